"""Information under any noise of the catalogue: the banded path, additivity, other parameters, what nothing tells."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from information_cases import EFFECTS, EVERY, VEHICLE, WHITE, turning

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Declared
from insenv.core.motion import Motion
from insenv.core.recording import Mounting, Site
from insenv.core.units import DEG
from insenv.effects.angle import EarthRate, EncoderHarmonic
from insenv.effects.base import NoiseEffect
from insenv.effects.bias import Bias, BiasDrift
from insenv.effects.catalogue import ALL
from insenv.effects.noise import AngleRandomWalk, BiasInstability, RateRandomWalk
from insenv.effects.rate.scale import ScaleFactor, ScaleFactorAsymmetry, ScaleFactorWarmUp
from insenv.information.alignment import Stretch, bound, procedure
from insenv.information.alignment_information import alignment_information, prior
from insenv.information.fisher import IncrementNoise, Information, information
from insenv.information.means import MOST, Noise, means, stated_noises
from insenv.information.scale_factor import CELLS, cells, model, motion_of, slope


def test_every_noise_of_the_catalogue_is_among_these() -> None:
    assert {type(noise.effect) for noise in EVERY} == {type(e) for e in ALL if isinstance(e, NoiseEffect)}


@pytest.mark.parametrize("noises", [WHITE, WHITE[:1]])
def test_white_noises_are_the_banded_path(noises: tuple[Noise, ...]) -> None:
    motion = turning(60.0, 5.0)
    banded = information(motion, EFFECTS, IncrementNoise(2e-6, 1e-6 if len(noises) > 1 else 0.0))
    general = means(motion, EFFECTS, noises).information
    assert general.names == banded.names
    np.testing.assert_allclose(general.matrix, banded.matrix, rtol=1e-9)


@pytest.mark.parametrize("noises", [WHITE, EVERY])
def test_the_matrix_is_the_one_of_dense_algebra_with_gaps(noises: tuple[Noise, ...]) -> None:
    motion, edges = turning(60.0, 5.0), np.array([0, 7, 20, 60, 61, 130, 300])
    kept = np.array([True, False, True, True, True, False])
    found = means(motion, EFFECTS, noises, edges, kept)
    covariance = sum(n.coefficient**2 * n.effect.covariance(edges, motion.dt) for n in noises)
    parts = [found.sensor.regressors(motion, np.zeros(5))[a:b].mean(axis=0) for a, b in pairwise(edges)]
    x = np.array(parts)[kept]
    expected = x.T @ np.linalg.solve(np.asarray(covariance)[np.ix_(kept, kept)], x)
    np.testing.assert_allclose(found.columns, x, rtol=1e-12)
    np.testing.assert_allclose(found.information.matrix, expected, rtol=1e-8)


def test_more_noise_tells_less_and_means_of_cells_tell_no_more() -> None:
    motion = turning(60.0, 5.0)
    sd = [
        means(motion, EFFECTS, noises, edges).information.bound().sd("earth_rate.c")
        for noises in (WHITE[:1], WHITE, EVERY)
        for edges in (None, np.arange(0, 301, 5), np.arange(0, 301, 50))
    ]
    fine, coarse, coarser = (sd[k::3] for k in range(3))
    assert fine[0] < fine[1] < fine[2]
    assert all(a <= b * (1 + 1e-9) <= c * (1 + 2e-9) for a, b, c in zip(fine, coarse, coarser, strict=True))
    # A second of 10 deg/s is a sixth of a radian at the second harmonic, and next to nothing at the first.
    assert coarse[0] == pytest.approx(fine[0], rel=2e-3)


def test_samples_within_an_interval_are_those_of_the_instrument() -> None:
    fine, coarse = turning(40.0, 10.0), turning(40.0, 2.0)
    held = (Noise(AngleRandomWalk(), 2e-6), Noise(BiasInstability(hold=5), 1e-6), Noise(RateRandomWalk(hold=5), 1e-7))
    slow = (held[0], Noise(BiasInstability(), 1e-6), Noise(RateRandomWalk(), 1e-7))
    effects = (ScaleFactor(),)
    found = [
        means(fine, effects, held, np.arange(0, 401, 5)),
        means(coarse, effects, slow),
        means(coarse, effects, held, per=5),
    ]
    for other in found[1:]:
        np.testing.assert_allclose(other.covariance, found[0].covariance, rtol=1e-9, atol=1e-25)


def test_information_of_independent_records_adds() -> None:
    motion = turning(60.0, 5.0)
    halves = [means(motion.interval(a, b), EFFECTS, WHITE[:1]).information for a, b in ((0, 150), (150, 300))]
    whole = means(motion, EFFECTS, WHITE[:1]).information
    np.testing.assert_allclose((halves[0] + halves[1]).matrix, whole.matrix, rtol=1e-10)
    # Noise that goes on from one to the other makes them no independent records.
    walks = [means(motion.interval(a, b), EFFECTS, EVERY).information for a, b in ((0, 150), (150, 300))]
    assert abs((walks[0] + walks[1]).matrix[2, 2] / means(motion, EFFECTS, EVERY).information.matrix[2, 2] - 1) > 0.01


def test_other_parameters_have_the_bound_of_the_same_quantity() -> None:
    told = means(turning(60.0, 5.0), (*EFFECTS, Bias()), EVERY).information.given({"bias.c": 1e-6})
    size = np.sqrt(np.diag(told.matrix))
    jacobian = np.linalg.qr(np.random.default_rng(0).standard_normal((6, 6)))[0] / size[:, None]
    other = told.instead([f"p{j}" for j in range(6)], jacobian)
    back = jacobian @ other.bound().cov @ jacobian.T
    # In units of what each parameter has alone: they differ by many orders.
    np.testing.assert_allclose(back * np.outer(size, size), told.bound().cov * np.outer(size, size), atol=1e-6)


def test_what_is_drawn_anew_is_the_marginal_of_both() -> None:
    told = means(turning(60.0, 5.0), (ScaleFactor(), BiasDrift()), EVERY).information
    again = {"scale_factor.c": 2e-6}
    jacobian = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    both = told.instead(("common", "drift", "own"), jacobian)
    marginal = both.given({"own": 2e-6}).bound().block(("common", "drift"))
    np.testing.assert_allclose(told.anew(again).bound().cov, marginal, rtol=1e-9)
    np.testing.assert_allclose(told.anew({}).matrix, told.matrix, rtol=1e-12)


# ------------------------------------------------------------------------------------- what nothing tells, by its name


def test_north_one_direction_names_the_encoder_with_the_earth_under_any_noise() -> None:
    effects = (EarthRate(), ScaleFactor(), Bias(), EncoderHarmonic(1))
    found = means(turning(36.0, 5.0), effects, EVERY).information.bound()
    assert sorted(map(sorted, found.unidentifiable)) == [
        ["bias.c", "scale_factor.c"],
        ["earth_rate.c", "encoder_harmonic:1.s"],
        ["earth_rate.s", "encoder_harmonic:1.c"],
    ]


def test_one_rest_names_heading_with_drift_and_a_turn_tells_them_apart() -> None:
    rest = alignment_information(VEHICLE, (Stretch(300.0),)).bound()
    assert sorted(map(sorted, rest.unidentifiable)) == [
        ["accel_x", "gyro_x", "phi_north"],
        ["accel_y", "gyro_y", "phi_east"],
        ["gyro_x", "phi_up"],
    ]
    assert np.isinf(rest.sd("phi_up")) and np.isinf(rest.sd("gyro_x"))
    assert not alignment_information(VEHICLE, procedure(300.0, [3.0], 20.0)).bound().unidentifiable


@pytest.mark.parametrize("turning_data", [True, False])
@pytest.mark.parametrize("stretches", [(Stretch(200.0),), procedure(100.0, [3.0, -3.0], 20.0)])
def test_the_information_of_a_vehicle_is_that_of_its_filter(stretches: tuple[Stretch, ...], turning_data: bool) -> None:
    told = alignment_information(VEHICLE, stretches, 0.3, turning_data).given(prior(VEHICLE))
    sd = np.sqrt(np.diag(told.bound().cov))
    np.testing.assert_allclose(sd, bound(VEHICLE, stretches, 0.3, turning_data).sd, rtol=1e-6)


SHEET = Datasheet(
    10.0,
    100.0,
    Site(latitude=0.56),
    Mounting(tilt=np.pi / 2),
    noise={"gyro": {"angle_random_walk": 3e-5, "rate_random_walk": 1e-8, "bias_instability": 2e-6}},
)


def dwells(*rates: float) -> Motion:
    """Ten seconds at each rate [deg/s]."""
    angle = np.concatenate([[0.0], np.cumsum(np.repeat(rates, 100)) * 0.1 * DEG])
    return motion_of(SHEET, angle, 0.1)


def test_a_single_rate_names_scale_factor_with_bias_and_two_rates_do_not() -> None:
    one, told = model(SHEET, dwells(20.0, 20.0))
    assert told.sensor.names == ("scale_factor.c", "bias.c") and np.isinf(list(told.sd.values())).all()
    assert one.information.bound().unidentifiable == (("scale_factor.c", "bias.c"),)
    two, _ = model(SHEET, dwells(20.0, -20.0))
    assert np.isfinite(two.information.bound().sd("scale_factor.c"))
    # One sense cannot tell a scale factor from an asymmetry.
    declared = Declared("scale_factor_asymmetry", "gyro", (0.0,), (np.inf,))
    sense, _ = model(replace(SHEET, declared=(declared,)), dwells(20.0, 10.0))
    assert sorted(sense.information.bound().unidentifiable[0]) == ["scale_factor.c", "scale_factor_asymmetry.c"]


def test_the_slope_of_two_dwells_is_the_closed_form() -> None:
    sheet = replace(SHEET, noise={"gyro": {"angle_random_walk": 3e-5}})
    found, told = model(sheet, dwells(20.0, -20.0))
    weights, perfect = slope(told, sheet, 20 * DEG)
    assert weights == {"scale_factor.c": pytest.approx(1.0), "bias.c": 0.0} and perfect == pytest.approx(0.0)
    # K = (y+ - y-) / 2 u, each mean over T with the variance N^2 / T; the Earth's rate adds to both.
    closed = 3e-5 / np.sqrt(2 * 10.0) / (20 * DEG)
    assert found.information.bound().sd("scale_factor.c") == pytest.approx(closed, rel=1e-3)


def test_cells_keep_to_a_rate_and_are_not_too_many() -> None:
    rate = np.concatenate([np.zeros(50), np.linspace(0, 1, 20_000), np.full(20_000, 1.0)])
    edges = cells(rate)
    assert edges[0] == 0 and edges[-1] == len(rate) and len(edges) <= CELLS + 1
    assert max(np.ptp(rate[a:b]) for a, b in pairwise(edges)) < 0.15
    steps = np.repeat([0.0, 1.0, -1.0, 0.2], 300)
    assert {0, 300, 600, 900, 1200} <= set(cells(steps).tolist())


def test_noises_of_a_datasheet_join_pulses_and_encoder() -> None:
    sheet = replace(SHEET, pulse=12**0.5 * 3e-6, encoder_noise=4e-6)
    told = {noise.effect.id: noise.coefficient for noise in stated_noises(sheet, "gyro")}
    assert told["quantization"] == pytest.approx(5e-6) and told["rate_random_walk"] == 1e-8
    assert stated_noises(sheet, "accel_x") == ()


def test_what_cannot_be_told_is_refused() -> None:
    motion = turning(10.0, 5.0)
    with pytest.raises(InputError, match="no noise given"):
        means(motion, (Bias(),), ())
    with pytest.raises(InputError, match="edges of cells given"):
        means(motion, (Bias(),), WHITE, [0, 3, 3])
    with pytest.raises(InputError, match=f"wanted 1 to {MOST}"):
        means(motion, (Bias(),), WHITE, [0, 3, 5], np.zeros(2, bool))
    with pytest.raises(InputError, match="has shapes"):
        means(motion, (ScaleFactorWarmUp(),), WHITE)
    with pytest.raises(InputError, match="no interval"):
        cells(np.zeros(0))
    assert isinstance(means(motion, (ScaleFactorAsymmetry(),), WHITE).information, Information)
    with pytest.raises(InputError, match="negative duration"):
        alignment_information(VEHICLE, (Stretch(-1.0),))
