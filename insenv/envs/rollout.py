"""Many runs of a task under a policy, with an estimator beside: the loop that a user would write."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import gymnasium
import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate, Policy
from insenv.core.plugins import POLICIES, find
from insenv.core.recording import Floats, Recording
from insenv.core.rows import row_of, rows
from insenv.envs.batch import Batch, RowsPart, going_on
from insenv.envs.belief import judge
from insenv.envs.group import Flags, Index
from insenv.envs.recorder import joined
from insenv.envs.single import TaskEnv
from insenv.envs.task import Task, checked
from insenv.envs.vector import TaskVectorEnv

#: Runs that are stepped together: calls cost as much as the arrays of so many, and larger ones leave the cache.
TOGETHER = 320

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class RollOut:
    """What R runs of at most K steps gave.

    Attributes
    ----------
    seeds : tuple of int
    names : tuple of str
        The q quantities of interest.
    truth : mapping of str to ndarray, shape (R,)
        At the end of each run.
    errors : ndarray, shape (R, q)
        Of the last belief; wrapped where the quantity is an angle on the circle.
    means, deviations : ndarray, shape (R, K + 1, q)
        Belief at the start and after each step; NaN where there was none, and after the end of a run.
    estimate : Estimate, optional
        The last one of every run, all that the estimator tells; None without one.
    reward : ndarray, shape (R,)
        Sum over the run.
    time : ndarray, shape (R,)
        Used [s].
    stopped : ndarray of bool, shape (R,)
        Whether the policy stopped the run; else its time was up.
    chunks : tuple of (ndarray, Recording)
        Rows and what they recorded, step by step; empty where it was not kept.
    """

    seeds: tuple[int, ...]
    names: tuple[str, ...]
    truth: Mapping[str, Floats]
    errors: Floats
    means: Floats
    deviations: Floats
    estimate: Estimate | None
    reward: Floats
    time: Floats
    stopped: Flags
    chunks: tuple[tuple[Index, Recording], ...] = ()

    def recording(self, row: int) -> Recording:
        """What run ``row`` recorded.

        Raises
        ------
        InputError
            If nothing was kept of it.
        """
        own = [row_of(chunk, int(at[0])) for index, chunk in self.chunks if len(at := np.flatnonzero(index == row))]
        return joined(own, f"seed {self.seeds[row]}")


def roll_out(
    environment: Task | gymnasium.Env[Any, Any] | gymnasium.vector.VectorEnv[Any, Any, Any],
    policy: str | Policy,
    estimator: str | None = None,
    seeds: Sequence[int] = (0,),
    *,
    keep: bool = True,
    every: int = 1,
    progress: Progress | None = None,
) -> RollOut:
    """Play the runs ``seeds``.

    Parameters
    ----------
    environment : Task or environment
        Of an environment its task is taken; wrappers and runs that have begun are left alone.
    policy : str or Policy
        Name of a plug-in, or one that is made.
    estimator : str, optional
        Name of a plug-in; the environment's own where none is named.
    seeds : sequence of int
    keep : bool
        Whether to keep the recordings: 16 bytes a sample and more.
    every : int
        Ask the estimator after so many steps, and at the end: where estimates cost more than the simulation. The
        policy is given the last one that was made.
    progress : callable, optional
        Called with the steps of all runs that are done, and their most.

    Raises
    ------
    InputError
        If a plug-in fails or an action cannot be used.
    """
    task = replace(_with_estimator(_task(environment), estimator), every=_whole(every))
    player = _player(policy, task)
    if not len(seeds):
        raise InputError("no seed given to roll_out; wanted at least one")
    total = len(seeds) * task.steps
    played = []
    for start in range(0, len(seeds), TOGETHER):
        some = tuple(seeds[start : start + TOGETHER])
        before = start * task.steps
        tell = None if progress is None else _shifted(progress, before, total)
        played.append(_play(task, player, some, keep, tell))
    return played[0] if len(played) == 1 else _stacked(played)


@dataclass(frozen=True)
class _Player:
    """A policy by name, watched."""

    name: str
    policy: Policy

    def begin(self, batch: int) -> Any:
        return self._answer("reset", self.policy.reset, batch)

    def act(self, state: Any, chunk: Recording | None, estimate: Estimate | None) -> tuple[Any, Any]:
        answer = self._answer("act", self.policy.act, state, chunk, estimate)
        if not isinstance(answer, tuple) or len(answer) != 2:
            raise InputError(f"policy {self.name!r} returned a {type(answer).__name__}; wanted an action and a state")
        return answer

    def usable(self, task: Task, action: Any, batch: int) -> Floats:
        try:
            return checked(task, action, batch)
        except InputError as error:
            raise InputError(f"policy {self.name!r}: {error}") from None

    def _answer(self, method: str, call: Callable[..., Any], *given: Any) -> Any:
        try:
            return call(*given)
        except Exception as error:
            text = " ".join(str(error).split()) or "no message"
            raise InputError(f"policy {self.name!r} failed in {method}: {type(error).__name__}: {text}") from error


class _Log:
    """What the runs of one batch leave behind."""

    def __init__(self, task: Task, seeds: tuple[int, ...], first: RowsPart, keep: bool) -> None:
        batch, q = len(seeds), first.group.means.shape[1]
        self.task, self.seeds, self.first, self.keep = task, seeds, first, keep
        self.means = np.full((batch, task.steps + 1, q), np.nan)
        self.deviations = np.full((batch, task.steps + 1, q), np.nan)
        self.means[:, 0], self.deviations[:, 0] = first.group.means, first.group.deviations
        self.reward, self.time = np.zeros(batch), np.zeros(batch)
        self.stopped = np.zeros(batch, bool)
        self.chunks: list[tuple[Index, Recording]] = []
        estimate = first.group.estimate
        self.truth = {name: values.copy() for name, values in first.group.truth.items()}
        self.estimate = estimate and replace(estimate, mean=estimate.mean.copy(), cov=estimate.cov.copy())

    def add(self, part: RowsPart) -> None:
        group, index = part.group, part.index
        self.reward[index] += part.seen.reward
        self.time[index] = group.passed * self.task.step_s
        self.stopped[index] = part.terminated
        if group.believed == group.passed:
            self.means[index, group.passed] = group.means
            self.deviations[index, group.passed] = group.deviations
        if self.estimate is not None and group.estimate is not None and (part.terminated or part.truncated):
            self.estimate.mean[index], self.estimate.cov[index] = group.estimate.mean, group.estimate.cov
        if part.terminated or part.truncated:
            for name, values in group.truth.items():
                self.truth[name][index] = values
        if self.keep and part.seen.chunk is not None:
            self.chunks.append((index, part.seen.chunk))

    def closed(self) -> RollOut:
        quantities = self.task.quantities if self.task.judge is not None else ()
        last = np.rint(self.time / self.task.step_s).astype(int)
        final = self.means[np.arange(len(last)), last]
        errors = np.empty_like(final)
        for j, q in enumerate(quantities):
            errors[:, j] = q.error(final[:, j], self.truth[q.name])
        return RollOut(
            seeds=self.seeds,
            names=tuple(q.name for q in quantities),
            truth=self.truth,
            errors=errors,
            means=self.means,
            deviations=self.deviations,
            estimate=self.estimate,
            reward=self.reward,
            time=self.time,
            stopped=self.stopped,
            chunks=tuple(self.chunks),
        )


def _play(task: Task, player: _Player, seeds: tuple[int, ...], keep: bool, progress: Progress | None) -> RollOut:
    """Runs that are stepped together. None begins later, so that they stay one group until they stop."""
    batch = Batch(task, len(seeds))
    index: Index = np.arange(len(seeds))
    part = batch.begin(index, seeds)
    log = _Log(task, seeds, part, keep)
    state, chunk, estimate = player.begin(len(seeds)), None, part.group.estimate
    steps = 0
    while len(index):
        action, state = player.act(state, chunk, estimate)
        actions = np.zeros((len(seeds), *task.action_space.shape))
        actions[index] = player.usable(task, action, len(index))
        parts = batch.step(actions)
        for part in parts:
            log.add(part)
        chunk, estimate = going_on(parts)
        alive = batch.alive[index]
        if not alive.all():
            index, state = index[alive], rows(state, np.flatnonzero(alive))
        steps += 1
        if progress is not None:
            progress(len(seeds) * (steps if len(index) else task.steps), len(seeds) * task.steps)
    return log.closed()


def _whole(every: int) -> int:
    if isinstance(every, bool) or not isinstance(every, int) or every < 1:
        raise InputError(f"every = {every!r} given to roll_out; wanted a whole number of steps from 1")
    return every


def _shifted(progress: Progress, before: int, total: int) -> Progress:
    return lambda done, _: progress(before + done, total)


def _stacked(parts: Sequence[RollOut]) -> RollOut:
    """Roll-outs one after the other."""
    first = parts[0]
    starts = np.cumsum([0, *(len(part.seeds) for part in parts)])

    def stack(name: str) -> Any:
        return np.concatenate([getattr(part, name) for part in parts])

    estimate = first.estimate
    if estimate is not None:
        found = [part.estimate for part in parts if part.estimate is not None]
        estimate = replace(
            estimate, mean=np.concatenate([e.mean for e in found]), cov=np.concatenate([e.cov for e in found])
        )
    return RollOut(
        seeds=tuple(seed for part in parts for seed in part.seeds),
        names=first.names,
        truth={name: np.concatenate([part.truth[name] for part in parts]) for name in first.truth},
        errors=stack("errors"),
        means=stack("means"),
        deviations=stack("deviations"),
        estimate=estimate,
        reward=stack("reward"),
        time=stack("time"),
        stopped=stack("stopped"),
        chunks=tuple(
            (index + start, chunk) for start, part in zip(starts, parts, strict=False) for index, chunk in part.chunks
        ),
    )


def _task(environment: Any) -> Task:
    found = environment if isinstance(environment, Task) else getattr(environment, "unwrapped", environment)
    if isinstance(found, TaskEnv | TaskVectorEnv):
        found = found.task
    if not isinstance(found, Task):
        raise InputError(f"{environment} given to roll_out; wanted a task or one of insenv's environments")
    return found


def _with_estimator(task: Task, estimator: str | None) -> Task:
    if estimator is None:
        return task
    watched = judge(estimator, task.datasheet, ())
    prior = watched.estimate(watched.begin(1), 1)
    # Of what this estimator says nothing, nothing is rewarded: the levelling knows no north.
    quantities = tuple(q for q in task.quantities if q.name in prior.names)
    return replace(task, quantities=quantities, judge=replace(watched, quantities=quantities))


def made(policy: str, datasheet: Datasheet, plugin: Callable[[Datasheet], Policy] | None = None) -> Policy:
    """The policy of that name, told what the datasheet says; ``plugin`` makes it where it is not installed here.

    Raises
    ------
    InputError
        If it is not installed or cannot be made.
    """
    plugin = find(POLICIES, policy) if plugin is None else plugin
    try:
        found: Policy = plugin(datasheet)
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"policy {policy!r} failed when it was made: {type(error).__name__}: {error}") from error
    return found


def _player(policy: str | Policy, task: Task) -> _Player:
    if isinstance(policy, str):
        return _Player(policy, made(policy, task.datasheet))
    if not (callable(getattr(policy, "reset", None)) and callable(getattr(policy, "act", None))):
        given = type(policy).__name__
        raise InputError(f"a policy of type {given} given to roll_out; wanted a name, or an object with reset, act")
    # One that stands before another's is called by that one's name.
    return _Player(str(getattr(policy, "name", type(policy).__name__)), policy)
