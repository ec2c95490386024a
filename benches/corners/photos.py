"""Photographs: how well the corners of each detector obey one camera, on the same corners."""
import math, pathlib
import cv2, numpy as np
from .peers import VARIANTS, corners as peers
from .scene import detect

SETS = {"opencv_left": (9, 6), "opencv_right": (9, 6), "udacity_lane": (9, 6), "learning_opencv_phone": (12, 12)}
CRITERIA = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 500, 1e-12)


def pairs(folder, size):
    """The largest group of one size: variant -> file -> (board, theirs, ours) of the corners that both found."""
    groups = {}
    for path in sorted(folder.iterdir()):
        gray = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION)
        if gray is not None:
            groups.setdefault(gray.shape, {})[path] = gray
    shape, pictures = max(groups.items(), key=lambda item: len(item[1]))
    own = detect(list(pictures), f"{size[0]}x{size[1]}")
    board = np.zeros((size[0] * size[1], 3), np.float32)
    board[:, :2] = np.mgrid[0:size[0], 0:size[1]].T.reshape(-1, 2)
    result = {v: {} for v in VARIANTS}
    for path, gray in pictures.items():
        ours = np.array([c[1:3] for c in own[path.name]])
        for variant, theirs in (peers(gray, size) if len(ours) else {}).items():
            theirs = np.array([theirs[i] for i in range(len(board))])
            distance = np.linalg.norm(theirs[:, None] - ours[None], axis=2)
            nearest = distance.argmin(1)
            both = distance.min(1) < 3
            if both.sum() >= 12:
                result[variant][path.name] = (board[both], theirs[both].astype(np.float32), ours[nearest[both]].astype(np.float32))
    return shape[::-1], result


def calibrated(views, shape, which):
    return cv2.calibrateCamera([v[0] for v in views], [v[which].reshape(-1, 1, 2) for v in views], shape, None, None, criteria=CRITERIA)


def held_out(views, shape, which):
    """RMS in pictures that were left out of the fit, each once; their poses are fitted to them."""
    total, n = 0.0, 0
    for i, (board, *corners) in enumerate(views):
        _, k, d, *_ = calibrated(views[:i] + views[i + 1:], shape, which)
        px = corners[which - 1]
        _, r, t = cv2.solvePnP(board, px.reshape(-1, 1, 2), k, d)
        r, t = cv2.solvePnPRefineLM(board, px.reshape(-1, 1, 2), k, d, r, t)
        off = cv2.projectPoints(board, r, t, k, d)[0].reshape(-1, 2) - px
        total, n = total + float((off**2).sum()), n + len(off)
    return math.sqrt(total / n)


def section(data):
    out = [
        "## Photographs", "",
        "No truth is known, so: one camera with five distortion terms, by `cv2.calibrateCamera` from the corners that OpenCV's variant and Straightedge",
        "both found, once with the places of either. RMS px of the reprojection; *held out*: in each picture by the camera of all others, only its",
        "pose fitted to it. The largest group of one size of each set; *best* marks the variant with the smallest RMS on at least as many corners as any",
        "but a tenth.", "",
        "| set | variant | pictures | corners | its RMS | Straightedge | ratio | held out: its | Straightedge | ratio |", "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, size in SETS.items():
        if not (data / name).is_dir():
            continue
        shape, result = pairs(data / name, size)
        rows = []
        for variant, found in result.items():
            views = list(found.values())
            if len(views) < 5:
                continue
            theirs, ours = (calibrated(views, shape, k)[0] for k in (1, 2))
            out_theirs, out_ours = (held_out(views, shape, k) for k in (1, 2))
            rows.append((variant, len(views), sum(len(v[0]) for v in views), theirs, ours, out_theirs, out_ours))
        most = max(r[2] for r in rows)
        best = min((r for r in rows if r[2] >= 0.9 * most), key=lambda r: r[3])
        for r in rows:
            variant, views, corners, theirs, ours, out_theirs, out_ours = r
            mark = " (best)" if r is best else ""
            line = (f"| {name} | {variant}{mark} | {views} | {corners} | {theirs:.4f} | {ours:.4f} | {ours / theirs:.3f} | "
                    f"{out_theirs:.4f} | {out_ours:.4f} | {out_ours / out_theirs:.3f} |")
            print(line, flush=True)
            out.append(line)
    return "\n".join(out) + "\n"
