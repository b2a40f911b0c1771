"""What no effect explains in a list of points is no silence: by readings that repeat a setting, and by their order."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.recording import Floats
from insenv.identify.findings import TargetFindings

LEVELS = np.linspace(-1.0, 1.0, 15)


def closed(folder: Path, rate: Floats, departure: Floats, seed: int) -> TargetFindings:
    rng = np.random.default_rng(seed)
    y = 0.3 + 200.8 * rate + 0.05 * (departure + rng.standard_normal(len(rate)))
    np.savetxt(folder / "run.csv", np.column_stack([200 * rate, y]), "%.9g", ",", header="w,g", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "row" }\ngyro = { column = "g", unit = "deg/s" }\n'
        'table_rate = { column = "w", unit = "deg/s" }\n[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'
    )
    (target,) = close(folder / "run.toml").targets
    return target


@pytest.mark.parametrize("seed", range(3))
def test_settings_that_are_off_each_time_are_a_doubt(tmp_path: Path, seed: int) -> None:
    """Every rate has an error of its own, six deviations: no law, and no noise of the readings."""
    own = 6 * np.random.default_rng(seed).standard_normal(15)
    target = closed(tmp_path, np.tile(LEVELS, 4), np.tile(own, 4), seed)
    assert target.verdict not in ("nothing-significant", "effects-found")
    assert any("readings at one setting agree better" in reason for reason in target.reasons)


@pytest.mark.parametrize("seed", range(3))
def test_two_levels_that_come_and_go_are_a_doubt(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng([1, seed])
    rate = rng.permutation(np.tile(LEVELS, 3))
    target = closed(tmp_path, rate, np.where(np.arange(45) // 6 % 2, 5.0, 0.0), seed)
    assert target.verdict != "nothing-significant"


def test_readings_without_a_fault_pass(tmp_path: Path) -> None:
    """Two of 30 or fewer, at a level of 1 %, in all but 3 in a thousand such sets."""
    doubts = 0
    for seed in range(30):
        rate = np.random.default_rng([2, seed]).permutation(np.tile(LEVELS, 2))
        target = closed(tmp_path, rate, np.zeros(30), 100 + seed)
        doubts += any("one setting" in r or "row to row" in r for r in target.reasons)
    assert doubts <= 2
