"""What of a file is read as its table: formats, settings above the header, lines of other kinds, empty columns."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from drafts.columns import TIME, drafted, turned_by_hand, units

from insenv.core.errors import InputError
from insenv.core.units import DEG
from insenv.data.guess.decide import draft
from insenv.data.guess.listing import listing
from insenv.data.guess.written import manifest_text
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest


def written(path: Path, lines: list[str]) -> Path:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


# ------------------------------------------------------------------------------------------------------------ formats


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


def test_arrays_that_lack_values_are_drafted_without_these_rows(tmp_path: Path) -> None:
    gyro = np.random.default_rng(3).standard_normal((400, 3))
    gyro[0] = np.nan
    np.savez(tmp_path / "run.npz", SENSgyro=gyro, SENStime=0.01 * np.arange(400))
    found = drafted(tmp_path / "run.npz")
    assert set(units(found)) == {"time", "gyro_x", "gyro_y", "gyro_z"}
    assert found.read == {"incomplete": "leave out"}
    assert found.rows == 399


def test_a_workbook_without_headings_is_refused(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for i in range(20):
        book.active.append([i, i * 0.5])
    book.save(tmp_path / "bare.xlsx")
    with pytest.raises(InputError, match="no header above its rows of numbers; wanted a header"):
        listing(tmp_path / "bare.xlsx")


def test_an_array_that_numpy_printed_is_a_table(tmp_path: Path) -> None:
    values = np.random.default_rng(1).standard_normal((40, 3))
    text = np.array2string(values, threshold=1000).splitlines()
    found = listing(written(tmp_path / "printed.txt", [*text[:20], "", *text[20:]]))
    assert found.rows == 40 and len(found.columns) == 3
    assert np.allclose(np.column_stack([c.values for c in found.columns]), values, atol=1e-6)


# ----------------------------------------------------------------------------------------------------- lines and rows


def test_a_rate_above_the_header_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("Fs,200\nInitialization time,36.5\ngyro [deg/s]\n" + "1.5\n2.5\n" * 99)
    assert units(drafted(path))["time"] == "200 Hz"


def test_a_header_below_prose_is_found(tmp_path: Path) -> None:
    rows = [f"{0.01 * i:.2f} {0.1 * i:.1f}" for i in range(40)]
    found = listing(written(tmp_path / "log.txt", ["StartTime: noon", "", "All in deg/s", "t_s gz", *rows]))
    assert [c.heading for c in found.columns] == ["t_s", "gz"]
    assert found.skip_lines == 3 and found.rows == 40


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
