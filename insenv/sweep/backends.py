"""Where the chunks of a sweep are worked on: here, in processes beside, or on the workers of a Dask cluster.

All three are back ends of joblib. A worker that a cluster loses costs no run: its chunks are done anew elsewhere.
"""

from __future__ import annotations

import logging
import queue
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, Protocol

import joblib
from joblib.externals.loky.process_executor import TerminatedWorkerError

from insenv.core.compiled import hurry
from insenv.core.errors import InputError
from insenv.sweep.store import Job, Table, versions

#: Time in which a scheduler must answer, and in which a first worker must be there [s].
ANSWER, FIRST_WORKER = 10.0, 60.0
#: Time between two looks at whether the scheduler is still there [s].
_LOOK = 0.5
#: Chunks that are handed out in advance, for each worker.
_AHEAD = 3

#: A chunk: its first run, and its seeds.
Call = tuple[int, range]
Answers = Iterator[tuple[int, Table]]


class LostError(InputError):
    """Who worked on the sweep is gone; what is done is kept."""


class Backend(Protocol):
    """Works on chunks."""

    def workers(self) -> int:
        """How many chunks are worked on at a time."""

    def run(self, job: Job, calls: Iterable[Call]) -> Answers:
        """First run and table of each chunk, in whatever order they come."""


def answer(job: Job, call: Call) -> tuple[int, Table]:
    """One chunk.

    Raises
    ------
    InputError
        If the job does not give one row for each seed.
    """
    start, seeds = call
    hurry()
    table = job(seeds)
    lengths = {name: len(column) for name, column in table.items()}
    if not lengths or set(lengths.values()) != {len(seeds)}:
        raise InputError(f"the job gave columns of {lengths} rows for {len(seeds)} seeds; wanted a row for each")
    return start, table


@dataclass(frozen=True)
class Serial:
    """In this process, one chunk after the other."""

    def workers(self) -> int:
        """One."""
        return 1

    def run(self, job: Job, calls: Iterable[Call]) -> Answers:
        """In their order."""
        return (answer(job, call) for call in calls)


@dataclass(frozen=True)
class Processes:
    """So many processes on this machine, with one thread each."""

    count: int

    def __post_init__(self) -> None:
        if self.count < 1:
            raise InputError(f"{self.count} processes given; wanted one or more")

    def workers(self) -> int:
        """The number of processes."""
        return self.count

    def run(self, job: Job, calls: Iterable[Call]) -> Answers:
        """As they come.

        Raises
        ------
        LostError
            If a process is killed.
        """
        with joblib.parallel_config("loky", n_jobs=self.count, inner_max_num_threads=1):
            try:
                yield from _parallel(self.count, job, calls)
            except TerminatedWorkerError:
                raise LostError("a process of the sweep was killed, perhaps as memory ran out") from None


@dataclass(frozen=True)
class Cluster:
    """The workers of a Dask scheduler at ``address``: "tcp://host:8786"."""

    address: str

    def workers(self) -> int:
        """Threads of all workers that there are."""
        with self._client() as client:
            return sum(client.nthreads().values()) or 1

    def run(self, job: Job, calls: Iterable[Call]) -> Answers:
        """As they come.

        Raises
        ------
        InputError
            If there is no scheduler or no worker, or a worker has other versions.
        LostError
            If the scheduler is lost.
        """
        with self._client() as client:
            self._same_versions(client)
            with joblib.parallel_config("dask", client=client):
                count = sum(client.nthreads().values())
                yield from self._watched(client, _parallel(count, job, calls))

    @contextmanager
    def _client(self) -> Iterator[Any]:
        try:
            from dask.distributed import Client
        except ImportError:
            raise InputError(f"{self.address}: a cluster needs Dask; install insenv[dist]") from None
        # What is lost is said in one sentence below; Dask would log a page about it.
        logger = logging.getLogger("distributed")
        level = logger.level
        logger.setLevel(logging.CRITICAL + 1)
        try:
            try:
                client = Client(self.address, timeout=ANSWER, set_as_default=False)
            except (OSError, ValueError, TimeoutError) as error:
                text = " ".join(str(error).split())
                raise InputError(
                    f"{self.address}: no Dask scheduler answers ({text}); wanted tcp://host:port"
                ) from None
            try:
                self._wait(client)
                yield client
            finally:
                with suppress(Exception):  # it may be gone
                    client.close(timeout=2)
        finally:
            logger.setLevel(level)

    def _wait(self, client: Any) -> None:
        try:
            client.wait_for_workers(1, timeout=FIRST_WORKER)
        except TimeoutError:
            raise InputError(
                f"{self.address}: the scheduler has no worker after {FIRST_WORKER:g} s; "
                f"wanted one: dask worker {self.address} --nthreads 1"
            ) from None

    def _same_versions(self, client: Any) -> None:
        """Refuse workers whose numbers may differ in the last bit."""
        here = versions()
        try:
            told = client.run(versions)
        except Exception as error:
            raise InputError(f"{self.address}: a worker cannot import insenv ({error})") from None
        for worker, there in told.items():
            for name, text in here.items():
                if there.get(name) != text:
                    raise InputError(f"{worker}: has {name} {there.get(name)}; wanted {text}, as here")

    def _watched(self, client: Any, answers: Answers) -> Answers:
        """The answers; a scheduler that is lost ends them, which joblib would wait for without end."""
        found: queue.Queue[tuple[str, Any]] = queue.Queue()
        threading.Thread(target=_pump, args=(answers, found), daemon=True).start()
        while True:
            try:
                kind, value = found.get(timeout=_LOOK)
            except queue.Empty:
                if client.status != "running":
                    raise self._lost() from None
                continue
            if kind == "answer":
                yield value
            elif kind == "end":
                return
            elif isinstance(value, InputError):
                raise value
            elif client.status != "running" or type(value).__name__ in _LOST:
                raise self._lost() from None
            else:
                raise value

    def _lost(self) -> LostError:
        return LostError(f"{self.address}: the Dask scheduler is lost")


#: What Dask raises for a task whose scheduler is gone.
_LOST = ("CancelledError", "FutureCancelledError", "CommClosedError")


def _pump(answers: Answers, found: queue.Queue[tuple[str, Any]]) -> None:
    """Put answers, and how they end, into a queue."""
    try:
        for value in answers:
            found.put(("answer", value))
        found.put(("end", None))
    except BaseException as error:
        found.put(("error", error))


def _parallel(count: int, job: Job, calls: Iterable[Call]) -> Answers:
    """On joblib's back end that is set."""
    pool = joblib.Parallel(return_as="generator_unordered", batch_size=1, pre_dispatch=_AHEAD * count)
    found: Answers = pool(joblib.delayed(answer)(job, call) for call in calls)
    return found


def backend(jobs: int = 1, cluster: str | None = None) -> Backend:
    """The back end for so many processes, or for a cluster's address.

    Raises
    ------
    InputError
        If both are asked for, or less than one process.
    """
    if cluster is not None:
        if jobs != 1:
            raise InputError(f"{jobs} processes and a cluster given; wanted one of the two")
        return Cluster(cluster)
    return Serial() if jobs == 1 else Processes(jobs)
