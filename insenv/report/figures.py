"""The pictures of a report: before in orange, after in blue, fitted dark, declared dashed.

Every function returns a `matplotlib.figure.Figure` of its own; nothing here touches pyplot or global state.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from insenv.core.quantities import ShownUnit, unit_for
from insenv.core.recording import Floats
from insenv.core.units import ZERO_CELSIUS
from insenv.identify.findings import Spectra, TargetFindings
from insenv.report import drawing as draw
from insenv.report.binning import BinnedMeans, Timeline, envelope, means, means_of_runs, paths, smoothed, timeline

_PANEL, _WIDE, _README = (5.2, 4.3), (10.6, 4.6), (12.0, 3.9)
_BINS = {"angle": 36}
#: Means in time that a path against temperature goes through.
_PATH = 60
#: Fewer points than this are shown one by one: rests, turns.
_FEW = 100
#: Range of the table angle [deg] from which it counts as going round.
_FULL_TURN = 270.0

#: What turns a residual into means in bins.
Binning = Callable[[Floats], BinnedMeans]


@draw.style()
def against_time(target: TargetFindings, narrow: bool = False) -> Figure:
    """Residual against time: before and after on one scale, below it after enlarged; held-out shaded."""
    figure = _figure(_PANEL if narrow else _WIDE)
    line, label = time_of(target)
    axes = _rows(figure, target)
    for ax in axes:
        draw.shade(ax, line, target.traces.held_out)
    _pair(axes, line.x, target, _in_time(line))
    draw.mark_runs(axes[0], line)
    axes[-1].set_xlabel(label)
    return figure


@draw.style()
def against(target: TargetFindings, covariate: str) -> Figure:
    """Residual against "angle", "rate" or "temperature", as `against_time`.

    What is joined against temperature is time: a bias that follows it late runs through a loop.
    """
    figure = _figure(_PANEL)
    x, label = covariate_of(covariate, target.traces.covariates[covariate])
    axes = _rows(figure, target)
    if covariate == "temperature" and len(x) >= _FEW:
        line, _ = time_of(target)
        _pair(axes, x, target, lambda y: paths(line, x, y, target.traces.held_out, _PATH))
        for ax in axes:
            ax.plot([], [], color=draw.FITTED, lw=1.3, ls=draw.DOTTED, label="held out")
            draw.legend(ax)
    else:
        _pair(axes, x, target, lambda y: means(x, y, _BINS.get(covariate, 24)))
    if covariate == "angle" and np.ptp(x[np.isfinite(x)]) >= _FULL_TURN:
        axes[-1].set_xlim(0, 360)
        axes[-1].set_xticks(range(0, 361, 60))
    axes[-1].set_xlabel(label)
    return figure


def covariates(target: TargetFindings) -> tuple[str, ...]:
    """Covariates of the target that vary, in the order in which they are shown."""
    known = target.traces.covariates
    order = ("angle", "rate", "temperature", "force", "turned")
    return tuple(key for key in order if key in known and _varies(known[key]))


@draw.style()
def spectrum(target: TargetFindings) -> Figure:
    """Root spectral density of the residual before and after, fitted and declared noise."""
    figure = _figure(_PANEL)
    _spectrum(figure.add_subplot(), target.spectra, unit_of(target), _changed(target))
    return figure


@draw.style()
def allan(target: TargetFindings) -> Figure:
    """Allan deviation of the residual before and after with its 68 % band, fitted and declared noise."""
    figure, s, unit = _figure(_PANEL), target.spectra, unit_of(target)
    ax = figure.add_subplot()
    if _changed(target):
        draw.curve(ax, s.tau, s.allan_before, unit, color=draw.BEFORE, lw=1.5, marker="o", ms=2.6, label="before")
    good = (s.tau > 0) & (s.allan_lower > 0) & np.isfinite(s.allan_upper)
    ax.fill_between(
        s.tau[good],
        unit.each(s.allan_lower[good]),
        unit.each(s.allan_upper[good]),
        color=draw.AFTER,
        alpha=0.22,
        lw=0,
    )
    draw.curve(
        ax,
        s.tau,
        s.allan_after,
        unit,
        color=draw.AFTER,
        lw=1.5,
        marker="o",
        ms=2.6,
        label=_after_label(target),
    )
    draw.models(ax, s.tau, s.allan_fitted, s.allan_declared, unit)
    draw.log_log(ax, s.tau, [s.allan_before, s.allan_after, s.allan_lower, s.allan_upper], unit)
    ax.set_xlabel("averaging time [s]")
    ax.set_ylabel(f"Allan deviation [{unit.label}]")
    draw.legend(ax)
    return figure


@draw.style()
def overview(target: TargetFindings) -> Figure:
    """One wide picture: residual before and after against time, and its spectrum."""
    figure = _figure(_README)
    left, right = figure.subplots(1, 2, width_ratios=(1.75, 1))
    line, label = time_of(target)
    unit = unit_of(target)
    draw.shade(left, line, target.traces.held_out)
    _both(left, line.x, target, _in_time(line))
    draw.mark_runs(left, line)
    left.set_xlabel(label)
    left.set_ylabel(f"residual [{unit.label}]")
    _spectrum(right, target.spectra, unit, _changed(target))
    return figure


def _figure(size: tuple[float, float]) -> Figure:
    return Figure(figsize=size, layout="constrained", facecolor="white")


def _rows(figure: Figure, target: TargetFindings) -> Sequence[Axes]:
    """Two axes above each other, or one where nothing was added."""
    if not _changed(target):
        return [figure.add_subplot()]
    return list(figure.subplots(2, 1, sharex=True))


def _in_time(line: Timeline) -> Binning:
    """Binning of a residual in time, fine enough to follow it where there are many points."""
    return lambda y: means_of_runs(line, y, int(np.clip(len(line.x) / 12, 30, 200)))


def _pair(axes: Sequence[Axes], x: Floats, target: TargetFindings, binning: Binning) -> None:
    """Before and after on the first axes, after alone on the second."""
    unit = unit_of(target)
    _both(axes[0], x, target, binning)
    if len(axes) > 1:
        after = unit.each(target.traces.after)
        _residual(axes[1], x, after, binning, (draw.AFTER, draw.AFTER_MEAN), "after, enlarged")
        draw.limit(axes[1], after)
        draw.legend(axes[1])
    for ax in axes:
        ax.set_ylabel(f"residual [{unit.label}]")
    axes[0].figure.align_ylabels(axes)


def _both(ax: Axes, x: Floats, target: TargetFindings, binning: Binning) -> None:
    """Before and after on the same axes: points, and means in bins."""
    unit = unit_of(target)
    before, after = unit.each(target.traces.before), unit.each(target.traces.after)
    if _changed(target):
        _residual(ax, x, before, binning, (draw.BEFORE, draw.BEFORE_MEAN), "before")
    _residual(ax, x, after, binning, (draw.AFTER, draw.AFTER_MEAN), "after" if _changed(target) else "residual")
    draw.limit(ax, *((before, after) if _changed(target) else (after,)))
    draw.legend(ax)


def _residual(ax: Axes, x: Floats, y: Floats, binning: Binning, colors: tuple[str, str], label: str) -> None:
    """A residual as points and means in bins; where the points are few, as points alone."""
    if len(x) < _FEW:
        ax.plot(x, y, "o", ms=4.2, mec="white", mew=0.4, color=colors[0], label=label, zorder=3)
        return
    draw.cloud(ax, x, y, colors[0])
    b = binning(y)
    draw.mean_line(ax, b, colors[1], f"{label} ({'mean in time' if b.held_out is not None else 'line: bin means'})")


def _spectrum(ax: Axes, s: Spectra, unit: ShownUnit, changed: bool) -> None:
    """Root spectral densities: thin as computed, thick averaged."""
    for density, color, label in ((s.psd_before, draw.BEFORE, "before"), (s.psd_after, draw.AFTER, "after")):
        if label == "before" and not changed:
            continue
        draw.curve(ax, *envelope(s.f, np.sqrt(density)), unit, color=color, lw=0.5, alpha=0.35)
        f, mean = smoothed(s.f, density)
        draw.curve(ax, f, np.sqrt(mean), unit, color=color, lw=1.6, label=label if changed else "residual")
    declared = None if s.psd_declared is None else np.sqrt(s.psd_declared)
    draw.models(ax, s.f, np.sqrt(s.psd_fitted), declared, unit)
    draw.log_log(ax, s.f, [np.sqrt(s.psd_before), np.sqrt(s.psd_after)], unit)
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel(f"two-sided root PSD [{per_root_hertz(unit)}]")
    draw.legend(ax)


def per_root_hertz(unit: ShownUnit) -> str:
    """Unit of a root spectral density."""
    return f"({unit.label})/√Hz" if "/" in unit.label else f"{unit.label}/√Hz"


def _changed(target: TargetFindings) -> bool:
    return bool(target.added)


def _after_label(target: TargetFindings) -> str:
    return "after, 68 % band" if _changed(target) else "residual, 68 % band"


def unit_of(target: TargetFindings) -> ShownUnit:
    """One unit for all pictures of a target, by the size of its residual before."""
    size = np.abs(target.traces.before[np.isfinite(target.traces.before)])
    return unit_for(target.held_out.unit, float(np.quantile(size, 0.9)) if len(size) else 0.0)


def time_of(target: TargetFindings) -> tuple[Timeline, str]:
    """All runs on one axis, in a unit of time that suits them, and the label of the axis."""
    line = timeline(target.traces)
    seconds, label = _time_unit(float(np.ptp(line.x)) if len(line.x) else 0.0)
    runs = tuple((run, start / seconds, stop / seconds) for run, start, stop in line.runs)
    moved = not np.array_equal(line.x, target.traces.t)
    return Timeline(line.x / seconds, runs), f"time{', runs one after the other' if moved else ''} [{label}]"


def _time_unit(length: float) -> tuple[float, str]:
    if length <= 1200:
        return 1.0, "s"
    return (60.0, "min") if length <= 3 * 3600 else (3600.0, "h")


def covariate_of(name: str, values: Floats) -> tuple[Floats, str]:
    """Values of a covariate to be drawn, and the label of its axis."""
    if name == "temperature":
        return values - ZERO_CELSIUS, "temperature [°C]"
    if name == "angle":
        return _turned(values), "table angle [deg]"
    if name == "force":
        return values, "specific force along the axis [m/s²]"
    if name == "turned":
        return np.rad2deg(values), "turned about the axis from rest to rest [deg]"
    unit = unit_for("rad/s", float(np.nanmax(np.abs(values))))
    return unit.each(values), f"rate [{unit.label}]"


def _turned(angle: Floats) -> Floats:
    """Table angle [deg] within one turn: about its middle where the table only swings, else from zero."""
    middle = np.angle(np.nanmean(np.exp(1j * angle)))
    about = np.rad2deg(middle + np.angle(np.exp(1j * (angle - middle))))
    return about if np.nanmax(about) - np.nanmin(about) < _FULL_TURN else np.mod(np.rad2deg(angle), 360)


def _varies(values: Floats) -> bool:
    """Whether there is anything to see against ``values``."""
    finite = values[np.isfinite(values)]
    return len(finite) > 1 and bool(np.ptp(finite) > 1e-6 * np.abs(finite).max())
