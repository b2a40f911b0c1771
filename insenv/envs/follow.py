"""The profile of a scenario, played step by step in its environment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Estimate
from insenv.core.recording import Floats, Recording
from insenv.envs.task import Task
from insenv.envs.turns import Command
from insenv.plants.turntable import Turntable
from insenv.plants.vehicle import Vehicle
from insenv.scenario import Scenario


class Follow:
    """A policy of given actions, shape (K, a), one a step; the last one is kept."""

    def __init__(self, actions: Floats) -> None:
        self.actions = actions

    def reset(self, batch: int | None = None) -> Any:
        """Steps that have passed, for every run."""
        return np.zeros(() if batch is None else batch, int)

    def act(self, state: Any, chunk: Recording | None, estimate: Estimate | None = None) -> tuple[Floats, Any]:
        """The next action."""
        return self.actions[np.minimum(state, len(self.actions) - 1)], state + 1


def profile_actions(scenario: Scenario, task: Task) -> Floats:
    """Actions that play the scenario's profile in an environment, shape (steps, a).

    Commands go out at the step that is nearest.

    Raises
    ------
    InputError
        If there is no profile, or it is one that no action commands.
    """
    if scenario.table.profile is None:
        raise InputError(
            f"{scenario.path}: [profile] is missing; wanted what the first run does, such as "
            'kind = "constant" with a rate, or kind = "turns"'
        )
    plant, actions = scenario.rig.plant, np.zeros((task.steps, *task.action_space.shape))
    if isinstance(plant, Vehicle):
        _turns(plant, task.step_s, actions)
    elif isinstance(plant, Turntable):
        _rates(plant, task.step_s, actions, scenario)
    return actions


def commanded(task: Task, actions: Floats) -> Sequence[Command]:
    """When what was told to the plant."""
    told, _ = task.world.command(actions)
    return [(round(k * task.step_s, 9), float(value)) for k, value in enumerate(np.ravel(told).tolist())]


def _turns(plant: Vehicle, step: float, actions: Floats) -> None:
    time = 0.0
    for rest, angle in plant.profile:
        time += rest
        k = round(time / step)
        if k < len(actions):
            actions[k, 0] = angle / np.pi
        time = k * step + plant.turn_time(angle)


def _rates(plant: Turntable, step: float, actions: Floats, scenario: Scenario) -> None:
    time = 0.0
    for piece in plant.profile:
        if piece.amplitude:
            raise InputError(f"{scenario.path}: profile.kind = 'sine' cannot be played in steps; wanted steady rates")
        actions[round(time / step) :, 0] = piece.rate
        time += min(piece.duration, (len(actions) + 1) * step)
