"""Speed of what has a bar, each beside a named alternative that runs in the same minute on the same machine.

CPU time of one thread, median of several runs. Prints a table and never fails: a slow machine is no defect,
so the ratio to the alternative says more than the figure.
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

# Before NumPy is imported: CPU time of threads that wait for each other would be counted too.
for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

import importlib.util
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from statistics import median

import bench_close
import bench_environments
import bench_rate_table
import bench_sweep
import bench_unit
import bench_vehicle
import numpy as np
from bench_line import Line, cpu

from insenv.close import close
from insenv.core.compiled import hurry
from insenv.core.recording import Floats
from insenv.core.series.allan import allan_deviation, log_taus
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.effects.noise import AngleRandomWalk, RateRandomWalk
from insenv.scenario import simulate

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
ROWS = 360_000
AXES, INSTANTS, CHUNK = 6, 2_000_000, 16_384
RATES, TAUS = 10_000_000, 52  # two of the shortest fall together


def main() -> None:
    hurry()
    shown = False
    for lines in (
        noise,
        importing,
        allan,
        reading,
        closing,
        *bench_close.ALL,
        *bench_environments.ALL,
        *bench_vehicle.ALL,
        *bench_rate_table.ALL,
        *bench_unit.ALL,
        *bench_sweep.ALL,
    ):
        for line in lines():
            if not shown:
                print(_row("work", "insenv", "bar", "beside it", "", "insenv is"))
                shown = True
            speed = "" if line.ratio is None else _times(line.ratio)
            print(_row(line.work, line.found, line.bar, line.alternative, line.beside, speed), flush=True)


def _row(*cells: str) -> str:
    widths = (52, 14, 12, 44, 12, 12)
    return " ".join(c.ljust(w) for c, w in zip(cells, widths, strict=True)).rstrip()


def _times(ratio: float) -> str:
    return f"{ratio:.1f} x faster" if ratio >= 1 else f"{1 / ratio:.1f} x slower"


def noise() -> Iterator[Line]:
    """White noise and random walk on six axes, streamed; an instant has six samples."""
    white, walk = AngleRandomWalk(), RateRandomWalk()
    coefficients = np.full((2, AXES, 1), 1e-6)
    source = np.random.Generator(np.random.SFC64(0))
    z: Floats = np.empty((2, AXES, 1, CHUNK))

    def draw() -> None:
        for _ in range(INSTANTS // CHUNK):
            source.standard_normal(out=z)

    def drive() -> None:
        state = None
        for _ in range(INSTANTS // CHUNK):
            source.standard_normal(out=z)
            errors, _ = white.drive(coefficients[0], 0.01, None, z[0])
            slow, state = walk.drive(coefficients[1], 0.01, state, z[1])
            errors += slow

    ours, bound = (INSTANTS / cpu(work, 5) / 1e6 for work in (drive, draw))
    work = "6 axes, white noise + random walk, instants"
    yield Line(
        work,
        f"{ours:.1f} M/s",
        ">= 4 M/s",
        "their normals alone (NumPy, SFC64)",
        f"{bound:.1f} M/s",
        ours / bound,
    )
    yield Line("    the same, samples of one axis", f"{AXES * ours:.0f} M/s", "", "", f"{AXES * bound:.0f} M/s", None)


def importing() -> Iterator[Line]:
    """A fresh interpreter that imports insenv, and one that does nothing."""
    ours, bare = (_fresh(program) for program in ("import insenv", "pass"))
    yield Line(
        "import insenv, fresh interpreter",
        f"{ours:.3f} s",
        "< 0.4 s",
        "interpreter alone",
        f"{bare:.3f} s",
        bare / ours,
    )


def _fresh(program: str) -> float:
    """Median CPU time of a new interpreter that runs ``program``, its own start included [s]."""
    command = [sys.executable, "-c", f"{program}\nimport time\nprint(time.process_time())"]
    runs = [subprocess.run(command, check=True, capture_output=True, text=True) for _ in range(9)]
    return median(float(run.stdout) for run in runs)


def allan() -> Iterator[Line]:
    """Overlapping Allan deviation of ten million rates at fifty averaging times."""
    rate = np.random.default_rng(0).standard_normal(RATES)
    taus = log_taus(RATES, 0.01, TAUS)
    ours = cpu(lambda: allan_deviation(rate, 0.01, taus), 3)
    work = f"Allan deviation, {RATES / 1e6:.0f} M rates x {len(taus)} taus"
    if importlib.util.find_spec("allantools") is None:
        yield Line(work, f"{ours:.2f} s", "<= 1.1 s", "allantools is not installed", "", None)
        return
    import allantools

    theirs = cpu(lambda: allantools.oadev(rate, rate=100.0, data_type="freq", taus=taus), 1)
    yield Line(work, f"{ours:.2f} s", "<= 1.1 s", "allantools.oadev", f"{theirs:.2f} s", theirs / ours)


def reading() -> Iterator[Line]:
    """A text file of an hour at 100 Hz, seven columns."""
    names = ["time", *(f"{kind}_{axis}" for kind in ("gyro", "accel") for axis in "xyz")]
    units = {"time": "s", "gyro": "rad/s", "accel": "m/s^2"}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _write_text(folder / "run.csv", names)
        channels = [f'{n} = {{ column = "{n}", unit = "{units[n.split("_")[0]]}" }}' for n in names]
        model = ['data = "run.csv"', "[channels]", *channels, "[model]", 'target = "gyro_x"', "declared = []"]
        (folder / "run.toml").write_text("\n".join(model))
        manifest = load_manifest(folder / "run.toml")
        ours = cpu(lambda: read_recordings(manifest), 5)
        few = ROWS // 10
        theirs = 10 * cpu(lambda: np.loadtxt(folder / "run.csv", delimiter=",", skiprows=1, max_rows=few), 3)
    how = "" if importlib.util.find_spec("pyarrow") else ", without pyarrow"
    work = f"read {ROWS} x {len(names)} CSV{how}"
    yield Line(
        work,
        f"{ours:.2f} s",
        "<= 0.5 s",
        f"numpy.loadtxt ({few} rows, time x 10)",
        f"{theirs:.2f} s",
        theirs / ours,
    )


def _write_text(path: Path, names: list[str]) -> None:
    values = np.random.default_rng(0).standard_normal((ROWS, len(names)))
    values[:, 0] = np.arange(ROWS) / 100
    line = ",".join(["%.9g"] * len(names)) + "\n"
    path.write_text(",".join(names) + "\n" + (line * ROWS) % tuple(values.ravel().tolist()))


def closing() -> Iterator[Line]:
    """Closing the loop on an hour of a rate table, all effects of the catalogue tried, report left out."""
    for scenario, slower in (("constant_rate", r'(?<=duration = ")1200'), ("staircase", r'(?<=dwell = ")20')):
        with tempfile.TemporaryDirectory() as name:
            manifest = _simulated(scenario, slower, Path(name))
            rows = len(read_recordings(load_manifest(manifest))[0])
            read = cpu(lambda m=manifest: read_recordings(load_manifest(m)), 3)  # type: ignore[misc]
            ours = cpu(lambda m=manifest: close(m), 3)  # type: ignore[misc]
        work = f"close the loop, {scenario}, {rows} rows"
        yield Line(work, f"{ours:.1f} s", "<= 10 s", "reading the file alone", f"{read:.2f} s", read / ours)


def _simulated(scenario: str, stretched: str, folder: Path) -> Path:
    """Manifest of the scenario, with the number that ``stretched`` finds raised for about `ROWS` rows."""
    text = (SCENARIOS / f"{scenario}.toml").read_text(encoding="utf-8")
    played = simulate(SCENARIOS / f"{scenario}.toml", folder / "short")
    factor = ROWS / len(read_recordings(load_manifest(played))[0])
    longer = re.sub(stretched, lambda number: f"{factor * float(number[0]):.12g}", text, count=1)
    (folder / "scenario.toml").write_text(longer, encoding="utf-8")
    return simulate(folder / "scenario.toml", folder / "long")


if __name__ == "__main__":
    main()
