r"""Whether a reading goes one way while the unit rests: it drifts, warms up, or creeps after each turn.

    d_k = mean of the second half of rest k - mean of its first half,      t = mean(d) sqrt(K) / sd(d)

Student's t on K - 1 degrees for each axis. The scatter of d over rests holds the noise within them, whatever it is, and
hands and turns that leave the unit as they may. A hand on one rest hides it there: rests that go one way by themselves,
beyond doubt, by the line through their parts, count too where most do. Means of rests do not tell it, and what they
leave is taken for noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import stdtr

from insenv.core.recording import Floats, Recording
from insenv.identify.positions.model import AXES
from insenv.identify.positions.rests import Rest

#: Fewest rests, and share of a rest that is left out at either end, where hands come and go.
FEWEST, ENDS = 4, 0.1
#: Probability by chance, all axes paid for, below which it is said, and what no means of rests notice [m/s^2].
CHANCE, LEAST = 1e-4, 2e-4
#: Parts of a rest, deviations by which one goes one way by itself, and how many must where there are as many.
PARTS, SURE, MANY = 8, 5.0, 6


def creeping(recordings: Sequence[Recording], rests: Sequence[Rest]) -> tuple[str, ...]:
    """A reason why means of rests are not all that they tell, of the axis that goes farthest; empty where none does."""
    spans = _whole(rests)
    if len(spans) < FEWEST:
        return ()
    changes = {axis: _changes(recordings, spans, axis) for axis in AXES}
    there = {axis: d for axis, (d, z) in changes.items() if abs(np.median(d)) > LEAST and _one_way(d, z)}
    if not there:
        return ()
    axis = max(there, key=lambda one: abs(np.median(there[one])))
    change = 1e3 * float(np.median(there[axis]))
    return (
        f"accel_{axis} reads {change:+.2g} mm/s^2 in the second half of a rest beside the first, in {len(spans)} rests:"
        " it drifts, warms up or creeps after each turn, and means of rests do not tell which",
    )


def _whole(rests: Sequence[Rest]) -> list[tuple[int, slice]]:
    """Run and rows of each rest, its parts together, without its ends."""
    spans = []
    for number in dict.fromkeys(rest.number for rest in rests):
        own = [rest for rest in rests if rest.number == number]
        start, stop = min(r.start for r in own), max(r.stop for r in own)
        ends = int(ENDS * (stop - start))
        if stop - start - 2 * ends >= 2 * PARTS:
            spans.append((own[0].run, slice(start + ends, stop - ends)))
    return spans


def _changes(recordings: Sequence[Recording], spans: Sequence[tuple[int, slice]], axis: str) -> tuple[Floats, Floats]:
    """By how much the second half of each rest reads more than the first, and slopes in their deviations: (rests,)."""
    halves, slopes = [], []
    for run, rows in spans:
        parts = np.array(
            [p.mean() for p in np.array_split(recordings[run].channels[f"accel_{axis}"].values[rows], PARTS)]
        )
        x = np.arange(PARTS) - (PARTS - 1) / 2
        slope = float(x @ parts / (x @ x))
        left = parts - parts.mean() - slope * x
        halves.append(float(parts[PARTS // 2 :].mean() - parts[: PARTS // 2].mean()))
        slopes.append(slope / max(float(np.sqrt(left @ left / (PARTS - 2) / (x @ x))), 1e-300))
    return np.array(halves), np.array(slopes)


def _one_way(change: Floats, slopes: Floats) -> bool:
    """Whether rests go one way: by their scatter, or half of them and more by itself each and none the other way."""
    clear = np.sign(slopes[np.abs(slopes) > SURE])
    if len(clear) >= max(min(MANY, len(slopes)), len(slopes) / 2) and abs(clear.sum()) == len(clear):
        return True
    sd = float(change.std(ddof=1))
    t = abs(float(change.mean())) * np.sqrt(len(change)) / sd if sd else 0.0
    return bool(2 * len(AXES) * stdtr(len(change) - 1, -t) < CHANCE)
