"""Bad data files: every fault ends in one sentence: file, place, what was found, what was wanted."""

import math
import sys
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st

from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.remarks import remarks
from insenv.data.split import split

ROWS = 40
CHANNELS = {"time": "s", "gyro": "deg/s", "table_angle": "deg", "temperature": "degC"}
TABLE = np.column_stack(
    [np.arange(ROWS) / 10, np.sin(np.arange(ROWS)), 3.0 * np.arange(ROWS), 20 + np.arange(ROWS) / 50]
)
LABELS = ["rest"] * 15 + ["turn"] * (ROWS - 15)


def manifest_text(name: str, head: str = "", indices: bool = False) -> str:
    columns: list[object] = list(range(len(CHANNELS))) if indices else list(CHANNELS)
    lines = [f'{n} = {{ column = {c!r}, unit = "{u}" }}' for (n, u), c in zip(CHANNELS.items(), columns, strict=True)]
    lines += [] if indices else ['segment = { column = "segment" }']
    return (
        f'{head}data = "{name}"\n[channels]\n' + "\n".join(lines) + '\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    )


def write_csv(path: Path) -> None:
    rows = [",".join([*map(repr, row), label]) for row, label in zip(TABLE.tolist(), LABELS, strict=True)]
    path.write_text("\n".join([",".join([*CHANNELS, "segment"]), *rows]) + "\n")


def write_text(path: Path) -> None:
    path.write_text("".join(" ".join(map(repr, row)) + "\n" for row in TABLE.tolist()))


def write_npz(path: Path) -> None:
    np.savez(path, **dict(zip(CHANNELS, TABLE.T, strict=True)), segment=np.array(LABELS))


def write_parquet(path: Path) -> None:
    columns = dict(zip(CHANNELS, TABLE.T, strict=True)) | {"segment": np.array(LABELS)}
    pytest.importorskip("pyarrow.parquet").write_table(
        pytest.importorskip("pyarrow").table(columns), path, write_page_checksum=True
    )


def write_mat(path: Path, compress: bool = True) -> None:
    columns = dict(zip(CHANNELS, TABLE.T, strict=True)) | {"segment": np.array(LABELS, dtype=object)}
    scipy.io.savemat(path, columns, do_compression=compress)


def write_plain_mat(path: Path) -> None:
    write_mat(path, compress=False)


def write_mat73(path: Path) -> None:
    with pytest.importorskip("h5py").File(path, "w", userblock_size=512) as file:
        for name, column in zip(CHANNELS, TABLE.T, strict=True):
            file[name] = column[None, :]


def write_float64(path: Path) -> None:
    path.write_bytes(TABLE.astype("<f8").tobytes())


def write_psins(path: Path) -> None:
    rows = "".join(" ".join(map(str, row)) + "\n" for row in np.arange(6 * ROWS).reshape(-1, 6) % 7)
    path.write_text(f"% log\n\n0 0 0 0 0 0\n34 108 380 0 10 9.78\n.1 .1 .1 125 125 125\n{rows}")


PSINS_MANIFEST = 'data = "a.imu"\n[model]\ntarget = "gyro_x"\ndeclared = []\n'
BINARY = 'format = "float64-le"\ncolumns = 4\n'
MAT73 = manifest_text("a.mat").replace('segment = { column = "segment" }\n', "")
#: Every format: writer, name of the file, manifest.
GOOD: dict[str, tuple[Callable[[Path], None], str, str]] = {
    "csv": (write_csv, "a.csv", manifest_text("a.csv")),
    "text": (write_text, "a.txt", manifest_text("a.txt", indices=True)),
    "npz": (write_npz, "a.npz", manifest_text("a.npz")),
    "parquet": (write_parquet, "a.parquet", manifest_text("a.parquet")),
    "mat": (write_mat, "a.mat", manifest_text("a.mat")),
    "plain mat": (write_plain_mat, "a.mat", manifest_text("a.mat")),
    "mat 7.3": (write_mat73, "a.mat", MAT73),
    "text mat": (write_text, "a.mat", manifest_text("a.mat", indices=True)),
    "float64-le": (write_float64, "a.bin", manifest_text("a.bin", BINARY, indices=True)),
    "psins-imu": (write_psins, "a.imu", PSINS_MANIFEST),
}


def load(path: Path) -> tuple[Recording, ...]:
    """Everything that happens to a user's files before the first fit."""
    manifest = load_manifest(path)
    recordings = read_recordings(manifest)
    split(manifest, recordings)
    remarks(recordings)
    return recordings


def written(folder: Path, kind: str) -> Path:
    """Good data file of one kind, with its manifest beside it."""
    write, name, text = GOOD[kind]
    write(folder / name)
    (folder / "run.toml").write_text(text)
    return folder / name


def message_of(folder: Path) -> str:
    with pytest.raises(InputError) as caught:
        load(folder / "run.toml")
    message = str(caught.value)
    assert "\n" not in message
    return message


@pytest.mark.parametrize("kind", GOOD)
def test_the_files_are_good_before_they_are_damaged(tmp_path: Path, kind: str) -> None:
    written(tmp_path, kind)
    (recording,) = load(tmp_path / "run.toml")
    assert len(recording) == ROWS


# Text of the sound CSV (line 1: header, line 12: the row of 1.0 s), what replaces it, words of the message.
CSV_FAULTS = [
    ("\n1.0,", "\noops,", ["line 12", "'time'", "'oops'", "number"]),
    ("\n1.0,", "\n,", ["line 12", "'time'", "''", "number"]),
    ("\n1.0,", "\nnan,", ["line 12", "'time'", "nan", "finite"]),
    ("\n1.0,", "\n-inf,", ["line 12", "'time'", "-inf", "finite"]),
    ("\n1.0,", "\n1e999,", ["line 12", "'time'", "inf", "finite"]),
    ("\n1.0,", "\n1_0,", ["line 12", "'time'", "'1_0'", "number"]),
    ("\n1.0,", "\n0.5,", ["line 12", "runs backwards", "0.5 s after 0.9 s", "increases"]),
    ("\n1.0,", "\n1e30,", ["line 12", "'time'", "1e+30", "1e+12"]),
    ("\n1.0,", "\n\n\n0.5,", ["line 14", "runs backwards"]),
    ("\n1.0,", "\n1.0,7,", ["line 12", "6 values", "5"]),
    ("\n1.0,", "\n", ["line 12", "4 values", "5"]),
    ("\n1.0,", '\n"1.0,', ["line 12", "quotation mark"]),
    ("30.0,20.2,", "30.0,-300,", ["line 12", "'temperature'", "-26.85", "from 0"]),
    (",20.2,rest", ",20.2,\udcff", ["line 12", "'segment'", "UTF-8"]),
    ("gyro,", "gryo,", ["'gyro'", "channels.gyro", "'gryo'"]),
    ("gyro,", "time,", ["'time'", "channels.time", "2 times"]),
    ("gyro,", "7,", ["'gyro'", "channels.gyro"]),
    ("time,gyro,table_angle,temperature,segment\n", "", ["'time'", "channels.time"]),
]  # fmt: skip


@pytest.mark.parametrize("fast", [True, False], ids=["pyarrow", "python"])
@pytest.mark.parametrize(("old", "new", "words"), CSV_FAULTS, ids=[repr(new) for _, new, _ in CSV_FAULTS])
def test_a_fault_in_a_csv_is_named_with_its_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str, words: list[str], fast: bool
) -> None:
    path = written(tmp_path, "csv")
    text = path.read_text()
    assert text.count(old) == 1
    path.write_bytes(text.replace(old, new).encode("utf-8", "surrogateescape"))
    if not fast:
        monkeypatch.setitem(sys.modules, "pyarrow", None)
    message = message_of(tmp_path)
    assert message.startswith(f"{path}: ")
    assert [word for word in words if word not in message] == []


@pytest.mark.parametrize(("kind", "content", "words"), [
    ("csv", b"", ["no rows"]),
    ("csv", b"\n \n", ["no rows"]),
    ("csv", b"time,gyro,table_angle,temperature,segment\n", ["no rows"]),
    ("csv", b"time,gyro,table_angle,temperature,segment\n0,0,0,0,a\n", ["1 row", "at least 2"]),
    ("csv", b"\xfft\0i\0m\0e\0", ["line 1", "0xff", "UTF-8"]),
    ("csv", b"\xff\xfet\0i\0m\0e", ["UTF-16"]),
    ("csv", b"0,1,2,3,4\n1,1,2,3,4\n", ["channels.time"]),
    ("text", b"# only words\n", ["no rows"]),
    ("text", b"0 1 2 3\n1 1 2\n", ["line 2", "3 values", "4"]),
    ("text", b"0 1 2 3\n1 1 2 x\n", ["line 2", "'x'", "number"]),
    ("text", b"0 1 2\n1 1 2\n", ["column 3", "below 3"]),
    ("text mat", b"0 1 2 3\n1 1 2\n", ["line 2", "3 values", "4"]),
    ("float64-le", b"", ["no rows"]),
    ("float64-le", b"\0" * 65, ["65 bytes", "32"]),
    ("float64-le", np.arange(16.0).astype(">f8").tobytes(), ["row"]),
    ("npz", b"PK\x03\x04 no archive", ["npz", "undamaged"]),
    ("npz", b"", ["npz", "undamaged"]),
    ("parquet", b"PAR1PAR1", ["Parquet", "undamaged"]),
    ("parquet", b"", ["Parquet", "undamaged"]),
    ("mat", b"MATLAB 5.0 MAT-file" + b" " * 200, ["MATLAB", "undamaged"]),
    ("mat", b"", ["MATLAB", "undamaged"]),
    ("mat 7.3", b"\x89HDF\r\n\x1a\n" + b"\0" * 100, ["MATLAB", "undamaged"]),
    ("psins-imu", b"% log\n0 0 0 0 0 0\n", ["1 of the 3 header lines"]),
    ("psins-imu", b"0 0 0 0 0 0\n34 108 380 0 10\n", ["line 2", "six numbers"]),
    ("psins-imu", b"0 0 0 0 0 0\n34 108 380 0 0 9.78\n1 1 1 1 1 1\n1 2 3 4 5 6\n", ["0.0 ms", "above zero"]),
    ("psins-imu", b"0 0 0 0 0 0\n34 9 9 0 9 9.78\n0 1 1 1 1 1\n1 2 3 4 5 6\n2 2 3 4 5 6\n", ["0.0 arcsec"]),
    ("psins-imu", b"0 0 0 0 0 0\n34 9 9 0 9 9.78\n1 1 1 1 1 1\n1 2 3 4 5 6\n1 2 3\n", ["line 5", "3 values"]),
])  # fmt: skip
def test_a_broken_file_is_named(tmp_path: Path, kind: str, content: bytes, words: list[str]) -> None:
    path = written(tmp_path, kind)
    path.write_bytes(content)
    message = message_of(tmp_path)
    assert message.startswith(f"{path}: ")
    assert [word for word in words if word not in message] == []


@pytest.mark.parametrize("kind", GOOD)
def test_a_missing_file_and_a_folder_are_named(tmp_path: Path, kind: str) -> None:
    path = written(tmp_path, kind)
    path.unlink()
    assert message_of(tmp_path) == f"{path}: no such data file"
    path.mkdir()
    assert message_of(tmp_path) == f"{path}: is a folder; wanted a data file"


ARRAYS = dict(zip(CHANNELS, TABLE.T, strict=True)) | {"segment": np.array(LABELS)}


@pytest.mark.parametrize(("change", "words"), [
    ({"gyro": np.array(["x"] * ROWS)}, ["'gyro'", "text", "'x'", "real numbers"]),
    ({"gyro": TABLE[:, 1] + 1j}, ["'gyro'", "complex", "real numbers"]),
    ({"gyro": TABLE[:-1, 1]}, ["'gyro'", "39 rows", "40"]),
    ({"gyro": TABLE}, ["'gyro'", "shape (40, 4)", "name[0]"]),
    ({"gyro": np.array(1.0)}, ["'gyro'", "shape ()"]),
    ({"gyro": np.where(np.arange(ROWS) == 7, np.nan, 1.0)}, ["row 7", "'gyro'", "nan", "finite"]),
    ({"gyro": np.array([None] * ROWS)}, ["npz", "undamaged"]),
])  # fmt: skip
def test_an_array_that_is_no_column_is_named(tmp_path: Path, change: dict[str, np.ndarray], words: list[str]) -> None:
    path = written(tmp_path, "npz")
    np.savez(path, **{**ARRAYS, **change})
    message = message_of(tmp_path)
    assert message.startswith(f"{path}: ")
    assert [word for word in words if word not in message] == []


def test_a_missing_value_in_parquet_is_named(tmp_path: Path) -> None:
    path = written(tmp_path, "parquet")
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    values = [None if i == 7 else 1.0 for i in range(ROWS)]
    parquet.write_table(pa.table({**ARRAYS, "gyro": values}), path)
    assert message_of(tmp_path).startswith(f"{path}: row 7: column 'gyro' (channels.gyro) is missing")


@pytest.mark.parametrize(("old", "new", "words"), [
    ('"deg/s"', '"deg/sec2"', ["channels.gyro.unit", "deg/sec2"]),
    ('"deg/s"', '"m"', ["channels.gyro.unit", '"m"', "rate"]),
    (', unit = "deg/s"', "", ["channels.gyro.unit", "missing", "a.csv", "deg/s"]),
    ('"segment"', '"part"', ["'part'", "channels.segment", "segment"]),
    ('"gyro", unit', "9, unit", ["9", "channels.gyro", "below 5"]),
])  # fmt: skip
def test_a_channel_that_does_not_fit_the_file_is_named(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    written(tmp_path, "csv")
    manifest = tmp_path / "run.toml"
    manifest.write_text(manifest.read_text().replace("'", '"').replace(old, new, 1))
    message = message_of(tmp_path)
    assert [word for word in words if word not in message] == []


DAMAGE = st.lists(
    st.tuples(
        st.sampled_from(["flip", "cut", "insert", "remove", "swap"]),
        st.floats(0, 1, exclude_max=True),
        st.one_of(
            st.binary(min_size=1, max_size=4),
            st.sampled_from([b"\n", b",", b'"', b"-", b"e9", b"nan", b"\0", b" "]),
        ),
    ),
    min_size=1,
    max_size=3,
)


def damaged(content: bytes, damage: list[tuple[str, float, bytes]]) -> bytes:
    """``content`` with bytes flipped, cut off, inserted, removed or overwritten at relative places."""
    for kind, place, new in damage:
        at = int(place * len(content))
        if kind == "flip" and content:
            content = content[:at] + bytes([content[at] ^ (new[0] or 1)]) + content[at + 1 :]
        elif kind == "cut":
            content = content[:at]
        elif kind == "insert":
            content = content[:at] + new + content[at:]
        elif kind == "remove":
            content = content[:at] + content[at + len(new) :]
        else:
            content = content[:at] + new + content[at + len(new) :]
    return content


def assert_loads_or_refuses(path: Path) -> None:
    """A valid load, or an `InputError` of one line that names the manifest or the data file."""
    try:
        recordings = load(path)
    except InputError as error:
        assert "\n" not in str(error)
        assert str(path.parent) in str(error)
        return
    for recording in recordings:
        assert (np.diff(recording.t) > 0).all()
        for channel in recording.channels.values():
            assert channel.values.shape == recording.t.shape
            assert np.isfinite(channel.values).all()
            assert math.isfinite(channel.delay)


class Sound(dict[str, tuple[Path, bytes, bytes]]):
    """For each kind: the data file's path, its content and its manifest's."""

    def __repr__(self) -> str:  # the contents would drown a report
        return f"Sound({', '.join(self)})"


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Sound:
    made = Sound()
    for kind in GOOD:
        path = written(tmp_path_factory.mktemp("sound"), kind)
        made[kind] = (path, path.read_bytes(), (path.parent / "run.toml").read_bytes())
    return made


@pytest.mark.parametrize("kind", GOOD)
@settings(max_examples=150, derandomize=True, deadline=None)
@given(damage=DAMAGE)
def test_a_damaged_data_file_loads_or_is_refused(
    sound: Sound, kind: str, damage: list[tuple[str, float, bytes]]
) -> None:
    path, content, _ = sound[kind]
    path.write_bytes(damaged(content, damage))
    try:
        assert_loads_or_refuses(path.parent / "run.toml")
    finally:
        path.write_bytes(content)


def outcome(manifest: Path) -> list[list[float]] | str:
    """What a load gives: the samples, or the sentence."""
    try:
        (recording,) = load(manifest)
    except InputError as error:
        return str(error)
    return [recording.t.tolist(), *(channel.values.tolist() for channel in recording.channels.values())]


@settings(max_examples=300, derandomize=True, deadline=None)
@given(damage=DAMAGE)
def test_a_damaged_csv_is_the_same_with_and_without_pyarrow(
    sound: Sound, damage: list[tuple[str, float, bytes]]
) -> None:
    path, content, _ = sound["csv"]
    path.write_bytes(damaged(content, damage))
    try:
        fast = outcome(path.parent / "run.toml")
        with patch.dict(sys.modules, pyarrow=None):
            assert outcome(path.parent / "run.toml") == fast
    finally:
        path.write_bytes(content)


@settings(max_examples=300, derandomize=True, deadline=None)
@given(damage=DAMAGE)
def test_a_damaged_manifest_loads_or_is_refused(sound: Sound, damage: list[tuple[str, float, bytes]]) -> None:
    path, _, text = sound["csv"]
    manifest = path.parent / "run.toml"
    manifest.write_bytes(damaged(text, damage))
    try:
        assert_loads_or_refuses(manifest)
    finally:
        manifest.write_bytes(text)


@pytest.mark.parametrize("kind", ["csv", "text", "npz", "parquet", "mat", "mat 7.3", "float64-le", "psins-imu"])
@settings(max_examples=30, derandomize=True, deadline=None)
@given(content=st.one_of(st.binary(max_size=300), st.text(max_size=100).map(lambda t: t.encode("utf-8", "replace"))))
def test_any_content_of_a_data_file_loads_or_is_refused(sound: Sound, kind: str, content: bytes) -> None:
    path, good, _ = sound[kind]
    path.write_bytes(content)
    try:
        assert_loads_or_refuses(path.parent / "run.toml")
    finally:
        path.write_bytes(good)


def test_data_in_place_of_its_manifest_is_said_to_be_data(tmp_path: Path) -> None:
    (tmp_path / "my.csv").write_text("t,gyro\n0,1\n")
    with pytest.raises(InputError, match=r"my\.csv: is a file of data; wanted the manifest .*data = \"my\.csv\""):
        load_manifest(tmp_path / "my.csv")
