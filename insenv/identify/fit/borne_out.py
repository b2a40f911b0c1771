"""Whether the held-out rows of a unit at rest bear out the sizes that the fitted rows tell.

A walk of the noise that is fitted where the fitted rows have little of what drives a bias takes most of it: of a gyro
that cools by 4 K in a night 0.02 deg/s/K by the fitted rows, with a deviation of 0.008, and 0.051 +- 0.002 by all.
With c_f +- s_f by the fitted rows and c_a +- s_a by all, noise fitted to all of them,

    z = (c_f - c_a) / sqrt(s_f^2 + s_a^2),

which overstates the variance of the difference, for all rows hold the fitted ones. Beyond `SURE` the difference is an
error that the fit does not know of, and is added to the deviation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from insenv.core.quantities import unit_for
from insenv.identify.findings import Estimate
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.fit.uncertainty import estimates

#: Deviations from which on the two differ: in one of 2000 recordings by chance.
SURE = 3.5

Own = Mapping[Term, tuple[Estimate, ...]]


def borne_out(problem: Problem, fit: Fit, own: Own) -> tuple[dict[Term, tuple[Estimate, ...]], tuple[str, ...]]:
    """The estimates of a unit at rest no surer than all rows bear them out, and a word of each that they do not."""
    found, said = dict(own), []
    asked = [term for term in own if not term.effect.generic and term.effect.part != "level" and term in fit.model]
    if problem.turns or not asked or not problem.held_out:
        return found, ()
    named = fit.named
    whole = problem.all_fitted()
    by_all = estimates(whole, solve(whole, named))
    for term in asked:
        rows = []
        for row in own[term]:
            other = next((o for o in by_all.get(term, ()) if o.parameter == row.parameter), None)
            off = 0.0 if other is None else row.value - other.value
            if other is None or not abs(off) > SURE * math.hypot(row.sd, other.sd) > 0:
                rows.append(row)
                continue
            rows.append(replace(row, sd=math.hypot(row.sd, off)))
            all_rows, fitted = (unit_for(row.unit, one.value).show_with_sd(one.value, one.sd) for one in (other, row))
            said.append(
                f"{row.effect} {row.parameter} = {all_rows} by all rows, and {fitted} by the fitted ones: these do not "
                "foretell the others, and the deviation that is stated has the difference in it"
            )
        found[term] = tuple(rows)
    return found, tuple(said)
