"""Expressions of units: products, quotients, powers and roots of names and numbers.

    product = factor {("*" | "·" | "/" | "per" | "") factor}      left to right, as in pint
    factor  = ("sqrt" | "√") factor | atom [("^" | "**") exponent]
    atom    = name | number | "(" product ")"

It is read in bounded time whatever the text. What a name means is not known here: the caller says.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from fractions import Fraction

_SYMBOLS = {"radian": "rad", "meter": "m", "kelvin": "K", "second": "s", "ampere": "A"}
NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_TOKEN = re.compile(rf"\s*({NUMBER}|[A-Za-zµμΔ°%‰][A-Za-z0-9_°]*|\*\*|[*/^()√·+-])", re.ASCII)
_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
_MAX_POWER = 12


class NotAUnitError(Exception):
    """The text is outside the grammar or names something unknown."""


@dataclass(frozen=True)
class Unit:
    """A factor to SI and powers of base units; products and powers of units are units."""

    factor: float
    powers: dict[str, Fraction] = field(default_factory=dict)

    def times(self, other: "Unit", sign: int) -> "Unit":
        """Product with the other unit for sign +1, quotient for sign -1."""
        if sign < 0 and other.factor == 0.0:
            raise NotAUnitError
        powers = dict(self.powers)
        for name, power in other.powers.items():
            powers[name] = powers.get(name, Fraction(0)) + sign * power
        factor = self.factor * other.factor if sign > 0 else self.factor / other.factor
        return Unit(factor, {name: power for name, power in powers.items() if power})

    def power(self, exponent: Fraction) -> "Unit":
        """Raise to a power of bounded size."""
        if abs(exponent) > _MAX_POWER:
            raise NotAUnitError
        try:
            factor = self.factor ** float(exponent)
        except (OverflowError, ZeroDivisionError):
            raise NotAUnitError from None
        return Unit(factor, {name: p * exponent for name, p in self.powers.items() if exponent})

    def __str__(self) -> str:
        over = [_symbol(name, power) for name, power in sorted(self.powers.items()) if power > 0]
        under = ["/" + _symbol(name, -power) for name, power in sorted(self.powers.items()) if power < 0]
        return "in " + (" ".join(over) or "1") + "".join(under) if self.powers else "a plain number"


def _symbol(name: str, power: Fraction) -> str:
    return _SYMBOLS.get(name, name) + ("" if power == 1 else f"^{float(power):g}")


class _Reader:
    """Recursive descent over the tokens of one expression."""

    def __init__(self, text: str, named: Callable[[str], Unit]) -> None:
        self.tokens = _tokens(text)
        self.named = named

    def whole(self) -> Unit:
        unit = self.product()
        if self.tokens:
            raise NotAUnitError
        return unit

    def product(self) -> Unit:
        unit = self.factor()
        while self.tokens and self.tokens[-1] != ")":
            token = self.tokens[-1]
            if token in ("*", "·", "/", "per"):
                self.tokens.pop()
            elif _starts_number(token) or (token == "(" and _starts_number(self.tokens[-2:][0])):
                raise NotAUnitError  # "10 000 Hz" and "5(3) s" are numbers written otherwise, not products
            unit = unit.times(self.factor(), -1 if token in ("/", "per") else 1)
        return unit

    def factor(self) -> Unit:
        if self.take("√") or self.take("sqrt"):
            return self.factor().power(Fraction(1, 2))
        unit = self.atom()
        return unit.power(self.exponent()) if self.take("^") or self.take("**") else unit

    def atom(self) -> Unit:
        if self.take("("):
            unit = self.product()
            self.expect(")")
            return unit
        token = self.pop()
        if _starts_number(token):
            return Unit(float(token))
        if token in ("per", "sqrt") or not (token[0].isalpha() or token[0] in "°%‰"):
            raise NotAUnitError
        return self.named(token)

    def exponent(self) -> Fraction:
        if self.take("("):
            value = self.exponent()
            if self.take("/"):
                divisor = self.exponent()
                if not divisor:
                    raise NotAUnitError
                value /= divisor
            self.expect(")")
            return value
        sign = -1 if self.take("-") else 1
        token = self.pop()
        if not _starts_number(token) or not float(token) <= _MAX_POWER:
            raise NotAUnitError
        return sign * Fraction(float(token)).limit_denominator(1000)

    def take(self, token: str) -> bool:
        found = bool(self.tokens) and self.tokens[-1] == token
        if found:
            self.tokens.pop()
        return found

    def expect(self, token: str) -> None:
        if not self.take(token):
            raise NotAUnitError

    def pop(self) -> str:
        if not self.tokens:
            raise NotAUnitError
        return self.tokens.pop()


def read(text: str, named: Callable[[str], Unit]) -> Unit:
    """The unit that an expression stands for, `named` telling that of a name. Both raise NotAUnitError."""
    return _Reader(text, named).whole()


def _starts_number(token: str) -> bool:
    return token[0] in "0123456789."


def _tokens(text: str) -> list[str]:
    """Tokens in reverse order, so that the next one is popped from the end."""
    text = re.sub("[⁰¹²³⁴-⁹⁻]+", lambda run: "^" + run.group().translate(_SUPERSCRIPTS), text).rstrip()
    tokens, at = [], 0
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise NotAUnitError
        tokens.append(match.group(1))
        at = match.end()
    return tokens[::-1]
