"""Rows of a target in cells: which cell each is in, its interval, means of cells, and curves between readings.

Cells of ``rows_per_cell`` sampling periods lie on one even grid that runs through gaps. The rows of a target that
``covers`` its interval end at the row's time, those of an instantaneous target are centred on it; a channel's ``delay``
moves it back.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import GAP, Channel, Floats, Recording
from insenv.data.sampling import own_steps

#: Deviations of an angle's reading by which it leaps over rows that are left out or lost.
LEAPS = 6.0
#: Share of a period by which the rows may stand beside the first one's grid, as rounding makes it.
SAME_PHASE = 1e-6
#: Share of a period by which steps differ at most that are even.
EVEN = 1e-6


def cells_of(
    recording: Recording, channel: Channel, rows_per_cell: int, ahead: int = 0
) -> tuple[NDArray[np.int64], float, int]:
    """Cell of each row, start of the first cell [s] and number of cells; the first begins ``ahead`` rows early."""
    dt, covers = recording.dt, channel.covers == "interval"
    middle = recording.t - channel.delay - (0.5 * dt if covers else 0.0)
    first = 1 if covers and len(recording) > 1 else 0
    ticks = (middle - middle[first]) / dt
    phase = float(np.median(ticks - np.rint(ticks)))
    if abs(phase) < SAME_PHASE:
        phase = 0.0  # the first row is where the others are
    index = np.rint(ticks - phase).astype(np.int64) + ahead
    cell = index // rows_per_cell
    if covers:
        # The interval of a piece's first row began before the piece: its references are not known. Of a channel that is
        # later than they are further ones did.
        before = max(1, int(np.ceil((channel.delay - _least_delay(recording)) / dt - SAME_PHASE)) + 1)
        for piece in recording.pieces():
            cell[piece.start : min(piece.start + before, piece.stop)] = -1
    return cell, float(middle[first] + (phase - 0.5 - ahead) * dt), int(cell.max()) + 1


def _least_delay(recording: Recording) -> float:
    """The least delay of the references of a table [s]; 0 without one."""
    names = [name for name in ("table_angle", "table_rate") if name in recording.channels]
    return min((recording.channels[name].delay for name in names), default=0.0)


def means_of_rows(
    values: Floats, cell_of_row: NDArray[np.int64], n: int, covered: Floats | None = None
) -> tuple[NDArray[np.int64], Floats]:
    """Rows per cell and their mean, of rows that cover other times weighted by these; 0 where there is none."""
    # Rows of no cell are counted in a place before the first one: to pick the others costs more than to count all.
    place = np.maximum(cell_of_row, -1) + 1
    count = np.bincount(place, minlength=n + 1)[1:]
    if covered is None:
        return count, np.bincount(place, weights=values, minlength=n + 1)[1:] / np.maximum(count, 1)
    total = np.bincount(place, weights=covered * values, minlength=n + 1)[1:]
    time = np.bincount(place, weights=covered, minlength=n + 1)[1:]
    return count, total / np.where(count > 0, time, 1.0)


def covered_by(recording: Recording, target: str) -> Floats | None:
    """Time that each row of ``target`` covers, in sampling periods, shape (n,); None where that is one period each.

    Rates of uneven rows are what was turned in them over their steps. Of steps that are wrong by s of a period their
    plain mean is 1 + 2 s^2 times too large; weighted by these steps it is what was turned over the time of all. Of
    increments that were taken to cover a period each the plain mean is.
    """
    channel = recording.channel(target)
    if channel.covers != "interval" or channel.by_period or is_even(recording, target):
        return None
    start, end = intervals(recording, target)
    return (end - start) / recording.dt


def interpolated(
    times: Floats, values: Floats, curve: Callable[[Floats, Floats], Callable[[Floats], Floats]] | None = None
) -> Callable[[Floats], Floats]:
    """Linear interpolation, or that by a ``curve``, that goes on with the slope of its ends."""
    between = None if curve is None else curve(times, values)

    def evaluate(x: Floats) -> Floats:
        if between is None:
            inside = np.interp(x, times, values)
        else:
            inside = np.asarray(between(np.clip(x, times[0], times[-1])), np.float64)
        if len(times) < 2:
            return inside
        for end, next_to_it, beyond in ((0, 1, x < times[0]), (-1, -2, x > times[-1])):
            slope = (values[next_to_it] - values[end]) / (times[next_to_it] - times[end])
            inside[beyond] = values[end] + slope * (x[beyond] - times[end])
        return inside

    return evaluate


def without_leaps(times: Floats, rest: Floats, dt: float, noise: float) -> Floats:
    """What a reading has beside the motion, shape (n,) [rad], without what it leaps by where rows are left out or lost.

    Rows are left out where a reference slips as well: then nothing of it belongs to the rows beside.
    """
    change = np.diff(rest)
    leaps = (np.diff(times) > GAP * dt) & (np.abs(change) > LEAPS * noise)
    return np.append(0.0, np.cumsum(np.where(leaps, 0.0, change)))


def is_even(recording: Recording, target: str) -> bool:
    """Whether rows follow each other evenly, none left out."""
    return evenly(recording.t, recording.dt) and target not in recording.left_out


def evenly(t: Floats, dt: float) -> bool:
    """Whether times, shape (n,) [s], are ``dt`` apart but for what numbers of a computer leave."""
    return bool(np.ptp(np.diff(t)) < EVEN * dt)


def intervals(recording: Recording, target: str) -> tuple[Floats, Floats]:
    """Start and end of the interval that each row of ``target`` stands for [s]."""
    dt, channel = recording.dt, recording.channel(target)
    # The steps by which increments are divided: a mean weighted by them is what was turned over the time of all.
    width = own_steps(recording.t, dt) if channel.covers == "interval" else np.full(len(recording.t), dt)
    end = recording.t - channel.delay + (0.0 if channel.covers == "interval" else 0.5 * dt)
    return end - width, end
