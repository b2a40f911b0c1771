"""The task of an environment, made from a scenario: what all systems have in common."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.system import system
from insenv.data.manifest import Model, checks
from insenv.envs.belief import SoughtQuantity, judge
from insenv.envs.task import Task, World
from insenv.scenario import Scenario, check_task, load
from insenv.scenario import datasheet as told
from insenv.scenario.source import changed
from insenv.scenario.spec import TaskSpec


@dataclass(frozen=True)
class Setup:
    """What a system makes of a scenario.

    Attributes
    ----------
    name : str
        In running text.
    system : str
        Its name in the registry (`insenv.core.system`).
    table : str
        The scenario's table of its plant.
    world : callable
        Its world, of a scenario, the datasheet and what is asked for.
    quantity : callable
        What is to be found, of what is asked for and the datasheet; nothing where there is no belief.
    """

    name: str
    system: str
    table: str
    world: Callable[[Scenario, Datasheet, TaskSpec], World]
    quantity: Callable[[TaskSpec, Datasheet], tuple[SoughtQuantity, ...]]


def scenario_task(
    setup: Setup,
    scenario: str,
    changes: Mapping[str, Any] | None,
    estimator: str | None,
    step_s: float | None,
    sampling: float | None,
) -> Task:
    """The task of a scenario in a system; parameters as of `insenv.systems.north_finder.env.north_finder`.

    Raises
    ------
    InputError
        If the scenario asks for what the system is not for, or it or the estimator cannot be used.
    """
    given = changed(changes)
    if step_s is not None:
        given["task.step"] = f"{step_s} s"
    if sampling is not None:
        given["instrument.sampling"] = f"{sampling} Hz"
    played = load(scenario, given)
    kinds = [kind.name for kind in system(setup.system).kinds]
    if played.task is not None and played.task.kind not in kinds:
        wanted = " or ".join(repr(kind) for kind in kinds)
        raise InputError(f"{played.path}: task.kind = {played.task.kind!r}; wanted {wanted}, and a {setup.table}")
    spec, sheet, plant = check_task(played), told(played), played.rig.plant
    quantities = setup.quantity(spec, sheet)
    return Task(
        name=f"{setup.name} {played.path.stem!r}",
        world=setup.world(played, sheet, spec),
        datasheet=sheet,
        model=Model(played.targets, played.declared, plant.reference_temperature),
        held_out=checks.held_out(played.table.held_out, 1, played.path),
        samples=spec.samples,
        steps=spec.steps,
        cost=spec.cost,
        quantities=quantities,
        judge=None if estimator is None else judge(estimator, sheet, quantities),
    )
