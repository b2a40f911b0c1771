"""The reference channels of a recording turned into the `Motion` that a target channel was exposed to.

Rows are gathered into cells of ``rows_per_cell`` sampling periods on one even grid that runs through gaps
(``count`` says how many rows a cell holds). What is measured is averaged over a cell; rates are differences
of their integral over the cell's edges, so that the mean over a cell is exact; states are given at the edges.

The rows of a target that ``covers`` its interval end at the row's time, those of an instantaneous target are
centred on it; a channel's ``delay`` moves it back.

A gyro sees the share p of the table's rate and the share q of the Earth's vertical rate:

    p = q = sin(tilt)                        a single gyro
    p = axis . table axis,  q = axis . up    a triad that turns about the vertical (`Mounting.table_axis`)

so that of a vehicle's triad, right-forward-up, the z gyro sees all of a turn and the other two nothing.
"""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.earth import EARTH_RATE
from insenv.core.motion import Motion, interval_mean
from insenv.core.recording import GAP, Channel, Floats, Recording, Response
from insenv.core.series.trajectory import Trajectory
from insenv.data.follow import followed
from insenv.data.reference import at_cells, is_set, order, programme
from insenv.data.resample import through
from insenv.data.smooth import smoothed

#: Share of the second difference at one end of a row, of that at the other, below which the rate has a corner in it.
CORNER = 0.25
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
    "cross_rate": "gyro_x, gyro_y, gyro_z",
}

#: Share of the largest rate by which a commanded rate that holds may change from cell to cell.
STEADY = 1e-7
#: A table has its commanded rate where it is off by so many times what it usually is (this quantile), or by so small a
#: share of the largest rate; not where it is off by so large a share. It follows a command that it has this
#: share of the time.
USUAL, FAR_OFF, SAME_RATE, OTHER_RATE, FOLLOWED = 0.3, 12.0, 1e-3, 0.02, 0.6
#: Share of the table's rate below which an axis is level, and change of that rate, as a share of the largest, from
#: which on a small share of it is no bias.
LEVEL, CHANGES = 1e-6, 0.2
#: Deviations of an angle's reading by which it leaps over rows that are left out or lost.
LEAPS = 6.0
#: Time about whose mean a specific force vibrates [s], and fewest rows of it.
SHAKES, FEWEST = 1.0, 5
#: Exposures that are kept, as long as what they were made of: those who clean a recording ask for the same one.
KEPT = 3
#: Direction of "up" in the axis letters of `Mounting.axes`.
_UP = {"U": 1.0, "D": -1.0}
#: Share of a period by which the rows may stand beside the first one's grid, as rounding makes it.
SAME_PHASE = 1e-6


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
        `insenv.data.follow`). Times the gain of the instrument (`Response`), as ``motion.rate`` is.
    beside : ndarray, shape (n,), optional
        What the reading of the angle has beside the motion behind it, over whole cells: the part of ``motion.rate`` of
        which a mean of cells wants all, those too of which rows are lost, for it cancels from one to the next.
    """

    y: Floats
    count: NDArray[np.int64]
    cell_of_row: NDArray[np.int64]
    motion: Motion
    u: Floats
    beside: Floats | None = None


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
    cell_of_row, start, n = _cells(recording, channel, rows_per_cell, response.ahead)
    if target in recording.left_out:
        cell_of_row[recording.left_out[target]] = -1
    step = rows_per_cell * recording.dt
    edges: Floats = start + step * np.arange(n + 1.0)
    count, y = _gather(channel.values, cell_of_row, n)
    projection, upwards = _shares(recording, target)
    share = projection * response.gain
    vertical = EARTH_RATE * np.sin(recording.site.latitude or 0.0) * upwards * with_earth * response.gain
    cells = _Cells(recording, target, cell_of_row, count, edges)
    table = cells.table(share, y - vertical)
    motion = Motion(
        t=edges - start,
        rate=table.reference * share + vertical,
        angle=table.angle,
        rate_edges=None if table.rate_edges is None else table.rate_edges * share + vertical,
        turn_rate=_turn_rate(cells),
        temperature=_temperature(recording, cell_of_row, n),
        base_tilt=_base_tilt(recording, target, edges),
        force=_others(recording, cell_of_row, n, "accel_") if target.startswith("gyro") else {},
        vibration=_vibration(recording, target, cell_of_row, n),
        cross_rate=_cross_rates(recording, target, cell_of_row, n) | _across(recording, target, projection, table.rate),
        projection=projection,
        reference_temperature=reference_temperature,
        base_turned=recording.mounting.base_turned,
        gain=response.gain,
        lag=response.lag,
        filtered=response.filtered,
        window=response.window,
        stands=is_set(recording),
    )
    beside = None if table.beside is None else table.beside * share
    return Exposure(y, count, cell_of_row, motion, table.rate * share + vertical, beside)


def rates_of_angles(recording: Recording, target: str, rows_per_cell: int, angles: Floats) -> Floats:
    """What ``target`` would see of angles at the rows of the table's own, shape (k, rows): rates over the cells."""
    channel, name = recording.channel(target), order(recording)[0]
    response = recording.responses.get(target, Response())
    _, start, n = _cells(recording, channel, rows_per_cell, response.ahead)
    step = rows_per_cell * recording.dt
    edges: Floats = start + step * np.arange(n + 1.0)
    times = recording.t - recording.channels[name].delay
    share = _shares(recording, target)[0] * response.gain / step
    return share * np.array([np.diff(np.interp(edges, times, angle)) for angle in angles])


@dataclass(frozen=True)
class _Table:
    """The table on the cells: the ``reference`` rate, that of curves, and both at the edges where there is a table."""

    reference: Floats
    rate: Floats
    rate_edges: Floats | None
    angle: Floats | None
    beside: Floats | None = None


@dataclass(frozen=True)
class _Angle:
    """The table's angle as a function of time, and at the edges of the cells."""

    of_time: Callable[[Floats], Floats]
    at_edges: Floats


@dataclass(frozen=True)
class _Cells:
    """The cells of a target, and what is known of the table on them."""

    recording: Recording
    target: str
    cell_of_row: NDArray[np.int64]
    count: NDArray[np.int64]
    edges: Floats
    angles: dict[tuple[str, ...], _Angle] = field(default_factory=dict)

    def table(self, share: float, reading: Floats) -> _Table:
        """The table as an instrument that sees ``share`` of it, and reads ``reading``, tells it from jitter."""
        names, behind = order(self.recording), self.recording.table
        n = len(self.count)
        if not names:
            return _Table(np.zeros(n), np.zeros(n), None, None)
        if is_set(self.recording):
            angle = at_cells(self.recording.channels["table_angle"], self.cell_of_row, n)
            return _Table(np.zeros(n), np.zeros(n), np.zeros(n + 1), angle)
        if behind is not None and behind.still:
            # The noise of an encoder is no motion: neither to subtract nor to make a curve of.
            return _Table(np.zeros(n), np.zeros(n), np.zeros(n + 1), np.full(n + 1, behind.angle[0]))
        reference, beside = self._rate(names), None
        told = programme(self.recording)
        if behind is not None:
            rate, at_edges = self._smoothed(behind)
            at_rows = self._of_instants(behind)
            rate = rate + at_rows
            if names[0] == "table_angle" and not self._even:
                over_rows, beside = self._over_rows(behind, names)
                reference = over_rows + beside + at_rows
            elif not self._read_beside(names):
                reference = reference + at_rows + self._between(behind, names)
        else:
            rate, at_edges = self._followed(names, reference, share, reading)
        if told is not None:
            rate, at_edges = self._by_programme(told, rate, at_edges)
        return _Table(reference, rate, at_edges, self._turned(names, behind), beside)

    def _turned(self, names: tuple[str, ...], behind: Trajectory | None) -> Floats | None:
        """The angle of curves at the edges: of an encoder that goes by counts the motion behind it, which stops once.

        The integral of a noisy rate wanders away from the angle.
        """
        if behind is None:
            return self._angle(names).at_edges
        return behind.angle_at(self.edges) if behind.of == "angle" else None

    def _smoothed(self, behind: Trajectory) -> tuple[Floats, Floats]:
        """The rate behind a noisy reading, over the cells and at the edges; zero where the table stops."""
        rate, at_edges = np.diff(behind.angle_at(self.edges)) / self._step, behind.rate_at(self.edges)
        stops = behind.stops(0.5 * (self.edges[1:] + self.edges[:-1]), rate)
        inside = np.concatenate([stops[:1], stops[1:] & stops[:-1], stops[-1:]])
        return np.where(stops, 0.0, rate), np.where(inside, 0.0, at_edges)

    def _of_instants(self, behind: Trajectory) -> Floats:
        """What a mean of readings at instants is more than the mean over the cells: -dt^2/24 of the second derivative.

        Of a table that swings once a second, read every 10 ms, that is 0.02 % of the rate.
        """
        if self.recording.channels[self.target].covers != "instant":
            return np.zeros(len(self.count))
        return -(self.recording.dt**2) / 24 * np.diff(behind.acceleration_at(self.edges)) / self._step

    def _between(self, behind: Trajectory, names: tuple[str, ...]) -> Floats:
        """What the straight line between two readings of an angle leaves of the rate, where edges lie between them."""
        if names[0] != "table_angle":
            return np.zeros(len(self.count))
        times = self.recording.t - self.recording.channels[names[0]].delay
        bow = behind.angle_at(self.edges) - _at(times, behind.angle_at(times))(self.edges)
        return np.diff(bow) / self._step

    def _over_rows(self, behind: Trajectory, names: tuple[str, ...]) -> tuple[Floats, Floats]:
        """Mean rate of the motion behind a noisy angle over the rows' very intervals, and the rest over whole cells.

        Intervals of uneven rows do not join: of an encoder's steps a part would be left between any two, white noise.
        """
        channel = self.recording.channels[names[0]]
        times = self.recording.t - channel.delay
        start, end = _intervals(self.recording, self.target)
        moved = behind.angle_at(end) - behind.angle_at(start)
        full = np.diff(behind.angle_at(self.edges)) / self._step
        _, mean = _gather(moved / (end - start), self.cell_of_row, len(self.count))
        kept = ~self.recording.left_out.get(self.target, np.zeros(len(times), dtype=bool))
        rest = _without_leaps(
            times[kept], (channel.values - behind.angle_at(times))[kept], self.recording.dt, behind.noise
        )
        return np.where(self.count > 0, mean, full), np.diff(_at(times[kept], rest)(self.edges)) / self._step

    @property
    def _even(self) -> bool:
        """Whether the intervals of the rows make up the cells."""
        return _is_even(self.recording, self.target)

    @property
    def _step(self) -> float:
        return float(self.edges[1] - self.edges[0])

    def _angle(self, names: tuple[str, ...]) -> _Angle:
        """The table's angle from the first of the channels ``names``: a curve through all rows is made once."""
        if names not in self.angles:
            angle = _angle_function(self.recording, names)
            assert angle is not None
            self.angles[names] = _Angle(angle, angle(self.edges))
        return self.angles[names]

    def rate_edges(self, names: tuple[str, ...]) -> Floats:
        """Rate of the table at the edges: central differences over one cell, or one sampling period of a rate."""
        angle = self._angle(names).of_time
        # Over one sampling period the corners of a rate stay sharp; an angle's noise would be as large as can be.
        half = 0.5 * (self.recording.dt if names[0] == "table_rate" else self._step)
        rate: Floats = (angle(self.edges + half) - angle(self.edges - half)) / (2 * half)
        if len(rate) > 3:
            # Half a cell beyond the ends the angle is a guess, and its error would stand for an acceleration.
            rate[[0, -1]] = 2 * rate[[1, -2]] - rate[[2, -3]]
        return rate

    def _rate(self, names: tuple[str, ...]) -> Floats:
        """Mean rate over the cells, from the first of the channels ``names``."""
        recording = self.recording
        channel = recording.channels[names[0]]
        full = np.diff(self._angle(names).at_edges) / self._step
        if self._read_beside(names):
            # Read at the very times of the target: a mean with its neighbours would mix their noise, and where a ramp
            # begins it is no reading at an instant.
            count, mean = _gather(channel.values, self.cell_of_row, len(self.count))
            return np.where(count > 0, mean, full)
        return _of_rows(recording, self.target, self.cell_of_row, self.count, full, names)

    def _read_beside(self, names: tuple[str, ...]) -> bool:
        """Whether the reference is a rate at the very times of the target."""
        channel, own = self.recording.channels[names[0]], self.recording.channels[self.target]
        return names[0] == "table_rate" and channel.covers == own.covers == "instant" and channel.delay == own.delay

    def _followed(
        self, names: tuple[str, ...], reference: Floats, share: float, reading: Floats
    ) -> tuple[Floats, Floats]:
        """The rate behind the jitter of a reading, over the cells and at the edges."""
        n, told = len(self.count), names[0] == "table_rate"
        at_edges = self.rate_edges(names)
        if not share:
            return reference, at_edges
        calm = followed(reference, reading / share, self.count > 0, "rate" if told else "angle")
        if not told:
            jitter = reference - calm
            return calm, at_edges - np.interp(np.arange(n + 1.0), np.arange(n) + 0.5, jitter)
        if np.array_equal(calm, reference):
            return calm, at_edges
        # A rate that was measured, not commanded: its noise has no corners to keep sharp.
        return calm, np.interp(np.arange(n + 1.0), np.arange(n) + 0.5, calm)

    def _by_programme(self, told: str, rate: Floats, at_edges: Floats) -> tuple[Floats, Floats]:
        """The commanded rate where it holds and the table has it; else the rate that was measured.

        A command is free of errors of the encoder. But it jumps where the table cannot, and between the rows at which
        a changing rate was logged it is a guess, whose error would look like one of the scale.
        """
        recording = self.recording
        commanded = self._rate((told,))
        if len(commanded) < 3 or not np.any(commanded):
            return rate, at_edges  # who turns a table by hand asks its drive for nothing
        changed = np.abs(np.diff(commanded)) > STEADY * np.abs(commanded).max()
        holds = ~np.concatenate([changed[:1], changed[1:] | changed[:-1], changed[-1:]])
        if recording.channels[told].covers == "interval":
            # Means that change as the table does are its rate, ramps and all.
            holds |= ~self._jumps(commanded)
        off = np.abs(commanded - rate)
        usual = float(np.quantile(off[holds], USUAL)) if holds.any() else 0.0
        top = float(np.abs(rate).max())
        there = off <= min(FAR_OFF * usual + SAME_RATE * top, OTHER_RATE * top)
        if not holds.any() or float(np.mean(there[holds])) < FOLLOWED:
            return rate, at_edges  # that passes by what was asked for now and then is no table that follows it
        there &= np.concatenate([there[:1], there[1:] & there[:-1]]) & np.concatenate(
            [there[1:] & there[:-1], there[-1:]]
        )
        edges = self.rate_edges((told,))
        at_both = np.concatenate([there[:1], there[1:] & there[:-1], there[-1:]])
        return np.where(there & holds, commanded, rate), np.where(at_both, edges, at_edges)

    @staticmethod
    def _jumps(commanded: Floats) -> NDArray[np.bool_]:
        """Cells beside a jump between two rates that hold."""
        change = np.abs(np.diff(commanded)) > STEADY * np.abs(commanded).max()
        alone = change & ~np.concatenate([[False], change[:-1]]) & ~np.concatenate([change[1:], [False]])
        return np.concatenate([alone, [False]]) | np.concatenate([[False], alone])


def _shares(recording: Recording, target: str) -> tuple[float, float]:
    """Shares of the table's rate and of the Earth's vertical rate that the target sees: an accelerometer none."""
    mounting, upwards = recording.mounting, float(np.sin(recording.mounting.tilt))
    if target.startswith("accel") and (mounting.table_axis or _has_table(recording)):
        return 0.0, 0.0
    if mounting.table_axis and target[-2:] in ("_x", "_y", "_z"):
        upwards = _UP.get(mounting.axes["xyz".index(target[-1])], 0.0)
        return upwards * _UP[mounting.table_axis], upwards
    return (upwards if target == "gyro" or _has_table(recording) else 1.0), upwards


def _has_table(recording: Recording) -> bool:
    return "table_angle" in recording.channels or "table_rate" in recording.channels


def _cells(
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
        # The interval of a piece's first row began before the piece: its references are not known.
        cell[[piece.start for piece in recording.pieces()]] = -1
    return cell, float(middle[first] + (phase - 0.5 - ahead) * dt), int(cell.max()) + 1


def _gather(values: Floats, cell_of_row: NDArray[np.int64], n: int) -> tuple[NDArray[np.int64], Floats]:
    """Rows per cell and their mean; 0 where there is none."""
    # Rows of no cell are counted in a place before the first one: to pick the others costs more than to count all.
    place = np.maximum(cell_of_row, -1) + 1
    count = np.bincount(place, minlength=n + 1)[1:]
    total = np.bincount(place, weights=values, minlength=n + 1)[1:]
    return count, total / np.maximum(count, 1)


def _at(
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


def _without_leaps(times: Floats, rest: Floats, dt: float, noise: float) -> Floats:
    """What a reading has beside the motion, shape (n,) [rad], without what it leaps by where rows are left out or lost.

    Rows are left out where a reference slips as well: then nothing of it belongs to the rows beside.
    """
    change = np.diff(rest)
    leaps = (np.diff(times) > GAP * dt) & (np.abs(change) > LEAPS * noise)
    return np.append(0.0, np.cumsum(np.where(leaps, 0.0, change)))


def _integral(recording: Recording, channel: Channel) -> Callable[[Floats], Floats]:
    """The integral of a rate channel as a function of time: exact at the rows, linear between them."""
    times = recording.t - channel.delay
    steps = np.diff(times)
    v = channel.values
    means = v[1:] if channel.covers == "interval" else 0.5 * (v[1:] + v[:-1])
    if channel.covers == "instant" and channel.source == "command" and len(v) > 3:
        means = means - _bow(v)
    return _at(times, np.concatenate([[0.0], np.cumsum(means * steps)]))


def _bow(values: Floats) -> Floats:
    """What the straight line between two values of a curve has more than their mean, shape (n - 1,).

    A twelfth of the second difference, the mean of those at both ends; nothing at a corner, where one of them is next
    to none and nothing tells when within the row the rate bends.
    """
    bend = np.diff(values, 2)
    before, after = np.append(bend[:1], bend), np.append(bend, bend[-1:])
    corner = np.minimum(np.abs(before), np.abs(after)) < CORNER * np.maximum(np.abs(before), np.abs(after))
    return np.where(corner, 0.0, 0.5 * (before + after)) / 12


def _angle_function(recording: Recording, preferred: tuple[str, ...]) -> Callable[[Floats], Floats] | None:
    """The table's angle as a function of time, from the first of the ``preferred`` channels that is there."""
    for name in preferred:
        if name in recording.channels:
            channel = recording.channels[name]
            if name == "table_angle":
                # Between readings without noise a line cuts (w h)^2 / 8 of a swing, where edges lie between the rows.
                curve = through if channel.source == "encoder" and recording.table is None else None
                return _at(recording.t - channel.delay, channel.values, curve)
            return _integral(recording, channel)
    return None


def _of_rows(
    recording: Recording,
    target: str,
    cell_of_row: NDArray[np.int64],
    count: NDArray[np.int64],
    full: Floats,
    preferred: tuple[str, ...],
) -> Floats:
    """Mean rate of the table over the very intervals of a cell's rows; ``full``, over the whole cell, where full.

    The same for an even clock without gaps. Where rows are lost, or steps differ a little, the table may have turned
    otherwise in the rest of the cell.
    """
    if _is_even(recording, target):
        return full
    rates = table_rate_of_rows(recording, target, preferred)
    assert rates is not None
    _, mean = _gather(rates, cell_of_row, len(count))
    return np.where(count > 0, mean, full)


def table_rate_of_rows(
    recording: Recording, target: str, preferred: tuple[str, ...] = ("table_angle", "table_rate")
) -> Floats | None:
    """Mean rate of the table over the interval of each row of ``target``, shape (n,) [rad/s]; None without a table."""
    angle = _angle_function(recording, preferred)
    if angle is None:
        return None
    if is_set(recording):
        return np.zeros(len(recording))
    start, end = _intervals(recording, target)
    return (angle(end) - angle(start)) / (end - start)


def _is_even(recording: Recording, target: str) -> bool:
    """Whether rows follow each other evenly, none left out."""
    return bool(np.ptp(np.diff(recording.t)) < 1e-6 * recording.dt) and target not in recording.left_out


def _intervals(recording: Recording, target: str) -> tuple[Floats, Floats]:
    """Start and end of the interval that each row of ``target`` stands for [s]."""
    dt, channel = recording.dt, recording.channel(target)
    steps = np.append(dt, np.diff(recording.t))
    width = np.where(steps <= GAP * dt, steps, dt) if channel.covers == "interval" else np.full(len(steps), dt)
    end = recording.t - channel.delay + (0.0 if channel.covers == "interval" else 0.5 * dt)
    return end - width, end


def table_share(recording: Recording, target: str) -> float:
    """Share of the table's rate that ``target`` shows: what it sees, times its gain."""
    return _shares(recording, target)[0] * recording.responses.get(target, Response()).gain


def _turn_rate(cells: _Cells) -> Floats | None:
    """Rate of the table at the edges, of an accelerometer; None where no table turns."""
    behind, names = cells.recording.table, order(cells.recording)
    stands = is_set(cells.recording) or (behind is not None and behind.still)
    if not cells.target.startswith("accel") or not names or stands:
        return None
    return cells.rate_edges(names)


def _temperature(recording: Recording, cell_of_row: NDArray[np.int64], n: int) -> Floats | None:
    """Temperature at the edges, from the smoothed means of the cells."""
    if "temperature" not in recording.channels:
        return None
    count, mean = _gather(recording.values("temperature", "K"), cell_of_row, n)
    filled = np.flatnonzero(count)
    edges = np.arange(n + 1.0)
    middle: Floats = edges[:-1] + 0.5
    return _at(middle, smoothed(np.interp(edges[:-1], filled, mean[filled])))(edges)


def up_direction(recording: Recording) -> Floats:
    """Unit vector of "up" in the axes of the triad: as the accelerometers feel it, else by the mounting."""
    names = ("accel_x", "accel_y", "accel_z")
    if all(name in recording.channels for name in names):
        force = np.array([recording.channels[name].values.mean() for name in names])
        return force / np.linalg.norm(force)
    return np.array([_UP.get(letter, 0.0) for letter in recording.mounting.axes])


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
            theta = _integral(recording, channel)(edges)
            theta = theta - np.linspace(theta[0], theta[-1], len(theta))
            total += factor * interval_mean(theta)
            known = True
    return total if known else None


def _others(recording: Recording, cell_of_row: NDArray[np.int64], n: int, prefix: str) -> dict[str, Floats]:
    """Cell means of the channels ``prefix`` + axis."""
    return {
        axis: _gather(recording.channels[prefix + axis].values, cell_of_row, n)[1]
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
            found[axis] = _gather((values - level) ** 2, cell_of_row, n)[1]
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
    upright = next((axis for axis, letter in zip("xyz", recording.mounting.axes, strict=True) if _UP.get(letter)), "z")
    level = target.startswith("gyro") and abs(projection) < LEVEL and target[-2:] != f"_{upright}"
    if not level or f"gyro_{upright}" in recording.channels:
        return {}
    return {upright: rate} if float(np.ptp(rate)) > CHANGES * float(np.abs(rate).max(initial=0.0)) > 0 else {}
