"""Runs that go on in step: the state of a task, and what is seen of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from insenv.core.estimate import Estimate
from insenv.core.recording import Floats, Recording
from insenv.rig import Rig, RigState

#: Arrays of an observation by key, and rows of a batch.
Blocks = dict[str, Floats]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Group:
    """Rows of runs that began together: a state.

    Attributes
    ----------
    seeds : tuple of int
        Of the R runs.
    rig : Rig
    passed : int
        Steps so far.
    state : RigState
    memory : object
        Of the instruments' electronics.
    truth : mapping of str to ndarray, shape (R,)
    learnt : object
        The estimator's state.
    believed : int
        Steps after which the estimate was made.
    estimate : Estimate, optional
    means, deviations : ndarray, shape (R, k)
        The belief; of no column where there is no estimator.
    rewarded : ndarray, shape (R,)
        Information that was paid for so far [nats].
    power_ups : ndarray of int, shape (R,)
        How often the instruments were switched on; ones but for a world with `insenv.envs.restart.Restarts`.
    switched_on : float
        Time of the run at which that was the last time [s]: the rig's clock was zero then.
    """

    seeds: tuple[int, ...]
    rig: Rig
    passed: int
    state: RigState
    memory: Any
    truth: Mapping[str, Floats]
    learnt: Any
    believed: int
    estimate: Estimate | None
    means: Floats
    deviations: Floats
    rewarded: Floats
    power_ups: Index
    switched_on: float = 0.0

    def __len__(self) -> int:
        return len(self.seeds)


@dataclass(frozen=True)
class Seen:
    """What a step shows of the R runs of a group.

    Attributes
    ----------
    observation : dict of str to ndarray, shape (R, ...)
        New arrays.
    reward : ndarray, shape (R,)
    record : callable, optional
        Makes the `chunk`.
    """

    observation: Blocks
    reward: Floats
    record: Callable[[], Recording] | None = None

    @cached_property
    def chunk(self) -> Recording | None:
        """The rows of this step, arrays of shape (R, n) or (n,); None where no time passed.

        Made when it is first asked for, before anybody else has the observation.
        """
        return None if self.record is None else self.record()


class Film(Protocol):
    """Pictures of one run, a batch of one."""

    def begin(self, group: Group) -> None:
        """The run begins."""

    def add(self, group: Group, chunk: Recording) -> None:
        """A step of it."""

    def frame(self) -> NDArray[np.uint8]:
        """The present, shape (height, width, 3)."""
