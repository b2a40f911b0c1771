"""The front of a design for whoever explores it: each point with its profile and its scenario file.

Places are those of a picture of `SIZE`, logarithmic in time and standard deviation; a profile is drawn against the time
of its own procedure. What the page shows of a point is made here: its script shows and hides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from insenv.design import words
from insenv.design.designing import DESIGNED, PUBLISHED, Designed, kind_of
from insenv.design.front import Point
from insenv.design.texts import shown
from insenv.design.written import scenario_text
from insenv.evaluate.words import shown as units
from insenv.report.drawing import log_ticks

#: Width and height of the front and of a profile, and their edges: left, right, top, bottom.
SIZE, PROFILE, EDGES = (560.0, 300.0), (560.0, 150.0), (62.0, 14.0, 22.0, 30.0)


@dataclass(frozen=True)
class Marked:
    """A point of the front.

    Attributes
    ----------
    x, y : float
        In the picture.
    kind : str
        "front", "designed" or "published".
    title : str
    words : str
        What it does.
    path : str
        Its profile, as an SVG path.
    low, high, time : str
        Ends of the profile's axes.
    zero : float, optional
        Where its axis is zero.
    scenario : str
        TOML.
    """

    x: float
    y: float
    kind: str
    title: str
    words: str
    path: str
    low: str
    high: str
    time: str
    zero: float | None
    scenario: str


@dataclass(frozen=True)
class Tick:
    """A number at a place of an axis."""

    at: float
    text: str


@dataclass(frozen=True)
class Front:
    """All points, by time, and the axes; ``line`` joins those of the front."""

    points: tuple[Marked, ...]
    line: str
    across: tuple[Tick, ...]
    up: tuple[Tick, ...]
    unit: str
    quantity: str
    axis: tuple[str, str]


def front(found: Designed) -> Front:
    """What there is to explore of a design."""
    others = [p for p in (found.chosen, found.published) if p not in found.front]
    every = sorted((p for p in (*found.front, *others) if np.isfinite(p.sd)), key=lambda p: p.time)
    name, scale = words.unit(found), units(found.quantity.unit)[1]
    across = _Axis([p.time for p in every], EDGES[0], SIZE[0] - EDGES[1])
    up = _Axis([p.sd / scale for p in every], SIZE[1] - EDGES[3], EDGES[2])
    again = _again(found)
    points = tuple(
        _marked(found, p, (across.place(p.time), up.place(p.sd / scale)), f"{p.sd / scale:.4g} {name}", again)
        for p in every
    )
    on = [p for p in points if p.kind != PUBLISHED]
    line = "M" + "L".join(f"{p.x:.1f} {p.y:.1f}" for p in on) if on else ""
    return Front(points, line, across.ticks, up.ticks, name, found.quantity.name, found.axis)


class _Axis:
    """A logarithmic axis between two places, with room beside the values."""

    def __init__(self, values: Sequence[float], first: float, last: float) -> None:
        self._low, self._high = min(values) / 1.15, max(values) * 1.15
        self._first, self._last = first, last

    def place(self, value: float) -> float:
        """Of a value."""
        share = np.log(value / self._low) / np.log(self._high / self._low)
        return round(float(self._first + (self._last - self._first) * share), 1)

    @property
    def ticks(self) -> tuple[Tick, ...]:
        """A few plain numbers."""
        return tuple(Tick(self.place(v), f"{v:g}") for v in log_ticks(self._low, self._high))


def _again(found: Designed) -> dict[str, str]:
    """What the file must say beside a procedure, so that the same is sought."""
    usual = kind_of(found.scenario, None)[0].quantity.name
    return {} if usual == found.quantity.name else {"design.quantity": found.quantity.name}


def _marked(found: Designed, point: Point, at: tuple[float, float], sd: str, again: dict[str, str]) -> Marked:
    kind = DESIGNED if point == found.chosen else PUBLISHED if point == found.published else "front"
    title = f"{point.time:.6g} s, {sd}"
    promise = words.promise(found) if kind == DESIGNED else (
        f"From the front of `insenv design` for {found.scenario}: {found.quantity.name} in {point.time:.6g} s with a "
        f"standard deviation of {sd} at least (bound). What it does: {point.plan.words}."
    )  # fmt: skip
    text = scenario_text(found.scenario, dict(point.plan.changes) | again, promise)
    track = point.plan.track or held(point)
    unit = found.axis[1]
    t, y = np.array([pair[0] for pair in track]), np.array([shown(pair[1], unit) for pair in track])
    low, high = float(min(y.min(), 0.0)), float(max(y.max(), 0.0))
    room = 0.06 * ((high - low) or 1.0)
    bottom, top = PROFILE[1] - EDGES[3], EDGES[2]

    def level(values: np.ndarray) -> np.ndarray:
        found_: np.ndarray = bottom + (top - bottom) * (values - low + room) / (high - low + 2 * room)
        return found_

    x = EDGES[0] + (PROFILE[0] - EDGES[0] - EDGES[1]) * t / point.time
    path = "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, level(y), strict=True))
    zero = round(float(level(np.zeros(1))[0]), 1)
    return Marked(
        *at, kind, title, point.plan.words, path, f"{low:.4g}", f"{high:.4g}", f"{point.time:.6g}", zero, text
    )


def held(point: Point) -> list[tuple[float, float]]:
    """Both ends of each stretch in which a value is held."""
    found, passed = [(0.0, 0.0)], 0.0
    for time, value in point.plan.course:
        found += [(passed, value), (passed + time, value)]
        passed += time
    return found
