"""SI inside, an engineer's units outside: ``shown = value / factor``, the unit chosen by magnitude.

Numbers are rounded to the digits that their standard deviation supports, by the rule of the Particle Data
Group (Review of Particle Physics, Introduction, "Rounding"): of the three leading digits of the standard
deviation, 100-354 keep two and 355-999 keep one.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from insenv.core.recording import Floats

_DEG = math.pi / 180
_DEG_H = _DEG / 3600
_G = 9.80665
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

#: Zero on the Celsius scale [K].
CELSIUS = 273.15


@dataclass(frozen=True)
class Unit:
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

    def show(self, value: float, digits: int = 3) -> str:
        """``value`` [SI] as text with the unit; "—" where it is not finite."""
        return f"{number(self.of(value), digits)} {self.label}".rstrip() if math.isfinite(value) else "—"

    def show_with_sd(self, value: float, sd: float) -> str:
        """``value ± sd`` [SI] as text with the unit."""
        return f"{with_sd(self.of(value), self.of(sd))} {self.label}".rstrip()


_RATE = (Unit("deg/s", _DEG, 0.05 * _DEG), Unit("deg/h", _DEG_H))
_FORCE = (Unit("m/s²", 1.0, 0.5), Unit("mm/s²", 1e-3, 2e-4), Unit("µg", _G * 1e-6))
_SHARE = (Unit("", 1.0, 0.01), Unit("ppm", 1e-6))

#: SI unit -> what to show instead, from the largest magnitude down.
_SHOWN: dict[str, tuple[Unit, ...]] = {
    "rad/s": _RATE,
    "m/s^2": _FORCE,
    "rad": (Unit("deg", _DEG, 0.1 * _DEG), Unit("arcsec", _DEG / 3600)),
    "": _SHARE,
    "1": _SHARE,
    "s": (Unit("s", 1.0, 0.1), Unit("ms", 1e-3, 1e-4), Unit("µs", 1e-6)),
    "Hz": (Unit("Hz", 1.0, 0.1), Unit("mHz", 1e-3)),
    "K": (Unit("K"),),
    "m/s": (Unit("m/s", 1.0, 0.1), Unit("mm/s", 1e-3)),
    "1/K": (Unit("ppm/K", 1e-6),),
    "1/s": (Unit("ppm/h", 1e-6 / 3600),),
    "s^2/rad^2": (Unit("ppm/(deg/s)²", 1e-6 / _DEG**2),),
    "1/(rad/s)^2": (Unit("ppm/(deg/s)²", 1e-6 / _DEG**2),),
    "rad/s^2": (Unit("deg/h/h", _DEG_H / 3600),),
    "rad/s/s": (Unit("deg/h/h", _DEG_H / 3600),),
    "m/s^2/s": (Unit("mm/s²/h", 1e-3 / 3600),),
    "m/s^3": (Unit("mm/s²/h", 1e-3 / 3600),),
    "rad/s/(K/s)": (Unit("deg/h/(K/min)", _DEG_H * 60),),
    "m/s^2/(K/s)": (Unit("mm/s²/(K/min)", 1e-3 * 60),),
    "rad/K": (Unit("deg/h/(K/s)", _DEG_H),),
    "rad/s/(m/s^2)": (Unit("deg/h/g", _DEG_H / _G),),
    "rad/sqrt(s)": (Unit("deg/√h", _DEG / 60),),
    "rad/s*sqrt(s)": (Unit("deg/√h", _DEG / 60),),
    "rad/s/sqrt(s)": (Unit("deg/h/√h", _DEG_H / 60),),
    "m/s/sqrt(s)": (Unit("µg/√Hz", _G * 1e-6),),
    "m/s^2*sqrt(s)": (Unit("µg/√Hz", _G * 1e-6),),
    "m/s^2/sqrt(s)": (Unit("µg/√h", _G * 1e-6 / 60),),
}


def unit_for(si: str, *magnitudes: float) -> Unit:
    """The unit in which the largest of ``magnitudes`` (numbers in the SI unit ``si``) reads well.

    A compound such as "rad/s/K" is shown as its first part's unit with the rest behind it; a unit that is not
    known is shown as it is.
    """
    size = max((abs(m) for m in magnitudes if math.isfinite(m)), default=0.0)
    head, tail = _split(si)
    if head is None:
        return Unit(_pretty(si))
    chosen = next(u for u in _SHOWN[head] if size >= u.least)
    return Unit(chosen.label + _pretty(tail), chosen.factor)


def _split(si: str) -> tuple[str | None, str]:
    """The longest known unit that ``si`` starts with, and the rest."""
    if si in _SHOWN:
        return si, ""
    heads = [h for h in ("rad/s", "m/s^2", "rad") if si.startswith((h + "/", h + "*"))]
    return (heads[0], si[len(heads[0]) :]) if heads else (None, "")


def _pretty(si: str) -> str:
    return (
        si.replace("^2", "²")
        .replace("^3", "³")
        .replace("sqrt(s)", "√s")
        .replace("sqrt(Hz)", "√Hz")
        .replace("*", "·")
    )


def largest(values: Iterable[float]) -> float:
    """Largest finite magnitude; 0 where there is none."""
    return max((abs(v) for v in values if math.isfinite(v)), default=0.0)


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
    last = _last_digit(sd)
    top = math.floor(math.log10(max(abs(value), sd)))
    if -4 < top < 5 and last > -7 and last <= 0:
        return f"{value:.{-last}f} ± {sd:.{-last}f}"
    places, scale = max(top - last, 0), 10.0**top
    return f"({value / scale:.{places}f} ± {sd / scale:.{places}f}){_times_ten(top)}"


def _last_digit(sd: float) -> int:
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
