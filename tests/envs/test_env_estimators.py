"""Estimators in the environment: belief, reward, and what is said of one that fails."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from env_cases import ID, RATE, SHORT, Sure, made

from insenv.core.errors import InputError
from insenv.core.estimate import Estimate
from insenv.core.recording import Floats
from insenv.envs.belief import Judge, SoughtQuantity
from insenv.envs.single import TaskEnv
from insenv.systems.north_finder.env import ANY_AZIMUTH, north_finder

TURN, STOP, REST = np.array([RATE, 0.0]), np.array([0.0, 1.0]), np.array([0.0, 0.0])
NORTH = ("correlation", "revolution", "north_gls")


def wrapped(angle: float) -> float:
    return float(np.angle(np.exp(1j * angle)))


def test_reward_is_information_less_the_cost_of_time() -> None:
    env = made("env_cases:Sure", **{"task.cost": 0.25})
    observation, _ = env.reset(seed=1)
    np.testing.assert_allclose(observation["belief"], [0.0, ANY_AZIMUTH])
    after, reward, *_ = env.step(TURN)
    assert after["belief"][1] == pytest.approx(ANY_AZIMUTH / np.sqrt(101))
    assert reward == pytest.approx(0.5 * np.log(101) - 0.25)


@pytest.mark.parametrize("early", [False, True])
def test_the_truth_is_told_by_the_last_reward_alone(early: bool) -> None:
    env = made("env_cases:Sure", **{"task.demanded": "20 deg"})
    env.reset(seed=1)
    for _ in range(5):
        observation, reward, *_ = env.step(TURN)
        assert float(reward) > -1.0
    sd = observation["belief"][1]
    observation, reward, terminated, truncated, info = env.step(STOP if early else TURN)
    assert (terminated, truncated) == (early, not early)
    error = wrapped(observation["belief"][0] - info["truth"]["azimuth"])
    gain = 0.0 if early else np.log(sd / observation["belief"][1]) - 1e-3
    z2 = (error / observation["belief"][1]) ** 2
    assert reward == pytest.approx(gain + 0.5 - 0.5 * min(z2, 100.0) - np.log1p((error / np.radians(20)) ** 2))


class Boasts(Sure):
    """Says before any data that it knows all."""

    def estimate(self, state: Any) -> Estimate:
        known = super().estimate(state)
        share = np.where(state.samples > 0, 1.0, 1e-9)[..., None]
        return Estimate(known.names, known.units, known.mean, known.cov * share[..., None] ** 2)


@pytest.mark.parametrize("estimator", ["env_cases:Sure", "test_env_estimators:Boasts"])
@pytest.mark.parametrize("steps", [0, 2, 6])
def test_a_run_earns_the_score_of_its_last_belief_less_the_cost_of_its_time(estimator: str, steps: int) -> None:
    env = made(estimator, **{"task.demanded": "20 deg", "task.cost": 0.25})
    assert isinstance(env, TaskEnv) and env.task.judge is not None
    env.reset(seed=1)
    total = sum(float(env.step(TURN)[1]) for _ in range(steps))
    if steps < 6:
        total += float(env.step(STOP)[1])
    judge, group = env.task.judge, env.group
    score = judge.information(group.deviations) + judge.verdict(group.means, group.deviations, group.truth)
    assert total == pytest.approx(float(score[0]) - 0.25 * steps)
    # Bounded: an honest prior earns nothing in the mean, the worst lie no less than this.
    assert score[0] >= 0.5 - 50.0 - np.log1p(81.0)


def expected(shift: Floats, factor: Floats, demanded: float) -> Floats:
    """Mean score of a belief that is ``shift`` deviations off and has ``factor`` times the true deviation 1e-3."""
    quantity = SoughtQuantity("bias", 1.0, 1.0, 1e-3 * demanded)
    judge = Judge("stated", None, (quantity,))  # type: ignore[arg-type]
    # The true value is normal; its quantiles, with weight in the tails, integrate what the score makes of it.
    x = np.linspace(-12.0, 12.0, 240_001)
    weight = np.exp(-0.5 * x**2) / np.sum(np.exp(-0.5 * x**2))
    found = np.empty(np.broadcast(shift, factor).shape)
    for at, (b, f) in enumerate(np.broadcast(shift, factor)):
        mean, sd = np.full((len(x), 1), 1e-3 * b), np.full((len(x), 1), 1e-3 * f)
        score = judge.information(sd) + judge.verdict(mean, sd, {"bias": 1e-3 * x})
        found.flat[at] = np.sum(weight * score)
    return found


@pytest.mark.parametrize("demanded", [0.1, 1.0, 100.0])
def test_no_statement_pays_better_than_the_honest_one(demanded: float) -> None:
    """A proper score: the limit on z^2 costs less than the digits of this sum."""
    factors = np.concatenate([np.logspace(-9, 3, 61), 1.0 + np.array([-0.1, -0.03, -0.01, 0.01, 0.03, 0.1])])
    honest = expected(np.zeros(1), np.ones(1), demanded)[0]
    other = expected(np.zeros(len(factors)), factors, demanded)
    assert np.all(other[np.abs(factors - 1.0) > 1e-6] < honest)
    assert expected(np.zeros(1), np.array([1e-6]), demanded)[0] < honest - 30.0
    # Near the honest deviation the loss is that of the logarithmic score, (f - 1)^2.
    near = np.array([0.99, 1.01])
    np.testing.assert_allclose(honest - expected(np.zeros(2), near, demanded), (near - 1.0) ** 2, rtol=0.05)
    shifts = np.array([-3.0, -0.3, -0.03, 0.03, 0.3, 3.0])
    assert np.all(expected(shifts, np.ones(6), demanded) < honest)


def test_errors_are_wrapped_on_the_circle_alone() -> None:
    circle = SoughtQuantity("azimuth", ANY_AZIMUTH, np.pi, 1.0, circular=True)
    line = SoughtQuantity("bias", 1.0, 10.0, 1.0)
    mean, true = np.array([3.0, -3.0]), np.array([-3.0, 3.0])
    np.testing.assert_allclose(circle.error(mean, true), [6 - 2 * np.pi, 2 * np.pi - 6])
    np.testing.assert_allclose(line.error(mean, true), [6.0, -6.0])


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("Raises", r"estimator 'env_cases:Raises' failed in update: RuntimeError: out of order$"),
        ("SaysNaN", r"estimator 'env_cases:SaysNaN' returned mean nan and deviation .* of 'azimuth'; wanted a finite"),
        (
            "WrongShape",
            r"'env_cases:WrongShape' returned a mean of shape \(1,\) and .* wanted \(1, 1\) and \(1, 1, 1\)",
        ),
        ("KnowsNoNorth", r"'env_cases:KnowsNoNorth': 'azimuth' is not estimated; there are level; wanted 'azimuth'"),
        ("IsNotMade", r"estimator 'env_cases:IsNotMade' failed when it was made: KeyError: 'encoder'"),
        ("Absent", r"estimator 'env_cases:Absent' cannot be imported"),
    ],
)
def test_an_estimator_that_fails_is_named_in_one_sentence(name: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence) as caught:
        env = made(f"env_cases:{name}")
        env.reset(seed=1)
        env.step(TURN)
    assert "\n" not in str(caught.value)


def test_a_step_that_failed_is_not_gone_on_from() -> None:
    env = made("env_cases:Raises")
    envs = gymnasium.make_vec(ID, num_envs=3, estimator="env_cases:Raises", changes=SHORT)
    for reset, step in ((env.reset, lambda: env.step(TURN)), (envs.reset, lambda: envs.step(np.tile(TURN, (3, 1))))):
        for _ in range(2):
            reset(seed=1)
            with pytest.raises(InputError, match="failed in update"):
                step()
            with pytest.raises(gymnasium.error.ResetNeeded, match="call reset first"):
                step()


@pytest.mark.parametrize("estimator", NORTH)
@pytest.mark.parametrize("scenario", ["north_finder/published", "north_finder/realistic"])
def test_a_table_that_never_turns_leaves_the_prior(scenario: str, estimator: str) -> None:
    env = gymnasium.make(ID, scenario=scenario, estimator=estimator, step_s=10.0, disable_env_checker=True)
    env.reset(seed=3)
    truncated = False
    while not truncated:
        observation, reward, _, truncated, _ = env.step(REST)
        assert observation["belief"][1] == pytest.approx(ANY_AZIMUTH)
        assert truncated or reward == pytest.approx(-1e-3 * 10.0)


@pytest.mark.parametrize("estimator", NORTH)
def test_a_table_that_turns_finds_north(estimator: str) -> None:
    env = gymnasium.make(ID, estimator=estimator, step_s=10.0, disable_env_checker=True)
    env.reset(seed=3)
    for _ in range(30):
        observation, *_, info = env.step(TURN)
    mean, sd = observation["belief"]
    assert sd < np.radians(1)
    # Five standard deviations: false alarm below 1e-6.
    assert abs(wrapped(mean - info["truth"]["azimuth"])) < 5 * sd


def test_no_more_than_ignorance_and_no_less_than_nothing_is_shown() -> None:
    from insenv.core.estimate import Estimate

    judge = Judge("any", None, (SoughtQuantity("azimuth", ANY_AZIMUTH, np.pi, 1.0, circular=True),))  # type: ignore[arg-type]
    estimate = Estimate(("azimuth",), ("rad",), np.zeros((2, 1)), np.array([np.inf, 0.0])[:, None, None])
    _, deviations = judge.belief(estimate)
    assert deviations[0, 0] == ANY_AZIMUTH
    assert 0 < deviations[1, 0] < 1e-11


def test_a_task_without_north_has_no_belief() -> None:
    task: Any = north_finder("north_finder/scale_factor_test", estimator="north_gls")
    assert "belief" not in task.observation_space.spaces
