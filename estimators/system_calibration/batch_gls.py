r"""All parameters of a unit by generalised least squares, from the rests and the turns of a whole recording.

    theta^ = mu + P^(1/2) (I + M)^-1 P^(1/2) X' C^-1 (m - u - X mu)

Means m over cells with the covariance C of all noises of the datasheet, walks and flicker among them; X are the
declared effects of the six channels and the derivatives to the errors of the table, mu and P what is told of both
(`insenv.information.unit.calibration`). As all is linear and Gaussian this is the maximum of the likelihood with the
prior, and it reaches the bound where the datasheet is right. The errors of the table are estimated beside. Memory: a
block of a second takes up to a kilobyte.
Source: S. M. Kay, Fundamentals of Statistical Signal Processing 1 (1993), sections 10.6 and 11.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from estimators.system_calibration.of_blocks import OfBlocks, Seen
from insenv.core.estimate import Estimate
from insenv.information.unit.calibration import joined


@final
@dataclass(frozen=True)
class BatchGls(OfBlocks):
    """Parameters of the unit and errors of the table with their covariance.

    Needs "gyro_x" .. "gyro_z" [rad/s], "accel_x" .. "accel_z" [m/s^2], "axis_1" .. [rad] and "turning"; "temperature"
    [K] where an effect of it is declared.

    Raises
    ------
    InputError
        If the datasheet tells of no axes, no gravity or no noise.
    """

    def estimate(self, state: Seen) -> Estimate:
        """What is known; before there is a block of data, what the datasheet tells."""
        parameters, runs = self.model.parameters, len(state.data.past)
        blocks = joined(state.data)
        if blocks is None:
            mean = np.tile([q.mean for q in parameters], (runs, 1))
            cov = np.tile(np.diag([q.sd**2 for q in parameters]), (runs, 1, 1))
        else:
            mean, cov = self.model.posterior(blocks)
        if not state.batched:
            mean, cov = mean[0], cov[0]
        return Estimate(tuple(q.name for q in parameters), tuple(q.unit for q in parameters), mean, cov)
