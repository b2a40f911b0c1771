"""A rest that goes on behind a gap in time: at another level, or at one that its noise may have come to.

Of 60 recordings of white noise alone none has a doubt of it, of 60 with a walk that may take the level half as far as
the step one has (seeds 0 to 59); of 12 with the step all have. One seed of each stands for them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close

MANIFEST = """\
data = "rests.csv"
[channels]
time = { column = "t", unit = "s" }
accel_x = { column = "a", unit = "m/s^2" }
[model]
target = "accel_x"
declared = ["bias"]
"""
DT, WHITE, STEP, WALK = 0.01, 0.025, 0.085, 8e-3


@pytest.mark.parametrize(("step", "walk", "doubted"), [(STEP, 0.0, True), (0.0, 0.0, False), (0.0, WALK, False)])
def test_another_level_behind_a_gap_is_doubted(tmp_path: Path, step: float, walk: float, doubted: bool) -> None:
    rng = np.random.default_rng(1)
    t = DT * np.arange(int(50 / DT))
    level = np.cumsum(walk * np.sqrt(DT) * rng.standard_normal(len(t))) + step * (t > 30)
    there = (t < 12) | (t >= 45)
    reads = level + WHITE * rng.standard_normal(len(t))
    np.savetxt(tmp_path / "rests.csv", np.column_stack([t, reads])[there], "%.9g", ",", header="t,a", comments="")
    (tmp_path / "rests.toml").write_text(MANIFEST)
    (target,) = close(tmp_path / "rests.toml").targets
    assert any("behind a gap of 33 s" in reason for reason in target.reasons) == doubted
    assert not doubted or target.verdict not in ("nothing-significant", "effects-found")
