"""The three published procedures beside better ones: time, accuracy, and the bound, each checked by Monte Carlo.

For each system the published procedure with its own estimator, the best documented policy with the best documented
estimator, and what `insenv design` finds. Writes docs/results/beat_the_papers.md and its picture.
"""

# ruff: noqa: E402  (what limits the threads must stand before NumPy is imported)
from __future__ import annotations

import os

# Each process has a core of its own; threads of theirs would wait for each other.
for _library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
    os.environ[f"{_library}_NUM_THREADS"] = "1"

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from studies.beat_the_papers.runs import (
    DEMANDED,
    DESIGNED,
    DOCUMENTED,
    PUBLISHED,
    Panel,
    Point,
    north,
    rate_table,
    two_positions,
)
from studies.result_page import Section, table, write

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "results"
PAGE = """\
# Beating the papers

The three published procedures, each beside a better one for the same instrument: the best documented policy and
estimator, and what `insenv design` finds. Written, with its picture, by

```sh
python scripts/beat_the_papers.py --seeds {seeds}
```

Errors are root mean squares against the simulator's truth over {seeds} runs (standard error {error:.1f} %), with half
of their 95 % interval. In the picture filled marks stand in the tables; open ones are other times and policies, of half
as many runs. Bars are 95 % intervals. A line is what theory predicts of the procedure that it names: a mark may stand
below it by chance, within its bar, and for good where its own procedure is a better one. `error / claimed` is the root
mean square of error over claimed standard deviation: 1 where the estimator is honest. The papers:
[two positions](two_position.md), [north finder](north_finder.md), [rate table](fog_test.md).
"""
COLOURS = {PUBLISHED: "#D55E00", DOCUMENTED: "#0072B2", DESIGNED: "#009E73"}
MARKS = {PUBLISHED: "o", DOCUMENTED: "s", DESIGNED: "D"}
LINES = ("--", ":")
HEADER = ("", "procedure", "estimator", "time [s]", "claimed", "error / claimed")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=200, help="runs behind each figure")
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time")
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder of the page")
    given = parser.parse_args()
    if given.seeds < 8:
        parser.error(f"--seeds {given.seeds} given; wanted at least 8")
    head = PAGE.format(seeds=given.seeds, error=100 / (2 * given.seeds) ** 0.5)
    write(given.out / "beat_the_papers.md", head, sections(range(1, given.seeds + 1), given.jobs), 4)
    print(given.out / "beat_the_papers.md")


def sections(seeds: Sequence[int], jobs: int) -> Iterator[Section]:
    """A summary with the picture, then a part for each system."""
    panels = [make(seeds, jobs) for make in (two_positions, north, rate_table)]
    found = [(_vehicle, panels[0]), (_north, panels[1]), (_table, panels[2])]
    parts = [Section(panel.title, _lines(panel), verdict(panel)) for verdict, panel in found]
    rows = [(panel.title, *_cells(panel)) for panel in panels]
    yield Section(
        "Summary",
        table(("", PUBLISHED, f"better, {DOCUMENTED}", DESIGNED), rows),
        _reached(*panels),
        {"beat_the_papers": drawn(panels)},
    )
    yield from parts


def _cells(panel: Panel) -> list[str]:
    """Time and error of the best procedure of each kind: the shortest one that does what is asked."""
    unit = panel.quantity.partition("[")[2].rstrip("]")
    return [
        "<br>".join(f"{p.time:.0f} s, {p.rms:.3g} {unit}{_share(p)}" for p in panel.asked if p.kind == kind)
        for kind in (PUBLISHED, DOCUMENTED, DESIGNED)
    ]


def _share(point: Point) -> str:
    return "" if np.isnan(point.found) else f", fault found in {100 * point.found:.0f} %"


def _lines(panel: Panel) -> tuple[str, ...]:
    every = [*panel.asked, *(p for points in panel.series.values() for p in points)]
    sought = any(np.isfinite(p.found) for p in every)
    header = (*HEADER[:4], panel.quantity, *HEADER[4:], *(("fault found", "false alarms") if sought else ()))
    shown = panel.asked if not sought else tuple(every)
    return table(header, [_row(point, sought) for point in shown])


def _row(point: Point, sought: bool) -> tuple[str, ...]:
    half = 1.96 * point.rms / (2 * point.runs) ** 0.5
    cells = [point.kind, point.procedure, point.estimator]
    cells += [f"{point.time:.0f}", f"{point.rms:.3g} ± {half:.2g}", f"{point.told:.3g}", f"{point.z:.2f}"]
    return (*cells, *(f"{100 * share:.0f} %" for share in (point.found, point.false))) if sought else tuple(cells)


def _of(panel: Panel, kind: str) -> list[Point]:
    return [point for point in panel.asked if point.kind == kind]


def _reached(vehicle: Panel, turning: Panel, ladder: Panel) -> str:
    """What was wanted, and what was found."""
    (turned,), (swept,) = _of(vehicle, DESIGNED), _of(ladder, DESIGNED)
    short, same = sorted(_of(turning, DESIGNED), key=lambda p: p.time)
    share = swept.time / _of(ladder, PUBLISHED)[0].time
    return (
        f"By `insenv design`, wanted in brackets: the sight's angle in {turned.time:.0f} s (190); north to "
        f"{same.rms:.1f} arcsec in {same.time:.0f} s (30), to {short.rms:.1f} in {short.time:.0f} s (46); the scale "
        f"factor in {share:.3f} of the published time (0.1) with the fault found in {100 * swept.found:.0f} %."
    )


def _vehicle(panel: Panel) -> str:
    printed, longer = _of(panel, PUBLISHED)
    best = min(_of(panel, DESIGNED), key=lambda p: p.time)
    documented = min(_of(panel, DOCUMENTED), key=lambda p: p.time)
    return (
        f"Two positions, noise A2, {DEMANDED:.3f} arcmin of the inertial part demanded: the printed {printed.time:.0f} "
        f"s leave {printed.rms:.3f} arcmin, {longer.time:.0f} s are needed; {documented.procedure} needs "
        f"{documented.time:.0f} s ({documented.rms:.3f} arcmin), the designed procedure {best.time:.0f} s "
        f"({best.rms:.3f} arcmin): {longer.time / best.time:.1f} times faster; wanted: 190 s."
    )


def _north(panel: Panel) -> str:
    (published,) = _of(panel, PUBLISHED)
    (documented,) = _of(panel, DOCUMENTED)
    short, same = sorted(_of(panel, DESIGNED), key=lambda p: p.time)
    return (
        f"North, realistic instrument: in {published.time:.0f} s the published procedure leaves {published.rms:.1f} "
        f"arcsec, `rate_choice` {documented.rms:.1f}, the designed one {same.rms:.1f} (wanted: 30), which in "
        f"{short.time:.0f} s leaves {short.rms:.1f} (wanted: 46)."
    )


def _table(panel: Panel) -> str:
    (published,) = _of(panel, PUBLISHED)
    (documented,) = _of(panel, DOCUMENTED)
    (best,) = _of(panel, DESIGNED)
    return (
        f"Scale factor: the published list takes {published.time:.0f} s for {published.rms:.1f} ppm and finds the "
        f"fault in {100 * published.found:.0f} %; {documented.procedure} {documented.time:.0f} s for "
        f"{documented.rms:.1f} ppm and {100 * documented.found:.0f} %; the designed list {best.time:.0f} s for "
        f"{best.rms:.1f} ppm and {100 * best.found:.0f} %: {best.time / published.time:.3f} of the time (wanted: 0.1)."
    )


def drawn(panels: Sequence[Panel]) -> Figure:
    """Time against error for each system."""
    figure = Figure(figsize=(12.5, 4.6), layout="constrained")
    for ax, panel in zip(figure.subplots(1, len(panels)), panels, strict=True):
        _draw(ax, panel)
    return figure


def _draw(ax: Axes, panel: Panel) -> None:
    for (label, (times, sd)), line in zip(panel.predicted.items(), LINES, strict=False):
        ax.plot(times, sd, line, color="#555555", lw=1.2, label=label)
    for k, value in enumerate(panel.demanded):
        label = " and ".join(f"{one:.3g}" for one in panel.demanded)
        ax.axhline(value, color="#CC79A7", lw=1.0, label=None if k else f"demanded: {label}")
    for kind in (PUBLISHED, DOCUMENTED, DESIGNED):
        style = {"color": COLOURS[kind], "marker": MARKS[kind], "ls": "none"}
        asked, others = _of(panel, kind), panel.series.get(kind, ())
        for p in (*asked, *others):
            half = 1.96 * p.rms / (2 * p.runs) ** 0.5
            ax.plot([p.time] * 2, [p.rms - half, p.rms + half], color=COLOURS[kind], lw=1.0)
        ax.plot([p.time for p in others], [p.rms for p in others], ms=4, mfc="white", **style)  # type: ignore[arg-type]
        if asked:
            ax.plot([p.time for p in asked], [p.rms for p in asked], ms=7, label=kind, **style)  # type: ignore[arg-type]
    for point in (*panel.asked, *(p for points in panel.series.values() for p in points)):
        if np.isfinite(point.found):
            late = point.time > 2000
            ax.annotate(
                f"finds {100 * point.found:.0f} %",
                (point.time, point.rms),
                xytext=(-7 if late else 7, 7),
                textcoords="offset points",
                fontsize=8,
                ha="right" if late else "left",
            )
    ax.set(xscale="log", yscale="log", xlabel="time [s]", ylabel=panel.quantity)
    ax.margins(0.12)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_locator(NullLocator())
    ax.set_title(panel.title, fontsize=10)
    ax.grid(True, color="#e5e5e5", lw=0.6)
    ax.legend(frameon=False, fontsize=8)


if __name__ == "__main__":
    main()
