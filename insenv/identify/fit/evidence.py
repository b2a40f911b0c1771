"""How sure: evidence of the fitted data and of the held-out data, joined.

The fitted data give a likelihood ratio. The held-out data give an independent test with no free parameter: under
the null hypothesis their residual r from the smaller model does not know in which direction phi the larger model,
fitted elsewhere, would move it,

    z = r' V^-1 phi / sqrt(phi' V^-1 phi) ~ N(0, 1),        V = S + X cov X'

with V the noise and the uncertainty of the smaller model's parameters. (The larger model's new coefficients are
independent of the smaller model's estimate, so phi is independent of r.) The two are joined as normal deviates with
the weights of their information, rho = phi' V^-1 phi / q with q the score on fitted data:

    Z = (z_fit + sqrt(rho) z_held) / sqrt(1 + rho)

No coefficient is fitted to held-out data; they confirm or refute, they do not shape.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import dct
from scipy.special import log_ndtr, ndtri_exp

from insenv.core.recording import Floats
from insenv.core.series.tails import log_tail_of_t
from insenv.identify.fit.bins import Block
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.heldout import residual
from insenv.identify.fit.noise import eigenvalues, modes
from insenv.identify.fit.problem import NOISE_TERMS, Problem


def held_out_deviate(problem: Problem, small: Fit, large: Fit, freedom: float) -> tuple[float, float]:
    """The deviate z of the held-out data, and the information phi' V^-1 phi of the change that it tests.

    The noise is known with ``freedom`` degrees of freedom where the change lives: z is Student's t, and is returned as
    the normal deviate of the same probability.
    """
    power = np.maximum(small.noise.power, large.noise.power)
    anchored = _Anchored.of(problem, power)
    left, left_modes, columns = _beside(problem, small, anchored)
    free = _free_of_run(problem, small, anchored)
    r, phi = free(anchored.scaled(left_modes)), free(anchored.whiten(left - residual(problem, large)))
    if not small.design.matrix.shape[1]:
        information = float(phi @ phi)
        return _deviate(float(r @ phi), information, freedom), information
    # V^-1 by the matrix inversion lemma, in the whitened domain where the noise is the identity.
    half = free(anchored.scaled(columns)) @ np.linalg.cholesky(small.cov)
    inner = np.eye(half.shape[1]) + half.T @ half
    damped = phi - half @ np.linalg.solve(inner, half.T @ phi)
    information = float(phi @ damped)
    return _deviate(float(r @ damped), information, freedom), information


def _beside(problem: Problem, fit: Fit, anchored: _Anchored) -> tuple[Floats, Floats, Floats]:
    """What is left of all bins, its held-out modes and those of the columns: the same for all beside the fit."""
    found: dict[tuple[tuple[int, int], ...], tuple[Floats, Floats, Floats]]
    found = problem.remember_last("held-out modes beside", fit, dict)
    where = tuple((a.start, a.stop) if a is not None else (0, 0) for a in anchored.anchors)
    if where not in found:
        left = residual(problem, fit)
        found[where] = left, anchored.modes(left), anchored.modes(fit.design.matrix)
    return found[where]


def held_out_information(problem: Problem, fit: Fit, phi: Floats) -> float:
    """Information phi' V^-1 phi of the held-out data on a change ``phi`` of the model, shape (bins,)."""
    anchored = _Anchored.of(problem, fit.noise.power)
    free = _free_of_run(problem, fit, anchored)
    white = free(anchored.whiten(phi))
    if not fit.design.matrix.shape[1]:
        return float(white @ white)
    half = free(anchored.whiten(fit.design.matrix)) @ np.linalg.cholesky(fit.cov)
    damped = half.T @ white
    return float(white @ white - damped @ np.linalg.solve(np.eye(half.shape[1]) + half.T @ half, damped))


#: Spread of z on simulated recordings without any effect and with the true noise, for slow effects; what is beyond 1
#: is the correlation of flicker across the border of fitted and held-out data. Faster effects reach 0.95.
HELD_OUT_SPREAD = 1.1


#: What changes from one power-up to the next: a run that was not fitted says nothing through its level and slope.
RUN_TO_RUN = ("level", "gain")


def _free_of_run(problem: Problem, fit: Fit, anchored: _Anchored) -> Callable[[Floats], Floats]:
    """Takes out of whitened held-out values what a run without fitted data may have as its own."""
    unseen = {b.run for b in problem.held_out} - {b.run for b in problem.fitted}
    terms = [i for i, term in enumerate(fit.model) if term.effect.part in RUN_TO_RUN]
    columns = [fit.design.matrix[:, j] for j in np.flatnonzero(np.isin(fit.design.term, terms))]
    columns.append(np.ones(problem.bins.n))
    own = [column * (problem.bins.run == run) for run in sorted(unseen) for column in columns]
    if not own:
        return lambda values: values
    basis, size, _ = np.linalg.svd(anchored.whiten(np.column_stack(own)), full_matrices=False)
    q = basis[:, size > 1e-9 * size.max(initial=1e-300)]
    return lambda values: values - q @ (q.T @ values)


@dataclass(frozen=True)
class _Anchored:
    """Whitening of held-out blocks given the fitted data before them.

    Wandering noise goes on from where the fitted data end, and from one held-out block to the next. A block is
    therefore taken relative to the mean of the last bins before it, as many as white noise needs to be averaged down
    to the wander; what is then left is as good as independent of the data before it. Over a gap noise wanders on.
    """

    blocks: tuple[Block, ...]
    anchors: tuple[slice | None, ...]
    root: Floats

    @classmethod
    def of(cls, problem: Problem, power: Floats) -> _Anchored:
        blocks = problem.held_out
        mode = problem.held_out_modes()
        variance = mode.shapes @ power
        white, walk = mode.shapes[0, 0] * power[0], power[2] * problem.bins.width
        most = int(np.clip(np.sqrt(white / max(walk, 1e-300)), 4, 1e6))
        anchors, offset = [], 0
        for block in blocks:
            anchor = _anchor(problem, block, most)
            if anchor is not None:
                size = anchor.stop - anchor.start
                own = modes((replace(block, span=block.n),), NOISE_TERMS, problem.bins.width).shapes[0] @ power
                variance[offset] = own + block.n * (white / size + walk * (size / 3 + _gap(problem, block, anchor)))
            anchors.append(anchor)
            offset += block.n
        return cls(blocks, tuple(anchors), np.sqrt(variance))

    def whiten(self, values: Floats) -> Floats:
        """Whitened modes of the held-out blocks of values over all bins, shape (modes, ...)."""
        return self.scaled(self.modes(values))

    def scaled(self, changed: Floats) -> Floats:
        """Modes whitened."""
        return changed / (self.root if changed.ndim == 1 else self.root[:, None])

    def modes(self, values: Floats) -> Floats:
        """Modes of the held-out blocks of values over all bins, relative to the anchors, shape (modes, ...)."""
        parts = []
        for block, anchor in zip(self.blocks, self.anchors, strict=True):
            level = 0.0 if anchor is None else values[anchor].mean(axis=0)
            parts.append(dct(values[block.start : block.stop] - level, type=2, norm="ortho", axis=0))
        return np.concatenate(parts)


def _anchor(problem: Problem, block: Block, most: int) -> slice | None:
    """The last bins before ``block`` in its run; the first after it where no fitted bins are before."""
    same = [b for b in problem.bins.blocks if b.run == block.run]
    before = [b for b in same if b.stop <= block.start]
    after = [b for b in same if b.start >= block.stop]
    if before and (any(b.fitted for b in before) or not any(b.fitted for b in after)):
        last = before[-1]
        return slice(max(last.start, last.stop - most), last.stop)
    if any(b.fitted for b in after):
        return slice(after[0].start, min(after[0].stop, after[0].start + most))
    return None


def _gap(problem: Problem, block: Block, anchor: slice) -> float:
    """Bins that are missing between a block and its anchor."""
    time = problem.bins.time
    apart = (
        time[block.start] - time[anchor.stop - 1]
        if anchor.stop <= block.start
        else time[anchor.start] - time[block.stop - 1]
    )
    return float(max(apart / problem.bins.width - 1, 0.0))


def held_out_modes(problem: Problem, fit: Fit) -> tuple[Floats, Floats]:
    """Residual of the held-out blocks with covariance V taken out: unit normals if only noise is left.

    Returns
    -------
    lam : ndarray, shape (modes,)
        Eigenvalue of each mode, 0 for the level of a block.
    r : ndarray, shape (modes,)
    """
    space = HeldOutSpace.of(problem, fit)
    return eigenvalues(problem.held_out), space.damped(space.white(residual(problem, fit)))


@dataclass(frozen=True)
class HeldOutSpace:
    """Where held-out data are unit normals if only the noise of a fit is left: V^-1/2, V = S + X cov X'.

    ``white`` takes values over all bins, shape (bins, ...), to modes of the held-out blocks, S^-1/2; ``model`` are the
    columns of the fit there, shape (modes, p), and ``damped`` takes out of modes what the fit's coefficients are not
    sure of.
    """

    white: Callable[[Floats], Floats]
    model: Floats
    damped: Callable[[Floats], Floats]

    @classmethod
    def of(cls, problem: Problem, fit: Fit) -> HeldOutSpace:
        """Of the held-out blocks beside a fit."""
        anchored = _Anchored.of(problem, fit.noise.power)
        free = _free_of_run(problem, fit, anchored)

        def white(values: Floats) -> Floats:
            return free(anchored.whiten(values))

        model = white(fit.design.matrix)
        if not model.shape[1]:
            return cls(white, model, lambda values: values)
        basis, size, _ = np.linalg.svd(model @ np.linalg.cholesky(fit.cov), full_matrices=False)
        taken = basis * (1 - 1 / np.sqrt(1 + size**2))
        return cls(white, model, lambda values: values - taken @ (basis.T @ values))


def _deviate(product: float, information: float, freedom: float) -> float:
    if information < 1e-12:
        return 0.0
    z = product / np.sqrt(information) / HELD_OUT_SPREAD
    tail = log_tail_of_t(abs(z), freedom)
    return float(np.copysign(-ndtri_exp(tail), z)) if np.isfinite(tail) else z


def joint_deviate(log_p_fit: float, ratio: float, z_held: float, information: float) -> float:
    """Z of the fitted and held-out evidence together; ``log_p_fit`` uncorrected for the looks taken."""
    rho = information / max(ratio, 1e-3)
    z_fit = float(-ndtri_exp(min(log_p_fit, -1e-12)))
    return float((z_fit + np.sqrt(rho) * z_held) / np.sqrt(1 + rho))


def log_tail(z: float) -> float:
    """Logarithm of the probability that a standard normal exceeds ``z``."""
    return float(log_ndtr(-z))
