"""A recording: channels on a common time base, simulated and measured alike.

Time of a row: an increment, and a rate that ``covers`` its interval, belongs to the interval that *ends* at
the row's time; angles, temperatures and instantaneous rates are values *at* the row's time. A channel with a
``delay`` shows a value that is older than the row's time by that much.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from insenv.core import earth
from insenv.core.errors import InputError
from insenv.core.series.trajectory import Trajectory
from insenv.core.unit.gimbals import Gimbals

Floats = NDArray[np.float64]
Covers = Literal["instant", "interval"]
#: What a channel of a table shows: what was measured, what was asked for, or where it was set from rest to rest.
Origin = Literal["encoder", "command", "set"]

#: An interval longer than this many sampling periods is a gap.
GAP = 1.5
#: Periods of a gap up to which its rows were lost, and share of a period by which it is then no whole number of them.
FEW_LOST, CLEAR = 10.0, 0.25


@dataclass(frozen=True)
class Channel:
    """One column of a recording.

    Attributes
    ----------
    values : ndarray, shape (n,)
        Samples in SI units.
    unit : str
        The SI unit: "rad/s", "rad", "m/s^2" or "K".
    covers : "instant" or "interval"
        Whether a sample is the value at the row's time or the mean over the interval that ends there.
    delay : float
        Age of the value at the row's time [s].
    source : "encoder", "command", "set" or None
        Of a table's angle or rate: whether it was measured or asked for, or an angle set from rest to rest, with no
        row of the turns between; None where nobody said.
    every : float
        Time from reading to reading [s], where it was not read at every row; 0 where it was.
    step : float
        Of increments: what one count of their counter is, as a rate over the usual row; 0 where nobody counted.
    by_period : bool
        Of increments: whether they were taken to cover one sampling period each, whatever their stamps.
    """

    values: Floats
    unit: str
    covers: Covers = "instant"
    delay: float = 0.0
    source: Origin | None = None
    every: float = 0.0
    step: float = 0.0
    by_period: bool = False


@dataclass(frozen=True)
class Response:
    """How an output follows the table: ``gain`` times its rate, ``lag`` seconds behind what was logged of it.

    ``ahead`` rows before the first one the output was renewed: bins begin there, so that each holds whole renewals.
    ``filtered``: the lag is no delay but that of a first-order filter, which also makes fast motion smaller.
    ``window``: what was logged is a mean over so many seconds, which makes it smaller too; the lag is that of the mean.
    """

    gain: float = 1.0
    lag: float = 0.0
    ahead: int = 0
    filtered: bool = False
    window: float = 0.0


@dataclass(frozen=True)
class Segment:
    """A labelled stretch of rows ``[start, stop)``: a rest, a dwell, a turn."""

    label: str
    start: int
    stop: int


@dataclass(frozen=True)
class Site:
    """Where the instrument stands: latitude [rad], altitude [m], gravity [m/s^2]; None where nobody said."""

    latitude: float | None = None
    altitude: float = 0.0
    gravity: float | None = None

    @property
    def local_gravity(self) -> float | None:
        """Gravity, as given or by the latitude [m/s^2]; None where nobody said either."""
        if self.gravity is not None or self.latitude is None:
            return self.gravity
        return float(earth.gravity(self.latitude, self.altitude))


@dataclass(frozen=True)
class Mounting:
    """How the instrument is mounted.

    ``tilt`` is the elevation of a single gyro's input axis above the table plane [rad] (pi/2: along the table
    axis, upwards). ``axes`` names the directions of a triad's x, y and z, e.g. "RFU" or "FRD". ``table_axis`` is "U" or
    "D" for a triad that turns about the vertical, positive about that direction; "" where nobody said: then ``tilt``
    stands for every gyro. ``base_turned`` is how far what carries table and instrument, or the parked vehicle, was
    turned since the first run, clockwise from above [rad]. ``gimbals`` are the axes of a table with several.
    """

    tilt: float = np.pi / 2
    axes: str = "RFU"
    table_axis: str = ""
    base_turned: float = 0.0
    gimbals: Gimbals | None = None


@dataclass(frozen=True)
class Recording:
    """Channels of one run on a common time base.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Time of each row [s], strictly increasing.
    channels : mapping of str to Channel
        Canonical name (``gyro``, ``accel_x``, ``table_angle``, ``temperature``, ...) to its samples.
    segments : tuple of Segment
    site, mounting : Site, Mounting
    label : str
        What to call the run in messages and reports (usually the file's name).
    notes : tuple of str
        What reading did to the rows, in words.
    left_out : mapping of str to ndarray of bool, shape (n,)
        Rows of a channel that are no measurements of it: outliers.
    unused : ndarray of bool, shape (n,), optional
        Rows that are neither fitted nor held out: what is counted of a recording leaves them out.
    period : float, optional
        Sampling period [s] where it was chosen: steps between means that a few gaps part do not tell it.
    table : Trajectory, optional
        The motion of the table behind a noisy reading of it.
    responses : mapping of str to Response
        How instruments follow the table, where their gain is not one.
    made_of : ndarray of int, shape (n, 2), optional
        First row of the file that a mean holds, and the one behind its last, where rows are means.
    """

    t: Floats
    channels: Mapping[str, Channel]
    segments: tuple[Segment, ...] = ()
    site: Site = field(default_factory=Site)
    mounting: Mounting = field(default_factory=Mounting)
    label: str = "recording"
    notes: tuple[str, ...] = ()
    left_out: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)
    unused: NDArray[np.bool_] | None = None
    period: float | None = None
    table: Trajectory | None = None
    responses: Mapping[str, Response] = field(default_factory=dict)
    made_of: NDArray[np.int_] | None = None

    def __len__(self) -> int:
        return len(self.t)

    def channel(self, name: str) -> Channel:
        """Channel ``name``.

        Raises
        ------
        InputError
            If the recording has none of that name.
        """
        if name not in self.channels:
            there = ", ".join(self.channels) or "none"
            raise InputError(f"{self.label}: no channel {name!r}; there are {there}")
        return self.channels[name]

    def values(self, name: str, unit: str) -> Floats:
        """Samples of channel ``name``, shape (n,), checked to be in ``unit``.

        Raises
        ------
        InputError
            If the recording has no such channel, or has it in another unit.
        """
        channel = self.channel(name)
        if channel.unit != unit:
            raise InputError(f"{self.label}: channel {name!r} is in {channel.unit}, wanted in {unit}")
        return channel.values

    @cached_property
    def dt(self) -> float:
        """Sampling period [s]: the mean of the steps that are no gap, so that jitter averages out.

        Where a few rows are lost the clock has gone on: what such a step is longer or shorter than whole periods is
        jitter as well, and without it that of both its ends would not average out.
        """
        if self.period is not None:
            return self.period
        steps = np.diff(self.t)
        usual = steps <= GAP * np.median(steps)
        mean = float(np.mean(steps[usual]))
        ticks = np.where(usual, 1.0, np.rint(steps / mean))
        lost = ~usual & (ticks <= FEW_LOST) & (np.abs(steps / mean - ticks) < CLEAR)
        counted = usual | lost
        return float(steps[counted].sum() / ticks[counted].sum()) if lost.any() else mean

    def pieces(self) -> tuple[slice, ...]:
        """Contiguous stretches of rows, in order: a step longer than ``GAP`` periods starts a new one."""
        breaks = np.flatnonzero(np.diff(self.t) > GAP * self.dt) + 1
        edges = [0, *breaks.tolist(), len(self.t)]
        return tuple(slice(a, b) for a, b in pairwise(edges))


def rows_between(recording: Recording, start: int, stop: int) -> Recording:
    """The rows ``[start, stop)`` of a recording, at their times."""
    channels = {n: replace(c, values=c.values[start:stop]) for n, c in recording.channels.items()}
    cut = (Segment(s.label, max(s.start, start) - start, min(s.stop, stop) - start) for s in recording.segments)
    segments = tuple(segment for segment in cut if segment.start < segment.stop)
    left_out = {name: mask[start:stop] for name, mask in recording.left_out.items()}
    found = replace(recording, t=recording.t[start:stop], channels=channels, segments=segments, left_out=left_out)
    unused = None if recording.unused is None else recording.unused[start:stop]
    return replace(found, unused=unused, made_of=None if recording.made_of is None else recording.made_of[start:stop])
