r"""Whether an effect has a size: its coefficients, all together, by the covariance that the report states.

An effect can be significant while its coefficient is not known: of an exponential that is much slower than the record
only the slope is told, c / tau, and c = 1 +- 5 is no statement. With theta the k coefficients of an effect, C their
covariance, shapes fitted beside them, and what shapes that are right only nearly add to it,

    m = theta' C^-1 theta,        z = the normal deviate that is as rare as m for chi-square on k degrees,

and an effect of which z is below `LEAST`, or a coefficient of which is less certain than the largest credible one is
large, is not named. The same holds for every effect of the catalogue. A gain that changes (it drifts, settles, follows
the temperature) is told beside a constant one, declared or not, for it would have the evidence of that one too. Beside
a command held-out data tell the size of an effect without a shape too, and z grows by their deviate where the fitted
ones tell at least half of one: a table that goes up in the fitted rows and down in the others shows an asymmetry to
both together. Nor is a curve of the rate beside a reference that is late (a lag, or a skew in the model) named, if it
has two shapes and more and the data tell none: then it is any curve; nor a hysteresis whose radius is not told, or a
hold whose time is not. Beside a reference that was measured, a curve of its rate, a step and a line must have a size
that is no chance of as many curves as were tried: its deviation holds what errors of
the reference do, the likelihood ratio does not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.linalg import block_diag
from scipy.special import chdtrc, ndtri, ndtri_exp, stdtr

from insenv.core.quantities import estimates_in, unit_for
from insenv.core.recording import Floats
from insenv.effects.angle import AngleLockedRate
from insenv.effects.rate.hysteresis import HOLDS, LEAST_HOLD, ScaleFactorHysteresis
from insenv.effects.rate.lag import SelfHeating
from insenv.effects.rate.scale import (
    ScaleFactor,
    ScaleFactorAnomaly,
    ScaleFactorDrift,
    ScaleFactorTemperature,
    ScaleFactorWarmUp,
)
from insenv.effects.timing import SampleHold, TimingSkew
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.problem import Model, Problem, Term
from insenv.identify.fit.uncertainty import coefficients_of, estimates, freedom_of_swings
from insenv.identify.search.jumps import is_step

#: Deviations by which an effect must differ from zero; a curve of the rate beside a reference that is late, whose
#: filter nobody knows exactly: what its skew leaves follows the rate too.
LEAST, BESIDE_LAG = 2.5, 3.0
#: Deviations of the fitted data by themselves from which on held-out data help to tell a size.
OWN = 0.5
#: Deviations from which on a shape is told, and how many shapes make any curve.
TOLD, SEVERAL = 2.0, 2
#: Chance of a size by noise alone, of all looks together, below which it is told beside a measured reference;
#: deviations from which on it is, whatever their number.
CHANCE, LARGEST_BY_CHANCE = 0.05, 6.0
#: Gains that change.
CHANGES = (ScaleFactorDrift.id, ScaleFactorWarmUp.id, ScaleFactorTemperature.id)


def unsized(
    problem: Problem, fit: Fit, term: Term, inexact: Model = (), held_out: float = 0.0, looks: float = 1.0
) -> str:
    """Why the size of a ``term`` of the fit is not told; empty if it is.

    Parameters
    ----------
    problem : Problem
    fit : Fit
    term : Term
    inexact : tuple of Term
        Terms whose shapes are right only nearly.
    held_out : float
        Deviate with which held-out data alone confirm the term.
    looks : float
        Curves that were tried, and odds against the effect: what its size is rare by, beside a reference that was
        measured.
    """
    if term.effect.generic:
        return ""
    return _of_servo(problem, fit, term) or _untold(problem, fit, term, inexact, held_out, looks)


def _untold(problem: Problem, fit: Fit, term: Term, inexact: Model, held_out: float, looks: float) -> str:
    """The same of what is no servo's."""
    if constant := _without_constant_gain(fit, term):
        fit = solve(problem, (*fit.model, constant), start=fit.noise.power)
    lags = any(e.motion.lag for e in problem.exposures)
    late = _curve_of_rate(term) and (lags or (_comes_late(fit) and not term.effect.of_response))
    # A smooth discrepancy of its own could be all of a drift: what is told is the drift of the two together. Of a curve
    # of the rate, which a gain is none of, it is just the question, and the report asks it too.
    bent = late or (_curve_of_rate(term) and not term.effect.of_response)
    others = inexact if bent else tuple(one for one in inexact if one is not term)
    theta, cov = coefficients_of(problem, fit, term, others)
    sd = np.sqrt(np.diag(cov))
    if not len(theta) or not np.all(sd > 0):
        return ""
    z = as_normal(deviate(theta, cov), freedom_of_swings(problem, fit, term))
    if problem.commanded and z >= OWN and not (late or term.shape):
        z = math.hypot(z, max(held_out, 0.0))
    if why := _too_small(problem, term, z, late, looks):
        where = " beside a constant gain" if constant else " beside a reference that is late" if late else ""
        told = f"{_listed(problem, term, theta, sd)}, {z:.2g} standard deviations from nothing{why.rstrip()}"
        return f"its size is not told{where}: {told}"
    if (late or isinstance(term.effect, SampleHold)) and (shapes := _shapes_untold(problem, fit, term)):
        return f"its shape is not told{' beside a reference that is late' if late else ''}: {shapes}"
    own = fit.design.term == fit.model.index(term)
    names = [label[1].partition("[")[0] for label, mine in zip(fit.design.labels, own, strict=True) if mine]
    most = {p.name: problem.limits(p)[1] for p in term.effect.linear}
    if any(s > most[name] for name, s in zip(names, sd, strict=True)):
        unit = unit_for(term.effect.linear[0].unit_on(problem.unit), *theta.tolist())
        told = f"{_listed(problem, term, theta, sd)}, beyond a credible {unit.show(max(most.values()))}"
        return f"its size is not told: {told}"
    return ""


def unsized_together(parts: Sequence[tuple[Problem, Fit, Term]]) -> str:
    """Why the sizes of one cause on several targets, each the last term of its fit, are not told; empty if they are.

    Each may be weak: by the coefficients of all of them together, m = sum of theta' C^-1 theta.
    """
    told = [coefficients_of(problem, fit, term, ()) for problem, fit, term in parts]
    z = deviate(np.concatenate([theta for theta, _ in told]), block_diag(*(cov for _, cov in told)))
    if z >= LEAST:
        return ""
    each = "; ".join(
        _listed(problem, term, theta, np.sqrt(np.diag(cov)))
        for (problem, _, term), (theta, cov) in zip(parts, told, strict=True)
    )
    return f"its sizes are not told: {each}, together {z:.2g} standard deviations from nothing"


def own_size(problem: Problem, fit: Fit, term: Term) -> float:
    """Standard deviations by which the coefficients of a ``term`` of the fit differ from nothing on this target."""
    theta, cov = coefficients_of(problem, fit, term, ())
    return deviate(theta, cov) if len(theta) and np.all(np.diag(cov) > 0) else 0.0


def deviate(theta: Floats, cov: Floats) -> float:
    """Normal deviate, two-sided, as rare as coefficients (k,) this far from zero by their covariance (k, k)."""
    scale = np.sqrt(np.diag(cov))
    unit = theta / scale
    square = float(unit @ np.linalg.pinv(cov / np.outer(scale, scale), hermitian=True) @ unit)
    if len(theta) == 1:
        return float(np.sqrt(square))
    tail = float(chdtrc(len(theta), square))
    log_p = math.log(tail) if tail > 0 else -math.inf
    return float(-ndtri_exp(log_p - np.log(2))) if np.isfinite(log_p) else float(np.sqrt(square))


def _curve_of_rate(term: Term) -> bool:
    """Whether a term is a curve of the rate of the moment, as what is left of a lag is; heat goes on for minutes."""
    effect = term.effect
    lasting = effect.of_time or "temperature" in effect.needs or isinstance(effect, SelfHeating)
    return effect.of_rate and effect.belongs == "instrument" and not lasting


def follows_measured_rate(problem: Problem, term: Term) -> bool:
    """Whether a term is a curve of a rate that was measured with errors."""
    effect = term.effect
    own = effect.of_rate and effect.belongs == "instrument" and not isinstance(effect, TimingSkew)
    return own and problem.turns and problem.smoothed and not problem.commanded


def _follows_reference(problem: Problem, term: Term) -> bool:
    """Whether a term follows a rate or an angle that was measured with errors, or is a jump or line, which these have.

    Wheels slip as the floor is, and so by where a robot heads.
    """
    wave = term.effect.id == AngleLockedRate.id and any(e.motion.lag for e in problem.exposures)
    jumps = is_step(term.effect) or term.effect.line
    return (problem.turns and not problem.commanded and (jumps or wave)) or follows_measured_rate(problem, term)


def as_normal(z: float, freedom: float) -> float:
    """Normal deviate that is as rare as one of Student's t on so many degrees of freedom; z where these are infinite.

    So many swings tell how far a coefficient scatters by them.
    """
    if not np.isfinite(freedom) or z <= 0:
        return z
    tail = float(stdtr(freedom, -z))
    return float(-ndtri(tail)) if tail > 0 else z


def _too_small(problem: Problem, term: Term, z: float, late: bool, looks: float) -> str:
    """How little a size is that is so many deviations from nothing, the end of a sentence; empty if it is told."""
    if z < (BESIDE_LAG if late else LEAST):
        return " "
    by_chance = z < LARGEST_BY_CHANCE and log_tail(z) + math.log(2 * max(looks, 1.0)) >= math.log(CHANCE)
    if by_chance and _follows_reference(problem, term):
        return f", of {looks:.2g} curves that errors of the reference may follow"
    return ""


def _without_constant_gain(fit: Fit, term: Term) -> Term | None:
    """The constant gain that a model lacks beside a term of a gain which changes; None where nothing is lacking."""
    if term.effect.id not in CHANGES or any(one.effect.id == ScaleFactor.id for one in fit.model):
        return None
    return Term(ScaleFactor())


def _shapes_untold(problem: Problem, fit: Fit, term: Term) -> str:
    """The shapes of a term of several, if none of them differs from nothing: then it is any curve; else empty.

    So it is with the one of a hysteresis: of any radius it goes with which way the rate changes, as a lag does. Nor is
    a hold one of which the time could be anything.
    """
    names = [param.name for param in term.effect.shapes]
    if len(names) < (1 if isinstance(term.effect, ScaleFactorHysteresis | SampleHold) else SEVERAL):
        return ""
    rows = [row for row in estimates(problem, fit)[term] if row.parameter in names]
    if any(abs(row.value) >= TOLD * row.sd for row in rows):
        return ""
    return ", ".join(
        f"{row.parameter} = {unit_for(row.unit, row.value).show_with_sd(row.value, row.sd)}" for row in rows
    )


def _of_servo(problem: Problem, fit: Fit, term: Term) -> str:
    """Why a gain, or a fault near one rate, is as well what a servo makes of its command; empty if it is none.

    A table that is late by tau behind its command swings less than that, in the second order by (tau w)^2 at the
    frequency w: the mean square of the command's change over that of itself. Where it holds its rates it reaches them.
    """
    if not problem.commanded or not _comes_late(fit):
        return ""
    local, gain = isinstance(term.effect, ScaleFactorAnomaly), term.effect.part == "gain"
    if not (local or gain):
        return ""
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))
    change = problem.bins.change(u)
    near = np.abs(np.abs(u) - term.shape[0]) < term.shape[1] if local else u != 0
    holds = np.abs(change) < HOLDS * float(np.abs(u).max(initial=0.0))
    if near.any() and float(np.mean(holds[near])) > LEAST_HOLD:
        return ""
    if local:
        return "hardly any of its rates is held: what a servo leaves of its lag is as local"
    skew = next(i for i, one in enumerate(fit.model) if one.effect.id == TimingSkew.id)
    late = float(np.mean(fit.theta[fit.design.term == skew]))
    made = float(np.mean((change / problem.bins.width) ** 2) / np.mean(u**2)) * late**2
    size = float(np.max(np.abs(fit.theta[fit.design.term == fit.model.index(term)]), initial=0.0))
    if size > made:
        return ""
    return f"a table that is {1e3 * abs(late):.3g} ms late behind its command swings less by up to {made:.2g}"


def _comes_late(fit: Fit) -> bool:
    """Whether a skew was fitted: beside a reference that is late by less, nobody took its lag before."""
    return any(one.effect.id == TimingSkew.id for one in fit.model)


def _listed(problem: Problem, term: Term, theta: Floats, sd: Floats) -> str:
    """The first coefficients of a term with their deviations, in the unit of the first."""
    unit = term.effect.linear[0].unit_on(problem.unit)
    return estimates_in(unit, theta[:3].tolist(), sd[:3].tolist())
