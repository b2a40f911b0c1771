"""Noise of a gyro on a table that turns, as its datasheet tells it.

What drifts matters to north at one frequency, once a turn. With the two-sided density S there the coefficients of
cosine and sine have the variance 2 S / T, as if N^2 were larger by S:

    rate random walk    K^2 / (2 pi f)^2         bias instability    B^2 / (2 pi f)
    lock-in that walks  the rate error -W^2 / (2 u) of W = W_L (1 + k B(t)) is a walk of K = W_L^2 k / u, u the input
"""

from __future__ import annotations

import numpy as np

from insenv.core.estimate import Datasheet
from insenv.core.recording import Floats


def white_angle(datasheet: Datasheet) -> float:
    """White error of the residual angle at each sample, one standard deviation [rad]: pulses and encoder."""
    pulse = datasheet.pulse / 12**0.5 or datasheet.coefficient("gyro", "quantization")
    return float(np.hypot(pulse, np.sin(datasheet.mounting.tilt) * datasheet.encoder_noise))


def density(datasheet: Datasheet, rate: Floats, share: float) -> Floats:
    """Two-sided density of the drifts at one cycle per turn [(rad/s)^2 / Hz], for table rates [rad/s]."""
    turning = np.maximum(np.abs(rate), 1e-9)
    walk = np.full(np.shape(turning), datasheet.coefficient("gyro", "rate_random_walk") ** 2)
    flicker = datasheet.coefficient("gyro", "bias_instability") ** 2
    locked = datasheet.told("lock_in_wander", "gyro")
    if locked is not None:
        threshold, _, _, wander = locked.mean
        walk = walk + (threshold**2 * wander / np.maximum(turning * share, 1e-9)) ** 2
    return np.asarray(walk / turning**2 + flicker / turning)


def lock_in(datasheet: Datasheet) -> float:
    """Square of the lock-in threshold that is told of [rad^2/s^2]; zero where none is."""
    square, wandering = datasheet.told("lock_in", "gyro"), datasheet.told("lock_in_wander", "gyro")
    total = 0.0 if square is None else max(square.mean[0], 0.0)
    return total if wandering is None else total + wandering.mean[0] ** 2
