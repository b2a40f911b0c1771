"""Level of the table from an accelerometer: exact without noise, relation to north, honest covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from north_cases import piece, row, wrapped

from estimators.north_finder.levelling import Levelling, level_error, north_error
from insenv.core.earth import gravity
from insenv.core.estimate import Datasheet, Declared, Estimate
from insenv.core.recording import Channel, Floats, Mounting, Recording, Site
from insenv.core.units import ARCSEC, DEG, UG
from insenv.effects.base import Effect
from insenv.effects.catalogue import by_key
from insenv.plants.profile import Piece, Profile, constant
from insenv.plants.turntable import Turntable
from insenv.rig import Fitted, Normals, Rig
from insenv.sensors.chain import Sensor

LATITUDE, RATE, SAMPLING = 40 * DEG, 10 * DEG, 20.0
G = float(gravity(LATITUDE))
STEADY = constant(RATE, np.inf)
Planted = tuple[tuple[str, tuple[float, ...]], ...]


def run(
    azimuth: Floats,
    tilt: tuple[Floats, Floats],
    effects: Planted = (),
    profile: Profile = STEADY,
    seed: int = 0,
    duration: float = 120.0,
) -> Recording:
    """A batch on a table that is out of level by ``tilt`` = (east, north)."""
    table = Turntable(
        latitude=LATITUDE,
        azimuth=azimuth,
        level_error=tilt,
        gravity=G,
        carries=("gyro", "accel_x"),
        profile=profile,
        max_acceleration=20 * DEG,
    )
    chain: tuple[Effect, ...] = tuple(by_key(key) for key, _ in effects)
    theta = np.array([v for _, values in effects for v in values])
    rig = Rig(table, (Fitted(Sensor("accel_x", chain), theta),), SAMPLING)
    n, normals = round(duration * SAMPLING), Normals(rig, seed, len(azimuth))
    readings, _ = rig.advance(rig.begin(normals.start()), None, n, normals.draw(n))
    accel = np.broadcast_to(readings.outputs["accel_x"], (len(azimuth), n))
    angle = np.broadcast_to(readings.references["table_angle"].values, (len(azimuth), n))
    channels = {"accel_x": Channel(accel, "m/s^2", "interval"), "table_angle": Channel(angle, "rad")}
    return Recording(readings.t, channels)


def sheet(noise: dict[str, float] | None = None, declared: tuple[Declared, ...] = ()) -> Datasheet:
    return Datasheet(
        SAMPLING, 120.0, Site(LATITUDE), Mounting(30 * DEG), noise={"accel_x": noise or {}}, declared=declared
    )


def read(estimator: Levelling, recording: Recording, batch: int | None) -> Estimate:
    return estimator.estimate(estimator.update(estimator.reset(batch), recording))


def cases(count: int) -> tuple[Floats, tuple[Floats, Floats]]:
    rng = np.random.default_rng(3)
    east, north = 20 * ARCSEC * rng.standard_normal((2, count))
    return np.pi * (1 - 2 * rng.random(count)), (east, north)


def known(azimuth: Floats, sd: float = 0.0) -> Estimate:
    return Estimate(("azimuth",), ("rad",), azimuth[:, None], np.full((len(azimuth), 1, 1), sd**2))


@pytest.mark.parametrize("profile", [STEADY, (Piece(60.0, -2 * RATE), Piece(np.inf, 1.5 * RATE))])
def test_the_level_error_is_found_exactly_whatever_the_bias(profile: Profile) -> None:
    azimuth, (east, north) = cases(6)
    recording = run(azimuth, (east, north), (("bias", (1e-3,)),), profile)
    level = read(Levelling(sheet()), recording, 6)
    found_east, found_north = level_error(level, azimuth)
    np.testing.assert_allclose(found_east, east, atol=1e-6 * ARCSEC)
    np.testing.assert_allclose(found_north, north, atol=1e-6 * ARCSEC)


def test_readings_at_an_instant_are_taken_at_the_end_of_the_interval() -> None:
    angle = RATE * np.arange(1.0, 2401.0) / SAMPLING
    accel = 0.02 + G * (3e-5 * np.cos(angle) - 5e-5 * np.sin(angle))
    channels = {"accel_x": Channel(accel, "m/s^2"), "table_angle": Channel(angle, "rad")}
    level = read(Levelling(sheet()), Recording(np.arange(1, 2401) / SAMPLING, channels), None)
    np.testing.assert_allclose(level.mean, [3e-5, -5e-5], atol=1e-6 * ARCSEC)


def test_north_is_off_by_the_tilt_about_north_times_the_tangent_of_the_latitude() -> None:
    azimuth, (east, north) = cases(6)
    level = read(Levelling(sheet()), run(azimuth, (east, north)), 6)
    error, sd = north_error(level, known(azimuth), LATITUDE)
    np.testing.assert_allclose(error, north * np.tan(LATITUDE), atol=1e-6 * ARCSEC)
    assert 10 * ARCSEC * np.tan(LATITUDE) / ARCSEC == pytest.approx(8.39, abs=0.005)
    np.testing.assert_allclose(sd, 0.0, atol=1e-9 * ARCSEC)
    # To first order in the level, the table's own Earth rate is turned by the same angle.
    c, s = Turntable(latitude=LATITUDE, azimuth=azimuth, level_error=(east, north)).horizontal_earth_rate
    np.testing.assert_allclose(wrapped(np.arctan2(s, c) - azimuth), error, atol=0.02 * ARCSEC)


def test_an_uncertain_azimuth_enters_the_error_of_north() -> None:
    azimuth, (east, north) = cases(6)
    level = read(Levelling(sheet()), run(azimuth, (east, north)), 6)
    _, sd = north_error(level, known(azimuth, 0.1), LATITUDE)
    np.testing.assert_allclose(sd, 0.1 * np.abs(east) * np.tan(LATITUDE), rtol=1e-6)


def test_without_a_revolution_there_is_the_prior() -> None:
    azimuth, tilt = cases(2)
    estimator = Levelling(sheet(), prior=0.01)
    level = read(estimator, run(azimuth, tilt, profile=constant(0.0, np.inf)), 2)
    np.testing.assert_array_equal(level.mean, 0.0)
    np.testing.assert_allclose(level.sd, 0.01)


def test_chunks_and_rows_of_a_batch_make_no_difference() -> None:
    azimuth, tilt = cases(3)
    estimator = Levelling(sheet({"angle_random_walk": 1e-5}))
    recording = run(azimuth, tilt, (("angle_random_walk", (1e-5,)),))
    whole, state = read(estimator, recording, 3), estimator.reset(3)
    for a, b in ((0, 1), (1, 20), (20, 721), (721, 2400)):
        state = estimator.update(state, piece(recording, a, b))
    for i in range(3):
        single = read(estimator, row(recording, i), None)
        for estimate in (estimator.estimate(state), whole):
            np.testing.assert_array_equal(estimate.mean[i], single.mean)
            np.testing.assert_array_equal(estimate.cov[i], single.cov)


def test_gravity_is_that_of_the_site() -> None:
    assert Levelling(sheet()).gravity == pytest.approx(G)
    assert Levelling(replace(sheet(), site=Site(gravity=9.7))).gravity == 9.7
    assert Levelling(replace(sheet(), site=Site())).gravity == 9.80665


# z-scores of 300 runs and two quantities: their spread has a standard deviation of at most 0.041 (0.029 if they are
# independent); 0.15 is 3.7 of it, a false alarm has the probability 2e-4.
@pytest.mark.slow
@pytest.mark.parametrize(
    "noise",
    [{"angle_random_walk": 2.2 * UG}, {"bias_instability": 5 * UG}, {"rate_random_walk": 0.5 * UG}],
    ids=lambda noise: next(iter(noise)),
)
def test_covariances_are_honest(noise: dict[str, float]) -> None:
    azimuth, (east, north) = cases(300)
    recording = run(azimuth, (east, north), tuple((k, (v,)) for k, v in noise.items()), seed=5)
    level = read(Levelling(sheet(noise)), recording, 300)
    found = np.array(level_error(level, azimuth)).T
    z = (found - np.stack([east, north], axis=-1)) / np.sqrt(0.5 * (level.sd**2).sum(axis=-1, keepdims=True))
    assert z.std(ddof=1) == pytest.approx(1.0, abs=0.15)
    error, sd = north_error(level, known(azimuth), LATITUDE)
    assert ((error - north * np.tan(LATITUDE)) / sd).std(ddof=1) == pytest.approx(1.0, abs=0.15)


def test_a_declared_drift_of_the_bias_counts_as_an_error_of_its_size() -> None:
    azimuth, (east, north) = cases(4)
    drift = 1e-6
    told = Declared("bias_drift", "accel_x", (drift,), (0.0,))
    recording = run(azimuth, (east, north), (("bias_drift", (drift,)),))
    level = read(Levelling(sheet(declared=(told,))), recording, 4)
    wanted = np.stack(
        [east * np.cos(azimuth) - north * np.sin(azimuth), east * np.sin(azimuth) + north * np.cos(azimuth)]
    )
    error = level.mean - wanted.T
    np.testing.assert_allclose(np.hypot(*error.T), np.sqrt((level.sd**2).sum(axis=-1)), rtol=0.01)
