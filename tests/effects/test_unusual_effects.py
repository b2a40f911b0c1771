"""Rare causes against second derivations, the twins that no search finds, and bent responses in several positions."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from motions import edges, rich_motion
from scipy.spatial.transform import Rotation
from simulated_runs import closed, manifest

from insenv.core.earth import EARTH_RATE
from insenv.core.motion import Motion
from insenv.core.recording import Channel, Floats, Mounting, Recording, Site
from insenv.core.units import STANDARD_GRAVITY
from insenv.effects.acceleration import LeverArm
from insenv.effects.angle import EncoderHarmonic, TableTilt
from insenv.effects.base import Effect
from insenv.effects.bias import BiasWarmUp
from insenv.effects.catalogue import CATALOGUE, by_key
from insenv.effects.forms import play, reversals
from insenv.effects.rate.hysteresis import EncoderBacklash, ScaleFactorHysteresis
from insenv.effects.rate.lag import OutputBandwidth, SelfHeating, SettlingAfterTurn
from insenv.effects.rate.threshold import DeadBand
from insenv.effects.thermal import BiasThermalHysteresis
from insenv.effects.tilt import BaseSettling
from insenv.effects.wobble import Wobble
from insenv.identify.findings import TargetFindings
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes
from insenv.identify.positions.checks.bent import bent
from insenv.identify.positions.least_squares import solve
from insenv.identify.positions.model import Surroundings, triad_term

STUDY = Path(__file__).resolve().parents[2] / "scripts" / "studies" / "unknown"


def added(effect: Effect, motion: Motion, *theta: float) -> Floats:
    return effect.apply(motion.rate, motion, np.array(theta), effect.begin(motion, np.array(theta)))[0]


def table(rate: Floats, dt: float) -> Motion:
    """A table at one rate in each interval."""
    angle = np.concatenate([[0.0], np.cumsum(rate * dt)])
    return Motion(t=edges(len(rate), dt), rate=rate, angle=angle)


@pytest.mark.parametrize("wander", [0.0, 1e-5, 3e-4])
def test_a_reversal_is_told_from_what_smoothing_leaves_of_the_steps_of_an_angle(wander: float) -> None:
    """Waves of some rows have no fourth differences: at each of a hundred in a rest the play was taken up anew."""
    t: Floats = np.arange(6001) * np.float64(0.01)
    angle = 3.0 * np.sin(0.35 * np.maximum(t - 5.0, 0.0)) + wander * np.sin(9.0 * t) * np.sin(1.3 * t)
    motion = Motion(t=t, rate=np.diff(angle) / 0.01, angle=angle)
    forms = EncoderBacklash().variants(motion)
    assert all(reversals(angle, form.radius) == 6 for form in forms)
    assert max(form.radius for form in forms) > 4e-3
    assert ["taken up" in form.contradiction(np.array([4e-4])) for form in forms] == [f.radius > 2e-3 for f in forms]


def test_a_play_does_not_move_with_the_noise_of_an_angle_at_rest() -> None:
    """It would be the reference's own error: a backlash of the wrong sign was beyond all doubt in nulls of a table."""
    rng = np.random.default_rng(3)
    angle = np.cumsum(np.concatenate([np.full(500, 0.01), np.zeros(500), np.full(500, -0.01), np.zeros(501)]))
    angle += 2e-6 * rng.standard_normal(2001)
    motion = Motion(t=edges(2000, 0.05), rate=np.diff(angle) / 0.05, angle=angle)
    for form in EncoderBacklash().variants(motion):
        rate = added(form, motion, 1e-4)
        for rest in (slice(520, 990), slice(1520, 2000)):
            assert np.abs(rate[rest]).max() < 1e-9 * np.abs(rate).max()


def test_a_chain_of_plays_is_the_play_step_by_step() -> None:
    rng = np.random.default_rng(0)
    x = np.cumsum(rng.standard_normal((3, 257)), axis=1)
    before = x[:, 0] + 0.3
    found = play(x, 1.7, before)
    for row in range(3):
        now = before[row]
        for k, value in enumerate(x[row]):
            now = min(max(now, value - 1.7), value + 1.7)
            assert found[row, k] == now


def test_the_angle_of_an_encoder_stays_behind_by_its_play_after_each_reversal() -> None:
    rate = np.concatenate([np.full(50, 0.2), np.full(80, -0.2), np.full(60, 0.2)])
    motion = replace(table(rate, 0.1), projection=0.5)
    behind = np.cumsum(added(EncoderBacklash(), motion, 1e-4)) * 0.1 / 0.5
    # From the middle of its play: half of it at first, then all of it to and fro.
    assert behind[49] == pytest.approx(0.5e-4)
    assert behind[129] == pytest.approx(-0.5e-4)
    assert behind[-1] == pytest.approx(0.5e-4)


def test_a_bias_stays_behind_the_temperature_by_half_its_loop() -> None:
    heat = 300.0 + np.concatenate([np.linspace(0, 20, 21), np.linspace(19, -20, 40), np.linspace(-19, 20, 40)])
    motion = Motion(t=edges(len(heat) - 1, 1.0), rate=np.zeros(len(heat) - 1), temperature=heat)
    loop = added(BiasThermalHysteresis(), motion, 1e-5, 3.0)
    # From the middle: over 3 K at first, then over 6 K after each turn.
    np.testing.assert_allclose(loop[[0, 1, 2, 5, 19]], 1e-5 * np.array([1 / 6, 0.5, 5 / 6, 1, 1]))
    np.testing.assert_allclose(loop[[20, 22, 25, 26, 59]], 1e-5 * np.array([5 / 6, 1 / 6, -5 / 6, -1, -1]))
    assert not BiasThermalHysteresis().blind(motion)
    for once in (np.sort(heat), heat[:62]):
        motion = Motion(t=edges(len(once) - 1, 1.0), rate=np.zeros(len(once) - 1), temperature=once)
        assert "does not turn back" in BiasThermalHysteresis().blind(motion)


def test_a_rate_from_below_reads_another_value_than_from_above() -> None:
    rate = np.array([0.0, 0.2, 0.5, 1.0, 0.5, 0.0, -1.0, 0.5])
    loop = added(ScaleFactorHysteresis(), table(rate, 1.0), 1e-3, 0.1)
    np.testing.assert_allclose(loop, 1e-3 * np.array([0, 1, 1, 1, -1, -1, -1, 1]))
    closed = added(ScaleFactorHysteresis("closed", 1.0), table(rate, 1.0), 1e-3, 0.1)
    assert closed[3] == closed[6] == 0.0 and closed[2] == -closed[4] == pytest.approx(0.75e-3)


def test_a_dead_band_leaves_what_exceeds_it() -> None:
    u = np.array([-1.0, -0.05, 0.0, 0.02, 0.3])
    motion = table(u, 1.0)
    np.testing.assert_allclose(u + added(DeadBand(), motion, 0.1, 0.1), [-0.9, 0, 0, 0, 0.2], atol=1e-15)
    np.testing.assert_allclose(u + added(DeadBand(whole=True), motion, 0.1, 0.1), [-1, 0, 0, 0, 0.3], atol=1e-15)


def test_a_low_pass_has_the_gain_and_the_phase_of_one() -> None:
    dt, tau, omega = 0.002, 0.1, 9.0
    t = edges(20000, dt)
    u = np.diff(-np.cos(omega * t) / omega) / dt
    out = u + added(OutputBandwidth(), Motion(t=t, rate=u), 1.0, tau)
    late = slice(2000, None)
    wave = np.column_stack([np.sin(omega * (t[1:] - dt / 2)), np.cos(omega * (t[1:] - dt / 2))])[late]
    c, s = np.linalg.lstsq(wave, out[late], rcond=None)[0]
    assert np.hypot(c, s) == pytest.approx(1 / np.hypot(1, omega * tau), rel=1e-3)
    assert np.arctan2(-s, c) == pytest.approx(np.arctan(omega * tau), abs=1e-3)


@pytest.mark.parametrize(("power", "heat"), [(2, 0.04), (1, 0.2)])
def test_driving_heats_exponentially_and_cools_so(power: int, heat: float) -> None:
    rate = np.concatenate([np.full(300, -0.2), np.zeros(300)])
    motion = table(rate, 1.0)
    found = added(SelfHeating(power), motion, 2.0, 50.0)
    # Means over an interval in closed form.
    mean = np.exp(-np.arange(300) / 50.0) * 50.0 * -np.expm1(-1 / 50.0)
    np.testing.assert_allclose(found[:300], 2.0 * heat * (1 - mean), rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(found[300:], 2.0 * heat * -np.expm1(-300 / 50.0) * mean, rtol=1e-9)


def test_heat_of_one_rate_is_a_warm_up_and_not_looked_for() -> None:
    one, two = table(np.full(100, 0.3), 1.0), table(np.repeat([0.3, 0.0, -0.3, 0.1], 50), 1.0)
    assert "warm-up" in SelfHeating().blind(one) and not SelfHeating().blind(two)
    stairs = table(np.repeat([0.0, 0.1, 0.0, -0.1, 0.0, 0.2, 0.0, -0.2, 0.0, 0.3, 0.0, -0.3], 8), 1.0)
    assert not SelfHeating().blind(stairs)
    assert SettlingAfterTurn().blind(one) and not SettlingAfterTurn().blind(
        table(np.tile(np.repeat([0.3, 0.0], 20), 4), 1.0)
    )


def test_beside_a_late_reference_no_lag_is_told_but_play_is() -> None:
    late = replace(table(np.repeat([0.3, 0.0, -0.3, 0.0], 50), 1.0), lag=0.02)
    assert "late" in OutputBandwidth().blind(late) and not OutputBandwidth().blind(replace(late, lag=0.0))
    for effect in (ScaleFactorHysteresis(), EncoderBacklash()):
        assert not effect.blind(late)


def test_a_hysteresis_is_told_between_rates_that_hold() -> None:
    swing = table(np.sin(0.1 * np.arange(500.0)), 1.0)
    assert "holds" in ScaleFactorHysteresis().blind(swing)


def test_radii_of_a_hysteresis_begin_beyond_the_noise_of_the_rate() -> None:
    u = np.repeat([0.3, 0.0, -0.3, 0.1], 50)
    noisy = u + 2e-3 * np.random.default_rng(1).standard_normal(len(u))
    (fitted, *_), effect = ScaleFactorHysteresis().variants(table(noisy, 1.0)), ScaleFactorHysteresis()
    assert 3e-3 < fitted.least < 6e-3 and effect.grid(table(noisy, 1.0)).min() > fitted.least
    told = replace(table(noisy, 1.0), reading=1e-3)  # the rate was so fast: an instrument that reads it too says less
    assert effect.variants(told)[0].least == 2e-3 and len(effect.grid(told)) == len(effect.grid(table(u, 1.0)))
    assert effect.grid(table(u, 1.0)).min() == pytest.approx(0.003)


def test_what_settles_has_the_sense_of_the_turn_before() -> None:
    rate = np.concatenate([np.zeros(5), np.full(4, 0.5), np.zeros(20), np.full(8, -0.5), np.zeros(20)])
    motion = table(rate, 1.0)
    mean = np.exp(-np.arange(20) / 7.0) * 7.0 * -np.expm1(-1 / 7.0)
    for by, first, second in (("sense", 1.0, -1.0), ("each", 1.0, 1.0), ("angle", 2.0, -4.0)):
        found = added(SettlingAfterTurn(by), motion, 1e-3, 7.0)  # type: ignore[arg-type]
        assert not found[:9].any() and not found[29:37].any()
        np.testing.assert_allclose(found[9:29], 1e-3 * first * mean, rtol=1e-12)
        np.testing.assert_allclose(found[37:], 1e-3 * second * mean, rtol=1e-12)


def test_a_lever_arm_feels_what_the_second_derivative_of_its_place_is() -> None:
    t = edges(4000, 0.01)
    turned, rate = 0.4 * np.sin(1.3 * t), 0.52 * np.cos(1.3 * t)
    motion = Motion(t=t, rate=np.zeros(4000), turn_rate=rate)
    place = 0.2 * np.exp(1j * turned)
    second = np.diff(place, 2) / 0.01**2 * np.exp(-1j * turned[1:-1])
    basis = LeverArm().basis(motion.rate, motion)
    found = 0.2 * (-basis[..., 0] + 1j * basis[..., 1])
    np.testing.assert_allclose(0.5 * (found[1:] + found[:-1]), second, atol=1e-4)


def test_an_axis_that_is_not_plumb_shows_gravity_once_a_turn() -> None:
    """Of a table that leans by d about its second axis, an accelerometer at the angle a feels g sin(d) cos(a)."""
    t, lean = edges(2000, 0.01), 0.02
    angle = 0.7 * t + 0.3
    motion = Motion(t=t, rate=np.zeros(2000), angle=angle)
    up = Rotation.from_euler("y", lean).inv().apply([0.0, 0.0, STANDARD_GRAVITY])
    felt = Rotation.from_euler("z", -angle[:, None]).apply(up)[:, 0]
    basis = TableTilt().basis(motion.rate, motion)
    np.testing.assert_allclose(-np.sin(lean) * basis[..., 0], 0.5 * (felt[1:] + felt[:-1]), atol=1e-5)


def test_a_wobble_is_the_curve_of_a_harmonic_at_one_tilt() -> None:
    motion = rich_motion(600)
    for order in (1, 2):
        twins = EncoderHarmonic(order).twins(motion)
        assert {e.key for e in twins} == {f"wobble:{k}" for k in (order - 1, order + 1) if k}
        own = EncoderHarmonic(order).basis(motion.rate, motion)
        for twin in twins:
            assert isinstance(twin, Wobble)
            columns = twin.basis(motion.rate, motion)
            alike = columns[:, :2] if twin.order > order else columns[:, 2:]
            left = alike - own @ np.linalg.lstsq(own, alike, rcond=None)[0]
            assert np.abs(left).max() < 1e-12 * np.abs(alike).max()
    assert EncoderHarmonic(1).twins(replace(motion, projection=1.0)) == ()


def test_a_base_that_settles_is_the_curve_of_a_warm_up() -> None:
    motion = replace(rich_motion(300), angle=None)
    assert BiasWarmUp().twins(motion) == (BaseSettling(),)
    theta = np.array([0.01, 9.0])
    np.testing.assert_array_equal(
        BaseSettling().curve(motion.rate, motion, theta), BiasWarmUp().curve(motion.rate, motion, theta)
    )


def test_twins_say_what_tells_them() -> None:
    motion = rich_motion(60)
    for effect in CATALOGUE:
        assert all(twin.told_by and twin not in CATALOGUE for twin in effect.twins(motion))


def rests(rng: np.random.Generator, cube: float) -> Magnitudes:
    """Forty attitudes of an accelerometer triad, 1 mm/s^2 of noise, c f^3 / g^2 on x."""
    f = rng.standard_normal((40, 3))
    f *= 9.80665 / np.linalg.norm(f, axis=1)[:, None]
    measured = f + 1e-3 * rng.standard_normal(f.shape)
    measured[:, 0] += cube * f[:, 0] ** 3 / 9.80665**2
    every = np.ones(40, bool)
    return Magnitudes(measured, np.full(40, 9.80665), Surroundings(np.arange(40.0)), every, every)


def test_a_bent_response_is_told_and_noise_is_not() -> None:
    """Nulls: 100 at 1 %, more than 6 with a probability of 2e-4."""
    terms = [triad_term(e) for e in _triad()]
    false = 0
    for seed in range(100):
        problem = rests(np.random.default_rng(seed), 0.0)
        false += bool(bent(problem, solve(problem, terms), 0.01))
    assert false <= 6
    problem = rests(np.random.default_rng(7), 2e-3)
    (reason,) = bent(problem, solve(problem, terms), 0.01)
    assert "cube" in reason


def test_a_bend_is_told_whatever_gravity_is_and_beside_axes_that_are_not_square() -> None:
    """Nulls: 30 at 1 %, more than 3 with a probability of 2e-4. Where nobody stated gravity no bend was ever told."""
    terms = [triad_term(e) for e in _triad()]
    skewed, false = np.array([[0, 3e-3, 0], [0, 0, 0], [0, 0, 0.0]]), 0
    for seed in range(30):
        problem = rests(np.random.default_rng(seed), 0.0)
        problem = replace(problem, measured=problem.measured @ (np.eye(3) + skewed), free_gravity=True)
        false += bool(bent(problem, solve(problem, terms[:2]), 0.01, terms))
    assert false <= 3
    problem = rests(np.random.default_rng(7), 2e-3)
    problem = replace(problem, measured=problem.measured @ (np.eye(3) + skewed), free_gravity=True)
    (reason,) = bent(problem, solve(problem, terms[:2]), 0.01, terms)
    assert "cube" in reason


def _triad() -> list[Effect]:
    return [by_key(key) for key in ("accel_bias", "accel_scale_factor", "non_orthogonality")]


@pytest.mark.parametrize(
    "name", ["generate.py", "procedures.py", "files.py", "causes.py", "units.py", "world.py", "rules.py"]
)
def test_the_generator_of_the_study_shares_nothing_with_insenv(name: str) -> None:
    tree = ast.parse((STUDY / name).read_text(encoding="utf-8"))
    imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    imported |= {a.name for node in ast.walk(tree) if isinstance(node, ast.Import) for a in node.names}
    assert not any(str(module).startswith(("insenv", "estimators", "scipy")) for module in imported)


@pytest.mark.parametrize(
    ("levels", "told"),
    [((1.0,), False), ((0.2, 0.5, 1.0), False), ((0.2, 1.0, 0.5, 1.2), False), ((0.2, 0.5, 1.0, 0.5, 0.2), True)],
)
def test_a_hysteresis_wants_a_rate_that_is_reached_from_both_sides(levels: tuple[float, ...], told: bool) -> None:
    """Else it is a curve of the rate; noise of the rate, a hundredth of a level, is no change of it."""
    rate = np.repeat(levels, 400) + 0.002 * np.random.default_rng(1).standard_normal(400 * len(levels))
    why = ScaleFactorHysteresis().blind(table(rate, 0.1))
    assert ("from below and from above" in why) != told


def _with_sense(sense: Floats, rate: Floats, c: float, earth: float) -> TargetFindings:
    """The loop on a staircase whose gyro reads c for a sense of rotation of its own, beside the Earth's rate."""
    rng, t = np.random.default_rng(4), 0.05 * np.arange(1.0, len(rate) + 1)
    noise = 4e-5 * rng.standard_normal(len(t)) / np.sqrt(0.05)
    y = 1.002 * (rate + earth) + 1e-3 + c * sense + noise
    command = Channel(rate, "rad/s", "interval", source="command")
    site = Site(latitude=0.7) if earth else Site()
    channels = {"gyro": Channel(y, "rad/s", "interval"), "table_rate": command}
    run = Recording(t, channels, site=site, mounting=Mounting(tilt=np.pi / 2))
    declared = ("bias", "scale_factor", *(("earth_rate",) if earth else ()))
    return closed(run, manifest(declared=declared)).targets[0]


STAIRCASE = np.deg2rad(np.repeat([5.0, -5, 20, -20, 40, -40, 10, -10, 30, -30, 0, 0], 1200))


@pytest.mark.parametrize("earth", [0.0, EARTH_RATE * np.sin(0.7)])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_bias_with_the_sense_of_rotation_is_told_from_a_dead_band(sign: int, earth: float) -> None:
    """A motor's current, where an anomaly or a knee was named: of a table that rests none, though the Earth turns it.

    What is lost at all rates is a threshold as well, unless the Earth's rate would be lost of a table at rest.
    """
    c = 3e-4
    found = _with_sense(sign * np.sign(STAIRCASE), STAIRCASE, c, earth)
    (one,) = found.added
    either = {"bias_direction", "dead_band"} if sign < 0 else {"bias_direction"}
    assert {one.effect, *one.confounded_with, *one.same_curve} <= either and one.effect in either
    size = next(p for p in one.parameters if p.parameter == "c")
    assert abs(abs(size.value) - c) < 4 * size.sd < c
