"""Knocks: moments in which an instrument at rest is much louder than in the rest of its run.

Somebody touches the table, a motor starts, the unit is put down at the very start: for a second a channel rings. Single
rows of that are outliers (`insenv.identify.clean.outliers`); the others are within the noise of no other second, and
with them in the fit the noise is louder and slower than it is, and hides every drift. Of windows of `WINDOW` seconds,
of less in a run that has no `FEWEST` of them, and `ROWS` rows at least, one is a knock where the scatter s about its
mean is beyond `LOUDER` times the median one,

    s^2 > LOUDER^2 max(median s^2, q^2 / 4),      q the step to which readings are rounded,

and so are those beside it that ring on, beyond `RINGS` times. White noise is so loud never, and a step only in the one
in which it happens. What the two others of a triad show at once is a knock on the third as well; what shakes the
other triad may be what moves a bias, and is none. What lasts longer than `LONGEST` of a run and no longer than
`LASTING` is an event that is left out as the bursts of means are (`insenv.identify.clean.bursts`): something shook the
bench for seconds. Where knocks are more than `MOST` of the rows, and these with them more than `EVENTS`, or one lasts
longer, that is how the unit is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_propagation

from insenv.core.recording import Recording
from insenv.core.series.rounding import rounding
from insenv.core.series.stretches import stretches
from insenv.data.exposure import has_table
from insenv.identify.findings import RejectedRows

#: Length of a window [s], and its fewest rows; fewest windows of a run.
WINDOW, ROWS, FEWEST = 0.5, 12, 40
#: Times the median scatter from which on a window is a knock, and from which on its neighbours ring.
LOUDER, RINGS = 4.0, 2.0
#: Largest share of the rows that knocks are, and that one of them is; that one which lasts is, and all together.
MOST, LONGEST = 0.05, 0.04
LASTING, EVENTS = 0.1, 0.15


def knocks(recording: Recording, target: str, run: int = 0) -> tuple[RejectedRows, ...]:
    """Rows in which ``target`` rings, in order of time; none where a table turns."""
    if has_table(recording) or recording.mounting.table_axis:
        return ()
    values = recording.channels[target].values
    rows = max(ROWS, min(int(round(WINDOW / recording.dt)), len(values) // FEWEST))
    count = len(values) // rows
    if count < FEWEST:
        return ()
    mask, scatter = _loud(values[: count * rows].reshape(count, rows), rounding(values))
    mask = mask | _of_others(recording, target, count, rows)
    ends = [(start * rows, stop * rows if stop < count else len(values)) for start, stop in stretches(mask)]
    n, brief = len(values), max(LONGEST * len(values), 2 * rows)
    lasting = [(start, stop) for start, stop in ends if brief < stop - start <= max(LASTING * n, 3 * rows)]
    ends = [(start, stop) for start, stop in ends if stop - start <= brief]
    if sum(stop - start for start, stop in ends) > MOST * n:
        ends = []
    if sum(stop - start for start, stop in (*ends, *lasting)) > EVENTS * n:
        lasting = []

    def loud(start: int, stop: int) -> str:
        times = _most(scatter, start, stop, rows)
        return f"{times:.2g} times as loud" if times > LOUDER else "as the other axes show"

    found = [RejectedRows(target, run, start, stop, f"a knock: {loud(start, stop)}") for start, stop in ends]
    found += [
        RejectedRows(target, run, start, stop, f"burst of noise, {loud(start, stop)}", "burst")
        for start, stop in lasting
    ]
    return tuple(sorted(found, key=lambda row: row.start))


def _of_others(recording: Recording, target: str, count: int, rows: int) -> NDArray[np.bool_]:
    """Windows in which the two other axes of the triad of ``target`` have a knock, shape (count,)."""
    names = [f"{target[:-1]}{axis}" for axis in "xyz" if axis != target[-1]]
    if len(names) != 2 or not all(name in recording.channels for name in names):
        return np.zeros(count, bool)
    others = [recording.channels[name].values[: count * rows] for name in names]
    one, other = (_loud(values.reshape(count, rows), rounding(values))[0] for values in others)
    return one & other


def _loud(windows: NDArray[np.float64], step: float) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Which windows, shape (windows, rows), are knocks, and how loud each is beside the median one."""
    scatter = windows.std(axis=1)
    usual = max(float(np.median(scatter)), 0.5 * step)
    times = scatter / usual if usual > 0 else np.zeros(len(scatter))
    return binary_propagation(times > LOUDER, mask=times > RINGS), times


def _most(times: NDArray[np.float64], start: int, stop: int, rows: int) -> float:
    """How loud the loudest of the windows between two rows is."""
    return float(times[start // rows : -(-stop // rows)].max())
