"""The wobble of a table's axis against rotation matrices, and what it looks like."""

import numpy as np
import pytest
from motions import edges, rich_motion
from scipy.spatial.transform import Rotation

from insenv.core.earth import EARTH_RATE
from insenv.core.motion import Motion
from insenv.effects.angle import EncoderHarmonic
from insenv.effects.wobble import Wobble

DEG = np.pi / 180
TILT = 30 * DEG


@pytest.mark.parametrize("order", [1, 2, 3])
def test_it_is_what_a_gyro_on_a_rotating_leaning_table_measures(order: int) -> None:
    """Attitudes R = exp(e x) R_z(a): their small rotations in the table's own axes, along the input axis."""
    motion = rich_motion(4000, 0.001)
    assert motion.angle is not None
    theta = 1e-5 * np.array([1.0, -0.7, 0.5, 0.8])
    a = motion.angle
    e = (theta[0] + 1j * theta[1]) * np.exp(1j * order * a) + (theta[2] + 1j * theta[3]) * np.exp(-1j * order * a)
    lean = Rotation.from_rotvec(np.stack([e.real, e.imag, np.zeros_like(a)], axis=-1))
    attitude = lean * Rotation.from_rotvec(a[:, None] * [0, 0, 1])
    axis = np.array([np.cos(TILT), 0.0, np.sin(TILT)])
    measured = (attitude[:-1].inv() * attitude[1:]).as_rotvec() @ axis / motion.dt
    level = np.diff(a) * np.sin(TILT) / motion.dt
    found, _ = Wobble(order).apply(motion.rate, motion, theta)  # `rich_motion` has the projection of 30 deg
    # Left out: e^2, and the turn within a step.
    assert np.abs(measured - level - found).max() < 3e-4 * np.abs(found).max()


def test_the_second_forward_circle_feigns_the_earths_rate() -> None:
    """An arc second of it at 10 deg/s, 30 deg tilt and 40 deg latitude is 6249 arc seconds of north."""
    t = edges(3600, 0.01)
    motion = Motion(t=t, rate=np.zeros(3600), angle=10 * DEG * t, projection=np.sin(TILT))
    found, _ = Wobble(2).apply(motion.rate, motion, np.array([1.0, 0.0, 0.0, 0.0]))
    assert np.abs(found).max() / (EARTH_RATE * np.cos(40 * DEG) * np.cos(TILT)) == pytest.approx(6249, rel=1e-3)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_at_one_tilt_it_is_an_encoder_harmonic(order: int) -> None:
    motion = rich_motion(500)
    columns = Wobble(order).basis(motion.rate, motion)
    assert motion.angle is not None
    likes = [np.diff(motion.angle)[:, None]] if order == 1 else [EncoderHarmonic(order - 1).basis(motion.rate, motion)]
    likes.append(EncoderHarmonic(order + 1).basis(motion.rate, motion))
    design = np.concatenate(likes, axis=-1)
    left = columns - design @ np.linalg.lstsq(design, columns, rcond=None)[0]
    assert np.abs(left).max() < 1e-12 * np.abs(columns).max()


def test_along_the_axis_of_the_table_nothing_is_seen_of_it() -> None:
    t = edges(100, 0.1)
    motion = Motion(t=t, rate=np.zeros(100), angle=t, projection=1.0)
    assert not np.any(Wobble(2).basis(motion.rate, motion))
