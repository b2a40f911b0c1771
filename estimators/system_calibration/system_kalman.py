r"""All parameters of a unit by a Kalman filter of the errors of its navigation: velocities at rest are its data.

The unit navigates on the table, with the static mechanisation (`insenv.navigation.strapdown`) and with what is known of
its errors taken off. With C^ = (1 - [phi x]) C the attitude found, dv = v^ - v, and u^ = u + X dtheta + n the inputs,
where X are the regressors of the declared effects and dtheta what is not yet known of their parameters,

    phi' = -omega_ie x phi - C (X_g dtheta + n_g),      dv' = f^n x phi + C (X_a dtheta + n_a),      dtheta' = 0

The first follows from C^' = C^ [w^ x] - [omega_ie x] C^, put into the definition of phi; the second from
v^' = C^ f^ + g, to first order; Coriolis terms of dv are left out, as in the mechanisation. While the unit rests, its
velocity is zero, and so v^ is a measurement of dv: of the force's errors by its slope, of the level errors and the
gyros' biases across the level by the slope's slope, and through the turns between two rests of scale factors and
misalignments of the gyros. Two angles of a turn show at its end as tilts against gravity; the readings of the table
are not needed, but for where it stands at first. Regressors are those of theta*, which is what is told.

The course that navigation takes is that of theta*, and what the filter finds stays beside it: put back after every
sample it would turn the axes in which the regressors stand, and a bias that is seen in other axes looks like something
new. A unit at rest, which cannot tell a bias of a level accelerometer from a tilt, told a bias of 30 mg so to a fifth,
and wrongly. At rest the course is put level by its own velocity, in some seconds and whatever the filter found, and the
errors that are found are shifted by as much.

Of a coarse unit the products of dtheta and phi show beside the noise (`insenv.information.unit.anew`): then the filter
begins again as the recording grows, with the parameters theta* and the first attitude that it found, and with the
covariance that was told; the error of the first attitude is three states more. What was told about mu instead of theta*
is put in at the end,

    theta^ = theta* + x^ + S P^-1 (mu - theta*),

with S the covariance found and P the one told: of a linear filter the same as to begin with mu - theta*. All rows are
kept for that.

Of a unit with biases, scale factors, misalignments (9 and 6) and second-order terms there are 30 states; what else is
declared with a deviation is one state each, and slow noise is processes of first order
(`insenv.information.unit.inputs`). Needs velocities free of vibration to `VIBRATION`.
Source: the 19 positions and their filter of velocity errors as the toolbox PSINS simulates them, after Xie Bo,
Multiposition calibration method of laser gyro SINS, J. Chinese Inertial Technology (2011); Camberlein and Mazzanti,
Calibration technique for laser gyro strapdown inertial navigation systems, Symposium Gyro Technology, Stuttgart (1985);
the equations are derived anew from Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. (2004),
sections 12.2 and 12.3; regressors of one course, lest the filter learn of what nobody sees: Huang, Mourikis and
Roumeliotis, Observability-based rules for designing consistent EKF SLAM estimators, Int. J. Robotics Research 29 (2010)
502; to begin again about what was found is Gauss-Newton: Bell and Cathey, The iterated Kalman filter update as a
Gauss-Newton method, IEEE Trans. Automatic Control 38 (1993) 294.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from types import ModuleType
from typing import final

import numpy as np
from numpy.typing import NDArray

from insenv.core.attitude import dcm_from_quaternion, dcm_from_rotation_vector, quaternion_from_dcm
from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.unit.gimbals import Gimbals
from insenv.core.unit.motion import GYROS, UNIT
from insenv.effects.base import combine
from insenv.information.positions import from_level
from insenv.information.unit.anew import FIRST, after, hidden, products_show
from insenv.information.unit.inputs import ROWS, TURNING, Slow, UnitInputs, noises_of_first_order, rows_of

#: Velocity of a unit at rest on its table, white from sample to sample [m/s]. What the second order of the angles makes
#: of gravity in a second stands beside it.
VIBRATION = 1e-5
#: Length of a block, at whose beginning slow noise goes on [s].
BLOCK = 1.0
#: Passes at most until an estimate stays where it is.
_PASSES = 5
#: Blocks whose regressors are taken together.
_TOGETHER = 20


@dataclass(frozen=True)
class FilterState:
    """State.

    Attributes
    ----------
    rows : ndarray, shape (R, STATE + m)
        Of `estimators.system_calibration.system_kalman_kernel`; values of the states in their deviations, of the
        parameters beside ``theta``.
    cov : ndarray, shape (R, 6 + m, 6 + m)
    theta : ndarray, shape (R, q)
        Parameters of which the regressors are [SI].
    past : ndarray, shape (R, ROWS, 1)
        Row before the rest.
    rest : ndarray, shape (R, ROWS, r)
        Rows that fill no block, or whose successor is not there.
    samples : int
        Taken so far.
    batched : bool
    wrong : ndarray, shape (R,)
        What the square of angles makes of a velocity at rest [m/s].
    begun : ndarray, shape (R, q) or (R, q + 3)
        ``theta`` less what is told, and of a coarse unit the first attitude, in deviations of both.
    kept : tuple of ndarray, shape (R, ROWS, n)
        All rows, of a coarse unit.
    outset : FilterState or None
        State before the first row, of a coarse unit.
    due : int
        Blocks after which the filter begins again.
    """

    rows: Floats
    cov: Floats
    theta: Floats
    past: Floats
    rest: Floats
    samples: int
    batched: bool
    wrong: Floats
    begun: Floats
    kept: tuple[Floats, ...] = ()
    outset: FilterState | None = None
    due: int = FIRST

    def runs(self, rows: NDArray[np.int64]) -> FilterState:
        """Some of the runs."""
        of = {name: getattr(self, name)[rows] for name in ("rows", "cov", "theta", "past", "rest", "wrong", "begun")}
        outset = None if self.outset is None else self.outset.runs(rows)
        return replace(self, **of, kept=tuple(part[rows] for part in self.kept), outset=outset)


@final
@dataclass(frozen=True)
class SystemKalman:
    """Parameters of the unit with their covariance, on line.

    Needs "gyro_x" .. "gyro_z" [rad/s], "accel_x" .. "accel_z" [m/s^2], "turning", and "axis_1" .. [rad] of the first
    row; "temperature" [K] where an effect of it is declared.

    Raises
    ------
    InputError
        If the datasheet tells of no axes, no gravity, no noise or one that is neither white, nor flicker, nor a walk.
    """

    datasheet: Datasheet

    def __post_init__(self) -> None:
        if self.datasheet.site.gravity is None:
            raise InputError("the datasheet tells of no gravity; wanted site.gravity, which accelerometers are set to")
        _ = self.gimbals, self._noises

    @property
    def gimbals(self) -> Gimbals:
        """The table, for where it stands at first and how well that is known."""
        found = self.datasheet.mounting.gimbals
        if found is None:
            raise InputError("the datasheet tells of no table with several axes; wanted mounting.gimbals")
        return found

    @cached_property
    def inputs(self) -> UnitInputs:
        """The declared model."""
        return UnitInputs(self.datasheet)

    @cached_property
    def _noises(self) -> tuple[Floats, tuple[Slow, ...]]:
        return noises_of_first_order(self.datasheet)

    @cached_property
    def _places(self) -> NDArray[np.int64]:
        """First state of each channel, and their number."""
        slow = [sum(s.channel == c for s in self._noises[1]) for c in range(len(UNIT))]
        return np.concatenate([[0], np.cumsum(np.add(self.inputs.counts, slow))]).astype(np.int64)

    @cached_property
    def _own(self) -> NDArray[np.int64]:
        """Places of the parameters among the states; the others are slow noise, in the order of `_noises`."""
        return np.concatenate(
            [self._places[c] + np.arange(count) for c, count in enumerate(self.inputs.counts)]
        ).astype(np.int64)

    @cached_property
    def _slow(self) -> NDArray[np.int64]:
        return np.setdiff1d(np.arange(self._places[-1]), self._own)

    @cached_property
    def _sd(self) -> Floats:
        return np.array([q.sd for q in self.inputs.parameters])

    @cached_property
    def _anew(self) -> bool:
        return products_show(self.datasheet)

    @cached_property
    def _sought(self) -> NDArray[np.int64]:
        """Places among all states of the parameters, and of the first attitude where it is one."""
        first = np.arange(6 + self._places[-1], self.states)
        return np.concatenate([6 + self._own, first]).astype(np.int64)

    @property
    def size(self) -> int:
        """Samples of a block."""
        return max(1, round(BLOCK * self.datasheet.sampling))

    @property
    def states(self) -> int:
        """Errors of attitude and velocity, parameters, processes of slow noise; the first attitude of a coarse unit."""
        return 6 + int(self._places[-1]) + 3 * self._anew

    def reset(self, batch: int | None = None) -> FilterState:
        """No row yet."""
        runs, m = batch or 1, self.states - 6
        theta = np.tile([q.mean for q in self.inputs.parameters], (runs, 1))
        cov = np.zeros((runs, 6 + m, 6 + m))
        cov[:, 6:, 6:] = np.eye(m)
        walks = [6 + int(j) for j, s in zip(self._slow, self._noises[1], strict=True) if s.walk]
        cov[:, walks, walks] = 0.0
        rows = np.zeros((runs, _kernel().STATE + m))
        nothing = np.zeros((runs, ROWS, 0))
        wrong, begun = self._wrong(np.tile(np.eye(len(self._sd)), (runs, 1, 1))), np.zeros((runs, len(self._sought)))
        return FilterState(rows, cov, theta, nothing, nothing, 0, batch is not None, wrong, begun)

    def update(self, state: FilterState, chunk: Recording) -> FilterState:
        """State after a chunk."""
        rows = rows_of(chunk, self.datasheet.reference_temperature)
        if not len(chunk):
            return state
        if not state.past.shape[-1]:
            state = self._begun(state, chunk, rows)
        if state.outset is not None:
            state = replace(state, kept=(*state.kept, rows))
        rows = np.concatenate([state.past, state.rest, rows], axis=-1)
        state, at = replace(state, rows=state.rows.copy(), cov=state.cov.copy()), 0
        while (whole := self._whole(rows[..., at:])) > 0:
            if state.outset is not None:
                whole = min(whole, state.due - state.samples // self.size)
            state = self._onward(state, rows[..., at : at + whole * self.size + 2])
            at += whole * self.size
            if state.outset is not None and state.samples == state.due * self.size:
                state = self._again(state, state.outset)
        return replace(state, past=rows[..., at : at + 1].copy(), rest=rows[..., at + 1 :].copy())

    def estimate(self, state: FilterState) -> Estimate:
        """What is known after the last whole block."""
        for _ in range(_PASSES):
            rows = self._gone(state)
            if not len(rows):
                break
            state = self._settled(state, rows)
        own = 6 + self._own
        cov = state.cov[:, own[:, None], own] * np.outer(self._sd, self._sd)
        mean = np.array([q.mean for q in self.inputs.parameters]) + self._sd * self._found(state)[:, : len(self._sd)]
        if not state.batched:
            mean, cov = mean[0], cov[0]
        parameters = self.inputs.parameters
        return Estimate(tuple(q.name for q in parameters), tuple(q.unit for q in parameters), mean, cov)

    def _found(self, state: FilterState) -> Floats:
        """Parameters and the first attitude, less what is told, in deviations, shape (R, q) or (R, q + 3)."""
        at = self._sought
        drawn_back = combine(state.cov[:, at[:, None], at], state.begun)
        return state.begun + state.rows[:, _kernel().STATE - 6 + at] - drawn_back

    def _gone(self, state: FilterState) -> NDArray[np.int64]:
        """Runs that went so far from where they began that the square of it shows beside the noise of a rest."""
        if state.outset is None or state.samples < self.size:
            return np.zeros(0, np.int64)
        gravity, q = self._gravity, len(self._sd)
        went = self._found(state) - state.begun
        angles = {"1": 1.0, "m/s^2": 1 / gravity}
        sizes = self._sd * [angles.get(q.unit, 0.0) for q in self.inputs.parameters]
        tilts = combine(state.outset.cov[:, :2, -3:], went[:, q:])
        squares = np.sum((went[:, :q] * sizes) ** 2, axis=-1) + np.sum(tilts**2, axis=-1)
        return np.flatnonzero(squares * gravity > hidden(self.datasheet))

    def _settled(self, state: FilterState, rows: NDArray[np.int64]) -> FilterState:
        """The same, these runs begun again."""
        assert state.outset is not None
        again = self._again(state.runs(rows), state.outset.runs(rows))
        found = {name: getattr(state, name).copy() for name in ("rows", "cov", "theta", "wrong", "begun")}
        for name, values in found.items():
            values[rows] = getattr(again, name)
        return replace(state, **found)

    def _again(self, state: FilterState, outset: FilterState) -> FilterState:
        """The filter after the same rows, begun with what it found."""
        q, found = len(self._sd), self._found(state)
        theta = np.array([q.mean for q in self.inputs.parameters]) + self._sd * found[:, :q]
        own = self._sought[:q]
        wrong = self._wrong(state.cov[:, own[:, None], own])
        again = replace(outset, rows=outset.rows.copy(), cov=outset.cov.copy(), theta=theta, wrong=wrong)
        for i, turn in enumerate(combine(again.cov[:, :3, -3:], found[:, q:])):
            first = dcm_from_quaternion(again.rows[i, :4])
            again.rows[i, :4] = quaternion_from_dcm(dcm_from_rotation_vector(turn) @ first)
        rows = np.concatenate(state.kept, axis=-1)
        again = self._onward(again, np.concatenate([outset.past, rows[..., : state.samples + 1]], axis=-1))
        again = replace(again, past=state.past, rest=state.rest, begun=found, kept=(rows,))
        return replace(again, outset=outset, due=after(state.due))

    def _whole(self, rows: Floats) -> int:
        """Whole blocks, with a row before and one after them."""
        return (rows.shape[-1] - 2) // self.size

    def _begun(self, state: FilterState, chunk: Recording, rows: Floats) -> FilterState:
        """Attitude by the table's first readings, and what of it is not known."""
        table = self.gimbals
        angles = np.stack([chunk.values(f"axis_{m + 1}", "rad")[..., 0] for m in range(len(table.axes))], axis=-1)
        first, cov = np.concatenate([state.rows], axis=0), state.cov.copy()
        mounting, base, others = np.array(table.sd[:3]), np.array(table.sd[3:6]), table.sd[6:]
        for i, at in enumerate(angles.reshape(len(first), -1)):
            to_unit, to_base = from_level(table, at.tolist())
            first[i, :4] = quaternion_from_dcm(to_unit.T)
            cov[i, :3, :3] = (to_unit.T * mounting**2) @ to_unit + (to_base.T * base**2) @ to_base
            cov[i, :3, :3] += (np.sum(np.square(others)) + table.noise**2) * np.eye(3)
            if self._anew:
                cov[i, :3, -3:] = np.linalg.cholesky(cov[i, :3, :3])
                cov[i, -3:, :3] = cov[i, :3, -3:].T
        past = rows[..., :1].copy()
        past[:, TURNING] = 0.0
        state = replace(state, rows=first, cov=cov, past=past)
        return replace(state, outset=state) if self._anew else state

    def _onward(self, state: FilterState, rows: Floats) -> FilterState:
        """After whole blocks; rows with that before and that after them. Arrays of the state are changed."""
        coupling, whole = self.inputs.coupling(state.theta), self._whole(rows)
        for first in range(0, whole, _TOGETHER):
            count = min(_TOGETHER, whole - first)
            at = first * self.size
            self._blocks(state, np.ascontiguousarray(rows[..., at : at + count * self.size + 2]), coupling, at)
        return replace(state, samples=state.samples + whole * self.size)

    def _blocks(self, state: FilterState, rows: Floats, coupling: Floats, at: int) -> None:
        """Blocks that begin ``at`` samples after those of the state, whose arrays are changed."""
        inputs, found = self.inputs.solved(rows, state.samples + at, state.theta, self.size)
        runs, n = len(rows), inputs.shape[-1]
        columns = np.empty((runs, n, self._places[-1]))
        columns[..., self._own] = np.concatenate(found, axis=-1) * self._sd
        columns[..., self._slow] = [s.sd for s in self._noises[1]]
        inputs, resting = np.ascontiguousarray(np.swapaxes(inputs, -1, -2)), rows[:, TURNING, 1:-1] == 0.0
        for k in range(0, n, self.size):
            now = slice(k, k + self.size)
            self._slow_on(state)
            _kernel().run(
                np.ascontiguousarray(inputs[:, now]),
                np.ascontiguousarray(columns[:, now]),
                np.ascontiguousarray(resting[:, now]),
                self._places,
                coupling,
                self._numbers,
                VIBRATION**2 + state.wrong**2,
                state.rows,
                state.cov,
            )
            np.add(state.cov, np.swapaxes(state.cov, -1, -2), out=state.cov)
            np.multiply(state.cov, 0.5, out=state.cov)

    def _slow_on(self, state: FilterState) -> None:
        """Slow noise goes on by a block, half of it before and half after it: one step from middle to middle."""
        if not len(self._slow):
            return
        time = self.size * self.datasheet.dt
        kept = np.exp([-time / s.time for s in self._noises[1]])
        new = 1 - kept**2 + np.array([s.walk * time for s in self._noises[1]])
        at = 6 + self._slow
        state.cov[:, at] *= kept[:, None]
        state.cov[:, :, at] *= kept
        state.cov[:, at, at] += new
        state.rows[:, _kernel().STATE + self._slow] *= kept

    def _wrong(self, cov: Floats) -> Floats:
        """Velocities at rest that the square of what is not known of the gyros makes of gravity, shape (R,) [m/s].

        cov : shape (R, q, q), of the parameters in their deviations.
        """
        variances = np.diagonal(cov, axis1=-2, axis2=-1) * self._sd**2
        angles = [
            [j for j, q in enumerate(self.inputs.parameters) if q.name.startswith(g) and q.unit == "1"] for g in GYROS
        ]
        found: Floats = np.max([variances[:, one].sum(axis=-1) for one in angles], axis=0)
        return found * self._gravity

    @property
    def _gravity(self) -> float:
        assert self.datasheet.site.gravity is not None
        return self.datasheet.site.gravity

    @cached_property
    def _numbers(self) -> Floats:
        latitude = self.datasheet.site.latitude
        north, up = (0.0, 0.0) if latitude is None else (EARTH_RATE * np.cos(latitude), EARTH_RATE * np.sin(latitude))
        return np.array([self.datasheet.dt, north, up, self._gravity, *self._noises[0]])


def _kernel() -> ModuleType:
    """Compiled loops, imported where an estimator is used."""
    from estimators.system_calibration import system_kalman_kernel

    return system_kalman_kernel
