"""Logs as loggers leave them: lines that are no rows are passed over and told, and one stamp out of order is no end."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Recording
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest

ROWS = 40


def lines() -> list[str]:
    rate = np.random.default_rng(0).normal(0, 0.01, ROWS)
    return ["t,gyro,state", *(f"{0.1 * i:.1f},{w:.6f},1" for i, w in enumerate(rate))]


def read(folder: Path, written: list[str], more: str = "", end: str = "\n") -> Recording:
    (folder / "log.csv").write_text("\n".join(written) + end)
    (folder / "log.toml").write_text(
        'data = "log.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        f'gyro = {{ column = "gyro", unit = "rad/s" }}\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n{more}'
    )
    (found,) = read_recordings(load_manifest(folder / "log.toml"))
    return found


def expected() -> np.ndarray:
    return np.array([float(line.split(",")[1]) for line in lines()[1:]])


@pytest.mark.parametrize("row", ["4.0,0.0", "4.0", "4.0,-", "4.0,0.01,", '4.0,"0.0'])
def test_a_last_line_that_is_cut_off_is_passed_over(tmp_path: Path, row: str) -> None:
    run = read(tmp_path, [*lines(), row], end="")
    full = row == "4.0,0.01,"  # all that is wanted of it is there
    np.testing.assert_array_equal(run.channels["gyro"].values, [*expected(), *([0.01] if full else [])])
    assert full or any(note == f"the last line, {ROWS + 2}, is cut off: passed over" for note in run.notes)


def test_a_cut_off_end_moves_no_row(tmp_path: Path) -> None:
    assert len(read(tmp_path, [*lines(), "4.0"], "[fit]\nrows = [[0, 40]]\n")) == ROWS


def test_a_short_line_between_others_is_a_fault(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="line 12: a row of 2 values; wanted 3"):
        read(tmp_path, [*lines()[:11], "1.0,0.1", *lines()[11:]])


def test_comments_and_headers_between_rows_are_passed_over(tmp_path: Path) -> None:
    told = [*lines()[:11], "# paused, by hand", *lines()[11:21], lines()[0], "#", *lines()[21:]]
    run = read(tmp_path, told)
    np.testing.assert_array_equal(run.channels["gyro"].values, expected())
    assert "3 lines are a comment or the header again, the first line 12: passed over" in run.notes
    with pytest.raises(InputError, match="wanted all of them where .* counts rows"):
        read(tmp_path, told, "[fit]\nrows = [[0, 40]]\n")


def test_a_cell_goes_on_in_the_next_line(tmp_path: Path) -> None:
    """An array that a program printed into a cell, over two lines."""
    printed = ["t,gyro,state", *(line[:-1] + '"[0. 0.\n 0. 0.]"' for line in lines()[1:])]
    np.testing.assert_array_equal(read(tmp_path, printed).channels["gyro"].values, expected())
    with pytest.raises(InputError, match="line 4: .*a quotation mark is not closed"):
        read(tmp_path, [*printed[:2], '0.1,0.1,"[0. 0.', *lines()[3:]])
    printed[5] = "0.4,oops,1"
    with pytest.raises(InputError, match="line 10: .* 'oops'; wanted a number"):
        read(tmp_path, printed)


def test_a_stamp_that_runs_back_by_less_than_a_step_is_a_late_one(tmp_path: Path) -> None:
    stamps = 0.1 * np.arange(400)
    stamps[201] = stamps[200] - 0.002
    rate = np.random.default_rng(1).normal(0, 0.01, 400)
    log = ["t,gyro,state", *(f"{t:.4f},{w:.6f},1" for t, w in zip(stamps, rate, strict=True))]
    run = read(tmp_path, log)
    np.testing.assert_allclose(run.t, 0.1 * np.arange(400), atol=1e-6)
    assert any(note.startswith("1 time stamp runs backwards, at line 203, by up to 0.002 s") for note in run.notes)
    log[202] = f"{stamps[201] - 5:.4f},0.0,1"
    with pytest.raises(InputError, match="line 203: time runs backwards"):
        read(tmp_path, log)


def test_the_loop_says_that_an_end_was_cut_off(tmp_path: Path) -> None:
    """The verdict stands, and a remark of the report names the line."""
    read(tmp_path, [*lines(), "4.0,0."], end="")
    found = close(tmp_path / "log.toml")
    assert any(f"the last line, {ROWS + 2}, is cut off: passed over" in remark for remark in found.remarks)


@pytest.mark.parametrize("layout", ["{t},{x};{y}", "{t},{x},{y};", "{t}; {x}, {y};"])
def test_rows_that_commas_and_semicolons_part_lose_nothing(tmp_path: Path, layout: str) -> None:
    rate = np.random.default_rng(1).normal(0, 0.01, (ROWS, 2)).round(6)
    rows = [layout.format(t=round(0.1 * i, 1), x=x, y=y) for i, (x, y) in enumerate(rate)]
    run = read_columns(tmp_path, rows)
    np.testing.assert_allclose(run.channels["gyro_x"].values, rate[:, 0])
    np.testing.assert_allclose(run.channels["gyro_y"].values, rate[:, 1])


def test_whole_counts_in_rows_that_end_in_a_semicolon_are_no_decimals(tmp_path: Path) -> None:
    counts = np.random.default_rng(2).integers(-3, 3, (ROWS, 2))
    run = read_columns(tmp_path, [f"{i},{x},{y};" for i, (x, y) in enumerate(counts)])
    np.testing.assert_array_equal(run.channels["gyro_y"].values, counts[:, 1])


def test_decimal_commas_between_semicolons_stay_decimal(tmp_path: Path) -> None:
    rate = np.random.default_rng(3).normal(0, 0.01, (ROWS, 2)).round(6)
    rows = [f"{0.1 * i:.1f};{x:.6f};{y:.6f}".replace(".", ",") for i, (x, y) in enumerate(rate)]
    run = read_columns(tmp_path, ["t;x;y", *rows], "csv")
    np.testing.assert_allclose(run.channels["gyro_y"].values, rate[:, 1])


def read_columns(folder: Path, rows: list[str], form: str = "text") -> Recording:
    """Time and two gyros, by their headings, or by their places in a file without them."""
    (folder / "log.txt").write_text("\n".join(rows) + "\n")
    keys = ('"t"', '"x"', '"y"') if form == "csv" else (0, 1, 2)
    (folder / "log.toml").write_text(
        f'data = "log.txt"\nformat = "{form}"\n[channels]\ntime = {{ column = {keys[0]}, unit = "s" }}\n'
        f'gyro_x = {{ column = {keys[1]}, unit = "rad/s" }}\ngyro_y = {{ column = {keys[2]}, unit = "rad/s" }}\n'
        '[model]\ntarget = ["gyro_x", "gyro_y"]\ndeclared = ["bias"]\n'
    )
    (found,) = read_recordings(load_manifest(folder / "log.toml"))
    return found
