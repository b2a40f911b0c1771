"""Whole revolutions: how they are delimited, and the covariance of a correlation in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from north_cases import PULSE, RATE, TILT, WALK, Case, azimuths, wrapped

from estimators.common import turns
from estimators.common.turns import A0, ANGLE, F1, START, STRETCH, WAY, Axis, T, begin, follow
from estimators.north_finder.correlation import Correlation
from insenv.core.errors import InputError
from insenv.core.estimate import Estimate
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.recording import Channel, Floats, Recording
from insenv.core.rows import rows
from insenv.core.units import ARCSEC, DEG
from insenv.information.rate_noise import pulses

DT = 0.01


def turned(angle: Floats, noise: float = 0.0) -> turns.Revolutions:
    """Revolutions of a table that had these angles at the ends of the intervals."""
    t = DT * np.arange(1, angle.shape[-1] + 1)
    gyro = np.zeros_like(angle)
    recording = Recording(t, {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(angle, "rad")})
    return follow(begin(None), Axis(DT, 1.0, 0.0, 12 * noise), recording, "gyro", "rad/s")


def read(case: Case, azimuth: Floats, seed: int = 0) -> Estimate:
    estimator = Correlation(case.datasheet())
    return estimator.estimate(estimator.update(estimator.reset(len(azimuth)), case.run(azimuth, seed)))


def test_the_plug_in_is_found_by_its_name() -> None:
    assert find(ESTIMATORS, "correlation") is Correlation


@settings(max_examples=40, deadline=None)
@given(rate=st.floats(5.0, 3000.0), way=st.sampled_from([-1.0, 1.0]), start=st.floats(-10.0, 10.0))
def test_revolutions_lie_end_to_end_and_turn_by_two_pi(rate: float, way: float, start: float) -> None:
    angle = start + way * rate * DEG * DT * np.arange(1.0, 15001.0)
    state = turned(angle)
    there = state.closed[: state.count]
    assert len(there) == int(abs(angle[-1] - angle[0]) / (2 * np.pi) + 1e-9)
    np.testing.assert_allclose(there[:, A0], way * 2 * np.pi, atol=2e-9)
    np.testing.assert_allclose(there[:, T], 360 / rate, rtol=1e-8)
    np.testing.assert_allclose(there[:, START], DT + np.arange(len(there)) * 360 / rate, atol=1e-8)
    np.testing.assert_allclose(there[:, ANGLE], angle[0] + way * 2 * np.pi * np.arange(len(there)), atol=1e-9)
    assert (there[:, WAY] == way).all()
    assert ((there[:, F1] > 0) & (there[:, F1] <= 1)).all()


def test_a_change_of_rate_begins_a_stretch_and_a_small_one_does_not() -> None:
    steps = DT * RATE * np.concatenate([np.ones(5000), 1.02 * np.ones(5000), -np.ones(5000), np.zeros(100)])
    state = turned(np.cumsum(steps))
    assert state.closed[: state.count, STRETCH].tolist() == [1, 1, 2]
    assert state.closed[: state.count, WAY].tolist() == [1, 1, -1]


def test_noise_of_the_encoder_begins_no_stretch() -> None:
    noise = 20 * ARCSEC
    angle = DT * RATE * np.arange(1, 15001) + noise * np.random.default_rng(1).standard_normal(15000)
    assert (turned(angle, noise).closed[:, STRETCH] == 1).all()
    assert turned(angle, noise).count == 4


def test_rows_of_a_state_go_on_alone() -> None:
    case = replace(Case(), duration=100.0)
    azimuth = azimuths(3)
    estimator, recording = Correlation(case.datasheet()), case.run(azimuth)
    state = rows(estimator.update(estimator.reset(3), recording), np.array([2, 0]))
    whole = estimator.estimate(estimator.update(estimator.reset(3), recording))
    np.testing.assert_array_equal(estimator.estimate(state).mean, whole.mean[[2, 0]])


def test_channels_that_are_missing_or_in_another_unit_are_named() -> None:
    estimator = Correlation(Case().datasheet())
    angle = Channel(np.zeros(3), "rad")
    with pytest.raises(InputError, match="no channel 'gyro'"):
        estimator.update(estimator.reset(), Recording(np.arange(3.0), {"table_angle": angle}))
    with pytest.raises(InputError, match="channel 'gyro' is in deg/s, wanted in rad/s"):
        channels = {"gyro": Channel(np.zeros(3), "deg/s"), "table_angle": angle}
        estimator.update(estimator.reset(), Recording(np.arange(3.0), channels))


def test_an_empty_chunk_changes_nothing() -> None:
    estimator = Correlation(Case().datasheet())
    state = estimator.reset(2)
    channels = {"gyro": Channel(np.zeros((2, 0)), "rad/s"), "table_angle": Channel(np.zeros((2, 0)), "rad")}
    assert estimator.update(state, Recording(np.zeros(0), channels)).count.tolist() == [0, 0]


def test_random_walk_and_pulses_give_the_closed_forms() -> None:
    azimuth = np.linspace(-3.0, 3.0, 7)
    time, case = 8 * 36.0, Case()
    walk = read(replace(case, pulse=0.0), azimuth).sd[:, 0]
    np.testing.assert_allclose(walk, WALK * np.sqrt(2 / time) / case.level, rtol=2e-3)
    sheet = replace(case.datasheet(), noise={})
    estimator = Correlation(sheet)
    state = estimator.update(estimator.reset(7), replace(case, walk=0.0, pulse=0.0).run(azimuth))
    # Both ends at the angle of the first row's end; the sine of the azimuth's error is what they add to.
    at = RATE * 0.01 - azimuth
    samples, step = time / 0.01, RATE * 0.01
    # Within a turn pulses at one rate are no white noise.
    inside = 0.5 * samples * step**2 * pulses(sheet, RATE)
    wanted = 2 / (time * case.level) * PULSE / 12**0.5 * np.sqrt(2 * np.sin(at) ** 2 + inside)
    np.testing.assert_allclose(estimator.estimate(state).sd[:, 0], wanted, rtol=2e-3)


def test_the_covariance_of_the_azimuth_grows_with_the_tilt_and_falls_with_time() -> None:
    short, long = (read(replace(Case(), pulse=0.0, duration=d), azimuths(2)).sd[0, 0] for d in (80.0, 300.0))
    assert short / long == pytest.approx(2.0, rel=1e-3)  # two revolutions, eight
    steep = read(replace(Case(), pulse=0.0, tilt=60 * DEG), azimuths(2)).sd[0, 0]
    assert steep / long == pytest.approx(np.cos(TILT) / np.cos(60 * DEG), rel=1e-3)


# z-scores of 300 runs: a false alarm has the probability 2e-4 (see test_revolution).
@pytest.mark.slow
@pytest.mark.parametrize("noise", [{"rate_random_walk": 3e-9}, {"bias_instability": 3e-8}], ids=lambda n: next(iter(n)))
def test_noise_that_drifts_is_in_the_covariance(noise: dict[str, float]) -> None:
    case = replace(Case(), sampling=20.0, pulse=0.0, walk=0.01 * WALK, noise=noise)
    azimuth = azimuths(300, 8)
    estimate = read(case, azimuth, 17)
    z = wrapped(estimate.mean[:, 0] - azimuth) / estimate.sd[:, 0]
    assert z.std(ddof=1) == pytest.approx(1.0, abs=0.15)
