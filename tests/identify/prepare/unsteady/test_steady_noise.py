"""Rows of steady noise, of any spectrum, hold nothing that comes and goes: what is said by chance.

Generated with NumPy and SciPy, no effect of insenv; seeds are fixed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfilt

from insenv.core.recording import Floats
from insenv.identify.prepare.rows_left import step
from insenv.identify.prepare.unsteady.loud import loud
from insenv.identify.prepare.unsteady.moving import ridges
from insenv.identify.prepare.unsteady.spectrogram import RowsLeft, lengths, spectrogram, white
from insenv.identify.prepare.unsteady.told import unsteady

N, HZ = 8000, 100.0
Rng = np.random.Generator


def flicker(rng: Rng) -> Floats:
    """Noise of a spectrum 1 / f."""
    f = np.fft.rfftfreq(2 * N)
    wave = np.fft.rfft(rng.standard_normal(2 * N))
    wave[1:] /= np.sqrt(f[1:])
    wave[0] = 0.0
    return np.asarray(np.fft.irfft(wave)[:N])


def counted(rng: Rng) -> Floats:
    """Counts from row to row of a counter of the angle, at a steady rate."""
    return np.diff(np.floor(np.cumsum(0.4 * rng.standard_normal(N + 1) + 5.3)))


def low_pass(rng: Rng, order: int, cut: float) -> Floats:
    """White noise behind a filter of a chip that cuts at a share of half the sampling rate."""
    return np.asarray(sosfilt(butter(order, cut, output="sos"), rng.standard_normal(N + 500))[500:])


KINDS: dict[str, Callable[[Rng], Floats]] = {
    "white": lambda rng: rng.standard_normal(N),
    "beside a walk": lambda rng: rng.standard_normal(N) + 0.02 * np.cumsum(rng.standard_normal(N)),
    "walk": lambda rng: np.cumsum(rng.standard_normal(N)),
    "flicker": flicker,
    "rounded": lambda rng: np.round(rng.standard_normal(N) / 0.7),
    "hardly blurred": lambda rng: np.round(0.3 * rng.standard_normal(N) + 0.005 * np.cumsum(rng.standard_normal(N))),
    "filtered": lambda rng: low_pass(rng, 2, 0.2),
    "filtered steeply": lambda rng: low_pass(rng, 4, 0.08),
    "held for four rows": lambda rng: np.repeat(rng.standard_normal(N // 4), 4),
    "resonant": lambda rng: lfilter([1], [1, -2 * 0.97 * np.cos(0.9), 0.97**2], rng.standard_normal(N)),
    "of an angle": lambda rng: np.diff(rng.standard_normal(N + 1)),
    "of a counter": counted,
    "of heavy tails": lambda rng: rng.standard_t(4, N),
    "beside lines": lambda rng: (
        rng.standard_normal(N) + np.cos(1.456 * np.arange(N)) + 0.7 * np.cos(1.457 * np.arange(N) + 1)
    ),
}


def left(values: Floats) -> RowsLeft:
    return RowsLeft(0, 0.0, 1 / HZ, values, step=step(values))


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_said_of_steady_noise(kind: str) -> None:
    """At 1e-5 each: among 30 recordings of each of 14 kinds one is said of with a probability of 0.4 %."""
    rng = np.random.default_rng(1)
    assert [said for _ in range(30) if (said := unsteady((left(KINDS[kind](rng)),), 0.05))] == []


@pytest.mark.parametrize("kind", ["white", "flicker", "filtered", "of a counter"])
def test_probabilities_are_bounds(kind: str) -> None:
    """At 5 % in 60 recordings: more than 9 has a probability of 0.1 %; a bound, so fewer."""
    rng, found = np.random.default_rng(2), 0
    for _ in range(60):
        made = white(left(KINDS[kind](rng)))
        assert made is not None
        seen = [one for rows in lengths(len(made.rows)) if (one := spectrogram(made, rows, 0.0)) is not None]
        level = 0.05 / (2 * len(seen))
        found += any(loud(one, level) or ridges(one, level) for one in seen)
    assert found <= 9


def test_rows_that_stand_still_or_are_few_are_not_asked() -> None:
    assert unsteady((left(np.zeros(N)),), 0.05) == ()
    assert unsteady((left(np.arange(40.0)),), 0.05) == ()
    assert unsteady((), 0.05) == ()


def test_rows_that_are_missing_are_no_quiet_ones() -> None:
    """Half of them, in stretches of five seconds, for which straight lines stand."""
    rng = np.random.default_rng(3)
    missing = np.arange(N) % 1000 >= 500
    values = np.where(missing, 0.0, rng.standard_normal(N))
    bare = RowsLeft(0, 0.0, 1 / HZ, values)
    assert unsteady((bare,), 0.05) != ()
    assert unsteady((RowsLeft(0, 0.0, 1 / HZ, values, missing=missing),), 0.05) == ()
