"""A bias that walks at random from rest to rest, by restricted maximum likelihood.

    cov = s^2 (I + kappa W) + C,    W_kl = min(t_k, t_l) a_kl

with t the middle of a rest, a_kl how much of the walk that rest k feels rest l feels too (1 for one channel in one
run), and C what is known of the noise beforehand: an instrument that is set down anew reads a little else, which the
parts of one rest have in common. Such a walk looks like a drift, and by chance like anything that changes slowly: kappa
is estimated from the fitted rests, beside everything that is to be tried. Few rests do not tell it well, and one that
is taken too small makes an effect of every walk: what is found must stand against the largest that is within `ALLOWED`
of the best likelihood as well.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from insenv.core.recording import Floats

#: Walks that are tried, as variance from rest to rest per variance of a mean.
WALKS = (0.0, *np.geomspace(0.01, 100.0, 17).tolist())
#: Times that the scale is fitted beside what is known of the noise beforehand.
SCALES = 4
#: Log likelihood below the best at which a walk is still likely enough: half of the 95 % point of chi-square.
ALLOWED = 1.92
#: Share of its size that a direction of the model must have beside the others. What has less is made of the readings'
#: own noise (scale factors and gravity differ by the reading itself), and with it a fit leaves nothing.
DISTINCT = 0.02
#: Below this p-value beside biases that walk, what is significant without them is said.
NEARLY = 0.1
#: Least freedom with which a walk is looked for.
LEAST_FREEDOM = 4


def walking(
    y: Floats,
    design: Floats,
    time: Floats,
    used: NDArray[np.bool_],
    alike: Floats,
    allowed: float = 0.0,
    known: Floats | None = None,
) -> tuple[Floats, float] | None:
    """L of the covariance s^2 L L' with the largest walk allowed, shape (n, n), units that are not ``used`` last; s^2.

    None where there is too little freedom to tell.

    Parameters
    ----------
    y : ndarray, shape (n,)
    design : ndarray, shape (n, p)
        Derivatives of ``y`` to all that is to be tried.
    time : ndarray, shape (n,)
    used : ndarray of bool, shape (n,)
    alike : ndarray, shape (n, n)
    allowed : float
        Log likelihood below the best that the walk may have: 0 for the likeliest walk.
    known : ndarray, shape (n, n), optional
        C.
    """
    basis = _distinct(design, used)
    if len(basis) - basis.shape[1] < LEAST_FREEDOM:
        return None
    walk = _walk(time, alike)
    shares = np.zeros_like(walk)  # C in s^2

    def covariance(kappa: float) -> Floats:
        return np.eye(len(time)) + kappa * walk + shares

    best, scale = 0.0, 1.0
    for _ in range(1 if known is None else SCALES):
        fits = _of_walks(y, basis, used, covariance)
        most = max(value for value, _ in fits)
        best = max(k for k, (value, _) in zip(WALKS, fits, strict=True) if value >= most - allowed)
        scale = fits[WALKS.index(best)][1]
        if known is not None:
            shares = known / scale
    return _root(covariance(best), used), scale


def likeliest(
    y: Floats, design: Floats, time: Floats, used: NDArray[np.bool_], alike: Floats
) -> tuple[float, float] | None:
    """Likelihood ratio of the likeliest walk over none, and how far it goes over all units; arguments as of `walking`.

    None where there is too little freedom to tell.
    """
    basis = _distinct(design, used)
    if len(basis) - basis.shape[1] < LEAST_FREEDOM:
        return None
    walk = _walk(time, alike)
    fits = _of_walks(y, basis, used, lambda kappa: np.eye(len(time)) + kappa * walk)
    best = max(range(len(WALKS)), key=lambda k: fits[k][0])
    steps = float(np.ptp(time[used])) / _step(time)
    return 2 * (fits[best][0] - fits[0][0]), float(np.sqrt(fits[best][1] * WALKS[best] * steps))


def weighed(
    y: Floats,
    design: Floats,
    time: Floats,
    used: NDArray[np.bool_],
    alike: Floats,
    known: Floats | None = None,
) -> list[tuple[float, Floats]]:
    """`WALKS` with their likelihood as a weight, those together one, each with L as of `walking`; arguments as there.

    A walk that is estimated is not known: the likeliest is often none, and what follows from it alone is too sure.
    ``known`` is to be in the span of the ``design``, beside which it changes neither likelihood nor scale.
    """
    basis, walk = _distinct(design, used), _walk(time, alike)
    if len(basis) - basis.shape[1] < 1:
        return [(1.0, np.eye(len(time)))]
    covariances = [np.eye(len(time)) + k * walk for k in WALKS]
    fits = [likelihood_and_scale(y[used], basis, c[np.ix_(used, used)]) for c in covariances]
    logs = np.array([value for value, _ in fits])
    weights = np.exp(logs - logs.max())
    if known is not None:
        covariances = [c + known / scale for c, (_, scale) in zip(covariances, fits, strict=True)]
    return [(float(w), _root(c, used)) for w, c in zip(weights / weights.sum(), covariances, strict=True)]


def _of_walks(
    y: Floats, basis: Floats, used: NDArray[np.bool_], covariance: Callable[[float], Floats]
) -> list[tuple[float, float]]:
    """`likelihood_and_scale` beside each of `WALKS`."""
    return [likelihood_and_scale(y[used], basis, covariance(kappa)[np.ix_(used, used)]) for kappa in WALKS]


def _distinct(design: Floats, used: NDArray[np.bool_]) -> Floats:
    """Directions of the model that are none of the readings' own noise, orthonormal, shape (used, q)."""
    told = design[:, np.linalg.norm(design[used], axis=0) > 0]
    basis, size, _ = np.linalg.svd(told[used] / np.linalg.norm(told[used], axis=0), full_matrices=False)
    found: Floats = basis[:, size > DISTINCT * size.max(initial=0.0)]
    return found


def _walk(time: Floats, alike: Floats) -> Floats:
    """W, of which one is that from rest to rest."""
    walk = np.minimum(time[:, None], time[None, :]) * alike
    return np.asarray(walk / _step(time), float)


def _step(time: Floats) -> float:
    """Time from one rest to the next [s]."""
    return max(float(np.median(np.abs(np.diff(time)))), 1e-9)


def _root(covariance: Floats, used: NDArray[np.bool_]) -> Floats:
    """L of a covariance, units that are not ``used`` last."""
    order = np.concatenate([np.flatnonzero(used), np.flatnonzero(~used)])
    root = np.zeros_like(covariance)
    root[np.ix_(order, order)] = np.linalg.cholesky(covariance[np.ix_(order, order)])
    return root


def restricted_likelihood(y: Floats, design: Floats, covariance: Floats) -> float:
    """Restricted likelihood of the shape of a covariance, its scale estimated."""
    return likelihood_and_scale(y, design, covariance)[0]


def likelihood_and_scale(y: Floats, design: Floats, covariance: Floats) -> tuple[float, float]:
    """`restricted_likelihood`, and the scale s^2 that it takes."""
    root = np.linalg.cholesky(covariance)
    white = solve_triangular(root, np.column_stack([design, y]), lower=True, check_finite=False)
    x, z = white[:, :-1], white[:, -1]
    q, r = np.linalg.qr(x / np.linalg.norm(design, axis=0))
    left = z - q @ (q.T @ z)
    freedom, square = len(y) - design.shape[1], max(float(left @ left), 1e-300)
    logs = np.log(np.diag(root)).sum() + np.log(np.maximum(np.abs(np.diag(r)), 1e-12)).sum()
    return float(-logs - 0.5 * freedom * np.log(square)), square / max(freedom, 1)
