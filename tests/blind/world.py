"""What one recording's gyro went through, at instants inside each of its samples.

A sample that covers an interval is the Gauss-Legendre mean over it; one that is taken at an instant has one instant,
the row's time. Rows end their intervals: row k covers (k dt, (k + 1) dt].

Several runs of one test stand one behind the other: each begins at time zero, with the same programme of the table and
a climate of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from blind.climate import Climate
from blind.table import Floats, Trajectory

EARTH = 7.292115e-5
GRAVITY = 9.81


@dataclass(frozen=True)
class World:
    """Exposure of a single gyro.

    ``n`` counts the rows of all runs. ``tilt`` is the elevation of its axis above the table [rad]; ``turning`` says
    whether there is a table at all.
    """

    n: int
    dt: float
    profile: str
    trajectory: Trajectory
    climate: Climate
    tilt: float
    latitude: float
    instant: bool = False
    reference: float = 25.0  # temperature at which bias and scale factor are defined [degC]
    runs: int = 1

    @property
    def turning(self) -> bool:
        return self.profile != "rest"

    @property
    def each(self) -> int:
        """Rows of a run."""
        return self.n // self.runs

    @property
    def duration(self) -> float:
        """Of a run [s]."""
        return self.each * self.dt

    @property
    def rows(self) -> Floats:
        """Time of each row since its run began [s]."""
        return self.dt * np.tile(np.arange(1.0, self.each + 1), self.runs)

    @cached_property
    def _nodes(self) -> tuple[Floats, Floats]:
        if self.instant:
            return np.ones(1), np.ones(1)
        fastest = float(np.abs(self.trajectory.rate(self.rows)).max()) * self.dt
        x, weights = np.polynomial.legendre.leggauss(3 if fastest < 0.3 else 8)
        return 0.5 * (x + 1), 0.5 * weights

    def mean(self, values: Floats) -> Floats:
        """Samples (n,) of a quantity that is given at all instants (n, g)."""
        return values @ self._nodes[1]

    @cached_property
    def t(self) -> Floats:
        return self.dt * (np.tile(np.arange(float(self.each)), self.runs)[:, None] + self._nodes[0])

    @cached_property
    def table(self) -> Floats:
        """Rate of the table."""
        return self.trajectory.rate(self.t.ravel()).reshape(self.t.shape)

    @cached_property
    def a(self) -> Floats:
        return self.trajectory.angle(self.t.ravel()).reshape(self.t.shape)

    @cached_property
    def u(self) -> Floats:
        """Rate about the gyro's axis, the vertical part of the Earth's included."""
        return np.sin(self.tilt) * (self.table + EARTH * np.sin(self.latitude))

    @cached_property
    def rate_at_ends(self) -> tuple[Floats, Floats]:
        """The same where each sample begins and where it ends."""
        first, last = (self.trajectory.rate(self.rows - back) for back in (self.dt, 0.0))
        upright = EARTH * np.sin(self.latitude)
        return np.sin(self.tilt) * (first + upright), np.sin(self.tilt) * (last + upright)

    @cached_property
    def kelvins(self) -> Floats:
        """Temperature of the instrument [degC]."""
        return self.climate.at(self.t.ravel()).reshape(self.t.shape)

    def seen(self, climate: Climate) -> Floats:
        return climate.at(self.t.ravel()).reshape(self.t.shape)

    @cached_property
    def turned(self) -> Floats:
        """Mean rate of the table in each sample: exact, from the angle."""
        if self.instant:
            return self.table[:, 0]
        edges = self.trajectory.angle(self.dt * np.arange(self.each + 1.0))
        return np.tile(np.diff(edges) / self.dt, self.runs)

    def horizontal_earth(self, azimuth: float = 0.0) -> Floats:
        """The Earth's horizontal rate as the axis turns through north."""
        level = EARTH * np.cos(self.latitude) * np.cos(self.tilt)
        return self.mean(level * np.cos(self.a + azimuth))

    def encoder_shift(self, error: Floats) -> Floats:
        """What an encoder that reads ``error`` (n,) [rad] too much adds to measured minus reference."""
        by_run = error.reshape(self.runs, -1)
        if self.instant:
            return -np.sin(self.tilt) * np.concatenate([np.gradient(row, self.dt) for row in by_run])
        first = 2 * by_run[:, :1] - by_run[:, 1:2] if self.each > 1 else by_run[:, :1]
        return -np.sin(self.tilt) * np.diff(np.concatenate([first, by_run], axis=1), axis=1).ravel() / self.dt
