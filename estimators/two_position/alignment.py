r"""Alignment of a body that rests, turns on the spot and rests again: what the two-position estimators share.

The first reading of sight and level sets the computed attitude; from there the static mechanisation runs without
correction (`insenv.navigation.strapdown`). Its error, phi of C' = exp(-[phi x]) C, is known for all time from

    x = (phi_E, phi_N, phi_U at the first reading;  b, gyro biases x, y, z;  nabla, accelerometer biases x, y, z;
         m, misalignments of the gyros x and y to z, and the z gyro's scale factor),
    E(t) = R_n' exp([phi x]) exp(-[(J b + S m) x]) R_n,     C = E C',     f' = E^T g up + C' nabla,

J = integral of R_n C' dt, S = integral of R_n C' w_z dt, R_n the turn of the navigation frame. The z accelerometer's
bias counts where the body leans, m where it turns; neither is told, both are in the covariance with what the datasheet
declares of them. To run stored data again from a corrected attitude is
to turn the forces by E(t): a second pass needs no data but the sums of the first. phi_U is the installation angle plus
the errors of the sight. Conventions: ENU, RFU, headings clockwise; see `insenv.core.attitude`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from estimators.two_position.alignment_told import ACCELS, GYROS, PARAMETERS, Sighting, Told
from insenv.core.attitude import angles_from_dcm, dcm_from_angles, dcm_from_quaternion, dcm_from_rotation_vector
from insenv.core.compiled import of_one_type
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import DEG
from insenv.navigation.strapdown import Navigation, initial, static_mechanisation

#: Samples that are mechanised at once: the velocities of a batch stay small.
_AT_ONCE = 2000
_LEVELS = ("level_pitch", "level_roll")
NAMES = ("installation_angle", "heading", "pitch", "roll", *GYROS, *ACCELS[:2])
UNITS = (*4 * ("rad",), *3 * ("rad/s",), *2 * ("m/s^2",))


@dataclass(frozen=True)
class Aligned:
    """State of an alignment; the batch in front.

    Attributes
    ----------
    navigation : Navigation, optional
        Of the mechanisation; None before the first reading.
    start : ndarray, shape (..., 4)
        Quaternion at the first reading.
    rows, sums : ndarray, shape (..., WIDTH) and (..., RESTS, SUMS)
        See `estimators.two_position.alignment_kernel`.
    cells : tuple of ndarray, shape (..., blocks, CELL)
    sights : ndarray, shape (..., 12)
        The first reading; of all: number, sum of reading minus computed heading, sums of what phi_U depends on.
    fit : object
        What else an estimator keeps.
    """

    navigation: Navigation | None
    start: Floats
    rows: Floats
    sums: Floats
    cells: tuple[Floats, ...]
    sights: Floats
    fit: Any = None

    @property
    def batch(self) -> tuple[int, ...]:
        """Axes of the batch."""
        return self.rows.shape[:-1]


class Alignment:
    """Base of the estimators: takes recordings in.

    Parameters
    ----------
    datasheet : Datasheet
        Biases are declared as effect "bias" of gyro_x ... accel_z, "cross_axis" of gyro_x and gyro_y to z and
        "scale_factor" of gyro_z as such; noise as "angle_random_walk" of gyro_x ... accel_y.
    sighting : Sighting, optional
        As the datasheet has it, or Table 1 of the paper.
    settle : float
        Time after a turn that is left out [s].
    """

    names, units = NAMES, UNITS
    #: Length of a block whose mean velocity is kept [s]; 0: none is kept.
    block: ClassVar[float] = 0.0
    #: Whether the samples are fitted one by one.
    recursive: ClassVar[bool] = False

    def __init__(self, datasheet: Datasheet, sighting: Sighting | None = None, settle: float = 0.0) -> None:
        if not settle >= 0:
            raise InputError(f"a settling time of {settle:g} s given; wanted zero or more")
        self.datasheet, self.settle = datasheet, settle
        self.told = Told.of(datasheet, sighting)
        self.size = max(round((self.block or 1.0) * datasheet.sampling), 1)

    def reset(self, batch: int | None = None) -> Aligned:
        """No data."""
        k = kernel()
        shape = () if batch is None else (batch,)
        start = np.broadcast_to([1.0, 0.0, 0.0, 0.0], (*shape, 4)).copy()
        rows, sums = np.zeros((*shape, k.WIDTH)), np.zeros((*shape, k.RESTS, k.SUMS))
        return Aligned(None, start, rows, sums, (), np.zeros((*shape, 12)))

    def update(self, state: Aligned, chunk: Recording) -> Aligned:
        """Take in the IMU, "sight_heading", "level_pitch", "level_roll" [rad] and "turning"; see `Alignment`."""
        n = len(chunk.t)
        if not n:
            return state
        shape = (*state.batch, n)
        sight = np.broadcast_to(chunk.values("sight_heading", "rad"), shape)
        gyro, accel = (_increments(chunk, names, shape, self.told.dt) for names in (GYROS, ACCELS))
        turning = np.zeros(shape)
        if "turning" in chunk.channels:
            turning[:] = chunk.values("turning", "1")
        seen = np.asarray(np.isfinite(sight.reshape(-1, n)).any(axis=0))
        first, used = 0, -1  # the sighting that began the alignment has been used; in later chunks none has
        if state.navigation is None:
            state, first = self._begun(state, chunk, sight, seen)
            used = first
        for a, b in _parts(seen, first, used, n):
            state = self._onward(state, gyro[..., a:b, :], accel[..., a:b, :], turning[..., a:b])
            if seen[b - 1] and b - 1 > used:
                state = self._sighted(state, sight[..., b - 1])
        return state

    def estimate(self, state: Aligned) -> Estimate:
        """What is known; the prior before data."""
        raise NotImplementedError

    def _begun(self, state: Aligned, chunk: Recording, sight: Floats, seen: NDArray[np.bool_]) -> tuple[Aligned, int]:
        """State at the first row that has sight and level in every run, and that row."""
        level = [self._level(chunk, name, sd, sight) for name, sd in zip(_LEVELS, self.datasheet.level_sd, strict=True)]
        known = np.isfinite(np.stack([sight, *level])).reshape(-1, sight.shape[-1]).all(axis=0)
        if not known.any():
            return state, sight.shape[-1]
        first = int(np.argmax(known))
        heading = sight[..., first]
        position = np.array([self.told.latitude, 0.0, self.told.altitude])
        navigation = initial(dcm_from_angles(heading, level[0][..., first], level[1][..., first]), position)
        k, rows = kernel(), state.rows.copy()
        flat = navigation.quaternion.reshape(-1, 4)
        k.begin(of_one_type(flat), self.told.rate, rows.reshape(-1, k.WIDTH), np.empty((3, 3)), np.empty(9))
        sights = np.zeros((*state.batch, 12))
        sights[..., 0], sights[..., 1], sights[..., 5] = heading, 1.0, 1.0
        return replace(state, navigation=navigation, start=navigation.quaternion, rows=rows, sights=sights), first

    @staticmethod
    def _level(chunk: Recording, name: str, sd: float, sight: Floats) -> Floats:
        """Pitch or roll as it is told; zero where the datasheet says that it is not."""
        if not np.isfinite(sd):
            return np.zeros(sight.shape)
        return np.broadcast_to(chunk.values(name, "rad"), sight.shape)

    def _onward(self, state: Aligned, gyro: Floats, accel: Floats, turning: Floats) -> Aligned:
        """After a few samples more."""
        k, told = kernel(), self.told
        assert state.navigation is not None
        before = state.navigation.samples
        path, navigation = static_mechanisation(gyro, accel, told.dt, state.navigation)
        rows, sums, n = state.rows.copy(), state.sums.copy(), gyro.shape[-2]
        done = (before + n) // self.size - before // self.size if self.block else 0
        cells = np.empty((*state.batch, done, k.CELL))
        settle = round(self.settle * self.datasheet.sampling)
        velocity = path.velocity.reshape(-1, n, 3)
        flat_sums, flat_turning = sums.reshape(-1, k.RESTS, k.SUMS), of_one_type(turning).reshape(-1, n)
        where = np.empty((len(velocity), n if self.recursive else 0), np.int64)
        k.gather(
            velocity,
            path.quaternion.reshape(-1, n, 4),
            flat_turning,
            of_one_type(gyro[..., 2]).reshape(-1, n),
            np.array([told.dt, before, self.size, settle, *told.rate]),
            rows.reshape(-1, k.WIDTH),
            flat_sums,
            cells.reshape(len(velocity), done, k.CELL),
            where,
            np.empty((3, 3)),
            np.empty(9),
        )
        kept = (*state.cells, cells) if done else state.cells
        fit = self._fitted(state, velocity, where) if self.recursive else state.fit
        return replace(state, navigation=navigation, rows=rows, sums=sums, cells=kept, fit=fit)

    def _fitted(self, state: Aligned, velocity: Floats, where: NDArray[np.int64]) -> Any:
        """What else is made of the velocities, shape (R, n, 3), each in the rest ``where``, shape (R, n)."""
        raise NotImplementedError

    def _sighted(self, state: Aligned, sight: Floats) -> Aligned:
        """After a further sighting; runs without one have NaN there."""
        assert state.navigation is not None
        there = np.isfinite(sight)
        heading = angles_from_dcm(state.navigation.dcm)[0]
        turned, J = self.turned(state)
        up = np.broadcast_to(turned[:, 2], (*state.batch, 3))  # third row of R_n'
        change = wrapped(np.where(there, sight, 0.0) - heading)
        late = (-times(up, J), -times(up, self.twisted(state)))
        new = np.concatenate([np.ones_like(change)[..., None], change[..., None], up, *late], axis=-1)
        sights = state.sights.copy()
        sights[..., 1:] += np.where(there[..., None], new, 0.0)
        return replace(state, sights=sights)

    def turned(self, state: Aligned) -> tuple[Floats, Floats]:
        """R_n and J now, shapes (3, 3) and (..., 3, 3)."""
        k = kernel()
        t, rate = self.time(state), np.array([0.0, *self.told.rate])
        turned = dcm_from_rotation_vector(rate * t)
        since = t - state.rows[..., k.TIME, None]
        J = state.rows[..., k.J : k.J + 9] + since * state.rows[..., k.LAST : k.LAST + 9]
        return turned, J.reshape(*state.batch, 3, 3)

    def twisted(self, state: Aligned) -> Floats:
        """S now, the Earth's share of it included, shape (..., 3, 3)."""
        k, J = kernel(), self.turned(state)[1]
        return state.rows[..., k.TWIST : k.TWIST + 9].reshape(*state.batch, 3, 3) + self.told.rate[1] * J

    def time(self, state: Aligned) -> float:
        """Since the first reading [s]."""
        return 0.0 if state.navigation is None else state.navigation.samples * self.told.dt

    def prior(self, state: Aligned) -> tuple[Floats, Floats]:
        """Mean and covariance of x before the data, shapes (..., 12) and (..., 12, 12)."""
        mean = np.broadcast_to(self.told.prior_mean, (*state.batch, PARAMETERS)).copy()
        return mean, self.told.prior(state.sights[..., 0])

    def estimate_of(self, state: Aligned, x: Floats, walk: Floats, cov: Floats) -> Estimate:
        """Estimate of everything from x, shape (..., 12).

        walk : horizontal forces that the walk of the attitude has made until now, shape (..., 2) [m/s^2].
        cov : of both, shape (..., 14, 14).
        """
        if state.navigation is None:
            return self.prior_estimate(state.batch)
        (turned, J), S, n = self.turned(state), self.twisted(state), PARAMETERS
        first = dcm_from_rotation_vector(x[..., :3])
        drift = dcm_from_rotation_vector(-times(J, x[..., 3:6], 0) - times(S, x[..., 9:12], 0))
        correction = turned.T @ (first @ drift) @ turned
        g, t = self.told.gravity, self.time(state)
        walked = np.stack([walk[..., 1] / g, -walk[..., 0] / g, np.zeros(state.batch)], axis=-1)
        dcm = dcm_from_rotation_vector(walked) @ correction @ state.navigation.dcm
        angles, slopes = angles_of(dcm)
        started = angles_from_dcm(first @ dcm_from_quaternion(state.start))[0]
        s = state.sights
        count = s[..., 1:2]
        # Of later sightings: reading minus computed heading, plus phi_U then; of the first the latter is phi_U at once.
        depends = np.zeros((*state.batch, n))
        depends[..., :6], depends[..., 9:] = s[..., 3:9] / count, s[..., 9:] / count
        lead = depends - np.eye(n)[2]
        installation = wrapped(s[..., 0] - started) + s[..., 2] / count[..., 0] + np.sum(lead * x, axis=-1)
        L = np.zeros((*state.batch, 9, n + 2))
        L[..., 0, :n] = depends
        to_now = np.zeros((*state.batch, 3, n + 2))
        to_now[..., :3] = turned.T
        to_now[..., 3:6] = -turned.T @ first @ J
        to_now[..., 9:n] = -turned.T @ first @ S
        to_now[..., 0, n + 1], to_now[..., 1, n] = 1 / g, -1 / g
        L[..., 1:4, :] = slopes @ to_now
        L[..., range(4, 9), range(3, 8)] = 1.0
        spread = L @ cov @ np.swapaxes(L, -1, -2)
        spread[..., 0, 0] += self.told.sighting.orientation**2 + self.told.sighting.tracking**2 / count[..., 0]
        spread[..., 1, 1] += self.told.walk**2 * t
        mean = np.concatenate([installation[..., None], angles, x[..., 3:8]], axis=-1)
        return Estimate(self.names, self.units, mean, symmetric(spread))

    def prior_estimate(self, batch: tuple[int, ...]) -> Estimate:
        """Before any reading: nothing is known of the heading, the body stands nearly level."""
        s = self.told.sighting
        mean = np.broadcast_to(np.concatenate([np.zeros(4), self.told.mean[:5]]), (*batch, 9)).copy()
        deviations = np.concatenate([[s.installation, np.pi / np.sqrt(3), 10 * DEG, 10 * DEG], self.told.sd[:5]])
        return Estimate(self.names, self.units, mean, np.broadcast_to(np.diag(deviations**2), (*batch, 9, 9)).copy())


def kernel() -> Any:
    """The loops, with numba: it costs more to import than the rest."""
    from estimators.two_position import alignment_kernel

    return alignment_kernel


def _increments(chunk: Recording, names: tuple[str, ...], shape: tuple[int, ...], dt: float) -> Floats:
    """Shape (..., n, 3)."""
    unit = "rad/s" if names is GYROS else "m/s^2"
    found = np.empty((*shape, 3))
    for j, name in enumerate(names):
        np.multiply(chunk.values(name, unit), dt, out=found[..., j])
    return found


def _parts(seen: NDArray[np.bool_], first: int, used: int, n: int) -> Iterator[tuple[int, int]]:
    """Ranges of rows from ``first`` on that end at a sighting after row ``used``, or are long enough."""
    cuts = [*(np.flatnonzero(seen[used + 1 :]) + used + 2).tolist(), n]
    for cut in cuts:
        while first < cut:
            stop = min(first + _AT_ONCE, cut)
            yield first, stop
            first = stop


def angles_of(dcm: Floats) -> tuple[Floats, Floats]:
    """Heading, pitch and roll, shape (..., 3), and their derivatives by a small turn of the frame, (..., 3, 3)."""
    step = 1e-6
    angles = np.stack(angles_from_dcm(dcm), axis=-1)
    turned = dcm_from_rotation_vector(np.concatenate([step * np.eye(3), -step * np.eye(3)]))
    near = np.stack(angles_from_dcm(turned @ dcm[..., None, :, :]), axis=-1)
    slopes = wrapped(near[..., :3, :] - near[..., 3:, :]) / (2 * step)
    return angles, np.swapaxes(slopes, -1, -2)


def times(a: Floats, b: Floats, side: int = 1) -> Floats:
    """Row vector times matrix (side 1), or matrix times column vector (side 0)."""
    product = a[..., None, :] @ b if side else a @ b[..., None]
    return np.asarray(product[..., 0, :] if side else product[..., 0])


def wrapped(angle: Floats) -> Floats:
    """Into (-pi, pi]."""
    return np.pi - np.mod(np.pi - angle, 2 * np.pi)


def symmetric(cov: Floats) -> Floats:
    """Without the rounding that tells both halves apart."""
    return np.asarray(0.5 * (cov + np.swapaxes(cov, -1, -2)))
