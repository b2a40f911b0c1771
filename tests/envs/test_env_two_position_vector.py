"""The vector form of the two-position calibration is as many single ones, bit for bit, whatever turns or ends when."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from env_cases import assert_same
from environments.copies import ROWS, native_and_sync
from gymnasium.vector import AutoresetMode
from two_position_cases import ESTIMATORS, ID, SCENARIOS, SHORT, SURE

from insenv.core.errors import InputError
from insenv.systems.two_position.env import TwoPositionVectorEnv


def pair(mode: AutoresetMode = AutoresetMode.NEXT_STEP, **settings: Any) -> tuple[Any, Any]:
    return native_and_sync(TwoPositionVectorEnv, ID, mode, **{"changes": SHORT} | settings)


def plan(steps: int, early: bool) -> list[Any]:
    """Turns at other times and by other angles in every row; with stops that come at another time too."""
    rng = np.random.default_rng(0)
    found = []
    for k in range(steps):
        actions = np.zeros((ROWS, 2))
        actions[:, 0] = np.where(rng.random(ROWS) < 0.3, rng.uniform(-0.06, 0.06, ROWS), 0.0)
        if early:
            actions[:, 1] = [k in (2, 3, 7), k == 4, k in (4, 9, 10), False]
        found.append(actions)
    return found


@pytest.mark.parametrize("early", [False, True])
@pytest.mark.parametrize("limit", [None, 4])
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_next_step_autoreset_is_as_sync(estimator: str | None, limit: int | None, early: bool) -> None:
    native, sync = pair(limit=limit, estimator=estimator)
    assert native.observation_space == sync.observation_space and native.action_space == sync.action_space
    assert_same(native.reset(seed=5), sync.reset(seed=5))
    ends = np.zeros(ROWS, int)
    for actions in plan(24, early):
        one, other = native.step(actions), sync.step(actions)
        assert_same(one, other)
        ends += one[2] | one[3]
    assert ends.min() >= 2
    assert_same(native.reset(), sync.reset())
    assert_same(native.step(plan(1, False)[0]), sync.step(plan(1, False)[0]))


@pytest.mark.parametrize("scenario", SCENARIOS)
@pytest.mark.parametrize("readings", ["start", "turns"])
def test_every_packaged_scenario_is_as_sync(scenario: str, readings: str) -> None:
    native, sync = pair(scenario=scenario, estimator=SURE, changes=SHORT | {"sight.readings": readings})
    assert_same(native.reset(seed=5), sync.reset(seed=5))
    for actions in plan(12, True):
        assert_same(native.step(actions), sync.step(actions))


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_without_autoreset_rows_are_reset_by_mask_as_in_sync(estimator: str | None) -> None:
    native, sync = pair(AutoresetMode.DISABLED, estimator=estimator)
    assert_same(native.reset(seed=5), sync.reset(seed=5))
    resets = 0
    for actions in plan(24, True):
        one, other = native.step(actions), sync.step(actions)
        assert_same(one, other)
        ended = one[2] | one[3]
        if ended.any():
            resets += 1
            assert_same(native.reset(options={"reset_mask": ended}), sync.reset(options={"reset_mask": ended}))
    assert resets >= 5


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_row_is_the_single_run_of_its_seed(scenario: str) -> None:
    native, _ = pair(scenario=scenario, estimator=SURE)
    shown = [native.reset(seed=20)] + [native.step(a)[::4] for a in plan(8, False)]
    for row in range(ROWS):
        env = gymnasium.make(ID, scenario=scenario, changes=SHORT, estimator=SURE, disable_env_checker=True).unwrapped
        alone = [env.reset(seed=20 + row)] + [env.step(a[row])[::4] for a in plan(8, False)]
        for (batch, info), (single, told) in zip(shown, alone, strict=True):
            assert_same({key: block[row] for key, block in batch.items()}, single)
            assert {key: float(info["truth"][key][row]) for key in told["truth"]} == told["truth"]


def test_bad_actions_name_the_row() -> None:
    env = TwoPositionVectorEnv(ROWS, changes=SHORT)
    env.reset(seed=1)
    actions = np.zeros((ROWS, 2))
    actions[2] = [3.0, 0.0]
    with pytest.raises(InputError, match=r"action \[3, 0\] of row 2; wanted numbers from \[-1, 0\]"):
        env.step(actions)
