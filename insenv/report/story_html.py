"""The story of a recording that was settled, as one HTML page with a picture of the error after each experiment."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator

from insenv.core.files import write_whole
from insenv.core.quantities import number, span
from insenv.identify.story import Story
from insenv.report import drawing as draw
from insenv.report import story as words_of
from insenv.report.page import rendered
from insenv.report.svg import inline


def write_html(story: Story, path: str | os.PathLike[str]) -> Path:
    """Write `to_html` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    return write_whole(path, to_html(story))


def to_html(story: Story) -> str:
    """``story`` as one self-contained HTML page; every text from a file is escaped."""
    from markupsafe import Markup

    drawn = story.raw is not None and story.wanted is not None
    return rendered(
        "story.html.j2",
        title=story.title or story.scenario,
        headline=words_of.headline(story),
        ending=words_of.ending(story),
        settled=story.ending == "settled",
        picture=Markup(inline(errors(story), "error", words_of.ending(story))) if drawn else "",
        steps=[_step(story, k) for k in range(len(story.chapters))],
    )


def _step(story: Story, index: int) -> dict[str, Any]:
    chapter = story.chapters[index]
    return {
        "number": index + 1,
        "did": words_of.sentence(chapter.procedure),
        "why": words_of.why(chapter),
        "time": f"{span(chapter.duration)}, {span(chapter.elapsed)} in all",
        "told": list(words_of.chapter_lines(story, index)),
        "settings": "; ".join(f"{k}: {_plain(v)}" for k, v in {**chapter.profile, **chapter.changes}.items()),
    }


def _plain(value: Any) -> str:
    """A setting of a scenario for reading."""
    if isinstance(value, dict):
        return ", ".join(f"{k} {_plain(v)}" for k, v in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(" at ".join(map(str, v)) if isinstance(v, list | tuple) else str(v) for v in value)
    return str(value)


@draw.style()
def errors(story: Story) -> Figure:
    """Error of the wanted quantity as measured and after each experiment, with two standard deviations as told."""
    assert story.raw is not None and story.wanted is not None
    unit = words_of.unit_of(story)
    answers = [story.raw, *(c.answer for c in story.chapters if c.answer is not None)]
    figure = Figure(figsize=(7.4, 3.6), layout="constrained")
    ax = figure.subplots()
    x = np.arange(len(answers))
    values = np.array([unit.of(a.error) for a in answers])
    bars = np.array([2 * unit.of(a.sd) for a in answers])
    demanded = unit.of(story.wanted.demanded)
    ax.axhspan(
        -demanded,
        demanded,
        color=draw.PALETTE["good-wash"],
        lw=0,
        zorder=0,
        label=f"demanded: ± {demanded:.3g} {unit.label}",
    )
    ax.axhline(0, color=draw.FITTED, lw=0.8, zorder=1)
    ax.plot(x, values, color=draw.DECLARED, lw=1.2, zorder=2)
    style: dict[str, Any] = {"fmt": "o", "ms": 6, "capsize": 4, "elinewidth": 1.4, "zorder": 4}
    ax.errorbar(x[:1], values[:1], bars[:1], color=draw.BEFORE, label="as measured", **style)
    ax.errorbar(x[1:], values[1:], bars[1:], color=draw.AFTER, label="with what was found taken out", **style)
    for place, value in zip(x, values, strict=True):
        ax.annotate(number(value), (place, value), xytext=(9, 4), textcoords="offset points", fontsize=8.5, zorder=5)
    labels = ["as measured", *(f"after run {k + 1}\n{c.found.verdict}" for k, c in enumerate(story.chapters))]
    ax.xaxis.set_major_locator(FixedLocator(x.tolist()))
    ax.set_xticklabels(labels)
    ax.set_xlim(-0.4, len(answers) - 0.35)
    ax.margins(y=0.12)
    ax.set_ylabel(f"error of {words_of.quantity_name(story.wanted)} [{unit.label}]")
    ax.grid(True, axis="y", color=draw.GRID, lw=0.5, zorder=0)
    draw.legend(ax)
    return figure
