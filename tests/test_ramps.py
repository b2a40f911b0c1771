"""A table that takes its time to the commanded rate, which is all that was logged."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import DEG_PER_HOUR, closed

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.ramps import approaching

N, DT = 12_000, 0.05
T = DT * np.arange(1.0, N + 1)
#: A dwell of 30 s at each of these [deg/s].
LEVELS = np.repeat(np.resize([5.0, -5.0, 20.0, -20.0, 40.0, -40.0, 10.0, -10.0, 0.0, 30.0], 20), 600)


def ramped(levels: Floats, acceleration: float) -> Floats:
    """Mean rates over the rows of a table that follows at ``acceleration`` [deg/s^2]."""
    rate, now = np.empty(len(levels)), levels[0]
    for i, wanted in enumerate(levels):
        before = now
        now += np.clip(wanted - now, -acceleration * DT, acceleration * DT)
        rate[i] = 0.5 * (before + now)
    return rate


def recording(rate: Floats, seed: int, noise: float = 20.0) -> Recording:
    """A perfect gyro on the table beside the command; ``noise`` of a row [deg/h]."""
    y = np.deg2rad(rate) + noise * DEG_PER_HOUR * np.random.default_rng(seed).standard_normal(N)
    channels = {"gyro": Channel(y, "rad/s", "interval"), "table_rate": Channel(np.deg2rad(LEVELS), "rad/s", "interval")}
    return Recording(T, channels)


@pytest.mark.parametrize("acceleration", [10.0, 40.0])
def test_rows_of_a_ramp_are_left_out(acceleration: float) -> None:
    rate = ramped(LEVELS, acceleration)
    run = recording(rate, 1)
    kept = np.ones(N, bool)
    for one in approaching(run, "gyro", 0):
        kept[one.start : one.stop] = False
    off = np.abs(rate - LEVELS) * 3600 > 5.0  # a quarter of a row's noise
    assert not np.any(kept & off)
    assert np.sum(~kept) < 2 * np.sum(off) + 20 * 8


def test_a_ramp_is_no_effect() -> None:
    # False-alarm probability 1 %, as everywhere; the seed is fixed.
    found = closed(recording(ramped(LEVELS, 20.0), 2))
    assert found.targets[0].added == () and sum(r.stop - r.start for r in found.rows_rejected) > 100


def test_a_reading_that_is_late_stays() -> None:
    for late in (1, 5):
        assert approaching(recording(np.roll(LEVELS, late), 3), "gyro", 0) == ()


def test_a_table_that_keeps_up_loses_nothing() -> None:
    assert approaching(recording(LEVELS, 4), "gyro", 0) == ()
