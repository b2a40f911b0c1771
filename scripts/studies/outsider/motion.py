"""How a rate table moves: a programme of rates, ramps between them, and a servo that follows with lag and ripple.

    programme -> demanded rate (jumps) -> ramped rate (limit of acceleration) -> servo of second order -> rate, angle

All on a grid far finer than the rows of any log.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter

Floats = NDArray[np.float64]

PROGRAMMES = ("staircase", "sine", "constant", "swing", "ramp", "reversals", "hand", "two_rates", "sweep")


@dataclass(frozen=True)
class Table:
    """A table and what it is told; rates in rad/s, accelerations in rad/s^2."""

    programme: str
    top: float
    cycles: int
    levels: int
    order: str
    acceleration: float
    bandwidth: float
    damping: float
    cogging: float
    teeth: int
    start: float
    rest: float


@dataclass(frozen=True)
class Motion:
    """Motion on the fine grid: shapes (n,)."""

    t: Floats
    demanded: Floats
    ramped: Floats
    rate: Floats
    angle: Floats
    ramped_angle: Floats

    @property
    def step(self) -> float:
        """Step of the grid [s]."""
        return float(self.t[1] - self.t[0])


def moved(table: Table, duration: float, step: float, rng: np.random.Generator) -> Motion:
    """The motion of a table over a time."""
    n = round(duration / step) + 1
    t: Floats = np.arange(float(n)) * step
    demanded = _demanded(table, t, rng)
    ramped = (
        demanded
        if table.programme in ("sine", "hand", "sweep", "ramp")
        else _ramped(demanded, table.acceleration * step)
    )
    followed = ramped if table.programme == "hand" else _servo(ramped, table, step)
    rate = followed
    if table.cogging and table.programme != "hand":
        place = table.start + _integral(followed, step)
        slow = 0.02 * table.top
        rate = followed + table.cogging * np.cos(table.teeth * place) * np.tanh(np.abs(followed) / slow)
    return Motion(t, demanded, ramped, rate, table.start + _integral(rate, step), table.start + _integral(ramped, step))


def _integral(rate: Floats, step: float) -> Floats:
    out = np.zeros_like(rate)
    np.cumsum(0.5 * step * (rate[1:] + rate[:-1]), out=out[1:])
    return out


def _servo(rate: Floats, table: Table, step: float) -> Floats:
    """Closed loop of second order, by the bilinear transform."""
    w = 2 * np.pi * min(table.bandwidth, 0.1 / step)
    k = 2 / step
    b = w * w * np.array([1.0, 2.0, 1.0])
    a = np.array(
        [k * k + 2 * table.damping * w * k + w * w, 2 * (w * w - k * k), k * k - 2 * table.damping * w * k + w * w]
    )
    return np.asarray(lfilter(b / a[0], a / a[0], rate - rate[0])) + rate[0]


def _ramped(demanded: Floats, most: float) -> Floats:
    """What follows jumps at a limited slope, stretch by stretch."""
    out = demanded.copy()
    jumps = np.flatnonzero(np.abs(np.diff(demanded)) > most) + 1
    value = demanded[0]
    for start, stop in zip(jumps, [*jumps[1:], len(demanded)], strict=False):
        value = out[start - 1]
        there = demanded[start:stop]
        steps = np.arange(1, stop - start + 1)
        gone = value + np.sign(there[0] - value) * most * steps
        late = np.abs(there[0] - value) > most * steps
        out[start:stop] = np.where(late, gone, there)
    return out


def _demanded(table: Table, t: Floats, rng: np.random.Generator) -> Floats:
    length = t[-1] - 2 * table.rest
    local = np.clip(t - table.rest, 0, length)
    inside = (t >= table.rest) & (t <= table.rest + length)
    phase = np.mod(local * table.cycles / length, 1.0)
    top = table.top
    match table.programme:
        case "staircase":
            rate = _stairs(table)[np.minimum((phase * len(_stairs(table))).astype(int), len(_stairs(table)) - 1)]
        case "constant":
            rate = np.full_like(t, top)
        case "two_rates":
            rate = np.where(phase < 0.5, top, 0.4 * top)
        case "reversals":
            rate = np.where(phase < 0.5, top, -top)
        case "ramp":
            rate = top * (1 - 4 * np.abs(np.mod(phase + 0.25, 1.0) - 0.5))
        case "swing":
            period = max(length / table.cycles / table.levels, 1.2 * 4 * top / table.acceleration)
            rate = np.where(np.mod(local, period) < 0.5 * period, top, -top)
            rate = np.where(local < 0.25 * period, 0.5 * rate, rate)
        case "sine":
            f = table.levels * table.cycles / length * max(1.0, length / 40)
            rate = top * np.sin(2 * np.pi * f * local) * np.clip(local / (0.05 * length), 0, 1)
        case "sweep":
            rate = top * np.sin(2 * np.pi * local * (0.05 + 0.5 * (0.2 + 0.8 * np.mod(phase, 1.0))))
        case _:
            rate = _by_hand(table, t, rng)
    return np.where(inside, rate, 0.0)


def _stairs(table: Table) -> Floats:
    up = table.top * np.arange(1, table.levels + 1) / table.levels
    if table.order == "alternating":
        return np.column_stack([up, -up]).ravel()
    if table.order == "with rests":
        return np.concatenate([[0.0], *[[x, 0.0, -x, 0.0] for x in up]])
    return np.concatenate([[0.0], up, up[-2::-1], [0.0], -up, -up[-2::-1]])


def _by_hand(table: Table, t: Floats, rng: np.random.Generator) -> Floats:
    step = t[1] - t[0]
    b, a = butter(2, min(1.2 * 2 * step, 0.9))
    wild = np.asarray(lfilter(b, a, rng.standard_normal(len(t))))
    wild /= np.std(wild) or 1.0
    b, a = butter(1, min(0.1 * 2 * step, 0.9))
    slow = np.asarray(lfilter(b, a, rng.standard_normal(len(t))))
    pauses = np.clip(1.5 + 2 * slow / (np.std(slow) or 1.0), 0, 1)
    return np.clip(0.4 * table.top * wild, -table.top, table.top) * pauses
