"""A slow change of the bias beside a reference that the held-out rows alone do not bear out: said, and not named."""

from __future__ import annotations

import numpy as np
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Recording
from insenv.effects.catalogue import by_key
from insenv.identify.findings import TargetFindings

ROWS, DT, WHITE, SWING, PERIOD = 600, 0.1, 0.002, 1.5, 7.0
SLOW = tuple(by_key(key) for key in ("bias_drift", "bias_warm_up", "bias_step"))
#: A drift, and a step in the middle, of one standard deviation beside a level [rad/s].
DRIFT, STEP = WHITE * np.sqrt(12 / ROWS), WHITE * np.sqrt(4 / ROWS)


def said(rng: np.random.Generator, law: np.ndarray | float = 0.0, walk: float = 0.0) -> TargetFindings:
    """The loop on a gyro that swings for a minute, has a ``law`` in its bias and walks so far in a row [rad/s]."""
    angle = SWING * np.sin(2 * np.pi * DT / PERIOD * np.arange(ROWS + 1))
    noise = WHITE * rng.standard_normal(ROWS) + walk * np.cumsum(rng.standard_normal(ROWS))
    gyro = Channel(np.diff(angle) / DT + noise + law, "rad/s", "interval")
    run = Recording(DT * np.arange(1.0, ROWS + 1), {"gyro": gyro, "table_angle": Channel(angle[1:], "rad")}, label="a")
    (target,) = closed(run, manifest(), catalogue=SLOW).targets
    return target


def speaks(target: TargetFindings) -> bool:
    """Whether it is named, or said that it may be."""
    own = [reason for reason in target.reasons if reason.startswith("bias_")]
    assert not own or target.verdict not in ("effects-found", "nothing-significant")
    return bool(own or target.added)


def test_a_drift_of_eight_deviations_in_a_minute_is_not_passed_in_silence() -> None:
    """Nor a step. The search, which fits 60 % of that minute, passed nearly all of these in silence."""
    rng, t = np.random.default_rng(1), np.arange(ROWS) / ROWS
    found = [said(rng, law) for _ in range(3) for law in (8 * DRIFT * t, 8 * STEP * (t > 0.45))]
    assert sum(map(speaks, found)) >= 4


def test_noise_alone_is_not_said_to_drift() -> None:
    """White, or with a walk: where 1 % of each would be said to drift, two of six come in one of 700 such tests."""
    rng = np.random.default_rng(2)
    assert sum(speaks(said(rng, walk=walk)) for walk in (0.0, 1e-5) for _ in range(3)) <= 1
