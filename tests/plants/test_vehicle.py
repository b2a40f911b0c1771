"""The vehicle: increments that a mechanisation without errors closes on, turns, sway, settling, sightings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from insenv.core import earth
from insenv.core.attitude import dcm_from_angles, misalignment
from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.rows import rows
from insenv.core.units import ARCMIN, ARCSEC, DEG
from insenv.navigation.strapdown import Navigation, StrapdownPath, full_mechanisation, initial, static_mechanisation
from insenv.navigation.truth import increments, turn
from insenv.plants.base import Scene
from insenv.plants.vehicle import Vehicle
from insenv.plants.vehicle_frame import Slope
from insenv.plants.vehicle_sight import OpticalSight, orientation_error, wrapped
from insenv.plants.vehicle_sway import Band, Settling, Sway, SwayLine, highest, waves

LATITUDE, ALTITUDE, RATE = 38 * DEG, 380.0, 100
SITE: dict[str, Any] = {
    "latitude": LATITUDE,
    "altitude": ALTITUDE,
    "gravity": float(earth.gravity(LATITUDE, ALTITUDE)),
    "max_rate": 10 * DEG,
    "max_acceleration": 10 / 3 * DEG,
}
TURNING = Vehicle(**SITE, profile=((5.0, 170 * DEG),))
#: A turn whose course changes within intervals, not at their edges.
ODD = replace(TURNING, max_rate=9.71 * DEG, max_acceleration=3.07 * DEG, profile=((5.003, 170 * DEG),))


def sway(*lines: SwayLine, band: Band | None = None, seed: int | None = None) -> Sway:
    draw = None if seed is None else np.random.default_rng(seed)
    return Sway((0.0, 0.0, 1.0), 0.0, waves(lines, band, draw), highest(lines, band))


WIND, ENGINE = SwayLine(1.5, 0.5 * ARCMIN), SwayLine(25.0, 10 * ARCSEC)
EVERYTHING = Vehicle(
    **SITE,
    heading=1.0,
    pitch=0.02,
    roll=-0.03,
    slope=Slope(3 * DEG, 1.0),
    lever_arm=(1.0, 0.5, 0.2),
    deflection=(2e-5, -3e-5),
    sway=sway(WIND, band=Band(0.05, 0.3, ARCMIN), seed=1),
    residual=Settling(0.01, 2.0),
    creep=Settling(1e-3 / 20, 20.0),
    sight=OpticalSight(0.01, 1e-4, 1e-4, after_turns=True),
    level_error=(1e-3, -1e-3),
    profile=((3.0, 30 * DEG), (2.0, -60 * DEG)),
)


def edges(duration: float, rate: int = RATE) -> Floats:
    return np.arange(round(duration * rate) + 1) / rate


def played(vehicle: Vehicle, t: Floats, z: Floats | None = None) -> Scene:
    normals = np.zeros((vehicle.draws, len(t) - 1)) if z is None else z
    return vehicle.advance(vehicle.begin(), None, t, normals)[0]


def triads(scene: Scene) -> tuple[Floats, Floats]:
    """Mean rate and mean specific force, shape (..., n, 3)."""
    gyro = np.stack([scene.motions[f"gyro_{axis}"].rate for axis in "xyz"], axis=-1)
    accel = np.stack([scene.motions[f"accel_{axis}"].force[axis] for axis in "xyz"], axis=-1)
    return gyro, accel


def reference(scene: Scene, *names: str) -> Floats:
    return np.stack([scene.references[name].values for name in names], axis=-1)


ATTITUDE, VELOCITY = ("heading", "pitch", "roll"), ("velocity_east", "velocity_north", "velocity_up")
Mechanisation = Callable[..., tuple[StrapdownPath, Navigation]]


def closure(vehicle: Vehicle, t: Floats, mechanisation: Mechanisation) -> tuple[Floats, Floats]:
    """Largest error of attitude [rad] and of velocity [m/s], east, north, up, from the first row on."""
    scene = played(vehicle, t)
    angles, velocity = reference(scene, *ATTITUDE), reference(scene, *VELOCITY)
    dcm = dcm_from_angles(*np.moveaxis(angles, -1, 0))
    dt = 1 / round((len(t) - 1) / t[-1])
    gyro, accel = (x * dt for x in triads(scene))
    start = initial(dcm[0], (LATITUDE, 0.0, ALTITUDE), velocity[0])
    start = replace(start, previous=np.concatenate([gyro[0], accel[0]]), samples=1)
    found, _ = mechanisation(gyro[1:], accel[1:], dt, start)
    phi = misalignment(found.dcm, dcm[1:])
    return np.abs(phi).max(axis=0), np.abs(found.velocity - velocity[1:]).max(axis=0)


# --------------------------------------------------------------------------------------------------- closure


@pytest.mark.parametrize(
    ("vehicle", "rate", "degrees", "speed"),
    [
        (Vehicle(**SITE), 100, 1e-15, 1e-12),
        (TURNING, 100, 2e-11, 1e-9),
        (ODD, 100, 2e-11, 1e-9),
        (replace(TURNING, slope=Slope(3 * DEG, 1.0)), 100, 2e-11, 2e-9),
        (replace(TURNING, lever_arm=(1.0, 0.5, 0.2)), 100, 1e-8, 1.5e-7),
        (replace(TURNING, residual=Settling(0.01, 2.0), creep=Settling(5e-5, 20.0)), 100, 1e-8, 1e-7),
        # Beyond a few hertz it is the mechanisation's own coning and sculling that is left: it falls with the rate.
        (Vehicle(**SITE, sway=sway(WIND)), 100, 1e-8, 1e-8),
        (replace(TURNING, sway=sway(WIND)), 100, 1e-8, 1e-7),
        (Vehicle(**SITE, sway=sway(ENGINE)), 1000, 1e-8, 1e-7),
        (replace(EVERYTHING, deflection=(0.0, 0.0)), 100, 1e-7, 2e-6),
    ],
    ids=["rest", "turn", "corners", "slope", "lever", "settling", "sway", "sway-turn", "engine", "everything"],
)
def test_the_full_mechanisation_finds_heading_level_and_velocity(
    vehicle: Vehicle, rate: int, degrees: float, speed: float
) -> None:
    angle, velocity = closure(vehicle, edges(40.0 if rate == RATE else 10.0, rate), full_mechanisation)
    assert angle.max() < degrees * DEG
    assert velocity.max() < speed


@pytest.mark.parametrize("vehicle", [Vehicle(**SITE), TURNING, replace(TURNING, slope=Slope(3 * DEG, 1.0))])
def test_the_static_mechanisation_does_so_where_the_instruments_stay_in_place(vehicle: Vehicle) -> None:
    angle, velocity = closure(vehicle, edges(40.0), static_mechanisation)
    assert angle.max() < 2e-11 * DEG
    assert velocity.max() < 2e-9


def test_in_sway_the_static_mechanisation_lacks_the_coriolis_force_alone() -> None:
    angle, velocity = closure(Vehicle(**SITE, sway=sway(WIND)), edges(40.0), static_mechanisation)
    assert angle.max() < 1e-8 * DEG
    # 2 w_ie times the way of the instruments: 1 m times two amplitudes of 0.7 arcmin.
    assert velocity.max() < 1.05 * 2 * earth.EARTH_RATE * 2 * np.sqrt(2) * WIND.rms


def test_the_engine_is_left_to_the_sampling_not_to_the_truth() -> None:
    vehicle = Vehicle(**SITE, sway=sway(ENGINE))
    coarse = closure(vehicle, edges(5.0, 100), full_mechanisation)[1].max()
    fine = closure(vehicle, edges(5.0, 800), full_mechanisation)[1].max()
    assert fine < coarse / 500  # fourth order: 8^4 = 4096


def test_a_turn_is_that_of_the_quadrature_over_a_path() -> None:
    vehicle = replace(TURNING, heading=0.4, pitch=0.01, roll=-0.02, slope=Slope(3 * DEG, 2.0))
    t = edges(30.0)
    scene = played(vehicle, t)
    angle = scene.motions["gyro_z"].angle
    assert angle is not None
    speed = np.clip(np.minimum(t - 5, 25 - t) * vehicle.max_acceleration, 0, vehicle.max_rate)
    path = turn(t, angle, speed, vehicle.attitude, (LATITUDE, 0.0, ALTITUDE), vehicle.slope.dcm[:, 2])
    for found, wanted in zip(triads(scene), increments(path, t), strict=True):
        np.testing.assert_allclose(found / RATE, wanted, rtol=0, atol=1e-13)


def test_a_deflected_vertical_tilts_gravity_alone() -> None:
    scene = played(Vehicle(**SITE, deflection=(1e-4, -2e-4)), edges(0.1))
    gravity = SITE["gravity"]
    np.testing.assert_allclose(triads(scene)[1][0], [-2e-4 * gravity, 1e-4 * gravity, gravity], rtol=1e-12)
    np.testing.assert_allclose(triads(scene)[0][0], earth.earth_rate_enu(LATITUDE), rtol=1e-12)


def test_without_a_latitude_the_earth_does_not_turn() -> None:
    assert not triads(played(Vehicle(), edges(0.1)))[0].any()


# ---------------------------------------------------------------------------------------------------- pure


def values(scene: Scene) -> dict[str, Floats]:
    found = {f"reference {name}": r.values for name, r in scene.references.items()}
    for name, motion in scene.motions.items():
        found[name] = motion.rate
        found |= {f"{name} force {axis}": force for axis, force in motion.force.items()}
        found |= {f"{name} cross {axis}": rate for axis, rate in motion.cross_rate.items()}
        if motion.rate_edges is not None:
            found[f"{name} edges"] = motion.rate_edges[..., 1:]
    return found


@pytest.mark.parametrize("sizes", [(1, 2, 997), (300, 700), (499, 1, 500), (250, 250, 250, 250)])
def test_chunks_are_the_whole_bit_for_bit(sizes: tuple[int, ...]) -> None:
    t, z = edges(10.0), np.random.default_rng(0).standard_normal((1, 1000))
    whole, state, parts = values(played(EVERYTHING, t, z)), EVERYTHING.begin(), []
    for first, n in zip(np.cumsum((0, *sizes)), sizes, strict=False):
        scene, state = EVERYTHING.advance(state, None, t[first : first + n + 1], z[..., first : first + n])
        parts.append(values(scene))
    for name, wanted in whole.items():
        np.testing.assert_array_equal(np.concatenate([part[name] for part in parts]), wanted, err_msg=name)


def test_how_finely_the_motion_is_resolved_does_not_show() -> None:
    t = edges(20.0)
    coarse, fine = (
        values(played(replace(EVERYTHING, sway=replace(EVERYTHING.sway, fastest=fastest)), t)) for fastest in (1.5, 8.0)
    )
    for name, wanted in fine.items():
        # Rounding of forces of 10 m/s^2 and angles of 1 rad.
        np.testing.assert_allclose(coarse[name], wanted, rtol=0, atol=2e-13, err_msg=name)


def test_a_mean_is_that_of_the_values_within_the_interval() -> None:
    # Simpson's rule over 40 parts of an interval, on edges of a sampling that is 80 times as fast: to (w dt / 80)^4.
    coarse, fine = played(EVERYTHING, edges(10.0)), played(EVERYTHING, edges(10.0, 80 * RATE))
    weights = np.array([1.0, *[4.0, 2.0] * 39, 4.0, 1.0]) / 240
    for axis in "xyz":
        at_edges = fine.motions[f"gyro_{axis}"].rate_edges
        assert at_edges is not None
        mean = np.lib.stride_tricks.sliding_window_view(at_edges, 81)[::80] @ weights
        # But where a turn changes its course within an interval.
        off = np.abs(coarse.motions[f"gyro_{axis}"].rate - mean)
        assert np.sort(off)[:-8].max() < 1e-13 and off.max() < 1e-5


def batch_of(n: int) -> Vehicle:
    draws = [np.random.default_rng(i) for i in range(n)]
    each: Floats = np.arange(n, dtype=np.float64)
    lines, band = (WIND,), Band(0.05, 0.3, ARCMIN)
    return replace(
        EVERYTHING,
        heading=np.array([d.uniform(-3, 3) for d in draws]),
        sway=replace(EVERYTHING.sway, waves=np.stack([waves(lines, band, d) for d in draws])),
        sight=OpticalSight(1e-2 * each, 1e-4 * each, 1e-4, after_turns=True),
        level_error=(1e-3 * each, -1e-3 * each),
        profile=(),
    )


def alone(vehicle: Vehicle, i: int) -> Vehicle:
    assert isinstance(vehicle.heading, np.ndarray) and vehicle.sway.waves is not None
    assert vehicle.sight is not None and vehicle.level_error is not None
    sight = vehicle.sight
    return replace(
        vehicle,
        heading=float(vehicle.heading[i]),
        sway=replace(vehicle.sway, waves=vehicle.sway.waves[i]),
        sight=replace(sight, installation=sight.installation[i], orientation=sight.orientation[i]),  # type: ignore[index]
        level_error=(vehicle.level_error[0][i], vehicle.level_error[1][i]),  # type: ignore[index]
    )


def test_a_row_of_a_batch_is_the_run_alone_bit_for_bit() -> None:
    together, t = batch_of(4), edges(30.0)
    z = np.random.default_rng(5).standard_normal((4, 1, len(t) - 1))
    commands = {0: [0.0, 0.3, np.nan, -0.2], 400: [0.1, 0.5, 0.0, np.nan], 2000: [0.4, -0.3, 0.0, 0.2]}
    starts, state, singles = sorted(commands), together.begin(), [alone(together, i).begin() for i in range(4)]
    for first, last in zip(starts, [*starts[1:], len(t) - 1], strict=True):
        part, command = t[first : last + 1], np.array(commands[first])
        scene, state = together.advance(state, command, part, z[..., first:last])
        for i in range(4):
            own = z[i, :, first:last]
            one, singles[i] = alone(together, i).advance(singles[i], command[i], part, own)
            for name, wanted in values(one).items():
                found = values(scene)[name]
                np.testing.assert_array_equal(
                    found[i] if found.ndim > wanted.ndim or found.ndim == 2 else found, wanted
                )
    kept = rows(state, np.array([2, 0]))
    np.testing.assert_array_equal(kept.before, state.before[[2, 0]])
    np.testing.assert_array_equal(kept.tails, state.tails[[2, 0]])


# ----------------------------------------------------------------------------------------------------- turns


def test_a_turn_of_170_deg_takes_20_s_within_its_limits() -> None:
    t = edges(30.0)
    scene = played(TURNING, t)
    angle, turning = scene.references["turn_angle"].values, scene.references["turning"].values
    assert TURNING.turn_time(170 * DEG) == pytest.approx(20.0, abs=1e-12)
    assert np.flatnonzero(turning).tolist() == list(range(500, 2500))
    assert angle[499] == 0.0 and angle[-1] == pytest.approx(170 * DEG, abs=1e-15)
    speed = np.diff(angle) * RATE
    assert speed.min() > -1e-9 and speed.max() == pytest.approx(TURNING.max_rate, rel=1e-9)
    assert np.abs(np.diff(speed)).max() * RATE < TURNING.max_acceleration * (1 + 1e-6)
    # Counter-clockwise: the heading, clockwise from north, falls.
    np.testing.assert_allclose(scene.references["heading"].values, wrapped(-angle), atol=1e-14)


@pytest.mark.parametrize("angle", [1e-6, 1 * DEG, -29 * DEG, 31 * DEG, -359 * DEG])
def test_a_turn_of_any_size_ends_where_it_was_told_to(angle: float) -> None:
    vehicle = Vehicle(**SITE)
    time = vehicle.turn_time(angle)
    scene, state = vehicle.advance(vehicle.begin(), angle, edges(np.ceil(time) + 1), np.zeros((0, 1)))
    assert scene.references["turn_angle"].values[-1] == pytest.approx(angle, abs=1e-15)
    assert scene.references["turning"].values.sum() == pytest.approx(time * RATE, abs=1)
    assert np.sqrt(4 * abs(angle) / vehicle.max_acceleration) <= time * (1 + 1e-12)


def test_a_turn_asked_for_while_turning_is_ignored() -> None:
    vehicle, t = Vehicle(**SITE), edges(30.0)
    _, state = vehicle.advance(vehicle.begin(), np.array([1.0, 1.0]), t[:101], np.zeros((2, 0, 100)))
    scene, _ = vehicle.advance(state, np.array([2.0, np.nan]), t[100:], np.zeros((2, 0, 2900)))
    np.testing.assert_array_equal(scene.references["turn_angle"].values[:, -1], [1.0, 1.0])


def test_a_command_ends_the_profile() -> None:
    scene, _ = TURNING.advance(TURNING.begin(), 0.0, edges(10.0), np.zeros((0, 1000)))
    assert not scene.references["turning"].values.any()


def test_the_residual_motion_fades_and_creep_covers_its_distance() -> None:
    vehicle = replace(TURNING, residual=Settling(0.01, 2.0), creep=Settling(1e-3 / 20, 20.0))
    scene = played(vehicle, edges(325.0))
    after = scene.references["velocity_north"].values[2499:]
    at = np.arange(len(after)) / RATE
    size = np.hypot(after, scene.references["velocity_east"].values[2499:])
    np.testing.assert_allclose(size, 0.01 * np.exp(-at / 2) + 5e-5 * np.exp(-at / 20), rtol=1e-7)
    assert size.sum() / RATE == pytest.approx(0.02 + 1e-3, rel=0.01)
    assert not scene.references["velocity_north"].values[:2499].any()
    assert scene.references["turning"].values[2499] == 1  # the jump to it lies within the turn


# ------------------------------------------------------------------------------------------------------ sway


def test_sway_has_its_rms_value_and_its_band() -> None:
    line, band = SwayLine(1.5, 1e-4), Band(0.5, 1.0, 2e-4)
    found = waves([line], band, np.random.default_rng(2))
    assert found[0, 0] == pytest.approx(np.sqrt(2) * 1e-4) and found[0, 1] == pytest.approx(3 * np.pi)
    assert (found[1:, 1] >= np.pi).all() and (found[1:, 1] <= 2 * np.pi).all()
    # 24 sines of 2 Gaussian coefficients in 400 runs: 19200 squares, so that 4 % are four deviations; p = 6e-5.
    draw = np.random.default_rng(3)
    power = np.mean([(waves([], band, draw)[:, 0] ** 2).sum() / 2 for _ in range(400)])
    assert power == pytest.approx(band.rms**2, rel=0.041)
    still = waves([line], band)
    assert (still[1:, 0] ** 2).sum() / 2 == pytest.approx(band.rms**2, rel=1e-12)


def test_the_instruments_feel_the_sway_through_its_arm() -> None:
    scene = played(Vehicle(**SITE, sway=sway(WIND)), edges(20.0))
    w, amplitude = 2 * np.pi * WIND.frequency, np.sqrt(2) * WIND.rms
    assert np.abs(scene.references["roll"].values).max() == pytest.approx(amplitude, rel=1e-3)
    assert np.abs(scene.references["velocity_east"].values).max() == pytest.approx(amplitude * w, rel=1e-2)
    force = np.abs(triads(scene)[1][:, 0]).max()
    # To the right: the arm's acceleration, and gravity along the roll.
    assert force == pytest.approx(amplitude * abs(-(w**2) - SITE["gravity"]), rel=1e-2)


def test_a_sway_that_is_faster_than_said_is_refused() -> None:
    with pytest.raises(InputError, match=r"^a sway of 1\.5 Hz"):
        Sway(waves=waves([WIND], None), fastest=1.0)


# ------------------------------------------------------------------------------------------------- sightings


def test_the_sight_reads_heading_and_its_errors_where_there_is_a_sighting() -> None:
    t = edges(12.0)
    z = np.random.default_rng(7).standard_normal((1, len(t) - 1))
    scene = played(EVERYTHING, t, z)
    reading, heading = scene.references["sight_heading"].values, scene.references["heading"].values
    turning = scene.references["turning"].values
    ends = np.flatnonzero(np.diff(turning) < 0) + 1
    assert np.flatnonzero(np.isfinite(reading)).tolist() == [0, *ends.tolist()] and len(ends) == 1
    at = np.isfinite(reading)
    np.testing.assert_allclose(reading[at], wrapped(heading[at] + 0.01 + 1e-4 + 1e-4 * z[0, at]), atol=1e-15)
    for i, name in enumerate(("pitch", "roll")):
        level = scene.references[f"level_{name}"].values
        assert np.isnan(level[1:]).all()
        assert level[0] == pytest.approx(scene.references[name].values[0] + (1e-3, -1e-3)[i], abs=1e-15)


def test_a_sight_that_looks_at_the_start_does_not_look_later() -> None:
    assert EVERYTHING.sight is not None
    vehicle = replace(EVERYTHING, sight=replace(EVERYTHING.sight, after_turns=False))
    assert np.isfinite(played(vehicle, edges(12.0)).references["sight_heading"].values).sum() == 1


def test_two_points_known_to_a_decimetre_give_20_arcsec_at_1458_m() -> None:
    assert orientation_error(0.1, 1458.5) == pytest.approx(20 * ARCSEC, rel=1e-4)
    # By drawing: 4000 runs, standard deviation to 1.1 %, five of them; p = 6e-7.
    draw = np.random.default_rng(1).normal(0, 0.1, (2, 2, 4000))
    target = np.array([900.0, 1147.7])[:, None] + draw[0] - draw[1]
    assert np.arctan2(*target).std() == pytest.approx(orientation_error(0.1, np.hypot(900, 1147.7)), rel=0.056)


# --------------------------------------------------------------------------------------------------- refused


def test_a_vehicle_that_cannot_turn_is_not_told_to() -> None:
    vehicle = Vehicle(latitude=LATITUDE)
    with pytest.raises(InputError, match=r"^a turn was commanded"):
        vehicle.advance(vehicle.begin(), np.array([0.0, 1.0]), edges(0.1), np.zeros((2, 0, 10)))
    vehicle.advance(vehicle.begin(), np.array([0.0, np.nan]), edges(0.1), np.zeros((2, 0, 10)))
    with pytest.raises(InputError, match=r"^the profile asks for a turn"):
        replace(vehicle, profile=((1.0, 1.0),)).begin()
