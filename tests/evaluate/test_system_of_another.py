"""Packages of other authors bring an estimator, a policy and a system; all commands work without an edit elsewhere."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from installed import ROOT, commands, environment_with

EXAMPLES = ROOT / "docs/example_plugin", ROOT / "docs/example_system"
PROGRAM = """
import gymnasium, insenv
one = gymnasium.make("insenv/SlowTable-v0", estimator="north_gls")
one.reset(seed=1)
one.step(one.action_space.sample())
several = gymnasium.make_vec("insenv/SlowTable-v0", num_envs=2)
several.reset(seed=1)
print(several.step(several.action_space.sample())[1].shape)
"""


@pytest.mark.slow
def test_every_command_works_for_what_installed_packages_bring(tmp_path: Path) -> None:
    """Both packages stand in one environment, and their commands run in one process."""
    python = environment_with(EXAMPLES, tmp_path / "env")

    slow = "slow_table/slow"
    some = ("--policy", "constant_rate", "--estimator", "north_gls", "--seeds", "2", "--every", "1000")
    theirs = ("--policy", "there_and_back", "--estimator", "folded_turns,revolution", "--seeds", "2", "--every", "1000")
    sound = "OK: it keeps the contract"
    expected = {
        ("check-plugin", "folded_turns", "--env", "NorthFinder"): sound,
        ("check-plugin", "there_and_back", "--env", "NorthFinder"): sound,
        ("evaluate", "--env", "NorthFinder", *theirs): "there_and_back  folded_turns",
        ("list", "environments"): "insenv/SlowTable-v0",
        ("list", "scenarios"): slow,
        ("check-plugin", "north_gls", "--env", "SlowTable"): sound,
        ("evaluate", "--env", "SlowTable", *some): "Cramer-Rao bound",
        ("sweep", slow, *some): "azimuth",
        ("design", slow, "--time", "60 s", "--no-verify"): "both ways",
        ("close-loop", slow, "--in-environment"): "error of north by north_gls",
    }
    for sentence, ended in zip(expected.values(), commands(python, tmp_path, *expected), strict=True):
        assert ended.status == 0 and sentence in ended.out, ended
    made = subprocess.run([python, "-c", PROGRAM], cwd=tmp_path, capture_output=True, text=True, timeout=500)
    assert made.stdout == "(2,)\n", made.stderr


def test_a_kind_of_task_that_no_system_has_is_answered_with_those_that_are() -> None:
    from insenv.core.errors import InputError
    from insenv.scenario import load

    with pytest.raises(InputError, match=r"task.kind = 'sea'; wanted one of 'north-finder'"):
        load("north_finder/published", {"task.kind": "sea"})
