"""What the pictures of a report are drawn with: colours, points, means, shading, logarithmic axes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as MplPath
from matplotlib.ticker import (
    AutoMinorLocator,
    FixedLocator,
    FuncFormatter,
    LogLocator,
    MaxNLocator,
    NullFormatter,
    ScalarFormatter,
)
from numpy.typing import NDArray

from insenv.core.quantities import ShownUnit
from insenv.core.recording import Floats
from insenv.report.binning import BinnedMeans, Timeline, reach, stretches

#: Colours of the stylesheet, as they are on paper: on a page each is the variable of its name, which knows the dark.
PALETTE = {
    "page": "#ffffff", "ink": "#1c2128", "soft": "#57606a", "grey": "#6a737d", "held": "#e4eaf1", "grid": "#d9dee4",
    "faint": "#eef1f4", "before": "#b8501a", "before-mean": "#7d3a0c", "after": "#2f74c0", "after-mean": "#0d3f7d",
    "good-wash": "#e7f1e4", "series-3": "#2f7d4d", "series-4": "#8a3d7a", "series-5": "#0b7a7c", "series-6": "#8a6d1b",
    "series-7": "#a03030", "series-8": "#5a6470",
}  # fmt: skip
BEFORE, AFTER, FITTED, DECLARED = (PALETTE[name] for name in ("before", "after", "ink", "grey"))
HELD_OUT, GRID = PALETTE["held"], PALETTE["grid"]
BEFORE_MEAN, AFTER_MEAN = PALETTE["before-mean"], PALETTE["after-mean"]
#: Of several curves, in their order; they differ in lightness too.
SERIES = (AFTER, BEFORE, *(PALETTE[f"series-{k}"] for k in range(3, 9)))

_INK = ("text.color", "axes.edgecolor", "axes.labelcolor", "axes.titlecolor", "xtick.color", "ytick.color")
#: Letters are letters, in the font of the page and on its ground.
_STYLE = {
    "svg.fonttype": "none", "svg.hashsalt": "insenv", "font.size": 9.5, "axes.labelsize": 9.5,
    "axes.facecolor": "none", "legend.framealpha": 0.0, **dict.fromkeys(_INK, FITTED),
}  # fmt: skip

#: Points of a cloud that are drawn for each inch of a picture, and the share of all that are drawn for being far out.
POINTS, FAR = 36, 0.005
#: Line of what is held out, where it cannot be shaded.
DOTTED = (0, (1, 1.2))
#: Length of a stroke that stands for a point, as a share of all points' span.
_STROKE = 1e-6
#: Share of a step by which what is drawn of many points goes on from one to the next.
GOLDEN = 0.5 * (5**0.5 - 1)


@contextmanager
def style() -> Iterator[None]:
    """Draw with the defaults of matplotlib and our few changes, whatever the machine's matplotlibrc says."""
    with matplotlib.style.context(["default", _STYLE]):
        yield


def cloud(ax: Axes, x: Floats, y: Floats, color: str) -> None:
    """Points, fainter and smaller the more there are: every so many-th, and all that lie far out."""
    width = ax.figure.get_figwidth() if isinstance(ax.figure, Figure) else 5.0
    shown = _thinned(y, round(POINTS * width))
    crowd = 500 / max(int(np.count_nonzero(shown)), 1)
    stroke, alpha = float(np.clip(3.2 * np.sqrt(crowd), 1.3, 3.4)), float(np.clip(crowd, 0.3, 0.65))
    # Strokes of next to no length with round ends: one path, a tenth of the size of markers. A picture of pixels has
    # none of no length at all, and none that is snapped to one pixel.
    kept = shown & np.isfinite(x) & np.isfinite(y)
    points = np.repeat(np.column_stack([x, y])[kept], 2, axis=0)
    points[1::2, 0] += _STROKE * (float(np.ptp(x[kept])) or 1.0) if kept.any() else 0.0
    codes = np.tile([MplPath.MOVETO, MplPath.LINETO], len(points) // 2)
    path = MplPath(points, codes)
    path.should_simplify = False
    ax.add_artist(PathPatch(path, fill=False, ec=color, lw=stroke, alpha=alpha, capstyle="round", snap=False, zorder=2))
    # As a patch its limits would be sought curve by curve, a tenth of the time of a page.
    ax.update_datalim(points)
    ax.autoscale_view()


def _thinned(y: Floats, most: int) -> NDArray[np.bool_]:
    """Which of many values are drawn: ``most`` of them, and the furthest from the middle in addition."""
    share = most / max(len(y), 1)
    kept = np.mod(np.arange(len(y)) * GOLDEN, 1) < share  # evenly spread, and in step with nothing that turns
    finite = np.isfinite(y)
    if share < 1 and finite.any():
        off = np.abs(y - np.median(y[finite]))
        kept |= off > np.quantile(off[finite], 1 - FAR)
    return kept


def mean_line(ax: Axes, b: BinnedMeans, color: str, label: str) -> None:
    """Means as a line; with marks and bars of their scatter where they are few enough to be told apart."""
    if b.held_out is not None:
        for part, look in ((~b.held_out, "-"), (b.held_out, DOTTED)):
            x, y = np.where(part, b.x, np.nan), np.where(part, b.mean, np.nan)
            ax.plot(x, y, color=color, lw=1.3, ls=look, label=label if look == "-" else "_", zorder=4)
        return
    if len(b.x) > 60:
        ax.plot(b.x, b.mean, color=color, lw=1.3, label=label, zorder=4)
        return
    dots: dict[str, Any] = {"marker": "o", "ms": 3.4, "mec": "white", "mew": 0.3}
    ax.errorbar(b.x, b.mean, b.error, color=color, lw=1.3, elinewidth=0.8, label=label, zorder=4, **dots)


def limit(ax: Axes, *residuals: Floats) -> None:
    """Symmetric limits; points beyond them are counted in the corner instead of squeezing the rest."""
    limit, beyond = reach(*residuals)
    ax.set_ylim(-limit, limit)
    ax.axhline(0, color=FITTED, lw=0.6, zorder=1)
    ax.grid(True, color=GRID, lw=0.5, zorder=0)
    ax.xaxis.set_minor_locator(AutoMinorLocator(2))
    ax.yaxis.set_major_locator(MaxNLocator(5))
    if 1e-4 < limit < 1e6:
        ax.yaxis.set_major_formatter(plain := ScalarFormatter(useOffset=False))
        plain.set_powerlimits((-7, 7))
    else:  # not as one factor above the axis, which the legend would hide
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: _power_of_ten(value)))
    if beyond:
        text = f"{beyond} point{'s' * (beyond > 1)} outside"
        ax.text(0.995, 0.02, text, transform=ax.transAxes, ha="right", va="bottom", fontsize=7.5, color=DECLARED)


def shade(ax: Axes, line: Timeline, held_out: NDArray[np.bool_]) -> None:
    """Held-out stretches in grey, and limits in time that fit the data."""
    label: str | None = "held out"
    for start, stop in stretches(line.x, held_out):
        ax.axvspan(start, stop, color=HELD_OUT, lw=0, zorder=0, label=label)
        label = None
    if len(line.x):
        margin = 0.01 * (np.ptp(line.x) or 1.0)
        ax.set_xlim(line.x.min() - margin, line.x.max() + margin)


def mark_runs(ax: Axes, line: Timeline) -> None:
    """Mark where runs start, where there are several, and name those that are wide enough for it."""
    if len(line.runs) < 2:
        return
    for run, start, stop in line.runs:
        ax.axvline(start, color=DECLARED, lw=0.7, ls=":", zorder=1)
        if stop - start < 0.05 * (line.runs[-1][2] - line.runs[0][1]):
            continue
        where = 0.5 * (start + stop), 0.97
        ax.annotate(
            f"run {run}",
            where,
            xycoords=("data", "axes fraction"),
            ha="center",
            va="top",
            fontsize=8,
            color=DECLARED,
        )


def models(ax: Axes, x: Floats, fitted: Floats, declared: Floats | None, unit: ShownUnit) -> None:
    """Fitted noise dark, declared noise dashed."""
    curve(ax, x, fitted, unit, color=FITTED, lw=1.3, label="fitted noise", zorder=5)
    if declared is not None:
        curve(ax, x, declared, unit, color=DECLARED, lw=1.3, ls=(0, (4, 2.5)), label="declared noise", zorder=5)


def curve(ax: Axes, x: Floats, y: Floats, unit: ShownUnit, **style: object) -> None:
    """A curve on logarithmic axes: what is not positive and finite is left out."""
    good = (x > 0) & np.isfinite(y) & (y > 0)
    ax.plot(x[good], unit.each(y[good]), **style)  # type: ignore[arg-type]


def log_log(ax: Axes, x: Floats, curves: Sequence[Floats], unit: ShownUnit) -> None:
    """Logarithmic scales whose limits hold the measured curves, whatever the models do beyond them."""
    ax.set_xscale("log")
    ax.set_yscale("log")
    values = np.concatenate([unit.each(y[(x > 0) & np.isfinite(y) & (y > 0)]) for y in curves])
    if len(values):
        low, high = np.quantile(values, 0.01), values.max()
        ax.set_ylim(low / 1.8, high * 1.8)
    for axis, limits in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
        axis.set_major_locator(FixedLocator(log_ticks(*limits)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: _tick_label(value)))
        axis.set_minor_locator(LogLocator(subs=range(1, 10), numticks=99))
        axis.set_minor_formatter(NullFormatter())
    ax.grid(True, which="major", color=GRID, lw=0.6)


def log_ticks(low: float, high: float, most: int = 7) -> list[float]:
    """Three to eight values between ``low`` and ``high`` to label: decades, else 1-2-5, else 1 to 9.

    Over a narrow range they are evenly spaced; of more than ``most`` decades every second is taken, or fewer.
    """
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for steps in ((1,), (1, 2, 5), range(1, 10)):
        ticks = [step * 10.0**n for n in decades for step in steps if low <= step * 10.0**n <= high]
        if len(ticks) > 2:
            return ticks[:: math.ceil(len(ticks) / most) if steps == (1,) else 1]
    return [float(v) for v in MaxNLocator(4).tick_values(low, high) if low <= v <= high]


def _tick_label(value: float) -> str:
    """A plain number where that is short, else with a power of ten."""
    if 1e-3 <= value < 1e5:
        return f"{value:.6g}"
    return _power_of_ten(value)


def _power_of_ten(value: float) -> str:
    """A number as factor and power of ten, in mathtext."""
    if value == 0:
        return "0"
    power = math.floor(math.log10(abs(value)) + 1e-9)
    factor = f"{value / 10.0**power:.4g}"
    return f"${'' if factor == '1' else factor + '·'}10^{{{power}}}$"


def legend(ax: Axes) -> None:
    """Above the axes, where it covers nothing."""
    handles, labels = ax.get_legend_handles_labels()
    ax.legend(
        handles, labels, loc="lower left", bbox_to_anchor=(0, 1.0), ncols=4, frameon=False, fontsize=8.2,
        borderaxespad=0.2, handlelength=1.4, columnspacing=0.8,
    )  # fmt: skip
    ax.spines[["top", "right"]].set_visible(False)
