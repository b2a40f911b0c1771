"""Many noisy points made readable: means in bins, runs one after the other, spectra averaged."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.identify.findings import Traces

#: A bin of fewer points says nothing.
_LEAST = 3


@dataclass(frozen=True)
class Bins:
    """Means of y in bins of x: arrays of shape (bins,); ``error`` is scatter over root count."""

    x: Floats
    mean: Floats
    error: Floats


@dataclass(frozen=True)
class Timeline:
    """Times of all runs on one axis: ``x`` [s], shape (n,), and where each run starts and ends."""

    x: Floats
    runs: tuple[tuple[int, float, float], ...]


def means(x: Floats, y: Floats, bins: int) -> Bins:
    """Means of ``y`` in ``bins`` equal bins of ``x``; NaN in bins with fewer than three points."""
    good = np.isfinite(x) & np.isfinite(y)
    x, y = x[good], y[good]
    if len(x) == 0 or np.ptp(x) == 0:
        return Bins(*3 * [np.empty(0)])
    index = np.minimum(((x - x.min()) / np.ptp(x) * bins).astype(int), bins - 1)
    count = np.bincount(index, minlength=bins)
    safe = np.maximum(count, 1)
    mean = np.bincount(index, y, bins) / safe
    scatter = np.bincount(index, (y - mean[index]) ** 2, bins) / np.maximum(count - 1, 1)
    told = count >= min(_LEAST, count.max())
    return Bins(
        np.where(told, np.bincount(index, x, bins) / safe, np.nan),
        np.where(told, mean, np.nan),
        np.where(told, np.sqrt(scatter / safe), np.nan),
    )


def means_of_runs(line: Timeline, y: Floats, bins: int) -> Bins:
    """Means in time of every run on its own, a NaN between them; ``bins`` are shared out by length."""
    total = sum(stop - start for _, start, stop in line.runs) or 1.0
    parts = []
    for _, start, stop in line.runs:
        mine = (line.x >= start) & (line.x <= stop)
        parts.append(means(line.x[mine], y[mine], max(4, round(bins * (stop - start) / total))))
    gap = np.array([np.nan])
    return Bins(*(np.concatenate([a for b in parts for a in (getattr(b, k), gap)]) for k in ("x", "mean", "error")))


def timeline(traces: Traces) -> Timeline:
    """Runs on one time axis: as they stand where their times follow each other, else one behind the other."""
    x, runs, end = np.array(traces.t, float), [], -np.inf
    total = sum(np.ptp(x[traces.run == run]) for run in np.unique(traces.run))
    for run in np.unique(traces.run):
        mine = traces.run == run
        if x[mine].min() < end:
            x[mine] += end + 0.01 * total - x[mine].min()
        end = x[mine].max()
        runs.append((int(run), float(x[mine].min()), float(end)))
    return Timeline(x, tuple(runs))


def stretches(x: Floats, marked: NDArray[np.bool_]) -> Iterator[tuple[float, float]]:
    """Intervals of ``x`` over which ``marked`` holds, half a step beyond the points on either side."""
    if len(x) == 0:
        return
    order = np.argsort(x)
    x, on = x[order], np.asarray(marked, bool)[order]
    half = 0.5 * float(np.median(np.diff(x))) if len(x) > 1 else 0.5
    edges = np.flatnonzero(np.diff(np.concatenate([[0], on.astype(int), [0]])))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        yield float(x[start] - half), float(x[stop - 1] + half)


def smoothed(f: Floats, density: Floats, per_decade: int = 24) -> tuple[Floats, Floats]:
    """A periodogram averaged in bins of equal ratio: frequencies and mean densities.

    Bins hold at least three values. Means of power stay unbiased, so a level can be read from them; single
    lines are lowered by the averaging. A density that is not on an even grid has been averaged already: it is
    returned as it is.
    """
    good = (f > 0) & np.isfinite(density) & (density > 0)
    f, density = f[good], density[good]
    if len(f) < 3 * _LEAST or np.ptp(np.diff(f)) > 0.5 * np.diff(f).min():
        return f, density
    starts, bins = [0], np.floor(np.log10(f / f[0]) * per_decade)
    for i in range(1, len(f)):
        if bins[i] != bins[starts[-1]] and i - starts[-1] >= _LEAST:
            starts.append(i)
    count = np.diff([*starts, len(f)])
    return np.exp(np.add.reduceat(np.log(f), starts) / count), np.add.reduceat(density, starts) / count


def reach(*residuals: Floats) -> tuple[float, int]:
    """A symmetric limit that shows the bulk of ``residuals``, and how many points lie beyond it."""
    size = np.abs(np.concatenate([r[np.isfinite(r)] for r in residuals]))
    if len(size) == 0 or size.max() == 0:
        return 1.0, 0
    bulk = float(np.quantile(size, 0.995))
    limit = 1.1 * float(size.max()) if size.max() <= 2.5 * bulk else 1.5 * bulk
    return limit, int(np.count_nonzero(size > limit))
