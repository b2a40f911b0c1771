r"""How clearly a further run would tell one effect from another: from the regressors, before anything is measured.

    delta(a, b) = min over b, beta of || a A - X beta - B b ||_W

over the recorded runs and the further one together. A are the regressors of the effect that is taken for true, a its
size, B those of its rival at any shape, X the rest of the model with a level for each run, W the inverse of the fitted
noise. If a is true, the likelihood ratio of a over b is expected to be delta^2 more than chance gives. Either may be
true: the smaller of delta(a, b) and delta(b, a) counts, b of the size that the recorded runs give it.
Source: T-optimality, Atkinson and Fedorov, Biometrika 62 (1975) 57.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import minimize, minimize_scalar

from insenv.core.recording import Floats
from insenv.effects.base import Effect
from insenv.identify.fit.bins import Block
from insenv.identify.fit.gls import spectrum
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import Model, Problem, Term
from insenv.identify.search.scan import TOLD_APART

#: Share of the largest singular value below which a direction of the model is none.
_NOTHING = 1e-9
#: Steps of the refinement of a rival's shape.
_STEPS = 12


@dataclass(frozen=True)
class Rival:
    """An effect that may be true: its terms, one per shape, and its linear parameters where they are known.

    Without terms it is part of the model already.
    """

    key: str
    terms: tuple[Term, ...] = ()
    theta: Floats | None = None


@dataclass(frozen=True, eq=False)
class RecordedRuns:
    """The recorded runs, all of their bins, with a further run behind them; whitened by the noise of ``power``.

    ``known`` is one measurement more, of the horizontal Earth rate's coefficients: a direction over its standard
    deviation, shape (2,), zero where there is none. It is the last row.
    """

    recorded: Problem
    further: Problem | None
    power: Floats
    known: Floats
    _columns: dict[Term, Floats] = field(default_factory=dict, repr=False)
    _bases: dict[Model, Floats] = field(default_factory=dict, repr=False)

    def columns(self, term: Term) -> Floats:
        """Whitened regressors of a term, shape (modes + 1, k)."""
        if term not in self._columns:
            self._columns[term] = self._of(term)
        return self._columns[term]

    def _of(self, term: Term) -> Floats:
        before = self._white(self.recorded, term)
        if self.further is not None:
            after = self._white(self.further, replace(term, per_run=False))
            before = np.asarray(block_diag(before, after)) if term.per_run else np.vstack([before, after])
        last = self.known if term.effect.of_earth else np.zeros(before.shape[1])
        return np.vstack([before, last])

    def model(self, model: Model) -> Floats:
        """Orthonormal basis of the whitened model, with a level of the further run, shape (modes + 1, p)."""
        if model not in self._bases:
            self._bases[model] = self._basis(model)
        return self._bases[model]

    def _basis(self, model: Model) -> Floats:
        parts = [self.columns(term) for term in model]
        if self.further is not None:
            ones = transform(self.further.fitted, np.ones((self.further.bins.n, 1)))
            white = ones / np.sqrt(spectrum(self.further, self.power))[:, None]
            parts.append(np.vstack([np.zeros((len(self.recorded.data()), 1)), white, [[0.0]]]))
        return _basis(np.column_stack(parts)) if parts else np.zeros((len(self.recorded.data()) + 1, 0))

    def _white(self, problem: Problem, term: Term) -> Floats:
        return problem.transformed(term) / np.sqrt(spectrum(problem, self.power))[:, None]

    def forget(self, term: Term) -> None:
        """Drop what was computed for a shape that will not be asked for again."""
        self._columns.pop(term, None)
        for problem in (self.recorded, self.further):
            if problem is not None:
                problem.forget(term)


def whole(problem: Problem) -> Problem:
    """The problem with all of its bins fitted, stretches that follow each other joined."""
    index = np.concatenate(problem.bins.kept)
    blocks: list[Block] = []
    for block in sorted(problem.bins.blocks, key=lambda b: b.start):
        last = blocks[-1] if blocks else None
        if (
            last
            and last.run == block.run
            and last.stop == block.start
            and index[block.start] == index[last.stop - 1] + 1
        ):
            blocks[-1] = replace(last, stop=block.stop)
        else:
            blocks.append(replace(block, fitted=True))
    kept: dict[Hashable, Any] = {
        key: value for key, value in problem.cache.items() if isinstance(key, tuple) and key[0] == "columns"
    }
    return replace(problem, bins=replace(problem.bins, blocks=tuple(blocks)), cache=kept)


@dataclass(frozen=True, eq=False)
class Known:
    """What a separation starts from.

    Attributes
    ----------
    recorded : Problem
        As of `whole`.
    power : ndarray, shape (terms,)
        Squared coefficients of the noise.
    model : Model
        All terms but those that are confounded.
    earth : ndarray, shape (2,)
        As of `Stage.known`.
    """

    recorded: Problem
    power: Floats
    model: Model
    earth: Floats = field(default_factory=lambda: np.zeros(2))

    def stage(self, further: Problem | None) -> RecordedRuns:
        """With a further run: the same for all that ask of it one after the other."""
        key = ("stage", self.power.tobytes(), self.earth.tobytes())
        made: RecordedRuns = self.recorded.remember_last(
            key, further, lambda: RecordedRuns(self.recorded, further, self.power, self.earth)
        )
        return made


@dataclass(frozen=True, eq=False)
class Contest:
    """Two effects of which either may be true, and what the recorded runs tell: the same for every further run.

    ``a`` has its parameters, and its first term is the one of its shape.
    """

    known: Known
    a: Rival
    b: Rival

    @cached_property
    def instead(self) -> Rival | None:
        """``b`` as it takes the place of ``a`` on the recorded runs; None where the model has it."""
        if not self.b.terms:
            return None
        term, theta = sized(self.known, self.a, self.b)
        return Rival(self.b.key, (term,), theta)

    def separation(self, further: Problem | None) -> float:
        """The smaller of delta(a, b) and delta(b, a) after a further run (None: now), in standard deviations."""
        there = delta(self.known, further, self.a, self.b)
        return there if self.instead is None else min(there, delta(self.known, further, self.instead, self.a))


def delta(known: Known, further: Problem | None, a: Rival, b: Rival) -> float:
    """Delta(a, b) alone: what ``b`` leaves of ``a``, which has its parameters and its shape as the first term."""
    assert a.theta is not None
    stage = known.stage(further)
    return _distance(stage, stage.model(known.model), _shown(stage, a), b)


def sized(known: Known, a: Rival, b: Rival) -> tuple[Term, Floats]:
    """Shape and linear parameters with which ``b`` takes the place of ``a`` on the recorded runs."""
    assert a.theta is not None
    stage = known.stage(None)
    return _instead(stage, stage.model(known.model), _shown(stage, a), b)


def _shown(stage: RecordedRuns, a: Rival) -> Floats:
    """What ``a`` adds, whitened. A run of which its parameters are not known has the mean of the others'."""
    assert a.theta is not None
    term, columns = a.terms[0], stage.columns(a.terms[0])
    if len(a.theta) != columns.shape[1]:
        own = a.theta.reshape(len(term.effect.linear), -1)
        mean, runs = own.mean(axis=1, keepdims=True), len(stage.recorded.exposures)
        each = own if own.shape[1] == runs else np.repeat(mean, runs, axis=1)
        further = [] if stage.further is None else [mean.ravel()]
        return columns @ np.concatenate([each.ravel(), *further])
    return columns @ a.theta


def _basis(columns: Floats) -> Floats:
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0] / size[size > 0]
    if not columns.shape[1]:
        return columns
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(u[:, s > _NOTHING * s[0]])


def _free(q: Floats, columns: Floats) -> tuple[Floats, Floats]:
    """Columns outside the span of ``q``, and the share of each that is left."""
    size = np.linalg.norm(columns, axis=0)
    left = columns - q @ (q.T @ columns)
    left -= q @ (q.T @ left)
    return left, np.linalg.norm(left, axis=0) / np.maximum(size, 1e-300)


def _distance(stage: RecordedRuns, q: Floats, signal: Floats, b: Rival) -> float:
    """Norm of what model and rival leave of a signal, at the rival's best shape."""
    rest = signal - q @ (q.T @ signal)
    rest -= q @ (q.T @ rest)
    if not b.terms:
        return float(np.linalg.norm(rest))
    return min(residue for _, residue in _shapes(stage, q, rest, b))


def _residue(stage: RecordedRuns, q: Floats, rest: Floats, term: Term) -> float:
    fresh, share = _free(q, stage.columns(term))
    fresh = fresh[:, share > TOLD_APART]
    if not fresh.shape[1]:
        return float(np.linalg.norm(rest))
    unit = fresh / np.linalg.norm(fresh, axis=0)
    # One column needs no decomposition, and most rivals have one.
    inside = unit.T @ rest if unit.shape[1] == 1 else np.linalg.lstsq(unit, rest, rcond=1e-6)[0]
    return float(np.linalg.norm(rest - unit @ inside))


def _instead(stage: RecordedRuns, q: Floats, signal: Floats, b: Rival) -> tuple[Term, Floats]:
    """Shape and parameters of a rival that takes the place of a signal on the recorded runs."""
    rest = signal - q @ (q.T @ signal)
    hidden = float(np.linalg.norm(rest)) < TOLD_APART * float(np.linalg.norm(signal))
    # What hides in the model leaves nothing to fit: then the rival is one that adds as much to the readings.
    q, rest = (np.zeros((len(signal), 0)), signal) if hidden else (q, rest)
    term, _ = min(_shapes(stage, q, rest, b), key=lambda one: one[1])
    fresh, _ = _free(q, stage.columns(term))
    size = np.maximum(np.linalg.norm(fresh, axis=0), 1e-300)
    return term, np.linalg.lstsq(fresh / size, rest, rcond=1e-6)[0] / size


def _shapes(stage: RecordedRuns, q: Floats, rest: Floats, b: Rival) -> Iterator[tuple[Term, float]]:
    """The best shape of a grid and what it leaves, and a better one beside it."""
    values = [_residue(stage, q, rest, term) for term in b.terms]
    best = b.terms[int(np.argmin(values))]
    yield best, min(values)
    if not best.shape or len(b.terms) < 2:
        return
    effect, shape = best.effect, np.array(best.shape)
    # What the grid leaves out the search leaves out too: an anomaly as wide as the range is a curve of another name.
    grid = np.array([term.shape for term in b.terms])
    low, high = grid.min(axis=0), grid.max(axis=0)
    tried: list[Term] = []
    costs: list[float] = []

    def cost(scaled: Floats) -> float:
        asked = np.clip(_unscaled(effect, scaled, shape), low, high)
        term = Term(effect, tuple(float(x) for x in asked), best.per_run)
        tried.append(term)
        costs.append(_residue(stage, q, rest, term))
        stage.forget(term)
        return costs[-1]

    if len(shape) == 1:
        minimize_scalar(
            lambda x: cost(np.array([x])), bounds=_around(b, best), method="bounded", options={"maxiter": _STEPS}
        )
    else:
        simplex = 0.2 * np.vstack([np.zeros(len(shape)), np.eye(len(shape))])
        options = {"maxfev": 3 * _STEPS, "initial_simplex": simplex}
        minimize(cost, simplex[0], method="Nelder-Mead", options=options)
    yield tried[int(np.argmin(costs))], min(costs)


def _unscaled(effect: Effect, scaled: Floats, shape: Floats) -> Floats:
    """A shape from its logarithm relative to another; a shape that may be zero or negative is moved by seconds."""
    logarithmic = np.array([p.low >= 0 and x > 0 for p, x in zip(effect.shapes, shape, strict=True)])
    return np.where(logarithmic, shape * np.exp(np.clip(scaled, -3, 3)), shape + scaled)


def _around(b: Rival, best: Term) -> tuple[float, float]:
    """From the shape before the best of the grid to the one after it, scaled."""
    grid = sorted(term.shape[0] for term in b.terms)
    place, (x,) = grid.index(best.shape[0]), best.shape
    low, high = grid[max(place - 1, 0)], grid[min(place + 1, len(grid) - 1)]
    if best.effect.shapes[0].low >= 0 and x > 0 and low > 0:
        return float(np.log(low / x)), float(np.log(high / x))
    return low - x, high - x
