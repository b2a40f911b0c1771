"""A line of the bench's table, and how its times are taken."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median


@dataclass(frozen=True)
class Line:
    """A row of the table: what was measured, its bar, and the alternative, all as texts but the ratio."""

    work: str
    found: str
    bar: str
    alternative: str
    beside: str
    ratio: float | None


def cpu(work: Callable[[], object], runs: int) -> float:
    """Median CPU time of ``work`` [s]; the first run, which compiles and fills caches, is left out."""
    work()
    spent = []
    for _ in range(runs):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return median(spent)
