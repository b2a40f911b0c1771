"""What pictures of environments with a dial are asked: what points where, and whether every text can be read."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.text import Text

from insenv.core.recording import Floats

SIZE = (960, 600)
#: Centre and radius of the dial with an estimator [pixels], and colours of instrument and belief.
CENTRE, RADIUS = np.array([213.6, 228.0]), 155.0
ORANGE, BLUE = (0xD5, 0x5E, 0x00), (0x00, 0x72, 0xB2)


def of_colour(frame: Any, colour: tuple[int, int, int]) -> Floats:
    """Places [pixels] of a colour on the dial, from its centre: right and up."""
    y, x = np.nonzero((np.abs(frame.astype(int) - colour) < 30).all(axis=-1))
    from_centre = np.stack([x - CENTRE[0], CENTRE[1] - y], axis=-1)
    return from_centre[np.hypot(*from_centre.T) < RADIUS]


def tip(places: Floats) -> float:
    """Azimuth on the dial of those farthest from its centre [rad]."""
    far = places[np.hypot(*places.T) > 0.9 * np.hypot(*places.T).max()]
    return float(np.arctan2(*far.mean(axis=0)))


def assert_same_in_any_order(renderer: Any, views: Sequence[Any]) -> None:
    """Frames are the same whatever was drawn before, and each view has its own."""
    forwards = [renderer.draw(view) for view in views]
    backwards = [renderer.draw(view) for view in reversed(views)]
    for frame, again in zip(forwards, reversed(backwards), strict=True):
        np.testing.assert_array_equal(frame, again)
    assert len({frame.tobytes() for frame in forwards}) == len(views)


def assert_every_text_is_read(figure: Figure) -> None:
    """No text overlaps another or leaves the picture."""
    unseen = beyond(figure)
    boxes = [
        (text.get_text(), text.get_window_extent())
        for text in figure.findobj(Text)
        if isinstance(text, Text) and text.get_visible() and text.get_text().strip() and text not in unseen
    ]
    assert len(boxes) > 30
    for text, box in boxes:
        assert box.x0 >= 0 and box.y0 >= 0 and box.x1 <= SIZE[0] and box.y1 <= SIZE[1], text
    for (one, a), (other, b) in combinations(boxes, 2):
        # A box has a pixel of air around its letters.
        both = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        assert min(both) < 2, f"{one!r} on {other!r}"


def beyond(figure: Figure) -> list[Text]:
    """Labels of ticks beyond the limits, which matplotlib makes and does not draw."""
    found = []
    for axis in (axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)):
        low, high = sorted(axis.get_view_interval())
        found += [tick.label1 for tick in axis.majorTicks if not low <= tick.get_loc() <= high]
    return found
