r"""Scale factor by generalised least squares: the whole record of a rate table, with the noise that is told.

    m = u + X theta + e,    theta^ = mu + (X' C^-1 X + P^-1)^-1 X' C^-1 (m - u - X mu),    K - 1 = g' theta^

Means m over cells of nearly one rate with the covariance C of all noises of the datasheet, walks and flicker among
them; X are the declared effects, mu and P what is told of them (`insenv.information.scale_factor`). So it reaches the
bound where the datasheet is right, sweeps included. What the datasheet does not declare enters unseen: for that there
is `estimators.rate_table.rate_line`, which is robust. Only the last power-up is used. Memory: 24 bytes for
a tenth of a second of a run.
Source: S. M. Kay, Fundamentals of Statistical Signal Processing 1 (1993), sections 4.5 and 10.6.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import final

import numpy as np

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.motion import Motion
from insenv.core.recording import Floats, Recording
from insenv.core.units import DEG
from insenv.effects.bias import Bias
from insenv.effects.rate.scale import ScaleFactor
from insenv.information.means import Means, stated_noises
from insenv.information.scale_factor import INTERVAL, DeclaredGyro, cells, declared, model, motion_of, slope

#: Deviations of a bias [rad/s] and of a scale factor of which nothing is told.
ANY_BIAS, ANY_ERROR = 0.1 * DEG, ScaleFactor.linear[0].sd
#: Covariances that are kept: runs under one policy mostly have the same cells.
_KEPT = 4
#: Rows of what is gathered: output, angle, temperature.
_OUTPUT, _ANGLE, _WARMTH = range(3)


@dataclass(frozen=True)
class Gathered:
    """The power-up that is under way, in intervals of a tenth of a second.

    Attributes
    ----------
    start : ndarray, shape (..., 3)
        Angle [rad] and temperature [K] at the first edge, and the power-up; NaN: no row yet.
    blocks : tuple of ndarray, shape (..., 3, j)
        Mean output [rad/s], angle and temperature at the end of j intervals.
    rest : ndarray, shape (..., 3, r)
        Rows that fill no interval yet.
    """

    start: Floats
    blocks: tuple[Floats, ...]
    rest: Floats


@final
@dataclass(frozen=True)
class RateGls:
    """Scale factor (relative to 1) and bias [rad/s] with their covariance.

    Needs "gyro" [rad/s] and "table_angle" [rad]; "temperature" [K] where an effect of it is declared.

    Attributes
    ----------
    datasheet : Datasheet
    largest : float
        Largest rate of the line whose slope is the scale factor [rad/s]; default: the table's. It matters where an
        effect is declared that bends the line.

    Raises
    ------
    InputError
        If the datasheet tells of no noise of the gyro, or the input axis lies in the table plane.
    """

    datasheet: Datasheet
    largest: float | None = None
    _known: dict[bytes, Means] = field(default_factory=dict, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not stated_noises(self.datasheet, "gyro"):
            raise InputError("rate_gls: the datasheet tells of no noise of the gyro; wanted it, for it weighs the data")
        if abs(np.sin(self.datasheet.mounting.tilt)) < 1e-6:
            raise InputError("rate_gls: the input axis lies in the table plane and sees nothing of its turning")

    @property
    def size(self) -> int:
        """Rows of an interval."""
        return max(1, round(INTERVAL * self.datasheet.sampling))

    def reset(self, batch: int | None = None) -> Gathered:
        """No row yet."""
        front = () if batch is None else (batch,)
        return Gathered(np.full((*front, 3), np.nan), (), np.zeros((*front, 3, 0)))

    def update(self, state: Gathered, chunk: Recording) -> Gathered:
        """After a chunk; all runs of a batch are switched on at the same times."""
        n, front = len(chunk), state.start.shape[:-1]
        rows = np.full((*front, 4, n), np.nan)
        rows[..., _OUTPUT, :] = chunk.values("gyro", "rad/s")
        rows[..., _ANGLE, :] = chunk.values("table_angle", "rad")
        if "temperature" in chunk.channels:
            rows[..., _WARMTH, :] = chunk.values("temperature", "K")
        rows[..., 3, :] = chunk.values("power", "1") if "power" in chunk.channels else 1.0
        power = rows[..., 3, :].reshape(-1, n)[0]
        changes = [0, *(np.flatnonzero(np.diff(power)) + 1).tolist(), n]
        for a, b in zip(changes[:-1], changes[1:], strict=True):
            state = self._after(state, rows[..., a:b])
        return state

    def estimate(self, state: Gathered) -> Estimate:
        """What is known of the last power-up; the prior before it has data."""
        front = state.start.shape[:-1]
        runs = int(np.prod(front))
        mean, cov = np.empty((runs, 2)), np.empty((runs, 2, 2))
        blocks = [block.reshape(runs, 3, -1) for block in state.blocks]
        data = np.concatenate([np.zeros((runs, 3, 1)), *blocks], axis=-1)
        data[:, 1:, 0] = state.start.reshape(runs, 3)[:, :2]
        for k in range(runs):
            mean[k], cov[k] = self._solved(data[k])
        return Estimate((ScaleFactor.id, Bias.id), ("1", "rad/s"), mean.reshape(*front, 2), cov.reshape(*front, 2, 2))

    def _after(self, state: Gathered, rows: Floats) -> Gathered:
        """After rows of one power-up, shape (..., 4, n)."""
        if not rows.shape[-1]:
            return state
        if not np.array_equal(state.start[..., 2], rows[..., 3, 0]):
            # The first row closes an interval whose beginning no angle is known for.
            state = Gathered(rows[..., 1:, 0].copy(), (), np.zeros((*rows.shape[:-2], 3, 0)))
            rows = rows[..., 1:]
        rows = np.concatenate([state.rest, rows[..., :3, :]], axis=-1)
        whole = rows.shape[-1] // self.size
        last = whole * self.size
        if not whole:
            return replace(state, rest=rows)
        parts = rows[..., :last].reshape(*rows.shape[:-1], whole, self.size)
        block = parts[..., -1].copy()
        block[..., _OUTPUT, :] = parts[..., _OUTPUT, :, :].mean(axis=-1)
        return replace(state, blocks=(*state.blocks, block), rest=rows[..., last:].copy())

    def _solved(self, data: Floats) -> tuple[Floats, Floats]:
        """Mean (2,) and covariance (2, 2) from data of one run, shape (3, j + 1)."""
        warmth = data[_WARMTH]
        temperature = warmth if np.isfinite(warmth).all() else None
        angle = data[_ANGLE] if data.shape[-1] > 1 else np.zeros(2)
        motion = motion_of(self.datasheet, angle, self.size * self.datasheet.dt, temperature)
        told = declared(self.datasheet, motion)
        prior = {
            name: sd if np.isfinite(sd) else (ANY_ERROR if name.startswith("scale_factor") else ANY_BIAS)
            for name, sd in told.sd.items()
        }
        theta, cov = told.mean, np.diag(np.square(list(prior.values())))
        if data.shape[-1] > 1:
            theta, cov = _posterior(self._means(motion, told), data[_OUTPUT, 1:], told, prior)
        return self._slope(told, theta, cov)

    def _means(self, motion: Motion, told: DeclaredGyro) -> Means:
        """The model of the cells; their covariance from a run before, if it had the same."""
        edges = cells(motion.rate).tobytes()
        if edges in self._known:
            return self._known[edges].along(motion, told.mean)
        found, _ = model(self.datasheet, motion)
        if len(self._known) >= _KEPT:
            self._known.clear()
        self._known[edges] = found
        return found

    def _slope(self, told: DeclaredGyro, theta: Floats, cov: Floats) -> tuple[Floats, Floats]:
        rate = self.datasheet.limits.rate if self.largest is None else self.largest
        weights, perfect = slope(told, self.datasheet, rate if np.isfinite(rate) else 1.0)
        names = told.sensor.names
        g = np.zeros((2, len(names)))
        g[0] = [weights[name] for name in names]
        g[1, names.index("bias.c")] = 1.0
        return g @ theta + [perfect, 0.0], g @ cov @ g.T


def _posterior(means: Means, output: Floats, told: DeclaredGyro, prior: dict[str, float]) -> tuple[Floats, Floats]:
    """Parameters and their covariance."""
    names = told.sensor.names
    found = means.information.given(prior)
    free = [names.index(name) for name in found.names]
    expected = means.averaged(means.motion.rate)
    first = 0
    for effect in told.sensor.effects:
        last = first + len(effect.params)
        expected = expected + means.addition(effect, told.mean[first:last])
        first = last
    theta, cov = told.mean.copy(), np.zeros((len(names), len(names)))
    spread = found.bound().cov
    theta[free] += spread @ (means.columns[:, free].T @ means.weighed(means.averaged(output) - expected))
    cov[np.ix_(free, free)] = spread
    return theta, cov
