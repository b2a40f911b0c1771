r"""Several runs of one unit, each at rest, at one rate or one temperature: whether its bias is the same in all of them.

A bias changes from one power-up to the next, with the temperature, or where the unit was set down anew. Where one bias
is for all runs the noise can take the differences of their levels for its own wander, slower than a run and the larger
for that. With a level of its own for each of n runs beside the model, the noise fitted anew, the likelihood ratio L of
all rows gains n - 1 parameters, and is judged as that of an effect (`insenv.identify.search.scan`): noise that wanders
from run to run does so within the runs.

A run, or a few, may be off: without them the others agree, and with them they do not.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.quantities import unit_for
from insenv.effects.thermal import BiasTemperature
from insenv.identify.fit.bins import of_one_use
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.fit.scatter import ANEW, Levels, chance_of_columns, has_one_level, levels, means_of_runs
from insenv.identify.search.candidates import Candidate
from insenv.identify.search.round import with_term
from insenv.identify.search.scan import Hit, deviate, likelihood_ratio, reference
from insenv.identify.search.tracks import Track

#: Degrees of freedom, and chance of the scatter, of the other runs from which on they agree; deviations of one that is
#: off, and share of all that may be.
FREE, AGREE, OFF, MANY = 3, 1e-2, 6.0, 0.25
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
        f"model, and are known to {unit.show(exact)}; {_few_off(track, found) or _one_way(found) or ANY_CAUSE}",
    )


def _few_off(track: Track, found: Levels) -> str:
    """Which runs are off by themselves, the others agreeing beside the model or a law of the temperature; or empty."""
    for law in (None, *_laws_of_temperature(track.problem)):
        columns = () if law is None else (means_of_runs(track.problem, track.problem.columns(Term(law)))[found.run],)
        if off := _without_few(replace(found, columns=np.column_stack([found.columns, *columns]))):
            unit = track.problem.unit
            each = (
                f"run {run + 1} ({track.labels[run]}) is off by {unit_for(unit, by).show_with_sd(by, sd)}"
                for run, by, sd in off
            )
            return f"{', '.join(each)}, and the others agree{'' if law is None else f' beside {law.key}'}"
    return ""


def _one_way(found: Levels) -> str:
    """That levels go one way from run to run beside the model, by Fisher's F; empty where they do not, or are few."""
    order = found.run.astype(np.float64)
    columns = np.column_stack([found.columns, order - order.mean()])
    if found.free - 1 < FREE or chance_of_columns(found.left, columns, found.columns.shape[1]) > BY_CHANCE:
        return ""
    return "they go one way from run to run, as a drift over the whole test does"


def _laws_of_temperature(problem: Problem) -> tuple[BiasTemperature, ...]:
    return () if problem.heat() is None else (BiasTemperature(1), BiasTemperature(2))


def _without_few(found: Levels) -> list[tuple[int, float, float]]:
    """The runs without which the others agree, how far each is from what they foretell, and the deviation of that.

    One after the other the run is left out without which the others scatter least: `MANY` of all at most.
    """
    stay = np.ones(len(found.left), bool)
    while found.of(stay).free > FREE and (~stay).sum() < max(1, int(MANY * len(stay))):
        runs = np.flatnonzero(stay)
        scatters = [found.of(stay & (np.arange(len(stay)) != run)).scatter for run in runs]
        stay[runs[int(np.argmin(scatters))]] = False
        if found.of(stay).chance > AGREE:
            off = [_foretold(found, stay, int(run)) for run in np.flatnonzero(~stay)]
            return off if all(abs(by) > OFF * sd for _, by, sd in off) else []
    return []


def _foretold(found: Levels, stay: NDArray[np.bool_], run: int) -> tuple[int, float, float]:
    """A run, how far it is from what those that stay foretell, and the deviation of that."""
    some = found.of(stay)
    foretold = found.columns[run] @ np.linalg.pinv(some.columns / some.sd[:, None])
    off = float(found.left[run] - foretold @ (some.left / some.sd))
    return int(found.run[run]), off, float(np.hypot(found.sd[run], np.linalg.norm(foretold)))
