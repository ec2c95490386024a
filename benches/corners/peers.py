"""The corners of OpenCV's detectors."""
import cv2

WINDOWS = [3, 5, 7, 9, 11]  # half-windows of cornerSubPix
VARIANTS = [f"subpix {w}" for w in WINDOWS] + ["SB", "SB ACCURACY"]


def corners(gray, size):
    """name -> index -> place, for each variant that finds the board."""
    result = {}
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 30, 0.001)
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH + cv2.CALIB_CB_NORMALIZE_IMAGE
    ok, found = cv2.findChessboardCorners(gray, size, flags=flags)
    for half in WINDOWS:
        if ok:
            refined = cv2.cornerSubPix(gray, found.copy(), (half, half), (-1, -1), criteria)
            result[f"subpix {half}"] = dict(enumerate(map(tuple, refined.reshape(-1, 2).tolist())))
    for name, flags in (("SB", 0), ("SB ACCURACY", cv2.CALIB_CB_ACCURACY)):
        ok, found = cv2.findChessboardCornersSB(gray, size, flags=flags)
        if ok:
            result[name] = dict(enumerate(map(tuple, found.reshape(-1, 2).tolist())))
    return result
