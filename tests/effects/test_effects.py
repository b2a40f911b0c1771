"""Facts that hold for every effect of the catalogue at once."""

from dataclasses import replace

import numpy as np
import pytest
from effect_cases import CURVES, DETERMINISTIC, KEYS, addition, normals, on, typical
from hypothesis import given
from hypothesis import strategies as st
from motions import rich_motion

from insenv.core.errors import InputError
from insenv.effects.angle import TableTilt
from insenv.effects.base import OUTPUT, CurveEffect, LinearEffect, MemoryEffect, central_differences
from insenv.effects.catalogue import ALL, CATALOGUE, TRIAD, by_key
from insenv.effects.own import TUMBLE, UNIT
from insenv.effects.spline import SplineAngle, SplineTime

#: What does nothing, for a reason that its effect tells.
SILENT = {("wobble:1", "c")}

every_effect = pytest.mark.parametrize("key", KEYS)
every_deterministic = pytest.mark.parametrize("key", DETERMINISTIC)
every_curve = pytest.mark.parametrize("key", CURVES)


# ------------------------------------------------------------------------------------------- what is declared


def test_the_catalogue_has_the_names_of_the_contract() -> None:
    assert len(set(KEYS)) == len(KEYS)
    assert {effect.id for effect in CATALOGUE} == {
        *("bias", "bias_drift", "bias_warm_up", "bias_step"),
        *("bias_temperature", "bias_temperature_rate", "bias_thermal_lag", "bias_thermal_hysteresis"),
        *("scale_factor", "scale_factor_drift", "scale_factor_warm_up", "scale_factor_temperature"),
        *("scale_factor_asymmetry", "scale_factor_cubic", "scale_factor_anomaly", "scale_factor_knee", "lock_in"),
        "compensation_ripple",
        *("encoder_harmonic", "angle_locked_rate", "earth_rate", "timing_skew", "sample_hold"),
        *("g_sensitivity", "cross_axis", "tone", "base_tilt"),
        *("encoder_backlash", "scale_factor_hysteresis", "dead_band", "bias_direction", "self_heating"),
        *("settling_after_turn", "centripetal_acceleration", "vibration_rectification", "lever_arm"),
        "table_tilt",
        *("spline_time", "spline_temperature", "spline_rate", "spline_angle"),
        *("angle_random_walk", "bias_instability", "rate_random_walk", "quantization"),
    }


def test_what_only_a_scenario_may_name_is_not_tried() -> None:
    assert ALL[: len(CATALOGUE)] == CATALOGUE
    assert {effect.id for effect in ALL[len(CATALOGUE) :]} == {
        *("accel_bias", "accel_scale_factor", "non_orthogonality", "misalignment"),
        *("wobble", "lock_in_wander", "rate_lock", "sine_response", "magnetic_field", "base_settling"),
        *("output_bandwidth", "accel_asymmetry", "accel_second_order", "size_effect", "force_delay"),
        *("accel_third_order", "accel_cross_coupling", "accel_misalignment"),
    }


@every_effect
def test_parameters_are_declared_in_full(key: str) -> None:
    effect = by_key(key)
    assert effect.key == key
    assert effect.source
    assert effect.linear
    names = [p.name for p in effect.params]
    assert len(set(names)) == len(names)
    for p in effect.params:
        assert p.unit
        assert 0 < p.sd < np.inf
        # A bound that is a share of the largest rate has no scale in common with the standard deviation.
        assert p.per_rate or p.per_run or p.sd <= p.bound
        # A step of a difference must not leave the range.
        assert p.low <= 0 or p.low > 1e-3 * p.sd


def test_a_key_names_an_effect_and_its_order() -> None:
    assert by_key("encoder_harmonic").key == "encoder_harmonic:1"
    assert by_key("encoder_harmonic:12").key == "encoder_harmonic:12"
    assert [p.name for p in by_key("bias_temperature:3").linear] == ["c", "c2", "c3"]


@pytest.mark.parametrize(
    ("key", "complaint"),
    [
        ("bais", "unknown effect 'bais'; did you mean 'bias'"),
        ("bias:2", "'bias' has no order"),
        ("bias_temperature:4", "order 4 given, wanted 1 to 3"),
        ("bias_temperature:", "order '' given, wanted a whole number"),
        ("encoder_harmonic:0", "order 0 given, wanted 1 to 360"),
        ("encoder_harmonic:-1", "order '-1' given, wanted a whole number"),
    ],
)
def test_a_wrong_key_ends_in_one_sentence(key: str, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        by_key(key)


@given(st.one_of(st.text(), st.tuples(st.sampled_from(KEYS), st.text()).map(":".join)))
def test_any_text_is_an_effect_or_an_input_error(key: str) -> None:
    try:
        assert by_key(key).key.startswith(key)
    except InputError as error:
        assert "\n" not in str(error)


@every_deterministic
def test_an_effect_of_the_rate_follows_the_input(key: str) -> None:
    motion = rich_motion(200)
    effect = on(motion, key)
    theta = typical(effect, motion)
    assert motion.rate_edges is not None
    within = 1.0 if "rate_edges" in effect.sharpened_by else 1.5
    faster = replace(motion, rate=1.5 * motion.rate, rate_edges=within * motion.rate_edges)
    back = replace(motion, rate=-motion.rate, rate_edges=-motion.rate_edges)
    follows = np.any(addition(effect, faster, theta) != addition(effect, motion, theta))
    # A sense of rotation is the same at any rate.
    follows |= effect.of_rate and bool(np.any(addition(effect, back, theta) != addition(effect, motion, theta)))
    assert follows == effect.of_rate
    # An accelerometer at rest has no input rate, and of a table's angle it feels where gravity points.
    turns = effect.of_rate or "angle" in effect.needs or "cross_rate" in effect.needs
    assert not (turns and "accelerometer" in effect.instruments) or effect in (*TRIAD, *UNIT, *TUMBLE, TableTilt())


def test_an_effect_belongs_to_some_instrument_and_curves_without_a_cause_are_generic() -> None:
    for effect in CATALOGUE:
        assert effect.instruments and set(effect.instruments) <= {"gyro", "accelerometer"}
        assert effect.generic == effect.id.startswith("spline_")
    alone = {effect.id for effect in CATALOGUE if effect.instruments == ("accelerometer",)}
    assert alone == {"base_tilt", "lever_arm", "table_tilt"}


@pytest.mark.parametrize("tau", [1e-3, 0.1, 0.3])
def test_the_slope_of_a_short_time_constant_is_taken_on_its_own_side_of_zero(tau: float) -> None:
    motion = rich_motion(200)
    effect = by_key("bias_warm_up")
    assert isinstance(effect, CurveEffect)
    slope = effect.jacobian(motion.rate, motion, np.array([1.0, tau]))[:, 1]
    # d/dtau of the mean over the first interval of exp(-t / tau), that is of (tau / dt) (1 - exp(-dt / tau)).
    x = motion.dt / tau
    assert slope[0] == pytest.approx((1 - (1 + x) * np.exp(-x)) / motion.dt, rel=1e-5)
    assert np.isfinite(slope).all()


def test_settings_out_of_range_are_refused() -> None:
    for make in (
        lambda: SplineTime(count=2),
        lambda: SplineTime(low=1.0, high=1.0),
        lambda: SplineAngle(count=2),
    ):
        with pytest.raises(InputError, match="wanted at least 3"):
            make()


# ------------------------------------------------------------------------------------------- what is computed


@every_effect
def test_shapes(key: str) -> None:
    for batch in ((), (3,), (2, 3)):
        motion = rich_motion(40, batch=batch)
        effect = on(motion, key)
        theta = typical(effect, motion)
        assert addition(effect, motion, theta).shape == (*batch, 40)
        if isinstance(effect, LinearEffect):
            assert effect.basis(motion.rate, motion).shape == (*batch, 40, len(theta))
    # Many parameter sets on one motion, and one parameter set on many inputs.
    motion = rich_motion(40)
    theta = typical(on(motion, key), motion)
    z = normals(effect, 40, (5,))
    many = on(motion, key).apply(motion.rate, motion, np.tile(theta, (5, 1)), None, z)[0]
    assert many.shape == (5, 40)
    assert addition(on(motion, key), motion, theta, np.tile(motion.rate, (5, 1))).shape == (5, 40)


@every_effect
def test_zero_coefficients_change_nothing(key: str) -> None:
    motion = rich_motion()
    effect = on(motion, key)
    theta = typical(effect, motion)
    theta[: len(effect.linear)] = 0.0
    assert not np.any(addition(effect, motion, theta))


@every_effect
def test_every_parameter_changes_the_output(key: str) -> None:
    motion = rich_motion()
    effect = on(motion, key)
    theta = typical(effect, motion)
    base = addition(effect, motion, theta)
    assert np.all(np.isfinite(base))
    for j in range(len(theta)):
        moved = theta.copy()
        moved[j] *= 1.5
        change = addition(effect, motion, moved) - base
        if (key, effect.params[j].name) in SILENT:
            assert not np.any(change)
            continue
        assert np.sqrt(np.mean(change**2)) > 1e-3 * np.sqrt(np.mean(base**2)), effect.params[j].name


@every_deterministic
def test_the_jacobian_is_the_difference_of_the_value(key: str) -> None:
    motion = rich_motion(200, 1.0)
    effect = on(motion, key)
    assert isinstance(effect, LinearEffect | CurveEffect)
    theta = typical(effect, motion)
    jacobian = effect.jacobian(motion.rate, motion, theta)
    assert jacobian.shape == (200, len(theta))
    # An independent step: ten times smaller than the one of `CurveEffect.jacobian`.
    finer = [replace(p, sd=0.1 * p.sd) for p in effect.params]
    expected = central_differences(lambda th: addition(effect, motion, th), theta, finer)
    # Neither a step in time nor a renewed sample has a derivative to its shape at every instant.
    smooth = len(effect.linear) if effect.id in ("bias_step", "sample_hold") else len(theta)
    for j in range(smooth):
        scale = np.abs(expected[:, j]).max()
        share = 1e-8 if isinstance(effect, LinearEffect) else 1e-3
        assert np.abs(jacobian[:, j] - expected[:, j]).max() <= share * scale, effect.params[j].name


@every_curve
def test_the_profile_is_the_curve_of_one_unit(key: str) -> None:
    motion = rich_motion(200)
    effect = by_key(key)
    assert isinstance(effect, CurveEffect)
    theta = typical(effect, motion)
    if key in ("lock_in", "rate_lock"):
        theta[0] = 1e-12  # linear as it vanishes
    k = len(effect.linear)
    profile = effect.profile(motion.rate, motion, theta[k:])
    found = addition(effect, motion, theta)
    fast = np.abs(motion.rate) > 0.05  # lock-in bends near standstill
    if key == "rate_lock":
        fast &= np.abs(np.abs(motion.rate) - theta[1]) > 0.05
    np.testing.assert_allclose((profile @ theta[:k])[fast], found[fast], rtol=1e-5, atol=1e-12 * theta[0])


@every_effect
def test_two_halves_are_the_whole(key: str) -> None:
    for dt, cut in ((0.1, 277), (0.01, 1), (1 / 64.055, 599)):
        motion = rich_motion(600, dt=dt, batch=(2,))
        effect = on(motion, key)
        theta = typical(effect, motion)
        z = normals(effect, motion.n, (2,))
        whole, end = effect.apply(motion.rate, motion, theta, effect.begin(motion, theta), z)
        state, parts = effect.begin(motion, theta), []
        for a, b in ((0, cut), (cut, motion.n)):
            part, state = effect.apply(
                motion.rate[..., a:b], motion.interval(a, b), theta, state, None if z is None else z[..., a:b]
            )
            parts.append(part)
        # The length of an interval, read off the edges, differs by a rounding between the chunks.
        scale = np.abs(whole).max()
        np.testing.assert_allclose(np.concatenate(parts, axis=-1), whole, rtol=1e-10, atol=1e-10 * scale)
        if end is not None:
            np.testing.assert_allclose(state, end, rtol=1e-10, atol=1e-10)


@every_effect
def test_a_row_of_a_batch_is_the_single_run(key: str) -> None:
    motion = rich_motion(123, batch=(3,))
    effect = on(motion, key)
    theta = typical(effect, motion) * np.array([[1.0], [0.7], [1.3]])
    z = normals(effect, motion.n, (3,))
    batch, _ = effect.apply(motion.rate, motion, theta, effect.begin(motion, theta), z)
    for i in range(3):
        row = motion.row(i)
        single, _ = effect.apply(
            motion.rate[i], row, theta[i], effect.begin(row, theta[i]), None if z is None else z[i]
        )
        np.testing.assert_array_equal(batch[i], single)


@every_effect
def test_needs_are_what_the_effect_depends_on(key: str) -> None:
    motion = rich_motion(50)
    mappings = ("force", "vibration", "cross_rate", "body_rate")
    optional = ("angle", "rate_edges", "turn_rate", "temperature", "base_tilt", "across", *mappings)
    lacking: dict[str, object] = {name: {} if name in mappings else None for name in optional}
    effect = on(motion, key)
    theta = typical(effect, motion)
    assert effect.missing(motion) == ()
    for need in effect.needs:
        assert effect.missing(replace(motion, **{need: lacking[need]})) == (need,)  # type: ignore[arg-type]
    used = effect.needs + effect.sharpened_by
    bare = replace(motion, **{k: v for k, v in lacking.items() if k not in used})  # type: ignore[arg-type]
    np.testing.assert_array_equal(addition(effect, bare, theta), addition(effect, motion, theta))
    if set(effect.needs) & {"angle", "rate_edges", "temperature", "base_tilt"}:
        with pytest.raises(InputError, match=f"needs {effect.needs[0]}, which the exposure lacks"):
            addition(effect, replace(motion, **{effect.needs[0]: None}), theta)  # type: ignore[arg-type]


EXACT = {
    *(
        "bias",
        "bias_drift",
        "bias_warm_up",
        "bias_step",
        "bias_temperature_rate",
        "scale_factor",
        "timing_skew",
    ),
    *("tone", "base_tilt", "g_sensitivity", "cross_axis", "spline_time"),
    *(key for key in KEYS if key.startswith(("encoder_harmonic", "wobble"))),
}
# A threshold and a held sample are no smooth functions of the exposure.
ABRUPT = {"lock_in", "rate_lock", "sample_hold"}
# Nor are the side of a play and the end of a turn.
ABRUPT |= {
    "dead_band",
    "bias_direction",
    "encoder_backlash",
    "scale_factor_hysteresis",
    "settling_after_turn",
    "bias_thermal_hysteresis",
}


@pytest.mark.parametrize("key", [key for key in DETERMINISTIC if key not in ABRUPT])
def test_an_interval_has_the_mean_of_its_parts(key: str) -> None:
    coarse, fine = rich_motion(3000, 0.02), rich_motion(48000, 0.00125)
    effect = on(coarse, key)
    theta = typical(effect, coarse)
    if key == "tone":
        theta[-1] = 22.6  # nearly half a cycle per interval
    if key == "bias_step":
        theta[-1] = 31.005  # within an interval
    found = addition(effect, coarse, theta)
    mean = addition(effect, fine, theta).reshape(-1, 16).mean(axis=-1)
    # Exact forms to rounding; the others to the curvature of the exposure within 0.02 s.
    share = 1e-9 if key in EXACT else 1e-3
    assert np.abs(found - mean).max() < share * np.abs(mean).max()


def test_memory_without_a_state_is_the_start_of_a_run() -> None:
    motion = rich_motion(50)
    for effect in CATALOGUE:
        if isinstance(effect, MemoryEffect):
            theta = typical(effect, motion)
            np.testing.assert_array_equal(
                effect.apply(motion.rate, motion, theta)[0], effect.curve(motion.rate, motion, theta)
            )


def test_the_height_of_a_law_of_the_rate_is_credible_as_a_share_of_the_largest_rate() -> None:
    """A ripple of 5 % of a slow table's rate was within 0.1 rad/s: it followed what smoothing leaves of an encoder."""
    heights = [p for e in CATALOGUE if e.of_rate and not e.generic for p in e.linear if p.unit == OUTPUT]
    assert len(heights) >= 4
    assert all(p.per_rate and p.bound <= 0.2 for p in heights)
