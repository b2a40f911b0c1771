"""What the rate table looks like: the table from above, the rates so far, and what a line leaves of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

from insenv.core.units import DEG, PPM
from insenv.envs.charts import StripChart
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
    Header,
    plain_angle,
    plain_bearing,
)
from insenv.systems.rate_table.frame import View, line

__all__ = ["Renderer"]

_KELVIN = 273.15
_RUN, _SWITCHED = "table rate", "gyro switched on"
_POINTS, _BAND, _CURVE = "levels of this power-up", "± 2 sd of white noise", "true, warm"


class Renderer(Drawing):
    """Draws frames of the rate table."""

    def kind(self, view: View) -> tuple[Any, ...]:
        """Who believes in what, and the ranges of the charts."""
        return view.demanded is not None, view.duration, view.largest

    def layout(self, size: tuple[int, int], *kind: Any) -> _Layout:
        """The picture of that kind."""
        return _Layout(size, *kind)


class _Layout:
    """The picture, with a chart more where an estimator believes."""

    def __init__(self, size: tuple[int, int], believes: bool, duration: float, largest: float) -> None:
        self._canvas = canvas = Canvas(size)
        self._header = Header(canvas, "rate table")
        self._table = _Table(canvas.axes(0.015, 0.17, 0.40, 0.67))
        self._charts = _Charts(canvas, believes, duration, largest)
        if not believes:
            text = "no estimator: nothing is believed about the scale factor"
            canvas.figure.text(0.215, 0.09, text, ha="center", color=QUIET)

    def draw(self, view: View) -> Frame:
        self._header.set(view.title, view.time, view.duration)
        self._table.set(view)
        self._charts.set(view)
        return self._canvas.pixels()


class _Table:
    """Table from above; what turns with it is made once and then rotated."""

    def __init__(self, ax: Axes) -> None:
        dial = Dial(ax, {0: "0°"})
        self._rotation, turning = dial.turning()
        ax.add_patch(Circle((0, 0), 0.80, fc=PLATE, ec=QUIET, lw=1.0, zorder=2))
        holes = np.deg2rad(np.arange(22.5, 360, 45))
        look: dict[str, Any] = {"transform": turning, "animated": True}
        ax.plot(0.70 * np.sin(holes), 0.70 * np.cos(holes), "o", ms=4, mfc="white", mec=QUIET, zorder=2.2, **look)
        ax.add_patch(Rectangle((-0.22, -0.22), 0.44, 0.44, fc="#f6c9a8", ec=INSTRUMENT, lw=1.2, zorder=5, **look))
        ax.plot([0], [0], "o", ms=15, mfc="none", mec=INSTRUMENT, mew=1.6, zorder=5.2, **look)
        ax.plot([0], [0], "o", ms=4, color=INSTRUMENT, label="gyro axis, upwards", zorder=5.2, ls="none", **look)
        ax.plot([0], [0.9], "D", ms=7, color=QUIET, label="zero of the table angle", zorder=4.2, ls="none", **look)
        self._turn = (dial.arrow(turning, 90.0, color=TRUE), dial.arrow(turning, 270.0, color=TRUE))
        self._corners = dial.corners()
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=2, frameon=False, fontsize=8.5, numpoints=1)

    def set(self, view: View) -> None:
        self._rotation.clear().rotate(view.table_angle)
        for arrow in self._turn:
            arrow.set(view.rate)
        texts = (
            f"table rate\n{plain_angle(view.rate, 2)}/s",
            f"table angle\n{plain_bearing(view.table_angle, 1)}",
            f"power-up\n{view.power_up}",
            f"gyro\n{view.temperature - _KELVIN:.2f} °C".replace("-", "−"),
        )
        for corner, text in zip(self._corners, texts, strict=True):
            corner.set_text(text)


class _Charts:
    """The ladder of rates against time, the residual of the line against the rate, and what is believed."""

    def __init__(self, canvas: Canvas, believes: bool, duration: float, largest: float) -> None:
        count = 3 if believes else 2
        bottom, top, gap = 0.085, 0.905, 0.115
        height = (top - bottom - gap * (count - 1)) / count
        left, width = 0.535, 0.44
        axes = [canvas.axes(left, top - height - k * (height + gap), width, height) for k in range(count)]
        self._ladder = StripChart(axes[0], "rate [deg/s]", duration)
        self._ladder.curve(_RUN, color=INSTRUMENT, lw=1.2)
        self._ladder.curve(_SWITCHED, color=TRUE, ls="none", marker="^")
        axes[0].set_xlabel("time [s]", labelpad=1)
        self._residual = StripChart(axes[1], "residual [ppm]", duration)
        most = largest / DEG
        axes[1].set_xlim(-most, most)
        axes[1].set_xlabel("rate [deg/s]  (residuals of the line, in ppm of the largest rate)", labelpad=1)
        axes[1].axhline(0.0, color=FAINT, lw=1.0)
        self._residual.band(_BAND, fc=QUIET, alpha=0.25)
        self._residual.curve(_CURVE, color=TRUE, lw=1.0, ls=(0, (4, 2)))
        self._residual.curve(_POINTS, color=INSTRUMENT, ls="none", marker="o")
        self._believed = StripChart(axes[2], "K [ppm]", duration, logarithmic=True) if believes else None
        if self._believed is not None:
            axes[2].set_xlabel("time [s]", labelpad=1)
            self._believed.curve("demanded", color=QUIET, lw=1.2, ls=":")
            self._believed.curve("true error", color=TRUE, ls="none", marker=".")
            self._believed.curve("believed sd", color=BELIEVED, lw=1.6)
            self._believed.legend()
        self._ladder.legend()
        self._residual.legend()

    def set(self, view: View) -> None:
        h = view.history
        self._ladder.set(_RUN, h.time, h.rate / DEG)
        switched = np.flatnonzero(np.diff(h.power_up) > 0) + 1
        self._ladder.set(_SWITCHED, h.time[switched], h.rate[switched] / DEG)
        self._ladder.limits(h.rate / DEG, least=1.0)
        self._set_residual(view)
        self._set_believed(view)

    def _set_residual(self, view: View) -> None:
        found = line(view)
        nothing = np.zeros(0)
        if found is None:
            for name in (_POINTS, _CURVE):
                self._residual.set(name, nothing, nothing)
            self._residual.set_band(_BAND, nothing, nothing, nothing)
            self._residual.limits(nothing)
            return
        self._residual.set(_POINTS, found.rate / DEG, found.residual / PPM)
        self._residual.set_band(_BAND, found.rate / DEG, -found.band / PPM, found.band / PPM)
        inside = np.abs(view.true_rates) <= np.abs(found.rate).max()
        self._residual.set(_CURVE, view.true_rates[inside] / DEG, found.curve[inside] / PPM)
        # A level that was hardly visited has a wide band, which shall not squeeze the rest into a line.
        wide = np.quantile(found.band, 0.75) / PPM
        self._residual.limits(found.residual / PPM, found.curve[inside] / PPM, np.array([-wide, wide]), least=1.0)

    def _set_believed(self, view: View) -> None:
        if self._believed is None:
            return
        h = view.history
        true, mean, sd = h.scale_factor.T
        error = np.abs(mean - true) / PPM
        demanded = np.full(2, np.nan if view.demanded is None else view.demanded / PPM)
        self._believed.set("demanded", np.array([0.0, view.duration]), demanded)
        self._believed.set("true error", h.time, error)
        self._believed.set("believed sd", h.time, sd / PPM)
        floor = 0.05 * np.min(sd, initial=np.inf) / PPM
        self._believed.limits(sd / PPM, np.maximum(error, floor), demanded)
