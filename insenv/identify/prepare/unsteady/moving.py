r"""Lines that move, or come and go: straight tracks through cells of time and frequency.

Of w = 2, 4, 8, ... segments that follow each other the sum of energies along a track,

    T_d(f) = sum_s E_(s, f + round(d s / w)),      T / 1.15  ~  Gamma(w)

for all first frequencies f and all d up to one frequency a segment if the noise is steady. Sums of 2 w segments are
made of two of w: n log w additions for n cells. A line that stands from end to end is what is usual at its frequency,
and is none of these; nor is noise that is as loud beside it. What moves faster is slow in shorter segments.

Source: J. H. Taylor, Astron. Astrophys. Suppl. 15 (1974) 367 (the tree of sums).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter, uniform_filter1d

from insenv.core.recording import Floats
from insenv.core.series.tails import log_far_tails_of_sums
from insenv.identify.prepare.unsteady.spectrogram import Spectrogram

#: How many times as loud noise may be along a track, and what one cell counts at most: rows of heavy tails.
LOUDER, LOUDEST = 1.15, 20.0
#: Doublings of a segment at most; columns on either side that are a line's own, those that are beside it, and segments
#: over which their loudness is smoothed.
DOUBLINGS, OWN, ABOUT, SMOOTHED = 6, 2, 10, 3


@dataclass(frozen=True)
class Ridge:
    """A straight track.

    Attributes
    ----------
    log_p : float
        Logarithm of the probability, among all that were tried.
    segment, count : int
        The first of its segments, and how many.
    column, change : int
        Column of the cells in which it begins, and by how many it moves.
    times : float
        Mean energy along it.
    """

    log_p: float
    segment: int
    count: int
    column: int
    change: int
    times: float


def ridges(cells: Spectrogram, level: float) -> list[Ridge]:
    """The strongest track of each block of segments that is beyond chance at a ``level``."""
    columns = cells.energy.shape[1]
    most = min(DOUBLINGS, int(np.log2(max(min(len(cells.energy), columns), 1))))
    energy = np.where(cells.told, np.minimum(cells.energy / _beside(cells), LOUDEST), 1.0).astype(np.float32)
    log_tried = float(np.log(max(2 * most * energy.size, 1)))
    found = []
    for way in (1, -1):
        for count, sums in _sums(energy[:, ::way], most):
            flat = sums.reshape(len(sums), -1)
            best = flat.argmax(axis=1)
            total = flat[np.arange(len(flat)), best].astype(np.float64)
            log_p = log_far_tails_of_sums(total / LOUDER, count) + log_tried
            for block in np.flatnonzero(log_p < np.log(level)).tolist():
                drift, column = divmod(int(best[block]), columns)
                at = column if way == 1 else columns - 1 - column
                mean = float(total[block]) / count
                found.append(Ridge(float(log_p[block]), block * count, count, at, way * drift, mean))
    return found


def _beside(cells: Spectrogram) -> Floats:
    """How much louder than usual the columns about each cell are, its own left out; no less than one."""
    own, about = (
        (uniform_filter(cells.energy, (1, 2 * half + 1), mode="constant") * (2 * half + 1)) for half in (OWN, ABOUT)
    )
    columns = np.arange(cells.energy.shape[1])
    within = [np.minimum(columns + half, columns[-1]) - np.maximum(columns - half, 0) + 1 for half in (OWN, ABOUT)]
    around = (about - own) / np.maximum(within[1] - within[0], 1)
    return np.maximum(uniform_filter1d(around, SMOOTHED, axis=0, mode="nearest"), 1.0)


def _sums(energy: NDArray[np.float32], most: int) -> Iterator[tuple[int, NDArray[np.float32]]]:
    """Sums along tracks towards higher columns of 2, 4, ... segments, shape (blocks, changes, columns)."""
    sums, columns = energy[:, None, :], energy.shape[1]
    for k in range(most):
        first, then = sums[0:-1:2], sums[1::2]
        first = first[: len(then)]
        changes = 2 * first.shape[1]
        both = np.empty((len(then), changes, columns), np.float32)
        for d in range(changes):
            half, shift = d // 2, d - d // 2
            both[:, d] = first[:, half]
            both[:, d, : columns - shift] += then[:, half, shift:]
            both[:, d, columns - shift :] = 0.0
        sums = both
        yield 2 ** (k + 1), sums
