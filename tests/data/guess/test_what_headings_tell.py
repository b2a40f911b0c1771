"""What the headings of a file tell of its columns: names, units in them, fields of known tools."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from drafts.columns import DT, TIME, asked, drafted, table, turned_by_hand, units
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.units import DEG, STANDARD_GRAVITY, scale_to_si
from insenv.data.guess.heading import read_heading
from insenv.data.guess.written import manifest_text
from insenv.data.manifest import load_manifest

# -------------------------------------------------------------------------------------------------- shapes of headers


_GYRO = st.sampled_from(
    ["gyro_{}", "gyr_{}", "g{}", "w{}", "Gyroscope {}", "imu.gyro.{}", "angular_velocity.{}", "omega_{}"]
)

_ACCEL = st.sampled_from(
    ["accel_{}", "acc_{}", "a{}", "Accelerometer {}", "imu.acc.{}", "linear_acceleration.{}", "f{}"]
)

_TIME = st.sampled_from(["t", "time", "Time", "timestamp", "Time elapsed"])
_RATE_UNITS = {"deg/s": DEG, "°/s": DEG, "dps": DEG, "rad/s": 1.0, "rads/s": 1.0, "deg/sec": DEG, "deg/h": DEG / 3600}
_FORCE_UNITS = {"m/s^2": 1.0, "m/s2": 1.0, "m/s²": 1.0, "g": STANDARD_GRAVITY, "G": STANDARD_GRAVITY}
_HAND = turned_by_hand()


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_whatever_the_header_what_is_told_is_true(data: st.DataObject, tmp_path: Path) -> None:
    """Names, units in brackets or not, delimiters, comments, rows of units, settings above: right, or asked."""
    rate, force = data.draw(st.sampled_from([*_RATE_UNITS])), data.draw(st.sampled_from([*_FORCE_UNITS]))
    brackets = data.draw(st.sampled_from([" ({})", " [{}]", "_none", "row"]))
    delimiter = data.draw(st.sampled_from([",", ";", "\t"]))
    upper = data.draw(st.booleans())
    gyro, accel, time = data.draw(_GYRO), data.draw(_ACCEL), data.draw(_TIME)
    names = [time, *(n.format(a.upper() if upper else a) for n in (gyro, accel) for a in "xyz"), "Status"]
    said = ["s", *[rate] * 3, *[force] * 3, "-"]
    lines = [data.draw(st.sampled_from(["", "# a comment", "Logger 3000", "Serial,12"]))]
    head = names if brackets in ("_none", "row") else [n + brackets.format(u) for n, u in zip(names, said, strict=True)]
    lines.append(data.draw(st.sampled_from(["", "# ", "% "])) + delimiter.join(head))
    lines += [delimiter.join(said)] if brackets == "row" else []
    columns = [np.arange(2400) * DT]
    columns += [_HAND[f"gyro_{a}"][:2400] / _RATE_UNITS[rate] for a in "xyz"]
    columns += [_HAND[f"accel_{a}"][:2400] / _FORCE_UNITS[force] for a in "xyz"]
    columns.append(np.zeros(2400))
    lines += [delimiter.join(f"{v:.9g}" for v in row) for row in zip(*columns, strict=True)]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(line for line in lines if line) + "\n", encoding="utf-8")
    found = drafted(path, procedure="static")  # it is turned by hand
    for channel in found.channels:
        kind = channel.name.split("_")[0]
        if channel.unit.value is not None and kind in ("gyro", "accel"):
            size = scale_to_si(channel.unit.value, {"gyro": "rate", "accel": "acceleration"}[kind], "")[0]
            assert size == pytest.approx({"gyro": _RATE_UNITS[rate], "accel": _FORCE_UNITS[force]}[kind]), channel
            assert names[1 + "xyz".index(channel.name[-1]) + 3 * (kind == "accel")] in channel.heading
    if brackets in (" ({})", " [{}]"):
        assert not found.questions and len(found.channels) == 7
    if not found.questions:
        (tmp_path / "a.toml").write_text(manifest_text(found, tmp_path / "a.toml"), encoding="utf-8")
        assert len(load_manifest(tmp_path / "a.toml").channels) == 7


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    content=st.binary(max_size=400)
    | st.text(alphabet="0123456789.,;\t\n -eE#%gyroxyzt[]()", max_size=400).map(str.encode)
)
@example(content=b"1 2\n3 4\n")
@example(content=b"t,g\n")
def test_any_file_ends_in_a_draft_or_in_one_sentence(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    try:
        found = drafted(path)
        tomllib.loads(manifest_text(found, tmp_path / "a.toml"))
    except InputError as error:
        assert str(error) and "\n" not in str(error)


@pytest.mark.parametrize(
    ("text", "kind", "axis", "unit"),
    [
        ("Gyro Output (rads/s)", "gyro", "", "rad/s"),
        ("Input Rate (RPM)", "table_rate", "", "RPM"),
        ("cmd_deg_s", "table_rate", "", "deg/s"),
        ("table_deg", "table_angle", "", "deg"),
        ("ustime", "time", "", "us"),
        ("TimeUS", "time", "", "us"),
        ("imu.temperature", "temperature", "", None),
        ("gyro_temp [degC]", "temperature", "", "degC"),
        ("Magnetometer X (uT)", "other", "x", None),
        ("linear_acceleration_covariance.0", "other", "", None),
        ("linear_acceleration_covariance0", "other", "", None),
        ("x_true (g)", "other", "x", None),
        ("high_g_x", "accel", "x", None),
        ("g_x", "gyro", "x", None),
        ("gyro_x_bias", "other", "x", None),
        ("gyro_accuracy", "other", "", None),
        ("gyro_timestamp", "other", "", None),
        ("time_min", "time", "", "min"),
        ("gyro [rad]", "gyro", "", None),
        ("field.angular_velocity.z", "gyro", "z", None),
        ("dtheta_x", "gyro", "x", None),
        ("GyroX", "gyro", "x", None),
        ("acc68Y", "accel", "y", None),
        ("accelXData", "accel", "x", None),
        ("gyroZRaw", "gyro", "z", None),
        ("xgyro", "gyro", "x", None),
        ("Yacc", "accel", "y", None),
        ("zmag", "other", "z", None),
        ("ACCEL_ZOUT", "accel", "z", None),
        ("gyroADC[1]", "gyro", "y", None),
        ("ang_vel_x", "gyro", "x", None),
        ("Accélération x (m/s^2)", "accel", "x", "m/s^2"),
        ("aceleração y", "accel", "y", None),
        ("角速度Z", "gyro", "z", None),
        ("Temps (s)", "time", "", "s"),
        ("temps [degC]", "temperature", "", "degC"),
        ("Zeit (s)", "time", "", "s"),
        ("time_μs", "time", "", "us"),
        ("acc1_x", "accel", "x", None),
        ("GyroZ2", "gyro", "z", None),
        ("gyro1", "gyro", "", None),
        ("accelZ_mps2", "accel", "z", "m/s^2"),
        ("Rotation Rate (X)", "gyro", "x", None),
        ("Acceleration (z)", "accel", "z", None),
        ("GPST", "time", "", None),
        ("n_samples", "row", "", None),
        ("signal", "", "", None),
    ],
)
def test_headings(text: str, kind: str, axis: str, unit: str | None) -> None:
    found = read_heading(text)
    assert (found.kind, found.axis) == (kind, axis)
    assert found.unit == unit or (found.unit and unit and found.unit.lower() == unit.lower())


# ------------------------------------------------------------------------------------------------ of tools and phones


def test_units_of_a_tool_are_taken_where_its_stamps_run_as_they_must(tmp_path: Path) -> None:
    """Kalibr counts nanoseconds and writes no units; the same headings beside seconds are somebody else's."""
    columns = turned_by_hand()
    names = {f"gyro_{a}": f"omega_{a}" for a in "xyz"} | {f"accel_{a}": f"alpha_{a}" for a in "xyz"}
    theirs = {names[name]: values for name, values in columns.items()}
    stamps = 1.4e18 + 1e7 * np.arange(8000.0)
    path = tmp_path / "a.csv"
    lines = [",".join(["timestamp", *theirs])]
    lines += [
        ",".join([f"{t:.0f}", *(f"{v:.9g}" for v in row)]) for t, *row in zip(stamps, *theirs.values(), strict=True)
    ]
    path.write_text("\n".join(lines) + "\n")
    found = {c.name: c.unit for c in drafted(path).channels}
    assert (found["time"].value, found["gyro_x"].value, found["gyro_x"].sure) == ("ns", "rad/s", "stated")
    assert found["accel_z"].value == "m/s^2"
    in_degrees = {n: v / DEG if n.startswith("omega") else v for n, v in theirs.items()}
    found = {c.name: c.unit for c in drafted(table(path, {"timestamp": TIME["time"], **in_degrees})).channels}
    assert (found["time"].value, found["gyro_x"].value) == ("s", None)


def test_fields_of_a_message_have_its_units_and_gravity_still_doubts_them(tmp_path: Path) -> None:
    """Tables of sensor_msgs/Imu, as tools write them, name no units; a driver may have put degrees into the field."""
    columns = turned_by_hand()
    names = {f"gyro_{a}": f"field.angular_velocity.{a}" for a in "xyz"}
    names |= {f"accel_{a}": f"field.linear_acceleration.{a}" for a in "xyz"}
    theirs = {**TIME, **{names[name]: values for name, values in columns.items()}}
    header = {"field.header.seq": np.arange(8000.0)}
    found = drafted(table(tmp_path / "a.csv", {**theirs, **header}))
    assert not asked(found)
    told = {channel.name: channel.unit for channel in found.channels}
    assert (told["gyro_y"].value, told["gyro_y"].sure, told["accel_x"].value) == ("rad/s", "stated", "m/s^2")
    degrees = {name: values / DEG if "angular" in name else values for name, values in theirs.items()}
    assert "gyro.unit" in asked(drafted(table(tmp_path / "b.csv", {**degrees, **header})))
    still = {"gyro_x": "angular_velocity.x", "accel_x": "orientation.w"}
    rest = {**TIME, **{still[name]: np.full(8000, 1e-3) for name in still}}
    assert units(drafted(table(tmp_path / "c.csv", rest)))["gyro"] == "rad/s"
    alone = {**TIME, "angular_velocity.x": np.random.default_rng(2).standard_normal(8000)}
    assert "gyro.unit" in asked(drafted(table(tmp_path / "d.csv", alone)))


PHONES = {
    "phyphox": ("Gyroscope.csv", "Time (s),X (rad/s),Y (rad/s),Z (rad/s)", {"time": "s", "gyro_x": "rad/s"}),
    "its accelerometer": ("data.csv", "Time (s),X (m/s^2),Y (m/s^2),Z (m/s^2)", {"time": "s", "accel_y": "m/s^2"}),
    "Sensor Logger": ("Gyroscope.csv", "seconds_elapsed,z,y,x", {"time": "s", "gyro_z": None}),
    "millis": ("GyroTest.csv", "Milliseconds,X,Y,Z", {"time": "ms", "gyro_x": None}),
}


@pytest.mark.parametrize(("name", "headings", "expected"), PHONES.values(), ids=PHONES)
def test_axes_alone_are_what_the_unit_or_the_file_says(
    name: str, headings: str, expected: Mapping[str, str | None], tmp_path: Path
) -> None:
    step = 10.0 if "Milli" in headings else 0.01
    values = np.random.default_rng(3).standard_normal((400, 3)) * 0.01
    columns = dict(zip(headings.split(","), [step * np.arange(400), *values.T], strict=True))
    found = units(drafted(table(tmp_path / name, columns)))
    assert {key: found[key] for key in expected} == expected
    assert len(found) == 4


def test_gravity_is_in_the_accelerometer_that_is_not_linear(tmp_path: Path) -> None:
    columns = {f"{name} {a} (m/s^2)": np.arange(30.0) for name in ("ACC", "LINEAR ACC") for a in "XYZ"}
    found = drafted(table(tmp_path / "phone.csv", {"time (s)": 0.1 * np.arange(30.0), **columns}))
    assert {c.name: c.column for c in found.channels if c.name.startswith("accel")} == {
        f"accel_{a}": f"ACC {a.upper()} (m/s^2)" for a in "xyz"
    }


def test_lines_that_name_their_values_are_drafted(tmp_path: Path) -> None:
    values = np.random.default_rng(3).integers(-40, 40, (400, 3)).tolist()
    lines = [f"Gyro X: {x}, Y: {y}, Z: {z}" for x, y, z in values]
    (tmp_path / "serial.txt").write_text("\n".join(lines) + "\n")
    found = drafted(tmp_path / "serial.txt")
    assert {channel.name: channel.column for channel in found.channels if channel.name != "time"} == {
        f"gyro_{axis}": f"Gyro {axis.upper()}" for axis in "xyz"
    }
    assert set(asked(found)) == {"time.rate", "gyro.unit"}


def test_an_export_of_xsens_tells_its_rate_and_leaves_columns_empty(tmp_path: Path) -> None:
    lines = ["// Start Time: Unknown", "// Update Rate: 100.0Hz", "PacketCounter\tUTC_Nano\tAcc_X\tAcc_Y\tAcc_Z"]
    lines += [f"{i:05d}\t\t9.82{i % 7}\t0.5{i % 5}\t0.54" for i in range(400)]
    (tmp_path / "MT_01.txt").write_text("\n".join(lines) + "\n")
    found = drafted(tmp_path / "MT_01.txt")
    assert not asked(found)
    assert units(found) == {"time": "100 Hz", **{f"accel_{axis}": "m/s^2" for axis in "xyz"}}


# -------------------------------------------------------------------------------- columns alike, and without headings


def test_columns_of_one_heading_are_told_by_their_place(tmp_path: Path) -> None:
    """What the numbers speak for is an answer that can be given: which of the columns of that heading."""
    t: Floats = np.arange(400, dtype=float) * 0.01
    noise = np.random.default_rng(3).standard_normal((3, 400)) * 0.01
    rows = np.column_stack([t, noise[0], t + 0.022, noise[1]])
    path = tmp_path / "two.csv"
    text = "\n".join(",".join(f"{v:.9g}" for v in row) for row in rows)
    path.write_text("Time (s),X (m/s^2),Time (s),X (rad/s)\n" + text + "\n")
    (question,) = (q for q in drafted(path).questions if q.key == "time.column")
    assert question.hint == "Time (s) (column 0)" and question.hint in question.choices
    assert "time.column" not in asked(drafted(path, time__column=question.hint))


def test_without_a_header_the_numbers_tell_the_columns(tmp_path: Path) -> None:
    columns = turned_by_hand(accel=STANDARD_GRAVITY)
    ordered = {name: columns[name] for name in [*(f"accel_{a}" for a in "xyz"), *(f"gyro_{a}" for a in "xyz")]}
    found = drafted(table(tmp_path / "a.txt", {**TIME, **ordered}, " ", header=False))
    assert [(c.name, c.column) for c in found.channels if c.name[-1] in "xyz"] == [
        (name, i) for i, name in enumerate(ordered, 1)
    ]
    assert units(found)["gyro_x"] == "rad/s" and units(found)["accel_x"] == "g" and not found.questions


def test_what_they_do_not_tell_is_asked_and_named(tmp_path: Path) -> None:
    path = table(tmp_path / "a.txt", {"": np.sin(np.arange(500.0)), " ": np.cos(np.arange(500.0))}, " ", header=False)
    assert "columns" in asked(drafted(path))
    found = drafted(path, columns="gyro [deg/s],-", time__rate="50 Hz")
    assert not found.questions and units(found) == {"time": "50 Hz", "gyro": "deg/s"}
    with pytest.raises(InputError, match="3 names for 2 columns"):
        drafted(path, columns="a,b,c")
