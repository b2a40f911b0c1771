"""An undeclared eccentricity of the encoder: confounded one way, found by the reversal that is proposed.

Played by scripts/north_finder_undeclared.py, as a user would.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import gymnasium
import numpy as np
import pytest

from estimators.rate_policies import Proposed
from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Limits
from insenv.core.recording import Recording
from insenv.core.units import ARCSEC, DEG
from insenv.envs.recorder import Recorder

SCRIPT = Path(__file__).parents[1] / "scripts" / "north_finder_undeclared.py"


@pytest.fixture(scope="module")
def story() -> ModuleType:
    spec = importlib.util.spec_from_file_location(SCRIPT.stem, SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look it up
    spec.loader.exec_module(module)
    return module


def shift() -> float:
    """North error of one direction [arcsec]: 2 arcsec at 10 deg/s, at 45 deg to the horizontal Earth rate."""
    level = EARTH_RATE * np.cos(40 * DEG) * np.cos(30 * DEG)
    added = 2 * ARCSEC * 10 * DEG * np.sin(30 * DEG) * np.exp(1j * np.pi / 4)
    return float(np.angle(level + added) / ARCSEC)


LATER = [pytest.param(seed, marks=pytest.mark.slow) for seed in (12, 13)]


# North is within 4 standard deviations before (of where the eccentricity puts it) and after: false alarm 2 x 6e-5 a
# seed. Where nothing but the eccentricity is wrong the search calls the residual explained in 7 of 8 runs; in the
# others, none of these seeds, the verdict is that something may be left.
@pytest.mark.parametrize("seed", [11, *LATER])
def test_the_reversal_that_is_proposed_finds_it(seed: int, story: ModuleType, capsys: Any) -> None:
    env = Recorder(gymnasium.make("insenv/NorthFinder-v0", scenario=story.SCENARIO))
    one, two = story.tell(env, seed)

    assert one.found.verdict == "confounded"
    (added,) = one.gyro.added
    assert (added.effect, added.order, added.confounded_with) == ("encoder_harmonic", 1, ("angle_locked_rate:1",))
    proposed = one.gyro.next_experiment[0]
    assert proposed.separates == ("encoder_harmonic:1", "angle_locked_rate:1")
    assert proposed.profile is not None and proposed.profile["kind"] == "reversal"
    (wrong, sure), (still, doubtful) = one.errors()
    assert 30 < sure < 50 and wrong == pytest.approx(shift(), abs=4 * sure)
    assert abs(shift()) > 2400
    # What it cannot know it does not pretend to know.
    assert abs(still) < doubtful and doubtful > 2000

    assert two.found.verdict == "effects-found"
    (added,) = two.gyro.added
    assert (added.effect, added.order, added.confounded_with) == ("encoder_harmonic", 1, ())
    _, (right, sd) = two.errors()
    assert sd < 100 and abs(right) < 4 * sd
    truth = {"c": -1.8793852, "s": -0.6840403}
    for estimate in added.parameters:
        assert abs(estimate.value / ARCSEC - truth[estimate.parameter]) < 5 * estimate.sd / ARCSEC
        assert estimate.sd < 0.1 * ARCSEC

    text = capsys.readouterr().out
    assert f"North error before: {wrong:.0f} arcsec" in text and f"North error after: {right:.0f} arcsec" in text
    assert "Verdict: confounded." in text and "Verdict: effects-found." in text


# --- a policy from a profile


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


@pytest.mark.parametrize(
    ("profile", "message"),
    [
        ({}, "kind None given, wanted reversal or staircase"),
        ({"kind": "sine"}, "kind 'sine' given"),
        ({"kind": "reversal", "rate": "1 deg/s"}, "without 'dwell'"),
        ({"kind": "staircase", "dwell": "1 s"}, "without 'rates'"),
        ({"kind": "staircase", "rates": [], "dwell": "1 s"}, "0 rates for 1 s each"),
        ({"kind": "reversal", "rate": "1 deg/s", "dwell": "0 s"}, "2 rates for 0 s each"),
        ({"kind": "reversal", "rate": "1 m", "dwell": "1 s"}, 'profile: rate "1 m" is in m'),
        ({"kind": "reversal", "rate": "30 deg/s", "dwell": "1 s"}, "table rate of 30 deg/s given"),
    ],
)
def test_a_profile_that_cannot_be_played_is_refused(profile: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Proposed(Datasheet(100.0, 300.0, limits=Limits(20 * DEG)), profile)
