"""The loop of a sweep: what is not done yet, in chunks of a fraction of a second, into the store."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator

from tqdm import tqdm

from insenv.core.errors import InputError
from insenv.sweep.backends import Backend, Serial, answer
from insenv.sweep.store import Job, Memory, Span, Store, Table, rows

#: Least time of a chunk that tells its speed, and the time that a chunk is to take [s].
LEAST, WANTED = 0.1, 0.5
#: How much larger each trial is than the one before, and the largest chunk.
_GROWTH, _LARGEST = 4, 2**16
#: Chunks for each worker, at least: the last ones to finish wait for nobody long.
_EACH = 4


def sweep(
    job: Job,
    first: int,
    total: int,
    store: Store | None = None,
    backend: Backend | None = None,
    chunk: int | None = None,
    progress: bool = False,
) -> Store:
    """Run ``job`` on the seeds ``first``, ``first + 1`` ... of ``total`` runs, as far as the store lacks them.

    Parameters
    ----------
    job : callable
        Picklable; of seeds, gives a table with a row for each, which depends on that seed alone.
    first, total : int
    store : Store, optional
        Where the results go; in memory.
    backend : Backend, optional
        In this process.
    chunk : int, optional
        Runs per chunk; so many as take about half a second, found by trial.
    progress : bool
        Whether to show a bar with the remaining time on standard error.

    Returns
    -------
    Store
        With all runs.

    Raises
    ------
    InputError
        If a number is out of range, or the job fails so; what is done is kept.
    LostError
        If the back end is; an `InputError`. What is done is kept.
    KeyboardInterrupt
        What is done is kept.
    """
    if first < 0 or total < 1 or (chunk is not None and chunk < 1):
        raise InputError(
            f"seed {first}, {total} runs and chunk {chunk} given; wanted seeds from 0, runs and chunks from 1"
        )
    store = Memory() if store is None else store
    backend = Serial() if backend is None else backend
    todo = _Todo(store.done(), total)
    with _bar(total, total - todo.remaining, progress) as bar:
        # Asked for first: a cluster that does not answer is told of before any work is done.
        workers = backend.workers() if todo.remaining else 1
        if chunk is None and todo.remaining:
            found = _measured(job, first, todo, store, bar)
            chunk = max(1, min(found, todo.remaining // (_EACH * workers)))
        if todo.remaining:
            calls = ((start, range(first + start, first + stop)) for start, stop in todo.spans(chunk or 1))
            for start, table in backend.run(job, calls):
                _keep(store, start, table, bar)
    return store


class _Todo:
    """Runs that are not done, given out in pieces."""

    def __init__(self, done: list[Span], total: int) -> None:
        edges = [0, *(edge for span in done for edge in span), total]
        self._gaps = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b > a]

    @property
    def remaining(self) -> int:
        """Runs that nobody was given yet."""
        return sum(b - a for a, b in self._gaps)

    def take(self, most: int) -> Span:
        """The next runs, ``most`` of them or as many as stand together."""
        start, stop = self._gaps.pop(0)
        if stop - start > most:
            self._gaps.insert(0, (start + most, stop))
            stop = start + most
        return start, stop

    def spans(self, chunk: int) -> Iterator[Span]:
        """All that are left."""
        while self._gaps:
            yield self.take(chunk)


def _measured(job: Job, first: int, todo: _Todo, store: Store, bar: tqdm) -> int:
    """How many runs take `WANTED`, from chunks of this sweep that grow until their time can be told."""
    # The first run pays for what is compiled and loaded, and tells nothing.
    size, fresh = 1, True
    while todo.remaining:
        start, stop = todo.take(size)
        began = time.perf_counter()
        _keep(store, *answer(job, (start, range(first + start, first + stop))), bar)
        elapsed = time.perf_counter() - began
        if not fresh and (elapsed >= LEAST or size >= _LARGEST):
            return min(max(1, round((stop - start) * WANTED / elapsed)), _LARGEST)
        size, fresh = (size if fresh else size * _GROWTH), False
    return size


def _keep(store: Store, start: int, table: Table, bar: tqdm) -> None:
    store.add(start, table)
    bar.update(rows(table))


def _bar(total: int, done: int, shown: bool) -> tqdm:
    """A bar on standard error: at once on a terminal, elsewhere after two seconds and now and then."""
    there = sys.stderr.isatty()
    return tqdm(
        total=total,
        initial=done,
        disable=not shown,
        unit="run",
        unit_scale=True,
        delay=0 if there else 2,
        mininterval=0.1 if there else 10,
        file=sys.stderr,
    )
