"""Scenarios of a vehicle: drawn as said, told as declared, refused in one sentence, written for the loop."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from insenv.close import close
from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.units import ARCMIN, ARCSEC, DEG, DEG_PER_HOUR, UG
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.plants.vehicle import Vehicle
from insenv.scenario import check_task, datasheet, load, names, simulate

PACKAGED = tuple(name for name in names() if name.startswith("two_position/"))
PUBLISHED, REALISTIC = "two_position/published_a", "two_position/realistic"
#: The readings of the published noise that have no file of their own: angle and velocity random walk.
NOISE, WALKS = "instrument.gyro.noise.angle_random_walk", "instrument.accel.noise.velocity_random_walk"
#: A turn within a few seconds.
SOON = {"duration": "10 s", "profile.turns": [["1 s", "10 deg"], ["1 s", "-5 deg"]]}


def vehicle(scenario: Any, seeds: Any) -> Vehicle:
    plant = scenario.cast(seeds).plant
    assert isinstance(plant, Vehicle)
    return plant


# ----------------------------------------------------------------------------------------------------- cast


@pytest.mark.parametrize("name", PACKAGED)
def test_a_row_of_a_batch_is_the_run_alone_bit_for_bit(name: str) -> None:
    scenario, seeds = load(name, SOON), [11, 12, 13]
    together = scenario.cast(seeds).run(seeds[0], scenario.samples, len(seeds))
    for i, seed in enumerate(seeds):
        alone = scenario.cast(seed).run(seed, scenario.samples)
        for target, values in alone.outputs.items():
            assert np.isfinite(values).all()
            np.testing.assert_array_equal(together.outputs[target][i], values, err_msg=target)
        for key, reference in alone.references.items():
            found = together.references[key].values
            np.testing.assert_array_equal(found[i] if found.ndim == 2 else found, reference.values, err_msg=key)


def test_the_size_of_the_chunks_does_not_matter() -> None:
    scenario = load(REALISTIC, SOON)
    rig = scenario.cast(3)
    whole = rig.run(3, scenario.samples)
    parts = list(rig.stream(3, scenario.samples, chunk=137))
    for target, values in whole.outputs.items():
        # White noise is scaled by the mean sampling period of a chunk, which rounding alone makes another.
        np.testing.assert_allclose(np.concatenate([part.outputs[target] for part in parts]), values, rtol=1e-12)
    for key, reference in whole.references.items():
        np.testing.assert_array_equal(np.concatenate([part.references[key].values for part in parts]), reference.values)


def test_what_is_drawn_has_the_mean_and_the_deviation_that_were_given() -> None:
    # 400 runs of 10 quantities: each mean and each variance within 4.5 of its own deviations, which chance alone breaks
    # in 0.01 % of all choices of the seeds.
    scenario, n = load(REALISTIC), 400
    rig = scenario.cast(range(n))
    plant = rig.plant
    assert isinstance(plant, Vehicle) and plant.sight is not None and plant.level_error is not None
    drawn = {f.sensor.target: dict(zip(f.sensor.names, f.theta.T, strict=True)) for f in rig.instruments}
    cases = [
        (plant.sight.installation, 30 * ARCMIN),
        (plant.sight.orientation, np.sqrt(2) * 0.1 / 1458.5),
        (plant.level_error[0], 5 * ARCMIN),
        (plant.level_error[1], 3 * ARCMIN),
        (plant.heading, 2 * np.pi / np.sqrt(12)),
        (drawn["gyro_x"]["bias.c"], 0.01 * DEG_PER_HOUR),
        (drawn["accel_y"]["bias.c"], 50 * UG),
        (drawn["gyro_z"]["scale_factor.c"], 10e-6),
        (drawn["gyro_y"]["cross_axis.c_z"], 24e-6),
        (drawn["gyro_x"]["bias_drift.c"], 0.002 * DEG_PER_HOUR / 3600),
    ]
    z = np.stack([np.asarray(values) / sd for values, sd in cases])
    assert np.abs(z.mean(axis=1)).max() < 4.5 / n**0.5
    assert np.abs(z.var(axis=1) - 1).max() < 4.5 * (2 / n) ** 0.5
    assert not drawn["gyro_y"]["cross_axis.c_y"].any()
    assert plant.sway.waves is not None
    assert len(np.unique(plant.sway.waves[:, 0, 2])) == n


def test_a_reading_of_the_sight_has_the_errors_of_the_table() -> None:
    # 500 runs: standard deviation of 28 arcsec to 3.2 %, within 4 of them; p = 6e-5.
    scenario, n = load(PUBLISHED, {"duration": "1 s", "sight.installation": "30 arcmin"}), 500
    readings = scenario.cast(range(n)).run(0, 1, n).references
    error = readings["sight_heading"].values[:, 0] - readings["heading"].values[:, 0] - 30 * ARCMIN
    assert error.std() == pytest.approx(np.hypot(20, 20) * ARCSEC, rel=0.13)
    assert abs(error.mean()) < 4 * np.hypot(20, 20) * ARCSEC / n**0.5


def test_another_draw_leaves_those_before_as_they_were() -> None:
    plain = vehicle(load(PUBLISHED), 5)
    swaying = {"vehicle.sway": {"lines": [{"frequency": "1 Hz", "rms": "1 arcsec"}]}, "vehicle.heading": "random"}
    other = vehicle(load(PUBLISHED, swaying), 5)
    assert plain.sight == other.sight and plain.level_error == other.level_error
    assert other.heading != plain.heading == 0.0


def test_a_run_cast_alone_is_a_row_of_any_batch() -> None:
    scenario = load(REALISTIC)
    together, alone = vehicle(scenario, [9, 5]), vehicle(scenario, 5)
    assert together.sight is not None and alone.sight is not None
    assert np.asarray(together.sight.installation)[1] == alone.sight.installation
    assert vehicle(scenario, [5]).attitude.shape == (1, 3, 3)


# ------------------------------------------------------------------------------------------------- datasheet


def test_a_datasheet_tells_limits_sight_and_level_and_nothing_drawn() -> None:
    told = datasheet(load(PUBLISHED))
    assert told.limits.rate == pytest.approx(10 * DEG) and told.limits.acceleration == pytest.approx(10 / 3 * DEG)
    assert told.sight is not None
    assert told.sight.orientation == pytest.approx(20 * ARCSEC, rel=1e-4)
    assert told.sight.tracking == pytest.approx(20 * ARCSEC)
    # The scenario's own values are its errors: what is told is how large they may be.
    assert told.sight.installation == pytest.approx(30 * ARCMIN)
    assert told.level_sd == pytest.approx((5 * ARCMIN, 3 * ARCMIN))
    bias = told.told("bias", "gyro_z")
    assert bias is not None and bias.mean == (0.0,) and bias.sd == pytest.approx((0.01 * DEG_PER_HOUR,))
    assert datasheet(load(REALISTIC)).level_sd == pytest.approx(told.level_sd)
    assert datasheet(load("two_position/undeclared")).told("bias_warm_up", "gyro_x") is None


def test_a_table_has_no_sight() -> None:
    told = datasheet(load("north_finder/published"))
    assert told.sight is None and told.level_sd == (np.inf, np.inf)


@pytest.mark.parametrize(
    ("name", "changes", "gyro", "accel"),
    [
        ("published_a", {}, 1.67e-5, 2),
        ("published_a2", {}, 1.67e-4, 2),
        ("published_b", {}, 1e-3, 2),
        ("published_a", {NOISE: "0.01 deg/sqrt(h)"}, 0.01, 2),
        ("published_a", {WALKS: "20 ug/sqrt(Hz)"}, 1.67e-5, 20),
        ("published_a", {NOISE: "0.01 deg/sqrt(h)", WALKS: "20 ug/sqrt(Hz)"}, 0.01, 20),
    ],
    ids=["A", "A2", "B", "C", "D", "E"],
)
def test_the_readings_of_the_published_noise(name: str, changes: dict[str, str], gyro: float, accel: float) -> None:
    told = datasheet(load(f"two_position/{name}", changes))
    assert told.coefficient("gyro_x", "angle_random_walk") == pytest.approx(gyro * DEG / 60, rel=5e-3)
    assert told.coefficient("accel_z", "angle_random_walk") == pytest.approx(accel * UG, rel=1e-9)


# ------------------------------------------------------------------------------------------------ task, refused


@pytest.mark.parametrize("name", PACKAGED)
def test_every_packaged_scenario_has_a_task_of_one_second_steps(name: str) -> None:
    scenario = load(name)
    task = check_task(scenario)
    assert (task.kind, task.steps, task.samples) == ("two-position", 620, 100)
    assert task.demanded == pytest.approx(0.65 * ARCMIN)
    assert vehicle(scenario, 0).turn_time(170 * DEG) == pytest.approx(20.0, abs=1e-9)


WITHOUT_TASK = {"duration": "10 s"}


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"site.latitude": "90 deg"}, "site.latitude = '90 deg'; a gyrocompass"),
        ({"site.latitude": "-90 deg"}, "site.latitude = '-90 deg'; a gyrocompass"),
        ({"site": {}}, "site.latitude is missing"),
        ({"profile": {"kind": "rest"}, "vehicle": {}}, "vehicle.max_rate is missing"),
        ({"vehicle.level_error": None}, "vehicle.level_error"),
        ({"duration": "0.5 s"}, "task.step = '1 s'"),
        ({"duration": "0.001 s"}, "samples; wanted from 2"),
        ({"sight": None}, "sight"),
        ({"vehicle": {}}, "the profile asks for a turn"),
        ({"vehicle": {"max_rate": "1 deg/s"}}, "vehicle.max_acceleration is missing"),
        ({"vehicle": {"max_acceleration": "1 deg/s^2"}}, "vehicle.max_rate is missing"),
        ({"vehicle.max_rate": "0 deg/s"}, "vehicle.max_rate = '0 deg/s'; wanted more than zero"),
        ({"vehicle.max_rate": "10 deg"}, "vehicle.max_rate"),
        ({"vehicle.slope": "30 deg"}, "vehicle.slope = '30 deg'; wanted at most 20 deg"),
        ({"vehicle.pitch": "90 deg"}, "vehicle.pitch = '90 deg'"),
        ({"vehicle.sway": {"arm": ["0 m", "0 m", "1 m"]}}, "vehicle.sway has no lines and no band"),
        ({"vehicle.sway": {"lines": [{"frequency": "0 Hz", "rms": "1 arcsec"}]}}, r"lines[0].frequency = '0 Hz'"),
        ({"vehicle.sway": {"band": {"low": "2 Hz", "high": "1 Hz", "rms": "1 arcsec"}}}, "band.high = '1 Hz'"),
        ({"vehicle.residual": {"velocity": "1 cm/s", "time_constant": "0 s"}}, "residual.time_constant = '0 s'"),
        ({"sight.installation": "20 deg"}, "sight.installation = '20 deg'; wanted a small angle"),
        ({"sight.installation": "+- 2 deg"}, "sight.installation = '+- 2 deg'; wanted a small angle"),
        ({"sight.orientation": "20 arcsec"}, "sight has orientation and surveyed points"),
        ({"sight.distance": "1 m"}, "sight.distance = '1 m' is too short"),
        ({"sight.tracking": "-1 arcsec"}, "sight.tracking = '-1 arcsec'; wanted zero or more"),
        ({"sight.readings": "never"}, "sight.readings"),
        ({"profile.turns": []}, "profile.turns = []"),
        ({"profile.turns": [["1 s", "400 deg"]]}, "profile.turns[0] = '400 deg'; wanted at most 360 deg"),
        ({"profile": {"kind": "sine", "amplitude": "1 deg/s"}}, "profile.kind = 'sine' moves a [table]"),
        ({"base": {}}, "[base] and [vehicle]"),
        ({"table": {}}, "[table] and [vehicle]"),
        ({"declared.earth_rate": {"c": "1 deg/h", "s": "1 deg/h"}}, "earth_rate is no error of a [vehicle]'s gyros"),
        ({"task.kind": "north-finder"}, "task.kind = 'north-finder' with a [vehicle]"),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence(changes: dict[str, Any], found: str) -> None:
    with pytest.raises(InputError) as error:
        check_task(load(PUBLISHED, changes))
    assert found in str(error.value) and "\n" not in str(error.value)


def test_a_profile_of_turns_is_no_profile_of_a_table_and_a_sight_belongs_to_a_vehicle() -> None:
    turns = {"kind": "turns", "turns": [["1 s", "10 deg"]]}
    with pytest.raises(InputError, match=r"profile\.kind = 'turns' turns a \[vehicle\]"):
        load("north_finder/published", {"profile": turns})
    with pytest.raises(InputError, match=r"\[sight\] belongs to a \[vehicle\]"):
        load("north_finder/published", {"sight": {"installation": "1 deg"}})
    with pytest.raises(InputError, match=r"task\.kind = 'two-position' without a \[vehicle\]"):
        load("north_finder/published", {"task.kind": "two-position"})


# --------------------------------------------------------------------------------------------------- written


def test_a_rest_is_written_as_a_static_recording_of_both_triads(tmp_path: Path) -> None:
    resting = {
        "profile": {"kind": "rest"},
        "duration": "3 s",
        "output.truth": True,
        "sight.installation": "30 arcmin",
    }
    manifest = load_manifest(simulate(PUBLISHED, tmp_path, 4, changes=resting))
    assert manifest.procedure == "static" and "table_angle" not in manifest.channels
    (run,) = read_recordings(manifest)
    assert run.channels["gyro_y"].covers == "interval" and len(run) == 300
    truth = json.loads((tmp_path / "truth.json").read_text())["vehicle"]
    assert truth["installation_angle"] == pytest.approx(30 * ARCMIN) and truth["heading"] == 0.0


def test_a_turn_is_written_with_its_angle_for_the_gyro_about_it(tmp_path: Path) -> None:
    warming = {"undeclared.scale_factor": {"targets": "gyro_z", "c": "100 ppm"}} | SOON
    text = (path := simulate("two_position/undeclared", tmp_path, 4, changes=warming)).read_text()
    assert "scale_factor" not in text and "bias_warm_up" not in text
    manifest = load_manifest(path)
    assert manifest.procedure == "rate-table" and manifest.model.targets == ("gyro_z",)
    (run,) = read_recordings(manifest)
    angle, gyro = run.values("table_angle", "rad"), run.values("gyro_z", "rad/s")
    assert angle[-1] == pytest.approx(5 * DEG, abs=1e-9)
    # Beside the scale factor the Earth's rate about Up, and four deviations of the bias.
    earth = 10 * EARTH_RATE * np.sin(38 * DEG)
    left = np.sum(gyro) / 100 - angle[-1] - earth
    assert left == pytest.approx(1e-4 * (5 * DEG + earth), abs=4 * 0.01 * DEG_PER_HOUR * 10)


def test_the_axis_of_a_level_gyro_that_feels_the_turn_is_named(tmp_path: Path) -> None:
    wrong = {"cross_axis": {"targets": "gyro_x", "c_x": "0", "c_y": "0", "c_z": "100 ppm"}}
    upright = {"vehicle.level_error": ["0 deg", "0 deg"], "profile.turns": [["20 s", "170 deg"]], "duration": "60 s"}
    changes = {"undeclared": wrong, "model.target": "gyro_x", "held_out": {"start": "50 s"}} | upright
    path = simulate("two_position/undeclared", tmp_path, 4, changes=changes)
    assert load_manifest(path).model.declared == ("bias", "earth_rate")
    (target,) = close(path).targets
    assert [added.effect for added in target.added] == ["cross_axis"]
    found = {p.parameter: p for p in target.added[0].parameters}["c_z"]
    assert found.value == pytest.approx(1e-4, abs=4 * found.sd) and found.sd < 2e-6


def test_a_vehicle_without_a_profile_is_not_simulated(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\[profile\] is missing"):
        simulate(PUBLISHED, tmp_path / "out", changes={"profile": None})
    assert not (tmp_path / "out" / "manifest.toml").exists()
