"""A late encoder: told whether it is delayed, smoothed by a first-order filter, or a mean of counts over a time.

The motion is 0.2 to 2 Hz; a filter of 20 ms makes 2 Hz smaller by 3 % where a delay leaves its size. Generated with
NumPy and SciPy, no effect of insenv; seeds are fixed.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from insenv.core.motion import Motion
from insenv.core.recording import Channel, Floats, Recording, Response
from insenv.data.reference import with_reference
from insenv.effects.timing import before_mean
from insenv.identify.clean.response.found import responding
from insenv.identify.clean.response.stretches import stretches

DT, N, LATE = 0.01, 6000, 0.02
GAIN = -0.87
WINDOW = 0.1


def bench(form: str, seed: int) -> Recording:
    """A reversed gyro beside an encoder's rate that is late by `LATE` in one of two ways."""
    rng = np.random.default_rng(seed)
    fine = DT / 20
    t = np.linspace(0.0, (20 * N - 1) * fine, 20 * N)
    waves = ((1.0, 0.2, 0.3), (0.8, 0.7, 1.0), (0.7, 2.0, 2.0))
    rate: Floats = np.sum([a * np.sin(2 * np.pi * f * t + p) for a, f, p in waves], axis=0)
    if form == "filter":
        share = 1 - np.exp(-fine / LATE)
        late = lfilter([share], [1, share - 1], rate)
    elif form == "window":
        angle = np.cumsum(rate) * fine
        late = (np.interp(t - LATE + 0.5 * WINDOW, t, angle) - np.interp(t - LATE - 0.5 * WINDOW, t, angle)) / WINDOW
    else:
        late = np.interp(t - LATE, t, rate)
    rows = slice(200, None, 20)
    encoder = late[rows] + 0.02 * rng.standard_normal(len(t[rows]))
    gyro = GAIN * rate[rows] + 0.01 * rng.standard_normal(len(t[rows]))
    channels = {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(encoder, "rad/s", source="encoder")}
    return with_reference(Recording(t[rows], channels))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("form", ["filter", "delay", "window"])
def test_a_filter_a_delay_and_a_mean_are_told_apart(form: str, seed: int) -> None:
    run = bench(form, seed)
    (found,) = responding((run,), (slice(0, len(run)),), "gyro", ())
    response = found.responses.get("gyro", Response())
    assert response.filtered == (form == "filter")
    assert response.window == (pytest.approx(WINDOW, rel=0.2) if form == "window" else 0.0)
    assert response.lag == pytest.approx(-LATE, abs=5e-4)
    assert response.gain == pytest.approx(GAIN, abs=2e-3)


@pytest.mark.parametrize("apart", [0.75, -1.6])
def test_clocks_that_are_far_apart_are_found(apart: float) -> None:
    """Two clocks that were never set by each other: nothing is alike within half a second."""
    rng = np.random.default_rng(4)
    t: Floats = np.arange(0.0, N) * DT
    waves = [(rng.uniform(0.3, 1), f, rng.uniform(0, 6)) for f in np.linspace(0.3, 1.9, 12)]

    def rate(at: Floats) -> Floats:
        return np.asarray(np.sum([a * np.sin(2 * np.pi * f * at + p) for a, f, p in waves], axis=0))

    encoder = rate(t + apart) + 0.02 * rng.standard_normal(N)
    gyro = 0.8 * rate(t) + 0.3 * rng.standard_normal(N)
    channels = {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(encoder, "rad/s", source="encoder")}
    run = with_reference(Recording(t, channels))
    (found,) = responding((run,), (slice(0, N),), "gyro", ())
    response = found.responses.get("gyro", Response())
    assert response.lag == pytest.approx(apart, abs=0.01)
    assert response.gain == pytest.approx(0.8, abs=0.02) or response.gain == 1.0


@pytest.mark.parametrize("windows", [5.0, 10.0, 40.0])
def test_a_mean_is_undone(windows: float) -> None:
    """A sine that swings once in so many windows; 0.4 % off at five of them, by the fourth power less beyond."""
    t = np.linspace(0.0, 20.0, 4001)
    omega = 2 * np.pi / (windows * WINDOW)
    share = np.sinc(1 / windows)
    motion = Motion(t=t, rate=np.zeros(4000), rate_edges=share * np.sin(omega * t), window=WINDOW)
    mean = -share * np.diff(np.cos(omega * t)) / omega / motion.dt
    whole, edges = before_mean(mean, share * np.sin(omega * t), motion)
    inside = slice(400, -400)
    assert np.abs(whole - mean / share)[inside].max() < 4.5e-3 * (5 / windows) ** 4 + 1e-6
    assert np.abs(edges - np.sin(omega * t))[inside].max() < 4.5e-3 * (5 / windows) ** 4 + 1e-6


@pytest.mark.parametrize("gain", [0.45, -0.87])
def test_of_a_table_that_swings_evenly_the_shortest_lag_is_taken(gain: float) -> None:
    """Half a swing later the reading is the same the other way round: that was taken, with the sign of the gain."""
    t, runs = 0.004 * np.arange(1200.0), []
    for seed, f in enumerate((2.0, 5.0, 7.0)):
        rng = np.random.default_rng(seed)
        told = np.round(2 * np.sin(2 * np.pi * f * t), 2)
        swell = 1 + 0.05 * np.sin(2 * np.pi * 0.11 * t)
        gyro = gain * 2 * swell * np.sin(2 * np.pi * f * (t - 0.007)) + 0.02 * rng.standard_normal(len(t))
        channels = {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(told, "rad/s", source="encoder")}
        runs.append(with_reference(Recording(t, channels)))
    found = responding(tuple(runs), tuple(slice(0, len(t)) for _ in runs), "gyro", ())
    for run in found:
        response = run.responses.get("gyro", Response(0.45))
        assert np.sign(response.gain) == np.sign(gain)
        assert response.lag == pytest.approx(0.0, abs=0.015)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_gyro_behind_a_filter_is_beside_no_mean_longer_than_its_motion(seed: int) -> None:
    """Swings of 1 to 2 Hz and a first-order filter of the gyro's: no mean over a third of a second made the encoder."""
    rng = np.random.default_rng(seed)
    fine, tau, delay = 0.0025, 0.033, 0.024
    t: Floats = np.arange(0.0, 80_000) * fine
    waves = [(np.exp(-0.5 * ((f - 1.6) / 0.35) ** 2) + 0.05, f, rng.uniform(0, 6)) for f in np.linspace(0.3, 4.7, 45)]
    rate: Floats = 0.2 * np.sum([a * np.sin(2 * np.pi * f * t + p) for a, f, p in waves], axis=0)
    share = 1 - np.exp(-fine / tau)
    behind = np.interp(t - delay, t, lfilter([share], [1, share - 1], rate))
    rows = slice(20, None, 20)
    noise = rng.standard_normal((2, len(t[rows])))
    channels = {
        "gyro": Channel(0.95 * behind[rows] + 0.005 * noise[0], "rad/s"),
        "table_rate": Channel(rate[rows] + 0.005 * noise[1], "rad/s", source="encoder"),
    }
    run = with_reference(Recording(t[rows], channels))
    (found,) = responding((run,), (slice(0, len(run)),), "gyro", ())
    response = found.responses.get("gyro", Response())
    assert response.window == 0.0
    assert response.lag == pytest.approx(tau + delay, abs=0.01)


@pytest.mark.parametrize("window", [0.01, 0.08])
def test_a_rate_over_some_rows_is_a_mean_though_it_has_no_noise_and_the_table_jumps_from_rate_to_rate(
    window: float,
) -> None:
    """Counts of 19 bits over 8 rows, late by half of them and 10 ms; ramps of 0.45 s. Over one row it is but late.

    A curve of the rate was told of what a delay alone left at the ends of the ramps. The likelihood ratio of the mean
    is beyond exp(20) here.
    """
    rng = np.random.default_rng(1)
    fine, rows = 1e-3, 6000
    t = fine * np.arange(10 * rows)
    steps = np.where((t // 5.0).astype(int) % 2, 5.2, 2.1)
    rate = np.convolve(np.pad(steps, (449, 0), mode="edge"), np.full(450, 1 / 450), "valid")
    angle = fine * (np.cumsum(rate) - 0.5 * rate)
    at: Floats = 0.5 + DT * np.arange(rows - 60.0)
    count = 2 * np.pi / 2**19
    read = [count * np.floor(np.interp(at - 0.01 - far, t, angle) / count) for far in (0.0, window)]
    encoder, gyro = (read[0] - read[1]) / window, np.interp(at, t, rate) + 2e-3 * rng.standard_normal(len(at))
    channels = {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(encoder, "rad/s", source="encoder")}
    (found,) = responding((with_reference(Recording(at, channels)),), (slice(0, 4000),), "gyro", ())
    response = found.responses.get("gyro", Response())
    assert response.window == (pytest.approx(window, rel=0.2) if window > DT else 0.0)
    if window > DT:
        assert response.lag == pytest.approx(-0.01 - 0.5 * window, abs=5e-4)


def test_a_gain_is_told_by_what_moves_and_not_by_the_longest_stretch_at_one_rate() -> None:
    """Rows are lost while a table starts, which then goes evenly to 1 %: there errors of it made a gain of 0.14."""
    rng = np.random.default_rng(2)
    t = 0.04 * np.arange(5000.0)
    t = t[(np.arange(5000) % 20 != 0) | (t > 20.0)]
    rate: Floats = 3.49 * np.clip((t - 5.0) / 6.0, 0.0, 1.0) * (1 + 0.01 * np.cos(0.6 * t))
    gyro = rate + 5e-3 * rng.standard_normal(len(t))
    channels = {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(rate, "rad/s", source="encoder")}
    steady = slice(int(np.searchsorted(t, 20.1)), 3000)
    (found,) = stretches((Recording(t, channels),), (steady,), "gyro", (t < 110.0,))
    assert np.ptp(found.input(0.0)[found.known > 0]) > 3.0


@pytest.mark.parametrize("seed", range(8))
def test_a_gyro_that_reads_one_number_most_of_the_time_has_no_gain_of_nothing(seed: int) -> None:
    """A robot that turns now and then, and else less than the gyro's threshold: a gain of nothing left nothing there.

    Of three seconds of turns no gain is told, and it stays one: every seed, whatever noise does.
    """
    rng, t = np.random.default_rng(seed), 0.1 * np.arange(1.0, 601.0)
    rate: Floats = np.where(t % 20 < 1.0, 0.05 * np.sin(np.pi * t), 0.012 * np.sin(0.9 * t + seed))
    gyro = np.where(np.abs(rate) < 0.018, -1e-4, GAIN * rate + 1e-3 * rng.standard_normal(len(t)))
    encoder = rate + 2e-3 * rng.standard_normal(len(t))
    channels = {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(encoder, "rad/s", source="encoder")}
    (found,) = responding((with_reference(Recording(t, channels)),), (slice(0, len(t)),), "gyro", ())
    assert abs(found.responses.get("gyro", Response()).gain) > 0.4


@pytest.mark.parametrize("gain", [1.0, -0.99])
def test_a_command_that_ramps_within_a_few_rows_is_the_motion_behind_it(gain: float) -> None:
    """Steps of 5 % of its range a row were jumps, of which no lag is asked: a gain of -0.99 was -0.86 +- 0.06."""
    t: Floats = 0.008 * np.arange(8000, dtype=np.float64)
    told = 20 * np.clip(np.sin(2 * np.pi * t / 1.6) * 8, -1, 1)
    y = np.deg2rad(gain * np.interp(t - 0.032, t, told)) + 3e-4 * np.random.default_rng(3).standard_normal(len(t))
    channels = {"gyro": Channel(y, "rad/s"), "table_rate": Channel(np.deg2rad(told), "rad/s", source="command")}
    (found,) = responding((with_reference(Recording(t, channels)),), (slice(0, len(t)),), "gyro", ())
    assert found.responses["gyro"].lag == pytest.approx(0.032, abs=2e-3)
