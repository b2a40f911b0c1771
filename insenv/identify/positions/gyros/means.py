"""Gyros at rest: how the bias depends on the attitude, under a bias that wanders.

    mean of w_k = b + G f_k + noise,      cov = s^2 (I + kappa W) + C,    W_kl = min(t_k, t_l) within a run

with f the specific force that the accelerometers show (`g_sensitivity`). The Earth's rate about the vertical goes with
f as well; C is what it may be where no latitude is given. A bias that walks at random from rest to
rest looks like a drift, and by chance like anything that changes slowly: kappa is estimated by restricted maximum
likelihood from the fitted rests, beside everything that is to be tried. Residuals are whitened in an order in which
the held-out rests come last: they are then what the fitted ones do not foretell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import LinearEffect
from insenv.identify.fit.evidence import HELD_OUT_SPREAD
from insenv.identify.positions.least_squares import Fit, solve
from insenv.identify.positions.model import AXES, Surroundings
from insenv.identify.positions.walk import walking, weighed


@dataclass(frozen=True)
class RestTerm:
    """An effect on one gyro at rest."""

    effect: LinearEffect

    @property
    def size(self) -> int:
        """Number of coefficients."""
        return len(self.effect.linear)


@dataclass(frozen=True)
class RestMeans:
    """Means of one gyro over n rests [rad/s].

    Attributes
    ----------
    y : ndarray, shape (n,)
    forces : ndarray, shape (n, 3)
        Specific forces [m/s^2].
    fitted, held_out : ndarray of bool, shape (n,)
    root : ndarray, shape (n, n)
        L of the noise's covariance s^2 L L', in the order of the rests.
    known : ndarray, shape (n, n), optional
        C [rad^2/s^2].
    """

    y: Floats
    forces: Floats
    around: Surroundings
    fitted: NDArray[np.bool_]
    held_out: NDArray[np.bool_]
    root: Floats
    known: Floats | None = None
    rank: int = 1
    spread: float = HELD_OUT_SPREAD

    @property
    def nuisance(self) -> Floats:
        """No unknowns but those of the effects."""
        return np.zeros(0)

    def begin(self, terms: Sequence[RestTerm]) -> Floats:
        """At zero, shape (p,)."""
        return np.zeros(sum(term.size for term in terms))

    def design(self, terms: Sequence[RestTerm]) -> Floats:
        """What one unit of each coefficient adds, shape (n, p)."""
        base = self.around.motion(np.zeros((len(self.y), 3)), 0)
        motion = Motion(
            t=base.t,
            rate=base.rate,
            temperature=base.temperature,
            force={axis: self.forces[:, i] for i, axis in enumerate(AXES)},
            reference_temperature=base.reference_temperature,
            step=1.0,
        )
        columns = [term.effect.basis(motion.rate, motion) for term in terms]
        return np.concatenate([np.zeros((len(self.y), 0)), *columns], axis=1)

    def evaluate(self, terms: Sequence[RestTerm], theta: Floats) -> tuple[Floats, Floats]:
        """Whitened residuals, shape (n, 1), and their derivatives, shape (n, 1, p)."""
        design = self.design(terms)
        columns = np.column_stack([self.y - design @ theta, -design])
        both = self._whitening @ columns
        return both[:, :1], both[:, None, 1:]

    @cached_property
    def _whitening(self) -> Floats:
        """L^-1, shape (n, n)."""
        return np.asarray(np.linalg.inv(self.root), np.float64)

    def plain(self, residual: Floats) -> Floats:
        """The residuals before they were whitened, shape (n, 1), or (n, 1, k)."""
        return np.tensordot(self.root, residual, axes=1)


def with_walk(
    problem: RestMeans, terms: Sequence[RestTerm], runs: NDArray[np.int64], allowed: float = 0.0
) -> RestMeans:
    """The problem with the walk that its fitted rests show beside ``terms``; ``runs``, shape (n,).

    ``allowed`` is the log likelihood below the best that the walk may have.
    """
    alike, design = (runs[:, None] == runs[None, :]).astype(float), problem.design(terms)
    found = walking(problem.y, design, problem.around.time, problem.fitted, alike, allowed, problem.known)
    return problem if found is None else replace(problem, root=found[0])


def over_walks(problem: RestMeans, beside: Sequence[RestTerm], runs: NDArray[np.int64], fit: Fit) -> Fit:
    """The fit with the deviations that its coefficients have over all walks, by their likelihood beside ``beside``.

    var = sum_k w_k [var_k + (theta_k - theta)^2], theta the coefficients as they are.
    """
    alike = (runs[:, None] == runs[None, :]).astype(float)
    variance, design = np.zeros(len(fit.theta)), problem.design(beside)
    for weight, root in weighed(problem.y, design, problem.around.time, problem.fitted, alike, problem.known):
        other = solve(replace(problem, root=root), fit.terms)
        variance += weight * (other.sd() ** 2 + (other.theta - fit.theta) ** 2)
    return replace(fit, over_noises=np.sqrt(variance))
