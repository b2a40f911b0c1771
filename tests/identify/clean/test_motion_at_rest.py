"""A unit that is declared at rest and moves: the rows are left out and said, or the recording is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.errors import InputError
from insenv.identify.findings import Findings

DT, N = 0.02, 20000


def closed(folder: Path, gyro: np.ndarray, more: str = "") -> Findings:
    np.savetxt(folder / "run.csv", np.column_stack([np.arange(N) * DT, gyro]), "%.9g", ",", header="t,g", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        f'gyro = {{ column = "g", unit = "deg/s" }}\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n{more}'
    )
    return close(folder / "run.toml")


def turned(start: float, seconds: float, angle: float = 360.0) -> np.ndarray:
    """A still gyro that is turned by hand once: a bell of the rate."""
    t = np.arange(N) * DT
    bell = np.exp(-0.5 * ((t - start) / (seconds / 5)) ** 2)
    return 0.3 + np.random.default_rng(1).normal(0, 0.05, N) + angle * bell / (bell.sum() * DT)


def test_a_turn_by_hand_is_no_error_of_the_gyro(tmp_path: Path) -> None:
    found = closed(tmp_path, turned(100.0, 12.0))
    (target,) = found.targets
    assert not target.added
    assert found.rows_rejected and all(row.reason == "motion" for row in found.rows_rejected)
    covered = sum(row.stop - row.start for row in found.rows_rejected) * DT
    assert 12.0 < covered < 28.0  # the bell is seen until four of its deviations
    assert target.cautions[0].startswith("Declared at rest, but the unit moves")
    (bias,) = target.estimates_after
    assert bias.value == pytest.approx(np.radians(0.3), abs=5 * bias.sd)


def test_a_recording_that_only_moves_is_refused(tmp_path: Path) -> None:
    t = np.arange(N) * DT
    with pytest.raises(InputError, match="is declared at rest and moves in .*multi-position"):
        closed(tmp_path, 30 * np.sin(2 * np.pi * t / 60))


def test_slow_and_small_departures_are_the_instruments(tmp_path: Path) -> None:
    """A warm-up of 2 deg/s, or a bias of 20 deg/s, is no motion."""
    t = np.arange(N) * DT
    rng = np.random.default_rng(2)
    found = closed(tmp_path, 20 + 2 * np.exp(-t / 60) + rng.normal(0, 0.05, N))
    assert not found.rows_rejected
    assert [one.effect for one in found.targets[0].added] == ["bias_warm_up"]


def test_loud_noise_is_no_motion(tmp_path: Path) -> None:
    """White noise of 60 deg/s at 50 Hz: means of a second scatter by 8.5 deg/s, beyond the limit of a quiet gyro."""
    found = closed(tmp_path, np.random.default_rng(3).normal(0, 60, N))
    assert not found.rows_rejected
