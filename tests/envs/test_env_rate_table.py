"""The rate table: gymnasium's contract, power cycles in single and vector form, what the truth is, frames."""

from __future__ import annotations

import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from env_cases import assert_same
from environments.copies import ROWS, assert_survives, native_and_sync
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.core.units import ARCSEC, DEG, DEG_PER_HOUR, PPM
from insenv.effects.base import LinearEffect, Param
from insenv.envs.recorder import Recorder
from insenv.envs.rollout import roll_out
from insenv.rig import Fitted
from insenv.scenario import load, names
from insenv.sensors.chain import Sensor
from insenv.systems.rate_table.env import RateTableEnv, RateTableVectorEnv, line_slope, rate_table

ID = "insenv/RateTable-v0"
#: Eight steps at a rate that keeps the tests fast; no [profile], which is for the whole test.
SHORT: dict[str, Any] = {
    "duration": "8 s",
    "profile": {"kind": "rest"},
    "instrument.sampling": "100 Hz",
}
PLAYED = (
    "rate_table/b215",
    "rate_table/b215_lock",
    "rate_table/kvh13",
    "rate_table/realistic",
    "rate_table/undeclared",
)


class Slope:
    """An estimator whose mean is a function of the gyro's output, and that is surer with every sample."""

    def __init__(self, datasheet: Any) -> None:
        self.dt = datasheet.dt

    def reset(self, batch: int | None = None) -> Any:
        return np.zeros((batch or 1, 3))

    def update(self, state: Any, chunk: Any) -> Any:
        rate, power = chunk.values("gyro", "rad/s"), chunk.values("power", "1")
        more = np.stack([rate.sum(axis=-1) * self.dt, power[..., -1], np.full(len(rate), rate.shape[-1])], axis=-1)
        return state + more

    def estimate(self, state: Any) -> Any:
        from insenv.core.estimate import Estimate

        mean = 1e-5 * state[..., :1] * state[..., 1:2]
        return Estimate(("scale_factor",), ("1",), mean, (1e-8 / (1 + state[..., 2:, None])))


SURE = "test_env_rate_table:Slope"


def made(changes: dict[str, Any] | None = None, estimator: str | None = None, scenario: str = "rate_table/b215") -> Any:
    given = SHORT | (changes or {})
    return gymnasium.make(ID, scenario=scenario, estimator=estimator, changes=given, disable_env_checker=True).unwrapped


def act(rate: float, signal: float = 0.0) -> Floats:
    return np.array([rate * DEG, signal])


# ------------------------------------------------------------------------------------------------ the contract


@pytest.mark.parametrize("name", PLAYED)
@pytest.mark.parametrize("estimator", [None, SURE])
def test_gymnasium_has_nothing_at_all_to_say(name: str, estimator: str | None) -> None:
    for changes in (SHORT, {}):
        settings: dict[str, Any] = {"scenario": name, "estimator": estimator, "changes": changes}
        env = gymnasium.make(ID, disable_env_checker=True, **settings).unwrapped
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            check_env(env, skip_render_check=True)


def test_every_packaged_scenario_is_played_or_at_rest() -> None:
    own = {name for name in names() if name.startswith("rate_table/")}
    assert own == {*PLAYED, "rate_table/b215_static", "rate_table/kvh13_static", "rate_table/student"}
    assert load("rate_table/kvh13_static").duration == 27 * 3600
    for name in own - set(PLAYED):
        with pytest.raises(InputError, match=r"\[task\] is missing"):
            rate_table(name)


def test_observation_is_what_is_documented_and_nothing_else() -> None:
    plain = {"gyro", "encoder", "temperature", "power_ups", "time_left"}
    task = rate_table()
    assert set(task.observation_space.spaces) == plain
    assert task.samples == 2000 and task.observation_space["gyro"].shape == (2000,)
    assert set(rate_table(estimator=SURE).observation_space.spaces) == plain | {"belief"}
    for space in task.observation_space.values():
        assert np.isfinite(space.low).all() and np.isfinite(space.high).all()  # type: ignore[attr-defined]
    np.testing.assert_allclose(task.action_space.high, [50 * DEG, 1.0])
    np.testing.assert_allclose(task.action_space.low, [-50 * DEG, -1.0])


def test_gyro_and_encoder_add_up_to_what_the_table_turned() -> None:
    env = made({"instrument.gyro.noise": {}})
    env.reset(seed=1)
    blocks = [env.step(act(20.0))[0] for _ in range(5)]
    turned = sum(b["encoder"].sum() for b in blocks)
    # 5 s at 20 deg/s less the 0.4 s of acceleration at 50 deg/s^2, which count half.
    assert turned == pytest.approx(96 * DEG, abs=0.36 * ARCSEC)
    measured = sum(b["gyro"].sum() for b in blocks)
    # Half a per cent at most by the anomaly and 200 ppm, 5 s of 20 deg/h.
    assert measured == pytest.approx(turned, abs=5e-3 * turned)
    assert measured != turned
    for block in blocks:
        assert env.observation_space["gyro"].contains(block["gyro"])


def test_whole_pulses_are_counted_where_the_scenario_says_so() -> None:
    pulses = {"instrument.gyro.unit": "0.5 arcsec", "instrument.gyro.pulses": True}
    env = made(pulses)
    env.reset(seed=1)
    gyro = np.concatenate([env.step(act(1.0))[0]["gyro"] for _ in range(3)]) / (0.5 * ARCSEC)
    np.testing.assert_allclose(gyro, np.rint(gyro), atol=1e-9)
    np.testing.assert_allclose(env.chunk.channels["gyro"].values[0], gyro[-100:] * 0.5 * ARCSEC * 100)


def test_ends_and_rewards() -> None:
    env = made({"task.cost": 0.25})
    env.reset(seed=1)
    steps = [env.step(act(5.0, -1.0 if k == 2 else 0.0)) for k in range(8)]
    assert [s[2:4] for s in steps] == [(False, False)] * 7 + [(False, True)]
    assert [s[1] for s in steps] == [-0.25] * 8
    env.reset(seed=1)
    env.step(act(5.0, -0.5))
    observation, reward, terminated, truncated, _ = env.step(act(5.0, 0.5))
    assert (reward, terminated, truncated) == (0.0, True, False)
    assert observation["time_left"] == 7.0 and observation["power_ups"] == 2.0 and not observation["gyro"].any()


def test_the_price_of_the_error_is_that_of_this_power_up() -> None:
    env = made(estimator=SURE)
    env.reset(seed=1)
    env.step(act(5.0))
    observation, reward, *_, info = env.step(act(5.0, 1.0))
    mean, sd = observation["belief"]
    error = mean - info["truth"]["scale_factor"]
    verdict = 0.5 - 0.5 * min((error / sd) ** 2, 100.0) - np.log1p((error / (10 * PPM)) ** 2)
    assert reward == pytest.approx(verdict)
    again = made(estimator=SURE)
    again.reset(seed=1)
    *_, first = again.step(act(5.0))
    *_, second = again.step(act(5.0, -1.0))
    assert first["truth"]["scale_factor"] != second["truth"]["scale_factor"]


@pytest.mark.parametrize(
    ("action", "sentence"),
    [
        ([np.nan, 0.0], r"action \[nan, 0\]; wanted numbers from \[-0.87.*, -1\] to \[0.87.*, 1\]"),
        ([1.0, 0.0], r"action \[1, 0\]"),
        ([0.1, -1.5], r"action \[0.1, -1.5\]"),
        ([0.1], r"an action of shape \(1,\); wanted \(2,\)"),
        (["a", "b"], "actions of type .*; wanted real numbers"),
    ],
)
def test_bad_actions_end_in_one_sentence(action: Any, sentence: str) -> None:
    env = made()
    env.reset(seed=1)
    with pytest.raises(InputError, match=sentence):
        env.step(action)
    assert env.step(act(1.0))[0]["time_left"] == 7.0


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"scenario": "rate_table/b251"}, "did you mean 'rate_table/b215'"),
        ({"scenario": "north_finder/published"}, "task.kind = 'north-finder'; wanted 'rate-table'"),
        ({"changes": {"table.tilt": "0 deg", "declared.earth_rate": {}}}, "the gyro does not see the table turn"),
        ({"changes": {"table.tilt": "80 deg"}}, "wanted earth_rate"),
        ({"changes": {"table.max_rate": "30 deg/s", "profile": {"kind": "rest"}, "duration": "9 s"}}, "task.range"),
        ({"changes": {"task.range": "0 deg/s"}}, "task.range = '0 deg/s'; wanted more than zero"),
        ({"changes": {"task.demanded": "1 deg"}}, "task.demanded"),
        ({"changes": {"task.kind": "scale-factor-test"}}, "task.range has no meaning"),
        ({"step_s": 7.0}, "divides the duration evenly"),
        ({"sampling": -1.0}, "instrument.sampling"),
        ({"sampling": 1234.5}, "slow_noise"),
        ({"sampling": np.inf}, "instrument.sampling"),
        ({"step_s": np.nan}, "task.step"),
        ({"changes": "abc"}, "changes = 'abc'; wanted a mapping"),
        ({"changes": {"task.stepp": "1 s"}}, "did you mean 'step'"),
        ({"changes": {"task.range": 35}}, "task.range = 35; wanted a text"),
        ({"changes": {"task.range": "35 m"}}, "wanted a rate"),
        ({"changes": {"task.range": "100 deg/s"}}, "task.range = '100 deg/s'; the table reaches 50 deg/s"),
        ({"scenario": "rate_table/b215_static"}, r"\[task\] is missing"),
        ({"estimator": "rate_lin"}, "did you mean 'rate_line'"),
        ({"estimator": 3}, "estimator of type int given; wanted its name"),
    ],
)
def test_impossible_scenarios_are_refused(settings: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence) as caught:
        rate_table(**settings)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "given", "sentence"),
    [
        ({}, {"policy": "no_such"}, "policy 'no_such' is not installed; wanted one of"),
        ({}, {"policy": 3}, "a policy of type int given to roll_out; wanted a name"),
        ({}, {"seeds": []}, "no seed given to roll_out"),
        ({}, {"every": 0}, "every = 0 given to roll_out"),
        ({"duration": "5 s"}, {"policy": "optimal_ladder"}, "rate ladder: 5 s given"),
        (
            {"table.max_rate": "20 deg/s", "task.range": "20 deg/s"},
            {"policy": "published_ladder"},
            "wanted at most 20 deg/s",
        ),
    ],
)
def test_impossible_roll_outs_are_refused(changes: dict[str, Any], given: dict[str, Any], sentence: str) -> None:
    asked: dict[str, Any] = {"policy": "van_der_corput", "seeds": [0], **given}
    with pytest.raises(InputError, match=sentence) as caught:
        roll_out(made(changes), asked.pop("policy"), **asked)
    assert "\n" not in str(caught.value)


# ------------------------------------------------------------------------------------------------- power cycles


def test_the_gyro_is_cold_again_and_the_table_goes_on() -> None:
    def temperatures(cycle: bool) -> tuple[Floats, Floats]:
        env = made({"temperature.time_constant": "3 s"})
        env.reset(seed=1)
        seen = [env.step(act(7.0, -1.0 if cycle and k == 4 else 0.0))[0] for k in range(8)]
        return np.array([s["temperature"][0] for s in seen]), np.concatenate([s["encoder"] for s in seen])

    (plain, encoder), (cycled, same) = temperatures(False), temperatures(True)
    np.testing.assert_array_equal(plain[:4], cycled[:4])
    np.testing.assert_allclose(plain[:4], cycled[4:], rtol=1e-12)
    # The reading's last digit may fall to either side.
    np.testing.assert_allclose(encoder, same, atol=0.37 * ARCSEC)


def test_a_chamber_goes_on_while_the_gyro_is_switched() -> None:
    ramp = {"temperature": {"kind": "ramp", "start": "20 degC", "end": "30 degC", "slope": "1 K/s"}}
    env = made(ramp)
    env.reset(seed=1)
    seen = [env.step(act(7.0, -1.0 if k == 4 else 0.0))[0]["temperature"][0] for k in range(8)]
    np.testing.assert_allclose(seen, 293.15 + np.arange(1.0, 9.0))
    stopped = env.reset(seed=1) and [env.step(act(7.0, s)) for s in (0.0, -1.0, 1.0)][-1][0]["temperature"]
    assert stopped == pytest.approx(293.15 + 2)


def test_what_is_drawn_anew_at_a_power_up_and_what_is_not() -> None:
    env = made()
    _, info = env.reset(seed=4)
    numbers, biases = [], [info["truth"]["gyro.bias.c"]]
    for k in range(6):
        observation, *_, info = env.step(act(3.0, -1.0 if k in (1, 3) else 0.0))
        numbers.append(float(observation["power_ups"][0]))
        biases.append(info["truth"]["gyro.bias.c"])
    assert numbers == [1, 2, 2, 3, 3, 3] and len(set(biases)) == 3
    scenario = load("rate_table/b215", SHORT)
    theta = scenario.cast(4, 3).instruments[0].theta
    place = scenario.rig.instruments[0].sensor.names.index("bias.c")
    assert biases[-1] == theta[place]
    assert np.ptp(biases) < 6 * 0.35 * DEG_PER_HOUR


def test_the_run_s_clock_and_the_number_of_the_power_up_are_recorded() -> None:
    env = Recorder(made())
    env.reset(seed=1)
    for k in range(6):
        env.step(act(3.0, -1.0 if k in (2, 4) else 0.0))
    recording = env.recording()
    np.testing.assert_allclose(recording.t, np.arange(1, 601) / 100)
    assert np.array_equal(recording.values("power", "1"), np.repeat([1.0, 1, 2, 2, 3, 3], 100))
    assert np.all(np.diff(recording.values("table_angle", "rad")[100:]) > 0)


@pytest.mark.parametrize("step", [0.5, 2.0, 4.0])
def test_how_a_run_is_cut_into_steps_makes_no_difference(step: float) -> None:
    changes = SHORT | {"instrument.slow_noise": "10 Hz"}

    def whole(step_s: float) -> Floats:
        env = gymnasium.make(ID, changes=changes, step_s=step_s, disable_env_checker=True).unwrapped
        env.reset(seed=3)
        acts = [act(9.0, -1.0 if k * step_s == 4 else 0.0) for k in range(round(8 / step_s))]
        return np.concatenate([env.step(a)[0]["gyro"] for a in acts])

    np.testing.assert_allclose(whole(1.0), whole(step), rtol=1e-9, atol=1e-14)


# ---------------------------------------------------------------------------------------------- the vector form


def pair(mode: AutoresetMode = AutoresetMode.NEXT_STEP, **settings: Any) -> tuple[Any, Any]:
    return native_and_sync(RateTableVectorEnv, ID, mode, **{"changes": SHORT} | settings)


def plan(steps: int) -> list[Floats]:
    """Rates that differ, power cycles of some rows and of all, twice in a row and right after a reset, stops."""
    rng = np.random.default_rng(0)
    found = []
    for k in range(steps):
        actions = np.zeros((ROWS, 2))
        actions[:, 0] = rng.uniform(-0.8, 0.8, ROWS)
        actions[:, 1] = [
            {2: -1.0, 3: -0.5, 11: 1.0}.get(k, 0.0),
            {0: -1.0, 3: -0.7, 5: 0.9}.get(k, -0.4),
            {3: -1.0, 9: -1.0, 10: -1.0}.get(k, 0.4),
            {3: -0.6, 13: -1.0, 14: 1.0}.get(k, 0.0),
        ]
        found.append(actions)
    return found


@pytest.mark.parametrize("scenario", PLAYED)
@pytest.mark.parametrize("estimator", [None, SURE])
def test_native_is_sync_bit_for_bit_with_power_cycles_and_stops(scenario: str, estimator: str | None) -> None:
    native, sync = pair(scenario=scenario, estimator=estimator)
    assert native.observation_space == sync.observation_space and native.action_space == sync.action_space
    assert_same(native.reset(seed=5), sync.reset(seed=5))
    for actions in plan(20):
        assert_same(native.step(actions), sync.step(actions))
    assert_same(native.reset(), sync.reset())
    assert_same(native.step(plan(1)[0]), sync.step(plan(1)[0]))


def test_without_autoreset_it_is_as_sync_too_and_at_the_full_sampling_rate() -> None:
    native, sync = pair(AutoresetMode.DISABLED, changes={"duration": "4 s", "profile": {"kind": "rest"}})
    assert_same(native.reset(seed=5), sync.reset(seed=5))
    for actions in plan(9):
        one, other = native.step(actions), sync.step(actions)
        assert_same(one, other)
        if (ended := one[2] | one[3]).any():
            assert_same(native.reset(options={"reset_mask": ended}), sync.reset(options={"reset_mask": ended}))


def test_rows_that_are_switched_together_stay_together() -> None:
    native, _ = pair()
    native.reset(seed=1)
    actions = np.zeros((ROWS, 2))
    native.step(actions)
    actions[:, 1] = -1.0
    native.step(actions)
    assert len(native.unwrapped._batch._places) == 1
    actions[1:, 1] = 0.0
    native.step(actions)
    assert sorted(len(place.index) for place in native.unwrapped._batch._places) == [1, ROWS - 1]


class Switches:
    """A policy that switches row i off and on at step i + 1, and notes what it is given."""

    def __init__(self, datasheet: Any) -> None:
        del datasheet

    def reset(self, batch: int | None = None) -> Floats:
        return np.stack([np.arange(batch or 1) + 1.0, np.zeros(batch or 1)], axis=-1)

    def act(self, state: Floats, chunk: Any, estimate: Any) -> tuple[Floats, Floats]:
        if chunk is not None:
            assert chunk.values("gyro", "rad/s").shape == (len(state), 100)
            state = np.stack([state[:, 0], state[:, 1] + chunk.values("power", "1")[:, -1]], axis=-1)
        action = np.stack([np.full(len(state), 0.1), -(state[:, 0] == 0).astype(float)], axis=-1)
        action[:, 1] += state[:, 0] < -3
        return action, state - np.array([1.0, 0.0])


def test_a_roll_out_gives_policies_all_rows_whatever_was_switched_when() -> None:
    task = rate_table(changes=SHORT)
    rolled = roll_out(task, "test_env_rate_table:Switches", SURE, seeds=(3, 4, 5))
    assert rolled.time.tolist() == [5.0, 6.0, 7.0]
    for row, seed in enumerate((3, 4, 5)):
        power = rolled.recording(row).values("power", "1")[::100]
        assert np.array_equal(power, 1.0 + (np.arange(len(power)) > row))
        env = made(estimator=SURE)
        env.reset(seed=seed)
        for k in range(len(power)):
            observation, *_ = env.step(np.array([0.1, -1.0 if k == row + 1 else 0.0]))
        assert rolled.means[row, len(power), 0] == observation["belief"][0]
        assert rolled.estimate is not None and rolled.estimate.mean[row, 0] == observation["belief"][0]
        # The error that is told is that of the gyro as it was in the end.
        *_, info = env.step(np.array([0.1, 1.0]))
        assert rolled.errors[row, 0] == observation["belief"][0] - info["truth"]["scale_factor"]


# ---------------------------------------------------------------------------------------------------- the truth


def test_the_scale_factor_is_the_slope_of_the_line_without_local_faults() -> None:
    for name in PLAYED[:2]:
        truth = made(scenario=name).reset(seed=7)[1]["truth"]
        assert truth["scale_factor"] == pytest.approx(truth["gyro.scale_factor.c"], abs=1e-12)
    truth = made(scenario="rate_table/kvh13").reset(seed=7)[1]["truth"]
    rate = np.linspace(-35, 35, 7001) * DEG
    left = 0.001 * (np.sin(0.253 * rate) / 0.253 - rate)
    ripple = 0.09 * DEG * np.sin(15 * np.arcsin(rate / (375 * DEG)))
    slope = np.polyfit(rate, left + ripple, 1)[0]
    assert truth["scale_factor"] - truth["gyro.scale_factor.c"] == pytest.approx(slope, rel=2e-3)


class ScaleFactorFifth(LinearEffect):
    """An effect of another package: c u^5 / U^4."""

    id = "scale_factor_fifth"
    linear = (Param("c", "1", sd=1e-3),)
    of_rate = True

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Shape (..., n, 1)."""
        return (u**5 / np.max(np.abs(u)) ** 4)[..., None]


def test_an_effect_of_another_package_is_part_of_the_true_scale_factor() -> None:
    """A line through the origin has the slope c (integral u^6 / integral u^2) / U^4 of c u^5 / U^4, u from -U to U."""
    env = made(scenario=PLAYED[0])
    env.reset(seed=7)
    found = line_slope(Fitted(Sensor("gyro", (ScaleFactorFifth(),)), np.array([2e-3])), env.group.rig.plant, 1.0)
    assert found == pytest.approx(2e-3 * 3 / 7, rel=1e-2)


def test_a_cold_gyro_and_a_narrow_range_are_told_of_as_they_are() -> None:
    cold = {"temperature": {"kind": "constant", "value": "25 degC"}, "task.range": "10 deg/s"}
    truth = made(cold).reset(seed=7)[1]["truth"]
    assert truth["scale_factor"] - truth["gyro.scale_factor.c"] == pytest.approx(-2.5 * PPM, abs=1e-12)


def test_an_undeclared_value_shows_in_what_is_measured_alone() -> None:
    def first(value: str) -> Any:
        env = made({"undeclared": {"scale_factor_asymmetry": {"c": value}}})
        env.reset(seed=4)
        return env, *env.step(act(10.0))

    (env, one, *_), (other_env, other, *_) = first("0 ppm"), first("12345.6 ppm")
    assert [key for key in one if np.any(one[key] != other[key])] == ["gyro"]
    assert env.observation_space == other_env.observation_space
    assert env.task.datasheet == other_env.task.datasheet


# ---------------------------------------------------------------------------------------------------- pictures


def test_gymnasium_accepts_the_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make(ID, changes=SHORT, estimator=SURE, disable_env_checker=True).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env)


def test_spec_and_environment_survive_json_and_pickle() -> None:
    assert_survives(gymnasium.make(ID, changes=SHORT, estimator=SURE), act(4.0, -1.0), act(5.0, -1.0))


@pytest.mark.parametrize("estimator", [None, SURE])
def test_frames_show_the_run(estimator: str | None) -> None:
    env = RateTableEnv(changes=SHORT, estimator=estimator, render_mode="rgb_array")
    frames = []
    env.reset(seed=1)
    frames.append(env.render())
    for k in range(8):
        env.step(act((10.0, 10.0, 20.0, 20.0, -5.0, -5.0, -20.0, -20.0)[k], -1.0 if k == 1 else 0.0))
        frames.append(env.render())
    for before, after in zip(frames, frames[1:], strict=False):
        assert after.shape == (600, 960, 3) and after.dtype == np.uint8 and np.any(before != after)
    again = RateTableEnv(changes=SHORT, estimator=estimator, render_mode="rgb_array")
    again.reset(seed=1)
    assert np.array_equal(again.render(), frames[0])


def test_the_line_in_the_picture_is_that_of_this_power_up() -> None:
    from insenv.systems.rate_table.frame import line

    changes = SHORT | {
        "duration": "60 s",
        "instrument.gyro.noise": {},
        "temperature": {"kind": "constant", "value": "27.5 degC"},
    }
    env = RateTableEnv(changes=changes, render_mode="rgb_array")
    env.reset(seed=1)
    rates = (-35.0, -20.0, -10.0, 10.0, 20.0, 35.0)
    for k in range(48):
        env.step(act(rates[k // 8], 0.0))
    view = env._film._view  # type: ignore[union-attr]
    found = line(view)
    assert found is not None
    np.testing.assert_allclose(found.rate / DEG, rates, atol=1e-3)
    inner = np.interp(found.rate, view.true_rates, found.curve)
    np.testing.assert_allclose(found.residual, inner, atol=5 * PPM)
    assert np.abs(found.residual).max() > 500 * PPM
    env.step(act(35.0, -1.0))
    assert line(env._film._view) is None  # type: ignore[union-attr]
