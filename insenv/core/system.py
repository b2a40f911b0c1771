"""Systems by name: what one brings, so that every command works for it.

A system is an object of the entry-point group ``insenv.systems``: `System`, small and light. What is heavy stands in it
as "module:Name" and is imported when it is used (`part`). insenv finds systems in this way alone, its own too.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from insenv.core.errors import InputError, nearest
from insenv.core.plugins import installed

#: Entry-point group.
SYSTEMS = "insenv.systems"


@dataclass(frozen=True)
class TaskKind:
    """A kind of task of a system: what ``task.kind`` of a scenario names.

    Attributes
    ----------
    name : str
        "north-finder".
    demanded : str
        SI unit of what is sought, and so of ``task.demanded``.
    estimator : str
        The usual one, by name.
    procedure : str
        "module:Name" of what `insenv design` makes of a scenario and its free variables (`insenv.design.kind.Kind`);
        nothing where it has none.
    ranged : bool
        Whether ``task.range`` has a meaning.
    policies : tuple of str
        Those that suit, by name; the documented one first.
    """

    name: str
    demanded: str
    estimator: str
    procedure: str
    ranged: bool = False
    policies: tuple[str, ...] = ()


@dataclass(frozen=True)
class Trial:
    """Short runs on which plug-ins are tried.

    Attributes
    ----------
    scenario : str
    changes : mapping
        Of the scenario, so that the runs are short.
    estimator : str
        A plain one, that gives policies something to look at.
    commands : sequence of (float, int)
        First component of the actions, and the steps for which it is held.
    """

    scenario: str
    changes: Mapping[str, Any]
    estimator: str
    commands: Sequence[tuple[float, int]]


@dataclass(frozen=True)
class System:
    """What a system brings; each place is "module:name".

    Attributes
    ----------
    name : str
        Its environment is "insenv/<name>-v0".
    kinds : tuple of TaskKind
        What its scenarios can ask for.
    scenario : str
        The one that is taken where none is named.
    scenarios : Path
        Folder of the packaged ones, whose names are "<folder>/<file>"; ``home`` names the folder.
    home : str
        First part of their names: "north_finder".
    task : str
        Makes a task of a scenario: ``(scenario, changes, estimator, step_s, sampling) -> insenv.envs.task.Task``.
    environment, vector : str
        Of Gymnasium: the function that makes one, and the class of the vector form.
    check : str
        ``(scenario) -> None`` raises InputError where a scenario cannot be played as it asks for.
    bound : str
        ``(datasheet, run, quantities, scenario) -> {quantity: least standard deviation}``; nothing where there is none.
    trial : Trial
    scene : str
        What a person sees and sets in the browser: a `insenv.play.scene.Scene`, or a function that makes one of a task;
        nothing for the plain one.
    plants : mapping of str to str
        Tables of a scenario that describe a plant of this system's own, each with what makes it of them
        (`insenv.scenario.plant.PlantMaker`).
    """

    name: str
    kinds: tuple[TaskKind, ...]
    scenario: str
    scenarios: Path
    home: str
    task: str
    environment: str
    vector: str
    check: str
    trial: Trial
    bound: str = ""
    scene: str = ""
    plants: Mapping[str, str] = field(default_factory=dict)

    @property
    def id(self) -> str:
        """Of its environment in Gymnasium."""
        return f"insenv/{self.name}-v0"


@cache
def systems() -> Mapping[str, System]:
    """All systems that are installed, by name.

    Raises
    ------
    InputError
        If one cannot be imported, or is none.
    """
    found = {}
    for name, point in sorted(installed(SYSTEMS).items()):
        one = part(point.value, f"system {name!r}")
        if not isinstance(one, System):
            raise InputError(f"system {name!r} is a {type(one).__name__}; wanted an insenv.core.system.System")
        found[one.name] = one
    return found


def system(name: str) -> System:
    """The system of a name: "NorthFinder".

    Raises
    ------
    InputError
        If there is none.
    """
    if name not in systems():
        raise InputError(f"environment {name!r} given; {nearest(name, systems())}")
    return systems()[name]


@cache
def kinds() -> Mapping[str, tuple[System, TaskKind]]:
    """All kinds of task by name, each with its system."""
    return {kind.name: (one, kind) for one in systems().values() for kind in one.kinds}


@cache
def plants() -> Mapping[str, str]:
    """Tables of scenarios that describe plants of the systems' own, each with what makes one of it."""
    return {table: place for one in systems().values() for table, place in one.plants.items()}


def part(place: str, what: str = "part of a system") -> Any:
    """What stands at "module:name", imported.

    Raises
    ------
    InputError
        If it is not there.
    """
    module, _, name = place.partition(":")
    try:
        return getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise InputError(f"{what} cannot be imported from {place!r} ({error}); wanted module:name") from None
