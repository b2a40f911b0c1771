"""The bound against simulated runs of efficient estimators, in all three environments."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from insenv.envs.rollout import roll_out
from insenv.evaluate.bounds import bounds
from insenv.evaluate.runs import task_of
from insenv.scenario import load

#: Deviations beyond which a ratio is a failure: 4.1 two-sided is 4e-5 each, 4e-4 for all nine figures.
FAR = 4.1
GLS = "estimators.rate_table.rate_gls:RateGls"
#: What is commanded changes with a step, and the bound is that of what was done: long steps are as good as short ones.
LONG = {"task.step": "5 s"}
DECLARED = {"undeclared": {}, "instrument.sampling": "20 Hz", "duration": "300 s", **LONG}
#: A sighting after each turn: of the tracking error, the mean of all counts.
SIGHTINGS = {"sight.readings": "turns", "instrument.sampling": "10 Hz", **LONG}
SIGHTLESS = {"sight.tracking": "0 arcsec", "sight.position_error": "0 m", "instrument.sampling": "10 Hz", **LONG}

#: Scenario, policy, estimator, changes, and what the estimator leaves unused by choice, at most.
CASES: dict[str, tuple[str, str, str, dict[str, Any], float]] = {
    "one way": ("north_finder/published", "constant_rate", "north_gls", LONG, 0.02),
    "both ways": ("north_finder/published", "bidirectional", "north_gls", LONG, 0.02),
    "noise A": ("two_position/published_a", "published_schedule", "two_position_joint", SIGHTLESS, 0.045),
    "noise A2": ("two_position/published_a2", "published_schedule", "two_position_joint", SIGHTLESS, 0.03),
    "noise B": ("two_position/published_b", "published_schedule", "two_position_joint", SIGHTLESS, 0.025),
    "two sightings": ("two_position/published_a", "published_schedule", "two_position_joint", SIGHTINGS, 0.02),
    "three sightings": ("two_position/published_b", "three_rests", "two_position_joint", SIGHTINGS, 0.03),
    "B-215": ("rate_table/b215", "optimal_ladder", GLS, DECLARED, 0.005),
    "KVH-13": ("rate_table/kvh13", "optimal_ladder", GLS, DECLARED, 0.005),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=str)
def test_an_efficient_estimator_errs_by_the_bound(case: str) -> None:
    scenario, policy, estimator, changes, lost = CASES[case]
    seeds = range(128 if estimator == GLS else 300)
    task = task_of(scenario, changes)
    (quantity,) = (q.name for q in task.quantities)
    one = roll_out(task, policy, None, seeds[:1]).recording(0)
    least = bounds(task.datasheet, one, (quantity,), load(scenario, changes))[quantity]
    errors, told = _errors(task, policy, estimator, seeds)
    rms = float(np.sqrt(np.mean(errors**2)))
    apart = FAR / np.sqrt(2 * len(seeds))
    assert 1 - apart < rms / least < (1 + lost) * (1 + apart)
    # What it tells of itself is a figure without chance, and no less than the bound.
    assert least * (1 - 1e-3) < told < least * (1 + lost)


def _errors(task: Any, policy: str, estimator: str, seeds: range) -> tuple[Any, float]:
    """Errors of the runs, and the root mean square of the deviations that are told."""
    (quantity,) = task.quantities
    run = roll_out(task, policy, estimator, seeds, keep=False, every=1_000_000)
    assert run.estimate is not None
    return run.errors[:, 0], float(np.sqrt(np.mean(run.estimate.of(quantity.name)[1] ** 2)))
