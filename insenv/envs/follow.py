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
    actions = np.zeros((task.steps, *task.action_space.shape))
    try:
        commands = scenario.rig.plant.commands(task.step_s, task.steps)
    except InputError as error:
        raise InputError(f"{scenario.path}: {error}") from None
    # A command goes with the first number of an action: this much of it with an action of 1.
    unit, _ = task.world.command(np.ones_like(actions[:1]))
    actions[:, 0] = commands / unit[0]
    return actions


def commanded(task: Task, actions: Floats) -> Sequence[Command]:
    """When what was told to the plant."""
    told, _ = task.world.command(actions)
    return [(round(k * task.step_s, 9), float(value)) for k, value in enumerate(np.ravel(told).tolist())]
