"""A design as one HTML page with its figures inside."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from insenv.core.files import write_whole
from insenv.core.recording import Floats
from insenv.design import words
from insenv.design.designing import DESIGNED, PUBLISHED, Designed
from insenv.design.explore import PROFILE, SIZE, front, held
from insenv.design.texts import shown
from insenv.evaluate.words import shown as units
from insenv.report import drawing as draw
from insenv.report.page import rendered, script
from insenv.report.svg import inline

#: Colours of the designed and the published procedure, and of the front; they differ in lightness, too.
COLOR = {DESIGNED: draw.AFTER, PUBLISHED: draw.BEFORE}
_FRONT, _ASKED = draw.DECLARED, draw.PALETTE["series-3"]
#: Marks of estimators under a procedure.
_MARKS = ("o", "^", "s", "D")
#: By which the time of what was played is moved to the side for each mark.
_BESIDE = 1.018


def write_html(found: Designed, path: str | os.PathLike[str]) -> Path:
    """Write `to_html` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    return write_whole(path, to_html(found))


def to_html(found: Designed) -> str:
    """The page; nothing is loaded from elsewhere."""
    from markupsafe import Markup

    described = "standard deviation against time: the front, the designed and the published procedure"
    pictures = [
        (
            "Time against accuracy",
            Markup(inline(front_figure(found), "front", described)),
            "Good: the designed procedure stands on the curve of the best ones, below or left of the published one, "
            "and what was played lies on its ring.",
        ),
        (
            "The two procedures",
            Markup(inline(course_figure(found), "course", f"{found.axis[0]} of both procedures against time")),
            "What the plant is told to do. Good: few and slow changes, as far as the accuracy allows.",
        ),
    ]
    if found.influences:
        pictures.append(
            (
                "What nobody declared",
                Markup(inline(influence_figure(found), "influences", "what each effect does to both procedures")),
                "Good: short bars, all of them short beside the demanded deviation.",
            )
        )
    return rendered(
        "design.html.j2",
        title=words.title(found),
        head=[f"{words.demand(found)}.", *words.sentences(found)],
        remarks=found.remarks,
        front=front(found),
        size=SIZE,
        profile=PROFILE,
        scripts=(script("front.js"),),
        tables=[
            ("Checked by Monte Carlo; +- are 95 % intervals", words.CHECKS, words.check_rows(found)),
            ("Time against accuracy", words.FRONT, words.front_rows(found)),
            (
                f"Sensitivity to undeclared effects, rms over runs [{words.unit(found)}]",
                words.INFLUENCES,
                words.influence_rows(found),
            ),
        ],
        pictures=pictures,
    )


def front_figure(found: Designed) -> Figure:
    """Time against accuracy: bounds as lines and rings, what was played with its interval."""
    name, scale = words.unit(found), units(found.quantity.unit)[1]
    with draw.style():
        picture = Figure(figsize=(7.6, 4.4), layout="constrained")
        ax = picture.subplots()
        time = np.array([p.time for p in found.front])
        sd = np.array([p.sd for p in found.front]) / scale
        ax.plot(time, sd, color=_FRONT, lw=1.4, marker=".", ms=5, label="best procedures (bound)", zorder=2)
        _demand_line(ax, found, scale)
        for label, point in ((DESIGNED, found.chosen), (PUBLISHED, found.published)):
            ring: dict[str, Any] = {"mfc": "none", "mec": COLOR[label], "mew": 1.6, "ms": 8, "ls": ""}
            if np.isfinite(point.sd):
                ax.plot([point.time], [point.sd / scale], marker="o", label=f"{label} (bound)", zorder=3, **ring)
        played = 0
        for label, color in COLOR.items():
            own = [c for c in found.checks if c.procedure == label]
            for mark, one in zip(_MARKS, own, strict=False):
                rms, half = (value / scale for value in one.score.rms)
                shift = _BESIDE ** (1 + played)  # beside the rings, and beside each other at the same time
                played += 1
                ax.errorbar(
                    [one.time * shift], [rms], [half], fmt=mark, color=color, ms=5, capsize=3, lw=1.2, zorder=4,
                    label=f"{label}, {one.estimator}: rms of {one.runs} runs",
                )  # fmt: skip
        _logarithmic(ax, time, [*sd, *(c.score.rms[0] / scale for c in found.checks)], found, scale)
        ax.set_xlabel("time of the procedure [s]")
        ax.set_ylabel(f"deviation of {found.quantity.name} [{name}]")
        ax.legend(frameon=False, fontsize=8)
    return picture


def _demand_line(ax: Axes, found: Designed, scale: float) -> None:
    """What was asked for, as a line."""
    if found.goal == "time":
        ax.axhline(found.asked / scale, color=_ASKED, lw=1.0, ls="--", label="demanded", zorder=1)
    else:
        ax.axvline(found.asked, color=_ASKED, lw=1.0, ls="--", label="time that was given", zorder=1)


def _logarithmic(ax: Axes, time: Floats, values: list[float], found: Designed, scale: float) -> None:
    """Logarithmic axes with a few plain numbers."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator

    every = [v for v in (*values, found.published.sd / scale) if np.isfinite(v) and v > 0]
    both = [*time.tolist(), found.published.time, found.chosen.time]
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(min(both) / 1.15, max(both) * 1.15)
    ax.set_ylim(min(every) / 1.3, max(every) * 1.3)
    for axis, limits in ((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())):
        axis.set_major_locator(FixedLocator(draw.log_ticks(*limits)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_locator(NullLocator())
        axis.set_minor_formatter(NullFormatter())
    ax.grid(True, color=draw.GRID, lw=0.6)
    ax.set_axisbelow(True)


def course_figure(found: Designed) -> Figure:
    """What the plant is told, against time, of both procedures."""
    what, unit = found.axis
    with draw.style():
        picture = Figure(figsize=(7.6, 3.6), layout="constrained")
        axes = picture.subplots(2, 1)
        for ax, (label, point) in zip(axes, ((DESIGNED, found.chosen), (PUBLISHED, found.published)), strict=True):
            track = point.plan.track or held(point)
            t, y = ([pair[k] for pair in track] for k in (0, 1))
            ax.plot(t, [shown(value, unit) for value in y], color=COLOR[label], lw=1.3)
            ax.set_xlim(0.0, point.time)
            ax.margins(y=0.12)
            ax.set_ylabel(f"{what} [{unit}]", fontsize=8.5)
            ax.set_title(f"{label}: {point.time:.6g} s", fontsize=9, loc="left", color=COLOR[label])
            ax.grid(True, color=draw.GRID, lw=0.5)
            ax.spines[["top", "right"]].set_visible(False)
        axes[-1].set_xlabel("time [s]")
    return picture


def influence_figure(found: Designed) -> Figure:
    """Bars of what each effect does to either procedure."""
    name, scale = words.unit(found), units(found.quantity.unit)[1]
    with draw.style():
        picture = Figure(figsize=(7.6, 1.2 + 0.62 * len(found.influences)), layout="constrained")
        ax = picture.subplots()
        place = np.arange(len(found.influences))
        for k, label in enumerate((DESIGNED, PUBLISHED)):
            size = [one.procedures[label][1] / scale for one in found.influences]
            ax.barh(place + (k - 0.5) * 0.36, size, 0.34, color=COLOR[label], label=label)
        ax.set_yticks(
            place, [words.effect_words(one.effect).replace(": ", "\n") for one in found.influences], fontsize=8
        )
        ax.invert_yaxis()
        ax.set_xlabel(f"change of {found.quantity.name}, rms over runs [{name}]")
        ax.grid(True, axis="x", color=draw.GRID, lw=0.5)
        ax.set_axisbelow(True)
        ax.legend(frameon=False, fontsize=8)
        ax.spines[["top", "right"]].set_visible(False)
    return picture
