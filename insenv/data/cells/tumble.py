r"""An accelerometer on a dividing head whose axis lies level: gravity turns through it.

    f = g sin(a - a_0),     f_p = g cos(a - a_0)

is the specific force along its input axis at the angle a of the head, and that across it, in the plane of the turn. How
the accelerometer sits on the head, a_0, is told by what it reads. Of a table that turns it is the mean from edge to
edge, with a their middle and d what it turns between them

    f = g sin(a - a_0) sin(d / 2) / (d / 2)

Source: IEEE Std 1293-2018, section 12.3 (static multipoint test), with the axes of its model equation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from insenv.core.recording import Floats, Recording
from insenv.core.series.least_absolute import least_absolute
from insenv.core.units import STANDARD_GRAVITY
from insenv.data.reference import is_set

#: Reading of the turn through gravity in that of gravity: of another an axis leans, or it is no accelerometer's.
FROM, TO = 0.6, 1.6
#: Part of the reading that may be none of it, and fewest positions.
OTHER, FEWEST = 0.1, 5
#: Least that a head turns that is not set to angles [rad]: within less a bias looks like the top of the wave.
HALF_A_TURN = np.pi


@dataclass(frozen=True)
class Tumble:
    """Gravity [m/s^2] and the angle of the head at which an accelerometer reads none of it, rising [rad]."""

    gravity: float
    zero: float

    def force(self, angle: Floats, turned: Floats | float = 0.0) -> Floats:
        """Specific force along the input axis at angles [rad], of their shape [m/s^2], and ``turned`` about each."""
        return np.asarray(self.gravity * np.sin(angle - self.zero) * np.sinc(turned / (2 * np.pi)))

    def across(self, angle: Floats, turned: Floats | float = 0.0) -> Floats:
        """That across it in the plane of the turn."""
        return np.asarray(self.gravity * np.cos(angle - self.zero) * np.sinc(turned / (2 * np.pi)))


def tumble(recording: Recording, target: str) -> Tumble | None:
    """How gravity turns through an accelerometer on a head that is set to angles, or turns; None where it does not."""
    if not target.startswith("accel") or "table_angle" not in recording.channels:
        return None
    angle, y = recording.channels["table_angle"].values, recording.channels[target].values
    if "table_rate" in recording.channels and is_set(recording):
        return None
    if len(np.unique(np.round(angle, 6))) < FEWEST or not (is_set(recording) or np.ptp(angle) > HALF_A_TURN):
        return None
    wave = np.column_stack([np.ones(len(y)), np.sin(angle), np.cos(angle)])
    (_, s, c), left = least_absolute(wave, y)
    gravity, size = recording.site.local_gravity or STANDARD_GRAVITY, float(np.hypot(s, c))
    if not FROM * gravity < size < TO * gravity or float(np.median(np.abs(left))) > OTHER * size:
        return None
    return Tumble(gravity, float(np.arctan2(-c, s)))


def gravity_sentence(recordings: Sequence[Recording], target: str) -> tuple[str, ...]:
    """A word where nobody said how large the gravity is that turns through an accelerometer."""
    if not any(r.site.local_gravity is None and tumble(r, target) for r in recordings):
        return ()
    return (
        f"Neither gravity nor latitude is given, {STANDARD_GRAVITY} m/s² is taken: where gravity is larger by a share, "
        "the scale factor is larger by it too, up to 0.3 % on the Earth; its standard deviation does not include that.",
    )
