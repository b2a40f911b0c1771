"""A line that wanders is not rejected at the price of the motion that tells of the instrument."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.prepare.problems import prepare

DT = 0.01
N = 9000


@pytest.mark.parametrize(("hertz", "longest"), [(0.02, 5.0), (1.0, 0.3)])
def test_means_that_reject_a_line_keep_the_motion(hertz: float, longest: float) -> None:
    """A table that swings once a second, and a line that wanders about 9 Hz: its bins would be a swing long."""
    rng = np.random.default_rng(3)
    t: Floats = DT * np.arange(N, dtype=np.float64)
    omega = 2 * np.pi * hertz
    wander = 9.0 + 0.08 * np.sin(2 * np.pi * t / 17) + 0.05 * np.sin(2 * np.pi * t / 7)
    line = 0.3 * np.cos(2 * np.pi * np.cumsum(wander) * DT)
    gyro = np.cos(omega * t) + line + 0.05 * rng.standard_normal(N)
    channels = {
        "gyro": Channel(gyro, "rad/s", "instant"),
        "table_angle": Channel(np.sin(omega * t) / omega, "rad", "instant", source="encoder"),
    }
    run = Recording(t, channels)
    found = prepare(manifest(), (run,), (use(N, 0.6),), "gyro", holds=False, width=0.2)
    assert found.problem.bins.width <= longest
    assert any(not one.steady for one in found.lines) is (longest > 1)
