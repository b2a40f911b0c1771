"""Leaps of a table's reading that no gyro turns along with: found wherever they stand, and nothing else is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from insenv.core.recording import Channel, Floats, Recording
from insenv.data.leaps import without_leaps

ROW = 0.01
T: Floats = ROW * np.arange(3000, dtype=np.float64)


def bench(seed: int, kind: str = "hand", gain: float = -0.87) -> Recording:
    """A gyro on a table whose angle was read, with the noise of both."""
    rng = np.random.default_rng(seed)
    rate = {
        "hand": 1.5 * np.sin(2 * np.pi * 0.3 * T) * np.sin(2 * np.pi * 0.05 * T),
        "steady": np.where(T > 3.0, 0.7, 0.0),
        "steps": rng.uniform(-2, 2, 30)[(T / 1.0).astype(int)],
        "still": np.zeros(len(T)),
    }[kind]
    angle = np.cumsum(rate) * ROW + 1e-4 * rng.standard_normal(len(T))
    gyro = gain * rate + 0.02 + 0.005 * rng.standard_normal(len(T))
    return Recording(T, {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(angle, "rad")})


def moved(recording: Recording, rows: slice, by: float) -> Recording:
    channel = recording.channels["table_angle"]
    values = channel.values.copy()
    values[rows] += by
    return replace(recording, channels={**recording.channels, "table_angle": replace(channel, values=values)})


@pytest.mark.parametrize("kind", ["hand", "steady", "steps"])
@pytest.mark.parametrize("rows", [slice(0, 1), slice(1200, 1201), slice(1500, None), slice(2999, None)])
def test_a_leap_is_taken_out_and_said(kind: str, rows: slice) -> None:
    true = bench(1, kind)
    found = without_leaps(moved(true, rows, -50.9))
    steps, own = np.diff(found.values("table_angle", "rad")), np.diff(true.values("table_angle", "rad"))
    np.testing.assert_allclose(steps, own, atol=0.03)
    assert "no gyro turns along" in found.notes[-1]


@pytest.mark.parametrize("rows", [1, 2, 3])
def test_a_reading_that_failed_and_came_late_leaves_no_lasting_leap(rows: int) -> None:
    """Of the way there and back one is over a gap, as any motion may be: the angle was off by a radian ever after."""
    true = bench(4)
    wrong = moved(true, slice(1200, 1200 + rows), -3.1)
    late = replace(wrong, t=wrong.t + 0.05 * (np.arange(len(T)) >= 1200))
    found = without_leaps(late)
    np.testing.assert_allclose(found.values("table_angle", "rad"), true.values("table_angle", "rad"), atol=0.05)
    assert "in 2 rows" in found.notes[-1]
    # A step over a gap that nothing takes back stands: nobody saw what happened.
    stays = replace(moved(true, slice(1200, None), -3.1), t=late.t)
    assert not without_leaps(stays).notes


@pytest.mark.parametrize("kind", ["hand", "steady", "steps", "still"])
def test_a_sound_bench_is_left_alone(kind: str) -> None:
    for seed in range(5):
        assert not without_leaps(bench(seed, kind)).notes


def test_a_turn_within_a_row_that_the_gyro_reads_too_is_motion() -> None:
    still = bench(2, "steady")
    gyro = still.values("gyro", "rad/s").copy()
    gyro[1500] -= 0.87 * 1.5 / ROW
    turned = replace(still, channels={**still.channels, "gyro": Channel(gyro, "rad/s")})
    assert not without_leaps(moved(turned, slice(1500, None), 1.5)).notes


def test_a_table_that_no_instrument_follows_tells_no_leap() -> None:
    assert not without_leaps(moved(bench(3, "hand", gain=0.0), slice(1500, None), 20.0)).notes
