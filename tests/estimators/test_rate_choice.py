"""Policies by the clock, and the choice of rate, directions and tilt."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from north_cases import RATE, TILT, Case, play, wrapped

from estimators.common.rate_policies import Bidirectional, Clockwork, ConstantRate
from estimators.north_finder.gls import NorthGls
from estimators.north_finder.rate_choice import RateChoice, expected_sd, plan
from estimators.north_finder.revolution import Revolution
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Declared, Estimator, Limits, Policy
from insenv.core.plugins import POLICIES, find
from insenv.core.recording import Floats, Recording, Site
from insenv.core.units import ARCSEC, DEG
from insenv.scenario import datasheet, load

TILTS = tuple(tilt * DEG for tilt in (5, 10, 12, 15, 20, 30))


def at(t: float) -> Recording:
    return Recording(np.array([t]), {})


def rates(policy: Clockwork, times: range) -> list[float]:
    """Commands [deg/s] after so many seconds."""
    return [float(policy.act(policy.reset(), at(float(t)) if t else None)[0][0]) / DEG for t in times]


def realistic(tilt: float | None = None) -> Datasheet:
    return datasheet(load("north_finder/realistic", {} if tilt is None else {"table.tilt": f"{tilt} deg"}))


@pytest.mark.parametrize(
    ("name", "kind"), [("constant_rate", ConstantRate), ("bidirectional", Bidirectional), ("rate_choice", RateChoice)]
)
def test_they_are_found_by_name(name: str, kind: type) -> None:
    assert find(POLICIES, name) is kind


def test_one_rate_all_the_time() -> None:
    sheet = Case().datasheet()
    assert set(np.round(rates(ConstantRate(sheet), range(0, 300, 7)), 9)) == {10.0}
    assert rates(ConstantRate(sheet, -RATE), range(1)) == pytest.approx([-10.0])


def test_half_of_the_time_each_way() -> None:
    found = rates(Bidirectional(Case(acceleration=20 * DEG).datasheet()), range(300))
    assert found[:150] == pytest.approx(150 * [10.0]) and found[150:] == pytest.approx(150 * [-10.0])


def test_a_slow_table_turns_over_earlier_so_that_both_halves_are_steady_for_as_long() -> None:
    policy = Bidirectional(Case(acceleration=1 * DEG).datasheet())
    # 10 s to start, 20 s to turn over: 135 s steady each way.
    assert policy.course.at == pytest.approx((0.0, 145.0))


def test_they_stop_when_the_time_is_over_and_not_before() -> None:
    policy = Bidirectional(Case().datasheet())
    action, memory = policy.act(policy.reset(3), at(299.99), None)
    assert action.shape == (3, 2) and not action[:, 1].any() and memory == pytest.approx(299.99)
    action, _ = policy.act(memory, at(300.0 - 1e-9), None)
    assert action[:, 1].all()


def test_a_batch_is_the_single_run() -> None:
    policy = ConstantRate(Case().datasheet())
    one, _ = policy.act(policy.reset(), None, None)
    many, _ = policy.act(policy.reset(5), None, None)
    assert one.shape == (2,) and np.array_equal(many, np.tile(one, (5, 1)))


def test_a_rate_that_the_table_has_not_is_refused() -> None:
    with pytest.raises(InputError, match="wanted at most 100 deg/s"):
        ConstantRate(Case().datasheet(), 101 * DEG)
    slow = replace(Case().datasheet(), limits=Limits(1 * DEG))
    with pytest.raises(InputError, match="has none of the rates"):
        plan(slow)
    with pytest.raises(InputError, match="wanted both"):
        plan(replace(Case().datasheet(), site=Site()))


def test_the_expected_deviation_is_what_the_estimator_believes() -> None:
    for reversals in (0, 1):
        sheet = realistic()
        policy = Bidirectional(sheet, 15 * DEG, reversals)
        recording, _ = play(load("north_finder/realistic"), policy, range(12))
        # Without the accelerometer: the plan knows of no level error.
        sheet = replace(sheet, noise={"gyro": sheet.noise["gyro"]}, declared=_of_gyro(sheet))
        estimator = NorthGls(sheet)
        sd = estimator.estimate(estimator.update(estimator.reset(12), recording)).sd[:, 0]
        expected = expected_sd(sheet, 15 * DEG, reversals)
        assert np.sqrt(np.mean(sd**2)) == pytest.approx(expected, rel=0.02)


def _of_gyro(sheet: Datasheet) -> tuple[Declared, ...]:
    return tuple(d for d in sheet.declared if d.target == "gyro")


def test_with_a_perfect_instrument_it_does_not_reverse() -> None:
    best = plan(Case(acceleration=20 * DEG).datasheet()).best
    assert best.reversals == 0 and best.sd / ARCSEC == pytest.approx(30.6, abs=0.4)


def test_an_uncertain_encoder_asks_for_a_reversal() -> None:
    e = 0.02 * ARCSEC
    told = Declared("encoder_harmonic:1", "gyro", (0.0, 0.0), (e, e))
    found = plan(replace(Case(acceleration=20 * DEG).datasheet(), declared=(told,)))
    assert found.reversals >= 1 and found.sd / ARCSEC < 31.5
    one_way = {c.rate: c.sd for c in found.candidates if c.reversals == 0}
    assert one_way[10 * DEG] / ARCSEC == pytest.approx(np.hypot(30.8, 0.02 * 1804), rel=0.03)
    assert one_way[60 * DEG] > 4 * one_way[10 * DEG]


def test_a_threshold_that_wanders_asks_for_a_faster_rate() -> None:
    quiet, sheet = Case(acceleration=20 * DEG).datasheet(), realistic()
    wandering = replace(quiet, declared=tuple(d for d in sheet.declared if d.effect == "lock_in_wander"))
    slow = [c.sd for c in plan(wandering, rates=(2 * DEG, 5 * DEG, 20 * DEG), reversals=(0,)).candidates]
    assert plan(wandering, rates=(2 * DEG, 5 * DEG, 20 * DEG), reversals=(0,)).rate == 20 * DEG
    # 1 % in 300 s alone: 42 arcsec at 5 deg/s, 234 at 2 deg/s, below 1 at 20 deg/s.
    assert np.sqrt(slow[1] ** 2 - slow[0] ** 2) / ARCSEC == pytest.approx(42, rel=0.1)
    assert slow[2] / ARCSEC == pytest.approx(np.hypot(234, 150), rel=0.25)


def test_a_slow_table_reverses_less() -> None:
    sheet = replace(realistic(), limits=Limits(100 * DEG, 1 * DEG))
    fast, slow = plan(realistic(), rates=(20 * DEG,)), plan(sheet, rates=(20 * DEG,))
    cost = {c.reversals: c.sd for c in slow.candidates}
    assert cost[3] > 1.1 * cost[1] and slow.sd > fast.sd


def test_for_the_realistic_instrument_the_best_is_both_ways_at_a_small_tilt() -> None:
    mounted, free = plan(realistic()), plan(realistic(), TILTS)
    assert mounted.reversals == 1 and 10 * DEG <= mounted.rate <= 20 * DEG
    # At a tilt of 30 deg the bound of a perfect instrument is 30.4 already.
    assert 31 < mounted.sd / ARCSEC < 32.5
    assert free.reversals == 1 and free.rate == 20 * DEG and 10 * DEG <= free.tilt <= 15 * DEG
    assert free.sd / ARCSEC < 29.5
    assert len(free.candidates) == len(TILTS) * len(mounted.candidates)
    assert [c.sd for c in free.candidates] == sorted(c.sd for c in free.candidates)
    assert "both ways" in str(free.best) and TILT in {c.tilt for c in free.candidates}


def test_where_nothing_can_be_told_every_candidate_is_infinite() -> None:
    found = plan(Case(latitude=np.pi / 2 - 1e-12).datasheet(), rates=(RATE,))
    assert found.sd > np.pi
    upright = plan(Case(tilt=np.pi / 2).datasheet(), rates=(RATE,), reversals=(0,))
    assert upright.sd > 1e6


# The relative root mean square of 400 runs has a standard deviation of 3.5 %. The limits are 4 of them from what is
# expected: 28.7 for the plan, and for the published procedure, whose level error of 8.4 arcsec of north nobody takes
# out, hypot(37.5, 25.5, 8.4) = 46 with the pairing forward and hypot(45, 25.5, 8.4) = 52 without overlap. The step at
# 30 arcsec is what is asked for, with the seeds fixed (29.0); other seeds exceed it in 10 of 100 cases.


@pytest.mark.slow
def test_the_chosen_plan_beats_the_published_procedure_by_a_third() -> None:
    (chosen,) = _deviations(RateChoice, [NorthGls], 12.0)
    forward, apart = _deviations(ConstantRate, [Revolution, lambda d: Revolution(d, pairing="non_overlapping")], None)
    assert chosen <= 30.0
    assert forward == pytest.approx(46.0, rel=0.14) and apart == pytest.approx(52.0, rel=0.14)
    assert chosen < 0.75 * forward


def _deviations(
    policy: Callable[[Datasheet], Policy], estimators: Sequence[Callable[[Datasheet], Estimator]], tilt: float | None
) -> list[float]:
    """Root mean square errors of north over 400 runs of the realistic instrument [arcsec]."""
    quick = {"instrument.sampling": "50 Hz", "task.step": "5 s"}
    scenario = load("north_finder/realistic", quick | ({} if tilt is None else {"table.tilt": f"{tilt} deg"}))
    sheet, errors = datasheet(scenario), []
    for first in range(0, 400, 100):
        recording, azimuth = play(scenario, policy(sheet), range(first, first + 100))
        plugins = [make(sheet) for make in estimators]
        found = [p.estimate(p.update(p.reset(100), recording)).of("azimuth")[0] for p in plugins]
        errors.append([wrapped(mean - azimuth) for mean in found])
    together: Floats = np.concatenate(errors, axis=-1)
    return [float(x) / ARCSEC for x in np.sqrt(np.mean(together**2, axis=-1))]
