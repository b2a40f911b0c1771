"""What was found as an object: saved, read back, applied to recordings, and those traced again.

Seeds are fixed. A search has a false alarm with a probability of 1 % at most.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from command import run
from hypothesis import given, settings
from hypothesis import strategies as st

from insenv.calibration import Calibration, Parameter, Run, Target, Term, calibration, correct, load_calibration
from insenv.calibration.write import summary
from insenv.close import close, opened
from insenv.core.errors import InputError
from insenv.core.recording import Channel, Floats, Recording
from insenv.data.fingerprint import fingerprint
from insenv.data.load import read_recordings
from insenv.effects.catalogue import CATALOGUE, by_key
from insenv.identify.findings import Findings
from insenv.scenario import simulate

SCENARIO = """
duration = "20 min"
[table]
max_rate = "100 deg/s"
max_acceleration = "50 deg/s^2"
[profile]
PROFILE
[instrument]
sampling = "10 Hz"
[instrument.gyro]
noise = { angle_random_walk = "0.01 deg/sqrt(h)" }
[temperature]
kind = "cycle"
levels = ["25 degC", "33 degC", "20 degC", "28 degC"]
slope = "2 K/min"
soak = "2 min"
[output]
format = "npz"
[declared]
bias = { c = "0.5 deg/h" }
scale_factor = { c = "20 ppm" }
[undeclared]
"""
STAIRCASE = """kind = "staircase"
rates = ["10 deg/s", "-10 deg/s", "30 deg/s", "-30 deg/s", "20 deg/s", "-20 deg/s", "5 deg/s", "-5 deg/s", "15 deg/s",
    "-15 deg/s", "30 deg/s", "-10 deg/s"]
dwell = "100 s" """
SINE = 'kind = "sine"\namplitude = "30 deg/s"\nfrequency = "0.02 Hz"'
ASYMMETRY = 'scale_factor_asymmetry = { c = "20 ppm" }'
WARM_UP = 'bias_warm_up = { c = "3 deg/h", tau = "200 s" }'
LAG = 'bias_thermal_lag = { c = "0.3 deg/h/K", tau = "150 s" }'
#: Undeclared effects, by what they are called here, with their profiles; a warm-up is one of "two".
CASES = {
    "asymmetry": (ASYMMETRY, STAIRCASE),
    "encoder": ('encoder_harmonic = { c = "3 arcsec", s = "-1 arcsec" }', STAIRCASE),
    "thermal lag": (LAG, STAIRCASE),
    "tone": ('tone = { c = "1 deg/h", s = "1 deg/h", f = "0.0431 Hz" }', STAIRCASE),
    "fast tone": ('tone = { c = "20 deg/h", s = "10 deg/h", f = "3.3 Hz" }', STAIRCASE),
    "step": ('bias_step = { c = "1.2 deg/h", t0 = "423 s" }', STAIRCASE),
    "lock-in": ('lock_in = { W_L_squared = "6e-3 (deg/s)^2" }', STAIRCASE),
    "skew": ('timing_skew = { c = "-1 ms" }', SINE),
    "hold": ('sample_hold = { c = 1, hold = "0.5 s" }', SINE),
    "two": (ASYMMETRY + "\n" + WARM_UP, STAIRCASE),
}
QUICK = ("asymmetry", "encoder", "hold", "two")


@dataclass(frozen=True)
class Made:
    """A recording, what was found on it, and the calibration."""

    manifest: Path
    found: Findings
    calibration: Calibration

    def recording(self) -> Recording:
        (recording,) = read_recordings(opened(self.manifest))
        return recording


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("calibration")


@cache
def simulated(folder: Path, name: str, seed: int = 1) -> Path:
    undeclared, profile = CASES[name]
    scenario = folder / f"{name.replace(' ', '_')}.toml"
    scenario.write_text(SCENARIO.replace("PROFILE", profile) + undeclared)
    return simulate(scenario, folder / f"{scenario.stem}_{seed}", seed)


@cache
def made(folder: Path, name: str) -> Made:
    manifest = simulated(folder, name)
    found = close(manifest)
    return Made(manifest, found, calibration(found, opened(manifest)))


# --- the round trip


@pytest.mark.parametrize("name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in CASES])
def test_a_corrected_recording_has_nothing_left(name: str, folder: Path) -> None:
    case = made(folder, name)
    assert case.found.verdict == "effects-found"
    wanted = {line.partition(" ")[0] for line in CASES[name][0].split("\n")}
    assert {added.effect for added in case.found.targets[0].added} == wanted

    file = folder / f"{name}.json"
    case.calibration.save(file)
    assert load_calibration(file) == case.calibration
    path, (done,) = correct(load_calibration(file), opened(case.manifest), folder / f"{name} corrected")
    assert done.run == 1 and not done.left
    assert {said.effect.partition(":")[0] for said in done.taken} == {"bias", "scale_factor", *wanted}

    (written,) = read_recordings(opened(path))
    assert fingerprint(written) == fingerprint(done.recording)
    again = close(path).targets[0]
    assert again.verdict == "nothing-significant"
    for estimate in again.estimates_after:
        # Of the same noise: what is left is what the linearisation of the shapes lost.
        assert abs(estimate.value) < estimate.sd


@pytest.mark.parametrize("name", ["encoder", pytest.param("skew", marks=pytest.mark.slow)])
def test_an_error_of_the_reference_is_taken_out_of_the_reference(name: str, folder: Path) -> None:
    case = made(folder, name)
    measured, done = case.recording(), case.calibration.explain(case.recording())
    (said,) = (s for s in done.taken if s.effect.startswith(("encoder_harmonic", "timing_skew")))
    assert said.channel == "table_angle"
    alone = msgspec.structs.replace(
        case.calibration,
        targets=[msgspec.structs.replace(t, terms=t.terms[2:]) for t in case.calibration.targets],
    ).apply(measured)
    np.testing.assert_array_equal(alone.values("gyro", "rad/s"), measured.values("gyro", "rad/s"))
    shift = alone.values("table_angle", "rad") - measured.values("table_angle", "rad")
    a = measured.values("table_angle", "rad")
    value = {p.name: p.value for p in case.calibration.targets[0].terms[2].parameters}
    if name == "encoder":  # a constant is no error of the rate
        expected = value["c"] * np.cos(a) + value["s"] * np.sin(a)
    else:
        expected = -value["c"] * np.gradient(a, measured.t)
    left = shift - expected
    assert np.ptp(left[5:-5]) < 0.01 * np.ptp(expected)


def test_what_was_found_without_what_was_declared(folder: Path) -> None:
    case = made(folder, "two")
    effects = [said.effect for said in case.calibration.found().explain(case.recording()).taken]
    assert sorted(effects) == ["bias_warm_up", "scale_factor_asymmetry"]


def test_the_covariance_is_that_of_the_parameters(folder: Path) -> None:
    (target,) = made(folder, "two").calibration.targets
    matrix = np.array(target.covariance)
    assert matrix.shape == (5, 5) and np.linalg.eigvalsh(matrix).min() > 0
    for term in target.terms:
        for p in term.parameters:
            assert p.row is not None and p.sd == pytest.approx(np.sqrt(matrix[p.row, p.row]), rel=1e-9)
    # Bias and warm-up are seen together: they pull at each other.
    rows = {(t.effect, p.name): p.row for t in target.terms for p in t.parameters}
    assert matrix[rows["bias", "c"], rows["bias_warm_up", "c"]] < 0


# --- another recording


def test_on_another_recording_only_what_carries_over_is_taken_out(folder: Path) -> None:
    case = made(folder, "two")
    (other,) = read_recordings(opened(simulated(folder, "two", 2)))
    done = case.calibration.explain(other)
    assert done.run is None
    assert [said.effect for said in done.taken] == ["scale_factor", "scale_factor_asymmetry"]
    reasons = {said.effect: said.reason for said in done.left}
    assert "power-up" in reasons["bias"] and "clock" in reasons["bias_warm_up"]
    text = summary(case.calibration, [done])
    assert "taken out: scale_factor, scale_factor_asymmetry" in text and "left: bias_warm_up (goes by" in text


def test_without_a_table_the_output_itself_is_the_input(folder: Path) -> None:
    case = made(folder, "asymmetry")
    (other,) = read_recordings(opened(simulated(folder, "asymmetry", 2)))
    field = replace(other, channels={"gyro": other.channels["gyro"]})
    with_table = case.calibration.apply(other).values("gyro", "rad/s")
    alone = case.calibration.apply(field).values("gyro", "rad/s")
    # Errors of 40 ppm of what is left of 40 ppm: products that the model leaves out, and ends of ramps.
    assert np.abs(alone - with_table).max() < 1e-8
    assert np.abs(alone - other.values("gyro", "rad/s")).max() > 1e-5


def bare(effect: str, *parameters: tuple[str, float, str], **changed: Any) -> Calibration:
    terms = [Term(effect, "added", [Parameter(n, v, 0.1 * abs(v), u) for n, v, u in parameters], **changed)]
    runs = [Run("run", 64 * "0", np.pi / 2, "RFU")]
    target = Target("gyro", "rad/s", "effects-found", terms)
    return Calibration("insenv.calibration/1", "0", "t", "m.toml", 64 * "0", 298.15, False, runs, [target])


def gyro(values: Floats, **channels: Channel) -> Recording:
    return Recording(0.1 * np.arange(1.0, len(values) + 1), {"gyro": Channel(values, "rad/s", "interval"), **channels})


def test_an_inverse_is_exact_where_it_settles() -> None:
    true = 0.5 * np.sin(0.05 * np.arange(400))
    reading = gyro(true * 1.2)
    corrected = bare("scale_factor", ("c", 0.2, "1")).apply(reading).values("gyro", "rad/s")
    np.testing.assert_allclose(corrected[1:], true[1:], atol=1e-12)


def test_a_correction_that_does_not_settle_is_refused() -> None:
    with pytest.raises(InputError, match=r"recording: gyro: scale_factor cannot be taken out .* wanted a recording"):
        bare("scale_factor", ("c", 1.3, "1")).apply(gyro(np.ones(50)))


@pytest.mark.parametrize(
    ("effect", "parameters", "changed", "reason"),
    [
        ("bias_temperature:1", [("c", 1e-6, "rad/s/K")], {}, "needs the channel temperature"),
        ("spline_rate", [], {"generic": True}, "a curve whose cause is not known"),
        ("earth_rate", [("c", 1e-5, "rad/s"), ("s", 0.0, "rad/s")], {}, "a true input, no error"),
        ("angle_locked_rate:1", [("c", 1e-5, "rad/s"), ("s", 0.0, "rad/s")], {}, "belongs to the place"),
        ("encoder_harmonic:2", [("c", 1e-5, "rad"), ("s", 0.0, "rad")], {}, "an error of the reference"),
        ("bias", [("c", 1e-5, "rad/s")], {"run_dependent": True}, "changes from one power-up to the next"),
        ("bias_step", [("c", 1e-5, "rad/s"), ("t0", 3.0, "s")], {}, "goes by the clock"),
        ("scale_factor", [("c", 1e-5, "1")], {"confounded_with": ["lock_in"]}, "could not be told from lock_in"),
        ("scale_factor", [("c", 1e-5, "1")], {"fitted": False}, "no residual shows it"),
        ("tone", [("f", 3.0, "Hz"), ("amplitude", 1e-5, "rad/s")], {}, "a line that wanders"),
    ],
)  # fmt: skip
def test_what_does_not_carry_over_is_named(
    effect: str, parameters: list[tuple[str, float, str]], changed: dict[str, Any], reason: str, tmp_path: Path
) -> None:
    one = bare(effect, *parameters, **changed)
    assert load_calibration(one.save(tmp_path / "c.json")) == one
    done = one.explain(gyro(np.ones(50)))
    assert not done.taken and done.left[0].reason.startswith(reason)
    np.testing.assert_array_equal(done.recording.values("gyro", "rad/s"), np.ones(50))


def test_a_recording_that_the_calibration_is_not_of_is_refused() -> None:
    made_of = bare("scale_factor", ("c", 1e-5, "1"))
    with pytest.raises(InputError, match="no channel that the calibration is of; wanted 'gyro'"):
        made_of.apply(Recording(np.arange(5.0), {"accel": Channel(np.ones(5), "m/s^2")}))
    with pytest.raises(InputError, match="channel 'gyro' is in m/s\\^2, wanted in rad/s"):
        made_of.apply(Recording(np.arange(5.0), {"gyro": Channel(np.ones(5), "m/s^2")}))
    with pytest.raises(InputError, match="wanted site.latitude"):
        msgspec.structs.replace(made_of, with_earth=True).apply(gyro(np.ones(5)))


def test_a_fingerprint_knows_samples_and_their_meaning_and_no_names() -> None:
    one = gyro(np.array([0.0, 1.0, 2.0]))
    assert fingerprint(replace(one, label="other")) == fingerprint(one)
    assert fingerprint(gyro(np.array([-0.0, 1.0, 2.0]))) == fingerprint(one)
    others = [
        gyro(np.array([0.0, 1.0, 2.1])),
        replace(one, t=one.t + 1e-9),
        replace(one, channels={"gyro_x": one.channels["gyro"]}),
        replace(one, channels={"gyro": replace(one.channels["gyro"], covers="instant")}),
        replace(one, channels={"gyro": replace(one.channels["gyro"], delay=0.01)}),
    ]
    assert len({fingerprint(r) for r in (one, *others)}) == 1 + len(others)


def test_an_effect_that_says_that_it_goes_by_time_is_tied_to_its_run() -> None:
    timed = {effect.id for effect in CATALOGUE if effect.of_time}
    assert timed == {
        *("bias_drift", "bias_warm_up", "bias_step", "scale_factor_drift", "scale_factor_warm_up"),
        *("sample_hold", "tone", "base_tilt", "spline_time"),
    }
    assert by_key("encoder_harmonic").belongs == "reference"


# --- the file


def tree() -> dict[str, Any]:
    document: dict[str, Any] = msgspec.to_builtins(bare("scale_factor", ("c", 1e-5, "1")))
    return document


@pytest.mark.parametrize(
    ("path", "value", "sentence"),
    [
        ((), [], r"the calibration = \[\]; wanted a table"),
        (("schema",), "insenv.calibration/2", r"schema = 'insenv.calibration/2'; wanted"),
        (("sha256",), "abc", "sha256 = 'abc'"),
        (("colour",), 1, "unknown key 'colour'"),
        (("with_earth",), "yes", "with_earth = 'yes'; wanted true or false"),
        (("targets", 0, "unit"), "deg/s", r"targets\[0\].unit = 'deg/s'; wanted one of"),
        (("targets", 0, "terms", 0, "effect"), "bais", r"targets\[0\].terms\[0\].effect: unknown effect 'bais'"),
        (("targets", 0, "terms", 0, "effect"), "lock_in_wander", "is driven by chance"),
        (("targets", 0, "terms", 0, "effect"), "bias_warm_up", "unit = '1'; wanted 'rad/s'"),
        (("targets", 0, "terms", 0, "runs"), [2], "is of run 2; wanted runs from 1 to 1"),
        (("targets", 0, "terms", 0, "parameters", 0, "name"), "k", r"name = 'k'; wanted one of c"),
        (("targets", 0, "terms", 0, "parameters", 0, "unit"), "ppm", "unit = 'ppm'; wanted '1'"),
        (("targets", 0, "terms", 0, "parameters", 0, "sd"), -1.0, "wanted finite numbers and no negative sd"),
        (("targets", 0, "terms", 0, "parameters", 0, "value"), "5", "value = '5'"),
        (("targets", 0, "terms", 0, "parameters", 0, "row"), 0, "row = 0; the covariance has 0 rows"),
        (("targets", 0, "covariance"), [[1.0, 2.0]], "covariance has rows of other lengths"),
    ],
)
def test_a_wrong_file_ends_in_one_sentence(path: tuple[Any, ...], value: Any, sentence: str, tmp_path: Path) -> None:
    document: Any = tree()
    node = document
    for step in path[:-1]:
        node = node[step]
    if path:
        node[path[-1]] = value
    file = tmp_path / "c.json"
    file.write_text(json.dumps(document if path else value))
    with pytest.raises(InputError, match=sentence) as caught:
        load_calibration(file)
    assert str(file) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "not JSON"),
        (b"{", "not JSON"),
        (b"\xff\xfe", "not JSON"),
        (b"[" * 100000, "nested too deeply"),
        (b'{"schema": NaN}', "NaN is no number of JSON"),
    ],
)
def test_what_is_no_json_is_refused(content: bytes, sentence: str, tmp_path: Path) -> None:
    (tmp_path / "c.json").write_bytes(content)
    with pytest.raises(InputError, match=sentence):
        load_calibration(tmp_path / "c.json")
    with pytest.raises(InputError, match="cannot be read"):
        load_calibration(tmp_path / "none.json")


SCALARS: st.SearchStrategy[Any] = (
    st.none() | st.booleans() | st.integers(-3, 10**6) | st.floats() | st.text(max_size=5) | st.just([])
)


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_any_change_of_a_file_is_a_calibration_or_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    document: Any = tree()
    node, key = document, data.draw(st.sampled_from(sorted(document)))
    while isinstance(node[key], dict | list) and node[key] and data.draw(st.booleans()):
        node = node[key]
        key = data.draw(st.sampled_from(sorted(node) if isinstance(node, dict) else list(range(len(node)))))
    node[key] = data.draw(SCALARS)
    file = tmp_path_factory.mktemp("any") / "c.json"
    file.write_text(json.dumps(document))
    try:
        found = load_calibration(file)
        found.apply(gyro(np.linspace(0.0, 1.0, 30)))
    except InputError as error:
        assert "\n" not in str(error)


# --- the command


def test_the_command_writes_and_applies_a_calibration(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    manifest, file = simulated(folder, "asymmetry"), tmp_path / "cal.json"
    effects = "scale_factor_asymmetry,scale_factor_cubic"
    ended = run(capsys, monkeypatch, "close-loop", manifest, "--effects", effects, "--calibration", file)
    assert ended.status == 0 and load_calibration(file).targets[0].verdict == "effects-found"
    ended = run(capsys, monkeypatch, "apply", file, manifest, "--out", tmp_path / "out")
    assert ended.status == 0
    assert "gyro: taken out: bias, scale_factor, scale_factor_asymmetry" in ended.out
    assert ended.out.rstrip().endswith(str(tmp_path / "out" / "manifest.toml"))
    text = (tmp_path / "out" / "manifest.toml").read_text()
    assert ", corrected" in text and "angle_random_walk" in text

    over = run(capsys, monkeypatch, "apply", file, manifest, "--out", manifest.parent)
    assert over.status == 2 and "would be written over; wanted another folder" in over.err
    for wrong in (tmp_path, tmp_path / "no" / "cal.json"):
        assert run(capsys, monkeypatch, "close-loop", manifest, "--calibration", wrong).status == 2
    twice = run(capsys, monkeypatch, "close-loop", manifest, "--calibration", file, "--json", file)
    assert twice.status == 2 and "wanted two files" in twice.err


def test_every_run_keeps_its_own_bias(tmp_path: Path) -> None:
    """Two runs of one gyro, of which the second is held out."""
    rng, t = np.random.default_rng(3), 0.1 * np.arange(1, 3001)
    table = np.array([0.2, -0.2, 0.1, -0.1])[(t // 20 % 4).astype(int)]
    for k, level in ((1, 1e-4), (2, -3e-4)):
        reading = table * (1 + 5e-5) + level + 1e-4 * np.abs(table) + 1e-6 * rng.standard_normal(len(t))
        np.savez(tmp_path / f"r{k}.npz", time=t, gyro=reading, table_rate=table)
    channels = 'time = { unit = "s" }\n' + "".join(
        f'{name} = {{ unit = "rad/s", covers = "interval" }}\n' for name in ("gyro", "table_rate")
    )
    model = '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'

    def traced(held_out: str) -> tuple[Calibration, Path]:
        path = tmp_path / "two.toml"
        path.write_text(f'data = ["r1.npz", "r2.npz"]\n[channels]\n{channels}{model}[held_out]\n{held_out}\n')
        return calibration(close(path, ["scale_factor_asymmetry"]), opened(path)), path

    both, path = traced('start = "200 s"')
    (bias,) = (term for term in both.targets[0].terms if term.effect == "bias")
    assert bias.run_dependent and {p.run: round(p.value, 5) for p in bias.parameters} == {1: 1e-4, 2: -3e-4}
    for recording in map(both.apply, read_recordings(opened(path))):
        assert abs(recording.values("gyro", "rad/s").mean() - table.mean()) < 1e-6

    one, path = traced("runs = [2]")
    first, second = map(one.explain, read_recordings(opened(path)))
    assert [s.effect for s in first.taken] == ["bias", "scale_factor", "scale_factor_asymmetry"]
    assert [s.effect for s in second.taken] == ["scale_factor", "scale_factor_asymmetry"]
    assert second.left[0].reason == "no fit saw run 2, which has its own"
