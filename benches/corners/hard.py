"""Pictures that are hard to see a board in: is it found, whole, with the right indices?"""
import math, random
import cv2, numpy as np
from .scene import COLS, ROWS, SEED, VIEWS, detect, render, scene

BOARD = COLS * ROWS
LEVELS = [  # name, --degrade, size of the pictures, px a square
    ("noise 25", "noise=25", None, None), ("noise 40", "noise=40", None, None), ("contrast 10 %", "contrast=0.1", None, None),
    ("contrast 10 % + noise 3", "contrast=0.1,noise=3", None, None),
    ("blur 4", "blur=4", None, None), ("blur 4 + noise 5", "blur=4,noise=5", None, None),
    ("motion 12", "motion=12", None, None), ("motion 12 + noise 5", "motion=12,noise=5", None, None),
    ("dark edge", "light=0.95,noise=2", None, None), ("salt and pepper 2 %", "", None, None), ("occlusion 10 %", "occlusion=0.1,noise=2", None, None),
    ("occlusion 25 %", "occlusion=0.25,noise=2", None, None),
    ("squares of 8 px, 0.5 MP", "noise=2", [800, 600], 8.6), ("squares of 8 px, 1 MP", "noise=2", [1152, 864], 8.6),
    ("squares of 27 px, 12 MP", "noise=2", [4000, 3000], 28.0), ("clutter", "", None, None),
]


def salt_and_pepper(gray, share, draw):
    out = gray.copy()
    chance = draw.random(gray.shape)
    out[chance < share / 2] = 0
    out[(chance >= share / 2) & (chance < share)] = 255
    return out


def clutter(shape, draw):
    """Textures that are nearly checkerboards: patches of turned chequers, of tiles, of stripes, of dots, with noise between."""
    h, w = shape
    y, x = np.mgrid[0:h, 0:w].astype(float)
    out = np.full(shape, 128.0)
    for _ in range(60):
        angle, pitch, other = draw.uniform(0, math.pi), draw.uniform(6, 40), draw.uniform(0.6, 1.6)
        u, v = x * math.cos(angle) + y * math.sin(angle), y * math.cos(angle) - x * math.sin(angle)
        v = v + draw.uniform(-0.3, 0.3) * u  # slanted
        i, j = np.floor(u / pitch), np.floor(v / (pitch * other))
        cell = np.random.default_rng(draw.integers(1 << 30)).random((64, 64))[i.astype(int) % 64, j.astype(int) % 64]
        kind = draw.integers(5)
        if kind == 0:  # random squares: crossings everywhere, no board
            texture = (cell > 0.5).astype(float)
        elif kind == 1:  # tiles with joints
            texture = 0.3 + 0.7 * ((u % pitch > 0.12 * pitch) & (v % (pitch * other) > 0.12 * pitch)) * (0.7 + 0.3 * cell)
        elif kind == 2:
            texture = (u / pitch % 2 < 1).astype(float)
        elif kind == 3:
            texture = (np.hypot(u % pitch - pitch / 2, v % (pitch * other) - pitch * other / 2) < 0.3 * pitch).astype(float)
        else:  # a few squares of a chequer, too few for a board
            texture = np.where((i % 6 < 3) & (j % 6 < 3), (i + j) % 2, cell > 0.5)
        centre, size = draw.uniform(0, [w, h]), draw.uniform(30, 120, 2)
        inside = (abs(x - centre[0]) < size[0]) & (abs(y - centre[1]) < size[1])
        low, high = sorted(draw.uniform(0, 255, 2))
        out[inside] = (low + (high - low) * texture)[inside]
    return out


def spoil(name, folder, files, draw):
    """What `synth` does not do, on its pictures."""
    for k, file in enumerate(files):
        path = str(folder / file)
        gray = cv2.imread(path, cv2.IMREAD_GRAYSCALE)
        if name.startswith("salt"):
            gray = salt_and_pepper(gray, 0.02, draw)
        elif name == "clutter":
            cover = cv2.imread(str(folder.parent / "cover" / file), cv2.IMREAD_GRAYSCALE) / 255.0
            behind = clutter(gray.shape, draw)
            background = gray - 160.0 * (1 - cover)
            gray = np.clip(background + (1 - cover) * behind + draw.normal(0, 2, gray.shape) + 0.5, 0, 255).astype(np.uint8)
        else:
            return
        cv2.imwrite(path, gray)


def hidden(plain, covered, at):
    """0 where nothing near a corner changed, 1 where it is touched, 2 where it is covered."""
    x, y = (round(v) for v in at)
    changed = abs(plain.astype(int) - covered) > 12
    cut = lambda r: changed[max(0, y - r):y + r + 1, max(0, x - r):x + r + 1]
    return 2 if cut(2).any() else 1 if cut(30).any() else 0


def level(name, degrade, size, square, folder):
    what = scene("usual" if not square else f"hard {name}", size=size, square_px=square)
    out = folder / "pictures"
    truth = render(what, degrade, out)
    draw = np.random.default_rng(SEED)
    if name == "clutter":
        alike = {**what, "board": {**what["board"], "levels": {"black": 255, "white": 255, "background": 0}}}
        render(alike, "", folder / "cover")
    spoil(name, out, truth, draw)
    if name.startswith("occlusion"):
        render(what, "", folder / "plain")
        render(what, degrade.split(",")[0], folder / "covered")
    found = detect([out / f for f in truth])
    row = {"whole": 0, "used": 0, "wrong": 0, "missed": 0, "seen": 0, "errors": []}
    for file, true in truth.items():
        corners = found[file]
        row["used"] += bool(corners)
        distances = {i: math.dist(true[i], (x, y)) if i in true else math.inf for i, x, y, _ in corners}
        state = {i: 0 for i in true}
        if name.startswith("occlusion"):
            plain, covered = (cv2.imread(str(folder / f / file), cv2.IMREAD_GRAYSCALE) for f in ("plain", "covered"))
            state = {i: hidden(plain, covered, p) for i, p in true.items()}
        free = [i for i, s in state.items() if s == 0]
        row["whole"] += all(i in distances for i in free) and bool(corners)
        row["missed"] += sum(i not in distances for i in free)
        row["seen"] += len(free)
        row["wrong"] += sum(d > 1 for d in distances.values())
        row["errors"] += [d for d in distances.values() if d <= 1]
    return row


def section(workplace):
    out = [
        "## Hard pictures", "",
        f"{VIEWS} poses a level. *Whole*: pictures in which every corner of the board that is not hidden was found. *Missed*: such corners that were not.",
        "*Wrong*: corners more than 1 px from the place of their index. Salt and pepper, and clutter (chequers of random colours, tiles,",
        "stripes, dots, 3 × 3 pieces of board behind the board) are drawn over `synth`'s pictures; *occlusion*: a grey ellipse of this share of the board.", "",
        "| level | board found | whole | missed | wrong | RMS px |", "|---|---|---|---|---|---|",
    ]
    for name, degrade, size, square in LEVELS:
        row = level(name, degrade, size, square, workplace(name))
        rms = math.sqrt(np.mean(np.square(row["errors"]))) if row["errors"] else math.nan
        line = f"| {name} | {row['used']} of {VIEWS} | {row['whole']} of {VIEWS} | {row['missed']} of {row['seen']} | {row['wrong']} | {rms:.4f} |"
        print(line, flush=True)
        out.append(line)
    return "\n".join(out) + "\n"
