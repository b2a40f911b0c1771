"""Runs that were saved, and the loop that is closed on them: by the command, in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_REPORT, _FINDINGS = "report.html", "report.json"


@dataclass
class _Saved:
    manifest: Path
    said: str = ""
    state: str = "saved"


class Closing:
    """Saved runs of a session; ``tell`` is told how each of them gets on."""

    def __init__(self, tell: Callable[[dict[str, Any]], None]) -> None:
        self._tell = tell
        self._runs: list[_Saved] = []
        self._processes: list[subprocess.Popen[str]] = []

    @property
    def manifests(self) -> list[Path]:
        """Of the saved runs."""
        return [run.manifest for run in self._runs]

    def known(self) -> list[dict[str, Any]]:
        """All of them, as they are told."""
        return [self._shown(number) for number in range(len(self._runs))]

    def report(self, number: int) -> Path | None:
        """The page of a run, if the loop was closed on it."""
        there = 0 <= number < len(self._runs) and self._runs[number].state == "closed"
        return self._runs[number].manifest.with_name(_REPORT) if there else None

    def add(self, manifest: Path, close: bool) -> None:
        """A run that was written; ``close`` the loop on it."""
        self._runs.append(_Saved(manifest))
        number = len(self._runs) - 1
        if close:
            threading.Thread(target=self._close, args=(number,), daemon=True).start()
        else:
            self._say(number, "saved", "")

    def stop(self) -> None:
        """End what is still at work."""
        for process in self._processes:
            if process.poll() is None:
                process.terminate()

    def _close(self, number: int) -> None:
        path = self._runs[number].manifest
        self._say(number, "closing", "reading the recording")
        files = ["--html", str(path.with_name(_REPORT)), "--json", str(path.with_name(_FINDINGS))]
        process = subprocess.Popen(
            [sys.executable, "-m", "insenv", "close-loop", str(path), *files, "-v"],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, encoding="utf-8", errors="replace",
            env={**os.environ, "NO_COLOR": "1"},
        )  # fmt: skip
        self._processes.append(process)
        last = ""
        assert process.stderr is not None
        for line in process.stderr:
            last = line.strip()
            self._say(number, "closing", last.partition("] ")[2] or last)
        if process.wait() == 0:
            self._say(number, "closed", _verdict(path.with_name(_FINDINGS)))
        else:
            self._say(number, "failed", last)

    def _say(self, number: int, state: str, said: str) -> None:
        self._runs[number].state, self._runs[number].said = state, said
        self._tell({"saved": self._shown(number)})

    def _shown(self, number: int) -> dict[str, Any]:
        run = self._runs[number]
        return {"number": number, "path": str(run.manifest), "state": run.state, "said": run.said}


def _verdict(path: Path) -> str:
    """The verdict of a report and the effects that were added."""
    found = json.loads(path.read_text(encoding="utf-8"))
    added = [one["effect"] for one in found.get("added", [])]
    return str(found["verdict"]) + (f": {', '.join(dict.fromkeys(added))}" if added else "")
