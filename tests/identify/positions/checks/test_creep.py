"""An accelerometer that goes one way while it rests: means of rests do not tell it."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.recording import Channel, Floats, Recording
from insenv.core.units import STANDARD_GRAVITY
from insenv.identify.positions.checks.creep import creeping
from insenv.identify.positions.rests import Rest

ROWS, RESTS = 400, 12
DRIFT, CREEP = np.linspace(0.0, 0.02, ROWS), 0.02 * np.exp(-np.arange(ROWS) / 80)


def said(way: Floats, seed: int = 0, rests: int = RESTS, hand: float = 0.0) -> tuple[str, ...]:
    """Of rests in drawn attitudes, each of which changes on z by ``way``; a ``hand`` leans on the fourth."""
    rng = np.random.default_rng(seed)
    unit = rng.standard_normal((rests, 3))
    force = STANDARD_GRAVITY * unit / np.linalg.norm(unit, axis=1)[:, None]
    values = np.repeat(force, ROWS, axis=0) + 5e-3 * rng.standard_normal((rests * ROWS, 3))
    values[:, 2] += np.tile(way, rests)
    values[3 * ROWS : 4 * ROWS, 2] += hand * np.repeat(rng.standard_normal(10), ROWS // 10)
    channels = {f"accel_{axis}": Channel(values[:, k], "m/s^2") for k, axis in enumerate("xyz")}
    recording = Recording(0.01 * np.arange(float(len(values))), channels)
    return creeping((recording,), [Rest(k, 0, k * ROWS, (k + 1) * ROWS) for k in range(rests)])


@pytest.mark.parametrize(
    ("way", "rests", "hand"), [(DRIFT, RESTS, 0.0), (DRIFT, RESTS, 0.1), (DRIFT, 4, 0.0), (CREEP, RESTS, 0.0)]
)
def test_a_drift_and_a_creep_after_each_turn_are_said(way: Floats, rests: int, hand: float) -> None:
    (reason,) = said(way, rests=rests, hand=hand)
    assert reason.startswith("accel_z reads") and f"in {rests} rests" in reason


@pytest.mark.parametrize("seed", range(10))
def test_noise_of_rests_goes_no_way(seed: int) -> None:
    """False alarm 1e-4 each."""
    assert said(np.zeros(ROWS), seed) == ()
    assert said(np.zeros(ROWS), seed, hand=0.1) == ()
