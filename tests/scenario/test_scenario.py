"""Scenarios: what is written is read back, the undeclared stays unsaid, bad input ends in one sentence."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.data.exposure import expose
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.scenario import load, simulate

FOLDER = Path(__file__).parents[2] / "scenarios"
EXAMPLES = sorted(path.stem for path in FOLDER.glob("*.toml"))
ARCSEC = np.pi / 648000

SMALL = """
duration = "20 s"
[site]
latitude = "30 deg"
[table]
tilt = "30 deg"
azimuth = "10 deg"
max_rate = "50 deg/s"
max_acceleration = "20 deg/s^2"
[profile]
kind = "reversal"
rate = "10 deg/s"
dwell = "5 s"
cycles = 2
[temperature]
kind = "ramp"
start = "20 degC"
end = "30 degC"
slope = "30 K/min"
[instrument]
sampling = "50 Hz"
[instrument.gyro]
noise = { angle_random_walk = "1e-3 deg/sqrt(h)" }
[declared]
bias = { c = "1 deg/h" }
earth_rate = {}
[undeclared]
tone = [{ c = "1e-4 deg/s", s = "0 deg/s", f = "3 Hz" }, { c = "0 deg/s", s = "2e-4 deg/s", f = "5 Hz" }]
[output]
truth = true
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "small.toml"
    path.write_text(text)
    return path


def columns(manifest: Path) -> dict[str, Floats]:
    """Columns of a CSV recording by channel, in the file's units."""
    table = np.genfromtxt(manifest.parent / "recording.csv", delimiter=",", skip_header=1)
    return dict(zip(tomllib.loads(manifest.read_text())["channels"], table.T, strict=True))


def shortened(name: str, folder: Path) -> Path:
    """An example of at most 60 s."""
    text = (FOLDER / f"{name}.toml").read_text()
    text = re.sub(r"^duration = .*\n", "", text, flags=re.MULTILINE)
    return written(folder, 'duration = "60 s"\n' + text)


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_manifest_of_every_example_is_read_back(name: str, tmp_path: Path) -> None:
    scenario = load(FOLDER / f"{name}.toml")
    assert scenario.table.undeclared and 1e3 < scenario.samples < 1e6
    manifest = load_manifest(simulate(shortened(name, tmp_path), tmp_path / "out"))
    assert manifest.model.declared == scenario.declared
    assert manifest.model.targets == scenario.targets
    for target in scenario.targets:
        assert manifest.noise[target]
    values = columns(manifest.path)
    assert set(values) == set(manifest.channels)
    assert all(np.isfinite(v).all() and len(v) == round(60 * scenario.rig.rate) for v in values.values())


@pytest.mark.parametrize("name", EXAMPLES)
def test_undeclared_effects_are_in_no_file(name: str, tmp_path: Path) -> None:
    scenario = load(FOLDER / f"{name}.toml")
    out = simulate(shortened(name, tmp_path), tmp_path / "out").parent
    assert sorted(path.name for path in out.iterdir()) == ["manifest.toml", "recording.csv"]
    for path in out.iterdir():
        text = path.read_text()
        for key in scenario.table.undeclared:
            assert key.partition(":")[0] not in text
        assert "undeclared" not in text


def test_the_same_seed_gives_the_same_files(tmp_path: Path) -> None:
    path = written(tmp_path, SMALL)
    first, second, other = (simulate(path, tmp_path / n, seed).parent for n, seed in (("a", 1), ("b", 1), ("c", 2)))
    for file in ("recording.csv", "manifest.toml", "truth.json"):
        assert (first / file).read_bytes() == (second / file).read_bytes()
        assert (first / file).read_bytes() != (other / file).read_bytes()


def test_the_truth_says_all_that_was_simulated(tmp_path: Path) -> None:
    out = simulate(written(tmp_path, SMALL), tmp_path / "out", 7).parent
    truth = json.loads((out / "truth.json").read_text())
    assert truth["seed"] == 7
    found = {(e["effect"], e["origin"]) for e in truth["effects"]}
    noise = ("angle_random_walk", "noise")
    assert found == {noise, ("bias", "declared"), ("earth_rate", "declared"), ("tone", "undeclared")}
    bias = next(e for e in truth["effects"] if e["effect"] == "bias")["parameters"][0]
    assert bias == {"name": "c", "value": pytest.approx(np.pi / 648000), "unit": "rad/s"}
    assert sum(e["effect"] == "tone" for e in truth["effects"]) == 2


def test_binary_formats_hold_what_text_holds(tmp_path: Path) -> None:
    text = columns(simulate(written(tmp_path, SMALL), tmp_path / "csv"))
    for name in ("npz", "parquet"):
        if name == "parquet":
            parquet = pytest.importorskip("pyarrow.parquet")
        manifest = simulate(written(tmp_path, SMALL + f'format = "{name}"\n'), tmp_path / name)
        path = manifest.parent / f"recording.{name}"
        data = np.load(path) if name == "npz" else parquet.read_table(path).to_pydict()
        assert load_manifest(manifest).runs[0].format == name
        for channel, values in text.items():
            np.testing.assert_allclose(np.asarray(data[channel]), values, atol=6e-10)


def test_whole_pulses_lose_no_angle(tmp_path: Path) -> None:
    pulses = SMALL.replace("noise = {", 'quantity = "increment"\nunit = "0.5 arcsec"\npulses = true\nnoise = {')
    counts = columns(simulate(written(tmp_path, pulses), tmp_path / "a"))["gyro"]
    rate = columns(simulate(written(tmp_path, SMALL), tmp_path / "b"))["gyro"]
    assert np.array_equal(counts, np.rint(counts))
    turned = np.cumsum(rate) / 50 * 3600 / 0.5
    phase = load(written(tmp_path, pulses)).phases(0, "gyro")
    left = turned + phase - np.cumsum(counts)
    assert left.min() >= -1e-3 and left.max() < 1 + 1e-3


def test_the_parked_vehicle_shows_gravity_through_its_gyros(tmp_path: Path) -> None:
    out = simulate(FOLDER / "parked_vehicle.toml", tmp_path / "out")
    values = columns(out)
    for target, gyro, sign in (("accel_x", "gyro_y", -1.0), ("accel_y", "gyro_x", 1.0)):
        angle = np.cumsum(values[gyro]) * ARCSEC
        t = values["time"]
        design = np.stack([np.ones_like(t), t, sign * angle], axis=1)
        coefficient = np.linalg.lstsq(design, values[target], rcond=None)[0][2]
        # 1.6 mrad of tilt against 4e-4 m/s^2 of white noise and half a sample: 1 % is above 10 sigma.
        assert coefficient == pytest.approx(9.797, rel=0.01)


def test_the_staircase_shows_its_undeclared_asymmetry(tmp_path: Path) -> None:
    values = columns(simulate(FOLDER / "staircase.toml", tmp_path / "out"))
    rate = np.diff(values["table_angle"], prepend=0.0) * 100
    design = np.stack([np.ones_like(rate), rate, np.abs(rate)], axis=1)
    fitted = np.linalg.lstsq(design, values["gyro"] - rate, rcond=None)[0]
    # 0.067 deg/sqrt(h) over 780 s at 15 deg/s: 3 ppm of white noise, some more of the coloured: 5 sigma.
    assert fitted[2] == pytest.approx(300e-6, abs=20e-6)
    assert fitted[1] == pytest.approx(60e-6, abs=20e-6)


SILENT = re.sub(r"noise = .*|bias = .*|earth_rate = .*|tone = .*|latitude = .*", "", SMALL)


@pytest.mark.parametrize("quantity", ["rate", "increment"])
def test_the_exposure_of_a_recording_is_the_motion_that_the_plant_gave(quantity: str, tmp_path: Path) -> None:
    path = written(tmp_path, SILENT.replace("[instrument.gyro]", f'[instrument.gyro]\nquantity = "{quantity}"'))
    (recording,) = read_recordings(load_manifest(simulate(path, tmp_path / "out")))
    exposed = expose(recording, "gyro")
    rig = load(path).rig
    t = np.arange(1001) / 50
    motion = rig.plant.advance(rig.plant.begin(), None, t, np.empty((0, 1000)))[0].motions["gyro"]
    # No row tells where the interval of the first one began. Angles are written to 1e-9 deg, at 50 Hz.
    tolerance = 2e-9 * np.pi / 180 * 50
    np.testing.assert_allclose(exposed.y, motion.rate[1:], atol=tolerance)
    np.testing.assert_allclose(exposed.motion.rate, motion.rate[1:], atol=tolerance)
    np.testing.assert_allclose(exposed.u, motion.rate[1:], atol=tolerance)
    assert exposed.motion.angle is not None and motion.angle is not None
    np.testing.assert_allclose(exposed.motion.angle, motion.angle[1:], atol=1e-10)


BAD = {
    'kind = "reversal"|kind = "revesal"': "profile.kind",
    'dwell = "5 s"|': "profile.dwell is missing",
    'dwell = "5 s"|dwell = "5 m"': "profile.dwell",
    'dwell = "5 s"|dwell = "-5 s"': "more than zero",
    'dwell = "5 s"|dwell = "5 s"\nfrequency = "1 Hz"': "no meaning for kind = 'reversal'",
    'rate = "10 deg/s"|rate = "60 deg/s"': "asks for a rate of 60 deg/s, the table reaches 50 deg/s",
    'latitude = "30 deg"|latitude = "130 deg"': "site.latitude",
    "earth_rate = {}|": "wanted earth_rate = {} in [declared] or in [undeclared]",
    "bias = {|bais = {": "declared.bais",
    'bias = { c = "1 deg/h" }|bias = 1.0': "wanted a table",
    'c = "1 deg/h"|c = "1 deg"': "declared.bias.c",
    'c = "1 deg/h"|d = "1 deg/h"': "declared.bias.d is no parameter",
    'bias = { c = "1 deg/h" }|bias = {}': "declared.bias.c is missing",
    'bias = { c = "1 deg/h" }|bias = { c = "1 deg/h", targets = "gyro_x" }': "declared.bias.targets",
    '[undeclared]|[undeclared]\nbias = { c = "1 deg/h" }': "declared and undeclared",
    '[undeclared]|[undeclared]\nbase_tilt = { c = "9.8 m/s^2", drift = "0 m/s^3" }': "effect of accelerometers",
    '[undeclared]|angle_random_walk = { N = "1 deg/sqrt(h)" }\n[undeclared]': "belongs to [instrument.gyro",
    "angle_random_walk|angle_random_wolk": "instrument.gyro.noise.angle_random_wolk",
    'noise = {|unit = "kg"\nnoise = {': "instrument.gyro.unit",
    "noise = {|pulses = true\nnoise = {": "wanted quantity = 'increment'",
    'sampling = "50 Hz"|sampling = "0 Hz"': "instrument.sampling",
    'sampling = "50 Hz"|sampling = "1e12 Hz"': "samples; wanted from 2",
    'sampling = "50 Hz"|': "instrument.sampling",
    'slope = "30 K/min"|slope = "30 K"': "temperature.slope",
    'slope = "30 K/min"|soak = "3 s"': "temperature.soak has no meaning",
    "cycles = 2|cycles = 0": "profile.cycles",
    "[table]|[base]\n[table]": "both of [table] and [base]",
    "truth = true|decimals = 40": "output.decimals",
    "truth = true|thruth = true": "output.thruth",
    '[output]|[model]\ntarget = "accel_x"\n[output]': "model.target",
    "[site]|[[site]": "TOML",
}


@pytest.mark.parametrize("change", BAD)
def test_bad_input_ends_in_one_sentence_and_no_file(change: str, tmp_path: Path) -> None:
    old, _, new = change.partition("|")
    assert old in SMALL
    path = written(tmp_path, SMALL.replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        simulate(path, tmp_path / "out")
    message = str(caught.value)
    assert BAD[change] in message and str(path) in message and "\n" not in message
    assert not (tmp_path / "out").exists()


def test_a_missing_scenario_and_a_folder_that_is_a_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere.toml"):
        simulate(tmp_path / "nowhere.toml", tmp_path / "out")
    (tmp_path / "out").write_text("")
    with pytest.raises(InputError, match="cannot be made a folder"):
        simulate(written(tmp_path, SMALL), tmp_path / "out")


@pytest.mark.parametrize("form", ["csv", "npz"])
def test_a_run_that_breaks_off_leaves_no_file(form: str, tmp_path: Path) -> None:
    def interrupted(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(written(tmp_path, SMALL + f'format = "{form}"\n'), tmp_path / "out", progress=interrupted)
    assert not list((tmp_path / "out").iterdir())


def test_progress_ends_at_the_total(tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    simulate(FOLDER / "reversal.toml", tmp_path / "out", progress=lambda done, total: seen.append((done, total)))
    assert [done for done, _ in seen] == sorted({done for done, _ in seen})
    assert seen[-1] == (115200, 115200) and len(seen) > 2


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_scenario_is_read_or_refused_in_one_sentence(data: st.DataObject, tmp_path: Path) -> None:
    name = data.draw(st.sampled_from(EXAMPLES))
    text = (FOLDER / f"{name}.toml").read_text()
    start = data.draw(st.integers(0, len(text)))
    stop = start + data.draw(st.integers(0, 12))
    inserted = data.draw(
        st.text(st.characters(codec="utf-8"), max_size=6) | st.sampled_from(["-", "1e300", "nan", "0"])
    )
    path = tmp_path / "damaged.toml"
    path.write_bytes((text[:start] + inserted + text[stop:]).encode())
    try:
        load(path)
    except InputError as error:
        assert "\n" not in str(error)
