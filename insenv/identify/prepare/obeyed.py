r"""Whether a unit did what it was told, where that is all that is known of its motion.

    y = b + (1 + c) u(t - tau) + e,        sum e^2 <= `LEFT` max(sum (y - mean y)^2, sum u^2)

by plain least squares. At one rate for all the time nothing but noise is left beside the mean of the reading, and that
no command foretells; the rate itself, the sum of u^2, was done as told. A table follows its command but for the ramps,
which are left out; a craft flies a course, a robot drives a speed, as well as it can. What it did not do is as large as
a third of what it did, comes back with every lap and goes with the rate: no law of the rate or of the angle is told
beside it.
"""

from __future__ import annotations

import numpy as np

from insenv.effects.bias import Bias
from insenv.effects.rate.scale import ScaleFactor
from insenv.effects.timing import TimingSkew
from insenv.identify.fit.problem import Problem, Term, design
from insenv.identify.prepare.bounded import least_squares, turned, unexplained

#: Share of the power of the reading that a command may leave.
LEFT = 0.05


def disobeyed(problem: Problem) -> float:
    """Share of the power of a gyro's reading that gain, level and lag of a command leave; 0 where it may be the gyro's.

    Beside a reference that was measured it is not asked.
    """
    if not problem.commanded or not problem.turns or not problem.target.startswith("gyro"):
        return 0.0
    share: float = problem.remember("disobeyed", lambda: _share(problem))
    return share if share > LEFT else 0.0


def _share(problem: Problem) -> float:
    level = (Term(Bias()),)
    own = design(problem, (*level, Term(ScaleFactor()), Term(TimingSkew(), per_run=True))).transformed
    told = float(np.sum(turned(problem) ** 2))
    return least_squares(own, problem.data())[1] / max(unexplained(problem, level), told, 1e-300)
