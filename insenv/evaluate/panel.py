"""Estimators side by side on the same runs, and whether the policy that plays them looks at an estimate.

What a policy never looks at cannot change what it does: runs under a policy that goes by the clock, or by what is
measured, are the same runs whichever estimator is beside. They are simulated once, and all estimators are given them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Estimate, Estimator, Policy
from insenv.core.recording import Floats, Recording
from insenv.envs.belief import Judge, judge
from insenv.envs.task import Task


class FaultError(InputError):
    """What an estimator did wrong; ``estimator`` is its name."""

    def __init__(self, estimator: str, text: str) -> None:
        super().__init__(text)
        self.estimator = estimator


class Timed:
    """An estimator, and the CPU time of its calls."""

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
        return self._taken("update", state, chunk)

    def estimate(self, state: Any) -> Estimate:
        """As of the estimator."""
        found: Estimate = self._taken("estimate", state)
        return found


@dataclass(frozen=True)
class Member:
    """An estimator of a panel.

    Attributes
    ----------
    judge : Judge
        Asked for what both the task wants and the estimator tells.
    prior : Estimate
        Of one run, before any data.
    timed : Timed
    """

    judge: Judge
    prior: Estimate
    timed: Timed

    @property
    def name(self) -> str:
        """Of the plug-in."""
        return self.judge.name


def member(name: str, task: Task) -> Member:
    """An estimator by name, for a task.

    Raises
    ------
    InputError
        If it cannot be made, or tells nothing of what the task asks for.
    """
    watched = judge(name, task.datasheet, ())
    prior = watched.estimate(watched.begin(1), 1)
    quantities = tuple(q for q in task.quantities if q.name in prior.names)
    if not quantities:
        wanted = ", ".join(q.name for q in task.quantities) or "nothing: it cannot be evaluated"
        raise InputError(f"estimator {name!r} tells {', '.join(prior.names)}; {task.name} asks for {wanted}")
    timed = Timed(watched.estimator)
    return Member(replace(watched, estimator=timed, quantities=quantities), prior, timed)


@dataclass(frozen=True)
class Panel(Judge):
    """Several estimators as one: their states and estimates side by side.

    The first one's quantities have their own names and are what is believed; those of the others are numbered.

    Attributes
    ----------
    members : tuple of Member
    tell : callable
        Told which estimator is about to work; "" after the last one.
    """

    members: tuple[Member, ...] = ()
    tell: Callable[[str], None] = lambda name: None

    def begin(self, batch: int) -> Any:
        """States before any data."""
        return tuple(self._each(lambda one, _: one.judge.begin(batch), [None] * len(self.members)))

    def update(self, state: Any, chunk: Recording) -> Any:
        """States after a chunk, of which each estimator has a copy: what one does to it the others do not see."""
        return tuple(self._each(lambda one, own: one.judge.update(own, _copy(chunk)), state))

    def estimate(self, state: Any, batch: int) -> Estimate:
        """All estimates, side by side."""
        found = self._each(lambda one, own: _sound(one, one.judge.estimate(own, batch)), state)
        names = [_numbered(k, name) for k, one in enumerate(found) for name in one.names]
        cov = np.zeros((batch, len(names), len(names)))
        for part, one in zip(self._places(), found, strict=True):
            cov[:, part, part] = one.cov
        units = tuple(unit for one in found for unit in one.units)
        return Estimate(tuple(names), units, np.concatenate([one.mean for one in found], axis=-1), cov)

    def split(self, estimate: Estimate) -> list[Estimate]:
        """The estimates of the members."""
        return [
            Estimate(one.prior.names, one.prior.units, estimate.mean[:, part], estimate.cov[:, part, part])
            for part, one in zip(self._places(), self.members, strict=True)
        ]

    def _places(self) -> list[slice]:
        edges = np.cumsum([0, *(len(one.prior.names) for one in self.members)]).tolist()
        return [slice(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True)]

    def _each(self, work: Callable[[Member, Any], Any], states: Sequence[Any]) -> list[Any]:
        found = []
        for one, state in zip(self.members, states, strict=True):
            self.tell(one.name)
            try:
                found.append(work(one, state))
            except InputError as error:
                raise FaultError(one.name, str(error)) from error
        self.tell("")
        return found


def panel(members: Sequence[Member], tell: Callable[[str], None]) -> Panel:
    """Of these, one or more."""
    first = members[0].judge
    return Panel(first.name, first.estimator, first.quantities, tuple(members), tell)


def errors(one: Member, estimate: Estimate, truth: Mapping[str, Floats]) -> dict[str, Floats]:
    """Of what the task asks for, wrapped on a circle, each of shape (R,)."""
    means, _ = one.judge.belief(estimate)
    return {q.name: q.error(means[:, j], truth[q.name]) for j, q in enumerate(one.judge.quantities)}


def _sound(one: Member, estimate: Estimate) -> Estimate:
    """An estimate that can be used.

    Raises
    ------
    InputError
        If it says NaN, or tells other quantities than before any data.
    """
    if estimate.names != one.prior.names:
        told, known = ", ".join(estimate.names), ", ".join(one.prior.names)
        raise InputError(f"estimator {one.name!r} tells {told}; wanted {known}, as before any data")
    if not (np.isfinite(estimate.mean).all() and np.isfinite(estimate.cov).all()):
        one.judge.belief(
            estimate
        )  # which says what cannot be used; a quantity that nobody asks for may be without bound
    return estimate


def _numbered(k: int, name: str) -> str:
    return f"{k}:{name}" if k else name


def _copy(chunk: Recording) -> Recording:
    channels = {name: replace(channel, values=channel.values.copy("K")) for name, channel in chunk.channels.items()}
    return replace(chunk, t=chunk.t.copy(), channels=channels)


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
