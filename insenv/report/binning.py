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
class BinnedMeans:
    """Means of y in bins of x: arrays of shape (bins,); ``error`` is scatter over root count.

    ``held_out`` marks bins of held-out data, where they are joined in time; NaN parts what must not be joined.
    """

    x: Floats
    mean: Floats
    error: Floats
    held_out: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class Timeline:
    """Times of all runs on one axis: ``x`` [s], shape (n,), and where each run starts and ends."""

    x: Floats
    runs: tuple[tuple[int, float, float], ...]


def means(x: Floats, y: Floats, bins: int) -> BinnedMeans:
    """Means of ``y`` in ``bins`` equal bins of ``x``; NaN in bins with fewer than three points."""
    good = np.isfinite(x) & np.isfinite(y)
    x, y = x[good], y[good]
    if len(x) == 0 or np.ptp(x) == 0:
        return BinnedMeans(np.empty(0), np.empty(0), np.empty(0))
    index = np.minimum(((x - x.min()) / np.ptp(x) * bins).astype(int), bins - 1)
    count = np.bincount(index, minlength=bins)
    safe = np.maximum(count, 1)
    mean = np.bincount(index, y, bins) / safe
    scatter = np.bincount(index, (y - mean[index]) ** 2, bins) / np.maximum(count - 1, 1)
    told = count >= min(_LEAST, count.max())
    return BinnedMeans(
        np.where(told, np.bincount(index, x, bins) / safe, np.nan),
        np.where(told, mean, np.nan),
        np.where(told, np.sqrt(scatter / safe), np.nan),
    )


def means_of_runs(line: Timeline, y: Floats, bins: int) -> BinnedMeans:
    """Means in time of every run on its own, a NaN between them; ``bins`` are shared out by length."""
    total = sum(stop - start for _, start, stop in line.runs) or 1.0
    parts = []
    for _, start, stop in line.runs:
        mine = (line.x >= start) & (line.x <= stop)
        for x, of_y in _unbroken(line.x[mine], y[mine], total / bins):
            parts.append(means(x, of_y, max(2, round(bins * np.ptp(x) / total))))
    gap = np.array([np.nan])
    return BinnedMeans(
        *(np.concatenate([a for b in parts for a in (getattr(b, k), gap)]) for k in ("x", "mean", "error"))
    )


def _unbroken(x: Floats, y: Floats, width: float) -> Iterator[tuple[Floats, Floats]]:
    """Stretches without a gap that is longer than ``width`` and than three steps."""
    step = np.diff(x)
    long = np.flatnonzero(step > max(width, 3 * float(np.median(step)))) + 1 if len(step) else np.zeros(0, int)
    yield from zip(np.split(x, long), np.split(y, long), strict=True)


def paths(line: Timeline, x: Floats, y: Floats, held_out: NDArray[np.bool_], bins: int) -> BinnedMeans:
    """Means of ``x`` and ``y`` in time, of fitted and of held-out stretches each on their own."""
    total = sum(stop - start for _, start, stop in line.runs) or 1.0
    found: list[tuple[Floats, Floats, NDArray[np.bool_]]] = []
    for _, start, stop in line.runs:
        mine = np.flatnonzero((line.x >= start) & (line.x <= stop))
        for part in np.split(mine, np.flatnonzero(np.diff(held_out[mine])) + 1):
            t, count = line.x[part], max(2, round(bins * np.ptp(line.x[part]) / total))
            of_x, of_y = means(t, x[part], count), means(t, y[part], count)
            found.append((np.append(of_x.mean, np.nan), np.append(of_y.mean, np.nan), held_out[part[:1]]))
    joined = [np.concatenate([part[k] for part in found]) for k in (0, 1)]
    marked = np.concatenate([np.full(len(part[0]), part[2][0]) for part in found])
    return BinnedMeans(joined[0], joined[1], np.full(len(marked), np.nan), marked)


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


def envelope(f: Floats, values: Floats, per_decade: int = 120) -> tuple[Floats, Floats]:
    """A curve over logarithmic ``f`` by the least and the largest of its values in each of many narrow bins."""
    good = (f > 0) & np.isfinite(values)
    f, values = f[good], values[good]
    label = np.floor(np.log10(f) * per_decade)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(label) != 0])) if len(f) else np.zeros(0, int)
    kept = set()
    for start, stop in zip(starts, [*starts[1:], len(f)], strict=True):
        kept |= {start + int(values[start:stop].argmin()), start + int(values[start:stop].argmax())}
    chosen = np.array(sorted(kept), int)
    return f[chosen], values[chosen]


def reach(*residuals: Floats) -> tuple[float, int]:
    """A symmetric limit that shows the bulk of ``residuals``, and how many points lie beyond it."""
    size = np.abs(np.concatenate([r[np.isfinite(r)] for r in residuals]))
    if len(size) == 0 or size.max() == 0:
        return 1.0, 0
    bulk = float(np.quantile(size, 0.995))
    limit = 1.1 * float(size.max()) if size.max() <= 2.5 * bulk else 1.5 * bulk
    return limit, int(np.count_nonzero(size > limit))
