r"""Biases, scale factors and misalignments of a unit by least squares, rest by rest and turn by turn.

    theta^ = G d,   G = (X' W X + P^-1)^-1 X' W,      cov = (1 - G X) P (1 - G X)' + G C G' + (G X_2) P_2 (G X_2)'

The textbook's calculation: means d of the rests, and of gyros the integrals of the turns too, less what a unit without
errors would show; X are biases, scale factors, misalignments and non-orthogonality of the six channels and the mounting
of the unit, W white noise. Everything else that the datasheet declares (theta_2 with P_2: asymmetry, g-sensitivity,
second-order terms, lever arms, errors of the table) is left out of the estimate, but not of its covariance; so is slow
noise, in C. What is not told apart keeps what was known of it (P).
Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. (2004), section 8.3; S. F. Schmidt,
Application of state-space methods to navigation problems (1966), for what is considered and not estimated.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from estimators.system_calibration.of_blocks import OfBlocks
from insenv.core.recording import Floats
from insenv.core.unit.motion import GYROS
from insenv.effects.own import ALL
from insenv.information.unit.calibration import Blocks

#: Effects that are estimated: the linear model of a triad.
ESTIMATED = {effect.id for effect in ALL if effect.part}


@final
@dataclass(frozen=True)
class SixPosition(OfBlocks):
    """Biases, scale factors, misalignments and the mounting of the unit with their covariance.

    Needs what `estimators.system_calibration.batch_gls.BatchGls` needs.

    Raises
    ------
    InputError
        If the datasheet tells of no axes, no gravity or no noise.
    """

    @cached_property
    def estimated(self) -> NDArray[np.bool_]:
        """Which of the model's parameters are, shape (p,)."""
        return np.array(
            [q.name.startswith("mounting.") or q.name.split(".")[1] in ESTIMATED for q in self.model.parameters]
        )

    def solved(self, blocks: Blocks, point: Floats | None) -> tuple[Floats, Floats]:
        """Mean and covariance of all parameters; what is not estimated keeps what is told of it."""
        parameters, own = self.model.parameters, self.estimated
        mean, sd = (np.array([getattr(q, name) for q in parameters]) for name in ("mean", "sd"))
        found = np.tile(mean, (len(blocks.left), 1))
        about = found.copy() if point is None else point
        cov = np.tile(np.diag(sd**2), (len(found), 1, 1))
        for row in range(len(found)):
            shift, spread = self._of_run(blocks, row, ((mean - about[row]) / sd)[own])
            found[row, own] = about[row, own] + sd[own] * shift
            cov[row][np.ix_(own, own)] = spread * np.outer(sd[own], sd[own])
        return found, cov

    def _of_run(self, blocks: Blocks, row: int, told: Floats) -> tuple[Floats, Floats]:
        """Of one run, from the blocks' point on, in units of the prior deviations; ``told`` is the prior mean there."""
        p, own = len(self.estimated), self.estimated
        normal, vector = np.zeros((own.sum(), own.sum())), np.zeros(own.sum())
        rows = []
        for c in range(6):
            columns, data, covariance = self.model.cells(blocks, row, c)
            # Accelerometers are used at rest, where no lever arm counts.
            used = np.ones(len(data), bool) if c < len(GYROS) else ~self.model.turns(blocks, row, c)
            all_columns = np.zeros((int(used.sum()), p))
            all_columns[:, self.model.places[c]] = columns[used]
            weights = 1 / np.diag(covariance)[used]
            mine = all_columns[:, own]
            normal += mine.T @ (weights[:, None] * mine)
            vector += mine.T @ (weights * data[used])
            rows.append((all_columns, weights, covariance[np.ix_(used, used)]))
        inverse: Floats = np.asarray(np.linalg.inv(np.eye(len(normal)) + normal), float)
        noise, others = np.zeros_like(normal), np.zeros((len(normal), int((~own).sum())))
        for columns, weights, covariance in rows:
            gain = columns[:, own].T * weights
            noise += gain @ covariance @ gain.T
            others += gain @ columns[:, ~own]
        # 1 - G X is the inverse itself, as P is one.
        cov = inverse @ (np.eye(len(normal)) + noise + others @ others.T) @ inverse
        return inverse @ (vector + told), 0.5 * (cov + cov.T)
