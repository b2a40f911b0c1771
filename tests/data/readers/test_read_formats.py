"""What people have: preambles, units in a row, strays, broken rows, matrices by rows, workbooks, R data, receivers."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st
from strangers import write

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest

N = 60
TABLE = np.column_stack([0.1 * np.arange(N), np.random.default_rng(1).normal(size=(N, 2))])
NAMED = """
[channels]
time = { column = "t", unit = "s" }
gyro = { column = "w", unit = "deg/s" }
accel = { column = "f", unit = "m/s^2" }
"""
BARE = NAMED.replace('"t"', "0").replace('"w"', "1").replace('"f"', "2")
MODEL = '[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'


def read(folder: Path, file: str, channels: str = NAMED, more: str = "", head: str = "") -> Recording:
    path = folder / "run.toml"
    path.write_text(f'data = "{file}"\n{head}\n{channels}\n{MODEL}\n{more}')
    return read_recordings(load_manifest(path))[0]


def rows(delimiter: str = ",") -> str:
    return "\n".join(delimiter.join(map(repr, row)) for row in TABLE.tolist()) + "\n"


def is_whole(found: Recording, first: int = 0) -> None:
    np.testing.assert_allclose(found.t, TABLE[first:, 0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.channels["gyro"].values, np.deg2rad(TABLE[first:, 1]), rtol=1e-12)
    np.testing.assert_allclose(found.channels["accel"].values, TABLE[first:, 2], rtol=1e-12)


HEADS = {
    "a comment that is the header": "% t\tw\tf\n",
    "a preamble of other widths": "Fs,100\nLogging Type,0\nt,w,f\n",
    "a preamble of sentences": "=~=~= log 2022.05.13 =~=~=\n\nunit 7, bench 3; second floor\nt,w,f\n",
    "a row of units": "t,w,f\ns,deg/s,m/s^2\n",
    "a row of units in brackets": "t;w;f\n[s];[deg/s];[m/s^2]\n",
}


@pytest.mark.parametrize("name", HEADS)
def test_the_header_is_found_by_its_names(tmp_path: Path, name: str) -> None:
    head = HEADS[name]
    delimiter = next(d for d in "\t;," if d in head.splitlines()[-1])
    (tmp_path / "a.csv").write_text(head + rows(delimiter))
    channels = re.sub(', unit = "[^"]*"', "", NAMED) if "units" in name else NAMED
    is_whole(read(tmp_path, "a.csv", channels))


def test_units_in_the_manifest_go_before_those_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,w,f\nms,rad/s,g\n" + rows())
    is_whole(read(tmp_path, "a.csv"))


def test_text_where_a_number_should_be_is_no_row_of_units(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,w,f\nnone,none,none\n" + rows())
    with pytest.raises(InputError, match="line 2: column 't'"):
        read(tmp_path, "a.csv")


@pytest.mark.parametrize("ending", ["csv", "txt"])
def test_lines_and_rows_are_skipped_as_told(tmp_path: Path, ending: str) -> None:
    (tmp_path / f"a.{ending}").write_text("7 of 9\n1,2\nt,w,f\n" + rows())
    found = read(tmp_path, f"a.{ending}", more="[read]\nskip_lines = 2\nskip = 3\n")
    is_whole(found, 3)
    with pytest.raises(InputError, match=r"read\.skip = 60 leaves nothing"):
        read(tmp_path, f"a.{ending}", more="[read]\nskip_lines = 2\nskip = 60\n")


def test_broken_rows_are_refused_and_left_out_where_told(tmp_path: Path) -> None:
    lines = rows().splitlines()
    lines[7], lines[8], lines[30] = ",,", "0.8,1", "3.0,nan,9"
    (tmp_path / "a.csv").write_text("t,w,f\n" + "\n".join(lines) + "\n")
    with pytest.raises(InputError, match="line 10: a row of 2"):
        read(tmp_path, "a.csv")
    found = read(tmp_path, "a.csv", more='[read]\nincomplete = "leave out"\n')
    assert len(found) == N - 3
    assert any("3 rows lack a value, the first line 9: left out" in note for note in found.notes)
    np.testing.assert_allclose(found.t, np.delete(TABLE[:, 0], [7, 8, 30]), rtol=0, atol=1e-12)


def test_rows_without_a_time_keep_their_places_where_some_are_left_out(tmp_path: Path) -> None:
    lines = rows().splitlines()
    lines[7] = lines[8] = ",,"
    (tmp_path / "a.csv").write_text("t,w,f\n" + "\n".join(lines) + "\n")
    timed = NAMED.replace('column = "t", unit = "s"', 'rate = "10 Hz"')
    found = read(tmp_path, "a.csv", timed, more='[read]\nskip = 2\nincomplete = "leave out"\n')
    np.testing.assert_allclose(found.t, np.delete(0.1 * np.arange(N - 2), [5, 6]), rtol=0, atol=1e-12)


@pytest.mark.parametrize(("at", "which"), [(-889.0, "first"), (5000.0, "last")])
def test_a_stray_row_is_left_out_and_said(tmp_path: Path, at: float, which: str) -> None:
    stray = np.array([[at, 0.0, 0.0]])
    table = np.concatenate([stray, TABLE] if at < 0 else [TABLE, stray])
    np.savetxt(tmp_path / "a.csv", table, "%.17g", ",", header="t,w,f", comments="")
    found = read(tmp_path, "a.csv")
    is_whole(found)
    assert found.notes[0].startswith(f"the {which} row lies")
    with pytest.raises(InputError, match=f"the {which} row lies"):
        read(tmp_path, "a.csv", more="[held_out]\nrows = [[40, 60]]\n")


def matrices(path: Path) -> str:
    content = {"run": TABLE.T.copy()}
    if path.suffix == ".mat":
        scipy.io.savemat(path, content)
    else:
        np.savez(path, run=content["run"])
    return NAMED.replace('"t"', '"run[0]"').replace('"w"', '"run[1]"').replace('"f"', '"run[2]"')


def workbook(path: Path) -> str:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["unit 7", None, None])
    book.active.append(["t", "w", "f", "remark"])
    for row in TABLE.tolist():
        book.active.append([*row, None])
    book.save(path)
    return NAMED


def r_data(path: Path) -> str:
    rdata = pytest.importorskip("rdata")
    pandas = pytest.importorskip("pandas")
    rdata.write_rda(path, {"imu": pandas.DataFrame(TABLE, columns=["t", "w", "f"])})
    return NAMED.replace('"t"', '"imu.t"').replace('"w"', '"imu.w"').replace('"f"', '"imu.f"')


FILES: dict[str, Callable[[Path], str]] = {
    "rows.mat": matrices,
    "rows.npz": matrices,
    "sheet.xlsx": workbook,
    "frame.rda": r_data,
}


@pytest.mark.parametrize("name", FILES)
def test_one_table_reads_the_same_from_every_format(tmp_path: Path, name: str) -> None:
    is_whole(read(tmp_path, name, FILES[name](tmp_path / name)))


@pytest.mark.parametrize("name", ["sheet.xlsx", "frame.rda"])
@settings(max_examples=40, deadline=None)
@given(damage=st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), min_size=1, max_size=3), cut=st.floats(0, 1))
def test_a_damaged_file_loads_or_is_refused(
    tmp_path_factory: pytest.TempPathFactory, name: str, damage: list[tuple[float, int]], cut: float
) -> None:
    folder = tmp_path_factory.mktemp("damaged")
    channels = FILES[name](folder / name)
    content = bytearray((folder / name).read_bytes())
    for at, byte in damage:
        content[int(at * (len(content) - 1))] = byte
    (folder / name).write_bytes(content if cut > 0.5 else content[: int(2 * cut * len(content))])
    try:
        read(folder, name, channels)
    except InputError as error:
        assert "\n" not in str(error)


@settings(max_examples=100, deadline=None)
@given(head=st.lists(st.text("ab,;\t%#1. \n\"'[]", max_size=12), max_size=6), reading=st.integers(0, 3))
def test_any_head_of_a_table_loads_or_is_refused(
    tmp_path_factory: pytest.TempPathFactory, head: list[str], reading: int
) -> None:
    folder = tmp_path_factory.mktemp("head")
    for name, channels in (("a.csv", NAMED), ("a.txt", BARE)):
        (folder / name).write_text("\n".join(head) + "\nt,w,f\n" + rows())
        try:
            found = read(folder, name, channels, more=f"[read]\nskip_lines = {reading}\n")
        except InputError as error:
            assert "\n" not in str(error)
        else:
            assert np.isfinite(found.channels["gyro"].values).all()


RECEIVER = """
[channels]
time = { column = "time" }
gyro_x = { column = "gyro_x", unit = "1e-9 rad" }
gyro_y = { column = "gyro_y", unit = "1e-9 rad" }
accel_y = { column = "accel_y", unit = "1e-6 m/s" }
"""


def log(short: bool = True) -> str:
    head = "%RAWIMUSA,2100,{s:.3f};" if short else "#RAWIMUA,COM1,0,55.5,FINESTEERING,2100,{s:.3f},02000020,bdba,32768;"
    lines = [
        head.format(s=100 + 0.01 * k)
        + f"2100,{100 + 0.01 * k:.9f},00000077,{k},-{2 * k},{3 * k},{4 * k},-{5 * k},{6 * k}*ab"
        for k in range(200)
    ]
    lines.insert(50, "#INSPVAA,COM1,0,1;2100,1,51,-114,1000,0,0,0,1,2,3,INS_SOLUTION_GOOD*cc")
    return "\r\n".join(lines)


@pytest.mark.parametrize("short", [True, False])
def test_a_receivers_log_has_z_first_and_y_reversed(tmp_path: Path, short: bool) -> None:
    (tmp_path / "a.asc").write_text(log(short))
    more = MODEL.replace('"gyro"', '"gyro_x"')
    path = tmp_path / "run.toml"
    path.write_text(f'data = "a.asc"\nformat = "novatel"\n{RECEIVER}\n{more}')
    found = read_recordings(load_manifest(path))[0]
    k = np.arange(200)
    np.testing.assert_allclose(np.diff(found.t), 0.01, atol=1e-9)
    np.testing.assert_allclose(found.channels["gyro_x"].values, 6e-9 * k / 0.01, rtol=1e-6)
    np.testing.assert_allclose(found.channels["gyro_y"].values, 5e-9 * k / 0.01, rtol=1e-6)
    np.testing.assert_allclose(found.channels["accel_y"].values, 2e-6 * k / 0.01, rtol=1e-6)
    assert found.channels["gyro_x"].covers == "interval"


def test_a_broken_record_of_a_log_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.asc").write_text(log().replace(",00000077,7,", ",00000077,", 1))
    path = tmp_path / "run.toml"
    path.write_text(f'data = "a.asc"\nformat = "novatel"\n{RECEIVER}\n' + MODEL.replace('"gyro"', '"gyro_x"'))
    with pytest.raises(InputError, match="line 8: a RAWIMUSA record of 8 values"):
        read_recordings(load_manifest(path))


CONVENTIONS = {
    "Kalibr": ("timestamp,omega_x,omega_y,omega_z,alpha_x,alpha_y,alpha_z", "timestamp", "omega_x", "alpha_x", 1e9),
    "EuRoC": (
        "#timestamp [ns],w_RS_S_x [rad s^-1],a,b,a_RS_S_x [m s^-2],c,d",
        "timestamp", "w_RS_S_x", "a_RS_S_x", 1e9,
    ),
    "PX4": (
        "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],accelerometer_m_s2[0],accelerometer_m_s2[1],accelerometer_m_s2[2]",
        "timestamp", "gyro_rad[0]", "accelerometer_m_s2[0]", 1e6,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CONVENTIONS)
def test_units_that_a_tool_takes_for_granted(tmp_path: Path, name: str) -> None:
    header, t, w, f, per_second = CONVENTIONS[name]
    lines = [f"{round(0.005 * k * per_second)},{k},0,0,{2 * k},0,0" for k in range(50)]
    (tmp_path / "a.csv").write_text(header + "\n" + "\n".join(lines) + "\n")
    channels = f'[channels]\ntime = {{ column = "{t}" }}\ngyro = {{ column = "{w}" }}\naccel = {{ column = "{f}" }}\n'
    found = read(tmp_path, "a.csv", channels)
    np.testing.assert_allclose(np.diff(found.t), 0.005, rtol=1e-9)
    np.testing.assert_allclose(found.channels["gyro"].values, np.arange(50.0))
    np.testing.assert_allclose(found.channels["accel"].values, 2 * np.arange(50.0))


@pytest.mark.parametrize("seed", range(6))
def test_uneven_rows_are_made_means_that_all_runs_have_rows_for(tmp_path: Path, seed: int) -> None:
    """Several runs with steps of 10 to 290 ms, each with pauses of its own: one grid for all."""
    draw = np.random.default_rng(seed)
    runs = []
    for _ in range(3):
        steps = draw.uniform(0.01, draw.uniform(0.05, 0.29), 1500)
        steps[draw.integers(0, 1500, 8)] = draw.uniform(0.5, 1.5, 8)
        t = np.cumsum(steps)
        rate = 0.5 * np.sin(t / 5)
        noise = 1e-3 * draw.standard_normal(1500)
        runs.append({"time": t, "gyro": 1.01 * rate + 0.01 + noise, "table_rate": rate})
    covers = 'covers = "instant"'
    says = {"gyro": covers, "table_rate": covers, "": ""}
    path = write(tmp_path, runs, says, ("bias", "scale_factor"))
    found = close(path)
    assert sum("resampled to" in remark for remark in found.remarks) == 3
    (k,) = [e for e in found.targets[0].estimates_after if e.effect == "scale_factor"]
    assert k.value == pytest.approx(0.01, abs=0.02)


def test_means_keep_the_grid_that_was_asked_for(tmp_path: Path) -> None:
    draw = np.random.default_rng(3)
    t = np.cumsum(draw.uniform(0.01, 0.2, 3000))
    c = {"time": t, "gyro": draw.standard_normal(3000)}
    path = write(tmp_path, [c], {"gyro": 'covers = "instant"', "": '[fit]\nresample = "4 Hz"\n'}, ("bias",))
    found = read_recordings(load_manifest(path))[0]
    assert found.dt == pytest.approx(1 / 4, rel=1e-12)
