"""A reference whose rows are late in a cycle: the skew of means over a multiple of it depends on where they begin."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import manifest

from insenv.core.recording import Channel, Recording
from insenv.data.reference import with_reference
from insenv.data.split import split
from insenv.identify.findings import Estimate
from insenv.identify.fit.clocks import skew_of_means
from insenv.identify.prepare.declared import declared_model
from insenv.identify.prepare.means import begun_later

DT, N, LATE = 0.01, 6000, 5e-3


@pytest.mark.parametrize("cycle", [(0.0, 1e-3, 0.0, -1e-3), (0.0, 0.0, 0.0, 0.0)])
def test_means_of_a_whole_cycle_have_the_lag_of_the_place_where_they_begin(cycle: tuple[float, ...]) -> None:
    rng, t = np.random.default_rng(1), DT * np.arange(float(N))
    waves = [(a, f, p) for a, f, p in zip((0.6, 0.4, 0.3), (0.31, 0.74, 1.7), rng.uniform(0, 6, 3), strict=True)]
    gyro = np.sum([a * 2 * np.pi * f * np.cos(2 * np.pi * f * t + p) for a, f, p in waves], axis=0)
    shown = t - LATE - np.array(cycle)[np.arange(N) % 4]
    angle = np.sum([a * np.sin(2 * np.pi * f * shown + p) for a, f, p in waves], axis=0)
    gyro, angle = gyro + 0.02 * rng.standard_normal(N), angle + 2e-4 * rng.standard_normal(N)
    run = with_reference(Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(angle, "rad")}))
    read = manifest(declared=("bias", "scale_factor"))
    told = begun_later(read, (run,), split(read, (run,)), "gyro", 8, declared_model(read, (run,), "gyro"))
    # The instrument reads before the reference, later by as much as the rows are late at which a mean begins and ends.
    wanted = [-LATE - cycle[k] for k in (1, 2, 3, 1)]
    assert [skew for _, skew, _ in told] == pytest.approx(wanted, abs=0.5 * max(cycle) + 1e-4)
    own = Estimate("timing_skew", "c", -LATE, 1e-4, "s")
    added, word = skew_of_means([(rows * DT, skew, sd) for rows, skew, sd in told], 8 * DT, own)
    assert ("that begin elsewhere" in word) is (added > 0) is any(cycle)
