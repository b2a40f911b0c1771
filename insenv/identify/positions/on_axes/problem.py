r"""A whole unit on a table whose axes are read: rests and turns of six channels as one problem.

    y = X theta + D eta + e,      e ~ N(0, s_c^2 C_c)

with the cells, the regressors X of the effects, the derivatives D to the errors of the table and the covariance C_c of
channel c as `insenv.information.unit.calibration` makes them; eta, errors of the table of which a deviation is stated,
have that as prior. The size s_c of a channel's noise is what all that may be found leaves of it. Rests are counted from
1 through all runs, and the turn after one belongs to it: both are held out together. Residuals are whitened with the
held-out cells last.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, cholesky, solve_triangular

from insenv.core.recording import Floats
from insenv.effects.base import Param
from insenv.identify.fit.evidence import HELD_OUT_SPREAD


@dataclass(frozen=True)
class Cause:
    """What a term is the error of: ``kind`` "gyro", "accel" or "table", and the effect's id with its parameters."""

    kind: str
    id: str
    linear: tuple[Param, ...]

    @property
    def key(self) -> str:
        """Kind and id."""
        return f"{self.kind}.{self.id}"


@dataclass(frozen=True)
class Share:
    """What a coefficient is called on one channel ("" for the table): parameter, unit, and its factor there."""

    channel: str
    name: str
    unit: str
    factor: float = 1.0


@dataclass(frozen=True)
class UnitTerm:
    """A cause with the places of its coefficients among a problem's columns; ``shape`` [s] where it has one."""

    effect: Cause
    at: tuple[int, ...]
    shares: tuple[tuple[Share, ...], ...]
    shape: float | None = None

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return len(self.at)

    def part(self, kept: Sequence[int]) -> UnitTerm:
        """The same cause with some of its coefficients alone."""
        return replace(self, at=tuple(self.at[j] for j in kept), shares=tuple(self.shares[j] for j in kept))


@dataclass(frozen=True)
class Cells:
    """Cells of one channel of one run: columns of all coefficients, means less what is stated, their covariance.

    Attributes
    ----------
    channel : int
    columns : ndarray, shape (m, P)
    nuisance : ndarray, shape (m, q)
    means : ndarray, shape (m,)
    covariance : ndarray, shape (m, m)
    time : ndarray, shape (m,)
        Middles [s].
    run : int
    turning, held_out : ndarray of bool, shape (m,)
    rest : ndarray of int, shape (m,)
        Number of the rest to which it belongs.
    """

    channel: int
    columns: Floats
    nuisance: Floats
    means: Floats
    covariance: Floats
    time: Floats
    run: int
    turning: NDArray[np.bool_]
    held_out: NDArray[np.bool_]
    rest: NDArray[np.int64]


@dataclass(frozen=True)
class OnAxes:
    """The cells of all channels, whitened: each cell is a unit of the search (`insenv.identify.positions.search`).

    Attributes
    ----------
    cells : tuple of Cells
    sizes : tuple of float
        s_c of each of them.
    nuisance : ndarray, shape (q,)
        Deviations that are stated of errors of the table [rad].
    """

    cells: tuple[Cells, ...]
    sizes: tuple[float, ...]
    nuisance: Floats
    foretold: NDArray[np.bool_] | None = None
    rank: int = 1
    spread: float = HELD_OUT_SPREAD

    @cached_property
    def held_out(self) -> NDArray[np.bool_]:
        """Cells to score, shape (n,): those that the fitted ones foretell."""
        out = np.concatenate([c.held_out for c in self.cells])
        return out if self.foretold is None else out & self.foretold

    @cached_property
    def fitted(self) -> NDArray[np.bool_]:
        """Cells to fit, shape (n,)."""
        return ~np.concatenate([c.held_out for c in self.cells])

    def begin(self, terms: Sequence[UnitTerm]) -> Floats:
        """At zero, shape (p + q,)."""
        return np.zeros(sum(term.size for term in terms) + len(self.nuisance))

    def evaluate(self, terms: Sequence[UnitTerm], theta: Floats) -> tuple[Floats, Floats]:
        """Whitened residuals, shape (n, 1), and their derivatives, shape (n, 1, p + q)."""
        y, columns, nuisance = self._white
        design = np.hstack([columns[:, [j for term in terms for j in term.at]], nuisance])
        return (y - design @ theta)[:, None], -design[:, None, :]

    @cached_property
    def root(self) -> Floats:
        """L of the noise's covariance, shape (n, n)."""
        return np.asarray(block_diag(*self._roots), float)

    def plain(self, residual: Floats) -> Floats:
        """The whitened residuals, shape (n, 1): of a held-out cell, what fitted ones do not foretell of its noise."""
        return residual

    def raw(self, residual: Floats) -> Floats:
        """Residuals before they were whitened, shape (n,), each in the unit of its channel."""
        cut = np.cumsum([len(c.means) for c in self.cells])[:-1]
        parts = np.split(residual.reshape(-1), cut)
        return np.concatenate([root @ part for root, part in zip(self._roots, parts, strict=True)])

    @cached_property
    def _roots(self) -> tuple[Floats, ...]:
        """Of each channel of each run: L with the held-out cells last, rows in the order of time."""
        found = []
        for c, size in zip(self.cells, self.sizes, strict=True):
            order = np.argsort(c.held_out, kind="stable")
            root = np.zeros_like(c.covariance)
            root[np.ix_(order, order)] = cholesky(c.covariance[np.ix_(order, order)], lower=True) * size
            found.append(root)
        return tuple(found)

    @cached_property
    def _white(self) -> tuple[Floats, Floats, Floats]:
        """Means, columns and derivatives to the table's errors, whitened."""
        parts = []
        for c, root in zip(self.cells, self._roots, strict=True):
            order = np.argsort(c.held_out, kind="stable")
            data = np.column_stack([c.means, c.columns, c.nuisance])
            white = np.empty_like(data)
            white[order] = solve_triangular(root[np.ix_(order, order)], data[order], lower=True, check_finite=False)
            parts.append(white)
        whole = np.concatenate(parts)
        p = self.cells[0].columns.shape[1]
        return whole[:, 0], whole[:, 1 : 1 + p], whole[:, 1 + p :]

    def rows(self, terms: Sequence[UnitTerm]) -> tuple[Floats, Floats]:
        """Whitened columns of the terms, then of the table's errors, and the whitened means."""
        y, columns, nuisance = self._white
        return np.hstack([columns[:, [j for term in terms for j in term.at]], nuisance]), y


#: Least cells beside its coefficients from which a channel tells the size of its noise, and its least and largest.
_LEAST, _SIZES = 8, (0.2, 1e4)
#: Share of a held-out cell's column that may lie where the fitted cells tell nothing.
_UNTOLD = 1e-3


def as_noisy_as_read(problem: OnAxes, terms: Sequence[UnitTerm]) -> OnAxes:
    """The problem with the noise of each channel as its fitted cells show it beside ``terms``."""
    y, columns, nuisance = problem._white  # noqa: SLF001
    used = problem.fitted
    places = np.array(sorted({j for term in terms for j in term.at}), int)
    rows = np.hstack([columns[np.ix_(used, places)], nuisance[used]])
    prior = np.hstack([np.zeros((len(problem.nuisance), len(places))), np.diag(1 / problem.nuisance)])
    design, right = np.vstack([rows, prior]), np.concatenate([y[used], np.zeros(len(prior))])
    width = np.linalg.norm(design, axis=0)
    basis, size, _ = np.linalg.svd(design / np.where(width > 0, width, 1.0), full_matrices=False)
    basis = basis[:, size > 1e-7 * size.max()]
    left = (right - basis @ (basis.T @ right))[: used.sum()]
    own = 1 - np.sum(basis[: used.sum()] ** 2, axis=1)
    channel = np.concatenate([np.full(len(c.means), c.channel) for c in problem.cells])[used]
    found = {}
    for c in np.unique(channel):
        freedom = float(own[channel == c].sum())
        scatter = float(np.sum(left[channel == c] ** 2)) / max(freedom, 1e-9)
        found[int(c)] = float(np.clip(np.sqrt(scatter), *_SIZES)) if freedom > _LEAST else 1.0
    sizes = tuple(size * found.get(c.channel, 1.0) for c, size in zip(problem.cells, problem.sizes, strict=True))
    return replace(problem, sizes=sizes)


def foretold(problem: OnAxes, terms: Sequence[UnitTerm]) -> OnAxes:
    """The problem whose held-out cells are those of which the fitted ones tell all coefficients of ``terms``."""
    _, columns, _ = problem._white  # noqa: SLF001
    design = columns[:, [j for term in terms for j in term.at]]
    width = np.linalg.norm(design, axis=0)
    design = design / np.where(width > 0, width, 1.0)
    _, size, axes = np.linalg.svd(design[problem.fitted], full_matrices=True)
    told = np.zeros(len(axes), bool)
    told[: len(size)] = size > 1e-7 * size.max(initial=0.0)
    lost = np.linalg.norm(design @ axes[~told].T, axis=1)
    return replace(problem, foretold=lost <= _UNTOLD * np.maximum(np.linalg.norm(design, axis=1), 1e-300))
