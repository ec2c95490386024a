#!/usr/bin/env python3
"""Writes tests/golden/corners.json: where OpenCV's two detectors find whole checkerboards.

    python3 benches/golden_corners.py ../shared/reference ../shared/data tests/golden

The reference files hold what OpenCV 5.0.0 answers to findChessboardCorners + cornerSubPix and to findChessboardCornersSB on each
picture of a set; pictures that are not in the data folder are left out. Where both find the board and differ by more than half a pixel at a corner, both places are kept: OpenCV is a
peer, not the truth.
"""
import json, math, pathlib, sys

DETECTORS = ["findChessboardCorners", "findChessboardCornersSB"]


def places(image):
    found = [[(x, y) for x, y in image[d]["corners"]] for d in DETECTORS if image[d]["found"]]
    if len(found) < 2:
        return [[round(x, 1), round(y, 1)] for x, y in (found[0] if found else [])]
    first, second = found
    rows = []
    for x, y in first:
        near = min(second, key=lambda q: math.dist(q, (x, y)))
        rows.append([round(v, 1) for v in ((x, y) if math.dist(near, (x, y)) <= 0.5 else (x, y, *near))])
    return rows


def main(reference, photographs, out):
    sets = {}
    for path in sorted(reference.glob("*.json")):
        data = json.loads(path.read_text())
        if data["pattern"]["type"] != "checkerboard":
            continue
        folder = photographs / path.stem
        images = {file: places(image) for file, image in data["images"].items() if (folder / file).is_file()}
        board = f"{data['pattern']['cols']}x{data['pattern']['rows']}"
        sets[path.stem] = {"board": board, "images": {f: c for f, c in images.items() if c}}
        print(path.stem, board, len(sets[path.stem]["images"]), "of", len(images))
    text = json.dumps({"opencv": "5.0.0", "command": "benches/golden_corners.py", "sets": sets}, separators=(",", ":"))
    for file in (f for s in sets.values() for f in s["images"]):
        text = text.replace(f'"{file}":', f'\n"{file}":')
    (out / "corners.json").write_text(text + "\n")


if __name__ == "__main__":
    main(*map(pathlib.Path, sys.argv[1:4]))
