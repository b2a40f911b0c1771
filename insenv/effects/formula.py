"""An effect made from a formula: a product of powers of what was recorded, times a coefficient.

    c x y          x, y of   u, |u|, u^2, u|u|, u^3, 1/u    rate of the input axis
                             du/dt, |du/dt|, (du/dt)^2      its derivative
                             (T - T_ref), |T - T_ref|, (T - T_ref)^2, (T - T_ref)^3, dT/dt, |dT/dt|, (dT/dt)^2
                             t, t^2                         time from the start of the run
                             cos(n a + p), n = 1 to 4       table angle; c cos p and -c sin p are the coefficients
                             f_x, |f_x|, f_x^2, v_x, ...    specific force along an axis, mean square of the vibration
    c x (T - T_0) + ...                            the same with an origin of its own: (T - T_0), (T - T_0)^2, (t - t_0)
    c lag(x y)     tau dL/dt = x y - L,    L = x y at the start of the run

Of a factor with an origin of its own each power is a column: c x (T - T_ref) + c_0 x, where T_0 = T_ref - c_0 / c, and
c x (T - T_ref)^2 + c_1 x (T - T_ref) + c_0 x. Nobody knows where a law over the temperature is nothing; at a reference
that was chosen for another reason it is not, and its part that does not change hides the one that does.

The mean of each factor over the interval stands for the factor; 1/u is nothing where the table stands (`STANDS`). The
coefficient has the unit of what is measured over that of the product, in base units. An effect of this kind is a class
with a text:

    class BiasOfHeatedMotion(Formula):
        id = "bias_of_heated_motion"
        formula = "u^2 * (T - T_ref)"
        linear = (coefficient(formula, "gyro", sd=1e-4),)
        source = "..."

All else of an effect (what it needs, whether it follows the rate or the time) is read from the text.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import product as iterate
from typing import Any, ClassVar

import numpy as np

from insenv.core.errors import InputError
from insenv.core.motion import Motion, interval_slope
from insenv.core.recording import Floats
from insenv.effects.base import Effect, Instrument, LinearEffect, MemoryEffect, Param
from insenv.effects.forms import columns, first_order, known, spread, standing, time_constants, wave
from insenv.effects.thermal import temperature_excess

#: Rate below which a table stands, and one over the rate is nothing [rad/s]: 0.06 deg/s.
STANDS = 1e-3
#: Orders of the table's angle.
ORDERS = (1, 2, 3, 4)
#: How a factor is written whose origin is its own, and how it is with the one of the recording.
FREE = {"(T - T_0)": "(T - T_ref)", "(t - t_0)": "t"}
#: Between the factors of a formula, and what opens one of which the first-order lag is meant.
TIMES, LAG = " * ", "lag("
#: Base units, in the order in which they are written.
_BASES = ("rad", "m", "s", "K")
#: What is measured, in base units.
_MEASURED: dict[str, dict[str, int]] = {"gyro": {"rad": 1, "s": -1}, "accelerometer": {"m": 1, "s": -2}}


@dataclass(frozen=True)
class Factor:
    """One factor of a formula.

    Attributes
    ----------
    text : str
    driver : str
        What was recorded: factors of one driver are not multiplied with each other.
    unit : dict
        Exponents of the base units of its first column.
    simplicity : int
        Rank among the factors of the driver, 1 for the plainest.
    means : callable
        Means over the intervals, a column for each part: of the input and the motion, for an effect of this name.
    needs : tuple of str
    of_rate, of_time : bool
    parts : tuple of (str, dict)
        What each column adds to the name of a coefficient, and its unit where that is another one.
    """

    text: str
    driver: str
    unit: dict[str, int]
    simplicity: int
    means: Callable[[Floats, Motion, str], tuple[Floats, ...]]
    needs: tuple[str, ...] = ()
    of_rate: bool = False
    of_time: bool = False
    parts: tuple[tuple[str, dict[str, int] | None], ...] = (("", None),)

    @property
    def columns(self) -> list[tuple[str, dict[str, int]]]:
        """What each column adds to the name of a coefficient, and its unit."""
        return [(part, self.unit if own is None else own) for part, own in self.parts]

    @property
    def free(self) -> bool:
        """Whether its origin is its own."""
        return any(word in self.text for word in FREE)


def _powers(
    driver: str,
    bare: str,
    unit: dict[str, int],
    mean: Callable[[Floats, Motion, str], Floats],
    kinds: tuple[str, ...],
    **flags: Any,
) -> list[Factor]:
    """Factors of one driver: ``bare`` is how it is written between bars."""
    single = bare if bare.isidentifier() else f"({bare})"
    forms: dict[str, tuple[str, int, int, Callable[[Floats], Floats]]] = {
        "1": (single if " " in bare or bare.isidentifier() else bare, 1, 1, lambda x: x),
        "||": (f"|{bare}|", 1, 2, np.abs),
        "2": (f"{single}^2", 2, 2, np.square),
        "x|x|": (f"{bare}|{bare}|", 2, 3, lambda x: x * np.abs(x)),
        "3": (f"{single}^3", 3, 3, lambda x: x * x * x),
        "-1": (f"1/{bare}", -1, 3, _inverse),
    }

    def factor(kind: str) -> Factor:
        text, power, rank, of = forms[kind]
        own = {base: power * exponent for base, exponent in unit.items()}
        return Factor(text, driver, own, rank, lambda u, motion, key: (of(mean(u, motion, key)),), **flags)

    return [factor(kind) for kind in kinds]


def _free(bare: str, base: str, mean: Callable[[Floats, Motion, str], Floats], power: int, **flags: Any) -> Factor:
    """A power of a driver with an origin of its own: a column for each power of what is measured from the usual one."""
    text = f"({bare})" if power == 1 else f"({bare})^{power}"
    parts = tuple(("" if k == power else f"_{k}", {base: k}) for k in range(power, -1, -1))

    def means(u: Floats, motion: Motion, key: str) -> tuple[Floats, ...]:
        x = mean(u, motion, key)
        return tuple(x**k for k in range(power, -1, -1))

    return Factor(text, bare[0], {base: power}, power + 1, means, parts=parts, **flags)


def _word(text: str) -> str:
    """A factor in letters and digits: "abs_temp_rate"."""
    if text.startswith("cos("):
        return f"angle{text[4] if text[4].isdigit() else 1}"
    word = {"u|u|": "u_abs_u", "1/u": "inverse_u"}.get(text, text)
    for old, new in (
        ("T - T_0", "free_temp"),
        ("t - t_0", "free_time"),
        ("du/dt", "u_rate"),
        ("dT/dt", "temp_rate"),
        ("T - T_ref", "temp"),
        ("^", ""),
    ):
        word = word.replace(old, new)
    opened = "abs_" if word.startswith("|") else ""
    return opened + "".join(c for c in word if c.isalnum() or c == "_")


def _inverse(x: Floats) -> Floats:
    moves = np.abs(x) > STANDS
    return np.where(moves, 1 / np.where(moves, x, 1.0), 0.0)


def _waves() -> list[Factor]:
    def means(order: int) -> Callable[[Floats, Motion, str], tuple[Floats, ...]]:
        def both(u: Floats, motion: Motion, key: str) -> tuple[Floats, ...]:
            angle, mean = known(motion, "angle", key), standing if motion.stands else wave
            return mean(angle, order, 1.0, 0.0), mean(angle, order, 0.0, 1.0)

        return both

    phases: dict[str, Any] = {"needs": ("angle",), "parts": (("", None), ("s", None))}
    return [Factor(f"cos({'' if n == 1 else f'{n} '}a + p)", "a", {}, n, means(n), **phases) for n in ORDERS]


def _of_axes(letter: str, name: str, unit: dict[str, int], kinds: tuple[str, ...]) -> list[Factor]:
    """Factors of a field that has an array for each axis."""

    def mean(axis: str) -> Callable[[Floats, Motion, str], Floats]:
        def of_axis(u: Floats, motion: Motion, key: str) -> Floats:
            values = getattr(motion, name)
            if axis not in values:
                raise InputError(f"effect {key!r} needs {name}.{axis}, which the exposure lacks")
            return np.asarray(values[axis])

        return of_axis

    return [
        factor
        for axis in "xyz"
        for factor in _powers(
            f"{letter}_{axis}", f"{letter}_{axis}", unit, mean(axis), kinds, needs=(f"{name}.{axis}",)
        )
    ]


def _rate(u: Floats, motion: Motion, key: str) -> Floats:
    return u


def _rate_slope(u: Floats, motion: Motion, key: str) -> Floats:
    return interval_slope(known(motion, "rate_edges", key), motion.dt)


def _temperature_slope(u: Floats, motion: Motion, key: str) -> Floats:
    return interval_slope(known(motion, "temperature", key), motion.dt)


def _temperature(u: Floats, motion: Motion, key: str) -> Floats:
    return temperature_excess(motion, key)


def _time(u: Floats, motion: Motion, key: str) -> Floats:
    return motion.middle


_WARM = {"needs": ("temperature",)}
#: All factors, by their text.
FACTORS: dict[str, Factor] = {
    factor.text: factor
    for factor in (
        *_powers("u", "u", {"rad": 1, "s": -1}, _rate, ("1", "||", "2", "x|x|", "3", "-1"), of_rate=True),
        *_powers(
            "du/dt",
            "du/dt",
            {"rad": 1, "s": -2},
            _rate_slope,
            ("1", "||", "2"),
            needs=("rate_edges",),
            of_rate=True,
        ),
        *_powers("T", "T - T_ref", {"K": 1}, _temperature, ("1", "||", "2", "3"), **_WARM),
        *(_free("T - T_0", "K", _temperature, power, **_WARM) for power in (1, 2)),
        *_powers("dT/dt", "dT/dt", {"K": 1, "s": -1}, _temperature_slope, ("1", "||", "2"), **_WARM),
        *_powers("t", "t", {"s": 1}, _time, ("1", "2"), of_time=True),
        _free("t - t_0", "s", _time, 1, of_time=True),
        *_waves(),
        *_of_axes("f", "force", {"m": 1, "s": -2}, ("1", "||", "2")),
        *_of_axes("v", "vibration", {"m": 2, "s": -4}, ("1",)),
    )
}


#: Words of factors in identifiers.
_NAMES = {text: _word(text) for text in FACTORS}


@dataclass(frozen=True)
class Product:
    """A formula as it is read: its factors, and whether its first-order lag is meant."""

    factors: tuple[Factor, ...]
    lagged: bool = False

    @property
    def text(self) -> str:
        """As it is written."""
        product = TIMES.join(factor.text for factor in self.factors)
        return f"{LAG}{product})" if self.lagged else product

    @property
    def simplicity(self) -> int:
        """Rank: the less, the plainer."""
        return sum(factor.simplicity for factor in self.factors) + 3 * self.lagged + 3 * (len(self.factors) - 1)

    def means(self, u: Floats, motion: Motion, key: str) -> tuple[Floats, ...]:
        """The product of the means over the intervals: a column for each coefficient."""
        return self.of(lambda factor: factor.means(u, motion, key))

    def of(self, means: Callable[[Factor], tuple[Floats, ...]]) -> tuple[Floats, ...]:
        """The same of the means of each factor."""
        out: tuple[Floats, ...] = ()
        for factor in self.factors:
            own = means(factor)
            out = tuple(a * b for a in out for b in own) if out else own
        return out

    def coefficients(self, instrument: str) -> dict[str, str]:
        """Names of the coefficients, one for each column, with their units in base units."""
        return {
            _name([part for part, _ in column]): _unit([unit for _, unit in column], instrument)
            for column in iterate(*(factor.columns for factor in self.factors))
        }

    def unit(self, instrument: str) -> str:
        """Unit of the first coefficient, in base units."""
        return next(iter(self.coefficients(instrument).values()))


def _name(parts: list[str]) -> str:
    """The name of a coefficient: a letter, and what its origin's own power is."""
    letter = "".join(part for part in parts if not part.startswith("_"))
    return (letter or "c") + "".join(part for part in parts if part.startswith("_"))


def _unit(units: list[dict[str, int]], instrument: str) -> str:
    """What is measured over the units of the factors."""
    left = dict.fromkeys(_BASES, 0) | _MEASURED[instrument]
    for unit in units:
        for base, exponent in unit.items():
            left[base] -= exponent
    above = " ".join(_power(base, n) for base, n in left.items() if n > 0) or "1"
    below = [_power(base, -n) for base, n in left.items() if n < 0]
    return above if not below else f"{above}/{below[0]}" if len(below) == 1 else f"{above}/({' '.join(below)})"


def _power(base: str, exponent: int) -> str:
    return base if exponent == 1 else f"{base}^{exponent}"


@cache
def product(text: str) -> Product:
    """The formula that a text says.

    Raises
    ------
    InputError
        If it is none.
    """
    lagged = text.startswith(LAG) and text.endswith(")")
    names = (text[len(LAG) : -1] if lagged else text).split(TIMES)
    for name in names:
        if name not in FACTORS:
            raise InputError(f"formula {text!r}: unknown factor {name!r}; wanted a product of {', '.join(FACTORS)}")
    factors = tuple(FACTORS[name] for name in names)
    if lagged and any(len(factor.parts) > 1 for factor in factors):
        raise InputError(
            f"formula {text!r}: a lag of the table's angle has a phase of its own, and of a product with an origin "
            "two parts; wanted it without"
        )
    if sum(factor.driver == "a" for factor in factors) > 1:
        raise InputError(f"formula {text!r}: two waves of the table's angle; wanted one")
    if sum(factor.free for factor in factors) > 1:
        raise InputError(f"formula {text!r}: two origins of their own; wanted one")
    return Product(factors, lagged)


def coefficient(formula: str, instrument: Instrument, sd: float, bound: float = np.inf, name: str = "c") -> Param:
    """A coefficient of a formula, with the unit that it has on an instrument; another ``name`` is of the first one."""
    read = product(formula)
    return Param(name, read.coefficients(instrument).get(name, read.unit(instrument)), sd=sd, bound=bound)


def name_of(formula: str) -> str:
    """An identifier for the effect of a formula: "formula_u2_temp"."""
    return (
        "formula_"
        + "_".join(_NAMES[factor.text] for factor in product(formula).factors)
        + ("_lagged" if product(formula).lagged else "")
    )


class _OfFormula:
    """What an effect's text says of it."""

    formula: ClassVar[str] = ""

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        if not cls.formula:
            return
        said: Any = cls
        read = product(cls.formula)
        said.needs = tuple(dict.fromkeys(need for factor in read.factors for need in factor.needs))
        said.of_rate = any(factor.of_rate for factor in read.factors)
        said.of_time = any(factor.of_time for factor in read.factors)


@dataclass(frozen=True)
class Formula(_OfFormula, LinearEffect):
    """A product of powers of what was recorded: the author writes ``formula``."""

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """The product, shape (..., n, k), with a column for each coefficient."""
        return columns(u, *product(self.formula).means(u, motion, self.id))


@dataclass(frozen=True)
class LaggedFormula(_OfFormula, MemoryEffect):
    """What follows such a product with a first-order lag: ``formula`` is "lag(...)"."""

    shapes = (Param("tau", "s", sd=300.0, low=0.5),)

    def begin(self, motion: Motion, theta: Floats) -> Floats:
        """The product at the start of a run, shape (...): before it nothing changed."""
        first = replace(motion.interval(0, 1), step=motion.dt)
        start = self._product(first.rate, first)[..., 0]
        return np.broadcast_to(start, np.broadcast_shapes(start.shape, np.shape(theta)[:-1])).copy()

    def carry(self, u: Floats, motion: Motion, theta: Floats, state: Any) -> tuple[Floats, Floats]:
        """Coefficient times the mean of the lagged product, shape (..., n), and it at the last edge, shape (...)."""
        x = motion.dt / theta[..., 1]
        decayed, share = np.exp(-x), -np.expm1(-x) / x
        drive = self._product(u, motion)
        followed, last = first_order(decayed, (1 - decayed)[..., None] * drive, np.asarray(state))
        mean = share[..., None] * followed + (1 - share)[..., None] * drive
        return spread(u, theta[..., 0, None] * mean), last

    def grid(self, motion: Motion) -> Floats:
        """Time constants, shape (g, 1)."""
        return time_constants(motion, 8)

    def _product(self, u: Floats, motion: Motion) -> Floats:
        (one,) = product(self.formula).means(u, motion, self.id)
        return np.broadcast_to(one, np.broadcast_shapes(np.shape(u), one.shape))


@cache
def made(formula: str, instrument: Instrument, sd: tuple[float, ...], name: str) -> Effect:
    """The effect of a formula, with coefficients of these standard deviations; equal to any other made of the same."""
    names = product(formula).coefficients(instrument)
    params = tuple(coefficient(formula, instrument, own, name=c) for c, own in zip(names, sd, strict=True))
    effect: Effect = _kind(formula, instrument, name)(params)
    return effect


@cache
def _kind(formula: str, instrument: Instrument, name: str) -> Any:
    """The class of a formula: one for all deviations, since each that is added slows the question what something is."""
    read = product(formula)
    kind: Any = type(
        "".join(part.capitalize() for part in name.split("_")),
        (LaggedFormula if read.lagged else Formula,),
        {
            "__doc__": f"{formula}, as a search found it.",
            "__module__": __name__,
            "id": name,
            "formula": formula,
            "title": formula,
            "meaning": f"found by a search among formulas: {formula}",
            "__annotations__": {"linear": tuple[Param, ...]},
            "linear": field(default=(), repr=False),
            "instruments": (instrument,),
            "source": "a search among formulas (insenv.identify.formula)",
        },
    )
    return dataclass(frozen=True)(kind)
