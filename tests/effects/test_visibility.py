"""A large effect is never less visible than a small one: a ladder over strength for the effects of a single gyro.

Each stands in a recording that is generic for it, once found at a signal-to-noise ratio of 12, then ten and a thousand
times as strong. It must be named, or stand among the rivals of what is named, at every strength. Seeds are fixed, so
nothing here is random; that a weak effect is named at all is the business of other tests.
"""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import declared_for, manifest, use, with_effects

from insenv.effects.catalogue import CATALOGUE
from insenv.identify.loop import trace

#: Effect, kind of run, parameters of which the first is scaled.
LADDERS: tuple[tuple[str, str, tuple[float, ...]], ...] = (
    ("bias_drift", "rest", (1.0,)),
    ("bias_warm_up", "rest", (1.0, 200.0)),
    ("bias_step", "rest", (1.0, 700.0)),
    ("bias_temperature:1", "rest", (1.0,)),
    ("bias_temperature_rate", "rest", (1.0,)),
    ("bias_thermal_lag", "rest", (1.0, 150.0)),
    ("bias_thermal_hysteresis", "rest", (1.0, 0.5)),
    ("scale_factor_drift", "staircase", (1.0,)),
    ("scale_factor_warm_up", "staircase", (1.0, 200.0)),
    ("scale_factor_temperature", "staircase", (1.0,)),
    ("scale_factor_asymmetry", "staircase", (1.0,)),
    ("scale_factor_cubic", "staircase", (1.0,)),
    ("encoder_harmonic:1", "staircase", (1.0, 0.5)),
    ("encoder_harmonic:2", "staircase", (1.0, 0.5)),
    ("angle_locked_rate:1", "staircase", (1.0, 0.5)),
    ("angle_locked_rate:2", "staircase", (1.0, 0.5)),
    ("timing_skew", "sine", (1.0,)),
    ("lock_in", "sine", (1e-9,)),
    ("tone", "rest", (1.0, 0.5, 0.05)),
)


#: Length of a run [s]; a step is told from a walk by what is long before and after it.
DURATION = {"bias_step": 1800.0}


@pytest.mark.slow
@pytest.mark.parametrize(("key", "kind", "theta"), LADDERS, ids=[row[0] for row in LADDERS])
def test_what_is_found_is_found_at_every_larger_strength(key: str, kind: str, theta: tuple[float, ...]) -> None:
    for snr in (12.0, 120.0, 12000.0):
        run, _ = with_effects(kind, 7, ((key, np.array(theta)),), snr, DURATION.get(key, 900.0))
        asked = manifest(declared=declared_for(run.recording), averaging=1.0)
        (track,) = trace(asked, (run.recording,), (use(len(run.recording)),), CATALOGUE).tracks
        named = {step.hit.candidate.effect.key for step in track.steps}
        named |= {rival for one in track.rivalries for rival in one.keys}
        assert key in named or key.partition(":")[0] in named, f"strength {snr:g}"
