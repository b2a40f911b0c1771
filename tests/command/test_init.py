"""`insenv init`: what is told is written, the rest is asked, and nothing that matters is assumed."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

import click
import numpy as np
import pytest
from command import ASYMMETRY, Ended, rows, run
from drafts.columns import DT, TIME, asked, drafted, on_table, table, turned_by_hand, units

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.units import DEG, STANDARD_GRAVITY
from insenv.data import commands
from insenv.data.guess.draft import Draft, Question
from insenv.data.init import fault, init
from insenv.data.manifest import load_manifest

Command = Callable[..., Ended]


@pytest.fixture
def insenv(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Command:
    return lambda *args: run(capsys, monkeypatch, *args)


def plain(folder: Path, header: str) -> Path:
    path = folder / "run.csv"
    path.write_text("\n".join([header, *rows()[1:]]) + "\n")
    return path


# -------------------------------------------------------------------------------------------------- at rest, or moved


def swung(rest: int, seed: int = 1) -> dict[str, Floats]:
    """Gyros [deg/s] of a unit that is swung slowly by hand about all axes after so many rows at rest, of 6000."""
    random = np.random.default_rng(seed)
    t = np.arange(6000) * DT
    rate = np.column_stack([60 * np.sin(2 * np.pi * f * t) for f in (0.031, 0.057, 0.083)])
    rate[:rest] = 0
    rate += 0.1 * random.standard_normal(rate.shape)
    return {"time [s]": t, **{f"gyro_{a} [deg/s]": rate[:, i] for i, a in enumerate("xyz")}}


def without_fit(path: Path) -> str:
    """The manifest beside a file, as it would be without the rows of a rest."""
    text = path.with_suffix(".toml").read_text().split("[fit]")[0]
    path.with_name("whole.toml").write_text(text)
    return "whole.toml"


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


def test_a_unit_that_mostly_rests_is_not_asked(tmp_path: Path) -> None:
    found = drafted(table(tmp_path / "a.csv", swung(rest=5000)))
    assert found.procedure.value == "static" and not found.questions


# ---------------------------------------------------------------------------------------------------------- questions


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


def test_columns_that_are_asked_are_the_targets(tmp_path: Path) -> None:
    names = [f"acc{n}{a}" for n in (68, 69) for a in "XYZ"]
    force = np.random.default_rng(1).standard_normal((400, len(names))).T
    columns = {"time [s]": TIME["time"][:400], **dict(zip(names, force, strict=True))}
    made = init([table(tmp_path / "a.csv", columns)])
    assert tomllib.loads(made.path.read_text())["model"]["target"] == ["accel_x", "accel_y", "accel_z"]


def test_runs_are_of_one_kind(tmp_path: Path) -> None:
    first, second = table(tmp_path / "a.csv", on_table()), table(tmp_path / "b.csv", on_table(seed=2))
    made = init([first, second], tmp_path / "both.toml")
    assert tomllib.loads(made.path.read_text())["data"] == ["a.csv", "b.csv"]
    table(second, {"time": np.arange(50.0) * DT, "other": np.ones(50)})
    with pytest.raises(InputError, match=r"b\.csv: its columns are not those of a\.csv"):
        init([first, second], tmp_path / "more.toml")


# -------------------------------------------------------------------------------------------------------- the command


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
