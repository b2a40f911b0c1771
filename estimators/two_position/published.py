r"""Two-position calibration as published: a cubic for each position, one pass, recursive least squares.

The first result corrects the attitude, propagated to the end of the position; through the turn it is only tracked, and
equations (14) to (16) of `estimators.two_position.equations` hold at the second position. The installation angle is
the sum of both phi_U less the sight's error. What the method leaves out (biases in the first position, eps_U, products
of misalignments) is in the covariance. The velocity is zero where a position begins: a body that sways or comes to rest
slowly breaks the method and its covariance; `two_position_tied` has a constant for that.

Source: Guo, Li, He (2018), DOI 10.11977/j.issn.1004-2474.2018.01.016.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimators.common.least_squares import ALPHA
from estimators.two_position.alignment import NAMES, UNITS, Aligned, Alignment, angles_of, kernel, symmetric, wrapped
from estimators.two_position.alignment_told import PARAMETERS as N
from estimators.two_position.alignment_told import Told
from estimators.two_position.equations import Position, Second, identify_position, identify_second
from estimators.two_position.tied import RestSums
from insenv.core.attitude import angles_from_dcm, dcm_from_quaternion, dcm_from_rotation_vector
from insenv.core.earth import gravity
from insenv.core.estimate import Estimate
from insenv.core.recording import Floats

#: Positions of the method.
POSITIONS = 2
_Z = 6  # place of gyro_z among the names


@dataclass(frozen=True)
class Fits:
    """Recursive fits of the first positions; see `estimators.two_position.kernel.fit`."""

    counts: Floats
    starts: Floats
    P: Floats
    X: Floats


@dataclass(frozen=True)
class Result:
    """All intermediate quantities of R runs.

    Attributes
    ----------
    first : Position
    second : Second
    angle : ndarray, shape (R,)
        Turn angle as the mechanisation followed it [rad].
    correction : ndarray, shape (R, 3, 3)
        C = correction C' at the start of the second position, as the first one has it.
    one, two : ndarray, shape (R, 9)
        Installation angle (with the sight's error), heading, pitch, roll, biases after one and two positions.
    """

    first: Position
    second: Second
    angle: Floats
    correction: Floats
    one: Floats
    two: Floats


class TwoPosition(Alignment):
    """The published method; parameters as of `Alignment`. The first two rests are used."""

    recursive = True

    def reset(self, batch: int | None = None) -> Aligned:
        """No data."""
        shape = () if batch is None else (batch,)
        fits = Fits(
            np.zeros((*shape, POSITIONS)),
            np.zeros((*shape, POSITIONS, 2)),
            np.broadcast_to(ALPHA * np.eye(3), (*shape, POSITIONS, 3, 3)).copy(),
            np.zeros((*shape, POSITIONS, 3, 2)),
        )
        return replace(super().reset(batch), fit=fits)

    def _fitted(self, state: Aligned, velocity: Floats, where: NDArray[np.int64]) -> Fits:
        from estimators.two_position import kernel as two_position_kernel

        old: Fits = state.fit
        new = Fits(old.counts.copy(), old.starts.copy(), old.P.copy(), old.X.copy())
        two_position_kernel.fit(
            velocity,
            where,
            self.told.dt,
            state.rows.reshape(len(velocity), -1),
            new.counts.reshape(-1, POSITIONS),
            new.starts.reshape(-1, POSITIONS, 2),
            new.P.reshape(-1, POSITIONS, 3, 3),
            new.X.reshape(-1, POSITIONS, 3, 2),
        )
        return new

    def identified(self, state: Aligned) -> Result:
        """Everything that the method computes; NaN or meaningless where a position has no data yet."""
        problem = _Problem(self, state)
        return problem.result(problem.a)

    def estimate(self, state: Aligned) -> Estimate:
        """After the last position that tells more than was known before it."""
        if state.navigation is None:
            return self.prior_estimate(state.batch)
        problem = _Problem(self, state)
        mean, cov = problem.prior
        for found, spread, there in problem.answers():
            better = there & (spread[:, 0, 0] < cov[:, 0, 0])
            mean = np.where(better[:, None], found, mean)
            cov = np.where(better[:, None, None], spread, cov)
        sight = self.told.sighting
        cov[:, 0, 0] += sight.orientation**2 + sight.tracking**2
        shape = state.batch
        return Estimate(NAMES, UNITS, mean.reshape(*shape, 9), symmetric(cov).reshape(*shape, 9, 9))


class _Problem:
    """The method on the R runs of a state."""

    def __init__(self, estimator: TwoPosition, state: Aligned) -> None:
        assert state.navigation is not None
        k = kernel()
        self.told: Told = estimator.told
        self.estimator, self.k = estimator, k
        self.time = estimator.time(state)
        turned, J = estimator.turned(state)
        self.turned, self.J = turned, J.reshape(-1, 3, 3)
        self.S = estimator.twisted(state).reshape(-1, 3, 3)
        self.computed = state.navigation.dcm.reshape(-1, 3, 3)
        self.started = angles_from_dcm(dcm_from_quaternion(state.start).reshape(-1, 3, 3))
        sums = state.sums.reshape(-1, k.RESTS, k.SUMS)
        self.runs = len(sums)
        two = sums[:, :POSITIONS]
        self.rests = RestSums(np.ascontiguousarray(two), self.told.dt)
        self.span, self.began = two[..., 0] * self.told.dt, two[..., k.BEGAN]
        self.good = self.span >= 1.0 - 1e-9
        powers = k.SPAN ** np.arange(1.0, 4.0)
        self.a = state.fit.X.reshape(-1, POSITIONS, 3, 2) / powers[:, None]
        # The vertical velocity matters to second order only: a straight line.
        square = np.where(two[..., 2] > 0, two[..., 2], 1.0)
        normal = float(gravity(self.told.latitude, self.told.altitude))
        self.vertical = two[..., k.MOMENTS + 5] / square / k.SPAN + normal - self.told.gravity
        self.angle = self._angle(two)
        self.prior_cov = self.told.prior(state.sights[..., 0].reshape(-1))

    def _angle(self, sums: Floats) -> Floats:
        """Turn angle between the two positions, shape (R,)."""
        starts = sums[..., self.k.A_START : self.k.A_START + 9].reshape(-1, POSITIONS, 3, 3)
        frames = dcm_from_rotation_vector(self.began[..., None] * np.array([0.0, *self.told.rate]))
        c = np.swapaxes(frames, -1, -2) @ starts
        self.first = c[:, 0]
        m = c[:, 1] @ np.swapaxes(c[:, 0], -1, -2)
        angle = np.arctan2(m[:, 1, 0] - m[:, 0, 1], m[:, 0, 0] + m[:, 1, 1])
        return np.where(self.good[:, 1] & (np.abs(angle) > 1e-3), angle, np.pi)

    def result(self, a: Floats) -> Result:
        """From coefficients a, shape (..., R, 2, 3, 2)."""
        told = self.told
        first = identify_position(a[..., 0, :, :], told.gravity, told.rate)
        end = self.began[:, 0] + self.span[:, 0]
        left = first.propagated(self.span[:, 0], told.rate)
        # Position 2: from its start on, the first correction only turns with the Earth.
        started = self._carried(left, self.began[:, 1] - end)
        corrected = self._corrected(a[..., 1, :, :], started)
        second = identify_second(corrected, self.angle, told.gravity, told.rate)
        one = self._outputs(first.phi[..., 2], self._now_after_one(first), np.zeros(()), first)
        since = self.time - self.began[:, 1]
        rest = replace(first, u=second.u, phi=second.phi)
        now = dcm_from_rotation_vector(rest.propagated(since, told.rate)) @ dcm_from_rotation_vector(
            self._carried(started, since)
        )
        two = self._outputs(first.phi[..., 2] + second.phi[..., 2], now, second.accel, second)
        return Result(first, second, self.angle, dcm_from_rotation_vector(started), one, two)

    def _now_after_one(self, first: Position) -> Floats:
        """Correction now as the first position has it."""
        within = np.minimum(self.time - self.began[:, 0], self.span[:, 0])
        left = first.propagated(within, self.told.rate)
        return dcm_from_rotation_vector(self._carried(left, self.time - self.began[:, 0] - within))

    def _carried(self, phi: Floats, t: Floats) -> Floats:
        """Misalignment after a time in which the frame turns with the Earth alone."""
        frames = dcm_from_rotation_vector(t[..., None] * np.array([0.0, *self.told.rate]))
        return np.asarray((phi[..., None, :] @ frames)[..., 0, :])

    def _corrected(self, a: Floats, phi: Floats) -> Floats:
        """Coefficients of the mechanisation that starts the position from the attitude corrected by phi."""
        T, g = self.span[:, 1], self.told.gravity
        e = dcm_from_rotation_vector(phi)
        up = np.zeros((*a.shape[:-1], 1))
        up[..., 0, 0] = self.vertical[:, 1]
        turned = np.concatenate([a, up], axis=-1) @ np.swapaxes(e, -1, -2)
        y = [g * dcm_from_rotation_vector(self._carried(phi, 0.5 * k * T))[..., :2, 2] for k in range(3)]
        s = np.where(T > 0, T, 1.0)[:, None]
        added = np.stack(
            [y[0], (4 * y[1] - 3 * y[0] - y[2]) / (2 * s), 2 * (y[0] - 2 * y[1] + y[2]) / (3 * s * s)], axis=-2
        )
        return np.asarray(turned[..., :2] + added)

    def _outputs(self, heading: Floats, correction: Floats, accel: Floats, found: Position | Second) -> Floats:
        """Values of `NAMES`, shape (..., R, 9)."""
        dcm = correction @ self.computed
        values = np.zeros((*heading.shape, 9))
        values[..., 0] = heading
        values[..., 1], values[..., 2], values[..., 3] = angles_from_dcm(dcm)
        if isinstance(found, Second):
            gyro = found.gyro
            values[..., 7:9] = (accel[..., None, :] @ dcm[..., :2, :2])[..., 0, :]
        else:
            gyro = np.stack([np.zeros_like(found.gyro_north), found.gyro_north], axis=-1)
        c = dcm if isinstance(found, Second) else dcm_from_rotation_vector(found.phi) @ self.first
        values[..., 4:6] = (gyro[..., None, :] @ c[..., :2, :2])[..., 0, :]
        return values

    @property
    def prior(self) -> tuple[Floats, Floats]:
        """Values of `NAMES` as first computed, and their covariance."""
        M = self._true()
        values = np.zeros((self.runs, 9))
        values[:, 1], values[:, 2], values[:, 3] = angles_from_dcm(self.computed)
        return values, M @ self._second_moments() @ np.swapaxes(M, -1, -2)

    def answers(self) -> list[tuple[Floats, Floats, NDArray[np.bool_]]]:
        """Values, their covariance and whether there are data, after one position and after both."""
        found = self.result(self.a)
        sigma, D, walk = self._linear()
        size = np.sqrt(np.diagonal(sigma, axis1=-2, axis2=-1))
        steps = np.where(size > 0, size, 1e-12).T  # (12, R)
        shift = np.zeros((12, self.runs, 12))
        shift[range(12), :, range(12)] = steps
        shift = np.swapaxes(shift.reshape(12, self.runs, POSITIONS, 2, 3), -1, -2)
        # About zero, where the method is exact to first order: its products are counted by themselves.
        near = self.result(shift), self.result(-shift)
        M, W, force = self._true(), np.zeros((self.runs, 9, 2)), (self.told.gravity * self.told.walk) ** 2
        W[:, 1:4] = angles_of(self.computed)[1][..., [1, 0]] * np.array([-1.0, 1.0]) / self.told.gravity
        answers = []
        for j, name in enumerate(("one", "two")):
            change = wrapped(getattr(near[0], name) - getattr(near[1], name)) / (2 * steps[..., None])
            L = np.moveaxis(change, 0, -1)  # (R, 9, 12)
            miss = L @ D - M
            cov = miss @ self._second_moments() @ np.swapaxes(miss, -1, -2) + L @ sigma @ np.swapaxes(L, -1, -2)
            lean = L @ walk @ np.swapaxes(W, -1, -2)
            cov += W @ np.swapaxes(W, -1, -2) * (force * self.time) - lean - np.swapaxes(lean, -1, -2)
            cov[:, 1, 1] += self.told.walk**2 * self.time
            answers.append((getattr(found, name), cov, np.asarray(self.good[:, : j + 1].all(axis=1))))
        return answers

    def _second_moments(self) -> Floats:
        """Of x about zero: the method knows of no declared bias."""
        cov = self.prior_cov.copy()
        cov[:, range(3, N), range(3, N)] += self.told.mean**2
        return cov

    def _true(self) -> Floats:
        """What the values' errors are before any correction, by x: shape (R, 9, 12), with the sign of a truth."""
        slopes = angles_of(self.computed)[1]
        M = np.zeros((self.runs, 9, N))
        M[:, 0, 2] = 1.0
        to_now = np.concatenate([np.broadcast_to(self.turned.T, (self.runs, 3, 3)), -self.turned.T @ self.J], axis=-1)
        M[:, 1:4, :6] = slopes @ to_now
        M[:, 1:4, 9:] = slopes @ (-self.turned.T @ self.S)
        M[:, range(4, 9), range(3, 8)] = 1.0
        return M

    def _linear(self) -> tuple[Floats, Floats, Floats]:
        """Covariance of the coefficients (R, 12, 12), derivatives by x (.., 12), covariance with the walk (.., 2)."""
        rests, used = self.rests, self.rests.span.shape[1]
        _, by_x = rests.predicted(self.estimator, np.zeros((self.runs, N)))
        own = [1, 2, 3, 5, 6, 7]
        fit = np.zeros((self.runs, used, 6, 8))
        for h in range(2):
            part = slice(4 * h + 1, 4 * h + 4)
            fit[:, :, 3 * h : 3 * h + 3, part] = np.linalg.inv(rests.gram[..., part, part])
        fit = np.where(rests.good[..., None, None], fit, 0.0)
        sigma, walk = rests.noise(self.estimator, fit)
        span = np.where(rests.good, rests.span, 1.0)[..., None]
        scale = (span ** -np.tile([1.0, 2.0, 3.0], 2)).reshape(self.runs, -1)
        sigma = sigma * scale[:, :, None] * scale[:, None, :]
        self._products(sigma)
        D = np.where(rests.good[..., None, None], by_x[:, :, own], 0.0).reshape(self.runs, -1, N) * scale[..., None]
        whole, lines = np.zeros((self.runs, 12, 12)), np.zeros((self.runs, 12, N))
        whole[:, : 6 * used, : 6 * used], lines[:, : 6 * used] = sigma, D
        late = np.zeros((self.runs, 12, 2))
        late[:, : 6 * used] = walk * scale[..., None]
        return whole, lines, late

    def _products(self, sigma: Floats) -> None:
        """Add the second-order terms of the first position, phi_U phi / 2, as an uncertainty."""
        g, cov, (north, _) = self.told.gravity, self._second_moments(), self.told.rate
        up = cov[:, 2, 2]
        sigma[:, 0, 0] += g * g * up * cov[:, 0, 0] / 4
        sigma[:, 3, 3] += g * g * up * cov[:, 1, 1] / 4
        both = g * g * up * cov[:, 0, 1] / 4
        sigma[:, 0, 3] += both
        sigma[:, 3, 0] += both
        sigma[:, 1, 1] += 3 * (g * up * north / 4) ** 2
