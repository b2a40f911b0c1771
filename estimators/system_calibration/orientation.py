"""Positions chosen for what they tell: the next best by the second, and a whole sequence that was searched for.

As the model is linear and Gaussian, what a position tells depends on no datum: both know all their positions before
the first measurement (`insenv.information.unit.sequence`). What is measured is passed over.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from estimators.system_calibration.positions import Positions, gimbals_of
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.unit.gimbals import turn_time
from insenv.information.positions import nineteen
from insenv.information.unit.calibration import UnitModel
from insenv.information.unit.sequence import Planner, Visit, designed, even, greedy, parameter_of_table


class PlannedVisits(Positions):
    """A policy that goes through visits with rests of their own.

    Parameters
    ----------
    datasheet : Datasheet
    visits : sequence of Visit
    """

    def __init__(self, datasheet: Datasheet, visits: Sequence[Visit]) -> None:
        super().__init__(datasheet, [visit.angles for visit in visits])
        steps = np.diff(np.concatenate([np.zeros((1, self.angles.shape[1])), self.angles]), axis=0)
        turning = turn_time(steps, datasheet.limits.rate, datasheet.limits.acceleration).sum(axis=-1)
        ends = np.cumsum(turning + [visit.dwell for visit in visits])
        self.ends = ends * datasheet.duration / ends[-1]


class GreedyOrientation(PlannedVisits):
    """At each position the neighbour, one axis further, whose turn and rest tell most of all parameters by the second.

    Parameters
    ----------
    datasheet : Datasheet
    dwell : float
        Rest at each [s].
    """

    def __init__(self, datasheet: Datasheet, dwell: float = 20.0) -> None:
        super().__init__(datasheet, greedy(Planner(checked(datasheet)), datasheet.duration, dwell))


class HorizonOrientation(PlannedVisits):
    """As `GreedyOrientation`, by what several positions tell together: the first of the best way is taken.

    Parameters
    ----------
    datasheet : Datasheet
    dwell : float
        Rest at each [s].
    ahead : int
        Positions that are looked at together.
    """

    def __init__(self, datasheet: Datasheet, dwell: float = 20.0, ahead: int = 2) -> None:
        super().__init__(datasheet, greedy(Planner(checked(datasheet)), datasheet.duration, dwell, ahead))


class DesignedSequence(PlannedVisits):
    """A sequence that was searched for: all parameters better than after the 19 published positions in the same time.

    Parameters
    ----------
    datasheet : Datasheet
    tries : int
        Sequences that are tried.
    """

    def __init__(self, datasheet: Datasheet, tries: int = 1000) -> None:
        planner, time = Planner(checked(datasheet)), datasheet.duration
        units = np.array([not parameter_of_table(p.name) for p in planner.model.parameters])
        wanted = None
        with suppress(InputError):  # of a table that cannot turn through them: then the sum of logarithms
            wanted = planner.deviations(even(planner, nineteen(gimbals_of(datasheet)), time), time)[units]
        super().__init__(datasheet, designed(planner, time, wanted, tries))


def checked(datasheet: Datasheet) -> Datasheet:
    """The datasheet, if a model can be made of it; raises InputError."""
    UnitModel(datasheet)
    return datasheet
