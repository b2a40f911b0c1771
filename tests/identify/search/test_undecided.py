"""A law at rest and the walk of the noise that stands for it: where the law is likelier, both are named as a set."""

from __future__ import annotations

import numpy as np
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Recording, Site
from insenv.effects.catalogue import by_key
from insenv.identify.findings import TargetFindings

ROWS, WHITE = 900, 0.002
SLOW = tuple(by_key(key) for key in ("bias_drift", "bias_warm_up", "bias_step"))


def said(seed: int, drift: float, walk: float = 0.0) -> TargetFindings:
    """The loop on a gyro at rest for a quarter of an hour that drifts by so much [rad/s] and walks so far in a row."""
    rng = np.random.default_rng(seed)
    t = np.arange(1.0, ROWS + 1)
    values = WHITE * rng.standard_normal(ROWS) + walk * np.cumsum(rng.standard_normal(ROWS)) + drift * t / ROWS
    run = Recording(t, {"gyro_x": Channel(values, "rad/s")}, site=Site(gravity=9.8), label="rest")
    (target,) = closed(run, manifest(("gyro_x",), ("bias",)), catalogue=SLOW).targets
    return target


def test_a_drift_that_a_walk_takes_in_is_a_set_with_it() -> None:
    """Of 6.5 deviations of white noise: fitted rows alone tell it from a walk in none of these."""
    found = [said(seed, 0.0015) for seed in range(12)]
    named = [target for target in found if target.added]
    assert len(named) >= 6
    for target in named:
        (added,) = target.added
        assert added.effect in ("bias_drift", "bias_warm_up")
        assert "rate_random_walk" in added.confounded_with
        assert target.verdict == "confounded"


def test_a_walk_is_hardly_ever_called_a_law() -> None:
    """And where it is, it is so in a set with the walk in it."""
    found = [said(seed, 0.0, walk) for seed in range(12) for walk in (1e-5, 2e-5)]
    named = [target for target in found if target.added]
    assert len(named) <= 2
    assert all(target.verdict == "confounded" for target in named)
