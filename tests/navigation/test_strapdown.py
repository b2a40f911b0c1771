"""Mechanisation: closure with the truth, an ODE solver as the judge, published error growth, and bits that agree."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import cache
from typing import Any

import numba
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from insenv.core import earth
from insenv.core.attitude import dcm_from_angles, dcm_from_rotation_vector, misaligned, misalignment
from insenv.core.compiled import jit
from insenv.core.errors import InputError
from insenv.navigation import kernel as strapdown_kernel
from insenv.navigation import strapdown
from insenv.navigation import truth as strapdown_truth
from insenv.navigation.strapdown import full_mechanisation, initial, static_mechanisation

LATITUDE, HEIGHT = np.radians(38.0), 380.0
POSITION = (LATITUDE, np.radians(114.0), HEIGHT)
ATTITUDE = dcm_from_angles(0.5, 0.03, -0.05)
BOTH = pytest.mark.parametrize("mechanise", [static_mechanisation, full_mechanisation])
Mechanise = Callable[..., tuple[strapdown.StrapdownPath, strapdown.Navigation]]


def within(found: np.ndarray, wanted: Any, tolerance: Any) -> None:
    away = np.abs(np.subtract(found, wanted))
    assert (away <= tolerance).all(), f"away by {away}, allowed {tolerance}"


# ------------------------------------------------------------------------------------ error-free motion comes back


@BOTH
@pytest.mark.parametrize("rate", [10, 100, 400])
def test_an_hour_at_rest(mechanise: Mechanise, rate: int) -> None:
    at_rest = strapdown_truth.increments_at_rest(ATTITUDE, POSITION, 1 / rate, 3600 * rate)
    trajectory, after = mechanise(*at_rest, 1 / rate, initial(ATTITUDE, POSITION), every=10)
    assert np.abs(trajectory.velocity).max() < 2e-9
    assert np.abs(np.degrees(misalignment(after.dcm, ATTITUDE))).max() < 1e-13
    within(after.position, POSITION, [1e-12, 1e-12, 1e-5])


@BOTH
@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.05, -0.02, 1.0)], ids=["level", "slope"])
def test_a_turn_that_speeds_up(mechanise: Mechanise, axis: tuple[float, ...]) -> None:
    t = np.linspace(0.0, 20.0, 2001)
    acceleration = 2 * np.radians(170.0) / 20.0**2
    path = strapdown_truth.turn(t, 0.5 * acceleration * t**2, acceleration * t, ATTITUDE, POSITION, axis)
    trajectory, after = mechanise(*strapdown_truth.increments(path, t), 0.01, initial(ATTITUDE, POSITION))
    normal = np.array(axis) / float(np.linalg.norm(axis))
    there = dcm_from_rotation_vector(np.radians(170.0) * normal) @ ATTITUDE
    np.testing.assert_allclose(path(t[-1:]).dcm[0], there, atol=1e-14)
    assert np.abs(misalignment(after.dcm, there)).max() < 1e-11
    assert np.abs(trajectory.velocity).max() < 1e-7


@pytest.mark.parametrize("rate", [50, 100])
def test_coning_leaves_the_drift_of_its_algorithm(rate: int) -> None:
    """Of A^2/2 (x - sin x) per interval, x = w dt, the previous increment restores A^2/3 sin^2(x/2) sin x."""
    half_angle, frequency, seconds = 1e-3, 5.0, 20
    t = np.arange(seconds * rate + 1) / rate
    path = strapdown_truth.coning(half_angle, frequency, ATTITUDE, POSITION)
    first = path(t[:1]).dcm[0]
    increments = strapdown_truth.increments(path, t)
    found, _ = static_mechanisation(*increments, 1 / rate, initial(first, POSITION), seconds // 2 * rate)
    phi = misalignment(found.dcm, path(t[found.sample]).dcm) @ ATTITUDE
    x = 2 * np.pi * frequency / rate
    missing = half_angle**2 * (0.5 * (x - np.sin(x)) - np.sin(x / 2) ** 2 * np.sin(x) / 3.0)
    # From the middle on: the first interval has none before it, and lacks all of the term.
    drift = (phi[1] - phi[0]) / (seconds // 2 * rate)
    assert drift[2] == pytest.approx(missing, rel=2e-4)
    assert np.abs(drift[:2]).max() < 0.02 * missing
    assert missing == pytest.approx(half_angle**2 * x**5 / 60, rel=0.3)


# ----------------------------------------------------------------------------------------- against an ODE solver


AMPLITUDE = np.array([0.4, 0.3, 0.5, 2.0, 3.0, 1.0])
FREQUENCY = np.array([1.1, 1.7, 0.6, 0.9, 0.5, 1.3])
PHASE = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
OFFSET = np.array([0.01, 0.02, 0.1, 0.0, 0.1, 9.8])
SECONDS = 20.0


def signal(t: float) -> np.ndarray:
    """Rate and specific force."""
    return OFFSET + AMPLITUDE * np.sin(FREQUENCY * t + PHASE)


def exact_increments(dt: float) -> tuple[np.ndarray, np.ndarray]:
    t = np.arange(round(SECONDS / dt) + 1)[:, None] * dt
    both = np.diff(OFFSET * t - AMPLITUDE / FREQUENCY * np.cos(FREQUENCY * t + PHASE), axis=0)
    return both[:, :3], both[:, 3:]


@cache
def solution(fed_back: bool) -> Any:
    start = np.concatenate([ATTITUDE.ravel(), fed_back * np.array([30.0, -20.0, 1.0]), POSITION])

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        c, v, p = y[:9].reshape(3, 3), y[9:12], y[12:]
        moving = fed_back * v
        turning, transport = earth.earth_rate_enu(p[0]), strapdown_truth.transport_rate(p, moving)
        rate, force = np.split(signal(t), 2)
        gravity = np.array([0.0, 0.0, -float(earth.gravity(p[0], p[2]))])
        c_dot = np.cross(c, rate[None, :]) - np.cross(turning + transport, c.T).T
        v_dot = c @ force - np.cross(2 * turning + transport, moving) + gravity
        p_dot = [-transport[0], transport[1] / np.cos(p[0]), moving[2]]
        return np.concatenate([c_dot.ravel(), v_dot, p_dot])

    return solve_ivp(slope, (0.0, SECONDS), start, "DOP853", rtol=1e-12, atol=1e-13, dense_output=True).sol


@pytest.mark.parametrize(("mechanise", "fed_back"), [(static_mechanisation, False), (full_mechanisation, True)])
def test_a_general_motion_against_an_ode_solver(mechanise: Mechanise, fed_back: bool) -> None:
    truth = solution(fed_back)
    end, errors = truth(SECONDS), []
    for dt in (0.02, 0.01):
        start = initial(ATTITUDE, POSITION, truth(0.0)[9:12])
        _, after = mechanise(*exact_increments(dt), dt, start)
        phi = misalignment(after.dcm, end[:9].reshape(3, 3))
        errors.append([np.abs(phi).max(), np.abs(after.velocity - end[9:12]).max()])
        within(after.position, end[12:], [1e-10, 1e-10, 1e-3])
    coarse, fine = np.array(errors)
    assert (fine < [5e-8, 3e-6]).all()
    assert (coarse > 6.0 * fine).all()  # third order: the first interval has none before it


def test_increments_of_a_sampled_trajectory_bring_it_back() -> None:
    t = np.arange(2001) * 0.01
    y = solution(True)(t).T
    dcm, velocity, position = y[:, :9].reshape(-1, 3, 3), y[:, 9:12], y[:, 12:]
    path = strapdown_truth.sampled(t, dcm, velocity, position)
    gyro, accelerometer = strapdown_truth.increments(path, t)
    np.testing.assert_allclose(gyro[50:-50], exact_increments(0.01)[0][50:-50], atol=1e-8)
    np.testing.assert_allclose(accelerometer[50:-50], exact_increments(0.01)[1][50:-50], atol=1e-6)
    trajectory, after = full_mechanisation(gyro, accelerometer, 0.01, initial(dcm[0], position[0], velocity[0]))
    assert np.abs(trajectory.velocity - velocity[1:]).max() < 1e-5
    assert np.abs(misalignment(after.dcm, dcm[-1])).max() < 1e-7


# ---------------------------------------------------------------------------------------------- truth by itself


PATHS = {
    "turn": strapdown_truth.turn(
        np.arange(5.0), np.arange(5.0) ** 2, 2 * np.arange(5.0), ATTITUDE, POSITION, (0.1, 0.2, 1.0)
    ),
    "coning": strapdown_truth.coning(0.02, 3.0, ATTITUDE, POSITION),
    "sampled": strapdown_truth.sampled(
        np.arange(9.0),
        dcm_from_angles(0.3 * np.arange(9.0), 0.1 * np.sin(np.arange(9.0)), 0.0),
        np.sin(np.outer(np.arange(9.0), (1.0, 0.3, 0.2))),
        np.broadcast_to(POSITION, (9, 3)),
    ),
}


@pytest.mark.parametrize("name", PATHS)
def test_rates_and_accelerations_are_derivatives(name: str) -> None:
    path, t, h = PATHS[name], np.linspace(0.21, 3.83, 7), 1e-5
    now, before, after = (path(t + shift) for shift in (0.0, -h, h))
    step = Rotation.from_matrix(np.swapaxes(before.dcm, -1, -2) @ after.dcm).as_rotvec()
    np.testing.assert_allclose(now.rate, step / (2 * h), atol=1e-7)
    np.testing.assert_allclose(now.acceleration, (after.velocity - before.velocity) / (2 * h), atol=1e-8)


@pytest.mark.parametrize("name", PATHS)
def test_an_increment_is_the_sum_over_parts_of_its_interval(name: str) -> None:
    coarse = strapdown_truth.increments(PATHS[name], np.linspace(0.0, 4.0, 41))
    fine = strapdown_truth.increments(PATHS[name], np.linspace(0.0, 4.0, 12 * 1000 + 1))
    for a, b in zip(coarse, fine, strict=True):
        np.testing.assert_allclose(np.cumsum(a, axis=0)[-1], b.sum(axis=0), atol=1e-11)


def test_at_rest_the_closed_form_is_the_quadrature() -> None:
    t = np.arange(4) * 0.01
    path = strapdown_truth.turn(t, 0 * t, 0 * t, ATTITUDE, POSITION)
    for a, b in zip(
        strapdown_truth.increments(path, t),
        strapdown_truth.increments_at_rest(ATTITUDE, POSITION, 0.01, 3),
        strict=True,
    ):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-16)


def test_a_batch_of_attitudes_turns_together() -> None:
    t = np.arange(11) * 0.1
    batch = dcm_from_angles(np.array([0.1, 0.2]), 0.0, 0.03)
    together = strapdown_truth.increments(strapdown_truth.turn(t, t, 1 + 0 * t, batch, POSITION), t)
    for i in range(2):
        alone = strapdown_truth.increments(strapdown_truth.turn(t, t, 1 + 0 * t, batch[i], POSITION), t)
        within(together[0][i], alone[0], 1e-15)
        within(together[1][i], alone[1], 1e-15)


# ------------------------------------------------------------------------------------------------- growth of errors


def test_static_error_growth_is_that_of_the_linear_model() -> None:
    """Velocity a1 t + a2 t^2 + a3 t^3 of d phi/dt = phi x w - e, dv/dt = g (-phi_N, phi_E) + n."""
    dt, seconds, g = 0.02, 300, float(earth.gravity(LATITUDE, HEIGHT))
    phi = np.array([2e-5, -3e-5, 5e-5])
    gyro_bias, bias = np.array([3e-8, -2e-8, 4e-8]), np.array([4e-4, -5e-4, 0.0])
    gyro, accelerometer = strapdown_truth.increments_at_rest(ATTITUDE, POSITION, dt, round(seconds / dt))
    gyro, accelerometer = gyro + ATTITUDE.T @ gyro_bias * dt, accelerometer + ATTITUDE.T @ bias * dt
    start = initial(misaligned(ATTITUDE, phi), POSITION)
    trajectory, after = static_mechanisation(gyro, accelerometer, dt, start, every=50)

    _, north, up = earth.earth_rate_enu(LATITUDE)
    u = np.cross(phi, (0.0, north, up)) - gyro_bias
    wanted = np.array(
        [
            [-g * phi[1] + bias[0], -g / 2 * u[1], g / 6 * up * u[0]],
            [g * phi[0] + bias[1], g / 2 * u[0], g / 6 * (up * u[1] - north * u[2])],
        ]
    )
    x = trajectory.sample * dt / seconds
    powers = x[:, None] ** np.arange(1, 7)  # three more than are asked for: nothing is left to bend them
    found = np.linalg.lstsq(powers, trajectory.velocity[:, :2], rcond=None)[0][:3].T
    scale = float(seconds) ** np.arange(1, 4)
    # Left out are products of two errors: phi n in a1, g phi u and g phi e in a2, g u u in a3.
    room = np.array([5e-8, 2e-11, 5e-15])
    within(found / scale, wanted, room)
    assert (np.abs(wanted) > 20 * room).all()
    carried = phi + u * seconds + 0.5 * np.cross(u, (0.0, north, up)) * seconds**2
    np.testing.assert_allclose(misalignment(after.dcm, ATTITUDE), carried, rtol=1e-3, atol=1e-9)


def test_only_the_full_mechanisation_swings_with_schulers_period() -> None:
    dt, n = 0.1, 36000
    position = (0.0, 0.0, 0.0)  # on the equator Foucault's turning of the swing does not reach north
    level = np.eye(3)
    at_rest = strapdown_truth.increments_at_rest(level, position, dt, n)
    start = initial(misaligned(level, (1e-5, 0.0, 0.0)), position)
    swings, _ = full_mechanisation(*at_rest, dt, start)
    grows, _ = static_mechanisation(*at_rest, dt, start)
    north = swings.velocity[:, 1]
    back = dt * swings.sample[np.argmax(north < 0.0)]
    meridian = earth.SEMI_MAJOR_AXIS * (1 - earth.ECCENTRICITY_SQUARED)
    schuler = np.sqrt(float(earth.gravity(0.0)) / meridian)
    assert back == pytest.approx(np.pi / schuler, rel=0.01)
    assert north.max() == pytest.approx(9.78 * 1e-5 / schuler, rel=0.01)
    assert (np.diff(grows.velocity[:, 1]) > 0).all()


# ------------------------------------------------------------------------------------------------ bits and shapes


def random_increments(*shape: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    return rng.normal(0.0, 0.15, (*shape, 3)), rng.normal(0.0, 0.1, (*shape, 3)) + np.array([0.0, 0.0, 0.098])


def same(a: Any, b: Any, *names: str) -> None:
    for name in names:
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


STATE = ("quaternion", "velocity", "position", "previous", "samples")
KEPT = ("velocity", "position", "quaternion")


@BOTH
@pytest.mark.parametrize("every", [1, 7, 1000])
def test_chunks_are_the_whole_bit_for_bit(mechanise: Mechanise, every: int) -> None:
    gyro, accelerometer = random_increments(500)
    start = initial(ATTITUDE, POSITION, (1.0, 2.0, 0.5))
    whole, end = mechanise(gyro, accelerometer, 0.01, start, every)
    state, parts = start, []
    for a, b in ((0, 1), (1, 6), (6, 6), (6, 300), (300, 500)):
        part, state = mechanise(gyro[a:b], accelerometer[a:b], 0.01, state, every)
        parts.append(part)
    same(state, end, *STATE)
    for name in (*KEPT, "sample"):
        np.testing.assert_array_equal(np.concatenate([getattr(p, name) for p in parts]), getattr(whole, name))
    np.testing.assert_array_equal(whole.sample, np.arange(every, 501, every))


@BOTH
def test_a_row_of_a_batch_is_the_run_alone_bit_for_bit(mechanise: Mechanise) -> None:
    gyro, accelerometer = random_increments(2, 3, 200)
    latitudes = np.stack([np.array([0.1, 0.5, -0.9]), np.zeros(3), np.full(3, 50.0)], axis=-1)
    states = initial(dcm_from_angles(np.array([[0.1], [2.0]]), 0.2, 0.3), latitudes)
    together, after = mechanise(gyro, accelerometer, 0.01, states, 20)
    assert together.velocity.shape == together.position.shape == (2, 3, 10, 3)
    assert together.dcm.shape == (2, 3, 10, 3, 3)
    for i in np.ndindex(2, 3):
        start = initial(dcm_from_angles((0.1, 2.0)[i[0]], 0.2, 0.3), latitudes[i[1]])
        alone, end = mechanise(gyro[i], accelerometer[i], 0.01, start, 20)
        for name in KEPT:
            np.testing.assert_array_equal(getattr(together, name)[i], getattr(alone, name))
        np.testing.assert_array_equal(after.quaternion[i], end.quaternion)


@BOTH
def test_one_recording_serves_many_initial_attitudes(mechanise: Mechanise) -> None:
    gyro, accelerometer = random_increments(100)
    many = initial(misaligned(ATTITUDE, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.01]])), POSITION)
    shared, _ = mechanise(gyro, accelerometer, 0.01, many)
    copied, _ = mechanise(np.stack([gyro, gyro]), np.stack([accelerometer, accelerometer]), 0.01, many)
    same(shared, copied, *KEPT)
    one, _ = mechanise(gyro[None], accelerometer[None], 0.01, initial(ATTITUDE, POSITION))
    assert one.velocity.shape == (1, 100, 3)
    np.testing.assert_array_equal(one.velocity[0], shared.velocity[0])


def test_the_state_given_is_left_as_it_was() -> None:
    start = initial(ATTITUDE, POSITION)
    copy = initial(ATTITUDE, POSITION)
    static_mechanisation(*random_increments(10), 0.01, start)
    same(start, copy, *STATE)


def test_large_turns_against_the_formulas_with_scipy() -> None:
    """The kernel's own algebra (quaternions, series) against rotation matrices."""
    gyro, accelerometer = random_increments(300)
    gyro[::3] *= 6.0  # beyond what the series takes
    trajectory, after = static_mechanisation(gyro, accelerometer, 0.01, initial(ATTITUDE, POSITION))
    c, v, a0, f0 = ATTITUDE, np.zeros(3), np.zeros(3), np.zeros(3)
    zeta = earth.earth_rate_enu(LATITUDE) * 0.01
    for i, (a, f) in enumerate(zip(gyro, accelerometer, strict=True)):
        phi = a + np.cross(a0, a) / 12
        size = np.linalg.norm(phi)
        k1, k2 = (1 - np.cos(size)) / size**2, (size - np.sin(size)) / size**3
        w = f + k1 * np.cross(a, f) + k2 * np.cross(a, np.cross(a, f)) + (np.cross(a0, f) + np.cross(f0, a)) / 12
        u = c @ w
        v = v + u - 0.5 * np.cross(zeta, u) + np.cross(zeta, np.cross(zeta, u)) / 12
        v[2] -= float(earth.gravity(LATITUDE, HEIGHT)) * 0.01
        c = dcm_from_rotation_vector(-zeta) @ c @ dcm_from_rotation_vector(phi)
        a0, f0 = a, f
        np.testing.assert_allclose(trajectory.velocity[i], v, rtol=0, atol=1e-12)
    np.testing.assert_allclose(after.dcm, c, rtol=0, atol=1e-13)


def test_the_attitude_stays_a_rotation() -> None:
    _, after = static_mechanisation(*random_increments(20_000), 0.01, initial(ATTITUDE, POSITION))
    assert np.linalg.norm(after.quaternion) == pytest.approx(1.0, abs=5e-16)


@pytest.mark.parametrize("size", [0.0, 1e-8, 1e-3, 0.1999, 0.2001, 1.0, 3.0])
def test_coefficients_of_a_turn(size: float) -> None:
    turn, k1, k2 = strapdown_kernel._turns((0.0, 0.6 * size, -0.8 * size))
    a = np.longdouble(size)
    if size < 1e-2:  # the next term is below 1e-17
        wanted = (0.5 - a**2 / 24 + a**4 / 720, 1 / np.longdouble(6) - a**2 / 120 + a**4 / 5040)
    else:
        wanted = ((1 - np.cos(a)) / a**2, (a - np.sin(a)) / a**3)
    np.testing.assert_allclose((k1, k2), np.array(wanted, np.float64), rtol=3e-14)
    half = np.sin(a / 2)
    np.testing.assert_allclose(
        turn, np.array([-2 * np.sin(a / 4) ** 2, 0.0, 0.6 * half, -0.8 * half], np.float64), rtol=1e-14, atol=1e-300
    )


@pytest.mark.parametrize("altitude", [-400.0, 0.0, 9000.0])
def test_gravity_is_that_of_the_core(altitude: float) -> None:
    for latitude in np.linspace(-1.5, 1.5, 13):
        sin2 = np.sin(latitude) ** 2
        root = np.sqrt(1.0 - earth.ECCENTRICITY_SQUARED * sin2)
        found = strapdown_kernel._gravity(sin2, root, altitude)
        assert found == pytest.approx(float(earth.gravity(latitude, altitude)), rel=1e-15)


def test_the_module_alone_does_not_load_numba() -> None:
    program = "import insenv.navigation.strapdown, insenv.navigation.truth, sys; print('numba' in sys.modules)"
    assert (
        subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True).stdout == "False\n"
    )


def test_a_folder_without_a_cache_still_computes(monkeypatch: pytest.MonkeyPatch) -> None:
    njit = numba.njit

    def without_cache(*args: Any, **options: Any) -> Any:
        if options.get("cache"):
            raise RuntimeError("cannot cache function: no locator available")
        return njit(*args, **options)

    monkeypatch.setattr(numba, "njit", without_cache)
    assert jit(lambda x: 2 * x)(3.0) == 6.0


# ------------------------------------------------------------------------------------------------------ bad input


GYRO, ACCELEROMETER = np.zeros((5, 3)), np.zeros((5, 3))


@BOTH
@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((GYRO, ACCELEROMETER[:4], 0.01), r"shape \(5, 3\) \(gyros\) and \(4, 3\)"),
        ((GYRO[:, :2], ACCELEROMETER[:, :2], 0.01), r"wanted the same shape \(\.\.\., n, 3\)"),
        ((GYRO, ACCELEROMETER, 0.0), "wanted a positive number"),
        ((GYRO, ACCELEROMETER, np.nan), "wanted a positive number"),
        ((np.zeros((3, 5, 3)), np.zeros((3, 5, 3)), 0.01), "do not go together"),
    ],
)
def test_increments_that_do_not_fit_are_refused(mechanise: Mechanise, arguments: Any, sentence: str) -> None:
    states = initial(np.stack([ATTITUDE, ATTITUDE]), POSITION)
    with pytest.raises(InputError, match=sentence):
        mechanise(*arguments, states)


@BOTH
def test_fewer_than_every_sample_is_refused(mechanise: Mechanise) -> None:
    with pytest.raises(InputError, match="wanted 1 or more"):
        mechanise(GYRO, ACCELEROMETER, 0.01, initial(ATTITUDE, POSITION), 0)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ((ATTITUDE, (38.0, 0.0, 0.0)), "no latitude"),
        ((ATTITUDE, (np.nan, 0.0, 0.0)), "no latitude"),
        ((ATTITUDE, (0.5, 0.0)), r"wanted shape \(\.\.\., 3\)"),
        ((ATTITUDE, POSITION, 0.0), r"a velocity of shape \(\)"),
        ((2 * ATTITUDE, POSITION), "no rotation"),
        ((np.stack([ATTITUDE] * 2), [POSITION] * 3), "do not go together"),
    ],
)
def test_a_start_that_is_none_is_refused(arguments: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        initial(*arguments)


def test_at_a_pole_only_the_static_mechanisation_works() -> None:
    pole = initial(ATTITUDE, (np.pi / 2, 0.0, 0.0))
    at_rest = strapdown_truth.increments_at_rest(ATTITUDE, pole.position, 0.01, 100)
    assert np.abs(static_mechanisation(*at_rest, 0.01, pole)[0].velocity).max() < 1e-12
    with pytest.raises(InputError, match="pole"):
        full_mechanisation(*at_rest, 0.01, pole)


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: strapdown_truth.increments(PATHS["turn"], [1.0]), "two or more rising times"),
        (lambda: strapdown_truth.increments(PATHS["turn"], [0.0, 1.0, 1.0]), "two or more rising times"),
        (
            lambda: strapdown_truth.sampled(np.arange(3.0), [ATTITUDE] * 3, np.zeros((3, 3)), [POSITION] * 3),
            "3 or more",
        ),
    ],
)
def test_a_path_that_is_none_is_refused(call: Callable[[], object], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        call()
