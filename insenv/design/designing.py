"""From a scenario to a procedure with its proof: search, front, Monte Carlo, influence of what may be there.

An estimator errs more than the bound says. Where a standard deviation is demanded, the search is for that over the
estimator's price, so that it is the estimator that reaches it: the price is the deviation that it tells in pilot runs,
over the bound.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from insenv.core.errors import InputError
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.system import kinds, part
from insenv.core.units import quantity, quantity_in
from insenv.design.free import Free
from insenv.design.front import Designer, Point, thinned, times
from insenv.design.kind import DesignedQuantity, Kind
from insenv.design.played import Influence, PlayedCheck, PlayStage
from insenv.scenario import check_task, load

Goal = Literal["time", "accuracy"]
Say = Callable[[str], None]
#: Names of the two procedures.
DESIGNED, PUBLISHED = "designed", "published"
#: Shortest and longest time of a front, as shares of the published one; fewest steps.
SHORTEST, LONGEST, _STEPS = 1 / 12, 1.5, 8
#: Pilot runs that tell an estimator's price, their first seed; prices that are believed.
_PRICED, _FIRST, _PRICES = 16, 10_000_000, (1.0, 2.0)


@dataclass(frozen=True)
class Designed:
    """What was found.

    Attributes
    ----------
    scenario : str
    task : str
        Kind of the task.
    quantity : DesignedQuantity
    axis : tuple of str
        What a course holds, and its unit for people.
    goal : "time" or "accuracy"
        What was made least.
    asked : float
        The standard deviation [SI] that was demanded, or the time [s] that was given.
    estimator : str
    price : float
        By which its deviation is larger than the bound.
    chosen, published : Point
    front : tuple of Point
        By time.
    checks : tuple of PlayedCheck
    influences : tuple of Influence
    seeds : range
    remarks : tuple of str
    """

    scenario: str
    task: str
    quantity: DesignedQuantity
    axis: tuple[str, str]
    goal: Goal
    asked: float
    estimator: str
    price: float
    chosen: Point
    published: Point
    front: tuple[Point, ...]
    checks: tuple[PlayedCheck, ...] = ()
    influences: tuple[Influence, ...] = ()
    seeds: range = range(0)
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Asked:
    """What is asked for, as texts; empty: what the scenario says, or the default.

    Attributes
    ----------
    demanded, time : str, optional
        ``demanded`` may be "published": as good as the published procedure.
    estimator, quantity : str, optional
    method : str
        Of the search.
    seed : int
        Of the search.
    """

    demanded: str | None = None
    time: str | None = None
    estimator: str | None = None
    quantity: str | None = None
    method: str = "auto"
    seed: int = 0


def design(
    scenario: str | Path, asked: Asked | None = None, seeds: range = range(64), jobs: int = 1, say: Say = lambda t: None
) -> Designed:
    """The best procedure for a scenario, its front, and its proof.

    Parameters
    ----------
    scenario : str or Path
        With a [task]; or the name of a packaged one.
    asked : Asked, optional
    seeds : range
        Runs of the Monte Carlo; none: nothing is played.
    jobs : int
        Processes at a time.
    say : callable
        Told what is being done.

    Raises
    ------
    InputError
        If something that was given cannot be used, or nothing that is free can be played.
    """
    asked = asked or Asked()
    kind, task = kind_of(scenario, asked.quantity)
    estimator = asked.estimator or kind.estimators[0]
    remarks = list(kind.remarks())
    if estimator:
        find(ESTIMATORS, estimator)
    else:
        seeds = range(0)
    kind.free.possible(str(scenario), ())  # refused before the work is done
    stage = PlayStage(str(scenario), kind.quantity, jobs)
    published = Point(plan := kind.published(), kind.sd(plan))
    goal, value = _goal(str(scenario), task, kind, asked, published.sd)
    shortest, longest = _times(kind, published.time)
    designer = Designer(kind, asked.method, asked.seed)
    say("the best procedures")
    front = designer.front([*times(shortest, longest), published.time], say)
    if not front:
        raise InputError(f"{scenario}: nothing that is free can be played; wanted wider bounds in [design]")
    price = 1.0
    if goal == "accuracy":
        chosen = designer.at(value, thorough=True)
    else:
        chosen = designer.least_time(value, kind.step, longest)
        if chosen is not None and len(seeds):
            say(f"what {estimator} adds to the bound")
            price = _price(stage, chosen, estimator)
            chosen = designer.least_time(value / price, kind.step, longest) if price > 1 else chosen
    if chosen is None:
        chosen, sentence = _instead(designer, front, goal, published.time)
        remarks.append(sentence)
    found = Designed(
        str(scenario), task, kind.quantity, kind.axis, goal, value, estimator, price, chosen, published,
        thinned(designer.front([]), [chosen]), seeds=seeds, remarks=tuple(remarks),
    )  # fmt: skip
    return _proved(found, kind, stage, estimator, say) if len(seeds) else found


def kind_of(scenario: str | Path, quantity: str | None = None) -> tuple[Kind, str]:
    """The kind of a scenario's task, made of it, and its name.

    Parameters
    ----------
    scenario : str or Path
    quantity : str, optional
        What is sought, where the task has more than one.

    Raises
    ------
    InputError
        If it has no task.
    """
    loaded = load(scenario, None if quantity is None else {"design.quantity": quantity})
    name = check_task(loaded).kind
    procedure = kinds()[name][1].procedure
    if not procedure:
        raise InputError(f"{loaded.path}: task.kind = {name!r}; there is no design of procedures for it yet")
    return part(procedure)(loaded, Free.of(loaded)), name


def _goal(scenario: str, task: str, kind: Kind, asked: Asked, published: float) -> tuple[Goal, float]:
    """What is made least, and the other of the two."""
    given = load(scenario).table.design
    if asked.demanded is not None and asked.time is not None:
        raise InputError("--demanded and --time given; wanted one: the other of the two is made least")
    if asked.time is not None:
        value = quantity(asked.time, "time", "--time")
        if not value >= kind.step:
            raise InputError(f"--time {asked.time!r} given; wanted a step of the task, {kind.step:g} s, or more")
        return "accuracy", round(value / kind.step) * kind.step
    text, where = asked.demanded, "--demanded"
    if text is None and given is not None and given.demanded is not None:
        text, where = given.demanded, f"{scenario}: design.demanded"
    if text is None:
        return "time", kind.quantity.demanded
    if text == PUBLISHED and np.isfinite(published):
        return "time", published
    value = quantity_in(text, kinds()[task][1].demanded, where)
    if not value > 0:
        raise InputError(f"{where} = {text!r}; wanted more than zero")
    return "time", value


def _times(kind: Kind, published: float) -> tuple[float, float]:
    """Shortest and longest time of the front [s]."""
    if kind.free.given.time is not None:
        return kind.free.between("time", "time", (0.0, np.inf), (kind.step, np.inf))
    return max(published * SHORTEST, _STEPS * kind.step), published * LONGEST


def _price(stage: PlayStage, point: Point, estimator: str) -> float:
    """Deviation of the estimator over the bound."""
    name = stage.quantity.name
    table = stage.table(point.plan, estimator, range(_FIRST, _FIRST + _PRICED))
    told = float(np.sqrt(np.mean(table[f"cov.{name}.{name}"])))
    return float(np.clip(told / point.sd, *_PRICES))


def _instead(designer: Designer, front: Sequence[Point], goal: Goal, time: float) -> tuple[Point, str]:
    """What is shown where what was asked for cannot be had."""
    if goal == "accuracy":
        return front[0], "in the time that was given nothing can be played: this is the shortest procedure"
    nearest = designer.at(time, thorough=True) or front[-1]
    return nearest, (
        f"what is demanded is not reached within {front[-1].time:.4g} s: this is the best procedure of "
        f"{nearest.time:.4g} s"
    )


def _proved(found: Designed, kind: Kind, stage: PlayStage, estimator: str, say: Say) -> Designed:
    """With Monte Carlo and influences."""
    cases = [(DESIGNED, found.chosen, estimator), (PUBLISHED, found.published, estimator)]
    if kind.estimators[1] not in (estimator, ""):
        cases.append((PUBLISHED, found.published, kind.estimators[1]))
    checks = []
    for name, point, who in cases:
        say(f"{len(found.seeds)} runs of the {name} procedure with {who}")
        checks.append(stage.check(name, point.plan, who, found.seeds, point.sd if np.isfinite(point.sd) else None))
    plans = {DESIGNED: found.chosen.plan, PUBLISHED: found.published.plan}
    effects = kind.free.possible(found.scenario, kind.possible())
    influences = stage.influences(plans, estimator, effects, say)
    return replace(found, checks=tuple(checks), influences=influences)
