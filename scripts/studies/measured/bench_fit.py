"""A gyro against a table's encoder or command, by least squares with NumPy alone: nothing of insenv is used.

    gyro(t) = b + k u(t - d) + noise

with b, k of each run together and one delay d a run. The rate u is noisy where it comes from an encoder, so that k is
given between two bounds: plain regression, which noise in u pulls to zero, and the reverse one, which it pushes away.
Delay by the least squares over shifts of u, its parabola at the smallest; standard deviations by blocks that are left
out in turn (a jackknife), because what is left is correlated. Repeated values say the hold, equal extremes a rail.

Second, with the hold and the lag apart, on the longest stretch without a gap:

    gyro(t) = b + k (u + tau du/dt)(last row at which the output changed its value)

tau: the encoder's rate is late by it (a first-order lag). u and its slope come from a local cubic.

    python bench_fit.py FILE.csv ... [--gyro-unit 1] [--rate-unit 0.10472]
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Blocks of the jackknife: longer than a period of the table's motion, many enough for a standard deviation.
BLOCKS = 20
#: Shifts that are tried, in seconds; positive: the gyro follows the rate.
SHIFTS = np.arange(-0.12, 0.1201, 0.0025)
#: Equal extreme values in a row from which a rail is named: more than a hold gives.
RAIL = 15


@dataclass(frozen=True, slots=True)
class Bench:
    """What the samples of one file say; rates in rad/s, times in seconds."""

    rows: int
    duration: float
    step: float
    gap: float
    bias: float
    bias_sd: float
    gain: float
    gain_sd: float
    reverse: float
    delay: float
    delay_sd: float
    before: float
    after: float
    hold: float
    rail: float
    railed: int


def fit(time: Array, gyro: Array, rate: Array) -> Bench:
    """Bias, gain and delay of one file with their standard deviations, the hold of the output and its rail."""
    rail, railed = _rail(gyro)
    keep = np.abs(gyro) < rail if railed else np.ones(gyro.size, bool)
    delay = _delay(time, gyro, rate, keep)
    line = _line(time, gyro, rate, keep, delay)
    pieces = np.array_split(np.arange(gyro.size), BLOCKS)
    trials = np.array([_trial(time, gyro, rate, keep, piece) for piece in pieces])
    spread = np.sqrt((BLOCKS - 1) * trials.var(axis=0))
    plain = _line(time, gyro, rate, keep, 0.0)
    step = float(np.median(np.diff(time)))
    return Bench(
        gyro.size,
        float(time[-1] - time[0]),
        step,
        float(np.diff(time).max()),
        line[0],
        float(spread[0]),
        line[1],
        float(spread[1]),
        line[2],
        delay,
        float(spread[2]),
        plain[3],
        line[3],
        _hold(time, gyro),
        rail if railed else np.inf,
        railed,
    )


@dataclass(frozen=True, slots=True)
class Held:
    """Gain, lag of the encoder and rms by the second model; `rows` between new values, `phase` and its share."""

    gain: float
    lag: float
    before: float
    after: float
    rows: int
    phase: int
    share: float


def held(time: Array, gyro: Array, rate: Array, half: int = 5) -> Held | None:
    """Fit of the hold and of the lag apart; None where no stretch is long enough or nothing is held."""
    step = float(np.median(np.diff(time)))
    ends = np.concatenate([[0], np.flatnonzero(np.diff(time) > 1.5 * step) + 1, [time.size]])
    spans = [(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True) if np.ptp(gyro[a:b]) > 0.1 * np.ptp(gyro)]
    a, b = max(spans, key=lambda span: span[1] - span[0])
    if b - a < 200:
        return None
    y, u = gyro[a:b], rate[a:b]
    smooth, slope = _cubic(u, step, half)
    change = np.flatnonzero(np.diff(y) != 0.0) + 1
    gaps = np.diff(change)
    every = int(np.bincount(gaps[gaps < 9]).argmax()) if gaps.size > 9 else 1
    count = np.bincount(change % every, minlength=every)
    phase = int(count.argmax())
    index = np.arange(b - a)
    last = np.maximum((index - phase) // every * every + phase, 0)
    inner = (index > half + every) & (index < b - a - half - 1) & (np.abs(y) < np.abs(gyro).max())
    ones = np.ones(b - a)
    plain, left = _least(np.column_stack([ones, smooth])[inner], y[inner])
    found, least = _least(np.column_stack([ones, smooth[last], slope[last]])[inner], y[inner])
    del plain
    return Held(
        float(found[1]), float(found[2] / found[1]), left, least, every, phase, float(count.max() / count.sum())
    )


def _least(design: Array, y: Array) -> tuple[Array, float]:
    found = np.linalg.lstsq(design, y, rcond=None)[0]
    return np.asarray(found, dtype=np.float64), float(np.std(y - design @ found))


def _cubic(x: Array, step: float, half: int) -> tuple[Array, Array]:
    """Value and slope of a cubic through the rows about each row."""
    t = np.arange(-half, half + 1) * step
    weights = np.linalg.pinv(np.vander(t, 4, increasing=True))
    wide = np.pad(x, half, mode="edge")
    return np.convolve(wide, weights[0][::-1], "valid"), np.convolve(wide, weights[1][::-1], "valid")


def _trial(time: Array, gyro: Array, rate: Array, keep: NDArray[np.bool_], out: NDArray[np.int64]) -> Array:
    rest = keep.copy()
    rest[out] = False
    delay = _delay(time, gyro, rate, rest)
    line = _line(time, gyro, rate, rest, delay)
    return np.array([line[0], line[1], delay])


def _line(
    time: Array, gyro: Array, rate: Array, keep: NDArray[np.bool_], delay: float
) -> tuple[float, float, float, float]:
    u = np.interp(time - delay, time, rate)[keep]
    y = gyro[keep]
    design = np.column_stack([np.ones(u.size), u])
    found = np.linalg.lstsq(design, y, rcond=None)[0]
    slope = np.polyfit(y, u, 1)[0]
    left = y - design @ found
    return float(found[0]), float(found[1]), float(1.0 / slope), float(np.sqrt(np.mean(left**2)))


def _delay(time: Array, gyro: Array, rate: Array, keep: NDArray[np.bool_]) -> float:
    cost = np.array([_line(time, gyro, rate, keep, float(shift))[3] ** 2 for shift in SHIFTS])
    best = int(np.clip(cost.argmin(), 1, cost.size - 2))
    a, b, c = cost[best - 1 : best + 2]
    return float(SHIFTS[best] + (SHIFTS[1] - SHIFTS[0]) * 0.5 * (a - c) / max(a - 2 * b + c, 1e-30))


def _hold(time: Array, gyro: Array) -> float:
    """Median time between changes while the rate is changing: a sample where nothing is held."""
    moving = np.abs(gyro - np.median(gyro)) > 3.0 * np.median(np.abs(np.diff(np.unique(gyro)))) + 1e-12
    change = np.flatnonzero((np.diff(gyro) != 0.0) & moving[1:])
    return float(np.median(np.diff(time[change]))) if change.size > 9 else np.nan


def _rail(gyro: Array) -> tuple[float, int]:
    top = float(np.abs(gyro).max())
    count = int((np.abs(gyro) >= top).sum())
    runs = np.flatnonzero(np.diff(np.concatenate([[0], (np.abs(gyro) >= top).astype(int), [0]])))
    longest = int((runs[1::2] - runs[::2]).max())
    return top, count if longest >= RAIL else 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--gyro-unit", type=float, default=1.0, help="rad/s of one unit of the gyro's column")
    parser.add_argument("--rate-unit", type=float, default=np.pi / 30, help="rad/s of one unit of the rate's column")
    given = parser.parse_args()
    print(
        "file | rows s | step gap ms | bias mrad/s | gain (reverse) | delay ms | rms before -> after | hold ms | rail"
    )
    for path in given.files:
        time, gyro, rate = np.loadtxt(path, delimiter=",", skiprows=1)[:, :3].T
        order = np.argsort(time, kind="stable")
        b = fit(time[order], gyro[order] * given.gyro_unit, rate[order] * given.rate_unit)
        print(
            f"{path.stem} | {b.rows} {b.duration:.1f} | {1e3 * b.step:.0f} {1e3 * b.gap:.0f} | "
            f"{1e3 * b.bias:.2f} +- {1e3 * b.bias_sd:.2f} | {b.gain:.4f} +- {b.gain_sd:.4f} ({b.reverse:.4f}) | "
            f"{1e3 * b.delay:.1f} +- {1e3 * b.delay_sd:.1f} | {b.before:.4f} -> {b.after:.4f} | {1e3 * b.hold:.0f} | "
            f"{f'{b.rail:.2f} ({b.railed} rows)' if b.railed else '-'}"
        )
        h = held(time[order], gyro[order] * given.gyro_unit, rate[order] * given.rate_unit)
        if h is not None:
            print(
                f"    held {h.rows} rows ({100 * h.share:.0f} % of the changes at row {h.phase}), gain {h.gain:.4f},"
                f" encoder late by {1e3 * h.lag:.1f} ms: {h.before:.4f} -> {h.after:.4f}"
            )


if __name__ == "__main__":
    main()
