"""The Cramér–Rao bound of single corners: what no unbiased estimate from the same pixels can beat.

The picture around a corner is two edges blurred by a Gaussian and integrated over the pixel; unknown are the corner, the
directions and widths of both edges, mean and amplitude: nine numbers less one for each width that is known to be zero. The
pixels are those that the strip fit reads: along each edge three quarters of the way to the next corner (half of it at the rim), at
most 24 px, and across it 2.8 widths. The derivatives are numeric, on a grid of samples within each pixel. Noise is white with the
σ of the level, plus that of rounding; black and white at 0 and 255 cut it off in the picture, which only takes information away.
"""
import math
import numpy as np
from .scene import COLS, ROWS

TABLE = np.linspace(-6, 6, 24001)
ERF = np.array([math.erf(v) for v in TABLE])
SAMPLES = 4  # per side of a pixel
ARM, ARM_RIM, LONGEST = 0.75, 0.5, 24.0


def erf(x):
    return np.interp(x, TABLE, ERF)


def model(theta, points, blur):
    """Grey values at `points` (n × 2) for [x, y, angle 1, angle 2, ln s 1, ln s 2, mean, amplitude]."""
    x, y, a1, a2, s1, s2, mean, amplitude = theta
    inner = 1 / SAMPLES**2 / 12  # of a sample's own square
    width = [math.sqrt(blur**2 * math.exp(2 * s) + inner) for s in (s1, s2)]
    normal = [np.array([-math.sin(a), math.cos(a)]) for a in (a1, a2)]
    t = [(points - [x, y]) @ n / w for n, w in zip(normal, width)]
    value = erf(t[0] / math.sqrt(2)) * erf(t[1] / math.sqrt(2))
    # both edges share one blur: correlation of the cosine between the normals, to first order
    value += 2 / math.pi * (normal[0] @ normal[1]) * np.exp(-0.5 * (t[0] ** 2 + t[1] ** 2))
    return mean + amplitude * value


def window(at, steps, rooms, blur):
    """Whole pixels that the fit reads around `at`; `rooms[k]` is how far edge k may be used before and after the corner."""
    pixels = set()
    size = 40
    base = np.round(at).astype(int)
    grid = np.stack(np.meshgrid(np.arange(-size, size + 1), np.arange(-size, size + 1)), -1).reshape(-1, 2)
    for k in range(2):
        d = steps[k]
        u, v = (0, 1) if abs(d[1]) >= abs(d[0]) else (1, 0)
        slope = d[u] / d[v]
        cos = 1 / math.hypot(1, slope)
        sd = math.sqrt(blur**2 / cos**2 + (1 + slope**2) / 12)
        half = 4 * min(4, math.ceil((2.8 * sd + 0.6) / 4))
        before, after = rooms[k] if d[v] > 0 else rooms[k][::-1]
        rel = grid + base - at
        along, across = grid[:, v], rel[:, u] - slope * rel[:, v]
        keep = (along >= -math.floor(before * cos)) & (along <= math.floor(after * cos)) & (abs(across) <= half)
        pixels.update(map(tuple, grid[keep] + base))
    return np.array(sorted(pixels), float)


def of_corner(truth, index, blur, noise, amplitude=127.5):
    """Trace of the bound's covariance at a corner of a board, px²."""
    at = np.array(truth[index])
    column, row = index % COLS, index // COLS
    steps, rooms = [], []
    for k, (here, last, stride) in enumerate(((column, COLS - 1, 1), (row, ROWS - 1, COLS))):
        before = np.array(truth[index - stride]) if here > 0 else None
        after = np.array(truth[index + stride]) if here < last else None
        steps.append((after if after is not None else at) - (before if before is not None else at))
        distance = [None if p is None else np.linalg.norm(p - at) for p in (before, after)]
        reach = [ARM * d if d else ARM_RIM * (distance[1 - i]) for i, d in enumerate(distance)]
        margin = 1.0 + 0.8 + 3 * blur * 0.3
        rooms.append([min(r, (d or math.inf) - margin, LONGEST) for r, d in zip(reach, distance)])
    pixels = window(at, steps, rooms, blur)
    offset = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    inside = np.stack(np.meshgrid(offset, offset), -1).reshape(-1, 2)
    points = (pixels[:, None, :] + inside[None]).reshape(-1, 2)
    theta = np.array([*at, *(math.atan2(d[1], d[0]) for d in steps), 0, 0, 127.5, amplitude])
    free = [0, 1, 2, 3, 6, 7] + ([4, 5] if blur > 0 else [])
    columns = []
    for i in free:
        h = 1e-3
        up, down = theta.copy(), theta.copy()
        up[i] += h
        down[i] -= h
        change = (model(up, points, blur) - model(down, points, blur)) / (2 * h)
        columns.append(change.reshape(len(pixels), -1).mean(1))
    j = np.stack(columns, 1)
    covariance = np.linalg.inv(j.T @ j) * (noise**2 + 1 / 12)
    return covariance[0, 0] + covariance[1, 1]


def rms(frames, blur, noise, amplitude=127.5):
    """RMS of the 2-D error at the bound over all corners of all frames (file -> index -> place), px."""
    traces = [of_corner(truth, i, blur, noise, amplitude) for truth in frames.values() if len(truth) == COLS * ROWS for i in truth]
    return math.sqrt(np.mean(traces))
