"""Random truths, tasks and packaged scenarios: drawn as said, told as declared, refused in one sentence."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.units import ARCSEC, DEG, PPM
from insenv.evaluate.runs import task_of
from insenv.plants.turntable import Turntable
from insenv.scenario import check_task, datasheet, load, names, simulate
from insenv.scenario.values import uncertain

TABLES = tuple(name for name in names() if name.startswith("north_finder/"))
NORTH = tuple(name for name in TABLES if not name.endswith("scale_factor_test"))
TURNING = {"profile": {"kind": "constant", "rate": "10 deg/s"}}
REALISTIC = "north_finder/realistic"


def table(scenario: Any, seeds: Any) -> Turntable:
    plant = scenario.cast(seeds).plant
    assert isinstance(plant, Turntable)
    return plant


# --------------------------------------------------------------------------------------------------- values


@settings(deadline=None)
@given(
    mean=st.floats(-1e6, 1e6),
    sd=st.floats(0, 1e6),
    sign=st.sampled_from(["+-", "±"]),
    space=st.sampled_from(["", " ", "  "]),
    exact=st.booleans(),
)
def test_a_mean_and_its_deviation_are_read(mean: float, sd: float, sign: str, space: str, exact: bool) -> None:
    text = f"{mean!r} ppm" if exact else f"{mean!r} ppm{space}{sign}{space}{sd!r} ppm"
    assert uncertain(text, "1", "x") == pytest.approx((mean * PPM, 0.0 if exact else sd * PPM), rel=1e-12)
    assert uncertain(f"{sign}{space}{sd!r} arcsec", "rad", "x") == pytest.approx((0.0, sd * ARCSEC), rel=1e-12)


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=12) | st.lists(st.sampled_from(["+-", "±", "5", "-2", "1e-3", " ", "ppm", "deg"])).map("".join))
def test_any_other_text_is_refused_in_one_sentence(text: str) -> None:
    try:
        mean, sd = uncertain(text, "1", "file: key")
    except InputError as error:
        assert "\n" not in str(error) and str(error).startswith("file: key")
    else:
        assert np.isfinite(mean) and 0 <= sd < np.inf


@pytest.mark.parametrize("text", ["5 +- 2 ppm", "5 ppm +- 2", "5 ppm +-", "+-", "5 ppm +- -2 ppm", "1 +- 2 +- 3", True])
def test_what_could_be_meant_in_two_ways_is_refused(text: object) -> None:
    with pytest.raises(InputError, match=r"^here"):
        uncertain(text, "1", "here")


# ----------------------------------------------------------------------------------------------------- cast


@pytest.mark.parametrize("name", TABLES)
def test_a_row_of_a_batch_is_the_run_alone_bit_for_bit(name: str) -> None:
    scenario = load(name, {"duration": "2 s"} | ({} if name not in NORTH else TURNING))
    seeds = [11, 12, 13]
    batch = scenario.cast(seeds)
    together = batch.run(seeds[0], scenario.samples, len(seeds))
    assert isinstance(batch.plant, Turntable) and np.shape(batch.plant.azimuth) == (3,)
    for i, seed in enumerate(seeds):
        one = scenario.cast(seed)
        assert isinstance(one.plant, Turntable) and isinstance(one.plant.azimuth, float)
        for alone, fitted in zip(one.instruments, batch.instruments, strict=True):
            assert fitted.theta.shape == (3, *alone.theta.shape)
            assert np.array_equal(fitted.theta[i], alone.theta)
        readings = one.run(seed, scenario.samples)
        for target, values in readings.outputs.items():
            assert np.array_equal(together.outputs[target][i], values)
            assert np.isfinite(values).all()
        phase = scenario.phases(seed, "gyro")
        assert scenario.phases(seeds, "gyro")[i] == phase  # type: ignore[index]


def test_a_batch_of_one_has_a_batch_axis_and_any_seeds_may_be_cast() -> None:
    scenario = load(REALISTIC)
    one, mixed = scenario.cast([5]), scenario.cast((9, 5))
    assert one.instruments[0].theta.shape[0] == 1
    assert isinstance(one.plant, Turntable) and np.shape(one.plant.level_error[0]) == (1,)
    assert np.array_equal(one.instruments[0].theta[0], mixed.instruments[0].theta[1])
    for seeds, found in ((-1, "seed -1"), ([], "no seed"), ([3, -2], "seed -2")):
        with pytest.raises(InputError, match=found):
            scenario.cast(seeds)


def test_the_earth_rate_of_a_run_is_that_of_its_table() -> None:
    scenario = load(REALISTIC)
    rig = scenario.cast([1, 2])
    gyro = rig.instruments[0]
    first = gyro.sensor.names.index("earth_rate.c")
    level = EARTH_RATE * np.cos(40 * DEG) * np.cos(30 * DEG)
    assert isinstance(rig.plant, Turntable)
    wanted = level * np.stack([np.cos(rig.plant.azimuth), np.sin(rig.plant.azimuth)], axis=-1)
    # 10 arcsec of level error turn and stretch it by their share at most; four deviations.
    np.testing.assert_allclose(gyro.theta[:, first : first + 2], wanted, atol=4 * 10 * ARCSEC * EARTH_RATE)
    assert not np.allclose(gyro.theta[:, first : first + 2], wanted, rtol=1e-9, atol=0)


def test_drawn_values_have_the_mean_and_the_deviation_that_were_given() -> None:
    # 400 runs of 7 quantities: each mean and each variance within 4 of its own deviations, which chance alone breaks
    # in 0.2 % of all choices of the seeds.
    scenario = load(REALISTIC, {"declared.scale_factor.c": "50 ppm +- 10 ppm"})
    seeds = range(400)
    rig, n = scenario.cast(seeds), len(seeds)
    drawn = {
        (fitted.sensor.target, name): fitted.theta[:, j]
        for fitted in rig.instruments
        for j, name in enumerate(fitted.sensor.names)
    }
    assert isinstance(rig.plant, Turntable)
    east, north = rig.plant.level_error
    cases = [
        (drawn["gyro", "bias.c"], 0.0, 0.005 * DEG / 3600),
        (drawn["accel_x", "bias.c"], 0.0, 30 * 9.80665e-6),
        (drawn["gyro", "scale_factor.c"], 50 * PPM, 10 * PPM),
        (drawn["gyro", "encoder_harmonic:1.c"], 0.0, 0.02 * ARCSEC / 2**0.5),
        (drawn["gyro", "encoder_harmonic:1.s"], 0.0, 0.02 * ARCSEC / 2**0.5),
        (np.asarray(east), 0.0, 10 * ARCSEC),
        (np.asarray(north), 0.0, 10 * ARCSEC),
    ]
    z = np.stack([(values - mean) / sd for values, mean, sd in cases])
    assert np.abs(z.mean(axis=1)).max() < 4 / n**0.5
    assert np.abs(z.var(axis=1) - 1).max() < 4 * (2 / n) ** 0.5
    # Independent: each of 21 correlations within 4.5 of 1 / sqrt(n), by chance outside in 0.02 % of all choices.
    correlation = np.asarray(np.corrcoef(z))[np.triu_indices(len(z), 1)]
    assert np.abs(correlation).max() < 4.5 / n**0.5
    # Uniform on the circle: 2 n R^2 of the mean vector is chi-squared with 2 freedoms, above 18.4 in 0.01 %.
    azimuth = np.asarray(rig.plant.azimuth)
    assert 2 * n * abs(np.exp(1j * azimuth).mean()) ** 2 < 18.4
    assert -np.pi < azimuth.min() < -0.98 * np.pi and 0.98 * np.pi < azimuth.max() <= np.pi


def test_an_azimuth_near_a_value_has_its_mean_and_deviation() -> None:
    n = 400
    azimuth = np.asarray(table(load("north_finder/undeclared"), range(n)).azimuth) / DEG
    # Within 4.5 deviations of mean and of spread: false alarm 1e-5.
    assert abs(azimuth.mean() - 65.0) < 4.5 * 10.0 / n**0.5
    assert abs(azimuth.std() / 10.0 - 1.0) < 4.5 / (2 * n) ** 0.5


@pytest.mark.parametrize("name", names())
def test_no_constant_solves_a_packaged_task(name: str) -> None:
    """What is sought differs from run to run by far more than what is demanded."""
    if load(name).task is None:
        pytest.skip("no task")
    task = task_of(name, {"instrument.sampling": "20 Hz"} if "rate_table" in name else None)
    truth = task.world.truth(task.world.cast(range(12)), 12)
    for q in task.quantities:
        apart = q.error(truth[q.name][1:], truth[q.name][:1])
        # Where a run differs by twice what is demanded, all eleven differences are smaller in 1e-4 of all choices.
        assert np.abs(apart).max() > q.demanded, (name, q.name)


def test_another_effect_at_the_end_leaves_the_draws_before_as_they_were() -> None:
    before = load("north_finder/undeclared").cast(3)
    tone = {"undeclared.tone": {"c": "+- 1 deg/h", "s": "0 deg/h", "f": "3 Hz"}}
    after = load("north_finder/undeclared", tone).cast(3)
    n = len(before.instruments[0].theta)
    assert np.array_equal(after.instruments[0].theta[:n], before.instruments[0].theta)


def test_a_scenario_without_random_values_is_cast_as_it_was_built() -> None:
    exact = {"declared.bias.c": "1 deg/h", "declared.scale_factor.c": "3 ppm", "table.azimuth": "65 deg"}
    scenario = load("north_finder/undeclared", exact)
    assert np.array_equal(scenario.cast(0).instruments[0].theta, scenario.rig.instruments[0].theta)
    assert scenario.cast(0).plant == scenario.cast(1).plant == scenario.rig.plant


def test_the_truth_holds_the_values_of_its_seed(tmp_path: Path) -> None:
    changes = TURNING | {"duration": "2 s", "output.truth": True}
    out = simulate(REALISTIC, tmp_path, 7, changes=changes).parent
    truth = json.loads((out / "truth.json").read_text())
    rig = load(REALISTIC, changes).cast(7)
    found = [p["value"] for e in truth["effects"] if e["target"] == "gyro" for p in e["parameters"]]
    assert found == rig.instruments[0].theta.tolist()
    assert isinstance(rig.plant, Turntable)
    assert truth["table"] == {"azimuth": rig.plant.azimuth, "level_error": list(rig.plant.level_error)}


# -------------------------------------------------------------------------------- what is told and what is not


def numbers(text: str) -> set[float]:
    return {float(found) for found in re.findall(r"-?\d+\.?\d*(?:e[+-]?\d+)?", text)}


@pytest.mark.parametrize("name", NORTH)
def test_nothing_undeclared_and_nothing_drawn_is_told(name: str, tmp_path: Path) -> None:
    """Neither by the datasheet nor by the manifest: no name, no value, no azimuth."""
    changes: dict[str, Any] = TURNING | {"duration": "2 s"}
    if not name.endswith("undeclared"):
        changes["undeclared"] = {"tone": {"c": "7.3 deg/h", "s": "0 deg/h", "f": "3 Hz"}}
    scenario, seed = load(name, changes), 4
    manifest = simulate(name, tmp_path, seed, changes=changes).read_text()
    told = repr(datasheet(scenario))
    truth = scenario.truth(seed)
    assert isinstance(truth.plant, Turntable)
    exact = {v for p in scenario.planted if p.origin != "undeclared" for v in (*p.values, *p.sd) if not p.told}
    hidden = {float(v) for v in (truth.plant.azimuth, *truth.plant.horizontal_earth_rate, *truth.plant.level_error)}
    hidden |= {v for p in truth.planted if p.origin == "undeclared" or any(p.sd) for v in p.values}
    hidden -= exact | {0.0}
    assert hidden
    for text in (told, manifest):
        for value in hidden:
            for factor in (1.0, 1 / DEG, 1 / ARCSEC, 3600 / DEG, 1e6):
                assert not np.any(np.isclose(list(numbers(text)), value * factor, rtol=1e-6, atol=0)), value
        for p in scenario.planted:
            if p.origin == "undeclared":
                assert p.effect.id not in text
        assert "azimuth" not in text and "undeclared" not in text


def test_the_datasheet_tells_the_makers_figures() -> None:
    told = datasheet(load(REALISTIC))
    assert (told.sampling, told.duration, told.dt) == (100.0, 300.0, 0.01)
    assert told.site.latitude == pytest.approx(40 * DEG) and told.mounting.tilt == pytest.approx(30 * DEG)
    assert told.site.gravity == pytest.approx(9.8017, abs=1e-4)
    assert (told.limits.rate, told.limits.acceleration) == pytest.approx((50 * DEG, 20 * DEG))
    assert told.pulse == pytest.approx(0.46634601 * ARCSEC)
    assert told.encoder_noise == pytest.approx(0.1 * ARCSEC)
    assert told.coefficient("gyro", "angle_random_walk") == pytest.approx(3e-4 * DEG / 60)
    assert told.coefficient("gyro", "quantization") == 0.0  # the pulses are it
    assert told.coefficient("accel_x", "bias_instability") == pytest.approx(2 * 9.80665e-6)
    wander, eccentric = told.told("lock_in_wander", "gyro"), told.told("encoder_harmonic:1", "gyro")
    assert wander is not None and wander.mean[0] == pytest.approx(0.05 * DEG) and not any(wander.sd)
    assert eccentric is not None and eccentric.sd == pytest.approx((0.02 * ARCSEC / 2**0.5,) * 2)
    assert told.told("earth_rate", "gyro") is None


# -------------------------------------------------------------------------------------- packaged, task, changes


def test_the_packaged_scenarios_are_those_of_the_documentation() -> None:
    page = (Path(__file__).parents[2] / "docs" / "scenario.md").read_text()
    assert set(re.findall(r"`((?:north_finder|two_position|rate_table|system_calibration)/\w+)`", page)) == set(names())


@pytest.mark.parametrize("name", TABLES)
def test_every_packaged_scenario_is_played_for_two_seconds(name: str) -> None:
    scenario = load(name, {"duration": "2 s"})
    task = check_task(scenario)
    assert (task.steps, task.samples) == (2, 100)
    readings = scenario.cast(1).run(1, scenario.samples)
    assert all(np.isfinite(values).all() for values in readings.outputs.values())
    assert ("accel_x" in readings.outputs) == (name == REALISTIC)


@pytest.mark.parametrize(("name", "hour"), [("published", 100.0), ("realistic", 5.0), ("scale_factor_test", 5.0)])
def test_the_warm_up_is_that_of_the_first_hour(name: str, hour: float) -> None:
    (warm_up,) = (p for p in load(f"north_finder/{name}").planted if p.effect.id == "scale_factor_warm_up")
    c, tau = warm_up.values
    assert c * (np.exp(-3600 / tau) - 1) == pytest.approx(hour * PPM, rel=1e-6)


def test_lock_in_rises_and_walks_as_said() -> None:
    (lock_in,) = (p for p in load(REALISTIC).planted if p.effect.id == "lock_in_wander")
    _, rise, tau, walk = lock_in.values
    assert rise * (1 - np.exp(-3600 / tau)) == pytest.approx(0.2, rel=1e-6)
    assert walk * 300**0.5 == pytest.approx(0.01)


def test_the_scale_factor_test_turns_the_table_twenty_times_at_every_rate() -> None:
    plant = load("north_finder/scale_factor_test").rig.plant
    assert isinstance(plant, Turntable)
    before, rates = plant.profile[0].rate, []
    for piece in plant.profile:
        steady = piece.duration - abs(piece.rate - before) / plant.max_acceleration
        assert 20 <= steady * abs(piece.rate) / (2 * np.pi) + 1e-9 < 20 + abs(piece.rate) / (2 * np.pi)
        rates.append(round(piece.rate / DEG))
        before = piece.rate
    assert rates[::2] == [10, 10, 20, 20, 30, 30, 60, 100] and rates[1::2] == [-r for r in rates[::2]]


def test_the_undeclared_eccentricity_stands_at_45_deg_to_the_earth_rate() -> None:
    scenario = load("north_finder/undeclared", {"table.azimuth": "65 deg"})
    (hidden,) = (p.values for p in scenario.planted if p.origin == "undeclared")
    there = table(scenario, 0).azimuth + 45 * DEG
    np.testing.assert_allclose(hidden, 2 * ARCSEC * np.array([-np.sin(there), np.cos(there)]), rtol=1e-6)


def test_changes_reach_every_kind_of_entry(tmp_path: Path) -> None:
    given = {"c": "1 ppm"}
    changes = {
        "table.tilt": "12 deg",
        "table.azimuth": "10 deg",
        "temperature": {"kind": "constant", "value": "20 degC"},
        "temperature.value": "21 degC",
        "undeclared.scale_factor_asymmetry": given,
        "undeclared.scale_factor_asymmetry.c": "2 ppm",
    }
    scenario = load("north_finder/published", changes)
    assert table(scenario, 3).tilt == pytest.approx(12 * DEG) and table(scenario, 3).azimuth == pytest.approx(10 * DEG)
    assert scenario.planted[-1].values == pytest.approx((2e-6,)) and given == {"c": "1 ppm"}
    assert load("north_finder/published").table.undeclared == {}


def test_a_tilt_of_zero_is_allowed() -> None:
    scenario = load("north_finder/published", {"table.tilt": "0 deg"} | TURNING | {"duration": "2 s"})
    lock_in = {"undeclared.lock_in": {"W_L_squared": "0.0025 deg^2/s^2"}}
    locked = load("north_finder/published", {"table.tilt": "0 deg"} | TURNING | {"duration": "2 s"} | lock_in)
    free, swallowed = (s.cast(1).run(1, 200).outputs["gyro"] for s in (scenario, locked))
    assert np.abs(free).max() < 2 * EARTH_RATE
    assert free.shape == swallowed.shape


#: Change of the published scenario, and words of the sentence that it ends in.
BAD: list[tuple[dict[str, Any], str]] = [
    ({"site.latitude": "90 deg"}, "site.latitude = '90 deg'; the input axis sees no horizontal Earth rate"),
    ({"site.latitude": "-90 deg"}, "north has no meaning"),
    ({"table.tilt": "90 deg"}, "table.tilt = '90 deg'; the input axis sees no horizontal Earth rate"),
    ({"site": {}, "declared.earth_rate": {"c": "1 deg/h", "s": "0 deg/h"}}, "site.latitude is missing"),
    ({"declared.earth_rate": {"c": "1 deg/h", "s": "0 deg/h"}}, "wanted earth_rate = {}"),
    ({"table": {"azimuth": "random", "tilt": "30 deg"}}, "table.max_rate is missing"),
    ({"task.kind": "gyrocompass"}, "task.kind = 'gyrocompass'; wanted one of 'north-finder'"),
    ({"task": {"kind": "north-finder"}}, "task.demanded"),
    ({"task.demanded": "30 ppm"}, "task.demanded"),
    ({"task.demanded": "0 arcsec"}, "task.demanded = '0 arcsec'; wanted more than zero"),
    ({"task.step": "0.015 s"}, "task.step = '0.015 s' is 1.5 samples"),
    ({"task.step": "0 s"}, "task.step = '0 s'; wanted more than zero"),
    ({"task.step": "7 s"}, "wanted a step that divides the duration evenly"),
    ({"task.step": "600 s"}, "wanted a step that divides the duration evenly"),
    ({"task.cost": -1.0}, "task.cost = -1"),
    ({"task.cost": float("nan")}, "task.cost = nan"),
    ({"duration": "2 m"}, "duration"),
    ({"table.azimuth": "randon"}, "table.azimuth"),
    ({"table.level_error": ["1 arcsec"]}, "table.level_error"),
    ({"table.level_error": ["1 arcsec", "1 s"]}, "table.level_error[1]"),
    ({"table.level_error": ["1 arcsec", "+- 1 deg"]}, "table.level_error[1] = '+- 1 deg'; wanted a small angle"),
    ({"table.encoder.skew": "-1 us"}, "table.encoder.skew"),
    (
        {"declared.scale_factor.c": "5 +- 2 ppm"},
        "declared.scale_factor.c = '5 +- 2 ppm'; wanted a mean and a deviation",
    ),
    ({"declared.scale_factor_warm_up.tau": "850 s +- 300 s"}, "standard deviations or more above 0.5 s"),
    ({"instrument.gyro.noise.angle_random_walk": "1 deg/sqrt(h) +- 1 deg/sqrt(h)"}, "without an uncertainty"),
    ({"declared.scale_factor.targets": "accel_x"}, "declared.scale_factor.targets"),
    ({"table.tlt": "12 deg"}, "unknown key 'table.tlt'; did you mean 'tilt'?"),
    ({"tabel.tilt": "12 deg"}, "unknown key 'tabel'; did you mean 'table'?"),
    ({"declared.scale_factor_warm_up.tua": "1 s"}, "tua is no parameter"),
    ({"undeclared.encoder_harmonics": {}}, "undeclared.encoder_harmonics"),
    ({"table.tilt.x": "12 deg"}, "a change of 'table.tilt.x', but table.tilt is no table"),
    ({"table..tilt": "12 deg"}, "a change of 'table..tilt'"),
    ({7: "12 deg"}, "a change of 7"),  # type: ignore[dict-item]
    ({"table.tilt": 12.0}, "table.tilt = 12.0"),
]


@pytest.mark.parametrize(("changes", "words"), BAD, ids=lambda value: str(value)[:60])
def test_a_scenario_that_cannot_be_is_refused_in_one_sentence(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as caught:
        load("north_finder/published", changes)
    message = str(caught.value)
    assert words in message and "published.toml" in message and "\n" not in message


def test_an_effect_of_another_instrument_is_refused() -> None:
    for changes, words in (
        ({"declared.scale_factor": {"c": "1 ppm", "targets": "accel_x"}}, "scale_factor is an effect of gyros"),
        ({"model.target": "accel_x"}, "is an effect of gyros"),
    ):
        with pytest.raises(InputError, match=words):
            load(REALISTIC, changes)


def test_a_task_that_nobody_plays_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\[profile\] is missing"):
        simulate("north_finder/published", tmp_path / "out")
    assert not (tmp_path / "out").exists()
    scenarios = Path(__file__).parents[2] / "scenarios"
    with pytest.raises(InputError, match=r"\[task\] is missing"):
        check_task(load(scenarios / "reversal.toml"))
    asked = {"task": {"kind": "north-finder", "demanded": "1 arcsec"}}
    with pytest.raises(InputError, match=r"wanted a \[table\] to turn"):
        load(scenarios / "parked_vehicle.toml", asked)


def test_a_name_that_is_nearly_one_is_told() -> None:
    with pytest.raises(InputError, match="did you mean 'north_finder/published'"):
        load("north_finder/publishd")
    with pytest.raises(InputError, match="wanted a TOML file, or one of north_finder/published"):
        load("nowhere")
