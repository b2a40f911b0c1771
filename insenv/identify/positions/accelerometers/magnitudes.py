"""Accelerometers at rest: the magnitude of what they read is that of gravity, whatever the attitude.

    rho_k = |f_k| - g (1 + gamma),     f_k = A (m_k - o_k)  as in `insenv.identify.positions.model`

for the mean m_k of rest k. To first order |f| - g is the part of the misfit that no attitude takes up, so the two
angles of each attitude are eliminated and one equation per rest is left. Where the manifest says neither gravity nor
latitude, g is 9.80665 m/s^2 and gamma, its share of error, is an unknown of its own with the standard deviation of
gravity over the Earth: nothing but the mean scale factor tells from it.

Source: Skog and Handel, Calibration of a MEMS inertial measurement unit, XVII IMEKO (2006); Tedaldi, Pretto and
Menegatti, A robust and easy to implement method for IMU calibration without external equipments, ICRA (2014).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats, Recording
from insenv.core.units import STANDARD_GRAVITY
from insenv.identify.fit.evidence import HELD_OUT_SPREAD
from insenv.identify.positions.model import Linear, Surroundings, TriadTerm
from insenv.identify.positions.rests import Rest
from insenv.identify.positions.walk import ALLOWED, walking

#: Standard deviation of gravity over the places where instruments are tested, as a share of it.
GRAVITY_SPREAD = 1.5e-3


@dataclass(frozen=True)
class Magnitudes:
    """Residuals of the magnitudes of specific force, one of each of n rests [m/s^2].

    Attributes
    ----------
    measured : ndarray, shape (n, 3)
    gravity : ndarray, shape (n,)
    fitted : ndarray of bool, shape (n,)
        False: held out, or left out.
    free_gravity : bool
        Whether gamma is an unknown.
    noise : ndarray, shape (n, n), optional
        L of the noise's covariance s^2 L L' where it is not white.
    scale : float
        s^2 as it was when ``noise`` was made, beside all that may be found [m^2/s^4].
    """

    measured: Floats
    gravity: Floats
    around: Surroundings
    fitted: NDArray[np.bool_]
    held_out: NDArray[np.bool_]
    free_gravity: bool = False
    noise: Floats | None = None
    scale: float = 1.0
    rank: int = 1
    spread: float = HELD_OUT_SPREAD

    @property
    def root(self) -> Floats:
        """L of the noise's covariance s^2 L L', shape (n, n)."""
        return np.eye(len(self.measured)) if self.noise is None else self.noise

    @property
    def nuisance(self) -> Floats:
        """Prior standard deviations of the unknowns that are no effects, behind those of the effects."""
        return np.full(int(self.free_gravity), GRAVITY_SPREAD)

    def begin(self, terms: Sequence[TriadTerm]) -> Floats:
        """At the sphere through the readings, |m - o|^2 = k^2 g^2: linear in o and k^2 g^2 - |o|^2; shape (p + q,)."""
        theta = np.zeros(sum(term.size for term in terms) + len(self.nuisance))
        m = self.measured[self.fitted]
        at, place = dict[str, slice](), 0
        for term in terms:
            at[term.effect.part] = slice(place, place + term.size)
            place += term.size
        if "level" not in at or len(m) < 5:
            return theta
        unknown = np.linalg.lstsq(np.column_stack([2 * m, np.ones(len(m))]), np.sum(m * m, axis=1), rcond=None)[0]
        theta[at["level"]] = unknown[:3]
        if "gain" in at:
            radius = float(np.sqrt(max(unknown[3] + unknown[:3] @ unknown[:3], 0.0)))
            theta[at["gain"]] = max(radius / float(self.gravity.mean()), 0.1) - 1
        return theta

    def evaluate(self, terms: Sequence[TriadTerm], theta: Floats) -> tuple[Floats, Floats]:
        """Whitened residuals, shape (n, 1), and their derivatives, shape (n, 1, p)."""
        residual, slopes = self.errors(terms, theta)
        if self.noise is None:
            return residual[:, None], slopes[:, None, :]
        both = self._whitening @ np.column_stack([residual, slopes])
        return both[:, :1], both[:, None, 1:]

    @cached_property
    def _whitening(self) -> Floats:
        """L^-1, shape (n, n): a search asks for it hundreds of times."""
        return np.asarray(np.linalg.inv(self.root), np.float64)

    def errors(self, terms: Sequence[TriadTerm], theta: Floats) -> tuple[Floats, Floats]:
        """Residuals, shape (n,), and their derivatives, shape (n, p)."""
        linear = Linear.of(terms, self.around)
        p = len(linear.gain)
        force = linear.corrected(self.measured, theta[:p])
        size = np.linalg.norm(force, axis=1)
        slopes = np.einsum("ni,pni->np", force / size[:, None], linear.slopes(force, theta[:p]))
        residual = size - self.gravity
        if self.free_gravity:
            residual = residual - self.gravity * theta[p]
            slopes = np.column_stack([slopes, -self.gravity])
        return residual, slopes

    def plain(self, residual: Floats) -> Floats:
        """The residuals before they were whitened, shape (n, 1), or (n, 1, k)."""
        return residual if self.noise is None else np.tensordot(self.noise, residual, axes=1)


def directions(measured: Floats, around: Surroundings, terms: Sequence[TriadTerm], theta: Floats) -> Floats:
    """Specific forces of readings of n rests, corrected, shape (n, 3) [m/s^2]."""
    linear = Linear.of(terms, around)
    return linear.corrected(measured, theta[: len(linear.gain)])


def uncertain_directions(
    measured: Floats, around: Surroundings, terms: Sequence[TriadTerm], theta: Floats, covariance: Floats
) -> Floats:
    """What independent unit normals make of the directions of n rests by the coefficients' covariance, (n, 3, p)."""
    linear = Linear.of(terms, around)
    force = linear.corrected(measured, theta)
    size = np.linalg.norm(force, axis=1)[:, None]
    unit, slopes = force / size, linear.slopes(force, theta) / size
    across = slopes - np.einsum("pni,ni->pn", slopes, unit)[:, :, None] * unit
    values, vectors = np.linalg.eigh(covariance)
    return np.einsum("pni,pq->niq", across, vectors * np.sqrt(np.maximum(values, 0.0)))


def with_walk(
    problem: Magnitudes,
    terms: Sequence[TriadTerm],
    runs: NDArray[np.int64],
    anew: Floats | None = None,
    allowed: float = ALLOWED,
) -> Magnitudes:
    """The problem with biases that walk at random, as far as the fitted rests allow beside ``terms``.

    Parts of one rest are no independent readings of an attitude: what wanders from part to part wanders on until the
    next rest, and from one run to the next. Of rests k and l the walk is felt by the cosine between their directions.
    ``runs``, shape (n,); ``anew``, shape (n, n), is the covariance of what else a unit reads when it is set down anew.
    """
    errors, slopes = problem.errors(terms, np.zeros(sum(t.size for t in terms) + len(problem.nuisance)))
    unit = problem.measured / np.linalg.norm(problem.measured, axis=1)[:, None]
    found = walking(errors, slopes, through_runs(problem, runs), problem.fitted, unit @ unit.T, allowed, anew)
    return problem if found is None else replace(problem, noise=found[0], scale=found[1])


def through_runs(problem: Magnitudes, runs: NDArray[np.int64]) -> Floats:
    """Time of each rest, one run behind the other, shape (n,) [s]."""
    before = [sum(float(problem.around.time[runs == r].max(initial=0.0)) for r in range(run)) for run in runs]
    return problem.around.time + np.array(before)


def gravities(recordings: Sequence[Recording], rests: Sequence[Rest]) -> tuple[Floats, bool]:
    """Gravity at each rest, shape (rests,) [m/s^2], and whether all of it is known."""
    known = [recording.site.local_gravity for recording in recordings]
    each = np.array([STANDARD_GRAVITY if g is None else g for g in known])
    return each[[rest.run for rest in rests]], None not in known
