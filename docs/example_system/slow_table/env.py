"""North on a table that turns slowly: an action is the rate and whether to stop, as of the north finder.

The world is the north finder's own; what is asked for, and how well it is known before, is this system's.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from insenv.core.estimate import Datasheet
from insenv.envs.belief import SoughtQuantity
from insenv.envs.setup import Setup, scenario_task
from insenv.envs.single import SystemEnv
from insenv.envs.task import Task
from insenv.envs.vector import SystemVectorEnv
from insenv.scenario import Scenario
from insenv.scenario.spec import TaskSpec
from insenv.systems.north_finder.env import NorthFinder


def _world(scenario: Scenario, sheet: Datasheet, spec: TaskSpec) -> NorthFinder:
    return NorthFinder(scenario, sheet, spec.samples)


def _azimuth(spec: TaskSpec, sheet: Datasheet) -> tuple[SoughtQuantity, ...]:
    """The azimuth, of which nothing is known: uniform on the circle."""
    return (SoughtQuantity("azimuth", np.pi / np.sqrt(3), np.pi, spec.demanded, circular=True, unit="rad"),)


_SETUP = Setup("slow table", "SlowTable", "[table]", _world, _azimuth)


def slow_table(
    scenario: str = "slow_table/slow",
    changes: Mapping[str, Any] | None = None,
    estimator: str | None = None,
    step_s: float | None = None,
    sampling: float | None = None,
) -> Task:
    """The task of a scenario; parameters as of `insenv.systems.north_finder.env.north_finder`."""
    return scenario_task(_SETUP, scenario, changes, estimator, step_s, sampling)


class SlowTableEnv(SystemEnv):
    """``insenv/SlowTable-v0``; parameters as of `slow_table`."""

    maker = staticmethod(slow_table)


class SlowTableVectorEnv(SystemVectorEnv):
    """The vector form of ``insenv/SlowTable-v0``."""

    maker = staticmethod(slow_table)
