"""The angle that a vehicle has turned by, as it was commanded: the one reference of its gyros that it has.

    a(t) = sum over its turns of the drive's trapezoid (`insenv.plants.vehicle_turn.Drive`)

counter-clockwise about Up, from the start of the run. It is what was asked for, at the limits of rate and acceleration
that the datasheet tells; no truth is looked up.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from insenv.core.estimate import Limits
from insenv.core.recording import Floats
from insenv.plants.vehicle_sway import Settling
from insenv.plants.vehicle_turn import Drive, LatestTurn, ahead

#: A command: the time from which it holds [s], and the angle to turn by [rad].
Command = tuple[float, float]


def turn_angle(t: Floats, commands: Sequence[Command], limits: Limits) -> Floats:
    """Angle turned by at the times ``t`` [rad], shape (n,); a turn asked for while the vehicle turns is ignored."""
    drive = Drive(limits.rate, limits.acceleration, np.zeros(3), (Settling(), Settling()))
    state, total = ahead(), np.zeros(len(t))
    for time, angle in commands:
        after = drive.commanded(state, np.asarray(angle), time)
        if after is not state:
            total += _trapezoid(t, drive, after)
        state = after
    return total


def _trapezoid(t: Floats, drive: Drive, state: LatestTurn) -> Floats:
    """What the latest turn of ``state`` adds, shape (n,)."""
    ramp, whole = drive.times(state.by)
    since = np.clip(t - state.start, 0.0, whole)
    rising, falling = np.minimum(since, ramp), np.maximum(since - (whole - ramp), 0.0)
    even = np.clip(since - ramp, 0.0, whole - 2 * ramp)
    path = rising**2 / 2 + ramp * even + ramp * falling - falling**2 / 2
    return np.copysign(drive.acceleration, state.by) * path
