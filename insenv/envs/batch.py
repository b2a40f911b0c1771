"""Rows of runs through steps, stops and resets: the mutable edge of a task.

Rows that began together stand in one `insenv.envs.group.Group`, with the generators of their unit normals
beside it. As long as all rows begin and end together there is one group, and no row is copied; a row that
stops early, or is reset alone, leaves its group. So do rows whose instruments are switched off and on: those that are
at the same time begin a group of their own, whose instruments' clock is zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from insenv.core.estimate import Estimate
from insenv.core.recording import Floats, Recording
from insenv.envs import task as tasks
from insenv.envs.group import Blocks, Flags, Group, Index, Seen
from insenv.envs.restart import restart
from insenv.envs.task import Task
from insenv.rig import Normals


@dataclass(frozen=True)
class RowsPart:
    """What the rows ``index`` of a batch saw in a step, and whether it was their last.

    ``group`` is their state afterwards; rows that ended are in it still.
    """

    index: Index
    group: Group
    seen: Seen
    terminated: bool = False
    truncated: bool = False


@dataclass(frozen=True)
class RowsPlace:
    """Rows of the batch, their state and the generators of their unit normals."""

    index: Index
    group: Group
    normals: Normals


class Batch:
    """``size`` rows of runs of a task.

    Attributes
    ----------
    task : Task
    size : int
    alive : ndarray of bool, shape (size,)
        Rows that have begun and not ended.
    """

    def __init__(self, task: Task, size: int) -> None:
        self.task, self.size = task, size
        self.alive: Flags = np.zeros(size, bool)
        self._places: tuple[RowsPlace, ...] = ()

    def begin(self, index: Index, seeds: Sequence[int]) -> RowsPart:
        """Begin the rows ``index`` anew, as the runs ``seeds``; what they were doing is given up."""
        self.leave(index)
        rig = self.task.world.cast(seeds)
        normals = Normals(rig, seeds)
        group, seen = tasks.begin(self.task, seeds, rig, normals.start())
        self._places = (*self._places, RowsPlace(index, group, normals))
        self.alive[index] = True
        return RowsPart(index, group, seen)

    def leave(self, index: Index) -> None:
        """End the rows ``index`` where they are."""
        leaving = np.zeros(self.size, bool)
        leaving[index] = True
        self.alive[index] = False
        staying = (self._without(place, leaving[place.index]) for place in self._places)
        self._places = tuple(place for place in staying if place is not None)

    def step(self, actions: Floats) -> tuple[RowsPart, ...]:
        """One step of all rows that are alive, with actions of shape (size, a), checked.

        Where it fails all runs are over: some may have gone on, and others not.
        """
        places = [split for place in self._places for split in self._switched(place, actions)]
        self._places = ()
        before = self.alive
        self.alive = np.zeros(self.size, bool)
        parts: list[RowsPart] = []
        staying: list[RowsPlace] = []
        for place in places:
            command, stops = self.task.world.command(actions[place.index])
            remaining: RowsPlace | None = place
            if np.count_nonzero(stops):
                parts.append(_stopped(self.task, place, np.flatnonzero(stops)))
                remaining = self._without(place, stops)
                command = command[~stops]
            if remaining is None:
                continue
            z = remaining.normals.draw(self.task.samples)
            group, seen = tasks.advance(self.task, remaining.group, command, z)
            ended = group.passed == self.task.steps
            parts.append(RowsPart(remaining.index, group, seen, truncated=ended))
            if not ended:
                staying.append(RowsPlace(remaining.index, group, remaining.normals))
        for part in parts:
            if part.terminated or part.truncated:
                before[part.index] = False
        self._places, self.alive = tuple(staying), before
        return tuple(parts)

    def _switched(self, place: RowsPlace, actions: Floats) -> tuple[RowsPlace, ...]:
        """A place in two where some of its rows are switched off and on."""
        world = self.task.switched
        if world is None or not (again := world.restarts(actions[place.index])).any():
            return (place,)
        staying, leaving = self._without(place, again), self._without(place, ~again)
        assert leaving is not None
        time = leaving.group.passed * self.task.step_s
        group = restart(world, leaving.group, time, leaving.normals.start)
        begun = RowsPlace(leaving.index, group, leaving.normals)
        return (begun,) if staying is None else (staying, begun)

    def _without(self, place: RowsPlace, leaving: Flags) -> RowsPlace | None:
        """A place without the rows that leave it, None where none stays."""
        if not leaving.any():
            return place
        kept = np.flatnonzero(~leaving)
        if not len(kept):
            return None
        return RowsPlace(place.index[kept], tasks.part(self.task, place.group, kept), place.normals.rows(kept))


def gathered(parts: Sequence[RowsPart], size: int) -> tuple[Blocks, Floats, Flags, Flags]:
    """Observations, rewards and the two flags of all parts, by row of the batch; zero where no part has it.

    Where one part has all rows its arrays are given as they are.
    """
    terminated, truncated = np.zeros(size, bool), np.zeros(size, bool)
    for part in parts:
        terminated[part.index], truncated[part.index] = part.terminated, part.truncated
    if len(parts) == 1 and len(parts[0].index) == size:
        return parts[0].seen.observation, parts[0].seen.reward, terminated, truncated
    reward = np.zeros(size)
    seen = {key: np.zeros((size, *block.shape[1:]), block.dtype) for key, block in parts[0].seen.observation.items()}
    for part in parts:
        reward[part.index] = part.seen.reward
        for key, block in part.seen.observation.items():
            seen[key][part.index] = block
    return seen, reward, terminated, truncated


def going_on(parts: Sequence[RowsPart]) -> tuple[Recording | None, Estimate | None]:
    """Recording and estimate of all rows that have not ended, in the order of the batch; None where there is none."""
    going = [part for part in parts if not (part.terminated or part.truncated)]
    if len(going) < 2:
        return (going[0].seen.chunk, going[0].group.estimate) if going else (None, None)
    order = np.argsort(np.concatenate([part.index for part in going]))
    chunks = [part.seen.chunk for part in going if part.seen.chunk is not None]
    channels = {
        name: replace(channel, values=_stacked([chunk.channels[name].values for chunk in chunks], going)[order])
        for name, channel in chunks[0].channels.items()
    }
    estimates = [part.group.estimate for part in going if part.group.estimate is not None]
    estimate = None
    if estimates:
        mean, cov = (np.concatenate([getattr(e, name) for e in estimates])[order] for name in ("mean", "cov"))
        estimate = replace(estimates[0], mean=mean, cov=cov)
    return replace(chunks[0], channels=channels), estimate


def _stacked(values: Sequence[Floats], parts: Sequence[RowsPart]) -> Floats:
    """Values of shape (R, n), or (n,) where the rows of a part share them, of all parts."""
    whole = (np.broadcast_to(v, (len(p.index), v.shape[-1])) for v, p in zip(values, parts, strict=True))
    return np.concatenate(list(whole))


def _stopped(task: Task, place: RowsPlace, index: Index) -> RowsPart:
    """The end of some rows of a place."""
    group, seen = tasks.stop(task, place.group)
    observation = {key: block[index] for key, block in seen.observation.items()}
    return RowsPart(place.index[index], tasks.part(task, group, index), Seen(observation, seen.reward[index]), True)
