"""What plug-ins are tried on: a few runs of each environment, as data and nothing else.

The runs are recorded beforehand under commands that every plant takes. So a plug-in is tried in a process that holds no
simulator, and what it gets there is all that it can know.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.system import system

#: Events of a channel at most at which a record is cut.
MOST_EVENTS = 60
#: Share of rows in which a channel that holds its value may change it.
HOLDING = 0.05
#: Runs of a trial.
RUNS = 3
Commands = Sequence[tuple[float, int]]


@dataclass(frozen=True)
class TrialRuns:
    """Runs of one environment.

    Attributes
    ----------
    name : str
    datasheet : Datasheet
    chunks : tuple of Recording
        Step by step, of all runs: channels of shape (R, n).
    estimates : tuple of Estimate
        Of a plain estimator, before each step.
    low, high : ndarray, shape (a,)
        Bounds of an action.
    asked : mapping of str to str
        What an estimator is asked for, with its SI unit.
    """

    name: str
    datasheet: Datasheet
    chunks: tuple[Recording, ...]
    estimates: tuple[Estimate, ...]
    low: Floats
    high: Floats
    asked: Mapping[str, str] = field(default_factory=dict)


class _Commanded:
    """A policy that plays a list."""

    def __init__(self, commands: Commands, width: int) -> None:
        self.width = width
        self.values = [value for value, steps in commands for _ in range(steps)]

    def reset(self, batch: int | None = None) -> tuple[int, int]:
        """Runs, and the step."""
        return batch or 1, 0

    def act(self, state: tuple[int, int], chunk: Recording | None, estimate: Estimate | None) -> tuple[Floats, Any]:
        """The next of the list."""
        runs, step = state
        action = np.zeros((runs, self.width))
        action[:, 0] = self.values[min(step, len(self.values) - 1)]
        return action, (runs, step + 1)


def trial(name: str) -> TrialRuns:
    """Record the runs of an environment.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    from insenv.envs.belief import judge
    from insenv.envs.rollout import roll_out
    from insenv.evaluate.runs import task_of

    tried = system(name).trial
    task = task_of(tried.scenario, tried.changes)
    played = roll_out(task, _Commanded(tried.commands, task.action_space.shape[0]), None, range(RUNS))
    watched = judge(tried.estimator, task.datasheet, ())
    state = watched.begin(RUNS)
    estimates = [watched.estimate(state, RUNS)]
    for _, chunk in played.chunks:
        state = watched.update(state, chunk)
        estimates.append(watched.estimate(state, RUNS))
    box = task.action_space
    low, high = np.asarray(box.low, float), np.asarray(box.high, float)
    chunks, asked = tuple(chunk for _, chunk in played.chunks), {q.name: q.unit for q in task.quantities}
    return TrialRuns(name, task.datasheet, chunks, tuple(estimates), low, high, asked)


def cut(chunks: Sequence[Recording], n: int) -> list[Recording]:
    """The same rows in pieces of ``n``."""
    first = chunks[0]
    t = np.concatenate([c.t for c in chunks])
    whole = {name: np.concatenate([c.channels[name].values for c in chunks], axis=-1) for name in first.channels}
    return [_part(first, t, whole, slice(a, a + n)) for a in range(0, len(t), n)]


def cut_at_events(chunks: Sequence[Recording]) -> list[Recording]:
    """The same rows, cut before and after each row at which something happens; see `events`."""
    first = chunks[0]
    t = np.concatenate([c.t for c in chunks])
    whole = {name: np.concatenate([c.channels[name].values for c in chunks], axis=-1) for name in first.channels}
    edges = sorted({0, len(t), *(e for row in events(whole) for e in (row, row + 1))})
    return [_part(first, t, whole, slice(a, b)) for a, b in pairwise(edges)]


def events(values: Mapping[str, Floats]) -> list[int]:
    """Rows at which a reading that is not always there appears, or one that holds its value changes it.

    ``values`` maps channels to samples, shape (..., n). At most `MOST_EVENTS` of each channel, evenly chosen.
    """
    found: set[int] = set()
    for samples in values.values():
        known = np.isfinite(samples).reshape(-1, samples.shape[-1])
        appears = known[:, 1:] & ~known[:, :-1]
        changes = known[:, 1:] & known[:, :-1] & (np.diff(samples.reshape(known.shape), axis=-1) != 0)
        if changes.mean() > HOLDING:  # a reading that changes all the time
            changes[:] = False
        rows = np.flatnonzero((appears | changes).any(axis=0)) + 1
        some = np.linspace(0, len(rows) - 1, min(len(rows), MOST_EVENTS)).round().astype(int)
        found |= set(rows[some].tolist())
    return sorted(found)


def _part(like: Recording, t: Floats, values: Mapping[str, Floats], at: slice) -> Recording:
    channels = {name: replace(c, values=values[name][..., at].copy()) for name, c in like.channels.items()}
    return replace(like, t=t[at].copy(), channels=channels)
