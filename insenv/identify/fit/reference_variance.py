r"""How much less certain parameters are beside a reference whose response goes with the frequency.

With w the weights of a coefficient over the whitened data, what the response of the reference may be, F b with
b ~ N(0, S^2) (`insenv.identify.fit.bands`), adds

    w'F S^2 F'w

to its variance: the gain that is fitted is that of the reference at the frequencies of the motion. Where what is left
is noise nothing is added: S counts where its likelihood is more than chance, exp(-l) < 5 % (two parameters, Wilks).
What is left beside that response tells how much swings differ (`insenv.identify.fit.swings`, in the covariance of
`insenv.identify.fit.uncertainty`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from insenv.core.recording import Floats
from insenv.identify.fit.bands import in_bands, response
from insenv.identify.fit.gls import Fit, spectrum, whitened_rows
from insenv.identify.fit.problem import Problem

#: Chance of a response where there is noise alone.
CHANCE = 0.05


@dataclass(frozen=True)
class Beside:
    """What the variance of each scaled coefficient grows by, shape (p,), and what is left, whitened, shape (modes,)."""

    added: Floats
    left: Floats


def beside_response(problem: Problem, fit: Fit) -> Beside | None:
    """A fit beside the response of the reference; None where no gyro turns, or nothing is fitted."""
    found: Beside | None = problem.remember_last("beside response", fit, lambda: _beside_response(problem, fit))
    return found


def _beside_response(problem: Problem, fit: Fit) -> Beside | None:
    rows, data = whitened_rows(problem, fit.design, fit.noise.power)
    p, n = rows.shape[1], len(problem.data())
    if not p or not problem.target.startswith("gyro") or not problem.turns:
        return None
    q, upper = np.linalg.qr(rows)
    weights = np.linalg.solve(upper, q.T)[:, :n]
    bands, frequency = in_bands(problem)
    white = bands / np.sqrt(spectrum(problem, fit.noise.power))[:, None]
    beside = np.vstack([white, np.zeros((p, white.shape[1]))])
    beside = beside - q @ (q.T @ beside)
    left = data - q @ (q.T @ data)
    sizes, gained = response(beside.T @ beside, beside.T @ left, frequency)
    if np.exp(-gained) > CHANCE:
        sizes = np.zeros_like(sizes)
    added = np.sum((weights @ white * sizes) ** 2, axis=1)
    return Beside(added, left[:n] - beside[:n] @ _response(beside, left, sizes))


def _response(beside: Floats, left: Floats, sizes: Floats) -> Floats:
    """The likeliest coefficients of the bands, shape (k,)."""
    scaled = beside * sizes
    inner = scaled.T @ scaled + np.eye(len(sizes))
    return np.asarray(sizes * np.linalg.solve(inner, scaled.T @ left))
