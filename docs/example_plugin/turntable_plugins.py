"""Plug-ins for insenv's north finder: an estimator that keeps its state outside, and a policy that keeps it inside.

Least squares of the gyro's rate on the table's angle and rate:

    gyro = b + k * table rate + c cos(angle) + s sin(angle),    azimuth = atan2(s, c),

for the Earth's level rate along the input axis goes with cos(azimuth - angle). Every sample's noise is taken for white,
though the errors of counted pulses cancel from one sample to the next: a better estimator would use that.
"""

import numpy as np

from insenv.core.estimate import Estimate


class FoldedTurns:
    """An estimator. What it learns stands in the state, so that one object serves a whole batch of runs."""

    def __init__(self, datasheet):
        self.datasheet = datasheet
        # White noise of one sample [rad/s]: the random walk, and two edges of a counted pulse.
        walk, dt = datasheet.coefficient("gyro", "angle_random_walk"), datasheet.dt
        self.variance = walk**2 / dt + 2 * (datasheet.pulse / dt) ** 2 / 12

    def reset(self, batch=None):
        """Normal equations [A | b] of four unknowns, and the last angle; the batch of runs stands in front."""
        front = () if batch is None else (batch,)
        return {"normal": np.zeros((*front, 4, 5)), "angle": np.zeros(front)}

    def update(self, state, chunk):
        """A new state: what came in stays as it was."""
        gyro, angle = chunk.values("gyro", "rad/s"), chunk.values("table_angle", "rad")
        # The first interval of this chunk begins where the last one ended.
        before = np.concatenate([state["angle"][..., None], angle[..., :-1]], axis=-1)
        middle, rate = 0.5 * (before + angle), (angle - before) / self.datasheet.dt
        columns = np.stack([np.ones_like(rate), rate, np.cos(middle), np.sin(middle), gyro], axis=-1)
        added = np.swapaxes(columns[..., :4], -1, -2) @ columns
        return {"normal": state["normal"] + added, "angle": angle[..., -1]}

    def estimate(self, state):
        """Mean and covariance; nothing is known of the azimuth before the table has turned."""
        normal = state["normal"]
        size = np.sqrt(np.maximum(np.diagonal(normal[..., :4], axis1=-2, axis2=-1), 1e-30))
        scaled = normal[..., :4] / (size[..., :, None] * size[..., None, :])
        turned = np.linalg.eigvalsh(scaled)[..., 0] > 1e-4
        inverse = np.linalg.inv(np.where(turned[..., None, None], scaled, np.eye(4)))
        cov = self.variance * inverse / (size[..., :, None] * size[..., None, :])
        _, _, c, s = np.moveaxis((inverse @ (normal[..., 4] / size)[..., None])[..., 0] / size, -1, 0)
        # Across the direction that was found, an error of the wave is an error of the angle.
        square = np.maximum(c**2 + s**2, 1e-30)
        variance = (s**2 * cov[..., 2, 2] - 2 * c * s * cov[..., 2, 3] + c**2 * cov[..., 3, 3]) / square**2
        nothing = np.pi**2 / 3  # of an angle that may be any
        mean = np.where(turned, np.arctan2(s, c), 0.0)
        variance = np.where(turned, np.minimum(variance, nothing), nothing)
        return Estimate(("azimuth",), ("rad",), mean[..., None], variance[..., None, None])


class ThereAndBack:
    """A policy: whole turns one way, then the other. It counts steps in itself, and insenv copies it for each run."""

    def __init__(self, datasheet):
        # Actions are a rate [rad/s] and a signal, which from 0.5 on stops the run.
        self.rate, self.half, self.time = min(0.35, datasheet.limits.rate), 0.5 * datasheet.duration, 0.0

    def act(self, block, estimate=None):
        """The next action; ``block`` is what was recorded since the last one, at first None."""
        if block is not None:
            self.time = float(block.t[-1])
        return np.array([self.rate if self.time < self.half else -self.rate, 0.0])
