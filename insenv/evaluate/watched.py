"""Plug-ins, watched: the CPU time of an estimator, and whether a policy looks at an estimate.

What a policy never looks at cannot change what it does; see `insenv.evaluate.panel`. Nothing here knows a simulator.
"""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

from insenv.core.estimate import Estimate, Estimator, Policy
from insenv.core.recording import Floats, Recording


class Timed:
    """An estimator, and the CPU time of its calls; it gets a copy of each chunk, so that nobody else sees it change."""

    def __init__(self, estimator: Estimator) -> None:
        self.estimator, self.cpu = estimator, 0.0

    def _taken(self, method: str, *given: Any) -> Any:
        began = time.process_time()
        try:
            return getattr(self.estimator, method)(*given)
        finally:
            self.cpu += time.process_time() - began

    def reset(self, batch: int | None = None) -> Any:
        """As of the estimator."""
        return self._taken("reset", batch)

    def update(self, state: Any, chunk: Recording) -> Any:
        """As of the estimator."""
        return self._taken("update", state, copied(chunk))

    def estimate(self, state: Any) -> Estimate:
        """As of the estimator."""
        found: Estimate = self._taken("estimate", state)
        return found


class Watched:
    """A policy, and whether it ever looked at an estimate (``looked``)."""

    def __init__(self, name: str, policy: Policy) -> None:
        self.name, self.policy, self.looked = name, policy, False

    def reset(self, batch: int | None = None) -> Any:
        """As of the policy."""
        return self.policy.reset(batch)

    def act(self, state: Any, chunk: Recording | None, estimate: Estimate | None) -> tuple[Floats, Any]:
        """As of the policy."""
        noted = None if estimate is None else _Noted(estimate.names, estimate.units, estimate.mean, estimate.cov)
        if noted is not None:
            object.__setattr__(noted, "watched", self)
        return self.policy.act(state, chunk, noted)


class _Noted(Estimate):
    """An estimate that says so to its ``watched`` policy when anything of it is looked at."""

    def __getattribute__(self, name: str) -> Any:
        watched = object.__getattribute__(self, "__dict__").get("watched")
        if watched is not None:
            watched.looked = True
        return object.__getattribute__(self, name)


def copied(chunk: Recording) -> Recording:
    """The same in arrays of its own."""
    channels = {name: replace(channel, values=channel.values.copy("K")) for name, channel in chunk.channels.items()}
    return replace(chunk, t=chunk.t.copy(), channels=channels)
