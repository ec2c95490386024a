#!/usr/bin/env python3
"""Writes tests/golden/calibration_*.json: OpenCV's answers for OpenCV's own corners.

    python3 -m venv venv && venv/bin/pip install opencv-python-headless
    venv/bin/python benches/golden_calibration.py ../shared/reference tests/golden

The corners are those of findChessboardCorners + cornerSubPix in the reference files, rounded to float32 as OpenCV does inside,
and written with all digits, so that both programs see the same numbers. The criteria are tightened until OpenCV stands still.
"""
import json, pathlib, sys
import cv2, numpy as np

SETS = ["opencv_left", "opencv_right", "udacity_lane", "learning_opencv_phone"]
VARIANTS = {  # --fix of straightedge: flags of OpenCV
    "": 0,
    "k3": cv2.CALIB_FIX_K3,
    "p1,p2": cv2.CALIB_ZERO_TANGENT_DIST,
    "cx,cy": cv2.CALIB_FIX_PRINCIPAL_POINT,
    "fx=fy,cx,cy,k3": cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_FIX_PRINCIPAL_POINT | cv2.CALIB_FIX_K3,
}


def main(reference, out):
    for name in SETS:
        data = json.load(open(reference / f"{name}.json"))
        cols, rows, square = data["pattern"]["cols"], data["pattern"]["rows"], data["square"]
        sizes, corners = [], {}
        for file, image in data["images"].items():
            found = image["findChessboardCorners"]
            if found["found"]:
                corners.setdefault(tuple(image["size"]), {})[file] = np.float32(found["corners"])
        size, views = max(corners.items(), key=lambda item: len(item[1]))
        board = np.zeros((cols * rows, 3), np.float32)
        board[:, :2] = np.mgrid[0:cols, 0:rows].T.reshape(-1, 2) * square
        answers = []
        for fix, flags in VARIANTS.items():
            if fix and name != "opencv_left":
                continue
            k = np.array([[1.0, 0, (size[0] - 1) / 2], [0, 1, (size[1] - 1) / 2], [0, 0, 1]])
            d = np.zeros(5)
            for _ in range(4):  # restarted from its own answer: the damping starts anew
                rms, k, d, r, t, s, _, per_view = cv2.calibrateCameraExtended(
                    [board] * len(views), [v.reshape(-1, 1, 2) for v in views.values()], size, k, d,
                    flags=flags if _ == 0 else flags | cv2.CALIB_USE_INTRINSIC_GUESS,
                    criteria=(cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 1000, 1e-15))
            sigma = s.ravel()[:9].tolist()
            params = [k[0, 0], k[1, 1], k[0, 2], k[1, 2], *d.ravel()[:5]]
            answers.append({"fix": fix, "rms_px": rms, "params": params, "sigma": sigma,
                            "view_rms_px": per_view.ravel().tolist()})
            print(name, fix, rms, params[:2])
        golden = {"opencv": cv2.__version__, "command": "benches/golden_calibration.py", "size_px": size,
                  "board": f"{cols}x{rows}", "square": square, "answers": answers,
                  "views": [{"file": f, "corners": [[float(repr_(x)) for x in p] for p in v]} for f, v in views.items()]}
        path = out / f"calibration_{name}.json"
        path.write_text(json.dumps(golden, separators=(",", ":")).replace('{"file"', '\n{"file"').replace('{"fix"', '\n{"fix"') + "\n")


def repr_(x):
    """Shortest text that float32 reads back; as float64 it is then rounded to float32 by the reader."""
    return np.format_float_positional(x, unique=True)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
