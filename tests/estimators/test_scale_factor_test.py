"""The scale-factor test of the published gyro: as a policy in the environment, on line, and on a measured recording."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest

import insenv  # noqa: F401 - registers the environment
from estimators.rate_table.scale_factor import repeatability, scale_factor_of
from estimators.rate_table.scale_factor_line import ScaleFactorOnLine, arcsec_per_pulse, drifted
from estimators.rate_table.scale_factor_test import PUBLISHED_RATES, ScaleFactorTest
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate, Limits
from insenv.core.plugins import ESTIMATORS, POLICIES, find
from insenv.core.recording import Channel, Floats, Mounting, Recording, Segment
from insenv.core.rows import row_of
from insenv.core.units import ARCSEC, DEG, PPM
from insenv.effects.noise import BiasInstability, RateRandomWalk
from insenv.envs.rollout import RollOut, roll_out
from insenv.envs.task import Task
from insenv.systems.north_finder.env import north_finder

NAME = "north_finder/scale_factor_test"
PULSE = 0.46634601 * ARCSEC
WALK = {"angle_random_walk": "3e-4 deg/sqrt(h)"}
#: Mirrors that are dithered, and warm: no lock-in and no warm-up.
STEADY = {"declared": {"bias": {"c": "+- 1 deg/h"}, "scale_factor": {"c": "+- 10 ppm"}}, "duration": "300 s"}
EXACT = STEADY | {"instrument.gyro.pulses": False, "instrument.gyro.noise": {}, "table.encoder": {}}
FAST = tuple(np.radians([30.0, 60.0, 100.0]))

few = partial(ScaleFactorOnLine, tests=3)


def played(task: Task, seeds: Any = (3,), rates: Any = FAST, turns: int = 2, **settings: Any) -> RollOut:
    """Two turns each way at three rates."""
    policy = ScaleFactorTest(task.datasheet, rates, turns)
    return roll_out(task, policy, "test_scale_factor_test:few", seeds, every=10_000, **settings)


def told(rolled: RollOut) -> Estimate:
    assert rolled.estimate is not None
    return rolled.estimate


def test_the_plug_ins_are_found_by_their_names() -> None:
    assert find(ESTIMATORS, "scale_factor") is ScaleFactorOnLine
    assert find(POLICIES, "scale_factor_test") is ScaleFactorTest


# --- the policy


def test_the_published_rates_are_the_default() -> None:
    policy = ScaleFactorTest(Datasheet(100.0, 300.0))
    np.testing.assert_allclose(policy.commands[:-1:2] / DEG, (10, 10, 20, 20, 30, 30, 60, 100))
    np.testing.assert_allclose(policy.commands[1::2], -policy.commands[:-1:2])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"rates": ()}, "rates .* wanted some"),
        ({"rates": (0.1, 0.0)}, "wanted some, not 0"),
        ({"rates": (2.0,)}, "table rate of 114.592 deg/s given"),
        ({"turns": 0}, "0 turns given"),
    ],
)
def test_a_test_that_cannot_be_is_refused(settings: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        ScaleFactorTest(Datasheet(100.0, 300.0, limits=Limits(1.0)), **settings)


def test_the_table_turns_as_often_as_asked_each_way_and_then_the_run_is_over() -> None:
    rolled = played(north_finder(NAME, STEADY), seeds=(3, 4))
    assert rolled.stopped.all()
    # Whole steps of 1 s: 2 turns take 24, 12 and 7.2 s, and the table 20 deg/s^2 to change its rate.
    assert rolled.time[0] < 2 * sum(720 / rate + rate / 10 + 1 for rate in (30, 60, 100))
    angle = rolled.recording(1).values("table_angle", "rad")
    turned = np.abs(np.diff(angle[_ends(angle)])) / (2 * np.pi)
    assert len(turned) == 6 and turned.min() > 2.0
    # At most what it takes to get there and to come to rest, and a step.
    assert turned.max() < 2.0 + (100 + 2 * 100**2 / 40) / 360


def _ends(angle: Floats) -> Any:
    """Where the table turns over."""
    way = np.sign(np.diff(angle))
    return np.concatenate([[0], np.flatnonzero(np.diff(way[way != 0])) + 1, [len(angle) - 1]])


# --- values


def test_without_noise_the_scale_factor_is_exact_whatever_the_bias_and_the_earth_do() -> None:
    rolled = played(north_finder(NAME, EXACT), seeds=(3, 4, 5))
    estimate = told(rolled)
    true = rolled.truth["gyro.scale_factor.c"]
    assert np.ptp(true) > 1 * PPM and np.abs(rolled.truth["gyro.bias.c"]).max() > 1e-6
    np.testing.assert_allclose(estimate.of("scale_factor")[0], true, atol=1e-12)
    for k in (1, 2, 3):
        np.testing.assert_allclose(estimate.of(f"test_{k}")[0], true, atol=1e-12)
    assert estimate.of("repeatability")[0].max() < 1e-12


def test_over_whole_turns_the_horizontal_earth_rate_cancels() -> None:
    tilted = EXACT | {"table.tilt": "30 deg", "declared.earth_rate": {}, "table.max_acceleration": "2000 deg/s^2"}
    rolled = played(north_finder(NAME, tilted))
    # 10 arcsec/s of it; while the table gets to its rate, 0.05 s, it does not.
    np.testing.assert_allclose(told(rolled).of("scale_factor")[0], rolled.truth["gyro.scale_factor.c"], atol=2e-8)


def test_weight_of_a_pulse_in_arcsec() -> None:
    assert arcsec_per_pulse(7 * PPM, PULSE) == pytest.approx(0.46634601 * (1 - 7e-6), abs=1e-10)


def test_in_a_loop_of_steps_and_in_a_roll_out_it_is_the_same() -> None:
    task = north_finder(NAME, STEADY)
    rolled = played(task)
    env: Any = gymnasium.make("insenv/NorthFinder-v0", scenario=NAME, changes=STEADY, disable_env_checker=True)
    env.reset(seed=3)
    policy, estimator = ScaleFactorTest(task.datasheet, FAST, 2), few(task.datasheet)
    state, known, chunk, over = policy.reset(), estimator.reset(), None, False
    while not over:
        action, state = policy.act(state, chunk)
        _, _, terminated, truncated, _ = env.step(action)
        if env.unwrapped.chunk is not None:
            chunk = row_of(env.unwrapped.chunk, 0)
            known = estimator.update(known, chunk)
        over = terminated or truncated
    assert terminated
    np.testing.assert_array_equal(estimator.estimate(known).mean, told(rolled).mean[0])
    np.testing.assert_array_equal(estimator.estimate(known).cov, told(rolled).cov[0])


def test_cut_into_chunks_or_whole_the_estimate_is_the_same() -> None:
    rolled = played(north_finder(NAME, STEADY), seeds=(3, 4))
    whole = few(north_finder(NAME, STEADY).datasheet)
    estimate = whole.estimate(whole.update(whole.reset(), rolled.recording(1)))
    np.testing.assert_allclose(estimate.mean, told(rolled).mean[1], rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(estimate.cov, told(rolled).cov[1], rtol=1e-9, atol=1e-25)


def test_a_test_is_told_when_the_table_has_turned_both_ways_and_not_before() -> None:
    estimator, state = few(Datasheet(100.0, 300.0)), few(Datasheet(100.0, 300.0)).reset()
    angle = np.concatenate([np.arange(1, 1601), np.arange(1599, -1000, -1)]) * 0.01 * 90 * DEG
    known = []
    for start in range(0, len(angle), 100):
        rows = slice(start, start + 100)
        state = estimator.update(state, turning(angle)(rows))
        known.append(float(estimator.estimate(state).of("test_1")[1]) < 1e-3)
    # Four turns in 16 s, of which the first row hides a part, so three whole ones; then two back, in 8 s.
    assert known == 23 * [False] + 19 * [True]


def turning(angle: Floats) -> Any:
    """Chunks of an exact gyro on a table with these angles."""
    rate = np.diff(angle, prepend=0.0) / 0.01

    def chunk(rows: slice) -> Recording:
        channels = {"gyro": Channel(rate[rows], "rad/s", "interval"), "table_angle": Channel(angle[rows], "rad")}
        return Recording(0.01 * np.arange(1.0, len(angle) + 1)[rows], channels)

    return chunk


def test_before_any_turn_nothing_is_known() -> None:
    estimator = ScaleFactorOnLine(Datasheet(100.0, 300.0))
    estimate = estimator.estimate(estimator.reset(2))
    assert estimate.mean.shape == (2, 10) and not estimate.mean.any()
    assert (estimate.sd > 1e-3).all()


def test_of_an_axis_in_the_table_plane_there_is_no_such_test() -> None:
    with pytest.raises(InputError, match="lies in the table plane"):
        ScaleFactorOnLine(Datasheet(100.0, 300.0, mounting=Mounting(0.0)))
    with pytest.raises(InputError, match="1 tests given"):
        ScaleFactorOnLine(Datasheet(100.0, 300.0), tests=1)


def test_on_a_measured_recording_with_segments_it_says_what_the_dwells_say() -> None:
    task = north_finder(NAME, STEADY)
    recording = replace(played(task).recording(0), mounting=Mounting(np.pi / 2))
    angle = recording.values("table_angle", "rad")
    rate = np.gradient(angle, recording.dt)
    steady = np.abs(np.abs(rate) - np.round(np.abs(rate) / (10 * DEG)) * 10 * DEG) < 0.05 * DEG
    steady &= np.abs(rate) > 25 * DEG
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], steady, [False]]).astype(int)))
    segments = tuple(
        Segment(f"dwell {k}", int(a), int(b))
        for k, (a, b) in enumerate(zip(bounds[::2], bounds[1::2], strict=True))
        if b - a > 500
    )
    assert len(segments) == 6
    weights = scale_factor_of(recording, segments, PULSE)
    estimator = few(task.datasheet)
    estimate = estimator.estimate(estimator.update(estimator.reset(), replace(recording, segments=segments)))
    values = np.array([float(estimate.of(f"test_{k}")[0]) for k in (1, 2, 3)])
    # The dwells' own count starts at the same rows; the bias is averaged, here it is solved for.
    np.testing.assert_allclose(arcsec_per_pulse(values, PULSE) * ARCSEC / weights, 1.0, atol=2e-8)
    assert estimate.of("repeatability")[0] == pytest.approx(repeatability(weights)[1], rel=1e-6, abs=2e-8)
    # Nothing outside the segments counts.
    spoilt = replace(recording.channel("gyro"), values=np.where(steady, recording.values("gyro", "rad/s"), 1.0))
    again = replace(recording, channels={**recording.channels, "gyro": spoilt}, segments=segments)
    np.testing.assert_array_equal(estimator.estimate(estimator.update(estimator.reset(), again)).mean, estimate.mean)


# --- covariance

NOISE: dict[str, dict[str, Any]] = {
    "as published": {},
    "random walk": {"instrument.gyro.noise": {"angle_random_walk": "3e-3 deg/sqrt(h)"}},
    "encoder": {"table.encoder.noise": "2 arcsec"},
    "pulses": {"instrument.gyro.noise": {}, "table.encoder": {}, "instrument.gyro.unit": "20 arcsec"},
    "rate random walk": {"instrument.gyro.noise": {**WALK, "rate_random_walk": "10 deg/h/sqrt(h)"}},
    "bias instability": {"instrument.gyro.noise": {**WALK, "bias_instability": "1 deg/h"}},
}


# z-scores of 200 runs of three tests each: their standard deviation has the spread 1 / sqrt(1200) = 0.029, so that 0.15
# is exceeded with the probability 2e-7; that of the mean 1 / sqrt(400) = 0.05: 3e-3, hence 0.2 there: 6e-5.
@pytest.mark.slow
@pytest.mark.parametrize("name", NOISE)
def test_the_covariance_is_honest(name: str) -> None:
    quick = {"instrument.sampling": "20 Hz", "task.step": "5 s", "instrument.gyro.noise": WALK}
    task = north_finder(NAME, STEADY | quick | NOISE[name])
    rolled = played(task, seeds=range(200), turns=1, keep=False)
    estimate, true = told(rolled), rolled.truth["gyro.scale_factor.c"]
    z = np.stack([(m - true) / sd for m, sd in (estimate.of(f"test_{k}") for k in (1, 2, 3))])
    assert z.std() == pytest.approx(1.0, abs=0.15)
    mean, sd = estimate.of("scale_factor")
    assert ((mean - true) / sd).std() == pytest.approx(1.0, abs=0.2)
    # The repeatability is that of the noise alone: with n - 1 its square is right in the mean. Of 200 mean squares of
    # two degrees of freedom each the relative spread is at most 0.07 sqrt(3): 0.5 is exceeded with 4e-5.
    variance = np.mean([estimate.of(f"test_{k}")[1] ** 2 for k in (1, 2, 3)])
    assert np.mean(estimate.of("repeatability")[0] ** 2) == pytest.approx(variance, rel=0.5)


def test_of_dwells_that_touch_the_bias_drifts_by_twice_its_allan_variance() -> None:
    noise = {"rate_random_walk": 2e-9, "bias_instability": 3e-8}
    sheet = Datasheet(100.0, 300.0, noise={"gyro": noise})
    time = np.array([1.0, 50.0])
    allan = RateRandomWalk().allan(np.array([2e-9]), time) ** 2 + BiasInstability().allan(np.array([3e-8]), time) ** 2
    np.testing.assert_allclose(drifted(sheet, 7.0 * time, 8 * time, 8 * time, 9 * time), 2 * allan, rtol=1e-9)


# --- the published test


def predicted(seconds: Floats, rate: float, lock_in: bool = True) -> float:
    """Scale-factor error that the scenario predicts over times [s] at a rate [rad/s], beside its constant."""
    settled = np.exp(-seconds / 850.0)
    threshold = 0.05 * DEG * (1 + 0.20293763 * (1 - settled)) if lock_in else 0.0
    return float(np.mean(-5.0734409e-6 * settled - 0.5 * (threshold / rate) ** 2))


def whole_test(changes: dict[str, Any], lock_in: bool) -> tuple[RollOut, Floats, Floats]:
    """The published test of seed 3, what is predicted for each of its tests, and the time of each [s]."""
    # In steps of five seconds each of 18 dwells is longer by five at most, and what is predicted is of its own end.
    quick = {"duration": "5840 s", "task.step": "5 s"}
    rolled = roll_out(north_finder(NAME, quick | changes), "scale_factor_test", "scale_factor", (3,), every=10_000)
    assert rolled.stopped.all()
    recording = rolled.recording(0)
    angle = recording.values("table_angle", "rad")[::100]
    ends = _ends(angle)[::2] * 1.0
    assert len(ends) == 9
    wanted = [predicted(np.arange(a, b), w, lock_in) for a, b, w in zip(ends, ends[1:], PUBLISHED_RATES, strict=False)]
    return rolled, np.array(wanted) + rolled.truth["gyro.scale_factor.c"], ends[1:]


# Each of eight tests, and of mean and repeatability, is within 4 standard deviations: false alarm 10 x 6e-5 = 6e-4.
@pytest.mark.slow
def test_the_published_test_shows_what_lock_in_and_warm_up_predict() -> None:
    rolled, wanted, until = whole_test({}, lock_in=True)
    estimate = told(rolled)
    values = estimate.mean[0, 2:]
    # The threshold wanders by 1 % in 300 s: at most by that of the end of a test, and what a lock-in adds by twice it.
    # 1e-7: the table is slower while it turns over.
    wander = 2 * 0.01 * np.sqrt(until / 300.0) * 0.5 * (0.06 * DEG / np.array(PUBLISHED_RATES)) ** 2
    sd = np.hypot(wander, estimate.sd[0, 2:])
    assert (np.abs(values - wanted) < 4 * sd + 1e-7).all()
    assert abs(estimate.mean[0, 0] - wanted.mean()) < 4 * sd.mean() + 1e-7
    spread = estimate.mean[0, 1]
    assert abs(spread - repeatability(1 / (1 + wanted))[1]) < 4 * np.sqrt((sd**2).sum() / 7) + 1e-7
    # The paper's figure, 7.0e-6, is of this size.
    assert 5e-6 < spread < 1e-5
    weight = arcsec_per_pulse(estimate.mean[0, 0], PULSE)
    assert weight == pytest.approx(0.46634601 / (1 + wanted.mean()), abs=2e-6)


@pytest.mark.slow
def test_dithered_it_repeats_much_better() -> None:
    scenario = {
        "bias": {"c": "+- 0.005 deg/h"},
        "scale_factor": {"c": "+- 10 ppm"},
        "scale_factor_warm_up": {"c": "-5.0734409 ppm", "tau": "850 s"},
    }
    rolled, wanted, _ = whole_test({"declared": scenario}, lock_in=False)
    estimate = told(rolled)
    # What is left is the warm-up; 4 standard deviations, 1e-8 of rounding the times: false alarm 8 x 6e-5.
    assert (np.abs(estimate.mean[0, 2:] - wanted) < 4 * estimate.sd[0, 2:] + 1e-8).all()
    assert estimate.mean[0, 1] == pytest.approx(repeatability(1 / (1 + wanted))[1], abs=1e-7)
    assert estimate.mean[0, 1] < 1.2e-6
