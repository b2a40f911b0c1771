r"""A point that is far off the curve of the others: a word or a sign that was written wrong, a rate that was not reached.

In a list of points the row before is no neighbour. The readings y are laid against what was set,

    y_i = sum_k b_k p_k(x_i) + e_i,     b = arg min sum_i |e_i|

with p_k the powers of a rate or a temperature, or the waves of an angle, and the time; one that is `FAR` robust deviations
off is left out, where it is alone. Where others at the same x, or next to it on either side, are off alike, it is how
the instrument is, and so it is at an end of what was set, where nothing says how the curve goes on.

Source: P. J. Huber, Robust Statistics (1981), section 7 (least absolute deviations are not pulled).
"""

from __future__ import annotations

import numpy as np

from insenv.core.recording import Floats, Recording
from insenv.core.series.least_absolute import least_absolute
from insenv.core.units import STANDARD_GRAVITY
from insenv.data.reference import ACCELEROMETER_TRIAD, ATTITUDE, points_of
from insenv.identify.findings import RejectedRows

#: Robust deviations by which a point is off: of 11 to 80 points in ten thousand lists without a blunder 1 to 8 has one.
FAR = 10.0
#: Points for each column of the curve, and most columns; points for each that may be off.
EACH, MOST_COLUMNS, ALONE = 4, 6, 20
#: Share of the range of what was set within which points are at one place, and of a deviation that is off alike.
SAME, ALIKE = 0.005, 0.3


def blunders(recording: Recording, target: str, run: int) -> list[RejectedRows]:
    """Rows of a list of points that are off the curve of the others, and alone.

    Parameters
    ----------
    recording : Recording
        Of which each row is a point (`insenv.data.reference.points_of`).
    target : str
    run : int
        Number of the run, counted from 0.
    """
    name = points_of(recording)
    if name is None or (name == ATTITUDE and target.startswith("accel")):
        return []
    columns, y = _curve(recording, name), recording.channels[target].values
    if columns.shape[1] < 2:
        return []
    left = least_absolute(columns, y)[1]
    scale = 1.4826 * float(np.median(np.sort(np.abs(left))[columns.shape[1] :]))
    off = np.flatnonzero(np.abs(left) > FAR * scale)
    if not scale or len(off) > max(1, len(y) // ALONE):
        return []
    return [
        RejectedRows(target, run, i, i + 1, f"{min(abs(left[i]) / scale, 999):.0f} robust deviations off the other points")
        for i in off.tolist()
        if _is_alone(recording, name, left, i)
    ]


def _curve(recording: Recording, name: str) -> Floats:
    """Columns that a law of the points may have, as many as the points allow, the plainest first: shape (n, k)."""
    n = len(recording)
    law = _law(recording, name)
    beside = ["temperature"] if name != "temperature" and "temperature" in recording.channels else []
    plain = [column for column in (*(recording.channels[one].values for one in beside), recording.t) if np.ptp(column)]
    slow = [(column - column.mean()) / np.ptp(column) for column in plain]
    first = 3 if name == ATTITUDE else 2
    columns = [np.ones(n), *law[:first], *slow, *law[first:]]
    return np.column_stack(columns[: min(MOST_COLUMNS, n // EACH)])


def _law(recording: Recording, name: str) -> list[Floats]:
    if name == ATTITUDE:
        return [recording.channels[axis].values / STANDARD_GRAVITY for axis in ACCELEROMETER_TRIAD]
    x = recording.channels[name].values
    if name == "table_angle":
        return [wave(order * x) for order in (1, 2) for wave in (np.cos, np.sin)]
    s = (x - x.mean()) / max(float(np.ptp(x)), 1e-300)
    return [s, s**2, s**3]


def _is_alone(recording: Recording, name: str, left: Floats, i: int) -> bool:
    """Whether no point at the same place, or next to it, is off alike, and the curve goes on on both sides."""
    at = np.column_stack(_law(recording, name)[: {ATTITUDE: 3, "table_angle": 2}.get(name, 1)])
    there = np.linalg.norm(at - at[i], axis=1) <= SAME * float(np.max(np.ptp(at, axis=0)))
    there[i] = False
    if there.any():
        return not bool(np.any(left[there] / left[i] > ALIKE))
    if name == ATTITUDE:
        return True  # of which no two are next to each other
    x = recording.channels[name].values if name != "table_angle" else np.mod(recording.channels[name].values, 2 * np.pi)
    places = np.unique(x)
    place = int(np.searchsorted(places, x[i]))
    if name != "table_angle" and place in (0, len(places) - 1):
        return False
    beside = np.isin(x, (places[place - 1], places[(place + 1) % len(places)]))
    return not bool(np.any(left[beside] / left[i] > ALIKE))
