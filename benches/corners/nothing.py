"""Pictures without a board: none may be found."""
import json, math, subprocess
import cv2, numpy as np
from .scene import PROGRAM, SEED

CROPS, RENDERED = 1000, 150


def crops(photos, draw, n):
    """Random pieces of photographs at random scales, turns and exposures."""
    for _ in range(n):
        photo = photos[draw.integers(len(photos))]
        h, w = photo.shape
        side = draw.uniform(80, 700, 2)
        scale = draw.uniform(0.6, 2.0)
        x, y = draw.uniform(0, max(1, w - side[0])), draw.uniform(0, max(1, h - side[1]))
        piece = photo[int(y):int(y + side[1]), int(x):int(x + side[0])]
        piece = cv2.resize(piece, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC)
        piece = np.rot90(piece, draw.integers(4))
        yield np.ascontiguousarray(piece)


def windows(draw):
    """A front of windows: frames, panes of different brightness, a few lit."""
    cell = draw.uniform(18, 60, 2)
    bar, wall, pane = draw.uniform(0.05, 0.4), draw.uniform(60, 240), draw.uniform(5, 200)
    y, x = np.mgrid[0:600, 0:800].astype(float)
    i, j = (x // cell[0]).astype(int), (y // cell[1]).astype(int)
    light = np.clip(pane + draw.normal(0, 30, (64, 64)) + 150 * (draw.random((64, 64)) < 0.25), 0, 255)[i % 64, j % 64]
    u, v = x % cell[0] / cell[0], y % cell[1] / cell[1]
    out = np.where((u > bar) & (v > bar), light, wall)
    cross = ((abs(u - (1 + bar) / 2) < 0.03) | (abs(v - (1 + bar) / 2) < 0.03)) & (draw.random() < 0.5)
    return np.where(cross & (u > bar) & (v > bar), wall, out)


def tiles(draw):
    """Tiles in random shades with joints between them, in rows or staggered."""
    cell = draw.uniform(12, 60, 2)
    joint, shades = draw.uniform(0.02, 0.15), draw.choice([2, 3, 6])
    y, x = np.mgrid[0:600, 0:800].astype(float)
    j = (y // cell[1]).astype(int)
    x = x + (draw.random() < 0.4) * 0.5 * cell[0] * (j % 2)
    i = (x // cell[0]).astype(int)
    light = draw.choice(np.linspace(30, 230, shades), (64, 64))[i % 64, j % 64]
    inside = (x % cell[0] > joint * cell[0]) & (y % cell[1] > joint * cell[1])
    return np.where(inside, light, draw.uniform(0, 255))


def keyboards(draw):
    """Keys with letters, rows shifted against each other."""
    pitch, dark = draw.uniform(24, 60), draw.random() < 0.5
    out = np.full((600, 800), 20 if dark else 120, np.uint8)
    for row in range(int(600 / pitch) + 1):
        shift = draw.uniform(0, pitch)
        for column in range(-1, int(800 / pitch) + 1):
            x, y = column * pitch + shift, row * pitch
            gap = 0.1 * pitch
            cv2.rectangle(out, (int(x + gap), int(y + gap)), (int(x + pitch - gap), int(y + pitch - gap)), 60 if dark else 235, -1)
            letter = chr(draw.integers(65, 91))
            cv2.putText(out, letter, (int(x + 0.25 * pitch), int(y + 0.6 * pitch)), cv2.FONT_HERSHEY_SIMPLEX, pitch / 60, 220 if dark else 30, 1, cv2.LINE_AA)
    return out


def seen(picture, draw):
    """A flat thing as a camera sees it: perspective, blur, noise."""
    h, w = picture.shape
    corners = np.float32([[0, 0], [w, 0], [w, h], [0, h]])
    moved = corners + draw.uniform(-0.15, 0.15, (4, 2)).astype(np.float32) * [w, h]
    out = cv2.warpPerspective(picture.astype(np.float32), cv2.getPerspectiveTransform(corners, moved.astype(np.float32)), (w, h),
                              flags=cv2.INTER_AREA, borderValue=float(draw.uniform(0, 255)))
    out = cv2.GaussianBlur(out, (0, 0), draw.uniform(0.4, 2.0))
    return np.clip(out + draw.normal(0, draw.uniform(0, 8), out.shape) + 0.5, 0, 255).astype(np.uint8)


def found(files):
    """Names of the pictures in which the program, each alone, finds a board."""
    names = []
    for file in files:
        done = subprocess.run([PROGRAM, "detect", file, "--json"], capture_output=True, text=True)
        if any(f["found"] for f in json.loads(done.stdout)["frames"]):
            names.append(file.name)
    return names


def section(workplace, data):
    draw = np.random.default_rng(SEED)
    sets = {}
    files = sorted(p for p in (data / "negatives").iterdir()) if (data / "negatives").is_dir() else []
    photos = [p for p in (cv2.imread(str(f), cv2.IMREAD_GRAYSCALE) for f in files) if p is not None]
    if photos:
        sets["photographs"] = photos
        sets["random pieces of them"] = crops(photos, draw, CROPS)
    for name, make in (("windows", windows), ("tiles", tiles), ("keyboards", keyboards)):
        sets[f"{name}, rendered"] = (seen(make(draw), draw) for _ in range(RENDERED))
    out = ["## Pictures without a board", "", "Each picture alone, without `--board`; boards of any kind count.", "",
           "| pictures | number | boards invented |", "|---|---|---|"]
    for name, pictures in sets.items():
        folder = workplace(name)
        paths = []
        for i, picture in enumerate(pictures):
            paths.append(folder / f"{i:04}.png")
            cv2.imwrite(str(paths[-1]), picture)
        wrong = found(paths)
        line = f"| {name} | {len(paths)} | {len(wrong)} |"
        print(line, *wrong[:20], flush=True)
        out.append(line)
    return "\n".join(out) + "\n"
