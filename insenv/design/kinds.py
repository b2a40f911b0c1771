"""The kinds of task that are designed, by the name that a scenario's ``[task]`` gives them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from insenv.design.free import Free
from insenv.design.kind import Kind
from insenv.design.north_finder import NorthFinder
from insenv.design.rate_table import RateTable, ScaleFactorTest
from insenv.design.two_position import TwoPosition
from insenv.scenario import Scenario

KINDS: Mapping[str, Callable[[Scenario, Free], Kind]] = {
    "north-finder": NorthFinder,
    "two-position": TwoPosition,
    "rate-table": RateTable,
    "scale-factor-test": ScaleFactorTest,
}
