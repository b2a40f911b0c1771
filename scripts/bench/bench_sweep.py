"""The bench's lines for sweeps and evaluation.

Means of dwells beside samples, many north-finder episodes, estimators judged together, Dask beside processes.
"""

from __future__ import annotations

import importlib.util
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from statistics import median

import numpy as np
from bench_line import Line, cpu

from insenv.effects.bias import Bias
from insenv.effects.noise import AngleRandomWalk, RateRandomWalk
from insenv.effects.rate.scale import ScaleFactor
from insenv.evaluate.play import Work, play_on
from insenv.evaluate.remote import InProcess
from insenv.evaluate.runs import Episodes
from insenv.plants.turntable import Turntable
from insenv.rig import Fitted, Normals, Rig
from insenv.rig_dwells import dwell_law
from insenv.sensors.chain import Sensor
from insenv.sweep import Backend, Cluster, Processes, Table, sweep

RATE, DWELL, DWELLS, RUNS = 100.0, 60.0, 5, 64
EPISODES, SAMPLED = 2000, 64
#: Estimators that are judged together, runs that are timed, and runs of which the time is told.
ESTIMATORS, JUDGED, WANTED = ("correlation", "revolution", "north_gls"), 64, 400
#: CPU time of a chunk [s], chunks, and repetitions, for the overhead of a back end.
WORK, CHUNKS, REPEATS = 0.25, 24, 3


def dwells() -> Iterator[Line]:
    """A gyro on a table that stands still for 60 s five times: means drawn from their law, and sample by sample."""
    sensor = Sensor("gyro", (Bias(), ScaleFactor(), AngleRandomWalk(), RateRandomWalk()))
    theta = np.tile([1e-6, 1e-5, 1e-6, 1e-9], (RUNS, 1))
    rig = Rig(Turntable(), (Fitted(sensor, theta),), RATE)
    n = int(DWELL * RATE)
    law = dwell_law(rig, [(0.0, DWELLS * n)], np.arange(DWELLS + 1) * n)

    def sampled() -> None:
        normals = Normals(rig, range(RUNS))
        state = rig.begin(normals.start())
        for _ in range(DWELLS):
            readings, state = rig.advance(state, None, n, normals.draw(n))
            readings.outputs["gyro"].mean(axis=-1)

    per_dwell = 1e6 / (RUNS * DWELLS)
    ours = cpu(lambda: law.draw(rig, range(RUNS)), 9) * per_dwell
    theirs = cpu(sampled, 3) * per_dwell
    work = f"mean of a dwell of {DWELL:.0f} s at {RATE:.0f} Hz, white noise + walk"
    yield Line(work, f"{ours:.1f} us", ">= 50 x", "sample by sample", f"{theirs:.0f} us", theirs / ours)


def north() -> Iterator[Line]:
    """Episodes of the published north finder, 300 s each: time for 100 000 of them on two cores."""
    for estimator in ("north_gls", "revolution"):
        drawn = Episodes("north_finder/published", estimator, "constant_rate", path="dwells", block=0.1)
        played = Episodes("north_finder/published", estimator, "constant_rate", every=300)
        ours = cpu(lambda job=drawn: job(range(EPISODES)), 3) / EPISODES * 1e5 / 2  # type: ignore[misc]
        theirs = cpu(lambda job=played: job(range(SAMPLED)), 1) / SAMPLED * 1e5 / 2  # type: ignore[misc]
        yield Line(
            f"1e5 north finders, {estimator}, dwells of 0.1 s, 2 cores",
            f"{ours:.0f} s",
            "<= 60 s",
            "sample by sample",
            f"{theirs:.0f} s",
            theirs / ours,
        )


def judging() -> Iterator[Line]:
    """Three estimators under a policy that looks at no estimate: on runs that are simulated once, and on their own.

    The start of a process is left out; `insenv evaluate` with two has two of them.
    """

    def played(*names: str) -> Callable[[], object]:
        work = Work("north_finder/published", names, "constant_rate", 0, JUDGED)
        return lambda: play_on(InProcess(), work, lambda doing, share: None)

    each = WANTED / JUDGED
    ours = cpu(played(*ESTIMATORS), 3) * each
    theirs = sum(cpu(played(name), 3) for name in ESTIMATORS) * each
    yield Line(
        f"evaluate {WANTED} north finders x {len(ESTIMATORS)} estimators, 1 core",
        f"{ours:.1f} s",
        "<= 60 s",
        "each on runs of its own",
        f"{theirs:.1f} s",
        theirs / ours,
    )


def busy(seeds: Sequence[int]) -> Table:
    """So much work for each seed."""
    for _ in seeds:
        end = time.process_time() + WORK
        while time.process_time() < end:
            pass
    return {"seed": np.array(seeds)}


def overhead() -> Iterator[Line]:
    """Two workers of a Dask cluster beside two local processes: wall time of the same chunks."""
    work = f"sweep of {CHUNKS} chunks of {WORK} s, 2 Dask workers (wall)"
    if importlib.util.find_spec("distributed") is None:
        yield Line(work, "dask is not installed", "<= 15 % more", "", "", None)
        return
    with _cluster() as address:
        # In turns, so that what else the machine does meets both alike.
        spent = [(_wall(Cluster(address)), _wall(Processes(2))) for _ in range(REPEATS + 1)][1:]
    dask, local = (median(times) for times in zip(*spent, strict=True))
    more = median(a / b for a, b in spent) - 1
    yield Line(work, f"{dask:.2f} s ({more:+.0%})", "<= +15 %", "2 processes", f"{local:.2f} s", local / dask)


def _wall(backend: Backend) -> float:
    start = time.perf_counter()
    sweep(busy, 0, CHUNKS, backend=backend, chunk=1)
    return time.perf_counter() - start


@contextmanager
def _cluster() -> Iterator[str]:
    """A scheduler and two workers on this machine."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    with tempfile.TemporaryDirectory() as folder:
        port = address.rpartition(":")[2]
        worker = [
            "worker",
            address,
            "--nthreads",
            "1",
            "--host",
            "127.0.0.1",
            "--local-directory",
            folder,
            "--no-nanny",
        ]
        parts = [["scheduler", "--host", "127.0.0.1", "--port", port], worker, worker]
        surroundings = os.environ | {"PYTHONPATH": os.path.dirname(__file__), "PYTHONWARNINGS": "ignore"}
        running = []
        try:
            for part in parts:
                command = [sys.executable, "-m", "dask", *part, "--no-dashboard"]
                quiet = subprocess.DEVNULL
                running.append(subprocess.Popen(command, env=surroundings, stdout=quiet, stderr=quiet))
                _await(address)
            _both(address)
            yield address
        finally:
            for process in running[::-1]:
                process.terminate()
                process.wait()


def _await(address: str) -> None:
    host, port = address.removeprefix("tcp://").split(":")
    for _ in range(600):
        with socket.socket() as probe:
            if not probe.connect_ex((host, int(port))):
                return
        time.sleep(0.1)


def _both(address: str) -> None:
    from dask.distributed import Client

    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=300)


ALL = (dwells, north, judging, overhead)
