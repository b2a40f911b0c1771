"""An accelerometer that clips below gravity: six faces fit it with a scale factor, and nothing is left."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.recording import Channel, Recording
from insenv.core.units import STANDARD_GRAVITY
from insenv.identify.positions.checks.clipped import clipped
from insenv.identify.positions.rests import Rest

ROWS, STEP = 400, 0.0024
FACES = STANDARD_GRAVITY * np.vstack([np.eye(3), -np.eye(3)])


def said(most: float, noise: float = 0.02, seed: int = 0, step: float = STEP) -> tuple[str, ...]:
    """Of six faces, a rest each, whose y reads no more than ``most`` either way."""
    rng = np.random.default_rng(seed)
    values = np.repeat(FACES, ROWS, axis=0) + noise * rng.standard_normal((6 * ROWS, 3))
    values = np.round(values / step) * step
    values[:, 1] = np.clip(values[:, 1], -most, most)
    channels = {f"accel_{axis}": Channel(values[:, k], "m/s^2") for k, axis in enumerate("xyz")}
    recording = Recording(0.01 * np.arange(float(len(values))), channels)
    return clipped((recording,), [Rest(k, 0, k * ROWS, (k + 1) * ROWS) for k in range(6)])


@pytest.mark.parametrize("most", [9.6, 9.8064, 9.816])  # far below gravity, at it and above half of its noise
def test_a_clipped_axis_is_told(most: float) -> None:
    low_and_high = said(most)
    assert [reason.split(",")[0] for reason in low_and_high] == [
        f"accel_y reads exactly {most:.5g} m/s^2",
        f"accel_y reads exactly {-most:.5g} m/s^2",
    ]


@pytest.mark.parametrize("step", [STEP, 0.02, 0.1])
@pytest.mark.parametrize("seed", range(5))
def test_noise_and_coarse_steps_are_no_clipping(step: float, seed: int) -> None:
    assert said(np.inf, seed=seed, step=step) == ()
