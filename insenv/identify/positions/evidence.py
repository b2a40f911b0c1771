"""How sure: what fitted units gain by a larger fit, and whether held-out units bear it out.

    chi = [(RSS_0 - RSS_1) / d] / [RSS_1 / nu]  ~  F(d, nu)          without the effect's d parameters, and with them

The noise is the scatter from rest to rest, estimated from the residuals of the fit itself with its freedom nu: the
white noise of the samples knows nothing of a bias that wanders, of a bench that gives way. The held-out rests give a
second test without free parameters, and both are joined, as in `insenv.identify.fit.evidence`:

    z = r' V^-1 phi / sqrt(phi' V^-1 phi),    V = s^2 (I + J C J'),    phi = r_0 - r_1 on held-out rests

Where each unit is held out in its turn (`insenv.identify.positions.leave_out`), all are fitted: Fisher's F of all of
them is the whole evidence, and the error of the units that were left out may not grow either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc, fdtri

from insenv.core.recording import Floats
from insenv.core.series.tails import log_tail_of_f, log_tail_of_t
from insenv.identify.fit.evidence import joint_deviate, log_tail
from insenv.identify.positions.least_squares import Fit, Problem, in_turn
from insenv.identify.positions.leave_out import left_out

#: Probability, among all units, of one so far off by chance below which it is left out, and the largest share of them.
OUTLIER, MOST_OUTLIERS = 1e-4, 0.1
#: Probability of a scatter of held-out units below which their noise is taken to be larger.
SCATTERED = 0.01
#: Deviate of held-out units that speaks against an effect which stated errors follow.
AGAINST = 2.0
#: Freedom of a variance that is known.
KNOWN = 10**6


def held_out_errors(problem: Problem, *fits: Fit, units: NDArray[np.bool_] | None = None) -> tuple[float, ...]:
    """Of each fit, the root mean square of the lengths of the residuals of the held-out units, or of some ``units``.

    Where each is held out in its turn, of those that every one of the fits foretells without it.
    """
    if in_turn(problem):
        each = [left_out(problem.root, fit.residual, fit.slopes, fit.inverse, problem.fitted) for fit in fits]
        known = problem.fitted & np.all([np.isfinite(left).all(axis=1) for left in each], axis=0)
    else:
        each, known = [problem.plain(fit.residual) for fit in fits], problem.held_out if units is None else units
    return tuple(float(np.sqrt(np.mean(np.sum(left[known] ** 2, axis=1)))) if known.any() else np.nan for left in each)


def held_out_error(problem: Problem, fit: Fit) -> float:
    """`held_out_errors` of one fit."""
    return held_out_errors(problem, fit)[0]


def noise_floor(problem: Problem, fit: Fit) -> float:
    """What `held_out_error` would be if the fitted noise alone were left, that of the coefficients included."""
    m, d = fit.residual.shape
    slopes = fit.slopes.reshape(m * d, -1)
    fitted = np.repeat(problem.fitted, d)
    # Whitened residuals are (1 - J C J_f') times unit normals.
    spread = np.eye(m * d)
    spread[:, fitted] -= slopes @ fit.told @ slopes[fitted].T
    if in_turn(problem):
        each = left_out(problem.root, spread.reshape(m, d, -1), fit.slopes, fit.inverse, problem.fitted)
        known = problem.fitted & np.isfinite(each).all(axis=(1, 2))
        return float(np.sqrt(fit.variance * np.sum(each[known] ** 2) / max(int(known.sum()), 1)))
    power = np.sum(problem.plain(spread.reshape(m, d, -1))[problem.held_out] ** 2)
    return float(np.sqrt(fit.variance * power / max(int(problem.held_out.sum()), 1)))


@dataclass(frozen=True)
class Evidence:
    """How much a larger fit explains: deviate of fitted and held-out units joined, likelihood ratio of the fitted."""

    deviate: float
    likelihood_ratio: float

    def p_value(self, looks: float) -> float:
        """Probability of such evidence anywhere in so many looks."""
        return float(min(1.0, looks * np.exp(log_tail(self.deviate))))


def evidence(problem: Problem, small: Fit, large: Fit, variance: float | None = None) -> Evidence:
    """Of the fit ``large``, which has all the terms of ``small``; ``variance`` of the noise, by ``large`` if None."""
    gained, nu = small.freedom - large.freedom, large.freedom if variance is None else KNOWN
    noise = large.variance if variance is None else variance
    if noise <= 0 or nu < 1:
        return Evidence(-np.inf, 0.0)
    change = max(small.rss - large.rss, 0.0)
    # What all units have in common shows in no scatter: held-out units are judged with a spread for it, or else these.
    common = problem.spread**2 if in_turn(problem) else 1.0
    log_p = log_tail_of_f(change / gained / noise / common, gained, nu)
    ratio = float(problem.rank * problem.fitted.sum() * np.log(max(small.rss / large.rss, 1.0)))
    z, information = (0.0, 0.0) if in_turn(problem) else _held_out_deviate(problem, small, large, noise)
    return Evidence(joint_deviate(log_p, change / noise, z, information), ratio)


def _held_out_deviate(problem: Problem, small: Fit, large: Fit, noise: float) -> tuple[float, float]:
    """The normal deviate of the held-out units, and its information.

    A few units that neither fit explains, knocks and polluted readings, point somewhere all the same, and are left
    out. Where more of them scatter than the fit foretells, they are judged with the least noise that makes it credible.
    """
    held = explained(problem, small, large, noise)
    ratio, count = held_out_scatter(problem, large, held, noise)
    noise *= max(1.0, ratio / float(fdtri(count, max(large.freedom, 1), 1 - SCATTERED)))
    r = small.residual[held].ravel()
    phi = r - large.residual[held].ravel()
    whitened = _Foretold.of(small, held).whiten(phi) / noise
    information = float(phi @ whitened)
    if not information > 1e-12:
        return 0.0, 0.0
    z = float(r @ whitened) / np.sqrt(information) / problem.spread
    log_p = log_tail_of_t(abs(z), large.freedom)
    return float(np.copysign(-_ndtri_exp(log_p), z)), information


def followed(problem: Problem, small: Fit, large: Fit) -> bool:
    """Whether stated errors follow what is added, most of the gain is theirs, and held-out units are not against it."""
    if in_turn(problem) or not len(problem.nuisance):
        return False
    shown = float(np.sum(small.residual[problem.fitted] ** 2) - np.sum(large.residual[problem.fitted] ** 2))
    if small.rss - large.rss < 2 * max(shown, 0.0):
        return False
    return _held_out_deviate(problem, small, large, large.variance)[0] > -AGAINST


def explained(problem: Problem, small: Fit, large: Fit, noise: float) -> NDArray[np.bool_]:
    """Held-out units, shape (m,), without those that are alone in that neither fit explains them (F, Bonferroni)."""
    held = problem.held_out
    if in_turn(problem) or not held.any() or not noise > 0:
        return held
    sizes = [
        np.sum((fit.residual[held].ravel() ** 2 / _Foretold.of(fit, held).variances).reshape(held.sum(), -1), axis=1)
        for fit in (small, large)
    ]
    tails = fdtrc(problem.rank, max(large.freedom, 1), np.minimum(*sizes) / problem.rank / noise)
    odd = tails * held.sum() < OUTLIER
    if odd.sum() > MOST_OUTLIERS * held.sum():
        return held
    explained = held.copy()
    explained[held] = ~odd
    return explained


def held_out_scatter(problem: Problem, fit: Fit, units: NDArray[np.bool_], variance: float) -> tuple[float, int]:
    """Mean square of what held-out units are off by, in what the fit and a noise of ``variance`` foretell; of how many.

    ~ F(count, freedom of the variance) if the fit is all there is.
    """
    r = fit.residual[units].ravel()
    count = max(problem.rank * int(units.sum()), 1)
    return float(r @ _Foretold.of(fit, units).whiten(r)) / count / variance, count


@dataclass(frozen=True)
class _Foretold:
    """Covariance V = I + J C J' of what a fit foretells of units, by ``half`` = J C^(1/2), shape (n, p)."""

    half: Floats

    @classmethod
    def of(cls, fit: Fit, units: NDArray[np.bool_]) -> _Foretold:
        slopes = fit.slopes[units]
        size = np.sqrt(np.maximum(np.diag(fit.told), 1e-300))
        powers, vectors = np.linalg.eigh(fit.told / np.outer(size, size))
        flat = slopes.reshape(slopes.shape[0] * slopes.shape[1], len(size))
        return cls((flat * size) @ (vectors * np.sqrt(np.maximum(powers, 0.0))))

    @property
    def variances(self) -> Floats:
        """The diagonal of V, shape (n,)."""
        return np.asarray(1 + np.sum(self.half**2, axis=1), float)

    def whiten(self, values: Floats) -> Floats:
        """V^-1 ``values`` by the matrix inversion lemma, shape (n,)."""
        inner = np.eye(self.half.shape[1]) + self.half.T @ self.half
        return np.asarray(values - self.half @ np.linalg.solve(inner, self.half.T @ values), float)


def _ndtri_exp(log_p: float) -> float:
    from scipy.special import ndtri_exp

    return float(ndtri_exp(min(log_p, -1e-12)))
