"""An evaluation as one HTML page with its figures inside."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from insenv.core.files import write_whole
from insenv.evaluate import board, words
from insenv.evaluate.evaluation import Evaluation
from insenv.report import drawing as draw
from insenv.report.page import rendered, script
from insenv.report.svg import inline

_LEAST = 1e-12


def write_html(found: Evaluation, path: str | os.PathLike[str]) -> Path:
    """Write `to_html` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    return write_whole(path, to_html(found))


def to_html(found: Evaluation) -> str:
    """The page; nothing is loaded from elsewhere."""
    from markupsafe import Markup

    parts = []
    for k, (quantity, unit) in enumerate(words.quantities(found)):
        described = f"errors of {quantity}: deviation of each pair with its interval, and the distribution of errors"
        parts.append(
            {
                "name": quantity,
                "unit": words.shown(unit)[0],
                "rows": board.board(found, quantity),
                "paired": words.paired_rows(found, quantity),
                "bound": words.bound(found, quantity),
                "picture": Markup(inline(figure(found, quantity, unit), f"q{k}", described)),
            }
        )
    return rendered(
        "evaluation.html.j2",
        title=f"{found.environment}: {found.scenario}",
        head=words.head(found),
        header=board.HEADER,
        titles=board.TITLES,
        picture=board.PICTURE,
        scripts=(script("sort.js"),),
        paired_header=words.PAIRED,
        first=words.first(found),
        parts=parts,
        faults=found.faults,
        beyond=words.beyond(found),
    )


def figure(found: Evaluation, quantity: str, unit: str) -> Figure:
    """Root mean square of each pair with its interval and bound; and how the absolute errors are distributed."""
    name, scale = words.shown(unit)
    shown = [(one, s) for one in found.scored for s in one.scores if s.quantity == quantity]
    with draw.style():
        picture = Figure(figsize=(9.0, max(2.6, 1.3 + 0.42 * len(shown))), layout="constrained")
        left, right = picture.subplots(1, 2)
        for k, (one, s) in enumerate(shown):
            color = draw.SERIES[k % len(draw.SERIES)]
            mark = {"color": color, "capsize": 3, "lw": 1.4}
            left.errorbar(s.rms[0] / scale, k, xerr=s.rms[1] / scale, fmt="o", ms=5, **mark)
            left.plot([s.told / scale] * 2, [k - 0.28, k + 0.28], color=color, lw=1.2, ls=":")
            if s.bound is not None:
                left.plot([s.bound / scale] * 2, [k - 0.28, k + 0.28], color=draw.FITTED, lw=1.4)
            error = np.sort(np.abs(found.errors[one.estimator, one.policy][quantity])) / scale
            share = (np.arange(len(error)) + 0.5) / len(error)
            style = ("-", "--", "-.", ":")[k // len(draw.SERIES) % 4]
            right.plot(np.maximum(error, _LEAST), share, color=color, lw=1.4, ls=style)
        left.set_yticks(range(len(shown)), [f"{one.policy}\n{one.estimator}" for one, _ in shown], fontsize=8)
        left.invert_yaxis()
        rms = [s.rms[0] for _, s in shown if s.rms[0] > 0]
        if rms and max(rms) > 8 * min(rms):
            _plain_log(left)
        else:
            left.set_xlim(left=0.0)
        left.set_xlabel(f"rms of {quantity} [{name}]\n(dotted: as claimed; black: bound)")
        right.set_ylim(0.0, 1.0)
        right.set_xlabel(f"|error| of {quantity} [{name}]\n(colours as on the left)")
        right.set_ylabel("share of the runs below")
        for ax in (left, right):
            ax.grid(True, color=draw.GRID, lw=0.5)
            ax.set_axisbelow(True)
        every = (found.errors[one.estimator, one.policy][quantity] for one, _ in shown)
        right.set_xlim(left=max(min(float(np.quantile(np.abs(e), 0.02)) / scale for e in every), _LEAST))
        _plain_log(right)
    return picture


def _plain_log(ax: Axes) -> None:
    """A logarithmic axis from left to right, its numbers written out, as many as there is room for."""
    ax.set_xscale("log")
    low, high = ax.get_xlim()
    decades = np.log10(high / low)
    subs = (1.0, 2.0, 5.0) if decades < 1.5 else (1.0, 3.0) if decades < 3 else (1.0,)  # noqa: PLR2004 -- decades
    ax.xaxis.set_major_locator(LogLocator(subs=subs))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())
