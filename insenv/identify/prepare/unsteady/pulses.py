r"""Pulses in the rows of a unit at rest that come again and again: a heater, a bus, one row of each packet.

Rows r of unit variance are folded at each number of rows P; of m times P rows the pulse over w of the phases is

    z = sum_{k < m} sum_{j in w} r_(k P + j) / sqrt(m w)  ~  N(0, 1)

if they are white; where the rows of the pulse are louder than others, z is less by as much, and of a reading that is
held, or hops by its steps, nothing is asked. An interval that is no whole number of rows has a multiple that nearly is.
A line folds as well, to a sine; what has most of its profile in one sine is none of these.

Source: D. A. Leahy et al., Astrophys. J. 266 (1983) 160 (folding, and its chance beside that of a periodogram).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq
from scipy.ndimage import median_filter
from scipy.special import log_ndtr

from insenv.core.recording import Floats
from insenv.identify.prepare.unsteady.spectrogram import White

#: Shortest and longest interval in rows, how often it comes at least, and rows that are folded at most.
SHORTEST, LONGEST, TIMES, MOST = 8, 2048, 16, 2**16
#: Standard deviations to which rows are clipped: a few knocks are no pulse that comes again.
CLIP = 3.0
#: Share of an interval that a pulse lasts at most, how many times as long the next one is that is tried, share of its
#: profile that may be a sine.
LASTS, LONGER, SINE = 0.125, 4, 0.5
#: Share of the times that a pulse has its sign at least, and how far it may be off by chance in deviations.
SIGN, BEYOND = 0.6, 3.0
#: Share of rows that read the number before from which on nothing is asked.
REPEATED = 0.25
#: Parts of an interval that may be its true one, and how tall a pulse is in each of them.
PARTS, ALIKE = 16, 0.6
#: Widths of a line, 1 / duration, that are taken out on either side of it; frequencies whose median is the noise there.
BESIDE, ABOUT = 3.0, 101


@dataclass(frozen=True)
class Pulses:
    """What comes again: every ``interval`` [s], for about ``length`` [s], so many ``times`` the noise of a row."""

    log_p: float
    interval: float
    length: float
    times: float


@dataclass(frozen=True)
class _Fold:
    deviate: float
    rows: int
    phase: int
    width: int


def pulses(made: White) -> Pulses | None:
    """The likeliest of a run's white rows; None beside a table, or where none comes often enough to be one."""
    if made.left.rate is not None or _stands(made):
        return None
    rows = _without_lines(made)[:MOST]
    longest = min(LONGEST, len(rows) // TIMES)
    if longest < SHORTEST or not rows.any():
        return None
    best = _folded(rows, max(range(SHORTEST, longest + 1), key=lambda interval: _tallest(rows, interval)))
    if not _comes_often(rows, best) or _is_a_sine(rows, best):
        return None
    tried = sum(2 * interval * len(list(_widths(interval))) for interval in range(SHORTEST, longest + 1))
    log_p = float(log_ndtr(-best.deviate / np.sqrt(_louder(rows, best))) + np.log(tried))
    times = best.deviate / np.sqrt((len(rows) // best.rows) * best.width)
    dt = made.left.dt
    return Pulses(log_p, dt * best.rows / _parts(rows, best), dt * best.width, float(times))


def _stands(made: White) -> bool:
    """Whether many readings are the one before again, held or by their steps: their noise is not alike in all rows."""
    return float(np.mean(np.diff(made.left.values) == 0)) > REPEATED


def _without_lines(made: White) -> Floats:
    """The rows, clipped, as loud at each frequency but for lines that are told elsewhere; of unit variance."""
    rows, n = made.rows, len(made.rows)
    size = next_fast_len(n)
    wave, f = rfft(rows - rows.mean(), size), rfftfreq(size, made.left.dt)
    wave /= np.sqrt(np.maximum(median_filter(np.abs(wave) ** 2, ABOUT, mode="nearest"), 1e-12 * n))
    for frequency, half in made.left.lines:
        wave[np.abs(f - frequency) <= half + BESIDE / (n * made.left.dt)] = 0.0
    rows = irfft(wave, size)[:n]
    rows = np.clip(rows, -CLIP * rows.std(), CLIP * rows.std())
    return np.asarray((rows - rows.mean()) / max(float(rows.std()), 1e-300))


def _widths(interval: int) -> Iterator[int]:
    """Rows of a pulse that are tried."""
    width = 1
    while width <= max(1.0, LASTS * interval):
        yield width
        width *= LONGER


def _profile(rows: Floats, interval: int) -> Floats:
    """Mean of the rows at each phase of an interval, over its deviation, shape (interval,)."""
    times = len(rows) // interval
    return np.asarray(rows[: times * interval].reshape(times, interval).sum(axis=0) / np.sqrt(times))


def _sums(profile: Floats) -> Iterator[tuple[int, Floats]]:
    """Each width of a pulse, and the same over so many phases from each one on, around the end."""
    widths = list(_widths(len(profile)))
    total = np.cumsum(np.concatenate([[0.0], profile, profile[: widths[-1]]]))
    for width in widths:
        yield width, (total[width : width + len(profile)] - total[: len(profile)]) / np.sqrt(width)


def _tallest(rows: Floats, interval: int) -> float:
    """The largest pulse at an interval, in deviations."""
    return max(max(float(sums.max()), -float(sums.min())) for _, sums in _sums(_profile(rows, interval)))


def _folded(rows: Floats, interval: int) -> _Fold:
    """The same with its phase and its width."""
    found = []
    for width, sums in _sums(_profile(rows, interval)):
        at = int(np.abs(sums).argmax())
        found.append(_Fold(float(abs(sums[at])), interval, at, width))
    return max(found, key=lambda one: one.deviate)


def _louder(rows: Floats, fold: _Fold) -> float:
    """How much louder the rows are where the pulse is, no less than one: of a reading that is held some phases are."""
    each = _each(rows, fold)
    return max(1.0, float(each.var(ddof=1)) / fold.width)


def _each(rows: Floats, fold: _Fold) -> Floats:
    """Sums over the pulse each time that it comes."""
    total = np.cumsum(np.append(0.0, rows))
    at = np.arange(fold.phase, len(rows) - fold.width + 1, fold.rows)
    return np.asarray(total[at + fold.width] - total[at])


def _comes_often(rows: Floats, fold: _Fold) -> bool:
    """Whether it has its sign more often than not, beyond chance: a few knocks have a phase as well."""
    each = _each(rows, fold)
    same = float(np.mean(each * np.sign(each.sum()) > 0))
    return same > max(SIGN, 0.5 + 0.5 * BEYOND / np.sqrt(len(each)))


def _is_a_sine(rows: Floats, fold: _Fold) -> bool:
    """Whether most of the profile, less what noise has in it, is one sine of the interval or of a part of it."""
    power = 2 * np.abs(rfft(_profile(rows, fold.rows))[1:]) ** 2 / fold.rows
    return float(power.max()) > SINE * max(float(power.sum()) - fold.rows, 1e-9)


def _parts(rows: Floats, fold: _Fold) -> int:
    """Into how many parts pulses like the tallest cut the interval."""
    sums = dict(_sums(_profile(rows, fold.rows)))[fold.width]
    for parts in range(min(PARTS, fold.rows // SHORTEST), 1, -1):
        at = fold.phase + np.rint(np.arange(parts) * fold.rows / parts).astype(int)
        if (sums[at % fold.rows] * np.sign(sums[fold.phase])).min() > ALIKE * fold.deviate:
            return parts
    return 1
