"""The motion of a table on the cells of a target, from what was logged of it.

Rates are differences of their integral over the cell's edges, so that the mean over a cell is exact; states are given
at the edges. A reading with noise is kept as it is, for that noise is fitted; curves are made of the motion behind it
(`insenv.core.series.trajectory`, `insenv.data.cells.follow`), and of a programme where the table has it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import cast

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Channel, Floats, Recording
from insenv.core.series.trajectory import Trajectory
from insenv.data.cells.follow import followed
from insenv.data.cells.rows import interpolated, intervals, is_even, means_of_rows, without_leaps
from insenv.data.reference import at_cells, is_in_points, is_set, order, programme
from insenv.data.resample import through

#: Share of the second difference at one end of a row, of that at the other, below which the rate has a corner in it.
CORNER = 0.25
#: Share of a row within which a delay is a whole number of rows.
WHOLE = 0.01
#: Share of the largest rate by which a commanded rate that holds may change from cell to cell.
STEADY = 1e-7
#: A table has its commanded rate where it is off by so many times what it usually is (this quantile), or by so small a
#: share of the largest rate; not where it is off by so large a share. It follows a command that it has this
#: share of the time.
USUAL, FAR_OFF, SAME_RATE, OTHER_RATE, FOLLOWED = 0.3, 12.0, 1e-3, 0.02, 0.6


@dataclass(frozen=True)
class TableMotion:
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
class TargetCells:
    """The cells of a target, and what is known of the table on them."""

    recording: Recording
    target: str
    cell_of_row: NDArray[np.int64]
    count: NDArray[np.int64]
    edges: Floats
    covered: Floats | None = None
    angles: dict[tuple[str, ...], _Angle] = field(default_factory=dict)

    def table(self, share: float, reading: Floats) -> TableMotion:
        """The table as an instrument that sees ``share`` of it, and reads ``reading``, tells it from jitter."""
        names, behind = order(self.recording), self.recording.table
        n = len(self.count)
        if not names:
            return TableMotion(np.zeros(n), np.zeros(n), None, None)
        if is_set(self.recording):
            angle = at_cells(self.recording.channels["table_angle"], self.cell_of_row, n)
            return TableMotion(np.zeros(n), np.zeros(n), np.zeros(n + 1), angle)
        if is_in_points(self.recording):
            rate = means_of_rows(self.recording.channels["table_rate"].values, self.cell_of_row, n)[1]
            return TableMotion(rate, rate, np.zeros(n + 1), None)
        if behind is not None and behind.still:
            # The noise of an encoder is no motion: neither to subtract nor to make a curve of.
            return TableMotion(np.zeros(n), np.zeros(n), np.zeros(n + 1), np.full(n + 1, behind.angle[0]))
        told, beside = programme(self.recording), None
        if behind is not None:
            rate, at_edges = self._smoothed(behind)
            at_rows = self._of_instants(behind)
            rate = rate + at_rows
            if names[0] == "table_angle" and not is_even(self.recording, self.target):
                over_rows, beside = self._over_rows(behind, names)
                reference = over_rows + beside + at_rows
            elif self._read_beside(names):
                reference = self._rate(names)
            else:
                reference = self._rate(names) + at_rows + self._between(behind, names)
        else:
            reference = self._rate(names) + self._of_instants_on(names)
            rate, at_edges = self._followed(names, reference, share, reading)
        if told is not None:
            rate, at_edges = self._by_programme(told, rate, at_edges)
        return TableMotion(reference, rate, at_edges, self._turned(names, behind), beside)

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
        stops = behind.stops(0.5 * (self.edges[1:] + self.edges[:-1]), rate, self._step)
        inside = np.concatenate([stops[:1], stops[1:] & stops[:-1], stops[-1:]])
        return np.where(stops, 0.0, rate), np.where(inside, 0.0, at_edges)

    def _of_instants(self, behind: Trajectory) -> Floats:
        """What a mean of readings at instants is more than the mean over the cells: -dt^2/24 of the second derivative.

        Of a table that swings once a second, read every 10 ms, that is 0.02 % of the rate.
        """
        if self.recording.channels[self.target].covers != "instant":
            return np.zeros(len(self.count))
        return -(self.recording.dt**2) / 24 * np.diff(behind.acceleration_at(self.edges)) / self._step

    def _of_instants_on(self, names: tuple[str, ...]) -> Floats:
        """The same by the curve through readings of an angle; a rate that was read is as it was read.

        With it, and 9/320 of the fourth difference, the rate at an instant is that of the seven readings around it,
        whose error is of the sixth order: of 20 readings in a swing 4 ppm, where three leave 1.6 %, five 300 ppm.
        """
        own, read = self.recording.channels[self.target], self.recording.channels[names[0]]
        if names[0] != "table_angle" or read.source != "encoder" or own.covers != "instant":
            return np.zeros(len(self.count))
        angle, dt = self._angle(names).of_time, self.recording.dt
        a, b, c, d, e = (angle(self.edges + rows * dt) for rows in (-2, -1, 0, 1, 2))
        second, fourth = b - 2 * c + d, a - 4 * b + 6 * c - 4 * d + e
        return np.diff(9 / 320 * fourth - second / 24) / self._step

    def _between(self, behind: Trajectory, names: tuple[str, ...]) -> Floats:
        """What the straight line between two readings of an angle leaves of the rate, where edges lie between them."""
        if names[0] != "table_angle":
            return np.zeros(len(self.count))
        times = self.recording.t - self.recording.channels[names[0]].delay
        bow = behind.angle_at(self.edges) - interpolated(times, behind.angle_at(times))(self.edges)
        return np.diff(bow) / self._step

    def _over_rows(self, behind: Trajectory, names: tuple[str, ...]) -> tuple[Floats, Floats]:
        """Mean rate of the motion behind a noisy angle over the rows' very intervals, and the rest over whole cells.

        Intervals of uneven rows do not join: of an encoder's steps a part would be left between any two, white noise.
        """
        channel = self.recording.channels[names[0]]
        times = self.recording.t - channel.delay
        start, end = intervals(self.recording, self.target)
        moved = behind.angle_at(end) - behind.angle_at(start)
        full = np.diff(behind.angle_at(self.edges)) / self._step
        _, mean = means_of_rows(moved / (end - start), self.cell_of_row, len(self.count), self.covered)
        kept = ~self.recording.left_out.get(self.target, np.zeros(len(times), dtype=bool))
        rest = without_leaps(
            times[kept], (channel.values - behind.angle_at(times))[kept], self.recording.dt, behind.noise
        )
        return np.where(self.count > 0, mean, full), np.diff(interpolated(times[kept], rest)(self.edges)) / self._step

    @property
    def _step(self) -> float:
        return float(self.edges[1] - self.edges[0])

    def _angle(self, names: tuple[str, ...]) -> _Angle:
        """The table's angle from the first of the channels ``names``: a curve through all rows is made once."""
        if names not in self.angles:
            angle = angle_of_time(self.recording, names)
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
        """Mean rate over the very intervals of a cell's rows, from the first of the channels ``names``.

        Of an even clock without gaps that is the mean over the cell. Where rows are lost, or steps differ a little, the
        table may have turned otherwise in the rest of the cell.
        """
        full = np.diff(self._angle(names).at_edges) / self._step
        if self._read_beside(names):
            # Read at the very times of the target: a mean with its neighbours would mix their noise, and where a ramp
            # begins it is no reading at an instant.
            rates: Floats | None = self.recording.channels[names[0]].values
        elif is_even(self.recording, self.target):
            return full
        else:
            rates = table_rate_of_rows(self.recording, self.target, names)
        assert rates is not None
        _, mean = means_of_rows(rates, self.cell_of_row, len(self.count), self.covered)
        return np.where(self.count > 0, mean, full)

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


def integral(recording: Recording, channel: Channel) -> Callable[[Floats], Floats]:
    """The integral of a rate channel as a function of time: exact at the rows, linear between them.

    Of a rate that is late by no whole number of rows, intervals end between the rows that it was read at: there it is
    the cubic whose slopes are the readings, for a line would take the mean of two intervals, (w h)^2 / 8 too little.
    """
    times = recording.t - channel.delay
    steps = np.diff(times)
    v = channel.values
    means = v[1:] if channel.covers == "interval" else 0.5 * (v[1:] + v[:-1])
    if channel.covers == "instant" and channel.source == "command" and len(v) > 3:
        means = means - _bow(v)
    total = np.concatenate([[0.0], np.cumsum(means * steps)])
    late = channel.delay / recording.dt
    between = channel.covers == "instant" and abs(late - round(late)) > WHOLE
    return interpolated(times, total, partial(_with_slopes, v) if between else None)


def _with_slopes(slopes: Floats, times: Floats, values: Floats) -> Callable[[Floats], Floats]:
    """The cubics between readings that have these slopes there."""
    from scipy.interpolate import CubicHermiteSpline  # slow to import

    return cast(Callable[[Floats], Floats], CubicHermiteSpline(times, values, slopes))


def _bow(values: Floats) -> Floats:
    """What the straight line between two values of a curve has more than their mean, shape (n - 1,).

    A twelfth of the second difference, the mean of those at both ends; nothing at a corner, where one of them is next
    to none and nothing tells when within the row the rate bends.
    """
    bend = np.diff(values, 2)
    before, after = np.append(bend[:1], bend), np.append(bend, bend[-1:])
    corner = np.minimum(np.abs(before), np.abs(after)) < CORNER * np.maximum(np.abs(before), np.abs(after))
    return np.where(corner, 0.0, 0.5 * (before + after)) / 12


def angle_of_time(recording: Recording, preferred: tuple[str, ...]) -> Callable[[Floats], Floats] | None:
    """The table's angle as a function of time, from the first of the ``preferred`` channels that is there."""
    for name in preferred:
        if name in recording.channels:
            channel = recording.channels[name]
            if name == "table_angle":
                # Between readings without noise a line cuts (w h)^2 / 8 of a swing, where edges lie between the rows.
                curve = through if channel.source == "encoder" and recording.table is None else None
                return interpolated(recording.t - channel.delay, channel.values, curve)
            return integral(recording, channel)
    return None


def table_rate_of_rows(
    recording: Recording, target: str, preferred: tuple[str, ...] = ("table_angle", "table_rate")
) -> Floats | None:
    """Mean rate of the table over the interval of each row of ``target``, shape (n,) [rad/s]; None without a table."""
    angle = angle_of_time(recording, preferred)
    if angle is None:
        return None
    if is_set(recording):
        return np.zeros(len(recording))
    if is_in_points(recording):
        return recording.channels["table_rate"].values
    start, end = intervals(recording, target)
    return (angle(end) - angle(start)) / (end - start)
