r"""Fisher information and Cramer-Rao bound of a procedure, from the regressors of an instrument.

Increments of an angle, x_k = X_k theta + w_k, with angle random walk N and a white angle error Q at every edge
(pulses: q / sqrt(12); the reading of an encoder) have the tridiagonal covariance

    C = N^2 dt I + Q^2 tridiag(-1, 2, -1),      M = X' C^-1 X + diag(1 / sd_j^2),      cov >= M^-1,

which is solved banded. A direction of the parameters that the motion does not excite and no prior holds has no
bound: it is named, and its parameters have an infinite variance.
Source: S. M. Kay, Fundamentals of Statistical Signal Processing 1 (1993), section 3.9.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import CurveEffect, Effect
from insenv.sensors.chain import Sensor

#: A direction whose information is less than this share of what its parameters have alone is not identifiable.
LEAST_SHARE = 1e-10
#: Parameters with a larger part than this in such a direction are named with it.
_PART = 1e-4


@dataclass(frozen=True)
class IncrementNoise:
    """Noise of the increments of an angle.

    Attributes
    ----------
    walk : float
        Angle random walk N [rad/sqrt(s)] (of an accelerometer's velocity: m/s/sqrt(s)).
    angle : float
        White error Q at every edge, one standard deviation [rad].
    """

    walk: float
    angle: float = 0.0

    def banded(self, n: int, dt: float) -> Floats:
        """Covariance of ``n`` increments over ``dt``, upper banded form, shape (2, n).

        Raises
        ------
        InputError
            If there is no noise at all: then nothing is uncertain and nothing can be weighed.
        """
        if not self.walk**2 * dt + self.angle**2 > 0:
            raise InputError("no noise given; wanted an angle random walk or a white angle error above zero")
        band = np.empty((2, n))
        band[0] = -(self.angle**2)
        band[1] = self.walk**2 * dt + 2 * self.angle**2
        return band


@dataclass(frozen=True)
class Bound:
    """Cramer-Rao bound.

    Attributes
    ----------
    names : tuple of str
    cov : ndarray, shape (p, p)
        Infinite variance and undefined (NaN) covariances for a parameter in an unidentifiable direction.
    unidentifiable : tuple of tuple of str
        The parameters of each direction that nothing is known of.
    """

    names: tuple[str, ...]
    cov: Floats
    unidentifiable: tuple[tuple[str, ...], ...] = ()

    def sd(self, name: str) -> float:
        """Least standard deviation of a parameter."""
        j = _place(self.names, name)
        return float(np.sqrt(self.cov[j, j]))

    def block(self, names: Sequence[str]) -> Floats:
        """Covariance of some of the parameters, shape (k, k)."""
        j = [_place(self.names, name) for name in names]
        return self.cov[np.ix_(j, j)]


@dataclass(frozen=True)
class Information:
    """Fisher information.

    Attributes
    ----------
    names : tuple of str
        "earth_rate.c", ... as a `Sensor` names its parameters.
    matrix : ndarray, shape (p, p)
    """

    names: tuple[str, ...]
    matrix: Floats

    def __add__(self, other: Information) -> Information:
        """Information of independent data on the same parameters."""
        if other.names != self.names:
            raise ValueError(f"information on {', '.join(other.names)} added to that on {', '.join(self.names)}")
        return replace(self, matrix=self.matrix + other.matrix)

    def given(self, sd: Mapping[str, float]) -> Information:
        """With prior standard deviations: zero makes a parameter known, infinity tells nothing."""
        matrix = self.matrix.copy()
        for name, value in sd.items():
            j = _place(self.names, name)
            if value > 0:
                matrix[j, j] += value**-2.0
        free = [j for j, name in enumerate(self.names) if sd.get(name, np.inf) > 0]
        return Information(tuple(self.names[j] for j in free), matrix[np.ix_(free, free)])

    def anew(self, sd: Mapping[str, float]) -> Information:
        """On values that differ from those it is on by independent deviations ``sd``, as from power-up to power-up.

        M (I + A M)^-1 with A = diag(sd^2): what one power-up tells of the next, or of the mean over all of them.
        """
        size = np.sqrt(np.diag(self.matrix))
        scale = np.where(size > 0, size, 1.0)
        matrix = self.matrix / np.outer(scale, scale)
        spread = (np.array([sd.get(name, 0.0) for name in self.names]) * scale) ** 2
        told = np.linalg.solve((np.eye(len(scale)) + spread[:, None] * matrix).T, matrix.T).T * np.outer(scale, scale)
        return replace(self, matrix=0.5 * (told + told.T))

    def instead(self, names: Sequence[str], jacobian: Floats) -> Information:
        """On other parameters that make these: theta = ``jacobian`` times the others, shape (p, q)."""
        return Information(tuple(names), jacobian.T @ self.matrix @ jacobian)

    def bound(self) -> Bound:
        """Its inverse, where it has one."""
        p = len(self.names)
        size = np.sqrt(np.diag(self.matrix))
        seen = size > 0
        scale = np.where(seen, size, 1.0)
        values, vectors = np.linalg.eigh(self.matrix / np.outer(scale, scale))
        null = values < LEAST_SHARE * max(p, 1)
        kept = vectors[:, ~null]
        cov = (kept / values[~null]) @ kept.T / np.outer(scale, scale)
        directions = _directions(vectors[:, null])
        lost = np.any(np.abs(vectors[:, null]) > _PART, axis=1)
        cov[lost, :] = cov[:, lost] = np.nan
        cov[lost, lost] = np.inf
        return Bound(self.names, cov, tuple(tuple(self.names[j] for j in d) for d in directions))


def information(
    motion: Motion,
    instrument: Sensor | Sequence[Effect],
    noise: IncrementNoise,
    theta: Floats | None = None,
    stretches: Sequence[slice] | None = None,
) -> Information:
    """What the increments of an instrument tell of the parameters of its effects.

    Parameters
    ----------
    motion : Motion
        Of a single run.
    instrument : Sensor, or a sequence of Effect (of a gyro)
    noise : IncrementNoise
    theta : ndarray, shape (p,), optional
        Where the derivatives are taken; needed where an effect has shapes. Zero otherwise.
    stretches : sequence of slice, optional
        Intervals that are used; the angle is free between stretches. Default: all in one.

    Raises
    ------
    InputError
        If an effect needs what the motion lacks, or has shapes and no ``theta`` was given.
    """
    sensor = instrument if isinstance(instrument, Sensor) else Sensor("gyro", tuple(instrument))
    total = Information(sensor.names, np.zeros((len(sensor.names),) * 2))
    dt = motion.dt
    columns = regressors(motion, sensor, theta) * dt
    for stretch in (slice(0, motion.n),) if stretches is None else stretches:
        part = columns[stretch]
        if len(part):
            total = total + Information(sensor.names, _quadratic(part, noise, dt))
    return total


def regressors(motion: Motion, sensor: Sensor, theta: Floats | None = None) -> Floats:
    """Derivative of the expected output to each parameter, shape (n, p); parameters as of `information`.

    Raises
    ------
    InputError
        If an effect needs what the motion lacks, or has shapes and no ``theta`` was given.
    """
    if missing := sensor.missing(motion):
        raise InputError(f"the motion does not give {', '.join(missing)}, which an effect needs")
    if theta is None:
        if shaped := [e.key for e in sensor.effects if isinstance(e, CurveEffect) and e.shapes]:
            raise InputError(f"effect {shaped[0]!r} has shapes; wanted theta, the place where it is linearised")
        theta = np.zeros(len(sensor.names))
    return sensor.regressors(motion, theta)


def north_bound(
    bound: Bound, level: float, azimuth: float | None = None, names: tuple[str, str] = ("earth_rate.c", "earth_rate.s")
) -> float:
    """Least standard deviation of the azimuth of ``c cos a + s sin a`` [rad].

    Parameters
    ----------
    bound : Bound
    level : float
        Horizontal Earth rate along the input axis [rad/s].
    azimuth : float, optional
        [rad]; None: root mean square over all azimuths.
    names : tuple of str
        Of c and s.

    Returns
    -------
    float
        Infinite where c and s are not identifiable, or nothing of the Earth's rate is level.
    """
    cov = bound.block(names)
    if not np.isfinite(cov).all() or level <= 0:
        return np.inf
    if azimuth is None:
        return float(np.sqrt(0.5 * np.trace(cov))) / level
    across = np.array([-np.sin(azimuth), np.cos(azimuth)])
    return float(np.sqrt(across @ cov @ across)) / level


def _quadratic(columns: Floats, noise: IncrementNoise, dt: float) -> Floats:
    """X' C^-1 X, shape (p, p)."""
    from scipy.linalg import solveh_banded  # slow to import

    band = noise.banded(len(columns), dt)
    if noise.angle > 0 and len(columns) > 1:
        weighed = solveh_banded(band, columns, check_finite=False)
    else:
        weighed = columns / band[1][:, None]
    matrix = columns.T @ weighed
    symmetric: Floats = 0.5 * (matrix + matrix.T)
    return symmetric


def _directions(vectors: Floats) -> list[list[int]]:
    """Parameters of each null direction, after rotation to as few of them as elimination finds."""
    rows = vectors.T.copy()
    for i in range(len(rows)):
        rest = np.abs(rows[i:])
        k, j = np.unravel_index(int(rest.argmax()), rest.shape)
        rows[[i, i + int(k)]] = rows[[i + int(k), i]]
        rows[i] /= rows[i, j]
        others = np.arange(len(rows)) != i
        rows[others] -= np.outer(rows[others, j], rows[i])
    return [[int(j) for j in np.flatnonzero(np.abs(row) > _PART)] for row in rows]


def _place(names: tuple[str, ...], name: str) -> int:
    if name not in names:
        raise InputError(f"no parameter {name!r}; there are {', '.join(names)}")
    return names.index(name)
