"""Uneven stamps of a unit at rest: nothing depends on when within the second a row was taken."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.split import split


def read(folder: Path, t: np.ndarray, more: str = "", table: str = "") -> Recording:
    rows = np.column_stack([t, 0.1 + 1e-3 * np.random.default_rng(0).standard_normal(len(t)), np.sin(t)])
    np.savetxt(folder / "run.csv", rows, "%.9g", ",", header="t,g,w", comments="")
    (folder / "run.toml").write_text(
        f'data = "run.csv"\n[channels]\ntime = {{ column = "t", unit = "s" }}\n{table}'
        f'gyro = {{ column = "g", unit = "rad/s" }}\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n{more}'
    )
    (found,) = read_recordings(load_manifest(folder / "run.toml"))
    return found


def bursts(seconds: float = 60.0) -> np.ndarray:
    """Stamps of a logger that writes the rows of 60 to 200 ms at once, within 30 ms, at 100 Hz."""
    rng, taken = np.random.default_rng(1), np.arange(0.0, seconds, 0.01)
    written = np.cumsum(rng.uniform(0.06, 0.2, round(seconds / 0.1)))
    batch = np.searchsorted(written, taken)
    keep = batch < len(written)
    t = written[batch[keep]] + rng.uniform(0.0, 0.03, keep.sum())
    return np.sort(t)


def test_rows_written_in_bursts_follow_each_other_at_their_mean_rate(tmp_path: Path) -> None:
    t = bursts()
    run = read(tmp_path, t)
    assert len(run) == len(t)
    np.testing.assert_allclose(np.diff(run.t), 0.01, rtol=5e-3)
    assert np.abs(run.t - t).max() < 0.3
    assert any("at rest, rows are taken to follow each other at their mean rate" in note for note in run.notes)


def test_rows_of_packets_follow_each_other_or_want_a_rate(tmp_path: Path) -> None:
    """18 rows a stamp; packets of one delay are told from such as wait for seconds, and both from rests far apart."""
    taken = 0.01 * np.arange(7200.0)
    stamp = np.repeat(taken[17::18], 18)
    run = read(tmp_path, stamp)
    assert len(run) == len(stamp)
    np.testing.assert_allclose(np.diff(run.t), 0.01, rtol=5e-3)
    with pytest.raises(InputError, match=r"packets, and these follow no even rate; wanted .* rate = .\d+"):
        read(tmp_path, stamp + 3.0 * np.sin(stamp / 12.0))
    rests = np.concatenate([taken, taken + 1e4])
    assert len(read(tmp_path, rests)) == len(rests)


def test_a_rate_that_changes_is_resampled(tmp_path: Path) -> None:
    steps = np.concatenate([np.full(3000, 0.01), np.full(3000, 0.03)]) * np.random.default_rng(2).uniform(
        0.5, 1.5, 6000
    )
    run = read(tmp_path, np.cumsum(steps))
    np.testing.assert_allclose(np.diff(run.t), run.dt, rtol=1e-6)
    assert any("resampled to" in note for note in run.notes)


@pytest.mark.parametrize("rows", ["[held_out]\nrows = [[4000, 5000]]\n", "[fit]\nrows = [[0, 4000]]\n"])
def test_where_a_manifest_counts_rows_they_are_those_of_the_file(tmp_path: Path, rows: str) -> None:
    """Means that are made anew hold the rows that were named, and no others."""
    steps = np.concatenate([np.full(3000, 0.01), np.full(3000, 0.03)]) * np.random.default_rng(2).uniform(
        0.5, 1.5, 6000
    )
    run = read(tmp_path, np.cumsum(steps), rows)
    (use,) = split(load_manifest(tmp_path / "run.toml"), (run,))
    assert run.made_of is not None
    first, last = (0, 4000) if "fit" in rows else (4000, 5000)
    of_named = run.made_of[use.held_out if "held_out" in rows else use.fit | use.held_out]
    assert first <= of_named[0, 0] < first + 20 and last - 20 < of_named[-1, 1] <= last


def test_a_table_wants_its_times(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not evenly sampled"):
        read(tmp_path, bursts(), table='table_rate = { column = "w", unit = "rad/s" }\n')


def test_a_sensor_that_is_heard_now_and_then_is_made_means(tmp_path: Path) -> None:
    """A tag by radio: readings some seconds apart while it is heard, and none for half an hour: no packets."""
    rng = np.random.default_rng(5)
    heard = np.cumsum(rng.uniform(600.0, 1800.0, 80))
    t = np.round(np.concatenate([start + np.cumsum(rng.uniform(5.0, 20.0, 5)) for start in heard]))
    run = read(tmp_path, t)
    np.testing.assert_allclose(np.diff(run.t) / run.dt, np.rint(np.diff(run.t) / run.dt), rtol=1e-9)
    assert any("resampled to" in note for note in run.notes)
    assert len(run) > 15
