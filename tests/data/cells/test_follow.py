"""The rate behind an encoder that jitters: nothing of the jitter, all of the motion."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from insenv.core.recording import Floats
from insenv.data.cells.follow import correlation, followed, follows

N, DT, JITTER = 8000, 0.1, 1e-5


def read(rate: Floats, rng: np.random.Generator) -> Floats:
    """Rates differenced from an angle with white errors."""
    return np.diff(np.concatenate([[0.0], np.cumsum(rate) * DT]) + JITTER * rng.standard_normal(N + 1)) / DT


def eased(rate: Floats) -> Floats:
    return np.convolve(np.pad(rate, 5, mode="edge"), np.full(11, 1 / 11), mode="valid")


PROFILES = {
    "rest": np.zeros(N),
    "constant": np.full(N, 0.3),
    "staircase": eased(np.repeat(np.linspace(-1, 1, 20), N // 20)),
}


@pytest.mark.parametrize("name", PROFILES)
def test_jitter_is_averaged_away_and_steps_stay(name: str) -> None:
    rate, rng = PROFILES[name], np.random.default_rng(1)
    seen = followed(read(rate, rng), rate + 1e-4 * rng.standard_normal(N), np.ones(N, bool), "angle")
    error, raw = np.abs(seen - rate), JITTER * np.sqrt(2) / DT
    assert np.median(error) < 0.02 * raw
    assert np.sqrt(np.mean(error**2)) < 0.3 * raw


@pytest.mark.parametrize("of", ["angle", "rate"])
def test_a_rate_without_jitter_is_left_as_it_is(of: str) -> None:
    rate = PROFILES["staircase"]
    np.testing.assert_array_equal(followed(rate, rate, np.ones(N, bool), of), rate)  # type: ignore[arg-type]


def test_a_slow_sine_is_followed_within_its_jitter() -> None:
    rate, rng = 0.5 * np.sin(2 * np.pi * np.arange(N) * DT / 60), np.random.default_rng(2)
    seen = followed(read(rate, rng), rate, np.ones(N, bool), "angle")
    assert np.abs(seen - rate).max() < 8 * JITTER * np.sqrt(2) / DT


@pytest.mark.parametrize("stop", [3, 8])
def test_a_table_that_stops_for_a_few_samples_stands_there(stop: int) -> None:
    """Ramps that last longer than the stops between them: their third differences are motion, and hide no jitter."""
    rng = np.random.default_rng(4)
    ramp = np.linspace(0.0, 1.0, 8)[1:-1]
    piece = np.concatenate([np.zeros(stop), ramp, np.full(12, 1.0), ramp[::-1]])
    rate = np.resize(piece, N)
    seen = followed(read(rate, rng), rate + 1e-4 * rng.standard_normal(N), np.ones(N, bool), "angle")
    standing = (rate == 0) & (np.arange(N) > 40) & (np.arange(N) < N - 40)
    assert np.mean(seen[standing] == 0) > 0.9
    assert np.abs(seen - rate).max() < 8 * JITTER * np.sqrt(2) / DT


def test_motion_that_the_instrument_follows_is_no_jitter() -> None:
    """A table that shakes at a fifth of the sampling rate, and a gyro that shakes with it."""
    rate, rng = 0.05 * np.sin(2 * np.pi * np.arange(N) * DT / 0.5), np.random.default_rng(3)
    angle = read(rate, rng)
    np.testing.assert_array_equal(followed(angle, rate + 1e-3, np.ones(N, bool), "angle"), angle)
    still = followed(angle, np.zeros(N), np.ones(N, bool), "angle")
    assert np.std(still) < 0.2 * np.std(angle)


@pytest.mark.parametrize(("late", "gain"), [(0.87, -1.0), (3.0, 1.0), (0.0, 0.45), (-1.5, -0.9)])
def test_motion_is_no_jitter_though_the_instrument_is_late_or_reversed(late: float, gain: float) -> None:
    """Turned by hand and read coarsely: a row of 40 ms is a quarter of a period of the fastest part."""
    rng = np.random.default_rng(5)
    rows = np.arange(4000.0)
    waves = [(rng.uniform(0.005, 0.12), rng.uniform(0, 6.3), rng.uniform(0.2, 1.0)) for _ in range(40)]

    def turned(at: Floats) -> Floats:
        return np.asarray(sum(size * np.sin(2 * np.pi * f * at + phase) for f, phase, size in waves))

    rate, reading = turned(rows), gain * turned(rows - late) + 0.01 * rng.standard_normal(rows.size)
    seen = followed(rate, reading, np.ones(rows.size, bool), "rate")
    assert np.std(seen - rate) < 0.01 * np.std(rate)


def test_an_instrument_that_stands_still_follows_no_jitter_however_it_is_shifted() -> None:
    rng = np.random.default_rng(6)
    angle = read(PROFILES["constant"], rng)
    seen = followed(angle, 1e-4 * rng.standard_normal(N), np.ones(N, bool), "angle")
    assert np.std(seen) < 0.1 * np.std(angle)


def test_rows_that_are_lost_make_no_peak_where_nothing_is_shifted() -> None:
    """A table that holds its rate for long and a reading 6 rows early; 24 rows were left out, at no shift from both.

    Of a smooth motion without noise: no false alarm.
    """
    rows = np.arange(6000.0)
    rate = 2.0 + np.tanh((rows - 2000.0) / 30.0) - 1.5 * np.tanh((rows - 4000.0) / 30.0)
    known = np.ones(rows.size)
    known[np.random.default_rng(7).integers(0, rows.size, 24)] = 0.0
    both, power = correlation(rate, np.interp(rows + 6.0, rows, rate), known, 40)
    assert int(np.argmax(both**2 / power)) - 40 == -6


def test_one_rate_tells_no_shift_and_no_ratio() -> None:
    """An encoder's rate of one value but for rounding where rows were left out: the ratio was a division by nothing."""
    rate, known, reading = np.full(N, 0.5), np.ones(N, bool), np.zeros(N)
    rate[4000], known[4000], reading[4001] = 0.5 + 3.5e-12, False, 1.0
    assert not follows(rate, rate - 1e-3, reading, known)


@pytest.mark.parametrize("behind", [0.3, 0.6, 0.8])
def test_motion_behind_a_filter_of_the_instrument_is_no_jitter(behind: float) -> None:
    """A body that shakes from row to row, its reading and what a filter of first order leaves of it."""
    rng = np.random.default_rng(8)
    change = rng.standard_normal(N)
    reading = lfilter([1 - behind], [1, -behind], change)
    known = np.ones(N, bool)
    assert follows(change, np.zeros(N), reading, known)
    assert not follows(change, np.zeros(N), lfilter([1 - behind], [1, -behind], rng.standard_normal(N)), known)
    assert not follows(change, np.zeros(N), reading + 0.5 * rng.standard_normal(N), known)
