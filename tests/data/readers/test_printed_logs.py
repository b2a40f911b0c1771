"""Logs as programs print them: lines that name their values, dates for stamps, stamps in two columns, blank rows."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.data.guess.listing import listing
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.readers.labelled import as_rows, names_of
from insenv.data.readers.stamps import seconds
from insenv.data.readers.table import Column
from insenv.data.readers.text import read_csv, read_text

ROWS = 40
RATES = np.round(np.random.default_rng(5).standard_normal((ROWS, 3)), 4)
NOON = datetime(2026, 3, 29, 11, 59, 59)
TIMES = 0.25 * np.arange(ROWS)
SETTINGS = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def read(folder: Path, lines: list[str], time: str, kind: str = "text", gyro: str = "gz") -> Recording:
    """The recording of a file of these ``lines``."""
    (folder / "log.txt").write_text("\n".join(lines) + "\n")
    manifest = f'data = "log.txt"\nformat = "{kind}"\n[channels]\ntime = {time}\n'
    manifest += f'gyro = {{ column = "{gyro}", unit = "rad/s" }}\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    (folder / "m.toml").write_text(manifest)
    return read_recordings(load_manifest(folder / "m.toml"))[0]


def same(found: Recording) -> None:
    """The recording is that of the fixed rates and times."""
    np.testing.assert_array_equal(found.channels["gyro"].values, RATES[:, 2])
    np.testing.assert_allclose(found.t - found.t[0], TIMES, atol=1e-6)


def stamped(form: str) -> list[str]:
    return [(NOON + timedelta(seconds=t)).strftime(form) for t in TIMES]


@pytest.mark.parametrize(
    "form",
    [
        *("%Y-%m-%d %H:%M:%S.%f", "%Y/%m/%dT%H:%M:%S.%fZ", "%H:%M:%S.%f", "%H:%M:%S,%f"),
        *("%Y_%m_%d_%H_%M_%S.%f", "%Y-%m-%d-%H-%M-%S.%f", "%I:%M:%S.%f %p"),
        *("%Y_%m_%d_%H_%M_%S_%f", "%Y-%m-%d %H-%M-%S-%f"),
    ],
)
def test_dates_and_times_of_day_are_read_in_seconds(form: str, tmp_path: Path) -> None:
    delimiter = ";" if "," in form else ","
    lines = [delimiter.join(("when", "gz"))]
    lines += [f"{stamp}{delimiter}{z}" for stamp, z in zip(stamped(form), RATES[:, 2], strict=True)]
    same(read(tmp_path, lines, '{ column = "when" }', "csv"))


def test_a_time_of_day_goes_on_after_midnight() -> None:
    assert seconds(["23:59:59.5", "00:00:00.5", "00:00:01.5"]) == pytest.approx([86399.5, 86400.5, 86401.5])


def test_noon_and_midnight_by_halves_of_the_day() -> None:
    assert seconds(["12:00:01 AM", "1:00:00 am", "12:00:00 PM", "11:59:59 PM"]) == pytest.approx(
        [1, 3600, 43200, 86399]
    )


def test_numbers_with_strokes_between_are_no_time_of_day() -> None:
    assert np.isnan(seconds(["10-20-30", "10_20_30", "12-2025-01"])).all()


@given(st.lists(st.datetimes(datetime(1971, 1, 1), datetime(2099, 1, 1)), min_size=1, max_size=5))
def test_a_date_is_its_seconds_since_1970(dates: list[datetime]) -> None:
    expected = [(one - datetime(1970, 1, 1)).total_seconds() for one in dates]
    assert seconds([one.isoformat(" ") for one in dates]) == pytest.approx(expected, abs=1e-6)


@SETTINGS
@given(st.text(max_size=30))
def test_any_text_is_a_stamp_or_none(text: str) -> None:
    found = seconds([text])
    assert found.shape == (1,)
    assert np.isnan(found[0]) or found[0] >= -1e11


@pytest.mark.parametrize(
    ("time", "line", "what"),
    [
        ('{ column = "when", unit = "ms" }', "12:00:00.5", "dates are read in seconds"),
        ('{ column = "when" }', "yesterday", "line 9: column 'when' .* is 'yesterday'; wanted a date or a time of day"),
    ],
)
def test_dates_that_cannot_be_are_refused(time: str, line: str, what: str, tmp_path: Path) -> None:
    lines = ["when,gz", *(f"{stamp},{z}" for stamp, z in zip(stamped("%H:%M:%S.%f"), RATES[:, 2], strict=True))]
    lines[8] = f"{line},0.1"
    with pytest.raises(InputError, match=what):
        read(tmp_path, lines, time, "csv")


@pytest.mark.parametrize(
    ("form", "name"),
    [
        ("gx: {x} gy: {y} gz: {z}", "gz"),
        ("GYRO: X={x},Y={y},Z={z},ACCEL: X=0.1,Y=0.2,Z=9.8", "GYRO Z"),
        ("Gyro X: {x} rad/s, Y: {y} rad/s, Z: {z} rad/s | Temp: 25.1 C", "Gyro Z"),
    ],
)
@pytest.mark.parametrize("noise", [[], ["MPU6050 found", "Calibrating ..."]])
def test_lines_that_name_their_values_are_rows(form: str, name: str, noise: list[str], tmp_path: Path) -> None:
    head = stamped("%H:%M:%S.%f")
    lines = [f"{t} -> {form.format(x=x, y=y, z=z)}" for t, (x, y, z) in zip(head, RATES.tolist(), strict=True)]
    same(read(tmp_path, noise + lines, '{ column = "time" }', gyro=name))


def test_a_line_that_lacks_a_name_is_told_by_its_number(tmp_path: Path) -> None:
    lines = ["boot", *(f"t: {t} gz: {z} gx: 1" for t, z in zip(TIMES, RATES[:, 2], strict=True))]
    lines[6] = "t: 1.25 gx: 1"
    with pytest.raises(InputError, match=r"line 7: column 'gz' .* is ''"):
        read(tmp_path, lines, '{ column = "t", unit = "s" }')


NAMES = st.from_regex(r"[A-Za-z][A-Za-z_]{3,8}", fullmatch=True)


@SETTINGS
@example(["AAAA", "g_AA"], [0.0] * 6, ": ", " ")
@example(["roll", "g"], [0.0] * 6, ": ", " ")
@given(
    st.lists(NAMES, min_size=2, max_size=6, unique=True),
    st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=6, max_size=6),
    st.sampled_from([": ", "=", " = "]),
    st.sampled_from([", ", " ", "\t", " | ", "; "]),
)
def test_names_and_values_come_back(names: list[str], values: list[float], sign: str, between: str) -> None:
    line = between.join(f"{name}{sign}{value!r}" for name, value in zip(names, values, strict=False))
    assert names_of(line) == tuple(names)
    assert [float(cell) for cell in as_rows(line, names)[0].split(",")] == values[: len(names)]


@pytest.mark.parametrize(
    ("line", "names", "values"),
    [
        (
            "Mag: 0.5 -0.8 7e-1  Accel: 0, 0.3,0.9",
            "Mag x,Mag y,Mag z,Accel x,Accel y,Accel z",
            "0.5,-0.8,7e-1,0,0.3,0.9",
        ),
        ("{'gyro': {'x': 48.2, 'y': -0.3}, 't': 12}", "gyro x,gyro y,t", "48.2,-0.3,12"),
        ('{"acc": [1.0, 2.0, 3.5], "stamp": 12}', "acc x,acc y,acc z,stamp", "1.0,2.0,3.5,12"),
        ("[1250 ms] ypr: 1 2 3 4", "time [ms],ypr 0,ypr 1,ypr 2,ypr 3", "1250,1,2,3,4"),
        ("Gyro: 1 2 3 deg/s", "Gyro x [deg/s],Gyro y [deg/s],Gyro z [deg/s]", "1,2,3"),
    ],
)
def test_several_values_of_one_name_are_columns(line: str, names: str, values: str) -> None:
    assert names_of(line) == tuple(names.split(","))
    assert as_rows(line, names_of(line)) == (values, 0)


KINDS = ["$VNYMR,{t},{x},{y},{z}*6A", "$GPGSV,3,1,12*7B", "$VNYMX,9,9,9,9*00"]


def test_comments_that_name_values_are_no_rows(tmp_path: Path) -> None:
    head = ["% robot 5", "% Motor [V] left, right: 8.0 8.0", "% Motor [A] left, right: 1.6 1.5", "% 1 time, 2-4 gyro"]
    rows = [f"{t} {x} {y} {z}" for t, (x, y, z) in zip(TIMES, RATES, strict=True)]
    (tmp_path / "log.txt").write_text("\n".join(head + rows) + "\n")
    manifest = 'data = "log.txt"\nformat = "text"\n[channels]\ntime = { column = 0, unit = "s" }\n'
    manifest += 'gyro = { column = 3, unit = "rad/s" }\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    (tmp_path / "m.toml").write_text(manifest)
    same(read_recordings(load_manifest(tmp_path / "m.toml"))[0])


def test_lines_of_one_kind_are_read(tmp_path: Path) -> None:
    """Among others, with checksums; the word is column 0."""
    rows = zip(TIMES, RATES, strict=True)
    lines = ["$GP"] + [k.format(t=t, x=x, y=y, z=z) for t, (x, y, z) in rows for k in KINDS]
    (tmp_path / "log.txt").write_text("\n".join(lines) + "\n")
    manifest = (
        'data = "log.txt"\nformat = "{}"\n[read]\nlines = "{}"\n[channels]\ntime = {{ column = 1, unit = "s" }}\n'
        'gyro = {{ column = 4, unit = "rad/s" }}\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    )
    (tmp_path / "m.toml").write_text(manifest.format("text", "$VNYMR"))
    same(read_recordings(load_manifest(tmp_path / "m.toml"))[0])
    for kind, word, what in [
        ("csv", "$VNYMR", "wanted format = 'text'"),
        ("text", "$VN", "no line begins with '.VN'.*lines begin with '.VNYMR', '.GPGSV'"),
        ("text", "a b", "wanted the first word of the lines"),
    ]:
        (tmp_path / "m.toml").write_text(manifest.format(kind, word))
        with pytest.raises(InputError, match=what):
            read_recordings(load_manifest(tmp_path / "m.toml"))


@pytest.mark.parametrize("line", ["1.0,2.0,3.0", "time [s],gyro x [deg/s]", "Fs: 100", "2026-03-29 11:59:59,1,2", ""])
def test_a_plain_row_or_header_names_no_values(line: str) -> None:
    assert names_of(line) == ()


def test_a_stamp_in_two_columns_is_one_time(tmp_path: Path) -> None:
    whole = 1_774_785_599 + (TIMES + 0.6).astype(int)
    parts = np.rint((TIMES + 0.6 - (TIMES + 0.6).astype(int)) * 1e9).astype(int)
    lines = ["secs,nsecs,gz", *(f"{a},{b},{z}" for a, b, z in zip(whole, parts, RATES[:, 2], strict=True))]
    same(read(tmp_path, lines, '{ column = "secs", nanoseconds = "nsecs" }', "csv"))
    with pytest.raises(InputError, match="wanted a column of whole seconds beside them"):
        read(tmp_path, lines, '{ column = "secs", nanoseconds = "nsecs", unit = "ms" }', "csv")


def test_an_empty_row_of_a_workbook_is_a_blank_line(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["t", "gz"])
    for t, z in zip(TIMES.tolist(), RATES[:, 2].tolist(), strict=True):
        book.active.append([None, None])
        book.active.append([t, z])
    book.save(tmp_path / "log.xlsx")
    (tmp_path / "m.toml").write_text(
        'data = "log.xlsx"\n[channels]\ntime = { column = "t", unit = "s" }\ngyro = { column = "gz", unit = "rad/s" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    )
    same(read_recordings(load_manifest(tmp_path / "m.toml"))[0])


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be"])
@pytest.mark.parametrize("kind", ["csv", "text"])
def test_text_of_two_bytes_a_character_is_read(tmp_path: Path, encoding: str, kind: str) -> None:
    lines = ["time [s],gz [rad/s]", *(f"{t:.2f},{rate}" for t, rate in zip(TIMES, RATES[:, 2], strict=True))]
    content = "\ufeff" * (encoding == "utf-16-be") + "\r\n".join(lines) + "\r\n"
    path = tmp_path / f"log.{'csv' if kind == 'csv' else 'txt'}"
    path.write_bytes(content.encode(encoding))
    columns = [Column("time", "time", False), Column("gyro", "gz", False)]
    table = (read_csv if kind == "csv" else read_text)(path, columns)
    np.testing.assert_array_equal(table.values["gyro"], RATES[:, 2])
    assert [c.heading for c in listing(path).columns] == ["time [s]", "gz [rad/s]"]
