"""Exact aggregation: cells into bins, bins into blocks.

A bin is a weighted mean over its cells; the regressors are averaged with the same weights as the data, so a linear
model of the samples is the same linear model of the bins, without approximation:

    mean_w(y) = mean_w(basis) @ theta + mean_w(noise)

The weights are the time that the rows of each cell cover, times a Hann window where lines above the bin rate must be
rejected (a plain mean lets a line of frequency f through with 1 / (pi f T), a Hann window with about 1 / (f T)^3).

A block is a stretch of consecutive bins of one run with one use (fitted or held out): one DCT each. A run that a bad
link has cut into many pieces is not cut into as many blocks: short gaps are bridged.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.data.exposure import Exposure

#: A bin with a smaller share of its rows present is left out.
FULL = 0.5
#: Gaps of a run up to which each parts two blocks; of more, those that lose so few bins, or no more than a piece has.
MOST_PIECES, SHORT_GAP = 20, 4


@dataclass(frozen=True)
class Block:
    """Consecutive bins ``[start, stop)`` of the concatenated bins: one run, one use.

    ``span`` is the number of bins from the first to the last bin of the run that the block belongs to.
    """

    run: int
    fitted: bool
    start: int
    stop: int
    span: int

    @property
    def n(self) -> int:
        """Number of bins."""
        return self.stop - self.start


@dataclass(frozen=True)
class Bins:
    """How the cells of every run are gathered into bins.

    Attributes
    ----------
    width : float
        Length of a bin [s].
    weights : tuple of ndarray, shape (bins of the run, cells per bin)
        Normalised weights of the kept bins.
    kept : tuple of ndarray of int
        Index of the kept bins in each run.
    blocks : tuple of Block
        Over the kept bins of all runs, concatenated; fitted and held-out ones in order of time.
    """

    width: float
    weights: tuple[Floats, ...]
    kept: tuple[NDArray[np.int64], ...]
    blocks: tuple[Block, ...]

    @property
    def n(self) -> int:
        """Number of kept bins of all runs."""
        return sum(len(kept) for kept in self.kept)

    @property
    def run(self) -> NDArray[np.int64]:
        """Run of each kept bin, counted from 0, shape (n,)."""
        return np.repeat(np.arange(len(self.kept)), [len(kept) for kept in self.kept])

    @property
    def time(self) -> Floats:
        """Middle of each kept bin from the start of its run [s], shape (n,)."""
        return np.concatenate([(kept + 0.5) * self.width for kept in self.kept])

    def places(self, block: Block) -> NDArray[np.int64]:
        """Places of a block's bins on the grid of all bins of its run, counted from the first one, shape (n,)."""
        own = np.concatenate(self.kept)[block.start : block.stop]
        return np.asarray(own - own[0])

    @property
    def held_out(self) -> NDArray[np.bool_]:
        """Bins that no fit may see, shape (n,)."""
        mask = np.zeros(self.n, bool)
        for block in self.blocks:
            mask[block.start : block.stop] = not block.fitted
        return mask

    def fitted_cells(self, run: int) -> NDArray[np.int64]:
        """Cells of a run that fitted bins are made of, in order, those that hold no row too, shape (cells,)."""
        per_bin = self.weights[run].shape[1]
        own = self.kept[run][~self.held_out[self.run == run]]
        return np.asarray((own[:, None] * per_bin + np.arange(per_bin)).ravel())

    def mean(self, values: tuple[Floats, ...]) -> Floats:
        """Weighted means over the kept bins of cell values, one array (cells, ...) per run; shape (n, ...)."""
        means = [self._mean_of_run(i, v) for i, v in enumerate(values)]
        return means[0] if len(means) == 1 else np.concatenate(means)

    def change(self, values: Floats) -> Floats:
        """Change of values of the bins from one to the next, within each block, shape (n,); 0 in one of a bin."""
        change = np.zeros(len(values))
        for block in self.blocks:
            if block.n > 1:
                change[block.start : block.stop] = np.gradient(values[block.start : block.stop])
        return change

    def _mean_of_run(self, run: int, values: Floats) -> Floats:
        weights, kept = self.weights[run], self.kept[run]
        per_bin = weights.shape[1]
        # Without gaps, as most runs are, a slice of them, which costs nothing.
        follow = len(kept) > 0 and int(kept[-1]) - int(kept[0]) + 1 == len(kept)
        chosen = slice(int(kept[0]), int(kept[-1]) + 1) if follow else kept
        if per_bin == 1:
            return np.array(values[chosen])
        if values.ndim == 2 and values.shape[1] == 1:  # an axis of one costs the sums over cells their speed
            return self._mean_of_run(run, values[:, 0])[:, None]
        whole = len(values) // per_bin
        gathered = values[: whole * per_bin].reshape(whole, per_bin, *values.shape[1:])
        if len(kept) < whole:
            gathered = gathered[chosen]
        return np.einsum("bc,bc...->b...", weights, gathered)


def gather(
    exposures: tuple[Exposure, ...],
    fit: tuple[NDArray[np.bool_], ...],
    held_out: tuple[NDArray[np.bool_], ...],
    cells_per_bin: int,
    rows_per_cell: int,
    reject_lines: bool = False,
) -> Bins:
    """Bins of one target over all runs.

    Parameters
    ----------
    exposures : tuple of Exposure
        One per run.
    fit, held_out : tuple of ndarray of bool, shape (rows,)
        Use of each row of each run. A bin that mixes uses is left out.
    cells_per_bin, rows_per_cell : int
    reject_lines : bool
        Whether the weights carry a Hann window.
    """
    window = _window(cells_per_bin, reject_lines)
    weights, kept, blocks, offset = [], [], [], 0
    for run, exposure in enumerate(exposures):
        share, use = _bin_use(exposure, fit[run], held_out[run], cells_per_bin, rows_per_cell)
        index = np.flatnonzero(use != _UNUSED)
        w = share[index] * window
        weights.append(w / w.sum(axis=1, keepdims=True))
        kept.append(index)
        blocks += _blocks(run, index, use[index], offset)
        offset += len(index)
    width = exposures[0].motion.dt * cells_per_bin
    return Bins(width, tuple(weights), tuple(kept), tuple(blocks))


def whole(bins: Bins, reject_lines: bool = False) -> Bins:
    """Bins of which each counts all its cells, those too without a row; as `gather` made them."""
    window = _window(bins.weights[0].shape[1], reject_lines)
    return replace(bins, weights=tuple(np.broadcast_to(window / window.sum(), w.shape) for w in bins.weights))


def without(bins: Bins, gone: NDArray[np.bool_]) -> Bins:
    """The bins without some of them; ``gone`` has shape (n,). Where they were, a block ends."""
    held, run = bins.held_out, bins.run
    weights, kept, blocks, offset = [], [], [], 0
    for one, index in enumerate(bins.kept):
        stay = ~gone[run == one]
        use = np.where(held[run == one], _HELD_OUT, _FITTED)[stay]
        weights.append(bins.weights[one][stay])
        kept.append(index[stay])
        blocks += _blocks(one, kept[-1], use, offset)
        offset += len(kept[-1])
    return Bins(bins.width, tuple(weights), tuple(kept), tuple(blocks))


def of_one_use(bins: Bins) -> Bins:
    """The same bins, all of them fitted."""
    blocks: list[Block] = []
    for run, index in enumerate(bins.kept):
        blocks += _blocks(run, index, np.full(len(index), _FITTED), sum(map(len, bins.kept[:run])))
    return replace(bins, blocks=tuple(blocks))


def at_places(series: Floats, place: NDArray[np.int64]) -> Floats:
    """Values at their places on an even grid, along the first axis; their mean where bins are lost."""
    if int(place[-1]) + 1 == len(series):
        return series
    laid = np.repeat(series.mean(axis=0, keepdims=True), int(place[-1]) + 1, axis=0)
    laid[place] = series
    return laid


def merged(bins: Bins, least: float = 1.0) -> tuple[Bins, NDArray[np.int64]]:
    """The bins two by two, and which two each is made of, shape (n, 2); neighbours of one run and one use.

    Of a run in many pieces a bin whose neighbour is lost stands for both, where it has the share ``least`` of their
    cells. It is then both of its two.
    """
    held, weights, kept, blocks, pairs = bins.held_out, [], [], [], []
    offset = first = 0
    for run, index in enumerate(bins.kept):
        own = held[first : first + len(index)]
        one, other = _pairs(index, own)
        w = bins.weights[run]
        absent = one == other
        before = absent & (index[one] % 2 == 1)
        halves = np.where(before[:, None], 0.0, w[one]), np.where((absent & ~before)[:, None], 0.0, w[other])
        both = np.concatenate(halves, axis=1)
        stay = ~absent | (np.count_nonzero(both, axis=1) >= least * both.shape[1])
        one, other, both = one[stay], other[stay], both[stay]
        weights.append(both / both.sum(axis=1, keepdims=True))
        kept.append(index[one] // 2)
        blocks += _blocks(run, kept[-1], np.where(own[one], _HELD_OUT, _FITTED), offset)
        pairs.append(first + np.column_stack([one, other]))
        offset, first = offset + len(one), first + len(index)
    return Bins(2 * bins.width, tuple(weights), tuple(kept), tuple(blocks)), np.concatenate(pairs)


def _pairs(index: NDArray[np.int64], held_out: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Neighbours of one use; of a run in many pieces also each bin, twice, of which the neighbour is lost."""
    left = np.flatnonzero((index[:-1] % 2 == 0) & (np.diff(index) == 1) & (held_out[:-1] == held_out[1:]))
    if np.count_nonzero(np.diff(index) > 1) <= MOST_PIECES:
        return left, left + 1
    alone = np.flatnonzero(~np.isin(index ^ 1, index))
    alone = alone[(alone < len(index) - 1) | (index[alone] % 2 == 1)]  # behind the last bin the run may have ended
    order = np.argsort(np.concatenate([left, alone]), kind="stable")
    return np.concatenate([left, alone])[order], np.concatenate([left + 1, alone])[order]


_UNUSED, _FITTED, _HELD_OUT = 0, 1, 2


def _window(n: int, reject_lines: bool) -> Floats:
    return np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2 if reject_lines else np.ones(n)


def _bin_use(
    exposure: Exposure,
    fit: NDArray[np.bool_],
    held_out: NDArray[np.bool_],
    cells_per_bin: int,
    rows_per_cell: int,
) -> tuple[Floats, NDArray[np.int64]]:
    """Share of rows in each cell of each bin, shape (bins, cells per bin), and the use of each bin, shape (bins,)."""
    n_cells = len(exposure.count)
    bins = n_cells // cells_per_bin
    cut = bins * cells_per_bin
    inside = exposure.cell_of_row >= 0
    cell = exposure.cell_of_row[inside]

    def rows(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
        counted = np.bincount(cell[mask[inside]], minlength=n_cells)[:cut]
        return counted.reshape(bins, cells_per_bin).sum(axis=1)

    total = exposure.count[:cut].reshape(bins, cells_per_bin)
    present = total.sum(axis=1)
    fitted, held = rows(fit), rows(held_out)
    use = np.where(fitted == present, _FITTED, np.where(held == present, _HELD_OUT, _UNUSED))
    use[present < FULL * cells_per_bin * rows_per_cell] = _UNUSED
    covered = total if exposure.covered is None else exposure.covered[:cut].reshape(bins, cells_per_bin)
    return covered / rows_per_cell, use


def _breaks(lost: NDArray[np.int64], changed: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Where blocks end: at a change of use and at a gap, of many gaps at those that are long beside the pieces.

    White noise does not feel a gap. Noise that wanders goes a little further in it than in one bin, which is nothing
    beside what hundreds of short transforms, each with a level of its own, would lose.
    """
    gaps = np.flatnonzero((lost > 0) | changed)
    if np.sum(lost > 0) <= MOST_PIECES:
        return gaps
    pieces = np.diff(np.concatenate([[-1], gaps, [len(lost)]]))
    bridged = max(SHORT_GAP, float(np.median(pieces)))
    return np.flatnonzero((lost > bridged) | changed)


def _blocks(run: int, index: NDArray[np.int64], use: NDArray[np.int64], offset: int) -> list[Block]:
    """Consecutive bins of one use; of a run in many pieces, bins with short gaps between them."""
    if not len(index):
        return []
    breaks = _breaks(np.diff(index) - 1, np.diff(use) != 0) + 1
    edges = [0, *breaks.tolist(), len(index)]
    span = int(index[-1] - index[0]) + 1
    return [
        Block(run, bool(use[a] == _FITTED), offset + a, offset + b, span)
        for a, b in zip(edges[:-1], edges[1:], strict=True)
    ]
