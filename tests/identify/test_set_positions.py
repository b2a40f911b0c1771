"""A gyro on a table that is set from position to position: rows at each, and none of the turns between.

Seeds are fixed. The Earth's rate stands in each case with more than 10 deviations, so that it is missed in fewer than
one of 10^15; a search at 1 % invents something in one null of a hundred.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Floats, Mounting, Recording
from insenv.core.series.positions import were_set
from insenv.data.exposure import expose
from insenv.data.reference import with_positions, with_reference
from insenv.effects.angle import EncoderHarmonic, MagneticField
from insenv.effects.rate.hysteresis import EncoderBacklash
from insenv.identify.fit.problem import regressors

DEG_PER_HOUR = np.pi / 180 / 3600
LEVEL = 9.7 * DEG_PER_HOUR


def row_by_row(rng: np.random.Generator) -> tuple[float, Floats, float]:
    """Means of 7 s, each at another angle and half a turn from it."""
    order = 15.0 * rng.integers(0, 24, 200)
    return 7.0, np.column_stack([order, order + 180]).ravel(), 6.0


def rest_by_rest(rng: np.random.Generator) -> tuple[float, Floats, float]:
    """Two minutes at each of twelve angles, three times round, a row a second; the turns are cut out."""
    return 1.0, np.repeat(np.tile(30.0 * rng.permutation(12), 3), 120), 12.0


def recording(kind: str, seed: int, level: float, wander: float = 0.0) -> Recording:
    rng = np.random.default_rng(seed)
    dt, degrees, sd = row_by_row(rng) if kind == "rows" else rest_by_rest(rng)
    noise = sd * (rng.standard_normal(len(degrees)) + wander * np.cumsum(rng.standard_normal(len(degrees))))
    angle = np.deg2rad(degrees)
    gyro = DEG_PER_HOUR * (20.0 + noise) + level * np.cos(angle - 1.1)
    channels = {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(angle, "rad")}
    return Recording(dt * np.arange(1.0, len(angle) + 1), channels, mounting=Mounting(tilt=0.0))


@pytest.mark.parametrize("kind", ["rows", "rests"])
def test_the_earths_rate_is_seen_at_set_positions(kind: str) -> None:
    (target,) = closed(recording(kind, 1, LEVEL, 0.02)).targets
    (found,) = target.added
    assert {found.effect, *found.confounded_with} >= {"earth_rate", "angle_locked_rate"}
    wave = {p.parameter: p for p in found.parameters}
    for name, true in (("c", np.cos(1.1)), ("s", np.sin(1.1))):
        assert abs(wave[name].value - LEVEL * true) < 4 * wave[name].sd < LEVEL


@pytest.mark.parametrize(("kind", "wander"), [("rows", 0.0), ("rests", 0.02)])
def test_without_it_nothing_is(kind: str, wander: float) -> None:
    assert not closed(recording(kind, 3, 0.0, wander)).targets[0].added


def test_columns_are_taken_at_the_rows_and_no_turn_is_made_of_them() -> None:
    run = with_reference(recording("rows", 1, LEVEL))
    assert run.channels["table_angle"].source == "set" and run.table is None
    exposure = expose(run, "gyro")
    columns = regressors(MagneticField(), exposure, ())
    angle = run.channels["table_angle"].values
    assert np.allclose(columns, np.column_stack([np.cos(angle), np.sin(angle)]), atol=1e-12)
    assert not np.any(exposure.u) and not np.any(exposure.motion.rate)
    assert "no row holds a turn" in EncoderHarmonic().blind(exposure.motion)
    assert "no row holds a turn" in EncoderBacklash().blind(exposure.motion)


def test_a_gyro_along_the_axis_tells_whether_the_turns_are_in_the_rows() -> None:
    still = recording("rests", 1, LEVEL)
    angle = still.channels["table_angle"].values
    turned = np.append(0.0, np.diff(angle))
    with_turns = {**still.channels, "gyro_z": Channel(turned, "rad/s")}
    assert with_positions(still).channels["table_angle"].source == "set"
    read = Recording(still.t, with_turns, mounting=still.mounting)
    assert with_positions(read).channels["table_angle"].source is None


def test_what_moves_was_not_set() -> None:
    t = np.arange(600.0)
    rng = np.random.default_rng(2)
    noise = 1e-4 * rng.standard_normal(len(t))
    rests = np.repeat(np.deg2rad(30.0 * np.arange(12)), 50)
    assert were_set(t, rests) and were_set(t, np.mod(rests + 2.0, 2 * np.pi))
    assert not were_set(0.01 * t, rests)  # an encoder that is read every half a second, of a table that turns evenly
    assert not were_set(t, np.deg2rad(30.0) * t)
    assert not were_set(t, 0.5 * np.sin(0.3 * t) + noise)
    assert not were_set(t, np.interp(t, t[::50], rests[::50]))
    assert not were_set(t, np.mod(3e-5 * np.sin(t) + noise, 2 * np.pi))  # about the zero of the encoder
    assert not were_set(t, np.mod(1e-3 * t, 2 * np.pi))


def leaning(seed: int, made: float, noisy: bool = False) -> Recording:
    """Means of 7 s of a gyro and two accelerometers on a table that leans by 2 deg and is set row by row."""
    rng = np.random.default_rng(seed)
    angle, n = np.deg2rad(15.0 * rng.integers(0, 24, 400)), 400
    force = 9.8 * np.deg2rad(2.0) * np.array([np.sin(angle), np.cos(angle)])
    if noisy:
        force = float(np.std(force)) * rng.standard_normal((2, n))
    gyro = DEG_PER_HOUR * (20.0 + 6.0 * rng.standard_normal(n)) + made * force[0]
    channels = {"gyro_x": Channel(gyro, "rad/s")}
    for axis, own in zip("xy", force, strict=True):
        channels[f"accel_{axis}"] = Channel(own + 5e-3 * rng.standard_normal(n), "m/s^2")
    return Recording(7.0 * np.arange(1.0, n + 1), channels)


@pytest.mark.parametrize("size", [10.0, 60.0])
def test_a_force_that_jumps_from_row_to_row_is_one_of_positions(size: float) -> None:
    """With a word that it may be the Earth's rate, where it is no larger: the table leans and no angle is told."""
    made = size * DEG_PER_HOUR / 0.34
    (target,) = closed(leaning(5, made), manifest(("gyro_x",), ("bias",))).targets
    (found,) = target.added
    assert found.effect == "g_sensitivity"
    (c_x,) = [p for p in found.parameters if p.parameter == "c_x"]
    assert abs(c_x.value - made) < 4 * c_x.sd < 0.5 * made
    assert any("Earth's rate" in said for said in target.cautions) == (size < 15)


def test_noise_of_an_accelerometer_is_no_position() -> None:
    """However loud: it has tails, which positions have not."""
    (target,) = closed(leaning(5, 0.0, noisy=True), manifest(("gyro_x",), ("bias",))).targets
    assert "g_sensitivity" in {one.effect for one in target.not_testable}


def with_turns(seed: int, level: float, off: float) -> Recording:
    """Rests as above with the turns in the rows, ten each, and a gyro that is ``off`` the plane of the table [rad]."""
    rng = np.random.default_rng(seed)
    rests = np.deg2rad(30.0 * rng.permutation(np.tile(np.arange(12), 2)))
    part = np.linspace(0.0, 1.0, 11)[1:]
    ways = [begin + (end - begin) * part**2 * (3 - 2 * part) for begin, end in pairwise(rests)]
    angle = np.concatenate([np.concatenate([np.full(110, rest), way]) for rest, way in zip(rests, ways, strict=False)])
    noise = 12.0 * rng.standard_normal(len(angle))
    turned = np.append(0.0, np.diff(angle))
    middle = angle - 0.5 * turned
    gyro = DEG_PER_HOUR * (20.0 + noise) + level * np.cos(middle - 1.1) + off * turned
    channels = {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(angle, "rad")}
    return Recording(np.arange(1.0, len(angle) + 1), channels, mounting=Mounting(tilt=0.0))


def test_a_gyro_that_is_not_quite_level_reads_a_part_of_the_turns() -> None:
    """It was nine tones, and the Earth's rate was lost in them."""
    (target,) = closed(with_turns(1, LEVEL, 0.01)).targets
    assert {a.effect for a in target.added} in ({"cross_axis", "earth_rate"}, {"cross_axis", "angle_locked_rate"})
    (c_z,) = [p for a in target.added for p in a.parameters if p.parameter == "c_z"]
    assert abs(c_z.value - 0.01) < 4 * c_z.sd < 1e-4


def test_one_that_is_level_reads_none() -> None:
    assert not closed(with_turns(2, 0.0, 0.0)).targets[0].added
