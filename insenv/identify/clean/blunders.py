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
from numpy.typing import NDArray

from insenv.core.recording import Floats, Recording
from insenv.core.series.least_absolute import least_absolute
from insenv.data.reference import points_of
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
    assert name is not None
    x, y = recording.channels[name].values, recording.channels[target].values
    columns = _curve(recording, name)
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
        if _is_alone(x if name != "table_angle" else np.mod(x, 2 * np.pi), left, i, name == "table_angle")
    ]


def _curve(recording: Recording, name: str) -> Floats:
    """Columns that a law of the points may have, as many as the points allow, the plainest first: shape (n, k)."""
    x, n = recording.channels[name].values, len(recording)
    if name == "table_angle":
        law = [wave(order * x) for order in (1, 2) for wave in (np.cos, np.sin)]
    else:
        s = (x - x.mean()) / max(float(np.ptp(x)), 1e-300)
        law = [s, s**2, s**3]
    beside = [recording.channels["temperature"].values] if "temperature" in recording.channels else []
    plain = [column for column in (*beside, recording.t) if column is not x and np.ptp(column)]
    slow = [(column - column.mean()) / np.ptp(column) for column in plain]
    columns = [np.ones(n), *law[:2], *slow, *law[2:]]
    return np.column_stack(columns[: min(MOST_COLUMNS, n // EACH)])


def _is_alone(x: Floats, left: Floats, i: int, round_about: bool) -> bool:
    """Whether no point at the same place, or next to it, is off alike, and the curve goes on on both sides."""
    near = SAME * float(np.ptp(x))
    there: NDArray[np.intp] = np.flatnonzero(np.abs(x - x[i]) <= near)
    others = there[there != i]
    if len(others):
        return not bool(np.any(left[others] / left[i] > ALIKE))
    places = np.unique(x)
    at = int(np.searchsorted(places, x[i]))
    if not round_about and at in (0, len(places) - 1):
        return False
    beside = np.isin(x, (places[at - 1], places[(at + 1) % len(places)]))
    return not bool(np.any(left[beside] / left[i] > ALIKE))
