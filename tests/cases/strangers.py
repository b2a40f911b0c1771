"""Recordings as strangers bring them: simulated runs spoilt in one way each, written as a table with a manifest.

A `Shape` is a function that turns the columns of a sound run into those of a stranger's file; what a manifest says
of it stands beside it. Columns are in SI units and named like the channels.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from simulated_runs import Injection, Simulated, gyro_run, scaled

from insenv.close import close
from insenv.core.recording import Floats
from insenv.identify.findings import Findings, TargetFindings

Columns = dict[str, Floats]
UNITS = {"time": "s", "gyro": "rad/s", "table_angle": "rad", "table_rate": "rad/s", "temperature": "K"}
COVERS = ("gyro", "table_rate")
#: Long means: a test wants an answer, not all that a recording tells.
MEANS = '[held_out]\naveraging = "1 s"\n'


@dataclass(frozen=True)
class Shape:
    """How a stranger's file departs from a sound one, and what its manifest says of it."""

    spoil: Callable[[Columns, np.random.Generator], Columns]
    says: Mapping[str, str] = field(default_factory=dict)
    dt: float = 0.1


def columns(run: Simulated) -> Columns:
    """Time and channels of a run."""
    return {"time": run.recording.t.copy(), **{n: c.values.copy() for n, c in run.recording.channels.items()}}


def kept(c: Columns, rows: np.ndarray) -> Columns:
    """The columns with some rows only."""
    return {name: values[rows] for name, values in c.items()}


def lost(c: Columns, start: float, stop: float) -> Columns:
    """The columns with a gap [s]."""
    return kept(c, (c["time"] < start) | (c["time"] >= stop))


def merged(c: Columns, edges: np.ndarray) -> Columns:
    """Rows that end at the rows ``edges`` of a finer recording: means of what covers its interval, else last values."""
    edges = edges[edges < len(c["time"])]
    out = {}
    for name, values in c.items():
        if name in COVERS:
            total = np.concatenate([[0.0], np.cumsum(values)])
            ends = np.concatenate([[0], edges + 1])
            out[name] = np.diff(total[ends]) / np.diff(ends)
        else:
            out[name] = values[edges]
    return out


def write(
    folder: Path, runs: list[Columns], says: Mapping[str, str], declared: tuple[str, ...], name: str = "run"
) -> Path:
    """Data files and a manifest; ``says`` maps a channel to further keys, "" to further lines."""
    files = []
    for i, c in enumerate(runs, start=1):
        path = folder / f"{name}_{i}.csv"
        table = np.column_stack(list(c.values()))
        np.savetxt(path, table, "%.15g", ",", header=",".join(c), comments="")
        files.append(path.name)
    lines = [] if "[[runs]]" in says.get("", "") else [f"data = {files!r}".replace("'", '"')]
    lines.append("[channels]")
    for channel in runs[0]:
        extra = says.get(channel, "")
        unit = "" if "unit" in extra else f', unit = "{UNITS[channel]}"'
        covers = (
            ', covers = "interval"' if channel in COVERS and "covers" not in extra and "quantity" not in extra else ""
        )
        lines.append(f'{channel} = {{ column = "{channel}"{unit}{covers}{", " + extra if extra else ""} }}')
    lines += ["[model]", 'target = "gyro"', f"declared = {list(declared)!r}".replace("'", '"'), says.get("", MEANS)]
    manifest = folder / f"{name}.toml"
    manifest.write_text("\n".join(lines))
    return manifest


def run_of(kind: str, seed: int, added: tuple[Injection, ...], snr: float, dt: float, duration: float) -> Simulated:
    """A run with effects of a given strength each."""
    bare = gyro_run(kind, seed, duration=duration, dt=dt)
    sized = tuple((key, scaled(bare, key, np.asarray(theta, float), snr)) for key, theta in added)
    return gyro_run(kind, seed, sized, duration, dt)


def closed_file(
    folder: Path, shape: Shape, kind: str, seed: int, added: tuple[Injection, ...] = (), duration: float = 1800.0
) -> Findings:
    """The findings on a run that was spoilt by ``shape``; the ``added`` effects are of twenty deviations each."""
    run = run_of(kind, seed, added, 20.0, shape.dt, duration)
    spoilt = shape.spoil(columns(run), np.random.default_rng(10_000 + seed))
    declared = ("bias",) if kind == "rest" else ("bias", "scale_factor")
    return close(write(folder, [spoilt], shape.says, declared))


#: A gyro beside a rate of which nobody says where it comes from.
_RATE_FILE = """\
data = "log.csv"
[channels]
time = { column = "t", unit = "s" }
gyro = { column = "g", unit = "rad/s" }
table_rate = { column = "w", unit = "rad/s" }
[model]
target = "gyro"
declared = ["bias", "scale_factor"]
"""


def closed_rate_file(folder: Path, t: ArrayLike, gyro: ArrayLike, rate: ArrayLike) -> TargetFindings:
    """The findings on a gyro [rad/s] beside a rate [rad/s], shape (n,) each, written to a file in a folder."""
    np.savetxt(folder / "log.csv", np.column_stack([t, gyro, rate]), "%.9g", ",", header="t,g,w", comments="")
    (folder / "log.toml").write_text(_RATE_FILE)
    (target,) = close(folder / "log.toml").targets
    return target


def closed_at_rest(
    folder: Path, t: ArrayLike, values: ArrayLike, averaging: str, channel: str = "gyro", unit: str = "rad/s"
) -> TargetFindings:
    """The findings on a channel at rest with a declared bias, shape (n,), written to a file in a folder."""
    np.savetxt(folder / "run.csv", np.column_stack([t, values]), "%.9g", ",", header="t,x", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        f'{channel} = {{ column = "x", unit = "{unit}" }}\n'
        f'[model]\ntarget = "{channel}"\ndeclared = ["bias"]\n[held_out]\naveraging = "{averaging}"\n'
    )
    (target,) = close(folder / "run.toml").targets
    return target
