r"""Time shared among parts of a procedure so that all parameters are told as wanted, with a certificate.

    M(x) = M_0 + sum_k x_k A_k,      phi(x) = max_i [M^-1]_ii / w_i^2,      sum_k x_k = T,   x >= 0

with A_k what a second of part k tells. phi is convex. For any weights lambda of the parameters, that sum to one,
psi = sum_i lambda_i [M^-1]_ii / w_i^2 <= phi, and as psi is convex with slopes -g_k,

    phi(y) >= psi(x) + sum_k g_k x_k - T max_k g_k         for every y and any x,

so that a pair (x, lambda) proves a bound by itself, however it was found. It is found by multiplicative steps of both.
Source: Pukelsheim, Optimal Design of Experiments (1993), chapter 7; Silvey, Titterington and Torsney, An algorithm for
optimal designs on a finite design space, Commun. Statist. A7 (1978) 1379.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from insenv.core.recording import Floats

#: Powers of the ratios and of the slopes with which weights and times are changed, and the least weight.
_OF_WEIGHTS, _OF_TIME, _LEAST = 0.25, 0.5, 1e-7


@dataclass(frozen=True)
class Shares:
    """Times with the largest ratio that was found, and what none betters.

    Attributes
    ----------
    seconds : ndarray, shape (k,)
    ratio : float
        Largest of the deviations over the wanted ones.
    weights : ndarray, shape (q,)
        Of the parameters: those that stand in the way have the most.
    bound : float
        No other times have a smaller ratio.
    """

    seconds: Floats
    ratio: float
    weights: Floats
    bound: float


def shared(  # noqa: PLR0913 -- what is asked for, and where the steps begin
    known: Floats, parts: Floats, time: float, wanted: Floats, steps: int, begin: tuple[Floats, Floats] | None = None
) -> Shares:
    """The best shares that ``steps`` steps find.

    Parameters
    ----------
    known : ndarray, shape (p, p)
        M_0, the prior in it.
    parts : ndarray, shape (k, p * p)
        What a second of each tells.
    time : float
        To be shared [s].
    wanted : ndarray, shape (q,)
        Deviations of the first q parameters, in the units of the matrices.
    steps : int
    begin : (ndarray, ndarray), optional
        Times, of any scale, and weights of the parameters; none: all the same.
    """
    k, q = len(parts), len(wanted)
    x, weights = (np.ones(k), np.full(q, 1 / q)) if begin is None else begin
    x = x * (time / x.sum())
    seconds, best, bound, proof = x, np.inf, 0.0, weights
    for _ in range(steps):
        inverse: Floats = np.asarray(np.linalg.inv(known + (x @ parts).reshape(known.shape)), float)
        ratios = np.diag(inverse)[:q] / wanted**2
        scaled = inverse[:, :q] * np.sqrt(weights) / wanted
        slopes = parts @ (scaled @ scaled.T).ravel()
        if (low := float(weights @ ratios + slopes @ x - time * slopes.max())) > bound:
            bound, proof = low, weights
        if ratios.max() < best:
            best, seconds = float(ratios.max()), x
        x = x * slopes**_OF_TIME
        x *= time / x.sum()
        weights = weights * ratios**_OF_WEIGHTS + _LEAST
        weights /= weights.sum()
    return Shares(seconds, float(np.sqrt(best)), proof, float(np.sqrt(bound)))
