"""Exact aggregation: a linear model of the samples is the same linear model of the bins."""

import numpy as np
import pytest
from effect_cases import on, typical
from motions import rich_motion
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.data.exposure import Exposure
from insenv.effects.base import LinearEffect
from insenv.effects.catalogue import CATALOGUE
from insenv.identify.fit.bins import FULL, MOST_PIECES, SHORT_GAP, Bins, gather, merged, without

LINEAR = [effect.key for effect in CATALOGUE if isinstance(effect, LinearEffect)]
N = 600
PER_BIN = 12


def exposure(count: NDArray[np.int64] | None = None, rows_per_cell: int = 1) -> Exposure:
    """Cells with the given number of rows in each."""
    motion = rich_motion(N)
    count = np.full(N, rows_per_cell) if count is None else count
    rows = np.repeat(np.arange(N), count)
    return Exposure(np.zeros(N), count, rows, motion, motion.rate)


def uneven() -> NDArray[np.int64]:
    """Up to 4 rows in a cell; a few cells empty."""
    return np.random.default_rng(2).integers(0, 5, N)


def bins_of(e: Exposure, fit: NDArray[np.bool_], held: NDArray[np.bool_], rows: int = 1, hann: bool = False) -> Bins:
    return gather((e,), (fit,), (held,), PER_BIN, rows, hann)


def halves(rows: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    fit = np.arange(rows) < rows // 2
    return fit, ~fit


@pytest.mark.parametrize("hann", [False, True], ids=["mean", "hann"])
@pytest.mark.parametrize("key", LINEAR)
def test_binned_regressors_times_parameters_are_the_binned_effect(key: str, hann: bool) -> None:
    """To 1e-12 of the largest value, with cells unevenly filled."""
    e = exposure(uneven(), 4)
    bins = bins_of(e, *halves(len(e.cell_of_row)), rows=4, hann=hann)
    effect = on(e.motion, key)
    assert isinstance(effect, LinearEffect)
    theta = typical(effect, e.motion) * np.linspace(1, -0.7, len(effect.linear))
    values = effect.apply(e.u, e.motion, theta)[0]
    expected = bins.mean((values,))
    assert np.abs(expected).max() > 0
    assert_allclose(
        bins.mean((effect.basis(e.u, e.motion),)) @ theta, expected, rtol=0, atol=1e-12 * np.abs(values).max()
    )


def test_a_bin_is_the_mean_of_its_rows() -> None:
    """Two ways: cells weighted by their rows, and the rows themselves."""
    e = exposure(uneven(), 4)
    rows = np.random.default_rng(3).standard_normal(len(e.cell_of_row))
    cells = np.bincount(e.cell_of_row, rows, N) / np.maximum(e.count, 1)
    bins = bins_of(e, *halves(len(rows)), rows=4)
    bin_of_row = e.cell_of_row // PER_BIN
    expected = [rows[bin_of_row == b].mean() for b in bins.kept[0]]
    assert_allclose(bins.mean((cells,)), expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("border", [300, 301, 311, 313])
def test_no_bin_mixes_fitted_and_held_out_rows(border: int) -> None:
    e = exposure()
    fit = np.arange(N) < border
    bins = bins_of(e, fit, ~fit)
    for block in bins.blocks:
        first, last = bins.kept[0][block.start] * PER_BIN, (bins.kept[0][block.stop - 1] + 1) * PER_BIN
        assert fit[first:last].all() if block.fitted else not fit[first:last].any()
    mixed = border % PER_BIN != 0
    assert bins.n == N // PER_BIN - mixed
    assert [b.fitted for b in bins.blocks] == [True, False]
    assert bins.held_out.tolist() == [kept * PER_BIN >= border for kept in bins.kept[0]]


def test_a_change_of_held_out_samples_changes_no_fitted_bin() -> None:
    e = exposure()
    fit = np.arange(N) < 317
    bins = bins_of(e, fit, ~fit)
    values = np.random.default_rng(4).standard_normal(N)
    before, after = bins.mean((values,)), bins.mean((values + 1e3 * ~fit,))
    assert np.array_equal(before[~bins.held_out], after[~bins.held_out])
    assert np.all(after[bins.held_out] > 900)


def test_rows_of_neither_use_are_in_no_bin() -> None:
    e = exposure()
    fit, held = np.arange(N) < 240, np.arange(N) >= 360
    bins = bins_of(e, fit, held)
    assert bins.n == 40
    assert [(b.fitted, b.start, b.stop) for b in bins.blocks] == [(True, 0, 20), (False, 20, 40)]


def test_blocks_are_consecutive_bins_of_one_run_and_one_use() -> None:
    count = np.ones(N, np.int64)
    count[120:150] = 0  # bins 10 and 11 are empty, half of bin 12 is
    first, second = exposure(count), exposure()
    uses = [np.arange(len(e.cell_of_row)) % 300 < 150 for e in (first, second)]
    bins = gather((first, second), tuple(uses), tuple(~u for u in uses), PER_BIN, 1)
    covered = np.zeros(bins.n, int)
    for block in bins.blocks:
        covered[block.start : block.stop] += 1
        local = np.arange(block.start, block.stop) - (len(bins.kept[0]) if block.run else 0)
        kept = bins.kept[block.run]
        assert np.all(np.diff(kept[local]) == 1)
        assert np.all(bins.run[block.start : block.stop] == block.run)
        assert np.all(bins.held_out[block.start : block.stop] != block.fitted)
        assert block.span == kept[-1] - kept[0] + 1 >= block.n
    assert np.all(covered == 1)
    assert 10 not in bins.kept[0] and 11 not in bins.kept[0]
    ends = {(b.run, bins.time[b.stop - 1]) for b in bins.blocks}
    assert (0, pytest.approx(9.5 * bins.width)) in [(r, t) for r, t in ends]


@pytest.mark.parametrize(("present", "kept"), [(FULL, True), (FULL - 1 / PER_BIN, False)])
def test_a_bin_needs_half_of_its_rows(present: float, kept: bool) -> None:
    count = np.ones(N, np.int64)
    count[24 : 36 - round(present * PER_BIN)] = 0
    e = exposure(count)
    bins = bins_of(e, *halves(len(e.cell_of_row)))
    assert (2 in bins.kept[0]) == kept


def test_a_window_rejects_lines_above_the_bin_rate() -> None:
    """At x cycles per bin a mean lets sin(pi x) / (pi x) through, a Hann window that over 1 - x^2."""
    per_bin, cycles = 200, np.array([3.4, 8.5, 20.3])
    t = (np.arange(N * 10) + 0.5) / per_bin
    motion = rich_motion(len(t), 0.01)
    e = Exposure(np.zeros(len(t)), np.ones(len(t), np.int64), np.arange(len(t)), motion, motion.rate)
    for x in cycles:
        wave = np.column_stack([np.cos(2 * np.pi * x * t), np.sin(2 * np.pi * x * t)])
        passed = {}
        for hann in (False, True):
            bins = gather((e,), (t < t[-1] / 2,), (t >= t[-1] / 2,), per_bin, 1, hann)
            passed[hann] = np.linalg.norm(bins.mean((wave,)), axis=1)
        plain = abs(np.sinc(x))
        # Means of samples, not of a continuous wave: (pi x / 200)^2 / 6 more, below 2 %.
        assert_allclose(passed[False], plain, rtol=0.02)
        assert_allclose(passed[True], plain / (x**2 - 1), rtol=0.05)


def test_weights_sum_to_one_and_keep_a_constant() -> None:
    e = exposure(uneven(), 4)
    for hann in (False, True):
        bins = bins_of(e, *halves(len(e.cell_of_row)), rows=4, hann=hann)
        assert_allclose(bins.weights[0].sum(axis=1), 1.0, rtol=0, atol=1e-14)
        values: Floats = np.where(e.count > 0, 7.0, 0.0)
        assert_allclose(bins.mean((values,)), 7.0, rtol=1e-14)


def two_runs(per_bin: int = PER_BIN) -> Bins:
    """Two runs of cells with one row each, the end of each held out."""
    one = exposure()
    fit = np.arange(N) < 400 // (2 * PER_BIN) * 2 * PER_BIN
    return gather((one, one), (fit, fit), (~fit, ~fit), per_bin, 1)


def covered(bins: Bins) -> None:
    """Blocks follow each other without a hole, each in one run, up to the last bin."""
    assert [b.start for b in bins.blocks] == [0, *(b.stop for b in bins.blocks[:-1])]
    assert bins.blocks[-1].stop == bins.n == len(bins.time)
    for block in bins.blocks:
        assert np.all(bins.run[block.start : block.stop] == block.run)


def test_bins_two_by_two_are_bins_of_twice_the_width() -> None:
    """Means, uses, times and blocks as gathered at once; of each two the mean."""
    bins, values = two_runs(), tuple(np.random.default_rng(k).standard_normal((N, 2)) for k in (1, 2))
    twice, pairs = merged(bins)
    at_once = two_runs(2 * PER_BIN)
    covered(twice)
    assert twice.blocks == at_once.blocks
    assert twice.width == at_once.width
    assert_allclose(twice.time, at_once.time, rtol=1e-12)
    assert_allclose(twice.mean(values), at_once.mean(values), rtol=1e-12)
    assert_allclose(bins.mean(values)[pairs].mean(axis=1), twice.mean(values), rtol=1e-12)


def test_bins_without_some_are_the_others() -> None:
    bins, values = two_runs(), tuple(np.random.default_rng(k).standard_normal(N) for k in (1, 2))
    gone = np.zeros(bins.n, bool)
    gone[[3, 4, 30, 60, 61]] = True
    rest = without(bins, gone)
    covered(rest)
    assert_allclose(rest.mean(values), bins.mean(values)[~gone], rtol=1e-12)
    assert_allclose(rest.time, bins.time[~gone], rtol=1e-12)
    assert np.array_equal(rest.held_out, bins.held_out[~gone])
    assert np.array_equal(rest.run, bins.run[~gone])
    assert len(rest.blocks) == len(bins.blocks) + 3


@pytest.mark.parametrize(("gaps", "lost", "blocks"), [(5, 1, 6), (MOST_PIECES, 1, MOST_PIECES + 1)])
def test_each_of_few_gaps_parts_two_blocks(gaps: int, lost: int, blocks: int) -> None:
    assert len(with_gaps(gaps, lost).blocks) == blocks


@pytest.mark.parametrize(("lost", "blocks"), [(SHORT_GAP, 1), (SHORT_GAP + 1, MOST_PIECES + 2)])
def test_of_many_gaps_the_short_ones_are_bridged(lost: int, blocks: int) -> None:
    assert len(with_gaps(MOST_PIECES + 1, lost).blocks) == blocks


def with_gaps(gaps: int, lost: int) -> Bins:
    """Bins of one cell, pieces of two bins between gaps of so many."""
    count = np.zeros(N, int)
    for k in range(gaps + 1):
        count[k * (2 + lost) :][:2] = 1
    fit = np.ones(count.sum(), bool)
    e = exposure(count)
    return gather((e,), (fit,), (~fit,), 1, 1)


def test_bins_two_by_two_survive_rows_that_are_lost_here_and_there() -> None:
    """One row of 13 is lost: means over 32 rows, made of single ones, hold what is there and mix no uses."""
    there = np.arange(N) % 13 != 5
    e, at = exposure(there.astype(np.int64)), np.flatnonzero(there)
    bins = gather((e,), (at < 352,), (at >= 352,), 1, 1)
    values: Floats = np.square(np.arange(N, dtype=np.float64))
    y = bins.mean((values,))
    for _ in range(5):
        bins, pairs = merged(bins, FULL)
        y = y[pairs].mean(axis=1)
    covered(bins)
    assert list(bins.kept[0]) == list(range(N // 32))
    assert np.array_equal(bins.held_out, np.arange(N // 32) >= 11)
    assert_allclose(bins.mean((values,)), y, rtol=1e-12)
    lost = ~there[: N // 32 * 32].reshape(-1, 32)
    assert np.all(bins.weights[0][lost] == 0.0)


def test_the_last_bin_of_a_run_in_pieces_is_not_merged_beyond_its_end() -> None:
    """Every third of 75 bins is lost, and the last has no neighbour: a mean over two would reach behind the run."""
    there = np.arange(N) // 8 % 3 != 1
    e = exposure(there.astype(np.int64))
    bins = gather((e,), (there[there],), (~there[there],), 8, 1)
    assert bins.kept[0][-1] == 74
    values: Floats = np.square(np.arange(N, dtype=np.float64))
    y = bins.mean((values,))
    bins, pairs = merged(bins, FULL)
    assert bins.kept[0][-1] == 36
    assert_allclose(bins.mean((values,)), y[pairs].mean(axis=1), rtol=1e-12)
