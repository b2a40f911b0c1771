"""The reference channels of a recording turned into the `Motion` that a target channel was exposed to.

Rows are gathered into cells of ``rows_per_cell`` sampling periods on one even grid that runs through gaps
(``count`` says how many rows a cell holds). What is measured is averaged over a cell; rates are differences
of their integral over the cell's edges, so that the mean over a cell is exact; states are given at the edges.

The rows of a target that ``covers`` its interval end at the row's time, those of an instantaneous target are
centred on it; a channel's ``delay`` moves it back.

An accelerometer that gravity turns through on a dividing head has the specific force along its input axis for a rate
(`insenv.data.cells.tumble`).

A gyro sees the share p of the table's rate and the share q of the Earth's vertical rate:

    p = q = sin(tilt)                        a single gyro
    p = axis . table axis,  q = axis . up    a triad that turns about the vertical (`Mounting.table_axis`)

so that of a vehicle's triad, right-forward-up, the z gyro sees all of a turn and the other two nothing.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.earth import EARTH_RATE
from insenv.core.motion import Motion, interval_mean, reading_noise
from insenv.core.recording import Floats, Recording, Response
from insenv.core.series.rounding import rounding
from insenv.data.cells.rows import cells_of, covered_by, interpolated, means_of_rows
from insenv.data.cells.table import STEADY, TargetCells, integral, table_rate_of_rows
from insenv.data.cells.tumble import Tumble, tumble
from insenv.data.reference import at_cells, is_in_points, is_set, order
from insenv.data.smooth import smoothed

#: Which manifest channel would supply a field of `Motion`.
CHANNEL_OF = {
    "rate": "table_rate",
    "rate_edges": "table_rate",
    "angle": "table_angle",
    "temperature": "temperature",
    "base_tilt": "gyro_x, gyro_y, gyro_z",
    "force": "accel_x",
    "vibration": "accel_x",
    "turn_rate": "table_rate",
    "across": "table_angle",
    "cross_rate": "gyro_x, gyro_y, gyro_z",
}

#: Share of the table's rate below which an axis is level, and change of that rate, as a share of the largest, from
#: which on a small share of it is no bias.
LEVEL, CHANGES = 1e-6, 0.2
#: Time about whose mean a specific force vibrates [s], and fewest rows of it.
SHAKES, FEWEST = 1.0, 5
#: Exposures that are kept, as long as what they were made of: those who clean a recording ask for the same one.
KEPT = 3
#: Direction of "up" in the axis letters of `Mounting.axes`.
UP = {"U": 1.0, "D": -1.0}


@dataclass(frozen=True)
class Exposure:
    """A target channel in cells, and what it was exposed to.

    Attributes
    ----------
    y : ndarray, shape (n,)
        Mean of the target over each cell; 0 where a cell is empty.
    count : ndarray of int, shape (n,)
        Rows in each cell.
    cell_of_row : ndarray of int, shape (rows,)
        Cell of each row; -1 for rows that are left out (the first of a piece whose interval began before it).
    motion : Motion
        Exposure on the cells; ``motion.rate`` is the reference that the model subtracts.
    u : ndarray, shape (n,)
        Input rate for regressors: the commanded rate where it was logged and the table has it, free of errors of the
        encoder; else without the jitter of the encoder, which would explain itself (`insenv.core.series.trajectory`,
        `insenv.data.cells.follow`). Times the gain of the instrument (`Response`), as ``motion.rate`` is.
    beside : ndarray, shape (n,), optional
        What the reading of the angle has beside the motion behind it, over whole cells: the part of ``motion.rate`` of
        which a mean of cells wants all, those too of which rows are lost, for it cancels from one to the next.
    covered : ndarray, shape (n,), optional
        Time that the rows of each cell cover together, in sampling periods, where rows cover other times than one.
    """

    y: Floats
    count: NDArray[np.int64]
    cell_of_row: NDArray[np.int64]
    motion: Motion
    u: Floats
    beside: Floats | None = None
    covered: Floats | None = None


def turns(exposures: Sequence[Exposure]) -> bool:
    """Whether the rate that an instrument was exposed to changes, within a run or from one run to another.

    At rest in two positions it sees the Earth's rate of both signs, and turns by no table.
    """
    within = any(np.ptp(e.u) for e in exposures)
    return within or float(np.ptp([e.u[0] for e in exposures])) > 2 * EARTH_RATE * (1 + STEADY)


def expose(
    recording: Recording,
    target: str,
    rows_per_cell: int = 1,
    reference_temperature: float = 298.15,
    with_earth: bool = False,
) -> Exposure:
    """Gather ``target`` and its references into cells.

    Parameters
    ----------
    recording : Recording
    target : str
        Name of the channel to explain.
    rows_per_cell : int
        Sampling periods in a cell.
    reference_temperature : float
        T_ref of the temperature effects [K].
    with_earth : bool
        Whether the model declares the Earth's rate: then its known vertical part belongs to the reference.

    Raises
    ------
    InputError
        If the recording has no such channel.
    """
    recording.channel(target)
    asked = (target, rows_per_cell, reference_temperature, with_earth, *_described(recording, target))
    parts = _parts(recording)
    for before, of, made in tuple(_kept):
        if before == asked and len(of) == len(parts) and all(a() is b for a, b in zip(of, parts, strict=True)):
            return made
    made = _exposed(recording, target, rows_per_cell, reference_temperature, with_earth)
    _kept[:] = [*_kept[1 - KEPT :], (asked, tuple(weakref.ref(part, _forget) for part in parts), made)]
    return made


_kept: list[tuple[tuple[Any, ...], tuple[weakref.ref[Any], ...], Exposure]] = []


def _forget(gone: weakref.ref[Any]) -> None:
    """Drop the exposures of a recording that is no more."""
    _kept[:] = [one for one in _kept if all(part is not gone for part in one[1])]


def _parts(recording: Recording) -> tuple[Any, ...]:
    """Arrays and objects of a recording that copies of it share."""
    table = () if recording.table is None else (recording.table,)
    values = (channel.values for channel in recording.channels.values())
    return (recording.t, recording.site, recording.mounting, *table, *values, *recording.left_out.values())


def _described(recording: Recording, target: str) -> tuple[Any, ...]:
    """The rest of what an exposure depends on."""
    channels = ((name, c.unit, c.covers, c.delay, c.source, c.every) for name, c in recording.channels.items())
    return (*channels, *recording.left_out, recording.period, recording.responses.get(target))


def _exposed(
    recording: Recording, target: str, rows_per_cell: int, reference_temperature: float, with_earth: bool
) -> Exposure:
    channel = recording.channel(target)
    response = recording.responses.get(target, Response())
    cell_of_row, start, n = cells_of(recording, channel, rows_per_cell, response.ahead)
    if target in recording.left_out:
        cell_of_row[recording.left_out[target]] = -1
    step = rows_per_cell * recording.dt
    edges: Floats = start + step * np.arange(n + 1.0)
    covered = covered_by(recording, target)
    count, y = means_of_rows(channel.values, cell_of_row, n, covered)
    projection, upwards = _shares(recording, target)
    share = projection * response.gain
    vertical = EARTH_RATE * np.sin(recording.site.latitude or 0.0) * upwards * with_earth * response.gain
    cells = TargetCells(recording, target, cell_of_row, count, edges, covered)
    table = cells.table(share, y - vertical)
    turned, reference, along = tumble(recording, target), table.reference * share + vertical, None
    if turned is not None and table.angle is not None:
        reference, along = _through_gravity(turned, table.angle, is_set(recording))
    motion = Motion(
        t=edges - start,
        rate=reference,
        angle=table.angle,
        rate_edges=None if table.rate_edges is None else table.rate_edges * share + vertical,
        turn_rate=_turn_rate(cells),
        temperature=_temperature(recording, cell_of_row, n),
        base_tilt=_base_tilt(recording, target, edges),
        across=along,
        force=_others(recording, cell_of_row, n, "accel_") if target.startswith("gyro") else {},
        vibration=_vibration(recording, target, cell_of_row, n),
        cross_rate=_cross_rates(recording, target, cell_of_row, n) | _across(recording, target, projection, table.rate),
        projection=projection,
        level=_level(recording, target),
        reference_temperature=reference_temperature,
        base_turned=recording.mounting.base_turned,
        gain=response.gain,
        lag=response.lag,
        filtered=response.filtered,
        window=response.window,
        stands=is_set(recording),
        points=is_in_points(recording),
        reading=reading_noise((y - table.reference * share)[count > 0]) if table.rate.any() else None,
    )
    beside = None if table.beside is None else table.beside * share
    weight = None if covered is None else count * means_of_rows(covered, cell_of_row, n)[1]
    u = table.rate * share + vertical if along is None else reference
    return Exposure(y, count, cell_of_row, motion, u, beside, weight)


def _through_gravity(turned: Tumble, angle: Floats, was_set: bool) -> tuple[Floats, Floats]:
    """Specific force along the input axis in each cell and that across it: where its angle was set, else means."""
    at, step = (angle[1:], 0.0) if was_set else (0.5 * (angle[1:] + angle[:-1]), np.diff(angle))
    return turned.force(at, step), turned.across(at, step)


def rates_of_angles(recording: Recording, target: str, rows_per_cell: int, angles: Floats) -> Floats:
    """What ``target`` would see of angles at the rows of the table's own, shape (k, rows): rates over the cells."""
    channel, name = recording.channel(target), order(recording)[0]
    response = recording.responses.get(target, Response())
    _, start, n = cells_of(recording, channel, rows_per_cell, response.ahead)
    step = rows_per_cell * recording.dt
    edges: Floats = start + step * np.arange(n + 1.0)
    times = recording.t - recording.channels[name].delay
    share = _shares(recording, target)[0] * response.gain / step
    return share * np.array([np.diff(np.interp(edges, times, angle)) for angle in angles])


def _shares(recording: Recording, target: str) -> tuple[float, float]:
    """Shares of the table's rate and of the Earth's vertical rate that the target sees: an accelerometer none."""
    mounting, upwards = recording.mounting, float(np.sin(recording.mounting.tilt))
    if target.startswith("accel") and (mounting.table_axis or has_table(recording)):
        return 0.0, 0.0
    if mounting.table_axis and target[-2:] in ("_x", "_y", "_z"):
        upwards = UP.get(mounting.axes["xyz".index(target[-1])], 0.0)
        return upwards * UP[mounting.table_axis], upwards
    return (upwards if target == "gyro" or has_table(recording) else 1.0), upwards


def _level(recording: Recording, target: str) -> float:
    """Share of the Earth's rate whose horizontal part a single gyro sees; 1 of an axis of a triad."""
    latitude = recording.site.latitude or 0.0
    return float(np.cos(latitude) * np.cos(recording.mounting.tilt)) if target == "gyro" else 1.0


def has_table(recording: Recording) -> bool:
    """Whether the angle or the rate of a table was recorded."""
    return "table_angle" in recording.channels or "table_rate" in recording.channels


def table_share(recording: Recording, target: str) -> float:
    """Share of the table's rate that ``target`` shows: what it sees, times its gain."""
    return _shares(recording, target)[0] * recording.responses.get(target, Response()).gain


def input_of_rows(recording: Recording, target: str) -> Floats | None:
    """What a table makes ``target`` read in each row, shape (n,) [SI]: its share of the rate, or gravity that turns."""
    if (turned := tumble(recording, target)) is not None:
        return turned.force(recording.channels["table_angle"].values)
    rate = table_rate_of_rows(recording, target)
    return None if rate is None else rate * table_share(recording, target)


def _turn_rate(cells: TargetCells) -> Floats | None:
    """Rate of the table at the edges, of an accelerometer; None where no table turns."""
    behind, names = cells.recording.table, order(cells.recording)
    stands = is_set(cells.recording) or (behind is not None and behind.still)
    if not cells.target.startswith("accel") or not names or stands:
        return None
    return cells.rate_edges(names)


def _temperature(recording: Recording, cell_of_row: NDArray[np.int64], n: int) -> Floats | None:
    """Temperature at the edges, from the smoothed means of the cells; of points that at the end of a cell is its own.

    Between two points somebody waited for another temperature: a leap there is none of the thermometer's noise.
    """
    if "temperature" not in recording.channels:
        return None
    if is_in_points(recording):
        return at_cells(recording.channels["temperature"], cell_of_row, n)
    read = recording.values("temperature", "K")
    count, mean = means_of_rows(read, cell_of_row, n)
    filled = np.flatnonzero(count)
    edges = np.arange(n + 1.0)
    middle: Floats = edges[:-1] + 0.5
    return interpolated(middle, smoothed(np.interp(edges[:-1], filled, mean[filled]), rounding(read)))(edges)


def up_direction(recording: Recording) -> Floats:
    """Unit vector of "up" in the axes of the triad: as the accelerometers feel it, else by the mounting."""
    names = ("accel_x", "accel_y", "accel_z")
    if all(name in recording.channels for name in names):
        force = np.array([recording.channels[name].values.mean() for name in names])
        return force / np.linalg.norm(force)
    return np.array([UP.get(letter, 0.0) for letter in recording.mounting.axes])


def _base_tilt(recording: Recording, target: str, edges: Floats) -> Floats | None:
    """Angle that times gravity is what an accelerometer at rest reads: -(theta x up), theta of the gyros."""
    if not target.startswith("accel_") or recording.mounting.table_axis:
        return None  # about axes that turn, the integral of a rate is no tilt
    up = up_direction(recording)
    axis = "xyz".index(target[-1])
    j, k = (axis + 1) % 3, (axis + 2) % 3
    total = np.zeros(len(edges) - 1)
    known = False
    for other, factor in ((j, -up[k]), (k, up[j])):
        channel = recording.channels.get(f"gyro_{'xyz'[other]}")
        if channel is None and abs(factor) > 0.1:
            return None
        if channel is not None:
            theta = integral(recording, channel)(edges)
            theta = theta - np.linspace(theta[0], theta[-1], len(theta))
            total += factor * interval_mean(theta)
            known = True
    return total if known else None


def _others(recording: Recording, cell_of_row: NDArray[np.int64], n: int, prefix: str) -> dict[str, Floats]:
    """Cell means of the channels ``prefix`` + axis."""
    return {
        axis: means_of_rows(recording.channels[prefix + axis].values, cell_of_row, n)[1]
        for axis in "xyz"
        if prefix + axis in recording.channels
    }


def _vibration(recording: Recording, target: str, cell_of_row: NDArray[np.int64], n: int) -> dict[str, Floats]:
    """Cell means of the square of each accelerometer about its own mean over `SHAKES` seconds.

    Of an accelerometer the other axes alone: its own noise is no vibration to itself.
    """
    from scipy.ndimage import uniform_filter1d  # slow to import

    width = int(SHAKES / recording.dt)
    if width < FEWEST or len(recording) < 2 * width:
        return {}
    found = {}
    for axis in "xyz":
        if (name := f"accel_{axis}") in recording.channels and name != target:
            values = recording.channels[name].values
            level = uniform_filter1d(values, width, mode="nearest")
            found[axis] = means_of_rows((values - level) ** 2, cell_of_row, n)[1]
    return found


def _cross_rates(recording: Recording, target: str, cell_of_row: NDArray[np.int64], n: int) -> dict[str, Floats]:
    if target[-2:] not in ("_x", "_y", "_z"):
        return {}
    rates = _others(recording, cell_of_row, n, target[:-1])
    return {axis: rate for axis, rate in rates.items() if axis != target[-1]}


def _across(recording: Recording, target: str, projection: float, rate: Floats) -> dict[str, Floats]:
    """The rate of the table, of which a level gyro reads a part where it is not quite level, by the vertical axis.

    Nothing where a gyro is there that reads it, or the table hardly changes its rate: then that part is a bias.
    """
    upright = next((axis for axis, letter in zip("xyz", recording.mounting.axes, strict=True) if UP.get(letter)), "z")
    level = target.startswith("gyro") and abs(projection) < LEVEL and target[-2:] != f"_{upright}"
    if not level or f"gyro_{upright}" in recording.channels:
        return {}
    return {upright: rate} if float(np.ptp(rate)) > CHANGES * float(np.abs(rate).max(initial=0.0)) > 0 else {}
