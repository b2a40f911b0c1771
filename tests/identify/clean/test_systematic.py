"""What is lost of one rate is a dwell or several visits, and not one event while the rate moves on."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.clean.systematic import at_one_angle, lost_rates
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


def turning(rng: np.random.Generator) -> Recording:
    """A table that turns eight times to and fro at several rates, 40 s each."""
    rate = np.repeat([1.2, -0.8, 0.5, -1.0, 0.9, -0.6, 0.7, -0.9], 1600) + 1e-4 * rng.standard_normal(12_800)
    angle = np.cumsum(rate) * ROW
    t = ROW * np.arange(len(rate), dtype=np.float64)
    told = Channel(np.asarray(angle), "rad", source="encoder")
    return Recording(t, {"gyro": Channel(np.asarray(rate), "rad/s"), "table_angle": told})


def test_outliers_at_one_angle_of_the_table_are_its_encoders() -> None:
    """One in each turn is; anywhere they are not: by chance in one of 10^4 tests."""
    rng = np.random.default_rng(1)
    recording = turning(rng)
    turn = np.mod(recording.channels["table_angle"].values, 2 * np.pi)
    marks = np.flatnonzero((turn[:-1] < 2.0) & (turn[1:] >= 2.0)).tolist()
    assert len(marks) > 8
    assert at_one_angle((recording,), outliers(*((k, k + 3) for k in marks)))
    # A means' width on either side is left out with each: it begins 0.4 rad before the mark, whichever way that is.
    assert at_one_angle((recording,), outliers(*((k - 15, k + 15) for k in marks)))
    anywhere = np.sort(rng.choice(12_000, len(marks), replace=False)).tolist()
    assert not at_one_angle((recording,), outliers(*((k, k + 3) for k in anywhere)))


def test_outliers_where_a_table_turns_back_are_none_of_its_encoder() -> None:
    """It turns back at the same angle again and again: that is the motion."""
    rate = np.tile(np.repeat([1.0, -1.0], 400), 10)
    t = ROW * np.arange(len(rate), dtype=np.float64)
    told = Channel(np.asarray(np.cumsum(rate) * ROW), "rad", source="encoder")
    recording = Recording(t, {"gyro": Channel(rate, "rad/s"), "table_angle": told})
    assert not at_one_angle((recording,), outliers(*((k, k + 2) for k in range(400, 7600, 800))))
