r"""An optical sight on a vehicle, and the level that it is told at the start.

The sight's zero direction p stands off the body's forward axis by the installation angle psi_pb = az_p - az_b. With the
sight on a target at the azimuth psi_T, and psi_0 the angle that it shows,

    az_p = psi_T - psi_0,        psi_T = atan2(E_T - E_O, N_T - N_O),

so that the heading it gives is az_b + psi_pb + the error of psi_T + that of psi_0. Vehicle O and target T stand on
surveyed points, each with an error s of east and of north. Across a line of sight of length D they are off by
sqrt(2) s, hence

    s(psi_T) = sqrt(2) s / D:       0.1 m and 20 arcsec are D = 1458.5 m.

It is the same for all sightings of a run; psi_0 has an error of its own in each (tracking). Source: Guo, Li and He,
Piezoelectrics and Acoustooptics 40 (2018), DOI 10.11977/j.issn.1004-2474.2018.01.016, equations 1 to 4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats


@dataclass(frozen=True)
class OpticalSight:
    """A sight, with what it has in a run.

    Attributes
    ----------
    installation : float or ndarray, shape (R,)
        Installation angle psi_pb [rad].
    orientation : float or ndarray, shape (R,)
        Error of the target's azimuth in this run [rad].
    tracking : float
        Standard deviation of the error of each sighting [rad].
    after_turns : bool
        Whether there is a sighting after each turn; there is one in the first row in any case.
    """

    installation: float | Floats = 0.0
    orientation: float | Floats = 0.0
    tracking: float = 0.0
    after_turns: bool = False

    def read(self, heading: Floats, taken: NDArray[np.bool_], z: Floats) -> Floats:
        """Readings [rad], NaN where none is ``taken``; ``heading`` of shape (..., n), ``z`` (..., draws, n)."""
        found = np.full(heading.shape, np.nan)
        if not taken.any():
            return found
        offset = (np.asarray(self.installation) + self.orientation)[..., None]
        values = heading[taken] + np.broadcast_to(offset, taken.shape)[taken]
        if self.tracking:
            values = values + self.tracking * np.broadcast_to(z[..., 0, :], taken.shape)[taken]
        found[taken] = wrapped(values)
        return found


def first_rows(t: Floats, span: tuple[int, int], after: Floats, taken: NDArray[np.bool_]) -> None:
    """Mark in ``taken``, shape (..., n), the first of the intervals of a span that begins at ``after`` [s] or later.

    ``t`` are the edges; nothing is marked where ``after`` is NaN, or where such an interval was before the first edge.
    """
    n = taken.shape[-1]
    edge = np.searchsorted(t, after)
    column = np.minimum(edge, n - 1)
    inside = (edge >= span[0]) & (edge < span[1]) & (t[column] - (t[-1] - t[0]) / n < after)
    taken |= np.broadcast_to(inside, taken.shape[:-1])[..., None] & (column[..., None] == np.arange(n))


def orientation_error(position: float, distance: float) -> float:
    """Standard deviation of a target's azimuth [rad] from points known to ``position`` [m] in each coordinate."""
    return float(np.sqrt(2.0) * position / distance)


def wrapped(angle: Floats) -> Floats:
    """The same angle in (-pi, pi]."""
    return np.pi - np.mod(np.pi - angle, 2 * np.pi)
