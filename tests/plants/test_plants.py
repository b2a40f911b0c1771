"""Plants: what they say of motion is consistent, obeys their limits, and may be cut anywhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.motion import interval_mean
from insenv.core.recording import Floats
from insenv.core.rows import rows
from insenv.effects.catalogue import by_key
from insenv.plants import profile, thermal
from insenv.plants.base import Plant, Scene
from insenv.plants.static import Disturbance, StaticBase
from insenv.plants.turntable import Encoder, Ripple, Turntable

DEG = np.pi / 180
NONE = np.empty((0, 1))

PROFILES = {
    "constant": profile.constant(10 * DEG, np.inf),
    "staircase": profile.staircase([0, 5 * DEG, -20 * DEG, 30 * DEG], 3.217),
    "reversal": profile.reversal(10 * DEG, 2.5, 3),
    "sine": profile.sine(8 * DEG, 0.4, np.inf, 1 * DEG),
    "rest": profile.rest(np.inf),
    "mixed": profile.sine(8 * DEG, 0.4, 4.1) + profile.constant(-9 * DEG, 5.0) + profile.rest(np.inf),
}


def edges(seconds: float, rate: float) -> Floats:
    return np.arange(round(seconds * rate) + 1) / rate


def play(plant: Plant, t: Floats, z: Floats | None = None) -> Scene:
    return plant.advance(plant.begin(), None, t, np.empty((plant.draws, len(t) - 1)) if z is None else z)[0]


def in_chunks(plant: Plant, t: Floats, cuts: Sequence[int], z: Floats) -> list[Scene]:
    state, scenes = plant.begin(), []
    for a, b in zip([0, *cuts], [*cuts, len(t) - 1], strict=True):
        scene, state = plant.advance(state, None, t[a : b + 1], z[..., a:b])
        scenes.append(scene)
    return scenes


def angle_of(scene: Scene) -> Floats:
    angle = scene.motions["gyro"].angle
    assert angle is not None
    return angle


@pytest.mark.parametrize("name", PROFILES)
@pytest.mark.parametrize("acceleration", [np.inf, 25 * DEG])
def test_rate_is_the_derivative_of_the_angle(name: str, acceleration: float) -> None:
    table = Turntable(max_acceleration=acceleration, ripple=Ripple(0.02, 3), profile=PROFILES[name])
    motion = play(table, edges(12, 2000)).motions["gyro"]
    angle, rate = motion.angle, motion.rate_edges
    assert angle is not None and rate is not None
    np.testing.assert_allclose(motion.rate, np.diff(angle) / motion.dt, rtol=1e-12, atol=1e-15)
    error = np.abs(motion.rate - interval_mean(rate))
    # A corner of the rate, where the servo begins or ends to slew, leaves the trapezoid an eighth of a step.
    jumps = np.abs(np.diff(rate)) > 0.05
    assert error[~jumps].max() < 25 * DEG / 2000 / 4
    assert jumps.sum() <= (6 if acceleration == np.inf else 0)


@pytest.mark.parametrize("name", PROFILES)
def test_the_servo_obeys_its_limits(name: str) -> None:
    table = Turntable(max_rate=30 * DEG, max_acceleration=25 * DEG, profile=PROFILES[name])
    rate = play(table, edges(14, 1000)).motions["gyro"].rate_edges
    assert rate is not None
    assert np.abs(rate).max() <= 30 * DEG * (1 + 1e-12)
    assert np.abs(np.diff(rate) * 1000).max() <= 25 * DEG * (1 + 1e-5)


def test_a_dwell_ends_at_its_rate_and_its_angle() -> None:
    table = Turntable(max_acceleration=5 * DEG, profile=profile.rest(1) + profile.constant(10 * DEG, 5.0))
    motion = play(table, edges(6, 10)).motions["gyro"]
    # Two seconds at 5 deg/s^2, then three at 10 deg/s: 10 deg + 30 deg.
    assert angle_of(play(table, edges(6, 10)))[-1] == pytest.approx(40 * DEG, rel=1e-12)
    assert motion.rate[-1] == pytest.approx(10 * DEG, rel=1e-12)


def test_ripple_repeats_with_the_angle_and_keeps_the_mean_rate() -> None:
    table = Turntable(ripple=Ripple(0.1, 4), profile=profile.constant(36 * DEG, np.inf))
    motion = play(table, edges(10, 500)).motions["gyro"]
    angle, rate = motion.angle, motion.rate_edges
    assert angle is not None and rate is not None
    np.testing.assert_allclose(rate, 36 * DEG * (1 + 0.1 * np.cos(4 * angle)) / np.sqrt(1 - 0.01), rtol=1e-11)
    assert angle[-1] == pytest.approx(2 * np.pi, rel=1e-12)


@pytest.mark.parametrize("name", PROFILES)
def test_a_turntable_in_chunks_is_the_turntable_in_one_piece(name: str) -> None:
    table = Turntable(
        latitude=0.6, tilt=0.4, max_acceleration=40 * DEG, ripple=Ripple(1e-3, 2), encoder=Encoder(noise=1e-5)
    )
    table = replace(table, profile=PROFILES[name], temperature=thermal.WarmUp(290, 10, 5))
    t = edges(12, 64.055)
    z = np.random.default_rng(1).standard_normal((1, len(t) - 1))
    whole, parts = play(table, t, z), in_chunks(table, t, [1, 7, 100, 500], z)
    assert np.array_equal(angle_of(whole)[1:], np.concatenate([angle_of(p)[1:] for p in parts]))
    for name_, reference in whole.references.items():
        joined = np.concatenate([p.references[name_].values for p in parts])
        np.testing.assert_allclose(joined, reference.values, rtol=1e-11, atol=1e-14)


def test_commands_in_chunks_are_the_profile_of_the_same_steps() -> None:
    rates = np.array([[5.0, -10.0, 0.0], [2.0, 2.0, 30.0]]) * DEG  # two tables, three commands
    table = Turntable(max_rate=20 * DEG, max_acceleration=8 * DEG)
    state, angles = table.begin(), []
    t = edges(6, 50)
    for k in range(3):
        scene, state = table.advance(state, rates[:, k], t[100 * k : 100 * k + 101], NONE)
        angles.append(angle_of(scene)[:, 1:])
    for row, angle in zip(rates, np.concatenate(angles, axis=-1), strict=True):
        # A command beyond the limit is held at the limit; a table that begins at rest must first get going.
        steps = profile.staircase([0.0, *np.clip(row, -20 * DEG, 20 * DEG)], 2.0)
        alone = play(replace(table, profile=steps), edges(8, 50))
        np.testing.assert_allclose(angle, angle_of(alone)[101:], rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("skew", [0.02, 0.5, 7.0])
def test_an_encoder_with_skew_shows_the_angle_as_it_was(skew: float) -> None:
    """Across commands too, and across more than one of them."""
    prompt = Turntable(max_rate=20 * DEG, max_acceleration=8 * DEG, ripple=Ripple(0.01, 3))
    late = replace(prompt, encoder=Encoder(skew=skew))
    commands = np.array([[5.0, -10.0, 0.0, 3.0], [2.0, 2.0, 30.0, -4.0]]) * DEG
    t = edges(8, 50)
    read = {}
    for table in (prompt, late):
        state, parts = table.begin(), []
        for k in range(4):
            scene, state = table.advance(state, commands[:, k], t[100 * k : 100 * k + 101], NONE)
            parts.append(scene.references["table_angle"].values)
        read[table] = np.concatenate(parts, axis=-1)
    behind = round(skew * 50)
    np.testing.assert_allclose(read[late][:, behind:], read[prompt][:, : 400 - behind], atol=1e-13)
    assert not np.any(read[late][:, :behind])
    assert len(state.start) <= 5  # what is long past is forgotten


def test_a_table_that_turned_before_the_record_began_shows_it() -> None:
    table = Turntable(encoder=Encoder(skew=0.3), profile=profile.constant(0.2, np.inf))
    read = play(table, edges(1, 10)).references["table_angle"].values
    np.testing.assert_allclose(read, 0.2 * (np.arange(1, 11) / 10 - 0.3), atol=1e-15)
    still = replace(table, max_acceleration=0.1)
    scene, _ = still.advance(still.begin(), 0.0, edges(1, 10), NONE)
    np.testing.assert_allclose(
        scene.references["table_angle"].values[:3], 0.2 * np.array([-0.2, -0.1, 0.0]), atol=1e-15
    )


def test_settings_that_a_table_does_not_have_are_refused() -> None:
    with pytest.raises(InputError, match="wanted zero or more seconds"):
        Encoder(skew=-0.1)
    with pytest.raises(InputError, match="carries no 'accel_y'"):
        Turntable(carries=("gyro", "accel_y"))


def test_rows_of_a_batch_of_tables_are_tables() -> None:
    rates = np.array([5.0, -10.0, 3.0]) * DEG
    table = Turntable(max_acceleration=8 * DEG, encoder=Encoder(skew=0.1))
    t = edges(2, 50)
    _, state = table.advance(table.begin(), rates, t[:51], NONE)
    kept = rows(state, np.array([2, 0]))
    whole, _ = table.advance(state, rates, t[50:], NONE)
    part, _ = table.advance(kept, rates[[2, 0]], t[50:], NONE)
    np.testing.assert_array_equal(angle_of(part), angle_of(whole)[[2, 0]])
    shared = rows(table.begin(), np.array([1]))
    np.testing.assert_array_equal(shared.angle, table.begin().angle)


def test_the_zero_mark_gives_a_pulse_every_turn_in_either_sense() -> None:
    table = Turntable(profile=profile.constant(0.9, 10.03) + profile.constant(-0.9, np.inf))
    scene = play(table, edges(40, 10))
    pulse, angle = scene.references["zero_pulse"], angle_of(scene)
    assert pulse.unit == "1" and set(np.unique(pulse.values)) == {0.0, 1.0}
    turns = np.floor(angle / (2 * np.pi))
    np.testing.assert_array_equal(np.flatnonzero(pulse.values), np.flatnonzero(np.diff(turns)))
    # Up to 1.44 turns and back to -2.85: past 1, 1, 0, -1 and -2.
    assert pulse.values.sum() == 5


def attitude(axis_azimuth: Floats, tilt: float, level: tuple[float, float]) -> Floats:
    """Input axis in east, north and up, shape (n, 3), on a table that leans by small rotations."""
    axis = np.stack([np.cos(tilt) * np.sin(axis_azimuth), np.cos(tilt) * np.cos(axis_azimuth)], axis=-1)
    axis = np.column_stack([axis, np.full(len(axis), np.sin(tilt))])
    return axis + np.cross([level[0], level[1], 0.0], axis)


def test_a_table_that_leans_sees_the_earth_and_gravity_from_there() -> None:
    level, azimuth, latitude, tilt = (3e-5, -5e-5), 1.1, 0.7, 0.5
    table = Turntable(
        *(tilt, latitude, azimuth),
        profile=profile.constant(0.3, np.inf),
        level_error=level,
        gravity=9.8,
        carries=("gyro", "accel_x"),
        felt=True,
    )
    scene = play(table, edges(30, 100))
    motion = scene.motions["gyro"]
    assert motion.angle is not None
    middle = interval_mean(motion.angle)
    earth = EARTH_RATE * np.array([0.0, np.cos(latitude), np.sin(latitude)])
    seen = attitude(azimuth - middle, tilt, level) @ earth
    theta = np.array(table.horizontal_earth_rate)
    level_part, _ = by_key("earth_rate").apply(motion.rate, motion, theta)
    # The mean of a cosine over 0.003 rad is 4e-7 below its middle.
    np.testing.assert_allclose(motion.rate - 0.3 * np.sin(tilt) + level_part, seen, atol=1e-6 * EARTH_RATE)
    felt, left = scene.motions["gyro"].force, azimuth - middle - 0.5 * np.pi
    np.testing.assert_array_equal(felt["x"], scene.motions["accel_x"].force["x"])
    for force, heading in ((felt["x"], azimuth - middle), (felt["y"], left)):
        np.testing.assert_allclose(force, attitude(heading, 0.0, level) @ [0, 0, 9.8], atol=1e-6 * 9.8 * 6e-5)
    assert set(felt["z"]) == {9.8}
    assert not scene.motions["accel_x"].rate.any()
    # A lean about north shifts north by its tangent of the latitude.
    c, s = table.horizontal_earth_rate
    assert np.arctan2(s, c) == pytest.approx(azimuth + level[1] * np.tan(latitude), abs=1e-8)


def test_tables_with_their_own_azimuths_are_those_tables() -> None:
    azimuth, east = np.array([0.3, -2.0, 1.5]), np.array([1e-5, 0.0, -2e-5])
    common = Turntable(tilt=0.5, latitude=0.7, profile=profile.constant(0.2, np.inf), carries=("gyro", "accel_x"))
    batch = replace(common, azimuth=azimuth, level_error=(east, 1e-5))
    c, s = map(np.asarray, batch.horizontal_earth_rate)
    assert c.shape == s.shape == (3,)
    whole = play(batch, edges(2, 50)).motions
    for i in range(3):
        one = replace(common, azimuth=float(azimuth[i]), level_error=(float(east[i]), 1e-5))
        assert one.horizontal_earth_rate == (c[i], s[i])
        assert isinstance(one.horizontal_earth_rate[0], float)
        alone = play(one, edges(2, 50)).motions
        np.testing.assert_array_equal(whole["gyro"].rate[i], alone["gyro"].rate)
        np.testing.assert_array_equal(whole["accel_x"].force["x"][i], alone["accel_x"].force["x"])


@pytest.mark.parametrize(
    ("asked", "word"),
    [(profile.constant(31 * DEG, 1.0), "rate"), (profile.sine(20 * DEG, 1.0, 1.0), "acceleration")],
)
def test_a_profile_beyond_the_table_is_refused(asked: profile.Profile, word: str) -> None:
    with pytest.raises(InputError, match=f"asks for a {word}"):
        Turntable(max_rate=30 * DEG, max_acceleration=50 * DEG, profile=asked).begin()


def test_the_input_axis_sees_its_share_of_table_and_earth() -> None:
    table = Turntable(tilt=30 * DEG, latitude=28.2 * DEG, azimuth=70 * DEG, profile=profile.constant(0.1, np.inf))
    rate = play(table, edges(1, 10)).motions["gyro"].rate
    np.testing.assert_allclose(rate, 0.5 * (0.1 + EARTH_RATE * np.sin(28.2 * DEG)), rtol=1e-12)
    # At table angle a the axis points to the azimuth 70 deg - a: north, and all of the rate, at a = 70 deg.
    c, s = table.horizontal_earth_rate
    level = EARTH_RATE * np.cos(28.2 * DEG) * np.cos(30 * DEG)
    assert c * np.cos(70 * DEG) + s * np.sin(70 * DEG) == pytest.approx(level)


def test_an_eccentric_encoder_is_the_effect_encoder_harmonic() -> None:
    size, table = 3e-5, Turntable(tilt=0.6, profile=profile.reversal(0.3, 4.0), max_acceleration=0.5)
    eccentric = replace(table, encoder=Encoder(eccentricity=size))
    t = edges(8, 20)
    scene = play(eccentric, t)
    motion = scene.motions["gyro"]
    read = scene.references["table_angle"].values
    seen = motion.rate[1:] - np.diff(read) / motion.dt * motion.projection
    theta = np.array([0.0, -size])
    effect, _ = by_key("encoder_harmonic").apply(motion.rate, motion, theta)
    np.testing.assert_allclose(seen, effect[1:], atol=1e-12)


def test_an_encoder_reads_multiples_of_its_resolution() -> None:
    encoder = Encoder(resolution=0.01)
    angle = np.linspace(-1, 1, 77)
    steps = encoder.read(angle, NONE) / 0.01
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-9)
    assert np.abs(encoder.read(angle, NONE) - angle).max() <= 0.005 * (1 + 1e-9)


def test_temperatures() -> None:
    t = np.array([0.0, 10.0, 100.0, 1e6])
    np.testing.assert_allclose(thermal.Constant(300.0).at(t), 300.0)
    np.testing.assert_allclose(thermal.Ramp(300, 290, 0.5).at(t), [300, 295, 290, 290])
    np.testing.assert_allclose(thermal.WarmUp(300, 10, 50).at(t), 300 + 10 * (1 - np.exp(-t / 50)))
    # Soak 10 s at 300 K, 20 s of ramp at 1 K/s, soak, back: 320 K from 30 s to 40 s.
    cycle = thermal.cycle([300, 320, 300], 1.0, 10.0)
    np.testing.assert_allclose(cycle.at(np.array([5.0, 20.0, 35.0, 50.0, 99.0])), [300, 310, 320, 310, 300])


ATTITUDE = StaticBase(heading=0.7, pitch=0.05, roll=-0.3, latitude=0.9, gravity=9.8)


def test_a_base_at_rest_sees_the_earth_turn_and_gravity() -> None:
    scene = play(ATTITUDE, edges(1, 4))
    rates = np.array([scene.motions[f"gyro_{a}"].rate for a in "xyz"])
    force = np.array([scene.motions[f"accel_{a}"].force[a] for a in "xyz"])
    np.testing.assert_allclose(np.linalg.norm(rates, axis=0), EARTH_RATE, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(force, axis=0), 9.8, rtol=1e-12)
    np.testing.assert_allclose((rates * force).sum(axis=0), EARTH_RATE * np.sin(0.9) * 9.8, rtol=1e-12)
    assert force[1, 0] == pytest.approx(9.8 * np.sin(0.05))  # pitch: forward axis up
    level = play(replace(ATTITUDE, pitch=0.0, roll=0.0), edges(1, 4))
    forward = level.motions["gyro_y"].rate[0]
    assert forward == pytest.approx(EARTH_RATE * np.cos(0.9) * np.cos(0.7))  # forward at azimuth 0.7


def test_the_gyros_of_a_tilting_base_tell_what_its_accelerometers_read() -> None:
    base = replace(ATTITUDE, latitude=None, disturbance=Disturbance(2e-3, 20.0))
    t = edges(200, 10)
    z = np.random.default_rng(3).standard_normal((2, len(t) - 1))
    motions = play(base, t, z).motions
    turned = np.array([np.cumsum(motions[f"gyro_{a}"].rate) * 0.1 for a in "xyz"])
    angle = np.diff(np.concatenate([np.zeros((3, 1)), turned], axis=1), axis=1) * 0.5
    mean = turned - angle  # the tilt is linear within an interval
    up = np.array([motions[f"accel_{a}"].force[a][0] for a in "xyz"]) / base.gravity
    leaning = -np.cross(mean.T, up)
    for axis, expected in zip("xyz", leaning.T, strict=True):
        tilt = motions[f"accel_{axis}"].base_tilt
        assert tilt is not None
        np.testing.assert_allclose(tilt, expected, atol=1e-15)


def test_the_disturbance_has_its_standard_deviation_and_does_not_depend_on_chunks() -> None:
    base = replace(ATTITUDE, pitch=0.0, roll=0.0, disturbance=Disturbance(2e-3, 2.0))
    t = edges(20000, 2)
    z = np.random.default_rng(4).standard_normal((3, 2, len(t) - 1))
    tilts = [play(base, t, z).motions[f"accel_{a}"].base_tilt for a in "xy"]
    # 2500 correlation times in each of 6 runs: relative deviation about 0.6 %; 4 % fails once in 10^10.
    assert np.std(np.array(tilts)[..., 100:]) == pytest.approx(2e-3, rel=0.04)
    parts = in_chunks(base, t, [1, 5, 3001], z)
    for axis in "xyz":
        joined = np.concatenate([p.motions[f"gyro_{axis}"].rate for p in parts], axis=-1)
        np.testing.assert_allclose(joined, play(base, t, z).motions[f"gyro_{axis}"].rate, rtol=1e-9, atol=1e-15)
        alone = play(base, t, z[1]).motions[f"gyro_{axis}"].rate
        assert np.array_equal(play(base, t, z).motions[f"gyro_{axis}"].rate[1], alone)
