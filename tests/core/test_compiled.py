"""Loops in plain Python and compiled: the same bits, and when which of them runs."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

from insenv.core.compiled import PATIENCE, Loop, jit, of_one_type, patient
from insenv.core.recording import Floats
from insenv.envs.rollout import RollOut, roll_out
from insenv.envs.task import Task
from insenv.systems.north_finder.env import north_finder
from insenv.systems.rate_table.env import rate_table
from insenv.systems.system_calibration.env import system_calibration
from insenv.systems.two_position.env import two_position


@jit
def _once_more(x: float) -> float:
    return x + 0.1


@jit
def _summed(values: Floats, out: Floats) -> None:
    for v in values:
        out[0] = _once_more(out[0]) * v


@pytest.fixture(autouse=True)
def _waiting(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(Loop, "waits", True)
    yield


# ------------------------------------------------------------------------------------------------------ when


def test_a_patient_loop_is_compiled_once_it_has_worked() -> None:
    loop, out, part = patient(_summed.function), np.zeros(1), np.full(PATIENCE // 2 - 1, 0.5)
    loop(part, out)
    loop(part, out)
    assert "machine" not in vars(loop)
    loop(part, out)
    assert "machine" in vars(loop)


def test_much_at_once_is_compiled_at_once() -> None:
    loop = patient(_summed.function)
    loop(np.full(PATIENCE + 1, 0.5), np.zeros(1))
    assert "machine" in vars(loop)


def test_arrays_in_tuples_count() -> None:
    loop = patient(lambda pair: pair[0][0] + pair[1][0])
    loop((np.ones(PATIENCE), np.ones(1)))
    assert "machine" in vars(loop)


def test_all_kinds_of_arrays_are_one_type_for_which_a_loop_is_compiled_once() -> None:
    kept, written = np.arange(6.0), np.arange(6.0)
    kept.flags.writeable = False
    kinds = (written, kept, np.arange(12.0)[::2], np.arange(6))
    for made in (of_one_type(kind, (2, 6)) for kind in kinds):
        assert made.flags.c_contiguous and made.flags.writeable and made.dtype == np.float64 and made.shape == (2, 6)
    assert of_one_type(written) is written
    loop = Loop(_summed.function, {})
    for kind in kinds:
        loop(of_one_type(kind), np.zeros(1))
    assert len(loop.machine.signatures) == 1


def test_who_is_in_a_hurry_has_no_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Loop, "waits", False)
    loop = patient(_summed.function)
    loop(np.ones(1), np.zeros(1))
    assert "machine" in vars(loop)


def test_a_first_step_compiles_nothing_and_loads_no_numba() -> None:
    lines = ["import gymnasium, numpy, sys, insenv"]
    for name, action in (
        ("NorthFinder", (0.2, 0.0)),
        ("TwoPosition", (1.0, 0.0)),
        ("RateTable", (0.5, 0.0)),
        ("SystemCalibration", (0.25, -0.25, 1.0, 0.03, 0.0)),
    ):
        lines += [
            f"env = gymnasium.make('insenv/{name}-v0')",
            "env.reset(seed=1)",
            f"env.step(numpy.array({action})[:env.action_space.shape[0]])",
            f"assert 'numba' not in sys.modules, '{name}'",
        ]
    subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True)


# ------------------------------------------------------------------------------------------------------ what


def test_loops_within_loops_give_the_same_bits() -> None:
    values, plain, machine = np.random.default_rng(0).standard_normal(100), np.zeros(1), np.zeros(1)
    _summed.plain(values, plain)
    _summed(values, machine)
    assert plain[0] == machine[0] != 0.0


def _tasks() -> dict[str, tuple[Task, str, str]]:
    """Tasks of all systems, a policy that turns and an estimator; runs that are short for their plants."""
    unit = {"instrument.sampling": "5 Hz", "duration": "100 s"}
    return {
        "north finder": (north_finder("north_finder/realistic", {"duration": "90 s"}), "constant_rate", "revolution"),
        "vehicle": (two_position("two_position/realistic", {"duration": "40 s"}), "three_rests", "two_position_joint"),
        "rate table": (rate_table(changes={"duration": "60 s"}), "van_der_corput", "scale_factor"),
        "whole unit": (system_calibration("system_calibration/mems", unit), "six_positions", "multi_position"),
    }


def _loops() -> list[Loop]:
    """All there are, whenever their modules were imported: the garbage collector no longer lists the first of them."""
    names = (value for module in list(sys.modules.values()) for value in list(vars(module).values()))
    return list({id(value): value for value in names if type(value) is Loop}.values())


def _bits(played: RollOut) -> list[Floats]:
    recording = played.recording(0)
    assert played.estimate is not None
    told = (played.estimate.mean, played.estimate.cov)
    return [recording.t, *(recording.channel(name).values for name in recording.channels), *told]


@pytest.mark.parametrize("name", ["north finder", "vehicle", "rate table", "whole unit"])
def test_plain_and_compiled_runs_are_the_same_bit_for_bit(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    task, policy, estimator = _tasks()[name]
    monkeypatch.setattr(Loop, "waits", False)
    compiled = roll_out(task, policy, estimator, [3], every=task.steps)
    loops = [loop for loop in _loops() if loop.patience and "machine" in vars(loop)]
    assert loops
    for loop in loops:
        monkeypatch.setattr(loop, "patience", sys.maxsize)
        monkeypatch.setattr(loop, "machine", None)
    monkeypatch.setattr(Loop, "waits", True)
    plain = roll_out(task, policy, estimator, [3], every=task.steps)
    for one, other in zip(_bits(plain), _bits(compiled), strict=True):
        np.testing.assert_array_equal(one, other)
