"""Plug-ins that are played in another process (`insenv.evaluate.host`), as if they were here.

The simulator's process holds the truth; what another author wrote could read it off the stack, or find it among all
objects. So estimators and policies are asked over a pipe. What they answer is checked to be numbers. Where their
process ends, this one ends in the same way, and whoever watches it (`insenv.evaluate.child`) says whose fault it was.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, NoReturn, Protocol

import msgspec
import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.plugins import ESTIMATORS, POLICIES, find
from insenv.core.recording import Floats, Recording
from insenv.evaluate.child import same_imports
from insenv.evaluate.host import LENGTH, NUMBERS, Numbers, Reply, Request
from insenv.evaluate.watched import Timed, Watched

#: Of a pipe [bytes].
_ROOM = 1 << 20
_PROGRAM = "from insenv.evaluate.host import main; main()"


class Stage(Protocol):
    """Where plug-ins are played; ``cpu`` is the time that they took outside this process [s]."""

    cpu: float

    def estimator(self, name: str) -> Callable[[Datasheet], Any]:
        """What makes the estimator of that name, timed."""

    def policy(self, name: str) -> Callable[[Datasheet], Any]:
        """What makes the policy of that name, watched."""


class InProcess:
    """In this process, for plug-ins that are trusted."""

    cpu = 0.0

    def estimator(self, name: str) -> Callable[[Datasheet], Any]:
        """As of a `Stage`."""
        made = find(ESTIMATORS, name)
        return lambda datasheet: Timed(made(datasheet))

    def policy(self, name: str) -> Callable[[Datasheet], Any]:
        """As of a `Stage`."""
        made = find(POLICIES, name)
        return lambda datasheet: Watched(name, made(datasheet))


class Apart:
    """In a process that never holds the truth."""

    def __init__(self) -> None:
        self.cpu = 0.0
        self._dropped: list[int] = []
        self._chunk: Recording | None = None
        self._decoder = msgspec.msgpack.Decoder(Reply)
        self._process = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=same_imports(),
        )
        _widen(self._process.stdin)

    def estimator(self, name: str) -> Callable[[Datasheet], Any]:
        """As of a `Stage`."""
        return lambda datasheet: _Estimator(self, self._made(ESTIMATORS, name, datasheet))

    def policy(self, name: str) -> Callable[[Datasheet], Any]:
        """As of a `Stage`."""
        return lambda datasheet: _Policy(self, self._made(POLICIES, name, datasheet), name)

    def load(self, estimators: Sequence[str], policy: str) -> None:
        """Import plug-ins, which may take long; what cannot be imported is told where it is made."""
        for group, name in (*((ESTIMATORS, name) for name in estimators), (POLICIES, policy)):
            with suppress(Exception):
                self.ask(Request("import", given=(group, name)))

    def ask(self, request: Request, chunk: Recording | None = None) -> Reply:
        """What the other process answers; a chunk that it has already is not sent again."""
        if chunk is not None and chunk is not self._chunk:
            # Its label names the scenario, which is nobody's business.
            request = replace(request, chunk=replace(chunk, label=""))
            self._chunk = chunk
        dropped, self._dropped = tuple(self._dropped), []
        assert self._process.stdin is not None and self._process.stdout is not None
        try:
            pickle.dump(replace(request, dropped=dropped), self._process.stdin, pickle.HIGHEST_PROTOCOL)
            self._process.stdin.flush()
        except BrokenPipeError:
            self._lost()
        head = self._process.stdout.read(LENGTH.size)
        data = self._process.stdout.read(LENGTH.unpack(head)[0]) if len(head) == LENGTH.size else b""
        try:
            answer = self._decoder.decode(data)
        except (msgspec.DecodeError, msgspec.ValidationError):
            self._lost()
        self.cpu += answer.cpu
        if answer.error is not None:
            kind, text = answer.error
            raise InputError(text) if kind == "InputError" else type(kind, (Exception,), {})(text)
        return answer

    def drop(self, key: int) -> None:
        """Nobody needs that state any more."""
        self._dropped.append(key)

    def close(self) -> None:
        """End the other process."""
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                with suppress(BrokenPipeError):
                    pipe.close()
        self._process.kill()
        self._process.wait()

    def _made(self, group: str, name: str, datasheet: Datasheet) -> int:
        return self.ask(Request("make", given=(group, name, datasheet))).key

    def _lost(self) -> NoReturn:
        """End as the other process ended."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(5.0)
        status = self._process.poll()
        if status is None:  # it goes on, and answers nonsense
            self._process.kill()
            status = 1
        if status < 0:
            signal.signal(-status, signal.SIG_DFL) if -status not in (signal.SIGKILL, signal.SIGSTOP) else None
            os.kill(os.getpid(), -status)
        os._exit(max(status, 0))


def _widen(pipe: Any) -> None:
    """Room for a whole chunk, where the system lets it: else both processes take turns at every 64 kB."""
    with suppress(ImportError, AttributeError, OSError):
        import fcntl

        fcntl.fcntl(pipe.fileno(), fcntl.F_SETPIPE_SZ, _ROOM)


class _State:
    """A state that stands in the other process."""

    def __init__(self, stage: Apart, key: int) -> None:
        self._stage, self.key = stage, key

    def rows(self, index: NDArray[np.int64]) -> _State:
        """Of the runs ``index``; see `insenv.core.rows`."""
        return _State(self._stage, self._stage.ask(Request("rows", state=self.key, given=(index,))).key)

    def __del__(self) -> None:
        self._stage.drop(self.key)


class _Estimator:
    """An `insenv.core.estimate.Estimator` there; ``cpu`` is the time of its calls [s]."""

    def __init__(self, stage: Apart, key: int) -> None:
        self._stage, self._key, self.cpu = stage, key, 0.0

    def reset(self, batch: int | None = None) -> _State:
        """As of the estimator."""
        return self._state(self._answer(Request("reset", self._key, given=(batch,))))

    def update(self, state: _State, chunk: Recording) -> _State:
        """As of the estimator."""
        return self._state(self._answer(Request("update", self._key, state.key), chunk))

    def estimate(self, state: _State) -> Any:
        """As of the estimator, whatever it is."""
        answer = self._answer(Request("estimate", self._key, state.key))
        if answer.other:
            return type(answer.other, (), {})()
        mean, cov = (_array(one) for one in answer.arrays)
        return Estimate(answer.names, answer.units, mean, cov)

    def _answer(self, request: Request, chunk: Recording | None = None) -> Reply:
        before = self._stage.cpu
        try:
            return self._stage.ask(request, chunk)
        finally:
            self.cpu += self._stage.cpu - before

    def _state(self, answer: Reply) -> _State:
        return _State(self._stage, answer.key)


class _Policy:
    """An `insenv.core.estimate.Policy` there, and whether it ever looked at an estimate."""

    def __init__(self, stage: Apart, key: int, name: str) -> None:
        self._stage, self._key, self.name, self.looked = stage, key, name, False

    def reset(self, batch: int | None = None) -> _State:
        """As of the policy."""
        return _State(self._stage, self._stage.ask(Request("reset", self._key, given=(batch,))).key)

    def act(self, state: _State, chunk: Recording | None, estimate: Estimate | None) -> Any:
        """As of the policy, whatever it is."""
        request = Request("act", self._key, state.key, (estimate,), blank=chunk is None)
        answer = self._stage.ask(request, chunk)
        self.looked |= answer.looked
        if answer.other:
            return type(answer.other, (), {})()
        (action,) = answer.arrays
        return _array(action), _State(self._stage, answer.key)


def _array(given: Numbers) -> Floats:
    """An array of numbers; of what is none one of that type, which whoever uses it refuses."""
    dtype = np.dtype(given.dtype)
    if dtype.kind not in NUMBERS:
        return np.empty(given.shape, dtype)
    return np.frombuffer(given.data, dtype).reshape(given.shape).copy()
