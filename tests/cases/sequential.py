"""Counting with an early end: whether events are rare enough, by Wald's sequential probability ratio test.

Trials are made one after another until the counts so far decide between two shares of events,

    L = sum log(p(x; bad) / p(x; good)),        stop where L <= log(miss / (1 - alarm)) or L >= log((1 - miss) / alarm)

A procedure whose events have the share ``good`` is then refused with a probability of about ``alarm`` at most, one
with the share ``bad`` is accepted with about ``miss`` at most, as by a fixed number of trials, with a half to a third
of the trials where the share is good. Source: Wald, Ann. Math. Stat. 16 (1945) 117.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import log


@dataclass(frozen=True)
class Shares:
    """Shares of events that are good and bad, and the probabilities of a false alarm and of a miss."""

    good: float
    bad: float
    alarm: float
    miss: float

    def accept(self, events: Iterable[bool]) -> bool:
        """Whether the events, one for each trial, speak for the good share; no more trials are made than decide it.

        Raises
        ------
        AssertionError
            If the trials end before it is decided.
        """
        ratio = 0.0
        for event in events:
            ratio += log(self.bad / self.good) if event else log((1 - self.bad) / (1 - self.good))
            if ratio <= log(self.miss / (1 - self.alarm)):
                return True
            if ratio >= log((1 - self.miss) / self.alarm):
                return False
        raise AssertionError("so few trials decide nothing")
