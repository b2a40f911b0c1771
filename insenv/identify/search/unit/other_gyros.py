"""A gyro of a unit at rest in its own axis that was turned in the hand about another one.

    r = c_x w_x + c_y w_y + c_z w_z

of the rates that the other gyros read: a coupling of the axes has that, and so has a turn about an axis that leans by
c, which only a table tells apart. It is said and has no name, and lines of such a turn are none of the gyro.
"""

from __future__ import annotations

import math

import numpy as np

from insenv.core.units import DEG
from insenv.effects.cross import CrossAxis
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.search.scan import likelihood_ratio, log_significance, reference, term_freedom
from insenv.identify.search.unit.real_motion import covered_by, turned_by_a_table

#: What means over a second of another gyro cover where the unit turns [rad/s], and the probability of chance below
#: which a gyro follows it.
TURNS, CERTAIN = 2 * DEG, 1e-6


def beside_other_gyros(problem: Problem, fit: Fit) -> Fit | None:
    """The fit without lines, and with a part of what the other gyros read of a unit that turned in the hand.

    None where it did not, where a table tells how it turned, or where the gyro follows none of them.
    """
    found: Fit | None = problem.remember_last("beside other gyros", fit, lambda: _beside(problem, fit))
    return found


def _beside(problem: Problem, fit: Fit) -> Fit | None:
    motions = [e.motion for e in problem.exposures]
    if problem.unit == "m/s^2" or any(map(turned_by_a_table, motions)) or not all(m.cross_rate for m in motions):
        return None
    axes = set.intersection(*(set(m.cross_rate) for m in motions))
    most = max((covered_by(problem, tuple(m.cross_rate[axis] for m in motions), False) for axis in axes), default=0.0)
    if most < TURNS:
        return None
    model = tuple(term for term in fit.model if not term.effect.line)
    base = reference(problem, model, fit.noise.power)
    part = Term(CrossAxis(), ())
    ratio, gained = likelihood_ratio(problem, base, (*model, part))
    if log_significance(ratio, gained, term_freedom(problem, base, part)) > math.log(CERTAIN):
        return None
    return solve(problem, (*model, part), start=fit.noise.power)


def follows_other_gyros(problem: Problem, fit: Fit) -> tuple[str, ...]:
    """That a gyro of a unit that turned in the hand follows another one, and by how much."""
    found = beside_other_gyros(problem, fit)
    if found is None:
        return ()
    own = np.flatnonzero(found.design.term == len(found.model) - 1)
    best = max(own, key=lambda j: abs(float(found.theta[j])) / max(float(found.sd[j]), 1e-300))
    axis = found.design.labels[best][1].removeprefix("c_")
    return (
        f"{problem.target} follows gyro_{axis}, {found.theta[best]:.3g} ± {found.sd[best]:.1g} of it: a coupling of "
        "their axes, or a turn about an axis between them, which only a table tells apart",
    )
