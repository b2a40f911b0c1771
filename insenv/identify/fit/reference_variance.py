r"""How much less certain parameters are beside a reference whose errors go with the motion.

With w the weights of a coefficient over the whitened data, what the response of the reference may be, F b with
b ~ N(0, S^2) (`insenv.identify.fit.bands`), and noise that goes with the motion (`insenv.identify.fit.swings`) add

    w'F S^2 F'w + (f - 1) w'w

to its variance: the gain that is fitted is that of the reference at the frequencies of the motion, and the rows of one
swing are no independent readings. Where what is left is noise, S is zero, f one, and nothing is added.
"""

from __future__ import annotations

import numpy as np

from insenv.core.recording import Floats
from insenv.identify.fit.bands import in_bands, response
from insenv.identify.fit.gls import Fit, spectrum, whitened_rows
from insenv.identify.fit.problem import Problem
from insenv.identify.fit.swings import by_swings


def added_variance(problem: Problem, fit: Fit) -> Floats:
    """What the variance of each scaled coefficient of ``fit`` grows by for the reference's errors, shape (p,)."""
    rows, data = whitened_rows(problem, fit.design, fit.noise.power)
    p, n = rows.shape[1], len(problem.data())
    if not p or not problem.target.startswith("gyro") or not any(np.ptp(e.u) for e in problem.exposures):
        return np.zeros(p)
    q, upper = np.linalg.qr(rows)
    weights = np.linalg.solve(upper, q.T)[:, :n]
    bands, frequency = in_bands(problem)
    white = bands / np.sqrt(spectrum(problem, fit.noise.power))[:, None]
    beside = np.vstack([white, np.zeros((p, white.shape[1]))])
    beside = beside - q @ (q.T @ beside)
    left = data - q @ (q.T @ data)
    sizes, _ = response(beside.T @ beside, beside.T @ left, frequency)
    grown = np.sum((weights @ white * sizes) ** 2, axis=1)
    own = left[:n] - beside[:n] @ _response(beside, left, sizes)
    factors = np.array([by_swings(problem, w, own)[0] for w in weights])
    return np.asarray(grown + (factors - 1) * np.sum(weights**2, axis=1))


def _response(beside: Floats, left: Floats, sizes: Floats) -> Floats:
    """The likeliest coefficients of the bands, shape (k,)."""
    scaled = beside * sizes
    inner = scaled.T @ scaled + np.eye(len(sizes))
    return np.asarray(sizes * np.linalg.solve(inner, scaled.T @ left))
