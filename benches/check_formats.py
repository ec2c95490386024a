#!/usr/bin/env python3
"""Read the camera files of tests/golden/formats with other programs and compare their projections.

pip install opencv-python-headless pyyaml pycolmap; run from the repository's root."""

import ast
import pathlib
import shutil
import tempfile

import cv2
import numpy as np
import pycolmap
import yaml

GOLDEN = pathlib.Path("tests/golden/formats")
K = np.array([[1000.2, 0, 399.4], [0, 999.9, 299.6], [0, 0, 1]])
D = np.array([-0.28, 0.10, 0.001, 0.002, 0.0])
POINTS = np.array([[x, y, 1.0] for x in np.linspace(-0.4, 0.4, 9) for y in np.linspace(-0.3, 0.3, 7)])


def opencv(k, d):
    return cv2.projectPoints(POINTS, np.zeros(3), np.zeros(3), np.asarray(k, float).reshape(3, 3), np.asarray(d, float))[0][:, 0]


def matrix(fx, fy, cx, cy):
    return [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]


def report(name, px, origin=0.0):
    worst = np.abs(px - origin - opencv(K, D)).max()
    print(f"{name:20} largest difference {worst:.1e} px")
    assert worst < 1e-9, name


storage = cv2.FileStorage(str(GOLDEN / "opencv.yaml"), cv2.FILE_STORAGE_READ)
assert storage.getNode("image_width").real() == 800
report("opencv.yaml", opencv(storage.getNode("camera_matrix").mat(), storage.getNode("distortion_coefficients").mat()))

ros = yaml.safe_load((GOLDEN / "ros.yaml").read_text())
assert all(isinstance(v, float) for v in ros["camera_matrix"]["data"] + ros["projection_matrix"]["data"])
report("ros.yaml", opencv(ros["camera_matrix"]["data"], ros["distortion_coefficients"]["data"]))

cam = yaml.safe_load((GOLDEN / "kalibr.yaml").read_text())["cam0"]
assert all(isinstance(v, float) for v in cam["intrinsics"] + cam["distortion_coeffs"]) and len(cam["distortion_coeffs"]) == 4
report("kalibr.yaml", opencv(matrix(*cam["intrinsics"]), cam["distortion_coeffs"]))

with tempfile.TemporaryDirectory() as folder:
    shutil.copy(GOLDEN / "cameras.txt", folder)
    for empty in ["images.txt", "points3D.txt", "rigs.txt", "frames.txt"]:
        (pathlib.Path(folder) / empty).touch()
    (camera,) = pycolmap.Reconstruction(folder).cameras.values()
report("cameras.txt", camera.img_from_cam(POINTS), origin=0.5)

model = ast.literal_eval((GOLDEN / "mrcal.cameramodel").read_text())
assert model["lensmodel"] == "LENSMODEL_OPENCV5"
report("mrcal.cameramodel", opencv(matrix(*model["intrinsics"][:4]), model["intrinsics"][4:]))

print("OpenCV", cv2.__version__, "PyYAML", yaml.__version__, "pycolmap", pycolmap.__version__)
