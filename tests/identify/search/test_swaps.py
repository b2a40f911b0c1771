"""What takes the place of an added effect at the end of a search is significant by itself."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from insenv.identify.search.settle import _swapped


def test_an_event_that_explains_a_little_better_takes_no_place() -> None:
    """A step of one axis, p = 1 with the odds against events, in the place of the warm-up that the whole box has."""
    track = cast(Any, SimpleNamespace())  # nothing of it is asked
    assert _swapped(track, cast(Any, None), cast(Any, SimpleNamespace(log_p=0.0)), 0.01) is track
