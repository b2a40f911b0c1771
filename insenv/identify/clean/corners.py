"""Readings at instants where the angle of their table leaves open how fast it turns: at corners and beside gaps.

Of angles in rows of dt the seven around a row tell its rate, of a smooth motion to the sixth power of dt. Where the
acceleration jumps by J at a row, the rate u is off there and in the rows beside by

    J dt (1/100, -1/24, 1/7, -1/24, 1/100),     where     d4 u = J dt (5/16, 1/32, -5/8, 1/32, 5/16),

so that the largest fourth difference tells what is left open, a quarter of it. Nothing tells when within a row it
jumps: where all corners together are not small beside the noise of a reading their rows are left out, for a delay, a
held output or a fault near one rate would be named for them.

Of a gap the nearer half of a row is open: by half of what the acceleration into it is another than that before it, in
a row. So it is at either end of a recording, beyond which no acceleration is known.

A corner is a motion, and the reading bends with it. Where it does not, the reference has leapt, as over a backlash, or
the reading is late or slow: those rows tell of it, and stay. Small corners, which a reading cannot tell alone, are
asked together. Of a motion that bends everywhere, as one that was read too seldom, nothing is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, median_filter

from insenv.core.recording import GAP, Floats, Recording
from insenv.core.series.robust import noise_of_steps
from insenv.core.series.stretches import stretches
from insenv.data.cells.table import table_rate_of_rows
from insenv.data.exposure import table_share
from insenv.data.reference import order
from insenv.identify.findings import RejectedRows

Mask = NDArray[np.bool_]

#: Share of the fourth difference of a rate at a corner that is left open in the row beside it, and farther ones.
OPEN = (0.25, 0.02, 0.002)
#: Share of the largest fourth difference around it above which one stands in the row of a corner.
LARGEST = 0.6
#: Share of the change of the slope into a gap that is left open.
HALF = 0.5
#: What is left open that matters where all of it does, in the noise of a reading; and its root square sum over all
#: corners from which on it does: a fault that is shaped as half of it would show by four deviations.
SEEN, TOGETHER = 0.2, 8.0
#: Noise of what was computed, as a share of the largest rate: it hides nothing, and tells nothing.
COMPUTED = 1e-9
#: Rows around a bend, and the times by which it is sharper than is usual there, and in all of the run: the noise of an
#: angle makes one row in 10^7 so sharp.
AROUND, SHARP = 61, 8.0
#: Rows that a fourth difference and the curve through an angle reach to either side.
REACH, BESIDE = 3, 3
#: Share of a bend that a reading must follow, and the deviation of that share up to which it tells by itself.
FOLLOWED, TELLS = 0.5, 0.25
#: Rows to either side of a corner in which a reading stands off the motion by the same, and the deviations, and share
#: of the change of the rate, by which it may not.
STANDS, OFF, AS_ONE = 6, 5.0, 0.002
#: Share of the rows beyond which a rate bends everywhere.
MOST_BENT = 0.2

CORNER = "the table's rate bends within this row, and its angle does not tell when"
EDGE = "the table's rate changes beside this row, where its angle was not read"


@dataclass(frozen=True)
class _Beside:
    """A reading ``y``, what it shows ``u`` of the table by its ``gain``, and its noise in a row."""

    y: Floats
    u: Floats
    gain: float
    noise: float

    @property
    def left(self) -> Floats:
        return self.y - self.u


def cornering(recording: Recording, target: str, run: int, known: tuple[RejectedRows, ...]) -> tuple[RejectedRows, ...]:
    """Rows of a reading at instants whose rate the angle leaves open, without those that are ``known`` already."""
    share, channel, names = table_share(recording, target), recording.channels[target], order(recording)
    if channel.covers != "instant" or names[:1] != ("table_angle",) or not share or len(recording) < 4 * STANDS:
        return ()
    rates = table_rate_of_rows(recording, target, names[:1])
    if rates is None or not np.ptp(rates):
        return ()
    both = _beside(channel.values, rates)
    if both.noise < COMPUTED * float(np.abs(both.u).max()):
        return ()
    taken = np.zeros(len(recording), bool)
    for one in known:
        taken[one.start : one.stop] |= one.run == run
    # Of a jump the seven readings around a row know more rows than those within which it is.
    beside = np.asarray(maximum_filter1d(taken, 2 * REACH + 1), bool)
    edges = _edges(recording, both)
    left_open = _left_open(both, edges[0] | taken)
    bent = left_open > SEEN
    corners = _corners(both, bent | edges[1] | beside, stretches(bent & ~edges[1] & ~beside))
    if np.linalg.norm([left_open[a:b].max() for a, b in corners]) < TOGETHER:
        corners = []
    corners += stretches(beside & ~taken)
    rows = [(a, b, CORNER) for a, b in corners] + [(a, b, EDGE) for a, b in stretches(edges[1] & ~beside)]
    if sum(b - a for a, b, _ in rows) > MOST_BENT * len(recording):
        return ()
    return tuple(RejectedRows(target, run, a, b, reason, "ramp") for a, b, reason in sorted(rows))


def _beside(y: Floats, u: Floats) -> _Beside:
    """The reading beside the rate of the table times its gain, which may be any."""
    gain, level = np.polyfit(u, y, 1)
    u = gain * u + level
    return _Beside(y, u, float(gain), noise_of_steps(np.diff(y - u)))


def _left_open(both: _Beside, edges: Mask) -> Floats:
    """What corners, where the rate bends more sharply than is usual, leave open of a row, in the noise of a reading.

    What rows at ``edges`` of a gap are off by, and the first and the last one, is no corner of those beside them.
    """
    bend = np.pad(np.abs(np.diff(both.u, 4)), 2)
    bend[maximum_filter1d(edges, 2 * REACH + 1)] = 0.0
    bend[:REACH] = bend[-REACH:] = 0.0
    usual = np.maximum(median_filter(bend, AROUND), float(np.median(bend)))
    corner = (bend > SHARP * usual) & (bend > LARGEST * maximum_filter1d(bend, 2 * REACH - 1))
    sharp = np.where(corner, bend, 0.0)
    left_open = np.max([share * maximum_filter1d(sharp, 2 * k + 3) for k, share in enumerate(OPEN)], axis=0)
    return np.asarray(left_open / max(both.noise, np.finfo(float).tiny))


def _edges(recording: Recording, both: _Beside) -> Mask:
    """Rows at gaps and ends, and those of them and of their neighbours that leave open what a reading shows, (2, n)."""
    t, dt = recording.t, recording.dt
    steps = np.diff(t)
    rate = both.gain * np.diff(recording.channels["table_angle"].values) / steps
    slope = np.pad(2 * np.diff(rate) / (steps[1:] + steps[:-1]), 1, mode="edge")
    seen = max(SEEN / HALF * both.noise / dt, SHARP * float(np.median(np.abs(np.diff(slope, 3)))))
    found = np.zeros((2, len(t)), bool)
    for k in np.flatnonzero(steps > GAP * dt).tolist():
        found[0, k : k + 2] = True
        found[1, max(k + 1 - BESIDE, 0) : k + 1] |= abs(slope[k] - slope[max(k - 1, 0)]) > seen
        found[1, k + 1 : k + 1 + BESIDE] |= abs(slope[k + 1] - slope[min(k + 2, len(t) - 1)]) > seen
    found[1, :BESIDE] |= abs(slope[0]) > seen
    found[1, -BESIDE:] |= abs(slope[-1]) > seen
    return found


def _corners(both: _Beside, bent: Mask, parts: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The stretches in which the reading bends with the table; none where it is late or slow in most of them."""
    followed = _followed(both, parts)
    slow = [_slow(both, bent, a, b) for a, b in followed]
    if 2 * sum(slow) > len(followed):
        return []
    return [part for part, late in zip(followed, slow, strict=True) if not late]


def _followed(both: _Beside, parts: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The stretches in which the reading bends with the table."""
    bend, read = (np.pad(np.diff(x, 2), 1) for x in (both.u, both.y))
    power = np.array([float(bend[a:b] @ bend[a:b]) for a, b in parts])
    along = np.array([float(bend[a:b] @ read[a:b]) for a, b in parts])
    alone = np.sqrt(6) * both.noise < TELLS * np.sqrt(power)
    together = bool(along[~alone].sum() > FOLLOWED * power[~alone].sum())
    follows = np.where(alone, along > FOLLOWED * power, together)
    return [part for part, so in zip(parts, follows, strict=True) if so]


def _slow(both: _Beside, bent: Mask, first: int, last: int) -> bool:
    """Whether the reading comes to the motion in the rows beside a corner: what it is off by goes on changing there."""
    sides = (np.arange(max(first - STANDS, 0), first), np.arange(last, min(last + STANDS, len(bent))))
    left = both.left
    off = [np.abs(left[rows] - np.median(left[rows])).max() for side in sides if len(rows := side[~bent[side]])]
    change = float(np.ptp(both.u[max(first - STANDS, 0) : last + STANDS]))
    return max(off, default=0.0) > OFF * both.noise + AS_ONE * change
