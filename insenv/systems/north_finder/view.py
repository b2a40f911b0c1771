"""What the north finder looks like: the table from above, and strip charts of a run.

North is at the top of the dial. The input axis at table angle a points to azimuth az - a; an estimator that
believes in az^ takes for north what lies at azimuth az - az^.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon, Rectangle

from insenv.core.attitude import wrapped
from insenv.core.units import ARCSEC, DEG, DEG_PER_HOUR, PPM
from insenv.envs.charts import StripChart
from insenv.envs.dial_picture import BeliefPanel, DialPicture
from insenv.envs.render import (
    BELIEVED,
    INSTRUMENT,
    PLATE,
    QUIET,
    TRUE,
    Canvas,
    Dial,
    Drawing,
    Frame,
    on_circle,
    plain_angle,
    plain_bearing,
)
from insenv.systems.north_finder.frame import IGNORANT, History, View

__all__ = ["History", "Renderer", "View", "draw"]


def draw(view: View, size: tuple[int, int] = (960, 600)) -> Frame:
    """One frame, shape (height, width, 3).

    For many frames keep a `Renderer`: it draws the same in a third of the time.

    Raises
    ------
    InputError
        If the size [pixels] is too small for a picture.
    """
    return Renderer(size).draw(view)


class Renderer(Drawing):
    """Draws frames of the north finder."""

    def kind(self, view: View) -> tuple[Any, ...]:
        """Who believes in what, and the ranges of the charts."""
        return view.belief is not None, len(view.history.believed_scale_factor) > 0, view.duration

    def layout(self, size: tuple[int, int], *kind: Any) -> DialPicture:
        """The picture of that kind."""
        believes, scale_factor, duration = kind

        def strips(canvas: Canvas) -> _Strips:
            return _Strips(canvas, duration, believes, scale_factor)

        return DialPicture(size, ("north finder", "north"), believes, _Table, _Belief, strips)


class _Table:
    """Table from above: what turns with it is made once, with the gyro's axis to the top, and then rotated."""

    def __init__(self, ax: Axes, believes: bool) -> None:
        dial = Dial(ax, {0: "N", 90: "E", 180: "S", 270: "W"})
        self._rotation, self._turning = dial.turning()
        ax.add_patch(Circle((0, 0), 0.80, fc=PLATE, ec=QUIET, lw=1.0, zorder=2))
        self._plate(ax)
        self._true = dial.pointer((0.0, 1.0), "true north", color=TRUE, lw=5.0, zorder=3)
        (self._zero,) = ax.plot(
            [], [], "D", ms=6, color=QUIET, label="zero of the table angle", zorder=4.2, animated=True
        )
        if believes:
            look = {"fc": BELIEVED, "lw": 0, "zorder": 2.5}
            self._sector = dial.sector((0.82, 0.985), "± 1 standard deviation", alpha=0.35, **look)
            self._believed = dial.pointer((0.0, 0.985), "believed north", color=BELIEVED, lw=2.0, zorder=4)
        self._turn = (dial.arrow(self._turning, 90.0, color=TRUE), dial.arrow(self._turning, 270.0, color=TRUE))
        self._corners = dial.corners()
        ax.legend(
            loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=3, frameon=False, fontsize=8.5, borderaxespad=0.3,
            handlelength=1.6, columnspacing=1.2, handletextpad=0.5,
        )  # fmt: skip

    def _plate(self, ax: Axes) -> None:
        holes = np.deg2rad(np.arange(22.5, 360, 45))
        look: dict[str, Any] = {"transform": self._turning, "zorder": 5, "animated": True}
        ax.plot(0.70 * np.sin(holes), 0.70 * np.cos(holes), "o", ms=4, mfc="white", mec=QUIET, **look | {"zorder": 2.2})
        ax.add_patch(Rectangle((-0.15, -0.24), 0.30, 0.40, fc="#f6c9a8", ec=INSTRUMENT, lw=1.2, **look))
        ax.plot([0, 0], [-0.24, 0.66], color=INSTRUMENT, lw=3.0, label="gyro axis", **look)
        ax.add_patch(Polygon([(-0.06, 0.64), (0.06, 0.64), (0.0, 0.79)], fc=INSTRUMENT, lw=0, **look))

    def set(self, view: View) -> None:
        axis = view.azimuth_true - view.table_angle
        self._rotation.clear().rotate(-axis)
        self._true.set(0.0)
        x, y = on_circle(0.9, view.azimuth_true)
        self._zero.set_data([x], [y])
        for arrow in self._turn:
            arrow.set(view.rate)
        if view.belief is not None:
            mean, sd = view.belief
            direction = view.azimuth_true - mean
            known = sd < IGNORANT
            self._sector.set(direction if known else 0.0, sd if known else np.pi)
            self._believed.set(direction if known else None)
        texts = (
            f"table rate\n{plain_angle(view.rate, 2)}/s",
            f"table angle\n{plain_bearing(view.table_angle, 1)}",
            f"axis elevation\n{plain_angle(view.tilt, 1)}",
            f"axis azimuth\n{plain_bearing(axis, 1)}",
        )
        for corner, text in zip(self._corners, texts, strict=True):
            corner.set_text(text)


class _Belief(BeliefPanel):
    """Azimuth in numbers, and the top of the dial magnified: where north is believed, against where it is."""

    def set(self, view: View) -> None:
        assert view.belief is not None
        mean, sd = view.belief
        known = sd < IGNORANT
        # A positive error of the azimuth moves the believed north to the west.
        east = wrapped(view.azimuth_true - mean) if known else 0.0
        unit, name, most = (DEG, "deg", 180.0) if max(sd, abs(east)) > DEG else (ARCSEC, "arcsec", np.inf)
        label = f"believed north, east of true north [{name}]"
        self._magnifier.set(east / unit, sd / unit if known else np.inf, most, label)
        places = int(np.clip(1 - np.floor(np.log10(max(sd, 1e-12) / DEG)), 0, 7)) if known else 1
        true = f"azimuth: true {plain_bearing(view.azimuth_true, places)}"
        believed = f"{plain_bearing(mean, places)} ± {_spread(sd)}" if known else "unknown"
        self._numbers.set_text(f"{true}, believed {believed}")


def _spread(sd: float) -> str:
    """A standard deviation with the two digits that it deserves."""
    value, sign = (sd / DEG, "°") if sd >= DEG else (sd / ARCSEC, "″")
    return f"{value:.{int(np.clip(1 - np.floor(np.log10(value)), 0, 4))}f}{sign}" if value > 0 else "0″"


#: Names of the residual's curves.
_LESS_TABLE, _LESS_EARTH = "gyro − table − vertical Earth rate", "and − believed horizontal Earth rate"


class _Strips:
    """Residual, scale factor and, with an estimator, north against time."""

    def __init__(self, canvas: Canvas, duration: float, believes: bool, scale_factor: bool) -> None:
        self._believes, self._scale_factor = believes, scale_factor
        count = 3 if believes else 2
        bottom, top, gap = 0.085, 0.905, 0.065
        left, width = (0.525, 0.45) if believes else (0.565, 0.41)
        height = (top - bottom - gap * (count - 1)) / count
        axes = [canvas.axes(left, top - height - k * (height + gap), width, height) for k in range(count)]
        for ax in axes[:-1]:
            ax.tick_params(labelbottom=False)
        axes[-1].set_xlabel("time [s]")
        self._residual = StripChart(axes[0], "residual [deg/h]", duration)
        self._scale = StripChart(axes[1], "scale factor [ppm]", duration)
        self._residual.curve(_LESS_TABLE, color=INSTRUMENT, lw=1.2)
        if believes:
            self._residual.curve(_LESS_EARTH, color=BELIEVED, lw=1.2)
        if scale_factor:
            self._scale.band("± 1 sd", fc=BELIEVED, alpha=0.22)
            self._scale.curve("believed", color=BELIEVED, lw=1.6)
        self._scale.curve("true", color=TRUE, lw=1.6, ls=(0, (4, 2)))
        charts = [self._residual, self._scale]
        if believes:
            self._north = StripChart(axes[2], "north [arcsec]", duration, logarithmic=True)
            self._north.curve("demanded", color=QUIET, lw=1.2, ls=":")
            self._north.curve("true error", color=TRUE, ls="none", marker=".")
            self._north.curve("believed sd", color=BELIEVED, lw=1.6)
            charts.append(self._north)
        for chart in charts:
            chart.legend()

    def set(self, view: View) -> None:
        self._set_residual(view)
        self._set_scale_factor(view)
        if self._believes:
            self._set_north(view)

    def _set_residual(self, view: View) -> None:
        h = view.history
        shown = [h.residual / DEG_PER_HOUR]
        self._residual.set(_LESS_TABLE, h.time, shown[0])
        if self._believes:
            shown.append(h.unexplained / DEG_PER_HOUR)
            self._residual.set(_LESS_EARTH, h.time[: len(shown[1])], shown[1])
        self._residual.limits(*shown, least=0.01)

    def _set_scale_factor(self, view: View) -> None:
        h = view.history
        true = h.scale_factor / PPM
        self._scale.set("true", h.time, true)
        # A rate near zero makes much of little: such moments of a reversal shall not squeeze the rest into a line.
        good = np.isfinite(true)
        shown = [np.quantile(true[good], (0.02, 0.98)) if good.any() else true]
        if self._scale_factor:
            mean, sd = (h.believed_scale_factor / PPM).T
            self._scale.set("believed", h.time, mean)
            self._scale.set_band("± 1 sd", h.time, mean - sd, mean + sd)
            # What was believed while next to nothing was known shall not squeeze the rest into a line.
            good = sd <= 3 * np.median(sd[np.isfinite(sd)] if np.isfinite(sd).any() else 0.0)
            shown += [(mean - sd)[good], (mean + sd)[good]]
        self._scale.limits(*shown, least=1.0)

    def _set_north(self, view: View) -> None:
        h = view.history
        mean, sd = h.north.T
        error = np.where(sd < IGNORANT, np.abs(wrapped(mean - view.azimuth_true)) / ARCSEC, np.nan)
        demanded = np.full(2, np.nan if view.demanded is None else view.demanded / ARCSEC)
        self._north.set("demanded", np.array([0.0, view.duration]), demanded)
        self._north.set("true error", h.time, error)
        self._north.set("believed sd", h.time, sd / ARCSEC)
        # A passage of the error through zero needs no decades of its own.
        floor = 0.05 * np.min(sd, initial=np.inf) / ARCSEC
        self._north.limits(sd / ARCSEC, np.maximum(error, floor), demanded)
