"""The part of `insenv.evaluate.check.plugin` that runs the plug-in, in a process without a simulator."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

from insenv.core.errors import InputError
from insenv.core.plugins import EFFECTS, ESTIMATORS, POLICIES, find, names
from insenv.core.stateful import Adapter
from insenv.core.units import dimension_of
from insenv.evaluate.check.estimator import check_estimator, why_unsuited
from insenv.evaluate.check.policy import check_policy
from insenv.evaluate.check.rules import DeclinedError, FaultError
from insenv.evaluate.child import Say
from insenv.evaluate.trials import TrialRuns

#: Where the truth is: what is imported of these, a plug-in reaches for.
SIMULATOR = ("insenv.systems", "insenv.envs", "insenv.scenario", "insenv.rig", "insenv.rig_dwells", "insenv.plants")
_METHODS = {ESTIMATORS: "estimate", POLICIES: "act"}


@dataclass(frozen=True)
class PluginKind:
    """Group of a plug-in, whether it keeps its state in itself, and, of an effect, what is wrong with it."""

    group: str
    stateful: bool = False
    faults: tuple[str, ...] = ()


@dataclass(frozen=True)
class Tried:
    """How a plug-in did on the runs of an environment.

    Attributes
    ----------
    environment : str
    declined : str
        Why it is not for them, in its words; empty: it takes them.
    faults : tuple of str
    """

    environment: str
    declined: str = ""
    faults: tuple[str, ...] = ()


def kind(name: str, say: Say) -> PluginKind:
    """What a plug-in is.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    say("its import", 0.0)
    group, found = _found(name)
    if group != EFFECTS:
        return PluginKind(group, isinstance(found, Adapter))
    from insenv.effects.check import check_effect

    say("its check", 0.0)
    try:
        effect = found() if isinstance(found, type) else found
    except Exception as error:  # whatever another author's code raises
        return PluginKind(group, faults=(f"it cannot be made without arguments ({error}); wanted defaults for all",))
    return PluginKind(group, faults=tuple(check_effect(effect)))


def tried(job: tuple[str, str, tuple[TrialRuns, ...]], say: Say) -> tuple[Tried, ...]:
    """Try the plug-in of a name and group on trials, and say what simulators it holds afterwards.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    name, group, trials = job
    dimension_of("rad")  # what reads units is loaded before the first call, whose time is watched
    plugin = find(group, name)
    check = check_estimator if group == ESTIMATORS else check_policy
    found = tuple(_on(check, plugin, trial, say) for trial in trials)
    reached = sorted({m for m in SIMULATOR if any(have == m or have.startswith(m + ".") for have in sys.modules)})
    if not reached:
        return found
    fault = (
        f"it imports {', '.join(reached)}, by which the truth can be reached; wanted it to see its datasheet and "
        f"recordings alone: leave the simulator to other modules"
    )
    return (*found, Tried("", faults=(fault,)))


def _on(check: Callable[..., list[str]], plugin: Callable[..., Any], trial: TrialRuns, say: Say) -> Tried:
    def said(doing: str, share: float) -> None:
        say(f"{doing} on {trial.name}", share)

    try:
        faults = tuple(check(plugin, trial, said))
        if not faults and check is check_estimator and (reason := why_unsuited(plugin, trial)):
            return Tried(trial.name, declined=reason)
        return Tried(trial.name, faults=faults)
    except DeclinedError as error:
        return Tried(trial.name, declined=str(error))
    except FaultError as error:
        return Tried(trial.name, faults=(str(error),))


def _found(name: str) -> tuple[str, Any]:
    """Group and class of an entry point, or of "module:Name" by the methods that it has."""
    groups = (ESTIMATORS, POLICIES, EFFECTS)
    if ":" not in name:
        for group in groups:
            if name in names(group):
                return group, find(group, name)
        known = [n for group in groups for n in names(group)]
        near = get_close_matches(name, known, 1)
        wanted = f"did you mean {near[0]!r}?" if near else f"wanted one of {', '.join(known)}, or module:Name"
        raise InputError(f"plug-in {name!r} is not installed; {wanted}")
    try:
        found = find(EFFECTS, name)  # as it is written, not adapted
    except InputError as error:
        # What it is meant to be nobody knows yet.
        raise InputError(str(error).replace("effect", "plug-in", 1)) from None
    for group, method in _METHODS.items():
        if callable(getattr(found, method, None)):
            return group, find(group, name)
    if hasattr(found, "linear") or hasattr(found, "apply"):
        return EFFECTS, found
    raise InputError(
        f"plug-in {name!r} has neither estimate() nor act(), and is no effect; wanted an estimator, a policy or one"
    )
