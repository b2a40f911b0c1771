"""`insenv init`: what headings and numbers tell is right, the rest is asked, and nothing that matters is assumed."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path

import click
import numpy as np
import pytest
from command import ASYMMETRY, Ended, rows, run
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.units import DEG, STANDARD_GRAVITY, scale_to_si
from insenv.data import commands
from insenv.data.guess.decide import draft
from insenv.data.guess.draft import Draft, Question
from insenv.data.guess.heading import read_heading
from insenv.data.guess.listing import listing
from insenv.data.guess.written import manifest_text
from insenv.data.init import fault, init
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest

DT = 0.01
Command = Callable[..., Ended]


def table(path: Path, columns: Mapping[str, Floats], delimiter: str = ",", header: bool = True) -> Path:
    lines = [delimiter.join(columns)] if header else []
    lines += [delimiter.join(f"{value:.12g}" for value in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return path


def drafted(path: Path, **answers: str) -> Draft:
    return draft([listing(path)], {key.replace("__", "."): value for key, value in answers.items()})


def units(found: Draft) -> dict[str, str | None]:
    return {channel.name: channel.unit.value for channel in found.channels}


def asked(found: Draft) -> dict[str, str]:
    return {question.key: question.hint for question in found.questions}


def turned_by_hand(gyro: float = 1.0, accel: float = 1.0, seed: int = 1) -> dict[str, Floats]:
    """A triad that rests in eight attitudes and is turned in between; gyros and forces in units of rad/s and m/s^2."""
    random = np.random.default_rng(seed)
    rate = np.zeros((8000, 3))
    for start in range(500, 8000, 1000):
        axis = random.standard_normal(3)
        rate[start : start + 200] = (axis / np.linalg.norm(axis)) * np.sin(np.linspace(0, np.pi, 200))[:, None]
    up = np.empty_like(rate)
    now = np.array([0.0, 0.0, 1.0])
    for i, w in enumerate(rate):
        now = now - np.cross(w, now) * DT
        now /= np.linalg.norm(now)
        up[i] = now
    rate += 2e-3 * random.standard_normal(rate.shape)
    force = STANDARD_GRAVITY * up + 0.02 * random.standard_normal(up.shape)
    return {
        **{f"gyro_{a}": rate[:, i] / gyro for i, a in enumerate("xyz")},
        **{f"accel_{a}": force[:, i] / accel for i, a in enumerate("xyz")},
    }


TIME = {"time": np.arange(8000.0) * DT}


def on_table(gain: float = 1.0, unit: float = 1.0, seed: int = 1) -> dict[str, Floats]:
    """A gyro in deg/s that follows a table with a gain; the table's rate in a unit of so many deg/s."""
    t = np.arange(4000) * 0.1
    rate = np.array([10.0, -10.0, 4.0, -4.0])[(t // 20 % 4).astype(int)]
    noise = 0.05 * np.random.default_rng(seed).standard_normal(len(t))
    return {"time": t, "gyro (deg/s)": gain * rate + 0.01 + noise, "table_rate": rate / unit}


# ----------------------------------------------------------------------------------- what the numbers tell


@pytest.mark.parametrize(("size", "unit"), [(1.0, "m/s^2"), (STANDARD_GRAVITY, "g")])
def test_gravity_tells_the_unit_of_accelerometers(size: float, unit: str, tmp_path: Path) -> None:
    found = units(drafted(table(tmp_path / "a.csv", {**TIME, **turned_by_hand(accel=size)})))
    assert {found[f"accel_{axis}"] for axis in "xyz"} == {unit}


@pytest.mark.parametrize(("size", "unit"), [(1.0, "rad/s"), (DEG, "deg/s")])
def test_gravity_that_turns_tells_the_unit_of_gyros(size: float, unit: str, tmp_path: Path) -> None:
    found = drafted(table(tmp_path / "a.csv", {**TIME, **turned_by_hand(gyro=size)}))
    assert {units(found)[f"gyro_{axis}"] for axis in "xyz"} == {unit}
    assert found.procedure.value == "multi-position" and not found.questions


def swung(rest: int, seed: int = 1) -> dict[str, Floats]:
    """Gyros [deg/s] of a unit that is swung slowly by hand about all axes after so many rows at rest, of 6000."""
    random = np.random.default_rng(seed)
    t = np.arange(6000) * DT
    rate = np.column_stack([60 * np.sin(2 * np.pi * f * t) for f in (0.031, 0.057, 0.083)])
    rate[:rest] = 0
    rate += 0.1 * random.standard_normal(rate.shape)
    return {"time [s]": t, **{f"gyro_{a} [deg/s]": rate[:, i] for i, a in enumerate("xyz")}}


def test_a_unit_that_moves_is_asked_what_it_is_judged_by_and_is_not_written_as_at_rest(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", swung(rest=0))
    made = init([path])
    (question,) = made.draft.questions
    assert question.key == "procedure" and "moves in" in question.text and made.draft.procedure.value is None
    assert tomllib.loads(made.path.read_text())["model"]["procedure"] == "?"
    told = init([path], answers={"procedure": "static"}, force=True)
    assert not told.draft.questions and tomllib.loads(told.path.read_text())["model"]["procedure"] == "static"


def test_an_accelerometer_moves_where_another_does(tmp_path: Path) -> None:
    """Tipped about x in one half and about y in the other: each alone stays in most rows, the unit does not."""
    tipped = {name: np.zeros(6000) for name in ("accel_x", "accel_y", "accel_z")}
    tipped["accel_x"][500:3000] = 4.0
    tipped["accel_y"][3200:5700] = 4.0
    tipped["accel_z"] = np.sqrt(STANDARD_GRAVITY**2 - tipped["accel_x"] ** 2 - tipped["accel_y"] ** 2)
    noise = 0.02 * np.random.default_rng(1).standard_normal((3, 6000))
    columns = {"time [s]": TIME["time"][:6000], **{f"{n} [m/s^2]": v for n, v in tipped.items()}}
    for name, e in zip(columns, [0.0, *noise], strict=True):
        columns[name] = columns[name] + e
    path = table(tmp_path / "a.csv", columns)
    assert set(asked(drafted(path))) == {"procedure"}
    with pytest.raises(InputError, match="declared at rest and moves"):
        close(init([path], answers={"procedure": "static"}).path.with_name(without_fit(path)))


def without_fit(path: Path) -> str:
    """The manifest beside a file, as it would be without the rows of a rest."""
    text = path.with_suffix(".toml").read_text().split("[fit]")[0]
    path.with_name("whole.toml").write_text(text)
    return "whole.toml"


def test_the_rest_of_a_unit_that_then_moves_is_written_where_it_is_declared_at_rest(tmp_path: Path) -> None:
    """It rests for 25 s of the 36 s that would be fitted, and never in what would be held out."""
    path = table(tmp_path / "a.csv", swung(rest=2500))
    (question,) = init([path]).draft.questions
    assert question.key == "procedure" and "longest rest" in question.text
    made = init([path], answers={"procedure": "static"}, force=True)
    ((start, stop),) = tomllib.loads(made.path.read_text())["fit"]["rows"]
    assert start <= 100 and 2400 <= stop <= 2600
    found = close(made.path)
    assert all(target.verdict == "nothing-significant" for target in found.targets)


def test_a_unit_that_rests_in_the_motion_of_a_swing_has_no_rest(tmp_path: Path) -> None:
    made = init([table(tmp_path / "a.csv", swung(rest=0))], answers={"procedure": "static"})
    assert "fit" not in tomllib.loads(made.path.read_text())


def test_accelerations_in_a_file_that_is_called_after_gyros_are_known_by_gravity(tmp_path: Path) -> None:
    hand = turned_by_hand(accel=STANDARD_GRAVITY)
    found = drafted(table(tmp_path / "gyroscope_data.csv", {**TIME, **{a: hand[f"accel_{a}"] for a in "xyz"}}))
    assert found.targets == ("accel_x", "accel_y", "accel_z") and units(found)["accel_x"] == "g"
    rest = {
        a: b + 0.01 * np.random.default_rng(1).standard_normal(8000)
        for a, b in zip("xyz", (0.6, 0.8, 0.0), strict=True)
    }
    found = drafted(table(tmp_path / "gyro_rest.csv", {**TIME, **rest}))
    assert found.targets == ("gyro_x", "gyro_y", "gyro_z")  # a bias of one deg/s is no gravity


def test_stamps_of_packets_are_said_where_the_rate_is_asked(tmp_path: Path) -> None:
    columns = {"timestamp": np.repeat(np.arange(800.0) * 0.1, 10), **turned_by_hand()}
    asks = {q.key: q.text for q in drafted(table(tmp_path / "a.csv", columns)).questions}
    assert "has the stamp of the row before in 90 %" in asks["time.rate"]


def test_columns_that_are_asked_are_the_targets(tmp_path: Path) -> None:
    names = [f"acc{n}{a}" for n in (68, 69) for a in "XYZ"]
    force = np.random.default_rng(1).standard_normal((400, len(names))).T
    columns = {"time [s]": TIME["time"][:400], **dict(zip(names, force, strict=True))}
    made = init([table(tmp_path / "a.csv", columns)])
    assert tomllib.loads(made.path.read_text())["model"]["target"] == ["accel_x", "accel_y", "accel_z"]


def test_a_unit_that_mostly_rests_is_not_asked(tmp_path: Path) -> None:
    found = drafted(table(tmp_path / "a.csv", swung(rest=5000)))
    assert found.procedure.value == "static" and not found.questions


def test_gyros_whose_axes_do_not_turn_gravity_are_asked(tmp_path: Path) -> None:
    columns = turned_by_hand()
    columns["gyro_x"], columns["gyro_y"] = columns["gyro_y"], -columns["gyro_x"]
    assert set(asked(drafted(table(tmp_path / "a.csv", {**TIME, **columns})))) == {"gyro.unit"}


def test_gyros_at_rest_are_asked(tmp_path: Path) -> None:
    columns = {name: values[:400] for name, values in {**TIME, **turned_by_hand()}.items()}
    assert set(asked(drafted(table(tmp_path / "a.csv", columns)))) == {"gyro.unit"}


def test_raw_counts_are_asked_and_gravity_makes_a_proposal(tmp_path: Path) -> None:
    columns = turned_by_hand(gyro=DEG / 131, accel=STANDARD_GRAVITY / 16384)
    found = drafted(table(tmp_path / "a.csv", {**TIME, **{n: np.rint(v) for n, v in columns.items()}}))
    hints = asked(found)
    assert scale_to_si(hints["accel.unit"], "acceleration", "")[0] == pytest.approx(STANDARD_GRAVITY / 16384)
    assert scale_to_si(hints["gyro.unit"], "rate", "")[0] == pytest.approx(DEG / 131)


def test_raw_counts_without_a_sign_are_asked_for_their_zero(tmp_path: Path) -> None:
    columns = turned_by_hand(accel=STANDARD_GRAVITY / 4096)
    counts = {n: np.rint(v) + 32768 for n, v in columns.items() if n.startswith("accel")}
    assert asked(drafted(table(tmp_path / "a.csv", {**TIME, **counts})))["accel.offset"] == "32768"


@pytest.mark.parametrize(
    ("stamps", "unit", "hint"),
    [
        (lambda i: 0.01 * i, "s", None),
        (lambda i: 5000 + 0.005 * i, "s", None),
        (lambda i: 1.7e9 + 0.01 * i, "s", None),
        (lambda i: 1.7e12 + 10 * i, "ms", None),
        (lambda i: 1.7e15 + 1e4 * i, "us", None),
        (lambda i: 1.7e18 + 1e7 * i, "ns", None),
        (lambda i: 6656 * i, "us", None),
        (lambda i: 1e7 * i, "ns", None),
        (lambda i: 10 * i, None, "ms"),  # or rows that are 10 s apart
        (lambda i: 1.0 * i, None, "ms"),  # or a row a second
        (lambda i: 0.5 * i, None, "ms"),  # or 2 Hz
        (lambda i: 500_000 * i, None, "us"),
        (lambda i: 1952.0 * i, None, "us"),  # or a row in two seconds
    ],
)
def test_the_steps_of_a_clock_tell_its_unit(
    stamps: Callable[[Floats], Floats], unit: str | None, hint: str | None, tmp_path: Path
) -> None:
    path = table(tmp_path / "a.csv", {"t": stamps(np.arange(500.0)), "gyro [deg/s]": np.ones(500)})
    found = drafted(path)
    assert units(found)["time"] == unit
    assert asked(found).get("time.unit") == hint


def test_a_file_without_time_is_asked_for_its_rate(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", {"n": np.arange(500.0), "gyro [deg/s]": np.ones(500)})
    assert set(asked(drafted(path))) == {"time.rate"}
    assert units(drafted(path, time__rate="100 Hz"))["time"] == "100 Hz"
    assert drafted(path, time__rate="row").channels[0].column == "row"


def faces(count: int, seed: int = 1) -> dict[str, Floats]:
    """Means of a triad in six faces, or in attitudes all round; biased, and one axis long by 2 %."""
    random = np.random.default_rng(seed)
    up = np.concatenate([np.eye(3), -np.eye(3)]) if count == 6 else random.standard_normal((count, 3))
    force = STANDARD_GRAVITY * up / np.linalg.norm(up, axis=1, keepdims=True) * [1.02, 1.0, 1.0] + [0.1, -0.1, 0.05]
    return {f"a{x} (m/s^2)": values for x, values in zip("xyz", force.T, strict=True)}


@pytest.mark.parametrize("count", [6, 24, 200])
def test_a_table_of_positions_is_one_without_a_time_or_with_a_useless_one(count: int, tmp_path: Path) -> None:
    for columns in (faces(count), {"t": np.arange(4.0 * count, step=4.0), **faces(count)}):
        path = table(tmp_path / f"{len(columns)}.csv", columns)
        found = drafted(path)
        assert not found.questions and found.procedure.value == "multi-position"
        (tmp_path / "faces.toml").write_text(manifest_text(found, tmp_path / "faces.toml"))
        (read,) = read_recordings(load_manifest(tmp_path / "faces.toml"))
        assert [(s.start, s.stop) for s in read.segments] == [(k, k + 1) for k in range(count)]
        assert np.allclose(read.channels["accel_x"].values, columns["ax (m/s^2)"])


def test_rows_of_a_series_are_no_positions(tmp_path: Path) -> None:
    found = drafted(table(tmp_path / "a.csv", {k: v[::4] for k, v in turned_by_hand().items() if k != "t"}))
    assert "segment" not in {channel.name for channel in found.channels}


def test_a_rate_above_the_header_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("Fs,200\nInitialization time,36.5\ngyro [deg/s]\n" + "1.5\n2.5\n" * 99)
    assert units(drafted(path))["time"] == "200 Hz"


@pytest.mark.parametrize(("turn", "unit"), [(360.0, "deg"), (2 * np.pi, "rad")])
def test_an_angle_that_jumps_by_a_turn_tells_its_unit(turn: float, unit: str, tmp_path: Path) -> None:
    t = np.arange(4000) * 0.1
    angle = np.mod(t / 40, 1) * turn
    columns = {"time": t, "gyro [deg/s]": 9 + 0.01 * np.sin(t), "table_angle": angle}
    found = drafted(table(tmp_path / "a.csv", columns))
    (channel,) = [c for c in found.channels if c.name == "table_angle"]
    assert (channel.unit.value, channel.extra) == (unit, {"wrapped": True})


@pytest.mark.parametrize(("size", "unit"), [(1.0, "deg/s"), (6.0, "rpm"), (1 / DEG, "rad/s")])
def test_a_gyro_of_known_unit_tells_that_of_its_table(size: float, unit: str, tmp_path: Path) -> None:
    found = drafted(table(tmp_path / "a.csv", on_table(unit=size)))
    assert units(found)["table_rate"] == unit and not found.questions


def test_a_command_that_jumps_with_its_gyro_holds_for_the_interval(tmp_path: Path) -> None:
    columns = on_table()
    covers = [c.extra.get("covers") for c in drafted(table(tmp_path / "a.csv", columns)).channels]
    assert covers == [None, "interval", "interval"]
    t = columns["time"]
    smooth = 10 * np.sin(t / 20)
    smooth_columns = {"time": t, "gyro (deg/s)": smooth + 0.01 * np.cos(7 * t), "table_rate": smooth}
    covers = [c.extra.get("covers") for c in drafted(table(tmp_path / "b.csv", smooth_columns)).channels]
    assert covers == [None, None, None]


@pytest.mark.parametrize(("gain", "hint"), [(-1.0, "-90 deg"), (-0.87, "-90 deg"), (0.87, "90 deg"), (0.5, "")])
def test_a_gain_that_is_not_one_asks_how_the_gyro_is_mounted(gain: float, hint: str, tmp_path: Path) -> None:
    columns = on_table(gain)
    columns["table_rate (deg/s)"] = columns.pop("table_rate")
    assert asked(drafted(table(tmp_path / "a.csv", columns))) == {"mounting.tilt": hint}


def test_a_triad_on_a_table_is_asked_for_its_axes(tmp_path: Path) -> None:
    columns = on_table()
    gyro = columns.pop("gyro (deg/s)")
    columns |= {"gx [deg/s]": 0 * gyro, "gy [deg/s]": 0 * gyro, "gz [deg/s]": gyro}
    assert {"mounting.table_axis", "mounting.axes"} <= set(asked(drafted(table(tmp_path / "a.csv", columns))))


# ------------------------------------------------------------------------------------ stated, but doubtful


def test_a_stated_unit_that_gravity_contradicts_is_asked(tmp_path: Path) -> None:
    columns = {f"{n} [g]" if n.startswith("accel") else n: v for n, v in turned_by_hand().items()}
    found = drafted(table(tmp_path / "a.csv", {**TIME, **columns}))
    assert asked(found)["accel.unit"] == "m/s^2"


def test_a_stated_unit_that_turning_contradicts_is_asked(tmp_path: Path) -> None:
    columns = {f"{n} [rad/s]" if n.startswith("gyro") else n: v for n, v in turned_by_hand(gyro=DEG).items()}
    found = drafted(table(tmp_path / "a.csv", {**TIME, **columns}))
    assert asked(found) == {"gyro.unit": "deg/s"}


def test_a_stated_unit_that_the_table_contradicts_is_asked(tmp_path: Path) -> None:
    columns = on_table(unit=6.0)
    columns["table_rate (rad/s)"] = columns.pop("table_rate")
    assert asked(drafted(table(tmp_path / "a.csv", columns))) == {"table_rate.unit": "rpm"}


def test_a_unit_that_is_none_is_asked(tmp_path: Path) -> None:
    columns = {"time [s]": np.arange(500) * DT, "gyro (V)": np.sin(np.arange(500.0))}
    found = drafted(table(tmp_path / "a.csv", columns))
    assert set(asked(found)) == {"gyro.unit"} and "V" in found.questions[0].text


def test_an_angle_in_a_name_is_no_increment(tmp_path: Path) -> None:
    """People write rad for rad/s: an increment is one where the name says so, or the user."""
    columns = {"time [s]": np.arange(500) * DT, "gyro_rad": np.sin(np.arange(500.0))}
    assert set(asked(drafted(table(tmp_path / "a.csv", columns)))) == {"gyro.unit"}
    columns["gyro [rad]"] = columns.pop("gyro_rad")
    assert set(asked(drafted(table(tmp_path / "a.csv", columns)))) == {"gyro.unit"}
    answered = drafted(tmp_path / "a.csv", gyro__unit="rad")
    assert answered.channels[1].extra == {"quantity": "increment"}
    columns["dtheta [rad]"] = columns.pop("gyro [rad]")
    assert drafted(table(tmp_path / "a.csv", columns)).channels[1].extra == {"quantity": "increment"}


# --------------------------------------------------------------------------------------- shapes of headers

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


# -------------------------------------------------------------------------------------- without a header


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


# ----------------------------------------------------------------------------------------------- formats


def test_npz_parquet_and_workbooks_are_read_as_their_readers_do(tmp_path: Path) -> None:
    columns = turned_by_hand(gyro=DEG)
    gyro, accel = (np.column_stack([columns[f"{k}_{a}"] for a in "xyz"]) for k in ("gyro", "accel"))
    np.savez(tmp_path / "a.npz", time=TIME["time"], gyro=gyro, accel=accel)
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pytest.importorskip("pyarrow").table({**TIME, **columns}), tmp_path / "a.parquet")
    book = pytest.importorskip("openpyxl").Workbook()
    book.active.append([*TIME, *columns])
    for row in zip(TIME["time"], *columns.values(), strict=True):
        book.active.append([float(value) for value in row])
    book.save(tmp_path / "a.xlsx")
    for name in ("a.npz", "a.parquet", "a.xlsx"):
        found = drafted(tmp_path / name)
        assert not found.questions and units(found)["gyro_y"] == "deg/s" and units(found)["accel_z"] == "m/s^2", name
        out = tmp_path / "a.toml"
        out.write_text(manifest_text(found, out))
        assert load_manifest(out).runs[0].format == found.format


def test_runs_are_of_one_kind(tmp_path: Path) -> None:
    first, second = table(tmp_path / "a.csv", on_table()), table(tmp_path / "b.csv", on_table(seed=2))
    made = init([first, second], tmp_path / "both.toml")
    assert tomllib.loads(made.path.read_text())["data"] == ["a.csv", "b.csv"]
    table(second, {"time": np.arange(50.0) * DT, "other": np.ones(50)})
    with pytest.raises(InputError, match=r"b\.csv: its columns are not those of a\.csv"):
        init([first, second], tmp_path / "more.toml")


# --------------------------------------------------------------------------------------------- questions


def test_answers_settle_further_questions(tmp_path: Path) -> None:
    """With the rate of the rows known, gravity tells the unit of the gyros: it is not asked."""
    path = table(tmp_path / "a.csv", turned_by_hand(gyro=DEG))
    assert set(asked(drafted(path))) == {"time.rate", "gyro.unit"}
    put: list[str] = []

    def ask(made: Draft, question: Question) -> str:
        put.append(question.key)
        return "100 Hz"

    made = init([path], ask=ask)
    assert put == ["time.rate"] and units(made.draft)["gyro_x"] == "deg/s"


@pytest.mark.parametrize(
    ("answer", "sound"), [("deg/s", True), ("0.0175 deg/s", True), ("deg", True), ("m", False), ("", False)]
)
def test_an_answer_is_a_unit(answer: str, sound: bool) -> None:
    assert (fault(Question("gyro.unit", "?", "", ("rate", "angle")), answer) == "") == sound


# --------------------------------------------------------------------------------------------- the command


@pytest.fixture
def insenv(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Command:
    return lambda *args: run(capsys, monkeypatch, *args)


def plain(folder: Path, header: str) -> Path:
    path = folder / "run.csv"
    path.write_text("\n".join([header, *rows()[1:]]) + "\n")
    return path


def test_open_questions_end_in_status_2_and_close_loop_waits(insenv: Command, tmp_path: Path) -> None:
    path = plain(tmp_path, "time,gyro,table_rate")
    ended = insenv("init", path)
    assert ended.status == 2 and ended.err.count("\n") == 1
    assert "2 questions are open (gyro.unit, table_rate.unit)" in ended.err
    manifest = tmp_path / "run.toml"
    written = manifest.read_text()
    assert written.count('unit = "?"') == 2 and "# ? In which unit" in written
    waiting = insenv("close-loop", manifest)
    assert waiting.status == 2 and waiting.err.count("\n") == 1
    assert "channels.gyro.unit, channels.table_rate.unit" in waiting.err
    manifest.write_text(written.replace('unit = "?"', 'unit = "deg/s"'))
    answered = insenv("close-loop", path, "--effects", "scale_factor_asymmetry", "--json", tmp_path / "a.json")
    assert answered.status == 0 and "scale_factor_asymmetry" in answered.out


def test_set_answers_beforehand(insenv: Command, tmp_path: Path) -> None:
    path = plain(tmp_path, "time,gyro,table_rate")
    assert insenv("init", path, "--set", "gyro.unit=deg/s").status == 0
    assert load_manifest(tmp_path / "run.toml").channels["table_rate"].unit == "deg/s"
    wrong = insenv("init", path, "--force", "--set", "gyros.unit=deg/s")
    assert wrong.status == 2 and "did you mean 'gyro.unit'" in wrong.err
    wrong = insenv("init", path, "--force", "--set", "gyro.unit=m")
    assert wrong.status == 2 and "gyro.unit" in wrong.err


def test_a_manifest_that_is_there_is_kept(insenv: Command, tmp_path: Path) -> None:
    path = plain(tmp_path, "time,gyro [deg/s],table_rate [deg/s]")
    (tmp_path / "run.toml").write_text("mine")
    ended = insenv("init", path)
    assert ended.status == 2 and "--force" in ended.err and (tmp_path / "run.toml").read_text() == "mine"
    ended = insenv("close-loop", path)
    assert ended.status == 2 and "is no manifest of run.csv" in ended.err
    assert insenv("init", path, "--force").status == 0


def test_close_loop_takes_a_data_file_and_goes_on(insenv: Command, tmp_path: Path) -> None:
    path = plain(tmp_path, "time,gyro [deg/s],table_rate [deg/s]")
    ended = insenv("close-loop", path, "--effects", "scale_factor_asymmetry,bias_drift")
    assert ended.status == 0 and "scale_factor_asymmetry" in ended.out
    assert "its manifest was written to" in ended.err and (tmp_path / "run.toml").exists()
    assert ASYMMETRY > 0


def test_the_manifest_goes_to_standard_output_and_the_table_aside(insenv: Command, tmp_path: Path) -> None:
    path = plain(tmp_path, "time,gyro [deg/s],table_rate [deg/s]")
    ended = insenv("init", path, "--out", "-")
    assert ended.status == 0 and not list(tmp_path.glob("*.toml"))
    assert tomllib.loads(ended.out)["model"]["target"] == "gyro" and "known by" in ended.err


def test_a_terminal_is_asked(insenv: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers = iter(["metre", "deg/s"])
    monkeypatch.setattr(commands, "is_terminal", lambda: True)
    monkeypatch.setattr(click, "prompt", lambda *args, **how: next(answers))
    ended = insenv("init", plain(tmp_path, "time,gyro,table_rate"))
    assert ended.status == 0 and "wanted a rate" in ended.err
    assert load_manifest(tmp_path / "run.toml").channels["gyro"].unit == "deg/s"


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


def test_columns_of_one_clock_are_one_time_and_of_two_are_asked(tmp_path: Path) -> None:
    t: Floats = np.arange(400, dtype=float) * 0.01 + 0.12
    gyro = np.random.default_rng(3).standard_normal(400) * 0.01
    twice = {"time": np.rint((1_717_013_147 + t) * 1e9), "seconds_elapsed": t, "gyro [rad/s]": gyro}
    found = drafted(table(tmp_path / "twice.csv", twice))
    assert not asked(found)
    assert found.left_out in {("time",), ("seconds_elapsed",)}
    late = {"time [s]": t, "stamp [s]": t + 0.022, "gyro [rad/s]": gyro}
    assert set(asked(drafted(table(tmp_path / "late.csv", late)))) == {"time.column"}


def test_a_table_merged_of_two_sources_keeps_the_rows_of_the_faster(tmp_path: Path) -> None:
    """Columns of the slower source are left out, and so are its rows; a stamp in two columns is one time."""
    lines = ["gps_sec,lat,stamp_sec,stamp_nanosec,gyro_z [rad/s]"]
    for i in range(1200):
        if i % 40 == 20:
            lines.append(f"{1_729_521_988 + i // 40},42.3,,,")
        stamp = 570_443_003 + 25_000_000 * i
        lines.append(f",,{1_729_521_988 + stamp // 10**9},{stamp % 10**9},{1e-3 * np.sin(0.3 * i):.6f}")
    (tmp_path / "merged.csv").write_text("\n".join(lines) + "\n")
    found = drafted(tmp_path / "merged.csv")
    assert units(found) == {"time": "s", "gyro": "rad/s"}
    time = next(channel for channel in found.channels if channel.name == "time")
    assert (time.column, dict(time.extra)) == ("stamp_sec", {"nanoseconds": "stamp_nanosec"})
    assert found.read == {"incomplete": "leave out"}
    (tmp_path / "m.toml").write_text(manifest_text(found, tmp_path / "m.toml"))
    recording = read_recordings(load_manifest(tmp_path / "m.toml"))[0]
    np.testing.assert_allclose(np.diff(recording.t), 0.025, atol=1e-6)


def test_lines_that_name_their_values_are_drafted(tmp_path: Path) -> None:
    values = np.random.default_rng(3).integers(-40, 40, (400, 3)).tolist()
    lines = [f"Gyro X: {x}, Y: {y}, Z: {z}" for x, y, z in values]
    (tmp_path / "serial.txt").write_text("\n".join(lines) + "\n")
    found = drafted(tmp_path / "serial.txt")
    assert {channel.name: channel.column for channel in found.channels if channel.name != "time"} == {
        f"gyro_{axis}": f"Gyro {axis.upper()}" for axis in "xyz"
    }
    assert set(asked(found)) == {"time.rate", "gyro.unit"}


def test_a_matrix_of_psins_is_known_by_its_increments(tmp_path: Path) -> None:
    """Increments of angle and velocity, then the time; arrays of another length, however many, are passed by."""
    random = np.random.default_rng(3)
    imu = np.column_stack(
        [1e-6 * random.standard_normal((2000, 3)), 0.098 * np.eye(3)[2] + 1e-5 * random.standard_normal((2000, 3))]
    )
    path = tmp_path / "run.npz"
    np.savez(path, avp=random.standard_normal((500, 10)), imu=np.column_stack([imu, 0.01 * np.arange(1, 2001)]))
    found = drafted(path)
    assert not asked(found)
    assert units(found) == {"time": "s", **{f"gyro_{a}": "rad" for a in "xyz"}, **{f"accel_{a}": "m/s" for a in "xyz"}}
    assert all(c.extra == {"quantity": "increment"} for c in found.channels if c.name != "time")


def test_arrays_that_lack_values_are_drafted_without_these_rows(tmp_path: Path) -> None:
    gyro = np.random.default_rng(3).standard_normal((400, 3))
    gyro[0] = np.nan
    np.savez(tmp_path / "run.npz", SENSgyro=gyro, SENStime=0.01 * np.arange(400))
    found = drafted(tmp_path / "run.npz")
    assert set(units(found)) == {"time", "gyro_x", "gyro_y", "gyro_z"}
    assert found.read == {"incomplete": "leave out"}
    assert found.rows == 399


def test_an_export_of_xsens_tells_its_rate_and_leaves_columns_empty(tmp_path: Path) -> None:
    lines = ["// Start Time: Unknown", "// Update Rate: 100.0Hz", "PacketCounter\tUTC_Nano\tAcc_X\tAcc_Y\tAcc_Z"]
    lines += [f"{i:05d}\t\t9.82{i % 7}\t0.5{i % 5}\t0.54" for i in range(400)]
    (tmp_path / "MT_01.txt").write_text("\n".join(lines) + "\n")
    found = drafted(tmp_path / "MT_01.txt")
    assert not asked(found)
    assert units(found) == {"time": "100 Hz", **{f"accel_{axis}": "m/s^2" for axis in "xyz"}}


# ------------------------------------------------------------------------------------------------- other layouts


def written(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_lines_of_a_unit_are_chosen_among_other_kinds(tmp_path: Path) -> None:
    """The manifest reads those alone, without their checksums; labels of parts are none."""
    numbers = [f"{i * 1e4:.0f},{0.01 * i},{0.02 * i},9.8*1A" for i in range(40)]
    lines = [f"{word}{row}" for row in numbers for word in ("GPS,1,2,", "IMU,", "ATT,7,")]
    found = listing(written(tmp_path / "log.csv", lines))
    assert (found.format, found.lines, len(found.columns)) == ("text", "IMU", 4)
    assert any("GPS, ATT are not read" in note for note in found.notes)
    np.testing.assert_allclose(found.columns[-1].values, 9.8)
    one = draft([found], {"columns": "time [us],gyro_x [deg/s],gyro_y [deg/s],accel_z [m/s^2]"})
    assert tomllib.loads(manifest_text(one, tmp_path))["read"] == {"lines": "IMU"}
    parts = [f"{('rest', 'turn')[i // 20 % 2]},{i},{i * i}" for i in range(80)]
    assert not listing(written(tmp_path / "parts.csv", parts)).lines
    satellites = [f"$GP{k},1,2,3*1A" for _ in range(20) for k in ("GGA", "RMC", "GSA")]
    with pytest.raises(InputError, match="several kinds, .GPGGA, .GPRMC, .GPGSA, none of which says gyro"):
        listing(written(tmp_path / "gps.txt", satellites))


def test_a_header_below_prose_is_found(tmp_path: Path) -> None:
    rows = [f"{0.01 * i:.2f} {0.1 * i:.1f}" for i in range(40)]
    found = listing(written(tmp_path / "log.txt", ["StartTime: noon", "", "All in deg/s", "t_s gz", *rows]))
    assert [c.heading for c in found.columns] == ["t_s", "gz"]
    assert found.skip_lines == 3 and found.rows == 40


def test_columns_that_are_mostly_empty_or_nan_are_left_out(tmp_path: Path) -> None:
    rows = [f"{i},{i / 7:.3f},{5 if i % 10 == 9 else ''},NaN" for i in range(60)]
    found = listing(written(tmp_path / "log.csv", ["t_s,gz,fix,light", *rows]))
    assert [c.heading for c in found.columns] == ["t_s", "gz"] and found.rows == 60


def test_rows_may_end_in_more_commas_than_there_are_headings(tmp_path: Path) -> None:
    """A logger that names 4 columns and parts 6, of which one that it names is empty too."""
    path = written(
        tmp_path / "log.csv", ["t_s,gx,gy,watch", *(f"{i / 50},{i / 7:.3f},{-i / 7:.3f},,," for i in range(60))]
    )
    found = listing(path)
    assert [c.heading for c in found.columns] == ["t_s", "gx", "gy"] and found.rows == 60
    assert np.allclose(found.columns[1].values, np.arange(60) / 7, atol=1e-3)
    full = written(tmp_path / "full.csv", ["t_s,gx", *(f"{i / 50},{i / 7:.3f},{i}," for i in range(60))])
    assert [c.heading for c in listing(full).columns] == ["", "", ""]  # the last comma may go, a number may not


def test_a_line_that_begins_with_zero_bytes_is_no_row(tmp_path: Path) -> None:
    rows = [f"{i / 50},{i / 7:.3f}" for i in range(60)]
    rows[30] = "\0" * 40 + rows[30]
    found = listing(written(tmp_path / "log.csv", ["t_s,gx", *rows, "\0" * 512]))
    assert found.rows == 59 and [c.heading for c in found.columns] == ["t_s", "gx"]


def test_an_array_that_numpy_printed_is_a_table(tmp_path: Path) -> None:
    values = np.random.default_rng(1).standard_normal((40, 3))
    text = np.array2string(values, threshold=1000).splitlines()
    found = listing(written(tmp_path / "printed.txt", [*text[:20], "", *text[20:]]))
    assert found.rows == 40 and len(found.columns) == 3
    assert np.allclose(np.column_stack([c.values for c in found.columns]), values, atol=1e-6)


def test_accelerations_without_gravity_are_no_wrong_range(tmp_path: Path) -> None:
    noise = 0.3 * np.random.default_rng(1).standard_normal((3, 600))
    for name, said in (("Linear Acceleration", "taken gravity out"), ("Acceleration", "is the range set right?")):
        columns = {f"{name} {a} (m/s^2)": n for a, n in zip("xyz", noise, strict=True)}
        found = drafted(table(tmp_path / "phone.csv", {"time (s)": 0.01 * np.arange(600.0), **columns}))
        assert any(said in note for note in found.notes)


def test_gravity_is_in_the_accelerometer_that_is_not_linear(tmp_path: Path) -> None:
    columns = {f"{name} {a} (m/s^2)": np.arange(30.0) for name in ("ACC", "LINEAR ACC") for a in "XYZ"}
    found = drafted(table(tmp_path / "phone.csv", {"time (s)": 0.1 * np.arange(30.0), **columns}))
    assert {c.name: c.column for c in found.channels if c.name.startswith("accel")} == {
        f"accel_{a}": f"ACC {a.upper()} (m/s^2)" for a in "xyz"
    }


def test_a_workbook_without_headings_is_refused(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for i in range(20):
        book.active.append([i, i * 0.5])
    book.save(tmp_path / "bare.xlsx")
    with pytest.raises(InputError, match="no header above its rows of numbers; wanted a header"):
        listing(tmp_path / "bare.xlsx")
