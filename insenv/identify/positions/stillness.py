"""Stillness: where a triad scatters no more than at its quietest, and its means stay where they are.

With s_c(t) the standard deviation of channel c in a window about t, and q_c the quiet level of the channel,

    s(t) = sqrt(mean over c of (s_c(t) / q_c)^2),        still:  s(t) < threshold,   threshold = sqrt(q s_max)

where q and s_max are the quiet level and the largest value of s in a run: half-way, in orders of magnitude, between
rest and motion. No figure of the instrument is needed, not even its unit. q_c is a low quantile of s_c, that of the
unit's quietest run: a run that swings has none of its own. Rounding to a step d has the variance d^2 / 12 at least,
also where a counter happens to stand still; of readings that stand at one step for whole windows the others tell it.

A unit that only swings scatters evenly too. Its means tell: those of neighbouring windows of w rows differ by

    A = mean of (m_(j+1) - m_j)^2 / 2  =  s_c^2 / w       of white noise, however strong,
                                       >  s_c^2           of what is slower than the windows.

A stretch wanders if some channel has A > s_c^2, and is off by more than a unit that lies (`WANDERS`).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.ndimage import uniform_filter1d

from insenv.core.recording import Floats, Recording
from insenv.core.series.rounding import rounding

#: Length of the windows whose scatter is looked at [s].
WINDOW = 0.5
#: Least number of rows in such a window.
WINDOW_ROWS = 8
#: Share of the windows that are quieter than the quiet level.
QUIET_SHARE = 0.1
#: Share of the variance of rounding up to which the readings in a window are one number.
SAME = 1e-6
#: Of white noise the quietest windows of a few rows and the quiet level of a run reach so many quiet levels.
QUIETEST, QUIET = 1.5, 1.3
#: The least and the largest threshold, in quiet levels.
THRESHOLDS = (4.0, 20.0)
#: Ratio of the largest scatter to the quiet level below which nothing moves at all.
MOVES = 8.0
#: By what the means over a window of a unit that lies do not differ: an accelerometer's, as a share of what the triad
#: reads in all, and a gyro's [rad/s].
WANDERS = {"accel": 0.005, "gyro": float(np.deg2rad(1.0))}
#: Differences of neighbouring means, in standard deviations of white noise, at which a stretch that wanders is cut.
LEAP = 5.0
#: Longest knock that a rest may have, in windows.
KNOCK = 4


def window_rows(recording: Recording) -> int:
    """Rows of a window."""
    return max(WINDOW_ROWS, round(WINDOW / recording.dt))


def quiet_levels(recordings: Sequence[Recording], channels: Sequence[str]) -> Floats:
    """Variance of each channel in a window of the unit's quietest run, shape (channels,); infinite of what is dead."""
    levels = np.full(len(channels), np.inf)
    for recording in recordings:
        for i, (name, squares) in enumerate(zip(channels, _variances(recording, channels), strict=True)):
            inside = squares[np.isfinite(squares)]
            of_rounding = rounding(recording.channels[name].values) ** 2 / 12
            inside = inside[inside > SAME * of_rounding]
            if len(inside):
                levels[i] = min(levels[i], max(float(np.quantile(inside, QUIET_SHARE)), of_rounding))
    return levels


def scatter(recording: Recording, channels: Sequence[str], quiet: Floats) -> Floats:
    """Scatter of the window about each row in quiet levels, shape (n,); infinite where a gap leaves no window."""
    squares = _variances(recording, channels)
    known = np.isfinite(squares)
    relative = np.where(known, squares, 0.0) / quiet[:, None]
    return np.sqrt(np.where(known, relative, np.inf).mean(axis=0))


def _variances(recording: Recording, channels: Sequence[str]) -> Floats:
    """Variance of each channel in the window about each row, shape (channels, n)."""
    width = window_rows(recording)
    squares = np.full((len(channels), len(recording)), np.inf)
    for row, name in zip(squares, channels, strict=True):
        for piece in recording.pieces():
            if piece.stop - piece.start >= width:
                row[piece] = _variance(recording.channels[name].values[piece], width)
    return squares


def _variance(values: Floats, width: int) -> Floats:
    """Variance in a window about each value; beyond the ends the ends are mirrored."""
    x = values - values.mean()
    mean = uniform_filter1d(x, width, mode="mirror")
    return np.maximum(uniform_filter1d(x * x, width, mode="mirror") - mean * mean, 0.0)


def threshold(s: Floats) -> float:
    """Scatter below which a window is still: between the quiet level and the largest; infinite if nothing moves."""
    known = s[np.isfinite(s)]
    if not len(known):
        return 0.0
    quiet, largest = float(np.quantile(known, QUIET_SHARE)), float(known.max())
    if not quiet and largest:  # readings that stand still where the unit does
        quiet = float(known[known > 0].min())
    if float(known.min()) < QUIETEST:
        quiet = min(quiet, QUIET)
    if largest < MOVES * quiet:
        return np.inf
    return float(np.clip(np.sqrt(largest / quiet), *THRESHOLDS)) * quiet


def steady(recording: Recording, channels: Sequence[str], start: int, stop: int) -> list[tuple[int, int]]:
    """Parts of the stretch ``[start, stop)`` whose means do not wander: all of it, what its leaps part, or none."""
    means, noise = _of_windows(recording, channels, start, stop)
    least = sizes(channels, means)
    if not _wanders(means, noise, least):
        return [(start, stop)]
    width, last = window_rows(recording), means.shape[1]
    leaps = (np.abs(np.diff(means, axis=1)) > LEAP * np.sqrt(2 * noise / width)[:, None]).any(axis=0)
    at = (np.flatnonzero(leaps) + 1).tolist()
    # The window on either side of a leap has a part of it.
    parts = [(a + (a > 0), b - (b < last)) for a, b in pairwise([0, *at, last])]
    kept = [(a, b) for a, b in parts if b - a > 1 and not _wanders(means[:, a:b], noise, least)]
    whole = _with_knocks(kept, means, least)
    return [(start + a * width, stop if b == last else start + b * width) for a, b in whole]


def scatters(recording: Recording, channels: Sequence[str], start: int, stop: int) -> bool:
    """Whether some channel scatters in the rows ``[start, stop)`` by more than one of a unit that lies may be off."""
    values = np.stack([recording.channels[name].values[start:stop] for name in channels])
    return bool(np.any(values.std(axis=1) > sizes(channels, values.mean(axis=1)[:, None])))


def sizes(channels: Sequence[str], means: Floats) -> Floats:
    """By what each channel of a unit that lies does not change, shape (channels,); ``means``, shape (channels, n)."""
    accels = [i for i, name in enumerate(channels) if name.startswith("accel")]
    read = float(np.median(np.linalg.norm(means[accels], axis=0)))
    return np.array([WANDERS["accel"] * read if i in accels else WANDERS["gyro"] for i in range(len(channels))])


def _with_knocks(parts: list[tuple[int, int]], means: Floats, least: Floats) -> list[tuple[int, int]]:
    """The parts, two as one where a few windows lie between them and the level is the same before and after."""
    joined: list[tuple[int, int]] = []
    for a, b in parts:
        if joined and a - joined[-1][1] <= KNOCK:
            before = means[:, slice(*joined[-1])].mean(axis=1)
            if (np.abs(means[:, a:b].mean(axis=1) - before) < least).all():
                joined[-1] = (joined[-1][0], b)
                continue
        joined.append((a, b))
    return joined


def _of_windows(recording: Recording, channels: Sequence[str], start: int, stop: int) -> tuple[Floats, Floats]:
    """Means over windows side by side, shape (channels, windows), and the median variance within, shape (channels,)."""
    width = window_rows(recording)
    count = (stop - start) // width
    rows = slice(start, start + count * width)
    x = np.stack([recording.channels[name].values[rows].reshape(count, width) for name in channels])
    return x.mean(axis=2), np.median(x.var(axis=2, ddof=1), axis=1)


def _wanders(means: Floats, noise: Floats, least: Floats) -> bool:
    """Whether the means of some channel differ from window to window by more than its noise and than ``least``."""
    if means.shape[1] < 2:
        return False
    size = 0.5 * np.mean(np.diff(means, axis=1) ** 2, axis=1)
    return bool(((size > noise) & (size > least**2)).any())
