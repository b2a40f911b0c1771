"""Values of SI units as the texts of a scenario."""

from __future__ import annotations

from insenv.core.units import ARCMIN, ARCSEC, DEG, PPM

_SHOWN = {"deg/s": DEG, "deg": DEG, "s": 1.0, "arcsec": ARCSEC, "arcmin": ARCMIN, "ppm": PPM, "1": 1.0}


def text(value: float, unit: str, digits: int = 9) -> str:
    """A value in SI as the text of a scenario: "20 deg/s"."""
    number = f"{shown(value, unit):.{digits}g}"
    return number if unit == "1" else f"{number} {unit}"


def shown(value: float, unit: str) -> float:
    """A value in SI in a unit for people."""
    return float(value / _SHOWN[unit])


def rounded(value: float, unit: str, to: float) -> float:
    """The value [SI] that is nearest in steps of ``to`` units."""
    return float(round(value / _SHOWN[unit] / to) * to * _SHOWN[unit])
