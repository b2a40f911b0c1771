"""Rows of a batched state.

A state is None, a number, an array with the batch in front, or a tuple, mapping or dataclass of such. What
knows better which of its arrays are shared by all rows has a method ``rows(index)`` of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Recording


def rows(state: Any, index: NDArray[np.int64]) -> Any:
    """The same state for the runs ``index`` of the batch alone.

    Raises
    ------
    TypeError
        If a part of the state is of none of these kinds.
    """
    if state is None or isinstance(state, bool | int | float | str):
        return state
    if callable(getattr(state, "rows", None)):
        return state.rows(index)
    if isinstance(state, np.ndarray):
        return state[index] if state.ndim else state
    if isinstance(state, tuple):
        return tuple(rows(part, index) for part in state)
    if isinstance(state, Mapping):
        return {key: rows(part, index) for key, part in state.items()}
    if is_dataclass(state) and not isinstance(state, type):
        return replace(state, **{f.name: rows(getattr(state, f.name), index) for f in fields(state)})
    raise TypeError(f"a state holds a {type(state).__name__}; wanted arrays, numbers, tuples, mappings, dataclasses")


def row_of(chunk: Recording, row: int) -> Recording:
    """One run of a batch; what all runs share it has too."""
    channels = {
        name: replace(channel, values=channel.values[row] if channel.values.ndim > 1 else channel.values)
        for name, channel in chunk.channels.items()
    }
    return replace(chunk, channels=channels)
