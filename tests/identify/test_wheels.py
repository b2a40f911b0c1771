"""A gyro beside the wheels of a robot, whose speeds come every tenth of a second with noise and are held in between.

Without noise of its own a held rate was taken for what a table was told, a gain of 0.92 read 0.5 +- 0.1 (seeds 0 to 5),
and of a robot that waits before it drives no gain was told at all. Of 61 recordings without a cause (seeds 100 to 130,
half of robots that wait) two name one, under a verdict that says that something is left; no gain is off by 2.5
deviations.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from strangers import closed_rate_file


@pytest.mark.parametrize("waits", [0.0, 0.62])
def test_the_gain_beside_wheels_that_are_held_is_right(tmp_path: Path, waits: float) -> None:
    rng, gain, dt, duration = np.random.default_rng(3), 0.92, 0.01, 40.0
    t = dt * np.arange(int(duration / dt))
    f, a, phase = rng.uniform(0.03, 0.5, 8), rng.uniform(0.05, 0.15, 8), rng.uniform(0, 2 * np.pi, 8)
    rate = np.sum(a[:, None] * np.sin(2 * np.pi * f[:, None] * t + phase[:, None]), axis=0)
    rate[t < waits * duration] = 0.0
    seen = rate[::10] + 0.02 * rng.standard_normal(len(t) // 10) * (rate[::10] != 0)
    gyro = gain * rate - 0.008 + 2e-3 * rng.standard_normal(len(t))
    target = closed_rate_file(tmp_path, t, gyro, np.repeat(seen, 10))
    (scale,) = [e for e in target.estimates_after if e.effect == "scale_factor"]
    assert target.added == ()
    assert scale.sd is not None
    assert abs(scale.value - (gain - 1.0)) < 4 * scale.sd < 0.2
