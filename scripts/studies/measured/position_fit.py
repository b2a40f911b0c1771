"""A triad held still in many attitudes, with NumPy alone: nothing of insenv is used.

A rest is a stretch whose standard deviation stays near that of the quietest ones on every channel, and whose gyros
stay at their level. The accelerometers: |M (y - b)| = g on every rest, M upper triangular (three scale factors, three
non-orthogonalities), by Gauss-Newton; each smaller model beside it, with what it leaves on rests that were left out
in turn. The gyros: each turn between two rests takes gravity's direction from one to the other; w = K (y - c), K 3 x
3, with the bias c from the rests.

    python position_fit.py FILE --columns 0 1 2 [3 4 5] --rate 100 [--accel-unit 9.80665] [--gyro-unit 0.01745]
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: A stretch rests where its standard deviation is below so many times the quietest tenth's, on every axis.
QUIET = 3.0
#: A hand's tremor is seen by gyros long before accelerometers see it: so much more is allowed to them.
TREMOR = 5.0
#: Shortest rest, seconds.
SHORTEST = 0.8
#: Means of rests that differ by less than this angle are one attitude (degrees).
SAME = 4.0
MODELS = ("bias", "bias+scale", "bias+scale+nonorth")
PARAMETERS = {"bias": 3, "bias+scale": 6, "bias+scale+nonorth": 9}


def rests(signals: Array, rate: float, quiet: float = QUIET, window: float = 0.4) -> list[tuple[int, int]]:
    """First and one-past-last row of every rest; a gyro's steadiness is asked for in its level too."""
    n = max(int(window * rate), 4)
    width = signals.shape[1]
    total, square = (np.vstack([np.zeros(width), np.cumsum(x, axis=0)]) for x in (signals, signals**2))
    mean = (total[n:] - total[:-n]) / n
    spread = np.sqrt(np.maximum((square[n:] - square[:-n]) / n - mean**2, 0.0))
    steps = [np.diff(np.unique(np.round(x, 9))) for x in signals.T]
    quanta = np.array([x.min() / 2 if x.size else 1e-12 for x in steps])
    floor = np.maximum(np.quantile(spread, 0.1, axis=0), quanta)
    ratio = spread / floor
    ratio[:, 3:] /= TREMOR
    loud = ratio.max(axis=1)
    if width > 3:
        level = np.abs(mean[:, 3:] - np.median(mean[loud < quiet, 3:], axis=0)) / floor[3:] / TREMOR
        loud = np.maximum(loud, level.max(axis=1))
    still = np.zeros(signals.shape[0], bool)
    for start in np.flatnonzero(loud < quiet):
        still[start : start + n] = True
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    found = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    trim = n // 2
    return [(a + trim, b - trim) for a, b in found if b - a - 2 * trim >= SHORTEST * rate]


def attitudes(means: Array) -> int:
    """Number of attitudes that differ by more than `SAME`."""
    unit = means / np.linalg.norm(means, axis=1, keepdims=True)
    kept: list[Array] = []
    for row in unit:
        if all(float(row @ other) < np.cos(np.radians(SAME)) for other in kept):
            kept.append(row)
    return len(kept)


def _matrix(p: Array) -> Array:
    m = np.diag(1.0 + p[3:6]) if p.size > 3 else np.eye(3)
    if p.size > 6:
        m[0, 1], m[0, 2], m[1, 2] = p[6:9]
    return m


def _miss(means: Array, g: float, p: Array) -> Array:
    found: Array = np.linalg.norm((means - p[:3]) @ _matrix(p).T, axis=1) - g
    return found


def solve(means: Array, g: float, model: str) -> tuple[Array, Array, float]:
    """Parameters, their standard deviations and the rms that is left, in the unit of `means`."""
    p = np.zeros(PARAMETERS[model])
    p[:3] = 0.5 * (means.max(axis=0) + means.min(axis=0)) if means.shape[0] > 5 else 0.0
    for _ in range(60):
        miss = _miss(means, g, p)
        step = np.array([1e-6 * g] * 3 + [1e-6] * (p.size - 3))
        slope = np.column_stack([(_miss(means, g, p + e) - miss) / h for e, h in zip(np.diag(step), step, strict=True)])
        change = np.linalg.lstsq(slope, -miss, rcond=None)[0]
        p = p + change
        if np.abs(change / np.maximum(step, 1e-30)).max() < 1e-3:
            break
    miss = _miss(means, g, p)
    free = max(miss.size - p.size, 1)
    cov = np.linalg.pinv(slope.T @ slope) * (miss @ miss) / free
    return p, np.sqrt(np.abs(np.diag(cov))), float(np.sqrt(miss @ miss / miss.size))


def left_out(means: Array, g: float, model: str) -> float:
    """Rms of |f| - g on each rest by a fit of all the others."""
    if means.shape[0] < PARAMETERS[model] + 2:
        return np.nan
    misses = []
    for k in range(means.shape[0]):
        p, _, _ = solve(np.delete(means, k, axis=0), g, model)
        misses.append(float(_miss(means[k : k + 1], g, p)[0]))
    return float(np.sqrt(np.mean(np.square(misses))))


def _product(a: Array, b: Array) -> Array:
    scalar = a[:, :1] * b[:, :1] - np.sum(a[:, 1:] * b[:, 1:], axis=1, keepdims=True)
    vector = a[:, :1] * b[:, 1:] + b[:, :1] * a[:, 1:] + np.cross(a[:, 1:], b[:, 1:])
    return np.hstack([scalar, vector])


def turn(gyro: Array, dt: float) -> Array:
    """Rotation from the last row's frame to the first's: quaternion product of mid-point steps, in pairs."""
    step = 0.5 * (gyro[1:] + gyro[:-1]) * dt
    angle = np.linalg.norm(step, axis=1, keepdims=True)
    q = np.hstack([np.cos(angle / 2), 0.5 * np.sinc(angle / (2 * np.pi)) * step])
    while q.shape[0] > 1:
        tail = q[-1:] if q.shape[0] % 2 else q[:0]
        q = np.vstack([_product(q[0 : q.shape[0] // 2 * 2 : 2], q[1::2]), tail])
    w, x, y, z = q[0] / np.linalg.norm(q[0])
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def turns(gyro: Array, up: Array, spans: Sequence[tuple[int, int]], dt: float, gain: Array) -> Array:
    """Angle vectors by which each turn misses gravity's direction at its end, radians, flattened."""
    miss = []
    for k in range(len(spans) - 1):
        a, b = spans[k][1] - 1, spans[k + 1][0] + 1
        told = turn(gyro[a:b] @ gain.T, dt).T @ up[k]
        miss.append(np.cross(told, up[k + 1]))
    return np.concatenate(miss)


def gyro_gain(
    gyro: Array, up: Array, spans: Sequence[tuple[int, int]], dt: float, which: Array
) -> tuple[Array, Array, float, float]:
    """K with the entries `which` free, its standard deviations, rms miss before and after in degrees."""
    free = np.flatnonzero(which.ravel())
    gain = np.eye(3)
    before = turns(gyro, up, spans, dt, gain)
    for _ in range(4 if free.size else 0):
        miss = turns(gyro, up, spans, dt, gain)
        slope = np.empty((miss.size, free.size))
        for j, index in enumerate(free):
            moved = gain.copy().ravel()
            moved[index] += 1e-5
            slope[:, j] = (turns(gyro, up, spans, dt, moved.reshape(3, 3)) - miss) / 1e-5
        flat = gain.ravel()
        flat[free] += np.linalg.lstsq(slope, -miss, rcond=None)[0]
        gain = flat.reshape(3, 3)
    after = turns(gyro, up, spans, dt, gain)
    sd = np.zeros(9)
    if free.size:
        ends = max(2 * (len(spans) - 1) - free.size, 1)
        sd[free] = np.sqrt(np.diag(np.linalg.pinv(slope.T @ slope)) * (after @ after) / ends)

    def rms(x: Array) -> float:
        return float(np.degrees(np.sqrt(np.mean(np.sum(x.reshape(-1, 3) ** 2, axis=1)))))

    return gain, sd.reshape(3, 3), rms(before), rms(after)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=Path)
    parser.add_argument("--columns", type=int, nargs="+", default=[0, 1, 2], help="accelerometers, then gyros")
    parser.add_argument("--rate", type=float, default=100.0, help="Hz")
    parser.add_argument("--accel-unit", type=float, default=1.0, help="m/s^2 of one unit")
    parser.add_argument("--gyro-unit", type=float, default=1.0, help="rad/s of one unit")
    parser.add_argument("--gravity", type=float, default=9.80665)
    parser.add_argument("--skip", type=int, default=0)
    parser.add_argument("--quiet", type=float, default=QUIET, help="rests: so many times the quietest tenth")
    parser.add_argument("--delimiter", default=None)
    given = parser.parse_args()
    rows = np.genfromtxt(given.file, delimiter=given.delimiter, skip_header=given.skip, usecols=given.columns)
    rows = rows[np.isfinite(rows).all(axis=1)]
    report(rows[:, :3] * given.accel_unit, rows[:, 3:6] * given.gyro_unit, given.rate, given.gravity, given.quiet)


def report(accel: Array, gyro: Array, rate: float, gravity: float, quiet: float) -> None:
    """Print what the rests and the turns say."""
    spans = rests(np.hstack([accel, gyro]), rate, quiet)
    means = np.array([accel[a:b].mean(axis=0) for a, b in spans]).reshape(-1, 3)
    if len(spans) < 4:
        print(f"{len(spans)} rests: no fit")
        return
    print(f"{len(spans)} rests, {attitudes(means)} attitudes, {min(b - a for a, b in spans) / rate:.1f} s at least")
    best, least = np.zeros(3), np.inf
    for model in MODELS:
        if means.shape[0] < PARAMETERS[model] + 1:
            continue
        p, sd, left = solve(means, gravity, model)
        without = left_out(means, gravity, model)
        if without < least:
            best, least = p, without
        if not np.abs(p[3:]).max(initial=0.0) < 0.5:
            print(f"  accel {model}: these attitudes do not tell it")
            continue
        names = ["bx", "by", "bz", "sx", "sy", "sz", "xy", "xz", "yz"]
        values = "  ".join(f"{n} {1e3 * v:.2f}+-{1e3 * s:.2f}" for n, v, s in zip(names, p, sd, strict=False))
        print(f"  accel {model}: left {1e3 * left:.2f}, on rests left out {1e3 * without:.2f} mm/s^2; 1e-3: {values}")
    if gyro.shape[1] < 3:
        return
    up = (means - best[:3]) @ _matrix(best).T
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    bias = np.concatenate([gyro[a:b] for a, b in spans]).mean(axis=0)
    print("  gyro bias mrad/s:", np.round(1e3 * bias, 3))
    rows = [("bias", np.zeros((3, 3))), ("bias+scale", np.eye(3)), ("bias+3x3", np.ones((3, 3)))]
    for name, which in rows:
        gain, sd, before, after = gyro_gain(gyro - bias, up, spans, 1.0 / rate, which)
        print(f"  gyro {name}: rotations miss by {before:.3f} -> {after:.3f} deg")
        if which.any():
            print("   K - 1 (1e-3):", np.round(1e3 * (gain - np.eye(3)), 2).tolist())
            print("   sd         :", np.round(1e3 * sd, 2).tolist())


if __name__ == "__main__":
    main()
