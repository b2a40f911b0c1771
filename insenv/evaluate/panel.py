"""Estimators side by side on the same runs, and whether the policy that plays them looks at an estimate.

What a policy never looks at cannot change what it does: runs under a policy that goes by the clock, or by what is
measured, are the same runs whichever estimator is beside. They are simulated once, and all estimators are given them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Estimate
from insenv.core.recording import Floats, Recording
from insenv.envs.belief import Judge, judge
from insenv.envs.task import Task
from insenv.evaluate.remote import Stage


class EstimatorFaultError(InputError):
    """What an estimator did wrong; ``estimator`` is its name."""

    def __init__(self, estimator: str, text: str) -> None:
        super().__init__(text)
        self.estimator = estimator


@dataclass(frozen=True)
class Member:
    """An estimator of a panel.

    Attributes
    ----------
    judge : Judge
        Asked for what both the task wants and the estimator tells.
    prior : Estimate
        Of one run, before any data.
    timed : object
        The estimator, with ``cpu``, the time of its calls [s].
    """

    judge: Judge
    prior: Estimate
    timed: Any

    @property
    def name(self) -> str:
        """Of the plug-in."""
        return self.judge.name


def member(name: str, task: Task, stage: Stage) -> Member:
    """An estimator by name, for a task, where it is played.

    Raises
    ------
    InputError
        If it cannot be made, or tells nothing of what the task asks for.
    """
    watched = judge(name, task.datasheet, (), stage.estimator(name))
    prior = watched.estimate(watched.begin(1), 1)
    quantities = tuple(q for q in task.quantities if q.name in prior.names)
    if not quantities:
        wanted = ", ".join(q.name for q in task.quantities) or "nothing: it cannot be evaluated"
        raise InputError(f"estimator {name!r} tells {', '.join(prior.names)}; {task.name} asks for {wanted}")
    return Member(replace(watched, quantities=quantities), prior, watched.estimator)


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
        """States after a chunk."""
        return tuple(self._each(lambda one, own: one.judge.update(own, chunk), state))

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
                raise EstimatorFaultError(one.name, str(error)) from error
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
