r"""Two-position calibration with the cubic term tied to the others, a constant, and two passes.

At rest the third coefficients of v_E, v_N = c + a1 t + a2 t^2 + a3 t^3 follow from the others,

    a3_E = omega_U a2_N / 3,      a3_N = -omega_U a2_E / 3 - omega_N^2 a1_N / 6,

so c, a1 and a2 alone are fitted by least squares to every sample of a rest; the constant takes the velocity that a
swaying body has when the fit begins. The coefficients of all rests are joined with the priors by minimum variance, the
gyro's vertical bias held by its own; the noise is an angle and a velocity random walk, which goes on from rest to rest.
The second pass fits what the corrected attitude leaves. The first `alignment_kernel.RESTS` rests are used; memory: 2 kB
for a run of any length.
Source: Guo, Li, He (2018), DOI 10.11977/j.issn.1004-2474.2018.01.016, for the method, without the tie and the constant.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from estimators.two_position.alignment import Aligned, Alignment, kernel
from estimators.two_position.alignment_told import PARAMETERS as N
from insenv.core.estimate import Estimate
from insenv.core.recording import Floats

#: A rest that is shorter than this tells nothing yet [s].
SHORTEST = 1.0
#: Passes over the sums: the second starts from the corrected attitude.
PASSES = 2


class TwoPositionTied(Alignment):
    """Installation angle, attitude and biases; parameters as of `Alignment`."""

    def estimate(self, state: Aligned) -> Estimate:
        """What is known now; the prior before data."""
        mean, prior = self.prior(state)
        flat = RestSums.of(self, state)
        x, walk, cov = minimum_variance(self, flat, mean.reshape(-1, N), prior.reshape(-1, N, N), self.time(state))
        shape = state.batch
        return self.estimate_of(state, x.reshape(*shape, N), walk.reshape(*shape, 2), cov.reshape(*shape, N + 2, N + 2))


class RestSums:
    """Sums of the rests of R runs in the time x = t / T of each, T its length.

    gram : (R, P, 8, 8), moments : (R, P, 8), of E then N; span : (R, P) [s]; began : (R, P) [s]; sums : as kept.
    """

    def __init__(self, sums: Floats, dt: float) -> None:
        k = kernel()
        # All rests, used or not: a batch with more of them has the same bits.
        self.sums = np.ascontiguousarray(sums)
        self.count, self.began = self.sums[..., 0], self.sums[..., k.BEGAN]
        self.span, self.dt = self.count * dt, dt
        self.good = self.span >= SHORTEST * (1 - 1e-9)
        scale = np.where(self.good, self.span / k.SPAN, 1.0)[..., None] ** -np.arange(7.0)
        powers = self.sums[..., :7] * scale
        moments = self.sums[..., k.MOMENTS : k.MOMENTS + 12].reshape(*self.span.shape, 4, 3)[..., :2]
        index = np.arange(4)
        self.gram = np.zeros((*self.span.shape, 8, 8))
        one = powers[..., index[:, None] + index]
        self.gram[..., :4, :4] = self.gram[..., 4:, 4:] = one
        self.gram[~self.good] = np.eye(8)
        self.moments = np.swapaxes(moments * scale[..., :4, None], -1, -2).reshape(*self.span.shape, 8)

    @classmethod
    def of(cls, estimator: Alignment, state: Aligned) -> RestSums:
        """Of a state, flattened to R runs."""
        k = kernel()
        return cls(state.sums.reshape(-1, k.RESTS, k.SUMS), estimator.told.dt)

    def predicted(self, estimator: Alignment, x: Floats) -> tuple[Floats, Floats]:
        """Coefficients of the velocity, shape (R, P, 8), and derivatives by x, shape (R, P, 8, 12)."""
        a, B = np.zeros((*self.span.shape, 2, 4)), np.zeros((*self.span.shape, 2, 4, N))
        scratch = np.empty((7, 3, 3)), np.empty(9), np.empty((3, 2)), np.empty((3, 2, N))
        numbers = estimator.told.numbers
        _model().polynomials(np.ascontiguousarray(x), self.sums, self.dt, numbers, *scratch, a, B)
        return a.reshape(*self.span.shape, 8), B.reshape(*self.span.shape, 8, N)

    def noise(self, estimator: Alignment, K: Floats) -> tuple[Floats, Floats]:
        """Covariance of K m over all rests, shape (R, P k, P k), and with the walk now, shape (R, P k, 2).

        K : shape (R, P, k, 8), zero where a rest is not used.
        """
        told, (runs, rests, k, _) = estimator.told, K.shape
        q = (told.gravity * told.walk) ** 2
        T, n = self.span[..., None, None], self.count[..., None, None]
        velocity, angle = walks()
        one = n * n * (told.velocity_walk**2 * T * velocity + q * T**3 * angle)
        M = np.zeros((runs, rests, 8, 8))
        M[..., :4, :4] = M[..., 4:, 4:] = one
        own = K @ M @ np.swapaxes(K, -1, -2)
        ramp, bend = np.zeros((8, 2)), np.zeros((8, 2))
        ramp[1, 0] = ramp[5, 1] = 1.0
        bend[2, 0] = bend[6, 1] = 0.5
        first = K @ self.gram @ (T * ramp)  # of the walk at the start of a rest, a force
        later = q * (self.began[..., None, None] * first + K @ self.gram @ (T * T * bend))
        whole = np.zeros((runs, rests, k, rests, k))
        for p in range(rests):
            whole[:, p, :, p] = own[:, p] + q * self.began[:, p, None, None] * first[:, p] @ _t(first[:, p])
            for r in range(p + 1, rests):
                whole[:, p, :, r] = later[:, p] @ _t(first[:, r])
                whole[:, r, :, p] = _t(whole[:, p, :, r])
        return whole.reshape(runs, rests * k, rests * k), later.reshape(runs, rests * k, 2)


@lru_cache
def walks() -> tuple[Floats, Floats]:
    """Covariance of int x^i v dx, i = 0..3, for v = W(x) and for v = int W, each shape (4, 4)."""
    i, j = np.meshgrid(np.arange(4.0), np.arange(4.0), indexing="ij")
    velocity = (1 / (i + 2) + 1 / (j + 2)) / (i + j + 3)
    angle = (0.5 / (i + 3) - 1 / (6 * (i + 4)) + 0.5 / (j + 3) - 1 / (6 * (j + 4))) / (i + j + 5)
    return velocity, angle


def tied(rests: RestSums, rate: tuple[float, float]) -> Floats:
    """Least squares of the moments: a1, a2 of E and of N in the time of each rest, shape (R, P, 4, 8)."""
    north, up = rate
    B = np.zeros((*rests.span.shape, 8, 6))
    B[..., [0, 1, 2, 4, 5, 6], range(6)] = 1.0
    B[..., 3, 5] = up * rests.span / 3
    B[..., 7, 2] = -up * rests.span / 3
    B[..., 7, 4] = -((north * rests.span) ** 2) / 6
    fit = np.linalg.solve(_t(B) @ rests.gram @ B, _t(B))[..., [1, 2, 4, 5], :]
    return np.where(rests.good[..., None, None], fit, 0.0)


def minimum_variance(
    estimator: Alignment, rests: RestSums, mean: Floats, prior: Floats, now: float
) -> tuple[Floats, Floats, Floats]:
    """x, shape (R, 12), force of the attitude's walk, (R, 2), and the covariance of both, (R, 14, 14)."""
    K = tied(rests, estimator.told.rate)
    runs, used, k, _ = K.shape
    S, C = rests.noise(estimator, K)
    idle = np.repeat(~rests.good, k, axis=1)
    S[:, range(used * k), range(used * k)] += idle
    size = np.sqrt(np.diagonal(S, axis1=-2, axis2=-1))
    half: Any = np.linalg.cholesky(S / (size[..., :, None] * size[..., None, :]))
    root: Any = np.linalg.cholesky(prior)
    x: Floats = mean.copy()
    for _ in range(PASSES):
        a, D = rests.predicted(estimator, x)
        left = (K @ (rests.moments - (rests.gram @ a[..., None])[..., 0])[..., None]).reshape(runs, -1)
        A = (K @ rests.gram @ D).reshape(runs, used * k, N) @ root
        y = np.concatenate([A, left[..., None], C], axis=-1) / size[..., None]
        whitened: Any = np.linalg.solve(half, y)
        white, residual, walk = whitened[..., :N], whitened[..., N : N + 1], whitened[..., N + 1 :]
        normal = _t(white) @ white + np.eye(N)
        offset = np.linalg.solve(root, (x - mean)[..., None])
        x += (root @ np.linalg.solve(normal, _t(white) @ residual - offset))[..., 0]
    # The last step is taken into account: what is left of the residual tells of the walk.
    moved = np.linalg.solve(root, (x - mean)[..., None]) - offset
    force = (_t(walk) @ (residual - white @ moved))[..., 0]
    spread = np.linalg.inv(normal)
    lean = _t(walk) @ white
    cov = np.empty((runs, N + 2, N + 2))
    cov[:, :N, :N] = root @ spread @ _t(root)
    cov[:, N:, :N] = -lean @ spread @ _t(root)
    cov[:, :N, N:] = _t(cov[:, N:, :N])
    q = (estimator.told.gravity * estimator.told.walk) ** 2
    cov[:, N:, N:] = q * now * np.eye(2) - _t(walk) @ walk + lean @ spread @ _t(lean)
    return x, force, cov


def _model() -> Any:
    from estimators.two_position import alignment_model  # with numba

    return alignment_model


def _t(matrix: Any) -> Any:
    return np.swapaxes(matrix, -1, -2)
