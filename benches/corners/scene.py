"""Scenes, their pictures by `straightedge synth`, and what `straightedge detect` finds in pictures."""
import json, math, os, pathlib, random, subprocess, sys
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PROGRAM = os.environ.get("STRAIGHTEDGE", ROOT / "target/release/straightedge")
COLS, ROWS, VIEWS = 9, 6, 16
SEED = int(os.environ.get("SEED", "1"))  # other poses and other noise, to see that nothing is tuned to those of the tables


def scene(kind, seed=SEED, size=None, square_px=None):
    """A scene file: 800 x 600 px unless told, a board with a white margin, poses by the kind."""
    draw = random.Random(f"{kind} {seed}")
    k1 = -0.4 if kind == "barrel" else -0.28
    size = size or ([1600, 1200] if kind == "large" else [800, 600])
    f = 1.25 * size[0]
    middle = [(s - 1) / 2 for s in size]
    square = 30.0
    scale = square_px or {"small": 10.5, "large": 110.0}.get(kind, 48.0)  # px per square in front of the camera
    few = scale < 0.04 * size[0]  # a small board may be anywhere
    poses = []
    for _ in range(VIEWS):
        if kind == "tilted":
            tilt, azimuth = math.radians(draw.uniform(40, 60)), draw.uniform(0, 2 * math.pi)
            angles = [math.degrees(tilt) * math.cos(azimuth), math.degrees(tilt) * math.sin(azimuth), draw.uniform(-30, 30)]
        else:
            angles = [draw.uniform(-25, 25), draw.uniform(-25, 25), draw.uniform(-30, 30)]
        z = f * square / scale * draw.uniform(0.95, 1.1)
        a, b, c = (math.radians(v) for v in angles)
        rx = np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])
        ry = np.array([[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]])
        rz = np.array([[math.cos(c), -math.sin(c), 0], [math.sin(c), math.cos(c), 0], [0, 0, 1]])
        shift = 0.08 if kind == "large" else 0.3 if few else 0.14
        place = np.array([draw.uniform(-shift, shift) * size[0] / f * z, draw.uniform(-shift, shift) * size[1] / f * z, z])
        centre = np.array([(COLS - 1) / 2 * square, (ROWS - 1) / 2 * square, 0])
        translation = place - rz @ ry @ rx @ centre
        poses.append({"angles_deg": angles, "translation": translation.tolist()})
    return {
        "camera": {"model": "brown5", "size_px": size, "params": [f, f, *middle, k1, 0.1, 0.001, 0.002, 0.0]},
        "board": {"size": f"{COLS}x{ROWS}", "square": square, "unit": "mm", "margin": 0.6},
        "poses": poses,
    }


def run(*arguments):
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode not in (0, 1):
        sys.exit(f"{' '.join(map(str, arguments))}: {done.stderr}")
    return done.stdout


def render(what, degrade, folder, seed=SEED):
    """Renders a scene into `folder`; file name -> index -> true place."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder.parent / f"{folder.name}.scene.json"
    file.write_text(json.dumps(what))
    run("synth", "--scene", file, "--seed", seed, "--out", folder, *(["--degrade", degrade] if degrade else []))
    frames = json.load(open(folder / "truth.json"))["frames"]
    return {f["file"]: {int(i): (x, y) for i, x, y in f["corners"]} for f in frames}


def detect(files, board=f"{COLS}x{ROWS}"):
    """File name -> list of (index, x, y, sigma)."""
    frames = json.loads(run("detect", *files, "--board", board, "--json"))["frames"]
    return {pathlib.Path(f["file"]).name: [(int(c[0]), *c[1:4]) for c in f.get("corners") or []] for f in frames}
