"""A reference with errors of its own tells slow motion well, and fast motion not: bins are as long as that."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from insenv.core.recording import Channel, Floats, Origin, Recording
from insenv.data.reference import with_reference
from insenv.identify.clean.doubtful import rows_told

DT, N = 0.01, 9000
SPAN = (slice(0, N),)


def low(top: float, seed: int) -> Floats:
    """Noise below ``top`` Hz of unit variance."""
    x = sosfilt(butter(2, top, fs=1 / DT, output="sos"), np.random.default_rng(seed).standard_normal(N))
    return np.asarray(x / x.std())


def beside(error: Floats, noise: float = 1e-4, source: Origin = "encoder") -> Recording:
    """A gyro that reads the rate of a hand, beside a reference of the angle with errors."""
    rng = np.random.default_rng(7)
    rate = low(0.7, 1)
    angle = np.cumsum(rate) * DT
    gyro = np.diff(angle, prepend=0.0) / DT + 2e-3 * rng.standard_normal(N)
    seen = Channel(angle + error + noise * rng.standard_normal(N), "rad", source=source)
    t: Floats = DT * np.arange(float(N))
    return with_reference(Recording(t, {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": seen}))


def gain(recording: Recording, rows: int) -> float:
    """Gain of means over so many rows, as a fit weights their modes: by the power of what is left."""
    from scipy.fft import dct

    bins = (N - 1) // rows
    angle, gyro = recording.channels["table_angle"].values, recording.channels["gyro"].values
    u = np.diff(angle[: bins * rows + 1 : rows]) / (rows * DT)
    y = gyro[1 : bins * rows + 1].reshape(bins, rows).mean(axis=1)
    u, y = dct(u, norm="ortho")[1:], dct(y, norm="ortho")[1:]
    left = np.convolve((y - u) ** 2, np.full(51, 1 / 51), mode="same")
    return float(np.sum(u * y / left) / np.sum(u * u / left))


@pytest.mark.parametrize("seed", [2, 3])
def test_bins_end_where_the_reference_no_longer_follows_and_the_gain_is_right(seed: int) -> None:
    recording = beside(np.cumsum(0.08 * low(3.0, seed)) * DT)
    rows = rows_told((recording,), SPAN, "gyro")
    assert 10 <= rows <= 60
    assert abs(gain(recording, rows) - 1) < 0.005
    assert gain(recording, 1) < 0.96


def test_an_encoder_that_follows_all_motion_leaves_bins_short() -> None:
    assert rows_told((beside(np.zeros(N)),), SPAN, "gyro") <= 2


def test_an_exact_reference_and_a_command_tell_all_motion() -> None:
    assert rows_told((beside(np.zeros(N), 0.0),), SPAN, "gyro") == 1
    assert rows_told((beside(np.cumsum(0.08 * low(3.0, 2)) * DT, source="command"),), SPAN, "gyro") == 1
