"""The pulse counter loses nothing, whatever the chunks, and its error is the effect ``quantization``."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.fft import dct
from scipy.stats import chi2

from insenv.core.recording import Floats
from insenv.effects.noise import Quantization
from insenv.sensors.counter import count


def increments(rows: int, n: int, seed: int, mean: float = 700.3, sd: float = 20.0) -> Floats:
    return mean + sd * np.random.default_rng(seed).standard_normal((rows, n))


def test_counts_are_differences_of_the_whole_part() -> None:
    values = increments(1, 50, 0, 0.4, 2.0)[0]
    counts, phase = count(values, 0.3)
    passed = 0.3 + np.cumsum(values)
    np.testing.assert_array_equal(counts, np.diff(np.floor(passed), prepend=0.0))
    assert phase == pytest.approx(passed[-1] % 1, abs=1e-12)
    assert counts.shape == (50,) and phase.shape == ()


@pytest.mark.parametrize("rows", [1, 3, 8, 11])  # by fours, and what is left
def test_chunks_and_rows_do_not_matter(rows: int) -> None:
    values, start = increments(rows, 500, 1), np.random.default_rng(2).random(rows)
    whole, end = count(values, start)
    first, between = count(values[:, :137], start)
    second, last = count(values[:, 137:], between)
    np.testing.assert_array_equal(np.concatenate([first, second], axis=-1), whole)
    np.testing.assert_array_equal(last, end)
    for i in range(rows):
        alone, phase = count(values[i], start[i])
        np.testing.assert_array_equal(alone, whole[i])
        assert phase == end[i]


def test_values_in_another_unit_are_counted_by_their_factor() -> None:
    values, start = increments(5, 50, 5), np.random.default_rng(6).random(5)
    whole, end = count(values * 0.37, start)
    counts, phase = count(values, start, 0.37)
    np.testing.assert_array_equal(counts, whole)
    np.testing.assert_array_equal(phase, end)


def test_what_is_given_stays_as_it_is() -> None:
    values, start = increments(2, 10, 3), np.array([0.2, 0.7])
    kept = values.copy(), start.copy()
    count(values, start)
    np.testing.assert_array_equal(values, kept[0])
    np.testing.assert_array_equal(start, kept[1])
    assert count(values[0], start)[0].shape == (2, 10)  # one angle, two counters


def test_no_pulse_is_lost_in_a_million_samples() -> None:
    values = increments(1, 1_000_000, 4)[0]
    counts, phase = count(values, 0.25)
    # Of rounding, each step has at most half a digit of a value below 1024: 6e-14.
    passed = np.sum(values.astype(np.longdouble)) + np.longdouble(0.25)
    assert abs(float(np.sum(counts.astype(np.longdouble)) + phase - passed)) < 1e-7


@given(st.lists(st.one_of(st.floats(-1e6, 1e6), st.floats(-1e-15, 1e-15)), min_size=1, max_size=30), st.floats(0, 0.99))
def test_the_part_that_is_left_is_less_than_a_pulse(values: list[float], phase: float) -> None:
    counts, left = count(np.array(values), phase)
    assert 0 <= left < 1
    np.testing.assert_array_equal(counts, np.rint(counts))


def test_with_a_random_start_the_error_has_no_mean() -> None:
    rows, values = 40_000, np.array([0.3, 12.45, -7.8, 0.01])
    counts, _ = count(values, np.random.default_rng(5).random(rows))
    passed = np.cumsum(values)
    error = np.cumsum(counts, axis=-1) - passed
    part = passed % 1
    deviation = np.sqrt(part * (1 - part) / rows)
    # Four means beyond 4 sigma: once in 4000 seeds.
    assert np.all(np.abs(error.mean(axis=0)) < 4 * deviation)


def test_the_error_has_the_spectrum_of_quantization() -> None:
    """Chi-square in bands of modes; false alarms: 12 bands, 1e-7 each. Uniform errors vary less than normal ones."""
    rows, n, dt, pulse = 48, 4096, 0.01, 2e-6
    values = increments(rows, n, 6)
    counts, _ = count(values, np.random.default_rng(7).random(rows))
    error = (counts - values) * pulse / dt
    k = np.arange(1, n)
    lam = 4 * np.sin(np.pi * k / (2 * n)) ** 2
    expected = pulse**2 / 12 * (Quantization().spectrum(lam, dt) + 4 / n * np.cos(np.pi * k / (2 * n)) ** 2 / dt**2)
    ratio = dct(error, type=2, norm="ortho", axis=-1)[:, 1:] ** 2 / expected
    bands = np.unique(np.geomspace(1, n - 1, 13).astype(int))
    for a, b in zip(bands[:-1], bands[1:], strict=True):
        assert 5e-8 < chi2.cdf(ratio[:, a - 1 : b - 1].sum(), rows * (b - a)) < 1 - 5e-8, (a, b)


def test_numba_is_imported_by_the_first_count_only() -> None:
    code = "import sys, insenv.sensors.counter, insenv.sensors.chain, insenv.rig; assert 'numba' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
