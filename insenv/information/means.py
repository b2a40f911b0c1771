r"""What means over cells tell, under any noise of the catalogue: regressors averaged, covariance of the same intervals.

    m_i = X_i theta + e_i,      cov(e_i, e_j) = sum_n c_n^2 Q_n(i, j),      M = X' C^-1 X

with X_i the mean of the effects' regressors over cell i and Q_n what `insenv.effects.base.NoiseEffect.covariance`
gives: the same effects simulate, are fitted and are bounded. Cells that are not kept are gaps; noise goes on in them.
The covariance is dense, so that there are `MOST` cells at most. What a regressor changes within a cell is lost: the
bound is that of the means, which are all of the data where regressors are steady and the noise is white.
Source: S. M. Kay, Fundamentals of Statistical Signal Processing 1 (1993), sections 3.9 and 4.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular

from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import Effect, NoiseEffect
from insenv.effects.catalogue import by_key
from insenv.effects.noise import Quantization
from insenv.information.fisher import Information, regressors
from insenv.information.rate_noise import white_angle
from insenv.sensors.chain import Sensor

#: Most cells: the covariance has their square.
MOST = 4000


@dataclass(frozen=True)
class Noise:
    """A noise effect with its coefficient, SI."""

    effect: NoiseEffect
    coefficient: float


def stated_noises(datasheet: Datasheet, target: str) -> tuple[Noise, ...]:
    """The noises that a datasheet tells of a channel; pulses and encoder are one white error of the angle."""
    named = dict(datasheet.noise.get(target, {}))
    if target == "gyro" and (angle := white_angle(datasheet)) > 0:
        named[Quantization.id] = angle
    effects = {name: by_key(name) for name in named}
    return tuple(Noise(e, named[name]) for name, e in effects.items() if isinstance(e, NoiseEffect) and named[name])


@dataclass(frozen=True)
class Means:
    """Means over cells as a linear model; made by `means`.

    Attributes
    ----------
    motion : Motion
        Of a single run, n intervals.
    sensor : Sensor
    edges : ndarray of int, shape (m + 1,)
        Of the cells, in intervals of the motion.
    kept : ndarray of bool, shape (m,)
        Cells that are data.
    columns : ndarray, shape (k, p)
        Regressors of the k kept cells.
    root : ndarray, shape (k, k)
        Lower root of the covariance of their noise.
    """

    motion: Motion
    sensor: Sensor
    edges: NDArray[np.int64]
    kept: NDArray[np.bool_]
    columns: Floats
    root: Floats

    @property
    def names(self) -> tuple[str, ...]:
        """Of the p parameters."""
        return self.sensor.names

    @property
    def covariance(self) -> Floats:
        """Of the noise of the kept cells, shape (k, k)."""
        return self.root @ self.root.T

    def along(self, motion: Motion, theta: Floats | None = None) -> Means:
        """The same cells and the same noise on another motion, with derivatives taken at ``theta``."""
        columns = averaged(regressors(motion, self.sensor, theta), self.edges)[self.kept]
        return replace(self, motion=motion, columns=columns)

    def white(self, values: Floats) -> Floats:
        """Values of the kept cells, shape (k, ...), in units in which their noise is white and one."""
        return np.asarray(solve_triangular(self.root, values, lower=True, check_finite=False))

    def weighed(self, values: Floats) -> Floats:
        """Inverse of the covariance times values of the kept cells, shape (k, ...)."""
        return np.asarray(solve_triangular(self.root, self.white(values), lower=True, trans="T", check_finite=False))

    @property
    def information(self) -> Information:
        """What the means tell of the parameters."""
        rows = self.white(self.columns)
        return Information(self.names, rows.T @ rows)

    def averaged(self, values: Floats) -> Floats:
        """Means over the kept cells, shape (k, ...), of values for each interval, shape (n, ...)."""
        return averaged(values, self.edges)[self.kept]

    def addition(self, effect: Effect, theta: Floats) -> Floats:
        """What an effect with parameters ``theta``, shape (p,), adds to the means, shape (k,).

        Raises
        ------
        InputError
            If it needs what the motion lacks.
        """
        if missing := effect.missing(self.motion):
            raise InputError(f"the motion does not give {', '.join(missing)}, which effect {effect.key!r} needs")
        u = self.sensor.true_input(self.motion)
        return self.averaged(effect.apply(u, self.motion, theta, effect.begin(self.motion, theta))[0])


def means(  # noqa: PLR0913 -- a model and what is averaged
    motion: Motion,
    instrument: Sensor | Sequence[Effect],
    noises: Sequence[Noise],
    edges: Sequence[int] | NDArray[np.int64] | None = None,
    kept: NDArray[np.bool_] | None = None,
    theta: Floats | None = None,
    per: int = 1,
) -> Means:
    """The means of an instrument's output over cells.

    Parameters
    ----------
    motion : Motion
        Of a single run, from the time on at which the instrument was switched on: noise that walks begins there.
    instrument : Sensor, or a sequence of Effect (of a gyro)
    noises : sequence of Noise
    edges : sequence of int, shape (m + 1,), optional
        Of the cells, in intervals of the motion, rising; default: each interval.
    kept : ndarray of bool, shape (m,), optional
        Cells that are data; the others are gaps.
    theta : ndarray, shape (p,), optional
        Where the derivatives are taken; needed where an effect has shapes.
    per : int
        Samples of the instrument in an interval of the motion: noise of the catalogue is driven by the sample.

    Raises
    ------
    InputError
        If an effect needs what the motion lacks, there is no noise, or the edges are not as wanted.
    """
    sensor = instrument if isinstance(instrument, Sensor) else Sensor("gyro", tuple(instrument))
    at = np.arange(motion.n + 1) if edges is None else np.asarray(edges, np.int64)
    if len(at) < 2 or at[0] < 0 or at[-1] > motion.n or np.any(np.diff(at) < 1):
        raise InputError(f"{len(at)} edges of cells given; wanted two or more, rising, from 0 to {motion.n}")
    used = np.ones(len(at) - 1, bool) if kept is None else np.asarray(kept, bool)
    if len(at) - 1 > MOST or not used.any():
        raise InputError(f"{len(at) - 1} cells given, {used.sum()} of them data; wanted 1 to {MOST}")
    if not any(noise.coefficient > 0 for noise in noises):
        raise InputError("no noise given; wanted a noise effect with a coefficient above zero")
    columns = averaged(regressors(motion, sensor, theta), at)[used]
    total = sum(n.coefficient**2 * n.effect.covariance(at * per, motion.dt / per) for n in noises)
    return Means(motion, sensor, at, used, columns, _root(np.asarray(total)[np.ix_(used, used)]))


def _root(covariance: Floats) -> Floats:
    try:
        return np.asarray(cholesky(covariance, lower=True, check_finite=False))
    except np.linalg.LinAlgError:
        raise InputError("the covariance of the means is not positive; wanted noise in each of them") from None


def averaged(values: Floats, edges: NDArray[np.int64]) -> Floats:
    """Means between the edges of values for each interval: (n, ...) gives (m, ...)."""
    sums = np.add.reduceat(values[: edges[-1]], edges[:-1], axis=0)
    return np.asarray(sums / np.diff(edges).reshape(-1, *(values.ndim - 1) * [1]))
