"""Rotation and normal gravity of the WGS84 Earth.

Gravity on the ellipsoid (Somigliana) and its change with height to second order:

    g0(L)    = g_e (1 + k sin^2 L) / sqrt(1 - e^2 sin^2 L)
    g(L, h)  = g0(L) [1 - (2/a) (1 + f + m - 2 f sin^2 L) h + 3 h^2 / a^2]

with geodetic latitude L in rad, height above the ellipsoid h in m, and m = Omega^2 a^2 b / GM.
Source: NIMA TR8350.2, 3rd ed. (2000), equations 4-1 and 4-3 and tables 3.1 to 3.4; Heiskanen and Moritz,
Physical Geodesy (1967), equation 2-123.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insenv.core.errors import InputError

#: Rotation rate of the Earth in rad/s.
EARTH_RATE = 7.292115e-5
#: Semi-major axis of the ellipsoid in m.
SEMI_MAJOR_AXIS = 6378137.0
#: Flattening of the ellipsoid.
FLATTENING = 1.0 / 298.257223563
#: First eccentricity squared of the ellipsoid.
ECCENTRICITY_SQUARED = FLATTENING * (2.0 - FLATTENING)
#: Normal gravity at the equator in m/s^2.
EQUATOR_GRAVITY = 9.7803253359
#: Somigliana's constant k = (b g_p) / (a g_e) - 1.
SOMIGLIANA = 0.00193185265241
#: Centrifugal ratio m = Omega^2 a^2 b / GM.
CENTRIFUGAL_RATIO = 0.00344978650684


def earth_rate_enu(latitude: ArrayLike) -> NDArray[np.float64]:
    """Earth rate in east, north, up: ``(0, Omega cos L, Omega sin L)``, shape (..., 3), rad/s.

    latitude : shape (...), rad, negative in the south. Raises InputError outside [-pi/2, pi/2].
    """
    lat = _checked(latitude)
    return EARTH_RATE * np.stack([np.zeros_like(lat), np.cos(lat), np.sin(lat)], axis=-1)


def gravity(latitude: ArrayLike, altitude: ArrayLike = 0.0) -> NDArray[np.float64]:
    """Magnitude of normal gravity, m/s^2, shape of `latitude` and `altitude` broadcast together.

    latitude : shape (...), rad, geodetic. Raises InputError outside [-pi/2, pi/2].
    altitude : shape (...), m above the ellipsoid; the terms left out stay below 1e-6 m/s^2 up to 10 km.
    """
    sin2 = np.sin(_checked(latitude)) ** 2
    ratio = np.asarray(altitude, dtype=np.float64) / SEMI_MAJOR_AXIS
    surface = EQUATOR_GRAVITY * (1.0 + SOMIGLIANA * sin2) / np.sqrt(1.0 - ECCENTRICITY_SQUARED * sin2)
    slope = 1.0 + FLATTENING + CENTRIFUGAL_RATIO - 2.0 * FLATTENING * sin2
    return np.asarray(surface * (1.0 - 2.0 * slope * ratio + 3.0 * ratio**2))


def _checked(latitude: ArrayLike) -> NDArray[np.float64]:
    lat = np.asarray(latitude, dtype=np.float64)
    inside = np.abs(lat) <= np.pi / 2  # false for NaN as well
    if not inside.all():
        worst = lat[~inside].flat[0]
        raise InputError(f"latitude {worst:g} rad is not a latitude; wanted radians from -pi/2 to pi/2")
    return lat
