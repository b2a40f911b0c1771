"""Published orders of positions of a unit, the time shared evenly: six, nineteen, twenty-four.

An action is (angle of each axis, rate, dwell, stop) as shares of their largest, shape (..., k + 3). A position lasts
until its share of the time is over, the turn to it included; the table takes the next one when its dwell is.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.unit.gimbals import Gimbals, turn_time
from insenv.information.positions import nineteen, six, twenty_four


def gimbals_of(datasheet: Datasheet) -> Gimbals:
    """The table's axes.

    Raises
    ------
    InputError
        If the datasheet tells of none.
    """
    if datasheet.mounting.gimbals is None:
        raise InputError("the datasheet tells of no table with several axes; wanted mounting.gimbals")
    return datasheet.mounting.gimbals


class Positions:
    """A policy that goes from position to position.

    Parameters
    ----------
    datasheet : Datasheet
    angles : sequence of sequence of float
        Of the axes at each position [rad].
    rate : float
        Share of the largest rate.
    """

    def __init__(self, datasheet: Datasheet, angles: Sequence[Sequence[float]], rate: float = 1.0) -> None:
        self.gimbals, self.limits = gimbals_of(datasheet), datasheet.limits
        self.angles, self.rate = np.asarray(angles, float), rate
        #: When each position is to be left [s].
        self.ends: Floats = np.arange(1, len(angles) + 1) * np.float64(datasheet.duration / len(angles))

    def reset(self, batch: int | None = None) -> Floats:
        """Positions that were taken up, of every run."""
        return np.zeros(() if batch is None else batch)

    def act(self, state: Floats, chunk: Recording | None, estimate: Estimate | None = None) -> tuple[Floats, Floats]:
        """The next position and how long to dwell there, shape (..., k + 3); positions taken up so far."""
        now = 0.0 if chunk is None or not len(chunk) else float(chunk.t[-1])
        taken = np.asarray(state, float)
        if chunk is not None and len(chunk):
            taken = np.broadcast_to(chunk.values("commands", "1")[..., -1], np.shape(state)).copy()
        last = len(self.angles) - 1
        after = np.minimum(taken.astype(int), last)
        before = np.where(after[..., None] > 0, self.angles[np.maximum(after - 1, 0)], 0.0)
        there = self.angles[np.where(taken > last, last, after)]
        turning = turn_time(there - before, self.rate * self.limits.rate, self.limits.acceleration).sum(axis=-1)
        dwell = np.clip(self.ends[after] - now - turning, 0.0, self.gimbals.longest)
        action = np.concatenate(
            [
                there / np.array(self.gimbals.most),
                np.full((*taken.shape, 1), self.rate),
                dwell[..., None] / self.gimbals.longest,
                np.zeros((*taken.shape, 1)),
            ],
            axis=-1,
        )
        return action, taken


class SixPositions(Positions):
    """Each axis of the unit up and down."""

    def __init__(self, datasheet: Datasheet) -> None:
        super().__init__(datasheet, six(gimbals_of(datasheet)))


class NineteenPositions(Positions):
    """The published 19 positions (`insenv.information.positions.NINETEEN`)."""

    def __init__(self, datasheet: Datasheet) -> None:
        super().__init__(datasheet, nineteen(gimbals_of(datasheet)))


class TwentyFourPositions(Positions):
    """All attitudes at right angles that the table reaches."""

    def __init__(self, datasheet: Datasheet) -> None:
        super().__init__(datasheet, twenty_four(gimbals_of(datasheet)))
