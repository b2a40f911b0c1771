r"""What a unit at rest shows of other channels where it is shaken: its own noise is louder there too.

A specific force, a rate about another axis or a vibration of a unit at rest is there when somebody moves it, and then
the channel that is asked is shaken as well. With the noise of the quiet rows a curve that lives in the loud ones would
be told from them at once. So the variance of its coefficient is that of its scores (`insenv.identify.fit.swings`) in
bins and in windows of a few seconds, and its deviate is smaller by the square root of what that is larger. What lies in
fewer than `ENOUGH` of these windows is one event, of which no law is told.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import ndtri_exp

from insenv.core.series.tails import log_tail_of_t
from insenv.identify.fit.problem import Problem
from insenv.identify.fit.swings import by_seconds, windows_of
from insenv.identify.search.scan import Hit, Reference, beside

#: Largest p-value at which an effect is worth the test.
WORTH = 0.05
#: Windows in which an effect is told by more than one event.
ENOUGH = 4.0
#: What of other channels a unit at rest is exposed to only where it is moved.
OF_OTHERS = ("force", "cross_rate", "vibration")


def beside_shaking(problem: Problem, base: Reference, hit: Hit) -> Hit:
    """The hit with its deviate as it is where the rows that tell it are louder than others.

    Parameters
    ----------
    problem : Problem
    base : Reference
        The model without it, its noise by plain likelihood.
    hit : Hit
    """
    others = any(need.partition(".")[0] in OF_OTHERS for need in hit.candidate.effect.needs)
    if not others or problem.turns or problem.in_points or hit.log_p >= np.log(WORTH):
        return hit
    span, size, _ = np.linalg.svd(beside(problem, base, hit.term), full_matrices=False)
    span = span[:, size > 1e-6 * size.max(initial=1e-300)]
    data = problem.data() / base.root
    data = data - base.basis @ (base.basis.T @ data)
    curve = span @ (span.T @ data)
    if windows_of(problem, curve) < ENOUGH:
        return replace(hit, deviate=-np.inf, remark="told by a few seconds alone, in which the unit was moved")
    factor, freedom = by_seconds(problem, curve, data - curve)
    return replace(hit, deviate=min(hit.deviate, _normal(hit.deviate / float(np.sqrt(factor)), freedom)))


def _normal(t: float, freedom: float) -> float:
    """The normal deviate as rare as Student's t."""
    tail = log_tail_of_t(t, freedom) if np.isfinite(freedom) else -np.inf
    return float(-ndtri_exp(min(tail, -1e-12))) if np.isfinite(tail) else t
