"""A reference with errors of its own tells slow motion well, and fast motion not: bins are as long as that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from insenv.core.recording import Channel, Floats, Origin, Recording
from insenv.data.reference import with_reference
from insenv.identify.clean.doubtful import Settled, doubted, measured_parts, rows_per_motion, settled
from insenv.identify.clean.lost import lost_rows
from insenv.identify.clean.response.fit import fitted

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


def told(recording: Recording) -> int:
    """Rows of a bin."""
    parts = doubted((recording,), SPAN, "gyro", (np.ones(N, bool),))
    return rows_per_motion(parts, settled(parts))


@pytest.mark.parametrize("seed", [2, 3])
def test_bins_end_where_the_reference_no_longer_follows_and_the_gain_is_right(seed: int) -> None:
    recording = beside(np.cumsum(0.08 * low(3.0, seed)) * DT)
    rows = told(recording)
    assert 10 <= rows <= 60
    assert abs(gain(recording, rows) - 1) < 0.005
    assert gain(recording, 1) < 0.96


def test_an_encoder_that_follows_all_motion_leaves_bins_short() -> None:
    assert told(beside(np.zeros(N))) <= 2


def test_an_exact_reference_and_a_command_tell_all_motion() -> None:
    assert told(beside(np.zeros(N), 0.0)) == 1
    assert told(beside(np.cumsum(0.08 * low(3.0, 2)) * DT, source="command")) == 1


# Stamps by arrival, and what was lost


def by_arrival(seed: int, gain: float = 1.09, off: float = 0.003, late: float = 0.025) -> Recording:
    """A gyro turned by hand, with breaks, at uneven steps, beside an angle whose own stamps jitter."""
    rng = np.random.default_rng(seed)
    fine: Floats = 0.001 * np.arange(10.0 * N + 400)
    rate = np.convolve(rng.standard_normal(len(fine)), np.hanning(800), "same") * np.clip(
        np.sin(0.2 * fine) + 0.5, 0, 1
    )
    angle = np.cumsum(rate / rate.std() * 0.7) * 0.001
    t = 0.1 + DT * np.arange(float(N)) + 5e-4 * rng.choice([-1.0, 1.0], N)
    gyro = gain * np.diff(np.interp(t, fine, angle), prepend=0.0) / np.diff(t, prepend=t[0] - DT)
    seen = np.interp(t - late + off * rng.standard_normal(N), fine, angle)
    channels = {
        "gyro": Channel(gyro + 0.01 * rng.standard_normal(N), "rad/s", "interval"),
        "table_angle": Channel(seen, "rad", source="encoder"),
    }
    return with_reference(Recording(t, channels))


@pytest.mark.parametrize("seed", [1, 2])
def test_beside_stamps_by_arrival_gain_and_lag_are_told_though_half_of_a_rate_is_noise(seed: int) -> None:
    recording = by_arrival(seed)
    parts = doubted((recording,), SPAN, "gyro", (np.ones(N, bool),))
    (one,) = settled(parts)
    read = np.diff(recording.channels["table_angle"].values) / np.diff(recording.t)
    plain = np.polyfit(read, recording.channels["gyro"].values[1:], 1)[0]
    assert abs(plain - 1.09) > 0.05
    assert abs(one.gain - 1.09) < 0.005
    assert abs(one.lag - -0.025) < 0.002
    assert rows_per_motion(parts, (one,)) >= one.over


def test_means_that_do_not_agree_with_longer_ones_tell_no_gain() -> None:
    """Of an error of the angle that is smooth over some rows the smoothed motion keeps what it is not told from."""
    rng = np.random.default_rng(6)
    rate = low(0.4, 5)
    error = 0.02 * np.convolve(rng.standard_normal(N), np.hanning(9), "same") * np.abs(low(0.2, 6))
    recording = beside(error + np.cumsum(rate - low(0.7, 1)) * DT)
    gyro = replace(recording.channels["gyro"], values=np.diff(np.cumsum(rate) * DT, prepend=0.0) / DT)
    parts = doubted((replace(recording, channels={**recording.channels, "gyro": gyro}),), SPAN, "gyro", ())
    (one,) = settled(parts)
    assert fitted(parts, {0: 0.0}, {0})[0] < 0.98
    assert one.over >= 8
    assert abs(one.gain - 1) < 0.01


@pytest.mark.parametrize("lost", [True, False])
def test_a_second_in_which_the_markers_were_lost_is_an_event(lost: bool) -> None:
    sound = by_arrival(4)
    angle = sound.channels["table_angle"].values.copy()
    if lost:
        angle[3000:3060] += np.linspace(0, 0.5, 60)
        angle[3060:3120] += np.linspace(0.5, 0, 60)
    seen = replace(sound.channels["table_angle"], values=angle)
    recording = with_reference(replace(sound, channels={**sound.channels, "table_angle": seen}))
    parts = doubted((recording,), SPAN, "gyro", (np.ones(N, bool),))
    found = lost_rows((recording,), "gyro", settled(parts))
    assert len(found) == lost
    for one in found:
        assert 2920 < one.start < 3010 and 3110 < one.stop < 3200


@pytest.mark.parametrize("law", ["dead band", "cubic", "one side", "clipped"])
def test_what_an_instrument_does_at_a_rate_is_no_event(law: str) -> None:
    one = by_arrival(5)
    y = one.channels["gyro"].values
    bent = {
        "dead band": np.sign(y) * np.maximum(np.abs(y) - 0.2, 0.0),
        "cubic": y + 0.05 * y**3,
        "one side": y + 0.1 * np.maximum(y, 0.0),
        "clipped": np.clip(y, -1.2, 1.2),
    }[law]
    recording = replace(one, channels={**one.channels, "gyro": replace(one.channels["gyro"], values=bent)})
    parts = doubted((recording,), SPAN, "gyro", (np.ones(N, bool),))
    assert lost_rows((recording,), "gyro", settled(parts)) == ()


def test_rounded_rows_at_rest_make_no_event_of_what_moves() -> None:
    """A bench that stands, and is knocked beside a lag: rows at rest, rounded, scatter by nothing."""
    t: Floats = DT * np.arange(2400.0)

    def rate(t: Floats) -> Floats:
        return np.where((t > 10) & (t < 10.3), 4 * np.sin(2 * np.pi * (t - 10) / 0.3), 0.0)

    late = 0.02
    recording = Recording(
        t,
        {
            "gyro": Channel(np.asarray(np.round(rate(t), 2), np.float64), "rad/s"),
            "table_rate": Channel(np.asarray(np.round(rate(t - late), 2), np.float64), "rad/s", source="encoder"),
        },
    )
    assert lost_rows((with_reference(recording),), "gyro", (Settled(0, 1, 1.0, 0.0),)) == ()


def test_a_reference_without_noise_that_loses_the_motion_once_is_left_out_there() -> None:
    """A telephone's own attitude that is set right by 0.9 deg within 0.15 s, at the very end of the run the same."""
    t = 0.01 * np.arange(3000.0)
    rate = 1.2 * np.sin(2.2 * t) * np.sin(0.37 * t) + 0.6 * np.sin(5.1 * t)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * 0.01)])
    angle = angle + 0.015 * np.clip((t - 8.0) / 0.15, 0, 1) - 0.08 * np.clip((t - 29.8) / 0.19, 0, 1)
    channels = {
        "gyro": Channel(rate + 2e-3 * np.random.default_rng(1).standard_normal(len(t)), "rad/s", "instant"),
        "table_angle": Channel(angle, "rad", "instant", source="encoder"),
    }
    run = Recording(t, channels)
    parts = measured_parts((run,), (slice(0, 3000),), "gyro", (np.ones(3000, bool),))
    rows = lost_rows((run,), "gyro", settled(parts))
    left = {i for row in rows for i in range(row.start, row.stop)}
    assert set(range(802, 814)) < left
    assert set(range(2984, 2999)) < left
    assert len(left) < 150
    steps = replace(channels["table_angle"], values=np.interp(t, [0, 10, 11, 20, 30], [0, 5, 5, -4, -4]))
    table = Recording(t, {**channels, "table_angle": steps})
    assert measured_parts((table,), (slice(0, 3000),), "gyro", (np.ones(3000, bool),)) == []
