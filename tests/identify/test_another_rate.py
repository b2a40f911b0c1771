"""A gain that no gyro has says that the reference is another rate: a law of the rate is then no more the gyro's.

Seeds are fixed; the cubic stands with more than 30 deviations of the noise.
"""

import numpy as np
import pytest
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Recording

DT = 0.02


@pytest.mark.parametrize(("gain", "doubted"), [(0.52, True), (0.98, False)])
def test_a_law_of_the_rate_beside_a_gain_of_no_gyro_is_doubted(gain: float, doubted: bool) -> None:
    rng = np.random.default_rng(5)
    t = DT * np.arange(6000.0)
    levels = np.repeat(rng.permutation(np.linspace(-1.5, 1.5, 24)), 250)
    rate = np.convolve(levels, np.ones(25) / 25, mode="same")
    angle = np.cumsum(rate) * DT + 2e-4 * rng.standard_normal(len(t))
    gyro = gain * (rate - 0.005 * rate**3) + 1e-3 * rng.standard_normal(len(t))
    channels = {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(angle, "rad", source="encoder")}
    (target,) = closed(Recording(t, channels), manifest(declared=("bias",))).targets
    assert "scale_factor_cubic" in {one.effect for one in target.added}
    assert any("none of a gyro" in reason for reason in target.reasons) == doubted
