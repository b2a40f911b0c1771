"""Student rate tables: gain, skew of each run and hold beside a late and noisy encoder.

Units are those of `scripts/studies/student_tables.py`, whose files share no code with insenv; seeds are fixed. A
deviation beyond 4 sd is one of 16000.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from studies import student_tables as bench

from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.reference import with_reference
from insenv.data.split import split
from insenv.identify.prepare.problems import Prepared, prepare
from insenv.scenario import simulate


def prepared(manifest: Path) -> Prepared:
    read = load_manifest(manifest)
    recordings = tuple(with_reference(r) for r in read_recordings(read))
    return prepare(read, recordings, split(read, recordings), "gyro")


@pytest.mark.parametrize("seed", [1, 2, 8])
def test_gain_lag_and_hold_are_told_in_the_samples(tmp_path: Path, seed: int) -> None:
    unit = bench.drawn(seed)
    found = prepared(bench.written(unit, seed, tmp_path))
    hold, motions = found.held.hold, [e.motion for e in found.problem.exposures]
    assert hold is not None and hold.share == 1.0
    assert hold.hold == pytest.approx(unit.hold * unit.dt, abs=1e-6)
    assert found.problem.gain == pytest.approx(unit.gain, abs=2e-3)
    np.testing.assert_allclose([m.lag for m in motions], -np.array(unit.late), atol=1e-3)
    assert found.lines == ()
    assert round(found.problem.bins.width / (unit.hold * unit.dt), 6) % 1 == 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 3, 5])
def test_skew_and_gain_are_within_their_deviations(seed: int) -> None:
    kept = bench.outcome(seed)
    assert set(kept["named"]) <= {"timing_skew", "sample_hold"}
    assert np.all(np.abs(kept["skew"]) < 4) and abs(kept["gain"][0]) < 4


def test_the_packaged_bench_is_simulated_as_several_files_of_one_unit(tmp_path: Path) -> None:
    manifest = simulate("rate_table/student", tmp_path, seed=3)
    runs = read_recordings(load_manifest(manifest))
    assert len(runs) == 3
    for run in runs:
        gyro = run.channels["gyro"].values
        np.testing.assert_allclose(gyro / 0.01, np.rint(gyro / 0.01), atol=1e-6)
        assert np.mean(np.diff(gyro) != 0) < 0.4  # renewed every third row
    assert not np.array_equal(runs[0].channels["gyro"].values, runs[1].channels["gyro"].values)


def test_a_controller_logs_a_command_that_jumps(tmp_path: Path) -> None:
    changes = {
        "table.logged_rate": "command",
        "profile.kind": "steps",
        "profile.steps": [["5 s", "0 deg/s"], ["5 s", "50 deg/s"]],
    }
    base = {"instrument.sampling": "10 Hz", "duration": "10 s"}
    manifest = simulate("rate_table/kvh13", tmp_path, seed=1, changes=changes | base)
    told = np.rad2deg(read_recordings(load_manifest(manifest))[0].channels["table_rate"].values)
    assert sorted(set(np.round(told, 6).tolist())) == [0.0, 50.0]
