"""The Earth's rate of a unit that is turned about an axis that leans: it goes with gravity, as a g-sensitivity does."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.units import DEG_PER_HOUR
from insenv.effects.cross import GSensitivity
from insenv.identify.findings import Estimate
from insenv.identify.fit.problem import Problem, Term


def with_gravity(problem: Problem, own: Mapping[Term, tuple[Estimate, ...]]) -> tuple[str, ...]:
    """A word where all that goes with the specific force is no more than what the Earth's rate can make of an axis.

    A table whose axis leans by a degree turns gravity and the Earth's rate through its horizontal axes alike, at an
    azimuth that no channel tells. Where the angle of the table is known that is a candidate of its own.
    """
    if any(e.motion.angle is not None for e in problem.exposures):
        return ()
    for term, rows in own.items():
        if term.effect.id != GSensitivity.id or term.per_run:
            continue
        size = {row.parameter: row.value for row in rows}
        made = problem.columns(term) @ np.array([size.get(name, 0.0) for name, *_ in problem.names(term)])
        if (covered := float(np.ptp(made))) <= 2 * EARTH_RATE:
            return (
                f"All that goes with the specific force on {problem.target} covers {covered / DEG_PER_HOUR:.2g} deg/h, "
                "and the Earth's rate makes up to 30 deg/h of an axis that is turned about one that leans: these "
                "channels do not tell the two apart, the angle of the table would.",
            )
    return ()
