"""Which rows are fitted and which are held out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.split import RowUse, split, without_tails


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
