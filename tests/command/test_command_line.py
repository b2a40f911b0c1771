"""The command line as its users know it: help, names, colour, completion, what is said and where."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import click
import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner
from command import Ended, run, write

from insenv import cli, shelf
from insenv.core.console import progress, terminal
from insenv.core.errors import InputError
from insenv.core.names import KINDS

Command = Callable[..., Ended]


@pytest.fixture
def insenv(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Command:
    return lambda *args: run(capsys, monkeypatch, *args)


def python(program: str) -> str:
    """What a program in a process of its own prints."""
    env = {**os.environ, "PYTHONPATH": str(Path(cli.__file__).parents[1])}
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, env=env)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("name", [*cli.insenv.commands])
def test_every_help_is_whole_and_ends_with_an_example_that_is_one(name: str) -> None:
    shown = CliRunner().invoke(cli.insenv, [name, "--help"]).stdout  # click keeps the options of a first context
    assert "..." not in shown.split("Options:")[1].split("Example:")[0].replace("DATA...", "").replace(
        "KEY=VALUE]...", ""
    )
    lines = [line.strip() for line in shown.partition("Example:")[2].splitlines() if line.strip()]
    assert lines
    for line in lines:
        assert line.startswith(f"insenv {name}")
        words = [word.strip("'\"") for word in line.split("|")[0].split()[2:]]
        cli.insenv.commands[name].make_parser(click.Context(cli.insenv.commands[name])).parse_args(words)


def test_the_list_of_commands_has_whole_sentences() -> None:
    shown = CliRunner().invoke(cli.insenv, ["-h"]).stdout
    assert "..." not in shown.split("Commands:")[1].split("Example")[0]
    assert all(f"\n  {name}" in shown for name in cli.insenv.commands)


@pytest.mark.parametrize("kind", KINDS)
def test_a_list_names_all_of_a_kind_with_a_line_each(kind: str, insenv: Command) -> None:
    ended = insenv("list", kind)
    assert ended.status == 0
    for name in shelf.names(kind):
        (line,) = [line for line in ended.out.splitlines() if line.startswith(f"{name} ")]
        assert len(line.split()) > 2


def test_a_kind_that_is_none_is_refused_with_the_nearest(insenv: Command) -> None:
    with pytest.raises(InputError, match="did you mean 'effects'"):
        shelf.names("efects")


@pytest.mark.parametrize(
    ("args", "meant"),
    [
        (("close-lop", "a"), "close-loop"),
        (("close-loop", "a.toml", "--jsn", "b"), "--json"),
        (("close-loop", "psins_lasrgyro"), "psins_lasergyro"),
        (("datasets", "--fetch", "tofupilot_termal"), "tofupilot_thermal"),
        (("sweep", "north_finder/publishd", "--policy", "constant_rate", "--estimator", "north_gls"), "published"),
        (("evaluate", "--env", "NorthFindr", "--estimator", "north_gls", "--policy", "constant_rate"), "NorthFinder"),
        (("evaluate", "--env", "NorthFinder", "--estimator", "north_gl", "--policy", "constant_rate"), "north_gls"),
        (("check-plugin", "north_gl"), "north_gls"),
        (("list", "efects"), "effects"),
        (("design", "north_finder/realistic", "--search", "gird"), "grid"),
        (("rate-test", "a.toml", "--zeros", "interleafed"), "interleaved"),
    ],
)
def test_a_wrong_name_is_answered_with_the_nearest(args: tuple[str, ...], meant: str, insenv: Command) -> None:
    ended = insenv(*args)
    assert ended.status == 2 and ended.err.count("\n") == 1
    assert "id you mean" in ended.err and meant in ended.err


@pytest.mark.parametrize(
    ("words", "incomplete", "found"),
    [
        ([], "clo", "close-loop"),
        (["close-loop"], "--js", "--json"),
        (["close-loop"], "psins", "psins_lasergyro"),
        (["close-loop", "a.toml", "--effects"], "tone,bias_st", "tone,bias_step"),
        (["sweep"], "north_finder/pu", "north_finder/published"),
        (["evaluate", "--env"], "North", "NorthFinder"),
        (["evaluate", "--env", "NorthFinder", "--estimator"], "north_", "north_gls"),
        (["rate-test", "a.toml", "--zeros"], "inter", "interleaved"),
        (["list"], "pol", "policies"),
        (["check-plugin"], "north_", "north_gls"),
        (["simulate"], "rate_table/b215_l", "rate_table/b215_lock"),
    ],
)
def test_the_shell_completes_commands_options_and_names(words: list[str], incomplete: str, found: str) -> None:
    complete = ShellComplete(cli.insenv, {}, "insenv", "_INSENV_COMPLETE")
    assert found in [item.value for item in complete.get_completions(words, incomplete)]


def test_the_version_waits_for_nothing_heavy() -> None:
    program = (
        "import sys\n"
        "sys.argv = ['insenv', '--version']\n"
        "from insenv.__main__ import main\n"
        "main()\n"
        "print([m for m in ('click', 'numpy', 'scipy', 'gymnasium', 'pint', 'matplotlib') if m in sys.modules])"
    )
    said, heavy = python(program).splitlines()
    assert heavy == "[]" and said == CliRunner().invoke(cli.insenv, ["--version"]).stdout.strip()


def test_the_command_waits_for_nothing_that_it_does_not_need() -> None:
    program = (
        "import sys, insenv.cli\n"
        "print([m for m in ('numpy', 'scipy', 'gymnasium', 'pint', 'matplotlib', 'msgspec') if m in sys.modules])"
    )
    assert python(program).strip() == "[]"


@pytest.mark.parametrize("first", ["insenv", "gymnasium"])
def test_the_environments_are_registered_whichever_is_imported_first(first: str) -> None:
    other = {"insenv": "gymnasium", "gymnasium": "insenv"}[first]
    program = f"import {first}\nimport {other}\nimport gymnasium\nprint(gymnasium.spec('insenv/RateTable-v0').id)"
    assert python(program).strip() == "insenv/RateTable-v0"


def test_the_verdict_is_last_and_quiet_says_it_alone(insenv: Command, tmp_path: Path) -> None:
    manifest = write(tmp_path)
    options = ("--effects", "scale_factor_asymmetry", "--html", tmp_path / "a.html")
    ended = insenv("close-loop", manifest, *options)
    assert ended.out.splitlines()[-1] == "effects-found: scale_factor_asymmetry"
    quiet = insenv("close-loop", manifest, "-q", "--effects", "scale_factor_asymmetry")
    assert (quiet.out, quiet.err) == ("effects-found: scale_factor_asymmetry\n", "")
    loud = insenv("close-loop", manifest, "-v", "--effects", "scale_factor_asymmetry")
    assert "[  0." in loud.err and "declared model" in loud.err


def test_a_file_that_is_not_there_is_answered_with_the_nearest_beside(insenv: Command, tmp_path: Path) -> None:
    write(tmp_path)
    (there,) = tmp_path.glob("*.toml")
    ended = insenv("close-loop", there.with_suffix(".tml"))
    assert ended.status == 2 and f"did you mean {str(there)!r}?" in ended.err


def test_colour_is_for_terminals_that_want_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    assert terminal.paint("a", "red") == "a"  # the standard output of a test is none
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert terminal.paint("a", "red").startswith("\x1b[")
    monkeypatch.setenv("NO_COLOR", "1")
    assert terminal.paint("a", "red") == "a"


@pytest.mark.parametrize(("asked", "painted"), [({}, False), ({"FORCE_COLOR": "1"}, True), ({"NO_COLOR": "1"}, False)])
def test_colour_reaches_a_pipe_where_it_is_forced(asked: dict[str, str], painted: bool, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time [s],gyro [deg/s]\n" + "".join(f"{k},{k % 7}\n" for k in range(50)))
    env = {"NO_COLOR": None, "FORCE_COLOR": None, **asked}
    shown = CliRunner().invoke(cli.insenv, ["init", str(tmp_path / "a.csv")], env=env)
    assert shown.exit_code == 0 and ("\x1b[" in shown.output) == painted


def test_progress_tells_what_is_left(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    say = progress.Progress()
    now[0] += 10
    say("25% of 8 parts")
    say("the search")
    assert capsys.readouterr().err.splitlines() == ["[ 10.0 s] 25% of 8 parts, 30 s left", "[ 10.0 s] the search"]


def test_choices_that_stand_on_lines_of_their_own_are_one_sentence(insenv: Command) -> None:
    ended = insenv("list")
    assert (
        ended.status == 2
        and "Choose from: effects, scenarios" in ended.err
        and "\N{REPLACEMENT CHARACTER}" not in ended.err
    )
