"""North by revolutions: exact without noise, figures of the theory, pairings, honest covariance, chunks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from north_cases import LATITUDE, PULSE, RATE, TILT, WALK, Case, azimuths, piece, row, there_and_back, wrapped

from estimators.common import turns
from estimators.north_finder.correlation import Correlation
from estimators.north_finder.revolution import Pairing, Revolution, end_angle_bias
from estimators.rate_table.scale_factor import repeatability, scale_factor_of
from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Declared, Estimate, Estimator
from insenv.core.recording import Channel, Floats, Mounting, Recording, Segment, Site
from insenv.core.units import ARCSEC, DEG
from insenv.plants.profile import Piece

PAIRINGS: tuple[Pairing, ...] = ("forward", "non_overlapping", "centred", "predicting")
QUIET = Case(walk=0.0, pulse=0.0)
SMOOTH = replace(QUIET, walk=WALK * 3.3e-6 / 3e-4)
ROUND = np.radians(np.arange(1.0, 361.0))


def settling(total: float, tau: float = 850.0) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """A scale factor that changes by ``total`` in the first hour, by 1 - exp(-t / tau)."""
    c = total / (1 - np.exp(-3600.0 / tau))
    return ("scale_factor", (c,)), ("scale_factor_warm_up", (-c, tau))


def every(datasheet: Datasheet) -> dict[str, Estimator]:
    paired: dict[str, Estimator] = {p: Revolution(datasheet, p) for p in PAIRINGS}
    return {"correlation": Correlation(datasheet), **paired}


def read(estimator: Estimator, recording: Recording, batch: int | None = None) -> Estimate:
    return estimator.estimate(estimator.update(estimator.reset(batch), recording))


def errors(estimator: Estimator, case: Case, azimuth: Floats, seed: int = 0) -> tuple[Floats, Floats]:
    """Error of the azimuth and its standard deviation [arcsec]."""
    mean, sd = read(estimator, case.run(azimuth, seed), len(azimuth)).of("azimuth")
    return wrapped(mean - azimuth) / ARCSEC, sd / ARCSEC


def uniform(
    azimuth: float, rate: float = RATE, dt: float = 0.01, scale: Any = lambda t: 0.0, n: int = 30000
) -> Recording:
    """Uniform turning in closed form."""
    t = np.arange(n + 1.0) * dt
    a = rate * t
    level = EARTH_RATE * np.cos(LATITUDE) * np.cos(TILT)
    seen = rate * np.sin(TILT) + EARTH_RATE * np.sin(LATITUDE) * np.sin(TILT)
    gyro = seen * (1 + scale(0.5 * (t[1:] + t[:-1]))) + level * np.diff(np.sin(a - azimuth)) / np.diff(a)
    return Recording(t[1:], {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(a[1:], "rad")})


# --- without noise


@pytest.mark.parametrize("rate", [RATE, -RATE, 17.3 * DEG, -61.7 * DEG])
@pytest.mark.parametrize("name", ["correlation", *PAIRINGS])
@pytest.mark.parametrize("constant", [0.0, 1e-4])
def test_the_exact_model_gives_north_to_a_millionth_of_an_arcsecond(name: str, rate: float, constant: float) -> None:
    estimator = every(QUIET.datasheet())[name]
    for azimuth in (0.3, -2.0, 3.1):
        mean, _ = read(estimator, uniform(azimuth, rate, scale=lambda t: constant)).of("azimuth")
        assert abs(mean - azimuth) < 1e-6 * ARCSEC


@pytest.mark.parametrize("rate", [RATE, -17.3 * DEG])
@pytest.mark.parametrize("name", PAIRINGS)
def test_a_steady_drift_of_the_scale_factor_is_taken_off_exactly(name: str, rate: float) -> None:
    drift = 1e-4 / 3600
    estimate = read(every(QUIET.datasheet())[name], uniform(-2.0, rate, scale=lambda t: 3e-5 + drift * t))
    assert abs(estimate.mean[0] + 2.0) < 1e-6 * ARCSEC
    turn = 2 * np.pi / abs(rate)
    middle = 0.01 + (np.floor((300 - 0.01) / turn) - 0.5) * turn
    np.testing.assert_allclose(estimate.mean[1:], [3e-5 + drift * middle, drift], rtol=1e-6)


def test_the_angle_at_the_end_of_an_interval_costs_half_its_turn() -> None:
    recording = uniform(1.0)
    gyro, a = (recording.values(k, u)[:28800] for k, u in (("gyro", "rad/s"), ("table_angle", "rad")))
    matrix = np.stack([np.ones_like(a), np.cos(a), np.sin(a)], axis=-1)
    _, c, s = np.linalg.lstsq(matrix, gyro, rcond=None)[0]
    assert end_angle_bias(RATE, 0.01) / ARCSEC == pytest.approx(-180.0, abs=1e-9)
    # The paper's phi is minus the azimuth.
    assert -(np.arctan2(s, c) - 1.0) / ARCSEC == pytest.approx(-180.0, abs=0.005)


def test_a_ramp_of_the_scale_factor_leaks_into_the_correlation_as_the_closed_form_says() -> None:
    total, time = 1e-6, 288.0
    case = replace(QUIET, effects=(("scale_factor_drift", (total / time,)),), sampling=20.0)
    error, _ = errors(Correlation(case.datasheet()), case, ROUND)
    closed = np.sqrt(2) * total * np.tan(TILT) / (time * EARTH_RATE * np.cos(LATITUDE)) / ARCSEC
    assert closed == pytest.approx(10.47, abs=0.01)
    assert error.std(ddof=1) == pytest.approx(closed, rel=0.01)


@pytest.mark.parametrize("ppm", [2, 10, 100])
def test_the_papers_table_2_by_correlation(ppm: int) -> None:
    case = replace(SMOOTH, effects=settling(ppm * 1e-6), sampling=20.0)
    error, _ = errors(Correlation(case.datasheet()), case, ROUND)
    paper = {2: 6.10, 10: 31.99, 100: 303.88}[ppm]
    assert error.std(ddof=1) == pytest.approx(paper, rel=0.06)


@pytest.mark.parametrize(
    ("pairing", "wanted"), [("forward", 5.39), ("non_overlapping", 2.08), ("centred", 2.08), ("predicting", 19.3)]
)
def test_the_papers_table_3_at_100_ppm(pairing: str, wanted: float) -> None:
    case = replace(SMOOTH, effects=settling(1e-4), sampling=20.0)
    error, _ = errors(every(case.datasheet())[pairing], case, ROUND)
    # 360 draws: the standard deviation of a standard deviation is 4 %, and noise is a small part of it.
    assert error.std(ddof=1) == pytest.approx(wanted, abs=max(0.2, 0.1 * wanted))


# --- turning


def test_both_directions_and_a_change_of_rate_join() -> None:
    profile = (Piece(130.0, RATE), Piece(60.0, -2 * RATE), Piece(np.inf, -1.2 * RATE))
    case = replace(QUIET, profile=profile, acceleration=20 * DEG, effects=(("scale_factor", (1e-4,)),))
    azimuth = azimuths(5)
    for name, estimator in every(case.datasheet()).items():
        error, _ = errors(estimator, case, azimuth)
        assert np.abs(error).max() < 0.05, name  # the change of rate within 5 % belongs to a stretch


def test_the_scale_factor_is_that_of_the_last_stretch_with_a_pair() -> None:
    case = replace(QUIET, profile=there_and_back(), acceleration=20 * DEG, effects=(("scale_factor", (5e-5,)),))
    estimate = read(Revolution(case.datasheet()), case.run(azimuths(3)), 3)
    np.testing.assert_allclose(estimate.of("scale_factor")[0], 5e-5, rtol=1e-6)


@pytest.mark.parametrize("rate", [0.0, 1 * DEG])
def test_without_enough_revolutions_there_is_the_prior(rate: float) -> None:
    recording = uniform(1.0, 1e-300 if rate == 0 else rate)
    recording = replace(recording, channels={**recording.channels, "table_angle": Channel(rate * recording.t, "rad")})
    for estimator in every(Case().datasheet()).values():
        for estimate in (read(estimator, recording), estimator.estimate(estimator.reset())):
            assert estimate.mean[0] == 0.0
            assert estimate.cov[0, 0] == pytest.approx(np.pi**2 / 3)
            assert np.isfinite(estimate.cov).all()


def test_at_the_pole_there_is_no_north() -> None:
    sheet = replace(Case().datasheet(), site=Site(latitude=np.pi / 2))
    assert read(Revolution(sheet), uniform(1.0)).cov[0, 0] == pytest.approx(np.pi**2 / 3)


def test_a_gap_and_a_missing_value_cost_a_revolution_and_nothing_else() -> None:
    whole = uniform(1.0, scale=lambda t: 1e-5)
    gyro = whole.values("gyro", "rad/s").copy()
    gyro[15000] = np.nan
    holed = replace(whole, channels={**whole.channels, "gyro": Channel(gyro, "rad/s", "interval")})
    kept = np.r_[:15000, 15007:30000]
    channels = {k: replace(c, values=c.values[kept]) for k, c in whole.channels.items()}
    for estimator in every(QUIET.datasheet()).values():
        for recording in (holed, replace(whole, t=whole.t[kept], channels=channels)):
            assert abs(read(estimator, recording).mean[0] - 1.0) < 1e-6 * ARCSEC


def test_a_gyro_in_the_table_plane_has_north_but_no_scale_factor() -> None:
    case = replace(QUIET, tilt=0.0)
    azimuth = azimuths(3)
    for name, estimator in every(case.datasheet()).items():
        estimate = read(estimator, case.run(azimuth), 3)
        if name == "correlation":
            np.testing.assert_allclose(estimate.mean[:, 0], azimuth, atol=1e-6 * ARCSEC)
        else:
            np.testing.assert_allclose(estimate.cov[:, 0, 0], np.pi**2 / 3)


def test_a_pairing_that_is_not_there_is_refused() -> None:
    with pytest.raises(InputError, match="pairing 'backward' given, wanted one of forward, non_overlapping"):
        Revolution(Case().datasheet(), "backward")  # type: ignore[arg-type]


# --- how a run is cut up


@pytest.mark.parametrize("cuts", [(1, 2, 3, 3600, 3601, 7777), tuple(range(100, 8000, 100))])
def test_chunks_make_no_difference(cuts: tuple[int, ...]) -> None:
    case = replace(Case(), profile=there_and_back(17 * DEG, 40.0), acceleration=20 * DEG, duration=80.0)
    recording = case.run(azimuths(3))
    for estimator in every(case.datasheet()).values():
        whole, state = read(estimator, recording, 3), estimator.reset(3)
        for a, b in zip([0, *cuts], [*cuts, 8000], strict=True):
            state = estimator.update(state, piece(recording, a, b))
        parts = estimator.estimate(state)
        np.testing.assert_array_equal(parts.mean, whole.mean)
        np.testing.assert_array_equal(parts.cov, whole.cov)


def test_a_row_of_a_batch_is_the_single_run() -> None:
    case = replace(Case(), profile=there_and_back(17 * DEG, 40.0), acceleration=20 * DEG, duration=80.0)
    recording = case.run(azimuths(3))
    for estimator in every(case.datasheet()).values():
        batch = read(estimator, recording, 3)
        for i in range(3):
            single = read(estimator, row(recording, i))
            np.testing.assert_array_equal(single.mean, batch.mean[i])
            np.testing.assert_array_equal(single.cov, batch.cov[i])


def test_an_update_leaves_the_state_before_as_it_was() -> None:
    estimator, recording = Revolution(Case().datasheet()), uniform(1.0)
    before = estimator.update(estimator.reset(), piece(recording, 0, 9000))
    copies = [np.copy(getattr(before, name)) for name in before.__dataclass_fields__]
    estimator.update(before, piece(recording, 9000, 30000))
    for name, copy in zip(before.__dataclass_fields__, copies, strict=True):
        np.testing.assert_array_equal(getattr(before, name), copy)
    assert before.closed.shape == (2, turns.WIDTH)


# --- noise


# 400 runs: the standard deviation is known to 3.5 %; bounds at 3.5 of that on either side of the theory's figure,
# so that a false alarm has the probability 5e-4.
@pytest.mark.slow
@pytest.mark.parametrize("ppm", [0, 10, 100])
def test_figures_of_the_theory_with_pulses_and_random_walk(ppm: int) -> None:
    case = replace(Case(), sampling=50.0, effects=settling(ppm * 1e-6) if ppm else ())
    azimuth, estimators = azimuths(400, 5), every(case.datasheet())
    recording = case.run(azimuth, 7)
    wanted = {"forward": 37.7, "non_overlapping": 45.2, "centred": 37.7} | ({"correlation": 37.5} if not ppm else {})
    for name, figure in wanted.items():
        error = wrapped(read(estimators[name], recording, 400).mean[:, 0] - azimuth) / ARCSEC
        assert error.std(ddof=1) == pytest.approx(figure, rel=0.125), name


# z-scores of 300 runs: their spread has the standard deviation 0.041; 0.15 is 3.7 of it, a false alarm has the
# probability 2e-4 for each figure.
@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        replace(Case(), sampling=50.0),
        replace(Case(), sampling=50.0, walk=0.1 * WALK, pulse=0.0, encoder_noise=0.3 * ARCSEC),
        replace(Case(), sampling=50.0, profile=there_and_back(17.3 * DEG), acceleration=20 * DEG),
    ],
    ids=["published", "encoder noise", "both directions"],
)
def test_covariances_are_honest(case: Case) -> None:
    azimuth = azimuths(300, 2)
    recording = case.run(azimuth, 11)
    for name, estimator in every(case.datasheet()).items():
        estimate = read(estimator, recording, 300)
        for quantity in ("azimuth", "scale_factor", "scale_factor_rate"):
            if quantity in estimate.names:
                mean, sd = estimate.of(quantity)
                z = (wrapped(mean - azimuth) if quantity == "azimuth" else mean) / sd
                assert z.std(ddof=1) == pytest.approx(1.0, abs=0.15), (name, quantity)
                assert abs(z.mean()) < 0.25, (name, quantity)


@pytest.mark.slow
def test_covariances_are_honest_where_the_scale_factor_drifts_as_declared() -> None:
    sd = 3e-6 / 300
    told = Declared("scale_factor_drift", "gyro", (0.0,), (sd,))
    case = replace(Case(), sampling=50.0, pulse=0.0, declared=(told,))
    azimuth = azimuths(300, 3)
    recording = case.run(azimuth, 13)
    drift = sd * np.random.default_rng(4).standard_normal((300, 1)) * (recording.t - 0.01)
    gyro = recording.values("gyro", "rad/s") + drift * RATE * np.sin(TILT)
    drifting = replace(recording, channels={**recording.channels, "gyro": Channel(gyro, "rad/s", "interval")})
    for name, estimator in every(case.datasheet()).items():
        mean, deviation = read(estimator, drifting, 300).of("azimuth")
        assert (wrapped(mean - azimuth) / deviation).std(ddof=1) == pytest.approx(1.0, abs=0.15), name


def test_a_declared_warm_up_counts_as_an_error_of_its_size() -> None:
    effects = settling(1e-4)
    told = tuple(Declared(key, "gyro", values, (0.0,) * len(values)) for key, values in effects)
    case = replace(QUIET, effects=effects, declared=told, sampling=20.0)
    for name, estimator in every(case.datasheet()).items():
        error, sd = errors(estimator, case, ROUND)
        # Without noise the error is what is declared, of one sign or the other.
        np.testing.assert_allclose(np.abs(error), sd, rtol=0.03, atol=0.02 * sd.max(), err_msg=name)


def test_a_declared_encoder_harmonic_counts_as_an_error_of_its_size() -> None:
    told = Declared("encoder_harmonic:1", "gyro", (0.0, 0.0), (0.1 * ARCSEC, 0.1 * ARCSEC))
    _, sd = errors(Correlation(replace(QUIET, declared=(told,)).datasheet()), QUIET, ROUND[:5])
    np.testing.assert_allclose(sd, 180.4, rtol=0.005)


def test_a_lock_in_that_is_declared_is_part_of_the_scale_factor() -> None:
    threshold, rise = 0.05 * DEG, 0.2
    told = Declared("lock_in_wander", "gyro", (threshold, rise, 850.0, 0.0), (0.0,) * 4)
    sheet = replace(QUIET, declared=(told,)).datasheet()
    u = RATE * np.sin(TILT) + EARTH_RATE * np.sin(LATITUDE) * np.sin(TILT)

    def lock(t: Floats) -> Floats:
        relative: Floats = -0.5 * (threshold * (1 + rise * (1 - np.exp(-t / 850.0))) / u) ** 2
        return relative

    recording = uniform(0.7, scale=lock)
    for name, estimator in every(sheet).items():
        estimate = read(estimator, recording)
        assert abs(estimate.mean[0] - 0.7) == pytest.approx(estimate.sd[0], rel=0.02, abs=1e-3 * ARCSEC), name
        if name != "correlation":
            scale, sd = estimate.of("scale_factor")
            assert scale == pytest.approx(lock(np.array([270.01]))[0], abs=1e-7)
            assert sd < 1e-7


# --- scale-factor test

TABLE_1 = (0.46634190, 0.46635057, 0.46634894, 0.46634916, 0.46634373, 0.46634242, 0.46634518, 0.46634614)


def test_statistic_of_the_printed_scale_factors() -> None:
    mean, spread = repeatability(TABLE_1)
    assert mean == pytest.approx(0.46634601, abs=1e-8)
    assert spread == pytest.approx(7.02e-6, abs=0.005e-6)


def test_repeatability_wants_two_values() -> None:
    with pytest.raises(InputError, match="wanted two or more"):
        repeatability([1.0])


def dwells(case: Case, seconds: float) -> tuple[Segment, ...]:
    n, each = round(case.duration * case.sampling), round(seconds * case.sampling)
    starts = np.arange(0, n, each) + 10
    return tuple(Segment(f"dwell {i}", int(a), int(a) + each - 20) for i, a in enumerate(starts))


def test_a_scale_factor_test_finds_the_pulse_whatever_the_bias() -> None:
    profile = (Piece(80.0, 100 * DEG), Piece(80.0, -100 * DEG), Piece(80.0, 60 * DEG), Piece(np.inf, -60 * DEG))
    effects = (("scale_factor", (-2e-5,)), ("bias", (1e-6,)))
    case = replace(QUIET, tilt=np.pi / 2, duration=320.0, profile=profile, effects=effects)
    recording = replace(row(case.run(azimuths(1)), 0), mounting=Mounting(np.pi / 2))
    values = scale_factor_of(recording, dwells(case, 80.0), PULSE)
    assert values.shape == (2,)
    np.testing.assert_allclose(values / PULSE, 1 / (1 - 2e-5), atol=1e-10)


def test_dwells_of_a_scale_factor_test_are_checked() -> None:
    recording = replace(uniform(1.0), mounting=Mounting(TILT))
    whole, short = Segment("a", 0, 15000), Segment("b", 0, 100)
    with pytest.raises(InputError, match="1 dwells given, wanted pairs"):
        scale_factor_of(recording, [whole], PULSE)
    with pytest.raises(InputError, match="dwell 'a' and the next turn the same way"):
        scale_factor_of(recording, [whole, whole], PULSE)
    with pytest.raises(InputError, match="dwell 'b' has no whole turn"):
        scale_factor_of(recording, [whole, short], PULSE)
