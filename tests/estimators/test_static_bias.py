"""The test at rest: bias, stability, Allan coefficients, warm-up, streamed."""

from __future__ import annotations

from functools import cache

import allantools
import numpy as np
import pytest
import rate_test_cases as case

from estimators.at_rest.static_bias import NOISES, Record, StaticBias
from estimators.common import allan_terms
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.rate_test import StaticResult
from insenv.core.recording import Channel, Floats, Mounting, Recording, Segment, Site
from insenv.core.units import ARCSEC, DEG, DEG_PER_HOUR, DEG_PER_SQRT_HOUR

Q = 0.35 * ARCSEC


def at_rest(gyro: Floats, sampling: float, **more: Channel) -> Recording:
    t = np.arange(1, gyro.shape[-1] + 1) / sampling
    return Recording(t, {"gyro": Channel(gyro, "rad/s", "interval"), **more})


def fed(plugin: StaticBias, chunks: list[Recording], batch: int | None = None) -> Record:
    state = plugin.reset(batch)
    for chunk in chunks:
        state = plugin.update(state, chunk)
    return state


def evaluated(plugin: StaticBias, *chunks: Recording) -> StaticResult:
    found = plugin.result(fed(plugin, list(chunks)))
    assert found is not None
    return found


def noise(n: int, sampling: float, seed: int) -> Floats:
    """White noise and quantisation like those of the B-215 [rad/s]."""
    rng = np.random.default_rng(seed)
    white = rng.standard_normal(n) * case.N * np.sqrt(sampling)
    return white + Q * np.diff(rng.standard_normal(n + 1)) * sampling


@cache
def a_test_of_minutes() -> StaticResult:
    """An hour and a half at 2000 Hz, in chunks."""
    plugin = StaticBias(Datasheet(2000.0, 5400.0))
    state = plugin.reset()
    for k in range(90):
        chunk = at_rest(noise(120_000, 2000.0, k), 2000.0)
        state = plugin.update(state, Recording(chunk.t + 60.0 * k, chunk.channels))
    found = plugin.result(state)
    assert found is not None
    return found


# -------------------------------------------------------------------------------------------------- bias stability


@pytest.mark.slow
@pytest.mark.parametrize("averaging", [0.0005, 0.01])
def test_bias_stability_is_that_of_the_closed_form(averaging: float) -> None:
    # 540 000 means over 10 ms: the standard deviation is known to 0.1 %, so 0.2 % is two of it for one seed.
    found = next(s for s in a_test_of_minutes().stability if s.averaging == pytest.approx(averaging))
    closed = np.sqrt(case.N**2 / averaging + 2 * Q**2 / averaging**2)
    assert found.value.value == pytest.approx(closed, rel=2e-3)


@pytest.mark.slow
def test_the_coefficients_are_those_that_were_put_in() -> None:
    found = a_test_of_minutes().allan.coefficients
    for name, truth in (("angle_random_walk", case.N), ("quantization", Q)):
        assert found[name].value == pytest.approx(truth, rel=5e-3)
        assert abs(found[name].value - truth) < 4.5 * found[name].sd  # false alarm 7e-6


def test_bias_stability_is_the_standard_deviation_of_means() -> None:
    gyro = noise(20_000, 100.0, 1)
    plugin = StaticBias(Datasheet(100.0, 200.0), averaging=(0.03, 0.5, 1.0, 7.0), scale_factor=2.0)
    for one in evaluated(plugin, at_rest(gyro, 100.0)).stability:
        m = round(one.averaging * 100)
        means = gyro[: len(gyro) // m * m].reshape(-1, m).mean(axis=1)
        assert one.count == len(means)
        assert one.value.value == pytest.approx(means.std(ddof=1) / 2, rel=1e-12)


def test_the_allan_deviation_is_that_of_allantools() -> None:
    gyro = noise(50_000, 100.0, 2)
    found = evaluated(StaticBias(Datasheet(100.0, 500.0)), at_rest(gyro, 100.0)).allan
    taus, deviation, _, _ = allantools.adev(gyro, rate=100.0, data_type="freq", taus=found.taus)
    assert found.taus[: len(taus)] == pytest.approx(taus)
    assert found.deviation[: len(taus)] == pytest.approx(deviation, rel=1e-10)
    assert ((found.lower < found.deviation) & (found.deviation < found.upper)).all()


def test_errors_of_the_coefficients_are_as_large_as_told() -> None:
    # 150 records: the standard deviation of z is known to 6 %; a quarter is four of it. What is told may be too large,
    # as differences of pairs that overlap tell more than is counted.
    plugin, z = StaticBias(Datasheet(50.0, 400.0)), []
    for seed in range(150):
        found = evaluated(plugin, at_rest(noise(20_000, 50.0, seed), 50.0)).allan.coefficients
        z.append([(found[n].value - v) / found[n].sd for n, v in (("angle_random_walk", case.N), ("quantization", Q))])
    assert (np.abs(np.std(z, axis=0) - 0.9) < 0.25).all(), np.std(z, axis=0)


# ------------------------------------------------------------------------------------------------------ streaming


@pytest.mark.parametrize("sizes", [(1,), (37, 100), (999, 3), (5000,)])
def test_a_stream_is_the_batch(sizes: tuple[int, ...]) -> None:
    rate = np.concatenate([np.zeros(2000), np.full(1000, 5 * DEG), np.zeros(3000)])
    gyro = rate + noise(len(rate), 50.0, 3) + 1e-5
    whole = case.recording(rate, gyro, 50.0, temperature=Channel(np.linspace(300.0, 306.0, len(rate)), "K"))
    plugin = StaticBias(Datasheet(50.0, 120.0))
    one, many = evaluated(plugin, whole), evaluated(plugin, *case.cut(whole, sizes))
    assert many.bias.value == pytest.approx(one.bias.value, rel=1e-10)
    for a, b in zip(one.stability, many.stability, strict=True):
        assert b.count == a.count
        assert b.value.value == pytest.approx(a.value.value, rel=1e-10, nan_ok=True)
    assert many.allan.deviation == pytest.approx(one.allan.deviation, rel=1e-10)
    assert many.series == pytest.approx(one.series, rel=1e-10)


def test_a_row_of_a_batch_is_the_run_alone() -> None:
    gyro = np.stack([noise(3000, 50.0, seed) for seed in range(3)])
    rate = np.zeros_like(gyro)
    rate[1, 1000:1500] = 3 * DEG
    plugin = StaticBias(Datasheet(50.0, 60.0))
    batch = plugin.estimate(fed(plugin, case.cut(case.recording(rate, gyro + rate, 50.0), (700,)), 3))
    for i in range(3):
        alone = plugin.estimate(fed(plugin, [case.recording(rate[i], gyro[i] + rate[i], 50.0)]))
        assert batch.mean[i] == pytest.approx(alone.mean, rel=1e-10)
        assert batch.cov[i] == pytest.approx(alone.cov, rel=1e-9)


def test_only_rest_counts() -> None:
    rate = np.concatenate([np.zeros(1010), np.full(990, 2 * DEG), np.zeros(1000)])
    found = evaluated(StaticBias(Datasheet(50.0, 60.0)), case.recording(rate, rate + 1e-5, 50.0))
    assert found.bias.value == pytest.approx(1e-5, rel=1e-12)
    assert found.stability[-2].value.value == pytest.approx(0.0, abs=1e-17)


def test_labels_say_what_rests() -> None:
    gyro = np.concatenate([np.full(500, 1e-5), np.full(500, 1.0), np.full(500, 3e-5)])
    whole = at_rest(gyro, 50.0)
    labelled = Recording(whole.t, whole.channels, (Segment("zero #1", 0, 500), Segment("rate +57 deg/s #1", 500, 1000)))
    assert evaluated(StaticBias(Datasheet(50.0, 30.0)), labelled).bias.value == pytest.approx(1e-5, rel=1e-12)


# ---------------------------------------------------------------------------------- power-ups, warm-up, Earth rate


def test_repeatability_is_that_of_the_power_ups() -> None:
    biases = np.array([1.0, 4.0, 2.5]) * DEG_PER_HOUR
    power = np.repeat([1.0, 2.0, 3.0], 1000)
    found = evaluated(
        StaticBias(Datasheet(50.0, 60.0)), at_rest(np.repeat(biases, 1000), 50.0, power=Channel(power, "1"))
    )
    assert found.bias_of_each == pytest.approx(tuple(biases), rel=1e-12)
    assert found.repeatability.value == pytest.approx(biases.std(ddof=1), rel=1e-12)
    assert found.bias.value == pytest.approx(biases.mean(), rel=1e-12)
    # The stability is about the mean of each power-up.
    assert found.stability[0].value.value == pytest.approx(0.0, abs=1e-17)


def test_warm_up_is_found_and_left_out() -> None:
    t = np.arange(1, 100_001) / 10.0
    amplitude, tau = -20 * DEG_PER_HOUR, 900.0
    gyro = amplitude * np.exp(-t / tau) + np.random.default_rng(5).standard_normal(len(t)) * case.N * np.sqrt(10.0)
    sheet = Datasheet(10.0, 1e4)
    kept, dropped = (evaluated(StaticBias(sheet, warm_up=w), at_rest(gyro, 10.0)) for w in (0.0, 6000.0))
    warm = kept.warm_up
    assert warm is not None
    assert abs(warm.amplitude.value - amplitude) < 4.5 * warm.amplitude.sd  # false alarm 7e-6 each
    assert abs(warm.time_constant.value - tau) < 4.5 * warm.time_constant.sd
    assert warm.rise.value == pytest.approx(17 * DEG_PER_HOUR, rel=0.05)
    assert abs(dropped.bias.value) < 0.1 * abs(kept.bias.value)
    assert dropped.warm_up_left_out == 6000.0
    last = dropped.stability[-1]
    assert last.averaging == 100.0
    assert last.settled.value < 0.3 * last.value.value
    assert np.isnan(dropped.stability[0].settled.value)


def test_earth_rate_is_said_to_be_removed_or_not() -> None:
    gyro = np.full(500, 9 * DEG_PER_HOUR)
    site = Site(latitude=32.03 * DEG)
    told = {
        "up": Datasheet(10.0, 50.0, site=site),
        "level": Datasheet(10.0, 50.0, site=site, mounting=Mounting(tilt=0.0)),
        "nowhere": Datasheet(10.0, 50.0),
    }
    found = {name: evaluated(StaticBias(sheet), at_rest(gyro, 10.0)) for name, sheet in told.items()}
    assert found["up"].bias.value == pytest.approx(9 * DEG_PER_HOUR)
    assert found["up"].bias_without_earth.value / DEG_PER_HOUR == pytest.approx(9 - 7.977, abs=1e-2)
    assert found["up"].earth_note.startswith("Earth rate removed: 7.97")
    assert found["level"].bias_without_earth.value == pytest.approx(9 * DEG_PER_HOUR)
    assert "not removed" in found["level"].earth_note and "east or west" in found["level"].earth_note
    assert "no latitude" in found["nowhere"].earth_note
    assert np.isnan(found["nowhere"].bias_without_earth.value)


# -------------------------------------------------------------------------------------------------------- the rest


def test_before_any_data_there_is_the_prior() -> None:
    plugin = StaticBias(Datasheet(10.0, 50.0))
    for estimate in (plugin.estimate(plugin.reset()), plugin.estimate(plugin.reset(2))):
        assert estimate.names == ("bias", *NOISES)
        assert np.isfinite(estimate.mean).all() and (estimate.sd > 0).all()
    assert plugin.result(plugin.reset()) is None


def test_the_bias_is_as_uncertain_as_told() -> None:
    # 200 records of white noise: 15 % is three standard deviations.
    gyro = np.random.default_rng(7).standard_normal((200, 6000)) * DEG_PER_SQRT_HOUR * np.sqrt(10.0)
    plugin = StaticBias(Datasheet(10.0, 600.0))
    value, sd = plugin.estimate(fed(plugin, [at_rest(gyro, 10.0)], 200)).of("bias")
    assert np.median(sd) >= 0.9 * DEG_PER_SQRT_HOUR / np.sqrt(600)
    assert (np.abs(value) < 4.5 * sd).all()  # at most 200 x 7e-6


def test_settings_without_meaning_are_refused() -> None:
    sheet = Datasheet(10.0, 50.0)
    with pytest.raises(InputError, match="averaging"):
        StaticBias(sheet, averaging=(0.0,))
    with pytest.raises(InputError, match="warm_up"):
        StaticBias(sheet, warm_up=-1.0)
    with pytest.raises(InputError, match="scale_factor"):
        StaticBias(sheet, scale_factor=0.0)


def test_it_is_found_by_name() -> None:
    assert find(ESTIMATORS, "static_bias") is StaticBias


def test_terms_that_are_not_seen_are_zero_with_what_may_be_hidden() -> None:
    taus, edf = np.geomspace(0.01, 20.48, 12), np.geomspace(2.0**16, 2.0**5, 12)
    found = allan_terms.plain(taus, case.N**2 / taus, edf).coefficients
    assert found["angle_random_walk"].value == pytest.approx(case.N, rel=1e-6)
    assert found["rate_random_walk"].sd > 0
