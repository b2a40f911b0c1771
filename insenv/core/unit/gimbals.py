r"""What a unit on a table of two or three axes is exposed to: kinematics, and the errors of the table.

    v_b = R_m T_k ... T_2 S_1 T_1 R_t v_n,      T_m = turn of the coordinates by the angle theta_m about axis m

takes the direction up and the Earth's rate from the level into the unit: R_t is the heading and tilt of the base, S_m
the angle by which axes m and m + 1 are short of a right one (about the direction normal to both), R_m the mounting of
the unit. Axes are letters of the unit's x (right), y (forward), z (up) at zero angles, from the outer to the inner. One
axis moves at a time, the outer before the inner: so the mean rate of an interval is exact,

    w = sum_m C_m a_m (theta_m' - theta_m) / dt + mean of the Earth's,

with C_m of the angles of the axes within m at the interval's beginning. A reading of an encoder is off by its
eccentricity: theta_m = reading_m - c_m cos(reading_m) - s_m sin(reading_m). Simpson's rule gives mean forces.
Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. (2004), sections 3.6 and 8.4.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.unit.rotations import Floats, Rotations, Vector, as_rows


@dataclass(frozen=True)
class Gimbals:
    """A table's axes, and how well its errors are known.

    Attributes
    ----------
    axes : str
        From the outer to the inner: "xz", "zxy".
    heading : float
        Azimuth of the base's forward axis as it is told [rad], clockwise from north.
    sd : tuple of float
        Standard deviations of the errors about zero [rad], in the order of `names`.
    most : tuple of float
        Largest angle of each axis [rad].
    noise : float
        White noise of an encoder's reading [rad].
    longest : float
        Longest dwell that can be commanded [s].
    mounted : float
        Angle by which the unit was put on the innermost axis turned about its z [rad].
    """

    axes: str
    heading: float = 0.0
    sd: tuple[float, ...] = ()
    most: tuple[float, ...] = ()
    noise: float = 0.0
    longest: float = 300.0
    mounted: float = 0.0

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of the table's errors: mounting of the unit, tilt and heading of the base, axes, encoders."""
        pairs = tuple(f"axes_{a}{b}.angle" for a, b in zip(self.axes[:-1], self.axes[1:], strict=True))
        encoders = tuple(f"encoder_{a}{m}.{part}" for m, a in enumerate(self.axes, 1) for part in "cs")
        return (*(f"mounting.{a}" for a in "xyz"), "base.tilt_x", "base.tilt_y", "base.heading", *pairs, *encoders)

    def true_angles(self, readings: Floats, errors: Floats) -> Floats:
        """Angles of readings without noise, both of shape (..., k, n), for errors of shape (..., q)."""
        from insenv.core.unit.encoder_kernel import true_angles  # Numba where an axis is read

        return self._by_axis(true_angles, readings, errors)

    def readings(self, angles: Floats, errors: Floats) -> Floats:
        """Readings without noise of true angles, the converse of `true_angles`."""
        from insenv.core.unit.encoder_kernel import readings

        return self._by_axis(readings, angles, errors)

    def _by_axis(self, kernel: Callable[..., None], values: Floats, errors: Floats) -> Floats:
        """What a kernel makes of rows of values (..., k, n) and of the encoders' errors."""
        k = len(self.axes)
        e = errors[..., 5 + k :].reshape(*errors.shape[:-1], k, 2)
        batch = np.broadcast_shapes(values.shape[:-1], e.shape[:-1])
        out = np.empty((*batch, values.shape[-1]))
        rows = as_rows(values, batch, 1)
        kernel(rows, as_rows(e, batch, 1), out.reshape(rows.shape))
        return out

    def level(self, errors: Floats, latitude: float | None) -> tuple[Vector, Vector]:
        """The direction up and the Earth's rate [rad/s] in the base's axes, components of shape (..., 1)."""
        shape = np.zeros((*errors.shape[:-1], 1))
        up: Vector = (shape, shape, shape + 1.0)
        if latitude is None:
            return self.based(up, errors), (shape, shape, shape)
        north, vertical = EARTH_RATE * np.cos(latitude), EARTH_RATE * np.sin(latitude)
        earth: Vector = (shape, shape + north, shape + vertical)
        return self.based(up, errors), self.based(earth, errors)

    def based(self, vector: Vector, errors: Floats) -> Vector:
        """A vector of the level (east, north, up) in the base's axes, components of shape (..., 1)."""
        turns = Rotations.of([("z", -(self.heading + errors[..., 5])), ("x", errors[..., 3]), ("y", errors[..., 4])])
        return turns.carry(vector, np.zeros((0, 1)))

    def inside(self, vector: Vector, angles: Floats, errors: Floats) -> Vector:
        """A vector of the base, components of shape (..., 1), in the unit, (..., n), for true angles (..., k, n)."""
        return self.rotations(errors).carry(vector, angles)

    def turning(self, rates: Floats, angles: Floats, errors: Floats) -> Vector:
        """Rate of the unit against the base in its own axes, for rates of the axes and angles, shape (..., k, n)."""
        return self.rotations(errors).spin(rates, angles)

    def rotations(self, errors: Floats) -> Rotations:
        """From the base to the unit, for errors of shape (..., q): axes with what is between them, and the mounting."""
        turns: list[tuple[str, Floats | int]] = []
        for m, letter in enumerate(self.axes):
            turns.append((letter, m))
            if m + 1 < len(self.axes):
                turns.append((self._normal(m), errors[..., 6 + m]))
        if self.mounted:
            turns.append(("z", np.array(self.mounted)))
        return Rotations.of(turns + [(letter, errors[..., i]) for i, letter in enumerate("xyz")])

    def _normal(self, m: int) -> str:
        """Letter of the direction that is normal to axes m and m + 1."""
        return next(letter for letter in "xyz" if letter not in self.axes[m : m + 2])


@dataclass(frozen=True)
class Exposed:
    """Mean rate against the inertial frame [rad/s] and mean specific force [m/s^2] of a unit; shape (..., n)."""

    rate: Vector
    force: Vector


def exposed(
    gimbals: Gimbals, errors: Floats, angles: Floats, rates: Floats, place: tuple[float | None, float]
) -> Exposed:
    """What the unit feels on n intervals.

    Parameters
    ----------
    gimbals : Gimbals
    errors : ndarray, shape (..., q)
        As `Gimbals.names` [rad].
    angles : ndarray, shape (..., k, 2 n + 1)
        True angles of the axes at the edges and, between them, in the middle of each interval [rad].
    rates : ndarray, shape (..., k, n)
        Mean rates of the axes over the intervals [rad/s].
    place : (float or None, float)
        Latitude [rad] (None: the Earth does not turn) and gravity [m/s^2].
    """
    latitude, gravity = place
    up, earth = gimbals.level(errors, latitude)
    rate, force = gimbals.rotations(errors).means(
        rates, angles, earth, (gravity * up[0], gravity * up[1], gravity * up[2])
    )
    return Exposed(rate, force)


def turn_time(angle: Floats | float, rate: Floats | float, acceleration: float) -> Floats:
    """Time of a turn from rest to rest [s]: even acceleration, even rate, even deceleration."""
    size = np.abs(angle)
    slow = size / rate + np.divide(rate, acceleration)
    time: Floats = np.where(size * acceleration >= np.square(rate), slow, 2 * np.sqrt(size / acceleration))
    return time


def course_time(gimbals: Gimbals, angles: Sequence[Sequence[float]], rate: float, acceleration: float) -> Floats:
    """Time that each change of position takes, the first from zero [s], shape (p,)."""
    path = np.concatenate([np.zeros((1, len(gimbals.axes))), np.asarray(angles, float)])
    times: Floats = turn_time(np.diff(path, axis=0), rate, acceleration).sum(axis=-1)
    return times
