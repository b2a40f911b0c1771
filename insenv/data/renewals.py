"""A table's channel that was read less often than the rows: held, or on straight lines, between its readings.

An attitude of 15 Hz beside a gyro of 100 Hz is brought to the gyro's rows by who writes the file: each reading is
repeated until the next, or rows between two readings stand on the straight line through them. Neither is how a table
moves. The rate of what is held is a comb, that of straight lines a staircase, and what such a reference leaves of the
motion, -a h^2 / 8 in the middle of a step h, is taken for an error of the instrument. The readings are therefore found
again, where the change from row to row bends or jumps,

    straight    v_i = v_k + (v_k+1 - v_k) (x_i - x_k) / (x_k+1 - x_k)       x the time or the number of the row
    held        v_i = v_k                                                   until x_k+1

and a cubic spline through them, over the same x, stands for the rows. Readings are told from a programme that turns
evenly and from the steps of a coarse encoder by their distance in rows: it is the same nearly everywhere.

A course over ground comes once a second, and so do the steps of many a table. There a gyro tells which it is: of a
table that steps its reading jumps with the angle, or with the slope of its lines, at some lag l,

    g(l) = sum_k J_k (mean over (c_k + l, c_k + l + w] - mean over (c_k + l - w, c_k + l]) / sum_k J_k^2

of jumps J_k at c_k is one, and of a motion that readings were drawn through w / h.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import GAP, Floats, Recording
from insenv.core.series.rounding import EPSILONS, counter_step
from insenv.core.series.stretches import stretches
from insenv.core.series.trajectory import reading_noise

Indices = NDArray[np.int64]

#: Rows between readings, in the median, and the longest time [s]: no programme of a table has shorter dwells.
LEAST_ROWS, MOST_ROWS, LONGEST = 2, 64, 0.5
#: Such a time where a gyro tells that it is none [s]; the windows beside a jump in times between readings, how much of
#: the jumps it reads there if it is one, and the longest lag in such times.
SLOWEST, BESIDE, JUMPS, LAG = 2.5, 0.125, 0.5, 1.0
#: Fewest readings, and rows of a straight line from reading to reading.
FEWEST, STRAIGHT_ROWS = 40, 4
#: A change of the slope is none below this share of the largest one within so many rows, or so many times that of the
#: straightest rows, this share of all: there it is rounding.
STRAIGHT, NEARBY, ROUNDING, STRAIGHTEST = 0.02, 8, 20.0, 0.3
#: Rows around one, the percentage of them that surely lie inside lines, and so many times what those bend by rounding
#: there is no corner; nor is this share of the range from row to row, for files have ten digits or so.
AROUND, INSIDE, LIKE_INSIDE, DIGITS = 33, 35, 3.0, 1e-8
#: Share of the rows on the way that bend by nothing, from which on lines are exactly straight.
EXACT = 0.6
#: By so many steps of a file's digits rounded lines bend; rows on the way change, and corners bend, by more.
ROUNDED_LINES, CLEAR = 2.5, 10.0
#: Which of the bends that are any is the least one, how far others are from its multiples as a share of it, how many
#: are no further, and up to which multiple they are looked at: then it is a step of digits.
LEAST, OFF, MULTIPLES, FAR = 0.01, 0.05, 0.9, 20.0
#: Share of a step by which stamps of an even clock are off by rounding.
ROUNDED = 0.02
#: Share of the readings after less than three times the usual number of rows; of these 90 % lie within as many rows as
#: are usual, and no earlier than at this share of them.
REGULAR, EARLIEST = 0.75, 0.4
#: Rows between the 5 and 95 % quantiles of their distances up to which readings are even.
EVEN = 2.0
#: Share of the distances that are the usual one, to a row or this share of it, from which on others do not matter.
ALIKE, WITHIN = 0.6, 0.15
#: Share of the jumps of a held value that are hardly larger than the smallest, up to which it is no coarse encoder's.
SMALLEST = 0.5
#: Share of the jumps of several counts that stand alone where a value is held.
MOSTLY = 0.9
#: Share of the bends that are smaller than one count; counts from row to row by which most bends are less where they
#: are those of an encoder.
RARE, FEW_COUNTS = 0.05, 2.5
#: Noise of readings as a share of the largest from which on a rate that was held was measured: what swings at a tenth
#: of the readings' rate seems to have 0.002.
MEASURED = 0.004
#: Share of the corners of straight lines that one row or two have, and of all rows that are beside corners at most;
#: share of the corners up to which a value may stand on both sides of them, as one that is held does.
SHARP, MOST_BENT, STANDS = 0.75, 0.7, 0.5


@dataclass(frozen=True)
class Renewals:
    """The readings behind a channel.

    Attributes
    ----------
    values : ndarray, shape (n,)
        What the channel is at the rows, on a smooth curve through the readings.
    period : float
        Median time from reading to reading [s].
    held : bool
        Whether the channel held its readings, and did not go straight from one to the next.
    at, jumps : ndarray, shape (readings,)
        When they were taken [s], and by how much the channel, or the slope of its lines, changed there.
    """

    values: Floats
    period: float
    held: bool
    at: Floats
    jumps: Floats


def with_renewals(recording: Recording, stamps: Floats | None = None) -> Recording:
    """The recording with its table's channels on smooth curves through their readings, where rows were not read.

    ``stamps`` are the rows' times as the file has them [s], over which lines that a gyro tells may have been drawn.
    """
    for name in ("table_angle", "table_rate"):
        channel = recording.channels.get(name)
        if channel is None or channel.source in ("command", "set"):
            continue
        found = renewals(recording.t, channel.values)
        if found is None and name == "table_angle":
            slow = renewals(recording.t, channel.values, stamps, SLOWEST)
            found = None if slow is None or _steps(recording, slow) else slow
        if found is not None:
            how = "held between its readings" if found.held else "on straight lines between its readings"
            text = f"{name} is {how}, every {found.period:.3g} s: taken on a smooth curve through them"
            measured = name == "table_rate" and found.held and _was_measured(channel.values)
            source = channel.source or ("encoder" if measured else None)
            shown = replace(channel, values=found.values, every=found.period, source=source)
            channels = {**recording.channels, name: shown}
            recording = replace(recording, channels=channels, notes=(*recording.notes, text))
    return recording


def _was_measured(values: Floats) -> bool:
    """Whether the readings of a rate that was held, as that of wheels, have noise; a curve through them shows none."""
    readings = values[1 + np.flatnonzero(np.diff(values))]
    return len(readings) >= FEWEST and reading_noise(readings) > MEASURED * float(np.abs(readings).max())


def renewals(t: Floats, values: Floats, stamps: Floats | None = None, longest: float = LONGEST) -> Renewals | None:
    """The readings behind a channel that was read less often than the rows; None where every row was read.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Times of the rows [s], increasing.
    values : ndarray, shape (n,)
    stamps : ndarray, shape (n,), optional
        Their times as the file has them, before a clock mended them [s].
    longest : float
        Longest time from reading to reading [s].
    """
    if len(t) < 2 * FEWEST or not np.any(np.diff(values)):
        return None
    rows = np.arange(float(len(t)))
    jumps = 1 + np.flatnonzero(np.diff(values))
    usual, even = _usual(_telling(values, jumps), t, longest)
    if usual >= LEAST_ROWS:
        at = _filled(jumps, usual, len(t))
        # What is held at first was read before the first row.
        first = max(1, -(-int(jumps[0]) // usual))
        before = t[jumps[0]] - _period(t, usual) * np.arange(first, 0, -1.0)
        when, readings = np.append(before, t[at]), np.append(np.full(first, values[0]), values[at])
        curve, steps = _through(when, readings, t, even and longest <= LONGEST), np.diff(values)[jumps - 1]
        return Renewals(curve, _period(t, usual), True, t[jumps], steps)
    over = [(_clock(t), _clock(t)), (rows, rows)]
    if stamps is not None and np.all(np.diff(stamps) > 0):
        over.append((stamps, t))
    lines = [(x, on, *_corners(x, values)) for x, on in over]
    for x, on, corners, meet, heights, exact in sorted(lines, key=lambda each: not each[-1]):
        usual, even = _usual(corners, t, longest, exact)
        if usual >= STRAIGHT_ROWS and (exact or longest <= LONGEST):
            place, heights = _with_lines(x, values, meet, heights, usual)
            slope = np.diff(values) / np.diff(t)
            bends = slope[np.minimum(corners + 1, len(slope) - 1)] - slope[corners - 1]
            curve = _through(place, heights, on, even and longest <= LONGEST)
            return Renewals(curve, _period(t, usual), False, np.interp(meet, x, t), bends)
    return None


def _steps(recording: Recording, found: Renewals) -> bool:
    """Whether a gyro reads jumps where readings of an angle were taken, or where there is none that could."""
    t = recording.t
    gyros = [c.values for name, c in recording.channels.items() if name.partition("_")[0] == "gyro"]
    return not gyros or any(_jumps_at(t, gyro, found) > JUMPS for gyro in gyros)


def _jumps_at(t: Floats, gyro: Floats, found: Renewals) -> float:
    """The largest g(l), of either sign."""
    series = np.concatenate([[0.0], np.cumsum((gyro[1:] + gyro[:-1]) / 2 * np.diff(t))]) if found.held else gyro
    total = np.concatenate([[0.0], np.cumsum((series[1:] + series[:-1]) / 2 * np.diff(t))])
    width = max(BESIDE * found.period, 2 * float(np.median(np.diff(t))))
    power = max(float(found.jumps @ found.jumps), 1e-300)

    def read(lag: float) -> float:
        before, here, after = (np.interp(found.at + lag + far, t, total) for far in (-width, 0.0, width))
        return float(found.jumps @ (after - 2 * here + before)) / (width * power)

    lags = np.arange(-LAG * found.period, LAG * found.period + width / 2, width / 2)
    return max(abs(read(float(lag))) for lag in lags)


def _clock(t: Floats) -> Floats:
    """Times, without their rounding where they are an even clock's, shape (n,): their last digits would bend lines."""
    steps = np.diff(t) / np.median(np.diff(t))
    whole = np.rint(steps)
    if np.all(np.abs(steps - whole) < ROUNDED * np.maximum(whole, 1.0)):
        return np.concatenate([[0.0], np.cumsum(whole)])
    return t


def _period(t: Floats, usual: int) -> float:
    return usual * float(np.mean(np.diff(t)[np.diff(t) <= GAP * np.median(np.diff(t))]))


def _usual(at: Indices, t: Floats, longest: float, exact: bool = False) -> tuple[int, bool]:
    """Rows from reading to reading, of readings at rows ``at``, and whether all are as far apart; 0: none is usual.

    Between ``exact`` lines they may be any: what has no noise to the last digit was not read there.
    """
    if len(at) < FEWEST:
        return 0, False
    gaps = np.diff(at)
    usual = float(np.median(gaps))
    own = gaps[gaps <= 3 * usual]
    low, high = np.quantile(own, (0.05, 0.95))
    regular = high - low <= max(1.0, usual) and low >= max(EARLIEST * usual, 2.0)
    # A link that lost some, and corners that its noise makes: most distances are the same all the same.
    alike = np.mean(np.abs(gaps - usual) <= max(1.0, WITHIN * usual)) >= ALIKE
    regular |= usual >= STRAIGHT_ROWS and (alike or exact)
    if len(own) < REGULAR * len(gaps) or not regular or _period(t, round(usual)) > longest:
        return 0, False
    if longest <= LONGEST and usual > MOST_ROWS:
        return 0, False
    return round(usual), bool(high - low <= EVEN)


def _telling(values: Floats, jumps: Indices) -> Indices:
    """Of rows at which a value jumps those that tell how often it was read: none of a coarse encoder's.

    Where a table hardly turns its encoder goes by single counts, however often it is read: a jump of several, with rows
    on both sides that stand, is no count.
    """
    step = np.abs(np.diff(values))
    if not _coarse(step[jumps - 1]):
        return jumps
    large = jumps[step[jumps - 1] > FEW_COUNTS * step[jumps - 1].min()]
    inner = large[(large > 1) & (large < len(step))]
    stands = (step[inner - 2] == 0) & (step[inner] == 0)
    return inner if len(inner) and np.mean(stands) > MOSTLY else np.empty(0, np.int64)


def _coarse(jumps: Floats) -> bool:
    """Whether jumps are the steps of a coarse encoder: most of them the smallest that there is."""
    return bool(np.mean(jumps < 1.5 * jumps.min()) > SMALLEST)


def _counts(x: Floats, values: Floats, bends: Floats) -> bool:
    """Whether bends are those of an encoder's counts, which go up and down by one or two at a steady rate."""
    few = float(np.median(bends)) * float(np.median(np.diff(x))) < FEW_COUNTS * counter_step(values)
    # Over a lost row a count bends by a part of one.
    return few or bool(np.mean(bends < 1.5 * np.quantile(bends, RARE)) > SMALLEST)


def _corners(x: Floats, values: Floats) -> tuple[Indices, Floats, Floats, bool]:
    """Rows at which straight lines meet, where over ``x`` and how high they do, and whether they are exactly straight.

    Rows on which a table stands are no line that anybody drew, nor are those on which it turns by as many counts of its
    encoder, now and then by one more, nor a value that stands, jumps and stands.
    """
    from scipy.ndimage import maximum_filter1d, percentile_filter  # slow to import

    slope = np.diff(values) / np.diff(x)
    bend = np.abs(np.diff(slope))
    step = _digits(values) * (1.0 / np.diff(x)[1:] + 1.0 / np.diff(x)[:-1]) / 2.0
    bend[bend < DIGITS * np.ptp(values) / np.median(np.diff(x))] = 0.0
    bend[bend < ROUNDED_LINES * step] = 0.0
    near = maximum_filter1d(bend, 2 * NEARBY + 1, mode="nearest")
    bent = (bend > STRAIGHT * near) & (bend > ROUNDING * float(np.quantile(bend, STRAIGHTEST)))
    if np.mean(bent) <= MOST_BENT:
        bent &= bend > LIKE_INSIDE * percentile_filter(bend, INSIDE, AROUND)
    groups = stretches(bent)
    if not groups or _counts(x, values, bend[bent]) or np.mean([b - a <= 2 for a, b in groups]) < SHARP:
        return np.empty(0, np.int64), np.empty(0), np.empty(0), False
    if np.mean([slope[a] == 0 == slope[min(b, len(slope) - 1)] for a, b in groups]) > STANDS:
        return np.empty(0, np.int64), np.empty(0), np.empty(0), False
    moved = np.abs(slope[1:]) > CLEAR * step
    clear = np.median([(bend[a:b] - CLEAR * step[a:b]).max() for a, b in groups]) > 0
    exact = bool(clear and moved.any() and np.mean(bend[moved] == 0) > EXACT)
    rows, at, readings = [], [], []
    for a, b in groups:
        # Bend i is at row i + 1; two bent rows have the corner between them, where the lines on both sides meet.
        one, other = a + 1, b
        place, before, after = float(x[one]), slope[a], slope[min(b, len(slope) - 1)]
        if b - a == 2 and after != before:
            meet = (values[other] - after * x[other] - values[one] + before * x[one]) / (before - after)
            place = float(np.clip(meet, x[one], x[other]))
        rows.append(one)
        at.append(place)
        readings.append(values[one] + before * (place - x[one]))
    return np.array(rows), np.array(at), np.array(readings), exact


def _digits(values: Floats) -> float:
    """The step of a file's digits, of which nearly all small second differences are multiples; 0 where none shows."""
    bends = np.abs(np.diff(values, 2))
    bends = bends[bends > EPSILONS * np.spacing(np.abs(values).max())]
    if not len(bends):
        return 0.0
    step = float(np.quantile(bends, LEAST))
    near = bends[bends < FAR * step] / step
    return step if float(np.mean(np.abs(near - np.rint(near)) < OFF)) > MULTIPLES else 0.0


def _filled(at: Indices, usual: int, n: int) -> Indices:
    """Rows of readings, with those in between that read the same again."""
    ends = np.append(at[1:], n)
    each = [np.arange(a, max(b - usual // 2, a + 1), usual) for a, b in zip(at, ends, strict=True)]
    return np.concatenate(each)


def _with_lines(x: Floats, values: Floats, at: Floats, readings: Floats, usual: int) -> tuple[Floats, Floats]:
    """Readings with the first and the last row, and with points on lines that are longer than usual."""
    place = np.concatenate([x[:1], at[(at > x[0]) & (at < x[-1])], x[-1:]])
    height = np.concatenate([values[:1], readings[(at > x[0]) & (at < x[-1])], values[-1:]])
    step = usual * float(np.median(np.diff(x)))
    parts = np.maximum(1, np.rint(np.diff(place) / step)).astype(int)
    share = np.concatenate([np.arange(k) / k for k in parts] + [[0.0]])
    first = np.append(np.repeat(np.arange(len(parts)), parts), len(parts))
    return np.interp(first + share, np.arange(float(len(place))), place), np.interp(
        first + share, np.arange(float(len(place))), height
    )


def _through(at: Floats, readings: Floats, x: Floats, even: bool) -> Floats:
    """Cubic spline through readings.

    Readings that follow each other unevenly have stamps with errors, which a spline through all of them would make
    larger: it is as smooth as generalised cross-validation says.
    """
    from scipy.interpolate import CubicSpline, make_smoothing_spline  # slow to import

    size = float(np.median(np.diff(at)))
    curve = CubicSpline(at / size, readings) if even else make_smoothing_spline(at / size, readings)
    return np.asarray(curve(x / size))
