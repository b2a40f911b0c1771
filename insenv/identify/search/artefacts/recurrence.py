r"""Whether what was found in all runs together is in each of them: a law of an instrument is the same in every run.

A curve of the rate (a cubic, a local anomaly) is fitted once more with a coefficient of its own in each run, c_r with
the standard deviation s_r. Beyond chance their scatter is that of something else which differs from run to run: the
gain, the lag, how fast the table moved. The coefficient is then worth what a mean over runs that scatter is worth
(`insenv.identify.fit.scatter`).

Each c_r stands beside a level of the run: of a steady rate a run tells nothing but one number, which is no coefficient.

Beside a reference that comes late, through a filter that nobody knows exactly, runs of other frequencies have other
gains, and a curve of the rate over all runs is what those gains leave: it must also be LEAST of its deviations beside a
gain and a lag of its own in each run.

What a filter, a soft mount or a motor that swings after a reversal leaves goes with the change of the rate as well. A
law of the rate is the same at one rate whether the table speeds up or slows down: with a coefficient of its own in
either, the two scatter as those of runs do.

Of a vehicle that stands, an attitude that is estimated wanders by itself, and no gyro with it: a dead band, a
lock-in or an asymmetry would explain that. A curve of which all lies in one or two such rests is no law.

What differs from the model in one or two means alone is no law either: of a table that turns round once a step of the
bias at that instant is the scale factor but for the mean in which it turned, and what that one holds would decide all.

A line that only one of several runs has while a table turns is how the table shook in it: the instrument was the same.
One that stands in a part of a run alone is what rang there: a tone has one amplitude.
"""

from __future__ import annotations

from dataclasses import replace
from math import comb

import numpy as np
from scipy.special import chndtr

from insenv.core.recording import Floats
from insenv.core.series.stretches import stretches
from insenv.effects.base import Effect
from insenv.effects.bias import Bias
from insenv.effects.rate.hysteresis import ScaleFactorHysteresis
from insenv.effects.rate.lag import SelfHeating
from insenv.effects.rate.scale import ScaleFactor
from insenv.effects.timing import TimingSkew
from insenv.identify.fit.gls import Fit, noise_beside, solve, spectrum
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import Model, Problem, Term, design
from insenv.identify.fit.scatter import scatter
from insenv.identify.fit.swings import by_swings
from insenv.identify.prepare.spectral.lines import whitened_series
from insenv.identify.search.scan import Reference, deviate, likelihood_ratio, reference

#: Probability of such a scatter by chance, below which there is one; deviate that the mean over runs must have then.
CHANCE, LEAST = 1e-2, 3.0
#: Share of the largest rate below which a table may rest, bins of a rest at least, and share of what a reference
#: wanders there up to which its mean is nothing; share of what a curve explains that is all of it, and how many rests
#: tell no law.
RESTS, LONG, ABOUT_ZERO, ALL_OF_IT, FEW = 0.03, 8, 0.5, 0.9, 2
#: Effects that know which way the rate changes, as a response does (`Effect.of_response`), though they are none.
OF_HISTORY = (ScaleFactorHysteresis.id, SelfHeating.id)
#: Change of the rate, in its root mean square, up to which a table turns steadily.
STEADY = 0.1
#: Parts of a run in which a line is looked at, fewest bins and waves of each; share of the line's energy that the
#: quieter half of them has at most, and probability of that of a steady line, where it comes and goes.
PARTS, FEWEST_BINS, CYCLES, LEFT, CHANCE_OF_PART = 8, 8, 2.0, 0.05, 1e-3
#: Means that a law must differ in from the model: (sum of squares)^2 over sum of fourth powers of what is left of it;
#: and a course of time beside a reference, which may begin as a body does that is set in motion.
FEWEST_MEANS, FEWEST_COURSE = 3.0, 6.0
#: Share of the fitted means within which the rate changes once, part of what tells a curve that lies there, and times
#: the usual change of the rate from mean to mean that are quick.
ONE_CHANGE, TOLD_THERE, QUICK = 0.03, 0.7, 3.0
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
    curve, late = _curve_of_rate(effect, term), _late(problem, fit.model)
    if curve and late and not _knows_change(effect) and _beside_response(problem, fit, term) < LEAST:
        runs = " of its own in each run" if len({b.run for b in problem.fitted}) > 1 else ""
        return f"its size is not told beside a gain and a lag{runs}, as a reference that comes late may make them"
    if len({b.run for b in problem.fitted}) < 2 or effect.generic:
        return ""
    if effect.line:
        moving = problem.turns
        return _of_one_run(problem, fit, term) if moving and term.per_run else ""
    # A shape that is right only nearly makes the runs differ by itself; beside a late reference the lag does so more.
    if not curve or (effect.shapes and not late):
        return ""
    # A run of one steady rate tells a level, and no coefficient beside it.
    model = (*fit.model, Term(Bias(), per_run=True), replace(term, per_run=True))
    each = solve(problem, model, start=fit.noise.power)
    own = np.flatnonzero(each.design.term == len(model) - 1)
    values, deviations = each.theta[own], each.sd[own]
    if len(own) < 2 or not _differ(values, deviations):
        return ""
    size = float(np.max(np.abs(values)))
    told = ", ".join(f"{c / size:.2g} ± {s / size:.1g}" for c, s in zip(values, deviations, strict=True))
    return f"not the same in the runs, as the law of an instrument would be: {told} of its largest"


def of_few_means(problem: Problem, fit: Fit, term: Term) -> str:
    """Why a curve is no law: all that tells it from the model is one mean or two; empty if more do.

    What knows how the rate changes is told where it does, be that one instant.

    Parameters
    ----------
    problem : Problem
    fit : Fit
        The model without it.
    term : Term
    """
    if _knows_change(term.effect):
        return ""
    fitted = ~problem.bins.held_out
    design, columns = fit.design.matrix[fitted], problem.columns(term)[fitted]
    left = _outside(design, columns)
    energy = np.sum(left**2, axis=1)
    means = float(energy.sum()) ** 2 / max(float(energy @ energy), 1e-300)
    if means < (FEWEST_COURSE if problem.turns and term.effect.of_time and term.effect.shapes else FEWEST_MEANS):
        return f"it differs from what the model has in {means:.2g} means alone, and what these hold would decide it"
    if lasts := _of_one_change(problem, energy):
        return (
            f"it differs from what the model has within {lasts:.2g} s alone, in which the rate changes once: a lag or "
            "a filter would as well"
        )
    return ""


def _of_one_change(problem: Problem, energy: Floats) -> float:
    """Time within which what tells a curve lies [s], if it is one quick change of the rate; 0 if it is more.

    A table that goes at two rates tells their gain and level, and a third parameter by its way from one to the other.
    """
    if not problem.turns or not problem.target.startswith("gyro"):
        return 0.0
    whole, length = max(float(energy.sum()), 1e-300), max(int(ONE_CHANGE * len(energy)), 1)
    held = np.cumsum(np.concatenate([[0.0], energy]))
    if float(np.max(held[length:] - held[:-length])) < TOLD_THERE * whole:
        return 0.0
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))[~problem.bins.held_out]
    quick = np.abs(np.gradient(u))
    told_by = float(quick @ energy) / whole
    return length * problem.bins.width if told_by > QUICK * np.sqrt(np.mean(quick**2)) else 0.0


def comes_and_goes(problem: Problem, fit: Fit, term: Term) -> str:
    """Why a line is no tone: it stands in a part of a run alone, as what rings after a push; empty if it is one.

    Of the whitened residual of the model without it the energies of the line in `PARTS` parts of the run that has most
    of it are s_k = |sum r exp(-i w t)|^2 / n, which a line of one amplitude would have alike: 2 s_k is chi-square on
    two degrees, not central by 2 S / K, S = sum s_k - K. The quieter half of them tells.

    Parameters
    ----------
    problem : Problem
    fit : Fit
        The model without it.
    term : Term
    """
    if not term.effect.line:
        return ""
    energies = [_energies(problem, fit, run, term.shape[0]) for run in sorted({b.run for b in problem.fitted})]
    own = max((e for e in energies if len(e)), key=lambda e: float(e.sum()), default=np.empty(0))
    total = float(own.sum()) - len(own)
    if total <= 0:
        return ""
    half = len(own) // 2
    quiet = float(np.sort(own)[:half].sum())
    if quiet - half > LEFT * total:
        return ""
    chance = comb(len(own), half) * float(chndtr(2 * quiet, 2 * half, 2 * half * total / len(own)))
    if not chance < CHANCE_OF_PART:
        return ""
    return f"in a part of the time alone: half of it has {max(quiet - half, 0.0) / total:.0%} of its power"


def _energies(problem: Problem, fit: Fit, run: int, frequency: float) -> Floats:
    """Energy of a line in each of `PARTS` parts of a run's fitted bins, in units of the noise's; none of short ones."""
    series, time = whitened_series(problem, fit, run)
    if len(series) // PARTS < FEWEST_BINS or float(np.ptp(time)) * frequency < PARTS * CYCLES:
        return np.empty(0)
    waves = series * np.exp(-2j * np.pi * frequency * time)
    return np.array([abs(part.sum()) ** 2 / len(part) for part in np.array_split(waves, PARTS)])


def not_both_ways(problem: Problem, fit: Fit, base: Reference, term: Term) -> str:
    """Why a curve of the rate beside a late reference is no law: it knows which way the rate changes; empty if not.

    Parameters
    ----------
    problem : Problem
    fit : Fit
        The model without it.
    base : Reference
        The same with its noise by plain likelihood.
    term : Term
    """
    effect = term.effect
    if not _curve_of_rate(effect, term) or _knows_change(effect) or not _late(problem, fit.model):
        return ""
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))
    faster = problem.bins.change(np.abs(u))
    steady = np.abs(faster) < STEADY * float(np.sqrt(np.mean(faster**2)))
    up = faster > 0  # at the turning points of a swing, too, or a jump there is all that is seen
    ways = np.column_stack([up & ~steady, ~up & ~steady, up & steady, ~up & steady])
    columns, data = _beside_own_noise(problem, base, transform(problem.fitted, problem.columns(term) * ways))
    theta = np.asarray(np.linalg.lstsq(columns, data, rcond=1e-10)[0], np.float64)
    left = data - columns @ theta
    cov = np.linalg.pinv(columns.T @ columns, hermitian=True)
    deviations = np.array([np.sqrt(cov[k, k] * by_swings(problem, columns[:, k], left)[0]) for k in (0, 1)])
    if not np.all(deviations > 0) or not theta[:2].any():
        return ""
    if not _differ(theta[:2], deviations):
        return ""
    size = float(np.max(np.abs(theta[:2])))
    told = " and ".join(f"{c / size:.2g} ± {s / size:.1g}" for c, s in zip(theta[:2], deviations, strict=True))
    return f"not the same where the table speeds up and slows down, as a law of the rate would be: {told} of the larger"


def _beside_own_noise(problem: Problem, base: Reference, columns: Floats) -> tuple[Floats, Floats]:
    """Columns and data, whitened by the noise that is left beside the columns and the model, both beside the model."""
    own = design(problem, base.model)
    size = np.sqrt(np.mean(columns**2, axis=0))
    free, prior = columns[:, size > 0] / size[size > 0], np.concatenate([np.zeros(int((size > 0).sum())), own.prior])
    noise = noise_beside(problem, np.column_stack([free, own.transformed]), prior, False, base.noise.power)
    root = np.sqrt(spectrum(problem, noise.power))
    basis = np.linalg.qr(own.transformed / root[:, None])[0]
    white = np.column_stack([problem.data(), columns]) / root[:, None]
    white -= basis @ (basis.T @ white)
    return white[:, 1:], white[:, 0]


def _differ(values: Floats, deviations: Floats) -> bool:
    """Whether coefficients scatter beyond chance, and their mean is worth nothing then."""
    found = scatter(values, deviations)
    return found.chance <= CHANCE and found.deviate <= LEAST


def of_a_rest(problem: Problem, fit: Fit, term: Term) -> str:
    """Why a curve of the rate is no law: it explains how the reference wanders at rest, and no more; empty if not.

    Parameters
    ----------
    problem : Problem
    fit : Fit
        The model without it.
    term : Term
    """
    if problem.commanded or not _curve_of_rate(term.effect, term):
        return ""
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))
    fitted = np.zeros(len(u), bool)
    for block in problem.fitted:
        fitted[block.start : block.stop] = True
    slow = stretches(fitted & (np.abs(u) < RESTS * float(np.abs(u).max())))
    wanders = [
        (a, b) for a, b in slow if b - a >= LONG and abs(u[a:b].mean()) < ABOUT_ZERO * np.sqrt(np.mean(u[a:b] ** 2))
    ]
    if not 0 < len(wanders) <= FEW:
        return ""
    design, column = fit.design.matrix[fitted], problem.columns(term)[fitted, 0]
    column = _outside(design, column)
    left = (problem.y - fit.predicted())[fitted]
    size = float(column @ left / (column @ column))
    explained = np.zeros(len(u))
    explained[fitted] = 2 * size * column * left - (size * column) ** 2
    at_rest = sum(float(explained[a:b].sum()) for a, b in wanders)
    if at_rest < ALL_OF_IT * float(explained.sum()):
        return ""
    return "all of it lies in a rest, in which the reference wanders by itself, as an estimated attitude does"


def _outside(design: Floats, columns: Floats) -> Floats:
    """What is left of columns, or of one, beside those of a design, by plain least squares."""
    return np.asarray(columns - design @ np.linalg.lstsq(design, columns, rcond=1e-10)[0])


def _knows_change(effect: Effect) -> bool:
    """Whether an effect goes with the change of the rate by itself."""
    return effect.of_response or effect.id in OF_HISTORY


def _curve_of_rate(effect: Effect, term: Term) -> bool:
    return effect.of_rate and not (effect.of_time or effect.of_run or term.per_run) and len(effect.linear) == 1


def _late(problem: Problem, model: Model) -> bool:
    """Whether the reference comes late: as its response says, or by a lag that was found beside one with noise."""
    if any(e.motion.lag for e in problem.exposures):
        return True
    return problem.smoothed and any(isinstance(term.effect, TimingSkew) for term in model)


def _beside_response(problem: Problem, fit: Fit, term: Term) -> float:
    """Deviate of a curve's evidence beside a gain and a lag of its own in each run."""
    rest = tuple(one for one in fit.model if not isinstance(one.effect, (ScaleFactor, TimingSkew)))
    free = (*rest, Term(ScaleFactor(), per_run=True), Term(TimingSkew(), per_run=True))
    base = reference(problem, free, fit.noise.power)
    ratio, gained = likelihood_ratio(problem, base, (*free, term))
    return deviate(problem, base, term, ratio, gained) if gained else np.inf


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
