r"""What no sequence of positions can do better: the search relaxed to a convex problem, with its certificate.

A sequence is a sum of rests and turns. That visits follow each other is left out, and so is all noise but the white,
without which more would be told: `insenv.information.unit.shares` then bounds every sequence of these parts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from insenv.core.estimate import Datasheet
from insenv.core.recording import Floats
from insenv.core.series.allan import WHITE
from insenv.information.positions import Angles, right_angles
from insenv.information.unit.sequence import Planner, neighbours, parameter_of_table
from insenv.information.unit.shares import Shares, shared

#: White noises; others are left out of the bound.
_WHITE = (WHITE, "velocity_random_walk")
#: Steps of a bound, and of a search for the least time.
_STEPS, _BISECTIONS = 1500, 12


@dataclass(frozen=True)
class SequenceBound:
    """Bounds for a unit on its table.

    Attributes
    ----------
    names : tuple of str
        Of the unit's parameters.
    parts : ndarray, shape (k, p * p)
        What a second of each rest and turn tells, in units of the prior deviations.
    """

    names: tuple[str, ...]
    parts: Floats

    def ratio(self, time: float, wanted: Floats, steps: int = _STEPS) -> Shares:
        """Of ``time`` seconds and deviations that are wanted, as shares of the prior, shape (q,)."""
        p = round(float(np.sqrt(self.parts.shape[1])))
        return shared(np.eye(p), self.parts, time, wanted, steps)

    def time(self, wanted: Floats, most: float, steps: int = _STEPS) -> float:
        """Below this time [s] no sequence tells all as wanted; at most ``most``."""
        low, high = 0.0, most
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.ratio(middle, wanted, steps).bound > 1 else (low, middle)
        return low


def sequence_bound(sheet: Datasheet, able: Sequence[Angles] | None = None) -> SequenceBound:
    """Of all rests at ``able`` (none: at right angles) and turns of one axis between them."""
    noise = {
        target: {name: value for name, value in one.items() if name in _WHITE} for target, one in sheet.noise.items()
    }
    planner = Planner(replace(sheet, noise=noise))
    able = right_angles(planner.model.gimbals) if able is None else able
    told = [planner.rest(a) for a in able]
    for a in able:
        for b in neighbours(a, able):
            matrix, time = planner.turn(a, b)
            told.append(matrix / time)
    names = tuple(q.name for q in planner.model.parameters if not parameter_of_table(q.name))
    return SequenceBound(names, np.reshape(told, (len(told), -1)))
