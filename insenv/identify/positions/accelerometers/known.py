"""Accelerometers at rest in attitudes that are known: faces of a cube, angles of a table.

    B_k [A (m_k - o) - g n_k],     n_k = u_k + phi x u_k,  of length 1,     B_k = (u_k, e_1, e_2)'

u_k is the stated direction of "up" in the axes of the triad, phi how the triad as a whole sits on its mount, unknown.
The component along u_k is the magnitude of gravity, whatever the tilt; those across it are off by g times the tolerance
of the stated attitude, and weighted by it: the noise of a mean is taken from the parts of the rests. Three equations a
rest instead of one: four or five faces tell bias and scale factor, six the non-orthogonality within the tolerance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats, Recording
from insenv.data.manifest import Manifest
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes
from insenv.identify.positions.least_squares import solve
from insenv.identify.positions.model import AXES, Linear, TriadTerm
from insenv.identify.positions.rests import PARTS, Rest

#: Prior standard deviation of how a triad sits on its mount [rad].
MOUNT = 0.2
#: Departure of what is read from what is stated, as a cosine, that is another face.
ANOTHER = 0.7
#: Least noise of a mean [m/s^2].
LEAST_NOISE = 1e-6
#: Equations to spare with which rests of one row tell that noise, and passes in which it and its weight are found.
FREEDOM, PASSES = 4, 5


@dataclass(frozen=True)
class KnownAttitudes(Magnitudes):
    """Residuals of the specific force, three of each of n rests [m/s^2].

    Attributes
    ----------
    up : ndarray, shape (n, 3)
        Stated unit vectors.
    across : float
        Standard deviation of the components across ``up`` in that of the one along it.
    noise_of_mean : float
        The latter as the parts of the rests show it [m/s^2].
    tolerance : float, optional
        Standard deviation of the components across, as stated, where each rest is one row, which shows no parts.
    """

    up: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    across: float = 1.0
    noise_of_mean: float = 1.0
    tolerance: float | None = None
    rank: int = 3

    @property
    def nuisance(self) -> Floats:
        """Of how the triad sits on its mount, shape (3,)."""
        return np.full(3, MOUNT)

    @property
    def root(self) -> Floats:
        """Diagonal, shape (3 n, 3 n)."""
        return np.diag(np.tile([1.0, self.across, self.across], len(self.up)))

    def evaluate(self, terms: Sequence[TriadTerm], theta: Floats) -> tuple[Floats, Floats]:
        """Whitened residuals, shape (n, 3), and their derivatives, shape (n, 3, p + 3)."""
        linear = Linear.of(terms, self.around)
        p, weight = len(linear.gain), np.array([1.0, self.across, self.across])
        force = linear.corrected(self.measured, theta[:p])
        leaning = self.up + np.cross(theta[p:], self.up)
        size = np.linalg.norm(leaning, axis=1, keepdims=True)
        n = leaning / size
        turned = np.cross(np.eye(3)[:, None, :], self.up[None]) / size
        turned = turned - np.einsum("pni,ni->pn", turned, n)[:, :, None] * n
        slopes = np.concatenate([linear.slopes(force, theta[:p]), -self.gravity[:, None] * turned])
        frame = self._frame()
        residual = np.einsum("nji,ni->nj", frame, force - self.gravity[:, None] * n) / weight
        return residual, np.einsum("nji,pni->njp", frame, slopes) / weight[:, None]

    def plain(self, residual: Floats) -> Floats:
        """The residuals before they were whitened, shape (n, 3), or (n, 3, k)."""
        return np.einsum("nj...,j->nj...", residual, np.array([1.0, self.across, self.across]))

    def _frame(self) -> Floats:
        """Rows along ``up`` and across it, shape (n, 3, 3)."""
        helper = np.eye(3)[np.argmin(np.abs(self.up), axis=1)]
        first = np.cross(self.up, helper)
        first /= np.linalg.norm(first, axis=1)[:, None]
        return np.stack([self.up, first, np.cross(self.up, first)], axis=1)


def as_quiet_as_read(problem: KnownAttitudes, terms: Sequence[TriadTerm]) -> KnownAttitudes:
    """The problem with the noise along ``up`` that a fit of everything that may be found leaves, where that tells one.

    Each row is a rest, and ``terms`` are told by the components along ``up`` alone, as far as they can be.
    """
    spare = int(problem.fitted.sum()) - sum(term.size for term in terms)
    if spare < FREEDOM or problem.tolerance is None:
        return problem
    for _ in range(PASSES):
        along = solve(problem, terms).residual[problem.fitted, 0]
        noise = max(float(np.sqrt(np.sum(along**2) / spare)), LEAST_NOISE)
        problem = replace(problem, noise_of_mean=noise, across=max(problem.tolerance / noise, 1.0))
    return problem


def as_level_as_read(problem: KnownAttitudes, residual: Floats, unknowns: int) -> KnownAttitudes:
    """The problem with the tolerance that the residuals of a fit show, where that is less than the one stated.

    ``residual`` are whitened, of a fit of everything that may be found, ``unknowns`` of them told by the components
    across: a tolerance that is far too wide would pass for noise that is far too small.
    """
    left = residual[:, 1:] * problem.across
    spread = float(np.sqrt(np.sum(left**2) / max(left.size - unknowns, 1)))
    return replace(problem, across=float(np.clip(spread / problem.noise_of_mean, 1.0, problem.across)))


def stated_up(manifest: Manifest, rests: Sequence[Rest], measured: Floats) -> Floats:
    """The stated directions of "up", one of each rest, shape (rests, 3).

    Raises
    ------
    InputError
        If there are not as many as rests, or a rest reads another direction.
    """
    assert manifest.positions is not None
    up = np.array(manifest.positions.up)
    where = f"{manifest.path}: positions.up"
    if len(up) != len(rests):
        raise InputError(f"{where} has {len(up)} directions; there are {len(rests)} rests, wanted one for each")
    cosine = np.sum(up * measured, axis=1) / np.linalg.norm(measured, axis=1)
    for rest in np.flatnonzero(cosine < ANOTHER):
        k = int(np.argmax(np.abs(measured[rest])))
        read = f"{'-' if measured[rest, k] < 0 else '+'}{AXES[k]}"
        raise InputError(
            f"{where}: rest {rest + 1} reads {read} up; wanted the direction stated for it "
            "(an axis that is reversed has a negative unit)"
        )
    return up


def noise_of_means(recordings: Sequence[Recording], rests: Sequence[Rest]) -> float:
    """Standard deviation of the mean of a rest, from the means of its parts [m/s^2]; the least where it has one row."""
    squares = []
    for rest in rests:
        for axis in AXES:
            values = recordings[rest.run].channels[f"accel_{axis}"].values[rest.rows]
            parts = [part.mean() for part in np.array_split(values, PARTS) if len(part)]
            squares.append(float(np.var(parts, ddof=1)) / len(parts) if len(parts) > 1 else 0.0)
    return max(float(np.sqrt(np.mean(squares))), LEAST_NOISE)
