r"""Several runs of one unit, each at rest or at one rate: whether its bias is the same in all of them.

A bias changes from one power-up to the next, with the temperature, or where the unit was set down anew. Where one bias
is for all runs the noise can take the differences of their levels for its own wander, slower than a run and the larger
for that. With a level of its own for each of n runs beside the model, the noise fitted anew, the likelihood ratio L of
all rows gains n - 1 parameters, and is judged as that of an effect (`insenv.identify.search.scan`): noise that wanders
from run to run does so within the runs.

One run may be off by itself: without it the others agree, and with it they do not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import fdtrc

from insenv.core.quantities import unit_for
from insenv.effects.thermal import BiasTemperature
from insenv.identify.fit.bins import of_one_use
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.fit.scatter import ANEW, Levels, has_one_level, left_of, levels, means_of_runs
from insenv.identify.search.candidates import Candidate
from insenv.identify.search.round import with_term
from insenv.identify.search.scan import Hit, deviate, likelihood_ratio, reference
from insenv.identify.search.tracks import Track

#: Degrees of freedom, and chance of the scatter, of the other runs from which on they agree; deviations of one that is
#: off.
FREE, AGREE, OFF = 3, 1e-2, 6.0
#: Chance of levels that go one way.
BY_CHANCE = 1e-3
#: What may change the bias of all.
ANY_CAUSE = (
    'it may be of each power-up (model.bias = "per-run"), of the temperature, of the table, or of how the unit was set '
    "down"
)


def each_its_own(track: Track) -> Hit | None:
    """A bias of each run beside the model, by all rows; None where one for all was not asked for."""
    problem, model = track.problem, track.fit.model
    if not has_one_level(problem, model) or not track.one_mounting:
        return None
    problem = problem.used_as(of_one_use(problem.bins).blocks)
    base = reference(problem, model, track.fit.noise.power)
    ratio, gained = likelihood_ratio(problem, base, with_term(model, ANEW))
    found = deviate(problem, base, ANEW, ratio, gained)
    return Hit(Candidate(ANEW.effect, (ANEW,)), ANEW, ratio, 1.0, found, gained)


def turned_on_anew(track: Track, alpha: float) -> tuple[str, ...]:
    """That the bias of a unit is not the same in its runs, in words."""
    hit = each_its_own(track)
    if hit is None or hit.log_p >= np.log(alpha):
        return ()
    found = levels(track.problem, track.fit)
    far, exact = float(np.sqrt(np.mean(found.left**2))), float(np.median(found.sd))
    unit = unit_for(track.problem.unit, far)
    return (
        f"the bias is not the same in the runs (p = {hit.p_value:.1g}): they scatter by {unit.show(far)} about the "
        f"model, and are known to {unit.show(exact)}; {_one_off(track, found) or _one_way(found) or ANY_CAUSE}",
    )


def _one_off(track: Track, found: Levels) -> str:
    """Which run is off by itself, the others agreeing beside the model or a law of the temperature; empty if none."""
    for law in (None, *_laws_of_temperature(track.problem)):
        columns = () if law is None else (means_of_runs(track.problem, track.problem.columns(Term(law))),)
        if alone := _without_one(replace(found, columns=np.column_stack([found.columns, *columns]))):
            run, off, sd = alone
            told = unit_for(track.problem.unit, off).show_with_sd(off, sd)
            return f"run {run + 1} is off by {told}, and the others agree{'' if law is None else f' beside {law.key}'}"
    return ""


def _one_way(found: Levels) -> str:
    """That levels go one way from run to run beside the model, by Fisher's F; empty where they do not, or are few."""
    order = np.arange(len(found.left), dtype=np.float64)
    columns = np.column_stack([found.columns, order - order.mean()])
    free = found.free - 1
    if free < FREE:
        return ""
    whole, rest = left_of(found.left, found.columns), left_of(found.left, columns)
    if not rest or fdtrc(1, free, (whole - rest) / (rest / free)) > BY_CHANCE:
        return ""
    return "they go one way from run to run, as a drift over the whole test does"


def _laws_of_temperature(problem: Problem) -> tuple[BiasTemperature, ...]:
    return () if problem.heat() is None else (BiasTemperature(1), BiasTemperature(2))


def _without_one(found: Levels) -> tuple[int, float, float] | tuple[()]:
    """The run without which the others agree, and how far it is from what they foretell, with its deviation."""
    others = [np.arange(len(found.left)) != run for run in range(len(found.left))]
    chances = [found.of(some).chance if found.of(some).free >= FREE else 0.0 for some in others]
    run = int(np.argmax(chances))
    some = found.of(others[run])
    foretold = found.columns[run] @ np.linalg.pinv(some.columns / some.sd[:, None])
    off = float(found.left[run] - foretold @ (some.left / some.sd))
    sd = float(np.hypot(found.sd[run], np.linalg.norm(foretold)))
    return (run, off, sd) if chances[run] > AGREE and abs(off) > OFF * sd else ()
