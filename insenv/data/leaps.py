"""Rows in which a table's reading leaps and no instrument turns along: a counter that was set anew, a lost word.

    |d_i| > 5 max(q, d'),        |sum of three y dt beside i, less their median| < 0.3 |d_i|

with d_i the step of the angle from row to row, or a rate that was measured, q the size that 99 % of them do not exceed,
d' the fifth largest beside i, and y a gyro that follows the table elsewhere. A step of 50 rad in 15 ms is no motion. As
the largest in the file it alone would say what the gain is, 0.000 +- 0.0001. The step of such a row is taken from those
beside it; where it leaps away and back, the rows on both sides stand as they are.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import GAP, Floats, Recording
from insenv.core.series.stretches import stretches

#: How much larger than others a leap is, the quantile that is usual, and rows on either side that are looked at.
LARGER, USUAL, BESIDE = 5.0, 0.99, 8
#: Share of a leap that an instrument reads of one that is motion; least share of the motion that it reads elsewhere.
READ, FOLLOWS = 0.3, 0.3
#: Most rows that one failure of a reading lasts: it leaps away and back again.
FAILED = 3
#: Steps of the time up to this quantile are how uneven rows are: beside longer ones only is a gap.
COMMON = 0.95
#: Fewest steps, and the largest share of them that may be leaps.
FEWEST, MOST = 64, 0.005


def without_leaps(recording: Recording) -> Recording:
    """The recording with leaps of its table's angle, or of a rate that was measured, taken out, and a note of them."""
    for name in ("table_angle", "table_rate"):
        channel = recording.channels.get(name)
        of_angle = name == "table_angle"
        if channel is None or (channel.source != "encoder" and (channel.source or not of_angle)):
            continue  # of a command a pulse is a pulse
        steps = np.diff(channel.values) if of_angle else channel.values * recording.dt
        leaps = found(recording, steps, of_angle)
        if not leaps.any():
            continue
        rows = np.flatnonzero(~leaps)
        sound = np.interp(np.arange(len(steps)), rows, steps[rows])
        if of_angle:
            sound = _returning(steps, leaps, sound)
        values = (
            np.append(channel.values[:1], channel.values[0] + np.cumsum(sound)) if of_angle else sound / recording.dt
        )
        first = int(np.argmax(leaps))
        many = f"in {int(leaps.sum())} rows, first " if leaps.sum() > 1 else ""
        size = np.rad2deg(steps[first])
        text = (
            f"{name} leaps {many}by {size:.4g} deg between rows {first} and {first + 1}, and no gyro turns along: "
            "taken out"
        )
        channels = {**recording.channels, name: replace(channel, values=values)}
        recording = replace(recording, channels=channels, notes=(*recording.notes, text))
    return recording


def _returning(steps: Floats, leaps: NDArray[np.bool_], sound: Floats) -> Floats:
    """The steps with those of a wrong reading between sound ones, away and back, made the motion between these."""
    sound, most = sound.copy(), float(np.abs(steps[~leaps]).max())
    for a, b in stretches(leaps):
        total = float(steps[a:b].sum())
        if b - a > 1 and abs(total) <= (b - a) * most:
            sound[a:b] = total / (b - a)
    return sound


def found(recording: Recording, steps: Floats, between: bool) -> NDArray[np.bool_]:
    """Steps that are leaps, shape (n,): ``between`` the rows, or of each row.

    Parameters
    ----------
    recording : Recording
    steps : ndarray, shape (n,)
        By what the angle changes [rad].
    between : bool
        Whether step i is that from row i to the next, n one less than the rows.
    """
    from scipy.ndimage import maximum_filter1d, median_filter, rank_filter, uniform_filter1d  # slow to import

    none = np.zeros(len(steps), bool)
    size = np.abs(steps)
    if len(steps) < FEWEST or not size.any():
        return none
    took = np.append(np.diff(recording.t), recording.dt)[: len(steps)]
    gaps = took > GAP * max(recording.dt, float(np.quantile(took, COMMON)))
    width = 2 * BESIDE + 1
    # Two wrong readings leap away and back each: the fifth largest of those beside them.
    others = rank_filter(size, -5, width, mode="constant")
    usual = LARGER * float(np.quantile(size, USUAL))
    large = size > np.maximum(LARGER * others, usual)
    leaps = large & ~gaps
    if not leaps.any() or leaps.mean() > MOST:
        return none
    gyros = [c.values for name, c in recording.channels.items() if name.startswith("gyro")]
    turned = [(0.5 * (y[1:] + y[:-1]) if between else y) * recording.dt for y in gyros]
    # One step that is no motion, and stands too near to others to be told, has more power than all motion.
    sound = (size <= usual) & ~gaps
    along = [y for y in turned if _follows(*(_sums(np.where(sound, x, 0.0), width) for x in (y, steps)))]
    if not along:
        return none
    for y in along:
        more = y - median_filter(y, 2 * width + 1, mode="nearest")
        leaps &= maximum_filter1d(3 * np.abs(uniform_filter1d(more, 3, mode="nearest")), width) < READ * size
    return leaps | _away_or_back(steps, leaps, large & gaps, usual / LARGER) if between else leaps


def _away_or_back(steps: Floats, leaps: NDArray[np.bool_], late: NDArray[np.bool_], usual: float) -> NDArray[np.bool_]:
    """Large steps after a gap that a leap takes back, or which take one back: a reading that failed came late."""
    also = np.zeros_like(leaps)
    for i in np.flatnonzero(late).tolist():
        for j in range(max(i - FAILED, 0), min(i + FAILED + 1, len(steps))):
            a, b = min(i, j), max(i, j) + 1
            also[i] |= bool(leaps[j]) and abs(float(steps[a:b].sum())) <= (b - a) * usual
    return also


def _sums(x: Floats, count: int) -> Floats:
    """Sums over so many steps each: an angle that is held for four rows turns within one of them alone."""
    sums: Floats = x[: len(x) // count * count].reshape(-1, count).sum(axis=1)
    return sums


def _follows(turned: Floats, steps: Floats) -> bool:
    """Whether an instrument reads a good share of the motion."""
    x = steps - steps.mean() if np.ptp(steps) > 0 else steps
    power = float(x @ x)
    return power > 0 and abs(float(x @ turned)) > FOLLOWS * power
