"""A bias that walks at random from rest to rest, by restricted maximum likelihood.

    cov = s^2 (I + kappa W),    W_kl = min(t_k, t_l) a_kl  within a run

with t the middle of a rest and a_kl how much of the walk that rest k feels rest l feels too (1 for one channel). Such
a walk looks like a drift, and by chance like anything that changes slowly: kappa is estimated from the fitted rests,
beside everything that is to be tried. Few rests do not tell it well, and one that is taken too small makes an effect of
every walk: what is found must stand against the largest that is within `ALLOWED` of the best likelihood as well.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats

#: Walks that are tried, as variance from rest to rest per variance of a mean.
WALKS = (0.0, *np.geomspace(0.01, 100.0, 17).tolist())
#: Log likelihood below the best at which a walk is still likely enough: half of the 95 % point of chi-square.
ALLOWED = 1.92
#: Least freedom with which a walk is looked for.
LEAST_FREEDOM = 4


def walking(
    y: Floats,
    design: Floats,
    time: Floats,
    runs: NDArray[np.int64],
    used: NDArray[np.bool_],
    alike: Floats | float = 1.0,
    allowed: float = 0.0,
) -> Floats | None:
    """L of the covariance s^2 L L' with the largest walk allowed, shape (n, n), units that are not ``used`` last.

    None where there is too little freedom to tell.

    Parameters
    ----------
    y : ndarray, shape (n,)
    design : ndarray, shape (n, p)
        Derivatives of ``y`` to all that is to be tried.
    time, runs : ndarray, shape (n,)
    used : ndarray of bool, shape (n,)
    alike : ndarray, shape (n, n), optional
    allowed : float
        Log likelihood below the best that the walk may have: 0 for the likeliest walk.
    """
    told = design[:, np.linalg.norm(design[used], axis=0) > 0]
    if int(used.sum()) - np.linalg.matrix_rank(told[used]) < LEAST_FREEDOM:
        return None
    basis, size, _ = np.linalg.svd(told[used] / np.linalg.norm(told[used], axis=0), full_matrices=False)
    basis = basis[:, size > 1e-6 * size.max(initial=0.0)]
    walk = np.minimum(time[:, None], time[None, :]) * (runs[:, None] == runs[None, :]) * alike
    walk = walk / max(float(np.median(np.abs(np.diff(time)))), 1e-9)

    def covariance(kappa: float) -> Floats:
        return np.eye(len(time)) + kappa * walk

    likelihood = [restricted_likelihood(y[used], basis, covariance(k)[np.ix_(used, used)]) for k in WALKS]
    best = max(k for k, value in zip(WALKS, likelihood, strict=True) if value >= max(likelihood) - allowed)
    order = np.concatenate([np.flatnonzero(used), np.flatnonzero(~used)])
    root = np.zeros_like(walk)
    root[np.ix_(order, order)] = np.linalg.cholesky(covariance(best)[np.ix_(order, order)])
    return root


def restricted_likelihood(y: Floats, design: Floats, covariance: Floats) -> float:
    """Restricted likelihood of the shape of a covariance, its scale estimated."""
    root = np.linalg.cholesky(covariance)
    x, z = np.linalg.solve(root, design), np.linalg.solve(root, y)
    q, r = np.linalg.qr(x / np.linalg.norm(design, axis=0))
    left = z - q @ (q.T @ z)
    freedom = len(y) - design.shape[1]
    logs = np.log(np.diag(root)).sum() + np.log(np.maximum(np.abs(np.diag(r)), 1e-12)).sum()
    return float(-logs - 0.5 * freedom * np.log(max(float(left @ left), 1e-300)))
