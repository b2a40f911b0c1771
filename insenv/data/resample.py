"""Unevenly sampled rows as means on an even grid, where the manifest asks for it.

    y_k = 1/T integral of y over (e_k, e_k + T],      e_k = t_0 + k T

A row that covers its interval counts with the part of its step that lies in the cell, so that the integral of the whole
is kept; a reading at an instant stands for the time from the middle of the step before it to that of the step after.
At rest such readings are averaged over the cell that they lie in. Angles and temperatures, which are states,
are read at the cell's end, on a curve or a line through the rows. A cell that a step longer than itself reaches into is
left out: nothing is known there. Beside a table that turns cells of readings begin half a step later: k even rows are
then a cell's own. Rows that are shared out whole stand late where an edge often meets one, and at last rather than at
first belongs to its cell: of rows at 0.2 and 0.3 s in cells of 0.5 s the mean time is 0.05 s late.

Single readings that are outliers (`insenv.core.series.outlying`) are left out before means are made: where they are one
row of two hundred they would be in one of twenty means over ten, as many as how the instrument is.

Rows that share a stamp were taken since the stamp before, for a logger writes late and never early: k rows of the stamp
t_j stand at t_j-1 + (t_j - t_j-1) i / k.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Channel, Floats, Recording, Segment
from insenv.core.series.outlying import MOST, NEIGHBOURS, at_one_angle, far

#: Rows in a cell, in the median, from which a mean is a mean.
FEWEST = 2.0
#: Share of the usual step from which on no step is so short that the error of a stamp bends a curve.
EVEN = 0.3
#: Rows on either side over which the table's rate is taken, beside which a reading is an outlier.
BESIDE = 4
#: Units of what is read at the end of a cell.
STATES = ("rad", "K")


def resampled(recording: Recording, rate: float, where: str) -> Recording:
    """The recording at ``rate`` [Hz]; ``where`` names the key in messages.

    Raises
    ------
    InputError
        If a cell would hold fewer than two rows in the median, or no cell is covered by rows.
    """
    recording = _without_outliers(recording)
    t, width = recording.t, 1 / rate
    steps = np.diff(t)
    middle = float(np.median(steps))
    if width < FEWEST * middle * (1 - 1e-9):
        most = f"wanted at most {_rounded_down(1 / (FEWEST * middle)):g} Hz, means over two rows"
        raise InputError(f"{where} = {rate:g} Hz; the median step of {recording.label} is {middle:.3g} s: {most}")
    # At rest it is all one when within a cell its rows were read.
    turns = any(name in recording.channels for name in ("table_angle", "table_rate"))
    instants = any(c.covers == "instant" and c.unit not in STATES for c in recording.channels.values())
    first = t[0] + 0.5 * middle * (turns and instants)
    edges: Floats = first + width * np.arange(np.floor((t[-1] - first) / width * (1 + 1e-12)) + 1)
    kept = _covered(t, steps, edges)
    if kept.sum() < 2:
        raise InputError(f"{where} = {rate:g} Hz; fewer than two means of {recording.label} are free of gaps")
    channels = {name: _channel(channel, t, edges, kept, turns) for name, channel in recording.channels.items()}
    ends = edges[1:][kept]
    at = [(s.label, *np.searchsorted(ends, (t[s.start], t[s.stop - 1]), side="right")) for s in recording.segments]
    segments = tuple(Segment(label, int(a), int(b)) for label, a, b in at if b > a)
    lost = "" if kept.all() else f"; {int(np.sum(~kept))} are left out for gaps"
    low, high = np.quantile(steps, (0.05, 0.95))
    text = f"{len(t)} rows in steps of {low:.3g} to {high:.3g} s resampled to {len(kept)} means over {width:g} s{lost}"
    found = replace(recording, t=ends, channels=channels, segments=segments, notes=(*recording.notes, text))
    own = np.searchsorted(t, edges, side="right")
    return replace(found, period=width, made_of=np.column_stack([own[:-1], own[1:]])[kept])


def _rounded_down(value: float) -> float:
    """The largest number of three figures that is no more than a positive one."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return round(math.floor(value / unit * (1 + 1e-9)) * unit, 12)


def spread(t: Floats) -> tuple[Floats, tuple[str, ...]]:
    """Times that increase, of stamps that never fall and differ somewhere, shape (n,) [s]; what was done, in words."""
    own, first, count = np.unique(t, return_index=True, return_counts=True)
    if len(own) == len(t):
        return t, ()
    before = np.concatenate([[own[0] - float(np.median(np.diff(own)))], own[:-1]])
    group = np.repeat(np.arange(len(own)), count)
    share = (np.arange(len(t)) - first[group] + 1) / count[group]
    shared = int(count[count > 1].sum())
    text = f"{shared} rows share their time stamp with others: spread evenly over the time since the stamp before"
    return before[group] + share * (own - before)[group], (text,)


def _without_outliers(recording: Recording) -> Recording:
    """The recording with lines between the neighbours of readings that are no measurements, and a note of them."""
    t, channels, notes = recording.t, dict(recording.channels), []
    if len(t) < 4 * NEIGHBOURS:
        return recording
    row = np.arange(len(t))
    ahead, behind = np.minimum(row + BESIDE, len(t) - 1), np.maximum(row - BESIDE, 0)
    angle, rate, turned = channels.get("table_angle"), channels.get("table_rate"), np.zeros(len(t))
    if angle is not None:
        turned = (angle.values[ahead] - angle.values[behind]) / (t[ahead] - t[behind])
    elif rate is not None:
        turned = rate.values
    for name, channel in recording.channels.items():
        if not name.startswith(("gyro", "accel")):
            continue
        of_gyro = np.abs(turned) if name.startswith("gyro") else np.zeros(len(t))
        spikes = far(channel.values, of_gyro, -of_gyro, 0.0) > 1
        if spikes.mean() > MOST and not of_gyro.any():
            notes.append(
                f"{int(spikes.sum())} of {len(t)} readings of {name} are far off the neighbours, first in row "
                f"{int(np.argmax(spikes))}: too many to be left out, and the means hold them"
            )
        if not 0 < spikes.mean() <= MOST or (angle is not None and at_one_angle(angle.values, spikes)):
            continue
        values = np.where(spikes, np.interp(t, t[~spikes], channel.values[~spikes]), channel.values)
        channels[name] = replace(channel, values=values)
        many = f"{int(spikes.sum())} readings of {name} are" if spikes.sum() > 1 else f"1 reading of {name} is"
        notes.append(f"{many} far off the neighbours, first in row {int(np.argmax(spikes))}: left out of the means")
    return replace(recording, channels=channels, notes=(*recording.notes, *notes))


def _covered(t: Floats, steps: Floats, edges: Floats) -> np.ndarray:
    """Cells into which no step longer than themselves reaches, shape (cells,)."""
    width = edges[1] - edges[0] if len(edges) > 1 else np.inf
    change = np.zeros(len(edges) + 1)
    gap = np.flatnonzero(steps > width * (1 + 1e-9))
    first = np.clip(np.searchsorted(edges, t[gap], side="right") - 1, 0, len(edges))
    last = np.clip(np.searchsorted(edges, t[gap + 1], side="left") - 1, 0, len(edges) - 1)
    np.add.at(change, first, 1)
    np.add.at(change, last + 1, -1)
    return np.cumsum(change)[: len(edges) - 1] == 0


def through(t: Floats, v: Floats) -> Callable[[Floats], Floats]:
    """A curve through readings, shape (n,): straight lines cut the corners of a motion of some rows' length.

    In each reading it has the slope of the parabola through its neighbours: of a smooth motion it is off by the fourth
    power of a step, and what happens in one step bends those next to it alone. Slopes that lean to the calmer side, as
    Akima's, are off by the square wherever a table turns about.

    Where a step is a small part of the others, the error of its stamp is a slope: lines it is then.
    """
    from scipy.interpolate import CubicHermiteSpline  # slow to import

    steps = np.diff(t)
    if len(t) < 3 or steps.min() < EVEN * float(np.median(steps)):
        return lambda at: np.interp(at, t, v)
    return CubicHermiteSpline(t, v, np.gradient(v, t, edge_order=2), extrapolate=True)


def _channel(channel: Channel, t: Floats, edges: Floats, kept: np.ndarray, turns: bool) -> Channel:
    v = channel.values
    if channel.unit == "rad":
        return replace(channel, values=through(t, v)(edges[1:])[kept])
    if channel.unit in STATES:
        return replace(channel, values=np.interp(edges[1:], t, v)[kept])
    if channel.unit == "1":
        return replace(channel, values=v[np.searchsorted(t, edges[1:], side="right") - 1][kept])
    if channel.covers == "interval":
        return replace(channel, values=_means(t, v[1:], edges)[kept])
    if turns:
        return replace(channel, values=_means(_own(t), v, edges)[kept], covers="interval")
    cell = np.searchsorted(edges, t, side="left") - 1
    inside = (cell >= 0) & (cell < len(kept))
    count = np.bincount(cell[inside], minlength=len(kept))
    total = np.bincount(cell[inside], weights=v[inside], minlength=len(kept))
    return replace(channel, values=(total / np.maximum(count, 1))[kept], covers="interval")


def _means(bounds: Floats, v: Floats, edges: Floats) -> Floats:
    """Means over the cells between edges of what is v between bounds, one of which is more than there are values."""
    total = np.concatenate([[0.0], np.cumsum(v * np.diff(bounds))])
    means: Floats = np.diff(np.interp(edges, bounds, total)) / np.diff(edges)
    return means


def _own(t: Floats) -> Floats:
    """Bounds of the time that each reading stands for: the middles of the steps beside it, shape (n + 1,) [s]."""
    middles = (t[1:] + t[:-1]) / 2
    return np.concatenate([[2 * t[0] - middles[0]], middles, [2 * t[-1] - middles[-1]]])
