"""The two-position calibration: gymnasium's contract, what is seen, what a turn does, and recordings."""

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from env_cases import assert_same
from environments.copies import assert_survives
from gymnasium.utils.env_checker import check_env
from two_position_cases import ESTIMATORS, ID, NINE, SCENARIOS, SHORT, STAY, STOP, SURE, TURN, made

from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.units import ARCMIN, ARCSEC
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.envs.recorder import Recorder
from insenv.envs.rollout import roll_out
from insenv.systems.two_position.env import TwoPosition, TwoPositionEnv, two_position

TURNS: dict[str, Any] = {"sight.readings": "turns"}


def checked(**settings: Any) -> list[str]:
    """Warnings of gymnasium's own check."""
    env = gymnasium.make(ID, disable_env_checker=True, **settings).unwrapped
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(env, skip_render_check=True)
    return [str(w.message) for w in caught]


@pytest.mark.parametrize("name", SCENARIOS)
def test_gymnasium_has_nothing_to_say_of_any_packaged_scenario(name: str) -> None:
    assert not checked(scenario=name)


@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_gymnasium_has_nothing_to_say_of_an_estimator(estimator: str | None) -> None:
    assert not checked(changes=SHORT, estimator=estimator)


def test_gymnasium_accepts_the_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pytest.importorskip("pygame")
    env = gymnasium.make(ID, changes=SHORT, estimator=SURE, disable_env_checker=True).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env)


def test_observation_is_what_is_documented_and_nothing_else() -> None:
    plain = {"gyro": (100, 3), "accel": (100, 3), "sight": (2,), "level": (3,), "turning": (1,), "time_left": (1,)}
    for estimator, more in ((None, {}), (SURE, {"belief": (2,)})):
        space = made(estimator).observation_space
        assert {key: box.shape for key, box in space.spaces.items()} == plain | more
        for box in space.values():
            assert np.isfinite(box.low).all() and np.isfinite(box.high).all()
    blocks = two_position(changes=SHORT, step_s=0.5, sampling=200.0).world.blocks
    assert blocks["gyro"].shape == (100, 3)
    assert made().action_space.low.tolist() == [-1.0, 0.0] and made().action_space.high.tolist() == [1.0, 1.0]


@pytest.mark.parametrize("name", SCENARIOS)
def test_what_is_seen_lies_within_its_bounds(name: str) -> None:
    env = gymnasium.make(ID, scenario=name, disable_env_checker=True).unwrapped
    observation, _ = env.reset(seed=1)
    assert observation in env.observation_space
    for k in range(40):
        observation, *_ = env.step(np.array([-1.0 if k == 3 else 0.0, 0.0]))
        assert observation in env.observation_space


def test_a_vehicle_at_rest_feels_gravity_and_the_turning_earth() -> None:
    env = made()
    env.reset(seed=1)
    blocks = [env.step(STAY)[0] for _ in range(8)]
    rate, force = (np.concatenate([b[key] for b in blocks]).mean(axis=0) / 0.01 for key in ("gyro", "accel"))
    # Biases of 0.01 deg/h and 50 ug, drawn: ten deviations, false alarm 1e-22.
    assert np.linalg.norm(rate) == pytest.approx(EARTH_RATE, abs=10 * 5e-8)
    assert np.linalg.norm(force) == pytest.approx(9.8, abs=10 * 5e-4)
    assert force[2] > 9.7
    assert [float(b["turning"][0]) for b in blocks] == [0.0] * 8


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_turn_is_seen_by_the_gyro_and_by_the_flag_and_takes_its_time(sense: float) -> None:
    env = made(None, **TURNS)
    _, info = env.reset(seed=1)
    blocks = [env.step(a)[0] for a in (STAY, [sense * NINE, 0.0], STAY, [-0.5, 0.0], STAY, STAY, STAY, STAY)]
    # At 5 deg/s^2 it takes 2.68 s; what is commanded meanwhile is passed over.
    assert [float(b["turning"][0]) for b in blocks] == [0, 1, 1, 1, 0, 0, 0, 0]
    up = EARTH_RATE * np.sin(np.radians(38.0))
    angle = sum(float(b["gyro"][:, 2].sum()) for b in blocks) - 8 * up
    assert angle == pytest.approx(sense * np.radians(9.0), abs=1e-5)
    readings = [b["sight"][0] for b in blocks if b["sight"][1]]
    assert [b["sight"][1] for b in blocks] == [1, 0, 0, 1, 0, 0, 0, 0]
    # Ten deviations of two trackings of 20 arcsec; azimuths are clockwise.
    assert readings[1] - readings[0] == pytest.approx(-sense * np.radians(9.0), abs=300 * ARCSEC)
    assert readings[0] == pytest.approx(
        info["truth"]["heading"] + info["truth"]["installation_angle"] + info["truth"]["sight.orientation"],
        abs=200 * ARCSEC,
    )


def test_sight_and_level_are_read_once_where_nothing_else_is_said() -> None:
    env = made(**{"sight.installation": "30 arcmin"})
    seen, info = env.reset(seed=2)
    assert not seen["sight"].any() and not seen["level"].any()
    blocks = [env.step(a)[0] for a in (STAY, TURN, *[STAY] * 6)]
    assert [b["sight"][1] for b in blocks] == [b["level"][2] for b in blocks] == [1] + [0] * 7
    truth = info["truth"]
    expected = [truth["pitch"] + truth["level.pitch"], truth["roll"] + truth["level.roll"]]
    np.testing.assert_allclose(blocks[0]["level"][:2], expected, atol=1e-9)
    assert truth["installation_angle"] == pytest.approx(30 * ARCMIN)
    assert {"gyro_x.bias.c", "accel_y.bias.c", "heading"} < set(truth)


def test_time_up_truncates_and_stop_terminates_without_time() -> None:
    env = made(None, **{"task.cost": 0.25})
    env.reset(seed=1)
    ends = [env.step(STAY)[1:4] for _ in range(8)]
    assert ends == [(-0.25, False, False)] * 7 + [(-0.25, False, True)]
    env.reset(seed=1)
    env.step(STAY)
    observation, reward, terminated, truncated, _ = env.step(STOP)
    assert (reward, terminated, truncated) == (0.0, True, False)
    assert observation["time_left"] == 7.0
    assert not any(observation[key].any() for key in ("gyro", "accel", "sight", "level"))


def test_reward_is_the_information_won_less_the_true_error() -> None:
    env = made(SURE, **{"task.demanded": "1 arcmin", "task.cost": 0.0})
    seen, info = env.reset(seed=1)
    before = seen["belief"][1]
    seen, reward, *_ = env.step(STAY)
    assert reward == pytest.approx(np.log(before / seen["belief"][1]))
    mean, sd = seen["belief"]
    error = mean - info["truth"]["installation_angle"]
    verdict = 0.5 - 0.5 * min((error / sd) ** 2, 100.0) - np.log1p((error / ARCMIN) ** 2)
    assert env.step(STOP)[1] == pytest.approx(verdict)


@pytest.mark.parametrize(
    ("action", "sentence"),
    [
        ([np.nan, 0.0], r"action \[nan, 0\]; wanted numbers from \[-1, 0\] to \[1, 1\]"),
        ([np.inf, 0.0], r"action \[inf, 0\]"),
        ([np.pi, 0.0], r"action \[3.14159, 0\]"),
        ([0.1, 1.5], r"action \[0.1, 1.5\]"),
        ([0.1], r"an action of shape \(1,\); wanted \(2,\)"),
        (0.1, r"an action of shape \(\)"),
        ([[0.1, 0.0]], r"an action of shape \(1, 2\)"),
        ([0.1, [0.0]], "an action of numbers and lists"),
        (["a", "b"], "actions of type .*; wanted real numbers"),
        ([True, False], "actions of type bool"),
        (None, r"an action of shape \(\)"),
    ],
)
def test_bad_actions_end_in_one_sentence_and_change_nothing(action: Any, sentence: str) -> None:
    env = made()
    env.reset(seed=1)
    with pytest.raises(InputError, match=sentence):
        env.step(action)
    assert env.step(STAY)[0]["time_left"] == 7.0


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"scenario": "two_position/publishd_a"}, "did you mean 'two_position/published_a"),
        ({"scenario": "north_finder/published"}, "task.kind = 'north-finder'; wanted 'two-position'"),
        ({"scenario": "north_finder/scale_factor_test"}, "task.kind = 'scale-factor-test'; wanted 'two-position'"),
        ({"changes": {"site.latitude": "90 deg"}}, "at a pole"),
        ({"changes": {"vehicle.max_rate": "0 deg/s"}}, "vehicle.max_rate"),
        ({"changes": {"task.demanded": "0 arcsec"}}, "task.demanded"),
        ({"step_s": 7.0}, "divides the duration evenly"),
        ({"step_s": 0.001}, "whole number of samples"),
        ({"sampling": -1.0}, "instrument.sampling"),
        ({"estimator": "two_positoin_cubic"}, "is not installed"),
    ],
)
def test_impossible_settings_are_refused(settings: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        two_position(**settings)


def test_a_north_finder_says_what_it_was_asked_and_what_it_is_for() -> None:
    wanted = (
        r"published_a\.toml: task.kind = 'two-position'; wanted 'north-finder' or 'scale-factor-test', and a \[table\]$"
    )
    with pytest.raises(InputError, match=wanted):
        gymnasium.make("insenv/NorthFinder-v0", scenario="two_position/published_a")


def test_an_estimator_that_does_not_know_the_angle_is_named() -> None:
    with pytest.raises(InputError, match="KnowsNoSight.*wanted 'installation_angle'"):
        made("two_position_cases:KnowsNoSight").reset(seed=1)


def rollout(env: Any, seed: int | None, actions: Any = (STAY, TURN, STAY, STAY, STAY)) -> Iterator[Any]:
    yield env.reset(seed=seed)
    for action in actions:
        yield env.step(action)


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_seed_is_a_run(name: str) -> None:
    settings: dict[str, Any] = {"scenario": name, "changes": SHORT, "estimator": SURE, "disable_env_checker": True}
    a, b = (gymnasium.make(ID, **settings).unwrapped for _ in range(2))
    for seed in (5, None):
        for one, other in zip(rollout(a, seed), rollout(b, seed), strict=True):
            assert_same(one, other)
    first, second = ([x[0] for x in rollout(a, seed)][1] for seed in (5, 6))
    assert all(np.any(first[key] != second[key]) for key in ("gyro", "accel", "sight"))


@pytest.mark.parametrize("step", [0.2, 4.0, 8.0])
@pytest.mark.parametrize("name", SCENARIOS)
def test_how_a_run_is_cut_into_steps_makes_no_difference(name: str, step: float) -> None:
    def whole(step_s: float) -> Any:
        env = gymnasium.make(ID, scenario=name, changes=SHORT, step_s=step_s, disable_env_checker=True).unwrapped
        env.reset(seed=3)
        blocks = [env.step(STAY if k else TURN)[0] for k in range(round(8 / step_s))]
        return {key: np.concatenate([b[key] for b in blocks]) for key in ("gyro", "accel")}

    for key, expected in whole(1.0).items():
        np.testing.assert_array_equal(whole(step)[key], expected)


def test_nothing_that_is_observed_or_rewarded_follows_the_truth_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    right = TwoPosition.truth
    before = [(x[0], x[1] if len(x) == 5 else None) for x in rollout(made(), 2)]

    def lie(self: TwoPosition, rig: Any, batch: int) -> dict[str, Any]:
        return {name: values + 1.0 for name, values in right(self, rig, batch).items()}

    monkeypatch.setattr(TwoPosition, "truth", lie)
    after = [(x[0], x[1] if len(x) == 5 else None) for x in rollout(made(), 2)]
    assert_same(tuple(before), tuple(after))


def test_an_undeclared_value_shows_in_what_is_measured_alone() -> None:
    def second(value: str) -> Any:
        entry = {"targets": ["gyro_z"], "c": value}
        env = made(undeclared={"scale_factor": entry})
        *_, (observation, *_, info) = rollout(env, 4, (STAY, TURN))
        return env, observation, info

    (env, one, info), (other_env, other, _) = second("0 ppm"), second("12345.6 ppm")
    assert [key for key in one if np.any(one[key] != other[key])] == ["gyro"]
    assert np.all(one["gyro"][:, :2] == other["gyro"][:, :2])
    assert env.observation_space == other_env.observation_space
    assert env.task.datasheet == other_env.task.datasheet
    assert set(info) == {"truth"} and "gyro_z.scale_factor.c" in info["truth"]


def test_registry_spec_and_environment_survive_json_and_pickle() -> None:
    env = gymnasium.make(ID, changes=SHORT, estimator=SURE, max_episode_steps=4)
    assert assert_survives(env, TURN, STAY, steps=3)[3]


def test_a_recording_holds_what_an_estimator_is_given(tmp_path: Path) -> None:
    env = Recorder(gymnasium.make(ID, changes=SHORT | TURNS))
    env.reset(seed=4)
    observed = [env.step(a)[0] for a in (STAY, TURN, *[STAY] * 6)]
    recording = env.recording()
    axes = {f"{family}_{axis}" for family in ("gyro", "accel") for axis in "xyz"}
    assert set(recording.channels) == axes | {"sight_heading", "level_pitch", "level_roll", "turning"}
    np.testing.assert_allclose(recording.t, np.arange(1, 801) * 0.01)
    for family, unit in (("gyro", "rad/s"), ("accel", "m/s^2")):
        values = np.stack([recording.values(f"{family}_{axis}", unit) for axis in "xyz"], axis=-1)
        np.testing.assert_array_equal(values * 0.01, np.concatenate([o[family] for o in observed]))
    sight = recording.values("sight_heading", "rad")
    assert np.isfinite(sight).sum() == 2 and sight[0] == observed[0]["sight"][0]
    assert np.flatnonzero(recording.values("turning", "1")).tolist() == list(range(100, 369))
    (again,) = read_recordings(load_manifest(env.save(tmp_path)))
    assert set(again.channels) == {*recording.channels, "table_angle"}  # as it was commanded
    for name in axes:
        np.testing.assert_array_equal(again.channels[name].values, recording.channels[name].values)


def test_a_roll_out_asks_a_policy_and_an_estimator() -> None:
    task = two_position(changes=SHORT)
    rolled = roll_out(task, "two_position_cases:TurnsOnce", SURE, seeds=range(3), keep=True)
    assert rolled.errors.shape == (3, 1)
    single = TwoPositionEnv(changes=SHORT, estimator=SURE)
    *_, last = rollout(single, 1, [STAY, STAY, TURN, *[STAY] * 5])
    assert last[3]
    error = last[0]["belief"][0] - last[4]["truth"]["installation_angle"]
    assert rolled.errors[1, 0] == pytest.approx(error, rel=1e-12)
    turning = rolled.recording(1).values("turning", "1")
    assert np.flatnonzero(turning)[0] == 200


@pytest.mark.parametrize("policy", ["published_schedule", "covariance_triggered", "three_rests"])
def test_the_policies_speak_of_half_turns(policy: str) -> None:
    task = two_position(changes=SHORT | {"duration": "700 s"}, step_s=10.0)
    rolled = roll_out(task, policy, "two_position_tied", seeds=[1], keep=True)
    recording = rolled.recording(0)
    up = EARTH_RATE * np.sin(np.radians(38.0))
    turned = np.cumsum(recording.values("gyro_z", "rad/s") - up) * 0.01
    # By a half turn or so, not by one of 180 / pi.
    assert np.radians(160.0) < np.abs(turned).max() < np.radians(181.0)
    # Six deviations of what is believed at the end; false alarm 2e-9.
    deviations = rolled.deviations[0, :, 0]
    assert abs(rolled.errors[0, 0]) < 6 * deviations[np.isfinite(deviations)][-1]
