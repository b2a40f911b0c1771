"""Runs of the north finder for the study of its estimators: one roll-out, any number of estimators on its recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from insenv.core.estimate import Datasheet, Estimate, Estimator
from insenv.core.recording import Floats, Recording
from insenv.core.units import ARCSEC
from insenv.envs.rollout import RollOut, roll_out
from insenv.systems.north_finder.env import north_finder

#: Runs that are played together, and processes that play them.
TOGETHER, PROCESSES = 50, 2
#: Name of an estimator in a table to what makes it of a datasheet.
Makers = Mapping[str, Callable[[Datasheet], Estimator]]


@dataclass(frozen=True)
class Procedure:
    """A scenario with its changes, and the policy that plays it: a name or what makes it of a datasheet."""

    scenario: str
    policy: Any
    changes: Mapping[str, Any]


@dataclass(frozen=True)
class Errors:
    """Errors of an azimuth [rad] and the standard deviations that the estimator told, shape (R,)."""

    azimuth: Floats
    sd: Floats

    @property
    def rms(self) -> float:
        """Root mean square [arcsec]."""
        return float(np.sqrt(np.mean(self.azimuth**2)) / ARCSEC)

    @property
    def mean(self) -> float:
        """Mean [arcsec]."""
        return float(np.mean(self.azimuth) / ARCSEC)

    @property
    def std(self) -> float:
        """Standard deviation about the mean, n - 1 [arcsec]."""
        return float(np.std(self.azimuth, ddof=1) / ARCSEC)

    @property
    def told(self) -> float:
        """Root mean square of the deviations told [arcsec]."""
        return float(np.sqrt(np.mean(self.sd**2)) / ARCSEC)


def errors(procedure: Procedure, makers: Makers, seeds: Sequence[int]) -> dict[str, Errors]:
    """Errors of every estimator on the same runs."""
    return _all([(procedure, seeds[i : i + TOGETHER]) for i in range(0, len(seeds), TOGETHER)], makers)


def round_the_circle(procedure: Procedure, makers: Makers) -> dict[str, Errors]:
    """Errors of every estimator at the azimuths 1, 2 ... 360 deg, a run each: no chance in how they fall."""
    jobs = []
    for degree in range(1, 361):
        there = replace(procedure, changes={**procedure.changes, "table.azimuth": f"{degree} deg"})
        jobs.append((there, [degree]))
    return _all(jobs, makers)


def _all(jobs: Sequence[tuple[Procedure, Sequence[int]]], makers: Makers) -> dict[str, Errors]:
    """Errors over all jobs, in their order."""
    with ProcessPoolExecutor(PROCESSES) as pool:
        played = list(pool.map(partial(_errors, makers), jobs, chunksize=max(1, len(jobs) // 40)))
    return {
        name: Errors(*(np.concatenate([getattr(p[name], f) for p in played]) for f in ("azimuth", "sd")))
        for name in makers
    }


def _errors(makers: Makers, job: tuple[Procedure, Sequence[int]]) -> dict[str, Errors]:
    procedure, seeds = job
    played, recording, sheet = play(procedure, seeds)
    truth = played.truth["azimuth"]
    found = {}
    for name, make in makers.items():
        mean, sd = whole(make(sheet), recording, len(seeds)).of("azimuth")
        found[name] = Errors((mean - truth + np.pi) % (2 * np.pi) - np.pi, sd)
    return found


def play(procedure: Procedure, seeds: Sequence[int]) -> tuple[RollOut, Recording, Datasheet]:
    """A roll-out, its recording (arrays of shape (R, n)) and the datasheet."""
    task = north_finder(procedure.scenario, procedure.changes)
    policy = procedure.policy if isinstance(procedure.policy, str) else procedure.policy(task.datasheet)
    played = roll_out(task, policy, None, seeds)
    return played, joined(played), task.datasheet


def joined(played: RollOut) -> Recording:
    """The recordings of all runs as one batch; they must have lasted equally long."""
    chunks = [chunk for _, chunk in played.chunks]
    batch = len(played.seeds)
    channels = {
        name: replace(
            channel,
            values=np.concatenate(
                [np.broadcast_to(c.channels[name].values, (batch, len(c.t))) for c in chunks], axis=-1
            ),
        )
        for name, channel in chunks[0].channels.items()
    }
    return replace(chunks[0], t=np.concatenate([c.t for c in chunks]), channels=channels)


def whole(estimator: Estimator, recording: Recording, batch: int) -> Estimate:
    """What an estimator makes of a whole recording."""
    return estimator.estimate(estimator.update(estimator.reset(batch), recording))
