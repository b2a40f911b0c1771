"""The picture of a system that points somewhere: a dial from above, what is believed of it, and strip charts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from matplotlib.axes import Axes

from insenv.envs.charts import Magnifier
from insenv.envs.render import QUIET, TRUE, Canvas, Frame, Header


class Shown(Protocol):
    """What is set to a view."""

    def set(self, view: Any) -> None:
        """Show it."""
        ...


class DialPicture:
    """The picture with or without an estimator: the dial has more room where nothing is believed.

    Parameters
    ----------
    size : (int, int)
        Width and height [pixels].
    names : (str, str)
        Of the system, and of what is believed or not.
    believes : bool
    dial : callable
        Makes what turns on the dial, from its axes and ``believes``.
    belief : callable
        Makes the panel of the belief, from the canvas and its left end and width.
    strips : callable
        Makes the strip charts, from the canvas.
    """

    def __init__(
        self,
        size: tuple[int, int],
        names: tuple[str, str],
        believes: bool,
        dial: Callable[[Axes, bool], Shown],
        belief: Callable[[Canvas, float, float], Shown],
        strips: Callable[[Canvas], Shown],
    ) -> None:
        self.canvas = canvas = Canvas(size)
        self._header = Header(canvas, names[0])
        left, width = 0.015, 0.415 if believes else 0.455
        low, height = (0.305, 0.63) if believes else (0.215, 0.71)
        self._parts = [dial(canvas.axes(left, low, width, height), believes)]
        if believes:
            self._parts.append(belief(canvas, left, width))
        else:
            text = f"no estimator: nothing is believed about {names[1]}"
            canvas.figure.text(left + width / 2, 0.09, text, ha="center", color=QUIET)
        self._parts.append(strips(canvas))

    def draw(self, view: Any) -> Frame:
        """One frame, shape (height, width, 3)."""
        self._header.set(view.title, view.time, view.duration)
        for part in self._parts:
            part.set(view)
        return self.canvas.pixels()


class BeliefPanel:
    """A line of numbers, and below it the top of the dial magnified."""

    def __init__(self, canvas: Canvas, left: float, width: float) -> None:
        middle = left + width / 2
        self._numbers = canvas.figure.text(middle, 0.207, "", ha="center", fontsize=9, color=TRUE, animated=True)
        self._magnifier = Magnifier(canvas.axes(left + 0.025, 0.105, width - 0.05, 0.085))
