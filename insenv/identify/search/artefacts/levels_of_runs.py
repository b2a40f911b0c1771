r"""Effects that several runs tell by their levels alone: the soaks of a chamber, the rates of a table with a file each.

Where the n levels scatter about a model and an effect as noise within the runs does not (`insenv.identify.fit.scatter`)
the effect is told by n numbers. With S_0 and S_1 their sums of squares without and with its k coefficients, each
weighted by 1 / (v_r + s^2),

    F = ((S_0 - S_1) / k) / (S_1 / (n - p))

and so is the last power of a polynomial beside the others.

A gain that goes with the temperature, of runs that are each at one temperature, is told by the gains of the runs so:
each with a gain, and a lag, of its own, against the mean excess of the temperature in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from insenv.core.recording import Floats
from insenv.effects.rate.scale import ScaleFactor
from insenv.effects.timing import TimingSkew
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.fit.scatter import (
    ANEW,
    Levels,
    at_one_temperature,
    chance_of_columns,
    has_one_level,
    levels,
    means_of_runs,
    of_each_run,
    told_between,
)
from insenv.identify.search.scan import deviate, likelihood_ratio, reference

#: Runs from which on their levels are asked, and gains tell anything.
FEWEST, FEWEST_GAINS = 5, 4
#: Chance of a scatter up to which there is one, and of an effect by n levels up to which it is told by them; where they
#: agree beside it, but for being few; and of a curve without a cause, of which many forms are tried.
SCATTER, CHANCE, FEW_AGREE, OF_A_CURVE = 1e-3, 1e-3, 1e-2, 1e-4
#: Deviations beside a level of each run from which on an effect is told within the runs.
WITHIN = 4.0


def not_told_by_levels(problem: Problem, fit: Fit, term: Term) -> str:
    """Why an effect is not told from how the levels of runs scatter; empty if it is.

    Parameters
    ----------
    problem : Problem
    fit : Fit
        The model without it.
    term : Term
    """
    if len(problem.exposures) < FEWEST or not has_one_level(problem, fit.model) or term.per_run or term.effect.line:
        return ""
    larger = solve(problem, (*fit.model, term), start=fit.noise.power)
    found = levels(problem, larger)
    level = found.left + means_of_runs(problem, larger.predicted()[:, None])[found.run, 0]
    told = _by_numbers(replace(found, left=level), _smaller(problem, fit, found.columns, term), term.effect.generic)
    return "" if not told or _told_within(problem, fit, term) else f"it is told by the levels of {told}"


def between_runs(problem: Problem, term: Term) -> bool:
    """Whether an effect is a gain that goes with the temperature, and each of several runs is at one."""
    return term.effect.of_rate and "temperature" in term.effect.needs and at_one_temperature(problem)


def not_told_by_gains(problem: Problem, fit: Fit, term: Term) -> str:
    """Why a gain that goes with the temperature is not told from how gains of runs scatter; empty if it is.

    Parameters
    ----------
    problem : Problem
        Of runs that are each at one temperature.
    fit : Fit
        The model without it.
    term : Term
    """
    own = Term(ScaleFactor(), per_run=True)
    rest = tuple(one for one in fit.model if not isinstance(one.effect, ScaleFactor | TimingSkew))
    each = solve(problem, (*rest, own, Term(TimingSkew(), per_run=True)), start=fit.noise.power)
    gain, sd, run = of_each_run(each, len(rest))
    if len(run) < FEWEST_GAINS:
        return f"it is told by the gains of {len(run)} runs alone"
    u, column = problem.columns(Term(ScaleFactor()))[:, 0], problem.columns(term)[:, 0]
    excess = [float(u[of] @ column[of] / (u[of] @ u[of])) for of in (problem.bins.run == r for r in run)]
    columns = np.column_stack([np.ones(len(run)), np.subtract(excess, np.mean(excess))])
    told = _by_numbers(Levels(gain, sd, columns, run), [1], False)
    return f"it is told by the gains of {told}" if told else ""


def _by_numbers(found: Levels, smaller: Sequence[int], generic: bool) -> str:
    """Why numbers of runs, ``found.left``, do not tell the last of their columns, end of a sentence; empty if they do.

    ``smaller`` are how many of the columns are left without them.
    """
    agree = found.free > 0 and found.chance > SCATTER
    if agree and found.free >= found.columns.shape[1]:
        return ""
    root = np.sqrt(found.sd**2 + found.between)
    times = float(np.sqrt(found.between) / np.median(found.sd))
    p = max(chance_of_columns(found.left / root, found.columns / root[:, None], without) for without in smaller)
    if p < (OF_A_CURVE if generic else FEW_AGREE if agree else CHANCE):
        return ""
    return (
        f"{len(found.left)} runs alone, of which {max(found.free, 0)} are left beside it (p = {p:.1g}, they scatter by "
        f"{np.hypot(1.0, times):.2g} times their noise)"
    )


def _smaller(problem: Problem, fit: Fit, columns: Floats, term: Term) -> list[int]:
    """Numbers of the columns of a larger model that are left without an effect, and without its last power."""
    without = told_between(problem, fit).shape[1]
    powers = getattr(term.effect, "order", 1) > 1 and columns.shape[1] - without > 1
    return [without, columns.shape[1] - 1] if powers else [without]


def _told_within(problem: Problem, fit: Fit, term: Term) -> bool:
    """Whether an effect is significant beside a level of each run."""
    base = reference(problem, (*fit.model, ANEW), fit.noise.power)
    ratio, gained = likelihood_ratio(problem, base, (*fit.model, ANEW, term))
    return bool(gained) and deviate(problem, base, term, ratio, gained) > WITHIN
