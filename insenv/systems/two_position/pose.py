"""Where the vehicle of a two-position calibration points, and the names of its instruments."""

from __future__ import annotations

from dataclasses import dataclass

from insenv.core.recording import Floats

#: Instruments, in the order of the observation.
GYROS, ACCELEROMETERS = (tuple(f"{family}_{axis}" for axis in "xyz") for family in ("gyro", "accel"))


@dataclass(frozen=True)
class Pose:
    """True heading, and angle turned by since the start, counter-clockwise [rad]; shape (R,)."""

    heading: Floats
    turned: Floats
