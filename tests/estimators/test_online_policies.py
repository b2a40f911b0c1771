"""Policies that close the loop on line: the contract, the predictions that they rest on, and what they reach."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from estimators.common import horizon
from estimators.common.horizon import Aim
from estimators.north_finder.horizon import GreedyNorth, HorizonNorth
from estimators.rate_table.rate_horizon import GreedyRateTable, HorizonRateTable
from estimators.two_position import rests_ahead
from estimators.two_position.horizon import GreedyTwoPosition, HorizonTwoPosition
from estimators.two_position.transposition import DEMANDED, ThreeRests, turn_time
from insenv.core.errors import InputError
from insenv.core.estimate import Limits
from insenv.core.plugins import POLICIES, find
from insenv.core.units import ARCSEC, DEG
from insenv.envs.rollout import roll_out
from insenv.evaluate.check.policy import check_policy
from insenv.evaluate.runs import task_of
from insenv.evaluate.trials import TrialRuns, trial
from insenv.information.alignment import bound, procedure, unknowing

SCRIPTS = str(Path(__file__).parents[2] / "scripts")
KINDS = {
    "greedy_north": GreedyNorth,
    "horizon_north": HorizonNorth,
    "greedy_two_position": GreedyTwoPosition,
    "horizon_two_position": HorizonTwoPosition,
    "greedy_rate_table": GreedyRateTable,
    "horizon_rate_table": HorizonRateTable,
}


@cache
def tried(environment: str) -> TrialRuns:
    return trial(environment)


@pytest.fixture
def scripts(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    before = set(sys.modules)
    monkeypatch.syspath_prepend(SCRIPTS)
    yield
    for name in {"learnt_policy", "train_policy"} - before:
        sys.modules.pop(name, None)


@pytest.mark.parametrize("name", KINDS)
def test_each_is_found_by_name(name: str) -> None:
    # That it keeps the contract is asked of all that there are in tests/evaluate/test_check_plugin.py.
    assert find(POLICIES, name) is KINDS[name]


def test_sequences_are_all_that_there_are_and_the_simple_ones_come_first() -> None:
    found = horizon.sequences(5, 2)
    assert found.shape == (2 * (1 + 4 + 6), 5) and len(np.unique(found, axis=0)) == len(found)
    changes = np.count_nonzero(np.diff(found, axis=1), axis=1)
    assert np.all(np.diff(changes) >= 0) and changes.max() == 2


def test_what_is_asked_wrongly_is_refused() -> None:
    north, two, rate = (tried(name).datasheet for name in ("NorthFinder", "TwoPosition", "RateTable"))
    with pytest.raises(InputError, match="wanted zero or more"):
        Aim(-1.0)
    with pytest.raises(InputError, match="wanted more than 0"):
        HorizonNorth(north, rate=0.0)
    with pytest.raises(InputError, match="wanted at most"):
        GreedyNorth(north, rate=200 * DEG)
    with pytest.raises(InputError, match="one to three ahead"):
        HorizonTwoPosition(two, turns=4)
    with pytest.raises(InputError, match="doubt"):
        HorizonRateTable(rate, doubt=0.0)


def test_rests_ahead_are_those_of_the_bound() -> None:
    sheet = task_of("two_position/published_a2", {}).datasheet
    told = ThreeRests(sheet).instrument
    known = unknowing(told).cov[np.ix_(rests_ahead.STATES, rests_ahead.STATES)]
    for angle in (np.pi, 150 * DEG):
        seconds, found = turn_time(sheet, angle), np.empty((1, 3))
        places = rests_ahead.place(told, 0.0), rests_ahead.place(told, -angle)
        turns = rests_ahead.turned(told, 0.0, angle, seconds), rests_ahead.turned(told, -angle, -angle, seconds)
        rests_ahead.look(known, np.array([[40.0, 40.0, 40.0]]), places, turns, 0.0, found)
        wanted = bound(told, procedure(40.0, [angle, -angle], seconds), turning_data=False)
        assert found[0, 1] == pytest.approx(wanted.time) and found[0, 2] == pytest.approx(wanted.installation, rel=1e-6)


def test_what_is_expected_of_a_turning_table_is_what_the_estimator_then_knows() -> None:
    task = task_of("north_finder/published", {"duration": "120 s"})
    policy = HorizonNorth(task.datasheet, 0.0, rate=10 * DEG, piece=8.0)
    none, known = np.array([np.pi]), policy.gls.information(policy.gls.reset(1))
    _, then = policy._expected(known, np.zeros((1, 3)), (none, none))
    played = roll_out(task, "constant_rate", None, range(1))
    cut = [chunk for _, chunk in played.chunks][: int(policy.piece * policy.plans.shape[1])]
    state = policy.gls.reset(1)
    for chunk in cut:
        state = policy.gls.update(state, chunk)
    now, _ = policy._expected(policy.gls.information(state), np.zeros((1, 3)), (none, none))
    # The first block and the free angle at the start are counted a little otherwise.
    assert then[0, 0] == pytest.approx(now[0], rel=0.06)


def test_the_table_is_asked_for_no_more_than_it_has_and_is_stopped_at_what_is_demanded() -> None:
    task = task_of("north_finder/realistic", {"instrument.sampling": "50 Hz"})
    for kind in (GreedyNorth, HorizonNorth):
        played = roll_out(task, kind(task.datasheet, 80 * ARCSEC), "north_gls", range(3))
        assert played.stopped.all() and np.all(played.time < 200)
        last = np.rint(played.time / task.step_s).astype(int)
        assert np.all(played.deviations[np.arange(3), last, 0] <= 80 * ARCSEC)
        # A piece earlier it was not yet there.
        assert np.all(played.deviations[np.arange(3), last - 4, 0] > 80 * ARCSEC)
        # Six deviations: false alarm 6e-9.
        assert np.all(np.abs(played.errors[:, 0]) < 6 * 80 * ARCSEC)
    slow = replace(task.datasheet, limits=Limits(6 * DEG, task.datasheet.limits.acceleration))
    assert HorizonNorth(slow).rate <= 6 * DEG


def test_two_positions_are_found_in_less_than_three_equal_rests_take() -> None:
    task = task_of("two_position/published_a2", {"instrument.sampling": "20 Hz"})
    policy = HorizonTwoPosition(task.datasheet)
    played = roll_out(task, policy, "two_position_joint", range(4))
    assert played.stopped.all() and np.all(played.time <= 184)
    assert played.estimate is not None
    assert np.all(played.estimate.of("heading")[1] <= DEMANDED)
    # Six deviations of the whole angle, the sight's 28 arcsec in it: false alarm 8e-9.
    assert np.all(np.abs(played.errors[:, 0]) < 6 * np.hypot(DEMANDED, 29 * ARCSEC))


def test_without_an_estimator_the_bound_says_when_to_stop() -> None:
    task = task_of("two_position/published_a2", {"instrument.sampling": "20 Hz"})
    played = roll_out(task, HorizonTwoPosition(task.datasheet), None, range(2))
    assert played.stopped.all() and np.all((played.time > 165) & (played.time < 182))


def test_a_price_of_time_ends_a_test_early() -> None:
    task = task_of("two_position/published_a2", {"instrument.sampling": "20 Hz"})
    dear = GreedyTwoPosition(task.datasheet, 0.0, price=5e-3)
    played = roll_out(task, dear, "two_position_joint", range(1))
    assert played.stopped.all() and 100 < played.time[0] < 500


@pytest.mark.slow
def test_faults_are_found_and_the_scale_factor_in_a_tenth_of_the_published_time(scripts: None) -> None:
    from studies.rate_table.policies import study
    from studies.rate_table.policy_runs import random_faults

    for kind in (GreedyRateTable, HorizonRateTable):
        row = study("x", random_faults(6), random_faults(6, 2, height=0.0), kind)
        # Found in 39 of 40 or more: all but one of six, false alarm below 1e-2, with the seeds fixed.
        assert row.found >= 5 / 6 and row.false_alarms == 0
        assert row.time < 0.1 * 4204
        # Ratio of two root mean squares of six values: above 2.2 with a chance of 1e-3.
        assert row.scale_factor_rms < 2.2 * row.scale_factor_sd


# ---------------------------------------------------------------------------------------------------- learnt


def test_the_learnt_policy_keeps_the_contract(scripts: None) -> None:
    from learnt_policy import LearntPolicy

    assert check_policy(LearntPolicy, tried("TwoPosition")) == []


def test_weights_that_are_none_are_refused(scripts: None, tmp_path: Path) -> None:
    import learnt_policy as learnt

    path = tmp_path / "weights.json"
    with pytest.raises(InputError, match="wanted what"):
        learnt.loaded(path)
    path.write_text('[{"weight": [[1.0, 2.0]], "bias": [0.0]}]')
    with pytest.raises(InputError, match="6 numbers in and 3 out"):
        learnt.loaded(path)
    learnt.saved([{"weight": np.zeros((3, 6)), "bias": np.arange(3.0)}], path)
    assert learnt.logits(learnt.loaded(path), np.ones((2, 6))).tolist() == [[0, 1, 2], [0, 1, 2]]


def test_runs_that_end_in_training_begin_anew_in_the_same_step(scripts: None) -> None:
    import learnt_policy as learnt
    from train_policy import Belief

    belief = Belief(3, changes={"duration": "60 s", "profile": {"kind": "rest"}})
    first = belief.reset(0)
    assert first.shape == (3, learnt.SHOWN)
    now, reward, ended, last = belief.step(np.array([learnt.STAY, learnt.TURN, learnt.STOP]))
    price = np.log1p((30.0 / 0.65) ** 2)
    assert ended.tolist() == [False, False, True] and reward[2] == pytest.approx(-price)
    assert belief.seen.turning.tolist() == [0, 1, 0] and belief.seen.turns.tolist() == [0, 1, 0]
    assert belief.seen.rest.tolist() == [5, 0, 0]
    assert np.array_equal(now[:2], last[:2]) and np.array_equal(now[2], first[2])
    done: Any = ended
    for _ in range(11):
        _, reward, done, _ = belief.step(np.full(3, learnt.STAY))
    assert done.tolist() == [True, True, False] and np.all(reward[:2] > -price)
