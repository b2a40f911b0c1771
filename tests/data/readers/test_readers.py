"""Facts about recordings read from files: every format, units, intervals, gaps, splits, saving."""

import csv
import math
import os
import sys
from collections.abc import Callable
from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.files import Format
from insenv.core.recording import Channel, Floats, Mounting, Recording, Segment, Site
from insenv.data.load import read_recordings
from insenv.data.manifest import HeldOut, Manifest, Model, load_manifest
from insenv.data.remarks import remarks
from insenv.data.save import save
from insenv.data.split import RowUse, split

ROOT = Path(__file__).parents[3]
DEG = math.pi / 180
NAMES = ("t", "wx", "ax", "temp")
RNG = np.random.default_rng(1)
#: Time [s], rate [deg/s], specific force [ug], temperature [degC].
TABLE = np.column_stack([np.arange(50) / 10 + 3, RNG.normal(size=50), RNG.normal(9.8e5, 1e3, 50), 20 + RNG.random(50)])
LABELS = ["a"] * 20 + [""] * 5 + ["b"] * 25

MODEL = '\n[model]\ntarget = "gyro_x"\ndeclared = ["bias"]\n'
UNITS = {"time": "s", "gyro_x": "deg/s", "accel_x": "ug", "temperature": "degC"}


def channels(columns: tuple[object, ...], **extra: str) -> str:
    """``[channels]`` with the four columns of `TABLE`."""
    lines = [f'{n} = {{ column = {c!r}, unit = "{u}" }}' for (n, u), c in zip(UNITS.items(), columns, strict=True)]
    return "\n[channels]\n" + "\n".join(lines + [f"{name} = {spec}" for name, spec in extra.items()])


def manifest(folder: Path, text: str) -> Manifest:
    path = folder / "run.toml"
    path.write_text(text, encoding="utf-8")
    return load_manifest(path)


def read(folder: Path, text: str) -> Recording:
    return read_recordings(manifest(folder, text))[0]


def text_table(path: Path, delimiter: str, header: str | None, quote: bool = False) -> None:
    cell = (lambda v: f'"{v!r}"') if quote else repr
    rows = [delimiter.join(cell(float(v)) for v in row) for row in TABLE]
    path.write_text("\n".join([header, *rows] if header is not None else rows) + "\n", encoding="utf-8")


def write_csv(path: Path) -> None:
    text_table(path, ",", ",".join(NAMES))


def write_tabs(path: Path) -> None:
    text_table(path, "\t", "\t".join(NAMES))


def write_semicolons(path: Path) -> None:
    text_table(path, ";", '"t";"wx";"ax, along; the track";"temp"'.replace("ax, along; the track", "ax"), quote=True)


def write_headed_text(path: Path) -> None:
    text_table(path, "  ", "# made by hand\n% twice\n" + " ".join(NAMES))


def write_bare_text(path: Path) -> None:
    text_table(path, "  ", None)


def write_comma_text(path: Path) -> None:
    text_table(path, ", ", "some words that are no columns")


def write_windows_text(path: Path) -> None:
    text_table(path, " ", None)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))


def write_decimal_commas(path: Path) -> None:
    write_semicolons(path)
    path.write_bytes(path.read_bytes().replace(b".", b","))


def write_commented_csv(path: Path) -> None:
    write_csv(path)
    path.write_bytes(b"\xef\xbb\xbf# logger 3\r\n%\r\n" + path.read_bytes().replace(b"\n", b"\r\n"))


def write_hashed_header(path: Path) -> None:
    write_csv(path)
    path.write_bytes(b"# logger 3, unit 7\n#" + path.read_bytes())


def write_npz(path: Path) -> None:
    np.savez(path, **dict(zip(NAMES, TABLE.T, strict=True)))


def write_npz_matrix(path: Path) -> None:
    np.savez(path, imu=TABLE)


def write_parquet(path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    parquet.write_table(pa.table(dict(zip(NAMES, TABLE.T, strict=True))), path)


def write_mat(path: Path) -> None:
    scipy.io.savemat(path, {"imu": {"t": TABLE[:, 0], "m": TABLE[:, 1:]}})


def write_mat4(path: Path) -> None:
    scipy.io.savemat(path, dict(zip(NAMES, TABLE.T, strict=True)), format="4")


def write_mat73(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        file["imu/t"] = TABLE[:, :1].T
        file["imu/m"] = TABLE[:, 1:].T


def write_float64(path: Path) -> None:
    path.write_bytes(TABLE.astype("<f8").tobytes())


INDICES = (0, 1, 2, 3)
FIELDS = ("imu.t", "imu.m[0]", "imu.m[1]", "imu.m[2]")
#: Writer, file name, columns, further lines at the manifest's head.
FORMATS: list[tuple[Callable[[Path], None], str, tuple[object, ...], str]] = [
    (write_csv, "a.csv", NAMES, ""),
    (write_csv, "a.csv", INDICES, ""),
    (write_csv, "a.dat", NAMES, 'format = "csv"\n'),
    (write_tabs, "a.csv", NAMES, ""),
    (write_semicolons, "a.csv", NAMES, ""),
    (write_decimal_commas, "a.csv", NAMES, ""),
    (write_commented_csv, "a.csv", NAMES, ""),
    (write_hashed_header, "a.csv", NAMES, ""),
    (write_headed_text, "a.txt", NAMES, ""),
    (write_bare_text, "a.txt", INDICES, ""),
    (write_comma_text, "a.txt", INDICES, ""),
    (write_windows_text, "a.log", INDICES, ""),
    (write_npz, "a.npz", NAMES, ""),
    (write_npz_matrix, "a.npz", INDICES, ""),
    (write_npz_matrix, "a.npz", ("imu[0]", "imu[1]", "imu[2]", "imu[3]"), ""),
    (write_parquet, "a.parquet", NAMES, ""),
    (write_mat, "a.mat", FIELDS, ""),
    (write_mat4, "a.mat", NAMES, ""),
    (write_mat73, "a.mat", FIELDS, ""),
    (write_bare_text, "a.mat", INDICES, ""),
    (write_float64, "a.bin", INDICES, 'format = "float64-le"\ncolumns = 4\n'),
]
IDS = [f"{write.__name__.removeprefix('write_')}-{columns[0]}" for write, _, columns, _ in FORMATS]


def assert_is_the_table(recording: Recording) -> None:
    np.testing.assert_allclose(recording.t, TABLE[:, 0], rtol=1e-15)
    expected = (("gyro_x", "rad/s", DEG * TABLE[:, 1]), ("accel_x", "m/s^2", 9.80665e-6 * TABLE[:, 2]),
                ("temperature", "K", TABLE[:, 3] + 273.15))  # fmt: skip
    for name, unit, values in expected:
        np.testing.assert_allclose(recording.values(name, unit), values, rtol=1e-14)
        assert recording.channels[name].covers == "instant"


@pytest.mark.parametrize(("write", "name", "columns", "head"), FORMATS, ids=IDS)
def test_one_table_reads_the_same_from_every_format(
    tmp_path: Path, write: Callable[[Path], None], name: str, columns: tuple[object, ...], head: str
) -> None:
    write(tmp_path / name)
    assert_is_the_table(read(tmp_path, f'{head}data = "{name}"' + channels(columns) + MODEL))


@pytest.mark.parametrize("write", [write_csv, write_semicolons])
def test_a_csv_reads_the_same_without_pyarrow(
    tmp_path: Path, write: Callable[[Path], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    write(tmp_path / "a.csv")
    assert_is_the_table(read(tmp_path, 'data = "a.csv"' + channels(NAMES) + MODEL))


@pytest.mark.parametrize(("module", "write", "name", "columns"), [
    ("pyarrow", write_parquet, "a.parquet", NAMES), ("h5py", write_mat73, "a.mat", FIELDS),
])  # fmt: skip
def test_a_missing_library_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, write: Callable[[Path], None], name: str,
    columns: tuple[object, ...],
) -> None:  # fmt: skip
    write(tmp_path / name)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError, match=rf"{name}: .* {module}; install insenv\[io\]"):
        read(tmp_path, f'data = "{name}"' + channels(columns) + MODEL)


def test_columns_that_the_manifest_does_not_name_may_hold_anything(tmp_path: Path) -> None:
    rows = [[*map(repr, map(float, row)), 'a "quoted", word' if i % 2 else ""] for i, row in enumerate(TABLE)]
    with (tmp_path / "a.csv").open("w", newline="") as file:
        csv.writer(file).writerows([[*NAMES, "note"], *rows])
    assert_is_the_table(read(tmp_path, 'data = "a.csv"' + channels(NAMES) + MODEL))


def test_units_in_the_header_serve_where_the_manifest_gives_none(tmp_path: Path) -> None:
    text_table(tmp_path / "a.csv", ",", "time [s],gyro_x (deg/s),accel_x (ug),temperature (degC)")
    names = "".join(f"{name} = {{}}\n" for name in UNITS)
    assert_is_the_table(read(tmp_path, f'data = "a.csv"\n[channels]\n{names}' + MODEL))
    other = names.replace("gyro_x = {}", 'gyro_x = { unit = "rad/s" }')
    recording = read(tmp_path, f'data = "a.csv"\n[channels]\n{other}' + MODEL)
    np.testing.assert_array_equal(recording.values("gyro_x", "rad/s"), TABLE[:, 1])


def test_increments_become_mean_rates_over_the_interval(tmp_path: Path) -> None:
    text_table(tmp_path / "a.csv", ",", "t,wx,ax,temp")
    text = 'data = "a.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n' + (
        'gyro_x = { column = "wx", unit = "0.5 arcsec", quantity = "increment" }\n'
        'accel_x = { column = "ax", unit = "125 ug s", quantity = "increment" }\n'
    )
    recording = read(tmp_path, text + MODEL)
    gyro, accel = recording.channels["gyro_x"], recording.channels["accel_x"]
    np.testing.assert_allclose(gyro.values * 0.1, TABLE[:, 1] * 0.5 * DEG / 3600, rtol=1e-12)
    np.testing.assert_allclose(accel.values * 0.1, TABLE[:, 2] * 125e-6 * 9.80665, rtol=1e-12)
    assert (gyro.unit, gyro.covers, accel.unit, accel.covers) == ("rad/s", "interval", "m/s^2", "interval")


TABLE_ANGLE = """data = "a.csv"
[channels]
time = { column = "t", unit = "s" }
gyro_x = { column = "w", unit = "deg/s" }
table_angle = { column = "a", unit = "deg" }
"""


def write_angle(path: Path, angle: NDArray[Any]) -> None:
    path.write_text("t,a,w\n" + "\n".join(f"{i},{a},0" for i, a in enumerate(angle.tolist())))


def test_a_wrapped_angle_becomes_cumulative(tmp_path: Path) -> None:
    angle = 50.0 * np.arange(40) - 700
    write_angle(tmp_path / "a.csv", angle % 360)
    wrapped = TABLE_ANGLE.replace('"deg" }', '"deg", wrapped = true }')
    values = read(tmp_path, wrapped + MODEL).values("table_angle", "rad")
    np.testing.assert_allclose(values - values[0], (angle - angle[0]) * DEG, atol=1e-12)


def test_an_angle_that_jumps_undeclared_is_refused(tmp_path: Path) -> None:
    write_angle(tmp_path / "a.csv", (280 + 10.0 * np.arange(40)) % 360)
    with pytest.raises(InputError, match=r"line 10: channels\.table_angle jumps by a full turn.*wrapped = true"):
        read(tmp_path, TABLE_ANGLE + MODEL)


@pytest.mark.parametrize(("time", "step"), [('{ rate = "200 Hz" }', 0.005), ('{ column = "row" }', 1.0)])
def test_time_without_a_column(tmp_path: Path, time: str, step: float) -> None:
    write_bare_text(tmp_path / "a.txt")
    text = f'data = "a.txt"\n[channels]\ntime = {time}\ngyro_x = {{ column = 1, unit = "deg/s" }}' + MODEL
    np.testing.assert_allclose(read(tmp_path, text).t, step * np.arange(50))


@pytest.mark.parametrize("name", ["a.csv", "a.txt", "a.npz", "a.parquet", "a.mat"])
def test_labels_become_segments(tmp_path: Path, name: str) -> None:
    columns: dict[str, Any] = {"t": TABLE[:, 0], "w": TABLE[:, 1], "part": np.array(LABELS)}
    if name.endswith("npz"):
        np.savez(tmp_path / name, **columns)
    elif name.endswith("mat"):
        scipy.io.savemat(tmp_path / name, {**columns, "part": np.array(LABELS, dtype=object)})
    elif name.endswith("parquet"):
        parquet = pytest.importorskip("pyarrow.parquet")
        parquet.write_table(pytest.importorskip("pyarrow").table(columns), tmp_path / name)
    else:
        rows = zip(*(c.tolist() for c in columns.values()), strict=True)
        lines = [",".join(map(str, row)) for row in (columns, *rows)]
        (tmp_path / name).write_text("\n".join(lines))
    text = (
        f'data = "{name}"\n[channels]\ntime = {{ column = "t", unit = "s" }}\n'
        'segment = { column = "part" }\n'
        'gyro_x = { column = "w", unit = "deg/s" }'
    )
    recording = read(tmp_path, text + MODEL)
    assert recording.segments == (Segment("a", 0, 20), Segment("b", 25, 50))


PSINS = """% PSINS-format SIMU log file.
% with remarks

0 0 -90.6 0 0 0
34.5 108.9 380.0 100.0 10.0 9.78
0.1 0.2 0.3 125 250 375
1 2 3 4 5 6
-1 -2 -3 -4 -5 -6
0 0 2 0 0 80
"""


def test_a_psins_log_states_its_units_time_and_site(tmp_path: Path) -> None:
    (tmp_path / "a.imu").write_text(PSINS)
    recording = read(tmp_path, 'data = "a.imu"' + MODEL)
    np.testing.assert_allclose(recording.t, [100.01, 100.02, 100.03])
    assert astuple(recording.site) == (pytest.approx(34.5 * DEG), 380.0, None)
    for axis, k in zip("xyz", (1, 2, 3), strict=True):
        gyro, accel = recording.channels[f"gyro_{axis}"], recording.channels[f"accel_{axis}"]
        np.testing.assert_allclose(gyro.values[:2], np.array([k, -k]) * 0.1 * k * DEG / 3600 / 0.01)
        # The header's g is the unit that its ug is a millionth of.
        np.testing.assert_allclose(accel.values[:2], np.array([k + 3, -k - 3]) * 125e-6 * k * 9.78 / 0.01)
        assert gyro.covers == accel.covers == "interval"


def test_a_manifest_overrules_a_psins_header(tmp_path: Path) -> None:
    (tmp_path / "a.imu").write_text(PSINS)
    text = (
        'data = "a.imu"\n[site]\nlatitude = "10 deg"\naltitude = "5 m"\n'
        '[channels]\ntime = { rate = "50 Hz" }\n'
        'gyro_x = { unit = "1 arcsec" }'
    )
    recording = read(tmp_path, text + MODEL)
    assert astuple(recording.site) == (pytest.approx(10 * DEG), 5.0, None)
    assert list(recording.channels) == ["gyro_x"]
    assert recording.channels["gyro_x"].values[0] == pytest.approx(DEG / 3600 * 50)


def test_gaps_are_kept_apart_and_remarked_on(tmp_path: Path) -> None:
    t = np.arange(100) / 10
    t[40:] += 2.0
    t[70:] += 0.5
    (tmp_path / "a.txt").write_text("\n".join(f"{v!r} 0.1" for v in t.tolist()))
    columns = "[channels]\ntime = { column = 0, unit = 's' }\ngyro_x = { column = 1, unit = 'deg/s' }\n"
    recording = read(tmp_path, f'data = "a.txt"\n{columns}' + MODEL)
    assert recording.pieces() == (slice(0, 40), slice(40, 70), slice(70, 100))
    (remark,) = remarks([recording])
    assert remark == "a.txt: 2 gaps in time, 2.5 s in all, longest 2 s"


def at_rest(**factors: float) -> Recording:
    """A triad at rest on the equator with honest units, its triads multiplied by ``factors``."""
    rng = np.random.default_rng(2)
    mean = {"gyro": (0.0, 7.292115e-5, 0.0), "accel": (0.0, 0.0, 9.80665)}
    noise = {"gyro": 1e-4, "accel": 1e-2}
    made = {
        f"{name}_{axis}": Channel(factors.get(name, 1.0) * (m + noise[name] * rng.normal(size=1000)), unit)
        for name, unit in (("gyro", "rad/s"), ("accel", "m/s^2"))
        for axis, m in zip("xyz", mean[name], strict=True)
    }
    return Recording(np.arange(1000) / 10, made, label="rest")


@pytest.mark.parametrize(("factors", "words"), [
    ({}, []),
    ({"accel": 1 / 9.80665}, ["0.102 times gravity", "accel"]),
    ({"accel": -1.0}, ["points down", "RFU"]),
    ({"gyro": 1e6}, ["times the Earth's rate", "gyro"]),
    ({"gyro": 1e-4}, ["times the Earth's rate", "gyro"]),
])  # fmt: skip
def test_means_at_rest_betray_a_wrong_unit(factors: dict[str, float], words: list[str]) -> None:
    found = remarks([at_rest(**factors)])
    assert len(found) == bool(words)
    assert all(word in found[0] for word in words)


def test_jitter_is_tolerated_and_remarked_on(tmp_path: Path) -> None:
    t = (np.arange(200) + np.tile([0.0, 0.2], 100)) / 10
    (tmp_path / "a.txt").write_text("\n".join(f"{v!r} 0.1" for v in t.tolist()))
    columns = "[channels]\ntime = { column = 0, unit = 's' }\ngyro_x = { column = 1, unit = 'deg/s' }\n"
    recording = read(tmp_path, f'data = "a.txt"\n{columns}' + MODEL)
    assert len(recording.pieces()) == 1
    (remark,) = remarks([recording])
    assert remark.startswith("a.txt: time stamps jitter by 10 % of the period (one sigma) about an even clock of")
    assert recording.dt == pytest.approx(0.1, rel=1e-4)


def two_runs(folder: Path, tail: str) -> tuple[RowUse, ...]:
    """Use of the rows of two runs of 50 rows each, 0.1 s apart."""
    write_bare_text(folder / "a.txt")
    write_bare_text(folder / "b.txt")
    text = 'data = ["a.txt", "b.txt"]' + channels(INDICES) + MODEL + tail
    loaded = manifest(folder, text)
    return split(loaded, read_recordings(loaded))


def rows_of(uses: tuple[RowUse, ...], field: str) -> list[int]:
    return np.flatnonzero(np.concatenate([getattr(use, field) for use in uses])).tolist()


SPLITS = [
    ("", [*range(30, 50), *range(80, 100)], [*range(30), *range(50, 80)]),
    ("[held_out]\nruns = [2]", range(50, 100), range(50)),
    ('[held_out]\nstart = "4 s"', [*range(40, 50), *range(90, 100)], [*range(40), *range(50, 90)]),
    (
        "[held_out]\nrows = [[10, 20], [60, 61]]",
        [*range(10, 20), 60],
        [*range(10), *range(20, 60), *range(61, 100)],
    ),
    ("[held_out]\nrows = [[90, 100]]\n[fit]\nrows = [[5, 7], [50, 51]]", range(90, 100), [5, 6, 50]),
]


@pytest.mark.parametrize(("tail", "held_out", "fit"), SPLITS, ids=["default", "runs", "start", "rows", "fit"])
def test_rows_are_split_as_the_manifest_says(tmp_path: Path, tail: str, held_out: range, fit: range) -> None:
    uses = two_runs(tmp_path, tail)
    assert [len(use.fit) for use in uses] == [50, 50]
    assert rows_of(uses, "held_out") == list(held_out)
    assert rows_of(uses, "fit") == list(fit)


@pytest.mark.parametrize(("tail", "words"), [
    ("[held_out]\nruns = [1, 2]", "every row is held out"),
    ('[held_out]\nstart = "0 s"', "every row is held out"),
    ('[held_out]\nstart = "1 h"', "no row is held out"),
    ("[held_out]\nrows = [[90, 101]]", r"held_out\.rows has \[90, 101\]; there are 100 rows"),
    ("[fit]\nrows = [[0, 101]]", r"fit\.rows has \[0, 101\]; there are 100 rows"),
    ("[fit]\nrows = [[0, 31]]\n[held_out]\nruns = [1]", "31 rows from row 0 on are in fit.rows and held out"),
    ("[held_out]\npositions = 'even'", "procedure = 'multi-position'"),
])  # fmt: skip
def test_a_split_that_cannot_be_is_refused(tmp_path: Path, tail: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        two_runs(tmp_path, tail)


def test_runs_keep_their_own_site_and_mounting(tmp_path: Path) -> None:
    write_bare_text(tmp_path / "a.txt")
    write_bare_text(tmp_path / "b.txt")
    runs = '[[runs]]\nfile = "a.txt"\n[[runs]]\nfile = "b.txt"\nlabel = "down"\nmounting.axes = "FRD"\n'
    first, second = read_recordings(manifest(tmp_path, runs + channels(INDICES) + MODEL))
    assert (first.label, first.mounting.axes) == ("a.txt", "RFU")
    assert (second.label, second.mounting.axes) == ("down", "FRD")


def recording_to_save(values: Floats, label: str, segments: tuple[Segment, ...]) -> Recording:
    made = {
        "gyro": Channel(values, "rad/s", "interval"),
        "table_angle": Channel(values * 3, "rad", delay=0.01),
        "temperature": Channel(np.abs(values) + 250, "K"),
    }
    site, mounting = Site(0.1 + 0.2, 380.1, 9.79), Mounting(0.3, "FRD")
    return Recording(np.arange(len(values)) / 7 + 1e5, made, segments, site, mounting, label)


def assert_same(first: Recording, second: Recording) -> None:
    np.testing.assert_array_equal(first.t, second.t)
    assert list(first.channels) == list(second.channels)
    for name, channel in first.channels.items():
        other = second.channels[name]
        np.testing.assert_array_equal(channel.values, other.values)
        assert (channel.unit, channel.covers, channel.delay) == (other.unit, other.covers, other.delay)
    for attribute in ("segments", "site", "mounting", "label"):
        assert getattr(first, attribute) == getattr(second, attribute)


@pytest.mark.parametrize("data_format", ["npz", "csv", "parquet"])
def test_what_is_saved_is_read_back_bit_for_bit(tmp_path: Path, data_format: Format) -> None:
    if data_format == "parquet":
        pytest.importorskip("pyarrow")
    rng = np.random.default_rng(3)
    segments = (Segment("rest", 0, 10), Segment("turn", 10, 15))
    runs = [recording_to_save(rng.normal(size=30), label, segments) for label in ("up", 'odd "name" \\ µ')]
    model = Model(("gyro",), ("bias", "earth_rate"), 300.1, "rate-table", "common")
    noise = {"gyro": {"angle_random_walk": 1.1e-7, "bias_instability": 2e-8, "quantization": 3e-6}}
    held_out = HeldOut(rows=((20, 30), (50, 60)), averaging=0.7)
    path = tmp_path / "new" / "run.toml"
    save(path, runs, model, title="Title", noise=noise, held_out=held_out, data_format=data_format)
    loaded = load_manifest(path)
    for saved, back in zip(runs, read_recordings(loaded), strict=True):
        assert_same(saved, back)
    assert (loaded.title, loaded.model, loaded.held_out) == ("Title", model, held_out)
    assert loaded.noise == noise
    assert sorted(p.name for p in path.parent.iterdir()) == [
        "run.toml",
        f"run_1.{data_format}",
        f"run_2.{data_format}",
    ]


@settings(max_examples=100, derandomize=True, deadline=None)
@given(title=st.text(st.characters(exclude_categories=["Cs"]), min_size=1))
def test_any_title_is_saved_and_read_back(tmp_path_factory: pytest.TempPathFactory, title: str) -> None:
    path = tmp_path_factory.getbasetemp() / "title.toml"
    run = recording_to_save(np.arange(5.0), "run", ())
    save(path, [run], Model(("gyro",), ()), title=title)
    assert load_manifest(path).title == title


def test_a_failed_save_leaves_everything_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run.toml"
    run = recording_to_save(np.arange(5.0), "run", ())
    save(path, [run], Model(("gyro",), ()), title="before")
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}

    def full_disk(file: Any, **_: Any) -> None:
        file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full_disk)
    with pytest.raises(InputError, match="No space left on device"):
        save(path, [run], Model(("gyro",), ()), title="after")
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_recordings_that_differ_cannot_share_a_manifest(tmp_path: Path) -> None:
    run = recording_to_save(np.arange(5.0), "first", ())
    other = Recording(run.t, {"gyro": run.channels["gyro"]}, label="second")
    with pytest.raises(InputError, match="second: channels differ from those of first"):
        save(tmp_path / "run.toml", [run, other], Model(("gyro",), ()))
    assert list(tmp_path.iterdir()) == []


def measured(name: str) -> Path:
    """Folder that holds the measured recording ``name``; skips where there is none."""
    for folder in (os.environ.get("INSENV_DATA"), ROOT.parent / "shared" / "data"):
        if folder and (Path(folder) / name).is_file():
            return Path(folder)
    pytest.skip(f"the measured recording {name} is neither in INSENV_DATA nor in ../shared/data")


def test_measured_laser_gyros_feel_gravity(tmp_path: Path) -> None:
    path = tmp_path / "laser.toml"
    path.write_text('data = "psins/lasergyro.imu"' + MODEL)
    (recording,) = read_recordings(load_manifest(path, measured("psins/lasergyro.imu")))
    assert (len(recording), recording.t[-1]) == (184718, pytest.approx(1847.18))
    # Normal gravity at 34.246 deg and 380 m is 9.7955 m/s^2; half a per cent of it is the biases' share.
    assert recording.channels["accel_z"].values.mean() == pytest.approx(9.7955, rel=0.005)
    assert remarks([recording]) == ()


def test_measured_two_positions_give_the_earths_rate(tmp_path: Path) -> None:
    files = ["ln100_updown/x_LN100_up.ins", "ln100_updown/x_LN100_down.ins"]
    path = tmp_path / "ln100.toml"
    path.write_text(
        f'data = {files}\nformat = "float64-le"\ncolumns = 7\n'
        '[channels]\ntime = { column = 0, unit = "s" }\n'
        'gyro_x = { column = 1, unit = "deg/s" }' + MODEL
    )
    up, down = read_recordings(load_manifest(path, measured(files[0])))
    means = [run.values("gyro_x", "rad/s").mean() / DEG * 3600 for run in (up, down)]
    assert (means[0] + means[1]) / 2 == pytest.approx(-0.254, abs=0.02)  # bias [deg/h]
    assert (means[0] - means[1]) / 2 == pytest.approx(11.73, abs=0.03)  # vertical Earth rate [deg/h]
