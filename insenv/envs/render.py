"""What the pictures of the environments are made of: a canvas, a dial and a window (charts: `insenv.envs.charts`).

A direction on a dial is an azimuth: clockwise from the top, x = r sin(azimuth), y = r cos(azimuth).

matplotlib objects are set, not made anew, from frame to frame, and only those that are ``animated`` are drawn in
every frame, on top of a background with all others. What is shown depends on what was set last and on nothing
before, so that equal frames have equal pixels. Nothing here touches pyplot.
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium.error import DependencyNotInstalled
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon, Wedge
from matplotlib.text import Text
from matplotlib.transforms import Affine2D, Transform
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.report.drawing import style

Frame = NDArray[np.uint8]

#: Dark for what is true, blue for what is believed, orange for the instrument: told apart by the colour-blind
#: too (Okabe and Ito 2008; Wong, Nature Methods 8 (2011) 441).
TRUE, BELIEVED, INSTRUMENT = "#1c2128", "#0072b2", "#d55e00"
QUIET, FAINT, PLATE = "#5c6670", "#d9dee4", "#eef1f4"

#: Size in inches of the picture that the layouts are made for; letters grow and shrink with the picture.
_DESIGN = (9.6, 6.0)
_LEAST = (160, 100)
#: Half the width of a dial with its corners, in radii.
_EDGE = 1.22


class Canvas:
    """A figure of fixed size in pixels, and its pixels.

    Parameters
    ----------
    size : (int, int)
        Width and height [pixels].

    Raises
    ------
    InputError
        If the size is smaller than 160 x 100.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        width, height = size
        if width < _LEAST[0] or height < _LEAST[1]:
            least = f"at least {_LEAST[0]} x {_LEAST[1]}"
            raise InputError(f"picture of {width} x {height} pixels is too small; wanted {least}")
        dpi = min(width / _DESIGN[0], height / _DESIGN[1])
        # A thousandth of a pixel more, so that no rounding of inches loses a whole one.
        inches = (width + 1e-3) / dpi, (height + 1e-3) / dpi
        self.figure = Figure(figsize=inches, dpi=dpi, facecolor="white")
        self._canvas = FigureCanvasAgg(self.figure)
        self._background: Any = None
        self._moving: list[Artist] = []

    def axes(self, left: float, bottom: float, width: float, height: float) -> Axes:
        """Axes at a place given in fractions of the picture."""
        return self.figure.add_axes((left, bottom, width, height))

    def pixels(self) -> Frame:
        """What is drawn, shape (height, width, 3)."""
        with style():
            if self._background is None:
                self._canvas.draw()
                self._background = self._canvas.copy_from_bbox(self.figure.bbox)
                self._moving = [artist for artist in self._in_order() if artist.get_animated()]
            self._canvas.restore_region(self._background)
            for artist in self._moving:
                self.figure.draw_artist(artist)
        return np.array(self._canvas.buffer_rgba())[:, :, :3].copy()

    def _in_order(self) -> Iterator[Artist]:
        yield from self.figure.texts
        for ax in self.figure.axes:
            yield from sorted(ax.get_children(), key=lambda artist: artist.get_zorder())


class Drawing(ABC):
    """Draws frames of one size; what it keeps between them is its figures, which show in no pixel.

    Parameters
    ----------
    size : (int, int)
        Width and height [pixels].
    """

    def __init__(self, size: tuple[int, int] = (960, 600)) -> None:
        self._size = size
        self._layouts: dict[tuple[Any, ...], Any] = {}

    def __getstate__(self) -> dict[str, Any]:
        """Without the figures, which cannot be pickled and are made anew when a frame is drawn."""
        return {**self.__dict__, "_layouts": {}}

    @abstractmethod
    def kind(self, view: Any) -> tuple[Any, ...]:
        """What of a view decides on the layout."""

    @abstractmethod
    def layout(self, size: tuple[int, int], *kind: Any) -> Any:
        """A picture of that kind, with a method ``draw(view)``."""

    def draw(self, view: Any) -> Frame:
        """One frame, shape (height, width, 3)."""
        kind = self.kind(view)
        with style():
            if kind not in self._layouts:
                self._layouts[kind] = self.layout(self._size, *kind)
            frame: Frame = self._layouts[kind].draw(view)
            return frame


class Header:
    """Title of a picture, and the time.

    Parameters
    ----------
    canvas : Canvas
    untitled : str
        What stands there where a title is empty.
    """

    def __init__(self, canvas: Canvas, untitled: str) -> None:
        self._untitled = untitled
        look: dict[str, Any] = {"fontsize": 11.5, "color": TRUE, "va": "center", "animated": True}
        self._title = canvas.figure.text(0.02, 0.963, "", weight="bold", **look)
        self._time = canvas.figure.text(0.985, 0.963, "", ha="right", **look)

    def set(self, title: str, time: float, duration: float) -> None:
        """Title of a scenario, time since the start of the run and its length at most [s]."""
        title = " ".join(title.split()) or self._untitled
        self._title.set_text(_literal(title if len(title) <= 64 else title[:63] + "…"))
        decimals = 0 if float(time).is_integer() else 1
        self._time.set_text(f"t = {time:.{decimals}f} s of {duration:g} s")


def _literal(text: str) -> str:
    """Text in which a dollar sign opens no formula."""
    return text.replace("$", r"\$")


def on_circle(radius: float, azimuth: Any) -> tuple[Any, Any]:
    """Points at azimuths [rad] on a circle about the origin."""
    return radius * np.sin(azimuth), radius * np.cos(azimuth)


class Dial:
    """A ring graduated in degrees clockwise from the top, radius 1, and pointers on it.

    Parameters
    ----------
    ax : Axes
        Emptied and given equal scales.
    names : mapping of int to str
        Letters instead of the number at some degrees.
    """

    def __init__(self, ax: Axes, names: dict[int, str]) -> None:
        self.ax = ax
        ax.set(xlim=(-_EDGE, _EDGE), ylim=(-_EDGE, _EDGE), aspect="equal")
        ax.set_axis_off()
        ax.add_patch(Circle((0, 0), 1.0, fc="white", ec=QUIET, lw=1.2, zorder=1))
        self._graduate(names)

    def _graduate(self, names: dict[int, str]) -> None:
        ticks = [
            (on_circle(1.0, np.deg2rad(d)), on_circle(1.0 + (0.045 if d % 10 == 0 else 0.025), np.deg2rad(d)))
            for d in range(0, 360, 5)
        ]
        self.ax.add_collection(LineCollection(ticks, colors=QUIET, linewidths=0.8, zorder=1))
        for degrees in range(0, 360, 30):
            name = names.get(degrees)
            x, y = on_circle(1.13, np.deg2rad(degrees))
            look: dict[str, Any] = {"fontsize": 11, "weight": "bold"} if name else {"fontsize": 8.5}
            color = TRUE if name else QUIET
            self.ax.text(x, y, name or f"{degrees}°", ha="center", va="center", color=color, **look)

    def turning(self) -> tuple[Affine2D, Transform]:
        """A rotation to be set, and the transform of artists that turn with it."""
        rotation = Affine2D()
        return rotation, rotation + self.ax.transData

    def arrow(self, turning: Transform, azimuth: float, **look: Any) -> Arrow:
        """A curved arrow about an azimuth [deg] of what turns, for its sense of rotation."""
        line = self.ax.plot([], [], lw=1.8, zorder=4.5, transform=turning, animated=True, **look)[0]
        head = Polygon(np.zeros((3, 2)), lw=0, zorder=4.5, transform=turning, animated=True, **look)
        self.ax.add_patch(head)
        return Arrow(line, head, np.deg2rad(azimuth))

    def corners(self) -> list[Text]:
        """Texts in the corners, to be set: above left and right, below left and right."""
        places = [(x, y) for y in (_EDGE, -_EDGE) for x in (-_EDGE, _EDGE)]
        look: dict[str, Any] = {"fontsize": 8.5, "color": TRUE, "animated": True}
        return [
            self.ax.text(x, y, "", ha="left" if x < 0 else "right", va="top" if y > 0 else "bottom", **look)
            for x, y in places
        ]

    def pointer(self, reach: tuple[float, float], label: str, **look: Any) -> Pointer:
        """A straight line from one radius to another, at an azimuth that is set later."""
        return Pointer(self.ax.plot([], [], label=label, solid_capstyle="butt", animated=True, **look)[0], reach)

    def sector(self, reach: tuple[float, float], label: str, **look: Any) -> Sector:
        """Part of a ring about an azimuth that is set later."""
        patch = Wedge((0, 0), reach[1], 0, 1, width=reach[1] - reach[0], label=label, animated=True, **look)
        self.ax.add_patch(patch)
        return Sector(patch)


@dataclass(frozen=True)
class Pointer:
    """A line on a dial."""

    line: Line2D
    reach: tuple[float, float]

    def set(self, azimuth: float | None) -> None:
        """Point there [rad]; nowhere for None."""
        self.line.set_visible(azimuth is not None)
        if azimuth is not None:
            (x0, y0), (x1, y1) = (on_circle(r, azimuth) for r in self.reach)
            self.line.set_data([x0, x1], [y0, y1])


@dataclass(frozen=True)
class Arrow:
    """A curved arrow on what turns."""

    line: Line2D
    head: Polygon
    azimuth: float

    def set(self, rate: float) -> None:
        """Point counter-clockwise for a positive rate; nothing for zero."""
        self.line.set_visible(rate != 0)
        self.head.set_visible(rate != 0)
        radius, half, sense = 0.5, np.deg2rad(35), -np.sign(rate)
        along = self.azimuth + sense * np.linspace(-half, half, 24)
        self.line.set_data(*on_circle(radius, along))
        tip = on_circle(radius, along[-1] + sense * 0.26)
        self.head.set_xy([on_circle(radius - 0.07, along[-1]), on_circle(radius + 0.07, along[-1]), tip])


@dataclass(frozen=True)
class Sector:
    """A part of a ring on a dial."""

    patch: Wedge

    def set(self, azimuth: float | None, half: float) -> None:
        """Reach from azimuth - half to azimuth + half [rad], the whole ring at most; nothing for None."""
        self.patch.set_visible(azimuth is not None)
        if azimuth is not None:
            middle, half = 90.0 - np.rad2deg(azimuth), min(np.rad2deg(half), 180.0)
            self.patch.set_theta1(middle - half)
            self.patch.set_theta2(middle + half)


def plain_angle(angle: float, places: int) -> str:
    """An angle [rad] in degrees with so many decimals; no minus sign before a zero."""
    return f"{round(np.rad2deg(angle), places) + 0.0:.{places}f}°".replace("-", "−")


def plain_bearing(angle: float, places: int) -> str:
    """An angle [rad] in degrees from 0 to below 360 with so many decimals."""
    return f"{round(np.rad2deg(angle), places) % 360.0:.{places}f}°"


class Window:
    """A window on the screen, for ``render_mode="human"``.

    A user who closes it is not shown another one: the frames after that go nowhere.

    Parameters
    ----------
    title : str
    rate : float
        Frames per second at most; `show` waits for as long.
    """

    def __init__(self, title: str, rate: float) -> None:
        self._title, self._rate = title, rate
        self._pygame: Any = None
        self._clock: Any = None
        self._dismissed = False

    def __getstate__(self) -> dict[str, Any]:
        """Without what is on this screen: a copy opens a window of its own."""
        return {**self.__dict__, "_pygame": None, "_clock": None}

    @property
    def is_open(self) -> bool:
        """Whether there is something to be seen."""
        return self._pygame is not None and self._pygame.display.get_surface() is not None

    def show(self, frame: Frame) -> None:
        """Show a frame, shape (height, width, 3), and take note of a wish to close the window.

        Raises
        ------
        DependencyNotInstalled
            If pygame is missing.
        """
        if self._dismissed:
            return
        height, width = frame.shape[:2]
        if not self.is_open:
            self._open((width, height))
        if any(event.type == self._pygame.QUIT for event in self._pygame.event.get()):
            self._dismissed = True
            self.close()
            return
        image = self._pygame.image.frombuffer(np.ascontiguousarray(frame).tobytes(), (width, height), "RGB")
        self._pygame.display.get_surface().blit(image, (0, 0))
        self._pygame.display.flip()
        self._clock.tick(self._rate)

    def close(self) -> None:
        """Close the window; again or before it was opened: nothing happens."""
        if self._pygame is not None:
            self._pygame.display.quit()
        self._pygame = self._clock = None

    def _open(self, size: tuple[int, int]) -> None:
        self._pygame = _pygame()
        self._pygame.display.init()
        self._pygame.display.set_caption(self._title)
        self._pygame.display.set_mode(size)
        self._clock = self._pygame.time.Clock()


def _pygame() -> Any:
    # Its greeting would stand in the middle of what a program prints.
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        import pygame
    except ImportError:
        raise DependencyNotInstalled(
            'pygame-ce is not installed; render_mode="human" wants it: pip install "insenv[render]"'
        ) from None
    return pygame
