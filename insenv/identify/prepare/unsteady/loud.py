r"""Stretches of time in which a band of frequencies is louder than in the rest of a run.

With S the mean energy in a band over a window of k segments and R that over all n - k others,

    S / (1.3 R)  ~  F(2 k q, 2 (n - k) q)

for noise that is steady, or no more than 1.3 times as loud at one time as at another. q, the frequencies of the band
that count, is what a Hann window leaves of them, or what the scatter of log energy from one segment to the next but one
says where that is more: rows of heavy tails make all frequencies of a segment louder at once, and at all times. Windows
of 1, 2, 4, ... segments are tried, in each octave and in all from one on (Bonferroni).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.core.series.robust import robust_deviation
from insenv.core.series.tails import log_far_tails_of_f
from insenv.identify.prepare.unsteady.spectrogram import Spectrogram

#: Ratio of powers up to which noise is steady.
LOUDER = 1.3
#: Frequencies of a Hann window for each that counts, of a band and of two alone; segments for each that counts.
FOR_EACH, OF_TWO, OVERLAP = 1.94, 1.44, 1.06
#: Share of the cells of a window that must tell something, and fewest segments that tell how they scatter.
LEAST, FEWEST = 0.5, 8
#: Share of the segments from which on it is told that they are quieter.
PART = 0.1
#: Largest ratio of powers that is told.
MOST = 1e6


@dataclass(frozen=True)
class Loud:
    """A window of segments in which a band of columns is louder than else.

    Attributes
    ----------
    log_p : float
        Logarithm of the probability, among all that were tried.
    segment, count : int
        The first of its segments, and how many.
    low, high : int
        Columns ``[low, high)`` of the cells.
    times : float
        Ratio of the power there to that in the rest of the run; below one where it is quieter.
    """

    log_p: float
    segment: int
    count: int
    low: int
    high: int
    times: float


def loud(cells: Spectrogram, level: float) -> list[Loud]:
    """Windows of each length that are louder than chance at a ``level``, loudest first, none touching another.

    Those of different length, or in another band, may.
    """
    found = []
    for windows in _tried(cells):
        ratio = windows.ratio(windows.inside, windows.told, windows.outside, windows.besides)
        found += [Loud(*one, float(ratio[place])) for place, one in windows.beyond(ratio, windows.freedom, level)]
    return found


def quiet(cells: Spectrogram, level: float) -> list[Loud]:
    """The same of windows that are quieter, a good part of a run: a reading that stands still for once is as well."""
    found = []
    for windows in _tried(cells):
        if windows.length < PART * len(cells.energy):
            continue
        ratio = windows.ratio(windows.outside, windows.besides, windows.inside, windows.told)
        beyond = windows.beyond(ratio, windows.freedom[::-1], level)
        found += [Loud(*one, 1 / float(ratio[place])) for place, one in beyond]
    return found


@dataclass(frozen=True)
class _Windows:
    """Windows of one ``length``: energy in them and outside, cells of both that tell; each of shape (bands, places)."""

    length: int
    bands: list[tuple[int, int]]
    inside: Floats
    told: Floats
    outside: Floats
    besides: Floats
    freedom: Floats
    log_tried: float

    def ratio(self, energy: Floats, cells: Floats, other: Floats, others: Floats) -> Floats:
        """Mean energy in some cells over that in others, nothing where too few of the windows tell it."""
        width = np.array([high - low for low, high in self.bands])[:, None]
        enough = (self.told > LEAST * self.length * width) & (self.besides > 0)
        return np.where(enough, energy * others / np.maximum(cells * other, energy * others / MOST + 1e-9), 0.0)

    def beyond(
        self, ratio: Floats, freedom: Floats, level: float
    ) -> Iterator[tuple[tuple[int, int], tuple[float, int, int, int, int]]]:
        """Place in ``ratio`` of what is beyond chance, and its probability, first segment, length and columns."""
        for band, at, log_p in _far(ratio, freedom, self.length, self.log_tried, float(np.log(level))):
            yield (band, at), (log_p, at, self.length, *self.bands[band])


def _tried(cells: Spectrogram) -> Iterator[_Windows]:
    n = len(cells.energy)
    bands = list(bands_of(cells.energy.shape[1]))
    power, there = (_of_bands(one, bands) for one in (cells.energy, cells.told))
    each = np.array([[count(p, t, high - low)] for p, t, (low, high) in zip(power, there, bands, strict=True)])
    power, there = (np.pad(np.cumsum(one, axis=1), ((0, 0), (1, 0))) for one in (power, there))
    lengths = [2**k for k in range(int(np.log2(n))) if 2**k <= n // 2]
    log_tried = float(np.log(len(bands) * sum(2 * n / length for length in lengths)))
    for length in lengths:
        inside, told = power[:, length:] - power[:, :-length], there[:, length:] - there[:, :-length]
        outside, besides = power[:, -1:] - inside, there[:, -1:] - told
        freedom = np.stack([told, besides]) * (2 * each / OVERLAP)
        yield _Windows(length, bands, inside, told, outside, besides, freedom, log_tried)


def _of_bands(values: Floats | NDArray[np.bool_], bands: list[tuple[int, int]]) -> Floats:
    """Sums over the columns of each band, shape (bands, segments)."""
    total = np.pad(np.cumsum(values, axis=1, dtype=np.float64), ((0, 0), (1, 0)))
    return np.stack([total[:, high] - total[:, low] for low, high in bands])


def _far(
    times: Floats, freedom: Floats, length: int, log_tried: float, log_level: float
) -> Iterator[tuple[int, int, float]]:
    """Band and place of windows beyond a level, none touching another of its band, with the log of its probability."""
    left, every = times.copy(), np.arange(len(times))
    while len(every):
        at = left[every].argmax(axis=1)
        ratio = left[every, at]
        log_p = log_far_tails_of_f(ratio / LOUDER, *np.maximum(freedom[:, every, at], 1e-9)) + log_tried
        beyond = (ratio > LOUDER) & (log_p < log_level)
        every, at = every[beyond], at[beyond]
        for band, place, one in zip(every.tolist(), at.tolist(), log_p[beyond].tolist(), strict=True):
            yield band, place, one
            left[band, max(0, place - length) : place + length + 1] = 0.0


def count(power: Floats, told: Floats, columns: int) -> float:
    """How many independent exponentials one cell of so many ``columns`` counts for.

    Of the energies of segments together and how many cells of each tell something, both of shape (n,).
    """
    theory = 1.0 if columns == 1 else 1 / (OF_TWO if columns == 2 else FOR_EACH)
    whole = told > LEAST * columns
    mean = power[whole] / told[whole]
    steps = np.diff(np.log(np.maximum(mean, 1e-12))[::2])
    if len(steps) < FEWEST:
        return theory
    spread = 0.5 * robust_deviation(steps - np.median(steps)) ** 2
    # Of the logarithm of a mean of q exponentials the variance is 1 / q + 1 / 2 q^2.
    return min(theory, (1 + np.sqrt(1 + 2 * spread)) / (2 * spread) / columns) if spread > 0 else theory


def bands_of(columns: int) -> Iterator[tuple[int, int]]:
    """Each octave of so many columns, and all from one octave on."""
    edges = octaves(columns)
    yield from pairwise(edges)
    yield from ((low, columns) for low in edges[:-2])


def octaves(columns: int) -> list[int]:
    """Edges of the octaves of so many columns."""
    edges, width = [0], 2
    while edges[-1] < columns:
        edges.append(min(edges[-1] + width, columns))
        width *= 2
    return edges
