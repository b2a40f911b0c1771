"""What the two-position calibration looks like: the vehicle from above, and strip charts of a run.

North is at the top of the dial. The body points to its heading, the sight to heading + installation angle.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, FancyBboxPatch, Polygon, Rectangle

from insenv.core.attitude import wrapped
from insenv.core.recording import Floats
from insenv.core.units import ARCMIN, ARCSEC, DEG
from insenv.envs.charts import StripChart
from insenv.envs.dial_picture import BeliefPanel, DialPicture
from insenv.envs.render import (
    BELIEVED,
    FAINT,
    INSTRUMENT,
    PLATE,
    QUIET,
    TRUE,
    Canvas,
    Dial,
    Drawing,
    Frame,
    plain_angle,
    plain_bearing,
)
from insenv.systems.north_finder.frame import IGNORANT
from insenv.systems.two_position.frame import History, View, residual

__all__ = ["History", "Renderer", "View", "draw"]

_UNITS = ((DEG, "deg", "°"), (ARCMIN, "arcmin", "′"), (ARCSEC, "arcsec", "″"))


def draw(view: View, size: tuple[int, int] = (960, 600)) -> Frame:
    """One frame, shape (height, width, 3).

    A `Renderer` that is kept draws the same in a third of the time.

    Raises
    ------
    InputError
        If the size [pixels] is too small for a picture.
    """
    return Renderer(size).draw(view)


class Renderer(Drawing):
    """Draws frames of the two-position calibration."""

    def kind(self, view: View) -> tuple[Any, ...]:
        """Who believes in what, and the ranges of the charts."""
        return view.believed_installation is not None, view.duration

    def layout(self, size: tuple[int, int], *kind: Any) -> DialPicture:
        """The picture of that kind."""
        believes, duration = kind

        def strips(canvas: Canvas) -> _Strips:
            return _Strips(canvas, duration, believes)

        return DialPicture(size, ("two-position calibration", "the sight"), believes, _Vehicle, _Belief, strips)


class _Vehicle:
    """Vehicle from above: what turns with it is made once, with the nose to the top, and then rotated."""

    def __init__(self, ax: Axes, believes: bool) -> None:
        dial = Dial(ax, {0: "N", 90: "E", 180: "S", 270: "W"})
        self._body, self._turning = dial.turning()
        self._turret, self._sighting = dial.turning()
        ax.add_patch(Circle((0, 0), 0.80, fc=PLATE, ec=QUIET, lw=1.0, zorder=2))
        self._outline(ax)
        self._true = dial.pointer((0.74, 1.0), "true heading", color=TRUE, lw=5.0, zorder=3)
        if believes:
            look = {"fc": BELIEVED, "lw": 0, "zorder": 2.5}
            self._sector = dial.sector((0.82, 0.985), "± 1 sd", alpha=0.35, **look)
            self._believed = dial.pointer((0.74, 0.985), "believed heading", color=BELIEVED, lw=2.0, zorder=4)
        self._turn = (dial.arrow(self._turning, 90.0, color=TRUE), dial.arrow(self._turning, 270.0, color=TRUE))
        self._corners = dial.corners()
        ax.legend(
            loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=4, frameon=False, fontsize=8.2, borderaxespad=0.3,
            handlelength=1.3, columnspacing=0.9, handletextpad=0.4,
        )  # fmt: skip

    def _outline(self, ax: Axes) -> None:
        look: dict[str, Any] = {"transform": self._turning, "animated": True}
        for x in (-0.27, 0.19):
            for y in (-0.42, -0.12, 0.22):
                ax.add_patch(Rectangle((x, y), 0.08, 0.20, fc=QUIET, lw=0, zorder=2.2, **look))
        hull = FancyBboxPatch((-0.19, -0.46), 0.38, 0.92, "round,pad=0.02,rounding_size=0.07", zorder=2.3, **look)
        hull.set(fc="white", ec=QUIET, lw=1.2)
        ax.add_patch(hull)
        ax.add_patch(Polygon([(-0.15, 0.34), (0.15, 0.34), (0.11, 0.45), (-0.11, 0.45)], fc=FAINT, zorder=2.4, **look))
        sight: dict[str, Any] = {"transform": self._sighting, "animated": True, "zorder": 5}
        ax.add_patch(Circle((0, 0), 0.12, fc="#f6c9a8", ec=INSTRUMENT, lw=1.2, **sight))
        ax.plot([0, 0], [0.0, 0.62], color=INSTRUMENT, lw=2.4, label="sight", **sight)
        ax.add_patch(Polygon([(-0.05, 0.60), (0.05, 0.60), (0.0, 0.72)], fc=INSTRUMENT, lw=0, **sight))

    def set(self, view: View) -> None:
        self._body.clear().rotate(-view.heading)
        self._turret.clear().rotate(-view.heading - view.installation)
        self._true.set(view.heading)
        for arrow in self._turn:
            arrow.set(view.rate)
        if view.believed_installation is not None:
            mean, sd = view.believed_heading or (0.0, np.inf)
            known = sd < IGNORANT
            self._sector.set(mean if known else 0.0, sd if known else np.pi)
            self._believed.set(mean if known else None)
        state = "at rest" if view.rate == 0 else f"turning {plain_angle(view.rate, 1)}/s"
        sighting = "none" if view.sighting is None else plain_bearing(view.sighting, 3)
        texts = (
            f"vehicle\n{state}",
            f"turned\n{plain_angle(view.turned, 1)}",
            f"heading\n{plain_bearing(view.heading, 3)}",
            f"last sighting\n{sighting}",
        )
        for corner, text in zip(self._corners, texts, strict=True):
            corner.set_text(text)


class _Belief(BeliefPanel):
    """Installation angle in numbers, and the believed heading magnified: where it is, against the true one."""

    def set(self, view: View) -> None:
        assert view.believed_installation is not None
        mean, sd = view.believed_heading or (0.0, np.inf)
        known = sd < IGNORANT
        error = wrapped(mean - view.heading) if known else 0.0
        unit, name, _ = _suitable(max(sd, abs(error)))
        most = np.pi / unit if unit == DEG else np.inf
        label = f"believed heading, clockwise of the true one [{name}]"
        self._magnifier.set(error / unit, sd / unit if known else np.inf, most, label)
        mean, sd = view.believed_installation
        unit, _, sign = _suitable(max(abs(view.installation), abs(mean), min(sd, IGNORANT)))
        places = int(np.clip(1 - np.floor(np.log10(max(sd, 1e-12) / unit)), 0, 5)) if sd < IGNORANT else 1
        true = f"installation: true {_signed(view.installation / unit, places)}{sign}"
        believed = f"{_signed(mean / unit, places)}{sign} ± {_spread(sd)}" if sd < IGNORANT else "unknown"
        self._numbers.set_text(f"{true}, believed {believed}")


def _suitable(angle: float) -> tuple[float, str, str]:
    """Unit, its name and its sign, in which an angle [rad] is 1 or more."""
    return next((unit for unit in _UNITS if angle >= unit[0]), _UNITS[-1])


def _signed(value: float, places: int) -> str:
    return f"{round(value, places) + 0.0:.{places}f}".replace("-", "−")


def _spread(sd: float) -> str:
    """A standard deviation with the two digits that it deserves."""
    unit, _, sign = _suitable(sd)
    value = sd / unit
    return f"{value:.{int(np.clip(1 - np.floor(np.log10(value)), 0, 4))}f}{sign}" if value > 0 else f"0{sign}"


_TURN, _EAST, _NORTH = "turn", "east", "north"


class _Strips:
    """Velocities and, with an estimator, the installation angle's error and its size against time."""

    def __init__(self, canvas: Canvas, duration: float, believes: bool) -> None:
        self._believes = believes
        count = 3 if believes else 2
        bottom, top, gap = 0.085, 0.905, 0.065
        left, width = (0.525, 0.45) if believes else (0.565, 0.41)
        height = (top - bottom - gap * (count - 1)) / count
        axes = [canvas.axes(left, top - height - k * (height + gap), width, height) for k in range(count)]
        for ax in axes[:-1]:
            ax.tick_params(labelbottom=False)
        axes[-1].set_xlabel("time [s]")
        self._charts: list[StripChart] = []
        if believes:
            self._error = self._chart(StripChart(axes[0], "error [arcmin]", duration))
            self._error.band("± 1 sd", fc=BELIEVED, alpha=0.22)
            self._error.curve("true", color=TRUE, lw=1.6, ls=(0, (4, 2)))
            self._error.curve("believed installation angle", color=BELIEVED, lw=1.6)
            self._size = self._chart(StripChart(axes[1], "|error| [arcmin]", duration, logarithmic=True))
            self._size.curve("demanded", color=QUIET, lw=1.2, ls=":")
            self._size.curve("true error", color=TRUE, ls="none", marker=".")
            self._size.curve("believed sd", color=BELIEVED, lw=1.6)
        else:
            self._velocity = self._chart(StripChart(axes[0], "velocity [m/s]", duration))
            self._pair(self._velocity)
        self._residual = self._chart(StripChart(axes[-1], "v − cubic [mm/s]", duration))
        self._pair(self._residual)
        for chart in self._charts:
            chart.legend()

    def _chart(self, chart: StripChart) -> StripChart:
        chart.band(_TURN, fc=FAINT, zorder=0.5)
        self._charts.append(chart)
        return chart

    @staticmethod
    def _pair(chart: StripChart) -> None:
        chart.curve(_EAST, color=INSTRUMENT, lw=1.1)
        chart.curve(_NORTH, color=QUIET, lw=1.1, alpha=0.7)

    def set(self, view: View) -> None:
        h = view.history
        if self._believes:
            self._set_error(view)
            self._set_size(view)
        else:
            still = np.where(h.turning[:, None] > 0, np.nan, h.velocity)
            self._set_pair(self._velocity, h.time, still, 1e-3)
        self._set_pair(self._residual, h.time, residual(h.time, h.turning, h.velocity) * 1e3, 1e-3)
        for chart in self._charts:
            _shade(chart, h)

    @staticmethod
    def _set_pair(chart: StripChart, time: Floats, values: Floats, least: float) -> None:
        chart.set(_EAST, time, values[:, 0])
        chart.set(_NORTH, time, values[:, 1])
        chart.limits(values, least=least)

    def _set_error(self, view: View) -> None:
        h = view.history
        mean, sd = h.installation.T
        known = sd < IGNORANT
        error = np.where(known, wrapped(mean - view.installation), np.nan)
        # What was believed while next to nothing was known shall not squeeze the rest into a line.
        good = known & (sd <= 3 * np.median(sd[known] if known.any() else 0.0))
        seen = np.concatenate([(error - sd)[good], (error + sd)[good]])
        unit, name, _ = _suitable(min(np.max(np.abs(seen), initial=0.0), ARCMIN) if len(seen) else ARCMIN)
        self._error.ax.yaxis.set_label_text(f"error [{name}]")
        self._error.set("true", np.array([0.0, view.duration]), np.zeros(2) if known.any() else np.full(2, np.nan))
        self._error.set("believed installation angle", h.time, error / unit)
        self._error.set_band("± 1 sd", h.time, (error - sd) / unit, (error + sd) / unit)
        self._error.limits(seen / unit, np.zeros(int(known.any())), least=1e-3)

    def _set_size(self, view: View) -> None:
        h = view.history
        mean, sd = h.installation.T
        error = np.where(sd < IGNORANT, np.abs(wrapped(mean - view.installation)) / ARCMIN, np.nan)
        demanded = np.full(2, np.nan if view.demanded is None else view.demanded / ARCMIN)
        self._size.set("demanded", np.array([0.0, view.duration]), demanded)
        self._size.set("true error", h.time, error)
        self._size.set("believed sd", h.time, sd / ARCMIN)
        # A passage of the error through zero needs no decades of its own.
        floor = 0.05 * np.min(sd, initial=np.inf) / ARCMIN
        self._size.limits(sd / ARCMIN, np.maximum(error, floor), demanded)


def _shade(chart: StripChart, h: History) -> None:
    """Shade the steps in which the vehicle turned, from bottom to top; elsewhere the band has no height."""
    low, high = chart.ax.get_ylim()
    before = np.concatenate([[0.0], h.time])
    t = np.repeat(before, 2)[1:-1] if len(h.time) else np.zeros(0)
    top = np.repeat(np.where(h.turning > 0, high, low), 2)
    chart.set_band(_TURN, t, np.full(len(t), low), top)
