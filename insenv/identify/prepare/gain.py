r"""A gain that nobody declared: a scale factor that is no small error.

Of an axis that points the other way, or leans so far that it sees a fifth of the table's rate, the gain g is fitted
before any search (`insenv.identify.clean.response`), for every other error is relative to it. Where the declared model
has no scale factor that gain is itself what the model lacks,

    y = u + c u + ...,      c = g - 1,      sd^2 = s^2 + (g theta)^2

with theta what is left of a scale factor beside the final model, g s its standard deviation: the rows all alike and the
bins by their noise tell one gain, and it is no surer than they agree. The declared model is judged with a gain of one.
"""

from __future__ import annotations

import math
from dataclasses import replace

from insenv.effects.rate.scale import ScaleFactor
from insenv.identify.findings import Added
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.heldout import Score
from insenv.identify.fit.problem import Model, Problem, Term
from insenv.identify.fit.uncertainty import SCALE, estimates


def is_undeclared(problem: Problem, declared: Model) -> bool:
    """Whether the gain that was fitted is no small error, and the declared model has no scale factor."""
    return problem.gain != 1.0 and not any(term.effect.id == SCALE for term in declared)


def as_declared(problem: Problem, declared: Model) -> Problem:
    """The problem as the declared model sees it: with a gain of one where it has no scale factor."""
    if not is_undeclared(problem, declared):
        return problem
    seen = problem.bins.mean(tuple(e.motion.rate for e in problem.exposures))
    return problem.measured_as(problem.y + (1 - 1 / problem.gain) * seen)


def undeclared_gain(
    problem: Problem, fit: Fit, declared: Model, scores: tuple[Score, Score], alpha: float
) -> tuple[tuple[Added, ...], tuple[str, ...]]:
    """The gain as a finding, and why it is none where it is not told by ``alpha``.

    Neither where it is declared, or what the search has found holds what is left of it.

    Parameters
    ----------
    problem : Problem
    fit : Fit
        The final model.
    declared : tuple of Term
    scores : tuple of Score
        Held-out errors of the declared and of the final model.
    """
    if not is_undeclared(problem, declared) or any(term.effect.id == SCALE for term in fit.model):
        return (), ()
    # A curve of the rate without a cause would hold it.
    term = Term(ScaleFactor())
    rows = estimates(problem, solve(problem, (*fit.named, term), start=fit.noise.power))[term]
    if not rows:
        return (), ()
    (left,) = rows
    value = problem.gain - 1
    row = replace(left, value=value, sd=math.hypot(left.sd, left.value - value))
    p_value = min(1.0, 2 * math.exp(max(log_tail(abs(row.value) / row.sd), -690.0)))
    if p_value > alpha:
        told = f"{1 + row.value:.2g} ± {row.sd:.1g}"
        return (), (f"the gain that the response shows, to which all else is relative, is not told: {told}",)
    found = Added(
        effect=SCALE,
        order=None,
        parameters=(row,),
        p_value=p_value,
        likelihood_ratio=-2 * math.log(max(p_value, 1e-300)),
        confounded_with=(),
        held_out_before=scores[0].rms,
        held_out_after=scores[1].rms,
        remark="seen in the response of the readings; a lag and a held output are relative to that gain",
    )
    return (found,), ()
