"""Angles and rates of a table that were set: a row at each, or rests without a row of the turns between them.

Nobody may make a motion of such a column. Means of 7 s at 0, 180, 45, 225 deg ... in the rows of a file are those of a
table at rest: what follows the angle is taken as it stands at each row, and no rate is subtracted. An angle is taken to
have been set where every change of it is either none or one to another position, whole turns apart; not where it goes
on evenly, as a table that turns does, unless it rests for long between, nor where a gyro reads the turns.

So is a table of rates and readings, the common test of a scale factor: a row is the mean of some seconds at one rate,
and the next is of another. What lies between was not recorded: no angle follows from it, no lag and no line. The same
holds of readings at temperatures for each of which somebody waited, of those at one angle each, and of means in one
attitude each.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from insenv.core.series.stretches import stretches

Floats = NDArray[np.float64]

#: Change of an angle up to which the table stands, and from which on it has gone to another position [rad].
STANDS, GONE = 0.002, 0.05
#: Fewest such changes.
FEWEST = 3
#: Change from one turn to the next, of half of them, up to which a table turns evenly [rad], and usual time between
#: turns [s] from which on it rests.
EVENLY, RESTS = 0.2, 20.0
#: Rows for which an angle stands between two turns, from which on it rests there.
DWELL = 5
#: Usual time from row to row of rates that were set [s], share of their range by which a rate is another one, or times
#: the larger of both, as of 0.1, 0.2, 0.5, 1, 2 deg/s; share of the rows at which it is, that of six readings at each;
#: fewest and most rows: nobody sets a thousand, and a table that swings may be read once a second.
APART, ANOTHER, TIMES, OFTEN, FEWEST_ROWS, MOST_ROWS = 1.0, 0.01, 0.2, 0.15, 6, 300
#: Least scatter of the rates at which an angle goes on, as a share of their mean, with which no table turns.
UNEVENLY = 0.2
#: Least such change of the smaller ones, as a share of the range: noise about nothing is none.
LEAST_STEP = 1e-4
#: Usual time from row to row of temperatures for which somebody waited [s], and least range of them [K].
WAITED, KELVINS = 300.0, 5.0
#: Turn of "up" from row to row that is another attitude [rad], and range of a force that is gravity, as a share of it.
TILTED, UNEQUAL = 0.1, 0.3


def were_set(t: Floats, angle: Floats) -> bool:
    """Whether readings of an angle [rad] at times ``t`` [s], shape (n,), go from position to position at once."""
    if _single(t, angle, RESTS) and _goes_unevenly(t, angle):
        return True
    change = np.diff(angle)
    short = np.abs(_within_a_turn(change))
    gone = short > GONE
    if int(gone.sum()) < FEWEST or bool(np.any(~gone & (short > STANDS))):
        return False
    drifts = (np.ptp(_within_a_turn(angle[a : b + 1] - angle[a])) > STANDS for a, b in stretches(~gone))
    if any(drifts):
        return False
    bend = np.abs(_within_a_turn(np.diff(change[gone])))
    return float(np.median(bend)) > EVENLY or float(np.median(np.diff(t[1:][gone]))) > RESTS


def dwells(t: Floats, angle: Floats) -> bool:
    """Whether readings of an angle [rad] at times ``t`` [s], shape (n,), stand for long, and then at another position.

    What is read a few times a second stands between two readings as well.
    """
    change = np.abs(_within_a_turn(np.diff(angle)))
    gone = np.flatnonzero(change > GONE)
    if len(gone) < FEWEST or np.any((change > STANDS) & (change <= GONE)):
        return False
    rows = np.diff(gone)
    return float(np.median(rows)) > DWELL and int(rows.min()) > 1 and float(np.median(np.diff(t[gone]))) > APART


def _goes_unevenly(t: Floats, angle: Floats) -> bool:
    """Whether an angle goes on from row to row as no table turns: at rates that differ from one to the next."""
    rate = np.abs(np.diff(angle)) / np.diff(t)
    return float(np.std(rate)) > UNEVENLY * float(np.mean(rate)) > 0


def rates_were_set(t: Floats, rate: Floats) -> bool:
    """Whether rates [rad/s] of a table at times ``t`` [s], shape (n,), are those of single points far apart."""
    return _single(t, rate, APART)


def temperatures_were_set(t: Floats, temperature: Floats) -> bool:
    """Whether temperatures [K] at times ``t`` [s], shape (n,), are those of single points, waited for one by one.

    For rows without times take those of `of_untimed`: how a temperature came about is not known then.
    """
    return _single(t, temperature, WAITED) and float(np.ptp(temperature)) >= KELVINS


def attitudes_were_set(t: Floats, force: Floats) -> bool:
    """Whether specific forces, shape (3, n), at times ``t`` [s] are gravity, mostly from another side in each row."""
    size = np.linalg.norm(force, axis=0)
    few = FEWEST_ROWS <= len(t) <= MOST_ROWS and float(np.median(np.diff(t))) >= APART
    if not few or not size.min() > 0 or float(np.ptp(size)) > UNEQUAL * float(np.median(size)):
        return False
    up = force / size
    return float(np.mean(np.linalg.norm(np.diff(up, axis=1), axis=0) > TILTED)) > OFTEN


def of_untimed(n: int) -> Floats:
    """Times of ``n`` rows that have none, shape (n,) [s]: as far apart as points of any kind are wanted."""
    return np.float64(WAITED) * np.arange(n)


def angles_are_points(t: Floats, angle: Floats) -> bool:
    """Whether angles [rad] that were set at times ``t`` [s], shape (n,), are single points far apart."""
    return _single(t, angle, APART)


def _single(t: Floats, values: Floats, apart: float) -> bool:
    """Whether few rows, usually ``apart`` or more, have another value than the row before often enough."""
    if not FEWEST_ROWS <= len(t) <= MOST_ROWS or float(np.median(np.diff(t))) < apart:
        return False
    change, larger = np.abs(np.diff(values)), np.maximum(np.abs(values[1:]), np.abs(values[:-1]))
    range_ = float(np.ptp(values))
    another = (change > ANOTHER * range_) | (change > np.maximum(TIMES * larger, LEAST_STEP * range_))
    return float(np.mean(another)) > OFTEN and range_ > 0


def _within_a_turn(angle: Floats) -> Floats:
    """An angle less whole turns, from minus to plus half of one [rad]."""
    return np.asarray(angle - 2 * np.pi * np.rint(angle / (2 * np.pi)))
