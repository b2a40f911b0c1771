"""The search of a design: boxes, fronts and least times, on costs that are known in closed form."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from insenv.core.errors import InputError
from insenv.design import search
from insenv.design.front import Designer, Point, nondominated, thinned, times
from insenv.design.kind import Family, Plan, Variable

BOX: Family = (Variable("a", 1.0, 100.0, log=True), Variable("b", -2.0, 2.0), Variable("k", 0, 3, whole=True))


def valley(values: Mapping[str, float]) -> float:
    """Least, 1, at a = 20, b = 0.7, k = 2."""
    return 1 + np.log(values["a"] / 20) ** 2 + (values["b"] - 0.7) ** 2 + abs(values["k"] - 2)


def test_a_simplex_finds_what_lies_between_the_points_of_the_grid() -> None:
    found = search.best(valley, BOX)
    assert found is not None
    assert found.values["k"] == 2
    assert found.values["a"] == pytest.approx(20, rel=0.02)
    assert found.values["b"] == pytest.approx(0.7, abs=0.02)
    assert found.cost < search.best(valley, BOX, method="grid").cost  # type: ignore[union-attr]


def test_nothing_leaves_the_box_and_what_is_held_stays() -> None:
    seen: list[Mapping[str, float]] = []

    def cost(values: Mapping[str, float]) -> float:
        seen.append(values)
        return values["a"] - values["b"] + values["c"]

    family = (Variable("a", 1.0, 2.0), Variable("b", 0.0, 1.0), Variable("c", 5.0, 5.0))
    found = search.best(cost, family)
    assert found is not None and found.cost == pytest.approx(5.0)
    for v in family:
        assert all(v.low <= one[v.name] <= v.high for one in seen)


def test_a_start_is_gone_on_from_without_a_grid() -> None:
    seen: list[Mapping[str, float]] = []

    def cost(values: Mapping[str, float]) -> float:
        seen.append(values)
        return valley(values)

    found = search.best(cost, BOX, [{"a": 15.0, "b": 0.5, "k": 2.0}])
    assert found is not None and found.cost == pytest.approx(1.0, abs=1e-2)
    assert {one["k"] for one in seen} == {2.0}


def test_where_nothing_can_be_played_nothing_is_found() -> None:
    assert search.best(lambda values: np.inf, BOX) is None


def test_cma_es_finds_the_least_of_a_large_box_and_does_so_again() -> None:
    pytest.importorskip("cma")
    centre = {f"x{k}": 0.3 + 0.1 * k for k in range(6)}
    family = tuple(Variable(name, 0.0, 1.0) for name in centre)

    def cost(values: Mapping[str, float]) -> float:
        return 1 + sum((values[name] - c) ** 2 for name, c in centre.items())

    first, again = (search.best(cost, family, method="auto", seed=3) for _ in range(2))
    assert first == again
    assert first is not None and first.cost == pytest.approx(1.0, abs=1e-3)


def test_without_cma_es_the_simplex_is_used_unless_it_was_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    family = tuple(Variable(f"x{k}", 0.0, 1.0) for k in range(6))
    monkeypatch.setattr(search, "installed", lambda: False)
    monkeypatch.setitem(sys.modules, "cma", None)
    found = search.best(lambda values: 1 + sum(values.values()), family)
    assert found is not None and found.cost == pytest.approx(1.0)
    with pytest.raises(InputError, match=r"needs the package cma; install insenv\[design\], or use 'simplex'"):
        search.best(lambda values: 1 + sum(values.values()), family, method="cma")


def test_an_unknown_search_is_refused() -> None:
    with pytest.raises(InputError, match=r"search 'newton' given; wanted one of auto, grid, simplex, cma"):
        search.best(valley, BOX, method="newton")


@dataclass(frozen=True)
class Made:
    """A kind whose deviation is (2 - x) / sqrt(T), x up to 1, which must last longer than 3 s."""

    step: float = 0.5
    tried: list[float] = field(default_factory=list)

    def families(self) -> tuple[Family, ...]:
        return ((Variable("x", 0.0, 0.5),), (Variable("x", 0.0, 1.0), Variable("y", 0.0, 1.0)))

    def plan(self, values: Mapping[str, float], time: float) -> Plan | None:
        self.tried.append(time)
        return Plan(time, (), {}, "", values) if time > 3 else None

    def sd(self, plan: Plan) -> float:
        return float((2 - plan.values["x"]) * plan.time**-0.5)


def designer() -> Designer:
    kind: Any = Made()
    return Designer(kind)


def test_the_better_family_is_chosen() -> None:
    point = designer().at(100.0)
    assert point is not None and point.sd == pytest.approx(0.1, rel=1e-3)


def test_the_least_time_is_the_first_step_that_reaches_what_is_demanded() -> None:
    # 1 / sqrt(T) <= 0.25 from 16 s on; steps are of half a second.
    point = designer().least_time(0.25001, 0.5, 1000.0)
    assert point is not None and point.time == 16.0
    assert designer().least_time(0.01, 0.5, 1000.0) is None


def test_every_time_that_is_searched_is_a_whole_number_of_steps() -> None:
    kind = Made()
    anything: Any = kind
    one = Designer(anything)
    one.front(times(4.0, 100.0, 5))
    assert kind.tried and all(t % 0.5 == 0 for t in kind.tried)


def test_a_front_holds_what_nothing_beats() -> None:
    def point(time: float, sd: float) -> Point:
        return Point(Plan(time, (), {}, ""), sd)

    points = [point(3, 1.0), point(1, 3.0), point(2, 3.5), point(4, 1.0), point(5, 0.5)]
    assert [p.time for p in nondominated(points)] == [1, 3, 5]
    near = [point(t, 1 / t) for t in (10, 10.1, 10.2, 20)]
    assert [p.time for p in thinned(near, [near[2]])] == [10.2, 20]
    assert [p.time for p in thinned(near, [])] == [10, 20]
