"""Rows of a run on an even clock, where a bad link has lost some here and there.

A line of the samples is looked for in rows that follow each other. Of a log that loses a row in ten no stretch without
a gap is long: short gaps are bridged, each by a straight line between its neighbours, which follows what is slow, and
has little of a fast line. What gaps make of a line, images beside it, is told by taking the line out: they go with it.

A logger that stops to write goes on at another phase of its clock. So rows are counted from one to the next, and by
what the clock has slipped they may stand off the even one, by less than moves a line that is not near half its rate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats, Recording
from insenv.core.series.stretches import stretches
from insenv.identify.prepare.spectral.lines import SAME_LINE, Line, find_lines

#: A gap is bridged that is no longer than this share of the rows, and so many more; rows that must be there of a
#: stretch, as a share; how far from its place on the even clock a row may be, in periods, by itself and with what the
#: clock has slipped before.
SHARE, MORE, PRESENT, OFF, SLIPPED = 0.02, 8, 2 / 3, 0.1, 0.35
#: How many times as many rows a stretch with gaps must have as the longest without one.
LONGER = 1.25


@dataclass(frozen=True)
class Rows:
    """Some rows of a run, in order, and their places on an even clock.

    Attributes
    ----------
    index : ndarray of int, shape (rows,)
    place : ndarray of int, shape (rows,)
        Counted from 0 at the first one.
    """

    index: NDArray[np.int64]
    place: NDArray[np.int64]

    @property
    def follow(self) -> bool:
        """Whether no row is lost between them."""
        return len(self.place) == 0 or int(self.place[-1]) + 1 == len(self.place)

    def filled(self, values: Floats) -> Floats:
        """Values of the rows, shape (rows,), with straight lines over the gaps, shape (n,)."""
        return values if self.follow else np.interp(np.arange(self.place[-1] + 1), self.place, values)


def rows_of(recording: Recording, wanted: NDArray[np.bool_]) -> Rows:
    """The longest stretch of rows that are ``wanted``, short gaps bridged where that makes it longer."""
    alone = _alone(longest(recording, wanted))
    index = np.flatnonzero(wanted)
    if not len(index) or len(index) < LONGER * len(alone.index):
        return alone
    places = (recording.t[index] - recording.t[index[0]]) / recording.dt
    breaks = np.flatnonzero(np.diff(places) > SHARE * len(index) + MORE) + 1
    best = max(np.split(np.arange(len(index)), breaks), key=len)
    at = places[best] - places[best[0]]
    steps = np.rint(np.diff(at)).astype(np.int64)
    place = np.concatenate([[0], np.cumsum(steps)])
    by_itself, off = float(np.std(np.diff(at) - steps)) / np.sqrt(2), float(np.std(at - place))
    even = bool(np.all(steps > 0)) and by_itself < OFF and off < SLIPPED
    if not even or len(best) < PRESENT * (place[-1] + 1) or len(best) < LONGER * len(alone.index):
        return alone
    return Rows(index[best], place)


def longest(recording: Recording, wanted: NDArray[np.bool_]) -> slice:
    """Longest stretch of consecutive rows that are wanted, without a gap."""
    best = slice(0, 0)
    for piece in recording.pieces():
        for a, b in stretches(wanted[piece]):
            if b - a > best.stop - best.start:
                best = slice(piece.start + a, piece.start + b)
    return best


def _alone(span: slice) -> Rows:
    index = np.arange(span.start, span.stop)
    return Rows(index, np.arange(len(index)))


def lines_of_rows(
    rows: Rows, t: Floats, dt: float, values: Floats, quantum: float, run: int, lowest: float
) -> tuple[Line, ...]:
    """Lines of the ``values`` of some rows above ``lowest`` [Hz], as `find_lines` has them: no image of another one.

    Parameters
    ----------
    rows : Rows
    t, values : ndarray, shape (rows,)
        Times from the start of the run [s], and values.
    dt, quantum, run, lowest
        As of `find_lines`.
    """
    if rows.follow:
        return find_lines(t, dt, values, quantum, run, lowest)
    even = t[0] + dt * np.arange(rows.place[-1] + 1)
    kept: list[Line] = []
    left, lost = values - values.mean(), 1 - len(rows.place) / (rows.place[-1] + 1)
    for line in find_lines(even, dt, rows.filled(values), quantum, run, lowest):
        again = find_lines(even, dt, rows.filled(left), quantum, run, lowest) if kept else (line,)
        found = [x for x in again if abs(x.frequency - line.frequency) < SAME_LINE]
        if not found or any(not x.steady and line.amplitude < lost * x.amplitude for x in kept):
            continue
        kept.append(_of_rows(found[0], t, left))
        left = left - kept[-1].at(t)
    return tuple(kept)


def _of_rows(line: Line, t: Floats, values: Floats) -> Line:
    """A line with the amplitude and the phase that the rows tell: of what is drawn over the gaps it has little."""
    if not line.steady:
        return line
    angle = 2 * np.pi * line.frequency * t
    c, s = np.linalg.lstsq(np.column_stack([np.cos(angle), np.sin(angle)]), values, rcond=None)[0]
    share = min(1.0, 0.5 * float(c**2 + s**2) / max(float(np.var(values)), 1e-300))
    return replace(line, amplitude=float(np.hypot(c, s)), phase=float(np.arctan2(-s, c)), share=share)
