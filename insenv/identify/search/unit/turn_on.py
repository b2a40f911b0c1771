r"""Several runs of one unit at rest: whether its bias is the same in all of them.

A bias changes from one power-up to the next, with the temperature, or where the unit was set down anew. Where one bias
was declared for all runs the noise can take the differences of their levels for its own wander, slower than a run and
the larger for that. With a level of its own for each of n runs beside the model, the noise fitted anew, the likelihood
ratio L of all rows gains n - 1 parameters, and is judged as that of an effect (`insenv.identify.search.scan`): noise
that wanders from run to run does so within the runs.
"""

from __future__ import annotations

import numpy as np

from insenv.core.quantities import estimates_in
from insenv.effects.bias import Bias
from insenv.identify.fit.bins import of_one_use
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Term
from insenv.identify.search.candidates import Candidate
from insenv.identify.search.round import with_term
from insenv.identify.search.scan import Hit, deviate, likelihood_ratio, reference
from insenv.identify.search.tracks import Track

#: A bias of each run.
ANEW = Term(Bias(), per_run=True)


def each_its_own(track: Track) -> Hit | None:
    """A bias of each run beside the model, by all rows; None where one for all was not asked for at rest."""
    problem, model = track.problem, track.fit.model
    common = any(term.effect == ANEW.effect and not term.per_run for term in model)
    if len(problem.exposures) < 2 or problem.turns or not common or not track.one_mounting:
        return None
    problem = problem.used_as(of_one_use(problem.bins).blocks)
    base = reference(problem, model, track.fit.noise.power)
    ratio, gained = likelihood_ratio(problem, base, with_term(model, ANEW))
    found = deviate(problem, base, ANEW, ratio, gained)
    return Hit(Candidate(ANEW.effect, (ANEW,)), ANEW, ratio, 1.0, found, gained)


def turned_on_anew(track: Track, alpha: float) -> tuple[str, ...]:
    """That the bias of a unit at rest is not the same in its runs, in words."""
    hit = each_its_own(track)
    if hit is None or hit.log_p >= np.log(alpha):
        return ()
    problem = track.problem
    levels = tuple(ANEW if term.effect == ANEW.effect else term for term in track.fit.model)
    fit = solve(problem, levels)
    own = np.flatnonzero(fit.design.term == levels.index(ANEW))
    told = estimates_in(problem.unit, fit.theta[own].tolist(), fit.sd[own].tolist())
    return (
        f"the bias is not the same in the runs (p = {hit.p_value:.1g}): {told}; it may be of each power-"
        'up (model.bias = "per-run"), of the temperature, or of how the unit was set down',
    )
