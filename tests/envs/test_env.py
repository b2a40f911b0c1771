"""The single environment: gymnasium's contract, actions, seeds, chunks, and that no truth is observed."""

import copy
import warnings
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from env_cases import ID, RATE, SHORT, assert_same, made
from environments.copies import assert_survives
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FlattenObservation, RecordEpisodeStatistics

import insenv
from insenv.core.errors import InputError
from insenv.scenario import names
from insenv.systems.north_finder.env import NorthFinder, NorthFinderEnv, north_finder

TURN = np.array([RATE, 0.0])
STOP = np.array([0.0, 1.0])


@pytest.fixture(autouse=True)
def no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


def checked(**settings: Any) -> list[str]:
    """Warnings of gymnasium's own check."""
    env = gymnasium.make(ID, disable_env_checker=True, **settings).unwrapped
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(env, skip_render_check=True)
    return [str(w.message) for w in caught]


@pytest.mark.parametrize("name", [name for name in names() if name.startswith("north_finder/")])
def test_gymnasium_finds_no_fault_with_any_packaged_scenario(name: str) -> None:
    advice = checked(scenario=name)
    # 100 deg/s are more than 1 rad/s, and gymnasium would like an action to lie within -1 and 1.
    wanted = ["symmetric and normalized"] if name == "north_finder/scale_factor_test" else []
    assert len(advice) == len(wanted), advice
    assert all(part in text for part, text in zip(wanted, advice, strict=True))


@pytest.mark.parametrize("estimator", [None, "env_cases:Sure", "correlation", "revolution", "north_gls"])
def test_gymnasium_has_nothing_at_all_to_say(estimator: str | None) -> None:
    assert not checked(changes=SHORT, estimator=estimator)


def test_gymnasium_accepts_the_pictures() -> None:
    pytest.importorskip("pygame")
    env = gymnasium.make(ID, changes=SHORT, estimator="env_cases:Sure", disable_env_checker=True).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env)


def test_a_frame_is_drawn_after_each_step_and_another_one() -> None:
    env = gymnasium.make(ID, changes=SHORT, render_mode="rgb_array")
    env.reset(seed=1)
    before = np.asarray(env.render())
    env.step(TURN)
    after = np.asarray(env.render())
    assert before.shape == after.shape and before.dtype == np.uint8
    assert np.any(before != after)


def test_rendering_without_a_mode_is_refused() -> None:
    env = made()
    env.reset(seed=1)
    with pytest.raises(InputError, match="made without render_mode"):
        env.render()
    with pytest.raises(InputError, match="'ansi'; wanted 'rgb_array', 'human', None"):
        NorthFinderEnv(render_mode="ansi")


def test_registering_twice_is_no_warning() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        insenv._register()


def test_observation_is_what_is_documented_and_nothing_else() -> None:
    plain = {"pulses", "encoder", "zero_pulse", "temperature", "time_left"}
    assert set(made().observation_space.spaces) == plain  # type: ignore[attr-defined]
    assert set(made("env_cases:Sure").observation_space.spaces) == plain | {"belief"}  # type: ignore[attr-defined]
    realistic = north_finder("north_finder/realistic")
    assert set(realistic.observation_space.spaces) == plain | {"accel_x"}
    for space in realistic.observation_space.values():
        assert np.isfinite(space.low).all() and np.isfinite(space.high).all()  # type: ignore[attr-defined]


def test_blocks_have_the_length_of_a_step() -> None:
    env = gymnasium.make(ID, changes=SHORT, step_s=0.5, sampling=200.0, disable_env_checker=True)
    observation, _ = env.reset(seed=1)
    assert observation["pulses"].shape == (100,)
    assert observation["time_left"] == 6.0
    observation, *_ = env.step(TURN)
    assert observation["time_left"] == 5.5
    assert north_finder(changes=SHORT, step_s=0.5, sampling=200.0).steps == 12


def test_counter_and_encoder_add_up_to_what_the_table_turned() -> None:
    env = made()
    env.reset(seed=1)
    blocks = [env.step(TURN)[0] for _ in range(3)]
    turned = sum(b["encoder"].sum() for b in blocks)
    # 3 s at 10 deg/s less the half second of acceleration at 20 deg/s^2.
    assert turned == pytest.approx(np.radians(27.5), abs=1e-9)
    pulse = np.radians(0.46634601 / 3600)
    counted = pulse * sum(b["pulses"].sum() for b in blocks)
    vertical = 3 * 7.292115e-5 * np.sin(np.radians(40)) * 0.5
    # 100 ppm of scale factor, 10 deg/h of horizontal Earth rate, a pulse.
    assert counted == pytest.approx(0.5 * turned + vertical, abs=2e-4 * turned + 3 * 5e-5 + pulse)


def test_zero_mark_is_seen_once_a_turn() -> None:
    env = made(**{"duration": "80 s", "task.step": "80 s"})
    env.reset(seed=1)
    observation, _, _, truncated, _ = env.step(TURN)
    assert truncated
    assert observation["zero_pulse"].sum() == 2  # 797.5 deg
    assert set(np.unique(observation["zero_pulse"])) == {0.0, 1.0}


def test_time_up_truncates_and_stop_terminates_without_time() -> None:
    env = made()
    env.reset(seed=1)
    ends = [env.step(TURN)[2:4] for _ in range(6)]
    assert ends == [(False, False)] * 5 + [(False, True)]
    env.reset(seed=1)
    env.step(TURN)
    observation, reward, terminated, truncated, _ = env.step(STOP)
    assert (reward, terminated, truncated) == (0.0, True, False)
    assert observation["time_left"] == 5.0
    assert not observation["pulses"].any() and not observation["encoder"].any()


def test_reward_without_an_estimator_is_the_cost_of_time() -> None:
    env = made(None, **{"task.cost": 0.25})
    env.reset(seed=1)
    assert env.step(TURN)[1] == -0.25


@pytest.mark.parametrize(
    ("action", "sentence"),
    [
        ([np.nan, 0.0], r"action \[nan, 0\]; wanted numbers from \[-0.87.*, 0\] to \[0.87.*, 1\]"),
        ([np.inf, 0.0], r"action \[inf, 0\]"),
        ([1.0, 0.0], r"action \[1, 0\]"),
        ([0.1, 1.5], r"action \[0.1, 1.5\]"),
        ([0.1], r"an action of shape \(1,\); wanted \(2,\)"),
        (0.1, r"an action of shape \(\); wanted \(2,\)"),
        ([[0.1, 0.0]], r"an action of shape \(1, 2\)"),
        ([0.1, [0.0]], "an action of numbers and lists"),
        (["a", "b"], "actions of type .*; wanted real numbers"),
        ([True, False], "actions of type bool"),
        ([0.1 + 0j, 0.0], "actions of type complex128"),
        (None, r"an action of shape \(\)"),
    ],
)
def test_bad_actions_end_in_one_sentence(action: Any, sentence: str) -> None:
    env = made()
    env.reset(seed=1)
    with pytest.raises(InputError, match=sentence):
        env.step(action)
    # Nothing has passed.
    assert env.step(TURN)[0]["time_left"] == 5.0


def test_an_action_of_single_precision_at_the_bound_is_good() -> None:
    env = made()
    env.reset(seed=1)
    env.step(env.action_space.high.astype(np.float32))  # type: ignore[attr-defined]


def test_stepping_before_reset_or_after_the_end_is_refused() -> None:
    env = made()
    with pytest.raises(gymnasium.error.ResetNeeded, match="no run has begun"):
        env.step(TURN)
    env.reset(seed=7)
    env.step(STOP)
    with pytest.raises(gymnasium.error.ResetNeeded, match="the run of seed 7 has ended"):
        env.step(TURN)


def test_unknown_options_are_refused() -> None:
    with pytest.raises(InputError, match="option 'azimuth' given to reset"):
        made().reset(seed=1, options={"azimuth": 1.0})


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"scenario": "north_finder/publishd"}, "did you mean 'north_finder/published'"),
        ({"changes": {"table.tilt": "90 deg"}}, "north has no meaning"),
        ({"changes": {"site.latitude": "90 deg"}}, "north has no meaning"),
        ({"step_s": 7.0}, "divides the duration evenly"),
        ({"step_s": 0.001}, "whole number of samples"),
        ({"sampling": -1.0}, "instrument.sampling"),
        ({"estimator": "nort_gls"}, "did you mean 'north_gls'"),
    ],
)
def test_impossible_settings_are_refused(settings: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        north_finder(**settings)


def rollout(env: Any, seed: int | None, steps: int = 3) -> Iterator[Any]:
    yield env.reset(seed=seed)
    for _ in range(steps):
        yield env.step(TURN)


@pytest.mark.parametrize("name", ["north_finder/published", "north_finder/realistic"])
def test_a_seed_is_a_run(name: str) -> None:
    settings: dict[str, Any] = {
        "scenario": name,
        "changes": SHORT,
        "estimator": "env_cases:Sure",
        "disable_env_checker": True,
    }
    a, b = (gymnasium.make(ID, **settings).unwrapped for _ in range(2))
    for one, other in zip(rollout(a, 5), rollout(b, 5), strict=True):
        assert_same(one, other)
    # And the runs after it, that were given no seed.
    for one, other in zip(rollout(a, None), rollout(b, None), strict=True):
        assert_same(one, other)
    first, second = ([x[0] for x in rollout(a, seed)][1] for seed in (5, 6))
    assert np.any(first["pulses"] != second["pulses"])


def test_the_environment_plays_the_run_that_the_scenario_has_under_that_seed() -> None:
    task = north_finder(changes=SHORT)
    _, info = made().reset(seed=11)
    assert info["truth"]["azimuth"] == task.world.cast([11]).plant.azimuth[0]  # type: ignore[attr-defined]


@pytest.mark.parametrize("step", [0.2, 2.0, 6.0])
def test_how_a_run_is_cut_into_steps_makes_no_difference(step: float) -> None:
    def whole(step_s: float, key: str) -> Any:
        env = gymnasium.make(ID, changes=SHORT, step_s=step_s, disable_env_checker=True).unwrapped
        env.reset(seed=3)
        return np.concatenate([env.step(TURN)[0][key] for _ in range(round(6 / step_s))])

    assert np.array_equal(whole(1.0, "pulses"), whole(step, "pulses"))
    # The table is told the same rate again: its angle is summed from there, to rounding.
    np.testing.assert_allclose(whole(1.0, "encoder"), whole(step, "encoder"), atol=1e-14)


def test_nothing_that_is_observed_or_rewarded_follows_the_truth_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, told = made(), made()
    wrong = NorthFinder.truth
    before = [(x[0], x[1] if len(x) == 5 else None) for x in rollout(plain, 2, 5)]

    def lie(self: NorthFinder, rig: Any, batch: int) -> dict[str, Any]:
        return {name: values + 1.0 for name, values in wrong(self, rig, batch).items()}

    monkeypatch.setattr(NorthFinder, "truth", lie)
    after = [(x[0], x[1] if len(x) == 5 else None) for x in rollout(told, 2, 5)]
    assert_same(tuple(before), tuple(after))


def test_an_undeclared_value_shows_in_what_is_measured_alone() -> None:
    def first(value: str) -> Any:
        changes = SHORT | {"undeclared": {"scale_factor_asymmetry": {"c": value}}}
        env = gymnasium.make(ID, changes=changes, disable_env_checker=True).unwrapped
        env.reset(seed=4)
        observation, *_, info = env.step(TURN)
        return env, observation, info

    (env, one, info), (other_env, other, _) = first("0 ppm"), first("12345.6 ppm")
    assert [key for key in one if np.any(one[key] != other[key])] == ["pulses"]
    assert env.observation_space == other_env.observation_space
    assert env.unwrapped.task.datasheet == other_env.unwrapped.task.datasheet
    assert set(info) == {"truth"} and "gyro.scale_factor_asymmetry.c" in info["truth"]


def test_given_away_arrays_are_nobody_elses() -> None:
    env = made("env_cases:Sure")
    kept = [copy.deepcopy(x) for x in rollout(env, 9)]
    again = []
    for x in rollout(env, 9):
        again.append(copy.deepcopy(x))
        for array in x[0].values():
            array[...] = 99.0
        x[-1]["truth"].clear()
    for one, other in zip(kept, again, strict=True):
        assert_same(one, other)


def test_wrappers_of_gymnasium_work() -> None:
    env = RecordEpisodeStatistics(FlattenObservation(gymnasium.make(ID, changes=SHORT)))
    observation, _ = env.reset(seed=1)
    assert observation in env.observation_space and observation.ndim == 1
    for _ in range(6):
        observation, *_, info = env.step(TURN)
    assert info["episode"]["l"] == 6


def test_spec_and_environment_survive_json_and_pickle() -> None:
    env = gymnasium.make(ID, changes=SHORT, estimator="env_cases:Sure", max_episode_steps=4)
    assert assert_survives(env, TURN, TURN, steps=3)[3]
