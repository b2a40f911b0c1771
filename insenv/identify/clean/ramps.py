"""Rows in which a table is still on its way to the rate that it was told.

Where the commanded rate is all that was logged it jumps, and no table does. After a jump by D at row k the reading
less the command,

    r_i = y_i - u_i,

goes from about -D to the line through the later half of the dwell. The rows until then are left out. A reference that
is merely late or early leaves the whole of D or nothing of it: that is a `timing_skew`, and stays.

A table has one acceleration: where large jumps show it, smaller ones, whose way hides in the noise of single rows, are
given the time that they take, and so is the start of a recording before which the table was at rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from insenv.core.recording import Floats, Recording
from insenv.data.exposure import table_rate_of_rows, table_share
from insenv.identify.findings import RejectedRows

#: Changes of a command that holds, as a share of its rows at most; least rows of a dwell.
MOST_CHANGES, LEAST_DWELL = 0.02, 20
#: Standard deviations of a row by which a jump must stand out.
JUMP = 20.0
#: Shares of the jump between which a reading is on its way, and the rows of the larger jumps that must be.
ON_ITS_WAY, LEAST_ROWS = (0.1, 0.9), 2
#: Rows whose mean tells whether the rate is there, and the standard deviations that it may be off.
ROWS, OFF = 9, 5.0
#: Share by which the time until then is prolonged: the end of an approach hides in the noise.
LONGER = 0.5
#: First rows that tell the rate at the start of a recording, and the times by which its way may be longer than others.
FIRST, SLOWER = 3, 3.0


@dataclass(frozen=True)
class _Approach:
    """Rows after a jump: the first one, that from which on the rate is there, and how many were on their way."""

    start: int
    stop: int
    between: int
    jump: float

    @property
    def pace(self) -> float:
        """Change of the rate in a row; infinite for a jump that the table followed within a row."""
        return abs(self.jump) / (self.stop - self.start) if self.stop > self.start else np.inf


def approaching(recording: Recording, target: str, run: int) -> tuple[RejectedRows, ...]:
    """Rows of ``target`` in which the table had not yet the commanded rate."""
    share = table_share(recording, target)
    if "table_angle" in recording.channels or "table_rate" not in recording.channels or not share:
        return ()
    u = table_rate_of_rows(recording, target)
    assert u is not None
    u = u * share
    jumps = np.flatnonzero(np.abs(np.diff(u)) > 1e-6 * np.abs(u).max(initial=0.0)) + 1
    if not len(jumps) or len(jumps) > MOST_CHANGES * len(u):
        return ()
    # A command that is logged at instants changes from one row to the next, its means over rows in two steps.
    first = jumps[np.concatenate([[True], np.diff(jumps) > 2])]
    ends = np.concatenate([first[1:], [len(u)]])
    left = recording.channels[target].values - u
    dwells = [(int(a), int(b)) for a, b in zip(first, ends, strict=True)]
    seen = [_approach(left, u, a, b) for a, b in dwells]
    found = [one for one in seen if one is not None]
    if not found:
        return ()
    # A skew is as long for every jump, a way is longer for a larger one.
    size = [abs(one.jump) for one in found]
    larger = [one for one, jump in zip(found, size, strict=True) if jump >= np.median(size)]
    if np.median([one.between for one in larger]) < LEAST_ROWS:
        return ()
    pace = float(np.median([one.pace for one in larger]))
    found += [_paced(u, a, b, pace) for (a, b), one in zip(dwells, seen, strict=True) if one is None or not one.between]
    found += [one for one in (_from_rest(left, u, dwells[0][0], pace),) if one is not None]
    reason = "the table was still on its way to the commanded rate"
    return tuple(
        RejectedRows(target, run, one.start, one.stop, reason, "ramp")
        for one in sorted(found, key=lambda one: one.start)
        if one.stop > one.start
    )


def _approach(left: Floats, u: Floats, start: int, end: int) -> _Approach | None:
    """The approach after the jump at row ``start`` of a dwell up to row ``end``; None where none could be seen."""
    if end - start < LEAST_DWELL or start == 0:
        return None
    return _way(left, _jump(u, start, end), start, end)


def _jump(u: Floats, start: int, end: int) -> float:
    """Change of the rate at the start of a dwell, once a command that changes in two steps has done so."""
    return float(u[min(start + 2, end - 1)] - u[start - 1])


def _way(left: Floats, jump: float, start: int, end: int) -> _Approach | None:
    """The rows from ``start`` on until the rate is there; None where the noise of a row hides the jump."""
    x = left[start:end]
    t, half = np.arange(len(x)), len(x) // 2
    line = np.polynomial.Polynomial.fit(t[half:], x[half:], 1)
    x = x - line(t)
    noise = 1.4826 * float(np.median(np.abs(x[half:] - np.median(x[half:]))))
    if abs(jump) < JUMP * noise:
        return None
    way = -x / jump
    # The extrapolated line is itself uncertain: at the start of the dwell by sqrt(14 / n) of a row's noise.
    allowed = OFF * noise * float(np.hypot(1 / np.sqrt(ROWS), np.sqrt(14 / half)))
    there = np.abs(uniform_filter1d(x, ROWS, mode="nearest")) < max(allowed, 1e-12 * abs(jump))
    until = int(np.argmax(there)) if there.any() else half
    between = int(np.sum((way[:until] > ON_ITS_WAY[0]) & (way[:until] < ON_ITS_WAY[1])))
    stop = start + min(half, until + int(np.ceil(LONGER * until)) + ROWS // 2) if between else start
    return _Approach(start, stop, between, jump)


def _paced(u: Floats, start: int, end: int, pace: float) -> _Approach:
    """The approach at the pace of the others, after a jump that single rows do not show."""
    jump = _jump(u, start, end) if start else 0.0
    stop = min(end, start + int(np.ceil(abs(jump) / pace)) + ROWS // 2) if jump else start
    return _Approach(start, stop, 0, jump)


def _from_rest(left: Floats, u: Floats, end: int, pace: float) -> _Approach | None:
    """The approach to the first rate of a recording that began while the table stood or had begun to move."""
    if end < LEAST_DWELL or u[0] == 0.0:
        return None
    jump = -float(np.mean(left[:FIRST]) - np.mean(left[end // 2 : end]))
    if not 0.0 < jump / u[0] <= 1.0 / ON_ITS_WAY[1]:
        return None
    found = _way(left, jump, 0, end)
    usual = SLOWER * abs(jump) / pace + ROWS
    return found if found is not None and found.between >= LEAST_ROWS and found.stop <= usual else None
