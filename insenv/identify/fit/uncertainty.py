"""Parameters of a fit with honest standard deviations, those of shapes included.

At the end of a search the model is linearised in everything: the columns of `insenv.effects` at the shapes found, and
the derivative of the curve to each shape. The inverse of the information in all of them together is the covariance, so
a scale factor's standard deviation knows that a time constant was fitted beside it.

Of the time of a jump and of the width of a play the likelihood is no parabola: where data do not tell one reading from
the next, what is lost over many of them is a walk. Their deviation is that of the likelihood over all their values,

    sd^2 = sum w (x - x_0)^2 / sum w,      w = exp(l(x) - l(x_0))

with everything else fitted anew at each x.

Beside a table that turns the standard deviations grow as scores of swings and runs say (`insenv.identify.fit.swings`).
Where runs of one bias scatter by more than the noise within them (`insenv.identify.fit.scatter`), coefficients hold
what that does to them, sum over runs of s^2 g g' with g = d theta / d level, on as many degrees of freedom as it has.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from insenv.core.recording import Floats
from insenv.data.exposure import Exposure
from insenv.data.manifest import checks
from insenv.effects.base import CurveEffect, MemoryEffect
from insenv.effects.rate.scale import ScaleFactor
from insenv.identify.findings import Covariance, Estimate
from insenv.identify.fit import discrepancy, lag_form, other_forms
from insenv.identify.fit.gls import Fit, noise_freedom, spectrum
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import NOISE_TERMS, Problem, Term, regressors
from insenv.identify.fit.reference_variance import Beside, beside_response
from insenv.identify.fit.rounded import added_covariance
from insenv.identify.fit.scatter import ANEW, Levels, has_one_level, levels
from insenv.identify.fit.swings import by_swings

_SQUARED = "_squared"
#: Counts from a gain of one. The input of every other effect is fitted times the gain that the data show, and what is
#: stated is of the input itself (`_as_stated`).
SCALE = ScaleFactor.id
#: Below this many degrees of freedom of the noise the variance of Student's t says nothing any more.
LEAST_FREEDOM = 4.0
#: Chance of a scatter of levels up to which coefficients hold it.
BETWEEN = 1e-3
#: Half the window in which a shape is looked at first, in its deviation by the derivative, and the factor by which it
#: grows as often while the likelihood at its ends is more than a share of the largest; values in a window.
WINDOW, WIDER, PASSES, FALLEN, VALUES = 4.0, 3.0, 12, 1e-3, 33
#: Fewest likely values of a window; of fewer it is made smaller.
TOLD = 4
#: SI units of the noise coefficients as the field writes them, by the unit of the output.
NOISE_UNITS = {
    output: {key: units[j] for key, units in checks.NOISE_UNITS.items()} for j, output in enumerate(("rad/s", "m/s^2"))
}


@dataclass(frozen=True)
class _Joint:
    """Covariance of all parameters (SI), shape (p, p), and the freedom with which swings tell it, shape (p,)."""

    covariance: Floats
    freedoms: Floats


@dataclass(frozen=True)
class _Slopes:
    """Derivatives to the shapes of a term: columns over the modes, name, unit, value and prior of each shape."""

    columns: Floats
    rows: tuple[tuple[str, str, float, float], ...]


def estimates(problem: Problem, fit: Fit, inexact: tuple[Term, ...] = ()) -> dict[Term, tuple[Estimate, ...]]:
    """Estimates of every term of the model: linear parameters, then shapes.

    The shapes of ``inexact`` are taken to be right only nearly (`insenv.identify.fit.discrepancy`), and their curves
    may have other forms (`insenv.identify.fit.other_forms`). Beside a reference whose errors go with the motion all are
    less certain (`insenv.identify.fit.reference_variance`), beside a lag of unknown form too
    (`insenv.identify.fit.lag_form`), and so they are where readings are rounded (`insenv.identify.fit.rounded`).
    """
    slopes, beside = _all_slopes(problem, fit), beside_response(problem, fit)
    sd = np.sqrt(np.diag(_joint(problem, fit, slopes, beside).covariance))
    linear_sd, shape_sd = _standard_deviations(sd, fit, slopes)
    if beside:
        added = beside.added + lag_form.added_variance(problem, fit)
        linear_sd = np.hypot(linear_sd, np.sqrt(added) / fit.design.scale)
    if inexact:
        linear_sd = np.hypot(linear_sd, np.sqrt(discrepancy.added_variance(problem, fit, inexact)) / fit.design.scale)
        linear_sd = np.hypot(linear_sd, np.sqrt(other_forms.added_variance(problem, fit, inexact)))
    out: dict[Term, tuple[Estimate, ...]] = {}
    for index, term in enumerate(fit.model):
        key = term.effect.key
        own = np.flatnonzero(fit.design.term == index)
        # A parameter of its own in every run keeps its plain name where only one run was fitted.
        single = len(own) <= len(term.effect.linear)
        names = [fit.design.labels[j][1].partition("[")[0] if single else fit.design.labels[j][1] for j in own]
        gain, zero = _as_stated(problem, fit, term)
        rows = [
            Estimate(key, n, zero + gain * theta, abs(gain) * float(linear_sd[j]), fit.design.labels[j][2])
            for j, n, theta in zip(own, names, fit.theta[own].tolist(), strict=True)
        ]
        rows += [_root(row, problem.unit) for row in rows if row.parameter.endswith(_SQUARED) and row.value > 0]
        if term in slopes:
            rows += [
                Estimate(key, name, f * value, f * float(sd), unit)
                for (name, unit, value, _), sd, f in zip(
                    slopes[term].rows, shape_sd[term], shapes_as_stated(problem, term), strict=True
                )
            ]
        out[term] = tuple(rows)
    return out


def coefficients_of(problem: Problem, fit: Fit, term: Term, inexact: tuple[Term, ...] = ()) -> tuple[Floats, Floats]:
    """Linear coefficients (SI) of one term, shape (k,), and their covariance with that of the shapes, (k, k).

    The shapes of ``inexact`` are taken to be right only nearly, as in `estimates`. What errors of a reference that go
    with the frequency add is in it but for responses, which tell them.
    """
    own, beside = np.flatnonzero(fit.design.term == fit.model.index(term)), beside_response(problem, fit)
    cov = _joint(problem, fit, _all_slopes(problem, fit), beside).covariance[np.ix_(own, own)]
    if beside and not term.effect.of_response:
        cov = cov + np.diag((beside.added / fit.design.scale**2)[own])
    if inexact:
        added = discrepancy.added_variance(problem, fit, inexact) / fit.design.scale**2
        added = added + other_forms.added_variance(problem, fit, inexact)
        cov = cov + np.diag(added[own])
    return fit.theta[own], cov


def freedom_of_swings(problem: Problem, fit: Fit, term: Term) -> float:
    """Freedom with which swings tell how uncertain the coefficients of a term are; infinite where noise tells it."""
    own = np.flatnonzero(fit.design.term == fit.model.index(term))
    freedoms = _joint(problem, fit, _all_slopes(problem, fit), beside_response(problem, fit)).freedoms
    return float(np.min(freedoms[own], initial=np.inf))


def covariance(problem: Problem, fit: Fit) -> Covariance:
    """All parameters together: linear ones in the order of the design, then shapes in that of the model."""
    slopes = _all_slopes(problem, fit)
    kept = np.flatnonzero(fit.design.term >= 0)
    shapes = [(term.effect.key, name, value) for term, s in slopes.items() for name, _, value, _ in s.rows]
    labels = [fit.design.labels[j][:2] for j in kept]
    index = np.concatenate([kept, len(fit.design.term) + np.arange(len(shapes))]).astype(int)
    gains, zeros = np.array([_as_stated(problem, fit, fit.model[j]) for j in fit.design.term[kept]]).reshape(-1, 2).T
    of_shapes = [f for term in slopes for f in shapes_as_stated(problem, term)]
    factor = np.concatenate([gains, of_shapes])
    return Covariance(
        (*((key, name) for key, name in labels), *((key, name) for key, name, _ in shapes)),
        np.concatenate(
            [zeros + gains * fit.theta[kept], [f * v for f, (*_, v) in zip(of_shapes, shapes, strict=True)]]
        ),
        _joint(problem, fit, slopes, beside_response(problem, fit)).covariance[np.ix_(index, index)]
        * np.outer(factor, factor),
    )


def _all_slopes(problem: Problem, fit: Fit) -> dict[Term, _Slopes]:
    def made() -> dict[Term, _Slopes]:
        return {term: _slopes(problem, fit, index) for index, term in enumerate(fit.model) if term.shape}

    slopes: dict[Term, _Slopes] = problem.remember_last("slopes", fit, made)
    return slopes


def _as_stated(problem: Problem, fit: Fit, term: Term) -> tuple[float, float]:
    """Factor and zero of a term's coefficients as they are stated.

    A scale factor counts from a gain of one; what is late is the input times the gain. What is a law of the rate has
    the input without it, c u^3, where c' (g u)^3 was fitted.
    """
    if term.effect.id == SCALE:
        return problem.gain, problem.gain - 1
    if lag_form.is_skew(term):
        return 1 / (1 + fit.scale_factor), 0.0
    return of_true_rates(problem, term), 0.0


def of_true_rates(problem: Problem, term: Term) -> float:
    """By what a coefficient of a law of the rate is larger where its input is the rate without the gain."""
    if not _is_law(problem, term):
        return 1.0

    def asked() -> float:
        shape = tuple(f * value for f, value in zip(shapes_as_stated(problem, term), term.shape, strict=True))
        fitted, stated = (
            problem.bins.mean(tuple(regressors(term.effect, e, at)[..., :1] for e in exposures))
            for exposures, at in (
                (problem.exposures, term.shape),
                (tuple(map(_without_gain, problem.exposures)), shape),
            )
        )
        size = float(np.sum(stated**2))
        return float(np.sum(stated * fitted)) / size if size else 1.0

    factor: float = problem.remember(("of true rates", term), asked)
    return factor


def _is_law(problem: Problem, term: Term) -> bool:
    """Whether a term is a law of the rate, fitted with the rate times a gain."""
    effect = term.effect
    return problem.gain != 1.0 and effect.of_rate and not effect.of_response and not problem.through_gravity


def _without_gain(exposure: Exposure) -> Exposure:
    """The exposure with the rates themselves, not times the gain of the target."""
    motion, gain = exposure.motion, exposure.motion.gain
    edges = None if motion.rate_edges is None else motion.rate_edges / gain
    motion = replace(motion, rate=motion.rate / gain, rate_edges=edges, gain=1.0)
    return replace(exposure, u=exposure.u / gain, motion=motion)


def shapes_as_stated(problem: Problem, term: Term) -> tuple[float, ...]:
    """Factor of each shape of a term as it is stated: those that are rates are so without the gain."""
    gain = abs(problem.gain) if _is_law(problem, term) else 1.0
    return tuple(1 / gain if p.unit_on(problem.unit) == "rad/s" else 1.0 for p in getattr(term.effect, "shapes", ()))


def _root(row: Estimate, unit: str) -> Estimate:
    """The root of a parameter that is fitted as its square: a lock-in threshold from W_L^2."""
    root = float(np.sqrt(row.value))
    return Estimate(row.effect, row.parameter.removesuffix(_SQUARED), root, row.sd / (2 * root), unit)


def noise_estimates(problem: Problem, fit: Fit) -> tuple[Estimate, ...]:
    """Coefficients of the noise terms that the data determine."""
    rows = []
    for term, power, share in zip(NOISE_TERMS, fit.noise.power, fit.noise.relative_sd, strict=True):
        if np.isfinite(share) and share < 1:
            param = term.linear[0]
            value = float(np.sqrt(power))
            rows.append(Estimate(term.id, param.name, value, value * float(share), NOISE_UNITS[problem.unit][term.id]))
    return tuple(rows)


def _standard_deviations(sd: Floats, fit: Fit, slopes: dict[Term, _Slopes]) -> tuple[Floats, dict[Term, Floats]]:
    """Of all parameters, shape (p,): those of the linear ones and those of the shapes of each term."""
    p = len(fit.design.scale)
    shape_sd, offset = {}, p
    for term, s in slopes.items():
        shape_sd[term] = sd[offset : offset + len(s.rows)]
        offset += len(s.rows)
    return sd[:p], shape_sd


def _joint(problem: Problem, fit: Fit, slopes: dict[Term, _Slopes], beside: Beside | None) -> _Joint:
    """Of the linear parameters and of the shapes of each term."""
    found: _Joint = problem.remember_last("joint", fit, lambda: _joined(problem, fit, slopes, beside))
    return found


def _joined(problem: Problem, fit: Fit, slopes: dict[Term, _Slopes], beside: Beside | None) -> _Joint:
    weight = 1 / np.sqrt(spectrum(problem, fit.noise.power))
    blocks = [fit.design.transformed, *(s.columns for s in slopes.values())]
    columns = np.column_stack(blocks) * weight[:, None]
    prior = np.concatenate([fit.design.prior, *([1 / row[3] ** 2 for row in s.rows] for s in slopes.values())])
    size = np.sqrt(np.sum(columns**2, axis=0) + prior)
    scaled = columns / size
    inverse = np.linalg.pinv(scaled.T @ scaled + np.diag(prior / size**2), hermitian=True)
    weights = scaled @ inverse
    # What errors of the reference leave goes with the motion: a coefficient is as uncertain as swings differ.
    told = [by_swings(problem, column, beside.left) if beside else (1.0, np.inf) for column in weights.T]
    larger, freedoms = np.array(told).reshape(-1, 2).T
    factor = _for_fitted_noise(problem, fit, weights) * np.sqrt(larger) / size
    p = len(fit.design.scale)
    factor[:p] /= fit.design.scale
    joint = np.asarray(inverse * np.outer(factor, factor))
    if found := _between_runs(problem, fit):
        of_runs = weights.T @ (problem.transformed(ANEW) * weight[:, None]) / size[:, None]
        of_runs[:p] /= fit.design.scale[:, None]
        added = found.between * of_runs @ of_runs.T
        freedoms = np.where(np.diag(added) > np.diag(joint), np.minimum(freedoms, found.free), freedoms)
        joint = joint + added
    wider = np.ones(len(joint))
    for place, index in _without_parabola(fit, slopes):
        own = [*np.flatnonzero(fit.design.term == index), p + place]
        sd = float(np.sqrt(joint[p + place, p + place]))
        wider[p + place] = _by_likelihood(problem, fit, index, np.delete(columns, own, axis=1), sd)
    joint *= np.outer(wider, wider)
    joint[:p, :p] += added_covariance(problem, fit) / np.outer(fit.design.scale, fit.design.scale)
    return _Joint(joint, freedoms)


def _without_parabola(fit: Fit, slopes: dict[Term, _Slopes]) -> Iterator[tuple[int, int]]:
    """Place among the shapes and index in the model of each jump and play: what does not bend smoothly."""
    place = 0
    for index, term in enumerate(fit.model):
        if term not in slopes:
            continue
        (*_, shape) = term.effect.shapes
        plays = isinstance(term.effect, MemoryEffect) and shape.unit != "s"
        if (shape.name == "t0" or plays) and len(term.shape) == 1 and not term.per_run:
            yield place, index
        place += len(slopes[term].rows)


def _by_likelihood(problem: Problem, fit: Fit, index: int, rest: Floats, sd: float) -> float:
    """Factor on the deviation ``sd`` of the shape of a term; the whitened columns ``rest`` are fitted beside it."""
    term, weight = fit.model[index], 1 / np.sqrt(spectrum(problem, fit.noise.power))
    (at,), (shape,) = term.shape, term.effect.shapes
    span = max(e.motion.dt * e.motion.n for e in problem.exposures)
    least, most = (0.0, span) if shape.name == "t0" else (shape.low, np.inf)
    known = np.linalg.qr(rest)[0]
    data = weight * problem.data()
    left = data - known @ (known.T @ data)

    def gained(value: float) -> float:
        cells = tuple(regressors(term.effect, e, (value,)) for e in problem.exposures)
        columns = weight[:, None] * transform(problem.fitted, problem.bins.mean(cells))
        fresh = columns - known @ (known.T @ columns)
        return float(np.sum((np.linalg.qr(fresh)[0].T @ left) ** 2)) / 2

    half, factor = WINDOW * sd, 1.0
    for _ in range(PASSES):
        values = np.linspace(max(least, at - half), min(most, at + half), VALUES)
        logs = np.array([gained(float(value)) for value in values])
        likely = np.exp(logs - logs.max())
        ended = values[[0, -1]] == [least, most]
        own = float(np.sqrt(likely @ (values - at) ** 2 / likely.sum())) / max(sd, 1e-300)
        if np.any((likely[[0, -1]] > FALLEN) & ~ended):
            half *= WIDER
        elif np.sum(likely > FALLEN) < TOLD:  # of a jump between two cells the derivative is none
            half /= WIDER
        else:
            factor = own if half < WINDOW * sd else max(1.0, own)
            break
    return factor


def _between_runs(problem: Problem, fit: Fit) -> Levels | None:
    """Levels of runs that scatter beyond chance about a fit; None where they do not, or a run is more than a level."""
    if not has_one_level(problem, fit.model):
        return None
    found = levels(problem, fit)
    return found if found.chance < BETWEEN else None


def _for_fitted_noise(problem: Problem, fit: Fit, weights: Floats) -> Floats:
    """Factor on each standard deviation because the noise is fitted too: that of Student's t, shape (p,).

    Column j of ``weights``, shape (modes, p), is what the whitened data are multiplied with to give coefficient j.
    """
    factors = np.ones(weights.shape[1])
    for j in range(weights.shape[1]):
        freedom = max(noise_freedom(problem, fit.noise.power, weights[:, j] ** 2), LEAST_FREEDOM)
        factors[j] = np.sqrt(freedom / (freedom - 2))
    return factors


def _of_runs(problem: Problem, fit: Fit, index: int, k: int) -> Floats:
    """Linear parameters of a term in each run, shape (runs, k); 0 for those that its data do not tell."""
    term, runs = fit.model[index], len(problem.exposures)
    names = [name for name, _, _ in problem.names(term)]
    theta = np.zeros(len(names))
    for j in np.flatnonzero(fit.design.term == index):
        theta[names.index(fit.design.labels[j][1])] = fit.theta[j]
    return theta.reshape(k, runs).T if term.per_run and runs > 1 else np.tile(theta, (runs, 1))


def _slopes(problem: Problem, fit: Fit, index: int) -> _Slopes:
    term = fit.model[index]
    effect = term.effect
    assert isinstance(effect, CurveEffect)
    k = len(effect.linear)
    per_run = _of_runs(problem, fit, index, k)
    cells = tuple(
        effect.jacobian(e.u, e.motion, np.concatenate([theta, term.shape]))[..., k:]
        for e, theta in zip(problem.exposures, per_run, strict=True)
    )
    columns = transform(problem.fitted, problem.bins.mean(cells))
    rows = tuple(
        (p.name, p.unit_on(problem.unit), value, 10 * max(p.sd, abs(value)))
        for p, value in zip(effect.shapes, term.shape, strict=True)
    )
    return _Slopes(columns, rows)
