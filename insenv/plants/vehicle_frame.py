"""Ground, axes and rates that a vehicle's frame is made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from insenv.core import earth
from insenv.core.attitude import dcm_from_rotation_vector
from insenv.core.recording import Floats


@dataclass(frozen=True)
class Slope:
    """Ground that rises by ``angle`` towards the azimuth ``towards`` [rad]."""

    angle: float = 0.0
    towards: float = 0.0

    @property
    def dcm(self) -> Floats:
        """Rotation of the ground out of the level, shape (3, 3)."""
        axis = np.array([np.cos(self.towards), -np.sin(self.towards), 0.0])
        return dcm_from_rotation_vector(self.angle * axis)


def times(matrix: Floats, vector: Floats) -> Floats:
    """Matrix times vector, summed in one order: a row of a batch has the bits of the run alone."""
    m, v = matrix, vector[..., None, :]
    found: Floats = m[..., 0] * v[..., 0] + m[..., 1] * v[..., 1] + m[..., 2] * v[..., 2]
    return found


def product(first: Floats, second: Floats) -> Floats:
    """Product of matrices, summed in one order."""
    return np.stack([times(first, second[..., k]) for k in range(3)], axis=-1)


def transport_matrix(latitude: float, altitude: float) -> Floats:
    """Matrix from the velocity to the transport rate, both in east, north, up; shape (3, 3)."""
    x = 1.0 - earth.ECCENTRICITY_SQUARED * np.sin(latitude) ** 2
    normal = earth.SEMI_MAJOR_AXIS / np.sqrt(x)
    meridian = normal * (1.0 - earth.ECCENTRICITY_SQUARED) / x
    east = 1.0 / (normal + altitude)
    # Near a pole the third row has no meaning, nor has a heading.
    tangent = np.tan(np.clip(latitude, -1.57, 1.57))
    return np.array([[0.0, -1.0 / (meridian + altitude), 0.0], [east, 0.0, 0.0], [east * tangent, 0.0, 0.0]])
