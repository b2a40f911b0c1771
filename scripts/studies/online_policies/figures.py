"""Intervals and pictures of `online_policies`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from insenv.core.recording import Floats

#: Colours that the colour-blind tell apart, as in the other figures.
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9")
#: Draws of a bootstrap.
_DRAWS = 2000
#: What the published procedure of the north finder has after 300 s [arcsec].
PUBLISHED = 46.0


def rms(errors: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def interval(*errors: Floats) -> tuple[float, float]:
    """Of the root mean square of the first, or of its difference from that of the second, on the same runs."""
    n = len(errors[0])
    index = np.random.default_rng(0).integers(0, n, (_DRAWS, n))
    values = np.sqrt(np.mean(np.square(errors[0][index]), axis=1))
    if len(errors) > 1:
        values = values - np.sqrt(np.mean(np.square(errors[1][index]), axis=1))
    low, high = np.quantile(values, [0.025, 0.975])
    return float(low), float(high)


def shown(errors: Floats, digits: int = 1) -> str:
    low, high = interval(errors)
    return f"{rms(errors):.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]"


def apart(errors: Floats, base: Floats, digits: int = 1) -> str:
    low, high = interval(errors, base)
    return f"{rms(errors) - rms(base):+.{digits}f} [{low:+.{digits}f}, {high:+.{digits}f}]"


def _is_online(name: str) -> bool:
    """Whether a policy decides by what it has seen."""
    return "horizon" in name or "greedy" in name


def curves(drawn: Mapping[str, tuple[Any, Floats]], x: str, y: str, limits: tuple[float, float]) -> Figure:
    figure, axes = plt.subplots(figsize=(8, 4.5), layout="constrained")
    for (name, (t, values)), colour in zip(drawn.items(), COLOURS, strict=False):
        axes.plot(t, values, label=name, color=colour, linestyle="-" if _is_online(name) else "--")
    axes.set(xlabel=x, ylabel=y, yscale="log", ylim=limits, xlim=(20, None))
    axes.axhline(PUBLISHED, color="0.5", linewidth=1, linestyle=":", label=f"published after 300 s: {PUBLISHED:.0f}")
    axes.grid(True, color="#e5e5e5", linewidth=0.6)
    axes.set_yticks([30, 46, 100, 200, 400], ["30", "46", "100", "200", "400"])
    axes.minorticks_off()
    axes.legend()
    return figure


def bars(times: Mapping[str, list[Floats]]) -> Figure:
    figure, axes = plt.subplots(figsize=(8, 3.5), layout="constrained")
    place = np.arange(len(times))
    for k, label in enumerate(("published_a2", "realistic")):
        means = [one[k].mean() for one in times.values()]
        spans = np.array([[m - one[k].min(), one[k].max() - m] for m, one in zip(means, times.values(), strict=True)]).T
        axes.barh(
            place + 0.4 * k - 0.2,
            means,
            0.38,
            xerr=spans,
            label=label,
            color=COLOURS[k],
            error_kw={"linewidth": 1, "capsize": 2},
        )
    axes.set_yticks(place, list(times))
    axes.invert_yaxis()
    axes.set_xlabel("time until the claimed deviation is 0.333 arcmin [s]; whiskers: least and most of the runs")
    axes.legend()
    return figure


def points(found: Mapping[str, tuple[float, float, float]]) -> Figure:
    figure, axes = plt.subplots(figsize=(8, 4.5), layout="constrained")
    for name, (time, sd, share) in found.items():
        online = _is_online(name)
        axes.plot(time, sd, "o" if online else "s", color=COLOURS[0 if online else 1], markersize=7)
        axes.annotate(
            f"{name}: {share:.0%}",
            (time, sd),
            xytext=(
                8,
                {
                    "greedy_rate_table": -14,
                    "sweep_and_refine": 10,
                    "greedy_rate_table, 4 ppm": -4,
                    "optimal_ladder": -14,
                }.get(name, 4),
            ),
            textcoords="offset points",
            fontsize=9,
        )
    axes.set(
        xscale="log", xlabel="time [s]", ylabel="scale factor, claimed deviation [ppm]", xlim=(250, 12000), ylim=(0, 15)
    )
    axes.set_xticks([300, 500, 1000, 2000, 5000], ["300", "500", "1000", "2000", "5000"])
    axes.minorticks_off()
    axes.set_title(
        "beside each: share of the faults that it finds; circles: decides during the run, squares: plans before",
        fontsize=10,
    )
    return figure
