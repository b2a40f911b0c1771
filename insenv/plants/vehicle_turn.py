r"""Turns of a vehicle on the spot: a trapezoid of rate within the limits of rate W and acceleration A.

A turn by D takes |D| / (A r) + r with the ramp r = min(W / A, sqrt(|D| / A)).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.plants.vehicle_sway import Settling

#: Times that differ by less are the same [s].
SAME = 1e-9
#: Settling has ended after so many time constants.
SETTLED = 40.0


@dataclass(frozen=True)
class LatestTurn:
    """State of a vehicle: its latest turn.

    All arrays are of one batch, or of none where every run has the same.

    Attributes
    ----------
    start : ndarray, shape (...)
        When it began [s].
    before, by : ndarray, shape (...)
        Turn angle before it, and that turned by [rad], counter-clockwise; ``by`` is 0 before the first.
    tails : ndarray, shape (..., 2, 3)
        Velocities of settling that were left at its start, in the vehicle's frame at turn angle 0 [m/s].
    planned : int
        Turns of the profile that have begun.
    """

    start: Floats
    before: Floats
    by: Floats
    tails: Floats
    planned: int = 0

    def rows(self, index: NDArray[np.int64]) -> LatestTurn:
        """State of the runs ``index`` of a batch; what all runs share stays shared."""
        if not self.start.ndim:
            return self
        start, before, by, tails = (a[index] for a in (self.start, self.before, self.by, self.tails))
        return replace(self, start=start, before=before, by=by, tails=tails)


def ahead() -> LatestTurn:
    """A vehicle that has not turned yet."""
    return LatestTurn(np.zeros(()), np.zeros(()), np.zeros(()), np.zeros((2, 3)))


@dataclass(frozen=True)
class Drive:
    """What a vehicle turns with.

    ``rate`` [rad/s] and ``acceleration`` [rad/s^2] are limits, ``axis`` the pivot axis in the vehicle's frame, shape
    (..., 3), and ``settling`` what a turn ends with: residual motion and creep.
    """

    rate: float
    acceleration: float
    axis: Floats
    settling: tuple[Settling, Settling]

    def times(self, by: Floats) -> tuple[Floats, Floats]:
        """Time of a ramp and of the whole turn by ``by`` [s], shape (...)."""
        size = np.abs(by)
        rising = np.minimum(self.rate / self.acceleration, np.sqrt(size / self.acceleration))
        return rising, np.where(size > 0, size / (self.acceleration * np.where(size > 0, rising, 1.0)) + rising, 0.0)

    def commanded(self, state: LatestTurn, angle: Floats, time: float) -> LatestTurn:
        """State of vehicles that are told at ``time`` to turn by ``angle``, shape (...); 0 or NaN: to stay.

        One that turns goes on with that.
        """
        asked = np.nan_to_num(np.asarray(angle, float))
        if not asked.any():
            return state
        end = state.start + self.times(state.by)[1]
        goes = (asked != 0) & ~((state.by != 0) & (time < end - SAME))
        if not goes.any():
            return state
        reached = state.before + state.by
        return replace(
            state,
            start=np.where(goes, time, state.start),
            before=np.where(goes, reached, state.before),
            by=np.where(goes, asked, state.by),
            tails=np.where(goes[..., None, None], self._settling(state, time, end), state.tails),
        )

    def _settling(self, state: LatestTurn, time: float, end: Floats) -> Floats:
        """Velocities of settling at ``time``, shape (..., 2, 3)."""
        reached = (state.before + state.by)[..., None]
        ahead = np.array([0.0, 1.0, 0.0])
        along = self.axis * self.axis[..., 1:2]
        forward = np.cos(reached) * (ahead - along) + np.sin(reached) * np.cross(self.axis, ahead) + along
        parts = []
        for k, one in enumerate(self.settling):
            old = _fade(time - state.start, one.time_constant)[..., None] * state.tails[..., k, :]
            new = one.velocity * _fade(time - end, one.time_constant) * (state.by != 0)
            parts.append(old + new[..., None] * forward)
        return np.stack(np.broadcast_arrays(*parts), axis=-2)


def _fade(since: Floats, time_constant: float) -> Floats:
    since = np.maximum(since, 0.0)
    return np.where(since < SETTLED * time_constant, np.exp(-since / time_constant), 0.0)
