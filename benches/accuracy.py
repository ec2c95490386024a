#!/usr/bin/env python3
"""Corner error, detection and σ over degradations, beside OpenCV on the same pictures; writes docs/accuracy.md.

    python3 -m venv venv && venv/bin/pip install opencv-python-headless
    cargo build --release && venv/bin/python benches/accuracy.py [levels] [photographs] [hard] [nothing]

Without a word: all parts; a named part replaces its section of the page. Pictures and truth are `straightedge synth`'s, corners are
`straightedge detect`'s and cv2's. Errors are 2-D distances to the true places of all corners that were found, RMS and 95th
percentile, px. A corner is wrong if it is more than 1 px off its index's place. `SEED=2` takes other poses and noise and leaves the
page alone. Photographs come from the folder named by STRAIGHTEDGE_DATA (default ../shared/data).
"""
import math, os, pathlib, sys, tempfile
import cv2, numpy as np
from corners import bound, hard, nothing, peers, photos
from corners.scene import COLS, ROOT, ROWS, SEED, VIEWS, detect, render, scene

DATA = pathlib.Path(os.environ.get("STRAIGHTEDGE_DATA", ROOT.parent / "shared/data"))
LEVELS = [  # name, --degrade, kind of scene, and for the bound: blur, noise, half the contrast
    ("clean", "", "usual"), ("noise 2", "noise=2", "usual", 0, 2), ("noise 5", "noise=5", "usual", 0, 5), ("noise 10", "noise=10", "usual", 0, 10),
    ("blur 1", "blur=1", "usual"), ("blur 2", "blur=2", "usual"), ("motion 5", "motion=5", "usual"),
    ("uneven light", "light=0.6,vignette=0.4", "usual"), ("contrast 30 %", "contrast=0.3", "usual"),
    ("contrast 30 % + noise 5", "contrast=0.3,noise=5", "usual", 0, 5, 38.25), ("shot noise 8", "shot=8", "usual"),
    ("JPEG 40", "jpeg=40", "usual"), ("blur 1 + noise 5", "blur=1,noise=5", "usual", 1, 5),
    ("blur 2 + noise 5", "blur=2,noise=5", "usual", 2, 5), ("blur 1 + noise 10", "blur=1,noise=10", "usual", 1, 10),
    ("tilt 40–60°", "", "tilted"), ("tilt 40–60°, noise 5", "noise=5", "tilted", 0, 5),
    ("squares of 10 px", "", "small"), ("squares of 100 px", "", "large"), ("k1 = −0.4", "", "barrel"),
]
OWN = "straightedge"



def measure(level, folder):
    name, degrade, kind, *for_bound = level
    out = folder / "pictures"
    truth = render(scene(kind), degrade, out)
    table = {}

    def add(variant, distances, full):
        row = table.setdefault(variant, {"distances": [], "full": 0, "sigmas": []})
        row["distances"] += distances
        row["full"] += full

    for file, corners in detect([out / f for f in truth]).items():
        true = truth[file]
        if corners:
            add(OWN, [math.dist(true[i], (x, y)) for i, x, y, _ in corners], len(corners) == COLS * ROWS)
            table[OWN]["sigmas"] += [(p - t) / sigma for i, x, y, sigma in corners for p, t in zip((x, y), true[i])]
    for file, true in truth.items():
        gray = cv2.imread(str(out / file), cv2.IMREAD_GRAYSCALE)
        for variant, found in ({} if os.environ.get("OWN") else peers.corners(gray, (COLS, ROWS))).items():
            n = COLS * ROWS  # the order of its corners may be the other one
            both = [[math.dist(true[o], p) for i, p in found.items() if (o := order(i)) in true] for order in (lambda i: i, lambda i: n - 1 - i)]
            add(variant, min(both, key=sum), 1)
    rows = {}
    for variant, row in table.items():
        d = np.array(row["distances"])
        rows[variant] = {
            "full": row["full"], "rms": float(np.sqrt(np.mean(d**2))), "p95": float(np.percentile(d, 95)), "wrong": int((d > 1).sum()),
            "in_sigma": float(np.std(row["sigmas"])) if row["sigmas"] else None,
        }
    if for_bound and OWN in rows:
        rows[OWN]["bound"] = bound.rms(truth, *for_bound)
    print(f"{name}: " + ", ".join(f"{v} {r['rms']:.4f}" for v, r in rows.items()), f"error/σ {rows[OWN]['in_sigma']:.3f}",
          f"bound × {rows[OWN]['rms'] / rows[OWN]['bound']:.3f}" if "bound" in rows[OWN] else "", flush=True)
    return rows


def levels(workplace):
    results = {level[0]: measure(level, workplace(level[0])) for level in LEVELS}
    out = [
        "## Corner error", "",
        f"{VIEWS} poses × {COLS * ROWS} corners a level.",
        "Error: 2-D distance to the truth over all corners that were found, px. *Best OpenCV* is the variant with the smallest RMS at",
        f"that level among `findChessboardCorners` + `cornerSubPix` with half-windows {', '.join(map(str, peers.WINDOWS))}, `findChessboardCornersSB`, and",
        "the same with `CALIB_CB_ACCURACY`. *Found* counts whole boards. *Wrong*: corners more than 1 px off. *Error/σ*: standard",
        "deviation of the error over the predicted σ of its corner; 1 is honest. *Bound*: the Cramér–Rao bound, computed for each corner from its own",
        "pixels, directions and contrast with all unknowns of the fit (`benches/corners/bound.py`), RMS px; given where white noise makes the error.", "",
        "| level | RMS | p95 | found | wrong | error/σ | bound | RMS/bound | best OpenCV RMS | its p95 | its variant | found by it | ratio |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, rows in results.items():
        own = rows.get(OWN)
        others = {v: r for v, r in rows.items() if v != OWN}
        best = min(others, key=lambda v: others[v]["rms"]) if others else None
        o = others.get(best)
        left = f"{own['rms']:.4f} | {own['p95']:.4f} | {own['full']} of {VIEWS} | {own['wrong']} | {own['in_sigma']:.2f}" if own else "– | – | 0 | – | –"
        least = f"{own['bound']:.4f} | {own['rms'] / own['bound']:.2f}" if own and "bound" in own else " | "
        right = f"{o['rms']:.4f} | {o['p95']:.4f} | {best} | {o['full']} of {VIEWS}" if o else "– | – | none | 0"
        ratio = f"{own['rms'] / o['rms']:.2f}" if own and o else "–"
        out.append(f"| {name} | {left} | {least} | {right} | {ratio} |")
    out += ["", "All variants, RMS px (whole boards found):", ""]
    variants = [OWN, *peers.VARIANTS]
    out += ["| level | " + " | ".join(variants) + " |", "|---" * (len(variants) + 1) + "|"]
    for name, rows in results.items():
        cell = lambda v: f"{rows[v]['rms']:.4f} ({rows[v]['full']})" if v in rows else "– (0)"
        out.append(f"| {name} | " + " | ".join(map(cell, variants)) + " |")
    return "\n".join(out) + "\n"


def main():
    parts = {
        "levels": levels, "photographs": lambda _: photos.section(DATA), "hard": hard.section,
        "nothing": lambda workplace: nothing.section(workplace, DATA),
    }
    chosen = sys.argv[1:] or list(parts)
    page = ROOT / "docs/accuracy.md"
    old = page.read_text() if page.exists() else ""
    sections = {text.split("\n")[0]: text for text in ("## " + t for t in old.split("\n## ")[1:])}
    made = []
    with tempfile.TemporaryDirectory() as folder:
        def workplace(name):
            path = pathlib.Path(os.environ.get("KEEP", folder)) / name.replace(" ", "_").replace("/", "_")
            path.mkdir(parents=True, exist_ok=True)
            return path

        for part in parts:
            if part in chosen:
                text = parts[part](workplace)
                sections[text.split("\n")[0]] = text
    if SEED != 1 or os.environ.get("OWN"):  # the page is left as it is
        return
    order = ["## Corner error", "## Photographs", "## Hard pictures", "## Pictures without a board"]
    head = ("# Accuracy\n\nCorner error and detection beside OpenCV on the same pictures. Made by `python benches/accuracy.py`\n"
            f"(OpenCV {cv2.__version__}); pictures and exact truth by `straightedge synth`.\n")
    page.write_text("\n".join([head, *(sections[name].rstrip("\n") + "\n" for name in order if name in sections)]))


if __name__ == "__main__":
    main()
