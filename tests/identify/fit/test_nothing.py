"""A curve that is next to nothing on all data: a bell 27 widths beyond the last rate is 1e-161 there, and no column."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Recording, Site
from insenv.effects.catalogue import by_key
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Term
from insenv.identify.prepare.problems import prepare


@pytest.mark.parametrize("widths", [27.0, 29.0, 60.0])
def test_a_bell_far_from_every_rate_is_no_column(widths: float) -> None:
    """Its prior overflowed, and the fit of the noise ended in a traceback."""
    t = np.arange(1, 6001) / 50.0
    rate = np.sin(0.5 * t)
    gyro = rate + 1e-3 * np.random.default_rng(1).standard_normal(len(t))
    channels = {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(rate, "rad/s")}
    run = Recording(t, channels, site=Site(gravity=9.8), label="run")
    prepared = prepare(manifest(("gyro",), ("bias",)), (run,), (use(len(t)),), "gyro", tones=False, holds=False)
    bell = Term(by_key("scale_factor_anomaly"), (1.0 + 0.25 * widths, 0.25))
    fit = solve(prepared.problem, (*prepared.model, bell))
    assert np.isfinite(fit.theta).all() and np.isfinite(fit.noise.power).all()
    assert not np.any(fit.design.term == len(prepared.model))
