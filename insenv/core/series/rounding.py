"""The step to which values were rounded: by a counter, a converter, or the digits of a text file.

The differences of rounded values differ by multiples of one step q. A difference of two of them is wrong by up to q,
however small the noise is: nothing within that is an outlier.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from insenv.core.series.robust import MEDIAN

Floats = NDArray[np.float64]

#: How far from a multiple of the step a difference may be, as a share of it.
OFF = 0.02
#: Times what the digits of a file leave from which on steps are a counter's, and the share of rows that keep to them.
DIGITS, KEPT = 10.0, 0.99
#: How many times as large moves are counted next, from as many steps on.
GROWTH = 4.0
#: Share of the readings at which a change of a counter's counts by one takes back the last one.
TURNS = 0.02
#: Differences in which no smooth motion is left, what they scatter by where counts are rounded (0.29 of one), and how
#: many of them tell it.
ORDER, ROUNDED, FEWEST = 6, (0.15, 0.6), 50
#: Share of a range below which a step is that of a computer's numbers.
LEAST_STEP = 1e-12
#: Steps of floating-point numbers below which a difference is nothing.
EPSILONS = 16.0


def rounding(values: Floats) -> float:
    """The step to which ``values``, shape (n,), were rounded; that of floating-point numbers where they were not."""
    least = EPSILONS * float(np.spacing(np.abs(values).max(initial=0.0)))
    steps = np.diff(values)
    between = np.diff(np.sort(steps))
    between = between[between > least]
    if not len(between):
        return least
    # The smallest one is the step if all are multiples of it; large multiples, known to a share of one, are not asked.
    multiples = between / between.min()
    multiples = multiples[multiples * least < OFF * between.min()]
    whole = len(multiples) > 0 and float(np.abs(multiples - np.rint(multiples)).max()) < OFF
    return float(np.median(between / np.rint(between / between.min()))) if whole else least


def counted(values: Floats) -> float:
    """The step of a counter behind ``values``, shape (n,), that were printed with more digits; else `rounding`.

    An encoder of 12 bits is written as 0.0879, 0.1758, 0.2637 deg: multiples of its step but for the last digit.
    """
    printed, moves = rounding(values), np.diff(values)
    fine = printed
    between = np.diff(np.sort(moves))
    between = np.sort(between[between > fine])
    if len(between) > 1:
        # Digits that are few of large numbers and many of small ones: what they leave is far below the step.
        gap = int(np.argmax(between[1:] / between[:-1]))
        if between[gap + 1] > DIGITS * between[gap]:
            fine = max(fine, float(between[gap]))
    between = between[between > DIGITS * fine]
    if not len(between):
        return printed
    step = float(between.min())
    for _ in range(2):
        step = float(np.median(between / np.rint(between / step)))
    step = _by_ever_larger(moves, step)
    times = np.rint(moves / step)
    if not np.any(times):
        return fine
    off = np.abs(moves - step * np.rint(moves / step)) / step
    kept = float(np.mean(off < OFF + 2 * fine / step)) > KEPT
    return step if kept and not _goes_evenly(times) else printed


def _by_ever_larger(moves: Floats, step: float) -> float:
    """The step by multiples of it, shape (n,), small ones first: those of hundreds are counted by what these tell."""
    size, most = np.abs(moves), float(np.abs(moves).max(initial=0.0))
    limit = GROWTH
    while True:
        near = moves[size <= limit * step]
        times = np.rint(near / step)
        if np.any(times):
            step = float(near @ times / (times @ times))
        if limit * step >= most:
            return step
        limit *= GROWTH


def _goes_evenly(times: Floats) -> bool:
    """Whether counts from row to row, shape (n,), hardly change in motion: they are a rate's, and no counter's.

    A counter's are the same only of a table that turns by whole counts in each row.
    """
    on = int(np.sum((times[1:] != 0) & (times[:-1] != 0)))
    return on >= FEWEST and int(np.sum(np.diff(times) != 0)) < TURNS * on


def counter_step(values: Floats) -> float:
    """The step of the counter that ``values``, shape (n,), show to be there; 0 where they show none.

    At a steady rate its counts from reading to reading go up and down by one, by turns. Those of a programme of round
    rates and accelerations are whole numbers too, and do so at the ends of ramps alone; and numbers that a computer
    made have steps that are none.
    """
    if not (step := _counted_step(values)):
        return 0.0
    changes = np.diff(np.rint(np.diff(values) / step))
    changes = changes[np.abs(changes) == 1]
    return step if np.sum(changes[1:] * changes[:-1] < 0) > TURNS * len(values) else 0.0


def _counted_step(values: Floats) -> float:
    """The step that ``values``, shape (n,), are multiples of; 0 where it is that of a computer's numbers."""
    step = counted(values)
    return 0.0 if step < LEAST_STEP * float(np.ptp(values)) else step


def swung_step(values: Floats) -> float:
    """The step of the counter behind readings of a swing, shape (n,); 0 where they show none.

    Their counts hardly ever turn back at once, but go up and down by a part of one wherever they change at all; those
    of a programme go in whole steps.
    """
    if not (step := _counted_step(values)):
        return 0.0
    counts = np.rint(np.diff(values) / step)
    change = np.abs(np.diff(counts, ORDER - 1)) / math.sqrt(math.comb(2 * ORDER, ORDER))
    if len(change) < FEWEST:
        return 0.0
    windows = np.lib.stride_tricks.sliding_window_view(np.diff(counts) != 0, ORDER - 1)
    change = change[np.any(windows, axis=-1)[: len(change)]]
    rounded = len(change) >= FEWEST and ROUNDED[0] < float(np.median(change)) / MEDIAN < ROUNDED[1]
    return step if rounded else 0.0
