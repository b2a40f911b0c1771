"""Power-ups as runs: an instrument that is switched on again is, for its bias and its warm-up, in another run.

The channel "power" counts the power-ups of a recording. Each file begins with one of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Recording, rows_between


def by_power_up(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """Each power-up as a recording of its own, in order and with all rows; those without "power" as they are.

    Raises
    ------
    InputError
        If a power-up has one row only.
    """
    return tuple(part for recording in recordings for part in _parts(recording))


def _parts(recording: Recording) -> Iterator[Recording]:
    if "power" not in recording.channels:
        yield recording
        return
    numbers = recording.values("power", "1")
    edges = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), len(recording)]
    if len(edges) == 2:
        yield recording
        return
    for start, stop in pairwise(edges):
        label = f"{recording.label}, power-up {numbers[start]:g}"
        if stop - start < 2:
            raise InputError(f"{label}: has 1 row of data; wanted at least 2")
        yield replace(rows_between(recording, start, stop), label=label)
