"""Recordings of the environment, and many runs in one call."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from env_cases import ID, RATE, SHORT, Stops, assert_same, made

from insenv.close import close
from insenv.core.errors import InputError
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.envs.recorder import Recorder
from insenv.envs.rollout import RollOut, roll_out
from insenv.systems.north_finder.env import north_finder

TURN = np.array([RATE, 0.0])


class Turns:
    """A policy that turns the table."""

    def reset(self, batch: int | None = None) -> int:
        return batch or 1

    def act(self, state: int, chunk: Any, estimate: Any) -> tuple[Any, int]:
        return np.tile(TURN, (state, 1)), state


def test_a_recording_comes_back_from_its_files(tmp_path: Path) -> None:
    env = Recorder(gymnasium.make(ID, scenario="north_finder/realistic", changes=SHORT))
    env.reset(seed=3)
    env.step(-TURN)
    env.reset(seed=4)
    observed = [env.step(TURN)[0] for _ in range(6)]
    recording = env.recording()
    pulse = np.radians(0.46634601 / 3600)
    counted = np.concatenate([o["pulses"] for o in observed])
    np.testing.assert_allclose(recording.values("gyro", "rad/s") * 0.01 / pulse, counted, atol=1e-9)
    np.testing.assert_allclose(
        np.diff(recording.values("table_angle", "rad"), prepend=0.0),
        np.concatenate([o["encoder"] for o in observed]),
        atol=1e-12,
    )
    assert set(recording.channels) == {"gyro", "table_angle", "temperature", "accel_x"}
    np.testing.assert_allclose(recording.t, np.arange(1, 601) * 0.01)
    path = env.save(tmp_path / "new" / "folder")
    (again,) = read_recordings(load_manifest(path))
    for name, channel in recording.channels.items():
        assert_same(again.channels[name].values, channel.values, name)
        assert again.channels[name].covers == channel.covers
    assert again.site.latitude == pytest.approx(np.radians(40))
    assert again.mounting.tilt == pytest.approx(np.radians(30))


def test_the_manifest_declares_what_the_scenario_declares_and_no_truth(tmp_path: Path) -> None:
    env = Recorder(gymnasium.make(ID, scenario="north_finder/undeclared", changes=SHORT | {"table.azimuth": "random"}))
    _, info = env.reset(seed=4)
    env.step(TURN)
    manifest = load_manifest(env.save(tmp_path))
    assert set(manifest.model.declared) == {"bias", "scale_factor", "scale_factor_drift", "earth_rate"}
    text = (tmp_path / "manifest.toml").read_text()
    assert "encoder_harmonic" not in text and "quantization" in text
    hidden = [value for name, value in info["truth"].items() if name == "azimuth" or "encoder_harmonic" in name]
    assert len(hidden) == 3 and not any(repr(value) in text for value in hidden)


def test_a_recorded_run_closes_the_loop(tmp_path: Path) -> None:
    changes = {"duration": "40 s", "undeclared": {"encoder_harmonic:1": {"c": "200 arcsec", "s": "100 arcsec"}}}
    env = Recorder(gymnasium.make(ID, changes=changes, step_s=20.0))
    env.reset(seed=4)
    env.step(4 * TURN)
    env.step(-4 * TURN)
    findings = close(env.save(tmp_path))
    assert findings is not None


def test_nothing_recorded_is_said(tmp_path: Path) -> None:
    env = Recorder(made())
    env.reset(seed=4)
    with pytest.raises(InputError, match="seed 4: no time has passed"):
        env.save(tmp_path)
    with pytest.raises(InputError, match="wanted one of insenv's environments"):
        Recorder(gymnasium.make("CartPole-v1"))


def test_a_roll_out_is_the_loop_that_a_user_would_write() -> None:
    env = Recorder(made("env_cases:Sure"))
    rolled = roll_out(env, Turns(), seeds=[3, 8])
    for row, seed in enumerate([3, 8]):
        observation, info = env.reset(seed=seed)
        beliefs, total = [observation["belief"]], 0.0
        for _ in range(6):
            observation, reward, *_ = env.step(TURN)
            beliefs.append(observation["belief"])
            total += float(reward)
        np.testing.assert_array_equal(rolled.means[row, :, 0], [b[0] for b in beliefs])
        np.testing.assert_array_equal(rolled.deviations[row, :, 0], [b[1] for b in beliefs])
        assert rolled.reward[row] == pytest.approx(total)
        assert rolled.truth["azimuth"][row] == info["truth"]["azimuth"]
        recording = rolled.recording(row)
        for name, channel in env.recording().channels.items():
            assert_same(recording.channels[name].values, channel.values, name)
    assert rolled.time.tolist() == [6.0, 6.0] and not rolled.stopped.any()
    assert rolled.estimate is not None
    np.testing.assert_array_equal(rolled.estimate.mean[:, 0], rolled.means[:, -1, 0])


def test_runs_may_stop_at_different_times() -> None:
    rolled = roll_out(north_finder(changes=SHORT), "env_cases:Stops", "env_cases:Sure", seeds=range(10, 18))
    assert rolled.time.tolist() == [0, 1, 2, 3, 4, 5, 6, 6]
    assert rolled.stopped.tolist() == [True] * 6 + [False] * 2
    assert np.isnan(rolled.means[2, 3:]).all() and np.isfinite(rolled.means[2, :3]).all()
    assert len(rolled.recording(3)) == 300
    with pytest.raises(InputError, match="seed 10: no time has passed"):
        rolled.recording(0)
    alone = roll_out(north_finder(changes=SHORT), Turns(), "env_cases:Sure", seeds=[13])
    np.testing.assert_array_equal(rolled.means[3, :4], alone.means[0, :4])
    north = rolled.truth["azimuth"]
    np.testing.assert_allclose(np.sin(rolled.errors[:, 0]), np.sin(rolled.estimate.mean[:, 0] - north))  # type: ignore


def test_many_runs_are_played_in_batches_and_progress_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    task, told = north_finder(changes=SHORT), []

    def play(**more: Any) -> RollOut:
        return roll_out(task, Turns(), "env_cases:Sure", seeds=range(7), **more)

    whole = play()
    monkeypatch.setattr("insenv.envs.rollout.TOGETHER", 3)
    parts = play(progress=lambda done, total: told.append((done, total)))
    for name in ("means", "deviations", "reward", "time", "errors"):
        assert_same(getattr(whole, name), getattr(parts, name), name)
    assert_same(dict(whole.truth), dict(parts.truth))
    assert whole.seeds == parts.seeds == tuple(range(7))
    for row in range(7):
        assert_same(whole.recording(row).values("gyro", "rad/s"), parts.recording(row).values("gyro", "rad/s"))
    assert told[-1] == (42, 42) and [d for d, _ in told] == sorted(d for d, _ in told)
    assert not play(keep=False).chunks


@pytest.mark.parametrize("every", [2, 4, 100])
def test_fewer_beliefs_change_nothing_in_the_end(every: int) -> None:
    task = north_finder(changes=SHORT)
    often, seldom = (roll_out(task, "env_cases:Stops", "env_cases:Sure", seeds=range(8), every=k) for k in (1, every))
    assert_same(often.errors, seldom.errors)
    np.testing.assert_allclose(often.reward, seldom.reward)
    assert often.estimate is not None and seldom.estimate is not None
    assert_same(often.estimate.cov, seldom.estimate.cov)
    believed = np.isfinite(seldom.means[7, :, 0])
    assert believed.tolist() == [k % every == 0 or k == 6 for k in range(7)]
    np.testing.assert_array_equal(often.means[7, believed], seldom.means[7, believed])


def test_an_estimator_that_knows_no_north_estimates_what_it_can() -> None:
    task = north_finder("north_finder/realistic", changes=SHORT)
    rolled = roll_out(task, Turns(), "levelling", seeds=[1, 2])
    assert rolled.estimate is not None and rolled.estimate.mean.shape[0] == 2
    assert rolled.names == () and rolled.means.shape == (2, 7, 0)


class ActsBadly(Stops):
    def act(self, state: Any, chunk: Any, estimate: Any) -> Any:
        return np.full((len(state), 2), np.nan), state


class FailsToAct(Stops):
    def act(self, state: Any, chunk: Any, estimate: Any) -> Any:
        raise ZeroDivisionError("no rate")


class ActsAlone(Stops):
    def act(self, state: Any, chunk: Any, estimate: Any) -> Any:
        return np.zeros((len(state), 2))


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"policy": "constant_rat"}, "policy 'constant_rat' is not installed"),
        ({"policy": FailsToAct(None)}, "policy 'FailsToAct' failed in act: ZeroDivisionError: no rate"),  # type: ignore
        ({"policy": ActsAlone(None)}, "policy 'ActsAlone' returned a ndarray; wanted an action and a state"),  # type: ignore
        ({"policy": ActsBadly(None)}, r"action \[nan, nan\]"),  # type: ignore[arg-type]
        ({"policy": Turns(), "estimator": "env_cases:Raises"}, "'env_cases:Raises' failed in update"),
        ({"policy": Turns(), "seeds": []}, "no seed given"),
        ({"policy": Turns(), "every": 0}, "every = 0 given to roll_out"),
        ({"policy": Turns(), "seeds": [-1]}, "seed -1 given"),
        ({"policy": Turns(), "environment": "north"}, "wanted a task or one of insenv's environments"),
    ],
)
def test_bad_roll_outs_end_in_one_sentence(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        roll_out(**({"environment": north_finder(changes=SHORT)} | given))
