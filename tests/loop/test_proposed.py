"""A profile that the loop proposes, played as a policy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimators.common.rate_policies import Proposed
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Limits
from insenv.core.recording import Recording
from insenv.core.units import DEG


def commands(profile: dict[str, Any], times: tuple[float, ...]) -> list[tuple[float, float]]:
    """Rates [deg/s] and whether to stop after so many seconds."""
    policy = Proposed(Datasheet(100.0, 300.0, limits=Limits(20 * DEG)), profile)
    found = [policy.act(policy.reset(), Recording(np.array([t]), {}))[0] for t in times]
    return [(round(float(rate) / DEG, 9), float(stop)) for rate, stop in found]


def test_a_reversal_is_played_as_it_is_proposed() -> None:
    profile = {"kind": "reversal", "rate": "10 deg/s", "dwell": "50 s"}
    assert commands(profile, (0.01, 49.9, 50.0, 99.9)) == [(10.0, 0.0), (10.0, 0.0), (-10.0, 0.0), (-10.0, 0.0)]
    assert commands(profile, (100.0,)) == [(-10.0, 1.0)]
    assert commands(profile | {"cycles": 2}, (100.0, 150.0, 200.0)) == [(10.0, 0.0), (-10.0, 0.0), (-10.0, 1.0)]


def test_a_staircase_is_played_as_it_is_proposed() -> None:
    profile = {"kind": "staircase", "rates": ["5 deg/s", "20 deg/s", "-5 deg/s"], "dwell": "1 min"}
    assert [rate for rate, _ in commands(profile, (0.0, 60.0, 120.0, 180.0))] == [5.0, 20.0, -5.0, -5.0]


def test_steps_are_played_as_they_are_proposed() -> None:
    profile = {"kind": "steps", "steps": [["60 s", "5 deg/s"], ["30 s", "0 deg/s"], ["1 min", "-5 deg/s"]]}
    assert [rate for rate, _ in commands(profile, (0.0, 60.0, 90.0))] == [5.0, 0.0, -5.0]
    assert commands(profile, (150.0,)) == [(-5.0, 1.0)]


@pytest.mark.parametrize(
    ("profile", "message"),
    [
        ({}, "kind None given, wanted reversal, staircase, steps"),
        ({"kind": "sine"}, "kind 'sine' given"),
        ({"kind": "reversal", "rate": "1 deg/s"}, "without 'dwell'"),
        ({"kind": "staircase", "dwell": "1 s"}, "without 'rates'"),
        ({"kind": "staircase", "rates": [], "dwell": "1 s"}, "0 rates for 0 s each"),
        ({"kind": "reversal", "rate": "1 deg/s", "dwell": "0 s"}, "2 rates for 0 s each"),
        ({"kind": "reversal", "rate": "1 m", "dwell": "1 s"}, 'profile: rate "1 m" is in m'),
        ({"kind": "reversal", "rate": "30 deg/s", "dwell": "1 s"}, "table rate of 30 deg/s given"),
    ],
)
def test_a_profile_that_cannot_be_played_is_refused(profile: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Proposed(Datasheet(100.0, 300.0, limits=Limits(20 * DEG)), profile)
