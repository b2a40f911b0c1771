r"""What error-free gyros and accelerometers sense on a known path, as increments: the converse of `strapdown`.

    omega_ib^b = omega_nb^b + C_n^b (omega_ie^n + omega_en^n)
    f^b        = C_n^b (v' + (2 omega_ie^n + omega_en^n) x v - g^n)

An increment is the integral of these over its interval. Both are turned by C_n^b(t) at each instant: f^b in the
middle of an interval is not its mean. At rest the integrals have closed forms; on a path they are taken by
Gauss-Legendre quadrature, which leaves rounding alone where the path is smooth within an interval.
Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. (2004), section 3.5; coning:
chapter 11 (here with the cone about body z).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insenv.core import earth
from insenv.core.errors import InputError

Floats = NDArray[np.float64]

#: Nodes per interval; ten integrate half a period of a sine to 1e-15 of its amplitude.
NODES = 10
_BLOCK = 4096


@dataclass(frozen=True)
class Kinematics:
    """Motion of the body at instants; leading axes (...) are broadcast together, the last of them is time.

    Attributes
    ----------
    dcm : ndarray, shape (..., 3, 3)
        C_b^n: body (right, forward, up) to east, north, up.
    rate : ndarray, shape (..., 3)
        omega_nb^b: rate of the body against the navigation frame, in body axes [rad/s].
    velocity, acceleration : ndarray, shape (..., 3)
        Velocity against the Earth in east, north, up, and the derivative of these components [m/s], [m/s^2].
    position : ndarray, shape (..., 3)
        Latitude, longitude [rad], height [m].
    """

    dcm: Floats
    rate: Floats
    velocity: Floats
    acceleration: Floats
    position: Floats


#: Motion at the times t, shape (k,) [s].
Path = Callable[[Floats], Kinematics]


def transport_rate(position: ArrayLike, velocity: ArrayLike) -> Floats:
    """Rate omega_en^n of the navigation frame over the WGS 84 ellipsoid, shape (..., 3) [rad/s].

    position : latitude, longitude [rad], height [m], shape (..., 3). velocity : east, north, up, shape (..., 3).
    """
    p, v = np.broadcast_arrays(np.asarray(position, np.float64), np.asarray(velocity, np.float64))
    x = 1.0 - earth.ECCENTRICITY_SQUARED * np.sin(p[..., 0]) ** 2
    normal = earth.SEMI_MAJOR_AXIS / np.sqrt(x)
    meridian = normal * (1.0 - earth.ECCENTRICITY_SQUARED) / x
    east = v[..., 0] / (normal + p[..., 2])
    return np.stack([-v[..., 1] / (meridian + p[..., 2]), east, east * np.tan(p[..., 0])], axis=-1)


def sensed(k: Kinematics) -> tuple[Floats, Floats]:
    """Rate omega_ib^b [rad/s] and specific force f^b [m/s^2] of error-free sensors, each shape (..., 3)."""
    turning = earth.earth_rate_enu(k.position[..., 0])
    transport = transport_rate(k.position, k.velocity)
    force = k.acceleration + np.cross(2.0 * turning + transport, k.velocity)
    force = force + _up(earth.gravity(k.position[..., 0], k.position[..., 2]))
    return k.rate + _in_body_axes(k.dcm, turning + transport), _in_body_axes(k.dcm, force)


def increments(path: Path, t: ArrayLike) -> tuple[Floats, Floats]:
    """Increments of error-free gyros [rad] and accelerometers [m/s] on a path, each shape (..., n, 3).

    t : edges of the intervals, shape (n + 1,), rising [s]. The path is smooth within each. Raises InputError.
    """
    edges = _edges(t)
    node, weight = np.polynomial.legendre.leggauss(NODES)
    parts = []
    for first in range(0, edges.size - 1, _BLOCK):
        part = edges[first : first + _BLOCK + 1]
        half = 0.5 * np.diff(part)
        at = (part[:-1] + half)[:, None] + half[:, None] * node
        both = sensed(path(at.ravel()))
        weights = half[:, None, None] * weight[:, None]
        parts.append([(x.reshape(*x.shape[:-2], *at.shape, 3) * weights).sum(axis=-2) for x in both])
    gyro, accelerometer = (np.concatenate(x, axis=-2) for x in zip(*parts, strict=True))
    return gyro, accelerometer


def increments_at_rest(dcm: ArrayLike, position: ArrayLike, dt: float, n: int) -> tuple[Floats, Floats]:
    """Increments of a base at rest, each shape (..., n, 3), by closed form; read-only, for all n are the same.

    dcm : C_b^n, shape (..., 3, 3). position : latitude, longitude [rad], height [m], shape (..., 3). dt in s.
    """
    c, p = np.asarray(dcm, np.float64), np.asarray(position, np.float64)
    turning, force = earth.earth_rate_enu(p[..., 0]), _up(earth.gravity(p[..., 0], p[..., 2]))
    gyro, accelerometer = (_in_body_axes(c, x * dt)[..., None, :] for x in (turning, force))
    shape = (*gyro.shape[:-2], n, 3)
    return np.broadcast_to(gyro, shape), np.broadcast_to(accelerometer, shape)


def turn(
    t: ArrayLike, angle: ArrayLike, rate: ArrayLike, dcm: ArrayLike, position: ArrayLike, axis: ArrayLike = (0, 0, 1)
) -> Path:
    """Path of a body that turns on the spot about a fixed axis.

    Parameters
    ----------
    t : array_like, shape (n + 1,)
        Edges of the intervals [s].
    angle, rate : array_like, shape (n + 1,)
        Angle [rad] and its derivative [rad/s] at the edges, right-handed about ``axis``. Between them the angle is
        the cubic through both: exact where the angular acceleration is constant or linear in an interval.
    dcm : array_like, shape (..., 3, 3)
        C_b^n at angle zero.
    position : array_like, shape (3,)
    axis : array_like, shape (3,)
        In east, north, up, of any length: up on a level base, the normal of a slope.
    """
    from scipy.interpolate import CubicHermiteSpline

    course = CubicHermiteSpline(_edges(t), np.asarray(angle, np.float64), np.asarray(rate, np.float64))
    speed = course.derivative()
    a = np.asarray(axis, np.float64) / np.linalg.norm(np.asarray(axis, np.float64))
    start = np.asarray(dcm, np.float64)
    along = a[:, None] * (a @ start)[..., None, :]
    across = np.swapaxes(np.cross(a, np.swapaxes(start, -1, -2)), -1, -2)
    body_axis = (a @ start)[..., None, :]

    def path(time: Floats) -> Kinematics:
        phi = course(time)[:, None, None]
        parts = (x[..., None, :, :] for x in (along, start - along, across))
        fixed, cosine, sine = parts
        still = np.zeros((time.size, 3))
        here = np.broadcast_to(np.asarray(position, np.float64), still.shape)
        turned = fixed + np.cos(phi) * cosine + np.sin(phi) * sine
        return Kinematics(turned, speed(time)[:, None] * body_axis, still, still, here)

    return path


def coning(half_angle: float, frequency: float, dcm: ArrayLike, position: ArrayLike) -> Path:
    """Path of a body on the spot whose z axis moves on a cone about that of ``dcm``.

    Its rotation vector against ``dcm``, shape (3, 3), is ``half_angle (cos wt, sin wt, 0)``, w = 2 pi frequency.
    """
    w, s, c = 2.0 * np.pi * frequency, np.sin(half_angle), np.cos(half_angle)
    start = np.asarray(dcm, np.float64)

    def path(time: Floats) -> Kinematics:
        x, y, zero = np.cos(w * time), np.sin(w * time), np.zeros_like(time)
        rows = (
            (c + (1 - c) * x * x, (1 - c) * x * y, s * y),
            ((1 - c) * x * y, c + (1 - c) * y * y, -s * x),
            (-s * y, s * x, zero + c),
        )
        cone = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
        rate = np.stack([-s * w * y, s * w * x, zero - (1 - c) * w], axis=-1)
        still = np.zeros((time.size, 3))
        here = np.broadcast_to(np.asarray(position, np.float64), still.shape)
        return Kinematics(start @ cone, rate, still, still, here)

    return path


def sampled(t: ArrayLike, dcm: ArrayLike, velocity: ArrayLike, position: ArrayLike) -> Path:
    """Path through a trajectory known at edges: splines with continuous angular and linear acceleration.

    t : shape (n + 1,), n >= 3 [s]. dcm : shape (n + 1, 3, 3). velocity, position : shape (n + 1, 3), as in
    `Kinematics`; the position enters gravity and curvature only. Raises InputError.
    """
    from scipy.interpolate import CubicSpline
    from scipy.spatial.transform import Rotation, RotationSpline

    edges = _edges(t)
    c, v, p = (np.asarray(x, np.float64) for x in (dcm, velocity, position))
    shapes = tuple(x.shape for x in (c, v, p))
    if edges.size < 4 or shapes != ((edges.size, 3, 3), (edges.size, 3), (edges.size, 3)):
        raise InputError(
            f"a trajectory of {edges.size} times with attitude, velocity and position of shapes {shapes} was given; "
            "wanted (n + 1, 3, 3), (n + 1, 3) and (n + 1, 3) with n of 3 or more"
        )
    attitude = RotationSpline(edges, Rotation.from_matrix(c))
    course, place = CubicSpline(edges, v), CubicSpline(edges, p)

    def path(time: Floats) -> Kinematics:
        return Kinematics(attitude(time).as_matrix(), attitude(time, 1), course(time), course(time, 1), place(time))

    return path


def _edges(t: ArrayLike) -> Floats:
    edges = np.asarray(t, np.float64)
    if edges.ndim != 1 or edges.size < 2 or not (np.diff(edges) > 0).all():
        raise InputError(f"edges of intervals of shape {edges.shape} were given; wanted two or more rising times")
    return edges


def _up(size: Floats) -> Floats:
    return size[..., None] * np.array([0.0, 0.0, 1.0])


def _in_body_axes(dcm: Floats, vector: Floats) -> Floats:
    """C_n^b v, shape (..., 3)."""
    return np.asarray(np.einsum("...ji,...j->...i", dcm, vector))
