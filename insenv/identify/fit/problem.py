"""One target channel as a linear model of its bins.

    y - u = X theta + noise,        X = binned regressors of the terms of the model

``u`` is the reference (the table's rate along the input axis, the Earth's vertical part where it is declared). A model
is a tuple of terms; a term is an effect, at a fixed shape where it has one.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.lazy import Lazy, nothing
from insenv.core.recording import Floats
from insenv.core.series.coarse import Coarse
from insenv.data.exposure import Exposure, turns
from insenv.effects.base import OUTPUT, CurveEffect, Effect, LinearEffect, NoiseEffect, Param
from insenv.effects.noise import AngleRandomWalk, BiasInstability, Quantization, RateRandomWalk
from insenv.identify.fit.bins import Bins, Block, without
from insenv.identify.fit.noise import Grouping, Modes, Pooled, grouping, modes, transform, transform_rows

#: Noise terms of every fit, in this order.
NOISE_TERMS: tuple[NoiseEffect, ...] = (
    AngleRandomWalk(),
    BiasInstability(),
    RateRandomWalk(),
    Quantization(),
)

#: Root mean square below which a column is nothing: a bell far from every rate, whose prior would overflow.
NOTHING = 1e-100
#: Blocks whose first and last bin are left free.
MOST_FREE_ENDS = 8
_NUISANCE = -1
#: Models whose columns are remembered: a search asks for them again, and for each with hundreds of terms more.
MOST_STACKS = 8

#: Share of the largest run's power of a column, below which a run tells nothing of its parameter.
UNTOLD = 1e-4
#: A column whose part outside the span of the columns before it is a smaller share of it is not told from them.
COLLINEAR = 1e-5

#: Of a rate, what its way through differences and means leaves of it.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Term:
    """An effect in a model: at a fixed ``shape`` if it has one, with parameters for every run if ``per_run``."""

    effect: Effect
    shape: tuple[float, ...] = ()
    per_run: bool = False

    def __hash__(self) -> int:
        """By the effect's name: effects without fields, which most are, have all the same hash."""
        return hash((self.effect.id, self.shape, self.per_run))

    @property
    def size(self) -> int:
        """Number of parameters that the term spends, shapes included."""
        return len(self.effect.linear) + len(self.effect.shapes)


Model = tuple[Term, ...]


@dataclass(frozen=True, eq=False)
class Problem:
    """The bins of one target, ready to be modelled.

    Attributes
    ----------
    target, unit : str
    exposures : tuple of Exposure
        One per run.
    bins : Bins
    y : ndarray, shape (bins,)
        Measured mean minus the reference.
    outliers : tuple of int
        Fitted bins that are left free: no model has to explain them.
    most : ndarray, shape (terms,), optional
        Largest power of each of `NOISE_TERMS`; None: the noise is fitted freely.
    commanded : bool
        Whether the reference is what a table was told, in all runs: without noise of its own.
    coarse : Coarse, optional
        What rounding of the readings leaves in their means beside a table that turns; None where noise blurs it.
    encoder : float
        Step to which the table's angle is read, times the share of its rate that the target sees [rad]; 0 where the
        reference is no angle that was read.
    counter : float
        Angle of one count of the target, where it reads increments [rad]; 0 where they are not counted.
    steps : callable
        Errors of the bins that these steps would make if the encoder began elsewhere, shape (draws, bins); None where
        nothing is known of them.
    """

    target: str
    unit: str
    exposures: tuple[Exposure, ...]
    bins: Bins
    y: Floats
    outliers: tuple[int, ...] = ()
    most: Floats | None = None
    commanded: bool = False
    coarse: Coarse | None = None
    encoder: float = 0.0
    counter: float = 0.0
    steps: Callable[[], Floats | None] = field(default=nothing, repr=False, compare=False)
    cache: dict[Hashable, Any] = field(default_factory=dict, repr=False)

    def remember(self, key: Hashable, make: Any) -> Any:
        """``make()``, computed once."""
        if key not in self.cache:
            self.cache[key] = make()
        return self.cache[key]

    def remember_last(self, key: Hashable, of: object, make: Callable[[], Any]) -> Any:
        """``make()`` of the very object ``of``, kept until it is asked for of another one."""
        last = self.cache.get(key)
        if last is None or last[0] is not of:
            last = self.cache[key] = of, make()
        return last[1]

    def forget(self, term: Term) -> None:
        """Drop the columns of a term that will not be asked for again."""
        self.cache.pop(("columns", term), None)
        self.cache.pop(("transformed", term), None)

    def all_fitted(self) -> Problem:
        """The problem with its held-out blocks fitted as well."""
        return self.used_as(tuple(replace(block, fitted=True) for block in self.bins.blocks))

    def used_as(self, blocks: tuple[Block, ...]) -> Problem:
        """The same bins in other blocks; columns that are the same then are kept: what is per run goes by the fit."""
        kept = {key: found for key, found in self._remembered("columns").items() if not key[1].per_run}
        return replace(self, bins=replace(self.bins, blocks=blocks), cache=kept)

    def without_bins(self, gone: NDArray[np.bool_]) -> Problem:
        """The problem without some of its bins, shape (bins,); where they were, a block ends."""
        place = np.cumsum(~gone) - 1
        outliers = tuple(int(place[i]) for i in self.outliers if not gone[i])
        steps = Lazy(partial(_errors_left, self.steps, ~gone)) if self.encoder else self.steps
        bins = without(self.bins, gone)
        return replace(self, bins=bins, y=self.y[~gone], outliers=outliers, steps=steps, cache={})

    def rows_in(self, some: NDArray[np.bool_]) -> dict[int, NDArray[np.int64]]:
        """Rows of each run in some bins, shape (bins,)."""
        rows = {}
        for run in np.unique(self.bins.run[some]).tolist():
            kept = self.bins.kept[run][some[self.bins.run == run]]
            cell = self.exposures[run].cell_of_row
            rows[run] = np.flatnonzero((cell >= 0) & np.isin(cell // self.bins.weights[run].shape[1], kept))
        return rows

    def measured_as(self, y: Floats) -> Problem:
        """The problem with other measured means; what no reading is in is kept."""
        return replace(self, y=y, cache=self._remembered("columns", "transformed"))

    def _remembered(self, *kinds: str) -> dict[Any, Any]:
        """What is remembered of terms, of some kinds."""
        return {key: found for key, found in self.cache.items() if isinstance(key, tuple) and key[0] in kinds}

    @property
    def turns(self) -> bool:
        """Whether the rate that the instrument was exposed to changes, in some run or between runs."""
        return turns(self.exposures)

    @property
    def in_points(self) -> bool:
        """Whether each mean is of one rate, angle or temperature, and nothing is known of the way to the next."""
        return any(e.motion.points for e in self.exposures)

    @property
    def through_gravity(self) -> bool:
        """Whether it is an accelerometer that gravity turns through: its input is a specific force."""
        return any(e.motion.across is not None for e in self.exposures)

    def heat(self) -> Floats | None:
        """Mean temperature of each bin [K], shape (bins,); None where that of a run was not recorded."""
        read = tuple(t for e in self.exposures if (t := e.motion.temperature) is not None)
        return self.bins.mean(read) if len(read) == len(self.exposures) else None

    @property
    def smoothed(self) -> bool:
        """Whether the rate in the regressors is the motion behind the noise of a measured reference, and no reading."""
        return any(np.ptp(e.u - e.motion.rate) > ROUNDING * np.ptp(e.u) for e in self.exposures)

    @property
    def gain(self) -> float:
        """What the instrument makes of its input, of which the scale factor is a small error."""
        return self.exposures[0].motion.gain

    @property
    def fitted(self) -> tuple[Block, ...]:
        """Blocks that may be fitted."""
        return tuple(b for b in self.bins.blocks if b.fitted)

    @property
    def held_out(self) -> tuple[Block, ...]:
        """Blocks that no fit may see."""
        return tuple(b for b in self.bins.blocks if not b.fitted)

    def modes(self) -> Modes:
        """Noise shapes over the modes of the fitted blocks."""
        return self.remember("modes", lambda: modes(self.fitted, NOISE_TERMS, self.bins.width))

    def held_out_modes(self) -> Modes:
        """The same over the modes of the held-out blocks."""
        return self.remember("held-out modes", lambda: modes(self.held_out, NOISE_TERMS, self.bins.width))

    def step_errors(self) -> Floats | None:
        """What the steps of the table's angle make of the bins, their zero elsewhere each time, (draws, bins)."""
        errors: Floats | None = self.steps()
        return None if errors is None or errors.shape[1] != self.bins.n else errors

    def grouping(self) -> Grouping:
        """Pooling of the modes of the fitted blocks."""
        return self.remember("grouping", lambda: grouping(self.modes()))

    def data(self) -> Floats:
        """Transformed data of the fitted blocks, shape (modes,)."""
        return self.remember("data", lambda: transform(self.fitted, self.y))

    def columns(self, term: Term) -> Floats:
        """Binned regressors of a term over all bins, shape (bins, k), k times the runs if per run."""
        return self.remember(("columns", term), lambda: self._columns(term))

    def transformed(self, term: Term) -> Floats:
        """Transformed regressors of the fitted blocks, shape (modes, k)."""
        return self.remember(("transformed", term), lambda: transform(self.fitted, self.columns(term)))

    def transformed_together(self, terms: Sequence[Term]) -> list[Floats]:
        """The same of several terms, those that are not remembered in one piece: calls of short transforms add up."""
        fresh = [term for term in terms if ("transformed", term) not in self.cache]
        if len(fresh) > 1:
            columns = [self.columns(term) for term in fresh]
            ends = np.cumsum([c.shape[1] for c in columns])
            changed = transform_rows(self.fitted, np.concatenate([c.T for c in columns]))
            for term, end, own in zip(fresh, ends, columns, strict=True):
                part = np.ascontiguousarray(changed[end - own.shape[1] : end].T)
                self.cache[("transformed", term)] = part
        return [self.transformed(term) for term in terms]

    def _columns(self, term: Term) -> Floats:
        binned = self.bins.mean(tuple(regressors(term.effect, e, term.shape) for e in self.exposures))
        if not term.per_run:
            return binned
        of_run = (self.bins.run[:, None] == np.arange(len(self.exposures))).astype(float)
        if term.effect.of_run:
            of_run = self._shared(of_run, binned)
        return (binned[:, :, None] * of_run[:, None, :]).reshape(len(binned), -1)

    def _shared(self, of_run: Floats, binned: Floats) -> Floats:
        """Shares of each run's parameters in each bin; where the fitted ones tell nothing, the mean of the others'.

        A table that stood still in them would else have no skew where it moves later, in data that are held out.
        """
        fitted = np.zeros(self.bins.n, bool)
        for block in self.fitted:
            fitted[block.start : block.stop] = True
        power = of_run[fitted].T @ np.sum(binned[fitted] ** 2, axis=1)
        tells = power > UNTOLD * power.max(initial=0.0)
        if tells.all() or not tells.any():
            return of_run
        return np.where((of_run @ tells > 0)[:, None], of_run, tells / tells.sum())

    def names(self, term: Term) -> list[tuple[str, str, float]]:
        """Name, unit and prior standard deviation of each column of a term."""
        rows = [(p.name, p.unit_on(self.unit), p.sd * self._prior_scale(p)) for p in term.effect.linear]
        if not term.per_run or len(self.exposures) == 1:
            return rows
        return [(f"{name}[{run + 1}]", unit, sd) for name, unit, sd in rows for run in range(len(self.exposures))]

    def priors(self, term: Term) -> list[float]:
        """Prior standard deviation of each column of a term in a fit: so wide that it pulls no credible value."""
        wide = [max(p.sd * self._prior_scale(p), self.limits(p)[1]) for p in term.effect.linear]
        return [sd for sd in wide for _ in range(len(self.exposures) if term.per_run else 1)]

    def limits(self, param: Param) -> tuple[float, float]:
        """Least and largest credible value of a linear parameter on this target."""
        scale = self._prior_scale(param)
        if param.per_rate:
            scale = max(float(np.abs(e.u).max()) for e in self.exposures)
        if param.per_run:
            scale /= max(float(np.ptp(e.motion.t)) for e in self.exposures)
        bound = max(param.bound * scale, param.rows * max(e.motion.dt for e in self.exposures))
        return max(param.low * scale, -bound), bound

    def _prior_scale(self, param: Param) -> float:
        """An accelerometer's output holds gravity: its priors in the output's unit are that much wider."""
        return 100.0 if self.unit == "m/s^2" and OUTPUT in param.unit else 1.0


def _errors_left(steps: Callable[[], Floats | None], left: NDArray[np.bool_]) -> Floats | None:
    errors = steps()
    return None if errors is None or errors.shape[1] != len(left) else errors[:, left]


def regressors(effect: Effect, exposure: Exposure, shape: tuple[float, ...]) -> Floats:
    """Regressors of an effect on the cells of one run, shape (cells, k)."""
    if isinstance(effect, LinearEffect):
        return effect.basis(exposure.u, exposure.motion)
    assert isinstance(effect, CurveEffect)
    return effect.profile(exposure.u, exposure.motion, np.array(shape))


@dataclass(frozen=True)
class Design:
    """Columns of a model that can be told from each other.

    Attributes
    ----------
    matrix : ndarray, shape (bins, p)
        Columns over all bins, each divided by its ``scale``.
    transformed : ndarray, shape (modes, p)
        The same in the modes of the fitted blocks.
    scale : ndarray, shape (p,)
    prior : ndarray, shape (p,)
        Prior precision of the scaled coefficients.
    labels : tuple of (term's key, parameter, unit)
    term : ndarray of int, shape (p,)
        Index of the term in the model; -1 for free bins.
    dropped : tuple of (term's key, parameter)
        Columns that are a combination of the ones before, or zero.
    """

    matrix: Floats
    transformed: Floats
    scale: Floats
    prior: Floats
    labels: tuple[tuple[str, str, str], ...]
    term: NDArray[np.int64]
    dropped: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class _Rows:
    """Columns as rows: one more moves the others in one piece.

    ``fresh`` is the weighted part outside the span of those before, of unit length; ``bins`` and ``modes`` are divided
    by the column's scale; ``ordered`` are the modes in the order in which they are pooled, of the data too.
    """

    fresh: Floats
    bins: Floats
    modes: Floats
    ordered: Floats


@dataclass(frozen=True, eq=False)
class _Stack:
    """Columns of a model that add something new each, and the names of those that do not.

    ``new`` are all columns, or those of the last term and ``before`` the others: most models are asked for their
    cross-products alone, ``pooled``. Of each column ``kept`` has the scale, the standard deviation of its prior, its
    label and the index of its term.
    """

    before: _Rows | None
    new: _Rows
    pooled: Pooled
    kept: tuple[tuple[float, float, tuple[str, str, str], int], ...]
    dropped: tuple[tuple[str, str], ...]


def _stack(problem: Problem, model: Model) -> _Stack:
    """The columns of a model, those of all but its last term as they are remembered of the models before it."""
    if not model:
        return _nothing(problem)
    before, term, groups = _whole(problem, model[:-1]), model[-1], problem.grouping()
    columns, changed, weight = problem.columns(term), problem.transformed(term), _weight(problem)
    kept, dropped = list(before.kept), list(before.dropped)
    span, own = before.new.fresh, []
    for j, ((name, unit, _), sd) in enumerate(zip(problem.names(term), problem.priors(term), strict=True)):
        scale = float(np.sqrt(np.mean(changed[:, j] ** 2)))
        outside = _outside(span, changed[:, j] * weight)
        if scale < NOTHING or outside is None:
            dropped.append((term.effect.key, name))
            continue
        if j + 1 < columns.shape[1]:
            span = np.vstack([span, outside])
        own.append((j, scale, outside))
        kept.append((scale, sd, (term.effect.key, name, unit), len(model) - 1))
    if not own:
        return replace(before, dropped=tuple(dropped))
    modes_of = np.array([changed[:, j] / scale for j, scale, _ in own])
    bins = np.array([columns[:, j] / scale for j, scale, _ in own])
    new = _Rows(np.array([row for *_, row in own]), bins, modes_of, modes_of[:, groups.order])
    cross = groups.pooled(new.ordered, before.new.ordered, before.pooled)
    return _Stack(before.new, new, cross, tuple(kept), tuple(dropped))


def _nothing(problem: Problem) -> _Stack:
    """Of a model without terms: the free bins."""
    free, changed = (np.ascontiguousarray(c.T) for c in problem.remember("free", lambda: _free_bins(problem)))
    groups = problem.grouping()
    ordered = np.vstack([problem.data(), changed])[:, groups.order]
    fresh = np.linalg.qr((changed * _weight(problem)).T)[0].T
    kept = ((1.0, np.inf, ("free bin", "mean", problem.unit), _NUISANCE),) * len(free)
    return _Stack(None, _Rows(fresh, free, changed, ordered), groups.pooled(ordered), kept, ())


def _remembered(problem: Problem, model: Model) -> _Stack:
    """The stack of a model, to which several terms may be added in turn; of the last `MOST_STACKS` models."""
    stacks: dict[Model, _Stack] = problem.remember("stacks", dict)
    found = stacks.pop(model, None) or _stack(problem, model)
    stacks[model] = found  # the last one used stands last
    while len(stacks) > MOST_STACKS:
        del stacks[next(iter(stacks))]
    return found


def _whole(problem: Problem, model: Model) -> _Stack:
    """The same with all columns put together, and remembered so."""
    found = _remembered(problem, model)
    if found.before is None:
        return found
    pairs = ((getattr(found.before, f.name), getattr(found.new, f.name)) for f in fields(_Rows))
    whole = replace(found, before=None, new=_Rows(*map(np.concatenate, pairs)))
    problem.cache["stacks"][model] = whole
    return whole


def _weight(problem: Problem) -> Floats:
    """Of each mode where it is judged what a column adds: less where white noise and a walk are larger."""
    modes, width = problem.modes(), problem.bins.width
    weight: Floats = problem.remember("weight", lambda: 1 / np.sqrt(modes.shapes[:, 0] + modes.shapes[:, 2] * width**2))
    return weight


def design(problem: Problem, model: Model) -> Design:
    """Stack the columns of a model; leave out those that add nothing new on the fitted bins."""
    stack = _whole(problem, model)
    if not stack.kept:
        return _empty_design(problem, stack.dropped)
    scales, prior = _scales(stack)
    _, _, labels, term_index = zip(*stack.kept, strict=True)
    return Design(
        stack.new.bins.T, stack.new.modes.T, scales, prior, tuple(labels), np.array(term_index), stack.dropped
    )


def pooled(problem: Problem, model: Model) -> tuple[Pooled, Floats]:
    """Cross-products, in groups of modes, of the data and of the columns of a model's design; their prior precision."""
    stack = _remembered(problem, model)
    return stack.pooled, _scales(stack)[1]


def _scales(stack: _Stack) -> tuple[Floats, Floats]:
    """Scale and prior precision of each column, shapes (p,)."""
    scales, sd = np.array([one[0] for one in stack.kept]), np.array([one[1] for one in stack.kept])
    return scales, (1 / (sd * scales)) ** 2


def free_bins(problem: Problem) -> list[int]:
    """Bins that no model has to explain: outliers, and the ends of the longest fitted blocks."""
    longest = sorted(problem.fitted, key=lambda b: -b.n)[:MOST_FREE_ENDS]
    ends = {edge for b in longest if b.n >= 8 for edge in (b.start, b.stop - 1)}
    return sorted(ends | set(problem.outliers))


def _free_bins(problem: Problem) -> tuple[Floats, Floats]:
    """Columns that free the first and the last bin of the longest fitted blocks, and outliers.

    An error of angle enters the means on both sides of an edge with opposite signs, but only one of them at the ends of
    a block. Modes are independent once those two means are free; otherwise quantisation there looks like a warm-up.
    """
    bins = free_bins(problem)
    columns = np.zeros((problem.bins.n, len(bins)))
    columns[bins, np.arange(len(bins))] = 1.0
    changed = transform(problem.fitted, columns)
    size = np.sqrt(np.mean(changed**2, axis=0)) if bins else np.ones(0)
    return columns / size, changed / size


def _outside(q: Floats, column: Floats) -> Floats | None:
    """The unit vector of the part of ``column`` outside the span of the rows ``q``; None where it is negligible."""
    norm = np.linalg.norm(column)
    if norm == 0 or not np.isfinite(norm):
        return None
    rest = column / norm
    for _ in range(2):  # twice is enough (Kahan, Parlett)
        rest = rest - (q @ rest) @ q
    left = np.linalg.norm(rest)
    return None if left < COLLINEAR else rest / left


def _empty_design(problem: Problem, dropped: tuple[tuple[str, str], ...]) -> Design:
    none = np.zeros(0)
    shape = (len(problem.data()), 0)
    return Design(
        np.zeros((problem.bins.n, 0)), np.zeros(shape), none, none, (), np.zeros(0, np.int64), dropped
    )  # fmt: skip
