"""Generalised least squares with priors: coefficients, noise and their covariance.

    theta = (X' S^-1 X + P)^-1 X' S^-1 y,      cov = (X' S^-1 X + P)^-1

in the DCT-II domain where S is diagonal; S by restricted maximum likelihood (`insenv.identify.fit.noise`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from insenv.core.recording import Floats
from insenv.identify.fit.noise import NoiseFit, fit_noise
from insenv.identify.fit.problem import Design, Model, Problem, design, pooled

#: Degrees of freedom with which noise is known at least.
LEAST_FREEDOM = 2.0


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    Attributes
    ----------
    model : Model
    design : Design
    beta : ndarray, shape (p,)
        Scaled coefficients; ``theta`` is in SI.
    cov : ndarray, shape (p, p)
        Covariance of the scaled coefficients.
    noise : NoiseFit
        By restricted maximum likelihood.
    """

    model: Model
    design: Design
    beta: Floats
    cov: Floats
    noise: NoiseFit

    @property
    def theta(self) -> Floats:
        """Coefficients in SI units, shape (p,)."""
        return self.beta / self.design.scale

    @property
    def sd(self) -> Floats:
        """Standard deviations of ``theta``, shape (p,)."""
        return np.sqrt(np.diag(self.cov)) / self.design.scale

    @property
    def named(self) -> Model:
        """The model without curves that explain and name no cause."""
        return tuple(term for term in self.model if not term.effect.generic)

    @property
    def scale_factor(self) -> float:
        """What the fit adds to the gain of the input; of one in every run the mean."""
        own = [k >= 0 and self.model[k].effect.part == "gain" for k in self.design.term]
        return float(np.mean(self.theta[own])) if any(own) else 0.0

    def predicted(self) -> Floats:
        """The model over all bins, shape (bins,); free bins are not part of it."""
        return self.design.matrix @ (self.beta * (self.design.term >= 0))


def spectrum(problem: Problem, power: Floats) -> Floats:
    """Variance of each mode of the fitted blocks, shape (modes,)."""
    return problem.modes().shapes @ power


def noise_beside(problem: Problem, columns: Floats, prior: Floats, restricted: bool, start: Floats) -> NoiseFit:
    """Noise beside columns that are no model's, such as one curve cut in parts, shapes (modes, c) and (c,).

    What the parts tell apart is in the noise of the whole: there it is a walk, beside which nothing is told apart.
    """
    cross = problem.grouping().pool(np.column_stack([problem.data(), columns]))
    return fit_noise(cross, prior, restricted=restricted, start=start, most=problem.most)


def solve(problem: Problem, model: Model, start: Floats | None = None) -> Fit:
    """Fit a model and its noise to the fitted bins."""
    columns = design(problem, model)
    noise = fit_noise(*pooled(problem, model), restricted=True, start=start, most=problem.most)
    beta, cov = coefficients(problem, columns, noise.power)
    return Fit(model, columns, beta, cov, noise)


def coefficients(problem: Problem, columns: Design, power: Floats) -> tuple[Floats, Floats]:
    """Generalised least squares for given noise: scaled coefficients and their covariance.

    A QR factorisation of the whitened columns with the priors as further rows, so that nearly collinear columns cost
    digits once, not twice; with the data as the last column Q need not be formed.
    """
    rows, data = whitened_rows(problem, columns, power)
    p = rows.shape[1]
    r = np.asarray(np.linalg.qr(np.column_stack([rows, data]), mode="r"))[:p]
    inverse = np.linalg.solve(r[:, :p], np.eye(p))
    return inverse @ r[:, p], inverse @ inverse.T


def whitened_rows(problem: Problem, columns: Design, power: Floats) -> tuple[Floats, Floats]:
    """Whitened columns and data with the priors as further rows, shapes (modes + p, p) and (modes + p,)."""
    weight = 1 / np.sqrt(spectrum(problem, power))
    rows = np.vstack([columns.transformed * weight[:, None], np.diag(np.sqrt(columns.prior))])
    return rows, np.concatenate([problem.data() * weight, np.zeros(len(columns.prior))])


def whitened(problem: Problem, fit: Fit) -> tuple[Floats, Floats, Floats]:
    """Weight of each mode, orthonormal basis of the whitened model, whitened residual."""
    found: tuple[Floats, Floats, Floats] = problem.remember_last("whitened", fit, lambda: _whitened(problem, fit))
    return found


def _whitened(problem: Problem, fit: Fit) -> tuple[Floats, Floats, Floats]:
    weight = 1 / np.sqrt(spectrum(problem, fit.noise.power))
    columns = fit.design.transformed * weight[:, None]
    q = np.linalg.qr(columns)[0] if columns.shape[1] else columns
    data = problem.data() * weight
    return weight, q, data - q @ (q.T @ data)


def noise_freedom(problem: Problem, power: Floats, energy: Floats) -> float:
    """Degrees of freedom with which the noise is known in the modes where ``energy``, shape (modes,), lies.

    The Fisher information of the noise powers gives the variance of S there, of terms that happened to come out as
    zero too; a variance estimated with nu degrees of freedom has var(log S) = 2 / nu. What is slow meets noise that
    only a few slow modes tell.
    """
    shares, size, covariance = _noise_known(problem, power)
    pull = (energy / max(float(energy.sum()), 1e-300)) @ shares
    variance = float((pull / size) @ covariance @ (pull / size))
    return float(np.clip(2 / max(variance, 1e-9), LEAST_FREEDOM, len(shares)))


def noise_freedoms(problem: Problem, power: Floats, energies: Floats) -> Floats:
    """`noise_freedom` of several energies, shape (rows, modes)."""
    shares, size, covariance = _noise_known(problem, power)
    pull = (energies @ shares) / np.maximum(energies.sum(axis=1), 1e-300)[:, None] / size
    variance = np.einsum("rt,tu,ru->r", pull, covariance, pull)
    return np.clip(2 / np.maximum(variance, 1e-9), LEAST_FREEDOM, len(shares))


def _noise_known(problem: Problem, power: Floats) -> tuple[Floats, Floats, Floats]:
    limits = None if problem.most is None else problem.most.tobytes()
    known: tuple[Floats, Floats, Floats] = problem.remember_last(
        ("noise known", limits), power, lambda: _known(problem, power)
    )
    return known


def _known(problem: Problem, power: Floats) -> tuple[Floats, Floats, Floats]:
    """Share of each noise power in each mode, and how the powers are known: a size and a covariance beside it."""
    free = slice(None) if problem.most is None else problem.most > 0
    shapes, power = problem.modes().shapes[:, free], power[free]
    groups = problem.grouping()
    relative = groups.shapes[:, free] / (groups.shapes[:, free] @ power)[:, None]
    information = 0.5 * (relative * groups.count[:, None]).T @ relative
    size = np.sqrt(np.diag(information))
    covariance = np.linalg.pinv(information / np.outer(size, size), rcond=1e-8, hermitian=True)
    return shapes / (shapes @ power)[:, None], size, covariance
