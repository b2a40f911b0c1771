"""The exposure of the six axes of a unit on a table of several axes.

What the plant plays and what an estimator expects are both made here, of true angles or of readings: one text for the
motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from insenv.core.motion import Motion
from insenv.core.unit.gimbals import Gimbals, exposed
from insenv.core.unit.rotations import Floats

#: Input axes of a unit, in the order of its channels.
GYROS = ("gyro_x", "gyro_y", "gyro_z")
ACCELEROMETERS = ("accel_x", "accel_y", "accel_z")
UNIT = (*GYROS, *ACCELEROMETERS)


@dataclass(frozen=True)
class AxesCourse:
    """What the axes do on n intervals.

    Attributes
    ----------
    t : ndarray, shape (n + 1,)
        Edges [s].
    angles : ndarray, shape (..., k, 2 n + 1)
        True angles at the edges and, between them, in the middles [rad].
    means : ndarray, shape (..., k, n)
        Mean rates over the intervals [rad/s].
    rates : ndarray, shape (..., k, n + 1)
        Rates at the edges [rad/s].
    """

    t: Floats
    angles: Floats
    means: Floats
    rates: Floats


def motions(
    gimbals: Gimbals,
    errors: Floats,
    course: AxesCourse,
    place: tuple[float | None, float],
    temperature: Floats,
    reference_temperature: float,
) -> dict[str, Motion]:
    """Exposure of each of `UNIT`.

    Parameters
    ----------
    gimbals : Gimbals
    errors : ndarray, shape (..., q)
        Of the table, as `Gimbals.names` [rad].
    course : AxesCourse
    place : (float or None, float)
        Latitude [rad] and gravity [m/s^2].
    temperature : ndarray, shape (..., n + 1)
        [K]
    reference_temperature : float
        [K]
    """
    t = course.t
    felt = exposed(gimbals, errors, course.angles, course.means, place)
    against_earth = gimbals.turning(course.rates, course.angles[..., ::2], errors)
    shared: dict[str, Any] = {
        "t": t,
        "force": dict(zip("xyz", felt.force, strict=True)),
        "body_rate": dict(zip("xyz", against_earth, strict=True)),
        "temperature": temperature,
        "reference_temperature": reference_temperature,
    }
    found, still = {}, np.zeros_like(felt.rate[0])
    for i, axis in enumerate("xyz"):
        others = {other: felt.rate[j] for j, other in enumerate("xyz") if j != i}
        found[GYROS[i]] = Motion(rate=felt.rate[i], rate_edges=against_earth[i], cross_rate=others, axis=axis, **shared)
    for i, axis in enumerate("xyz"):
        others = {other: felt.force[j] for j, other in enumerate("xyz") if j != i}
        found[ACCELEROMETERS[i]] = Motion(rate=still, cross_rate=others, axis=axis, **shared)
    return found
