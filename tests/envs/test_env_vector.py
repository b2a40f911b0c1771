"""The vector environment is as many single ones, bit for bit, whatever ends when."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import pytest
from env_cases import ID, RATE, SHORT, assert_same, made
from environments.copies import ROWS, native_and_sync
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from insenv.core.errors import InputError
from insenv.scenario import names
from insenv.systems.north_finder.env import NorthFinderVectorEnv

NORTH_FINDERS = [name for name in names() if name.startswith("north_finder/") and name != "north_finder/published"]
Make = Callable[..., tuple[Any, Any]]
ESTIMATORS = (None, "env_cases:Sure", "correlation", "revolution", "north_gls")


def pair(mode: AutoresetMode = AutoresetMode.NEXT_STEP, **settings: Any) -> tuple[Any, Any]:
    return native_and_sync(NorthFinderVectorEnv, ID, mode, **{"changes": SHORT} | settings)


def plan(steps: int, early: bool) -> list[Any]:
    """Rates that differ from row to row and change; with stops that come at another time in every row."""
    rng = np.random.default_rng(0)
    found = []
    for k in range(steps):
        actions = np.zeros((ROWS, 2))
        actions[:, 0] = rng.uniform(-0.8, 0.8, ROWS)
        if early:
            actions[:, 1] = [k in (2, 3, 7), k == 4, k in (4, 9, 10), False]
        found.append(actions)
    return found


@pytest.mark.parametrize("early", [False, True])
@pytest.mark.parametrize("limit", [None, 4])
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_next_step_autoreset_is_as_sync(estimator: str | None, limit: int | None, early: bool) -> None:
    native, sync = pair(limit=limit, estimator=estimator)
    assert native.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert native.observation_space == sync.observation_space and native.action_space == sync.action_space
    assert_same(native.reset(seed=5), sync.reset(seed=5))
    ends = np.zeros(ROWS, int)
    for actions in plan(18, early):
        one, other = native.step(actions), sync.step(actions)
        assert_same(one, other)
        ends += one[2] | one[3]
    assert ends.min() >= 2
    # Runs that were given no seed.
    assert_same(native.reset(), sync.reset())
    assert_same(native.step(plan(1, False)[0]), sync.step(plan(1, False)[0]))


@pytest.mark.parametrize("scenario", NORTH_FINDERS)
@pytest.mark.parametrize("estimator", [None, "north_gls"])
def test_every_packaged_scenario_is_as_sync(scenario: str, estimator: str | None) -> None:
    # No profile: it would be checked against the slower table, and an environment commands its own.
    changes = SHORT | ({"profile": {"kind": "rest"}} if "scale_factor" in scenario else {})
    native, sync = pair(scenario=scenario, estimator=estimator, changes=changes)
    assert_same(native.reset(seed=5), sync.reset(seed=5))
    for actions in plan(12, True):
        assert_same(native.step(actions), sync.step(actions))


@pytest.mark.parametrize("seed", [[7, 3, 3, 11], [7, None, 3, None]])
def test_seeds_may_be_listed(seed: list[int | None]) -> None:
    native, sync = pair()
    native.reset(seed=100)
    sync.reset(seed=100)
    assert_same(native.reset(seed=seed), sync.reset(seed=seed))
    for actions in plan(8, False):
        assert_same(native.step(actions), sync.step(actions))
    assert native.np_random_seed == sync.np_random_seed
    assert [g.bit_generator.state for g in native.np_random] == [g.bit_generator.state for g in sync.np_random]


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_without_autoreset_rows_are_reset_by_mask_as_in_sync(estimator: str | None) -> None:
    native, sync = pair(AutoresetMode.DISABLED, estimator=estimator)
    assert native.metadata["autoreset_mode"] is AutoresetMode.DISABLED
    assert_same(native.reset(seed=5), sync.reset(seed=5))
    resets = 0
    for actions in plan(18, True):
        one, other = native.step(actions), sync.step(actions)
        assert_same(one, other)
        ended = one[2] | one[3]
        if ended.any():
            resets += 1
            assert_same(native.reset(options={"reset_mask": ended}), sync.reset(options={"reset_mask": ended}))
    assert resets >= 5


def test_rows_that_go_on_may_be_reset_too_and_with_seeds() -> None:
    native, sync = pair()
    native.reset(seed=1)
    sync.reset(seed=1)
    for k, actions in enumerate(plan(9, False)):
        assert_same(native.step(actions), sync.step(actions))
        if k in (1, 4, 5):  # at 5 all rows have ended, and the mask takes two of them out of the autoreset
            mask = np.array([True, False, k == 4, True])
            given = {"seed": [50 + k, 51, 52, None]}
            one = native.reset(options={"reset_mask": mask}, **given)
            assert_same(one, sync.reset(options={"reset_mask": mask}, **given))


def test_a_row_is_the_single_run_of_its_seed() -> None:
    native, _ = pair(estimator="env_cases:Sure")
    observations, infos = native.reset(seed=20)
    shown = [(observations, infos)] + [native.step(a)[::4] for a in plan(6, False)]
    for row in range(ROWS):
        env = made("env_cases:Sure")
        alone = [env.reset(seed=20 + row)] + [env.step(a[row])[::4] for a in plan(6, False)]
        for (batch, info), (single, told) in zip(shown, alone, strict=True):
            assert_same({key: block[row] for key, block in batch.items()}, single)
            assert {key: float(info["truth"][key][row]) for key in told["truth"]} == told["truth"]


def test_rows_in_step_are_one_group_and_no_row_is_copied(monkeypatch: pytest.MonkeyPatch) -> None:
    from insenv.envs import task

    native, _ = pair()
    native.reset(seed=1)
    monkeypatch.setattr(task, "part", lambda *_: pytest.fail("a group was taken apart"))
    for actions in plan(20, False):
        native.step(actions)
        assert len(native.unwrapped._batch._places) <= 1


def test_given_away_arrays_are_nobody_elses() -> None:
    native, other = (gymnasium.make_vec(ID, num_envs=ROWS, changes=SHORT) for _ in range(2))

    def spoil(given: Any) -> Any:
        kept = copy.deepcopy(given)
        for part in given:
            if isinstance(part, dict):
                for array in (*part.values(), *part.get("truth", {}).values()):
                    if isinstance(array, np.ndarray):
                        array[...] = 1
            elif isinstance(part, np.ndarray):
                part[...] = 1
        return kept

    mask = np.array([True, False, False, True])
    assert_same(spoil(native.reset(seed=1)), other.reset(seed=1))
    for actions in plan(3, True):
        assert_same(spoil(native.step(actions)), other.step(actions))
    assert_same(native.reset(options={"reset_mask": mask}), other.reset(options={"reset_mask": mask}))


def vector(**settings: Any) -> VectorEnv[Any, Any, Any]:
    return gymnasium.make_vec(ID, num_envs=ROWS, changes=SHORT, **settings)


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        (
            {"autoreset_mode": AutoresetMode.SAME_STEP},
            "'SameStep' is not offered; wanted one of 'NextStep', 'Disabled'",
        ),
        ({"autoreset_mode": "never"}, "wanted one of 'NextStep', 'Disabled'"),
        ({"max_episode_steps": 0}, "max_episode_steps = 0; wanted a whole number from 1"),
        ({"num_envs": 0}, "num_envs = 0"),
        ({"render_mode": "rgb_array"}, "'rgb_array'; wanted None"),
    ],
)
def test_other_settings_are_refused(settings: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        NorthFinderVectorEnv(**{"num_envs": ROWS, "changes": SHORT, **settings})


def test_modes_may_be_named() -> None:
    assert vector(autoreset_mode="Disabled").metadata["autoreset_mode"] is AutoresetMode.DISABLED


def test_bad_actions_name_the_row_and_change_nothing() -> None:
    env, other = vector(), vector()
    env.reset(seed=1)
    other.reset(seed=1)
    actions = np.zeros((ROWS, 2))
    actions[2] = [3.0, 0.0]
    with pytest.raises(InputError, match=r"action \[3, 0\] of row 2; wanted numbers from \[-0.87"):
        env.step(actions)
    with pytest.raises(InputError, match=r"actions of shape \(2,\); wanted \(4, 2\)"):
        env.step(actions[0])
    actions[2] = [RATE, 0.0]
    assert_same(env.step(actions), other.step(actions))


def test_actions_of_rows_that_begin_anew_are_not_looked_at() -> None:
    env = vector()
    env.reset(seed=1)
    actions = np.zeros((ROWS, 2))
    actions[1, 1] = 1.0
    env.step(actions)
    actions[1] = np.nan
    assert env.step(actions)[0]["time_left"][:, 0].tolist() == [4.0, 6.0, 4.0, 4.0]


def test_stepping_before_reset_or_after_the_end_is_refused() -> None:
    env = vector(autoreset_mode="Disabled")
    actions = np.zeros((ROWS, 2))
    with pytest.raises(gymnasium.error.ResetNeeded, match="no run has begun"):
        env.step(actions)
    with pytest.raises(gymnasium.error.ResetNeeded, match="without a mask first"):
        env.reset(options={"reset_mask": np.array([True, False, False, False])})
    env.reset(seed=1)
    actions[3, 1] = 1.0
    env.step(actions)
    with pytest.raises(gymnasium.error.ResetNeeded, match="the run of row 3 has ended"):
        env.step(actions)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"seed": [1, 2]}, "2 seeds given; wanted 4"),
        ({"options": {"reset_mask": [True] * ROWS}}, "no array of booleans"),
        ({"options": {"reset_mask": np.ones(ROWS)}}, "no array of booleans"),
        ({"options": {"reset_mask": np.ones(3, bool)}}, r"shape \(3,\)"),
        ({"options": {"reset_mask": np.zeros(ROWS, bool)}}, "0 True"),
        ({"options": {"speed": 1}}, "option 'speed'"),
    ],
)
def test_bad_resets_end_in_one_sentence(given: dict[str, Any], sentence: str) -> None:
    env = vector()
    env.reset(seed=1)
    with pytest.raises(InputError, match=sentence):
        env.reset(**given)


def test_wrapper_pickle_and_spec() -> None:
    env = RecordEpisodeStatistics(vector())
    env.reset(seed=1)
    for actions in plan(6, False):
        *_, info = env.step(actions)
    assert info["episode"]["l"].tolist() == [6] * ROWS
    inner = env.unwrapped
    again = pickle.loads(pickle.dumps(inner))
    actions = plan(1, False)[0]
    assert_same(inner.step(actions), again.step(actions))
    assert inner.spec is not None
    assert gymnasium.make_vec(inner.spec).num_envs == ROWS
