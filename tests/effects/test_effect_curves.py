"""Each curve against a second derivation, and the grids of shapes that a scan tries."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from effect_cases import CURVES, addition
from hypothesis import given
from hypothesis import strategies as st
from motions import edges, rich_motion
from scipy.stats import chi2

from insenv.core.motion import Motion, interval_mean
from insenv.core.recording import Floats
from insenv.effects.angle import AngleLockedRate, EarthRate
from insenv.effects.base import CurveEffect
from insenv.effects.catalogue import by_key
from insenv.effects.forms import cosine_of_twice, wave
from insenv.effects.rate.lock_in import LockIn, LockInWander
from insenv.effects.rate.scale import ScaleFactorAnomaly
from insenv.effects.spline import SplineAngle, SplineTemperature
from insenv.effects.thermal import BiasThermalLag
from insenv.effects.timing import SampleHold, TimingSkew
from insenv.sensors.chain import Sensor

every_curve = pytest.mark.parametrize("key", CURVES)

# At an instant: theta, and what one effect adds for input rate u, table angle a, table rate w with its
# derivative, temperature T above T_ref with its slope, and time t.
FORMULAS = {
    "bias": ([0.3], lambda m: 0.3 + 0 * m.u),
    "bias_drift": ([0.3], lambda m: 0.3 * m.t),
    "bias_warm_up": ([0.3, 7.0], lambda m: 0.3 * np.exp(-m.t / 7)),
    "bias_step": ([0.3, 20.0], lambda m: 0.3 * (m.t > 20)),
    "bias_temperature:1": ([0.3], lambda m: 0.3 * m.T),
    "bias_temperature:2": ([0.3, 0.1], lambda m: 0.3 * m.T + 0.1 * m.T**2),
    "bias_temperature:3": ([0.3, 0.1, 0.01], lambda m: 0.3 * m.T + 0.1 * m.T**2 + 0.01 * m.T**3),
    "bias_temperature_rate": ([0.3], lambda m: 0.3 * m.T_slope),
    "scale_factor": ([0.3], lambda m: 0.3 * m.u),
    "scale_factor_drift": ([0.3], lambda m: 0.3 * m.u * m.t),
    "scale_factor_warm_up": ([0.3, 7.0], lambda m: 0.3 * m.u * np.exp(-m.t / 7)),
    "scale_factor_temperature": ([0.3], lambda m: 0.3 * m.u * m.T),
    "scale_factor_asymmetry": ([0.3], lambda m: 0.3 * np.abs(m.u)),
    "scale_factor_cubic": ([0.3], lambda m: 0.3 * m.u**3),
    "scale_factor_anomaly": (
        [0.3, 0.2, 0.05],
        lambda m: 0.3 * np.sign(m.u) * np.exp(-((np.abs(m.u) - 0.2) ** 2) / (2 * 0.05**2)),
    ),
    "lock_in": (
        [1e-4],
        lambda m: np.where(m.u**2 > 1e-4, np.sign(m.u) * np.sqrt(np.maximum(m.u**2 - 1e-4, 0)) - m.u, -m.u),
    ),
    "encoder_harmonic:1": ([0.3, 0.2], lambda m: 0.5 * m.w * (-0.3 * np.sin(m.a) + 0.2 * np.cos(m.a))),
    "encoder_harmonic:3": (
        [0.3, 0.2],
        lambda m: 0.5 * 3 * m.w * (-0.3 * np.sin(3 * m.a) + 0.2 * np.cos(3 * m.a)),
    ),
    "angle_locked_rate:2": ([0.3, 0.2], lambda m: 0.3 * np.cos(2 * m.a) + 0.2 * np.sin(2 * m.a)),
    "earth_rate": ([0.3, 0.2], lambda m: 0.3 * np.cos(m.a) + 0.2 * np.sin(m.a)),
    "timing_skew": ([0.3], lambda m: -0.3 * 0.5 * m.w_slope),
    "tone": ([0.3, 0.2, 0.7], lambda m: 0.3 * np.cos(1.4 * np.pi * m.t) + 0.2 * np.sin(1.4 * np.pi * m.t)),
}


@pytest.mark.parametrize("key", FORMULAS)
def test_the_value_is_the_formula_of_the_contract(key: str) -> None:
    dt = 0.002
    motion = rich_motion(20000, dt)
    t = motion.middle
    instant = SimpleNamespace(
        t=t,
        u=motion.rate,
        a=4.0 * np.sin(0.21 * t) + 0.05 * t,
        w=0.84 * np.cos(0.21 * t) + 0.05,
        w_slope=-0.84 * 0.21 * np.sin(0.21 * t),
        T=6 * np.sin(0.05 * t) + 8 * (1 - np.exp(-t / 20)),
        T_slope=0.3 * np.cos(0.05 * t) + 0.4 * np.exp(-t / 20),
    )
    theta, formula = FORMULAS[key]
    found, expected = addition(by_key(key), motion, np.array(theta)), formula(instant)
    # Curvature within 2 ms.
    assert np.abs(found - expected).max() < 2e-5 * np.abs(expected).max()


@pytest.mark.parametrize("order", [1, 3])
def test_a_harmonic_is_averaged_over_a_fast_turn(order: int) -> None:
    """A third of a turn per interval: the mean by the antiderivative, sin(n a) / n."""
    angle = 0.4 + edges(7, 2 * np.pi / 2.9)
    motion = Motion(t=np.arange(8.0), rate=np.ones(7), angle=angle)
    found = addition(by_key(f"angle_locked_rate:{order}"), motion, np.array([1.0, 0.0]))
    expected = np.diff(np.sin(order * angle)) / (order * np.diff(angle))
    np.testing.assert_allclose(found, expected, atol=1e-14)


# --------------------------------------------------------------------------------------------- the grids


@every_curve
def test_grids_have_one_column_per_shape_and_stay_in_range(key: str) -> None:
    effect = by_key(key)
    assert isinstance(effect, CurveEffect)
    for motion in (rich_motion(3600, 1.0), rich_motion(60), rich_motion(1), rich_motion(2, 1e-3, batch=(2,))):
        grid = effect.grid(motion)
        assert grid.ndim == 2
        assert grid.shape[1] == len(effect.shapes)
        assert np.all(np.isfinite(grid))
        if key != "tone":  # its frequencies are searched by Fourier transform
            assert len(grid) < 1200


@every_curve
def test_grids_are_independent_of_where_a_run_is_cut(key: str) -> None:
    effect = by_key(key)
    assert isinstance(effect, CurveEffect)
    late = rich_motion(600).interval(300, 600)
    for shape in effect.grid(late):
        theta = np.concatenate([[p.sd for p in effect.linear], shape])
        assert np.any(addition(effect, late, theta))


def test_an_anomaly_is_looked_for_at_the_rates_that_were_run() -> None:
    levels = np.array([0.02, 0.1, 0.35, 1.0])
    rate = np.repeat(np.concatenate([levels, -levels]), 200)
    motion = Motion(t=np.arange(len(rate) + 1.0), rate=rate)
    grid = ScaleFactorAnomaly().grid(motion)
    for width in np.unique(grid[:, 1]):
        centres = grid[grid[:, 1] == width, 0]
        assert set(np.round(centres, 9)) <= set(levels) | {0.02, 0.06}
    np.testing.assert_allclose(grid[grid[:, 1] == 0.02, 0], levels)
    still = replace(motion, rate=np.full(len(rate), 7.3e-5))
    assert ScaleFactorAnomaly().grid(still).shape == (0, 2)


@pytest.mark.parametrize("key", FORMULAS)
def test_a_rate_next_to_nothing_gives_a_number_without_a_warning(key: str) -> None:
    """A servo that settles leaves rates of any smallness; warnings are errors here."""
    rate = np.concatenate([np.zeros(2), np.geomspace(5e-324, 1e-3, 96), -np.geomspace(5e-324, 1e-3, 2)])
    motion = replace(rich_motion(100), rate=rate)
    assert np.isfinite(addition(by_key(key), motion, np.array(FORMULAS[key][0]))).all()


def test_lock_in_has_nothing_to_show_without_a_rate() -> None:
    motion = rich_motion(10)
    assert LockIn().grid(motion).shape == (1, 0)
    assert LockIn().grid(replace(motion, rate=np.zeros(10))).shape == (0, 0)


# ------------------------------------------------------------------------------- single curves, derived again


def test_thermal_lag_of_a_ramp() -> None:
    """T = T0 + m t: the excess is m tau (1 - exp(-t / tau)), its mean from the antiderivative."""
    m, tau, c = 0.02, 37.0, 3e-3
    t = edges(200, 1.5)
    motion = Motion(t=t, rate=np.zeros(200), temperature=290 + m * t)
    antiderivative = m * tau * (t + tau * np.exp(-t / tau))
    found = addition(BiasThermalLag(), motion, np.array([c, tau]))
    np.testing.assert_allclose(found, c * np.diff(antiderivative) / 1.5, rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize("u", [0.01, 0.1, -0.5, 3.0])
def test_lock_in_is_near_its_linear_form_and_locks_below_the_threshold(u: float) -> None:
    """sqrt(u^2 - c) = u - c / 2u - c^2 / 8u^3 - ...: the remainder is below c^2 / 4u^3 for c < u^2 / 2."""
    c = 2e-5
    motion = Motion(t=np.arange(2.0), rate=np.array([u]))
    found = addition(LockIn(), motion, np.array([c]))[0]
    assert abs(found + c / (2 * u)) < c**2 / (4 * abs(u) ** 3)
    slow = np.array([0.9 * np.sqrt(c)])
    assert addition(LockIn(), replace(motion, rate=slow), np.array([c]))[0] == -slow[0]
    # Formally, for a fit's trial step: a negative square pushes the other way.
    assert np.sign(addition(LockIn(), motion, np.array([-c]))[0]) == np.sign(u)


def test_the_mean_rate_of_lock_in_is_that_of_adlers_equation() -> None:
    """One period of psi' = w - w_L sin psi by fourth-order Runge-Kutta steps, of the length that the effect says."""
    ratio = np.array([1.2, 1.5, 2.0, 5.0, 20.0, 100.0, 500.0])
    threshold = 9e-4
    w = ratio * threshold
    motion = Motion(t=np.arange(len(w) + 1.0), rate=w)
    mean_rate = w + addition(LockIn(), motion, np.array([threshold**2]))
    steps = 4000
    h, psi = 2 * np.pi / mean_rate / steps, np.zeros_like(w)

    def slope(angle: Floats) -> Floats:
        return w - threshold * np.sin(angle)

    for _ in range(steps):
        k1 = slope(psi)
        k2 = slope(psi + 0.5 * h * k1)
        k3 = slope(psi + 0.5 * h * k2)
        k4 = slope(psi + h * k3)
        psi += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    np.testing.assert_allclose(psi, 2 * np.pi, rtol=1e-9)


def test_a_threshold_that_neither_settles_nor_walks_is_plain_lock_in() -> None:
    motion = rich_motion(100)
    z = np.random.default_rng(0).standard_normal((1, 100))
    wander, _ = LockInWander().apply(motion.rate, motion, np.array([2e-3, 0.0, 50.0, 0.0]), None, z)
    np.testing.assert_allclose(wander, addition(LockIn(), motion, np.array([4e-6])), rtol=1e-14)


def test_the_threshold_of_lock_in_settles_and_walks_as_its_parameters_say() -> None:
    n, dt, level, rise, tau, walk = 4000, 0.1, 1e-3, 0.2, 60.0, 1e-3
    t, u = edges(n, dt), np.full((50, n), 0.05)
    motion = Motion(t=t, rate=u)
    z = np.random.default_rng(1).standard_normal((50, 1, n))
    found, _ = LockInWander().apply(u, motion, np.array([level, rise, tau, walk]), None, z)
    # Adler backwards: W^2 = u^2 - (u + e)^2.
    threshold = np.sqrt(-found * (2 * u + found)) / level
    settling = rise * (1 - np.exp(-t / tau))
    wandered = threshold - 1 - interval_mean(settling)
    # Trapezoid of an exponential: rise (dt / tau)^2 / 12 = 5e-8, against a walk of 1e-3 sqrt(0.1) = 3e-4 a step.
    steps = np.diff(wandered, axis=-1) / (walk * np.sqrt(dt))
    # Variance 2/3 of 200 000 increments of means of a walk, neighbours correlated by 1/4: 0.36 %; 2 % is above 5 sigma.
    assert np.mean(steps**2) == pytest.approx(2 / 3, rel=0.02)
    # Its end, of 50 runs; false alarm 2e-6.
    assert 1e-6 < chi2.cdf(np.sum(wandered[:, -1] ** 2) / (walk**2 * n * dt), 50) < 1 - 1e-6


def test_the_expected_wander_has_no_walk() -> None:
    motion = rich_motion(50)
    sensor = Sensor("gyro", (LockInWander(),))
    columns = sensor.regressors(motion, np.array([2e-3, 0.2, 5.0, 1e-3]))
    assert columns.shape == (50, 4)
    assert np.all(np.any(columns[:, :3], axis=0)) and not columns[:, 3].any()


@given(st.integers(1, 12), st.integers(1, 60), st.sampled_from([1.0, 0.01, 1 / 3, 1 / 64.055]))
def test_a_held_sample_repeats_for_whole_intervals(hold: int, n: int, dt: float) -> None:
    u = np.arange(1.0, n + 1)
    motion = Motion(t=edges(n, dt), rate=u)
    held = u + addition(SampleHold(), motion, np.array([1.0, hold * dt]))
    np.testing.assert_array_equal(held, u[np.arange(n) // hold * hold])


@pytest.mark.parametrize("ratio", [0.3, 1.3, 1.5, 2.5, 7.77])
def test_a_hold_of_broken_intervals_renews_with_the_first_middle_in_its_cell(ratio: float) -> None:
    n, dt = 50, 0.02
    u = np.arange(1.0, n + 1)
    cell = np.floor((np.arange(n) + 0.5) / ratio + 1e-9)
    expected = [u[np.flatnonzero(cell == cell[k])[0]] for k in range(n)]
    motion = Motion(t=edges(n, dt), rate=u)
    np.testing.assert_array_equal(u + addition(SampleHold(), motion, np.array([1.0, ratio * dt])), expected)


def test_a_spline_and_a_constant_make_every_cubic_and_go_on_as_a_constant() -> None:
    x = np.linspace(250.0, 330.0, 400)
    motion = Motion(t=np.arange(400.0), rate=np.zeros(399), temperature=x)
    effect = SplineTemperature().over(motion)
    design = np.column_stack([np.ones(399), effect.basis(motion.rate, motion)])
    assert np.linalg.matrix_rank(design) == effect.count + 1
    antiderivative = ((x - 290) / 40) ** 4 * 10
    cubic = np.diff(antiderivative) / np.diff(x)
    coefficients = np.linalg.lstsq(design, cubic, rcond=None)[0]
    np.testing.assert_allclose(design @ coefficients, cubic, atol=1e-10)
    outside = replace(motion, temperature=x + 100.0)
    beyond = effect.basis(outside.rate, outside)[-10:]
    np.testing.assert_allclose(beyond, np.broadcast_to(np.eye(effect.count)[-1], beyond.shape), atol=1e-12)


def test_a_spline_over_something_that_stands_still_is_flat() -> None:
    motion = Motion(t=np.arange(11.0), rate=np.zeros(10), temperature=np.full(11, 300.0))
    basis = SplineTemperature().over(motion).basis(motion.rate, motion)
    assert np.all(basis == basis[0])


def test_an_angle_spline_has_the_period_of_a_turn() -> None:
    motion = rich_motion(100)
    assert motion.angle is not None
    turned = replace(motion, angle=motion.angle - 6 * np.pi)
    effect = SplineAngle()
    np.testing.assert_allclose(effect.basis(turned.rate, turned), effect.basis(motion.rate, motion), atol=1e-12)
    turn = Motion(t=np.arange(2.0), rate=np.zeros(1), angle=np.array([0.3, 0.3 + 2 * np.pi]))
    np.testing.assert_allclose(effect.basis(turn.rate, turn), np.full((1, effect.count), 1 / (effect.count + 1)))


def test_a_harmonic_is_exact_for_a_table_that_turns_evenly() -> None:
    """(sin a1 - sin a0) / (a1 - a0), and a value that does not depend on those beside it."""
    step = np.geomspace(1e-3, 3.0, 400) * np.where(np.arange(400) % 2, 1, -1)
    angle = np.concatenate([[0.0], np.cumsum(step)])
    exact = np.diff(np.sin(2 * angle)) / (2 * step)
    np.testing.assert_allclose(wave(angle, 2, 1.0, 0.0), exact, atol=1e-12)
    found = wave(angle, 2, 0.3, -0.7)
    alone = [wave(angle[k : k + 2], 2, 0.3, -0.7)[0] for k in range(400)]
    np.testing.assert_array_equal(found, alone)
    still = np.array([0.4, 0.4, 0.4 + 1e-9])
    np.testing.assert_allclose(wave(still, 1, 3.0, 4.0), 3 * np.cos(0.4) + 4 * np.sin(0.4), rtol=1e-8)


@pytest.mark.parametrize("effect", [EarthRate(), AngleLockedRate(2)], ids=lambda e: e.key)
def test_a_harmonic_is_averaged_where_the_rate_changes_within_an_interval(effect: EarthRate | AngleLockedRate) -> None:
    """A sine of 60 deg at 2 Hz, as a slow logger sees it: against the mean of 400 points within each interval."""
    fine = np.linspace(0.0, 60.0, 120 * 400 + 1)
    angle, rate = np.radians(60) * np.sin(0.5 * fine), np.radians(60) * 0.5 * np.cos(0.5 * fine)
    middle = np.radians(60) * np.sin(0.5 * (fine[:-1] + fine[1:]) / 2)
    order = getattr(effect, "order", 1)
    exact = np.cos(order * middle).reshape(120, 400).mean(axis=1)
    share = 0.5
    even = Motion(t=fine[::400], rate=np.diff(angle[::400]) * 2 * share, angle=angle[::400], projection=share)
    motion = replace(even, rate_edges=rate[::400] * share + 1e-5)
    off = [np.abs(effect.basis(m.rate, m)[:, 0] - exact).max() for m in (even, motion)]
    assert off[0] > 1e-3 > 20 * off[1]


def test_the_cosine_is_a_cosine_at_its_turning_points_too() -> None:
    x = np.concatenate([np.linspace(-300, 300, 100_001), np.pi * np.arange(-9, 10), np.pi / 2 * np.arange(-9, 10)])
    np.testing.assert_allclose(cosine_of_twice(0.5 * x), np.cos(x), atol=5e-16, rtol=0)


def test_a_skew_is_exact_where_it_was_found() -> None:
    dt, late = 0.01, 0.037
    t = dt * np.arange(2001.0)

    def angle(at: np.ndarray) -> np.ndarray:  # corners of the rate at 5 and 8 s
        return 0.5 * (np.maximum(at - 5.0, 0) ** 2 - np.maximum(at - 8.0, 0) ** 2)

    u, earlier = np.diff(angle(t)) / dt, np.diff(angle(t - late)) / dt
    motion = Motion(t=t, rate=u, rate_edges=np.clip(t - 5.0, 0.0, 3.0))
    skew = TimingSkew().near(np.array([late]))
    np.testing.assert_allclose(late * skew.basis(u, motion)[:, 0], earlier - u, atol=1e-3 * late)
    # To first order it is wrong at the corners by half of what the rate changes by in the skew, and more.
    assert np.abs(late * TimingSkew().basis(u, motion)[:, 0] - (earlier - u)).max() > 0.5 * late
    assert skew.near(np.array([late * 1.0005])) == skew


def test_an_anomaly_at_the_largest_rate_is_none() -> None:
    """What rises to the end is any curve of the rate; nothing says that it is local."""
    effect = by_key("scale_factor_anomaly")
    motion = Motion(t=np.arange(5.0), rate=np.array([-0.5, 1.0, 0.2, 0.9]))
    assert effect.unseen(motion, (1.0, 0.1))
    assert not effect.unseen(motion, (0.8, 0.3))
