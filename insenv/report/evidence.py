"""Pictures of the evidence: each added effect on what is left without it, and the samples by frequency.

shown beside an effect:   what is left + its own curve,   and the curve
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from insenv.core.recording import Floats
from insenv.identify.findings import SampleSpectrum, Switchable, TargetFindings
from insenv.report import drawing as draw
from insenv.report.binning import means
from insenv.report.figures import covariate_of, covariates, per_root_hertz, time_of, unit_of

#: Size of a picture of one effect, and of the samples [inch].
_EFFECT, _SAMPLES = (5.2, 2.7), (10.6, 3.3)
#: Share of a curve that a mean over a covariate must explain for the curve to be drawn against it; bins of it.
_EXPLAINED, _BINS = 0.98, 60
#: Points up to which the neighbours of each tell instead, and share that they must explain: they cut a curve's corners.
_FEW, _BY_NEIGHBOURS = 120, 0.9
#: Lines that are named in a picture.
_NAMED = 6


def effects(target: TargetFindings, model: Switchable) -> Iterator[tuple[str, Figure]]:
    """Keys of the added effects with a curve of their own, each with its picture."""
    for k, switch in enumerate(model.switches):
        own = np.array(model.of) == k
        curve = model.columns[:, own] @ model.theta[own]
        if switch.role == "added" and np.ptp(curve) > 0:
            yield switch.effect, _effect(target, curve)


@draw.style()
def _effect(target: TargetFindings, curve: Floats) -> Figure:
    """What is left with an effect put back, and the effect as it was fitted."""
    figure = Figure(figsize=_EFFECT, layout="constrained", facecolor="white")
    ax, unit, traces = figure.add_subplot(), unit_of(target), target.traces
    put_back, curve = unit.each(traces.after + curve), unit.each(curve)
    name = _against(target, curve)
    line, label = time_of(target)
    x = line.x
    if name:
        x, label = covariate_of(name, traces.covariates[name])
    held = traces.held_out
    for part, colour, said in ((~held, draw.BEFORE, "residual with it put back"), (held, draw.DECLARED, "held out")):
        draw.cloud(ax, x[part], put_back[part], colour)
        ax.plot([], [], "o", ms=3, color=colour, label=said)
    order = np.argsort(x, kind="stable")
    step = np.diff(x[order])
    gap = np.zeros(0, int) if name else np.flatnonzero(step > 3 * float(np.median(step))) + 1
    joined = (np.insert(v[order], gap, np.nan) for v in (x, curve))
    ax.plot(*joined, color=draw.AFTER_MEAN, lw=1.6, label="the effect as fitted", zorder=5)
    draw.limit(ax, put_back)
    (low, high), (least, most) = ax.get_ylim(), np.quantile(put_back[np.isfinite(put_back)], (0.001, 0.999))
    margin = 0.1 * (most - least)
    ax.set_ylim(max(low, least - margin), min(high, most + margin))
    ax.set_xlabel(label)
    ax.set_ylabel(f"[{unit.label}]")
    draw.legend(ax)
    return figure


def _against(target: TargetFindings, curve: Floats) -> str:
    """The covariate of which a curve is a function; "" where it is one of time."""
    best, chosen = _BY_NEIGHBOURS if len(curve) <= _FEW else _EXPLAINED, ""
    for name in covariates(target):
        x = covariate_of(name, target.traces.covariates[name])[0]
        if not np.isfinite(x).all():
            continue
        share = _by_neighbours(x, curve) if len(curve) <= _FEW else _by_means(x, curve)
        if share > best:
            best, chosen = share, name
    return chosen


def _by_means(x: Floats, curve: Floats) -> float:
    """Share of a curve that its means over ``x`` explain."""
    b = means(x, curve, _BINS)
    good = np.isfinite(b.mean)
    if good.sum() < 2:
        return 0.0
    return _explained(curve, curve - np.interp(x, b.x[good], b.mean[good]))


def _by_neighbours(x: Floats, curve: Floats) -> float:
    """Share of a curve of few points that the straight line between the neighbours of each in ``x`` explains."""
    order = np.argsort(x, kind="stable")
    x, curve = x[order], curve[order]
    wide = x[2:] - x[:-2]
    weight = np.where(wide > 0, (x[1:-1] - x[:-2]) / np.where(wide > 0, wide, 1.0), 0.5)
    return _explained(curve, curve[1:-1] - (1 - weight) * curve[:-2] - weight * curve[2:])


def _explained(curve: Floats, left: Floats) -> float:
    """Share of a curve's square sum about its mean that is not ``left``."""
    return 1 - float(np.sum(left**2) / np.sum((curve - curve.mean()) ** 2))


@draw.style()
def samples(target: TargetFindings, found: SampleSpectrum) -> Figure:
    """Spectrum of the samples up to half the sampling rate, with the lines that were found in it."""
    figure = Figure(figsize=_SAMPLES, layout="constrained", facecolor="white")
    ax, unit = figure.add_subplot(), unit_of(target)
    mean, largest = np.sqrt(found.density), np.sqrt(found.largest)
    draw.curve(ax, found.f, largest, unit, color=draw.AFTER, lw=0.6, alpha=0.6, label="largest value nearby")
    draw.curve(ax, found.f, mean, unit, color=draw.AFTER_MEAN, lw=1.3, label="mean")
    draw.log_log(ax, found.f, [mean, largest], unit)
    ends = f"means over {found.width:.3g} s end here"
    ax.axvline(0.5 / found.width, color=draw.DECLARED, lw=1.0, ls=":", label=ends)
    order = sorted(f for f, _ in found.lines)
    for k, (f, steady) in enumerate(found.lines):
        label = "_" if k else "line found (dashed: it wanders)"
        ax.axvline(f, color=draw.BEFORE, lw=0.9, ls="-" if steady else "--", alpha=0.8, zorder=1, label=label)
        if k < _NAMED:
            last = f > 0.7 * found.nyquist  # beside the end of the axis there is no room
            side: dict[str, Any] = {"xytext": (-3 if last else 3, -2 - 10 * (order.index(f) % 3))}
            place = side | {"ha": "right" if last else "left", "textcoords": "offset points", "va": "top"}
            look: dict[str, Any] = {"fontsize": 8, "color": draw.BEFORE_MEAN, "xycoords": ("data", "axes fraction")}
            ax.annotate(f"{f:.4g} Hz", (f, 1.0), **place, **look)
    ax.set_xlim(found.f[0], found.nyquist)
    ax.set_xlabel("frequency [Hz]; the axis ends at half the sampling rate")
    ax.set_ylabel(f"root PSD [{per_root_hertz(unit)}]")
    draw.legend(ax)
    return figure
