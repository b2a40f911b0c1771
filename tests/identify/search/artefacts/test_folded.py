"""A wave of the table's angle faster than the means can follow: no slower one is named for it.

At 200 deg/s and 10 Hz a turn has 18 rows and nine means of two: order 11, a motor's poles, is order 2 of the means.
Seeds are fixed; of the wave in the means ten deviations are asked where there are fifty.
"""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Floats, Recording
from insenv.data.reference import with_reference
from insenv.effects.angle import AngleLockedRate, EncoderHarmonic
from insenv.effects.base import LinearEffect
from insenv.effects.bias import Bias
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Term
from insenv.identify.prepare.binned import binned
from insenv.identify.search.artefacts.folded import folded

DT, N, RATE = 0.1, 3000, np.deg2rad(200.0)


def waving(order: int, seed: int) -> Recording:
    """A gyro on a table at a steady rate, with a wave of its angle and 0.2 deg/s of noise a row."""
    rng = np.random.default_rng(seed)
    t: Floats = DT * np.arange(float(N))
    rate = np.full(N, RATE)
    angle = RATE * t
    wave = np.deg2rad(0.3) * np.cos(order * (angle - 0.5 * RATE * DT))
    gyro = 1.001 * rate + 0.01 + wave + np.deg2rad(0.2) * rng.standard_normal(N)
    channels = {
        "gyro": Channel(gyro, "rad/s", "interval"),
        "table_angle": Channel(angle, "rad"),
        "table_rate": Channel(rate, "rad/s", "interval"),
    }
    return Recording(t, channels)


@pytest.mark.parametrize(("order", "faster"), [(2, False), (11, True)])
@pytest.mark.parametrize("wave", [AngleLockedRate(2), EncoderHarmonic(2)])
def test_a_faster_wave_is_no_slower_one(order: int, faster: bool, wave: LinearEffect) -> None:
    """The means have order 2 either way."""
    run = with_reference(waving(order, 1))
    problem = binned(manifest(), (run,), (use(len(run)),), "gyro", 2)
    fit = solve(problem, (Term(Bias()), Term(wave)))
    own = fit.design.term == 1
    assert np.max(np.abs(fit.theta[own]) / fit.sd[own]) > 10
    assert ("folded by the means" in folded(problem, fit)) == faster


def test_means_of_one_row_fold_nothing() -> None:
    run = with_reference(waving(11, 1))
    problem = binned(manifest(), (run,), (use(len(run)),), "gyro", 1)
    assert not folded(problem, solve(problem, (Term(Bias()), Term(AngleLockedRate(2)))))
