r"""Rates of a scale-factor test: optimal designs for models of the output against the rate.

With the basis f of a model, x = rate / top, shares w_i of the time and noise of density N^2,

    M(w) = sum_i w_i f(x_i) f(x_i)',        Cov = N^2 M^-1 / T

A D-optimal design has the largest det M; the multiplicative rule w_i <- w_i f_i' M^-1 f_i / p climbs to it. A
c-optimal one has the least variance of one coefficient c: by Elfving's theorem w_i = |u_i| / U for the least
U = sum |u_i| with sum u_i f(x_i) = c, and the variance is U^2. For odd polynomials of degree n it is T_n'(0)^2 = n^2:
1, 9, 25. Both are found on a grid that is then made finer around the rates that were chosen.

What a model excludes its optimal design never looks for: a local fault at one of its rates bends the line unseen.

Sources: A. C. Atkinson, A. N. Donev, R. D. Tobias, Optimum Experimental Designs, with SAS (2007); G. Elfving, Ann.
Math. Stat. 23 (1952) 255; D. M. Titterington, Appl. Statist. 27 (1978) 227: the multiplicative rule.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats

#: Terms of each model; x is the rate, as a share of the largest.
MODELS: dict[str, tuple[str, ...]] = {
    "line": ("1", "x"),
    "cubic": ("1", "x", "x^3"),
    "quintic": ("1", "x", "x^3", "x^5"),
    "asymmetry": ("1", "x", "|x|"),
}
CRITERIA = ("c", "d")
_TERMS: dict[str, Callable[[Floats], Floats]] = {
    "1": np.ones_like,
    "x": lambda x: x,
    "|x|": np.abs,
    "x^3": lambda x: x**3,
    "x^5": lambda x: x**5,
}
#: Points of the first grid, and of each finer one to either side of a point that was chosen.
_GRID, _AROUND = 141, 12
#: Times that the grid is made finer.
_ROUNDS = 3
#: Shares below this are none; steps of the multiplicative rule, and the excess of f' M^-1 f over p at which it ends.
_NONE, _STEPS, _OPTIMAL = 1e-5, 2000, 1e-4


@dataclass(frozen=True)
class LadderDesign:
    """Rates [rad/s], ascending, and the share of the time for each, both of shape (k,)."""

    rate: Floats
    share: Floats


def basis(model: str, x: Floats) -> Floats:
    """Terms of a model, shape (..., n, p), at rates ``x``, shape (..., n).

    Raises
    ------
    InputError
        If there is no such model.
    """
    if model not in MODELS:
        raise InputError(f"rate ladder: model {model!r} given, wanted one of {', '.join(MODELS)}")
    return np.stack([_TERMS[term](np.asarray(x, np.float64)) for term in MODELS[model]], axis=-1)


def optimal(model: str, criterion: str, top: float) -> LadderDesign:
    """The optimal design for rates up to ``top`` [rad/s] either way; "c": for the scale factor.

    Raises
    ------
    InputError
        If there is no such model or criterion, or ``top`` is not positive.
    """
    if criterion not in CRITERIA:
        raise InputError(f"rate ladder: criterion {criterion!r} given, wanted {' or '.join(CRITERIA)}")
    if not 0 < top < np.inf:
        raise InputError(f"rate ladder: largest rate of {top:g} rad/s given, wanted a positive one")
    x, share = _of_unit_range(model, criterion)
    return LadderDesign(top * x, share.copy())


@cache  # a policy asks at each of its beginnings, and it takes a quarter of a second
def _of_unit_range(model: str, criterion: str) -> tuple[Floats, Floats]:
    """Rates from -1 to 1 and their shares."""
    solve = _c_optimal if criterion == "c" else _d_optimal
    x = np.linspace(-1.0, 1.0, _GRID)
    spacing = x[1] - x[0]
    for k in range(_ROUNDS):
        share = solve(basis(model, x))
        # All models are symmetric: the mirror image of an optimal design is one, and so is their mean.
        share = 0.5 * (share + share[::-1])
        x, share = _merged(x, share, 2 * spacing)
        if k < _ROUNDS - 1:
            near = x[:, None] + spacing * np.arange(-_AROUND, _AROUND + 1) / _AROUND
            x, spacing = np.unique(np.clip(np.round(near, 9), -1.0, 1.0)), spacing / _AROUND
    share = solve(basis(model, x))
    return x, 0.5 * (share + share[::-1])


def covariance(model: str, x: Floats, variance: Floats, weighted: bool = True) -> Floats:
    """Covariance of the coefficients, shape (p, p), from means at ``x`` that have a variance each, shape (n,).

    Without weights it is that of a plain least-squares fit, as the published procedure makes it. Coefficients that
    the rates do not tell have what the pseudo-inverse gives.
    """
    F = basis(model, x)
    G = np.linalg.pinv(F)
    found: Floats = (G * variance) @ G.T
    if weighted:
        found = np.linalg.pinv(F.T @ (F / variance[:, None]), hermitian=True).astype(float)
    return found


def scale_factor_variance(design: LadderDesign, model: str) -> float:
    """Variance of the scale factor, in N^2 / (T top^2): 1 for a line with half of the time at each end."""
    top = float(np.abs(design.rate).max())
    used = design.share > 0
    x = design.rate[used] / top
    return float(covariance(model, x, 1.0 / design.share[used])[1, 1])


def coverage(rates: Floats, width: float, top: float) -> float:
    """Share of the magnitudes from 0 to ``top`` that lie within ``width`` of one that is run [all rad/s].

    A local fault elsewhere is not seen: the nonlinearity of a list of rates is a lower bound.
    """
    near = np.sort(np.unique(np.abs(rates)))
    low, high = np.maximum(near - width, 0.0), np.minimum(near + width, top)
    low = np.maximum(low, np.concatenate([[0.0], np.maximum.accumulate(high)[:-1]]))
    return float(np.maximum(high - low, 0.0).sum() / top)


def _c_optimal(F: Floats) -> Floats:
    """Shares of the points with the basis ``F`` for the second coefficient (Elfving, as a linear programme)."""
    from scipy.optimize import linprog

    n, p = F.shape
    solved = linprog(np.ones(2 * n), A_eq=np.hstack([F.T, -F.T]), b_eq=np.eye(p)[1], method="highs")
    u = np.abs(solved.x[:n] - solved.x[n:])
    return np.asarray(u / u.sum())


def _d_optimal(F: Floats) -> Floats:
    """Shares of the points with the basis ``F`` by the multiplicative rule."""
    n, p = F.shape
    kept, w = np.arange(n), np.full(n, 1.0 / n)
    for _ in range(_STEPS):
        G = F[kept]
        d = np.einsum("ij,ij->i", G @ np.linalg.inv(G.T @ (G * w[:, None])), G) / p
        if d.max() < 1 + _OPTIMAL:
            break
        w = w * d
        # A point with less than this lies in no optimal design (Harman and Pronzato, 2007).
        excess = p * (d.max() - 1)
        least = 1 + excess / 2 - np.sqrt(excess * (4 + excess - 4 / p)) / 2
        alive = d >= least
        kept, w = kept[alive], w[alive] / w[alive].sum()
    share = np.zeros(n)
    share[kept] = w
    return share


def _merged(x: Floats, share: Floats, within: float) -> tuple[Floats, Floats]:
    """The heaviest of each group of neighbours, with the share of all of them; symmetric as it was."""
    x, share = x[share > _NONE], share[share > _NONE]
    group = np.concatenate([[0], np.cumsum(np.diff(x) > within)])
    # Of the two of a mirrored pair the outer one is taken, on both sides.
    heaviest = [
        max(np.flatnonzero(group == g), key=lambda i: (round(float(share[i]), 9), abs(x[i])))
        for g in range(group[-1] + 1)
    ]
    total: Floats = np.bincount(group, share).astype(float)
    return x[heaviest], total
