"""An accelerometer that clips below gravity, which six faces fit with a scale factor; a gyro held at nought."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.recording import Channel, Recording
from insenv.core.units import STANDARD_GRAVITY
from insenv.identify.positions.checks.numbers import clipped, silenced
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


@pytest.mark.parametrize("band", [0.03, 0.0])
@pytest.mark.parametrize("step", [0.001, 0.004])
def test_a_gyro_that_is_held_at_nought_is_told(band: float, step: float) -> None:
    """Noise of two steps, or half of one, about a bias: at rest it reads a few numbers, or none but nought."""
    rng = np.random.default_rng(1)
    turn = np.sin(np.pi * np.arange(100) / 100)
    rate = np.concatenate([np.append(np.zeros(ROWS), size * turn) for size in (0.8, -0.6, 1.0, -0.9, 0.7)])
    values = np.round((rate + 0.01 + 0.002 * rng.standard_normal(len(rate))) / step) * step
    values = np.where(np.abs(values) < band, 0.0, values)
    recording = Recording(0.01 * np.arange(float(len(values))), {"gyro_x": Channel(values, "rad/s")})
    rests = [Rest(k, 0, k * (ROWS + 100), k * (ROWS + 100) + ROWS) for k in range(5)]
    assert bool(silenced((recording,), rests, "gyro_x")) is (band > 0)
