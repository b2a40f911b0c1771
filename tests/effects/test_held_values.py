"""What an output that is held shows: whole cells, wherever their boundaries fall."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from insenv.effects.timing import held_values


@given(st.floats(1.0, 40.0), st.integers(0, 20_000), st.integers(1, 400), st.integers(-3, 3))
def test_every_interval_shows_a_value_that_was_read_before_it(ratio: float, start: int, n: int, near: int) -> None:
    """A last interval in the middle of which a cell begins, to a millionth of a cell, was beyond the values."""
    # ratios of which a boundary falls within rounding of the last interval, too
    ends = round((start + n - 0.5) / ratio)
    for one in (ratio, (start + n - 0.5) / max(ends, 1) * (1 + near * 3e-7)):
        if one < 1:
            continue
        shown = held_values(np.arange(n + 1.0), one, start)
        age = np.arange(1, n + 1) - shown  # in intervals: 0 is renewed just now
        assert shown.shape == (n,)
        assert np.all(age >= 0)
        assert np.all(age[shown > 0] < one + 1)
        assert np.all((np.diff(shown) == 0) | (age[1:] == 0))


def test_the_case_that_was_met() -> None:
    assert held_values(np.arange(2722.0), 7.668554300701175, 8790)[-1] <= 2721
