"""Rails: found where a channel clips and nowhere else, named, their rows left out, what is lost said."""

from __future__ import annotations

import numpy as np
import pytest
from recorded.mems_bench import bench, clipped
from simulated_runs import KINDS, closed, gyro_run

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.clean.rails import find_rails
from insenv.report.json import to_json
from insenv.report.text import summary

SEEDS = range(4)


def shaken(values: Floats) -> Recording:
    t = np.linspace(0.0, 0.01 * (len(values) - 1), len(values))
    return Recording(t, {"accel_x": Channel(values, "m/s^2")})


def swing(amplitude: float, frequency: float, noise: float, seed: int = 0, n: int = 30_000) -> Floats:
    t = 0.01 * np.arange(n)
    return amplitude * np.sin(2 * np.pi * frequency * t) + noise * np.random.default_rng(seed).standard_normal(n)


@pytest.mark.parametrize("frequency", [0.05, 1.0, 7.1])
@pytest.mark.parametrize("step", [0.0, 0.01])
@pytest.mark.parametrize("ends", ["both", "high"])
def test_a_channel_that_clips_has_rails(frequency: float, step: float, ends: str) -> None:
    values = np.clip(swing(12.0, frequency, 0.05), -10.0 if ends == "both" else -np.inf, 10.0)
    values = np.round(values / step) * step if step else values
    found = {rail.high: rail.value for rail in find_rails((shaken(values),), "accel_x")}
    assert found == pytest.approx({True: 10.0, False: -10.0} if ends == "both" else {True: 10.0})


@pytest.mark.parametrize("frequency", [0.05, 1.0, 7.1])
@pytest.mark.parametrize("step", [0.0, 0.01, 0.2])
def test_one_that_does_not_has_none(frequency: float, step: float) -> None:
    values = swing(9.9, frequency, 0.1)
    values = np.round(values / step) * step if step else values
    assert find_rails((shaken(values),), "accel_x") == ()


@pytest.mark.parametrize("noise", [0.0, 0.1, 1.0])
def test_a_coarse_reading_at_its_highest_rest_is_no_rail(noise: float) -> None:
    """A triad that is turned by hand and lies still: thousands of equal values are gravity, not a rail."""
    t = np.arange(30_000)
    attitude = np.interp(t, [0, 8000, 8400, 16000, 16400, 30_000], [-1.0, -1.0, 0.2, 0.2, 1.0, 1.0])
    smooth = np.sin(0.5 * np.pi * attitude) * 9.81 + noise * 0.02 * np.random.default_rng(1).standard_normal(len(t))
    assert find_rails((shaken(np.round(smooth / 0.02) * 0.02),), "accel_x") == ()


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("step", [0.0, 1e-2])
def test_a_sound_run_has_none(kind: str, seed: int, step: float) -> None:
    recording = gyro_run(kind, seed, duration=600.0).recording
    if step:
        coarse = np.round(recording.channels["gyro"].values / step) * step
        recording = Recording(recording.t, {**recording.channels, "gyro": Channel(coarse, "rad/s", "interval")})
    assert find_rails((recording,), "gyro") == ()


def beside_a_late_encoder(u: Floats, top: float, step: float, seed: int) -> Recording:
    """A gyro of u that clips at ``top``, rounded to ``step``, beside a rate that is late by 60 ms and noisy."""
    t: Floats = 0.02 * np.arange(1.0, len(u) + 1)
    rng = np.random.default_rng(seed)
    rate = np.interp(t - 0.06, t, u) + 0.1 * rng.standard_normal(len(u))
    gyro = np.clip(u + 0.01 * rng.standard_normal(len(u)), -top, top)
    gyro = np.round(gyro / step) * step if step else gyro
    return Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(rate, "rad/s")})


@pytest.mark.parametrize("step", [0.0, 0.005])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_gyro_that_clips_beside_a_late_and_noisy_reference_has_rails(step: float, seed: int) -> None:
    """What is asked beyond the rail is less than three deviations of the reference; yet the table moves on."""
    t = 0.02 * np.arange(3000)
    u = 1.1 * np.sin(2 * np.pi * 0.41 * t + seed) + 0.5 * np.sin(2 * np.pi * 0.67 * t)
    found = {rail.high for rail in find_rails((beside_a_late_encoder(u, 1.2, step, seed),), "gyro")}
    assert found == {True, False}


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("top", [1.2, 2.5])
def test_a_number_that_overflows_is_at_the_wrong_end(seed: int, top: float) -> None:
    """Beyond its largest value the gyro reads its smallest; where it never comes so far, nothing is said."""
    t = 0.02 * np.arange(3000)
    u = 1.1 * np.sin(2 * np.pi * 0.41 * t + seed) + 0.5 * np.sin(2 * np.pi * 0.67 * t)
    run = beside_a_late_encoder(u, 2.0, 0.005, seed)
    gyro = np.asarray(run.channels["gyro"].values)
    low = -top - 0.005
    over = Channel(np.where(gyro > top, low, np.maximum(gyro, low)), "rad/s")
    run = Recording(run.t, {**run.channels, "gyro": over})
    found = [(rail.high, rail.over, round(rail.value, 6)) for rail in find_rails((run,), "gyro")]
    assert found == ([(False, True, -1.205)] if top < 1.6 else [])


@pytest.mark.parametrize("seed", SEEDS)
def test_pulses_of_a_gyro_that_starts_from_rest_do_not_overflow(seed: int) -> None:
    """Hundreds of rows without a pulse are the smallest reading of a table that turns one way only."""
    rng, n = np.random.default_rng(seed), 6000
    rate = np.where(np.arange(n) < 300, 0.0, 0.8) + 0.2 * (np.arange(n) > 4000)
    angle = np.cumsum(0.01 * rate) + 3e-5 * rng.standard_normal(n)
    gyro = Channel(np.diff(np.floor(angle / 2.4e-6), prepend=0.0) * 2.4e-6 / 0.01, "rad/s")
    late = Channel(np.concatenate([np.zeros(3), rate[:-3]]), "rad/s")
    gyro = Channel(np.where(rate == 0, 0.0, gyro.values), "rad/s")
    run = Recording(0.01 * np.arange(float(n)), {"gyro": gyro, "table_rate": late})
    assert find_rails((run,), "gyro") == ()


@pytest.mark.parametrize("seed", SEEDS)
def test_a_reading_that_is_repeated_for_once_in_fast_motion_is_no_rail(seed: int) -> None:
    """A logger lost eleven rows. Of 3000 rows of a gyro no two have the same value by chance but in one of 10^9."""
    t = 0.02 * np.arange(3000)
    u = 1.1 * np.sin(2 * np.pi * 0.41 * t + seed) + 0.5 * np.sin(2 * np.pi * 0.67 * t)
    one = beside_a_late_encoder(u, 9.0, 0.0, seed)
    values = one.channels["gyro"].values.copy()
    top = int(values[:-20].argmax())
    values[top : top + 11] = values.max()
    again = Recording(one.t, {**one.channels, "gyro": Channel(values, "rad/s")})
    assert find_rails((again,), "gyro") == ()


def of_a_robot(top: float, seed: int) -> Recording:
    """A minute of a robot's gyro, rounded as 16.4 counts per deg/s are, beside its wheels: few turns are fast."""
    rng, t = np.random.default_rng(seed), 0.1 * np.arange(1.0, 701.0)
    rate = np.interp(t, np.arange(0.0, 71.0, 1.0), 0.05 * rng.standard_normal(71))
    counts = np.round(np.degrees(rate + 1e-3 * rng.standard_normal(len(t))) * 16.4) / 16.4
    gyro = np.radians(np.round(np.clip(counts, -top, top), 4))
    return Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(rate, "rad/s")})


@pytest.mark.parametrize("seed", range(8))
def test_a_rail_of_few_rows_that_the_wheels_ask_for_more_at_is_one(seed: int) -> None:
    """The 4 % of rows that are fastest. Unclipped there is none: no value of noise is read eight times (1e-9)."""
    free = np.degrees(of_a_robot(np.inf, seed).channels["gyro"].values)
    top = float(np.round(np.quantile(np.abs(free), 0.96), 4))
    found = {rail.high: np.degrees(rail.value) for rail in find_rails((of_a_robot(top, seed),), "gyro")}
    assert set(found) == {True, False}
    assert np.abs(list(found.values())) == pytest.approx(top)
    assert find_rails((of_a_robot(np.inf, seed),), "gyro") == ()


@pytest.mark.parametrize("step", [0.0, 0.02, 0.1])
@pytest.mark.parametrize("seed", SEEDS)
def test_the_highest_dwell_of_a_coarse_reading_beside_such_a_reference_is_none(step: float, seed: int) -> None:
    """A table that runs up, turns on steadily, and back: the reading stands, and so does the table."""
    rng = np.random.default_rng(seed + 10)
    corners = np.cumsum(rng.uniform(0.5, 4.0, 40))
    t = 0.02 * np.arange(int(corners[-1] / 0.02))
    u = np.interp(t, corners, np.tile([0.0, 1.2, 1.2, 0.0, -1.2, -1.2, 0.0, 0.7], 5))
    assert find_rails((beside_a_late_encoder(u, 9.0, step, seed),), "gyro") == ()


def test_a_bench_at_rest_has_none() -> None:
    assert all(find_rails((bench(duration=200.0),), name) == () for name in ("accel_x", "accel_z", "gyro_x"))


@pytest.mark.parametrize(("seed", "limit"), [(1, 33.0), (2, 33.0)])
def test_a_gyro_that_clips_on_a_table_is_told_so(seed: int, limit: float) -> None:
    """The outermost dwells lie beyond the rail: they are lost, and the scale factor of the others is right."""
    run = gyro_run("staircase", seed, duration=1200.0)
    most = np.deg2rad(limit)
    found = closed(clipped(run.recording, "gyro", -most, most))
    target = found.targets[0]
    assert (found.verdict, [a.effect for a in target.added]) == ("effects-found", ["saturation"])
    assert {p.parameter: p.value for p in target.added[0].parameters} == pytest.approx({"high": most, "low": -most})
    assert target.added[0].held_out_after < 0.01 * target.added[0].held_out_before
    scale = next(e for e in target.estimates_after if e.effect == "scale_factor")
    # Within five standard deviations: 2 cases, false alarm 1e-6.
    assert abs(scale.value - run.own["scale_factor"]) < 5 * scale.sd
    text = summary(found)
    assert (
        text.splitlines()[0] == f"The declared model of gyro lacked saturation at -{limit:.2f} and {limit:.2f} deg/s."
    )
    assert "nothing is known of" in text
    causes = {row["cause"] for row in to_json(found)["rows_rejected"]}
    assert causes == {"saturation"}


def test_a_dwell_that_is_lost_is_a_finding() -> None:
    """The readings stand still at one rate: their rows are left out, and the verdict is not that all is well."""
    run = gyro_run("staircase", 4, duration=1200.0)
    rate, gyro = run.recording.channels["table_rate"].values, run.recording.channels["gyro"]
    fastest = np.flatnonzero(rate > 0.98 * rate.max())
    values = gyro.values.copy()
    for piece in np.split(fastest, np.flatnonzero(np.diff(fastest) > 1) + 1):
        for part in np.array_split(piece[5:-5], 20):
            values[part] = values[part[0]]
    recording = Recording(run.recording.t, {**run.recording.channels, "gyro": Channel(values, "rad/s", "interval")})
    found = closed(recording)
    lost = any(row.cause == "stuck" for row in found.rows_rejected)
    assert not lost or found.verdict != "nothing-significant"


def test_rows_that_count_nothing_are_at_no_end_of_a_range() -> None:
    """A ring laser that turns one way, read more often than it counts: it was taken to overflow at 0."""
    rng = np.random.default_rng(2)
    read = rng.random(20_000) > 0.16
    counts = np.where(read, np.floor(135 + 3.0 * rng.standard_normal(20_000)), 0.0) * 3.9e-3
    told = 135 * 3.9e-3 + 0.3 * rng.standard_normal(20_000)
    channels = {"gyro": Channel(counts, "rad/s"), "table_rate": Channel(told, "rad/s", source="encoder")}
    assert find_rails((Recording(0.0025 * np.arange(20_000.0), channels),), "gyro") == ()


def test_a_rail_beside_a_noisy_reference_is_told_by_all_its_rows() -> None:
    """No single row of a heading tells that more was asked for than was read."""
    rng = np.random.default_rng(3)
    t = 0.03 * np.arange(700.0)
    there = (np.abs(t - 6) < 0.7) | (np.abs(t - 15) < 0.3)
    rate = np.where(there, -2.2, 1.2 * np.sin(2 * np.pi * t / 9.0))
    gyro = np.maximum(rate + 0.01 * rng.standard_normal(700), -2.05)
    told = rate + 0.08 * rng.standard_normal(700)
    channels = {
        "gyro": Channel(gyro, "rad/s", "interval"),
        "table_rate": Channel(told, "rad/s", "interval", source="encoder"),
    }
    (rail,) = find_rails((Recording(t, channels),), "gyro")
    assert not rail.high and rail.value == -2.05
