r"""Strapdown mechanisation in east, north, up, from the increments of gyros and accelerometers.

    C_b^n' = C_b^n [omega_ib^b x] - [omega_in^n x] C_b^n
    v'     = C_b^n f^b - (2 omega_ie^n + omega_en^n) x v + g^n

*Full* mechanisation: omega_in = omega_ie + omega_en, the velocity is fed back, and the position moves on the WGS 84
ellipsoid. *Static* mechanisation: omega_en = 0 and v = 0 on the right-hand side, and the position stays; the velocity
is then a plain integral of the attitude's error, as alignment on a base at rest wants it. Gravity points along
the ellipsoid's normal. The vertical channel is free: over hours it diverges, as it must.

Both take the same step of attitude and velocity, with coning and sculling, in `insenv.navigation.kernel`.
Source: Savage (1998), given there; Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. (2004),
sections 3.5 and 3.7.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insenv.core.attitude import dcm_from_quaternion, quaternion_from_dcm
from insenv.core.compiled import of_one_type
from insenv.core.errors import InputError

Floats = NDArray[np.float64]

#: East, north, up cannot be followed nearer to a pole than this [rad].
POLE = 1e-3


@dataclass(frozen=True)
class Navigation:
    """State of a mechanisation.

    Attributes
    ----------
    quaternion : ndarray, shape (..., 4)
        Of C_b^n, scalar first.
    velocity : ndarray, shape (..., 3)
        East, north, up [m/s].
    position : ndarray, shape (..., 3)
        Latitude and longitude [rad], height above the ellipsoid [m].
    previous : ndarray, shape (..., 6)
        Increments of the sample before: gyros [rad], accelerometers [m/s]; zero before the first sample, which
        then counts as the first of a steady motion.
    samples : int
        Number of samples taken so far.
    """

    quaternion: Floats
    velocity: Floats
    position: Floats
    previous: Floats
    samples: int = 0

    @property
    def dcm(self) -> Floats:
        """C_b^n, shape (..., 3, 3)."""
        return dcm_from_quaternion(self.quaternion)


@dataclass(frozen=True)
class StrapdownPath:
    """What a mechanisation found at the ends of the samples kept.

    Attributes
    ----------
    sample : ndarray of int, shape (m,)
        Number of samples taken since the start of the run: time is this times the sampling interval.
    velocity, position : ndarray, shape (..., m, 3)
        As in `Navigation`.
    quaternion : ndarray, shape (..., m, 4)
        Of C_b^n, scalar first.
    """

    sample: NDArray[np.int64]
    velocity: Floats
    position: Floats
    quaternion: Floats

    @property
    def dcm(self) -> Floats:
        """C_b^n, shape (..., m, 3, 3)."""
        return dcm_from_quaternion(self.quaternion)


def initial(dcm: ArrayLike, position: ArrayLike, velocity: ArrayLike = (0.0, 0.0, 0.0)) -> Navigation:
    """State before the first sample.

    dcm : C_b^n, shape (..., 3, 3). position : latitude, longitude [rad] and height [m], shape (..., 3).
    velocity : east, north, up, shape (..., 3) [m/s]. Leading axes are broadcast together.
    Raises InputError if ``dcm`` is no rotation or a latitude lies beyond a pole.
    """
    q = quaternion_from_dcm(dcm)
    p, v = np.asarray(position, np.float64), np.asarray(velocity, np.float64)
    for name, value in (("position", p), ("velocity", v)):
        if value.shape[-1:] != (3,):
            raise InputError(f"a {name} of shape {value.shape} was given; wanted shape (..., 3)")
    if not (np.abs(p[..., 0]) <= np.pi / 2).all():
        raise InputError("a position's latitude is no latitude; wanted radians from -pi/2 to pi/2")
    try:
        batch = np.broadcast_shapes(q.shape[:-1], p.shape[:-1], v.shape[:-1])
    except ValueError:
        raise InputError(
            f"{q.shape[:-1]} attitudes, {p.shape[:-1]} positions and {v.shape[:-1]} velocities do not go together"
        ) from None
    q, v, p = (np.broadcast_to(x, (*batch, x.shape[-1])) for x in (q, v, p))
    return Navigation(q, v, p, previous=np.zeros((*batch, 6)))


def static_mechanisation(
    gyro: ArrayLike, accelerometer: ArrayLike, dt: float, state: Navigation, every: int = 1
) -> tuple[StrapdownPath, Navigation]:
    """Run the static mechanisation over a chunk: velocity is integrated, but not fed back.

    Parameters
    ----------
    gyro, accelerometer : array_like, shape (..., n, 3)
        Increments over the intervals in body axes right, forward, up: angle [rad], velocity [m/s].
        Leading axes are broadcast with those of ``state``.
    dt : float
        Length of an interval [s].
    state : Navigation
        From `initial`, or from the chunk before. Its position stays.
    every : int
        Of every so many samples, counted from the start of the run, the last is kept.

    Returns
    -------
    Trajectory, Navigation
        The same bits, however a run is cut into chunks and whatever runs beside it.

    Raises
    ------
    InputError
        Shapes that do not go together, ``dt`` not positive, or ``every`` below 1.
    """
    run = _Run.of(gyro, accelerometer, dt, state, every)
    velocity, attitude = run.room(3), run.room(4)
    _kernel().static(*run.arguments, (velocity, attitude))
    after = run.after()
    position = np.broadcast_to(after.position[..., None, :], (*run.batch, run.kept.size, 3))
    return StrapdownPath(run.kept, run.shaped(velocity), position, run.shaped(attitude)), after


def full_mechanisation(
    gyro: ArrayLike, accelerometer: ArrayLike, dt: float, state: Navigation, every: int = 1
) -> tuple[StrapdownPath, Navigation]:
    """Run the full mechanisation over a chunk: the velocity is fed back and the position moves.

    Arguments, results and errors as in `static_mechanisation`; InputError also if a run begins or ends within
    `POLE` of a pole.
    """
    run = _Run.of(gyro, accelerometer, dt, state, every)
    _refuse_pole(state)
    velocity, attitude, position = run.room(3), run.room(4), run.room(3)
    _kernel().full(*run.arguments, (velocity, attitude, position))
    after = run.after()
    _refuse_pole(after)
    return StrapdownPath(run.kept, run.shaped(velocity), run.shaped(position), run.shaped(attitude)), after


@dataclass(frozen=True)
class _Run:
    """A chunk as the kernel takes it: increments (1 or R, n, 3), rows (R, 16), samples kept (m,)."""

    batch: tuple[int, ...]
    gyro: Floats
    accelerometer: Floats
    dt: float
    every: int
    rows: Floats
    kept: NDArray[np.int64]
    samples: int

    @classmethod
    def of(cls, gyro: ArrayLike, accelerometer: ArrayLike, dt: float, state: Navigation, every: int) -> _Run:
        """Check and flatten what a mechanisation was given."""
        a, f = np.asarray(gyro, np.float64), np.asarray(accelerometer, np.float64)
        if a.shape != f.shape or a.ndim < 2 or a.shape[-1] != 3:
            raise InputError(
                f"increments of shape {a.shape} (gyros) and {f.shape} (accelerometers) were given; "
                "wanted the same shape (..., n, 3)"
            )
        if not (dt > 0.0 and np.isfinite(dt)):
            raise InputError(f"a sampling interval of {dt:g} s was given; wanted a positive number")
        if every < 1:
            raise InputError(f"every {every} samples were to be kept; wanted 1 or more")
        try:
            batch = np.broadcast_shapes(a.shape[:-2], state.quaternion.shape[:-1])
        except ValueError:
            raise InputError(
                f"increments of {a.shape[:-2]} runs and a state of {state.quaternion.shape[:-1]} do not go together"
            ) from None
        parts = (state.quaternion, state.velocity, state.position, state.previous)
        rows = np.concatenate([np.broadcast_to(x, (*batch, x.shape[-1])) for x in parts], axis=-1)
        samples = state.samples + a.shape[-2]
        kept = np.arange(state.samples // every + 1, samples // every + 1) * every
        return cls(batch, _flat(a, batch), _flat(f, batch), dt, every, rows.reshape(-1, 16), kept, samples)

    @property
    def arguments(self) -> tuple[Any, ...]:
        """What both kernels take first."""
        first = self.every - 1 - (self.samples - self.gyro.shape[1]) % self.every
        return self.gyro, self.accelerometer, float(self.dt), (first, int(self.every)), self.rows

    def room(self, width: int) -> Floats:
        """Return an empty array for a result of each sample kept."""
        return np.empty((len(self.rows), self.kept.size, width))

    def shaped(self, result: Floats) -> Floats:
        """Return a result with the axes of the batch."""
        return result.reshape(*self.batch, *result.shape[1:])

    def after(self) -> Navigation:
        """State after the kernel ran."""
        q, v, p, previous = np.split(self.rows.reshape(*self.batch, 16), [4, 7, 10], axis=-1)
        return Navigation(q, v, p, previous, self.samples)


def _flat(increments: Floats, batch: tuple[int, ...]) -> Floats:
    """Shape (R, n, 3); (1, n, 3) where all rows share one run, which is then not copied."""
    if increments.size == increments.shape[-2] * 3:
        return of_one_type(increments).reshape(1, -1, 3)
    return of_one_type(increments, (*batch, *increments.shape[-2:])).reshape(-1, *increments.shape[-2:])


def _refuse_pole(state: Navigation) -> None:
    latitude = np.abs(state.position[..., 0])
    if (latitude > np.pi / 2 - POLE).any():
        raise InputError(
            f"a run comes within {POLE:g} rad of a pole, where east and north have no direction; "
            "wanted latitudes farther from it"
        )


def _kernel() -> ModuleType:
    """Import the loops, with numba: it costs more to import than the rest of the core."""
    from insenv.navigation import kernel as strapdown_kernel

    return strapdown_kernel
