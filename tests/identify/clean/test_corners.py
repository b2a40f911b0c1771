"""Readings at instants beside an angle: corners of the motion and gaps, where the angle leaves the rate open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import DEG_PER_HOUR, closed, manifest

from insenv.core.recording import Channel, Floats, Recording
from insenv.data.reference import with_reference
from insenv.identify.clean.corners import cornering

N, DT, FINE = 9_000, 0.02, 20
#: Deviation of a reading: a corner of 40 deg/s^2 leaves up to 0.13 deg/s of the rate open, a hundred times as much.
NOISE = 5 * DEG_PER_HOUR
#: Rates [deg/s] from dwell to dwell. Seeds are fixed; each test says how often another would fail.
LEVELS = (0.0, 5.0, -5.0, 20.0, -20.0, 0.0, 40.0, -40.0, 10.0, -10.0, 30.0, 0.0)


def staircase(acceleration: float = 40.0) -> tuple[Floats, Floats]:
    """Angle [rad] and rate [rad/s] at the rows of a table that goes from rate to rate, at times between the rows."""
    dwell = N * DT / len(LEVELS)
    t, rate = [0.0], [0.0]
    for k, (before, level) in enumerate(zip(LEVELS[:-1], LEVELS[1:], strict=True), 1):
        start = dwell * k + 0.0037 * k
        t += [start, start + abs(level - before) / acceleration]
        rate += [before, level]
    fine = DT / FINE * np.arange(N * FINE)
    of_fine = np.deg2rad(np.interp(fine, t, rate))
    angle = np.cumsum(np.append(0.0, 0.5 * (of_fine[1:] + of_fine[:-1]))) * DT / FINE
    return angle[::FINE], of_fine[::FINE]


def swing(rows: float) -> tuple[Floats, Floats]:
    """The same of a table that swings once in so many rows."""
    w = 2 * np.pi / (rows * DT)
    t = DT * np.arange(N)
    return -0.5 / w * np.cos(w * t), 0.5 * np.sin(w * t)


def recording(motion: tuple[Floats, Floats], seed: int, noise: float = NOISE, of_angle: float = 0.0) -> Recording:
    """A perfect gyro that is read at instants on a table whose angle is read at the same times."""
    (angle, rate), rng = motion, np.random.default_rng(seed)
    y = rate + noise * rng.standard_normal(len(rate))
    read = angle + of_angle * rng.standard_normal(len(rate))
    channels = {"gyro": Channel(y, "rad/s"), "table_angle": Channel(read, "rad")}
    return with_reference(Recording(DT * np.arange(float(len(rate))), channels))


def rows_of(run: Recording) -> Floats:
    """Rows that are left out."""
    return np.array([k for one in cornering(run, "gyro", 0, ()) for k in range(one.start, one.stop)], float)


def test_what_an_angle_does_not_tell_of_a_corner_is_no_error_of_the_gyro() -> None:
    """11 ways of two corners: three to ten rows of each. False-alarm probability of the verdict 5 %."""
    run = recording(staircase(), 1)
    ways = np.flatnonzero(np.abs(np.diff(run.channels["table_angle"].values, 3)) > 1e-7) + 1
    out = rows_of(run)
    assert 22 * 3 <= len(out) <= 22 * 10
    assert np.abs(out[:, None] - ways).min(axis=1).max() <= 5
    found = closed(run)
    assert found.targets[0].verdict == "nothing-significant"
    (scale,) = [e for e in found.targets[0].estimates_after if e.effect == "scale_factor"]
    assert abs(scale.value) < 4 * scale.sd < 1e-4  # 6 in 10^5
    (said,) = [text for text in found.remarks if "left out" in text]
    assert said.count("its angle does not tell when") == 1


@pytest.mark.parametrize("rows", [25.0, 60.0, 400.0])
def test_of_a_swing_nothing_is_left_out_but_where_it_begins_and_ends(rows: float) -> None:
    out = rows_of(recording(swing(rows), 2))
    assert set(out) <= {0, 1, 2, N - 3, N - 2, N - 1}  # one noisy seed in 10^3 would have another


@pytest.mark.parametrize(
    ("noise", "of_angle"), [(4000 * DEG_PER_HOUR, 0.0), (NOISE, 2e-4), (4000 * DEG_PER_HOUR, 2e-5)]
)
def test_what_is_hidden_in_noise_costs_no_row(noise: float, of_angle: float) -> None:
    """Of the gyro, or of the encoder: one row in 10^7 is as sharp by chance."""
    assert not len(rows_of(recording(staircase(), 3, noise, of_angle)))


def test_means_and_a_rate_that_was_read_have_no_corners() -> None:
    run = recording(staircase(), 4)
    gyro, rate = run.channels["gyro"], Channel(staircase()[1], "rad/s", source="encoder")
    means = replace(run, channels={**run.channels, "gyro": replace(gyro, covers="interval")})
    assert cornering(means, "gyro", 0, ()) == ()
    assert cornering(replace(run, channels={"gyro": gyro, "table_rate": rate}), "gyro", 0, ()) == ()


@pytest.mark.parametrize("slow", [2.0, 5.0])
def test_a_reading_that_comes_slowly_to_a_rate_keeps_its_rows(slow: float) -> None:
    """Behind a filter of so many rows, which the corners alone tell from a delay."""
    angle, rate = staircase()
    filtered = np.empty(N)
    now = 0.0
    for i, value in enumerate(rate):
        now += (value - now) * (1 - np.exp(-1 / slow))
        filtered[i] = now
    run = recording((angle, filtered), 5)
    assert not len(rows_of(run))
    effects = {e.effect for e in closed(run).targets[0].added}
    assert effects & {"output_bandwidth", "timing_skew"}


def test_a_backlash_is_no_corner() -> None:
    """The encoder leaps where the table turns round, in the midst of a way: nothing bends there but the reference.

    By 28 deviations of a row in three of them.
    """
    angle, rate = staircase(15.0)
    side = np.sign(rate)
    for k in np.flatnonzero(side == 0):
        side[k] = side[k - 1] if k else 0.0
    leaps = np.flatnonzero(np.diff(side) == -2) + 1
    run = recording((angle - 1e-5 * side, rate), 6, 8 * NOISE)
    out = rows_of(run)
    assert len(out) and np.abs(out[:, None] - leaps).min() > 3
    assert {e.effect for e in closed(run).targets[0].added} == {"encoder_backlash"}


def test_beside_a_gap_the_rate_is_known_where_it_does_not_change() -> None:
    """Ways are cut out, and as much of two dwells: the rows beside a way go, the others stay. False alarms 5 %."""
    angle, rate = staircase()
    whole = recording((angle, rate), 7)
    moving = np.convolve(np.abs(np.diff(rate, prepend=0.0)) > 1e-9, np.ones(41), "same") > 0
    still = np.zeros(N, bool)
    still[1200:1260] = still[2000:2030] = True
    kept = ~(moving | still)
    channels = {name: replace(c, values=c.values[kept]) for name, c in whole.channels.items()}
    run = with_reference(Recording(whole.t[kept], channels, period=DT))
    own = np.flatnonzero(kept)[rows_of(run).astype(int)]
    beside = np.flatnonzero(np.convolve(moving, np.ones(7), "same") > 0)
    assert len(own) == 6 * 11 and set(own) <= set(beside)
    found = closed(run, manifest(declared=("bias", "scale_factor")))
    assert found.targets[0].verdict == "nothing-significant"
