"""A gyro beside a reference whose rate is mostly noise: a tracker of a slow body, a compass that is wrong once a turn.

Seeds are fixed. A scale factor that is off by 4 deviations has the probability 6e-5 a case.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from simulated_runs import closed, manifest, use

from insenv.core.recording import Channel, Floats, Recording
from insenv.data.exposure import expose
from insenv.data.reference import with_reference
from insenv.effects.bias import Bias
from insenv.effects.rate.scale import ScaleFactor
from insenv.identify.clean.plausibility import implausible
from insenv.identify.findings import Estimate, TargetFindings
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Term
from insenv.identify.prepare.binned import binned
from insenv.identify.prepare.bounded import bounded

DT, GAIN = 0.01, 1.02


def on_a_rope(seed: int, wanders: float = 0.0) -> Recording:
    """A body that swings by half a turn in half a minute, beside a tracker with 4 mrad of noise a row.

    Metal near by bends its field, and its angle ``wanders`` within half a second [rad].
    """
    rng = np.random.default_rng(seed)
    t: Floats = DT * np.arange(12000, dtype=np.float64)
    parts = [(1.1, 31.0, 0.3), (0.35, 13.0, 1.2), (0.12, 7.0, 2.0)]
    angle = sum((a * np.sin(2 * np.pi * t / p + x) for a, p, x in parts), np.zeros_like(t))
    gyro = GAIN * np.gradient(angle, DT) - 4e-3 + 2e-3 * rng.standard_normal(len(t))
    bent = lfilter([0.2], [1.0, -0.98], rng.standard_normal(len(t)))
    seen = angle + 4e-3 * rng.standard_normal(len(t)) + wanders * bent
    channels = {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(seen, "rad", source="encoder")}
    return Recording(t, channels)


def scale(target: TargetFindings) -> Estimate:
    (found,) = [e for e in target.estimates_after if e.effect == "scale_factor"]
    return found


@pytest.mark.parametrize("rows", [10, 100, 400])
def test_motion_in_long_means_is_none_of_the_noise_at_an_instant(rows: int) -> None:
    """Of means of 4 s the rates are known to a milliradian, and at an instant to a tenth: no table stands there."""
    exposure = expose(with_reference(on_a_rope(1)), "gyro", rows)
    assert np.std(exposure.u - exposure.y / GAIN) < 0.2 * np.std(exposure.y)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_gain_beside_a_noisy_tracker_is_right(seed: int) -> None:
    (target,) = closed(on_a_rope(seed), manifest()).targets
    found = scale(target)
    assert abs(found.value - (GAIN - 1)) < 4 * found.sd < 0.2


def test_noise_may_not_stand_for_the_motion() -> None:
    """By means of 0.2 s, in which the tracker's errors are half of the motion, a walk of the noise is likelier."""
    told, model = manifest(), (Term(Bias()), Term(ScaleFactor()))
    problem = binned(told, (with_reference(on_a_rope(4, 0.02)),), (use(12000),), "gyro", 20)
    assert solve(problem, model).scale_factor < -0.8
    assert abs(solve(bounded(problem, model), model).scale_factor - (GAIN - 1)) < 0.2


def test_where_the_motion_is_read_nothing_is_bounded() -> None:
    problem = binned(manifest(), (with_reference(on_a_rope(4)),), (use(12000),), "gyro", 20)
    assert bounded(problem, (Term(Bias()), Term(ScaleFactor()))) is problem


def on_a_turntable(seed: int) -> Recording:
    """A telephone that turns once a minute beside a compass that is wrong by 0.4 rad once a turn, with noise."""
    rng = np.random.default_rng(seed)
    t: Floats = 0.03 * np.arange(16000, dtype=np.float64)
    angle = 0.107 * np.clip(t - 3, 0, None)
    gyro = np.gradient(angle, t) + 2e-3 * rng.standard_normal(len(t))
    seen = angle + 0.37 * np.cos(angle) + 0.02 * rng.standard_normal(len(t))
    channels = {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(seen, "rad", source="encoder")}
    return Recording(t, channels)


def test_a_gyro_that_turns_as_far_as_a_bad_compass_is_no_wrong_column() -> None:
    told = manifest()
    said = implausible(told, (with_reference(on_a_turntable(1)),))["gyro"]
    assert any("turns as far as the table" in text for text in said)


def test_a_gain_that_noise_of_the_reference_leaves_open_is_said_to_be() -> None:
    (target,) = closed(on_a_turntable(2), manifest()).targets
    found = scale(target)
    assert abs(found.value) < 3 * found.sd
    assert any("the gain is anything from" in text for text in target.reasons)


def test_a_table_at_one_rate_tells_no_gain_and_that_is_no_doubt() -> None:
    """Half an hour at 10 deg/s beside a good encoder was called a residual that is not noise, for its gain was open."""
    rng = np.random.default_rng(5)
    t: Floats = 0.1 * np.arange(18000, dtype=np.float64)
    rate = 0.1745 + 3e-7 * np.sin(t / 10)
    gyro = rate + 2e-5 * rng.standard_normal(len(t))
    seen = 0.1 * np.cumsum(rate) + 2e-6 * rng.standard_normal(len(t))
    channels = {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(seen, "rad", source="encoder")}
    (target,) = closed(Recording(t, channels), manifest()).targets
    assert target.reasons == ()
    assert abs(scale(target).value) < 3 * scale(target).sd and scale(target).sd > 0.3
