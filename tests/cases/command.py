"""The command as a user runs it, and a small recording for it: a table that reverses every 20 s."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from insenv.cli import main

#: What the small recording has beyond its declared bias and scale factor.
ASYMMETRY = 1e-3
DT = 0.1
MANIFEST = """\
title = "A table that reverses"
data = "run.csv"

[channels]
time = { column = "time", unit = "s" }
gyro = { column = "gyro", unit = "deg/s", covers = "interval" }
table_rate = { column = "table", unit = "deg/s", covers = "interval" }

[model]
target = "gyro"
declared = ["bias", "scale_factor"]

[noise]
angle_random_walk = "0.1 deg/sqrt(h)"
"""


def rows(n: int = 3000, seed: int = 1) -> list[str]:
    """Lines of the recording, the header first."""
    t = np.arange(n) * DT
    table = np.array([10.0, -10.0, 4.0, -4.0])[(t // 20 % 4).astype(int)]
    white = np.random.default_rng(seed).standard_normal(n) * (0.1 / 60 / np.sqrt(DT))
    gyro = table * (1 + 5e-5) + 0.01 + ASYMMETRY * np.abs(table) + white
    return ["time,gyro,table", *(f"{a:.3f},{b:.6f},{c:g}" for a, b, c in zip(t, gyro, table, strict=True))]


def write(folder: Path, manifest: str = MANIFEST, lines: list[str] | None = None) -> Path:
    """The manifest's path, with the recording beside it."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "run.csv").write_text("\n".join(rows() if lines is None else lines) + "\n")
    path = folder / "run.toml"
    path.write_text(manifest)
    return path


@contextmanager
def interruptible() -> Iterator[None]:
    """Programs started within heed Ctrl-C; they would ignore it where these tests run in the background of a shell."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    status: int
    out: str
    err: str


def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, *args: object) -> Ended:
    """`insenv` with ``args``, in this process: as the command itself, its handling of errors included."""
    monkeypatch.setattr(sys, "argv", ["insenv", *map(str, args)])
    capsys.readouterr()
    try:
        main()
        status: object = 0
    except SystemExit as end:
        status = end.code or 0
    text = capsys.readouterr()
    assert isinstance(status, int)
    return Ended(status, text.out, text.err)
