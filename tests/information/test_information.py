"""Information and bounds: published figures, dense algebra, and directions that nothing is known of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from north_cases import LATITUDE, PULSE, RATE, TILT

from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.core.units import ARCSEC, DEG, DEG_PER_SQRT_HOUR
from insenv.effects.angle import EarthRate, EncoderHarmonic
from insenv.effects.bias import Bias, BiasDrift
from insenv.effects.rate.scale import ScaleFactor, ScaleFactorWarmUp
from insenv.information.fisher import IncrementNoise, Information, information, north_bound
from insenv.information.polynomial import BiasPolynomial, ScaleFactorPolynomial
from insenv.information.table_motion import Course, back_and_forth, motion, one_way, steady
from insenv.plants.turntable import Turntable
from insenv.sensors.chain import Sensor


def turning(duration: float, sampling: float = 20.0, tilt: float = TILT, rate: float = RATE) -> Motion:
    """The table turns evenly from the start."""
    t: Floats = np.arange(round(duration * sampling) + 1) / sampling
    share = float(np.sin(tilt))
    vertical = EARTH_RATE * np.sin(LATITUDE) * share
    return Motion(
        t=t,
        rate=np.full(len(t) - 1, rate * share + vertical),
        angle=rate * t,
        rate_edges=np.full(len(t), rate * share + vertical),
        projection=share,
    )


def bound(duration: float, walk: float, degree: int, sampling: float = 20.0, angle: float = 0.0) -> float:
    """Root mean square over azimuth [arcsec]; ``walk`` in deg/sqrt(h)."""
    effects = (EarthRate(), ScaleFactorPolynomial(degree, duration))
    noise = IncrementNoise(walk * DEG_PER_SQRT_HOUR, angle)
    found = information(turning(duration, sampling), effects, noise).bound()
    return north_bound(found, EARTH_RATE * np.cos(LATITUDE) * np.cos(TILT)) / ARCSEC


# Latitude 40 deg, tilt 30 deg, 10 deg/s, no pulses: rows of duration, scale factor of degree 0, 2, 4.
PUBLISHED: dict[tuple[float, float], tuple[float, float, float]] = {
    (120, 1e-4): (16.1, 16.5, 17.2),
    (120, 3e-4): (48.2, 49.4, 51.7),
    (120, 5e-4): (80.4, 82.4, 86.2),
    (120, 1e-3): (161, 165, 172),
    (288, 1e-4): (10.3, 10.4, 10.4),
    (288, 3e-4): (31.0, 31.1, 31.3),
    (288, 5e-4): (51.7, 51.8, 52.1),
    (288, 1e-3): (103, 104, 104),
    (300, 1e-4): (10.1, 10.2, 10.2),
    (300, 3e-4): (30.4, 30.5, 30.7),
    (300, 5e-4): (50.7, 50.9, 51.2),
    (300, 1e-3): (101, 102, 102),
    (600, 1e-4): (7.2, 7.2, 7.2),
    (600, 3e-4): (21.5, 21.5, 21.5),
    (600, 5e-4): (35.8, 35.8, 35.9),
    (600, 1e-3): (71.6, 71.7, 71.8),
}


@pytest.mark.parametrize("case", PUBLISHED, ids=str)
def test_the_bound_of_the_rate_biased_gyro_is_the_derived_table(case: tuple[float, float]) -> None:
    found = tuple(bound(*case, degree) for degree in (0, 2, 4))
    assert found == pytest.approx(PUBLISHED[case], rel=0.01)


def test_the_bound_without_nuisances_is_the_closed_form() -> None:
    walk, duration = 3e-4 * DEG_PER_SQRT_HOUR, 288.0  # whole turns
    closed = walk * np.sqrt(2 / duration) / (EARTH_RATE * np.cos(LATITUDE) * np.cos(TILT)) / ARCSEC
    assert bound(duration, 3e-4, 0) == pytest.approx(closed, rel=1e-3)


@pytest.mark.parametrize(("tilt", "arcsec"), [(5, 26.8), (10, 27.1), (20, 28.4), (30, 30.8), (45, 37.8), (60, 53.4)])
def test_the_bound_over_tilt_with_pulses(tilt: float, arcsec: float) -> None:
    effects = (EarthRate(), ScaleFactorPolynomial(2, 300.0))
    noise = IncrementNoise(3e-4 * DEG_PER_SQRT_HOUR, PULSE / 12**0.5)
    found = information(turning(300.0, 100.0, tilt * DEG), effects, noise).bound()
    sd = north_bound(found, EARTH_RATE * np.cos(LATITUDE) * np.cos(tilt * DEG)) / ARCSEC
    assert sd == pytest.approx(arcsec, rel=0.01)


@pytest.mark.parametrize(("sampling", "arcsec"), [(1, 50.5), (10, 33.2), (100, 30.8)])
def test_pulses_cost_less_at_a_higher_sampling_rate(sampling: float, arcsec: float) -> None:
    assert bound(300, 3e-4, 2, sampling, PULSE / 12**0.5) == pytest.approx(arcsec, rel=0.01)


def test_the_banded_solve_is_the_dense_one() -> None:
    exposure = turning(40.0, 5.0)
    sensor = Sensor("gyro", (EarthRate(), ScaleFactor(), EncoderHarmonic(2)))
    noise = IncrementNoise(2e-6, 1e-6)
    n, dt = exposure.n, exposure.dt
    jump = np.eye(n) - np.eye(n, k=-1)
    first = np.zeros((n, n))
    first[0, 0] = 1.0  # the error before the first increment
    covariance = noise.walk**2 * dt * np.eye(n) + noise.angle**2 * (jump @ jump.T + first)
    x = sensor.regressors(exposure, np.zeros(5)) * dt
    told = information(exposure, sensor, noise)
    np.testing.assert_allclose(told.matrix, x.T @ np.linalg.solve(covariance, x), rtol=1e-9)
    # A unitless comparison: columns of rad/s and of 1 differ by many orders.
    size = np.sqrt(np.diag(told.matrix))
    inverse = np.linalg.inv(told.matrix / np.outer(size, size)) / np.outer(size, size)
    np.testing.assert_allclose(told.bound().cov, inverse, rtol=1e-7, atol=1e-30)


def test_one_direction_cannot_tell_the_encoder_from_the_earth_and_says_so() -> None:
    effects = (EarthRate(), ScaleFactor(), Bias(), EncoderHarmonic(1), EncoderHarmonic(2))
    noise = IncrementNoise(3e-4 * DEG_PER_SQRT_HOUR)
    found = information(turning(288.0), effects, noise).bound()
    assert sorted(map(sorted, found.unidentifiable)) == [
        ["bias.c", "scale_factor.c"],
        ["earth_rate.c", "encoder_harmonic:1.s"],
        ["earth_rate.s", "encoder_harmonic:1.c"],
    ]
    assert np.isinf(found.sd("earth_rate.c")) and np.isinf(north_bound(found, 1.0))
    without = information(turning(288.0), (EarthRate(), ScaleFactor(), EncoderHarmonic(2)), noise).bound()
    assert not without.unidentifiable
    assert found.sd("encoder_harmonic:2.c") == pytest.approx(without.sd("encoder_harmonic:2.c"), rel=1e-6)


def test_a_parameter_that_the_motion_does_not_show_is_named() -> None:
    rest = turning(10.0, rate=0.0)
    rest = replace(rest, angle=np.full(rest.n + 1, 0.3))
    found = information(rest, (EarthRate(), EncoderHarmonic(1), BiasDrift()), IncrementNoise(1e-6)).bound()
    assert sorted(map(sorted, found.unidentifiable)) == [
        ["earth_rate.c", "earth_rate.s"],
        ["encoder_harmonic:1.c"],
        ["encoder_harmonic:1.s"],
    ]
    assert np.isfinite(found.sd("bias_drift.c")) and np.isinf(found.sd("encoder_harmonic:1.c"))


def test_a_reversal_frees_the_encoder() -> None:
    t = np.arange(3001) / 10
    course = back_and_forth(RATE, 300.0, 1, 20 * DEG)
    exposure = motion(course, t, TILT, LATITUDE, 20 * DEG)
    noise = IncrementNoise(3e-4 * DEG_PER_SQRT_HOUR)
    level = EARTH_RATE * np.cos(LATITUDE) * np.cos(TILT)
    effects = (EarthRate(), ScaleFactorPolynomial(2, 300.0), BiasPolynomial(0, 300.0))
    sd = [
        north_bound(information(exposure, e, noise, stretches=steady(exposure)).bound(), level) / ARCSEC
        for e in (effects, (*effects, EncoderHarmonic(1)))
    ]
    assert sd[1] == pytest.approx(sd[0], rel=2e-3)
    assert sd[1] < 1.02 * bound(300, 3e-4, 2)


def test_priors_hold_what_the_motion_does_not() -> None:
    told = information(
        turning(288.0), (EarthRate(), ScaleFactor(), EncoderHarmonic(1)), IncrementNoise(3e-4 * DEG_PER_SQRT_HOUR)
    )
    level = EARTH_RATE * np.cos(LATITUDE) * np.cos(TILT)
    names = ("encoder_harmonic:1.c", "encoder_harmonic:1.s")
    known = told.given(dict.fromkeys(names, 0.0))
    assert known.names == ("earth_rate.c", "earth_rate.s", "scale_factor.c")
    perfect = north_bound(known.bound(), level)
    eccentric = north_bound(told.given(dict.fromkeys(names, 0.02 * ARCSEC)).bound(), level)
    # e sin(tilt) W / level: 1804 arcsec of north per arcsec.
    leverage = np.sin(TILT) * RATE / level
    assert leverage == pytest.approx(1804, rel=1e-3)
    assert eccentric == pytest.approx(np.hypot(perfect, 0.02 * ARCSEC * leverage), rel=1e-3)
    assert told.given(dict.fromkeys(names, np.inf)).bound().unidentifiable


def test_what_cannot_be_asked_for_is_refused() -> None:
    exposure = turning(10.0)
    noise = IncrementNoise(1e-6)
    with pytest.raises(InputError, match="no noise given"):
        information(exposure, (Bias(),), IncrementNoise(0.0))
    with pytest.raises(InputError, match="has shapes"):
        information(exposure, (ScaleFactorWarmUp(),), noise)
    with pytest.raises(InputError, match="does not give angle"):
        information(Motion(t=np.arange(3.0), rate=np.ones(2)), (EarthRate(),), noise)
    told = information(exposure, (Bias(),), noise)
    with pytest.raises(InputError, match=r"no parameter 'bias.d'; there are bias.c"):
        told.bound().sd("bias.d")
    with pytest.raises(ValueError, match="added to"):
        _ = told + Information(("scale_factor.c",), np.eye(1))


def test_shapes_are_linearised_where_theta_stands() -> None:
    exposure = turning(300.0)
    found = information(exposure, (ScaleFactorWarmUp(),), IncrementNoise(1e-6), np.array([1e-4, 100.0])).bound()
    assert found.names == ("scale_factor_warm_up.c", "scale_factor_warm_up.tau")
    assert not found.unidentifiable and np.isfinite(found.sd("scale_factor_warm_up.tau"))


@pytest.mark.parametrize("reversals", [0, 1, 3])
@pytest.mark.parametrize("acceleration", [20 * DEG, 2 * DEG])
def test_the_predicted_motion_is_what_the_table_does(reversals: int, acceleration: float) -> None:
    course = back_and_forth(RATE, 60.0, reversals, acceleration)
    table = Turntable(tilt=TILT, latitude=LATITUDE, max_acceleration=acceleration)
    state, start, z = table.begin(), 0, np.zeros((0, 1))
    angles = [np.zeros(1)]
    # Commands on the grid: only there can both be compared.
    on_grid = Course(tuple(round(at, 1) for at in course.at), course.rate)
    predicted = motion(on_grid, np.arange(601) / 10, TILT, LATITUDE, acceleration)
    for k, at in enumerate(on_grid.at):
        stop = round(10 * on_grid.at[k + 1]) if k + 1 < len(on_grid.at) else 600
        start = round(10 * at)
        scene, state = table.advance(state, on_grid.rate[k], np.arange(start, stop + 1) / 10, z)
        exposed = scene.motions["gyro"]
        assert exposed.angle is not None
        angles.append(exposed.angle[1:])
        np.testing.assert_allclose(predicted.rate[start:stop], exposed.rate, atol=1e-6)
    assert predicted.angle is not None
    np.testing.assert_allclose(predicted.angle, np.concatenate(angles), atol=1e-5)


def test_stretches_of_a_course_are_steady_and_of_one_length() -> None:
    course = back_and_forth(RATE, 300.0, 3, 20 * DEG)
    exposure = motion(course, np.arange(30001) / 100, TILT, LATITUDE, 20 * DEG)
    lengths = [stretch.stop - stretch.start for stretch in steady(exposure)]
    assert len(lengths) == 4 and max(lengths) - min(lengths) <= 4
    assert sum(lengths) == pytest.approx(100 * (300 - 7 * 0.5), abs=12)
    assert one_way(RATE).command(5.0) == RATE and course.command(-1.0) == 0.0


def test_polynomials_are_named_and_refer_to_their_span() -> None:
    exposure = turning(300.0)
    columns = ScaleFactorPolynomial(2, 300.0).basis(exposure.rate, exposure)
    gram = columns.T @ columns / np.sum(exposure.rate**2)
    np.testing.assert_allclose(gram, np.diag([1, 1 / 3, 1 / 5]), atol=1e-6)
    assert Sensor("gyro", (BiasPolynomial(1, 300.0),)).names == ("bias_polynomial.c0", "bias_polynomial.c1")
