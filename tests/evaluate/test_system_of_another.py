"""A package of another author brings a system, and every command works for it without an edit elsewhere."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from installed import ROOT, environment_with

EXAMPLE = ROOT / "docs/example_system"
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
def test_every_command_works_for_the_system_of_another_package(tmp_path: Path) -> None:
    python = environment_with(EXAMPLE, tmp_path / "env")

    def ran(*options: str) -> str:
        ended = subprocess.run([python, *options], cwd=tmp_path, capture_output=True, text=True, timeout=500)
        assert ended.returncode == 0, ended.stdout + ended.stderr
        return ended.stdout

    def insenv(*options: str) -> str:
        return ran("-m", "insenv.cli", *options)

    slow = "slow_table/slow"
    assert "insenv/SlowTable-v0" in insenv("list", "environments") and slow in insenv("list", "scenarios")
    assert "OK: it keeps the contract" in insenv("check-plugin", "north_gls", "--env", "SlowTable")
    some = ("--policy", "constant_rate", "--estimator", "north_gls", "--seeds", "2", "--every", "1000")
    assert "Cramer-Rao bound" in insenv("evaluate", "--env", "SlowTable", *some)
    assert "azimuth" in insenv("sweep", slow, *some)
    assert "both ways" in insenv("design", slow, "--time", "60 s", "--no-verify")
    assert "error of north by north_gls" in insenv("close-loop", slow, "--in-environment")
    assert ran("-c", PROGRAM) == "(2,)\n"


def test_a_kind_of_task_that_no_system_has_is_answered_with_those_that_are() -> None:
    from insenv.core.errors import InputError
    from insenv.scenario import load

    with pytest.raises(InputError, match=r"task.kind = 'sea'; wanted one of 'north-finder'"):
        load("north_finder/published", {"task.kind": "sea"})
