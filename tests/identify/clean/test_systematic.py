"""What is lost of one rate is a dwell or several visits, and not one event while the rate moves on."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.clean.systematic import lost_rates
from insenv.identify.findings import RejectedRows

ROW = 0.025


def table(rate: Floats) -> Recording:
    t = ROW * np.arange(len(rate), dtype=np.float64)
    return Recording(t, {"gyro": Channel(rate, "rad/s"), "table_rate": Channel(rate, "rad/s", source="encoder")})


def outliers(*spans: tuple[int, int]) -> tuple[RejectedRows, ...]:
    return tuple(RejectedRows("gyro", 0, a, b, "off the motion") for a, b in spans)


@pytest.mark.parametrize("start", [60, 140, 203])
def test_one_event_while_the_rate_moves_is_nothing_of_a_rate(start: int) -> None:
    """A unit is turned by hand: the rates that it passes in a second, and hardly elsewhere, are few rows each."""
    rng, t = np.random.default_rng(start), ROW * np.arange(280)
    moving = table(5 * np.sin(2 * np.pi * 0.9 * t + 1) + 3 * np.sin(2 * np.pi * 1.7 * t) + rng.standard_normal(280))
    assert lost_rates((moving,), "gyro", outliers((start, start + 40)), "outlier") == ()


def test_a_dwell_that_is_lost_is_and_so_is_a_rate_that_is_lost_at_every_visit() -> None:
    dwells = table(np.repeat([-2.0, -1.0, 0.5, 1.0, 2.0], 80))
    (rate,) = lost_rates((dwells,), "gyro", outliers((165, 235)), "outlier")
    assert rate == pytest.approx(0.5)
    ramps = table(np.tile(np.concatenate([np.linspace(-2, 2, 100), np.linspace(2, -2, 100)]), 3))
    through = np.flatnonzero(np.abs(ramps.channels["table_rate"].values - 1.0) < 0.06)
    visits = np.split(through, np.flatnonzero(np.diff(through) > 1) + 1)
    spans = [(int(v[0]), int(v[-1]) + 1) for v in visits]
    lost = lost_rates((ramps,), "gyro", outliers(*spans), "outlier")
    assert lost and lost == pytest.approx((1.0,) * len(lost), abs=0.1)
