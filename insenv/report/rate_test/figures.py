"""The pictures of a rate test: nonlinearity, Allan deviation, bias against time."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from insenv.core.quantities import ShownUnit, span
from insenv.core.rate_test import LineFit, RateTest, StaticResult
from insenv.core.recording import Floats
from insenv.core.series.allan import FLICKER, QUANTIZATION, WALK, WHITE
from insenv.core.units import DEG, DEG_PER_HOUR, HOUR, PPM
from insenv.report import drawing as draw

_WIDE, _PANEL = (10.6, 3.9), (5.2, 4.0)
_COLOURS = draw.SERIES
#: Powers of tau of the Allan terms and their factors: N / sqrt(tau) and so on, as variances.
_TERMS = {
    QUANTIZATION: (3.0, -2.0),
    WHITE: (1.0, -1.0),
    FLICKER: (2 * np.log(2) / np.pi, 0.0),
    WALK: (1 / 3, 1.0),
    "rate_ramp": (0.5, 2.0),
}


@draw.style()
def nonlinearity(test: RateTest) -> Figure:
    """Deviations from the line, in ppm of the largest output: of all points, and without those flagged, if any."""
    assert test.line is not None
    figure = Figure(figsize=_WIDE, layout="constrained")
    methods = ("all points", "without flagged") if test.line.flagged else ("all points",)
    axes = np.ravel(figure.subplots(1, len(methods)))
    for ax, method in zip(axes, methods, strict=True):
        each: dict[str, Any] = {"color": draw.DECLARED, "lw": 0.6, "marker": ".", "ms": 2.5, "zorder": 2}
        for k, one in enumerate(test.line.of_each(method)):
            used = (one.weights > 0) | (method == "all points")
            ax.plot(one.rates[used] / DEG, _ppm(one)[used], label="_" if k else "each power-up", **each)
        fit = test.line.fit(method)
        kept = (fit.weights > 0) | (method == "all points")
        dots: dict[str, Any] = {"color": draw.AFTER, "lw": 1.2, "marker": "o", "ms": 3.2, "elinewidth": 0.8}
        x, y, sd = fit.rates[kept] / DEG, _ppm(fit)[kept], _ppm(fit, fit.sd)[kept]
        ax.errorbar(x, y, sd, label="mean of the power-ups, ± 1 sd", zorder=4, **dots)
        if method != "all points":
            _limit(ax, np.concatenate([_ppm(one)[one.weights > 0] for one in (fit, *test.line.of_each(method))]))
            for flagged in test.line.flagged:
                ax.axvline(flagged.rate / DEG, color=draw.BEFORE, lw=0.9, ls="--", zorder=1)
        ax.axhline(0, color=draw.FITTED, lw=0.6, zorder=1)
        ax.grid(True, color=draw.GRID, lw=0.5, zorder=0)
        ax.set_xlabel("rate [deg/s]")
        ax.set_ylabel("deviation / largest output [ppm]")
        if test.line.flagged:
            ax.set_title("all points" if method == "all points" else "without flagged (dashed)", fontsize=9.5)
        ax.legend(fontsize=8)
    return figure


def _ppm(fit: LineFit, values: np.ndarray | None = None) -> np.ndarray:
    top = fit.scale_factor.value * float(np.abs(fit.rates).max())
    return (fit.residuals if values is None else values) / abs(top) / PPM


def _limit(ax, values: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    """Limits that the kept points fill, whatever the flagged ones do."""
    top = 1.15 * float(np.abs(values).max()) or 1.0
    ax.set_ylim(-top, top)


@draw.style()
def allan(tests: list[RateTest]) -> Figure:
    """Allan deviation of the records at rest with 68 % intervals and the fitted sum of the terms."""
    figure = Figure(figsize=_PANEL, layout="constrained")
    ax = figure.add_subplot()
    unit = ShownUnit("deg/h", DEG_PER_HOUR)
    curves: list[np.ndarray] = []
    for k, (colour, test) in enumerate(zip(np.resize(np.array(_COLOURS), len(tests)), tests, strict=True), start=1):
        assert test.static is not None
        found = test.static.allan
        band = (unit.each(found.lower), unit.each(found.upper))
        ax.fill_between(found.taus, *band, color=colour, alpha=0.2, lw=0)
        label = test.title if len(tests) > 1 else "measured, 68 %"
        draw.curve(ax, found.taus, found.deviation, unit, color=colour, lw=1.4, marker="o", ms=2.6, label=label)
        fitted = "sum of the fitted terms" if k == len(tests) else "_"
        draw.curve(ax, found.taus, _model(test.static), unit, color=draw.FITTED, lw=0.9, ls=(0, (4, 2.5)), label=fitted)
        curves.append(found.deviation)
    if any(map(len, curves)):
        every = np.concatenate(curves)
        draw.log_log(ax, np.ones(len(every)), [every], unit)
    ax.set_xlabel("averaging time [s]")
    ax.set_ylabel("Allan deviation [deg/h]")
    ax.legend(fontsize=8)
    return figure


def _model(static: StaticResult) -> np.ndarray:
    """Sum of the fitted terms [rad/s]."""
    taus = static.allan.taus
    found = static.allan.coefficients
    terms = (found[key].value ** 2 * factor * taus**power for key, (factor, power) in _TERMS.items() if key in found)
    others = sum((term.variance(taus) for term in static.allan.others), np.zeros_like(taus))
    total = np.sqrt(sum(terms, others))
    total[: static.allan.left_out] = np.nan
    return total


@draw.style()
def against_time(test: RateTest) -> Figure:
    """Output at rest against the time since the power-up, with the temperature where it is known."""
    static = test.static
    assert static is not None
    figure = Figure(figsize=_PANEL, layout="constrained")
    ax = figure.add_subplot()
    hours = static.t[-1] > 2 * HOUR if len(static.t) else False
    t = static.t / (HOUR if hours else 60.0)
    look: dict[str, Any] = {"color": draw.AFTER, "lw": 1.0}
    after_gap = np.append(False, np.diff(t) > 1.5 * np.median(np.diff(t))) if len(t) > 1 else np.zeros(len(t), bool)

    def parted(values: Floats) -> Floats:  # no line goes across a gap
        return np.insert(values, np.flatnonzero(after_gap), np.nan)

    ax.plot(parted(t), parted(static.series / DEG_PER_HOUR), **look)
    ax.set_xlabel(f"time since the power-up [{'h' if hours else 'min'}]")
    mean = f", means over {span(float(np.median(np.diff(static.t))))}" if len(static.t) > 1 else ""
    ax.set_ylabel(f"output at rest{mean} [deg/h]")
    ax.grid(True, color=draw.GRID, lw=0.5, zorder=0)
    if len(static.temperature) and np.ptp(static.temperature) > 0.01:
        other = ax.twinx()
        other.plot(parted(t), parted(static.temperature - 273.15), color=draw.BEFORE, lw=0.9)
        other.set_ylabel("temperature [degC]", color=draw.BEFORE)
    return figure
