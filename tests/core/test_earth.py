"""Earth rate and normal gravity against published values and against the field of the WGS84 potential."""

import numpy as np
import pytest

from insenv.core import earth
from insenv.core.errors import InputError


@pytest.mark.parametrize(
    ("latitude_deg", "published", "tolerance"),
    [
        (0.0, 9.7803253359, 1e-10),  # NIMA TR8350.2, table 3.4
        (90.0, 9.8321849378, 2e-10),  # NIMA TR8350.2, table 3.4
        (45.0, 9.8061977, 1e-7),  # commonly quoted, cut off after seven decimals
    ],
)
@pytest.mark.parametrize("hemisphere", [1, -1])
def test_gravity_on_the_ellipsoid(latitude_deg: float, published: float, tolerance: float, hemisphere: int) -> None:
    assert earth.gravity(hemisphere * np.radians(latitude_deg)) == pytest.approx(published, abs=tolerance)


# zonal harmonics of the WGS84 ellipsoid, J2n = (-1)^(n+1) 3 e^2n / ((2n+1)(2n+3)) (1 - n + 5 n J2 / e^2):
# Heiskanen and Moritz, equation 2-92; GM and J2 of TR8350.2, tables 3.1 and 3.3
GM = 3.986004418e14
J2 = 1.082629821313e-3


def _zonal(n: int) -> float:
    e2 = earth.ECCENTRICITY_SQUARED
    return (-1) ** (n + 1) * 3 * e2**n / ((2 * n + 1) * (2 * n + 3)) * (1 - n + 5 * n * J2 / e2)


def _axial_gravity(radius: float, legendre_at: float) -> float:
    """Gravity on the equator (argument 0) or on the axis (argument 1), where it is radial by symmetry."""
    total = 1.0
    for n in range(1, 6):
        p2n = np.polynomial.legendre.Legendre.basis(2 * n)(legendre_at)
        total -= (2 * n + 1) * _zonal(n) * (earth.SEMI_MAJOR_AXIS / radius) ** (2 * n) * p2n
    return GM / radius**2 * total - (earth.EARTH_RATE**2 * radius if legendre_at == 0.0 else 0.0)


@pytest.mark.parametrize("altitude", [-400.0, 0.0, 380.0, 4000.0, 10000.0])
def test_gravity_with_height_follows_the_potential(altitude: float) -> None:
    equator, pole = earth.gravity([0.0, np.pi / 2], altitude)
    polar_axis = earth.SEMI_MAJOR_AXIS * (1.0 - earth.FLATTENING)
    assert equator == pytest.approx(_axial_gravity(earth.SEMI_MAJOR_AXIS + altitude, 0.0), abs=1e-6)
    assert pole == pytest.approx(_axial_gravity(polar_axis + altitude, 1.0), abs=1e-6)


def test_gravity_broadcasts() -> None:
    latitudes = np.radians([[-34.2], [51.0784]])
    altitudes = np.array([0.0, 380.0, 1000.0])
    together = earth.gravity(latitudes, altitudes)
    assert together.shape == (2, 3)
    assert together[1, 2] == earth.gravity(latitudes[1, 0], 1000.0)
    assert (np.diff(together, axis=1) < 0).all()


def test_earth_rate_in_both_hemispheres() -> None:
    latitude = np.radians([[0.0, 30.0], [-30.0, -90.0]])
    rate = earth.earth_rate_enu(latitude)
    assert rate.shape == (2, 2, 3)
    np.testing.assert_allclose(np.linalg.norm(rate, axis=-1), 7.292115e-5, rtol=1e-15)
    np.testing.assert_array_equal(rate[..., 0], 0.0)
    np.testing.assert_allclose(rate[0, 1, 1:], 7.292115e-5 * np.array([np.sqrt(0.75), 0.5]), rtol=1e-14)
    np.testing.assert_allclose(rate[1, 0, 1:], 7.292115e-5 * np.array([np.sqrt(0.75), -0.5]), rtol=1e-14)
    assert np.degrees(rate[0, 0, 1]) * 3600 == pytest.approx(15.041, abs=1e-3)  # deg/h, north at the equator


@pytest.mark.parametrize("latitude", [51.08, [0.1, -1.6], np.nan])
def test_latitude_in_degrees_or_not_a_number_is_refused(latitude: object) -> None:
    with pytest.raises(InputError, match="wanted radians from -pi/2 to pi/2"):
        earth.gravity(latitude)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="wanted radians from -pi/2 to pi/2"):
        earth.earth_rate_enu(latitude)  # type: ignore[arg-type]
