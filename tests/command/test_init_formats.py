"""Files of phones, boards, receivers and spreadsheets as strangers bring them: read right, asked, or refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from insenv.core.errors import InputError
from insenv.data.guess.decide import draft
from insenv.data.guess.draft import Draft
from insenv.data.guess.listing import listing
from insenv.data.init import init
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.readers.stamps import second, seconds

ROWS = 200
T = np.arange(ROWS) * 0.02
RATE = 12.5 + np.sin(np.arange(ROWS))  # deg/s, or whatever the heading says


def rows(*columns: object, sep: str = ",", form: str = "{:.6f}") -> str:
    """A line for each row; arrays are written as numbers, texts as they are."""
    cells = [[form.format(v) for v in c] if isinstance(c, np.ndarray) else [c] * ROWS for c in columns]
    return "".join(sep.join(line) + "\n" for line in zip(*cells, strict=True))


def with_commas(text: str) -> str:
    return text.replace(".", ",")


def drafted(path: Path, text: str | bytes, **answers: str) -> Draft:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return draft([listing(path)], {key.replace("__", "."): value for key, value in answers.items()})


def units(made: Draft) -> dict[str, str | None]:
    return {c.name: c.unit.value for c in made.channels}


LABVIEW = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nDecimal_Separator\t,\nDate\t2026/11/22\n***End_of_Header***\t\n"
    "Channels\t1\t\nSamples\t200\t\nY_Unit_Label\tdeg/s\t\n***End_of_Header***\t\t\nX_Value\tGyro\tComment\n"
)
SHIMMER = "sep=\t\nTimestamp_Unix_CAL\tAccel_LN_X_CAL\tGyro_X_CAL\t\nms\tm/(s^2)\tdeg/s\t\n"
STAMPS = "".join(
    f"22.11.2026 13:45:{int(t):02d},{round(t % 1 * 1000):03d}\t{with_commas(f'{r:.4f}')}\n"
    for t, r in zip(T, RATE, strict=True)
)
READ: dict[str, str | bytes] = {
    "decimal commas": "Time (s);Gyro (deg/s)\n" + with_commas(rows(T, RATE, sep=";")),
    "with exponents": '"Time (s)";"Gyro (deg/s)"\n' + with_commas(rows(T, RATE, sep=";", form="{:.9E}")),
    "in quotation marks": '"Time (s)","Gyro (deg/s)"\n'
    + with_commas(rows(T, RATE, sep=";")).replace(";", '","').replace("\n", '"\n"')[:-1].join(['"', ""]),
    "a tab behind": LABVIEW + with_commas(rows(T, RATE, "", sep="\t")),
    "of Windows": "Zeit [s];Drehrate Gyro [°/s];Temperatur [°C]\n".encode("cp1252")
    + rows(T, RATE, "25.0", sep=";").encode(),
    "between blanks": "   Time [s]   Gyro X [deg/s]\n" + rows(T, RATE, sep="    "),
    "the minus of typesetters": "Time [s],Gyro [deg/s]\n" + rows(T - 1.99, RATE).replace("-", "\u2212"),
    "of Fortran": "Time [s],Gyro [deg/s]\n" + rows(T, RATE, form="{:.9E}").replace("E", "D"),
    "bars": "Time [s]|Gyro [deg/s]\n" + rows(T, RATE, sep="|"),
    "seconds of arc": "Time [s],Gyro [deg/s],Elevation\n" + rows(T, RATE, "12°34'56\""),
    "the week of a receiver": "gps_tow [s],gyro [deg/s]\n" + rows((604_798 + T) % 604_800, RATE),
    "32 bits": "time_us,gyro [deg/s]\n" + rows(np.rint(4294967296 - 2e6 + 1e6 * T) % 2**32, RATE),
    "16 bits": "time [ms],gyro [deg/s]\n" + rows((64_000 + 1e3 * T) % 65_536, RATE),
    "summer time that ends": "time,gyro [deg/s]\n"
    + "".join(
        f"2026-10-25T02:{f'59:{58 + t:06.3f}+02:00' if t < 2 else f'00:{t - 2:06.3f}+01:00'},{r:.6f}\n"
        for t, r in zip(T, RATE, strict=True)
    ),
    "units and remarks below": "Time\tOmega\ns\tdeg/s\n\tthe first\n" + rows(T, RATE, sep="\t"),
}


@pytest.mark.parametrize("kind", READ)
def test_numbers_come_as_they_were_written(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "a.txt" if kind in ("between blanks", "units and remarks below") else tmp_path / "a.csv"
    made = drafted(path, READ[kind], **({"gyro__unit": "deg/s"} if kind == "a tab behind" else {}))
    assert not made.questions
    init([path], answers={"gyro.unit": "deg/s"} if kind == "a tab behind" else {})
    (read,) = read_recordings(load_manifest(path.with_suffix(".toml")))
    (gyro,) = (channel for name, channel in read.channels.items() if name.startswith("gyro"))
    assert np.allclose(np.degrees(gyro.values), RATE, atol=1e-6) and np.allclose(np.diff(read.t), 0.02)


def test_the_first_row_of_a_file_without_headings_is_a_row(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text(STAMPS)
    found = listing(tmp_path / "a.txt")
    assert found.rows == ROWS and np.allclose(found.columns[1].values, RATE, atol=1e-4)
    assert np.allclose(np.diff(found.columns[0].values), 0.02, atol=1e-6)


@pytest.mark.parametrize(
    ("stamp", "other", "apart"),
    [
        ("22-Nov-2026 13:45:01.5", "22-Nov-2026 13:45:02.0", 0.5),
        ("31.12.2026 23:59:59,9", "01.01.2027 00:00:00,0", 0.1),
        ("11/22/2026 1:45:01 PM", "11/23/2026 1:45:01 PM", 86400.0),
        ("22/11/2026 13:45:01", "23/11/2026 13:45:01", 86400.0),
        ("59:59.9", "00:00.0", 0.1),
    ],
)
def test_stamps_with_the_day_first_and_of_minutes(stamp: str, other: str, apart: float) -> None:
    assert np.diff(seconds([stamp, other]))[0] == pytest.approx(apart, abs=1e-5)


def test_a_date_that_may_be_of_two_months_is_none() -> None:
    assert np.isnan(second("05/06/2026 13:45:01"))


REFUSED = {
    "thousands of Germany": (
        "t [s];gyro [deg/h]\n" + with_commas(rows(T, sep=";")).replace("\n", ";2.063,156\n"),
        "2.063,156",
    ),
    "thousands of America": ("t [s],gyro [deg/h]\n" + rows(T, '"2,063.16"'), "2,063.16"),
    "thousands of Germany, later": (
        "t [ms];gyro [deg/s]\n" + "".join(f"{'1.' if k > 150 else ''}{k % 151 + 100};0,{k:03d}\n" for k in range(ROWS)),
        "1.100",
    ),
    "a pointer": ("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n", "Git LFS"),
    "another record": ("%CORRIMUDATASA,2394,5.0;2394,5.0,0.1,0.1,0.1,0.1,0.1,0.1*5aa97065\n" * 5, "CORRIMUDATASA"),
    "very wide": (",".join(["c"] * 3000) + "\n" + (",".join(["1"] * 3000) + "\n") * 5, "3000 columns"),
    "a page": ("<!DOCTYPE html>\n<html><body>\n<p>Not found</p>\n</body></html>\n", "no rows of numbers"),
    "another unit further down": (
        "t [s],gyro [deg/s]\n" + rows(T, RATE) + "t [s],gyro [rad/s]\n" + rows(T + 4, RATE / 57.3),
        "line 202: another header ('gyro [rad/s]' for 'gyro [deg/s]')",
    ),
    "another order further down": (
        "t [s],gyro_x [deg/s],gyro_y [deg/s]\n"
        + rows(T, RATE, 0 * T)
        + "t [s],gyro_y [deg/s],gyro_x [deg/s]\n"
        + rows(T),
        "another header",
    ),
    "hexadecimal counts": ("t [s],gyro [deg/s]\n" + rows(T, "0x12AF"), "0x12AF"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_what_would_be_read_wrong_is_refused_in_words(kind: str, tmp_path: Path) -> None:
    text, said = REFUSED[kind]
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError) as refused:
        init([tmp_path / "a.csv"])
    assert said in str(refused.value) and "\n" not in str(refused.value)


HEADINGS: dict[str, tuple[str, dict[str, str | None]]] = {
    "Fahrenheit": ("t [s],gyro [deg/s],Chamber Temp (F)", {"temperature": "degF"}),
    "kelvin": ("t [s],gyro [deg/s],T [K]", {"temperature": "K"}),
    "counts of a thermometer": ("t [s],gyro [deg/s],TEMP_OUT", {"temperature": None}),
    "a temperature in volts": ("t [s],gyro [deg/s],Temp (V)", {"temperature": None}),
    "time in other words": ("tov (s),gyro [deg/s],n", {"time": "s"}),
    "units of each its own": ("t [s],gyro_x [deg/s],gyro_y [rad/s]", {"gyro_x": "deg/s", "gyro_y": "rad/s"}),
    "turns in words": ("t [s],Roll Rate [deg/s],Yaw Rate [deg/s]", {"gyro_x": "deg/s", "gyro_z": "deg/s"}),
    "a gyro by its kind": ("t [s],FOG (V),Rate (dps)", {"gyro": None, "table_rate": "dps"}),
    "abbreviations": ("t [s],gyroADC[0],X_ACCL_OUT", {"gyro_x": None, "accel_x": None}),
}


@pytest.mark.parametrize("kind", HEADINGS)
def test_what_headings_say_and_do_not_say(kind: str, tmp_path: Path) -> None:
    heading, expected = HEADINGS[kind]
    third = np.full(ROWS, 250.0)
    text = heading + "\n" + rows(T, RATE, third, form="{:g}")
    found = units(drafted(tmp_path / "a.csv", text, procedure="static"))
    assert {name: found.get(name, "no such channel") for name in expected} == expected


def test_the_rate_above_the_header_tells_the_unit_of_the_stamps(tmp_path: Path) -> None:
    stamps = np.arange(ROWS) * 200.0 + 1_003_254
    text = "// Sample rate: 50.0Hz\nSampleTimeFine\tGyr_X [deg/s]\n" + rows(stamps, RATE, sep="\t")
    assert units(drafted(tmp_path / "a.txt", text))["time"] == "0.1 ms"
    other = drafted(tmp_path / "b.txt", text.replace("50.0Hz", "31.0Hz"))
    assert [q.hint for q in other.questions if q.key == "time.unit"] == [""]


def test_rates_of_a_table_commanded_and_read_are_no_gyro(tmp_path: Path) -> None:
    steps = np.repeat([0.0, 10.0, -10.0, 50.0], ROWS // 4)
    text = "Time (s), Rate Cmd (dps), Rate Act (dps), FOG out (V)\n" + rows(T, steps, steps, steps * 0.02, sep=", ")
    assert {q.key for q in drafted(tmp_path / "a.csv", text).questions} == {"table_rate.column", "gyro.unit"}


def test_a_table_in_dps_agrees_with_a_gyro_in_degrees(tmp_path: Path) -> None:
    steps = np.repeat([0.0, 10.0, -10.0, 50.0], ROWS // 4)
    text = "Time (s),gyro (deg/s),table_rate (dps)\n" + rows(T, steps * 1.0003, steps)
    assert not drafted(tmp_path / "a.csv", text).questions


@pytest.mark.parametrize(
    ("stamps", "said"),
    [(lambda t: 0 * t + 12.5, "stands still"), (lambda t: -t, "runs backwards")],
)
def test_a_time_that_does_not_run_is_said(
    stamps: Callable[[np.ndarray], np.ndarray], said: str, tmp_path: Path
) -> None:
    (question,) = drafted(tmp_path / "a.csv", "time [s],gyro [deg/s]\n" + rows(stamps(T), RATE)).questions
    assert question.key == "time.rate" and f"time [s] {said}" in question.text


def test_columns_of_a_log_that_states_them(tmp_path: Path) -> None:
    lines = ["FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns", "FMT, 133, 40, IMU, Qf, TimeUS,GyrX"]
    for t, r in zip(T, RATE, strict=True):
        lines += [f"IMU, {t * 1e6:.0f}, {r:.5f}", "ATT, 1, 2, 3"]
    (tmp_path / "a.log").write_text("\n".join(lines) + "\n")
    found = listing(tmp_path / "a.log")
    assert [c.heading for c in found.columns] == ["TimeUS", "GyrX"]


def test_a_row_of_units_in_brackets_is_no_row(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    made = drafted(path, SHIMMER.removeprefix("sep=\t\n") + rows(T * 1000 + 1.7e12, RATE, RATE, "", sep="\t"))
    assert units(made) == {"time": "ms", "accel_x": "m/(s^2)", "gyro_x": "deg/s"} and not made.notes


def test_many_short_parameters_beside_the_rows_are_not_taken_for_them(tmp_path: Path) -> None:
    """A navigation toolbox keeps seven columns of rows beside a dozen parameters of three values each."""
    short = {f"p{k}": np.full(3, 0.1 * k) for k in range(12)}
    long = {"t": T, "wb": np.column_stack([RATE] * 3), "fb": np.tile([0.0, 0.0, -9.8], (ROWS, 1))}
    savemat(tmp_path / "imu.mat", {"imu": short | long})
    found = listing(tmp_path / "imu.mat")
    assert {len(c.values) for c in found.columns} == {ROWS}
    assert {c.name for c in draft([found], {}).channels} >= {"gyro_x", "accel_z", "time"}


def test_the_bare_letter_of_an_axis_is_taken_before_its_raw_and_summed_ones(tmp_path: Path) -> None:
    names = "timestamp,x,y,z,x_integral,y_integral,z_integral,x_raw,y_raw,z_raw\n"
    made = drafted(tmp_path / "sensor_gyro_0.csv", names + rows(1e6 * T, *[RATE] * 3, *[0.02 * RATE] * 3, *[RATE] * 3))
    assert {c.name: c.column for c in made.channels if c.name.startswith("gyro")} == {
        "gyro_x": "x",
        "gyro_y": "y",
        "gyro_z": "z",
    }


def test_a_file_whose_first_line_begins_with_zero_bytes_is_text(tmp_path: Path) -> None:
    """What a serial port had in its buffer: the line lacks digits, and is passed over."""
    text = rows(T, RATE, sep="\t")
    made = drafted(tmp_path / "port.tab", b"\0" * 6 + text[4:].encode(), columns="t [s],gyro [deg/s]")
    assert units(made)["gyro"] == "deg/s"
    assert len(listing(tmp_path / "port.tab").columns[0].values) == ROWS - 1
