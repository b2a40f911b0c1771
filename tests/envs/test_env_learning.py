"""What learners need of every environment: normalised spaces, runs that last, returns that are bounded, copies."""

from __future__ import annotations

import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from env_cases import assert_same
from gymnasium.utils.env_checker import check_env

import insenv  # noqa: F401 - registers the environments
from insenv.core.errors import InputError
from insenv.envs.normalised import DEAD_BAND, SIGNAL, Normalised, commanded

#: Short runs of every environment.
SETTINGS: dict[str, dict[str, Any]] = {
    "NorthFinder": {"changes": {"duration": "30 s", "instrument.sampling": "20 Hz"}, "step_s": 1.0},
    "TwoPosition": {
        "changes": {"duration": "60 s", "instrument.sampling": "20 Hz", "profile": {"kind": "rest"}},
        "step_s": 2.0,
    },
    "RateTable": {"changes": {"duration": "30 s", "instrument.sampling": "20 Hz"}, "step_s": 1.0},
}
EVERY = pytest.mark.parametrize("name", SETTINGS)


def made(name: str, **more: Any) -> Any:
    return gymnasium.make(f"insenv/{name}-v0", disable_env_checker=True, **SETTINGS[name], **more).unwrapped


@EVERY
def test_a_normalised_environment_is_one_that_gymnasium_takes(name: str) -> None:
    env = made(name, normalised=True)
    assert isinstance(env, Normalised)
    for space in (env.action_space, env.observation_space):
        assert (
            isinstance(space, gymnasium.spaces.Box)
            and space.dtype == np.float32
            and np.all(space.low == -1)
            and np.all(space.high == 1)
        )
    check_env(env, skip_render_check=True)
    spec = gymnasium.make(f"insenv/{name}-v0", normalised=True, **SETTINGS[name]).spec
    assert spec is not None and isinstance(gymnasium.make(spec).unwrapped, Normalised)


@EVERY
def test_random_actions_play_on_and_earn_what_is_bounded(name: str) -> None:
    env = made(name, normalised=True)
    env.action_space.seed(0)
    lengths, most = [], env.task.steps
    for seed in range(8):
        env.reset(seed=seed)
        total, ended, steps = 0.0, False, 0
        while not ended:
            _, reward, terminated, truncated, _ = env.step(env.action_space.sample())
            total, ended, steps = total + reward, terminated or truncated, steps + 1
        lengths.append(steps)
        # The score of a belief within its limits, and the cost of all the time.
        q = env.task.quantities[0]
        assert -50.0 - np.log1p((2 * q.limit / q.demanded) ** 2) - 1.0 < total < 28.2
    # A uniform signal ends one run in 420 steps: none of the eight in 1 of 2 choices of the seed, all never.
    assert np.mean(lengths) > 0.8 * most


@EVERY
def test_a_normalised_run_is_the_run(name: str) -> None:
    """The same truth, rewards and ends as the environment under the actions that are passed on."""
    env, plain = made(name, normalised=True), made(name, estimator={**USUAL}[name])
    rng = np.random.default_rng(3)
    _, truth = env.reset(seed=5)
    _, same = plain.reset(seed=5)
    assert truth == same
    for _ in range(5):
        action = np.array([rng.uniform(-1, 1), 0.0], np.float32)
        seen, *rest = env.step(action)
        _, *other = plain.step(commanded(plain.task, float(action[0]), 0.0))
        assert rest == other and seen in env.observation_space


USUAL = {"NorthFinder": "north_gls", "TwoPosition": "two_position_joint", "RateTable": "rate_line"}


@EVERY
def test_a_signal_counts_where_it_is_given_twice(name: str) -> None:
    env = made(name, normalised=True)

    def step(signal: float) -> bool:
        return bool(env.step(np.array([0.0, signal], np.float32))[2])

    env.reset(seed=1)
    assert [step(s) for s in (SIGNAL, 0.0, 1.0, -1.0, 1.0)] == [False] * 5
    assert step(1.0)
    if name == "RateTable":
        env.reset(seed=1)
        plain = env.env.group.power_ups
        for signal in (-1.0, -1.0, -1.0):
            step(signal)
        assert env.env.group.power_ups == plain + 1


def test_a_command_has_a_dead_band_and_reaches_the_largest() -> None:
    task = made("NorthFinder").task
    assert commanded(task, DEAD_BAND, 0.0)[0] == commanded(task, -DEAD_BAND, 0.0)[0] == 0.0
    assert commanded(task, -1.0, 0.0)[0] == task.action_space.low[0]
    assert commanded(task, 1.0, 1.0).tolist() == task.action_space.high.tolist()


@pytest.mark.parametrize("action", [[np.nan, 0.0], [1.1, 0.0], [0.0], 0.0])
def test_a_normalised_action_that_cannot_be_used_is_refused(action: Any) -> None:
    env = made("NorthFinder", normalised=True)
    env.reset(seed=1)
    with pytest.raises(InputError, match="wanted two numbers from -1 to 1"):
        env.step(np.array(action, np.float32))


@EVERY
@pytest.mark.parametrize("normalised", [False, True])
def test_an_environment_that_has_rendered_survives_pickle(name: str, normalised: bool) -> None:
    more: dict[str, Any] = {"normalised": True} if normalised else {"estimator": USUAL[name]}
    env = made(name, render_mode="rgb_array", **more)
    action = np.array([0.4, 0.0], env.action_space.dtype)
    env.reset(seed=2)
    env.step(action)
    env.render()
    again = pickle.loads(pickle.dumps(env))
    assert_same(env.step(action), again.step(action))
    assert_same(env.render(), again.render())
