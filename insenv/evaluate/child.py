"""Work in a process of its own, which is ended when nothing is heard of it for too long.

What another author wrote may crash, print, or never return. The child is given a function by name and an argument,
pickled; it says what it is about to do, line by line, and leaves its result in a file.
"""

from __future__ import annotations

import importlib
import json
import os
import pickle
import queue
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

#: What a child says: what it is about to do, and how much of its work is done.
Say = Callable[[str, float], None]

_PROGRAM = "from insenv.evaluate.child import main; main()"
#: A child that imports and compiles is given this much longer [s].
START = 120.0
_STARTING = ("", "its start", "its import")
#: Longest time between two looks at whether to stop [s].
_LOOK = 0.2


@dataclass(frozen=True)
class Ended:
    """How a child ended: its result, or why there is none, in words, and what it was doing."""

    result: Any = None
    fault: str = ""
    doing: str = ""


def same_imports() -> dict[str, str]:
    """The environment of a Python process that imports from where this one does."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path)}


class Child:
    """A process that works on ``function(argument, say)``.

    Parameters
    ----------
    function : str
        "module:name".
    argument : object
        Can be pickled.
    limit : float
        Longest silence [s].
    """

    def __init__(self, function: str, argument: Any, limit: float) -> None:
        self.limit, self.doing, self.share = limit, "", 0.0
        descriptor, name = tempfile.mkstemp(prefix="insenv-")
        os.close(descriptor)
        self._result = Path(name)
        self._process = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # what it starts ends with it
            env={**same_imports(), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        )
        self._lines: queue.Queue[bytes | None] = queue.Queue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        assert self._process.stdin is not None
        with suppress(BrokenPipeError), self._process.stdin as pipe:
            pickle.dump((function, name), pipe)
            pickle.dump(argument, pipe)

    def _read(self) -> None:
        assert self._process.stdout is not None
        with suppress(ValueError):
            for line in self._process.stdout:
                self._lines.put(line)
        self._lines.put(None)

    def wait(self, told: Callable[[Child], None] = lambda _: None) -> Ended:
        """Listen until it ends; ``told`` is called now and then, and may raise to end it."""
        silent = 0.0
        try:
            while True:
                try:
                    line = self._lines.get(timeout=_LOOK)
                except queue.Empty:
                    silent += _LOOK
                    if silent > self.limit + (START if self.doing in _STARTING else 0.0):
                        return Ended(fault=f"does not return within {self.limit:g} s{self._where()}", doing=self.doing)
                    told(self)
                    continue
                if line is None:
                    return self._end()
                silent = 0.0
                self.doing, self.share = json.loads(line)
                told(self)
        finally:
            self.end()

    def end(self) -> None:
        """Leave nothing behind."""
        with suppress(OSError):
            if hasattr(os, "killpg"):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.kill()
        self._process.wait()
        self._reader.join()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._result.unlink(missing_ok=True)

    def _where(self) -> str:
        return f" in {self.doing}" if self.doing else ""

    def _end(self) -> Ended:
        """What is in the file, once it is complete."""
        status = self._process.wait()
        data = self._result.read_bytes()
        if status or not data:
            by = f"signal {-status}" if status < 0 else f"exit status {status}"
            return Ended(fault=f"ended the process ({by}){self._where()}", doing=self.doing)
        ended: Ended = pickle.loads(data)
        return ended


def main() -> None:
    """The child's side: what a plug-in prints goes to standard error, and Ctrl-C is the parent's affair."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with open(os.dup(1), "w", buffering=1) as lines:
        os.dup2(2, 1)
        (function, name), argument = pickle.load(sys.stdin.buffer), pickle.load(sys.stdin.buffer)
        module, _, attribute = function.partition(":")
        ended = _worked(getattr(importlib.import_module(module), attribute), argument, lines)
        Path(name).write_bytes(pickle.dumps(ended))


def _worked(function: Callable[[Any, Say], Any], argument: Any, lines: IO[str]) -> Ended:
    from insenv.core.errors import InputError

    def say(doing: str, share: float = 0.0) -> None:
        lines.write(json.dumps([doing, share]) + "\n")

    say("its start")
    try:
        return Ended(function(argument, say))
    except InputError as error:
        return Ended(fault=str(error))
