"""Runs of the two-position calibration: errors of an estimator at the end, and how they shrink on the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from insenv.core.plugins import POLICIES, find
from insenv.core.recording import Floats
from insenv.core.units import ARCMIN, DEG, DEG_PER_HOUR, UG
from insenv.envs.rollout import roll_out
from insenv.systems.two_position.env import two_position

#: Runs that are played together, and processes that play them.
TOGETHER, PROCESSES = 40, 2
#: Unit in which a quantity is shown, and what it is called.
SHOWN = {
    **dict.fromkeys(("installation_angle", "heading", "pitch", "roll"), (ARCMIN, "arcmin")),
    **dict.fromkeys(("gyro_x", "gyro_y"), (DEG_PER_HOUR, "deg/h")),
    **dict.fromkeys(("accel_x", "accel_y"), (UG, "ug")),
}


@dataclass(frozen=True)
class Procedure:
    """A scenario with its changes, the policy and its settings, and the turn that it ends up with [rad]."""

    scenario: str
    policy: str = "published_schedule"
    settings: tuple[tuple[str, Any], ...] = ()
    changes: tuple[tuple[str, Any], ...] = ()
    turned: float = 170 * DEG


@dataclass(frozen=True)
class Judged:
    """Errors and told deviations by quantity, shape (R,), SI, and the time used [s]."""

    errors: Mapping[str, Floats]
    sd: Mapping[str, Floats]
    time: Floats

    def rms(self, name: str) -> float:
        """Root mean square in the quantity's unit."""
        return float(np.sqrt(np.mean(np.square(self.errors[name]))) / SHOWN[name][0])

    def z(self, name: str) -> float:
        """Root mean square of the errors over what was told."""
        return float(np.sqrt(np.mean(np.square(self.errors[name] / self.sd[name]))))


def judge(procedure: Procedure, estimator: str, seeds: Sequence[int]) -> Judged:
    """Errors of an estimator at the end of each run."""
    parts = [tuple(seeds[i : i + TOGETHER]) for i in range(0, len(seeds), TOGETHER)]
    with ProcessPoolExecutor(PROCESSES) as pool:
        played = list(pool.map(partial(_judge, procedure, estimator), parts))
    return Judged(
        {name: np.concatenate([p.errors[name] for p in played]) for name in played[0].errors},
        {name: np.concatenate([p.sd[name] for p in played]) for name in played[0].sd},
        np.concatenate([p.time for p in played]),
    )


def _judge(procedure: Procedure, estimator: str, seeds: Sequence[int]) -> Judged:
    task = two_position(procedure.scenario, dict(procedure.changes))
    policy = find(POLICIES, procedure.policy)(task.datasheet, **dict(procedure.settings))
    # A policy that stops on the covariance is asked every step, one that goes by the clock once at the end.
    every = 1 if procedure.policy != "published_schedule" else task.steps + 1
    played = roll_out(task, policy, estimator, seeds, keep=False, every=every)
    assert played.estimate is not None
    truth = {name: played.truth[name] for name in ("installation_angle", "pitch", "roll")}
    # Clockwise from north, and the turn is counter-clockwise.
    truth["heading"] = played.truth["heading"] - procedure.turned
    truth |= {name: played.truth[f"{name}.bias.c"] for name in ("gyro_x", "gyro_y", "accel_x", "accel_y")}
    errors, sd = {}, {}
    for name, true in truth.items():
        mean, sd[name] = played.estimate.of(name)
        difference = mean - true
        circular = SHOWN[name][0] == ARCMIN
        errors[name] = np.angle(np.exp(1j * difference)) if circular else difference
    return Judged(errors, sd, played.time)
