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

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insenv.core.earth import EARTH_RATE

Floats = NDArray[np.float64]
#: A vector along a time axis: its three components, each of shape (..., n).
Vector = tuple[Floats, Floats, Floats]
#: Angles of which all cosines are taken at once.
_FEW = 200


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
        at = 5 + len(self.axes)
        e = errors[..., at:].reshape(*errors.shape[:-1], len(self.axes), 2)[..., None]
        cosine, sine = _cos_sin(readings)
        angles: Floats = readings - e[..., 0, :] * cosine - e[..., 1, :] * sine
        return angles

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
        return _turned(vector, self._base(errors))

    def inside(self, vector: Vector, angles: Floats, errors: Floats) -> Vector:
        """A vector of the base in the unit, components of shape (..., n), for true angles of shape (..., k, n)."""
        for m, letter in enumerate(self.axes):
            vector = _turn(vector, letter, angles[..., m, :])
            if m + 1 < len(self.axes):
                vector = _turn(vector, self._normal(m), errors[..., 6 + m, None])
        return _turned(vector, self._mounted(errors))

    def turning(self, rates: Floats, angles: Floats, errors: Floats) -> Vector:
        """Rate of the unit against the base in its own axes, for rates of the axes and angles, shape (..., k, n)."""
        zero = np.zeros(np.broadcast_shapes(rates.shape[:-2], errors.shape[:-1]) + rates.shape[-1:])
        vector: Vector = (zero, zero, zero)
        for m, letter in enumerate(self.axes):
            vector = _turn(vector, letter, angles[..., m, :])
            i = "xyz".index(letter)
            vector = (
                vector[0] + rates[..., m, :] if i == 0 else vector[0],
                vector[1] + rates[..., m, :] if i == 1 else vector[1],
                vector[2] + rates[..., m, :] if i == 2 else vector[2],
            )
            if m + 1 < len(self.axes):
                vector = _turn(vector, self._normal(m), errors[..., 6 + m, None])
        return _turned(vector, self._mounted(errors))

    def _normal(self, m: int) -> str:
        """Letter of the direction that is normal to axes m and m + 1."""
        return next(letter for letter in "xyz" if letter not in self.axes[m : m + 2])

    def _base(self, errors: Floats) -> Iterator[tuple[str, Floats]]:
        """Heading, counted clockwise, and tilts about right and forward."""
        yield "z", -(self.heading + errors[..., 5, None])
        yield "x", errors[..., 3, None]
        yield "y", errors[..., 4, None]

    def _mounted(self, errors: Floats) -> Iterator[tuple[str, Floats]]:
        if self.mounted:
            yield "z", np.array([self.mounted])
        for i, letter in enumerate("xyz"):
            yield letter, errors[..., i, None]


def _turned(vector: Vector, turns: Iterator[tuple[str, Floats]]) -> Vector:
    for letter, angle in turns:
        vector = _turn(vector, letter, angle)
    return vector


def _cos_sin(angle: Floats) -> tuple[Floats, Floats]:
    """Cosine and sine, where many neighbours are the same (a table rests, or another axis turns) of one of them."""
    flat = np.ascontiguousarray(angle).reshape(-1)
    if len(flat) < _FEW:
        return np.cos(angle), np.sin(angle)
    new = np.empty(len(flat), bool)
    new[0] = True
    np.not_equal(flat[1:], flat[:-1], out=new[1:])
    at = np.cumsum(new)
    if at[-1] > 0.5 * len(flat):
        return np.cos(angle), np.sin(angle)
    values = flat[new]
    at -= 1
    return np.cos(values)[at].reshape(angle.shape), np.sin(values)[at].reshape(angle.shape)


def _turn(vector: Vector, letter: str, angle: Floats) -> Vector:
    """Components in axes that are turned by ``angle`` about one of them."""
    i = "xyz".index(letter)
    j, k = (i + 1) % 3, (i + 2) % 3
    c, s = _cos_sin(angle)
    found = list(vector)
    found[j], found[k] = c * vector[j] + s * vector[k], c * vector[k] - s * vector[j]
    return found[0], found[1], found[2]


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
    turning = gimbals.turning(rates, angles[..., :-1:2], errors)
    # Both at once: cosines and sines of the angles are the costly part.
    front = (2, *(1,) * (angles.ndim - errors.ndim - 1), *errors.shape[:-1], 1)
    both = [np.stack(pair).reshape(front) for pair in zip(*gimbals.level(errors, latitude), strict=True)]
    (up_x, earth_x), (up_y, earth_y), (up_z, earth_z) = (
        _simpson(v) for v in gimbals.inside((both[0], both[1], both[2]), angles, errors)
    )
    rate = (turning[0] + earth_x, turning[1] + earth_y, turning[2] + earth_z)
    return Exposed(rate, (gravity * up_x, gravity * up_y, gravity * up_z))


def _simpson(values: Floats) -> Floats:
    """Means over intervals, of values at their edges and middles."""
    mean: Floats = (values[..., :-1:2] + 4.0 * values[..., 1::2] + values[..., 2::2]) / 6.0
    return mean


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
