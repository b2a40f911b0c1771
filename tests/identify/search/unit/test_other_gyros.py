"""A unit that is turned in the hand about one axis: a gyro across it follows that one, and its lines are the turn's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.identify.findings import TargetFindings

DT, N = 0.05, 8000

MANIFEST = """
data = "unit.npz"
[channels]
time = { rate = "20 Hz" }
gyro_x = { column = "gyro_x", unit = "rad/s" }
gyro_z = { column = "gyro_z", unit = "rad/s" }
[model]
target = "gyro_x"
declared = ["bias"]
procedure = "static"
"""


def across(folder: Path, turn: float, part: float) -> TargetFindings:
    """Of a gyro with a ``part`` of a turn of so many rad/s about the axis of another one."""
    rng, t = np.random.default_rng(2), DT * np.arange(N)
    rate = turn * (np.sin(2 * np.pi * t / 41) + 0.7 * np.sin(2 * np.pi * t / 31))
    x, z = (share * rate + 1e-3 * rng.standard_normal(N) for share in (part, 1.0))
    np.savez(folder / "unit.npz", gyro_x=x, gyro_z=z)
    (folder / "unit.toml").write_text(MANIFEST)
    (found,) = close(folder / "unit.toml").targets
    return found


@pytest.mark.parametrize(("turn", "part"), [(0.3, 1.2e-3), (0.3, 0.0), (0.0, 0.0)])
def test_a_turn_about_another_axis_makes_no_line(tmp_path: Path, turn: float, part: float) -> None:
    """Named without this: tones at the frequencies of the turn. Chance gives as much in one recording of a million."""
    found = across(tmp_path, turn, part)
    assert found.added == ()
    said = [reason for reason in found.reasons if "follows gyro_z" in reason]
    assert len(said) == bool(part)
    if said:
        value, sd = (float(word) for word in said[0].split("gyro_z, ")[1].split(" of it")[0].split(" ± "))
        assert abs(value - part) < 4 * sd
