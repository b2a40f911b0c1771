"""Noise of binned means, diagonal in the DCT-II domain, and its coefficients by (restricted) maximum likelihood.

White noise and random walk of bin means are diagonal under the orthonormal DCT-II, flicker and angle quantisation
very nearly so. With lambda_k = 4 sin^2(pi k / 2n) the variance of coefficient k is a sum over noise effects

    S_k = sum_j theta_j^2 s_j(lambda_k, T),        s_j = NoiseEffect.spectrum

and no n x n matrix is ever formed. The likelihood needs only cross-products of the data and the regressors, pooled in
groups of modes in which S is nearly constant:

    l = -1/2 [ sum_g n_g log S_g + r' S^-1 r  (+ log |X' S^-1 X| for the restricted one) ]

Coefficient k = 0 of a block carries the block's level; its variance is that of the mean of a stretch of noise that
started at an unknown level one run ago, so the levels of several dwells still tell a scale factor, honestly weighted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct
from scipy.linalg.lapack import dposv, dpotrs
from scipy.optimize import minimize, nnls

from insenv.core.recording import Floats
from insenv.effects.base import NoiseEffect
from insenv.identify.fit.bins import Block

#: Share of the variance that regressors leave below which a noise term counts as absent.
_ABSENT = 1e-9
#: Share of the data's variance that rounding leaves of it: an accelerometer's level is gravity.
_ROUNDING = 1e-15
#: Power that is none, of readings that stand still: its inverse can still be squared.
_NONE = 1e-90
#: Share by which squares grow, so that rounding of nearly collinear columns leaves the matrix positive.
_RIDGE = 1e-11
#: Slope of the log-likelihood in the logarithm of a power that counts as none.
_FLAT = 0.02
#: How many times the power that would explain all that regressors leave by least squares a term may have: where slow
#: noise is all that there is, they leave little of what they would take by their weights. 1e4 was too little.
_MOST = 1e8


def transform(blocks: tuple[Block, ...], values: Floats) -> Floats:
    """Orthonormal DCT-II of each block along the first axis; rows in the order of the blocks."""
    return _joined([dct(values[b.start : b.stop], type=2, norm="ortho", axis=0) for b in blocks], 0)


def transform_rows(blocks: tuple[Block, ...], rows: Floats) -> Floats:
    """The same along the second axis of ``rows``, shape (k, bins), to (k, modes): next to each other, twice as fast."""
    return _joined([dct(rows[:, b.start : b.stop], type=2, norm="ortho", axis=1) for b in blocks], 1)


def _joined(parts: list[Floats], axis: int) -> Floats:
    """Parts behind each other; most recordings have one, which is not copied."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=axis)


def eigenvalues(blocks: tuple[Block, ...]) -> Floats:
    """Lambda of each mode, in the order of `transform`; 0 marks the level of a block."""
    return np.concatenate([4 * np.sin(0.5 * np.pi * np.arange(b.n) / b.n) ** 2 for b in blocks])


@dataclass(frozen=True)
class Modes:
    """Spectral shapes of the noise terms over the modes of some blocks.

    Attributes
    ----------
    shapes : ndarray, shape (modes, terms)
        Variance of each mode for unit squared coefficient of each noise effect.
    lam : ndarray, shape (modes,)
        Eigenvalue of each mode; that of a level is the one of half a mode over its run.
    """

    shapes: Floats
    lam: Floats


@lru_cache(maxsize=32)
def modes(blocks: tuple[Block, ...], terms: tuple[NoiseEffect, ...], width: float) -> Modes:
    """Spectral shapes of ``terms`` for means over ``width`` seconds: the same for all targets and many bins alike."""
    lam = eigenvalues(blocks)
    level = lam == 0
    n = np.concatenate([np.full(b.n, b.n) for b in blocks])
    span = np.concatenate([np.full(b.n, b.span) for b in blocks])
    # The mean of a block of n bins is known no better than the noise wanders over its run of `span` bins:
    # half a mode of the run; for noise without memory this is the block's own level.
    lam_block, lam_run = (4 * np.sin(0.25 * np.pi / m[level]) ** 2 for m in (n, span))
    lam[level] = lam_block
    shapes = np.stack([term.spectrum(lam, width) for term in terms], axis=1)
    wander = np.stack([term.spectrum(lam_run, width) for term in terms], axis=1)
    shapes[level] = np.maximum(shapes[level], wander * (n[level] / span[level])[:, None])
    return Modes(shapes, lam)


@dataclass(frozen=True)
class Pooled:
    """Cross-products of columns, pooled over groups of modes with nearly equal spectrum.

    Attributes
    ----------
    cross : ndarray, shape (groups, c, c)
        Sum of outer products of the rows of each group; the data is column 0.
    count : ndarray, shape (groups,)
    shapes : ndarray, shape (groups, terms)
    """

    cross: Floats
    count: Floats
    shapes: Floats

    @cached_property
    def flat(self) -> Floats:
        """Cross-products of each group in a row, shape (groups, c c)."""
        return self.cross.reshape(len(self.count), -1)

    @cached_property
    def scale(self) -> Floats:
        """Power of each term that would alone explain what the regressors leave where the term is strongest."""
        return _scale(self)

    def weighted(self, weight: Floats) -> Floats:
        """Sum of the groups' cross-products times ``weight``, shape (c, c)."""
        return weight.dot(self.flat).reshape(self.cross.shape[1:])

    def energy(self, r: Floats) -> Floats:
        """Squared sum of the columns times ``r`` in each group, shape (groups,)."""
        return self.flat.dot((r[:, None] * r).reshape(-1))

    def traces(self, inverse: Floats) -> Floats:
        """Trace of ``inverse`` times the regressors' cross-products in each group, shape (groups,)."""
        padded = np.zeros(self.cross.shape[1:])
        padded[1:, 1:] = inverse
        return self.flat @ padded.ravel()


@dataclass(frozen=True)
class Grouping:
    """Which modes are pooled: computed once, used for every set of columns."""

    order: NDArray[np.int64]
    starts: NDArray[np.int64]
    count: Floats
    shapes: Floats

    def pool(self, columns: Floats) -> Pooled:
        """Pool ``columns``, shape (modes, c)."""
        return self.pooled(columns.T[:, self.order])

    def pooled(self, new: Floats, ordered: Floats | None = None, before: Pooled | None = None) -> Pooled:
        """Pool rows whose modes stand in this order, shape (c, modes), behind those that are pooled already."""
        first = 0 if before is None else before.cross.shape[1]
        cross = np.empty((len(self.count), first + len(new), first + len(new)))
        if before is not None:
            cross[:, :first, :first] = before.cross
        for j, row in enumerate(new):
            # Each with those up to it: the others are the same the other way round.
            for start, rows in ((0, ordered), (first, new[: j + 1])):
                if rows is not None:
                    sums = np.add.reduceat(rows * row, self.starts, axis=1).T
                    cross[:, first + j, start : start + len(rows)] = sums
                    cross[:, start : start + len(rows), first + j] = sums
        return Pooled(cross, self.count, self.shapes)


def grouping(mode: Modes, groups: int = 100) -> Grouping:
    """Group modes by eigenvalue, evenly in its logarithm, the lowest ones alone."""
    order = np.lexsort((mode.shapes[:, 0], mode.lam))
    lam = mode.lam[order]
    edges = np.geomspace(lam[0] * 0.999, lam[-1] * 1.001, groups + 1)
    label = np.searchsorted(edges, lam)
    # Levels of short blocks share an eigenvalue with high modes but not a spectrum: kept apart by their shapes.
    jump = np.abs(np.diff(np.log(mode.shapes[order] + 1e-300), axis=0)).max(axis=1) > 0.2
    starts = np.flatnonzero(np.concatenate([[True], (np.diff(label) > 0) | jump]))
    count = np.diff(np.append(starts, len(order))).astype(float)
    shapes = np.add.reduceat(mode.shapes[order], starts, axis=0) / count[:, None]
    return Grouping(order, starts, count, shapes)


@dataclass(frozen=True)
class NoiseFit:
    """Fitted noise.

    Attributes
    ----------
    power : ndarray, shape (terms,)
        Squared coefficients of the noise effects.
    loglik : float
        (Restricted) log-likelihood, up to a constant.
    likelihood : callable
        Log-likelihood and its gradient as functions of the powers.
    """

    power: Floats
    loglik: float
    likelihood: Callable[[Floats], tuple[float, Floats]] = field(repr=False)

    @cached_property
    def information(self) -> Floats:
        """Curvature of the likelihood in the logarithms of the powers, shape (terms, terms)."""
        rows, step = [], 1e-3
        for j in range(len(self.power)):
            up, down = self.power.copy(), self.power.copy()
            up[j] *= np.exp(step)
            down[j] *= np.exp(-step)
            rows.append((self.likelihood(down)[1] * down - self.likelihood(up)[1] * up) / (2 * step))
        h = np.array(rows)
        return 0.5 * (h + h.T)

    @cached_property
    def relative_sd(self) -> Floats:
        """Standard deviation of each coefficient as a share of it; infinite where it is not determined."""
        curvature = np.diag(self.information)
        known = curvature > 1e-3
        sd = np.full(len(self.power), np.inf)
        if known.any():
            sub = self.information[np.ix_(known, known)]
            sd[known] = 0.5 * np.sqrt(np.maximum(np.diag(np.linalg.pinv(sub)), 0))
        return sd


def fit_noise(
    pooled: Pooled,
    prior: Floats,
    restricted: bool = True,
    start: Floats | None = None,
    most: Floats | None = None,
) -> NoiseFit:
    """Powers of the noise terms that maximise the (restricted) likelihood.

    Fisher scoring: each pass regresses the power of the groups on the spectral shapes with non-negative
    coefficients, weighted by the variance that the pass before gives them; then a quasi-Newton polish.

    Parameters
    ----------
    pooled : Pooled
        Column 0 is the data, the others the regressors.
    prior : ndarray, shape (c - 1,)
        Prior precision of the regressors' coefficients.
    restricted : bool
        Restricted likelihood, for estimates; the plain one, for ratios between models.
    start : ndarray, shape (terms,), optional
        Powers to start from.
    most : ndarray, shape (terms,), optional
        Largest power of each term.
    """
    scale = pooled.scale
    low = np.log(_ABSENT * scale)
    high = np.log(_MOST * scale)
    high = high if most is None else _within(np.log(np.maximum(most, 1e-300)), low, high)
    powers = 0.25 * scale if start is None else np.maximum(start, 1e-3 * scale)
    powers = _scored(pooled, prior, restricted, powers, slice(None) if most is None else np.flatnonzero(most > 0))
    x = _within(np.log(np.maximum(powers, 1e-6 * scale)), low, high)

    def likelihood(power: Floats) -> tuple[float, Floats]:
        return loglik(pooled, power, prior, restricted)

    def cost(x: Floats) -> tuple[float, Floats]:
        power = np.exp(x)
        value, gradient = likelihood(power)
        return -value, -gradient * power

    value, slope = cost(x)
    free = ((x > low) | (slope < 0)) & ((x < high) | (slope > 0))
    if (free & (np.abs(slope) > _FLAT)).any():
        bounds = list(zip(low, high, strict=True))
        best = minimize(cost, x, jac=True, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-10, "gtol": _FLAT})
        x, value = best.x, float(best.fun)
    return NoiseFit(np.exp(x), -value, likelihood)


def _within(values: Floats, low: Floats, high: Floats) -> Floats:
    """As np.clip, which takes longer to look at four numbers than to change them."""
    return np.minimum(np.maximum(values, low), high)


def _scored(
    pooled: Pooled, prior: Floats, restricted: bool, power: Floats, free: slice | NDArray[np.intp], passes: int = 25
) -> Floats:
    """Powers after some passes of Fisher scoring, steps halved where the likelihood would fall; ``free`` terms alone.

    What a term that must be nothing would take the others have to take from the start: nearly nothing of them, where
    it took all, is a place from which no slope leads away.
    """
    bound = np.ones(len(power), bool)
    bound[free] = False
    power = np.where(bound, _NONE, power)
    at = _profile(pooled, power, prior)
    value = at.loglik(pooled, prior, restricted)
    shapes = pooled.shapes[:, free]
    for _ in range(passes):
        freedom = _freedom(pooled, at, restricted)
        root = np.sqrt(freedom)
        root *= at.weight
        rows = shapes * root[:, None]
        column = np.sqrt(np.add.reduce(rows * rows, axis=0))
        rows /= column
        target = np.zeros(len(power))
        target[free] = nnls(rows, at.energy / freedom * root)[0] / column
        for _ in range(6):
            tried = np.maximum(target, np.maximum(1e-12 * power, _NONE))
            new = _profile(pooled, tried, prior)
            gained = new.loglik(pooled, prior, restricted) - value
            if gained > 0:
                break
            target = 0.5 * (target + power)
        if gained <= 0:
            break
        power, at, value = tried, new, value + gained
        if gained < 1e-6:
            break
    return power


def _freedom(pooled: Pooled, at: _Profile, restricted: bool) -> Floats:
    """Degrees of freedom of the residual of a profile in each group."""
    if not restricted or not len(at.beta):
        return pooled.count
    return np.maximum(pooled.count - pooled.traces(at.inverse()) / at.s, 0.05 * pooled.count)


def _scale(pooled: Pooled) -> Floats:
    """As `Pooled.scale`."""
    share = pooled.shapes / np.maximum.reduce(pooled.shapes, axis=0)
    whole = pooled.weighted(np.ones(len(pooled.count)))
    beta: Floats = np.zeros(0)
    singular = 0
    if len(whole) > 1:
        whole.reshape(-1)[:: len(whole) + 1] *= 1 + _RIDGE
        _, beta, singular = dposv(whole[1:, 1:], whole[1:, 0])
    if singular:
        beta = np.asarray(np.linalg.lstsq(whole[1:, 1:], whole[1:, 0], rcond=None)[0], np.float64)
    r = np.concatenate([[1.0], -beta])
    energy = np.maximum(pooled.energy(r), _ROUNDING * pooled.cross[:, 0, 0])
    return np.maximum((share * energy[:, None]).sum(0) / (share * pooled.shapes * pooled.count[:, None]).sum(0), 1e-60)


#: Of no regressors, and their factor.
_NO_COEFFICIENTS = np.zeros(0), np.zeros((0, 0))


class _Profile(NamedTuple):
    """Coefficients at their best for a noise.

    Variances of the groups and their inverses, energy left in each, coefficients, Cholesky factor of their information.
    """

    s: Floats
    weight: Floats
    energy: Floats
    beta: Floats
    factor: Floats

    def inverse(self) -> Floats:
        """Covariance of the coefficients, shape (c - 1, c - 1)."""
        return np.asarray(dpotrs(self.factor, np.eye(len(self.beta)), lower=0)[0])

    def loglik(self, pooled: Pooled, prior: Floats, restricted: bool) -> float:
        """Log-likelihood."""
        value = pooled.count.dot(np.log(self.s)) + self.energy.dot(self.weight) + (self.beta * self.beta).dot(prior)
        if restricted and len(self.beta):
            value += 2 * np.add.reduce(np.log(self.factor.diagonal()))
        return float(-0.5 * value)


def _profile(pooled: Pooled, power: Floats, prior: Floats) -> _Profile:
    s = pooled.shapes.dot(power)
    weight = 1 / s
    products = weight.dot(pooled.flat)
    c = len(prior) + 1
    diagonal = products[c + 1 :: c + 1]
    diagonal += prior
    diagonal *= 1 + _RIDGE
    beta, factor = _NO_COEFFICIENTS
    r = np.empty(c)
    r[0] = 1.0
    if c > 1:
        a = products.reshape(c, c)
        # As scipy.linalg.cho_factor and cho_solve, whose checks of batches cost more than the matrix itself.
        factor, beta, indefinite = dposv(a[1:, 1:], a[1:, 0])
        if indefinite:
            raise np.linalg.LinAlgError("the regressors' information is not positive definite")
        np.negative(beta, out=r[1:])
    return _Profile(s, weight, pooled.energy(r), beta, factor)


def loglik(pooled: Pooled, power: Floats, prior: Floats, restricted: bool) -> tuple[float, Floats]:
    """Log-likelihood with the coefficients at their best, and its gradient in the powers."""
    at = _profile(pooled, power, prior)
    excess = at.energy * at.weight - pooled.count
    if restricted and len(at.beta):
        excess += pooled.traces(at.inverse()) * at.weight
    return at.loglik(pooled, prior, restricted), (0.5 * excess * at.weight).dot(pooled.shapes)
