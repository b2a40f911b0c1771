"""Accelerometers at rest: the magnitude of what they read is that of gravity, whatever the attitude.

    rho_k = |f_k| - g (1 + gamma),     f_k = A (m_k - o_k)  as in `insenv.identify.positions_model`

for the mean m_k of rest k. To first order |f| - g is the part of the misfit that no attitude takes up, so the two
angles of each attitude are eliminated and one equation per rest is left. Where the manifest says neither gravity nor
latitude, g is 9.80665 m/s^2 and gamma, its share of error, is an unknown of its own with the standard deviation of
gravity over the Earth: nothing but the mean scale factor tells from it.

Source: Skog and Handel, Calibration of a MEMS inertial measurement unit, XVII IMEKO (2006); Tedaldi, Pretto and
Menegatti, A robust and easy to implement method for IMU calibration without external equipments, ICRA (2014).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insenv.core import earth
from insenv.core.recording import Floats, Recording, Site
from insenv.core.units import STANDARD_GRAVITY
from insenv.identify.evidence import HELD_OUT_SPREAD
from insenv.identify.positions import Rest
from insenv.identify.positions_model import Linear, Surroundings, TriadTerm

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
    """

    measured: Floats
    gravity: Floats
    around: Surroundings
    fitted: NDArray[np.bool_]
    held_out: NDArray[np.bool_]
    free_gravity: bool = False
    rank: int = 1
    spread: float = HELD_OUT_SPREAD

    @property
    def nuisance(self) -> Floats:
        """Prior standard deviations of the unknowns that are no effects, behind those of the effects."""
        return np.full(int(self.free_gravity), GRAVITY_SPREAD)

    def evaluate(self, terms: Sequence[TriadTerm], theta: Floats) -> tuple[Floats, Floats]:
        """Residuals, shape (n, 1), and their derivatives, shape (n, 1, p)."""
        linear = Linear.of(terms, self.around)
        p = len(linear.gain)
        force = linear.corrected(self.measured, theta[:p])
        size = np.linalg.norm(force, axis=1)
        slopes = np.einsum("ni,pni->np", force / size[:, None], linear.slopes(force, theta[:p]))
        residual = size - self.gravity
        if self.free_gravity:
            residual = residual - self.gravity * theta[p]
            slopes = np.column_stack([slopes, -self.gravity])
        return residual[:, None], slopes[:, None, :]

    def plain(self, residual: Floats) -> Floats:
        """The residuals themselves: they are not whitened."""
        return residual

    def directions(self, terms: Sequence[TriadTerm], theta: Floats) -> Floats:
        """Specific forces, corrected, shape (n, 3) [m/s^2]."""
        linear = Linear.of(terms, self.around)
        return linear.corrected(self.measured, theta[: len(linear.gain)])


def site_gravity(site: Site) -> float | None:
    """Magnitude of gravity as the manifest knows it; None where it says neither gravity nor latitude."""
    if site.gravity is not None:
        return site.gravity
    return None if site.latitude is None else float(earth.gravity(site.latitude, site.altitude))


def gravities(recordings: Sequence[Recording], rests: Sequence[Rest]) -> tuple[Floats, bool]:
    """Gravity at each rest, shape (rests,) [m/s^2], and whether all of it is known."""
    known = [site_gravity(recording.site) for recording in recordings]
    each = np.array([STANDARD_GRAVITY if g is None else g for g in known])
    return each[[rest.run for rest in rests]], None not in known
