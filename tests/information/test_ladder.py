"""Optimal designs of a scale-factor test, and what a table can do of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from insenv.core.errors import InputError
from insenv.core.units import DEG, DEG_PER_SQRT_HOUR, PPM
from insenv.information.ladder import MODELS, LadderDesign, basis, covariance, coverage, optimal, scale_factor_variance
from insenv.information.ladder_time import Dwells, dwells, published

TOP = 35 * DEG
NOISE = 0.12 * DEG_PER_SQRT_HOUR
FLOOR = 4e-4 * DEG


def test_the_c_optimal_variances_are_the_squares_of_the_chebyshev_slopes() -> None:
    variances = [scale_factor_variance(optimal(model, "c", TOP), model) for model in ("line", "cubic", "quintic")]
    np.testing.assert_allclose(variances, (1, 9, 25), rtol=2e-4)


def test_the_c_optimal_rates_are_the_extrema_of_the_chebyshev_polynomial() -> None:
    cubic = optimal("cubic", "c", TOP)
    np.testing.assert_allclose(cubic.rate / TOP, np.cos(np.pi * np.arange(4) / 3)[::-1], atol=1e-3)
    np.testing.assert_allclose(cubic.share, [1 / 18, 4 / 9, 4 / 9, 1 / 18], atol=1e-3)


@pytest.mark.parametrize(
    ("model", "rates", "variance"),
    [
        ("line", (-35, 35), 1.0),
        ("cubic", (-35, -35 / 3**0.5, 35 / 3**0.5, 35), 14.0),
        ("quintic", (-35, -28.1, -13.8, 13.8, 28.1, 35), 51.0),
        ("asymmetry", (-35, 0, 35), 1.5),
    ],
)
def test_a_d_optimal_design_has_as_many_rates_as_coefficients(model: str, rates: Any, variance: float) -> None:
    design = optimal(model, "d", TOP)
    np.testing.assert_allclose(design.rate / DEG, rates, atol=0.05)
    np.testing.assert_allclose(design.share, 1 / len(rates), atol=1e-6)
    assert scale_factor_variance(design, model) == pytest.approx(variance, rel=2e-3)


@pytest.mark.parametrize("model", MODELS)
def test_no_rate_is_told_of_more_than_the_d_optimal_ones(model: str) -> None:
    # The equivalence theorem of Kiefer and Wolfowitz: f' M^-1 f <= p, with equality at the design's rates.
    design = optimal(model, "d", TOP)
    inverse = covariance(model, design.rate / TOP, 1 / design.share)
    F = basis(model, np.linspace(-1, 1, 2001))
    assert np.einsum("ij,jk,ik->i", F, inverse, F).max() <= F.shape[-1] * (1 + 1e-4)


def test_the_published_list() -> None:
    listed = published()
    assert len(listed.rate) == 36 and len(np.unique(np.abs(listed.rate))) == 18
    assert np.sum((listed.rate / DEG) ** 2) == pytest.approx(11927.78, abs=1e-9)
    assert listed.time.sum() - 120 == pytest.approx(4053.99, abs=0.01)
    assert listed.duration(50 * DEG) == pytest.approx(4190, abs=30)


@pytest.mark.parametrize(
    ("model", "weighted", "plain"),
    [("line", 27.3, 30.6), ("cubic", 105, 132), ("quintic", 268, 404), ("asymmetry", 27.3, 30.6)],
)
def test_what_the_published_list_tells_of_the_scale_factor(model: str, weighted: float, plain: float) -> None:
    listed = published()
    for with_weights, wanted in ((True, weighted), (False, plain)):
        cov = listed.covariance(model, TOP, 1.0, weighted=with_weights)
        assert cov[1, 1] * listed.time.sum() == pytest.approx(wanted, rel=5e-3)


def test_many_short_visits_beat_a_floor_that_no_dwell_averages_out() -> None:
    listed, line = published(), optimal("line", "c", TOP)
    assert listed.scale_factor_sd("line", NOISE, weighted=False) / PPM == pytest.approx(4.89, abs=0.01)
    assert listed.scale_factor_sd("line", NOISE, FLOOR, weighted=False) / PPM == pytest.approx(6.1, abs=0.05)
    ladders = [dwells(line, 4174.0, 50 * DEG, visits) for visits in (1, 4, 8)]
    np.testing.assert_allclose([d.scale_factor_sd("line", NOISE) / PPM for d in ladders], 0.885, atol=0.002)
    floored = [d.scale_factor_sd("line", NOISE, FLOOR) / PPM for d in ladders]
    assert floored[0] == pytest.approx(8.1, abs=0.05) and floored[0] > floored[1] > floored[2]


def test_a_design_that_sits_on_a_fault_does_not_see_it() -> None:
    rate = optimal("cubic", "d", TOP).rate
    fault = 0.033718 * DEG * np.sign(rate) * np.exp(-0.5 * ((np.abs(rate) - 20 * DEG) / (0.22 * DEG)) ** 2)
    F = basis("cubic", rate / TOP)
    fitted = np.linalg.lstsq(F, fault, rcond=None)[0]
    assert np.abs(F @ fitted - fault).max() < 1e-15
    # Neighbouring rates in between bend the other way: the whole fault is in K.
    assert fitted[1] / TOP / PPM > 1000


def test_coverage_of_a_list() -> None:
    rates = np.array([10.0, -10.0, 11.0, 35.0])
    assert coverage(rates, 0.25, 35.0) == pytest.approx((0.5 + 0.5 + 0.25) / 35)
    assert coverage(rates, 1.0, 35.0) == pytest.approx((3 + 1) / 35)
    assert coverage(np.arange(0, 36.0), 0.6, 35.0) == pytest.approx(1.0)
    # Of the published one no more than a third is seen, where a fault of 0.22 deg/s stands out by 0.43 deg/s.
    assert coverage(published().rate, 0.43 * DEG, TOP) == pytest.approx(0.37, abs=0.01)


def test_a_ladder_takes_the_time_that_it_is_given_and_turns_back_each_round() -> None:
    listed = dwells(optimal("cubic", "d", TOP), 600.0, 50 * DEG, 4, zero=10.0)
    assert listed.duration(50 * DEG) == pytest.approx(600.0)
    assert np.all(listed.time[listed.rate == 0] == 10.0) and np.sum(listed.rate == 0) == 5
    np.testing.assert_allclose(listed.rate[1:5], -listed.rate[6:10])
    assert np.all(np.diff(dwells(optimal("cubic", "d", TOP), 600.0, 50 * DEG, 2).rate) != 0)


def test_whole_turns() -> None:
    listed = dwells(optimal("cubic", "d", TOP), 600.0, 50 * DEG, 4, whole_turns=True)
    turns = np.abs(listed.rate) * listed.time / (2 * np.pi)
    np.testing.assert_allclose(turns, np.rint(turns), atol=1e-9)
    assert turns.min() >= 1 - 1e-9
    np.testing.assert_allclose(dwells(optimal("line", "c", TOP), 1.0, np.inf, 1, whole_turns=True).time, 360 / 35)


def test_slewing_begins_and_ends_where_the_table_is() -> None:
    listed = Dwells(np.array([10.0, -10.0, 0.0]), np.array([1.0, 1.0, 1.0]))
    np.testing.assert_allclose(listed.slewing(5.0), [2.0, 4.0, 2.0])
    assert listed.duration(5.0) == 11.0 and listed.duration() == 3.0


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: optimal("septic", "c", TOP), "model 'septic' given, wanted one of line, cubic"),
        (lambda: optimal("line", "e", TOP), "criterion 'e' given, wanted c or d"),
        (lambda: optimal("line", "c", 0.0), "largest rate of 0 rad/s given"),
        (lambda: dwells(LadderDesign(np.ones(1), np.ones(1)), 10.0, np.inf, 0), "0 visits given"),
        (lambda: dwells(optimal("line", "c", TOP), 1.0, 5 * DEG), "1 s given, of which .* left to dwell"),
        (lambda: dwells(optimal("line", "c", TOP), np.inf), "inf s given"),
    ],
)
def test_what_cannot_be_is_refused(call: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        call()
