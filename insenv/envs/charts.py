"""Strip charts, and the magnifier of a value that is believed.

What is set depends on the values given last and on nothing before (see `insenv.envs.render`).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.ticker import AutoMinorLocator, FixedLocator, FuncFormatter, MaxNLocator, NullLocator
from matplotlib.transforms import Transform

from insenv.core.recording import Floats
from insenv.envs.render import BELIEVED, FAINT, QUIET, TRUE
from insenv.report.drawing import log_ticks

_TICKS = MaxNLocator(5, steps=[1, 2, 2.5, 5, 10])
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class StripChart:
    """Curves against time that grow from the left, on a time axis of fixed length.

    Parameters
    ----------
    ax : Axes
    label : str
        Quantity and unit.
    duration : float
        Length of the time axis [s].
    logarithmic : bool
        The vertical scale; what is not positive is then left out.
    apart : float
        Distance of the label from the axis, as a fraction of the picture's width.
    """

    def __init__(self, ax: Axes, label: str, duration: float, logarithmic: bool = False, apart: float = 0.063) -> None:
        self.ax, self.logarithmic = ax, logarithmic
        self._lines: dict[str, Line2D] = {}
        self._bands: dict[str, Polygon] = {}
        ax.set_ylabel(label)
        place = ax.get_position()
        # Labels of charts above each other stand in one line, whatever the ticks say.
        ax.yaxis.set_label_coords(place.x0 - apart, 0.5 * (place.y0 + place.y1), transform=_whole(ax))
        ax.set_xlim(0.0, duration)
        ax.yaxis.set_animated(True)
        ax.grid(True, color=FAINT, lw=0.6)
        ax.set_axisbelow(True)
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=8.5)
        ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 3, 5, 6, 10]))
        ax.xaxis.set_minor_locator(AutoMinorLocator(2))
        if logarithmic:
            ax.set_yscale("log")
            ax.yaxis.set_minor_locator(NullLocator())
        most = 1e4 if logarithmic else 1e6
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: plain(value, most)))
        middle: dict[str, Any] = {"ha": "center", "va": "center", "transform": ax.transAxes}
        self._note = ax.text(0.5, 0.5, "nothing measured yet", color=QUIET, animated=True, **middle)

    def curve(self, name: str, **look: Any) -> None:
        """Add a curve; its name stands in the legend."""
        (self._lines[name],) = self.ax.plot([], [], label=name, ms=4, animated=True, **look)

    def band(self, name: str, **look: Any) -> None:
        """Add a band between two curves."""
        # Ones, as a logarithmic scale has no zero.
        self._bands[name] = Polygon(np.ones((3, 2)), closed=True, label=name, lw=0, animated=True, **look)
        self.ax.add_patch(self._bands[name])

    def legend(self) -> None:
        """Name the curves above the axes, where no curve is hidden; call it when all are added."""
        self.ax.legend(
            loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=4, frameon=False, fontsize=8.2,
            borderaxespad=0.1, handlelength=1.5, columnspacing=1.0, handletextpad=0.5,
        )  # fmt: skip

    def set(self, name: str, t: Floats, y: Floats) -> None:
        """Values of a curve, each of shape (k,)."""
        good = np.isfinite(y) & ((y > 0) | (not self.logarithmic))
        # NaN breaks the line where something is missing.
        self._lines[name].set_data(t, np.where(good, y, np.nan))
        if self._lines[name].get_linestyle() != "None":
            # A line of one point would not be seen.
            self._lines[name].set_marker("o" if np.count_nonzero(good) == 1 else "")

    def set_band(self, name: str, t: Floats, low: Floats, high: Floats) -> None:
        """Edges of a band, each of shape (k,)."""
        good = np.isfinite(low) & np.isfinite(high)
        t, low, high = t[good], low[good], high[good]
        self._bands[name].set_visible(len(t) > 0)
        if len(t):
            edge = np.concatenate([low, high[::-1]])
            self._bands[name].set_xy(np.column_stack([np.concatenate([t, t[::-1]]), edge]))

    def limits(self, *shown: Floats, least: float = 0.0) -> None:
        """Vertical axis that holds the values ``shown``, arrays of any shape; a linear one spans ``least`` at least."""
        values = np.concatenate([np.ravel(v) for v in shown])
        values = values[np.isfinite(values) & ((values > 0) | (not self.logarithmic))]
        self._note.set_visible(not len(values))
        low, high = (values.min(), values.max()) if len(values) else (1.0, 2.0)
        if self.logarithmic:
            low, high = low / 1.5, high * 1.5
            ticks = log_ticks(low, high, 5)
        else:
            margin = max(0.08 * (high - low), 0.5 * (least - (high - low))) or 1.0
            low, high = low - margin, high + margin
            ticks = [v for v in _TICKS.tick_values(low, high) if low <= v <= high]
        self.ax.set_ylim(low, high)
        self.ax.yaxis.set_major_locator(FixedLocator(ticks if len(values) else []))


class Magnifier:
    """A normal density about a value, against a line at zero: how far is it, and how sure."""

    def __init__(self, ax: Axes) -> None:
        self.ax = ax
        ax.set_yticks([])
        ax.set_ylim(0, 1.12)
        ax.spines[["top", "right", "left"]].set_visible(False)
        ax.tick_params(labelsize=8.5)
        ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: plain(value)))
        ax.xaxis.set_animated(True)
        look: dict[str, Any] = {"closed": True, "fc": BELIEVED, "lw": 0, "animated": True}
        self._density = Polygon(np.zeros((3, 2)), alpha=0.18, **look)
        self._within = Polygon(np.zeros((3, 2)), alpha=0.35, **look)
        ax.add_patch(self._density)
        ax.add_patch(self._within)
        (self._middle,) = ax.plot([], [], color=BELIEVED, lw=1.8, animated=True)
        ax.axvline(0.0, ymax=0.95, color=TRUE, lw=2.2, animated=True)

    def set(self, value: float, sd: float, most: float, unit: str) -> None:
        """Value and standard deviation in the unit of the axis, which reaches to ``most`` at most.

        With an infinite deviation nothing is believed, wherever the value.
        """
        known = np.isfinite(sd)
        reach = min(_round_up(max(3.5 * sd, 1.25 * abs(value), 1e-9)), most) if known else most
        self.ax.set_xlim(-reach, reach)
        self.ax.set_xticks(np.linspace(-reach, reach, 5))
        self.ax.set_xlabel(unit, fontsize=9)
        self._within.set_visible(known)
        self._middle.set_visible(known)
        if not known:
            self._density.set_xy([(-reach, 0), (-reach, 1), (reach, 1), (reach, 0)])
            return
        # A peak narrower than a pixel is still one.
        sd = max(sd, 1e-3 * reach)
        x = value + sd * np.linspace(-4, 4, 161)
        self._density.set_xy(_bell(x, value, sd))
        self._within.set_xy(_bell(x[np.abs(x - value) <= 1.0001 * sd], value, sd))
        self._middle.set_data([value, value], [0.0, 1.0])


def _whole(ax: Axes) -> Transform:
    """From fractions of the picture to pixels."""
    figure = ax.get_figure(root=True)
    assert figure is not None
    return figure.transSubfigure


def _bell(x: Floats, value: float, sd: float) -> Floats:
    y = np.exp(-0.5 * ((x - value) / sd) ** 2)
    return np.column_stack([np.r_[x[0], x, x[-1]], np.r_[0.0, y, 0.0]])


def plain(value: float, most: float = 1e6) -> str:
    """A number for a tick: short, with a true minus sign; from ``most`` on, and small ones, as powers of ten."""
    value = 0.0 if abs(value) < 1e-12 else value
    if value == 0 or 1e-3 <= abs(value) < most:
        return f"{value:.6g}".replace("-", "−")
    factor, _, power = f"{value:.3e}".partition("e")
    digits = f"{float(factor):g}".replace("-", "−")
    ten = "10" + str(int(power)).translate(_SUPERSCRIPT)
    return {"1": ten, "−1": "−" + ten}.get(digits, f"{digits}·{ten}")


def _round_up(value: float) -> float:
    """The next 1, 2, 4 or 10 times a power of ten: halves of these are short numbers too."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * next(s for s in (1.0, 2.0, 4.0, 10.0) if s * power >= value * (1 - 1e-9)))
