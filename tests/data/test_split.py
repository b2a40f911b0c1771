"""Which rows are fitted and which are held out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.split import RowUse, other_folds, sentence_of_split, split, with_uses, without_tails


def used(folder: Path, more: str, runs: int = 1) -> tuple[tuple[Recording, ...], tuple[RowUse, ...]]:
    for run in range(runs):
        rows = np.column_stack([np.arange(100.0), np.random.default_rng(run).normal(size=100)])
        np.savetxt(folder / f"{run}.csv", rows, "%.9g", ",", header="t,g", comments="")
    names = ", ".join(f'"{run}.csv"' for run in range(runs))
    (folder / "run.toml").write_text(
        f'data = [{names}]\n[channels]\ntime = {{ column = "t", unit = "s" }}\n'
        f'gyro = {{ column = "g", unit = "rad/s" }}\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n{more}'
    )
    manifest = load_manifest(folder / "run.toml")
    recordings = read_recordings(manifest)
    return recordings, split(manifest, recordings)


def ranges(mask: np.ndarray) -> list[int]:
    return np.flatnonzero(np.diff(mask.astype(int), prepend=0, append=0)).tolist()


def test_without_a_word_the_last_part_of_the_time_is_held_out(tmp_path: Path) -> None:
    _, (use,) = used(tmp_path, "")
    assert ranges(use.fit) == [0, 60] and ranges(use.held_out) == [60, 100]


def test_other_folds_hold_out_the_first_and_the_middle_part_of_each_run(tmp_path: Path) -> None:
    recordings, _ = used(tmp_path, "", runs=2)
    first, middle = other_folds(load_manifest(tmp_path / "run.toml"), recordings)
    assert [ranges(use.held_out) for use in first] == 2 * [[0, 40]]
    assert [ranges(use.held_out) for use in middle] == 2 * [[30, 70]]
    assert all(np.array_equal(use.fit, ~use.held_out) for use in (*first, *middle))


@pytest.mark.parametrize("more", ["[fit]\nrows = [[10, 30]]\n", '[held_out]\nstart = "40 s"\n'])
def test_rows_that_a_manifest_names_have_no_other_folds(tmp_path: Path, more: str) -> None:
    recordings, _ = used(tmp_path, more)
    assert not other_folds(load_manifest(tmp_path / "run.toml"), recordings)


def test_rows_that_are_named_alone_are_parted(tmp_path: Path) -> None:
    """In each run the last rows that were named; none besides."""
    _, (use,) = used(tmp_path, "[fit]\nrows = [[10, 30], [50, 80]]\n")
    assert ranges(use.fit) == [10, 30, 50, 60] and ranges(use.held_out) == [60, 80]
    _, (first, second) = used(tmp_path, "[fit]\nrows = [[0, 50], [150, 200]]\n", runs=2)
    assert ranges(first.fit) == [0, 30] and ranges(first.held_out) == [30, 50]
    assert ranges(second.fit) == [50, 80] and ranges(second.held_out) == [80, 100]


def test_named_rows_of_both_kinds_stay_as_named(tmp_path: Path) -> None:
    _, (use,) = used(tmp_path, "[fit]\nrows = [[10, 30]]\n[held_out]\nrows = [[40, 50]]\n")
    assert ranges(use.fit) == [10, 30] and ranges(use.held_out) == [40, 50]
    with pytest.raises(InputError, match="20 rows from row 40 on are in fit.rows and held out"):
        used(tmp_path, '[fit]\nrows = [[10, 60]]\n[held_out]\nstart = "40 s"\n')


def test_what_follows_the_last_row_in_use_is_cut(tmp_path: Path) -> None:
    recordings, uses = used(tmp_path, "[fit]\nrows = [[10, 30]]\n[held_out]\nrows = [[40, 50]]\n")
    (run,), (use,) = without_tails(recordings, uses)
    assert len(run) == len(use.fit) == len(use.held_out) == 50 and ranges(use.held_out) == [40, 50]
    np.testing.assert_array_equal(run.channels["gyro"].values, recordings[0].channels["gyro"].values[:50])


def turned(folder: Path, rate: np.ndarray, more: str = "") -> tuple[tuple[str, ...], RowUse]:
    rows = np.column_stack([np.arange(float(len(rate))), rate, rate])
    np.savetxt(folder / "turned.csv", rows, "%.9g", ",", header="t,g,w", comments="")
    (folder / "turned.toml").write_text(
        'data = "turned.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "g", unit = "rad/s" }\n'
        'table_rate = { column = "w", unit = "rad/s" }\n[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'
        f"{more}"
    )
    manifest = load_manifest(folder / "turned.toml")
    recordings = read_recordings(manifest)
    return sentence_of_split(manifest, recordings), split(manifest, recordings)[0]


def test_of_a_table_that_stands_first_the_last_part_of_its_motion_is_held_out(tmp_path: Path) -> None:
    """A robot waits before it drives: nothing would tell the gain that is asked of all its motion."""
    waits = np.where(np.arange(1000) < 620, 0.0, np.sin(0.31 * np.arange(1000)))
    said, use = turned(tmp_path, waits)
    assert ranges(use.fit)[0] == 0 and ranges(use.held_out)[1] == 1000 and not np.any(use.fit & use.held_out)
    assert 820 < ranges(use.held_out)[0] < 880
    assert len(said) == 1 and "the last 40 % of what it turns" in said[0]
    manifest = load_manifest(tmp_path / "turned.toml")
    (first,), (middle,) = other_folds(manifest, read_recordings(manifest))
    assert ranges(first.held_out)[0] == 0 and 740 < ranges(first.held_out)[1] < 800
    assert 710 < ranges(middle.held_out)[0] < 760 and 860 < ranges(middle.held_out)[1] < 920


@pytest.mark.parametrize("first", [0, 300, 560, 1000])
def test_a_table_that_turns_among_the_first_rows_is_parted_by_the_time(tmp_path: Path, first: int) -> None:
    said, use = turned(tmp_path, np.where(np.arange(1000) < first, 0.0, np.sin(0.31 * np.arange(1000))))
    assert not said and ranges(use.held_out) == [600, 1000]


def test_what_a_manifest_names_stays_where_the_table_stands_first(tmp_path: Path) -> None:
    waits = np.where(np.arange(1000) < 620, 0.0, np.sin(0.31 * np.arange(1000)))
    said, use = turned(tmp_path, waits, '[held_out]\nstart = "700 s"\n')
    assert not said and ranges(use.held_out) == [700, 1000]
    said, use = turned(tmp_path, waits, "[fit]\nrows = [[0, 1000]]\n")
    assert not said and ranges(use.held_out) == [600, 1000]


def test_a_last_turn_alone_is_not_parted(tmp_path: Path) -> None:
    """Of four in a hundred rows hardly any would be held out."""
    said, use = turned(tmp_path, np.where(np.arange(1000) < 960, 0.0, 1.0))
    assert not said and ranges(use.held_out) == [600, 1000]


@pytest.mark.parametrize("period", range(2, 25))
@pytest.mark.parametrize("times", [3, 4, 6])
def test_of_what_comes_again_and_again_each_is_fitted_and_held_out(tmp_path: Path, period: int, times: int) -> None:
    rates = np.tile(np.arange(period, dtype=float), times)
    np.savetxt(tmp_path / "p.csv", np.column_stack([rates, rates]), "%.9g", ",", header="w,g", comments="")
    (tmp_path / "p.toml").write_text(
        'data = "p.csv"\n[channels]\ntime = { column = "row" }\ngyro = { column = "g", unit = "deg/s" }\n'
        'table_rate = { column = "w", unit = "deg/s" }\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    )
    manifest = load_manifest(tmp_path / "p.toml")
    (use,) = split(manifest, read_recordings(manifest))
    assert abs(use.held_out.sum() - len(rates) / 3) <= 1
    assert set(rates[use.fit]) == set(range(period))
    if times != 4:  # four in a row need not hold all three of which one is held out
        assert set(rates[use.held_out]) == set(range(period))


def test_rows_in_no_use_are_said_and_cut_with_the_others(tmp_path: Path) -> None:
    recordings, uses = used(tmp_path, "[fit]\nrows = [[20, 60]]\n[held_out]\nrows = [[60, 80]]")
    (told,) = with_uses(recordings, uses)
    assert told.unused is not None and ranges(~told.unused) == [20, 80]
    (cut,), _ = without_tails((told,), uses)
    assert cut.unused is not None and ranges(~cut.unused) == [20, 80] and len(cut.unused) == 80
    whole, uses = used(tmp_path, "")
    assert with_uses(whole, uses)[0].unused is None
