r"""All parameters of a unit by generalised least squares, from the rests and the turns of a whole recording.

    theta^ = mu + P^(1/2) (I + M)^-1 P^(1/2) X' C^-1 (m - u - X mu)

Means m over cells with the covariance C of all noises of the datasheet, walks and flicker among them; X are the
declared effects of the six channels and the derivatives to the errors of the table, mu and P what is told of both
(`insenv.information.unit.calibration`). As all is linear and Gaussian this is the maximum of the likelihood with the
prior, and it reaches the bound where the datasheet is right. The errors of the table are estimated beside. Memory: a
block of a second takes up to a kilobyte. Of a coarse unit, whose errors times its mounting show beside the noise, the
model is linear about what was found before (`insenv.information.unit.anew`), and all samples are kept for that.
Source: S. M. Kay, Fundamentals of Statistical Signal Processing 1 (1993), sections 10.6 and 11.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from estimators.system_calibration.of_blocks import OfBlocks


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
