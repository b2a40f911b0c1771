"""Facts about manifests: what they mean in SI units, their defaults, and what is refused."""

import math
import re
from dataclasses import astuple
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insenv.core.errors import InputError
from insenv.core.recording import Mounting, Site
from insenv.data.load import read_recordings
from insenv.data.manifest import HeldOut, Manifest, load_manifest
from insenv.data.stream import stream_run

DEG = math.pi / 180

FULL = """
title = "Rate-biased laser gyro on a tilted table"
data  = ["run1.csv", "run2.csv"]

[channels]
time        = { column = "time_s", unit = "s" }
gyro        = { column = "gyro_pulses", unit = "0.46634601 arcsec", quantity = "increment" }
table_angle = { column = "table_deg", unit = "deg", wrapped = true }
table_rate  = { column = "cmd_deg_s", unit = "deg/s", covers = "interval", delay = "10 ms" }
temperature = { column = 4, unit = "degC" }

[site]
latitude = "28.2 deg"
gravity  = "9.79 m/s^2"

[mounting]
tilt = "30 deg"
axes = "FRD"

[model]
target   = "gyro"
declared = ["bias", "scale_factor", "earth_rate", "bias_temperature:3"]
reference_temperature = "20 degC"
bias = "per-run"

[noise]
angle_random_walk = "3e-4 deg/sqrt(h)"
bias_instability  = "5e-3 deg/h"
rate_random_walk  = "1e-3 deg/h/sqrt(h)"
quantization      = "0.5 arcsec"

[held_out]
runs = [2]
averaging = "5 s"

[fit]
rows = [[400, 6194]]

[source]
repository = "someone/something"
sha256 = "00ff"
"""

SMALL = """
data = "run.csv"
channels.time = { rate = "100 Hz" }
channels.gyro_x = { unit = "deg/s" }
channels.accel_x = { unit = "m/s^2" }
model = { target = ["gyro_x", "accel_x"], declared = ["bias"] }
"""


def load(folder: Path, text: str) -> Manifest:
    path = folder / "run.toml"
    path.write_text(text, encoding="utf-8")
    return load_manifest(path)


def test_every_key_arrives_in_si_units(tmp_path: Path) -> None:
    manifest = load(tmp_path, FULL)
    assert [run.file for run in manifest.runs] == [tmp_path / "run1.csv", tmp_path / "run2.csv"]
    assert [run.label for run in manifest.runs] == ["run1.csv", "run2.csv"]
    site, mounting = manifest.runs[0].site, manifest.runs[0].mounting
    assert astuple(site) == (pytest.approx(28.2 * DEG), 0.0, 9.79)
    assert astuple(mounting) == (pytest.approx(30 * DEG), "FRD", "", 0.0, None)
    gyro, rate = manifest.channels["gyro"], manifest.channels["table_rate"]
    assert (gyro.column, gyro.unit, gyro.quantity) == ("gyro_pulses", "0.46634601 arcsec", "increment")
    assert rate.covers == "interval"
    assert rate.delay == pytest.approx(0.01)
    assert manifest.channels["table_angle"].wrapped
    assert manifest.channels["temperature"].column == 4
    assert manifest.model.targets == ("gyro",)
    assert manifest.model.declared == ("bias", "scale_factor", "earth_rate", "bias_temperature:3")
    assert manifest.model.reference_temperature == pytest.approx(293.15)
    assert manifest.model.bias == "per-run"
    assert manifest.noise["gyro"] == {
        "angle_random_walk": pytest.approx(3e-4 * DEG / 60),
        "bias_instability": pytest.approx(5e-3 * DEG / 3600),
        "rate_random_walk": pytest.approx(1e-3 * DEG / 3600 / 60),
        "quantization": pytest.approx(0.5 * DEG / 3600),
    }
    assert manifest.held_out == HeldOut(runs=(2,), averaging=5.0)
    assert manifest.fit_rows == ((400, 6194),)
    assert manifest.source is not None
    assert (manifest.source.repository, manifest.source.sha256) == ("someone/something", ("00ff",))


def test_defaults(tmp_path: Path) -> None:
    manifest = load(tmp_path, SMALL)
    assert manifest.title == "run"
    assert manifest.runs[0].mounting == Mounting()
    assert manifest.runs[0].site == Site()
    assert manifest.channels["gyro_x"].column == "gyro_x"
    assert manifest.model.reference_temperature == pytest.approx(298.15)
    assert manifest.held_out == HeldOut()
    assert manifest.fit_rows == ()
    assert manifest.noise == {"gyro_x": {}, "accel_x": {}}
    assert manifest.procedure == "static"
    assert not manifest.time_is_row


def test_a_table_makes_the_procedure_a_rate_table(tmp_path: Path) -> None:
    assert load(tmp_path, FULL).procedure == "rate-table"


def test_data_may_lie_in_another_folder(tmp_path: Path) -> None:
    path = tmp_path / "run.toml"
    path.write_text(SMALL)
    assert load_manifest(path, tmp_path / "cache").runs[0].file == tmp_path / "cache" / "run.csv"


def test_a_run_takes_from_the_manifest_what_it_leaves_out(tmp_path: Path) -> None:
    text = (
        SMALL.replace('data = "run.csv"', "")
        + """
[mounting]
tilt = "10 deg"
axes = "FLU"
[site]
latitude = "-30 deg"
[[runs]]
file = "up.csv"
[[runs]]
file = "down.csv"
label = "downwards"
mounting.tilt = "-10 deg"
site.altitude = "1 km"
"""
    )
    up, down = load(tmp_path, text).runs
    assert (up.label, down.label) == ("up.csv", "downwards")
    assert astuple(up.mounting) == (pytest.approx(10 * DEG), "FLU", "", 0.0, None)
    assert astuple(down.mounting) == (pytest.approx(-10 * DEG), "FLU", "", 0.0, None)
    assert (up.site.altitude, down.site.altitude) == (0.0, 1000.0)
    assert up.site.latitude == down.site.latitude == pytest.approx(-30 * DEG)


@pytest.mark.parametrize(
    ("file", "format_name"),
    [("a.csv", "csv"), ("a.TSV", "csv"), ("a.txt", "text"), ("a.log", "text"), ("a.npz", "npz"),
     ("a.mat", "mat"), ("a.parquet", "parquet"), ("a.imu", "psins-imu")],
)  # fmt: skip
def test_the_suffix_tells_the_format(tmp_path: Path, file: str, format_name: str) -> None:
    assert load(tmp_path, SMALL.replace("run.csv", file)).runs[0].format == format_name


def test_noise_goes_to_the_targets_whose_dimension_it_has(tmp_path: Path) -> None:
    text = (
        SMALL
        + """
[noise]
angle_random_walk = "0.6 deg/sqrt(h)"
velocity_random_walk = "0.6 m/s/sqrt(h)"
bias_instability = "1 deg/h"
[noise.accel_x]
bias_instability = "100 ug"
quantization = "1 mm/s"
"""
    )
    noise = load(tmp_path, text).noise
    assert noise["gyro_x"] == {
        "angle_random_walk": pytest.approx(0.01 * DEG),
        "bias_instability": pytest.approx(DEG / 3600),
    }
    assert noise["accel_x"] == {
        "angle_random_walk": pytest.approx(0.01),
        "bias_instability": pytest.approx(100 * 9.80665e-6),
        "quantization": pytest.approx(1e-3),
    }


def test_a_data_sheet_may_state_noise_of_channels_that_are_no_targets(tmp_path: Path) -> None:
    """A maker states gyros and accelerometers together; a channel that is not there is still a mistake."""
    noise = '[noise]\nangle_random_walk = "0.6 deg/sqrt(h)"\nvelocity_random_walk = "0.6 m/s/sqrt(h)"\n'
    of_gyro = SMALL.replace('["gyro_x", "accel_x"]', '"gyro_x"')
    assert load(tmp_path, of_gyro + noise).noise == {"gyro_x": {"angle_random_walk": pytest.approx(0.01 * DEG)}}
    alone = of_gyro.replace('channels.accel_x = { unit = "m/s^2" }\n', "")
    with pytest.raises(InputError, match="no target is an accelerometer"):
        load(tmp_path, alone + noise)


def test_a_psins_log_needs_no_channels(tmp_path: Path) -> None:
    manifest = load(tmp_path, 'data = "a.imu"\n[model]\ntarget = "accel_y"\ndeclared = []')
    assert list(manifest.channels) == ["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"]


def test_the_row_index_as_time_is_marked(tmp_path: Path) -> None:
    assert load(tmp_path, SMALL.replace('rate = "100 Hz"', 'column = "row"')).time_is_row


# What is replaced by what, and words that the sentence must have: key, what was found, what was wanted.
WRONG = [
    ("[model]", "[modle]", ["'modle'", "'model'"]),
    ('target   = "gyro"', "", ["'model.target'", "missing"]),
    ('target   = "gyro"', 'target = "gryo"', ["model.target", "'gryo'", "'gyro'"]),
    ('target   = "gyro"', 'target = "temperature"', ["model.target", "'temperature'", "gyro"]),
    ('target   = "gyro"', "target = []", ["model.target", "at least one"]),
    ('target   = "gyro"', 'target = ["gyro", "gyro"]', ["model.target", "once"]),
    ('"earth_rate"', '"Earth rate"', ["model.declared", "'Earth rate'", "name:order"]),
    ('"earth_rate"', '"bias"', ["model.declared", "once"]),
    ('"earth_rate"', "7", ["model.declared[2]", "7", "text"]),
    ('bias = "per-run"', 'bias = "none"', ["model.bias", "'none'", "'per-run'"]),
    ('"20 degC"', '"20 deg"', ["model.reference_temperature", "20 deg"]),
    ('"20 degC"', '"-300 degC"', ["model.reference_temperature", "-300 degC", "more than zero"]),
    ("temperature = {", "temparature = {", ["'temparature'", "'temperature'"]),
    ('gyro        = { column', 'gyro = { colum', ["'channels.gyro.colum'", "'column'"]),
    ('"increment"', '"increments"', ["channels.gyro.quantity", "'increments'", "'rate'"]),
    ('"increment"', '"increment", covers = "instant"', ["channels.gyro.covers", "interval"]),
    ("wrapped = true", "wrapped = 1", ["channels.table_angle.wrapped", "1", "true"]),
    ("wrapped = true", 'rate = "1 Hz"', ["channels.table_angle.rate", "time"]),
    ("column = 4", "column = -1", ["channels.temperature.column", "-1"]),
    ("column = 4", "column = 1.5", ["channels.temperature.column", "1.5"]),
    ("column = 4", 'column = 4, quantity = "increment"', ["channels.temperature.quantity", "gyro"]),
    ('"10 ms"', '"10 mV"', ["channels.table_rate.delay", "10 mV"]),
    ('column = "time_s", unit = "s"', 'column = "time_s", rate = "1 Hz"', ["channels.time", "either"]),
    ('column = "time_s", unit = "s"', 'rate = "0 Hz"', ["channels.time.rate", "0 Hz", "more than zero"]),
    ('time        = { column = "time_s", unit = "s" }', "", ["channels.time", "100 Hz"]),
    ('"28.2 deg"', "28.2", ["site.latitude", "28.2", "unit"]),
    ('"28.2 deg"', '"28.2 degrs"', ["site.latitude", "28.2 degrs"]),
    ('"28.2 deg"', '"128.2 deg"', ["site.latitude", "128.2 deg", "90 deg"]),
    ('"9.79 m/s^2"', '"979 m/s^2"', ["site.gravity", "979 m/s^2", "10 m/s^2"]),
    ('"30 deg"', '"100 deg"', ["mounting.tilt", "100 deg", "90 deg"]),
    ('"FRD"', '"FRU"', ["mounting.axes", "'FRU'", "right-handed"]),
    ('"FRD"', '"xyz"', ["mounting.axes", "'xyz'", "RFU"]),
    ('"5e-3 deg/h"', '"5e-3 m/h"', ["noise.bias_instability", "5e-3 m/h"]),
    ('"5e-3 deg/h"', '"-5e-3 deg/h"', ["noise.bias_instability", "-5e-3 deg/h", "zero or more"]),
    ("bias_instability ", "bias_stability ", ["noise.bias_stability", "'bias_instability'"]),
    ("quantization  ", "velocity_random_walk ", ["noise.velocity_random_walk", "accelerometer"]),
    ("quantization      =", "gyro_x.quantization =", ["noise.gyro_x", "gyro"]),
    ("runs = [2]", "runs = [0]", ["held_out.runs", "0", "from 1 to 2"]),
    ("runs = [2]", "runs = [3]", ["held_out.runs", "3", "from 1 to 2"]),
    ("runs = [2]", "runs = []", ["held_out.runs", "at least one"]),
    ("runs = [2]", 'runs = [2]\nstart = "1 s"', ["held_out", "runs and start", "one of them"]),
    ("runs = [2]", "rows = [[5, 5]]", ["held_out.rows", "[5, 5]"]),
    ("runs = [2]", "rows = [5, 9]", ["held_out.rows[0]", "5", "list"]),
    ("runs = [2]", 'positions = "third"', ["held_out.positions", "'third'", "'even'"]),
    ("runs = [2]", 'start = "-1 s"', ["held_out.start", "-1 s"]),
    ('averaging = "5 s"', 'averaging = "0 s"', ["held_out.averaging", "0 s"]),
    ("rows = [[400, 6194]]", "row = 3", ["'fit.row'", "'rows'"]),
    ("[fit]", "[fit", ["line ", "TOML"]),
    ('"run1.csv", "run2.csv"', '"run1.csv", "run1.csv"', ["'run1.csv'", "twice"]),
    ('"run1.csv", "run2.csv"', "", ["data", "at least one"]),
    ('"run1.csv", "run2.csv"', '"run1.xyz", "run2.csv"', ["'run1.xyz'", "format"]),
    ("data  = [", "[[runs]]\nfile = 'a.csv'\n[channels.gyro_x]\nunit = [", ["channels.gyro_x.unit"]),
    ("data  =", "dta =", ["'dta'", "'data'"]),
    ("title =", 'format = "cvs"\ntitle =', ["format", "'cvs'", "'csv'"]),
    ("title =", "columns = 7\ntitle =", ["columns", "7", "float64-le"]),
    ("title =", 'format = "float64-le"\ntitle =', ["columns", "None", "float64-le"]),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "words"), WRONG, ids=[new.split("\n")[0][:40] for _, new, _ in WRONG])
def test_what_is_wrong_is_named(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    assert FULL.count(old) == 1
    with pytest.raises(InputError) as caught:
        load(tmp_path, FULL.replace(old, new))
    message = str(caught.value)
    assert message.startswith(f"{tmp_path / 'run.toml'}: ")
    assert "\n" not in message
    assert [word for word in words if word not in message] == []


def test_neither_and_both_of_data_and_runs_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="neither of 'data' and"):
        load(tmp_path, SMALL.replace('data = "run.csv"', ""))
    with pytest.raises(InputError, match="both of 'data' and"):
        load(tmp_path, SMALL + '[[runs]]\nfile = "b.csv"\n')


def test_the_line_of_a_syntax_error_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"run\.toml: line 3: not TOML"):
        load(tmp_path, 'title = "a"\n\ndata = \n')


def test_bytes_that_are_no_text_are_named_with_their_line(tmp_path: Path) -> None:
    path = tmp_path / "run.toml"
    path.write_bytes(b'title = "a"\ndata = "\xff"\n')
    with pytest.raises(InputError, match=r"run\.toml: line 2: byte 0xff"):
        load_manifest(path)


@pytest.mark.parametrize("name", ["missing.toml", ".", "nul\0.toml", "x" * 5000])
def test_a_manifest_that_cannot_be_opened(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        load_manifest(tmp_path / name)


TABLES = ("", "channels", "channels.gyro", "model", "site", "noise", "noise.gyro", "held_out", "fit")
KEYS = st.sampled_from([
    "data", "runs", "file", "format", "columns", "channels", "time", "gyro", "accel_x", "unit",
    "column", "quantity", "rate", "covers", "delay", "site", "latitude", "mounting", "tilt", "axes",
    "model", "target", "declared", "noise", "angle_random_walk", "held_out", "rows", "start", "fit",
    "source", "x",
])  # fmt: skip
TEXTS = st.sampled_from(["gyro", "accel_x", "a.csv", "s", "deg/s", "5 deg", "1 s", "RFU", "bias", "rate", "", "\n"])
LEAVES = st.one_of(TEXTS, st.text(max_size=8), st.integers(), st.floats(), st.booleans())


def toml(value: object) -> str:
    """Any tree of dicts, lists and leaves as an inline TOML value."""
    if isinstance(value, dict):
        return "{" + ", ".join(f'"{key}" = {toml(v)}' for key, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, str):
        return '"' + "".join(f"\\U{ord(c):08x}" for c in value) + '"'
    return str(value).lower()


TREES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=4),
    max_leaves=20,
)
MANIFESTS = st.dictionaries(KEYS, TREES, max_size=6).map(
    lambda tree: "\n".join(f"{key} = {toml(value)}" for key, value in tree.items()).encode()
)
EITHER = st.one_of(
    MANIFESTS, st.binary(max_size=200), st.text(max_size=200).map(lambda t: t.encode("utf-8", "replace"))
)


@settings(max_examples=300, derandomize=True, deadline=None)
@given(content=EITHER)
def test_any_content_is_a_manifest_or_an_input_error(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "any.toml"
    path.write_bytes(content)
    try:
        assert isinstance(load_manifest(path), Manifest)
    except InputError as error:
        assert "any.toml" in str(error)
        assert "\n" not in str(error)


@settings(max_examples=600, derandomize=True, deadline=None)
@given(table=st.sampled_from(TABLES), key=KEYS, value=TREES)
def test_any_value_in_any_table_is_a_manifest_or_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, table: str, key: str, value: object
) -> None:
    path = tmp_path_factory.getbasetemp() / "any.toml"
    head = f"[{table}]\n" if table else ""
    good = FULL if head in FULL else FULL + head
    path.write_text(good.replace(head, f"{head}{key} = {toml(value)}\n", 1), encoding="utf-8")
    try:
        load_manifest(path)
    except InputError as error:
        assert "\n" not in str(error)


STATED = """
[channels]
time = { column = "t", unit = "s" }
gyro = { column = "g", unit = "deg/s" }
[model]
target = "gyro"
declared = ["bias", "scale_factor"]
[[runs]]
file = "up.csv"
table_rate = "50 deg/s"
temperature = "-20 degC"
[[runs]]
file = "down.csv"
table_rate = "-50 deg/s"
temperature = "20 degC"
"""


def stated(folder: Path, old: str = "", new: str = "") -> Manifest:
    """Two files of three rows without a column for rate or temperature, beside `STATED` with a change."""
    for name in ("up", "down"):
        (folder / f"{name}.csv").write_text("t,g\n0,1\n1,2\n2,3\n")
    (folder / "run.toml").write_text(STATED.replace(old, new, 1) if old else STATED)
    return load_manifest(folder / "run.toml")


def test_what_no_column_has_may_be_stated_of_each_run(tmp_path: Path) -> None:
    manifest = stated(tmp_path)
    assert manifest.procedure == "rate-table"
    whole = read_recordings(manifest)
    chunks = [next(iter(stream_run(manifest, run))) for run in manifest.runs]
    for found in (whole, chunks):
        rates = [run.channels["table_rate"] for run in found]
        assert [c.values.tolist() for c in rates] == [[50 * DEG] * 3, [-50 * DEG] * 3]
        assert {(c.unit, c.covers, c.source) for c in rates} == {("rad/s", "interval", "command")}
        assert [run.channels["temperature"].values[0] for run in found] == pytest.approx([253.15, 293.15])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('temperature = "20 degC"', "", "runs[1] has no temperature"),
        ('"20 degC"', '"20 m"', "runs[1].temperature"),
        ('"20 degC"', '"-300 degC"', "runs[1].temperature = '-300 degC'; wanted no less than absolute zero"),
        ("[model]", 'table_rate = { column = "g", unit = "deg/s" }\n[model]', "channels.table_rate has a column"),
    ],
)
def test_what_is_stated_of_runs_and_cannot_be_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)):
        stated(tmp_path, old, new)
