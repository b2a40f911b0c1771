r"""Noise of the rows that is louder where a table turns, or turns faster.

With the segments in order of the size of the rate, the mean energies S of those in the upper third and R of those in
the lower one,

    S / (1.3 R)  ~  F(2 m q, 2 n q)

for noise that knows nothing of the motion. All segments without motion are one lower third, if a table rests. What the
motor shakes, and the noise of a converter that follows the rate, are so; what a reference does is left out before.

An angle that is read in steps q stands while the table rests, and while it turns its differences over a row have the
variance q^2 / 6 dt^2 beside the noise of the rows at rest: no more than that is none of the gyro's.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from insenv.core.recording import Floats
from insenv.core.series.robust import MEDIAN
from insenv.core.series.tails import log_far_tails_of_f
from insenv.identify.prepare.unsteady.loud import LOUDER, OVERLAP, count, octaves
from insenv.identify.prepare.unsteady.spectrogram import RowsLeft, Spectrogram

#: Share of the largest rate below which a table rests; fewest segments that tell something on either side.
RESTS, FEWEST = 0.01, 12
#: Times the power that the steps of an angle make which is still theirs: an encoder has noise of its own as well.
OF_STEPS = 2.0
#: Groups of segments by the rate, beside those at rest, each of which has a level of its own.
GROUPS = 6


@dataclass(frozen=True)
class WithMotion:
    """Noise that goes with the rate.

    Attributes
    ----------
    log_p : float
        Logarithm of its probability.
    times : float
        Ratio of the power where the table turns fast to that where it turns slowly, or rests.
    rests : bool
        Whether the latter is at rest.
    """

    log_p: float
    times: float
    rests: bool


def with_motion(cells: Spectrogram, left: RowsLeft) -> WithMotion | None:
    """How the noise goes with the size of the rate; None at rest, or at one rate, or where nothing is told."""
    if left.rate is None:
        return None
    columns = cells.told.shape[1]
    speed = _speeds(cells, left.rate)
    power, told = cells.energy.sum(axis=1), cells.told.sum(axis=1).astype(np.float64)
    whole = told > 0.5 * columns
    if whole.sum() < 2 * FEWEST:
        return None
    still = speed < RESTS * speed[whole].max()
    rests = bool(np.sum(whole & still) >= FEWEST)
    slow = whole & (still if rests else speed <= np.quantile(speed[whole], 1 / 3))
    fast = whole & ~slow & (speed >= np.quantile(speed[whole], 2 / 3))
    if fast.sum() < FEWEST or slow.sum() < FEWEST or speed[fast].min() < 2 * speed[slow].max():
        return None
    each = 2 * count(power, told, columns) / OVERLAP
    there, here = float(told[fast].sum()), float(told[slow].sum())
    times = float(power[fast].sum() / there / max(power[slow].sum() / here, 1e-300))
    beyond = (np.array([one]) for one in (times / LOUDER, each * there, each * here))
    return WithMotion(float(log_far_tails_of_f(*beyond)[0]), times, rests) if times > LOUDER else None


def of_steps(moved: WithMotion, left: RowsLeft) -> bool:
    """Whether the steps of the angle of a table that rests as well make so much noise while it turns."""
    if left.rate is None or not left.encoder or not moved.rests:
        return False
    speed = np.abs(left.rate)
    still = speed < RESTS * speed.max()
    at_rest, turning = (_variance(left.values[rows]) for rows in (still, ~still))
    return turning < OF_STEPS * (at_rest + left.encoder**2 / (6 * left.dt**2))


def _variance(values: Floats) -> float:
    """Robust, of values about nothing."""
    return float(np.median(np.abs(values)) / MEDIAN) ** 2


def without_motion(cells: Spectrogram, left: RowsLeft) -> Spectrogram:
    """The cells with a level of their own at each rate, octave by octave."""
    if left.rate is None:
        return cells
    speed = _speeds(cells, left.rate)
    still = speed < RESTS * speed.max()
    order = np.argsort(speed, kind="stable")[int(still.sum()) :]
    energy = cells.energy.copy()
    for group in (np.flatnonzero(still), *np.array_split(order, GROUPS)):
        for low, high in pairwise(octaves(energy.shape[1])):
            usual = energy[group, low:high].sum() / max(int(cells.told[group, low:high].sum()), 1)
            energy[group, low:high] /= max(float(usual), 1e-300)
    return replace(cells, energy=energy)


def _speeds(cells: Spectrogram, rate: Floats) -> Floats:
    """The mean size of the rate in each segment, shape (segments,)."""
    total = np.append(0.0, np.cumsum(np.abs(rate)))
    first = cells.rows // 2 * np.arange(len(cells.energy))
    return np.asarray((total[first + cells.rows] - total[first]) / cells.rows)
