"""What of a file is left out is named: columns with words or gaps, and the word in a row that lacks a value."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from insenv.core.errors import InputError
from insenv.data.guess.listing import listing

HEADINGS = ("time [s]", "gyro_x [deg/s]", "gyro_y [deg/s]")


def table(path: Path, words: dict[int, str], rows: int = 300) -> Path:
    """Two gyros at rest, of which the second has a word in some rows."""
    rng = np.random.default_rng(5)
    lines = [",".join(HEADINGS)]
    for i, (x, y) in enumerate(rng.normal(size=(rows, 2))):
        lines.append(f"{i * 0.01:.2f},{x:.5f},{words.get(i, f'{y:.5f}')}")
    path.write_text("\n".join(lines) + "\n")
    return path


def in_turn(rows: int = 400) -> dict[str, np.ndarray]:
    """A phone's log: a row has the accelerometers or the gyros."""
    rng = np.random.default_rng(6)
    values = {"acc": rng.normal(size=(rows, 3)) + [0, 0, 9.8], "gyr": rng.normal(size=(rows, 3))}
    values["acc"][::2], values["gyr"][1::2] = np.nan, np.nan
    return {"t": 0.01 * np.arange(rows), **values}


def test_the_word_in_a_row_that_is_left_out_is_said(tmp_path: Path) -> None:
    found = listing(table(tmp_path / "a.csv", {100: "fault"}))
    assert found.notes == ("1 row lacks a value, line 102 (gyro_y [deg/s] is 'fault'): left out",)
    found = listing(table(tmp_path / "b.csv", {100: ""}))
    assert found.notes == ("1 row lacks a value, line 102: left out",)


@pytest.mark.parametrize(("word", "said"), [("fault", "which has 'fault'"), ("nan", "which has 'nan'")])
def test_a_gyro_that_is_left_out_is_named_with_line_and_word(tmp_path: Path, word: str, said: str) -> None:
    found = listing(table(tmp_path / "a.csv", dict.fromkeys(range(2, 300, 3), word)))
    assert [c.heading for c in found.columns] == list(HEADINGS[:2])
    assert found.notes == (
        f"gyro_y [deg/s] is left out: 100 of 300 rows hold no number, the first of them line 4, {said}",
    )


def test_columns_of_no_instrument_are_left_out_without_a_word(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", dict.fromkeys(range(300), "still"))
    path.write_text(path.read_text().replace("gyro_y [deg/s]", "remark"))
    assert listing(path).notes == ()


def test_sensors_in_turn_are_one_clear_sentence(tmp_path: Path) -> None:
    values = in_turn()
    savemat(tmp_path / "phone.mat", values)
    rows = np.column_stack([values["t"], values["acc"], values["gyr"]])
    cells = [",".join("" if np.isnan(x) else f"{x:.5f}" for x in row) for row in rows]
    (tmp_path / "phone.csv").write_text("\n".join(["time [s],ax,ay,az,gyro_x,gyro_y,gyro_z", *cells]) + "\n")
    for name in ("phone.mat", "phone.csv"):
        with pytest.raises(InputError, match="no gyro and no accelerometer has a number in most rows") as error:
            listing(tmp_path / name)
        assert str(error.value).endswith("wanted a file for each sensor, with the rows that it has")


def test_a_slower_sensor_of_an_archive_is_left_out_by_name(tmp_path: Path) -> None:
    values = in_turn()
    values["gyr"] = np.random.default_rng(7).normal(size=values["gyr"].shape)
    savemat(tmp_path / "a.mat", values)
    found = listing(tmp_path / "a.mat")
    assert {str(c.key) for c in found.columns} == {"t", "gyr[0]", "gyr[1]", "gyr[2]"}
    assert [note.split(":")[0] for note in found.notes] == [f"acc[{i}] is left out" for i in range(3)]


def test_an_empty_file_is_said_to_be_empty(tmp_path: Path) -> None:
    (tmp_path / "a.csv").touch()
    with pytest.raises(InputError, match="is empty"):
        listing(tmp_path / "a.csv")
