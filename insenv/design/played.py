"""Procedures played: Monte Carlo with an estimator, and what an effect that nobody told of does to the same runs.

Every procedure is played in its environment on the same seeds. The influence of an effect is the difference between two
plays of the same run, with and without it: the noise is the same, so that a few runs tell it.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from insenv.core.attitude import wrapped
from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.design.free import added
from insenv.design.kind import DesignedQuantity, Plan
from insenv.envs.follow import Follow, profile_actions
from insenv.envs.rollout import roll_out
from insenv.evaluate.runs import Table, table_of, task_of
from insenv.evaluate.scores import QuantityScore, score
from insenv.scenario import load
from insenv.sweep import backend, sweep

#: Runs that tell an effect's influence.
FEW = 8
#: Runs of a piece of work.
_TOGETHER = 16

Say = Callable[[str], None]


@dataclass(frozen=True)
class Play:
    """A job of `insenv.sweep`: a scenario's profile played for seeds, with an estimator asked at the end.

    Attributes
    ----------
    scenario, changes : str
        Name or path; other values of its entries, as JSON.
    estimator : str
    quantity : str
    circular : bool
        Whether its errors are wrapped.
    moved : float
        As of `insenv.design.kind.Plan`.
    """

    scenario: str
    changes: str
    estimator: str
    quantity: str
    circular: bool = False
    moved: float = 0.0

    def __call__(self, seeds: Sequence[int]) -> Table:
        """A row for each seed; as of `insenv.evaluate.runs.table_of`.

        Raises
        ------
        InputError
            If the estimator does not tell the quantity, or the environment does not know the truth of it.
        """
        changes = json.loads(self.changes)
        task = task_of(self.scenario, changes)
        actions = profile_actions(load(self.scenario, changes), task)
        played = roll_out(task, Follow(actions), self.estimator, list(seeds), keep=False, every=task.steps)
        assert played.estimate is not None
        if self.quantity not in played.estimate.names or self.quantity not in played.truth:
            told = ", ".join(played.estimate.names)
            raise InputError(f"estimator {self.estimator!r} tells {told}; wanted {self.quantity} of {task.name}")
        mean, _ = played.estimate.of(self.quantity)
        error = mean - played.truth[self.quantity] - self.moved
        if self.circular:
            error = wrapped(error)
        return table_of(
            list(seeds), played.estimate, played.truth, {self.quantity: error}, (played.time, played.stopped)
        )


@dataclass(frozen=True)
class PlayedCheck:
    """A procedure in Monte Carlo.

    Attributes
    ----------
    procedure, estimator : str
    runs : int
    time : float
        [s]
    score : QuantityScore
        With the bound.
    """

    procedure: str
    estimator: str
    runs: int
    time: float
    score: QuantityScore


@dataclass(frozen=True)
class Influence:
    """What an effect does to the estimate of each procedure: mean and root mean square over runs [SI].

    Attributes
    ----------
    effect : mapping
        As listed.
    procedures : mapping of str to pair of float
    """

    effect: Mapping[str, Any]
    procedures: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class PlayStage:
    """Where procedures are played.

    Attributes
    ----------
    scenario : str
    quantity : DesignedQuantity
    jobs : int
        Processes at a time.
    """

    scenario: str
    quantity: DesignedQuantity
    jobs: int = 1

    def table(self, plan: Plan, estimator: str, seeds: range, more: Mapping[str, Any] | None = None) -> Table:
        """The runs ``seeds`` of a procedure; ``more`` changes the scenario further."""
        changes = json.dumps({**plan.changes, **(more or {})})
        job = Play(self.scenario, changes, estimator, self.quantity.name, self.quantity.circular, plan.moved)
        each = max(1, min(_TOGETHER, -(-len(seeds) // self.jobs)))
        store = sweep(job, seeds.start, len(seeds), None, backend(self.jobs), each)
        parts = list(store.parts())
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def check(self, name: str, plan: Plan, estimator: str, seeds: range, bound: float | None) -> PlayedCheck:
        """Monte Carlo of a procedure."""
        table = self.table(plan, estimator, seeds)
        scored = score(table, self.quantity.name, self.quantity.unit, bound)
        return PlayedCheck(name, estimator, len(seeds), plan.time, scored)

    def influences(
        self,
        plans: Mapping[str, Plan],
        estimator: str,
        effects: Sequence[Mapping[str, Any]],
        say: Say = lambda text: None,
        runs: int = FEW,
    ) -> tuple[Influence, ...]:
        """What each effect does to each procedure; without a counter of pulses, which would answer by chance."""
        seeds, name = range(runs), f"error.{self.quantity.name}"
        found: list[dict[str, tuple[float, float]]] = [{} for _ in effects]
        counted = load(self.scenario).table.instrument.gyro.pulses
        smooth: dict[str, Any] = {"instrument.gyro.pulses": False} if counted else {}
        for procedure, plan in plans.items():
            without = self.table(plan, estimator, seeds, smooth)[name]
            for known, effect in zip(found, effects, strict=True):
                say(f"what {effect['effect']} does to the {procedure} procedure")
                with_it = self.table(plan, estimator, seeds, smooth | added(self.scenario, effect))[name]
                known[procedure] = _moved(with_it - without, self.quantity.circular)
        return tuple(Influence(dict(e), known) for e, known in zip(effects, found, strict=True))


def _moved(difference: Floats, circular: bool) -> tuple[float, float]:
    if circular:
        difference = wrapped(difference)
    return float(difference.mean()), float(np.sqrt(np.mean(difference**2)))
