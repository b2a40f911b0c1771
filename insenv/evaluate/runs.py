"""Runs of a scenario under a policy with an estimator, as a table: one row for each seed.

The path "samples" rolls the environment out sample by sample. The path "dwells" draws the means over short dwells from
their joint law (`insenv.rig_dwells`) and hands them to the estimator as readings at that lower rate: the same
distribution for a fraction of the time, for policies that go by the clock.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.estimate import Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.system import kinds, part
from insenv.envs.belief import Judge, judge
from insenv.envs.rollout import made, roll_out
from insenv.envs.task import Task, checked
from insenv.rig import Readings, stream
from insenv.rig_dwells import PLACE, Command, DwellLaw, blocks, dwell_law
from insenv.scenario import load

Path = Literal["samples", "dwells"]
Table = dict[str, NDArray[Any]]

#: Runs that are drawn together on the path "dwells": their arrays stay within the processor's cache.
TOGETHER = 128


def task_of(scenario: str, changes: Mapping[str, Any] | None = None, sampling: float | None = None) -> Task:
    """The task of a scenario, whichever environment plays it.

    Raises
    ------
    InputError
        If it cannot be used, or has no task.
    """
    loaded = load(scenario, changes)
    if loaded.task is None:
        raise InputError(f"{loaded.path}: [task] is missing; wanted it, for runs are played for one")
    made_task: Callable[..., Task] = part(kinds()[loaded.task.kind][0].task)
    return made_task(scenario, changes, None, None, sampling)


@dataclass(frozen=True)
class Episodes:
    """A job of `insenv.sweep`: gives a table of the runs of given seeds, which can be pickled.

    Attributes
    ----------
    scenario : str
        Name or path.
    estimator, policy : str
        Names of plug-ins.
    changes : str
        Of the scenario's entries, as JSON.
    path : "samples" or "dwells"
    block : float, optional
        Length of a dwell [s]; a step of the task.
    every : int
        Steps after which the estimator is asked, sample by sample.
    """

    scenario: str
    estimator: str
    policy: str
    changes: str = "{}"
    path: Path = "samples"
    block: float | None = None
    every: int = 1

    def __post_init__(self) -> None:
        if self.path not in get_args(Path):
            raise InputError(f"path {self.path!r} given; wanted {' or '.join(get_args(Path))}")
        if self.block is not None and self.path != "dwells":
            raise InputError(f"dwells of {self.block:g} s given; wanted them with the path 'dwells' only")

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each quantity of the estimate.

        Raises
        ------
        InputError
            If the scenario or the estimator cannot be used.
        """
        watched = judge(self.estimator, _task(self).datasheet, ())
        prior = watched.estimate(watched.begin(1), 1)
        return dict(zip(prior.names, prior.units, strict=True))

    def __call__(self, seeds: Sequence[int]) -> Table:
        """The table; see `episodes`."""
        if self.path == "samples":
            return _sampled(self, seeds)
        found = [_short(self, seeds[i : i + TOGETHER]) for i in range(0, len(seeds), TOGETHER)]
        return {name: np.concatenate([part[name] for part in found]) for name in found[0]}


def episodes(
    scenario: str,
    estimator: str,
    policy: str,
    seeds: Sequence[int],
    changes: Mapping[str, Any] | None = None,
    **settings: Any,
) -> Table:
    """Play the runs ``seeds``.

    Parameters
    ----------
    scenario, estimator, policy : str
    seeds : sequence of int
    changes : mapping, optional
    **settings
        ``path``, ``block`` and ``every`` of `Episodes`.

    Returns
    -------
    dict of str to ndarray, shape (R,)
        "seed", "time" [s] and "stopped"; "estimate.a" and "cov.a.b" for quantities a, b of the estimate (SI), at the
        end of the run; "truth.a" where the truth is known, "error.a" for what the task asks for.

    Raises
    ------
    InputError
        If a plug-in fails, the scenario cannot be used, or the path "dwells" does not hold for it.
    """
    return Episodes(scenario, estimator, policy, json.dumps(changes or {}), **settings)(seeds)


def _sampled(job: Episodes, seeds: Sequence[int]) -> Table:
    played = roll_out(_task(job), job.policy, job.estimator, seeds, keep=False, every=job.every)
    assert played.estimate is not None
    errors = dict(zip(played.names, played.errors.T, strict=True))
    return table_of(seeds, played.estimate, played.truth, errors, (played.time, played.stopped))


@lru_cache(maxsize=4)
def _task(job: Episodes) -> Task:
    return task_of(job.scenario, json.loads(job.changes))


def table_of(
    seeds: Sequence[int],
    estimate: Estimate,
    truth: Mapping[str, Floats],
    errors: Mapping[str, Floats],
    ended: tuple[Floats, NDArray[np.bool_]],
) -> Table:
    """Columns in a fixed order; see `episodes`."""
    table: Table = {"seed": np.array(seeds, np.int64), "time": ended[0], "stopped": ended[1]}
    for j, name in enumerate(estimate.names):
        table[f"estimate.{name}"] = np.ascontiguousarray(estimate.mean[:, j])
    for j, a in enumerate(estimate.names):
        for k, b in enumerate(estimate.names[: j + 1]):
            table[f"cov.{b}.{a}"] = np.ascontiguousarray(estimate.cov[:, k, j])
    table |= {f"truth.{name}": truth[name] for name in estimate.names if name in truth}
    return table | {f"error.{name}": np.ascontiguousarray(values) for name, values in errors.items()}


# ------------------------------------------------------------------------------------------------ the path "dwells"


@dataclass(frozen=True)
class _Plan:
    """What all runs of a job share: its task at the rate of the dwells, who is asked, commands, and the law."""

    task: Task
    judge: Judge
    commands: tuple[tuple[float, int], ...]
    stopped: bool
    law: DwellLaw


@lru_cache(maxsize=4)
def _plan(job: Episodes) -> _Plan:
    """The law of a job's dwells.

    Raises
    ------
    InputError
        If the policy looks at what is measured, the scenario is none of a turntable that moves in all runs alike, or
        has effects that no Gaussian law describes.
    """
    fine = _task(job)
    if fine.switched is not None or fine.world.cast((0,)).plant.steered_by != "rate":
        raise InputError(f"{fine.name}: has no path 'dwells'; wanted a north finder, or the path 'samples'")
    block = fine.samples if job.block is None else round(job.block * fine.datasheet.sampling)
    if block < 1 or fine.samples % block:
        raise InputError(
            f"{fine.name}: dwells of {job.block} s given; wanted a whole part of the step, {fine.step_s:g} s"
        )
    coarse = task_of(job.scenario, json.loads(job.changes), fine.datasheet.sampling / block)
    actions, stopped = _actions(job.policy, fine)
    steps = [float(rate) for rate in fine.world.command(actions)[0]]
    merged = tuple((rate, len(list(group))) for rate, group in groupby(steps))
    commands: list[Command] = [(rate, n * fine.samples) for rate, n in merged]
    law = dwell_law(fine.world.cast((0, 1)), commands, blocks(len(steps) * fine.samples, block))
    watched = judge(job.estimator, coarse.datasheet, ())
    known = watched.estimate(watched.begin(1), 1).names
    quantities = tuple(q for q in coarse.quantities if q.name in known)
    at_rate = tuple((rate, n * fine.samples // block) for rate, n in merged)
    return _Plan(coarse, replace(watched, quantities=quantities), at_rate, stopped, law)


def _actions(name: str, task: Task) -> tuple[Floats, bool]:
    """Actions of a policy that goes by the clock, shape (steps, a), and whether it stopped before time was up."""
    policy = made(name, task.datasheet)
    found: list[Floats] = []
    state, chunk = policy.reset(1), None
    for step in range(task.steps):
        try:
            action, state = policy.act(state, chunk, None)
        except Exception as error:
            raise InputError(
                f"policy {name!r} looks at what is measured ({' '.join(str(error).split())}); "
                f"wanted one that goes by the clock, or the path 'samples'"
            ) from None
        try:
            action = checked(task, action, 1)
        except InputError as error:
            raise InputError(f"policy {name!r}: {error}") from None
        if task.world.command(action)[1][0]:
            return _some(found, task), True
        found.append(action[0])
        t: Floats = np.arange(step * task.samples + 1, (step + 1) * task.samples + 1) / task.datasheet.sampling
        # Times and nothing else: what is not there cannot be looked at.
        chunk = Recording(t, {}, (), task.datasheet.site, task.datasheet.mounting, task.name)
    return _some(found, task), False


def _some(actions: list[Floats], task: Task) -> Floats:
    if not actions:
        raise InputError(f"{task.name}: the policy stops at once; wanted one step at least")
    return np.array(actions)


def _short(job: Episodes, seeds: Sequence[int]) -> Table:
    """Some runs of the path "dwells"."""
    plan = _plan(job)
    task, batch = plan.task, len(seeds)
    world, rig = task.world, task.world.cast(seeds)
    outputs = plan.law.draw(rig, seeds)
    memory, learnt, truth = world.begin(rig, seeds), plan.judge.begin(batch), world.truth(rig, batch)
    passed = 0
    for readings in _readings(plan, rig, seeds, outputs):
        seen, memory = world.read(readings, memory)
        chunk = Recording(readings.t, world.record(readings, seen), (), task.datasheet.site, task.datasheet.mounting)
        learnt = plan.judge.update(learnt, replace(chunk, label=task.name))
        passed += len(readings.t)
    estimate = plan.judge.estimate(learnt, batch)
    means, _ = plan.judge.belief(estimate)
    errors = {q.name: q.error(means[:, j], truth[q.name]) for j, q in enumerate(plan.judge.quantities)}
    time = np.full(batch, passed * task.datasheet.dt)
    return table_of(seeds, estimate, truth, errors, (time, np.full(batch, plan.stopped)))


def _readings(plan: _Plan, rig: Any, seeds: Sequence[int], outputs: Mapping[str, Floats]) -> Iterator[Readings]:
    """What the instruments and the table's log say at the ends of the dwells, stretch by stretch of one command."""
    z = np.zeros((len(seeds), rig.plant.draws, plan.law.edges.size - 1))
    for row, seed in zip(z, seeds, strict=True):
        for d in range(rig.plant.draws):
            stream(seed, (PLACE, d)).standard_normal(out=row[d])
    state, first = rig.plant.begin(), 0
    for rate, n in plan.commands:
        part = slice(first, first + n)
        t: Floats = plan.law.edges[first : first + n + 1] / plan.law.rate
        scene, state = rig.plant.advance(state, np.full(len(seeds), rate), t, z[..., part])
        yield Readings(t[1:], {name: values[:, part] for name, values in outputs.items()}, scene.references)
        first += n
