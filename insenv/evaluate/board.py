"""The leaderboard of an evaluation: a row for each pair, its interval drawn against the bound, sorted by the error.

    x(value) = 6 + 128 ln(value / least) / ln(most / least)

Values of a cell are what a table is sorted by; its text has the digits that the interval allows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, log

from insenv.evaluate import words
from insenv.evaluate.evaluation import Evaluation
from insenv.evaluate.scores import QuantityScore, Scored

HEADER = ("policy", "estimator", "rms", "", "bound", *words.HEADER[2:4], *words.HEADER[5:])
#: How a page calls them, where it is otherwise.
TITLES = {"": "rms, claimed, bound"}
#: Where the picture of an interval stands in a row; width of its axis, and its edge.
PICTURE, _WIDE, _EDGE = 3, 128.0, 6.0


@dataclass(frozen=True)
class Interval:
    """Places of a row's picture: interval and middle of the error, what was claimed, and the bound."""

    low: float
    high: float
    middle: float
    claimed: float
    bound: float | None


@dataclass(frozen=True)
class BoardRow:
    """Text and value of each cell of `HEADER`; the picture."""

    cells: tuple[tuple[str, float | str], ...]
    picture: Interval


def board(found: Evaluation, quantity: str) -> list[BoardRow]:
    """Rows of the pairs that tell a quantity, the least error first."""
    own = [(one, s) for one in found.scored for s in one.scores if s.quantity == quantity]
    own.sort(key=lambda pair: pair[1].rms[0])
    texts = dict(zip([id(s) for _, s in _in_order(found, quantity)], words.rows(found, quantity), strict=True))
    axis = _axis([s for _, s in own])
    return [BoardRow(_cells(one, s, texts[id(s)]), _interval(s, axis)) for one, s in own]


def _in_order(found: Evaluation, quantity: str) -> list[tuple[Scored, QuantityScore]]:
    return [(one, s) for one in found.scored for s in one.scores if s.quantity == quantity]


def _cells(one: Scored, s: QuantityScore, text: tuple[str, ...]) -> tuple[tuple[str, float | str], ...]:
    scale = words.shown(s.unit)[1]
    known = dict(zip(words.HEADER, text, strict=True))
    bound = "" if s.bound is None else f"{s.bound / scale:.4g}"
    values: dict[str, float | None] = {
        "rms": s.rms[0],
        "bound": s.bound,
        "bias": s.bias[0],
        "standard deviation": s.deviation[0],
        "claimed": s.told,
        "error / claimed": s.spread[0],
        "NEES": one.nees[0],
        "efficiency": None if s.efficiency is None else s.efficiency[0],
        "time [s]": one.time,
        "CPU [ms]": one.cpu,
        "estimator [ms]": one.cpu_estimator,
    }
    shown = {**known, "bound": bound, "": ""}
    return tuple((shown[name], _value(values[name]) if name in values else shown[name]) for name in HEADER)


def _value(value: float | None) -> float | str:
    return value if value is not None and isfinite(value) else ""


def _axis(scores: Sequence[QuantityScore]) -> tuple[float, float]:
    """Least and largest of what is drawn, which differ."""
    drawn = [v for s in scores for v in (s.rms[0], _low(s), s.rms[0] + s.rms[1], s.told, s.bound or 0.0)]
    drawn = [v for v in drawn if isfinite(v) and v > 0] or [1.0]
    least, most = min(drawn), max(drawn)
    return (least, most) if most > least else (least / 2, most * 2)


def _low(s: QuantityScore) -> float:
    return max(s.rms[0] - s.rms[1], s.rms[0] / 20)


def _interval(s: QuantityScore, axis: tuple[float, float]) -> Interval:
    least, most = axis

    def place(value: float) -> float:
        value = min(max(value, least), most) if isfinite(value) else most
        return round(_EDGE + _WIDE * log(value / least) / log(most / least), 1)

    bound = None if s.bound is None else place(s.bound)
    return Interval(place(_low(s)), place(s.rms[0] + s.rms[1]), place(s.rms[0]), place(s.told), bound)
