"""What a table's channels are, the motion behind a noisy encoder, and tables as laboratories have them.

Seeds are fixed. A deviation beyond 4 sd is one of 16000; a search at 1 % invents something in one null of a hundred.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recorded.real_tables import Ramped, still
from simulated_runs import closed

from insenv.core.errors import InputError
from insenv.core.recording import Channel, Floats, Recording
from insenv.core.series.trajectory import reading_noise, trajectory
from insenv.data.exposure import expose
from insenv.data.manifest import load_manifest
from insenv.data.reference import found_source, sentences, with_reference
from insenv.identify.findings import TargetFindings

N, DT = 4000, 0.01
T: Floats = DT * np.arange(N, dtype=np.float64)
SWING = 2.0 * np.sin(2 * np.pi * 0.4 * T) + 0.5 * np.sin(2 * np.pi * 1.1 * T)
TURNED = (2.0 * (1 - np.cos(2 * np.pi * 0.4 * T)) / (0.8 * np.pi)) + 0.5 * (1 - np.cos(2.2 * np.pi * T)) / (2.2 * np.pi)


def key(target: TargetFindings) -> list[str]:
    return [a.effect for a in target.added]


@pytest.mark.parametrize("at", ["instant", "interval"])
@pytest.mark.parametrize("acceleration", [50.0, 400.0])
def test_a_command_that_jumps_beside_an_angle_leaves_the_scale_factor_right(at: str, acceleration: float) -> None:
    run = Ramped(acceleration=acceleration, at=at).recording(1)  # type: ignore[arg-type]
    (target,) = closed(run).targets
    (scale,) = [e for e in target.estimates_after if e.effect == "scale_factor"]
    assert key(target) == []
    assert abs(scale.value - 2e-3) < 4 * scale.sd < 1e-5


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_noise_of_an_encoder_is_no_motion(seed: int) -> None:
    (target,) = closed(still(seed)).targets
    assert target.verdict == "nothing-significant"
    untold = {n.effect for n in target.not_testable}
    assert {"encoder_harmonic:1", "encoder_harmonic:4", "angle_locked_rate:1"} <= untold


def test_without_an_angle_nothing_that_repeats_with_it_is_tested() -> None:
    run = still(1)
    (target,) = closed(replace(run, channels={"gyro": run.channels["gyro"]})).targets
    needs = {n.effect: n.needs for n in target.not_testable}
    assert needs["encoder_harmonic:1"] == needs["angle_locked_rate:1"] == ("table_angle",)


@pytest.mark.parametrize("of", ["angle", "rate"])
def test_the_motion_behind_a_noisy_reading_is_found_within_its_deviation(of: str) -> None:
    rng = np.random.default_rng(1)
    true, noise = (TURNED, 3e-4) if of == "angle" else (SWING, 0.02)
    found = trajectory(T, DT, true + noise * rng.standard_normal(N), of)  # type: ignore[arg-type]
    assert found is not None and found.noise == pytest.approx(noise, rel=0.1)
    error = (found.rate_at(T) - SWING)[50:-50]
    assert 0.5 < np.sqrt(np.mean((error / found.rate_sd[50:-50]) ** 2)) < 1.3
    # What bends a slope: noise left in the acceleration, and acceleration that was smoothed away.
    acceleration, seen = np.gradient(SWING, DT), np.gradient(found.rate_at(T), DT)
    assert float(seen @ acceleration) / float(seen @ seen) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("of", ["angle", "rate"])
def test_readings_at_uneven_times_tell_the_motion_as_well(of: str) -> None:
    rng = np.random.default_rng(4)
    at = T + 4e-4 * rng.choice([-1.0, 1.0], N)
    true, noise = (TURNED, 3e-4) if of == "angle" else (SWING, 0.02)
    found = trajectory(at, DT, np.interp(at, T, true) + noise * rng.standard_normal(N), of)  # type: ignore[arg-type]
    assert found is not None and np.array_equal(found.t, at) and found.noise == pytest.approx(noise, rel=0.1)
    error = (found.rate_at(T) - SWING)[50:-50]
    assert 0.5 < np.sqrt(np.mean((error / found.rate_sd[50:-50]) ** 2)) < 1.3


def test_noise_that_goes_with_the_rate_is_known_row_by_row() -> None:
    """Stamps that are 3 ms off: at rest the deviation is that of the reading, in motion tens of times as much."""
    rng = np.random.default_rng(5)
    rate = np.where(T % 20 < 10, SWING, 0.0)
    angle = np.cumsum(rate) * DT
    read = np.interp(T + 3e-3 * rng.standard_normal(N), T, angle) + 1e-4 * rng.standard_normal(N)
    found = trajectory(T, DT, read, "angle")
    assert found is not None
    error, middle = found.rate_at(T) - rate, (T % 10 > 0.5) & (T % 10 < 9.5)
    moving, resting = error[middle & (rate != 0)], error[middle & (T % 20 > 10)]
    # Second differences of the readings would leave 0.3 rad/s of it.
    assert np.sqrt(np.mean(moving**2)) < 0.1
    assert np.sqrt(np.mean(resting**2)) < 0.003


def test_readings_without_noise_need_no_smoothing() -> None:
    assert trajectory(T, DT, TURNED, "angle") is None
    assert trajectory(T, DT, SWING, "rate") is None


def test_a_coarse_encoder_has_the_noise_of_its_step() -> None:
    assert reading_noise(1e-3 * np.round(TURNED / 1e-3)) == pytest.approx(1e-3 / np.sqrt(12), rel=0.2)


def test_a_table_that_stands_is_told_from_one_that_creeps() -> None:
    jitter = 1e-4 * np.random.default_rng(2).standard_normal(N)
    standing, creeping = trajectory(T, DT, jitter, "angle"), trajectory(T, DT, jitter + 1e-4 * T, "angle")
    assert standing is not None and standing.still
    assert creeping is None or not creeping.still


def test_a_command_is_told_from_a_measured_rate() -> None:
    rng = np.random.default_rng(3)
    held = np.repeat(rng.uniform(-1, 1, 8), N // 8)
    assert found_source("table_rate", Channel(held, "rad/s")) == "command"
    assert found_source("table_rate", Channel(SWING, "rad/s")) == "command"
    assert found_source("table_rate", Channel(SWING + 0.01 * rng.standard_normal(N), "rad/s")) == "encoder"
    assert found_source("table_rate", Channel(np.round(SWING, 2), "rad/s")) == "encoder"
    assert found_source("table_angle", Channel(TURNED, "rad")) == "encoder"


def test_what_is_declared_is_kept_and_what_is_found_is_said() -> None:
    run = Ramped().recording(1)
    rate = replace(run.channels["table_rate"], source="encoder")
    told = with_reference(replace(run, channels={**run.channels, "table_rate": rate}))
    assert told.channels["table_rate"].source == "encoder"
    assert [text.split()[0] for text in sentences((run,), ["table_rate"])] == ["table_angle"]
    assert any("what the table was told" in text for text in sentences((run,)))


def test_the_encoder_is_the_reference_and_the_command_the_programme() -> None:
    run = with_reference(Ramped(jitter=1e-9).recording(4))
    seen = expose(run, "gyro")
    true = (seen.y - 1e-4) / 1.002
    moving = np.abs(np.diff(seen.motion.rate, prepend=seen.motion.rate[0])) > 1e-4
    assert moving.sum() > 50
    assert np.abs(seen.u - true)[moving].max() < 3e-4  # the command is off by up to 2 rad/s there
    told = np.deg2rad(Ramped().levels)
    exact = np.abs(seen.u[:, None] - told).min(axis=1) < 1e-12
    assert np.mean(exact[~moving]) > 0.9


def test_a_table_that_is_turned_by_hand_has_no_programme() -> None:
    """Its drive is asked for nothing: where a fast turn was in the run, slow ones passed for standing still."""
    t: Floats = 0.01 * np.arange(3000, dtype=np.float64)
    rate = 0.05 * np.sin(2 * np.pi * 0.4 * t) + 3.0 * np.exp(-(((t - 2) / 0.3) ** 2))
    angle = np.cumsum(rate) * 0.01 + 1e-4 * np.random.default_rng(6).standard_normal(len(t))
    gyro = rate + 5e-3 * np.random.default_rng(7).standard_normal(len(t))
    channels = {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(angle, "rad")}
    channels["table_rate"] = Channel(np.zeros(len(t)), "rad/s")
    seen = expose(with_reference(Recording(t, channels)), "gyro")
    assert np.std((seen.u - rate)[500:]) < 0.01


def test_a_source_on_another_channel_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.toml"
    path.write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "g", unit = "rad/s", source = "encoder" }\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    )
    with pytest.raises(InputError, match=r"gyro.source has no meaning on this channel; it belongs to table_angle"):
        load_manifest(path)


def test_stops_between_moves_stand_still() -> None:
    """What the smoother leaves of an encoder's noise at a stop is no rate: lock-in, c / u, was named of it."""
    t: Floats = np.linspace(0.0, 599.9, 6000)
    rate = np.where((t // 30 % 2 == 1), 0.2, 0.0)
    angle = np.cumsum(rate) * 0.1 + 1e-5 * np.random.default_rng(4).standard_normal(len(t))
    gyro = rate + 1e-5 * np.random.default_rng(5).standard_normal(len(t))
    channels = {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(angle, "rad")}
    exposure = expose(with_reference(Recording(t, channels)), "gyro")
    stopped = (t // 30 % 2 == 0)[1:] & ((t % 30 > 2) & (t % 30 < 28))[1:]
    assert np.mean(exposure.u[: len(stopped)][stopped] == 0) > 0.98
    moving = (t // 30 % 2 == 1)[1:] & ((t % 30 > 2) & (t % 30 < 28))[1:]
    assert np.all(exposure.u[: len(moving)][moving] > 0.19)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_swing_of_a_few_rows_that_a_gyro_reads_is_no_noise_of_the_encoder(seed: int) -> None:
    """An attitude at 5 Hz of a hand that goes to and fro in 0.8 s: differences of its rows are motion.

    The same rows beside a gyro that reads nothing of them are taken for an encoder with noise.
    """
    rng = np.random.default_rng(seed)
    t = 0.2 * np.arange(400.0)
    phase = np.cumsum(2 * np.pi * 0.2 * (1.25 + 0.2 * rng.standard_normal(400)))
    angle = 0.4 * np.sin(phase)
    gyro = np.append(0.0, np.diff(angle) / 0.2) + 1e-2 * rng.standard_normal(400)
    channels = {"table_angle": Channel(angle, "rad", source="encoder")}
    alone = with_reference(Recording(t, channels))
    beside = with_reference(Recording(t, {**channels, "gyro": Channel(gyro, "rad/s", "interval")}))
    assert alone.table is not None
    assert beside.table is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_noise_of_an_encoder_that_no_gyro_reads_stays_noise(seed: int) -> None:
    rng = np.random.default_rng(seed)
    read = TURNED + 3e-3 * rng.standard_normal(N)
    gyro = Channel(SWING + 1e-3 * rng.standard_normal(N), "rad/s")
    run = with_reference(Recording(T, {"gyro": gyro, "table_angle": Channel(read, "rad", source="encoder")}))
    assert run.table is not None
    assert abs(run.table.noise / 3e-3 - 1) < 0.1
