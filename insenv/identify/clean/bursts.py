"""Bursts and settling of an instrument at rest: events, not laws.

Somebody touches the bench, a lorry passes, a spring settles: for some seconds up to half a minute the channels of a
triad leave their level together and come back. No law of the instrument foretells the next one. Of means over
stretches of 2, 4, ... seconds of a channel x, with a and b the means before and after the stretch,

    d = the smaller of x - a and x - b where both have one sign, else 0

is what comes and goes; a step or a drift moves one side along, so that d has its noise alone. A stretch is a burst
where d is beyond `FAR` robust deviations on one channel of the triad, and then on each other one where it is beyond
`BESIDE`. At the very start, where there is no before, what has ended within `START` of the run is settling.

Of a reading that hardly ever changes, rounded to a step far above its noise, less than half that step is no departure.

A base that tilts, as the gyros show, moves an accelerometer in bursts too: that has a cause, and is searched for.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, median_filter

from insenv.core.recording import Floats, Recording
from insenv.core.series.robust import robust_deviation
from insenv.core.series.rounding import rounding
from insenv.core.series.stretches import stretches
from insenv.data.exposure import expose, has_table
from insenv.identify.clean.outliers import leaving_out
from insenv.identify.findings import RejectedRows

Mask = NDArray[np.bool_]

#: Length of the means that are looked at [s], and the longest burst, as a share of the run and in seconds.
SECOND, LONGEST_SHARE, LONGEST = 1.0, 0.08, 64.0
#: Robust deviations from which one channel shows a burst, and from which another one shows the same.
FAR, BESIDE = 7.0, 3.0
#: Share of the run within which what settles at its start has ended, and the share of it that may then be left.
START, ENDED = 0.06, 0.2
#: Largest share of a run that bursts take: more of them are how the instrument is.
MOST = 0.15
#: Means by which a burst is grown at most on each side, while it is more than this share of its size off; means
#: beyond them that show the level.
GROWN, TAIL, REACH = 12, 0.25, 20
#: Share of the power that the tilt of a base that moves leaves at most.
EXPLAINED = 0.5
#: Range of the temperature from which it is driven [K].
KELVINS = 5.0
#: Share of rows that repeat the one before, from which noise no longer carries means beyond the rounding.
STANDING = 0.8
#: Fewest means of a run.
FEWEST = 120


@dataclass(frozen=True)
class Burst:
    """Rows ``[start, stop)`` of a run in which ``target`` left its level by ``size`` and came back."""

    run: int
    start: int
    stop: int
    size: float
    settling: bool


def without_bursts(
    recordings: tuple[Recording, ...], target: str
) -> tuple[tuple[Recording, ...], tuple[RejectedRows, ...]]:
    """The recordings with the bursts of ``target`` left out, and those rows; as they are where a table turns."""
    cleaned, rejected = [], []
    for run, recording in enumerate(recordings):
        found = bursts(recording, target, run)
        mask = np.zeros(len(recording), bool)
        for one in found:
            mask[one.start : one.stop] = True
        cleaned.append(leaving_out(recording, target, mask) if found else recording)
        rejected += [_rows(one, recording, target) for one in found]
    return tuple(cleaned), tuple(rejected)


def _rows(one: Burst, recording: Recording, target: str) -> RejectedRows:
    what = "settling at the start" if one.settling else "burst"
    return RejectedRows(target, one.run, one.start, one.stop, what, "burst", one.size)


def bursts(recording: Recording, target: str, run: int = 0) -> tuple[Burst, ...]:
    """Bursts of ``target``, in order of time; found on all channels of its triad together."""
    if has_table(recording) or recording.mounting.table_axis:
        return ()
    per_mean = max(1, int(round(SECOND / recording.dt)))
    if len(recording) // per_mean < FEWEST or _soaked(recording):
        return ()
    family = [n for n in recording.channels if n == target or _alike(n, target)]
    series = {name: _series(recording, name, per_mean) for name in family}
    least = {name: _least(recording.channels[name].values) for name in family}
    away = {name: _away(values, known, least[name]) for name, (values, known) in series.items()}
    hit = np.zeros(len(series[target][0]), bool)
    clear = [(far, start, stop, name) for name in family for start, stop, far in away[name] if far >= FAR]
    # The stretch that shows it best is the burst; longer ones around it show it too.
    for _, start, stop, name in sorted(clear, reverse=True):
        if not hit[start:stop].any() and (name == target or _beside(away[target], start, stop)):
            hit[start:stop] = True
    values = median_filter(series[target][0], size=3, mode="nearest")
    for a, b in stretches(hit):
        hit[slice(*_grown(values, a, b))] = True
    seen = [_burst(values, a, b, run, per_mean, len(recording)) for a, b in stretches(hit)]
    found = tuple(one for one in seen if one.size)  # a few means off a level without scatter are none
    return found if sum(one.stop - one.start for one in found) <= MOST * len(recording) else ()


def _burst(values: Floats, a: int, b: int, run: int, per_mean: int, rows: int) -> Burst:
    off = values[a:b] - _level(values, a, b)
    start = 0 if a == 0 else a * per_mean
    return Burst(run, start, min(rows, b * per_mean), float(off[np.argmax(np.abs(off))]), a == 0)


def _level(values: Floats, a: int, b: int) -> float:
    """Level beside a stretch."""
    beside = np.concatenate([values[max(0, a - REACH - GROWN) : max(0, a - GROWN)], values[b + GROWN :][:REACH]])
    return float(np.median(beside if len(beside) else values))


def _grown(values: Floats, a: int, b: int) -> tuple[int, int]:
    """The stretch with what beside it has not come back yet."""
    off = values - _level(values, a, b)
    least = TAIL * float(np.median(off[a:b]))
    first, last = max(0, a - GROWN), min(len(values), b + GROWN)
    while a > first and off[a - 1] * np.sign(least) > abs(least):
        a -= 1
    while b < last and off[b] * np.sign(least) > abs(least):
        b += 1
    return max(0, a - 1), min(len(values), b + 1)


def _soaked(recording: Recording) -> bool:
    """Whether the temperature is driven: what comes and goes with it has a cause."""
    kelvins = recording.channels.get("temperature")
    return kelvins is not None and float(np.ptp(kelvins.values)) > KELVINS


def _alike(name: str, target: str) -> bool:
    return "_" in target and name.partition("_")[0] == target.partition("_")[0]


def _beside(away: list[tuple[int, int, float]], start: int, stop: int) -> bool:
    return any(far >= BESIDE and a < stop and b > start for a, b, far in away)


def _series(recording: Recording, name: str, per_mean: int) -> tuple[Floats, Mask]:
    """Means of a channel, and which of them are to be judged: none where the base tilts."""
    exposure = expose(recording, name, per_mean)
    known = exposure.count > 0.5 * per_mean
    values = np.interp(np.arange(len(known)), np.flatnonzero(known), exposure.y[known])
    tilt = exposure.motion.base_tilt
    if tilt is not None:
        known &= not _tilts(values, tilt)
    return values, known


def _tilts(values: Floats, tilt: Floats) -> bool:
    """Whether most of the values follow the tilt that the gyros show; integrated gyro noise alone is no tilt."""
    t = np.linspace(-1.0, 1.0, len(values))
    trend = np.column_stack([np.ones_like(t), t, t**2])
    rest, shape = (x - trend @ np.linalg.lstsq(trend, x, rcond=None)[0] for x in (values, tilt))
    power = float(shape @ shape)
    share = float(rest @ shape) / power if power > 0 else 0.0
    without = rest - share * shape
    return bool(without @ without < EXPLAINED * (rest @ rest))


def _away(values: Floats, known: Mask, least: float) -> list[tuple[int, int, float]]:
    """Stretches in which the values leave their level by more than ``least`` and come back: start, stop, deviations."""
    n = len(values)
    total = np.concatenate([[0.0], np.cumsum(values)])
    found: list[tuple[int, int, float]] = []
    for length, side in _lengths(n):
        at = np.arange(side, n - side - length + 1)
        inside = (total[at + length] - total[at]) / length
        before = (total[at] - total[at - side]) / side
        after = (total[at + length + side] - total[at + length]) / side
        a, b = inside - before, inside - after
        d = np.where(np.sign(a) == np.sign(b), np.sign(a) * np.minimum(np.abs(a), np.abs(b)), 0.0)
        noise = robust_deviation(0.5 * (a + b))
        if noise > 0:
            tops = [i for i in _tops(np.abs(d), length) if abs(d[i]) > least]
            found += [(int(at[i]), int(at[i]) + length, float(abs(d[i]) / noise)) for i in tops]
            found += _settling(total, length, side, max(noise, least / FAR))
    return [one for one in found if known[one[0] : one[1]].any()]


def _least(values: Floats) -> float:
    """Half of the step to which values were rounded, if most of them are as the one before."""
    return 0.5 * rounding(values) if np.mean(np.diff(values) == 0) > STANDING else 0.0


def _lengths(n: int) -> Iterator[tuple[int, int]]:
    """Lengths of the stretches of ``n`` means that are looked at, and of those beside them."""
    length = 2
    while length <= min(LONGEST / SECOND, LONGEST_SHARE * n):
        yield length, min(2 * length, 20 + length)
        length = int(np.ceil(1.5 * length))


def settling_curve(time: Floats, curve: Floats) -> bool:
    """Whether a ``curve`` at instants ``time`` [s], both of shape (n,), would be taken for settling at the start."""
    seconds = np.arange(time[0], time[-1], SECOND)
    total = np.concatenate([[0.0], np.cumsum(np.interp(seconds, time, curve))])
    n = len(seconds)
    return any(_settling(total, length, side, 1.0) for length, side in _lengths(n))


def _settling(total: Floats, length: int, side: int, noise: float) -> list[tuple[int, int, float]]:
    """The start of the run, if it leaves the level after it and has ended."""
    n = len(total) - 1
    if length > START * n or length + 4 * side > n:
        return []
    first = total[length] / length
    near = (total[length + side] - total[length]) / side
    far = (total[length + 4 * side] - total[length + side]) / (3 * side)
    return [(0, length, abs(first - far) / noise)] if abs(near - far) < ENDED * abs(first - far) else []


def _tops(size: Floats, length: int) -> list[int]:
    """Where ``size`` is the largest within ``length`` on both sides."""
    return np.flatnonzero((size > 0) & (size == maximum_filter1d(size, 2 * length + 1))).tolist()
