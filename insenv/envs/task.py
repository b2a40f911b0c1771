r"""A task in steps, pure and batched.

    group_0 = begin(task, seeds, z),     group_{k+1} = advance(task, group_k, commands, z)

A `Task` is a `World` (what is simulated, what is seen of it) with the length of a step, the time that there is,
what an estimator is asked for and what time costs; its state is an `insenv.envs.group.Group`. Nothing here
changes what it is given: the generators of the unit normals ``z`` stand outside, in `insenv.envs.batch`.

The reward of a step of length dt, with an estimator, is the information won (`insenv.envs.belief`) less ``cost dt``; at
the end the verdict of the truth is added. Over a run the sum is the score of the last belief less the cost of its time:
nothing that is said on the way pays. Without an estimator a step earns ``- cost dt``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.recording import Channel, Floats, Recording
from insenv.core.rows import rows
from insenv.data.manifest import HeldOut, Model
from insenv.envs.belief import Judge, SoughtQuantity
from insenv.envs.group import Blocks, Film, Group, Index, Seen
from insenv.envs.restart import Restarts
from insenv.rig import Readings, Rig


class World(Protocol):
    """What one system is: all that an environment has of its own. Settings only; states go in and come out."""

    @property
    def action(self) -> spaces.Box:
        """Space of one action, shape (a,)."""

    @property
    def blocks(self) -> Mapping[str, spaces.Box]:
        """Spaces of what is seen of the instruments in one step."""

    def cast(self, seeds: Sequence[int]) -> Rig:
        """The rig of the runs ``seeds``, with their random truths, shape (R,)."""

    def command(self, actions: Floats) -> tuple[Any, NDArray[np.bool_]]:
        """Command of the plant and whether to stop, shape (R,), for actions of shape (R, a)."""

    def begin(self, rig: Rig, seeds: Sequence[int]) -> Any:
        """Memory of the instruments' electronics before the first sample, a state of `insenv.core.rows`."""

    def still(self, rig: Rig, time: float, batch: int) -> Blocks:
        """What is seen where no time passes: at a reset and at a stop [(R, ...)]."""

    def read(self, readings: Readings, memory: Any) -> tuple[Blocks, Any]:
        """What is seen of a step, in new arrays, and the memory afterwards."""

    def record(self, readings: Readings, blocks: Blocks) -> Mapping[str, Channel]:
        """The same as channels of a recording, in arrays of its own: what an estimator is given."""

    def truth(self, rig: Rig, batch: int) -> Mapping[str, Floats]:
        """True values of each run, shape (R,), by name."""

    def film(self, task: Task) -> Film:
        """What draws a run."""


@dataclass(frozen=True)
class Task:
    """A world, asked for something.

    Attributes
    ----------
    name : str
    world : World
    datasheet : Datasheet
        What is told of it.
    model : Model
        What the manifest of a recording declares.
    held_out : HeldOut
        Of such a manifest.
    samples : int
        In a step.
    steps : int
        Until time is up.
    cost : float
        Price of a second.
    quantities : tuple of SoughtQuantity
        What is to be found.
    judge : Judge, optional
        The estimator that believes and rewards.
    every : int
        Steps from one belief to the next; there is one at the end in any case. What is won in between is paid
        with the next belief.
    """

    name: str
    world: World
    datasheet: Datasheet
    model: Model
    held_out: HeldOut
    samples: int
    steps: int
    cost: float
    quantities: tuple[SoughtQuantity, ...] = ()
    judge: Judge | None = None
    every: int = 1

    @property
    def step_s(self) -> float:
        """Length of a step [s]."""
        return self.samples / self.datasheet.sampling

    @cached_property
    def switched(self) -> Restarts | None:
        """The world, where its instruments can be switched off and on."""
        return self.world if isinstance(self.world, Restarts) else None

    @cached_property
    def action_space(self) -> spaces.Box:
        """Space of one action."""
        return self.world.action

    @cached_property
    def _bounds(self) -> tuple[Floats, Floats]:
        """Of an action; a number that was rounded to single precision may lie that much beyond."""
        box = self.action_space
        slack = 1e-6 * (box.high - box.low)
        return box.low - slack, box.high + slack

    def holds(self, actions: NDArray[Any]) -> NDArray[np.bool_]:
        """Which elements of actions, shape (..., a), are finite and within their bounds."""
        low, high = self._bounds
        within: NDArray[np.bool_] = (actions >= low) & (actions <= high)
        return within

    @cached_property
    def observation_space(self) -> spaces.Dict:
        """Space of the observation of one run."""
        seen: dict[str, spaces.Space[Any]] = dict(self.world.blocks)
        seen["time_left"] = spaces.Box(0.0, self.steps * self.step_s, (1,), np.float64)
        if self.switched is not None:
            seen["power_ups"] = spaces.Box(1.0, 1.0 + self.steps, (1,), np.float64)
        if self.judge is not None and self.quantities:
            limit = np.array([q.limit for q in self.quantities])
            prior = np.array([q.prior for q in self.quantities])
            low = np.concatenate([-limit, np.zeros_like(prior)])
            seen["belief"] = spaces.Box(low, np.concatenate([limit, prior]), dtype=np.float64)
        return spaces.Dict(seen)


def begin(task: Task, seeds: Sequence[int], rig: Rig, z: tuple[Floats | None, ...]) -> tuple[Group, Seen]:
    """The runs ``seeds`` of ``rig = task.world.cast(seeds)`` at time 0, with the unit normals of `Normals.start`."""
    batch, world = len(seeds), task.world
    group = Group(
        seeds=tuple(seeds),
        rig=rig,
        passed=0,
        state=rig.begin(z),
        memory=world.begin(rig, seeds),
        truth=world.truth(rig, batch),
        learnt=None if task.judge is None else task.judge.begin(batch),
        believed=0,
        estimate=None,
        means=np.empty((batch, 0)),
        deviations=np.empty((batch, 0)),
        rewarded=np.zeros(batch),
        power_ups=np.ones(batch, np.int64),
    )
    group = _believing(task, group)
    return group, Seen(_observation(task, group, world.still(rig, 0.0, batch)), np.zeros(batch))


def advance(task: Task, group: Group, command: Any, z: Floats) -> tuple[Group, Seen]:
    """One step on, with unit normals ``z`` of shape (R, draws, n); the last one pays for the true error."""
    world = task.world
    readings, state = group.rig.advance(group.state, command, task.samples, z)
    blocks, memory = world.read(readings, group.memory)
    record, learnt = partial(_recorded, task, group, readings, blocks), None
    if task.judge is not None:
        chunk = record()
        record, learnt = partial(_again, chunk), task.judge.update(group.learnt, chunk)
    after = replace(group, passed=group.passed + 1, state=state, memory=memory, learnt=learnt)
    reward = np.full(len(group), -task.cost * task.step_s)
    last = after.passed == task.steps
    if task.judge is not None and (last or after.passed % task.every == 0):
        after, gain = _rewarded(task, _believing(task, after), last)
        reward += gain
    return after, Seen(_observation(task, after, blocks), reward, record)


def stop(task: Task, group: Group) -> tuple[Group, Seen]:
    """The end of all runs of a group, before time is up: no time passes, the last belief is judged."""
    batch = len(group)
    if group.believed < group.passed:
        group = _believing(task, group)
    group, reward = _rewarded(task, group, True)
    blocks = task.world.still(group.rig, group.passed * task.step_s - group.switched_on, batch)
    return group, Seen(_observation(task, group, blocks), reward)


def part(task: Task, group: Group, index: Index) -> Group:
    """Rows ``index`` of a group alone."""
    if len(index) == len(group):
        return group
    seeds = tuple(group.seeds[i] for i in index.tolist())
    kept = {name: rows(getattr(group, name), index) for name in _ROWS}
    estimate = group.estimate
    if estimate is not None:
        estimate = replace(estimate, mean=estimate.mean[index], cov=estimate.cov[index])
    state = replace(
        group.state,
        plant=rows(group.state.plant, index),
        sensors=rows(group.state.sensors, index),
    )
    if task.switched is None:
        rig = task.world.cast(seeds)
    else:
        rig = task.switched.recast(seeds, kept["power_ups"].tolist(), group.switched_on)
    return replace(group, seeds=seeds, rig=rig, state=state, estimate=estimate, **kept)


#: What of a group is a state with the batch in front.
_ROWS = ("memory", "truth", "learnt", "means", "deviations", "rewarded", "power_ups")


def checked(task: Task, actions: Any, rows_: int, asked: NDArray[np.bool_] | None = None) -> Floats:
    """Actions as floats of shape (rows, a); those of rows that are not ``asked`` are not looked at.

    Raises
    ------
    InputError
        If they have another shape, are no numbers, not finite or out of bounds.
    """
    box = task.action_space
    try:
        given = np.asarray(actions)
    except ValueError:
        raise InputError(f"{task.name}: actions of different lengths; wanted shape {(rows_, *box.shape)}") from None
    if given.shape != (rows_, *box.shape):
        raise InputError(f"{task.name}: actions of shape {given.shape}; wanted {(rows_, *box.shape)}")
    if given.dtype.kind not in "fiu":
        raise InputError(f"{task.name}: actions of type {given.dtype}; wanted real numbers")
    good = task.holds(given)
    if asked is not None:
        good |= ~asked[:, None]
    if np.count_nonzero(good) < good.size:
        row = int(np.flatnonzero(~good.all(axis=-1))[0])
        where = f" of row {row}" if rows_ > 1 else ""
        least, most = _shown(box.low), _shown(box.high)
        raise InputError(f"{task.name}: action {_shown(given[row])}{where}; wanted numbers from {least} to {most}")
    return given.astype(np.float64, copy=False)


def _recorded(task: Task, group: Group, readings: Readings, blocks: Blocks) -> Recording:
    """What a group recorded in a step, on the run's clock."""
    sheet, channels = task.datasheet, task.world.record(readings, blocks)
    t = readings.t + group.switched_on if group.switched_on else readings.t
    if task.switched is not None:
        number = np.repeat(group.power_ups[:, None].astype(float), len(t), axis=-1)
        channels = {**channels, "power": Channel(number, "1")}
    return Recording(t, channels, (), sheet.site, sheet.mounting, task.name)


def _again(chunk: Recording) -> Recording:
    return chunk


def _believing(task: Task, group: Group) -> Group:
    """A group whose belief is of now."""
    judge = task.judge
    if judge is None:
        return group
    estimate = judge.estimate(group.learnt, len(group))
    means, deviations = judge.belief(estimate)
    return replace(group, believed=group.passed, estimate=estimate, means=means, deviations=deviations)


def _rewarded(task: Task, group: Group, last: bool) -> tuple[Group, Floats]:
    """A group whose information is paid, and what that is, shape (R,); at the end with the verdict of the truth."""
    judge = task.judge
    if judge is None:
        return group, np.zeros(len(group))
    known = judge.information(group.deviations)
    reward = known - group.rewarded
    if last:
        reward = reward + judge.verdict(group.means, group.deviations, group.truth)
    return replace(group, rewarded=known), reward


def _observation(task: Task, group: Group, blocks: Blocks) -> Blocks:
    """Blocks, time left and belief."""
    seen = dict(blocks)
    seen["time_left"] = np.full((len(group), 1), (task.steps - group.passed) * task.step_s)
    if task.switched is not None:
        seen["power_ups"] = group.power_ups[:, None].astype(float)
    if task.judge is not None and task.quantities:
        seen["belief"] = np.concatenate([group.means, group.deviations], axis=-1)
    return seen


def _shown(values: NDArray[Any]) -> str:
    return "[" + ", ".join(f"{float(v):g}" for v in values) + "]"
