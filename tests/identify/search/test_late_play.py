"""Play of the encoder, and hysteresis of the scale factor, are told beside a reference that comes late.

Both were not tried there: the phase of a lag has their sign, but not their form, and is in the model. Recordings are
simulated without insenv (`studies.hand_turned`) or made here; seeds are fixed.
"""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import manifest, use
from studies.hand_turned import case

from insenv.core.recording import Channel, Floats, Recording
from insenv.effects.catalogue import CATALOGUE
from insenv.identify.loop import trace
from insenv.identify.search.tracks import Track

SKEWED = manifest(declared=("bias", "scale_factor", "timing_skew"))


def followed(x: Floats, gap: float) -> Floats:
    """What is moved by ``x`` through a gap of that half width."""
    at, out = float(x[0]), np.empty_like(x)
    for k, value in enumerate(x):
        at = min(max(at, value - gap), value + gap)
        out[k] = at
    return out


def named(track: Track) -> dict[str, float]:
    keys = [label[0] for label in track.fit.design.labels]
    added = {step.hit.candidate.effect.key for step in track.steps}
    return {key: float(track.fit.theta[keys.index(key)]) for key in added}


def hand(seed: int, gap: float) -> Track:
    one = case(seed, "clean", "hand", 60.0, row=0.02)
    angle = followed(one.angle, gap) if gap else one.angle
    channels = {"gyro": Channel(one.gyro, "rad/s", "interval"), "table_angle": Channel(angle, "rad", source="encoder")}
    (track,) = trace(SKEWED, (Recording(one.t, channels),), (use(len(one.t)),), CATALOGUE).tracks
    assert track.problem.exposures[0].motion.lag
    return track


@pytest.mark.parametrize("seed", range(2))
def test_backlash_is_told_beside_a_late_reference(seed: int) -> None:
    found = named(hand(seed, 0.02))
    assert found["encoder_backlash"] == pytest.approx(0.02, rel=0.5)


@pytest.mark.parametrize("seed", range(3))
def test_a_late_reference_has_no_play(seed: int) -> None:
    assert not {"encoder_backlash", "scale_factor_hysteresis"} & set(named(hand(seed, 0.0)))


@pytest.mark.parametrize("seed", range(2))
def test_hysteresis_is_told_beside_a_late_reference(seed: int) -> None:
    """A vehicle whose rate goes from one plateau to the next; its reference comes 60 ms late and has noise."""
    rng = np.random.default_rng(seed)
    dt, n = 0.02, 6000
    t: Floats = dt * np.arange(n, dtype=np.float64)
    steps = np.repeat(rng.uniform(-1.0, 1.0, n // 100), 100)
    u = np.convolve(np.pad(steps, (25, 25), mode="edge"), np.ones(51) / 51, mode="valid")
    gyro = 0.01 + followed(u, 0.04) + 2e-3 * rng.standard_normal(n)
    late = np.interp(t - 0.06, t, u) + 2e-3 * rng.standard_normal(n)
    one = Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(late, "rad/s", source="encoder")})
    (track,) = trace(SKEWED, (one,), (use(n),), CATALOGUE).tracks
    assert track.problem.exposures[0].motion.lag
    found = named(track)
    assert abs(found["scale_factor_hysteresis"]) == pytest.approx(0.04, rel=0.3)
