"""The command: exit status, what stands on standard output and standard error, and what files are left."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from command import ASYMMETRY, MANIFEST, Ended, interruptible, rows, run, write
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from insenv import cli
from insenv.close import close
from insenv.core.console.progress import Progress
from insenv.core.errors import InputError
from insenv.identify.findings import VERDICTS, Findings

PROGRESS = re.compile(r"\[ *\d+\.\d s\] .+")

Command = Callable[..., Ended]


@pytest.fixture
def insenv(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Command:
    return lambda *args: run(capsys, monkeypatch, *args)


def process(*args: object, program: str = "", **options: Any) -> subprocess.CompletedProcess[str]:
    """`insenv` in a process of its own; ``program`` may be Python text that calls it otherwise."""
    start = ["-c", program] if program else ["-m", "insenv.cli"]
    folder = str(Path(cli.__file__).parents[1])
    env = {**os.environ, "PYTHONPATH": folder, **options.pop("env", {})}
    command = [sys.executable, *start, *map(str, args)]
    return subprocess.run(command, capture_output=True, text=True, env=env, check=False, **options)


def files(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


# ------------------------------------------------------------------------------------------ good input


def is_estimate(block: Any) -> bool:
    return isinstance(block["name"], str) and isinstance(block["unit"], str) and is_number(block["value"])


def is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def check_contract(document: dict[str, Any], targets: int = 1) -> None:
    """Keys and types that outside programs rely on."""
    assert document["schema"] == "insenv.close-loop/1"
    assert document["manifest"].endswith(".toml")
    assert isinstance(document["rows"], int) and is_number(document["duration_s"])
    assert document["verdict"] in VERDICTS
    assert all(isinstance(name, str) for name in document["declared"])
    held_out = [document["held_out"]] if targets == 1 else list(document["held_out"].values())
    assert len(held_out) == targets
    for block in held_out:
        assert block.keys() >= {"before", "after", "noise_floor", "unit", "averaging_s"}
        assert all(is_number(block[key]) for key in ("before", "after", "noise_floor", "averaging_s"))
    for added in document["added"]:
        assert ":" not in added["effect"]
        assert all(is_number(added[key]) for key in ("p_value", "held_out_before", "held_out_after"))
        assert added["parameters"] and all(is_estimate(p) for p in added["parameters"])
        assert all(isinstance(key, str) for key in added["confounded_with"])
    for when in ("before", "after"):
        assert document["estimates"][when] and all(is_estimate(e) for e in document["estimates"][when])
    assert all(isinstance(r["effect"], str) and is_number(r["p_value"]) for r in document["rejected"])
    assert all(isinstance(n["needs"], list) for n in document["not_testable"])
    assert all(e.keys() >= {"separates", "procedure"} for e in document["next_experiment"])
    for block in [document["noise"]] if targets == 1 else document["noise"].values():
        assert all(is_number(n["value"]) and n["unit"] for n in block.values())


def strict(path: Path) -> dict[str, Any]:
    """The JSON of a report; NaN and infinity are no JSON."""

    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is no JSON")

    document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
    return document


def test_a_good_run_prints_and_writes_what_it_found(insenv: Command, tmp_path: Path) -> None:
    manifest, out = write(tmp_path / "in"), tmp_path / "out"
    out.mkdir()
    ended = insenv("close-loop", manifest, "--json", out / "a.json", "--html", out / "a.html")
    assert ended.status == 0
    assert all(PROGRESS.fullmatch(line) for line in ended.err.splitlines())
    document = strict(out / "a.json")
    check_contract(document)
    assert document["verdict"] == "effects-found"
    (added,) = document["added"]
    assert added["effect"] == "scale_factor_asymmetry"
    (found,) = added["parameters"]
    # Five standard deviations of the estimate itself: chance 6e-7.
    assert abs(found["value"] - ASYMMETRY) < 5 * found["sd"] < 0.3 * ASYMMETRY
    for text in (
        "gyro: effects-found",
        "scale_factor_asymmetry",
        "ppm",
        "Held-out error",
        str(out / "a.html"),
    ):
        assert text in ended.out
    page = (out / "a.html").read_text(encoding="utf-8")
    assert page.startswith("<!DOCTYPE html>") and "A table that reverses" in page
    assert sorted(path.name for path in out.iterdir()) == ["a.html", "a.json"]


def test_effects_restricts_the_search(insenv: Command, tmp_path: Path) -> None:
    manifest = write(tmp_path)
    assert insenv("close-loop", manifest, "--json", tmp_path / "a.json", "--effects", "bias_drift, tone").status == 0
    document = strict(tmp_path / "a.json")
    named = [
        entry["effect"].partition(":")[0] for key in ("added", "rejected", "not_testable") for entry in document[key]
    ]
    assert set(named) <= {"bias_drift", "tone"}
    assert document["verdict"] != "effects-found"


def test_a_seed_gives_the_same_json_byte_for_byte(insenv: Command, tmp_path: Path) -> None:
    manifest = write(tmp_path)
    written = []
    for _ in range(2):
        assert insenv("close-loop", manifest, "--seed", 7, "--json", tmp_path / "a.json").status == 0
        written.append((tmp_path / "a.json").read_bytes())
    assert written[0] == written[1]
    assert json.loads(written[0])["seed"] == 7


def test_several_targets_have_a_block_each(insenv: Command, tmp_path: Path) -> None:
    lines = [f"{a},{b.split(',')[1]}" for a, b in zip(rows(), rows(seed=2), strict=True)]
    lines[0] = "time,gyro,table,other"
    text = MANIFEST.replace("gyro = {", "gyro_x = {").replace('target = "gyro"', 'target = ["gyro_x", "gyro_y"]')
    text = text.replace("table_rate", 'gyro_y = { column = "other", unit = "deg/s" }\ntable_rate')
    ended = insenv("close-loop", write(tmp_path, text, lines), "--json", tmp_path / "a.json")
    assert ended.status == 0
    document = strict(tmp_path / "a.json")
    check_contract(document, targets=2)
    assert set(document["verdicts"]) == set(document["held_out"]) == set(document["noise"]) == {"gyro_x", "gyro_y"}
    assert document["verdict"] == min(document["verdicts"].values(), key=VERDICTS.index)
    for key in ("added", "rejected"):
        assert {entry["target"] for entry in document[key]} == {"gyro_x", "gyro_y"}
    assert {e["target"] for e in document["estimates"]["after"]} == {"gyro_x", "gyro_y"}


def test_line_ends_byte_order_marks_spaces_and_relative_paths_change_nothing(
    insenv: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = write(tmp_path / "plain")
    other = tmp_path / "a folder" / "my manifest.toml"
    other.parent.mkdir()
    text = MANIFEST.replace("run.csv", "my run 1.csv").replace('"table"', '"my table"')
    other.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    lines = ["time,gyro,my table", *rows()[1:]]
    (other.parent / "my run 1.csv").write_bytes(b"\xef\xbb\xbf" + "\r\n".join(lines).encode() + b"\r\n")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    options = ("--effects", "scale_factor_asymmetry", "--json")
    assert insenv("close-loop", plain, *options, "a.json").status == 0
    assert insenv("close-loop", Path("..") / "a folder" / other.name, *options, "b.json").status == 0
    first, second = strict(elsewhere / "a.json"), strict(elsewhere / "b.json")
    for key in ("manifest", "command", "data"):
        assert first.pop(key) != second.pop(key)
    assert first == second


def test_progress_is_told_after_two_seconds_and_on_standard_error(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [100.0]
    monkeypatch.setattr("insenv.core.console.progress.time.monotonic", lambda: now[0])
    say = Progress()
    for later, text in ((1.0, "early"), (2.0, "still early"), (3.0, "late")):
        now[0] = 100.0 + later
        say(text)
    told = capsys.readouterr()
    assert told.out == "" and told.err == "[  3.0 s] late\n"


# ------------------------------------------------------------------------------------------ bad input


def changed(old: str, new: str) -> Callable[[Path], None]:
    """Replace a text of the manifest."""

    def change(folder: Path) -> None:
        assert old in MANIFEST
        (folder / "run.toml").write_text(MANIFEST.replace(old, new, 1))

    return change


def row(number: int, text: str) -> Callable[[Path], None]:
    """Replace a row of the recording, counted from 1."""

    def change(folder: Path) -> None:
        lines = rows()
        lines[number] = text
        write(folder, lines=lines)

    return change


def only(count: int) -> Callable[[Path], None]:
    return lambda folder: void(write(folder, lines=rows(count)))


def content(name: str, data: bytes) -> Callable[[Path], None]:
    return lambda folder: void((folder / name).write_bytes(data))


def gone(name: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).unlink()


def a_folder(folder: Path) -> None:
    (folder / "run.csv").unlink()
    (folder / "run.csv").mkdir()


def unreadable(folder: Path) -> None:
    if os.geteuid() == 0:
        pytest.skip("root reads every file")
    (folder / "run.csv").chmod(0)


def void(value: object) -> None:
    del value


#: What is done to the good manifest and recording, and what the sentence must name.
BAD_FILES: dict[str, tuple[Callable[[Path], None], tuple[str, ...]]] = {
    "unknown table": (changed("[noise]", "[niose]"), ("run.toml", "niose", "did you mean 'noise'")),
    "unknown key": (changed("target =", "targte ="), ("run.toml", "model.targte")),
    "unknown channel": (changed("gyro = {", "gyrp = {"), ("run.toml", "gyrp")),
    "unknown unit": (changed('"deg/s"', '"deg/sx"'), ("run.toml", "channels.gyro.unit", "deg/sx")),
    "unit of another kind": (changed('"deg/s"', '"m"'), ("run.toml", "channels.gyro.unit", '"m"')),
    "noise without a unit": (changed('"0.1 deg/sqrt(h)"', '"0.1"'), ("run.toml", "noise.angle_random_walk")),
    "missing column": (changed('column = "gyro"', 'column = "gyros"'), ("run.csv", "gyros")),
    "missing file": (gone("run.csv"), ("run.csv",)),
    "missing manifest": (gone("run.toml"), ("run.toml",)),
    "folder for a file": (a_folder, ("run.csv",)),
    "unreadable file": (unreadable, ("run.csv", "Permission denied")),
    "target without a channel": (changed('target = "gyro"', 'target = "accel_x"'), ("run.toml", "accel_x")),
    "declared without its channel": (
        changed('["bias", ', '["bias", "bias_temperature", '),
        ("run.toml", "bias_temperature", "needs the channel temperature"),
    ),
    "earth rate without a latitude": (
        changed('["bias", ', '["bias", "earth_rate", '),
        ("run.toml", "earth_rate", "site.latitude"),
    ),
    "unknown effect declared": (changed('"bias"', '"bais"'), ("run.toml", "model.declared", "bais")),
    "order that is not there": (
        changed('"bias"', '"encoder_harmonic:0"'),
        ("run.toml", "model.declared", "encoder_harmonic:0"),
    ),
    "noise declared as an effect": (
        changed('"bias"', '"rate_random_walk"'),
        ("run.toml", "rate_random_walk", "[noise]"),
    ),
    "the same effect twice": (
        changed('"bias", ', '"bias", "bias", '),
        ("run.toml", "model.declared", "bias"),
    ),
    "nothing to explain": (changed('target = "gyro"', "target = []"), ("run.toml", "model.target")),
    "time runs backwards": (row(100, "5.0,0.1,10"), ("run.csv", "line 101", "backwards")),
    "time stands still": (row(100, "9.9,0.1,10\n9.9,0.2,10"), ("run.csv", "line 102", "stands still")),
    "not a number": (row(50, "4.9,nan,10"), ("run.csv", "line 51", "gyro", "nan")),
    "infinite": (row(50, "4.9,-inf,10"), ("run.csv", "line 51", "gyro", "inf")),
    "too large": (row(50, "4.9,1e300,10"), ("run.csv", "line 51", "gyro")),
    "text in a number column": (row(50, "4.9,ten,10"), ("run.csv", "line 51", "gyro", "ten")),
    "empty cell": (row(50, "4.9,,10"), ("run.csv", "line 51", "gyro")),
    "row too short": (row(50, "4.9,0.1"), ("run.csv", "line 51")),
    "no row": (only(0), ("run.csv",)),
    "one row": (only(1), ("run.csv", "1 row")),
    "fewer rows than parameters": (only(4), ("run.toml", "gyro")),
    "hardly more rows than parameters": (only(12), ("run.toml", "gyro")),
    "empty manifest": (content("run.toml", b""), ("run.toml", "model")),
    "empty recording": (content("run.csv", b""), ("run.csv", "no rows")),
    "manifest that is no TOML": (content("run.toml", b"[model\n"), ("run.toml", "line 1", "TOML")),
    "manifest that is no text": (content("run.toml", b"\xff\xfe\x00"), ("run.toml", "UTF-8")),
    "recording that is no text": (content("run.csv", bytes(range(256)) * 9), ("run.csv",)),
    "all rows held out": (
        changed("[noise]", '[held_out]\nstart = "0 s"\n[noise]'),
        ("run.toml", "held_out.start"),
    ),
    "rows that are not there": (
        changed("[noise]", "[held_out]\nrows = [[10, 99999]]\n[noise]"),
        ("run.toml", "held_out.rows", "3000"),
    ),
    "runs that are not there": (
        changed("[noise]", "[held_out]\nruns = [7]\n[noise]"),
        ("run.toml", "held_out.runs"),
    ),
}

BAD_OPTIONS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "unknown effect": (("--effects", "bias_drift,bais"), ("bais", "did you mean 'bias'")),
    "no effect": (("--effects", ""), ("unknown effect ''",)),
    "noise to try": (("--effects", "rate_random_walk"), ("rate_random_walk", "noise")),
    "alpha of zero": (("--alpha", "0"), ("alpha = 0", "between 0 and 1")),
    "alpha of one": (("--alpha", "1"), ("alpha = 1", "between 0 and 1")),
    "alpha below zero": (("--alpha", "-0.1"), ("alpha = -0.1", "between 0 and 1")),
    "alpha of nothing": (("--alpha", "nan"), ("alpha = nan", "between 0 and 1")),
    "alpha in words": (("--alpha", "small"), ("--alpha", "small")),
    "seed below zero": (("--seed", "-1"), ("seed = -1", "zero or more")),
    "no folder for the JSON": (("--json", "{}/none/a.json"), ("none", "does not exist")),
    "no folder for the HTML": (("--html", "{}/none/a.html"), ("none", "does not exist")),
    "folder as JSON": (("--json", "{}"), ("is a folder",)),
    "folder as HTML": (("--html", "{}"), ("is a folder",)),
    "one file for both": (("--json", "{}/a", "--html", "{}/a"), ("wanted two files",)),
    "unknown option": (("--colour", "red"), ("--colour",)),
    "one word too many": (("more",), ("more",)),
}


def refused(ended: Ended | subprocess.CompletedProcess[str], fragments: tuple[str, ...] = ()) -> None:
    """Status 2 and one sentence on standard error, nothing else."""
    out, err = (ended.out, ended.err) if isinstance(ended, Ended) else (ended.stdout, ended.stderr)
    status = ended.status if isinstance(ended, Ended) else ended.returncode
    assert status == 2, err
    assert out == "" and "Traceback" not in err
    assert err.startswith("insenv: ") and err.endswith("\n") and err.count("\n") == 1, err
    for fragment in fragments:
        assert fragment in err


@pytest.mark.parametrize("case", BAD_FILES)
def test_a_bad_file_ends_in_one_sentence_and_no_output(insenv: Command, case: str, tmp_path: Path) -> None:
    manifest = write(tmp_path)
    change, fragments = BAD_FILES[case]
    change(tmp_path)
    before = files(tmp_path)
    refused(
        insenv("close-loop", manifest, "--json", tmp_path / "a.json", "--html", tmp_path / "a.html"),
        fragments,
    )
    assert files(tmp_path) == before


@pytest.mark.parametrize("case", BAD_OPTIONS)
def test_a_bad_option_ends_in_one_sentence_and_no_output(insenv: Command, case: str, tmp_path: Path) -> None:
    manifest = write(tmp_path)
    options, fragments = BAD_OPTIONS[case]
    before = files(tmp_path)
    refused(insenv("close-loop", manifest, *(option.format(tmp_path) for option in options)), fragments)
    assert files(tmp_path) == before


@pytest.mark.parametrize(
    ("args", "fragment"),
    [
        (("close-lop", "run.toml"), "close-lop"),
        (("--quiet",), "--quiet"),
        (("close-loop",), "MANIFEST"),
        (("simulate", "scenario.toml"), "--out"),
        (("simulate", "nowhere.toml", "--out", "made"), "nowhere.toml: the scenario cannot be read"),
        (("datasets", "nowhere", "--fetch"), "nowhere"),
        (("datasets", "nowhere"), "--fetch"),
    ],
)
def test_a_bad_command_ends_in_one_sentence(
    insenv: Command, args: tuple[str, ...], fragment: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    refused(insenv(*args), (fragment,))
    assert not list(tmp_path.iterdir())


def test_a_report_that_cannot_be_written_leaves_the_old_one(insenv: Command, tmp_path: Path) -> None:
    manifest = write(tmp_path)
    long = tmp_path / ("a" * 250 + ".json")
    (tmp_path / "a.html").write_text("old")
    refused(insenv("close-loop", manifest, "--effects", "bias_drift", "--json", long), ("cannot be written",))
    assert (tmp_path / "a.html").read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.html", "run.csv", "run.toml"]


def test_help_and_version_go_to_standard_output() -> None:
    for args, text in (
        (["--version"], "insenv, version"),
        (["--help"], "close-loop"),
        (["close-loop", "--help"], "--alpha"),
        (["simulate", "--help"], "--out"),
        ([], "Usage"),
    ):
        result = CliRunner().invoke(cli.insenv, args)
        assert result.exit_code == 0 and text in result.stdout and not result.stderr


# -------------------------------------------------------------------------------- a process of its own


def test_a_process_ends_with_the_status_and_one_sentence(tmp_path: Path) -> None:
    manifest = write(tmp_path, MANIFEST.replace('"deg/s"', '"deg/sx"', 1))
    refused(process("close-loop", "--quiet", manifest, "--json", tmp_path / "a.json"), ("channels.gyro.unit",))
    assert not (tmp_path / "a.json").exists()
    refused(process("close-loop", "--quiet", tmp_path / "no\nname.toml"), ("no\N{REPLACEMENT CHARACTER}name.toml",))


def test_a_terminal_without_the_signs_and_a_closed_pipe_get_no_traceback(tmp_path: Path) -> None:
    manifest = write(tmp_path)
    args = ("close-loop", manifest, "--effects", "scale_factor_asymmetry", "--json", tmp_path / "a.json")
    escaped = process(*args, env={"PYTHONIOENCODING": "latin-1"}, encoding="latin-1")
    assert escaped.returncode == 0 and "\\u221a" in escaped.stdout  # the root of angle random walk
    (tmp_path / "a.json").unlink()
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", "insenv.cli", *map(str, args)]
    env = {**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[1])}
    broken = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, text=True, env=env, check=False)
    os.close(writing)
    assert "Traceback" not in broken.stderr
    check_contract(strict(tmp_path / "a.json"))


#: Progress without the wait, so that a test knows when the work has begun.
TELLING = (
    "import sys, insenv.cli as c\n"
    "c.Progress.__call__ = lambda self, text: print('begun', file=sys.stderr, flush=True)\n"
    "c.main()"
)


@pytest.mark.parametrize("command", ["close-loop", "simulate"])
def test_ctrl_c_leaves_no_file_and_its_own_status(command: str, tmp_path: Path) -> None:
    manifest, out = write(tmp_path / "in"), tmp_path / "out"
    out.mkdir()
    if command == "close-loop":
        args = [str(manifest), "--json", str(out / "a.json"), "--html", str(out / "a.html")]
    else:
        scenario = Path(cli.__file__).parents[1] / "scenarios" / "sine.toml"
        args = [str(scenario), "--out", str(out)]
    env = {**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[1])}
    with interruptible():
        started = subprocess.Popen(
            [sys.executable, "-c", TELLING, command, *args],
            env=env,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
    assert started.stderr is not None
    assert started.stderr.readline() == "begun\n"
    started.send_signal(signal.SIGINT)
    out_text, err = started.communicate()
    assert started.returncode == 130
    assert out_text == "" and err.splitlines()[-1] == "insenv: interrupted; nothing was written"
    assert "Traceback" not in err
    assert not list(out.iterdir())


# ------------------------------------------------------------------------------------------ any damage

SHORT = rows(300)


def damaged(data: st.DataObject, text: str) -> bytes:
    """The text with a few places cut, doubled or overwritten."""
    for _ in range(data.draw(st.integers(1, 2))):
        start = data.draw(st.integers(0, len(text)))
        stop = start + data.draw(st.integers(0, 12))
        new = data.draw(
            st.text(st.characters(codec="utf-8"), max_size=5)
            | st.sampled_from(["-", "1e300", "nan", "0", "1e-300", "\n", ",", '"', "[", "true", "99999999"])
        )
        text = text[:start] + new + text[stop:]
    return text.encode()


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_any_damage_ends_in_one_sentence_or_in_findings(data: st.DataObject, tmp_path: Path) -> None:
    manifest = write(tmp_path, lines=SHORT)
    which = data.draw(st.sampled_from(["run.toml", "run.csv"]))
    if which == "run.toml":
        manifest.write_bytes(damaged(data, MANIFEST))
    else:
        (tmp_path / "run.csv").write_bytes(damaged(data, "\n".join(SHORT)))
    try:
        found = close(manifest, ["bias_drift", "bias_warm_up", "scale_factor_asymmetry"])
    except InputError as error:
        assert str(error) and "\n" not in str(error)
    else:
        assert isinstance(found, Findings) and found.verdict in VERDICTS


def test_the_package_runs_as_a_module() -> None:
    done = subprocess.run([sys.executable, "-m", "insenv", "--version"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.split(",")[0]) == (0, "insenv")
