r"""Two-position calibration: the equations of one and of two positions.

With the velocities v_j = a1 t + a2 t^2 + a3 t^3 of the static mechanisation since a position began, u = phi' at t = 0
and c, s of the turn angle, counter-clockwise about up:

    (6)  u_E = 2 a2_N / g,   u_N = -2 a2_E / g,   u_U = -6 a3_N / (g omega_N) - 2 a2_E tan L / g
    (7)  phi_E = a1_N / g,   phi_N = -a1_E / g,   phi_U = phi_N tan L - u_E / omega_N
         eps_N = -u_N - phi_E omega_U                                                         (first position)
    (15) nabla_E = a1_E / 2 + s a1_N / 2 (1 - c),        nabla_N = a1_N / 2 - s a1_E / 2 (1 - c)
    (16) eps_N = -u_N + nabla_N^I omega_U / g,           eps_E = (s eps_N - u_E) / (1 - c)
    (14) phi_E = (a1_N - nabla_N) / g,  phi_N = (nabla_E - a1_E) / g,  phi_U = phi_N tan L - (u_E + eps_E) / omega_N

Source: Guo, Li, He (2018), DOI 10.11977/j.issn.1004-2474.2018.01.016, equations (5) to (20). Not as printed: the third
coefficient of (5), the sign in (7), the superscripts in (12) and (13), and M and N of (17), (18), which make (16)
singular at 180 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from insenv.core.recording import Floats


@dataclass(frozen=True)
class Position:
    """What the velocities of one position tell, biases ignored: equations (6) and (7).

    Attributes
    ----------
    a : ndarray, shape (..., 3, 2)
        Coefficients of t, t^2, t^3; east and north.
    u : ndarray, shape (..., 3)
        Rate of the misalignment at the start [rad/s].
    phi : ndarray, shape (..., 3)
        Misalignment at the start [rad].
    gyro_north : ndarray, shape (...)
        North gyro bias [rad/s].
    """

    a: Floats
    u: Floats
    phi: Floats
    gyro_north: Floats

    def propagated(self, t: Floats, rate: tuple[float, float]) -> Floats:
        """Misalignment after ``t``, shape (..., 3): phi + u t + (u x omega) t^2 / 2, with u_U = phi_E omega_N."""
        north, up = rate
        u = np.stack([self.u[..., 0], self.u[..., 1], self.phi[..., 0] * north], axis=-1)
        bend = np.stack([u[..., 1] * up - u[..., 2] * north, -u[..., 0] * up, u[..., 0] * north], axis=-1)
        return np.asarray(self.phi + u * t[..., None] + 0.5 * bend * t[..., None] ** 2)


@dataclass(frozen=True)
class Second:
    """What the second position adds: equations (14) to (16).

    Attributes
    ----------
    a, u
        As of `Position`, of the mechanisation that the first position corrected.
    phi : ndarray, shape (..., 3)
        What the first position left, at the start of the second [rad].
    gyro, accel : ndarray, shape (..., 2)
        Biases, east and north of the second position [rad/s], [m/s^2].
    """

    a: Floats
    u: Floats
    phi: Floats
    gyro: Floats
    accel: Floats


def identify_position(a: Floats, gravity: float, rate: tuple[float, float]) -> Position:
    """Equations (6) and (7) of coefficients a, shape (..., 3, 2), with the Earth rate (north, up)."""
    u = rates(a, gravity, rate)
    east, north = a[..., 0, 1] / gravity, -a[..., 0, 0] / gravity
    phi = np.stack([east, north, north * (rate[1] / rate[0]) - u[..., 0] / rate[0]], axis=-1)
    return Position(a, u, phi, -u[..., 1] - east * rate[1])


def identify_second(a: Floats, angle: Floats, gravity: float, rate: tuple[float, float]) -> Second:
    """Equations (14) to (16) of the second position's coefficients, shape (..., 3, 2), and the turn angle [rad]."""
    (north, up), u = rate, rates(a, gravity, rate)
    c, s = np.cos(angle), np.sin(angle)
    turn = s / (2 * (1 - c))
    a_east, a_north = a[..., 0, 0], a[..., 0, 1]
    accel = np.stack([a_east / 2 + turn * a_north, a_north / 2 - turn * a_east], axis=-1)
    before = -s * accel[..., 0] + c * accel[..., 1]  # nabla_N of the first position
    gyro_north = -u[..., 1] + before * up / gravity
    gyro_east = (s * gyro_north - u[..., 0]) / (1 - c)
    phi_east, phi_north = (a_north - accel[..., 1]) / gravity, (accel[..., 0] - a_east) / gravity
    heading = phi_north * (up / north) - (u[..., 0] + gyro_east) / north
    return Second(
        a, u, np.stack([phi_east, phi_north, heading], axis=-1), np.stack([gyro_east, gyro_north], axis=-1), accel
    )


def rates(a: Floats, gravity: float, rate: tuple[float, float]) -> Floats:
    """Equation (6): u, shape (..., 3)."""
    north, up = rate
    east = -2 * a[..., 1, 0] / gravity
    return np.stack(
        [
            2 * a[..., 1, 1] / gravity,
            east,
            -6 * a[..., 2, 1] / (gravity * north) + east * up / north,
        ],
        axis=-1,
    )
