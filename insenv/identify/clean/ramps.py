"""Rows in which a table is still on its way to the rate that it was told.

Where the commanded rate is all that was logged it jumps, and no table does. After a jump by D at row k the reading
less the command,

    r_i = y_i - u_i,

goes from about -D to the line through the later half of the dwell, or through the part of it in which it stands. The
rows until then are left out, and all of a dwell in which it never stands. A reference that is merely late or early
leaves the whole of D or nothing of it: that is a `timing_skew`, and stays.

A table has one acceleration: where large jumps show it, smaller ones, whose way hides in the noise of single rows, are
given the time that they take, and so is the start of a recording before which the table was at rest.

Until it is there it falls behind the integral of the command by an angle, which the reading shows. Of a table with one
acceleration a and a delay d that is

    -sum r_i dt = D |D| / 2a + d D,

fitted over all jumps of a run. Ways up and down do not cancel, for the first term is odd: after a few minutes an Earth
rate would be looked for at the wrong heading.

Where an angle was read and the rate jumps from one row to the next, as in a simulation of a table without a motor, the
angle does not tell when within a row: a reading at an instant has all of the jump, and the angle half of it. Such rows
are left out: half a row of delay would be named for them, and a held output.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, median_filter, uniform_filter1d

from insenv.core.recording import Floats, Recording
from insenv.core.series.robust import noise_of_steps, robust_deviation
from insenv.core.series.stretches import stretches
from insenv.data.cells.table import table_rate_of_rows
from insenv.data.exposure import table_share
from insenv.data.reference import order
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
#: Fewest rows that tell whether a rate stands, and the share of its pace before within which it does.
FEWEST, SLOWED = 8, 0.5
#: Share of a dwell, at its end, by which the gain is told.
END = 0.25
#: First rows that tell the rate at the start of a recording, and the times by which its way may be longer than others.
FIRST, SLOWER = 3, 3.0


#: Share of the rows from which on a table is on its way all the time.
NEVER_THERE = 0.9
#: Fewest jumps that tell an acceleration and a delay.
LEAST_JUMPS = 3
#: Rows for which a table stands at its rate before and after a jump, the share of the jump within which it does, and
#: the steps in which an angle shows it at most, and the change of a row, in its noise, that many of which would show.
STANDS, AS_ONE, LONGEST_JUMP, SEEN = 6, 0.02, 4, 0.2
#: Share of the jumps between that by which means are off, none, and instants, a half; deviations in which it is told.
INSTANT, SURE = 0.25, 3.0
#: Rows around a bend and the times by which it is sharper than is usual there; share of the rows beyond which a rate
#: bends everywhere.
AROUND, SHARP, MOST_BENT = 15, 4.0, 0.2


def slewed(recording: Recording, target: str) -> Recording:
    """The recording with a command on whose integral the table is: it comes to each rate as the reading shows."""
    ways = [way for way in approaching(recording, target, 0) if way.start > 0]
    u = table_rate_of_rows(recording, target) if len(ways) >= LEAST_JUMPS else None
    if u is None or any(then.start < way.stop for way, then in pairwise(ways)):  # it does not come to each rate
        return recording
    share = table_share(recording, target)
    left = recording.channels[target].values / share - u
    jump = np.array([u[way.stop - 1] - u[way.start] for way in ways])
    behind = np.array([_behind(left, way.start, way.stop) for way in ways])
    terms = np.column_stack([jump * np.abs(jump), jump])
    slow, late = np.linalg.lstsq(terms, behind, rcond=None)[0]
    if slow <= 0:
        return recording
    rate = recording.channels["table_rate"]
    values = rate.values.copy()
    for way, lost in zip(ways, terms @ np.array([slow, late]), strict=True):
        # Rows that are kept, at either end, know nothing of it: means and slopes reach one row further.
        rows = np.arange(way.start + 1, max(way.stop - 2, way.start + 2))
        weight = np.linspace(1.0, 0.0, len(rows) + 1)[:-1]
        values[rows] -= lost * weight / weight.sum()
    return replace(recording, channels={**recording.channels, "table_rate": replace(rate, values=values)})


def _behind(left: Floats, start: int, stop: int) -> float:
    """By how much the reading falls behind the command from row ``start`` to ``stop``, in rows times a rate."""
    there = left[stop : stop + LEAST_DWELL]
    return -float(np.sum(left[start:stop] - there.mean())) if len(there) else 0.0


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
    dwells = _dwells(u)
    left = recording.channels[target].values - u
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
    longest = max(one.stop - one.start for one in found)
    found += [one for one in (_from_rest(left, u, dwells[0][0], (pace, longest)),) if one is not None]
    if sum(one.stop - one.start for one in found) > NEVER_THERE * (len(u) - dwells[0][0]):
        return ()  # what is left where it never stands is no way of the table, and nothing would be left of the rest
    reason = "the table was still on its way to the commanded rate"
    # Slopes of the command are central differences: the row before a jump has a part of it.
    return tuple(
        RejectedRows(target, run, max(one.start - 1, 0), one.stop, reason, "ramp")
        for one in sorted(found, key=lambda one: one.start)
        if one.stop > one.start
    )


def ends_of_dwells(recording: Recording, target: str) -> NDArray[np.bool_] | None:
    """Rows at the ends of the dwells of a commanded rate that jumps; None of any other reference.

    There a table is at its rate, if anywhere.
    """
    if order(recording)[:1] != ("table_rate",) or recording.channels["table_rate"].source != "command":
        return None
    u = table_rate_of_rows(recording, target)
    dwells = [] if u is None else _dwells(u)
    if not len(dwells):
        return None
    at_end = np.zeros(len(recording), bool)
    for start, end in [(0, dwells[0][0]), *dwells]:
        at_end[end - int(np.ceil(END * (end - start))) : end] = True
    return at_end


def _dwells(u: Floats) -> list[tuple[int, int]]:
    """First row and the row behind the last of each dwell after a jump of a command that holds; none of another."""
    jumps = np.flatnonzero(np.abs(np.diff(u)) > 1e-6 * np.abs(u).max(initial=0.0)) + 1
    # A command that is logged at instants changes from one row to the next, its means over rows in two steps.
    first = jumps[np.diff(jumps, prepend=-3) > 2]
    changes = len(first) if len(jumps) <= 2 * len(first) else len(jumps)
    if not 0 < changes <= MOST_CHANGES * len(u):
        return []
    return [(int(a), int(b)) for a, b in pairwise((*first, len(u)))]


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
    stands = _stands(x, jump)
    if stands is None:
        return _Approach(start, end, end - start, jump)
    t, still = np.arange(len(x)), slice(stands, None)
    x = x - np.polynomial.Polynomial.fit(t[still], x[still], 1)(t)
    noise = robust_deviation(x[still] - np.median(x[still]))
    if abs(jump) < JUMP * noise:
        return None
    way = -x / jump
    # The extrapolated line is itself uncertain: at the start of the dwell by sqrt(14 / n) of a row's noise.
    allowed = OFF * noise * float(np.hypot(1 / np.sqrt(ROWS), np.sqrt(14 / (len(x) - stands))))
    there = np.abs(uniform_filter1d(x, ROWS, mode="nearest")) < max(allowed, 1e-12 * abs(jump))
    until = _stays(there, stands)
    between = int(np.sum((way[:until] > ON_ITS_WAY[0]) & (way[:until] < ON_ITS_WAY[1])))
    stop = start + min(stands, until + int(np.ceil(LONGER * until)) + ROWS // 2) if between else start
    return _Approach(start, stop, between, jump)


def _stays(there: NDArray[np.bool_], stands: int) -> int:
    """The row from which on the rate is there for as long again as it took; a servo that swings passes it before."""
    return next((a for a, b in stretches(there) if b - a >= max(a, ROWS) or b == len(there)), stands)


def _stands(x: Floats, jump: float) -> int | None:
    """The row of a dwell from which on the rate stands: its middle, or a later one; None where it never does.

    It comes no nearer in what follows, by the noise, by a small share of the jump or beside how it came before.
    """
    steps = np.diff(x)
    noise = noise_of_steps(steps - np.median(steps))
    stands, pace = len(x) // 2, np.inf
    while len(x) - stands >= FEWEST:
        middle = (stands + len(x)) // 2
        rows = min(ROWS, middle - stands)
        came = float(np.mean(x[middle:]) - np.mean(x[stands : stands + rows])) * float(np.sign(jump))
        apart = 0.5 * (middle + len(x)) - stands - 0.5 * rows
        unseen = OFF * noise * float(np.sqrt(2 / rows))
        if came < min(max(unseen, AS_ONE * abs(jump)), SLOWED * pace * apart):
            return stands if came < unseen else middle
        stands, pace = middle, max(came / apart, 0.0)
    return None if np.isfinite(pace) else stands


def _paced(u: Floats, start: int, end: int, pace: float) -> _Approach:
    """The approach at the pace of the others, after a jump that single rows do not show."""
    jump = _jump(u, start, end) if start else 0.0
    stop = min(end, start + int(np.ceil(abs(jump) / pace)) + ROWS // 2) if jump else start
    return _Approach(start, stop, 0, jump)


def _from_rest(left: Floats, u: Floats, end: int, others: tuple[float, int]) -> _Approach | None:
    """The approach to the first rate of a recording that began while the table stood or had begun to move.

    ``others`` are the pace of the larger jumps, and the rows that the longest way took: a servo that swings takes as
    long for a small one.
    """
    if end < LEAST_DWELL or u[0] == 0.0:
        return None
    jump = -float(np.mean(left[:FIRST]) - np.mean(left[end // 2 : end]))
    if not 0.0 < jump / u[0] <= 1.0 / ON_ITS_WAY[1]:
        return None
    found = _way(left, jump, 0, end)
    pace, longest = others
    usual = max(SLOWER * abs(jump) / pace, longest) + ROWS
    return found if found is not None and found.between >= LEAST_ROWS and found.stop <= usual else None


def jumping(recording: Recording, target: str, run: int) -> tuple[RejectedRows, ...]:
    """Rows within which the rate of a table jumps whose angle alone was read: nothing tells when in the row.

    A reading that is late by a row and more differs beside them as well: that is a skew, and all rows stay. So they do
    where the readings are means, which have of a ramp what the angle has.
    """
    share, channel = table_share(recording, target), recording.channels[target]
    if "table_angle" not in recording.channels or not share or channel.delay:
        return ()
    u = table_rate_of_rows(recording, target, ("table_angle",))
    assert u is not None
    left = channel.values - u * share
    noise = noise_of_steps(np.diff(left))
    change = np.abs(np.diff(u)) * abs(share) > SEEN * noise
    reason, found = "the table's rate jumps within this row, and its angle does not tell when", []
    jumps: list[float] = []
    off: list[float] = []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], change, [False]])))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        before, after = slice(first - STANDS + 1, first + 1), slice(last, last + STANDS)
        if first - STANDS + 1 < 0 or last + STANDS > len(u) or last - first > LONGEST_JUMP:
            continue
        jump = AS_ONE * abs(u[last] - u[first])
        allowed = OFF * noise + jump * abs(share)
        beside = np.concatenate([left[before], left[after]])
        stands = max(np.ptp(u[before]), np.ptp(u[after])) < jump
        if last > first + 1 and stands and np.abs(beside - np.median(beside)).max() < allowed:
            found.append(RejectedRows(target, run, int(first) + 1, int(last), reason, "ramp"))
            jumps.append((u[last] - u[first]) * share)
            off.append(float(np.sum(left[first + 1 : last] - np.median(beside))))
    return tuple(found) if _of_instants(np.array(jumps), np.array(off), noise) else ()


def bending(recording: Recording, target: str, run: int) -> tuple[RejectedRows, ...]:
    """Rows within which a commanded rate bends that was read at instants, beside readings that are means.

    It does not tell its mean over a row in which a ramp begins: it is off by up to an eighth of the change of the slope
    in a row, a skew of as much. Of a rate that bends everywhere, as a swing does, nothing is left out; so where the
    reading beside the bend is not on its line, for it is late.
    """
    share, channel, names = table_share(recording, target), recording.channels[target], order(recording)
    if names[:1] != ("table_rate",) or not share or len(recording) < 4 * STANDS:
        return ()
    told = recording.channels["table_rate"]
    if told.source != "command" or told.covers != "instant" or channel.covers != "interval":
        return ()
    u = table_rate_of_rows(recording, target, names[:1])
    assert u is not None
    left = channel.values - u * share
    noise = noise_of_steps(np.diff(left))
    bend = np.pad(np.abs(np.diff(told.values * share, 2)), 1)
    sharp = (bend > SHARP * median_filter(bend, AROUND)) & (bend > 8 * SEEN * noise)
    reason, found = "the table's rate bends within this row, and its reading does not tell when", []
    if abs(told.values[1] - told.values[0]) * abs(share) > 8 * SEEN * noise:
        found.append(RejectedRows(target, run, 0, 1, "the table's rate before this row was not read", "ramp"))
    late = 0
    for first, last in stretches(np.asarray(maximum_filter1d(sharp, 3), bool)):
        before, after = slice(max(first - STANDS, 1), first), slice(last, last + STANDS)
        beside = np.concatenate([x - np.median(x) for x in (left[before], left[after]) if len(x)])
        allowed = OFF * noise + AS_ONE * float(np.ptp(u[before.start : after.stop]))
        if np.abs(beside).max(initial=0.0) > allowed:
            late += 1
        else:
            found.append(RejectedRows(target, run, int(first), int(last), reason, "ramp"))
    many = sum(one.stop - one.start for one in found) > MOST_BENT * len(u)
    return () if many or late > len(found) else tuple(found)


def _of_instants(jumps: Floats, off: Floats, noise: float) -> bool:
    """Whether readings within jumps may be such at instants: off by half of one, where means are by nothing."""
    power = float(jumps @ jumps)
    share, sd = (abs(float(off @ jumps)) / power, noise / np.sqrt(power)) if power else (0.0, 0.0)
    return power > 0 and share + SURE * sd > INSTANT
