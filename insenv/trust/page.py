"""What a claim is worth on a recording, as one HTML page."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from insenv.core.files import write_whole
from insenv.report import drawing as draw
from insenv.report.page import rendered
from insenv.report.svg import inline
from insenv.trust import words
from insenv.trust.rates import Trust

#: Share of copies in which an effect of the smallest detectable size is to be found.
PROMISED = 0.95
_DESCRIBED = "share of copies in which an effect was found, and in which it was named, by its size, with intervals"


def write_html(found: Trust, path: str | os.PathLike[str]) -> Path:
    """Write `to_html` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    return write_whole(path, to_html(found))


def to_html(found: Trust) -> str:
    """The page; nothing is loaded from elsewhere."""
    from markupsafe import Markup

    header, *rows = words.completeness(found)
    return rendered(
        "trust.html.j2",
        found.findings.filing,
        title=f"Trust: {found.findings.title}",
        verdict=words.verdict(found)[0].upper() + words.verdict(found)[1:],
        head=words.head(found),
        wrong=[row for one in found.reliability for row in words.reliability(one)],
        left=[f"{one.target}: {words.not_counted(one)}" for one in found.reliability if one.left],
        header=header,
        rows=rows if found.effects else [],
        picture=Markup(inline(figure(found), "completeness", _DESCRIBED)),
    )


def figure(found: Trust) -> Figure:
    """How many injected effects were found and named, by their size."""
    with draw.style():
        picture = Figure(figsize=(9.0, 3.4), layout="constrained")
        ax = picture.subplots()
        sizes = [size for size in found.whole.sizes if size.found.of]
        for shift, word, color in ((0.96, "found", draw.AFTER), (1.04, "named", draw.BEFORE)):
            rates = [getattr(size, word) for size in sizes]
            share = np.array([100 * rate.share for rate in rates])
            low, high = (np.array([100 * rate.interval[side] for rate in rates]) for side in (0, 1))
            bars = np.maximum([share - low, high - share], 0.0)
            ax.errorbar(
                [shift * s.size for s in sizes],
                share,
                yerr=bars,
                fmt="o-",
                ms=5,
                lw=1.2,
                capsize=3,
                color=color,
                label=word,
            )
        ax.axhline(100 * PROMISED, color=draw.FITTED, lw=1.0, ls=":")
        ax.set_xscale("log", base=2)
        ax.set_xticks([s.size for s in sizes], [f"{s.size:g}" for s in sizes])
        ax.minorticks_off()
        ax.set_xlim(0.4, 5.0)
        ax.set_ylim(0.0, 104.0)
        ax.set_xlabel("size [smallest detectable amplitudes]")
        ax.set_ylabel("copies [%]")
        if sizes:
            ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False, borderaxespad=0.2)
        ax.grid(True, color=draw.GRID, lw=0.5)
        ax.set_axisbelow(True)
    return picture
