"""A student's or a laboratory's rate table: a cheap gyro beside a real encoder, several files of one unit.

    y_k = round(g u(t') + b + e(u, t') + noise),    t' = the last renewal of the output before t_k
    w_k = round((L u)(t_k) + noise)                 L a delay, a first-order filter, or a mean of counts over a time

Drawn for each unit: gain and polarity, hold and its phase in each file, rounding, what was logged of the table and how
it is late, the encoder's noise, step and eccentricity, rows that show the value before. In half of the units the gyro
has one error more, e.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Floats = NDArray[np.float64]

#: Step of the grid on which the table moves [s], and time that is simulated before and after a file.
FINE, MARGIN = 0.0005, 1.0
#: Parts of a turn that an encoder's eccentricity may be of [rad], where it has one.
ECCENTRIC = (5e-4, 3e-3)


@dataclass(frozen=True)
class Unit:
    """What is true of a unit; times in seconds, angles in radians."""

    dt: float
    gain: float
    bias: float
    hold: int  # rows for which the output stands; 1: none
    step: float  # of the gyro's numbers
    noise: float  # of each new reading
    logged: str  # "rate", "angle" or "both"
    form: str  # "delay", "filter" or "window"
    late: tuple[float, ...]  # of each file
    encoder_noise: float
    encoder_step: float
    eccentricity: float
    stale: float  # share of rows that show the encoder's value before
    motion: tuple[str, ...]
    duration: tuple[float, ...]
    extra: str  # what else is wrong with the gyro; "" where nothing is


@dataclass(frozen=True)
class File:
    """Columns of a file, and what the error more added to each new reading."""

    columns: dict[str, Floats]
    added: Floats
    late: float = field(default=0.0)


def drawn(rng: np.random.Generator, extra: bool) -> Unit:
    """One unit."""
    files = int(rng.integers(1, 5))
    logged = str(rng.choice(["rate", "rate", "angle", "both"]))
    form = str(rng.choice(["delay", "filter", "window"])) if logged == "rate" else "delay"
    mean = rng.uniform(0.005, 0.03) + (0.03 if form == "window" else 0.0)
    own = 0.15 * mean * rng.standard_normal(files) * (rng.random() < 0.5)
    top_step = rng.choice([0.0, 0.001, 0.005, 0.01])
    return Unit(
        dt=float(rng.choice([0.005, 0.01, 0.01])),
        gain=float(rng.choice([-1, 1]) * rng.choice([0.87, 0.93, 1.0]) * (1 + 0.01 * rng.standard_normal())),
        bias=float(0.02 * rng.standard_normal()),
        hold=int(rng.choice([1, 1, 2, 3, 4])),
        step=float(top_step),
        noise=float(rng.uniform(0.002, 0.008)),
        logged=logged,
        form=form,
        late=tuple(float(x) for x in mean + own),
        encoder_noise=float(rng.uniform(0.003, 0.02) if logged == "rate" else rng.uniform(1e-4, 5e-4)),
        encoder_step=0.0077 if logged == "rate" else 2 * np.pi / 8192,
        eccentricity=float(rng.uniform(*ECCENTRIC)) if logged != "rate" and rng.random() < 0.3 else 0.0,
        stale=float(rng.choice([0.0, 0.0, 0.05])) if logged == "rate" else 0.0,
        motion=tuple(str(rng.choice(["sine", "steps", "hand"])) for _ in range(files)),
        duration=tuple(float(x) for x in rng.uniform(15, 80, files)),
        extra=str(rng.choice(sorted(EXTRA))) if extra else "",
    )


def moved(kind: str, t: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """True rate and the one that was asked for, on the fine grid [rad/s]."""
    top = rng.uniform(0.8, 3.0)
    if kind == "sine":
        asked = top * np.sin(2 * np.pi * rng.uniform(0.1, 0.9) * t + rng.uniform(0, 6))
        return smooth(asked, 0.03), asked
    if kind == "steps":
        dwell = rng.uniform(2.0, 5.0)
        asked = top * rng.uniform(-1, 1, int(t[-1] / dwell) + 1)[(t / dwell).astype(int)]
        return smooth(smooth(asked, rng.uniform(0.1, 0.3)), 0.05), asked
    white = rng.standard_normal(len(t))
    for tau in (0.25, 0.25, 0.1):
        white = smooth(white, tau)
    return top * white / (1.5 * np.std(white)), np.zeros(len(t))


def smooth(x: Floats, tau: float) -> Floats:
    """First-order filter on the fine grid."""
    a = np.exp(-FINE / tau)
    return np.asarray(lfilter([1 - a], [1, -a], x - x[0]) + x[0])


#: Errors that half of the units have beside: of the rate u [rad/s] and the time t [s], of unit size at 1 rad/s.
EXTRA: dict[str, Callable[[Floats, Floats], Floats]] = {
    "scale_factor_cubic": lambda u, t: u**3,
    "scale_factor_asymmetry": lambda u, t: np.abs(u),
    "tone": lambda u, t: np.sin(2 * np.pi * 3.7 * t),
}


def files_of(unit: Unit, strength: float, rng: np.random.Generator) -> list[File]:
    """The files of a unit; its error more is ``strength`` standard deviations of what all of them tell of it."""
    runs = [_moves(unit, number, rng) for number in range(len(unit.duration))]
    size = _size(unit, runs, strength) if unit.extra else 0.0
    return [_logged(unit, number, run, size, rng) for number, run in enumerate(runs)]


@dataclass(frozen=True)
class _Run:
    fine: Floats
    true: Floats
    asked: Floats
    angle: Floats
    t: Floats  # of the rows
    renewed: Floats  # when each row's value was new


def _moves(unit: Unit, number: int, rng: np.random.Generator) -> _Run:
    fine = np.arange(0.0, unit.duration[number] + 2 * MARGIN, FINE)
    true, asked = moved(unit.motion[number], fine, rng)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (true[1:] + true[:-1])) * FINE])
    rows = np.arange(round(unit.duration[number] / unit.dt))
    phase = int(rng.integers(unit.hold))
    t: Floats = MARGIN + unit.dt * rows.astype(np.float64)
    return _Run(fine, true, asked, angle, t, t - unit.dt * ((rows + phase) % unit.hold))


def _shape(unit: Unit, run: _Run) -> Floats:
    """The error more, of unit size, at each renewal."""
    u = np.interp(run.renewed, run.fine, run.true)
    return EXTRA[unit.extra](u, run.renewed - MARGIN)


def _size(unit: Unit, runs: list[_Run], strength: float) -> float:
    """Size of the error more: beside bias and scale factor, against the noise of the differences of both readings."""
    late = unit.encoder_noise**2 + unit.encoder_step**2 / 12
    per_row = unit.noise**2 + unit.step**2 / 12 + (late if unit.logged == "rate" else 2 * late / 0.1**2)
    told = 0.0
    for run in runs:
        fitted = slice(0, int(0.6 * len(run.t)), unit.hold)
        u, x = np.interp(run.renewed, run.fine, run.true)[fitted], _shape(unit, run)[fitted]
        known = np.column_stack([np.ones(len(u)), u])
        told += float(np.sum((x - known @ np.linalg.lstsq(known, x, rcond=None)[0]) ** 2))
    return float(strength * np.sqrt(per_row / told))


def _logged(unit: Unit, number: int, run: _Run, size: float, rng: np.random.Generator) -> File:
    n = len(run.t)
    fresh = np.rint((run.renewed - run.t[0]) / unit.dt).astype(int) + unit.hold
    noise = unit.noise * rng.standard_normal(n + unit.hold)
    added = size * _shape(unit, run) if unit.extra else np.zeros(n)
    gyro = unit.gain * np.interp(run.renewed, run.fine, run.true) + unit.bias + added + noise[fresh]
    columns = {"time": run.t - run.t[0], "gyro": _rounded(gyro, unit.step)}
    if unit.logged == "rate":
        columns["table_rate"] = _rate(unit, run, unit.late[number], rng)
    else:
        seen = np.interp(run.t - unit.late[number], run.fine, run.angle)
        seen = seen + unit.eccentricity * np.sin(seen) + unit.encoder_noise * rng.standard_normal(n)
        columns["table_angle"] = _rounded(seen, unit.encoder_step)
    if unit.logged == "both":
        columns["table_rate"] = np.interp(run.t, run.fine, run.asked)
    return File(columns, added, unit.late[number])


def _rate(unit: Unit, run: _Run, late: float, rng: np.random.Generator) -> Floats:
    """What was logged of the encoder's rate."""
    if unit.form == "filter":
        seen = np.interp(run.t, run.fine, smooth(run.true, late))
    elif unit.form == "window":  # counts over twice the time by which their mean is late
        ends = [np.interp(when, run.fine, run.angle) for when in (run.t, run.t - 2 * late)]
        seen = (ends[0] - ends[1]) / (2 * late)
    else:
        seen = np.interp(run.t - late, run.fine, run.true)
    seen = _rounded(seen + unit.encoder_noise * rng.standard_normal(len(seen)), unit.encoder_step)
    old = rng.random(len(seen)) < unit.stale
    old[0] = False
    last = np.maximum.accumulate(np.where(old, 0, np.arange(len(seen))))
    return seen[last]


def _rounded(x: Floats, step: float) -> Floats:
    return np.asarray(step * np.rint(x / step) if step else x)
