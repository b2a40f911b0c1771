"""Whether a plug-in keeps its contract: on runs of each environment, in a process of its own without a simulator."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from insenv.core.errors import InputError
from insenv.core.plugins import EFFECTS, ESTIMATORS, POLICIES
from insenv.core.system import system, systems
from insenv.evaluate.check.child import PluginKind, Tried
from insenv.evaluate.child import Child
from insenv.evaluate.trials import trial

#: Longest time of one call [s].
LIMIT = 60.0
_WORDS = {ESTIMATORS: "estimator", POLICIES: "policy", EFFECTS: "effect"}


@dataclass(frozen=True)
class Checked:
    """What was found of a plug-in.

    Attributes
    ----------
    name, kind : str
        "estimator", "policy" or "effect".
    stateful : bool
        Whether it keeps its state in itself, and was adapted.
    tried : tuple of Tried
        By environment.
    faults : tuple of str
        Wherever it was tried.
    """

    name: str
    kind: str
    stateful: bool = False
    tried: tuple[Tried, ...] = ()
    faults: tuple[str, ...] = ()

    @property
    def kept(self) -> bool:
        """Whether it keeps its contract: no fault, and one environment at least whose runs it takes."""
        sound = not self.faults and not any(one.faults for one in self.tried)
        return sound and (self.kind == "effect" or any(not one.declined for one in self.tried if one.environment))

    def __str__(self) -> str:
        lines = [f"{self.kind} {self.name}"]
        if self.stateful:
            lines.append("  It keeps its state in itself and is adapted: one copy for each run, in a loop.")
        lines += [f"  - {fault}" for fault in self.faults]
        width = max((len(one.environment) for one in self.tried), default=0)
        for one in self.tried:
            if one.declined:
                lines.append(f"  {one.environment:{width}}  not for it: {one.declined}")
            elif not one.faults:
                lines.append(f"  {one.environment:{width}}  sound")
            lines += [f"  {one.environment:{width}}  - {fault}" for fault in one.faults]
        return "\n".join([*lines, "OK: it keeps the contract." if self.kept else f"{self._verdict()}."])

    def _verdict(self) -> str:
        if self.faults or any(one.faults for one in self.tried):
            return "It does not keep the contract; each line that begins with a dash says what to mend"
        return "No environment that it was tried on can judge it: each line says what it lacks"


def check_plugin(
    name: str,
    environments: Sequence[str] | None = None,
    limit: float = LIMIT,
    say: Callable[[str], None] = lambda text: None,
) -> Checked:
    """Check an estimator, a policy or an effect.

    Parameters
    ----------
    name : str
        Of an entry point, or "module:Name".
    environments : sequence of str, optional
        Names of systems, "NorthFinder"; all.
    limit : float
        Longest time of one call [s].
    say : callable
        Told what is being done.

    Raises
    ------
    InputError
        If there is no such plug-in or environment.
    """
    wanted = tuple(systems()) if environments is None else tuple(system(each).name for each in environments)
    ended = Child("insenv.evaluate.check.child:kind", name, limit).wait()
    if not isinstance(found := ended.result, PluginKind):
        raise InputError(ended.fault if name in ended.fault else f"plug-in {name!r} {ended.fault}")
    if found.group == EFFECTS:
        return Checked(name, "effect", faults=found.faults)
    trials = []
    for each in wanted:
        say(f"recording runs of {each}")
        trials.append(trial(each))
    child = Child("insenv.evaluate.check.child:tried", (name, found.group, tuple(trials)), limit)
    ended = child.wait(lambda c: say(c.doing))
    tried = ended.result if ended.result is not None else ()
    faults = (f"it {ended.fault}",) if ended.fault else ()
    return Checked(name, _WORDS[found.group], found.stateful, tried, faults)
