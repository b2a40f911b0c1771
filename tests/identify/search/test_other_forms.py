"""A local fault of another form than the one that was fitted: what its wings do to the scale factor is in its sd."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from simulated_runs import DEG_PER_HOUR, closed

from insenv.core.recording import Channel, Recording

N, DT = 18_000, 0.2
T = DT * np.arange(1.0, N + 1)


@cache
def scale_factor(form: str) -> tuple[float, float]:
    """Error of the scale factor in its standard deviations, and that deviation, beside a fault at 20 deg/s."""
    rate = np.deg2rad(60) * np.sin(2 * np.pi * T / 300)
    off = (np.abs(rate) - np.deg2rad(20)) / np.deg2rad(4)
    fault = np.sign(rate) * (1 / (1 + off**2) if form == "wings" else np.exp(-0.5 * off**2))
    noise = 2.0 * DEG_PER_HOUR * np.random.default_rng(5).standard_normal(N)
    channels = {
        "gyro": Channel(rate + 3 * DEG_PER_HOUR * fault + noise, "rad/s", "interval"),
        "table_rate": Channel(rate, "rad/s", "interval"),
        "table_angle": Channel(np.cumsum(rate) * DT, "rad"),
    }
    found = closed(Recording(T, channels)).targets[0]
    assert "scale_factor_anomaly" in {a.effect for a in found.added}
    (own,) = (e for e in found.estimates_after if e.effect == "scale_factor")
    return own.value / own.sd, own.sd


@pytest.mark.parametrize("form", ["wings", "bump"])
def test_the_deviation_of_the_scale_factor_knows_of_the_form(form: str) -> None:
    # Four standard deviations: by chance in one of 16 000 tests. Without the other form the wings are some ten.
    assert abs(scale_factor(form)[0]) < 4.0


def test_where_the_form_is_plain_little_is_added() -> None:
    assert scale_factor("bump")[1] < 0.5 * scale_factor("wings")[1]
