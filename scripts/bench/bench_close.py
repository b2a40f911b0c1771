"""Closing the loop on an hour at 100 Hz, full catalogue, over recordings of many kinds, and on ten times the samples.

CPU time of one thread for each recording once, the first of a process left out; the peak of memory is the process's.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median

import numpy as np
from bench_line import Line

from insenv.close import close
from insenv.core.recording import Floats

ROWS, DT = 360_000, 0.01
#: Motion of the table, and what is spoilt or added.
KINDS: tuple[tuple[str, str], ...] = (
    ("rest", ""),
    ("rest", "step"),
    ("rest", "line"),
    ("rest", "lost"),
    ("constant", ""),
    ("constant", "harmonic"),
    ("reversal", ""),
    ("reversal", "line"),
    ("reversal", "spikes"),
    ("staircase", "harmonic"),
    ("sine", ""),
    ("sine", "lost"),
)


def rates(kind: str, n: int) -> Floats:
    """Table rate [rad/s]."""
    t = np.arange(n) * DT
    if kind == "constant":
        return np.full(n, 0.35)
    if kind == "reversal":
        return 0.3 * np.sign(np.sin(2 * np.pi * t / 300) + 1e-9)
    if kind == "staircase":
        return 0.1 * (1 + (t // 300) % 10) * (-1) ** (t // 300)
    return 0.6 * np.sin(2 * np.pi * t / 100) if kind == "sine" else np.zeros(n)


def write_recording(folder: Path, kind: str, spoilt: str, n: int, seed: int = 0) -> Path:
    """An npz file and its manifest."""
    rng = np.random.Generator(np.random.SFC64(seed))
    t, rate = np.arange(1, n + 1) * DT, rates(kind, n)
    angle = np.cumsum(rate) * DT
    y = 1.0003 * rate + 2e-5 + 2e-5 * rng.standard_normal(n) + 1e-9 * np.cumsum(rng.standard_normal(n))
    temperature = 25 + 6 * (1 - np.exp(-t / 1500)) + np.sin(2 * np.pi * t / 2500)
    if spoilt == "step":
        y += 5e-7 * (t > 0.3 * t[-1])
    elif spoilt == "line":
        y += 5e-5 * np.sin(2 * np.pi * 29.9 * t + np.cumsum(0.01 * rng.standard_normal(n)))
    elif spoilt == "harmonic":
        y += 5e-6 * np.gradient(np.cos(angle), DT)
    elif spoilt == "spikes":
        y[rng.integers(0, n, 30)] += 0.01
    kept = rng.random(n) > 0.02 if spoilt == "lost" else np.ones(n, bool)
    columns = {"t": t, "gyro": y, "temp": temperature} | ({} if kind == "rest" else {"angle": angle, "rate": rate})
    np.savez(folder / "run.npz", **{name: values[kept] for name, values in columns.items()})  # type: ignore[arg-type]
    table = 'table_angle = { column = "angle", unit = "rad" }\ntable_rate = { column = "rate", unit = "rad/s" }\n'
    (folder / "run.toml").write_text(
        'data = "run.npz"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "gyro", unit = "rad/s", covers = "interval" }\n'
        'temperature = { column = "temp", unit = "degC" }\n'
        + ("" if kind == "rest" else table)
        + '[model]\ntarget = "gyro"\ndeclared = ["bias"'
        + ("]\n" if kind == "rest" else ', "scale_factor"]\n')
    )
    return folder / "run.toml"


def seconds(kind: str, spoilt: str, n: int) -> float:
    """CPU time of one call [s]."""
    with tempfile.TemporaryDirectory() as name:
        manifest = write_recording(Path(name), kind, spoilt, n)
        start = time.process_time()
        close(manifest)
        return time.process_time() - start


def closing(kinds: Sequence[tuple[str, str]] = KINDS) -> Iterator[Line]:
    """Median and longest over the kinds; then ten times the samples of one of them."""
    seconds("rest", "", ROWS // 10)
    each = {kind: seconds(*kind, ROWS) for kind in kinds}
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    worst = max(each, key=lambda kind: each[kind])
    work = f"close the loop, {ROWS} rows, {len(each)} recordings"
    yield Line(work, f"{median(each.values()):.1f} s", "median <= 3 s", f"peak of memory {peak:.0f} MB", "", None)
    yield Line("    the longest", f"{each[worst]:.1f} s", "<= 10 s", " ".join(filter(None, worst)), "", None)
    kind = kinds[0]
    ratio = seconds(*kind, 10 * ROWS) / each[kind]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    yield Line("    ten times the rows", f"{ratio:.1f} x", "<= 12 x", f"peak of memory {peak:.0f} MB", "", None)


ALL = (closing,)

if __name__ == "__main__":
    for line in closing([KINDS[int(i)] for i in sys.argv[1:]] or KINDS):
        print(line.work, line.found, line.bar, line.alternative, flush=True)
