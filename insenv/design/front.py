r"""Time against accuracy: the best procedure at each of some times, and the least time for a demanded accuracy.

    sigma(T) = min_x sigma(x, T),       T(sigma) = min { T : sigma(T) <= sigma }

sigma(T) falls but for the rounding to whole steps, so that the least time is found by bisection. A point of the front
is one that no other beats in both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from insenv.design.kind import Kind, Plan
from insenv.design.search import BestPoint, Values, best

#: Points of a front.
POINTS = 10
#: Times whose procedures a search begins with; factor from which on a family of procedures is hopeless there.
_NEAR, _BEHIND = 2, 1.5
#: Ratio of neighbouring times that are shown.
_APART = 1.1
#: A later family, which is less simple, must be better by this share.
_BETTER = 0.005
Say = Callable[[str], None]


@dataclass(frozen=True)
class Point:
    """A procedure and the least standard deviation of what is sought [SI]."""

    plan: Plan
    sd: float

    @property
    def time(self) -> float:
        """Of the procedure [s]."""
        return self.plan.time


class Designer:
    """Searches a kind's procedures; what was found at one time is where the search at the next begins.

    Parameters
    ----------
    kind : Kind
    method : str
        As of `insenv.design.search.best`.
    seed : int
    """

    def __init__(self, kind: Kind, method: str = "auto", seed: int = 0) -> None:
        self.kind, self.method, self.seed = kind, method, seed
        self._families = kind.families()
        self._known: dict[float, Point | None] = {}
        self._found: dict[float, dict[int, BestPoint]] = {}

    def at(self, time: float, thorough: bool = False) -> Point | None:
        """The best procedure of a time [s], a whole number of steps; None where none can be played.

        ``thorough`` searches all of the box, whatever is known of other times.
        """
        when = max(round(time / self.kind.step), 1) * self.kind.step
        if when not in self._known or thorough:
            found = self._searched(when, thorough or not any(self._found.values()))
            before = self._known.get(when)
            self._known[when] = found if before is None or (found and found.sd < before.sd) else before
        return self._known[when]

    def _searched(self, time: float, thorough: bool) -> Point | None:
        def cost(values: Values) -> float:
            plan = self.kind.plan(values, time)
            return float(np.inf) if plan is None else self.kind.sd(plan)

        near = [] if thorough else sorted((t for t, f in self._found.items() if f), key=lambda t: abs(np.log(t / time)))
        found: dict[int, BestPoint] = {}
        for k, family in enumerate(self._families):
            start = [self._found[t][k].values for t in near[:_NEAR] if k in self._found[t]]
            if near and not self._hopeful(k, near[:_NEAR]):
                continue
            one = best(cost, family, start, "simplex" if start else self.method, self.seed)
            if one is None and start:  # what was possible at another time says nothing of the rest of the box
                one = best(cost, family, (), "simplex", self.seed)
            if one is not None:
                found[k] = one
        self._found[time] = found
        if not found:
            return None
        plan = self.kind.plan(_first_of_equals(found).values, time)
        assert plan is not None
        return Point(plan, self.kind.sd(plan))

    def _hopeful(self, k: int, near: Sequence[float]) -> bool:
        """Whether a family is not far behind at other times, or is not known there."""
        for t in near:
            known = self._found[t]
            if k not in known or known[k].cost <= _BEHIND * min(one.cost for one in known.values()):
                return True
        return False

    def least_time(self, demanded: float, shortest: float, longest: float) -> Point | None:
        """The shortest procedure with a standard deviation of ``demanded`` [SI]; None where the longest has more."""
        step = self.kind.step
        high = self.at(longest)
        if high is None or high.sd > demanded:
            return None
        low = max(int(shortest / step) - 1, 0)
        top = round(high.time / step)
        while top - low > 1:
            middle = _between(low, top)
            point = self.at(middle * step)
            if point is not None and point.sd <= demanded:
                top, high = middle, point
            else:
                low = middle
        return high

    def front(self, times: Iterable[float], say: Say = lambda text: None) -> tuple[Point, ...]:
        """What no other procedure beats, of those at ``times`` and all that were found before; by time."""
        for time in sorted(times, reverse=True):
            say(f"the best procedure of {time:.4g} s")
            self.at(time)
        return nondominated([p for p in self._known.values() if p is not None])


def _first_of_equals(found: Mapping[int, BestPoint]) -> BestPoint:
    """The best, where families that come first win what is nearly a draw."""
    chosen: BestPoint | None = None
    for one in found.values():
        if chosen is None or one.cost < (1 - _BETTER) * chosen.cost:
            chosen = one
    assert chosen is not None
    return chosen


def _between(low: int, high: int) -> int:
    """The middle in the logarithm while that is far apart."""
    middle = round(np.sqrt(max(low, 1) * high)) if high > 2 * max(low, 1) else (low + high) // 2
    return min(max(middle, low + 1), high - 1)


def thinned(points: Sequence[Point], kept: Sequence[Point]) -> tuple[Point, ...]:
    """Points by time, each well apart from the one before; those of ``kept`` in any case."""
    found: list[Point] = []
    for point in points:
        if found and point.time < _APART * found[-1].time:
            if point not in kept:
                continue
            if found[-1] not in kept:
                found.pop()
        found.append(point)
    return tuple(found)


def nondominated(points: Sequence[Point]) -> tuple[Point, ...]:
    """Those that no other point beats in time and accuracy, by time."""
    kept: list[Point] = []
    for point in sorted(points, key=lambda p: (p.time, p.sd)):
        if not kept or point.sd < kept[-1].sd:
            kept.append(point)
    return tuple(kept)


def times(shortest: float, longest: float, points: int = POINTS) -> list[float]:
    """Evenly spaced in the logarithm [s]."""
    return np.geomspace(shortest, longest, points).tolist()
