"""The process in which plug-ins are played: it is given datasheets, recordings and estimates, and never the truth.

The simulator (`insenv.evaluate.remote`) sends requests, pickled; answers go back as numbers and texts alone (msgpack),
so that nothing a plug-in says is run over there. States stay here and are known by number.
"""

from __future__ import annotations

import os
import pickle
import signal
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import IO, Any

import msgspec
import numpy as np

from insenv.core.estimate import Datasheet, Estimate
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.recording import Recording
from insenv.core.rows import rows
from insenv.evaluate.watched import Watched, copied

#: Kinds of numbers that an answer may have.
NUMBERS = "fiub"
LENGTH = struct.Struct("<Q")


@dataclass(frozen=True)
class Request:
    """One call.

    Attributes
    ----------
    what : str
        "import", "make", "rows", or a method of a plug-in.
    key : int
        The plug-in.
    state : int, optional
        The state that it is given.
    given : tuple
        Further arguments.
    chunk : Recording, optional
        A new one; it stays the present one until the next.
    blank : bool
        Whether there is no chunk.
    dropped : tuple of int
        States that nobody needs any more.
    """

    what: str
    key: int = -1
    state: int | None = None
    given: tuple[Any, ...] = ()
    chunk: Recording | None = None
    blank: bool = False
    dropped: tuple[int, ...] = ()


class Numbers(msgspec.Struct, frozen=True):
    """An array; without bytes where it holds no numbers."""

    dtype: str
    shape: tuple[int, ...]
    data: bytes


class Reply(msgspec.Struct, frozen=True, omit_defaults=True):
    """What a call gave: a plug-in or a state by number, an estimate, an action, what is none by its type, an error."""

    key: int = -1
    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    arrays: tuple[Numbers, ...] = ()
    other: str = ""
    error: tuple[str, str] | None = None
    looked: bool = False
    cpu: float = 0.0


class Host:
    """Plug-ins and states by number."""

    def __init__(self) -> None:
        self._things: dict[int, Any] = {}
        self._last = 0
        self._chunk: Recording | None = None

    def answer(self, request: Request) -> Reply:
        """Of one request; whatever a plug-in raises is told."""
        for key in request.dropped:
            self._things.pop(key, None)
        if request.chunk is not None:
            self._chunk = request.chunk
        began = time.process_time()
        try:
            with np.errstate(invalid="ignore"):
                found = self._answered(request)
        except Exception as error:  # whatever another author's code raises
            found = Reply(error=(type(error).__name__, str(error)))
        plugin = self._things.get(request.key)
        looked = isinstance(plugin, Watched) and plugin.looked
        return msgspec.structs.replace(found, cpu=time.process_time() - began, looked=looked)

    def _answered(self, request: Request) -> Reply:
        if request.what == "import":
            find(*request.given)
            return Reply()
        state = None if request.state is None else self._things[request.state]
        if request.what in ("make", "rows"):
            thing = _made(*request.given) if request.what == "make" else rows(state, *request.given)
            return Reply(self._kept(thing))
        call: Callable[..., Any] = getattr(self._things[request.key], request.what)
        if request.what == "reset":
            return Reply(self._kept(call(*request.given)))
        if request.what == "estimate":
            return _as_answer(call(state))
        chunk = None if request.blank or self._chunk is None else copied(self._chunk)
        if request.what == "update":
            return Reply(self._kept(call(state, chunk)))
        return self._acted(call(state, chunk, *request.given))

    def _acted(self, answer: Any) -> Reply:
        """An action and the state after it."""
        if not isinstance(answer, tuple) or len(answer) != 2:
            return Reply(other=type(answer).__name__)
        try:
            action = np.asarray(answer[0])
        except ValueError:  # rows of different lengths
            action = np.empty(0, object)
        return Reply(self._kept(answer[1]), arrays=(_numbers(action),))

    def _kept(self, thing: Any) -> int:
        self._last += 1
        self._things[self._last] = thing
        return self._last


def _made(group: str, name: str, datasheet: Datasheet) -> Any:
    plugin = find(group, name)(datasheet)
    return plugin if group == ESTIMATORS else Watched(name, plugin)


def _as_answer(estimate: Any) -> Reply:
    if not isinstance(estimate, Estimate):
        return Reply(other=type(estimate).__name__)
    names, units = (tuple(str(text) for text in some) for some in (estimate.names, estimate.units))
    return Reply(names=names, units=units, arrays=(_numbers(estimate.mean), _numbers(estimate.cov)))


def _numbers(values: Any) -> Numbers:
    array = np.asarray(values)
    data = np.ascontiguousarray(array).tobytes() if array.dtype.kind in NUMBERS else b""
    return Numbers(array.dtype.str, array.shape, data)


def found(job: tuple[tuple[str, str], ...], say: Callable[[str, float], None]) -> None:
    """Whether plug-ins of these groups and names can be imported.

    Raises
    ------
    InputError
        Of the first that cannot.
    """
    for group, name in job:
        say(f"the import of {name!r}", 0.0)
        find(group, name)


def main() -> None:
    """Answer until nobody asks any more; what a plug-in prints goes to standard error."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with open(os.dup(0), "rb") as requests, open(os.dup(1), "wb") as answers:
        os.dup2(2, 1)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        serve(requests, answers)


def serve(requests: IO[bytes], answers: IO[bytes]) -> None:
    """Answer each request."""
    host, encoder = Host(), msgspec.msgpack.Encoder()
    while True:
        try:
            request: Request = pickle.load(requests)
        except EOFError:
            return
        data = encoder.encode(host.answer(request))
        answers.write(LENGTH.pack(len(data)))
        answers.write(data)
        answers.flush()
