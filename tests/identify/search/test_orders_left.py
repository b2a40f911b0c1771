"""Waves of the table's angle of any order: those that the catalogue foresees end at four a turn."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from scipy.signal import lfilter
from simulated_runs import closed

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.findings import TargetFindings

N, DT, ORDER = 12_000, 0.02, 7
#: Noise of a row [rad/s], and the wave in the encoder [rad] and in the gyro [rad/s].
WHITE, IN_ENCODER, IN_GYRO = 2e-4, 1e-5, 5e-5


def turned(programme: str) -> Floats:
    """The angle of a table after each row [rad]: at rest and one rate, at two, or swinging over two turns."""
    t = DT * np.arange(N + 1.0)
    if programme == "swing":
        return np.asarray(6.3 * np.sin(2 * np.pi * t / 40))
    if programme == "two rates":
        return np.asarray(0.3 * t + 0.4 * np.maximum(t - 100, 0))
    return np.asarray(0.5 * np.maximum(t - 20, 0))


def said(
    reading: Floats, angle: Floats, seed: int, source: Literal["encoder", "command"] = "encoder"
) -> TargetFindings:
    """The loop on the mean rates of a gyro beside the angles of a table."""
    noisy = reading + WHITE * np.random.default_rng(seed).standard_normal(N)
    told = Channel(angle[1:], "rad", source=source)
    channels = {"gyro": Channel(noisy, "rad/s", "interval"), "table_angle": told}
    (found,) = closed(Recording(DT * np.arange(1.0, N + 1), channels, label="a")).targets
    return found


def names(found: TargetFindings) -> list[str]:
    return [f"{one.effect}:{one.order}" for one in found.added]


@pytest.mark.parametrize("programme", ["two rates", "swing"])
def test_a_wave_of_the_encoder_has_its_order(programme: str) -> None:
    """Coefficients within five deviations: one of them is not in 1 of 10^6 tests."""
    angle = turned(programme)
    found = said(np.diff(angle) / DT, angle - IN_ENCODER * np.cos(ORDER * angle), 1)
    assert names(found) == [f"encoder_harmonic:{ORDER}"]
    for row, true in zip(found.added[0].parameters, (IN_ENCODER, 0.0), strict=True):
        assert abs(row.value - true) < 5 * row.sd


@pytest.mark.parametrize("programme", ["two rates", "swing"])
def test_a_rate_that_goes_with_the_angle_has_its_order(programme: str) -> None:
    angle = turned(programme)
    wave = IN_GYRO * np.sin(ORDER * 0.5 * (angle[1:] + angle[:-1]))
    found = said(np.diff(angle) / DT + wave, angle, 2)
    assert names(found) == [f"angle_locked_rate:{ORDER}"]
    for row, true in zip(found.added[0].parameters, (0.0, IN_GYRO), strict=True):
        assert abs(row.value - true) < 5 * row.sd


def test_at_one_rate_nobody_tells_the_two() -> None:
    angle = turned("one rate")
    found = said(np.diff(angle) / DT, angle - IN_ENCODER * np.cos(ORDER * angle), 3)
    both = {f"encoder_harmonic:{ORDER}", f"angle_locked_rate:{ORDER}"}
    assert found.verdict == "confounded"
    assert both <= {*names(found), *found.added[0].confounded_with}


def test_behind_a_command_it_is_the_motor() -> None:
    """The table turns so, and nobody told it to."""
    angle = turned("two rates")
    ripple = IN_ENCODER * np.cos(ORDER * angle)
    found = said(np.diff(angle + ripple) / DT, angle, 4, source="command")
    assert not any(f":{ORDER}" in name for name in names(found))


def test_a_ripple_that_both_see_is_no_wave_of_a_filtered_encoder() -> None:
    """Ten times as large as what is left of it behind a filter of 30 ms."""
    plain = turned("two rates")
    angle = plain + 20 * IN_ENCODER * np.cos(ORDER * plain)
    share = float(np.exp(-DT / 0.03))
    late = lfilter([1 - share], [1, -share], angle - angle[0]) + angle[0]
    found = said(np.diff(angle) / DT, np.asarray(late), 5)
    assert not any(name.startswith("encoder_harmonic") for name in names(found))


def test_a_place_in_the_turn_takes_as_many_waves_as_were_tried_and_is_said_to_be_one() -> None:
    """A magnet beside the table: half a radian of each turn."""
    angle = turned("two rates")
    middle = 0.5 * (angle[1:] + angle[:-1])
    place = 3e-4 * np.exp(-0.5 * (np.angle(np.exp(1j * (middle - 2.0))) / 0.4) ** 2)
    found = said(np.diff(angle) / DT + place, angle, 5)
    assert {f"angle_locked_rate:{k}" for k in (1, 2, 3, 4)} <= set(names(found))
    assert found.verdict == "effects-found-incomplete"
    assert any("one curve of it that is no wave" in reason for reason in found.reasons)
