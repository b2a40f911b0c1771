"""Sweeps on a real Dask scheduler with two workers, processes on this machine, some of which are killed."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
import sweep_jobs
from dask.distributed import Client

from insenv.core.errors import InputError
from insenv.sweep import Cluster, Folder, Memory, Table, stacked, sweep

pytestmark = pytest.mark.slow
HERE = Path(__file__).parents[1] / "cases" / "sweep"


@dataclass
class Processes:
    """A scheduler and its workers."""

    address: str
    scheduler: subprocess.Popen[bytes]
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)


def started(*args: str) -> subprocess.Popen[bytes]:
    """A part of Dask, with the tests' folder on its path."""
    surroundings = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")]),
        "PYTHONWARNINGS": "ignore",
        "OMP_NUM_THREADS": "1",
    }
    command = [sys.executable, "-m", "dask", *args]
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, env=surroundings, stdout=quiet, stderr=quiet, start_new_session=True)


def ended(process: subprocess.Popen[bytes]) -> None:
    """Kill a process with all that it started."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def worker(address: str) -> subprocess.Popen[bytes]:
    return started(
        *("worker", address, "--nthreads", "1", "--no-dashboard", "--no-nanny", "--host", "127.0.0.1"),
        *("--death-timeout", "60", "--local-directory", os.environ.get("TMPDIR", "/tmp")),
    )


@pytest.fixture
def cluster() -> Iterator[Processes]:
    """A scheduler and two workers."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    scheduler = started("scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    made = Processes(address, scheduler, [worker(address), worker(address)])
    try:
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            with socket.socket() as probe:
                if not probe.connect_ex(("127.0.0.1", port)):
                    break
            time.sleep(0.1)
        with Client(address, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=300)
        yield made
    finally:
        for process in (*made.workers, made.scheduler):
            ended(process)


def whole() -> Table:
    return sweep_jobs.walk(range(sweep_jobs.FIRST, sweep_jobs.FIRST + sweep_jobs.TOTAL))


def same(found: Table, expected: Table) -> None:
    assert list(found) == list(expected)
    for name in expected:
        np.testing.assert_array_equal(found[name], expected[name])


def kill_after(store: Memory, runs: int, process: subprocess.Popen[bytes]) -> threading.Thread:
    """Kill a process once so many runs are there."""

    def wait() -> None:
        while sum(stop - start for start, stop in store.done()) < runs:
            time.sleep(0.01)
        ended(process)

    thread = threading.Thread(target=wait, daemon=True)
    thread.start()
    return thread


def test_a_cluster_gives_the_same_bits(cluster: Processes) -> None:
    for chunk in (None, 13):
        found = sweep(
            sweep_jobs.walk, sweep_jobs.FIRST, sweep_jobs.TOTAL, backend=Cluster(cluster.address), chunk=chunk
        )
        same(stacked(found.parts()), whole())


def test_a_killed_worker_costs_no_run(cluster: Processes) -> None:
    store = Memory()
    thread = kill_after(store, 50, cluster.workers[0])
    sweep(sweep_jobs.slow, sweep_jobs.FIRST, sweep_jobs.TOTAL, store, Cluster(cluster.address), chunk=11)
    thread.join()
    assert cluster.workers[0].poll() is not None and cluster.workers[1].poll() is None
    same(stacked(store.parts()), whole())


def test_a_killed_scheduler_is_told_of_and_the_sweep_goes_on_elsewhere(cluster: Processes, tmp_path: Path) -> None:
    store = Folder(tmp_path, sweep_jobs.IDENTITY)
    thread = kill_after(store, 50, cluster.scheduler)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="the Dask scheduler is lost"):
        sweep(sweep_jobs.slow, sweep_jobs.FIRST, sweep_jobs.TOTAL, store, Cluster(cluster.address), chunk=11)
    thread.join()
    assert 50 <= sum(stop - start for start, stop in store.done()) < sweep_jobs.TOTAL
    again = Folder(tmp_path, sweep_jobs.IDENTITY, resume=True)
    sweep(sweep_jobs.slow, sweep_jobs.FIRST, sweep_jobs.TOTAL, again, chunk=11)
    same(stacked(again.parts()), whole())


def test_a_killed_driver_on_a_cluster_goes_on(cluster: Processes, tmp_path: Path) -> None:
    path = tmp_path / "store"
    command = [sys.executable, sweep_jobs.__file__, str(path), "1", cluster.address]
    killed = subprocess.Popen(command, start_new_session=True)
    while len(list(path.glob("runs-*.npz"))) < 5:
        assert killed.poll() is None
        time.sleep(0.02)
    ended(killed)
    store = Folder(path, sweep_jobs.IDENTITY, resume=True)
    assert sum(stop - start for start, stop in store.done()) < sweep_jobs.TOTAL
    sweep(sweep_jobs.slow, sweep_jobs.FIRST, sweep_jobs.TOTAL, store, Cluster(cluster.address), chunk=11)
    same(stacked(store.parts()), whole())


def test_no_scheduler_is_told_of(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("insenv.sweep.backends.ANSWER", 1.0)
    with pytest.raises(InputError, match="no Dask scheduler answers"):
        sweep(sweep_jobs.walk, 0, 5, backend=Cluster("tcp://127.0.0.1:1"))
    with pytest.raises(InputError, match="no Dask scheduler answers"):
        sweep(sweep_jobs.walk, 0, 5, backend=Cluster("nonsense://x"))
