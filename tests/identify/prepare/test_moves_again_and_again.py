"""A table that is indexed again and again, about an axis across the gyro's: what each move leaves is no line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close

MANIFEST = """
data = "run.csv"
[channels]
time = { column = "t", unit = "s" }
gyro = { column = "x", unit = "deg/h" }
table_angle = { column = "angle", unit = "deg" }
[site]
latitude = "48 deg"
[mounting]
tilt = "0 deg"
[model]
target = "gyro"
declared = ["bias", "earth_rate"]
[held_out]
averaging = "0.5 s"
"""
DT, EVERY, EARTH = 0.1, 50.0, 15.041 * np.cos(np.radians(48))


@pytest.mark.parametrize("line", [0.0, 0.3])
def test_what_comes_after_each_move_is_no_tone(tmp_path: Path, line: float) -> None:
    """A line of the gyro at another frequency is one: eight deviations at least, of ten thousand that were tried."""
    rng, t = np.random.default_rng(5), DT * np.arange(18_000)
    since = t % EVERY
    angle = 30 * (t // EVERY + np.minimum(since / 3.0, 1.0))
    rate = EARTH * np.cos(np.radians(angle)) + 0.4 * np.exp(-since / 12) + line * np.cos(2 * np.pi * 0.0317 * t)
    read = rate + 0.8 * rng.standard_normal(len(t))
    np.savetxt(tmp_path / "run.csv", np.column_stack([t, read, angle]), "%.9g", ",", header="t,x,angle", comments="")
    (tmp_path / "run.toml").write_text(MANIFEST)
    (found,) = close(tmp_path / "run.toml").targets
    named = [one.effect for one in found.added]
    assert "settling_after_turn" in named
    assert named.count("tone") == bool(line)
