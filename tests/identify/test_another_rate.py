"""Laws of a measured rate that may be the reference's own: beside a gain that no gyro has, or as small as its errors.

Seeds are fixed; the cubic stands with more than 30 deviations of the noise.
"""

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Recording
from insenv.identify.assemble import findings
from insenv.identify.fit.uncertainty import estimates
from insenv.identify.loop import trace
from insenv.identify.search.settle import dropped, without_repeated
from insenv.identify.search.unfinished import nothing_as_well, unfinished

DT = 0.02


@pytest.mark.parametrize(("gain", "doubted"), [(0.52, True), (0.98, False)])
def test_a_law_of_the_rate_is_named_as_surely_as_the_reference_is_the_rate(gain: float, doubted: bool) -> None:
    rng = np.random.default_rng(5)
    t = DT * np.arange(6000.0)
    levels = np.repeat(rng.permutation(np.linspace(-1.5, 1.5, 24)), 250)
    rate = np.convolve(levels, np.ones(25) / 25, mode="same")
    angle = np.cumsum(rate) * DT + 2e-4 * rng.standard_normal(len(t))
    gyro = gain * (rate - 0.005 * rate**3) + 1e-3 * rng.standard_normal(len(t))
    channels = {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(angle, "rad", source="encoder")}
    runs, asked = (Recording(t, channels),), manifest(declared=("bias",))
    outcome = trace(asked, runs, (use(len(t)),))
    (target,) = findings(asked, runs, outcome).targets
    assert "scale_factor_cubic" in {one.effect for one in target.added}
    assert any("none of a gyro" in reason for reason in target.reasons) == doubted

    (track,) = outcome.tracks
    assert without_repeated(track) is track
    again = without_repeated(replace(track, steps=track.steps + track.steps))
    assert "scale_factor_cubic" not in {step.hit.candidate.effect.key for step in again.steps}
    told = [any("was added more than once" in why for why in unfinished(one, 0.01)) for one in (track, again)]
    assert told == [False, True]
    own = estimates(track.problem, track.fit)
    assert nothing_as_well(track, own) is None
    wide = {term: tuple(replace(row, sd=abs(row.value) / 1.9) for row in rows) for term, rows in own.items()}
    weak = nothing_as_well(track, wide)
    assert weak is not None
    left = track
    while weak is not None:
        left = dropped(left, *weak)
        weak = nothing_as_well(left, wide)
    assert not {"scale_factor", "scale_factor_cubic"} & {step.hit.candidate.effect.key for step in left.steps}
    weak = nothing_as_well(track, wide)
    assert weak is not None
    fewer = dropped(track, *weak)
    assert len(fewer.steps) == len(fewer.rivalries) == len(track.steps) - 1
    assert fewer.refusals[-1].unsized and "1.9 standard deviations from nothing" in fewer.refusals[-1].reason
