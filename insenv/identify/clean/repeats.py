r"""A held output that shows itself: readings that change in every k-th row alone.

Of a logger that is read more often than its sensor, every renewal is followed by k - 1 rows with the very same number.
Where n changes all lie in one class of rows modulo k, chance does that with probability $k^{1-n}$ whatever a table did:
no reference is needed, neither its lag nor its noise matters, and all of the output is held.

A logger may lose rows before it repeats them, or its clock may leap: each stretch between two gaps then has a class of
its own. The hold is as certain, but renewals have no one phase.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Recording
from insenv.data.exposure import expose

#: Longest hold in rows, fewest changes of all runs together and of a run or stretch that tells its phase.
LONGEST, FEWEST, OF_RUN = 64, 24, 12
#: Log of the chance that is allowed: that of 48 changes in every other row.
CHANCE = -47 * np.log(2.0)
#: Share of the changes that may lie elsewhere: rows that a logger lost or doubled.
ELSEWHERE = 0.01


@dataclass(frozen=True)
class Repeats:
    """Rows of a hold, those from a renewal to the start of each run (None: not told), and how many changes told it.

    ``slips`` where stretches of a run have renewals of different phases.
    """

    rows: int
    phases: tuple[int | None, ...]
    changes: int
    slips: bool = False

    @property
    def log_chance(self) -> float:
        """Log of the probability that changes lie so by chance."""
        return -(self.changes - 1) * float(np.log(self.rows))


def repeats(recordings: tuple[Recording, ...], spans: tuple[slice, ...], target: str) -> Repeats | None:
    """The hold that the readings of ``spans``, contiguous in each run, show by themselves; None without one."""
    stretches = [_changes(recording, target, span) for recording, span in zip(recordings, spans, strict=True)]
    changes = [np.concatenate(parts) for parts in stretches]
    told = [at for at in changes if len(at) >= OF_RUN]
    apart = [at for parts in stretches for at in parts if len(at) >= OF_RUN]
    for rows in range(LONGEST, 1, -1):
        if all(_in_one_class(at, rows) for at in told):
            phases = tuple(-_class(at, rows) % rows if len(at) >= OF_RUN else None for at in changes)
            found = Repeats(rows, phases, sum(map(len, told)))
        elif all(_in_one_class(at, rows) for at in apart):
            # Each further stretch chose its class: one change of it told nothing.
            found = Repeats(rows, (None,) * len(changes), sum(map(len, apart)) - len(apart) + 1, slips=True)
        else:
            continue
        if found.changes >= FEWEST and found.log_chance <= CHANCE:
            return found
    return None


def _changes(recording: Recording, target: str, span: slice) -> list[NDArray[np.int64]]:
    """Cells in which the reading is another one than in the cell before, of each stretch without a gap."""
    cell, y = expose(recording, target).cell_of_row[span], recording.channels[target].values[span]
    rows = np.flatnonzero(cell >= 0)
    cell, y = cell[rows], y[rows]
    parts = np.split(np.arange(len(cell)), np.flatnonzero((np.diff(cell) != 1) | (np.diff(rows) != 1)) + 1)
    return [cell[part][1:][np.diff(y[part]) != 0] for part in parts]


def _class(at: NDArray[np.int64], rows: int) -> int:
    return int(np.argmax(np.bincount(at % rows, minlength=rows)))


def _in_one_class(at: NDArray[np.int64], rows: int) -> bool:
    return int(np.sum(at % rows != _class(at, rows))) <= ELSEWHERE * len(at)
