#!/usr/bin/env python3
"""CPU time beside OpenCV on the same inputs in the same run, one thread each; rewrites docs/speed.md.

    pip install opencv-python-headless numpy
    python3 benches/peers_speed.py [calibrate] [undistort] [detect] [job] [window]      without a word: all, and the page is written

Run it from the repository's root on a machine that does nothing else. Photographs come from the folder named by
STRAIGHTEDGE_DATA (default ../shared/data); what needs them is left out where it is absent. Each figure is the least of several
calls in milliseconds of process CPU time."""

import json
import os
import pathlib
import platform
import re
import resource
import subprocess
import sys
import tempfile
import time

import cv2
import numpy as np

VIEWS = [15, 50, 200, 1000, 5000]
SIZES = [(640, 480), (1152, 864), (4000, 3000)]
DATA = pathlib.Path(os.environ.get("STRAIGHTEDGE_DATA", "../shared/data"))
CRITERIA = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 30, 1e-3)


def least_ms(call):
    """At least two calls, and as many as fit into a third of a second."""
    begin, least, calls = time.process_time(), float("inf"), 0
    while calls < 2 or (calls < 200 and time.process_time() - begin < 0.33):
        start = time.process_time()
        call()
        least = min(least, time.process_time() - start)
        calls += 1
    return least * 1e3


def ours(stage, folder, *more, features=()):
    """Runs the Rust half and returns its figures."""
    command = ["cargo", "bench", "--locked", "--quiet", "--bench", "peers", *features, "--", stage, str(folder), *more]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def ms(value):
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def times(theirs, mine):
    ratio = theirs / mine
    return f"{ratio:.2f} ×" if ratio < 3 else f"{ratio:.1f} ×" if ratio < 30 else f"{ratio:.0f} ×"


def corners(file):
    """Boards and pictures of a problem, as OpenCV takes them."""
    problem = json.loads(pathlib.Path(file).read_text())
    board, picture = [], []
    for observation in problem["observations"]:
        index = np.array([c["index"] for c in observation["corners"]])
        board.append(np.float32(np.stack([index % 9, index // 9, 0 * index], 1) * problem["target"]["square"]))
        picture.append(np.float32([c["px"] for c in observation["corners"]]).reshape(-1, 1, 2))
    return board, picture


def peak_mb():
    status = pathlib.Path("/proc/self/status")
    lines = status.read_text().splitlines() if status.exists() else []
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM")), float("nan"))


def memory_of_opencv(file):
    """One calibration in a process of its own: what it needs beyond its input."""
    # Not from the JSON: reading that needs more than the calibration.
    known = np.load(file)
    board, picture = list(known["board"]), list(known["picture"])
    before = peak_mb()
    cv2.calibrateCamera(board, picture, (800, 600), None, None)
    print(json.dumps({"before": before, "peak": peak_mb()}))


def calibrate(folder):
    mine = ours("calibrate", folder)
    rows, memory = [], []
    peers = {}
    for views in VIEWS:
        board, picture = corners(folder / f"corners_{views}.json")
        plain = least_ms(lambda: cv2.calibrateCamera(board, picture, (800, 600), None, None))
        extended = None
        run = lambda: cv2.calibrateCameraExtended(board, picture, (800, 600), None, None)
        if views <= 200:
            extended = least_ms(run)
        elif views == 1000:
            # Minutes: once.
            start = time.process_time()
            run()
            extended = 1e3 * (time.process_time() - start)
        peers[views] = plain, extended
    # Compiled anew, so that it is last.
    narrow = ours("calibrate", folder, features=["--features", "narrow"])
    for views in VIEWS:
        (plain, extended), us, baseline = peers[views], mine[str(views)]["ms"], narrow[str(views)]["ms"]
        rows.append([str(views), ms(us), ms(baseline), ms(plain), times(plain, us), times(plain, baseline)]
                    + ([ms(extended), times(extended, us)] if extended else ["–", "–"]))
        if views >= 200:
            us = ours("memory", folder, str(views))
            board, picture = corners(folder / f"corners_{views}.json")
            arrays = folder / f"corners_{views}.npz"
            np.savez(arrays, board=np.stack(board), picture=np.stack(picture))
            command = [sys.executable, __file__, "memory", str(arrays)]
            them = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)
            memory.append([str(views)] + [f"{m['peak'] - m['before']:.0f}" for m in (us, them)])
    models = []
    for views in (50, 200):
        few, many = mine[f"brown5 {views}"], mine[f"tilted {views}"]
        models.append([str(views), ms(few["ms"]), ms(many["ms"]), f"{many['ms'] / few['ms']:.2f}",
                       f"{few['step']:.3g}", f"{many['step']:.3g}", f"{many['step'] / few['step']:.2f}"])
    return ("## Calibration\n\nFrom corners (54 a view, noise 0.1 px, random poses) to nine intrinsics; Straightedge always with several starts, "
            "Huber's loss, weights and σ. *Baseline*: without the registers of AVX2 (`--features narrow`); the answer is the same to the bit.\n\n"
            + table(["views", "Straightedge ms", "baseline ms", "calibrateCamera ms", "ratio", "ratio, baseline", "calibrateCameraExtended ms", "ratio"], rows)
            + "\nMemory beyond the corners themselves, MB at its peak:\n\n"
            + table(["views", "Straightedge", "calibrateCamera"], memory)
            + "\nModels with 5 and with 14 terms on the same corners; a step is one of the solver over all views.\n\n"
            + table(["views", "brown5 ms", "tilted ms", "×", "a step, brown5 ms", "a step, tilted ms", "×"], models)
            + f"\nA splined camera of 30 × 20 control points on 50 views: {mine['splined'] * 1e-3:.2f} s.\n")


def undistort(folder):
    mine = ours("undistort", folder)
    rows = []

    def add(size, channels, stage, key, theirs):
        us, mp = mine[f"{size[0]}x{size[1]} {channels} {key}"], size[0] * size[1] * 1e-6
        rows.append([f"{mp:.1f} MP", "grey" if channels == 1 else "RGB", stage, f"{us / mp:.2f}", f"{theirs / mp:.2f}", times(theirs, us)])

    for size in SIZES:
        fx, fy, cx, cy, *d = json.loads((folder / f"camera_{size[0]}x{size[1]}.json").read_text())["params"]
        k, d = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), np.array(d)
        gray = cv2.imread(str(folder / f"board_{size[0]}x{size[1]}_0.pgm"), cv2.IMREAD_GRAYSCALE)
        make = lambda: cv2.initUndistortRectifyMap(k, d, None, k, size, cv2.CV_32FC1)
        maps = make()
        for channels in (1, 3):
            photo = gray if channels == 1 else cv2.merge([gray] * 3)
            add(size, channels, "one-shot: undistort", "one-shot", least_ms(lambda: cv2.undistort(photo, k, d)))
            add(size, channels, "cached: remap, bilinear", "cached", least_ms(lambda: cv2.remap(photo, *maps, cv2.INTER_LINEAR)))
            add(size, channels, "cached: remap, Lanczos (6×6; OpenCV 8×8)", "lanczos",
                least_ms(lambda: cv2.remap(photo, *maps, cv2.INTER_LANCZOS4)))
        add(size, 1, "positions: initUndistortRectifyMap", "map", least_ms(make))
    view, keep = mine["1152x864 1 view"], mine["1152x864 1 keep"] / (1152 * 864e-6)
    return ("## Undistortion\n\nms per megapixel, 8 bits, same camera matrix before and after. One-shot computes positions with the picture; cached has kept "
            f"them as curves, which take {keep:.1f} ms per megapixel to make. Choosing the view for an α (once a camera) takes {ms(view)} ms.\n\n"
            + table(["picture", "", "stage", "Straightedge", "OpenCV", "ratio"], rows))


def with_subpix(picture, size):
    found, corners = cv2.findChessboardCorners(picture, size)
    if found:
        cv2.cornerSubPix(picture, corners, (5, 5), (-1, -1), CRITERIA)
    return found


def detect(folder):
    if (DATA / "negatives").is_dir():
        for file in sorted((DATA / "negatives").iterdir()):
            picture = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
            if picture is None:
                continue
            for w, h in SIZES:
                cv2.imwrite(str(folder / f"negative_{w}x{h}_{file.stem}.pgm"), cv2.resize(picture, (w, h), interpolation=cv2.INTER_CUBIC))
    else:
        print(f"no photographs in {DATA}: rendered pictures only")
    mine = ours("detect", folder)
    peers = [lambda p: with_subpix(p, (9, 6)),
             lambda p: cv2.findChessboardCornersSB(p, (9, 6))[0],
             lambda p: cv2.findChessboardCornersSB(p, (9, 6), flags=cv2.CALIB_CB_ACCURACY)[0]]
    rows = []
    for w, h in SIZES:
        for kind, what in [("board", "board, rendered"), ("clutter", "no board, rendered"), ("negative", "no board, photographs")]:
            files = sorted(folder.glob(f"{kind}_{w}x{h}_*.pgm"))
            if w > 2000:
                files = files[:2]
            if not files:
                continue
            us = float(np.mean([mine[f.stem]["ms"] for f in files]))
            full = sum(mine[f.stem]["corners"] >= 54 for f in files)
            row = [f"{w * h * 1e-6:.1f} MP", what, f"{ms(us)} ({full}/{len(files)})"]
            for peer in peers:
                pictures = [cv2.imread(str(f), cv2.IMREAD_GRAYSCALE) for f in files]
                found = sum(bool(peer(p)) for p in pictures)
                theirs = float(np.mean([least_ms(lambda: peer(p)) for p in pictures]))
                row += [f"{ms(theirs)} ({found}/{len(files)})", times(theirs, us)]
            rows.append(row)
            print(row)
    return ("## Detection\n\nms a picture, mean over the pictures; in brackets how many of them gave a board of 54 corners. OpenCV is told the size of the "
            "board, Straightedge finds it. At 12 MP two pictures a line.\n\n"
            + table(["picture", "", "Straightedge", "findChessboardCorners + cornerSubPix(5)", "ratio", "findChessboardCornersSB", "ratio",
                     "SB, ACCURACY", "ratio"], rows))


OPENCV_JOB = """
import pathlib, sys, time, cv2, numpy as np
cv2.setNumThreads(1)
start = time.process_time()
board = np.float32(np.mgrid[0:9, 0:6].T.reshape(-1, 2) * 25)
board = np.hstack([board, np.zeros((54, 1), np.float32)])
criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 30, 1e-3)
points, pictures = [], []
for file in sorted(pathlib.Path(sys.argv[1]).glob("*.jpg")):
    picture = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
    found, corners = cv2.findChessboardCorners(picture, (9, 6))
    if found:
        points.append(board)
        pictures.append(cv2.cornerSubPix(picture, corners, (5, 5), (-1, -1), criteria))
rms = cv2.calibrateCamera(points, pictures, picture.shape[::-1], None, None)[0]
print(time.process_time() - start, rms, len(points))
"""


def child_ms(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    out = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return out, 1e3 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


def job(_):
    photos = DATA / "opencv_left"
    if not photos.is_dir():
        print(f"no photographs in {photos}: the whole job is left out")
        return ""
    subprocess.run(["cargo", "build", "--locked", "--release", "--quiet"], check=True)
    command = ["target/release/straightedge", "calibrate", str(photos), "--board", "9x6", "--square", "25mm", "--json"]
    runs = [child_ms(command) for _ in range(5)]
    if runs[0][0].returncode != 0:
        print(f"the whole job is left out: {' '.join(command)} answered {runs[0][0].returncode}")
        return ""
    answer = json.loads(runs[0][0].stdout)
    us = min(t for _, t in runs)
    peers = [child_ms([sys.executable, "-c", OPENCV_JOB, str(photos)]) for _ in range(5)]
    seconds, rms, used = peers[0][0].stdout.split()
    work = min(1e3 * float(p.stdout.split()[0]) for p, _ in peers)
    used_by_us = sum(f["included"] for f in answer["frames"])
    return ("## Whole job\n\n`straightedge calibrate ../shared/data/opencv_left --board 9x6 --square 25mm --json`, and the same with OpenCV in Python "
            "(findChessboardCorners, cornerSubPix(5), calibrateCamera): CPU time of the process over all its threads.\n\n"
            + table(["", "ms", "pictures used", "RMS px"],
                    [["Straightedge", ms(us), str(used_by_us), f"{answer['rms_px']:.3f}"],
                     ["OpenCV, without starting Python and importing", ms(work), used, f"{float(rms):.3f}"],
                     ["OpenCV, whole process", ms(min(t for _, t in peers)), used, f"{float(rms):.3f}"]]))


def window(_):
    command = ["taskset", "-c", "0", "cargo", "bench", "--locked", "--quiet", "--bench", "window", "--", "toggle"]
    lines = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout.splitlines()
    numbers = [re.findall(r"[0-9.]*[0-9]", line) for line in lines if line.startswith("toggle")]
    return ("## Window\n\n`taskset -c 0 cargo bench --bench window -- toggle`: a picture of 54 corners is set aside or taken back, on one core. Wall time in ms "
            "from the click until the frame is drawn (without the graphics card) that shows the new camera with its σ map, and the one that shows the new "
            "influence of every picture; required are 50 ms with 50 pictures. In brackets CPU time of the process.\n\n"
            + table(["pictures", "camera and σ map", "influence"],
                    [[n, f"{map_ms} ({map_cpu})", f"{influence_ms} ({influence_cpu})"]
                     for n, map_ms, map_cpu, _, influence_ms, influence_cpu, _ in numbers]))


def machine():
    model = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), platform.machine())
    rust = subprocess.run(["rustc", "--version"], stdout=subprocess.PIPE, text=True).stdout.split()[1]
    return (f"{model}, {os.cpu_count()} cores, {platform.system()}; OpenCV {cv2.__version__} (wheel, dispatches to the CPU's SIMD), "
            f"NumPy {np.__version__}, Python {platform.python_version()}; Rust {rust}, x86-64 release build, with AVX2 where the processor has it")


def main():
    cv2.setNumThreads(1)
    if sys.argv[1:2] == ["memory"]:
        return memory_of_opencv(sys.argv[2])
    stages = {"calibrate": calibrate, "undistort": undistort, "detect": detect, "job": job, "window": window}
    chosen = sys.argv[1:] or list(stages)
    page = ("# Speed beside OpenCV\n\nMade by `python3 benches/peers_speed.py`; do not edit. One thread each, least CPU time of several calls, same inputs "
            "in the same run. *Ratio* = OpenCV's time / Straightedge's: above 1 Straightedge is faster.\n\n" + f"{machine()}.\n")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        ours("prepare", folder)
        for stage in chosen:
            text = stages[stage](folder)
            print(text)
            page += "\n" + text if text else ""
    if not sys.argv[1:]:
        pathlib.Path("docs/speed.md").write_text(page)


main()
