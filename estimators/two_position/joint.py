r"""Two-position calibration from the whole record at once: Gauss-Newton with priors.

The mean velocities of blocks of `BLOCK` at rest are a function of x (see `estimators.two_position.alignment`), of a
velocity of its own for each rest, and of noise: angle random walk, velocity random walk, and a white velocity that sway
makes, whose size the scatter of the blocks tells; for a few seconds after a turn more, for the vehicle may still be
moving. `estimators.two_position.joint_kernel` whitens it. The velocity of the turns is not used (a lever arm of 0.5 m
costs 62 arcmin). The vertical gyro bias is held by its prior: without one the estimate is worse than the published
method. The first `alignment_kernel.RESTS` rests are used; memory: 176 bytes for each block of a run.
Source: S. M. Kay, Fundamentals of Statistical Signal Processing 1 (1993), sections 8.9 and 13.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from estimators.two_position.alignment import Aligned, Alignment, kernel
from estimators.two_position.alignment_told import PARAMETERS as N
from estimators.two_position.alignment_told import Sighting
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats

#: Length of a block [s].
BLOCK = 1.0
#: Motion that a turn may leave where nothing else is said: speed [m/s] and time constant [s].
RESIDUAL = (0.003, 2.0)
#: Gauss-Newton steps.
STEPS = 3


class TwoPositionJoint(Alignment):
    """Installation angle, attitude and biases.

    Parameters
    ----------
    datasheet, sighting, settle
        As of `Alignment`.
    sway : float, optional
        White part of the mean velocity of a block [m/s]; None: from the scatter of the blocks.
    residual : tuple of float
        Motion that a turn may leave: its speed at first [m/s] and its time constant [s].
    """

    block = BLOCK

    def __init__(
        self,
        datasheet: Datasheet,
        sighting: Sighting | None = None,
        settle: float = 0.0,
        sway: float | None = None,
        residual: tuple[float, float] = RESIDUAL,
    ) -> None:
        super().__init__(datasheet, sighting, settle)
        if sway is not None and not sway >= 0:
            raise InputError(f"a sway of {sway:g} m/s given; wanted zero or more")
        self.sway, self.residual = sway, residual

    def estimate(self, state: Aligned) -> Estimate:
        """What is known now; the prior before data."""
        mean, prior = self.prior(state)
        shape, k = state.batch, kernel()
        runs = int(np.prod(shape))
        cells = np.concatenate([c.reshape(runs, -1, k.CELL) for c in (*state.cells, np.empty((*shape, 0, k.CELL)))], 1)
        x, force, cov = self._solved(cells, mean.reshape(runs, N), prior.reshape(runs, N, N), self.time(state))
        return self.estimate_of(
            state, x.reshape(*shape, N), force.reshape(*shape, 2), cov.reshape(*shape, N + 2, N + 2)
        )

    def _solved(self, cells: Floats, mean: Floats, prior: Floats, now: float) -> tuple[Floats, Floats, Floats]:
        """As `estimators.two_position.tied.minimum_variance`."""
        runs = len(mean)
        normal, walk = np.empty((runs, N + 1, N + 1)), np.empty((runs, 2, N + 2))
        told = self.told
        noise = ((told.gravity * told.walk) ** 2, told.velocity_walk**2, told.dt, *self.residual)
        sway, x = self._sway(cells, noise), mean.copy()
        root: Any = np.linalg.cholesky(prior)
        scratch = (
            *(np.empty((6, 3, 3)), np.empty(9), np.empty(9), np.empty(9)),
            *(np.empty(2), np.empty((2, N)), np.empty((2, 4, N + 1))),
        )
        cells, loop = np.ascontiguousarray(cells), _loops().gather
        for step in range(STEPS + 1):
            loop(x, cells, sway, noise, told.numbers, now, *scratch, normal, walk)
            known = _t(root) @ normal[:, :N, :N] @ root + np.eye(N)
            if step == STEPS:
                break
            offset = np.linalg.solve(root, (x - mean)[..., None])
            x = x + (root @ np.linalg.solve(known, _t(root) @ normal[:, :N, N:] - offset))[..., 0]
        spread = root @ np.linalg.inv(known) @ _t(root)
        lean = walk[:, :, :N]
        cov = np.empty((runs, N + 2, N + 2))
        cov[:, :N, :N] = spread
        cov[:, N:, :N] = -lean @ spread
        cov[:, :N, N:] = _t(cov[:, N:, :N])
        cov[:, N:, N:] = walk[:, :, N + 1 :] * np.eye(2) + lean @ spread @ _t(lean)
        return x, walk[:, :, N].copy(), cov

    def _sway(self, cells: Floats, noise: tuple[float, ...]) -> Floats:
        """Variance of the white part of the mean velocities, shape (R,)."""
        if self.sway is not None:
            return np.full(len(cells), self.sway**2)
        found = np.empty((len(cells), 2))
        _loops().scatter(np.ascontiguousarray(cells), found)
        # Second differences: 6 of white noise; of the walks 1 q_v T and 11/20 q_a T^3.
        mean = found[:, 1] / np.maximum(found[:, 0], 1.0)
        T = self.size * self.told.dt
        return np.maximum(mean - noise[1] * T - 0.55 * noise[0] * T**3, 0.0) / 6


def _loops() -> Any:
    from estimators.two_position import joint_kernel as two_position_joint_kernel

    return two_position_joint_kernel


def _t(matrix: Any) -> Any:
    return np.swapaxes(matrix, -1, -2)
