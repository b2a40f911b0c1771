"""A plug-in that keeps what it learns in itself, adapted to the interface in which states go in and come out.

    class Mean:                                      class Plan:
        def __init__(self, datasheet): ...               def __init__(self, datasheet): ...
        def update(self, block): ...                     def act(self, block, estimate): ...   -> action
        def estimate(self): ...  -> Estimate

Each run of a batch gets a copy of its own, which is handed the run's own block without a batch axis. A step works on a
copy of the copy, so that a state that was kept is not changed behind its keeper's back. It costs a loop over the runs.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.rows import row_of


@dataclass(frozen=True)
class Copies:
    """Plug-ins of some runs; ``single``: of one run that has no batch axis."""

    each: tuple[Any, ...]
    single: bool = False

    def rows(self, index: NDArray[np.int64]) -> Copies:
        """Those of the runs ``index``; see `insenv.core.rows`."""
        return Copies(tuple(self.each[int(i)] for i in index))


class Stateful:
    """Base: a class that keeps its state in itself, made once and copied for each run."""

    def __init__(self, made: Callable[..., Any], datasheet: Datasheet) -> None:
        self.fresh, self.datasheet = made(datasheet), datasheet

    def reset(self, batch: int | None = None) -> Copies:
        """Copies that have seen nothing."""
        return Copies(tuple(self._begun() for _ in range(batch or 1)), batch is None)

    def _begun(self) -> Any:
        """A copy; its own ``reset``, where it has one without arguments, is called."""
        copy = self._copied(self.fresh)
        if callable(begin := getattr(copy, "reset", None)) and not _arguments(begin):
            begin()
        return copy

    def _copied(self, one: Any) -> Any:
        """A copy of everything but the datasheet, which nobody changes and which is large."""
        return deepcopy(one, {id(self.datasheet): self.datasheet})


class StatefulEstimator(Stateful):
    """Has ``update(block)`` and ``estimate()``."""

    def update(self, state: Copies, chunk: Recording) -> Copies:
        """Each copy is handed its own row."""
        each = self._copied(state.each)
        for row, copy in enumerate(each):
            copy.update(chunk if state.single else row_of(chunk, row))
        return replace(state, each=each)

    def estimate(self, state: Copies) -> Estimate:
        """What the copies say, one below the other.

        Raises
        ------
        InputError
            If one says no `Estimate`, or of other quantities than the first.
        """
        told = [copy.estimate() for copy in self._copied(state.each)]
        for one in told:
            if not isinstance(one, Estimate):
                raise InputError(f"estimate() returned a {type(one).__name__}; wanted an Estimate")
            if one.names != told[0].names:
                raise InputError(f"one run tells {', '.join(one.names)}, another {', '.join(told[0].names)}")
        if state.single:
            return told[0]
        return replace(told[0], mean=_stacked([e.mean for e in told]), cov=_stacked([e.cov for e in told]))


class StatefulPolicy(Stateful):
    """Has ``act(block, estimate)``, which returns an action."""

    def act(self, state: Copies, chunk: Recording | None, estimate: Estimate | None) -> tuple[Floats, Copies]:
        """Actions of the copies, one below the other."""
        each = self._copied(state.each)
        if state.single:
            return np.asarray(each[0].act(chunk, estimate)), replace(state, each=each)
        actions = []
        for row, copy in enumerate(each):
            known = None if estimate is None else replace(estimate, mean=estimate.mean[row], cov=estimate.cov[row])
            actions.append(copy.act(None if chunk is None else row_of(chunk, row), known))
        return _stacked(actions), replace(state, each=each)


@dataclass(frozen=True)
class Adapter:
    """What makes the adapted plug-in of a datasheet, as its class would."""

    made: Callable[..., Any]
    kind: type[Stateful]

    def __call__(self, datasheet: Datasheet) -> Stateful:
        """The plug-in."""
        return self.kind(self.made, datasheet)


def adapted(made: Callable[..., Any]) -> Callable[..., Any]:
    """The class itself if its methods take a state, else what adapts it."""
    update, act = getattr(made, "update", None), getattr(made, "act", None)
    if callable(update) and _keeps(update, 1):
        return Adapter(made, StatefulEstimator)
    if callable(act) and _keeps(act, 2):
        return Adapter(made, StatefulPolicy)
    return made


def _keeps(method: Callable[..., Any], most: int) -> bool:
    """Whether a method of a class takes ``most`` arguments beside ``self`` at most: then no state is among them."""
    return inspect.isfunction(method) and 0 < len(_arguments(method)) <= most + 1 and "state" not in _arguments(method)


def _arguments(method: Callable[..., Any]) -> list[str]:
    """Names of the positional arguments; with ``*args`` as many as one likes."""
    try:
        parameters = inspect.signature(method).parameters.values()
    except (TypeError, ValueError):
        return []
    if any(p.kind is p.VAR_POSITIONAL for p in parameters):
        return ["*"] * 9
    return [p.name for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]


def _stacked(values: Sequence[Any]) -> Floats:
    """Rows of equal shape as one array.

    Raises
    ------
    InputError
        If they have other shapes.
    """
    try:
        return np.stack([np.asarray(value, float) for value in values])
    except (TypeError, ValueError) as error:
        raise InputError(f"the runs of a batch gave what does not fit together: {error}") from None
