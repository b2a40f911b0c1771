"""Covariance analysis without sampling: efficient and other estimators, and the bias by an undeclared effect."""

from __future__ import annotations

import numpy as np
import pytest
from information_cases import EFFECTS, EVERY, VEHICLE, WHITE, turning

from insenv.core.errors import InputError
from insenv.core.units import DEG_PER_HOUR
from insenv.effects.angle import EarthRate, EncoderHarmonic
from insenv.effects.bias import Bias, BiasDrift
from insenv.effects.cross import CrossAxis
from insenv.effects.rate.scale import ScaleFactor, ScaleFactorWarmUp
from insenv.effects.thermal import BiasTemperature
from insenv.information.alignment import Stretch, bound, procedure
from insenv.information.alignment_response import responses
from insenv.information.means import Means, means
from insenv.information.sensitivity import Linear, efficient, sensitivity

COURSE = procedure(120.0, [3.0], 20.0)
SD = {"scale_factor.c": 1e-6}


@pytest.fixture(scope="module")
def told() -> Means:
    return means(turning(60.0, 5.0), EFFECTS, EVERY)


@pytest.mark.parametrize("prior", [{}, SD, {"scale_factor.c": 0.0}])
def test_the_efficient_estimator_has_the_bound(told: Means, prior: dict[str, float]) -> None:
    estimator = efficient(told, prior)
    found = told.information.given(prior).bound()
    places = [told.names.index(name) for name in found.names]
    errors = estimator.errors(told)[np.ix_(places, places)]
    size = np.sqrt(np.diag(found.cov))
    np.testing.assert_allclose(errors / np.outer(size, size), found.cov / np.outer(size, size), atol=1e-9)


def test_wrong_weights_cost_and_the_analysis_says_how_much(told: Means) -> None:
    plain = efficient(means(turning(60.0, 5.0), EFFECTS, WHITE[:1]))
    errors, best = np.diag(plain.errors(told)), np.diag(told.information.bound().cov)
    assert np.all(errors >= best * (1 - 1e-9)) and errors[2] > 1.0001 * best[2]
    # Sample covariance of 4000 draws: relative deviation sqrt(2 / 4000); five deviations, 6e-7 each.
    noise = told.root @ np.random.default_rng(1).standard_normal((len(told.columns), 4000))
    np.testing.assert_allclose(np.var(plain.gain @ noise, axis=1), errors, rtol=5 * np.sqrt(2 / 4000))


def test_a_truth_that_spreads_more_than_the_prior_says_costs(told: Means) -> None:
    estimator = efficient(told, SD)
    honest, spread = (estimator.errors(told, {"scale_factor.c": sd})[2, 2] for sd in (1e-6, 1e-4))
    assert spread > 10 * honest
    with pytest.raises(InputError, match="leaves a part of scale_factor.c"):
        estimator.errors(told, {})


def test_a_direction_that_nothing_tells_is_refused_by_name() -> None:
    blind = means(turning(60.0, 5.0), (EarthRate(), EncoderHarmonic(1), ScaleFactor()), WHITE)
    with pytest.raises(InputError, match=r"not identifiable: earth_rate.* with encoder_harmonic:1"):
        efficient(blind)
    assert isinstance(efficient(blind, {"encoder_harmonic:1.c": 1e-7, "encoder_harmonic:1.s": 1e-7}), Linear)


def test_the_bias_is_what_a_fit_of_clean_data_makes_of_the_effect(told: Means) -> None:
    cases = [(Bias(), [2e-7]), (EncoderHarmonic(1), [1e-7, -2e-7]), (ScaleFactorWarmUp(), [1e-5, 30.0])]
    for (effect, theta), response in zip(cases, sensitivity(told, cases), strict=True):
        added = told.white(told.addition(effect, np.array(theta)))
        fitted = np.linalg.lstsq(told.white(told.columns), added, rcond=None)[0]
        np.testing.assert_allclose(response.bias, fitted, rtol=1e-6, atol=1e-9 * np.abs(fitted).max())
        assert response.effect == effect.key and response.names == told.names
        assert response.of({"earth_rate.c": 2.0}) == pytest.approx(2 * response.bias[0])
    one, two = sensitivity(told, [(Bias(), [1.0]), (Bias(), [-3.0])])
    np.testing.assert_allclose(two.significance, -3 * one.significance, atol=1e-12 * np.abs(two.significance).max())
    with pytest.raises(InputError, match="does not give temperature, which effect 'bias_temperature:1' needs"):
        sensitivity(told, [(BiasTemperature(), [1.0])])


def test_an_effect_that_is_declared_biases_itself_alone(told: Means) -> None:
    (found,) = sensitivity(told, [(ScaleFactor(), [1e-5])])
    expected = [1e-5 if name == "scale_factor.c" else 0.0 for name in told.names]
    np.testing.assert_allclose(found.bias, expected, atol=1e-15)


# ---------------------------------------------------------------------------------------------- vehicle at rest


def test_a_bias_beyond_its_prior_is_found_by_a_vehicle_that_turns() -> None:
    found = responses(VEHICLE, COURSE, [("gyro_x", Bias(), [1e-7]), ("accel_y", Bias(), [1e-3])])
    np.testing.assert_allclose(found[0].bias[3], 1e-7, rtol=0.05)
    np.testing.assert_allclose(found[1].bias[7], 1e-3, rtol=1e-3)
    assert found[0].effect == "gyro_x.bias" and np.abs(found[0].significance[:3]).max() < 0.6
    np.testing.assert_allclose(found[0].sd, bound(VEHICLE, COURSE, turning_data=False).sd, rtol=0.01)


def test_one_rest_takes_a_gyro_bias_for_heading() -> None:
    (found,) = responses(VEHICLE, (Stretch(600.0),), [("gyro_x", Bias(), [5e-8])])
    # phi_U = -eps_E / omega_N, as far as the prior of the bias, 5e-8, and of phi, 1, let it.
    north = 7.292115e-5 * np.cos(VEHICLE.latitude)
    assert abs(found.bias[2]) == pytest.approx(5e-8 / north, rel=0.02)


def test_what_a_level_vehicle_does_not_give_is_refused() -> None:
    with pytest.raises(InputError, match="needs temperature"):
        responses(VEHICLE, COURSE, [("gyro_x", BiasTemperature(), [1e-7])])
    with pytest.raises(InputError, match="wanted one of gyro_x"):
        responses(VEHICLE, COURSE, [("gyro", Bias(), [1e-7])])
    with pytest.raises(InputError, match="no stretch"):
        responses(VEHICLE, (), [("gyro_x", Bias(), [1e-7])])
    drift, cross = responses(
        VEHICLE,
        COURSE,
        [("gyro_x", BiasDrift(), [0.01 * DEG_PER_HOUR / 3600]), ("gyro_x", CrossAxis(), [0.0, 0.0, 1e-5])],
    )
    assert np.isfinite(drift.bias).all() and np.abs(cross.bias).max() > 0
