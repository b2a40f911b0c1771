"""A size that the fitted rows tell of a unit at rest, and all rows do not.

Seeds are fixed; beyond 3.5 deviations the two differ in one of 2000 recordings by chance.
"""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Recording
from insenv.identify.findings import TargetFindings

ROWS = 600
SLOPE = 1e-4


def heated(seed: int, returns: bool) -> TargetFindings:
    """A gyro that is warmed by 5 K in the fitted rows and cools in the others; its bias ``returns`` or stays."""
    rng = np.random.default_rng(seed)
    part = np.arange(ROWS) / ROWS
    warm = 5.0 * np.interp(part, [0.0, 0.6, 1.0], [0.0, 1.0, 0.0])
    bias = SLOPE * (warm if returns else np.maximum.accumulate(warm))
    gyro = bias + 3e-5 * rng.standard_normal(ROWS)
    channels = {"gyro_x": Channel(gyro, "rad/s"), "temperature": Channel(298.0 + warm, "K")}
    run = Recording(10.0 * np.arange(1.0, ROWS + 1), channels)
    return closed(run, manifest(("gyro_x",), ("bias", "bias_temperature"))).targets[0]


@pytest.mark.parametrize("returns", [True, False])
def test_a_size_is_no_surer_than_all_rows_bear_it_out(returns: bool) -> None:
    target = heated(1, returns)
    (slope,) = [e for e in target.estimates_after if e.effect.startswith("bias_temperature") and e.parameter == "c"]
    assert any("by all rows" in reason for reason in target.reasons) == (not returns)
    assert (slope.sd < 0.1 * SLOPE) == returns
    assert abs(slope.value - SLOPE) < 4 * slope.sd
