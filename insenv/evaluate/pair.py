"""The part of `insenv.evaluate.evaluation` that plays runs: one estimator under one policy, in a process of its own."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, field, replace
from typing import Any

from insenv.core.errors import InputError
from insenv.core.estimate import Estimate, Estimator
from insenv.core.recording import Recording
from insenv.envs.belief import judge
from insenv.envs.rollout import roll_out
from insenv.envs.task import Task
from insenv.evaluate.bounds import bounds
from insenv.evaluate.child import Say
from insenv.evaluate.runs import Table, table_of, task_of


@dataclass(frozen=True)
class Pair:
    """Runs to play.

    Attributes
    ----------
    scenario, changes : str
        Its name or path; other values of its entries, as JSON.
    estimator, policy : str
    first, count : int
        Seeds.
    every : int
        Steps after which the estimator is asked.
    bound : bool
        Whether to compute the bounds, too.
    """

    scenario: str
    estimator: str
    policy: str
    first: int
    count: int
    changes: str = "{}"
    every: int = 1
    bound: bool = False


@dataclass(frozen=True)
class Played:
    """What the runs gave.

    Attributes
    ----------
    table : dict of str to ndarray, shape (R,)
        See `insenv.evaluate.runs.episodes`.
    cpu, cpu_estimator : float
        Of all the runs, and of the estimator alone in them [s].
    units : dict of str to str
        SI unit of each quantity of the estimate.
    bounds : dict of str to float
        Least standard deviations.
    """

    table: Table
    cpu: float
    cpu_estimator: float
    units: dict[str, str]
    bounds: dict[str, float] = field(default_factory=dict)


class _Timed:
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
        return self._taken("reset", batch)

    def update(self, state: Any, chunk: Recording) -> Any:
        return self._taken("update", state, chunk)

    def estimate(self, state: Any) -> Estimate:
        found: Estimate = self._taken("estimate", state)
        return found


def play(pair: Pair, say: Say) -> Played:
    """Play the runs.

    Raises
    ------
    InputError
        If a plug-in fails, or the estimator tells nothing of what the task asks for.
    """
    say("its import", 0.0)
    task, timed, units = _asked(pair)
    seeds = range(pair.first, pair.first + pair.count)
    least: dict[str, float] = {}
    who = f"policy {pair.policy!r} and estimator {pair.estimator!r}"
    say(f"step 1 of {who}", 0.0)

    def progress(done: int, total: int) -> None:
        say(f"step {done * task.steps // total + 1} of {who}", done / total)

    # What is compiled and read at first is no part of the time.
    roll_out(replace(task, steps=1), pair.policy, None, seeds[:1], keep=False)
    timed.cpu, began = 0.0, time.process_time()
    played = roll_out(task, pair.policy, None, seeds, keep=False, every=pair.every, progress=progress)
    cpu, cpu_estimator = time.process_time() - began, timed.cpu
    if pair.bound:
        one = roll_out(task, pair.policy, None, seeds[:1], progress=progress)
        least = bounds(task.datasheet, one.recording(0), one.names)
    assert played.estimate is not None
    errors = dict(zip(played.names, played.errors.T, strict=True))
    table = table_of(seeds, played.estimate, played.truth, errors, (played.time, played.stopped))
    return Played(table, cpu, cpu_estimator, units, least)


def _asked(pair: Pair) -> tuple[Task, _Timed, dict[str, str]]:
    """The task, judged by the estimator."""
    task = task_of(pair.scenario, json.loads(pair.changes))
    watched = judge(pair.estimator, task.datasheet, ())
    prior = watched.estimate(watched.begin(1), 1)
    quantities = tuple(q for q in task.quantities if q.name in prior.names)
    if not quantities:
        wanted = ", ".join(q.name for q in task.quantities) or "nothing: it cannot be evaluated"
        raise InputError(f"estimator {pair.estimator!r} tells {', '.join(prior.names)}; {task.name} asks for {wanted}")
    timed = _Timed(watched.estimator)
    judged = replace(watched, estimator=timed, quantities=quantities)
    return replace(task, quantities=quantities, judge=judged), timed, dict(zip(prior.names, prior.units, strict=True))
