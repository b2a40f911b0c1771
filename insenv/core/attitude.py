r"""Attitude of a body (right-forward-up) in the navigation frame (east-north-up).

With heading psi clockwise from north, pitch theta (nose up) and roll gamma (right side down),

    C_b^n = R_z(-psi) R_x(theta) R_y(gamma),      R_i(a) = exp(a [e_i x]),

so column j of C_b^n holds body axis j in east, north, up. A computed attitude is off by the small angle phi of

    C_b^n' = (I - [phi x]) C_b^n,                 here for any angle: C_b^n' = exp(-[phi x]) C_b^n.

Positive phi_U turns the computed frame counter-clockwise: the computed heading is too large by phi_U.
Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. (2004), section 3.6 and chapter 12, with
the sign of psi turned. Quaternions hold the scalar first; q and -q are the same attitude.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insenv.core.errors import InputError

Floats = NDArray[np.float64]

#: Below this cosine of pitch heading and roll cannot be told apart.
VERTICAL = 1e-12


def wrapped(angle: Any) -> Any:
    """An angle [rad], or an array of them, in [-pi, pi)."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def dcm_from_angles(heading: ArrayLike, pitch: ArrayLike, roll: ArrayLike) -> Floats:
    """C_b^n, shape (..., 3, 3), of heading (clockwise from north), pitch and roll, each shape (...), rad."""
    psi, theta, gamma = np.broadcast_arrays(*(np.asarray(a, np.float64) for a in (heading, pitch, roll)))
    sp, cp, st, ct = np.sin(psi), np.cos(psi), np.sin(theta), np.cos(theta)
    sg, cg = np.sin(gamma), np.cos(gamma)
    rows = (
        (cp * cg + sp * st * sg, sp * ct, cp * sg - sp * st * cg),
        (-sp * cg + cp * st * sg, cp * ct, -sp * sg - cp * st * cg),
        (-ct * sg, st, ct * cg),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def angles_from_dcm(dcm: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Heading and roll in [-pi, pi], pitch in [-pi/2, pi/2], rad, each shape (...), of C_b^n, shape (..., 3, 3).

    With the nose straight up or down roll is set to zero. Raises InputError if ``dcm`` is no rotation.
    """
    c = _rotation(dcm)
    level = np.hypot(c[..., 0, 1], c[..., 1, 1])
    vertical = level < VERTICAL
    heading = np.where(vertical, np.arctan2(-c[..., 1, 0], c[..., 0, 0]), np.arctan2(c[..., 0, 1], c[..., 1, 1]))
    roll = np.where(vertical, 0.0, np.arctan2(-c[..., 2, 0], c[..., 2, 2]))
    return heading, np.arctan2(c[..., 2, 1], level), roll


def dcm_from_rotation_vector(vector: ArrayLike) -> Floats:
    """exp([v x]), shape (..., 3, 3), of rotation vectors v, shape (..., 3), rad."""
    from scipy.spatial.transform import Rotation

    v = _vectors(vector, 3)
    return np.asarray(Rotation.from_rotvec(v.reshape(-1, 3)).as_matrix()).reshape(*v.shape[:-1], 3, 3)


def rotation_vector_from_dcm(dcm: ArrayLike) -> Floats:
    """Rotation vectors v, shape (..., 3), at most pi long, of exp([v x]), shape (..., 3, 3).

    Raises InputError if ``dcm`` is no rotation.
    """
    from scipy.spatial.transform import Rotation

    c = _rotation(dcm)
    return np.asarray(Rotation.from_matrix(c.reshape(-1, 3, 3)).as_rotvec()).reshape(c.shape[:-1])


def dcm_from_quaternion(quaternion: ArrayLike) -> Floats:
    """C_b^n, shape (..., 3, 3), of quaternions, shape (..., 4), scalar first; their norm does not matter."""
    from scipy.spatial.transform import Rotation

    q = _vectors(quaternion, 4)
    found = Rotation.from_quat(q.reshape(-1, 4), scalar_first=True).as_matrix()
    return np.asarray(found).reshape(*q.shape[:-1], 3, 3)


def quaternion_from_dcm(dcm: ArrayLike) -> Floats:
    """Unit quaternions, shape (..., 4), scalar first and not negative, of C_b^n, shape (..., 3, 3).

    Raises InputError if ``dcm`` is no rotation.
    """
    from scipy.spatial.transform import Rotation

    c = _rotation(dcm)
    found = Rotation.from_matrix(c.reshape(-1, 3, 3)).as_quat(canonical=True, scalar_first=True)
    return np.asarray(found).reshape(*c.shape[:-2], 4)


def misaligned(dcm: ArrayLike, phi: ArrayLike) -> Floats:
    """C_b^n' = exp(-[phi x]) C_b^n, shape (..., 3, 3): the attitude as computed with the error phi.

    dcm : shape (..., 3, 3). phi : shape (..., 3), rad, in east, north, up. The converse is ``misaligned(c, -phi)``.
    """
    return dcm_from_rotation_vector(-_vectors(phi, 3)) @ _rotation(dcm)


def misalignment(computed: ArrayLike, true: ArrayLike) -> Floats:
    """Return phi, shape (..., 3), rad, in east, north, up, of ``computed = misaligned(true, phi)``.

    computed, true : shape (..., 3, 3). Raises InputError if one is no rotation.
    """
    return -rotation_vector_from_dcm(_rotation(computed) @ np.swapaxes(_rotation(true), -1, -2))


def _vectors(values: ArrayLike, length: int) -> Floats:
    v = np.asarray(values, np.float64)
    if v.ndim == 0 or v.shape[-1] != length:
        raise InputError(f"an array of shape {v.shape} was given; wanted shape (..., {length})")
    return v


def _rotation(values: ArrayLike) -> Floats:
    c = np.asarray(values, np.float64)
    if c.shape[-2:] != (3, 3):
        raise InputError(f"an attitude of shape {c.shape} was given; wanted shape (..., 3, 3)")
    off = np.abs(c @ np.swapaxes(c, -1, -2) - np.eye(3)).max(initial=0.0)
    if not off < 1e-6 or (np.linalg.det(c) < 0).any():
        raise InputError(f"an attitude of 3 by 3 is no rotation (C C' differs from 1 by {off:.1g}); wanted a rotation")
    return c
