r"""All parameters of a unit from rests in many attitudes that nobody knows, and the turns between them.

    f_i = C_i' g + X_a theta + n,     w_i = C_i' omega_ie + X_g theta + n,
    C_i' exp([omega_ie tau] x) C_i+1 = turn by the gyros, less what theta makes of it

over the rests i with mean outputs f_i and w_i and unknown attitudes C_i, and the turns of length tau from one to the
next. The attitudes are nuisance: so of a rest only the magnitudes of gravity and of the Earth's rate and the angle
between them tell, and of a turn how it carries one rest's directions into the next one's. No table is needed: the unit
may be turned by hand. The equations are solved by Gauss-Newton, with turns integrated anew, to the maximum of the
posterior; the noise has the covariance of all that the datasheet tells.
What shows in a turn alone of an accelerometer (lever arm, delay) keeps what was declared.
Source: Tedaldi, Pretto and Menegatti, A robust and easy to implement method for IMU calibration without external
equipments, ICRA 2014; gravity's magnitude: Lotters et al., Sensors and Actuators A 68 (1998) 221; the attitudes as
unknowns instead of magnitudes: Triggs et al., Bundle adjustment (2000), whose marginal is the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import final

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from insenv.core.attitude import dcm_from_rotation_vector, rotation_vector_from_dcm
from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.unit.motion import GYROS, UNIT
from insenv.information.means import stated_noises
from insenv.information.unit.inputs import ROWS, TURNING, UnitInputs, noises_of_first_order, rows_of

#: Shortest rest that is used [s]; steps of Gauss-Newton at most, and the one that is small enough [prior deviations].
SHORTEST, _STEPS, _SMALL = 1.0, 8, 1e-3
#: Headings that are begun with where biases may be larger than this share of the Earth's level rate.
_HEADINGS, _SURE = 4, 0.3
#: Share of a turn's white noise that keeps its covariance regular.
_RIDGE = 1e-6


@dataclass(frozen=True)
class RowsSeen:
    """State: all rows, in chunks of shape (R, ROWS, n), and whether there is a batch in front."""

    rows: tuple[Floats, ...]
    batched: bool


@dataclass(frozen=True)
class _Rests:
    """Rests of a run, K of them, and the turns between.

    Attributes
    ----------
    means : ndarray, shape (K, ROWS)
    turns : list of ndarray, shape (ROWS, n + 2)
        Rows from the last of a rest to the first of the next.
    times : ndarray, shape (K - 1,)
        [s]
    noise : list of ndarray
        Of each channel: covariance of the means of the rests; of a gyro's, those of the turns stand between.
    """

    means: Floats
    turns: list[Floats]
    times: Floats
    noise: list[Floats]


@final
@dataclass(frozen=True)
class MultiPosition:
    """Parameters of the unit with their covariance, without a table.

    Needs "gyro_x" .. "gyro_z" [rad/s], "accel_x" .. "accel_z" [m/s^2] and "turning"; "temperature" [K] where an effect
    of it is declared.

    Raises
    ------
    InputError
        If the datasheet tells of no gravity, no noise or one that is neither white, nor flicker, nor a walk.
    """

    datasheet: Datasheet

    def __post_init__(self) -> None:
        if self.datasheet.site.gravity is None:
            raise InputError("the datasheet tells of no gravity; wanted site.gravity, which accelerometers are set to")
        _ = self._white

    @cached_property
    def inputs(self) -> UnitInputs:
        """The declared model."""
        return UnitInputs(self.datasheet)

    @cached_property
    def _white(self) -> Floats:
        """Densities of the gyros' white noise [rad^2/s]."""
        return noises_of_first_order(self.datasheet)[0][:3]

    @cached_property
    def _level(self) -> tuple[Floats, Floats]:
        """Gravity's reaction and the Earth's rate, east, north, up."""
        site = self.datasheet.site
        assert site.gravity is not None
        rate = np.zeros(3)
        if site.latitude is not None:
            rate[1:] = EARTH_RATE * np.cos(site.latitude), EARTH_RATE * np.sin(site.latitude)
        return np.array([0.0, 0.0, site.gravity]), rate

    def reset(self, batch: int | None = None) -> RowsSeen:
        """No row yet."""
        return RowsSeen((np.zeros((batch or 1, ROWS, 0)),), batch is not None)

    def update(self, state: RowsSeen, chunk: Recording) -> RowsSeen:
        """State after a chunk."""
        rows = rows_of(chunk, self.datasheet.reference_temperature)
        return RowsSeen((*state.rows, rows), state.batched)

    def estimate(self, state: RowsSeen) -> Estimate:
        """What is known; before there are two rests, what the datasheet tells."""
        parameters = self.inputs.parameters
        sd, prior = (np.array([getattr(q, name) for q in parameters]) for name in ("sd", "mean"))
        rows = np.concatenate(state.rows, axis=-1)
        mean, cov = np.tile(prior, (len(rows), 1)), np.tile(np.diag(sd**2), (len(rows), 1, 1))
        for i in range(len(rows)):
            rests = self._rests(rows[i])
            if len(rests.means) > 1:
                shift, spread = self._solved(rests)
                mean[i] += sd * shift
                cov[i] = spread * np.outer(sd, sd)
        if not state.batched:
            mean, cov = mean[0], cov[0]
        return Estimate(tuple(q.name for q in parameters), tuple(q.unit for q in parameters), mean, cov)

    def _rests(self, rows: Floats) -> _Rests:
        """Of one run; shorter rests are part of the turn that they are in."""
        sheet, n = self.datasheet, rows.shape[-1]
        change = np.flatnonzero(np.diff(rows[TURNING] > 0)) + 1
        edges = np.concatenate([[0], change, [n]])
        least = SHORTEST * sheet.sampling
        kept = [
            (int(a), int(b))
            for a, b in zip(edges[:-1], edges[1:], strict=True)
            if b - a >= least and rows[TURNING, a] == 0
        ]
        if len(kept) < 2:
            return _Rests(np.zeros((len(kept), ROWS)), [], np.zeros(0), [])
        means = np.array([rows[:, a:b].mean(axis=-1) for a, b in kept])
        between = list(zip(kept[:-1], kept[1:], strict=True))
        turns = [rows[:, before[1] - 1 : after[0] + 1] for before, after in between]
        times = np.array([after[0] - before[1] for before, after in between]) * sheet.dt
        cells = np.array([edge for pair in kept for edge in pair], np.int64)
        noise = []
        for target in UNIT:
            one = sum(c.coefficient**2 * c.effect.covariance(cells, sheet.dt) for c in stated_noises(sheet, target))
            noise.append(np.asarray(one) if target in GYROS else np.asarray(one)[::2, ::2])
        return _Rests(means, turns, times, noise)

    def _solved(self, rests: _Rests) -> tuple[Floats, Floats]:
        """Of one run, in units of the prior deviations: the best of what several first headings lead to."""
        found = [self._from(rests, heading) for heading in self._headings(rests)]
        _, shift, cov = min(found, key=lambda one: one[0])
        return shift, cov

    def _from(self, rests: _Rests, heading: float) -> tuple[float, Floats, Floats]:
        """Cost, parameters and their covariance, from a first heading on."""
        parameters = self.inputs.parameters
        sd, prior = (np.array([getattr(q, name) for q in parameters]) for name in ("sd", "mean"))
        q, count = len(sd), len(rests.means)
        theta, attitudes = np.zeros(q), self._first(rests, heading)
        cost, cov = np.inf, np.eye(q)
        for _ in range(_STEPS):
            residual, slopes, attitudes = self._equations(rests, prior + sd * theta, sd, attitudes)
            # Unknown are the changes of the attitudes and the parameters themselves, which have the prior.
            data = residual + slopes[:, :q] @ theta
            normal = slopes.T @ slopes
            normal[:q, :q] += np.eye(q)
            # An attitude is within half a turn: that holds a heading that nothing tells.
            normal[q:, q:] += np.eye(3 * count) / np.pi**2
            inverse: Floats = np.asarray(np.linalg.inv(normal), float)
            solved = inverse @ (slopes.T @ data)
            step, theta = solved[:q] - theta, solved[:q]
            turned = solved[q:].reshape(count, 3)
            attitudes = [dcm_from_rotation_vector(v) @ c for v, c in zip(turned, attitudes, strict=True)]
            left = data - slopes @ solved
            cost, cov = float(left @ left + theta @ theta), inverse[:q, :q]
            if np.abs(step).max() < _SMALL and np.abs(turned).max() < _SMALL:
                break
        return cost, theta, 0.5 * (cov + cov.T)

    def _first(self, rests: _Rests, heading: float) -> list[Floats]:
        """Attitude of the first rest by gravity, with a heading; the others follow from the turns."""
        return [dcm_from_rotation_vector(np.array([0.0, 0.0, heading])) @ self._level_axes(rests)]

    @staticmethod
    def _level_axes(rests: _Rests) -> Floats:
        """Of the first rest by gravity: rows are two level directions and up, in the unit."""
        force = rests.means[0, 3:6]
        up = force / np.linalg.norm(force)
        side = np.eye(3)[int(np.argmin(np.abs(up)))]
        east = np.cross(side, up) / np.linalg.norm(np.cross(side, up))
        return np.stack([east, np.cross(up, east), up])

    def _headings(self, rests: _Rests) -> Floats:
        """That which the Earth's rate tells, and others where biases may be as large."""
        earth = self._level[1]
        if not earth.any():
            return np.zeros(1)
        inputs, _ = self._at_rest(rests, np.array([q.mean for q in self.inputs.parameters]))
        east, north, _ = self._level_axes(rests) @ inputs[0, :3]
        names = [f"{target}.bias.c" for target in GYROS]
        bias = max((q.sd for q in self.inputs.parameters if q.name in names), default=0.0)
        count = 1 if bias < _SURE * earth[1] else _HEADINGS
        headings: Floats = np.arctan2(east, north) + 2 * np.pi * np.arange(count) / count
        return headings

    def _equations(
        self, rests: _Rests, theta: Floats, sd: Floats, attitudes: list[Floats]
    ) -> tuple[Floats, Floats, list[Floats]]:
        """White residuals, their derivatives to parameters per deviation and attitudes, and attitudes of all rests."""
        gravity, earth = self._level
        q, count = len(theta), len(rests.means)
        ends = np.concatenate([[0], np.cumsum(self.inputs.counts)])
        inputs, columns = self._at_rest(rests, theta)
        turned = [self._turned(rows, theta, sd) for rows in rests.turns]
        attitudes = list(attitudes)
        for k in range(len(attitudes), count):
            drift = dcm_from_rotation_vector(-earth * rests.times[k - 1])
            attitudes.append(drift @ attitudes[k - 1] @ turned[k - 1][0])
        left, slopes = np.zeros((len(UNIT), count)), np.zeros((len(UNIT), count, q + 3 * count))
        for c in range(len(UNIT)):
            vector = earth if c < len(GYROS) else gravity
            own = slice(ends[c], ends[c + 1])
            slopes[c, :, own] = columns[c] * sd[own]
            for k, attitude in enumerate(attitudes):
                slopes[c, k, q + 3 * k : q + 3 * k + 3] = np.cross(attitude[:, c % 3], vector)
                left[c, k] = inputs[k, c] - attitude[:, c % 3] @ vector
        seen, made = np.zeros((count - 1, 3)), np.zeros((count - 1, 3, q + 3 * count))
        for k, (matrix, slope, _) in enumerate(turned):
            before = attitudes[k].T
            expected = before @ dcm_from_rotation_vector(earth * rests.times[k]) @ attitudes[k + 1]
            made[k, :, : slope.shape[1]] = slope
            made[k, :, q + 3 * k : q + 3 * k + 6] = np.concatenate([-before, before], axis=-1)
            seen[k] = rotation_vector_from_dcm(matrix @ expected.T)
        roots = [self._root(rests, [one[2] for one in turned]), *(cholesky(one, lower=True) for one in rests.noise[3:])]
        data = [np.concatenate([left[:3].ravel(), seen.ravel()]), *left[3:]]
        rows = [np.concatenate([slopes[:3].reshape(-1, q + 3 * count), made.reshape(-1, q + 3 * count)]), *slopes[3:]]
        white = [
            np.asarray(solve_triangular(root, np.column_stack([row, one]), lower=True))
            for root, row, one in zip(roots, rows, data, strict=True)
        ]
        every = np.concatenate(white)
        return every[:, -1], every[:, :-1], attitudes

    def _root(self, rests: _Rests, carried: list[Floats]) -> Floats:
        """Lower root of the covariance of the gyros' rests, channel by channel, and of the turns.

        A turn has the mean noise of each gyro carried by ``carried``, shape (3, 3) [s], and what of the white noise
        that mean leaves.
        """
        count = len(rests.means)
        total = np.zeros((6 * count - 3, 6 * count - 3))
        most = float(self._white.max())
        for c, noise in enumerate(rests.noise[:3]):
            part = np.zeros((len(total), len(noise)))
            part[c * count : (c + 1) * count, ::2] = np.eye(count)
            for k, matrix in enumerate(carried):
                part[3 * (count + k) : 3 * (count + k) + 3, 2 * k + 1] = matrix[:, c]
            total += part @ noise @ part.T
        for k, (matrix, time) in enumerate(zip(carried, rests.times, strict=True)):
            own = slice(3 * (count + k), 3 * (count + k) + 3)
            total[own, own] += most * (time * (1 + _RIDGE) * np.eye(3) - matrix @ matrix.T / time)
        return np.asarray(cholesky(total, lower=True))

    def _at_rest(self, rests: _Rests, theta: Floats) -> tuple[Floats, list[Floats]]:
        """Inputs of the rests, shape (K, 6), and the regressors of each channel."""
        rows = np.repeat(rests.means[..., None], 3, axis=-1)
        rows[:, TURNING] = 0.0
        inputs, columns = self.inputs.solved(rows, 1, np.tile(theta, (len(rows), 1)))
        return inputs[..., 0], [one[:, 0] for one in columns]

    def _turned(self, rows: Floats, theta: Floats, sd: Floats) -> tuple[Floats, Floats, Floats]:
        """Turn by the gyros, its derivative to their parameters per deviation, and to their mean rates."""
        inputs, columns = self.inputs.solved(np.ascontiguousarray(rows[None]), 1, theta[None])
        counts = self.inputs.counts[:3]
        # The last column of each gyro is of a rate of one: how its noise is carried.
        own = tuple(np.ascontiguousarray(np.insert(columns[g][0], counts[g], 1.0, axis=-1)) for g in range(3))
        matrix, slope = np.eye(3), np.zeros((3, sum(counts) + 3))
        _kernel().turn(np.ascontiguousarray(inputs[0, :3].T), own, self.datasheet.dt, matrix, slope)
        last = np.cumsum(np.add(counts, 1)) - 1
        return matrix, np.delete(slope, last, axis=1) * sd[: sum(counts)], slope[:, last]


def _kernel() -> ModuleType:
    """Compiled loops, imported where an estimator is used."""
    from estimators.system_calibration import turn_kernel

    return turn_kernel
