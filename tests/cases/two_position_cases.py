"""What the tests of the two-position calibration share: a short scenario, an estimator and a policy of their own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

import insenv  # noqa: F401 - registers the environments
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.scenario import names

ID = "insenv/TwoPosition-v0"
SCENARIOS = [name for name in names() if name.startswith("two_position/")]
SURE = "two_position_cases:Sure"
ESTIMATORS = (None, SURE, "two_position", "two_position_tied", "two_position_joint")
#: Eight steps of a second; a turn by 9 deg takes three of them.
SHORT: dict[str, Any] = {
    "duration": "8 s",
    "profile": {"kind": "rest"},
    "vehicle.max_rate": "10 deg/s",
    "vehicle.max_acceleration": "5 deg/s^2",
}
NINE = np.radians(9.0) / np.pi
STAY, TURN, STOP = np.array([0.0, 0.0]), np.array([NINE, 0.0]), np.array([0.0, 1.0])


@dataclass(frozen=True)
class Tally:
    """State of `Sure`: samples at rest so far, and what the sight read first."""

    samples: Floats
    heading: Floats


class Sure:
    """An estimator that is surer with each sample at rest; it believes in a function of what is read."""

    def __init__(self, datasheet: Datasheet) -> None:
        self.datasheet = datasheet

    def reset(self, batch: int | None = None) -> Tally:
        return Tally(np.zeros(batch or ()), np.full(batch or (), np.nan))

    def update(self, state: Tally, chunk: Recording) -> Tally:
        still = chunk.values("turning", "1") == 0
        first = chunk.values("sight_heading", "rad")[..., 0]
        heading = np.where(np.isnan(state.heading), first, state.heading)
        return Tally(state.samples + np.count_nonzero(still, axis=-1), heading)

    def estimate(self, state: Tally) -> Estimate:
        sd = np.radians(1.0) / np.sqrt(1 + state.samples)
        mean = np.stack([sd / 2, np.nan_to_num(state.heading)], axis=-1)
        cov = (sd**2)[..., None, None] * np.eye(2)
        return Estimate(("installation_angle", "heading"), ("rad", "rad"), mean, cov)


class KnowsNoSight(Sure):
    def estimate(self, state: Tally) -> Estimate:
        known = super().estimate(state)
        return Estimate(("level", "heading"), known.units, known.mean, known.cov)


class OnlyTheAngle(Sure):
    def estimate(self, state: Tally) -> Estimate:
        known = super().estimate(state)
        return Estimate(known.names[:1], known.units[:1], known.mean[..., :1], known.cov[..., :1, :1])


class TurnsOnce:
    """A policy that turns every vehicle by 9 deg in the third step."""

    def __init__(self, datasheet: Datasheet) -> None:
        del datasheet

    def reset(self, batch: int | None = None) -> Floats:
        return np.zeros(batch or 1)

    def act(self, state: Floats, chunk: Recording | None, estimate: Estimate | None) -> tuple[Floats, Floats]:
        return np.stack([np.where(state == 2, NINE, 0.0), np.zeros_like(state)], axis=-1), state + 1


def made(estimator: str | None = None, **changes: Any) -> Any:
    """A short calibration without wrappers."""
    env = gymnasium.make(ID, estimator=estimator, changes=SHORT | changes, disable_env_checker=True)
    return env.unwrapped
