"""Rows of a batched state, whatever it is made of."""

from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from insenv.core.recording import Floats
from insenv.core.rows import rows

INDEX = np.array([2, 0])


@dataclass(frozen=True)
class Filter:
    gain: Floats
    steps: int
    parts: tuple[Any, ...]


@dataclass(frozen=True)
class Shared:
    table: Floats
    own: Floats

    def rows(self, index: Any) -> "Shared":
        return Shared(self.table, self.own[index])


@pytest.mark.parametrize("state", [None, 3, 2.5, True, "steady"])
def test_what_is_no_array_is_shared(state: Any) -> None:
    assert rows(state, INDEX) is state


def test_an_array_without_axes_is_shared() -> None:
    assert rows(np.array(4.0), INDEX) == 4.0


def test_states_are_taken_apart_down_to_their_arrays() -> None:
    a = np.arange(12.0).reshape(4, 3)
    state = Filter(a, 5, ({"x": a[:, 0]}, None, MappingProxyType({"y": a})))
    taken = rows(state, INDEX)
    assert isinstance(taken, Filter) and taken.steps == 5 and taken.parts[1] is None
    np.testing.assert_array_equal(taken.gain, a[[2, 0]])
    np.testing.assert_array_equal(taken.parts[0]["x"], [6.0, 0.0])
    np.testing.assert_array_equal(taken.parts[2]["y"], a[[2, 0]])
    np.testing.assert_array_equal(state.gain, np.arange(12.0).reshape(4, 3))


def test_a_state_that_knows_better_is_asked() -> None:
    table, own = np.arange(5.0), np.arange(4.0)
    taken = rows((Shared(table, own),), INDEX)[0]
    assert taken.table is table
    np.testing.assert_array_equal(taken.own, [2.0, 0.0])


@pytest.mark.parametrize("state", [[np.zeros(4)], object(), Filter])
def test_what_cannot_be_taken_apart_is_refused(state: Any) -> None:
    with pytest.raises(TypeError, match="wanted arrays, numbers, tuples, mappings, dataclasses"):
        rows(state, INDEX)
