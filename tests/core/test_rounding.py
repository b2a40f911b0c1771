"""The step of rounding: found where values are rounded, and no row within it is an outlier."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.recording import Channel, Floats, Recording
from insenv.core.series.outlying import unseen
from insenv.core.series.rounding import counted, counter_step, rounding
from insenv.identify.clean.outliers import without_outliers
from insenv.identify.findings import RejectedRows


def turned(rate: float, step: float, seed: int = 1) -> Recording:
    """A gyro of little noise on a table whose angle [deg] is rounded."""
    t = np.linspace(0.01, 300.0, 30_000)
    angle = np.round(rate * t / step) * step
    gyro = np.deg2rad(rate + 1e-4 * np.random.default_rng(seed).standard_normal(len(t)))
    channels = {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(np.deg2rad(angle), "rad")}
    return Recording(t, channels)


def test_the_last_digits_of_a_computed_rate_leap_nowhere() -> None:
    """Of a command of some deg/s that a resampler left off by 1e-13: 33 sound rows were said to be left out."""
    rng = np.random.default_rng(2)
    reference = np.full(6000, 0.3) + 1e-13 * rng.integers(-1, 2, 6000)
    assert not unseen(reference + 1e-4 * rng.standard_normal(6000), reference, coarse=9e-16)[0].any()


@pytest.mark.parametrize("rate", [10.00003, 10.003, 20.0000011])
@pytest.mark.parametrize("step", [1e-3, 1e-4, 1e-6])
def test_a_rounded_angle_makes_no_outlier(rate: float, step: float) -> None:
    """One row in hundreds has one step more than its neighbours: many times the noise, and nothing at all."""
    found: tuple[RejectedRows, ...] = without_outliers((turned(rate, step),), "gyro", 8)[1]
    assert found == ()


def test_an_outlier_of_a_rounded_recording_is_one_still() -> None:
    recording = turned(10.00003, 1e-4)
    values = recording.channels["gyro"].values.copy()
    values[12_000] += np.deg2rad(0.05)
    spiked = Recording(recording.t, {**recording.channels, "gyro": Channel(values, "rad/s", "interval")})
    assert [(r.start, r.stop) for r in without_outliers((spiked,), "gyro", 8)[1]] == [(12_000, 12_001)]


@pytest.mark.parametrize("step", [1e-6, 0.25, 3.0])
def test_the_step_is_found(step: float) -> None:
    walk = np.cumsum(20 * np.random.default_rng(0).standard_normal(5000))
    values = np.asarray(np.round(walk) * step, dtype=np.float64)
    assert rounding(values) == pytest.approx(step, rel=1e-6)


def test_what_is_not_rounded_has_the_step_of_its_numbers() -> None:
    assert rounding(np.random.default_rng(0).standard_normal(5000)) < 1e-12
    assert rounding(np.full(100, 3.0)) < 1e-12


@pytest.mark.parametrize("bits", [8, 12, 14])
@pytest.mark.parametrize("decimals", [4, 9])
def test_the_step_of_an_encoder_is_found_behind_the_digits_of_a_file(bits: int, decimals: int) -> None:
    t = 0.005 * np.arange(20000)
    step = 360.0 / 2**bits
    for angle in (40.0 * (1 - np.cos(1.3 * t)), 17.0 * t, 0.05 * t):
        printed = np.round(np.floor(angle / step) * step, decimals)
        assert counted(printed) == pytest.approx(step, rel=1e-3)


def test_noise_and_a_walk_of_few_digits_are_no_counter() -> None:
    noise = np.random.default_rng(1).standard_normal(20000)
    walk: Floats = np.asarray(np.cumsum(noise), np.float64)
    for values in (np.round(noise, 3), np.round(walk, 4), noise):
        assert counted(values) == pytest.approx(rounding(values))


@pytest.mark.parametrize("counts", [65.19, 12.07])
def test_the_motion_of_a_row_at_one_rate_is_no_step(counts: float) -> None:
    """An encoder without noise on a table that rests, and then turns at exactly one rate: 65 and 66 counts a row."""
    step = 2 * np.pi / 2**13
    rate = np.where(np.arange(3000) < 200, 0.0, counts * step)
    read = step * np.floor(np.cumsum(rate) / step)
    assert counted(read) == pytest.approx(step, rel=1e-6)
    assert counter_step(read) == pytest.approx(step, rel=1e-6)


def test_the_step_of_an_encoder_is_found_behind_digits_of_small_and_large_numbers() -> None:
    """Eight digits of radians up to 50, a swing of up to 137 counts of 16 bits a row."""
    step = 2 * np.pi / 2**16
    t = 0.005 * np.arange(8000)
    read = step * np.floor((22.0 + 29.0 * np.sin(0.09 * t)) / step)
    printed = np.array([float(f"{x:.8g}") for x in read])
    assert counted(printed) == pytest.approx(step, rel=1e-6)
