r"""A held output that shows itself: readings that change in every k-th row alone.

Of a logger that is read more often than its sensor, every renewal is followed by k - 1 rows with the very same number.
Where n changes all lie in one class of rows modulo k, chance does that with probability $k^{1-n}$ whatever a table did:
no reference is needed, neither its lag nor its noise matters, and all of the output is held.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Recording
from insenv.data.exposure import expose

#: Longest hold in rows, fewest changes of all runs together and of a run that tells its phase.
LONGEST, FEWEST, OF_RUN = 64, 48, 12
#: Share of the changes that may lie elsewhere: rows that a logger lost or doubled.
ELSEWHERE = 0.01


@dataclass(frozen=True)
class Repeats:
    """Rows of a hold, those from a renewal to the start of each run (None: not told), and how many changes told it."""

    rows: int
    phases: tuple[int | None, ...]
    changes: int


def repeats(recordings: tuple[Recording, ...], spans: tuple[slice, ...], target: str) -> Repeats | None:
    """The hold that the readings of ``spans``, contiguous in each run, show by themselves; None without one."""
    changes = [_changes(recording, target, span) for recording, span in zip(recordings, spans, strict=True)]
    told = [at for at in changes if len(at) >= OF_RUN]
    if sum(map(len, told)) < FEWEST:
        return None
    for rows in range(LONGEST, 1, -1):
        if all(_in_one_class(at, rows) for at in told):
            phases = tuple(-_class(at, rows) % rows if len(at) >= OF_RUN else None for at in changes)
            return Repeats(rows, phases, sum(map(len, told)))
    return None


def _changes(recording: Recording, target: str, span: slice) -> NDArray[np.int64]:
    """Cells in which the reading is another one than in the cell before."""
    cell, y = expose(recording, target).cell_of_row[span], recording.channels[target].values[span]
    kept = cell >= 0
    cell, y = cell[kept], y[kept]
    return cell[1:][(np.diff(y) != 0) & (np.diff(cell) == 1)]


def _class(at: NDArray[np.int64], rows: int) -> int:
    return int(np.argmax(np.bincount(at % rows, minlength=rows)))


def _in_one_class(at: NDArray[np.int64], rows: int) -> bool:
    return int(np.sum(at % rows != _class(at, rows))) <= ELSEWHERE * len(at)
