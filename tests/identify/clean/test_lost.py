"""What a reference lost is an event; what it has each time that the table turns round is how the table is.

The seed is fixed. A play of 1.5 mrad moves a mean by nineteen of its deviations.
"""

import numpy as np
import pytest

from insenv.core.recording import Channel, Floats, Recording
from insenv.data.reference import with_reference
from insenv.identify.clean.doubtful import Settled
from insenv.identify.clean.lost import lost_rows

DT, PLAY = 0.01, 1.5e-3


def run(turns: tuple[int, ...], bias: float) -> Recording:
    """A table that turns round every 15 s, and an encoder that has a play at some of these turns."""
    rng = np.random.default_rng(4)
    t: Floats = DT * np.arange(9000.0)
    rate = np.clip(1.5 * np.sin(2 * np.pi * t / 30), -0.35, 0.35)
    angle = (np.cumsum(rate) - 0.5 * rate) * DT
    way = (t / 15).astype(int)
    there = np.isin(way, turns) & (np.diff(way, prepend=0) > 0)
    behind = PLAY * np.cumsum(np.where(way % 2, 1.0, -1.0) * there)
    shown = angle + behind + 4e-5 * rng.standard_normal(len(t))
    gyro = rate + bias + 1e-3 * rng.standard_normal(len(t))
    return with_reference(Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(shown, "rad")}))


@pytest.mark.parametrize(("turns", "events"), [((3,), 1), ((1, 2, 3, 4, 5), 0)])
@pytest.mark.parametrize("bias", [0.0, 0.2])
def test_what_is_there_at_every_turn_is_no_event(turns: tuple[int, ...], events: int, bias: float) -> None:
    """Whatever the bias, which is no rate of turn."""
    assert len(lost_rows((run(turns, bias),), "gyro", (Settled(0, 30, 1.0, 0.0),))) == events


@pytest.mark.parametrize(("law", "lost"), [(True, False), (False, True)])
def test_what_goes_with_the_fastest_swing_is_no_event(law: bool, lost: bool) -> None:
    """Once it moves at six times what else it does: 0.005 u^2 there is 18 deviations of slower rows, and a law.

    As large an error of the reference in a swing no faster than others is an event.
    """
    rng = np.random.default_rng(5)
    t: Floats = DT * np.arange(9000.0)
    slow = 0.9 * np.sin(2 * np.pi * t / 7) * np.cos(2 * np.pi * t / 31)
    once = np.exp(-0.5 * ((t - 40) / 0.4) ** 2)
    rate = slow + 5.0 * once * law
    gyro = rate + 0.005 * rate**2 * law + 0.5 * once * (not law) + 0.03 * rng.standard_normal(len(t))
    angle = (np.cumsum(rate) - 0.5 * rate) * DT + 1e-4 * rng.standard_normal(len(t))
    carried = Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(angle, "rad")})
    assert bool(lost_rows((with_reference(carried),), "gyro", (Settled(0, 30, 1.0, 0.0),))) == lost


@pytest.mark.parametrize("seed", range(4))
def test_the_ends_of_a_run_beside_a_coarse_encoder_are_sound(seed: int) -> None:
    """There the outermost reading of the angle was taken again and again, with its rounding."""
    rng = np.random.default_rng([7, seed])
    t: Floats = DT * np.arange(4000.0)
    phase = rng.uniform(0, 2 * np.pi)
    rate = 3.0 * np.cos(2 * np.pi * 0.6 * t + phase)
    angle = 3.0 / (2 * np.pi * 0.6) * np.sin(2 * np.pi * 0.6 * t + phase)
    step = 2 * np.pi / 1024
    gyro = rate + 5e-3 * rng.standard_normal(len(t))
    channels = {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(np.round(angle / step) * step, "rad")}
    assert lost_rows((with_reference(Recording(t, channels)),), "gyro", (Settled(0, 30, 1.0, 0.0),)) == ()
