"""Instruments that are switched off and on in the middle of a run.

The plant and the run's time go on; the instruments' clock is zero again, their noise begins in another state, and what
differs from power-up to power-up is drawn anew. Rows that are switched at the same time begin a group of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Protocol, runtime_checkable

from insenv.core.recording import Floats
from insenv.envs.group import Flags, Group
from insenv.rig import Rig, RigState


@runtime_checkable
class Restarts(Protocol):
    """A `insenv.envs.task.World` that can do so.

    What is shown of it has "power_ups", and its recordings a channel "power": the number of the power-up, from 1.
    """

    def restarts(self, actions: Floats) -> Flags:
        """Which instruments to switch off and on before the step, shape (R,), for actions of shape (R, a)."""

    def recast(self, seeds: Sequence[int], power_ups: Sequence[int], time: float) -> Rig:
        """The rig of the runs, with instruments that were switched on so many times, the last time at ``time`` [s]."""

    def went_on(self, plant: Any, passed: float) -> Any:
        """The plant's state on a clock that is zero ``passed`` seconds later."""

    def truth(self, rig: Rig, batch: int) -> Mapping[str, Floats]:
        """As of a world."""


def restart(
    world: Restarts, group: Group, time: float, start: Callable[[Sequence[int]], tuple[Floats | None, ...]]
) -> Group:
    """All runs of a group at ``time`` [s], with instruments switched off and on; no time passes.

    ``start`` is `insenv.rig.Normals.start`.
    """
    power_ups = group.power_ups + 1
    numbers: list[int] = power_ups.tolist()
    rig = world.recast(group.seeds, numbers, time)
    plant = world.went_on(group.state.plant, group.state.samples / rig.rate)
    return replace(
        group,
        rig=rig,
        state=RigState(0, plant, start(numbers)),
        truth=world.truth(rig, len(group)),
        power_ups=power_ups,
        switched_on=time,
    )
