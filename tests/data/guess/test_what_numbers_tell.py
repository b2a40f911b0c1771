"""What the numbers of a file tell of its units, its clock and its table; the rest is asked, doubtful units too."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from drafts.columns import DT, TIME, asked, drafted, on_table, table, turned_by_hand, units

from insenv.core.recording import Floats
from insenv.core.units import DEG, STANDARD_GRAVITY, scale_to_si
from insenv.data.guess.written import manifest_text
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest

# -------------------------------------------------------------------------------------------------------------- units


@pytest.mark.parametrize(("size", "unit"), [(1.0, "m/s^2"), (STANDARD_GRAVITY, "g")])
def test_gravity_tells_the_unit_of_accelerometers(size: float, unit: str, tmp_path: Path) -> None:
    found = units(drafted(table(tmp_path / "a.csv", {**TIME, **turned_by_hand(accel=size)})))
    assert {found[f"accel_{axis}"] for axis in "xyz"} == {unit}


@pytest.mark.parametrize(("size", "unit"), [(1.0, "rad/s"), (DEG, "deg/s")])
def test_gravity_that_turns_tells_the_unit_of_gyros(size: float, unit: str, tmp_path: Path) -> None:
    found = drafted(table(tmp_path / "a.csv", {**TIME, **turned_by_hand(gyro=size)}))
    assert {units(found)[f"gyro_{axis}"] for axis in "xyz"} == {unit}
    assert found.procedure.value == "multi-position" and not found.questions


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


def test_accelerations_without_gravity_are_no_wrong_range(tmp_path: Path) -> None:
    noise = 0.3 * np.random.default_rng(1).standard_normal((3, 600))
    for name, said in (("Linear Acceleration", "taken gravity out"), ("Acceleration", "is the range set right?")):
        columns = {f"{name} {a} (m/s^2)": n for a, n in zip("xyz", noise, strict=True)}
        found = drafted(table(tmp_path / "phone.csv", {"time (s)": 0.01 * np.arange(600.0), **columns}))
        assert any(said in note for note in found.notes)


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


# ------------------------------------------------------------------------------------------------------------- clocks


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


def test_points_at_one_rate_each_need_no_time(tmp_path: Path) -> None:
    rates = np.linspace(-100, 100, 11)
    path = table(tmp_path / "a.csv", {"commanded_rate (deg/s)": rates, "gyro (deg/s)": 1.01 * rates + 0.3})
    found = drafted(path)
    assert not found.questions
    (time,) = (channel for channel in found.channels if channel.name == "time")
    assert time.column == "row"


@pytest.mark.parametrize(
    ("columns", "points", "declared"),
    [
        ({"temp_degC": np.linspace(-40, 60, 21), "gyro (deg/s)": np.linspace(0, 1, 21)}, "temperature", ("bias",)),
        ({"table_angle (deg)": np.arange(0, 360, 15.0), "gyro (deg/h)": np.ones(24)}, "angle", ("bias",)),
        (
            {"table_angle (deg)": np.arange(0, 360, 15.0), "accel (m/s^2)": np.sin(np.arange(24.0))},
            "angle",
            ("accel_bias", "accel_scale_factor"),
        ),
    ],
)
def test_points_of_other_kinds_need_no_time(
    columns: dict[str, Floats], points: str, declared: tuple[str, ...], tmp_path: Path
) -> None:
    found = drafted(table(tmp_path / "a.csv", columns))
    assert not found.questions
    (time,) = (channel for channel in found.channels if channel.name == "time")
    assert time.column == "row" and f"points at one {points} each" in time.unit.why
    assert found.declared == declared


def test_stamps_of_packets_are_said_where_the_rate_is_asked(tmp_path: Path) -> None:
    columns = {"timestamp": np.repeat(np.arange(800.0) * 0.1, 10), **turned_by_hand()}
    asks = {q.key: q.text for q in drafted(table(tmp_path / "a.csv", columns)).questions}
    assert "has the stamp of the row before in 90 %" in asks["time.rate"]


def test_columns_of_one_clock_are_one_time_and_of_two_are_asked(tmp_path: Path) -> None:
    t: Floats = np.arange(400, dtype=float) * 0.01 + 0.12
    gyro = np.random.default_rng(3).standard_normal(400) * 0.01
    twice = {"time": np.rint((1_717_013_147 + t) * 1e9), "seconds_elapsed": t, "gyro [rad/s]": gyro}
    found = drafted(table(tmp_path / "twice.csv", twice))
    assert not asked(found)
    assert found.left_out in {("time",), ("seconds_elapsed",)}
    late = {"time [s]": t, "stamp [s]": t + 0.022, "gyro [rad/s]": gyro}
    assert set(asked(drafted(table(tmp_path / "late.csv", late)))) == {"time.column"}


# ---------------------------------------------------------------------------------------------------------- positions


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


# ------------------------------------------------------------------------------------------------------------- tables


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


# ----------------------------------------------------------------------------------------------- stated, but doubtful


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
