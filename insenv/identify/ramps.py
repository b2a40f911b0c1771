"""Rows in which a table is still on its way to the rate that it was told.

Where the commanded rate is all that was logged it jumps, and no table does. After a jump by D at row k the reading
less the command,

    r_i = y_i - u_i,

goes from about -D to the line through the later half of the dwell. The rows until then are left out. A reference that
is merely late or early leaves the whole of D or nothing of it: that is a `timing_skew`, and stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from insenv.core.exposure import table_rate_of_rows, table_share
from insenv.core.recording import Floats, Recording
from insenv.identify.findings import RejectedRows

#: Changes of a command that holds, as a share of its rows at most; least rows of a dwell.
MOST_CHANGES, LEAST_DWELL = 0.02, 20
#: Standard deviations of a row by which a jump must stand out.
JUMP = 20.0
#: Shares of the jump between which a reading is on its way, and the rows of the median jump that must be.
ON_ITS_WAY, LEAST_ROWS = (0.1, 0.9), 2
#: Rows whose mean tells whether the rate is there, and the standard deviations that it may be off.
ROWS, OFF = 9, 5.0
#: Share by which the time until then is prolonged: the end of an approach hides in the noise.
LONGER = 0.5


@dataclass(frozen=True)
class _Approach:
    """Rows after a jump: the first one, that from which on the rate is there, and how many were on their way."""

    start: int
    stop: int
    between: int


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
    found = [one for a, b in zip(first, ends, strict=True) if (one := _approach(left, u, int(a), int(b))) is not None]
    if not found or np.median([one.between for one in found]) < LEAST_ROWS:
        return ()
    reason = "the table was still on its way to the commanded rate"
    return tuple(
        RejectedRows(target, run, one.start, one.stop, reason, "ramp") for one in found if one.stop > one.start
    )


def _approach(left: Floats, u: Floats, start: int, end: int) -> _Approach | None:
    """The approach after the jump at row ``start`` of a dwell up to row ``end``; None where none could be seen."""
    if end - start < LEAST_DWELL or start == 0:
        return None
    x = left[start:end]
    t, half = np.arange(len(x)), len(x) // 2
    line = np.polynomial.Polynomial.fit(t[half:], x[half:], 1)
    x = x - line(t)
    jump = float(u[min(start + 2, end - 1)] - u[start - 1])
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
    return _Approach(start, stop, between)
