"""SI inside, an engineer's units outside: ``shown = value / factor``, the unit chosen by magnitude.

Numbers are rounded to the digits that their standard deviation supports, by the rule of the Particle Data
Group (Review of Particle Physics, Introduction, "Rounding"): of the three leading digits of the standard
deviation, 100-354 keep two and 355-999 keep one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from insenv.core.recording import Floats
from insenv.core.units import (
    ARCSEC,
    DEG,
    DEG_PER_HOUR,
    DEG_PER_HOUR_PER_SQRT_HOUR,
    DEG_PER_SQRT_HOUR,
    HOUR,
    MINUTE,
    PPM,
    STANDARD_GRAVITY,
    UG,
)

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class ShownUnit:
    """A unit to show: one of it is ``factor`` in SI; used from the SI magnitude ``least`` upwards."""

    label: str
    factor: float = 1.0
    least: float = 0.0

    def of(self, value: float) -> float:
        """``value`` [SI] in this unit."""
        return value / self.factor

    def each(self, values: Floats) -> Floats:
        """``values`` [SI] in this unit, same shape."""
        return values / self.factor

    def number(self, value: float, digits: int = 3) -> str:
        """``value`` [SI] as text without the unit; "—" where it is not finite."""
        return number(self.of(value), digits)

    def show(self, value: float, digits: int = 3) -> str:
        """``value`` [SI] as text with the unit; "—" where it is not finite."""
        return f"{number(self.of(value), digits)} {self.label}".rstrip() if math.isfinite(value) else "—"

    def show_with_sd(self, value: float, sd: float) -> str:
        """``value ± sd`` [SI] as text with the unit."""
        return f"{with_sd(self.of(value), self.of(sd))} {self.label}".rstrip()


_RATE = (ShownUnit("deg/s", DEG, 0.05 * DEG), ShownUnit("deg/h", DEG_PER_HOUR))
_FORCE = (ShownUnit("m/s²", 1.0, 0.5), ShownUnit("mm/s²", 1e-3, 2e-4), ShownUnit("µg", UG))
_FORCE_DRIFT = (ShownUnit("mm/s²/h", 1e-3 / HOUR, 2e-4 / HOUR), ShownUnit("µg/h", UG / HOUR))
_RATE_DRIFT = (ShownUnit("deg/h/h", DEG_PER_HOUR / HOUR),)
_SHARE = (ShownUnit("", 1.0, 0.01), ShownUnit("ppm", PPM))
_PER_RATE_SQUARED = (ShownUnit("ppm/(deg/s)²", PPM / DEG**2),)
_WHITE_RATE = (ShownUnit("deg/√h", DEG_PER_SQRT_HOUR),)
_WHITE_FORCE = (ShownUnit("m/s/√h", 1 / math.sqrt(HOUR)),)

#: SI unit -> what to show instead, from the largest magnitude down.
_SHOWN: dict[str, tuple[ShownUnit, ...]] = {
    "rad/s": _RATE,
    "m/s^2": _FORCE,
    "rad": (ShownUnit("deg", DEG, 0.1 * DEG), ShownUnit("arcsec", ARCSEC)),
    "": _SHARE,
    "1": _SHARE,
    "s": (ShownUnit("s", 1.0, 0.1), ShownUnit("ms", 1e-3, 1e-4), ShownUnit("µs", 1e-6)),
    "m": (ShownUnit("m", 1.0, 0.1), ShownUnit("mm", 1e-3)),
    "Hz": (ShownUnit("Hz", 1.0, 0.1), ShownUnit("mHz", 1e-3)),
    "K": (ShownUnit("K"),),
    "m/s": (ShownUnit("m/s", 1.0, 0.1), ShownUnit("mm/s", 1e-3)),
    "1/K": (ShownUnit("ppm/K", PPM),),
    "1/s": (ShownUnit("ppm/h", PPM / HOUR),),
    "s^2/rad^2": _PER_RATE_SQUARED,
    "1/(rad/s)^2": _PER_RATE_SQUARED,
    "1/(rad/s)": (ShownUnit("ppm/(deg/s)", PPM / DEG),),
    "1/(rad/s)^3": (ShownUnit("ppm/(deg/s)³", PPM / DEG**3),),
    "1/(m/s^2)": (ShownUnit("ppm/g", PPM / STANDARD_GRAVITY),),
    "1/(m/s^2)^3": (ShownUnit("ppm/g³", PPM / STANDARD_GRAVITY**3),),
    "1/(m/s^2)^2": (ShownUnit("ppm/g²", PPM / STANDARD_GRAVITY**2),),
    "rad^2/s^2": (ShownUnit("(deg/h)²", DEG_PER_HOUR**2),),
    "rad/s^2": _RATE_DRIFT,
    "rad/s/s": _RATE_DRIFT,
    "m/s^2/s": _FORCE_DRIFT,
    "m/s^3": _FORCE_DRIFT,
    # Powers of one temperature stand below each other: one unit whatever their size.
    "rad/s/K": (ShownUnit("deg/h/K", DEG_PER_HOUR),),
    "rad/s/K^2": (ShownUnit("deg/h/K²", DEG_PER_HOUR),),
    "rad/s/K^3": (ShownUnit("deg/h/K³", DEG_PER_HOUR),),
    "rad/s s/K": (ShownUnit("deg/h/(K/min)", DEG_PER_HOUR * MINUTE),),
    "m/s^2 s/K": (ShownUnit("mm/s²/(K/min)", 1e-3 * MINUTE),),
    "rad/s/(m/s^2)": (ShownUnit("deg/h/g", DEG_PER_HOUR / STANDARD_GRAVITY),),
    "m/s^2/(m/s^2)": _SHARE,
    "rad/s/(m/s^2)^2": (ShownUnit("deg/h/g²", DEG_PER_HOUR / STANDARD_GRAVITY**2),),
    "m/s^2/(m/s^2)^2": (ShownUnit("µg/g²", UG / STANDARD_GRAVITY**2),),
    # Noise, in the units of IEEE Std 952 and 1293; the read-out step of an angle in arcsec.
    "rad/sqrt(s)": _WHITE_RATE,
    "rad/s sqrt(s)": _WHITE_RATE,
    "rad/s/sqrt(s)": (ShownUnit("deg/h/√h", DEG_PER_HOUR_PER_SQRT_HOUR),),
    "rad/s s": (ShownUnit("arcsec", ARCSEC),),
    "m/s/sqrt(s)": _WHITE_FORCE,
    "m/s^2 sqrt(s)": _WHITE_FORCE,
    "m/s^2/sqrt(s)": (ShownUnit("µg/√h", UG / math.sqrt(HOUR)),),
    "m/s^2 s": (ShownUnit("m/s"),),
}

#: Bias instability has the unit of the output but is quoted in the small one, whatever its size.
_INSTABILITY = {"rad/s": ShownUnit("deg/h", DEG_PER_HOUR), "m/s^2": ShownUnit("µg", UG)}


def instability_unit(si: str) -> ShownUnit:
    """The unit of a bias instability given in the SI unit ``si``."""
    return _INSTABILITY.get(si, ShownUnit(_pretty(si)))


def unit_for(si: str, *magnitudes: float) -> ShownUnit:
    """The unit in which the largest of ``magnitudes`` (numbers in the SI unit ``si``) reads well.

    A compound such as "rad/s/K" is shown as its first part's unit with the rest behind it; a unit that is not
    known is shown as it is.
    """
    size = max((abs(m) for m in magnitudes if math.isfinite(m)), default=0.0)
    head, tail = _split(si)
    if head is None:
        return ShownUnit(_pretty(si))
    chosen = next(u for u in _SHOWN[head] if size >= u.least)
    return ShownUnit(chosen.label + _pretty(tail), chosen.factor)


def estimates_in(si: str, values: Sequence[float], deviations: Sequence[float]) -> str:
    """Values ± deviations [SI] as text, in one unit that suits the largest: "-0.61 ± 0.04, 2.1 ± 0.5 deg/s"."""
    unit = unit_for(si, *values)
    each = (with_sd(unit.of(v), unit.of(s)) for v, s in zip(values, deviations, strict=True))
    return f"{', '.join(each)} {unit.label}".rstrip()


def _split(si: str) -> tuple[str | None, str]:
    """The longest known unit that ``si`` starts with, and the rest."""
    if si in _SHOWN:
        return si, ""
    heads = [h for h in ("rad/s", "m/s^2", "rad") if si.startswith(h + "/")]
    return (heads[0], si[len(heads[0]) :]) if heads else (None, "")


def _pretty(si: str) -> str:
    return (
        si.replace("^2", "²").replace("^3", "³").replace("sqrt(s)", "√s").replace("sqrt(Hz)", "√Hz").replace("*", "·")
    )


def number(value: float, digits: int = 3) -> str:
    """``value`` to ``digits`` significant digits; "—" where it is not finite."""
    if not math.isfinite(value):
        return "—"
    if value == 0:
        return "0"
    power = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if -4 < power < 5:
        return f"{value:.{max(digits - 1 - power, 0)}f}"
    return f"{value / 10.0**power:.{digits - 1}f}{_times_ten(power)}"


def with_sd(value: float, sd: float) -> str:
    """``value ± sd`` to the digits that the standard deviation supports; "9.79 ± 0.04"."""
    if not math.isfinite(value) or not math.isfinite(sd) or sd <= 0:
        return number(value, 4)
    last = last_digit(sd)
    top = math.floor(math.log10(max(abs(value), sd)))
    if -4 < top < 5 and (-7 < last <= 0 or (last > 0 and top <= 2)):
        return f"{_fixed(value, -last)} ± {_fixed(sd, -last)}"
    places, scale = max(top - last, 0), 10.0**top
    return f"({_fixed(value / scale, places)} ± {_fixed(sd / scale, places)}){_times_ten(top)}"


def _fixed(value: float, places: int) -> str:
    """``value`` rounded to ``places`` decimals, to tens and hundreds where negative; zero without a sign."""
    return f"{round(value, places) + 0.0:.{max(places, 0)}f}"


def decimals(value: float, digits: int) -> int:
    """Decimals that show ``value`` to ``digits`` significant digits; none for large numbers."""
    return max(0, digits - 1 - math.floor(math.log10(abs(value)))) if value else digits - 1


def last_digit(sd: float) -> int:
    """Power of ten of the last digit that a standard deviation supports (see the module's opening)."""
    power = math.floor(math.log10(sd))
    return power - 1 if sd / 10.0**power < 3.55 else power


def _times_ten(power: int) -> str:
    return "" if power == 0 else "×10" + str(power).translate(_SUPERSCRIPT)


def p_value(p: float) -> str:
    """A probability with its relation: "= 0.04", "= 2×10⁻⁷", "< 10⁻¹⁵" (less means nothing more)."""
    if not math.isfinite(p):
        return "—"
    if p < 1e-15:
        return "< 10⁻¹⁵"
    if p >= 1e-3:
        return f"= {min(p, 1.0):.2g}"
    digit, _, power = f"{p:.0e}".partition("e")
    return f"= {digit}{_times_ten(int(power))}"


def percent(share: float) -> str:
    """A share as a percentage with two digits; "—" where it is not finite."""
    if not math.isfinite(share):
        return "—"
    return f"{100 * share:.0f}%" if abs(share) >= 0.095 else f"{100 * share:.2g}%"


def span(seconds: float) -> str:
    """A duration for reading: "5 s", "23.5 min", "6.2 h"."""
    if not math.isfinite(seconds):
        return "—"
    if seconds < 180:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if seconds < 3 * 3600 else f"{seconds / 3600:.3g} h"
