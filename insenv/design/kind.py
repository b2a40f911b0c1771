"""What a kind of task brings to a design: free variables, a procedure from their values, and what it tells.

A kind of task of another system is one class with these four methods, which `insenv.core.system.TaskKind` names.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, Protocol

from insenv.core.estimate import Datasheet
from insenv.design.free import Free
from insenv.scenario import Scenario, datasheet

#: Rates [rad/s] or turn angles [rad], each with the time [s] for which, or after which, it is commanded.
Course = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Variable:
    """A free variable.

    Attributes
    ----------
    name : str
    low, high : float
        SI; equal where it is held.
    unit : str
        In which it is shown.
    whole : bool
        A whole number: every value is tried.
    points : int
        Of the grid, where it is not.
    log : bool
        Whether the grid is even in the logarithm.
    """

    name: str
    low: float
    high: float
    unit: str = "1"
    whole: bool = False
    points: int = 5
    log: bool = False


#: Variables that are searched together.
Family = tuple[Variable, ...]


@dataclass(frozen=True)
class Plan:
    """A procedure that the plant can play.

    Attributes
    ----------
    time : float
        [s]
    course : Course
    changes : mapping
        Of the scenario's entries, as texts.
    words : str
    values : mapping of str to float
        Of the free variables; empty where it was not made of them.
    told : mapping of str to float
        Further figures, such as the coverage of a rate test [1].
    moved : float
        By which what is sought is another at the end than at the start, such as a heading after turns [SI].
    track : tuple of pair of float
        Times [s] and values between which a picture draws lines; empty: the values of the course are held.
    """

    time: float
    course: Course
    changes: Mapping[str, Any]
    words: str
    values: Mapping[str, float] = field(default_factory=dict)
    told: Mapping[str, float] = field(default_factory=dict)
    moved: float = 0.0
    track: Course = ()


@dataclass(frozen=True)
class DesignedQuantity:
    """What is sought.

    Attributes
    ----------
    name : str
        As estimators and the environment's truth call it.
    unit : str
        SI: "rad" or "1".
    demanded : float
        Standard deviation that the task wants.
    circular : bool
    """

    name: str
    unit: str
    demanded: float
    circular: bool = False


@dataclass(frozen=True)
class OfScenario:
    """What every kind here is made of."""

    scenario: Scenario
    free: Free

    @cached_property
    def sheet(self) -> Datasheet:
        """What is told of the instruments."""
        return datasheet(self.scenario)

    @property
    def step(self) -> float:
        """Of the task [s]."""
        return self.free.step


class Kind(Protocol):
    """A kind of task, made of a scenario and its ``[design]``.

    Attributes
    ----------
    free : Free
    estimators : tuple of str
        The best one that is documented, and the published procedure's own; "": there is none, and nothing is played.
    axis : tuple of str
        What the course holds, and its unit for people.
    """

    estimators: ClassVar[tuple[str, str]]
    axis: ClassVar[tuple[str, str]]

    @property
    def free(self) -> Free:
        """What is free."""

    @property
    def step(self) -> float:
        """Length of a step of the task [s]."""

    @property
    def quantity(self) -> DesignedQuantity:
        """What is sought."""

    def families(self) -> tuple[Family, ...]:
        """What is free."""

    def plan(self, values: Mapping[str, float], time: float) -> Plan | None:
        """The procedure of these values in ``time`` seconds; None where the plant cannot play it."""

    def published(self) -> Plan:
        """The scenario's own procedure, or that of the paper."""

    def sd(self, plan: Plan) -> float:
        """Least standard deviation of what is sought [SI]; infinite where the procedure does not tell it."""

    def remarks(self) -> tuple[str, ...]:
        """What the reader of a design has to know of its bound."""

    def possible(self) -> tuple[Mapping[str, Any], ...]:
        """Effects whose influence is told where the scenario lists none: entries of ``design.possible``."""
