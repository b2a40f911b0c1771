"""Readings of a thermometer that are none are bridged and said; sound ones stand as they are."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from insenv.core.recording import Channel, Floats, Recording
from insenv.data.cells.thermometer import with_sound_temperature


def read(kelvins: Floats) -> Recording:
    channels = {"gyro": Channel(np.zeros(len(kelvins)), "rad/s"), "temperature": Channel(kelvins, "K")}
    return Recording(t=np.arange(0.0, 5.0 * len(kelvins), 5.0), channels=channels)


def cycle(step: float = 0.01, n: int = 3000) -> Floats:
    noise = 0.005 * np.random.default_rng(1).standard_normal(n)
    return 300 + np.round((10 * np.sin(2 * np.pi * np.arange(n) / 1100) + noise) / step) * step


@pytest.mark.parametrize("step", [0.01, 0.0625, 0.5])
def test_a_sound_thermometer_is_left_as_it_is(step: float) -> None:
    recording = read(cycle(step))
    assert with_sound_temperature(recording) is recording


def test_words_of_its_start_are_bridged_and_said() -> None:
    true = cycle()
    values = true.copy()
    values[[700, 1500, 1501]] = 358.15
    found = with_sound_temperature(read(values))
    assert np.abs(found.channels["temperature"].values - true).max() < 0.15
    assert "3 rows are no readings, first 85 degC in row 700" in found.notes[0]
    assert not found.left_out


def test_rows_at_which_it_stands_are_left_out() -> None:
    values = cycle()
    values[1000:1300] = values[1000]
    found = with_sound_temperature(read(values))
    assert_array_equal(np.flatnonzero(found.left_out["gyro"])[[0, -1]], [1000, 1299])
    assert "stands at" in found.notes[0] and "rows 1000 to 1299 are left out" in found.notes[0]


def test_a_soak_at_one_temperature_is_no_standing_reading() -> None:
    """It warms from where it stood, by the steps of the thermometer."""
    values = cycle(0.1)
    values = np.concatenate([np.full(800, values[0]), values])
    recording = read(values)
    assert with_sound_temperature(recording) is recording
