r"""Whether what was found in all runs together is in each of them: a law of an instrument is the same in every run.

A curve of the rate (a cubic, a local anomaly) is fitted once more with a coefficient of its own in each run, c_r with
the standard deviation s_r. Beyond chance their scatter is that of something else which differs from run to run: the
gain, the lag, how fast the table moved. The coefficient is then worth what a mean over runs that scatter is worth,

    Q = sum_r (c_r - c)^2 / s_r^2,      t^2 = max(0, (Q - (k - 1)) / (sum w - sum w^2 / sum w)),      w = 1 / s_r^2
    c = sum_r c_r v_r / sum v,  v_r = 1 / (s_r^2 + t^2),      z = c sqrt(sum v)

Each c_r stands beside a level of the run: of a steady rate a run tells nothing but one number, which is no coefficient.

Beside a reference that comes late, through a filter that nobody knows exactly, runs of other frequencies have other
gains, and a curve of the rate over all runs is what those gains leave: it must also be LEAST of its deviations beside a
gain of its own in each run.

Source: R. DerSimonian and N. Laird, Meta-analysis in clinical trials, Controlled Clinical Trials 7 (1986) 177.

A line that only one of several runs has while a table turns is how the table shook in it: the instrument was the same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import chdtrc

from insenv.core.recording import Floats
from insenv.effects.bias import Bias
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.problem import Problem, Term

#: Probability of such a scatter by chance, below which there is one; deviate that the mean over runs must have then.
CHANCE, LEAST = 1e-2, 3.0
#: Share of the line's largest amplitude that a run must be able to show, in this many standard deviations.
SHOWN, TOLD = 0.5, 3.0


def not_in_all_runs(problem: Problem, fit: Fit, term: Term) -> str:
    """Why ``term`` beside the model of ``fit`` is no law: it is not the same in the runs; empty if it is one.

    Parameters
    ----------
    problem : Problem
    fit : Fit
        The model without it.
    term : Term
    """
    effect = term.effect
    if len({b.run for b in problem.fitted}) < 2 or effect.generic:
        return ""
    if effect.line:
        moving = problem.turns
        return _of_one_run(problem, fit, term) if moving and term.per_run else ""
    curve = effect.of_rate and not (effect.of_time or effect.of_run or term.per_run) and len(effect.linear) == 1
    # A shape that is right only nearly makes the runs differ by itself; beside a late reference the lag does so more.
    if not curve or (effect.shapes and not any(e.motion.lag for e in problem.exposures)):
        return ""
    if (beside := _beside_gains(problem, fit, term)) is not None and beside < LEAST:
        return "its size is not told beside a gain of its own in each run, as a reference that comes late may make it"
    # A run of one steady rate tells a level, and no coefficient beside it.
    model = (*fit.model, Term(Bias(), per_run=True), replace(term, per_run=True))
    each = solve(problem, model, start=fit.noise.power)
    own = np.flatnonzero(each.design.term == len(model) - 1)
    values, deviations = each.theta[own], each.sd[own]
    if len(own) < 2 or scattered(values, deviations)[0] > CHANCE or scattered(values, deviations)[1] > LEAST:
        return ""
    size = float(np.max(np.abs(values)))
    told = ", ".join(f"{c / size:.2g} ± {s / size:.1g}" for c, s in zip(values, deviations, strict=True))
    return f"not the same in the runs, as the law of an instrument would be: {told} of its largest"


def _beside_gains(problem: Problem, fit: Fit, term: Term) -> float | None:
    """Deviate of a curve's coefficient beside a gain of its own in each run; None where no reference comes late."""
    scale = [one for one in fit.model if one.effect.id == "scale_factor" and not one.per_run]
    if not scale or not any(e.motion.lag for e in problem.exposures):
        return None
    free = tuple(replace(one, per_run=True) if one in scale else one for one in fit.model)
    each = solve(problem, (*free, term), start=fit.noise.power)
    own = np.flatnonzero(each.design.term == len(free))
    return float(np.max(np.abs(each.theta[own]) / each.sd[own])) if len(own) else None


def scattered(values: Floats, deviations: Floats) -> tuple[float, float]:
    """Probability of the scatter of the runs' coefficients by chance, and the deviate of their mean beside it."""
    w = 1 / deviations**2
    mean = float(values @ w / w.sum())
    q, free = float((values - mean) ** 2 @ w), len(values) - 1
    between = max(0.0, (q - free) / float(w.sum() - w @ w / w.sum()))
    v = 1 / (deviations**2 + between)
    return float(chdtrc(free, q)), float(abs(values @ v) / np.sqrt(v.sum()))


def _of_one_run(problem: Problem, fit: Fit, term: Term) -> str:
    """Why a line is none: one run alone has it, and others would show it."""
    each = solve(problem, (*fit.model, term), start=fit.noise.power)
    own = np.flatnonzero(each.design.term == len(fit.model))
    runs = sorted({each.design.labels[j][1].partition("[")[2] for j in own})
    parts = [[j for j in own if each.design.labels[j][1].partition("[")[2] == run] for run in runs]
    amplitude = np.array([float(np.linalg.norm(each.theta[j])) for j in parts])
    deviation = np.array([float(np.max(each.sd[j])) for j in parts])
    able = TOLD * deviation < SHOWN * amplitude.max()
    has = amplitude > TOLD * deviation
    if int(has.sum()) > 1 or int((able & ~has).sum()) < 1:
        return ""
    return f"in one of {len(parts)} runs only: the table shook so, or what stands beside it"
