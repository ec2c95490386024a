#!/usr/bin/env python3
"""Writes tests/golden/peers.json: OpenCV's calibration of the photographs with the corners of each of its detectors.

    python3 -m venv venv && venv/bin/pip install opencv-python-headless
    venv/bin/python benches/golden_peers.py ../shared/data tests/golden

For each set the largest group of one size is taken, and of it the pictures in which both detectors find the whole board, so that
all answers are about the same corners. Detectors: findChessboardCorners + cornerSubPix with half-windows 5 and 11, and
findChessboardCornersSB, plain and with CALIB_CB_ACCURACY; five distortion terms.
"""
import json, pathlib, sys
import cv2, numpy as np

SETS = {"opencv_left": (9, 6), "opencv_right": (9, 6), "udacity_lane": (9, 6), "learning_opencv_phone": (12, 12)}
CRITERIA = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 100, 1e-4)


def detect(gray, size):
    found = {}
    ok, corners = cv2.findChessboardCorners(gray, size)
    if ok:
        for half in (5, 11):
            found[f"subpix {half}"] = cv2.cornerSubPix(gray, corners.copy(), (half, half), (-1, -1), CRITERIA)
    for name, flags in (("SB", 0), ("SB ACCURACY", cv2.CALIB_CB_ACCURACY)):
        ok, corners = cv2.findChessboardCornersSB(gray, size, flags=flags)
        if ok:
            found[name] = corners
    return found


def main(data, out):
    sets = {}
    for name, size in SETS.items():
        by_shape = {}
        for path in sorted((data / name).iterdir()):
            gray = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
            if gray is not None:
                by_shape.setdefault(gray.shape, {})[path.name] = detect(gray, size)
        shape, pictures = max(by_shape.items(), key=lambda item: len(item[1]))
        common = {f: found for f, found in pictures.items() if len(found) == 4}
        board = np.zeros((size[0] * size[1], 3), np.float32)
        board[:, :2] = np.mgrid[0:size[0], 0:size[1]].T.reshape(-1, 2)
        answers = {}
        for detector in next(iter(common.values())):
            corners = [common[f][detector].reshape(-1, 1, 2) for f in common]
            rms, k, d, *_ = cv2.calibrateCamera([board] * len(corners), corners, shape[::-1], None, None,
                                                criteria=(cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 500, 1e-12))
            answers[detector] = {"rms_px": rms, "params": [k[0, 0], k[1, 1], k[0, 2], k[1, 2], *d.ravel()[:5]]}
            print(name, len(common), detector, round(rms, 4), round(k[0, 0], 2))
        sets[name] = {"board": f"{size[0]}x{size[1]}", "size_px": shape[::-1], "files": list(common), "answers": answers}
    golden = {"opencv": cv2.__version__, "command": "benches/golden_peers.py", "sets": sets}
    (out / "peers.json").write_text(json.dumps(golden, indent=1) + "\n")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
