"""Units at the border: ``value_si = factor * x + offset``.

Inside the package every number is in SI units and radians; only readers, manifests and reports come here.
`insenv.core.unit_text` says how an expression is read; what a single name means is asked of pint, with these
readings where names compete:

* ``g``, ``mg``, ``ug``, ``ng`` are accelerations, in standard gravity, never gram;
* ``h`` is the hour; ``Gal`` and ``mGal`` are the galileo, 0.01 m/s^2; ``dps`` is ``deg/s``;
* the radian is a dimension of its own, so that ``Hz`` is no rate of turn and ``1/s`` neither;
* ``degC`` and ``degF`` have their offset where a temperature stands alone, and are steps of temperature in a
  compound such as ``deg/h/degC``.
"""

import json
import math
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NoReturn, overload

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.unit_text import NUMBER, NotAUnitError, Unit, read

if TYPE_CHECKING:
    import pint

#: Degree of angle in rad.
DEG = math.pi / 180.0
#: Minute of arc in rad.
ARCMIN = DEG / 60.0
#: Second of arc in rad.
ARCSEC = DEG / 3600.0
#: Minute in s.
MINUTE = 60.0
#: Hour in s.
HOUR = 3600.0
#: Part per million, a fraction.
PPM = 1e-6
#: Degree per hour in rad/s.
DEG_PER_HOUR = DEG / HOUR
#: Degree per root hour (angle random walk) in rad/sqrt(s).
DEG_PER_SQRT_HOUR = DEG / math.sqrt(HOUR)
#: Degree per hour per root hour (rate random walk) in rad/s/sqrt(s).
DEG_PER_HOUR_PER_SQRT_HOUR = DEG_PER_HOUR / math.sqrt(HOUR)
#: Standard gravity in m/s^2 (CGPM 1901, exact).
STANDARD_GRAVITY = 9.80665
#: Thousandth of standard gravity in m/s^2.
MILLI_G = 1e-3 * STANDARD_GRAVITY
#: Millionth of standard gravity in m/s^2.
UG = 1e-6 * STANDARD_GRAVITY
#: Milligal in m/s^2.
MGAL = 1e-5
#: Zero of the Celsius scale in K.
ZERO_CELSIUS = 273.15


@dataclass(frozen=True)
class Dimension:
    """What a number may measure: powers of SI base units and the radian; a unit and a name for messages."""

    powers: dict[str, Fraction]
    example: str
    name: str = "quantity"


def _dimension(name: str, example: str, **powers: float) -> tuple[str, Dimension]:
    return name, Dimension({base: Fraction(power) for base, power in powers.items()}, example, name)


#: Every dimension that `quantity` and `scale_to_si` can be asked for by name.
DIMENSIONS: dict[str, Dimension] = dict(
    [
        _dimension("angle", "deg", radian=1),
        _dimension("rate", "deg/s", radian=1, second=-1),
        _dimension("angular acceleration", "deg/s^2", radian=1, second=-2),
        _dimension("length", "m", meter=1),
        _dimension("velocity", "m/s", meter=1, second=-1),
        _dimension("acceleration", "m/s^2", meter=1, second=-2),
        _dimension("time", "s", second=1),
        _dimension("frequency", "Hz", second=-1),
        _dimension("temperature", "degC", kelvin=1),
        _dimension("temperature difference", "K", kelvin=1),
        _dimension("fraction", "ppm"),
        _dimension("angle random walk", "deg/sqrt(h)", radian=1, second=-0.5),
        _dimension("bias instability", "deg/h", radian=1, second=-1),
        _dimension("rate random walk", "deg/h/sqrt(h)", radian=1, second=-1.5),
        _dimension("quantization", "arcsec", radian=1),
        _dimension("velocity random walk", "m/s/sqrt(h)", meter=1, second=-1.5),
        _dimension("acceleration random walk", "ug/sqrt(s)", meter=1, second=-2.5),
    ]
)

_PREFIXES = {"": 1.0, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "n": 1e-9}  # both code points of micro
_ALIASES = {"°": "degree"}
#: Size, powers and zero of names that nearly every manifest and scenario has, as pint has them: its registry takes a
#: third of a second to make, and most commands need no other name.
COMMON: dict[str, tuple[float, dict[str, float], float]] = {
    "s": (1.0, {"second": 1.0}, 0.0),
    "ms": (1e-3, {"second": 1.0}, 0.0),
    "us": (1e-6, {"second": 1.0}, 0.0),
    "ns": (1e-9, {"second": 1.0}, 0.0),
    "min": (60.0, {"second": 1.0}, 0.0),
    "h": (3600.0, {"second": 1.0}, 0.0),
    "day": (86400.0, {"second": 1.0}, 0.0),
    "Hz": (1.0, {"second": -1.0}, 0.0),
    "m": (1.0, {"meter": 1.0}, 0.0),
    "mm": (0.001, {"meter": 1.0}, 0.0),
    "cm": (0.01, {"meter": 1.0}, 0.0),
    "km": (1000.0, {"meter": 1.0}, 0.0),
    "g_0": (9.80665, {"meter": 1.0, "second": -2.0}, 0.0),
    "rad": (1.0, {"radian": 1.0}, 0.0),
    "deg": (DEG, {"radian": 1.0}, 0.0),
    "mrad": (0.001, {"radian": 1.0}, 0.0),
    "arcmin": (0.00029088820866572163, {"radian": 1.0}, 0.0),
    "arcsec": (4.84813681109536e-06, {"radian": 1.0}, 0.0),
    "rpm": (0.10471975511965977, {"radian": 1.0, "second": -1.0}, 0.0),
    "K": (1.0, {"kelvin": 1.0}, 0.0),
    "degC": (1.0, {"kelvin": 1.0}, 273.15),
    "%": (0.01, {}, 0.0),
    "ppm": (1e-6, {}, 0.0),
}
_LEADING_NUMBER = re.compile(rf"\s*([+-]?{NUMBER})(.*)", re.ASCII | re.DOTALL)
#: The 1 of a unit that is written as a reciprocal: "5 1/s" is 5/s. "2 1/3 s" is a number written otherwise.
_RECIPROCAL = re.compile(r"1\s*(?=(/|per\b)\s*[^\d.\s])")
_MAX_LENGTH = 100


@lru_cache(maxsize=1)
def registry() -> "pint.UnitRegistry[Any]":
    """The registry of pint, made once and only when a unit is first asked for."""
    import pint  # here and not above: it costs more to import than the rest of the core

    return pint.UnitRegistry(cache_folder=None)


@lru_cache(maxsize=256)
def _named(name: str) -> tuple[Unit, float]:
    """A single name: its unit and its offset (that of a temperature scale, else zero)."""
    if name.endswith("g") and name[:-1] in _PREFIXES:
        return Unit(_PREFIXES[name[:-1]] * STANDARD_GRAVITY, DIMENSIONS["acceleration"].powers), 0.0
    if name.endswith("dps") and name[:-3] in _PREFIXES:
        return Unit(_PREFIXES[name[:-3]] * DEG, DIMENSIONS["rate"].powers), 0.0
    name = _ALIASES.get(name, name)
    if name not in COMMON and not registry().parse_unit_name(name):
        raise NotAUnitError
    factor, root, zero = COMMON[name] if name in COMMON else by_pint(name)
    powers = {base: Fraction(power).limit_denominator(1000) for base, power in root.items()}
    if zero != 0.0 and powers != DIMENSIONS["temperature"].powers:
        raise NotAUnitError  # a logarithmic unit such as the decibel
    return Unit(factor, powers), zero


def by_pint(name: str) -> tuple[float, dict[str, float], float]:
    """(factor, powers of base units, offset) of a name that pint knows."""
    import pint

    try:
        factor, root = registry().get_root_units(name, check_nonmult=False)
        zero = registry().Quantity(0.0, name).to_root_units().magnitude
    except pint.PintError:  # such as a prefix before degC
        raise NotAUnitError from None
    powers = {str(base): float(str(power)) for base, power in root._units.items()}
    return float(str(factor)), powers, float(zero)


@lru_cache(maxsize=256)
def _parse(text: str) -> tuple[float | None, Unit, float | None]:
    """(leading number or None, unit of the rest, its offset, None for a compound); raises NotAUnitError."""
    if len(text) > _MAX_LENGTH:
        raise NotAUnitError
    leading = _LEADING_NUMBER.fullmatch(text)
    number, rest = (float(leading[1]), leading[2].strip()) if leading else (None, text.strip())
    if rest.startswith(("^", "**")) or (number is None and not rest):
        raise NotAUnitError
    if re.fullmatch(r"[^\W\d]+|°[CF]", rest) and rest not in ("per", "sqrt"):
        return number, *_named(rest)
    if number is not None:
        one = _RECIPROCAL.match(rest)
        rest = f"1 {rest[one.end() :] if one else rest}"
    compound = read(rest, lambda name: _named(name)[0])
    return number, compound, None


def scale_to_si(unit: object, dimension: str | Dimension, where: str) -> tuple[float, float]:
    """(factor, offset) with ``value_si = factor * x + offset`` for numbers x given in `unit`.

    The unit may carry a number, as a pulse weight does: ``"0.46634601 arcsec"``, ``"125 ug s"``. `dimension`
    is a key of `DIMENSIONS` or a `dimension_of`; `where` opens the message and names file and key, such as
    ``run.toml: channels.gyro.unit``. The offset is zero but for temperatures in degC or degF.

    Raises InputError: not a unit, a unit of another dimension, a factor that is zero or not finite.
    """
    wanted = _Wanted(dimension, where, "unit")
    number, scale, offset = wanted.parsed(unit)
    factor = scale.factor * (1.0 if number is None else number)
    if not (math.isfinite(factor) and factor != 0.0):
        wanted.refuse(unit, "is a unit of no finite size other than zero")
    return factor, offset


def quantity(given: object, dimension: str | Dimension, where: str) -> float:
    """The SI value of a number with its unit, such as ``"3e-4 deg/sqrt(h)"`` or ``"25 degC"`` (-> 298.15).

    `dimension` is a key of `DIMENSIONS` or a `dimension_of`; `where` opens the message and names file and
    key, such as ``run.toml: site.latitude``. A bare number is taken for a fraction and for nothing else.

    Raises InputError: no number, no unit, not a unit, a unit of another dimension, a value that is not
    finite.
    """
    if isinstance(given, (int, float)) and not isinstance(given, bool):
        given = "infinity" if abs(given) >= 1e300 else str(given)
    wanted = _Wanted(dimension, where, "quantity")
    number, unit, offset = wanted.parsed(given)
    if number is None:
        wanted.refuse(given, "has no number that is understood")
    value = number * unit.factor + offset
    if not math.isfinite(value):
        wanted.refuse(given, "is not finite")
    return value


def quantity_in(given: object, si_unit: str, where: str) -> float:
    """As `quantity`, of the dimension that an SI unit such as ``"rad/s/K"`` has."""
    dimension = dimension_of(si_unit)
    return quantity(given, dimension if dimension.powers else "fraction", where)


def dimension_of(unit: str) -> Dimension:
    """The dimension of a unit, for `quantity` and `scale_to_si`. Raises InputError for any other text."""
    return Dimension(_known(unit)[1].powers, unit)


@overload
def show(value_si: float, unit: str) -> float: ...
@overload
def show(value_si: NDArray[np.float64], unit: str) -> NDArray[np.float64]: ...
def show(value_si: float | NDArray[np.float64], unit: str) -> float | NDArray[np.float64]:
    """A value, shape (...), from SI to a display unit: ``show(4.848e-6, "deg/h")`` is 1.0.

    A temperature is converted with its offset; for its standard deviation show it in ``K``.
    Raises InputError for a text that is not a unit.
    """
    number, scale, offset = _known(unit)
    factor = scale.factor * (1.0 if number is None else number)
    if not (math.isfinite(factor) and factor != 0.0):
        raise InputError(f"{_quoted(unit)} is a unit of no finite size other than zero")
    return (value_si - (offset or 0.0)) / factor


def _known(unit: str) -> tuple[float | None, Unit, float | None]:
    try:
        return _parse(unit)
    except NotAUnitError:
        raise InputError(f"{_quoted(unit)} is not a unit that is understood") from None


class _Wanted:
    """What is asked for, and the sentence that says so."""

    def __init__(self, dimension: str | Dimension, where: str, kind: str) -> None:
        self.absolute = dimension == "temperature"
        self.dimension = DIMENSIONS[dimension] if isinstance(dimension, str) else dimension
        self.where, self.kind = where, kind

    def parsed(self, given: object) -> tuple[float | None, Unit, float]:
        """(leading number or None, unit, offset), the offset zero unless a temperature is wanted."""
        try:
            if not isinstance(given, str):
                raise NotAUnitError
            number, unit, offset = _parse(given)
        except NotAUnitError:
            self.refuse(given, f"is not a {self.kind} that is understood")
        if unit.powers != self.dimension.powers:
            self.refuse(given, f"is {unit}")
        if self.absolute and offset is None:
            self.refuse(given, "is a compound, whose zero point is not known")
        return number, unit, offset if self.absolute and offset is not None else 0.0

    def refuse(self, given: object, reason: str) -> NoReturn:
        name, example = self.dimension.name, self.dimension.example
        if self.kind == "quantity":
            example = f"1 {example}"
        article = "an" if name[0] in "aeiou" else "a"
        raise InputError(f'{self.where} {_quoted(given)} {reason}; wanted {article} {name} such as "{example}"')


def _quoted(given: object) -> str:
    """The given text on one line and of bounded length."""
    text = given if isinstance(given, str) else repr(given)
    return json.dumps(text if len(text) <= 60 else text[:57] + "...", ensure_ascii=False)
