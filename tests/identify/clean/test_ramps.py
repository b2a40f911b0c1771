"""A table that takes its time to the commanded rate, which is all that was logged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import DEG_PER_HOUR, closed, manifest

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.clean.ramps import approaching, bending, jumping, slewed

N, DT = 12_000, 0.05
T = DT * np.arange(1.0, N + 1)
#: A dwell of 30 s at each of these [deg/s].
LEVELS = np.repeat(np.resize([5.0, -5.0, 20.0, -20.0, 40.0, -40.0, 10.0, -10.0, 0.0, 30.0], 20), 600)


def ramped(levels: Floats, acceleration: float, first: float | None = None) -> Floats:
    """Mean rates over the rows of a table that follows at ``acceleration`` [deg/s^2], from the rate ``first`` on."""
    rate, now = np.empty(len(levels)), levels[0] if first is None else first
    for i, wanted in enumerate(levels):
        before = now
        now += max(-acceleration * DT, min(wanted - now, acceleration * DT))
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


@pytest.mark.parametrize("noise", [3600.0, 7200.0])
def test_a_jump_that_single_rows_hide_takes_the_time_of_the_others(noise: float) -> None:
    rate = ramped(LEVELS, 20.0)
    kept = np.ones(N, bool)
    for one in approaching(recording(rate, 5, noise), "gyro", 0):
        kept[one.start : one.stop] = False
    off = np.abs(rate - LEVELS)
    # A mean over nine rows tells the end of an approach to five of its deviations, within which the way may go on.
    assert np.max(off[kept]) < 5 * noise / 3600 / 3 * 1.5 and np.sum(kept & (off > 0.0)) < 0.1 * np.sum(off > 0.0)


def test_a_table_that_stood_before_the_first_row_is_on_its_way_too() -> None:
    rate = ramped(LEVELS, 2.0, first=0.0)
    found = approaching(recording(rate, 6), "gyro", 0)
    assert found[0].start == 0 and 50 <= found[0].stop <= 120  # 2.5 s of 0.05 s, and half of it for what hides
    steady = approaching(recording(ramped(LEVELS, 2.0), 6), "gyro", 0)
    assert steady[0].start == 599  # the slope of the row before has a part of the jump


def test_short_ways_beside_long_ones_are_seen() -> None:
    # The median jump is over within two rows here, the larger ones are not.
    rate = ramped(LEVELS, 150.0)
    found = approaching(recording(rate, 7), "gyro", 0)
    kept = np.ones(N, bool)
    for one in found:
        kept[one.start : one.stop] = False
    assert not np.any(kept & (np.abs(rate - LEVELS) * 3600 > 5.0))


def test_a_ramp_is_no_effect() -> None:
    # False-alarm probability 1 %, as everywhere; the seed is fixed.
    found = closed(recording(ramped(LEVELS, 20.0), 2))
    assert found.targets[0].added == () and sum(r.stop - r.start for r in found.rows_rejected) > 100


def test_a_reading_that_is_late_stays() -> None:
    for late in (1, 5):
        assert approaching(recording(np.roll(LEVELS, late), 3), "gyro", 0) == ()


def test_a_table_that_keeps_up_loses_nothing() -> None:
    assert approaching(recording(LEVELS, 4), "gyro", 0) == ()


@pytest.mark.parametrize("acceleration", [10.0, 40.0])
def test_the_table_is_where_its_ways_have_brought_it(acceleration: float) -> None:
    """Its angle in the dwells, less what the integral of the command is off by: that is 18 deg, or 4, a cycle."""
    rate = ramped(LEVELS, acceleration)
    run = recording(rate, 8)
    table = np.cumsum(slewed(run, "gyro").channels["table_rate"].values) * DT
    kept = np.ones(N, bool)
    for one in approaching(run, "gyro", 0):
        kept[one.start : one.stop] = False
    wrong = np.rad2deg(table) - np.cumsum(rate) * DT
    assert np.ptp((np.cumsum(LEVELS - rate) * DT)[kept]) > 30 / acceleration * 10
    assert np.ptp(wrong[kept]) < 0.2


def test_without_jumps_a_command_stays_as_it_is() -> None:
    slow = recording(ramped(LEVELS, 150.0), 9)
    still = replace(slow, channels={**slow.channels, "table_rate": Channel(np.full(N, 0.3), "rad/s")})
    assert slewed(still, "gyro") is still


def beside_angle(late: int, seed: int = 8) -> Recording:
    """A gyro read at instants on a table whose rate jumps, beside the running sum of that rate; so many rows late."""
    rate = np.deg2rad(LEVELS)
    y = np.roll(rate, late) + 20 * DEG_PER_HOUR * np.random.default_rng(seed).standard_normal(N)
    return Recording(T, {"gyro": Channel(y, "rad/s"), "table_angle": Channel(np.cumsum(rate) * DT, "rad")})


def test_a_rate_that_jumps_within_a_row_is_no_delay_and_no_hold() -> None:
    jumps = np.flatnonzero(np.diff(LEVELS)) + 1
    assert [(one.start, one.stop) for one in jumping(beside_angle(0), "gyro", 0)] == [
        (k - 1, k) for k in jumps.tolist()
    ]
    assert closed(beside_angle(0)).targets[0].verdict == "nothing-significant"


def test_a_reading_that_is_late_by_rows_keeps_them() -> None:
    assert jumping(beside_angle(3), "gyro", 0) == ()


@pytest.mark.parametrize("gain", [1.0, -0.87])
@pytest.mark.parametrize("acceleration", [2.0, 3.0])
def test_a_table_on_its_way_for_most_of_its_dwells_tells_its_gain(acceleration: float, gain: float) -> None:
    """It is at its rate from 27 s on of dwells of 30 s, or never after the largest jumps: what is left is clean."""
    declared = manifest(declared=("bias", "scale_factor"))
    found = closed(recording(gain * ramped(LEVELS, acceleration), 10), declared)
    (own,) = found.targets
    (scale,) = [e for e in own.estimates_after if e.effect == "scale_factor"]
    assert abs(1 + scale.value - gain) < 3 * scale.sd < 1e-4  # false-alarm probability 0.3 %, the seed is fixed
    assert (own.verdict, own.added) == ("nothing-significant", ())


@pytest.mark.parametrize("acceleration", [1.5, 2.7, 3.5, 5.0])
def test_no_row_of_a_way_is_kept_however_long_it_is(acceleration: float) -> None:
    rate = ramped(LEVELS, acceleration)
    kept = np.ones(N, bool)
    for one in approaching(recording(rate, 11), "gyro", 0):
        kept[one.start : one.stop] = False
    there = np.abs(rate - LEVELS) * 3600 < 5.0
    assert not np.any(kept & ~there) and np.sum(kept) > 0.75 * np.sum(there)


def test_a_swing_between_two_rates_is_one_of_jumps_however_it_was_logged() -> None:
    """A jump every 60 rows, read at instants: its mean over a row changes twice."""
    levels = np.repeat(np.resize([10.0, -10.0], N // 60 + 1), 60)[:N]
    rate = ramped(levels, 20.0)
    run = recording(rate, 12)
    told = replace(run.channels["table_rate"], values=np.deg2rad(levels), covers="instant")
    run = replace(run, channels={**run.channels, "table_rate": told})
    assert sum(one.stop - one.start for one in approaching(run, "gyro", 0)) > 0.3 * N


@pytest.mark.parametrize("start", [0.0, 5.0])
def test_of_a_first_row_that_began_before_the_rate_was_read_nothing_is_known(start: float) -> None:
    """Means of a gyro beside a rate that was read at the ends of rows, on a ramp from the first one on."""
    levels = np.repeat([start, 20.0, -20.0, 10.0], N // 4)
    fine = ramped(np.repeat(levels, 10), 1.0, first=0.0)  # of a tenth of a row each
    y = np.deg2rad(fine.reshape(N, 10).mean(axis=1)) + 1e-6 * np.random.default_rng(13).standard_normal(N)
    told = Channel(np.deg2rad(fine[9::10]), "rad/s", "instant", source="command")
    found = bending(Recording(T, {"gyro": Channel(y, "rad/s", "interval"), "table_rate": told}), "gyro", 0)
    assert any((one.start, one.stop) == (0, 1) for one in found) == bool(start)


def swinging(levels: Floats, natural: float = 0.5, damping: float = 0.6) -> Floats:
    """Rates of a servo of second order that passes what it is told, in exact steps of a hundredth of a row."""
    rate, slope, out, dt = 0.0, 0.0, np.empty(len(levels)), DT / 100
    w = 2 * np.pi * natural
    for i, wanted in enumerate(levels):
        total = 0.0
        for _ in range(100):
            slope += dt * (w * w * (wanted - rate) - 2 * damping * w * slope)
            rate += dt * slope
            total += rate
        out[i] = total / 100
    return out


def test_a_servo_that_swings_is_there_when_it_stays() -> None:
    """Where it passed the rate it was taken to be there, with a seventh of a jump to come."""
    rate = swinging(LEVELS)
    kept = np.ones(N, bool)
    for one in approaching(recording(rate, 3, 5.0), "gyro", 0):
        kept[one.start : one.stop] = False
    off = np.abs(rate - LEVELS) * 3600
    assert np.max(off[kept]) < 10.0
    assert np.sum(~kept) < 0.35 * N
