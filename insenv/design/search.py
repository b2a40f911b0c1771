r"""The best point of a box: a grid, then a simplex from its best points, or CMA-ES where the box is large.

    x = low + s (high - low),  or  low (high / low)^s,    s in [0, 1]

Whole variables are tried one by one. All is deterministic, and nothing leaves the box.
Sources: J. A. Nelder, R. Mead, Computer J. 7 (1965) 308; N. Hansen, The CMA Evolution Strategy: A Tutorial,
arXiv:1604.00772.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from itertools import product
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.design.kind import Family, Variable

Values = Mapping[str, float]
Objective = Callable[[Values], float]

METHODS = ("auto", "grid", "simplex", "cma")
#: Free variables from which on CMA-ES takes over, evaluations of it and of a simplex, points of a grid at most.
LARGE, _CMA, _SIMPLEX, _MOST = 5, 400, 100, 512
#: Best points of the grid that a simplex begins at.
_STARTS = 2
#: Side of the first simplex and deviation of the first generation, as shares of the box.
_SIDE, _SIGMA = 0.12, 0.2
#: Stands for what cannot be played: CMA-ES ranks, and wants numbers.
_IMPOSSIBLE = 1e30


@dataclass(frozen=True)
class BestPoint:
    """The best point."""

    values: Values
    cost: float


def best(
    objective: Objective, family: Family, start: Sequence[Values] = (), method: str = "auto", seed: int = 0
) -> BestPoint | None:
    """The point of least cost; None where every point costs infinitely much.

    Parameters
    ----------
    objective : callable
        Cost of values; infinite where they cannot be.
    family : tuple of Variable
    start : sequence of values
        Points that are known to be good: with any, only these are gone on from, and there is no grid.
    method : "auto", "grid", "simplex" or "cma"
    seed : int
        Of CMA-ES.

    Raises
    ------
    InputError
        If there is no such method, or CMA-ES is asked for by name and is not installed.
    """
    if method not in METHODS:
        raise InputError(f"search {method!r} given; wanted one of {', '.join(METHODS)}")
    given = [_inside(family, one) for one in start] or _grid(family)
    ranked = sorted(((objective(one), k) for k, one in enumerate(given)), key=lambda pair: pair)
    tried = [BestPoint(given[k], cost) for cost, k in ranked if np.isfinite(cost)]
    if not tried:
        return None
    free = [v for v in family if not v.whole and v.high > v.low]
    if not free or method == "grid":
        return tried[0]
    if method == "cma" or (method == "auto" and len(free) >= LARGE and installed()):
        return min([tried[0], _evolved(objective, free, tried[0], seed)], key=lambda one: one.cost)
    return min((_simplex(objective, free, one) for one in tried[:_STARTS]), key=lambda one: one.cost)


def installed() -> bool:
    """Whether CMA-ES is there."""
    return find_spec("cma") is not None


def _inside(family: Family, values: Values) -> dict[str, float]:
    return {v.name: min(max(values[v.name], v.low), v.high) for v in family}


def _grid(family: Family) -> list[dict[str, float]]:
    """All combinations; of many continuous variables fewer points each."""
    free = [v for v in family if not v.whole and v.high > v.low]
    whole = int(np.prod([v.high - v.low + 1 for v in family if v.whole] or [1]))
    most = max(int((_MOST / whole) ** (1 / max(len(free), 1))), 2)
    axes = [_ticks(v, min(v.points, most)) for v in family]
    return [dict(zip([v.name for v in family], point, strict=True)) for point in product(*axes)]


def _ticks(variable: Variable, points: int) -> list[float]:
    if variable.high <= variable.low:
        return [variable.low]
    if variable.whole:
        return np.arange(round(variable.low), round(variable.high) + 1.0).tolist()
    return [_value(variable, s) for s in np.linspace(0.0, 1.0, points)]


def _value(variable: Variable, share: float) -> float:
    low, high = variable.low, variable.high
    s = min(max(float(share), 0.0), 1.0)
    return float(low * (high / low) ** s) if variable.log else low + s * (high - low)


def _share(variable: Variable, value: float) -> float:
    low, high = variable.low, variable.high
    return float(np.log(value / low) / np.log(high / low)) if variable.log else (value - low) / (high - low)


def _at(free: Sequence[Variable], shares: Any, held: Values) -> dict[str, float]:
    return {**held, **{v.name: _value(v, s) for v, s in zip(free, shares, strict=True)}}


def _simplex(objective: Objective, free: Sequence[Variable], start: BestPoint) -> BestPoint:
    from scipy.optimize import minimize

    first = np.array([_share(v, start.values[v.name]) for v in free])
    corners: Floats = np.vstack([first, *(first + step for step in _SIDE * np.diag(np.where(first > 0.5, -1.0, 1.0)))])
    solved = minimize(
        lambda s: min(objective(_at(free, s, start.values)), _IMPOSSIBLE),
        first,
        method="Nelder-Mead",
        bounds=[(0.0, 1.0)] * len(free),
        options={"initial_simplex": corners, "maxfev": _SIMPLEX, "xatol": 1e-3, "fatol": 1e-4 * start.cost},
    )
    return BestPoint(_at(free, solved.x, start.values), float(solved.fun)) if solved.fun < start.cost else start


def _evolved(objective: Objective, free: Sequence[Variable], start: BestPoint, seed: int) -> BestPoint:
    try:
        import cma
    except ImportError:
        raise InputError("search 'cma' needs the package cma; install insenv[design], or use 'simplex'") from None
    first = [_share(v, start.values[v.name]) for v in free]
    strategy = cma.CMAEvolutionStrategy(
        first,
        _SIGMA,
        {"bounds": [0.0, 1.0], "seed": seed + 1, "maxfevals": _CMA, "verbose": -9, "tolfun": 1e-4 * start.cost},
    )
    while not strategy.stop():
        asked = strategy.ask()
        strategy.tell(asked, [min(objective(_at(free, s, start.values)), _IMPOSSIBLE) for s in asked])
    found = strategy.result
    return BestPoint(_at(free, found.xbest, start.values), float(found.fbest))
