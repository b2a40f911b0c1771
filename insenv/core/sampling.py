"""When the rows of a file were taken: its time stamps, checked, and mended where they only jitter about a clock.

Increments become mean rates over the time that they cover: the period of the clock, or each row's own step where the
sampler itself is uneven by a little and the table's angle says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from insenv.core.clock import NEGLIGIBLE, Clock, clock_of, roughness
from insenv.core.errors import InputError
from insenv.core.recording import GAP, Floats


@dataclass(frozen=True)
class Sampling:
    """Times of the rows [s], the time that each covers (one for all, or shape (n,)) [s], what was done in words."""

    t: Floats
    covered: float | Floats
    notes: tuple[str, ...] = ()


def sampling(path: Path, t: Floats, place: Callable[[int], str], angle: Floats | None) -> Sampling:
    """Sampling of a run with stamps ``t``, shape (n,) [s]; ``angle`` of its table, shape (n,), where there is one.

    Raises
    ------
    InputError
        If time runs backwards or stands still, or if there is no clock behind the stamps.
    """
    check_forwards(path, t, place)
    clock = clock_of(t)
    if not clock.steady:
        raise InputError(f"{path}: {_uneven(t, clock)}")
    if clock.jitter < NEGLIGIBLE * clock.period:
        # Seconds since 1970 are good to 0.2 us: of a table that turns by 60 deg/s that is 5 deg/h at 100 Hz.
        even = angle is not None and roughness(clock.even, angle) < roughness(t, angle)
        return Sampling(increasing(path, clock.even if even else t, place), clock.period)
    if angle is not None and roughness(t, angle) < roughness(clock.even, angle):
        text = f"sampled unevenly, by {_share(clock)} of the period (one sigma) as the table's angle confirms"
        return Sampling(t, own_steps(t, clock.period), (f"{text}: each row is taken for the mean over its own step",))
    text = f"time stamps jitter by {_share(clock)} of the period (one sigma) about an even clock of"
    note = f"{text} {1 / clock.period:.6g} Hz: its times are taken"
    return Sampling(increasing(path, clock.even, place), clock.period, (note,))


def check_forwards(path: Path, t: Floats, place: Callable[[int], str]) -> None:
    """Refuse time of one row, time that runs backwards, and time that stands still throughout."""
    if len(t) < 2:
        raise InputError(f"{path}: has {len(t)} row of data; wanted at least 2")
    steps = np.diff(t)
    if (steps < 0).any() or t[-1] == t[0]:
        row = int(np.argmax(steps < 0)) + 1
        _refuse(path, t, row, place)


def increasing(path: Path, t: Floats, place: Callable[[int], str]) -> Floats:
    """The times, refused where they do not increase."""
    still = np.diff(t) <= 0
    if still.any():
        _refuse(path, t, int(np.argmax(still)) + 1, place)
    return t


def _refuse(path: Path, t: Floats, row: int, place: Callable[[int], str]) -> None:
    verb = "stands still" if t[row] == t[row - 1] else "runs backwards"
    found = f"{t[row]:.15g} s after {t[row - 1]:.15g} s"
    raise InputError(f"{path}: {place(row)}: time {verb} ({found}); wanted time that increases")


def own_steps(t: Floats, period: float) -> Floats:
    """Time that each row covers [s]: its step; ``period`` after a gap and for the first row."""
    steps = np.append(period, np.diff(t))
    return np.where(steps <= GAP * period, steps, period)


def _share(clock: Clock) -> str:
    return f"{100 * clock.jitter / clock.period:.2g} %"


def _uneven(t: Floats, clock: Clock) -> str:
    low, middle, high = np.quantile(np.diff(t), (0.05, 0.5, 0.95))
    spread = f"steps of {low:.3g} to {high:.3g} s, {middle:.3g} s in the median, about no even clock"
    rate = 0.5 / max(high, 1e-300)
    nice = 10.0 ** np.floor(np.log10(rate))
    rate = nice * max(m for m in (1, 2, 5) if m * nice <= rate * (1 + 1e-9))
    example = f'fit.resample = "{rate:g} Hz" for means over {1 / rate:g} s'
    return f"not evenly sampled ({spread}); wanted even steps, or {example}"
