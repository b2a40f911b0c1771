"""A policy that goes by what it measures."""

from typing import Any

import numpy as np

from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording


class Looking:
    """Turns at 10 deg/s once the gyro has told something."""

    def __init__(self, datasheet: Datasheet) -> None:
        self.datasheet = datasheet

    def reset(self, batch: int | None = None) -> Any:
        """Nothing to keep."""

    def act(self, state: Any, chunk: Recording | None, estimate: Estimate | None) -> tuple[Floats, Any]:
        """The rate, and no stop."""
        seen = 0.0 if chunk is None else float(np.isfinite(chunk.values("gyro", "rad/s")).all())
        return np.broadcast_to([0.17 * seen, 0.0], (1, 2)).copy(), state
