"""What the tests of the environments share: a short scenario, estimators of their own, and what "the same" means."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

import insenv  # noqa: F401 - registers the environments
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording

ID = "insenv/NorthFinder-v0"
#: Six steps of a second; a table that gymnasium's check does not think too fast.
SHORT: dict[str, Any] = {"duration": "6 s", "table.max_rate": "50 deg/s"}
RATE = np.radians(10.0)


@dataclass(frozen=True)
class Tally:
    """State of `Sure`: what passed so far, of each run."""

    samples: Floats
    turned: Floats


class Sure:
    """An estimator that is surer with each sample of a table that turns; it believes in a function of the gyro's."""

    def __init__(self, datasheet: Datasheet) -> None:
        self.datasheet = datasheet

    def reset(self, batch: int | None = None) -> Tally:
        return Tally(np.zeros(batch or ()), np.zeros(batch or ()))

    def update(self, state: Tally, chunk: Recording) -> Tally:
        rate = chunk.values("gyro", "rad/s")
        # Column by column, so that a row of a batch is the same run alone, bit for bit.
        turned = state.turned
        for k in range(0, rate.shape[-1], 10):
            turned = turned + rate[..., k] * self.datasheet.dt
        return Tally(state.samples + rate.shape[-1], turned)

    def estimate(self, state: Tally) -> Estimate:
        sd = np.pi / np.sqrt(3) / np.sqrt(1 + state.samples)
        mean = np.clip(state.turned, -3, 3)
        return Estimate(("azimuth",), ("rad",), mean[..., None], (sd**2)[..., None, None])


class Raises(Sure):
    def update(self, state: Tally, chunk: Recording) -> Tally:
        raise RuntimeError("out of\norder")


class SaysNaN(Sure):
    def estimate(self, state: Tally) -> Estimate:
        known = super().estimate(state)
        mean = np.where(state.samples[..., None] > 0, np.nan, known.mean)
        return Estimate(known.names, known.units, mean, known.cov)


class WrongShape(Sure):
    def estimate(self, state: Tally) -> Estimate:
        return Estimate(("azimuth",), ("rad",), np.zeros(1), np.zeros((1, 1)))


class KnowsNoNorth(Sure):
    def estimate(self, state: Tally) -> Estimate:
        known = super().estimate(state)
        return Estimate(("level",), known.units, known.mean, known.cov)


class IsNotMade(Sure):
    def __init__(self, datasheet: Datasheet) -> None:
        raise KeyError("encoder")


class Stops:
    """A policy that turns the table and stops row i after i steps."""

    def __init__(self, datasheet: Datasheet) -> None:
        del datasheet

    def reset(self, batch: int | None = None) -> Floats:
        return np.arange(batch or 1, dtype=float)

    def act(self, state: Floats, chunk: Recording | None, estimate: Estimate | None) -> tuple[Floats, Floats]:
        action = np.stack([np.full_like(state, RATE), (state <= 0).astype(float)], axis=-1)
        return action, state - 1


def made(estimator: str | None = None, **changes: Any) -> gymnasium.Env[Any, Any]:
    """A short north finder without wrappers."""
    env = gymnasium.make(ID, estimator=estimator, changes=SHORT | changes, disable_env_checker=True)
    return env.unwrapped


def actions(*rows: tuple[float, float]) -> Floats:
    """Actions of a batch: rate in deg/s and stop."""
    return np.array([(np.radians(rate), stop) for rate, stop in rows])


def assert_same(a: Any, b: Any, where: str = "") -> None:
    """Equal bit for bit, in type and keys too."""
    assert type(a) is type(b), (where, type(a), type(b))
    if isinstance(a, dict):
        assert a.keys() == b.keys(), where
        for key in a:
            assert_same(a[key], b[key], f"{where}.{key}")
    elif isinstance(a, tuple):
        assert len(a) == len(b), where
        for i, (x, y) in enumerate(zip(a, b, strict=True)):
            assert_same(x, y, f"{where}[{i}]")
    elif isinstance(a, np.ndarray):
        assert a.dtype == b.dtype and a.shape == b.shape, where
        assert np.array_equal(a, b), (where, a, b)
    else:
        assert a == b, (where, a, b)
