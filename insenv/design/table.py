"""What the procedures of a turntable have in common: rates that are held for whole steps."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from insenv.core.errors import InputError
from insenv.design.kind import Course
from insenv.design.texts import text
from insenv.information.table_motion import Course as Rates
from insenv.plants.profile import Profile
from insenv.scenario import Scenario


def scenario_course(scenario: Scenario, steps: Profile) -> Course | None:
    """Time and rate of each of the ``steps`` of the scenario's profile; None where it has none.

    Raises
    ------
    InputError
        If the profile has a sine, which an environment cannot be told.
    """
    if scenario.table.profile is None:
        return None
    pieces, left = [], scenario.duration
    for piece in steps:
        if piece.amplitude:
            raise InputError(f"{scenario.path}: profile.kind = 'sine' is not played in steps; wanted steady rates")
        held = min(piece.duration, left)
        if held > 0:
            pieces.append((held, piece.rate))
        left -= held
    if left > 1e-9:
        pieces.append((left, pieces[-1][1]))
    return tuple(pieces)


def length(course: Course) -> float:
    """Of a course [s]."""
    return float(sum(time for time, _ in course))


def profile(course: Course) -> dict[str, object]:
    """The ``[profile]`` of a course."""
    return {"kind": "steps", "steps": [[text(time, "s", 12), text(rate, "deg/s")] for time, rate in course]}


def rates(course: Course) -> Rates:
    """As `insenv.information.table_motion` takes it."""
    starts = np.cumsum([0.0, *(time for time, _ in course)])
    return Rates(tuple(starts[:-1].tolist()), tuple(rate for _, rate in course))


def whole(times: Iterable[float], step: float, total: float) -> list[float]:
    """Times [s] with their ends at the nearest whole steps, ``total`` in all."""
    ends = np.rint(np.cumsum(list(times)) / step)
    ends[-1] = round(total / step)
    return (np.diff(ends, prepend=0.0) * step).tolist()
