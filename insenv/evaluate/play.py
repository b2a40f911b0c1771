"""The part of `insenv.evaluate.evaluation` that plays runs: estimators under one policy.

The simulator has a process of its own, and the plug-ins another, which never holds the truth.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from typing import Any

from insenv.core.compiled import hurry
from insenv.core.errors import InputError
from insenv.core.estimate import Policy
from insenv.core.recording import Recording
from insenv.envs.rollout import Progress, RollOut, made, roll_out
from insenv.envs.task import Task
from insenv.evaluate.bounds import bounds
from insenv.evaluate.child import Say
from insenv.evaluate.panel import EstimatorFaultError, Member, Panel, errors, member, panel
from insenv.evaluate.remote import Apart, Stage
from insenv.evaluate.runs import Table, table_of, task_of
from insenv.scenario import load


@dataclass(frozen=True)
class Work:
    """Runs to play.

    Attributes
    ----------
    scenario, changes : str
        Its name or path; other values of its entries, as JSON.
    estimators : tuple of str
    policy : str
    first, count : int
        Seeds.
    every : int
        Steps after which the estimators are asked.
    bound : bool
        Whether to compute the bounds, too.
    """

    scenario: str
    estimators: tuple[str, ...]
    policy: str
    first: int
    count: int
    changes: str = "{}"
    every: int = 1
    bound: bool = False

    @property
    def seeds(self) -> range:
        """Of the runs."""
        return range(self.first, self.first + self.count)


@dataclass(frozen=True)
class PlayedRuns:
    """What the runs gave of one estimator.

    Attributes
    ----------
    table : dict of str to ndarray, shape (R,)
        See `insenv.evaluate.runs.episodes`.
    cpu, cpu_estimator : float
        Of all the runs as if this estimator were alone in them, and of the estimator [s].
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


#: By estimator: what its runs gave, or why there is nothing, in a sentence.
Answers = dict[str, PlayedRuns | str]


class _LookedError(Exception):
    """The policy looks at estimates: its runs are others for each estimator."""


def play(work: Work, say: Say) -> Answers:
    """Play the runs, the plug-ins in another process: once for all estimators where the policy looks at no estimate.

    Raises
    ------
    InputError
        If the scenario cannot be used.
    """
    say("its import", 0.0)
    with closing(Apart()) as stage:
        stage.load(work.estimators, work.policy)
        return play_on(stage, work, say)


def play_on(stage: Stage, work: Work, say: Say) -> Answers:
    """As `play`, the plug-ins wherever they are."""
    task = task_of(work.scenario, json.loads(work.changes))
    faults: dict[str, str] = {}
    members = []
    for name in work.estimators:
        say(f"estimator {name!r} before any data", 0.0)
        try:
            members.append(member(name, task, stage))
        except InputError as error:
            faults[name] = str(error)
    return faults | _shared(stage, work, task, members, say)


def _shared(stage: Stage, work: Work, task: Task, members: Sequence[Member], say: Say) -> Answers:
    """Of estimators that were made, on runs that are simulated once if that can be."""
    try:
        return _together(stage, work, task, members, say) if members else {}
    except _LookedError:
        found = (_shared(stage, work, task, [one], say) for one in members)
        return {name: answer for each in found for name, answer in each.items()}
    except EstimatorFaultError as error:
        rest = [one for one in members if one.name != error.estimator]
        return {error.estimator: str(error)} | _shared(stage, work, task, rest, say)
    except InputError as error:
        return {one.name: str(error) for one in members}


def _together(stage: Stage, work: Work, task: Task, members: Sequence[Member], say: Say) -> Answers:
    """One simulation for all.

    Raises
    ------
    _LookedError
        If the policy looks at an estimate, and there are several.
    FaultError
        If an estimator fails.
    InputError
        If the policy fails.
    """
    watched: Any = made(work.policy, task.datasheet, stage.policy(work.policy))
    where, share = f"step 1 of policy {work.policy!r}", 0.0

    def tell(name: str) -> None:
        say(f"{where}, estimator {name!r}" if name else where, share)

    def progress(done: int, total: int) -> None:
        nonlocal where, share
        if watched.looked and len(members) > 1:
            raise _LookedError
        where, share = f"step {done * task.steps // total + 1} of policy {work.policy!r}", done / total
        say(where, share)

    judge = panel(members, tell)
    try:
        return _rolled(stage, work, replace(task, quantities=judge.quantities, judge=judge), watched, progress)
    except InputError as error:
        if watched.looked and len(members) > 1 and not isinstance(error, EstimatorFaultError):
            raise _LookedError from error
        raise


def _rolled(stage: Stage, work: Work, task: Task, policy: Policy, progress: Progress) -> Answers:
    """The runs, with the CPU time of each estimator; the first one once more for its motion where bounds are wanted."""
    judge = task.judge
    assert isinstance(judge, Panel)
    # What is compiled and read at first is no part of the time.
    hurry()
    roll_out(replace(task, steps=1), policy, None, work.seeds[:1], keep=False)
    for one in judge.members:
        one.timed.cpu = 0.0
    began = time.process_time() + stage.cpu
    played = roll_out(task, policy, None, work.seeds, keep=False, every=work.every, progress=progress)
    spent, own = time.process_time() + stage.cpu - began, [one.timed.cpu for one in judge.members]
    first = None
    if work.bound:
        first = roll_out(task, policy, None, work.seeds[:1], every=work.every, progress=progress).recording(0)
    return {
        one.name: PlayedRuns(table, spent - sum(own) + cpu, cpu, _units(one), _least(work, task, first, one))
        for one, table, cpu in zip(judge.members, _tables(work, judge, played), own, strict=True)
    }


def _tables(work: Work, judge: Panel, played: RollOut) -> list[Table]:
    assert played.estimate is not None
    ended = (played.time, played.stopped)
    return [
        table_of(work.seeds, estimate, played.truth, errors(one, estimate, played.truth), ended)
        for one, estimate in zip(judge.members, judge.split(played.estimate), strict=True)
    ]


def _units(one: Member) -> dict[str, str]:
    return dict(zip(one.prior.names, one.prior.units, strict=True))


def _least(work: Work, task: Task, run: Recording | None, one: Member) -> dict[str, float]:
    if run is None:
        return {}
    names = tuple(q.name for q in one.judge.quantities)
    return bounds(task.datasheet, run, names, load(work.scenario, json.loads(work.changes)))
