r"""Net motion of the base of a body at rest, by the effect ``base_tilt``.

With th_a the tilt integrated from the gyros less their mean rate and c = g, an accelerometer of a base that tilts reads

    f_a = b_a + g th_a + drift_a t,       du/dt = drift / g,       net rate of the base = du/dt x u

with u the up direction in body axes: the drift is what the gyros' mean does not know of. It is fitted to all of the
rest in velocities, V(t) = v0 + b t + drift t^2 / 2, by generalised least squares. The noise of V is white (pulses of
the accelerometers, shaking), a velocity random walk, and the integral of the gyros' angle random walk; for the means of
blocks of length d with the middles t_i and t_j, a the smaller of them and b the larger,

    C_ij = R^2 [i = j] + A^2 (a - [i = j] d / 6) + (g N)^2 a^2 (3 b - a) / 6

R and A, which no datasheet tells of a vehicle, are fitted to each rest and axis by restricted maximum likelihood: it
sees only what the regressors leave. As those are a quadratic of the time, that is the likelihood of the third
differences of V, of which only neighbours are correlated. N is told; a few minutes hardly determine it, several rests
do (`fitted_angle_walk`). Products of the base's tilt and its rate of turn are left out: a few thousandths of a degree.
Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. (2004), section 10.3, for the tilt;
Harville, J. Am. Stat. Assoc. 72 (1977) 320, for the restricted likelihood.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded, solve_triangular
from scipy.optimize import minimize, minimize_scalar

from insenv.core.errors import InputError
from insenv.core.recording import Floats, Recording
from insenv.core.units import DEG_PER_SQRT_HOUR
from insenv.data.exposure import Exposure, expose
from insenv.effects.tilt import BaseTilt

GYROS, ACCELS = ("gyro_x", "gyro_y", "gyro_z"), ("accel_x", "accel_y", "accel_z")
#: Velocities are averaged over this long [s], or longer in a rest of more than `MOST` blocks.
BLOCK, MOST = 1.0, 300
#: Fewer blocks than this do not tell the noise from the tilt.
FEWEST = 20
#: Range in which `fitted_angle_walk` looks, and how finely [rad/sqrt(s), and a factor].
LEAST_WALK, LARGEST_WALK, FINELY = 1e-5 * DEG_PER_SQRT_HOUR, 1.0 * DEG_PER_SQRT_HOUR, 1.05
#: Differences that leave nothing of the regressors.
_ORDER = 3
#: What is added to the diagonal, as a share of it: keeps the matrix definite.
_JITTER = 1e-12


@dataclass(frozen=True)
class Unrest:
    """What disturbs the velocities of one level axis.

    Attributes
    ----------
    velocity : float
        White velocity error of a block, R [m/s].
    velocity_walk : float
        A [m/s/sqrt(s)].
    angle_walk : float
        Of the gyros, N [rad/sqrt(s)].
    """

    velocity: float
    velocity_walk: float
    angle_walk: float


@dataclass(frozen=True)
class RestBlocks:
    """A rest in blocks.

    Attributes
    ----------
    axes : ndarray, shape (3, 3)
        Level right, level forward and up in body axes, as rows.
    t : ndarray, shape (m,)
        Middles of the blocks since the start [s].
    v : ndarray, shape (m, 2)
        Velocity right and forward, the tilt seen by the gyros taken off [m/s].
    X : ndarray, shape (m, k)
        Regressors: start velocity, constant force, drift.
    gravity, span : float
        [m/s^2], [s]
    """

    axes: Floats
    t: Floats
    v: Floats
    X: Floats
    gravity: float
    span: float

    @cached_property
    def differences(self) -> Differences:
        """Third differences of the velocities, and what they are made of."""
        a, b = np.minimum.outer(self.t, self.t), np.maximum.outer(self.t, self.t)
        one = np.eye(len(a))
        to = np.diff(one, n=_ORDER, axis=0)
        parts = (one, _walk(self.t, a), self.gravity**2 * _tilt(a, b))
        return Differences(to @ self.v, np.stack([_bands(to @ part @ to.T) for part in parts]))


@dataclass(frozen=True)
class Differences:
    """Third differences of block velocities.

    Attributes
    ----------
    v : ndarray, shape (m - 3, 2)
    bands : ndarray, shape (3, 4, m - 3)
        Their covariance for R = 1, A = 1 and N = 1: the diagonal and those below it.
    """

    v: Floats
    bands: Floats


def _bands(square: Floats) -> Floats:
    return np.stack([np.pad(np.diagonal(square, -k), (0, k)) for k in range(_ORDER + 1)])


def _walk(t: Floats, a: Floats) -> Floats:
    """Covariance of block means of a walk; one has a sixth of its length less variance than the walk at its middle."""
    return a - (t[1] - t[0]) / 6 * np.eye(len(a))


def _tilt(a: Floats, b: Floats) -> Floats:
    """Covariance of the integral of a walk."""
    return a * a * (3 * b - a) / 6


@dataclass(frozen=True)
class BaseMotion:
    """Net motion of the base over a rest.

    Attributes
    ----------
    rate : ndarray, shape (3,)
        Net rate about the level axes, in body axes [rad/s].
    cov : ndarray, shape (3, 3)
        Of the gyros' mean rate less ``rate``.
    force_cov : ndarray, shape (3, 3)
        Of the mean specific force [(m/s^2)^2].
    unrest : tuple of Unrest
        Along level right and level forward.
    blocks : RestBlocks
    fitted : ndarray, shape (m, 2)
        The fit to ``blocks.v`` [m/s].
    """

    rate: Floats
    cov: Floats
    force_cov: Floats
    unrest: tuple[Unrest, Unrest]
    blocks: RestBlocks
    fitted: Floats


def base_motion(rest: Recording, gravity: float, angle_walk: float) -> BaseMotion:
    """Net rate of the base over a whole rest.

    Parameters
    ----------
    rest : Recording
        With three gyros [rad/s] and three accelerometers [m/s^2] in axes right, forward, up.
    gravity : float
        [m/s^2]
    angle_walk : float
        Angle random walk of the gyros [rad/sqrt(s)].

    Raises
    ------
    InputError
        If a channel is missing or in another unit, rows are missing in between, the axes are others, or the rest has
        less than `FEWEST` blocks.
    """
    seen = velocities(rest, gravity)
    unrest = [fitted_unrest(seen, j, angle_walk) for j in (0, 1)]
    fits = [least_squares(seen, j, one) for j, one in enumerate(unrest)]
    drift = np.array([beta[2] for beta, _ in fits]) / gravity
    right, forward = (P[2, 2] / gravity**2 for _, P in fits)
    # A level right axis that rises is a turn about forward; a level forward axis that rises is one about right.
    cov = (seen.axes.T * np.array([forward, right, angle_walk**2 / seen.span])) @ seen.axes
    ends = np.mean([2 * (one.velocity / seen.span) ** 2 + one.velocity_walk**2 / seen.span for one in unrest])
    return BaseMotion(
        rate=np.cross(drift @ seen.axes[:2], seen.axes[2]),
        cov=cov,
        force_cov=ends * np.eye(3),
        unrest=(unrest[0], unrest[1]),
        blocks=seen,
        fitted=np.stack([seen.X @ beta for beta, _ in fits], axis=1),
    )


def velocities(rest: Recording, gravity: float) -> RestBlocks:
    """Velocities of a rest without what the gyros see of the tilt; errors as `base_motion`."""
    axes = level_axes(means(rest)[1])
    seen = [expose(rest, name) for name in ACCELS]
    if any((e.count == 0).any() for e in seen):
        raise InputError(f"{rest.label}: rows are missing in between; wanted a rest without gaps")
    motion = seen[0].motion
    block = max(round(BLOCK / motion.dt), -(-motion.n // MOST), 1)
    blocks = motion.n // block
    if blocks < FEWEST:
        raise InputError(f"{rest.label}: lasts {motion.n * motion.dt:.3g} s; wanted at least {FEWEST * BLOCK:g} s")
    summed = np.cumsum(_columns(seen, axes, gravity), axis=0) * motion.dt
    table = np.column_stack([motion.t[1:], summed])[: blocks * block].reshape(blocks, block, -1).mean(axis=1)
    X = np.column_stack([np.ones(blocks), table[:, 3:]])
    return RestBlocks(axes, table[:, 0], table[:, 1:3], X, gravity, motion.n * motion.dt)


def _columns(seen: list[Exposure], axes: Floats, gravity: float) -> Floats:
    """Force right and forward without the tilt, a constant, and the time, shape (n, 4)."""
    basis = [BaseTilt().basis(e.u, e.motion) for e in seen]
    force = np.stack([e.y - gravity * B[:, 0] for e, B in zip(seen, basis, strict=True)], axis=1)
    return np.column_stack([force @ axes[:2].T, np.ones(len(force)), basis[0][:, 1]])


def fitted_angle_walk(rests: Sequence[Recording], gravity: float) -> float:
    """Angle random walk of the gyros [rad/sqrt(s)] that several rests share, by restricted maximum likelihood.

    Every rest and axis has its own R and A. It holds for rests of this length: what drifts more slowly than white noise
    of the rate, as the bias of an accelerometer does, counts as a walk that grows with the length. Errors as
    `base_motion`.
    """
    seen = [velocities(rest, gravity) for rest in rests]

    def cost(log_walk: float) -> float:
        walk = float(np.exp(log_walk))
        return sum(_cost(one, j, fitted_unrest(one, j, walk)) for one in seen for j in (0, 1))

    bounds = tuple(np.log([LEAST_WALK, LARGEST_WALK]))
    best = minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": np.log(FINELY)})
    return float(np.exp(best.x))


def fitted_unrest(seen: RestBlocks, axis: int, angle_walk: float) -> Unrest:
    """R and A of level axis 0 (right) or 1 (forward) by restricted maximum likelihood."""
    left = seen.v[:, axis] - seen.X @ np.linalg.lstsq(seen.X, seen.v[:, axis], rcond=None)[0]
    white = max(float(np.std(np.diff(left))), 1e-12)
    start = np.log([white, white / np.sqrt(seen.span)])

    def cost(p: Floats) -> float:
        return _cost(seen, axis, _unrest(p, angle_walk))

    best = minimize(cost, start, method="Nelder-Mead", options={"xatol": 0.02, "fatol": 0.002, "maxiter": 400})
    return _unrest(best.x, angle_walk)


def _unrest(logs: Floats, angle_walk: float) -> Unrest:
    R, A = np.exp(np.clip(logs, -60, 60))
    return Unrest(float(R), float(A), angle_walk)


def covariance(seen: RestBlocks, unrest: Unrest) -> Floats:
    """Covariance of the block velocities along one level axis, shape (m, m)."""
    a, b = np.minimum.outer(seen.t, seen.t), np.maximum.outer(seen.t, seen.t)
    tilt = (seen.gravity * unrest.angle_walk) ** 2 * _tilt(a, b)
    C: Floats = unrest.velocity_walk**2 * _walk(seen.t, a) + tilt + unrest.velocity**2 * np.eye(len(a))
    return C + _JITTER * np.diag(np.diag(C))


def _cost(seen: RestBlocks, axis: int, unrest: Unrest) -> float:
    """Restricted log-likelihood, negative, up to a constant."""
    squares = np.array([unrest.velocity, unrest.velocity_walk, unrest.angle_walk]) ** 2
    bands = np.tensordot(squares, seen.differences.bands, 1)
    half, v = cholesky_banded(bands, lower=True, check_finite=False), seen.differences.v[:, axis]
    weighed = cho_solve_banded((half, True), v, check_finite=False)
    return float(np.log(half[0]).sum() + 0.5 * v @ weighed)


def least_squares(seen: RestBlocks, axis: int, unrest: Unrest) -> tuple[Floats, Floats]:
    """Coefficients of the regressors for level axis 0 or 1, shape (k,), and their covariance, (k, k)."""
    half: Any = np.linalg.cholesky(covariance(seen, unrest))
    white: Any = solve_triangular(half, np.column_stack([seen.X, seen.v[:, axis]]), lower=True)
    A, y = white[:, :-1], white[:, -1]
    P: Floats = np.linalg.inv(A.T @ A)
    return P @ (A.T @ y), P


def means(rest: Recording) -> tuple[Floats, Floats]:
    """Mean rate [rad/s] and mean specific force [m/s^2] of a rest, each of shape (3,).

    Without the first row: the tilt is integrated from its end. Raises InputError if a channel is missing or in another
    unit, or the axes are not right, forward, up.
    """
    if rest.mounting.axes != "RFU":
        raise InputError(f"{rest.label}: axes {rest.mounting.axes!r}; wanted 'RFU' (right, forward, up)")
    rate = np.array([rest.values(name, "rad/s")[1:].mean() for name in GYROS])
    return rate, np.array([rest.values(name, "m/s^2")[1:].mean() for name in ACCELS])


def level_axes(force: Floats) -> Floats:
    """Level right, level forward and up in body axes, as rows, shape (3, 3), of a specific force, shape (3,)."""
    up = force / np.linalg.norm(force)
    forward = np.array([0.0, 1.0, 0.0]) - up[1] * up
    forward /= np.linalg.norm(forward)
    return np.stack([np.cross(forward, up), forward, up])
