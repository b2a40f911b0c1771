"""The scale-factor line: dwells, flags, methods, and its own uncertainty."""

from __future__ import annotations

import numpy as np
import pytest
import rate_test_cases as case

from estimators.rate_table import rate_dwells, rate_line_fits, rate_line_result
from estimators.rate_table.rate_line import RateLine
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.plugins import ESTIMATORS, find
from insenv.core.rate_test import NORMALISATIONS, RateLineResult
from insenv.core.recording import Channel, Floats, Mounting, Recording, Segment, Site
from insenv.core.units import DEG, DEG_PER_HOUR, PPM

SAMPLING = 20.0
SHEET = Datasheet(SAMPLING, 1e4)


def exact(outputs: Floats, rates: Floats, repeats: int = 1) -> RateLineResult:
    """The result for dwells of a turn without any noise."""
    rows = np.zeros((repeats * len(rates), rate_dwells.WIDTH))
    for q in range(repeats):
        mine = rows[q * len(rates) : (q + 1) * len(rates)]
        mine[:, rate_dwells.RATE], mine[:, rate_dwells.OUTPUT] = rates, outputs
        mine[:, rate_dwells.TIME], mine[:, rate_dwells.TURNS] = 2 * np.pi / np.maximum(np.abs(rates), 1e-3), 1
        mine[:, rate_dwells.POWER], mine[:, rate_dwells.START] = q + 1, np.arange(len(rates)) * 1000.0
    found = rate_line_result.result(rows, 0.0, "none", float("nan"))
    assert found is not None
    return found


def followed(chunks: list[Recording], plugin: RateLine, batch: int | None = None) -> object:
    state = plugin.reset(batch)
    for chunk in chunks:
        state = plugin.update(state, chunk)
    return state


# ---------------------------------------------------------------------------------------- figures of the publication


def test_the_published_rates_have_the_known_sum_of_squares() -> None:
    assert sum(rate**2 for rate in case.PUBLISHED) == pytest.approx(11927.78, abs=1e-9)


def test_the_anomaly_gives_the_published_nonlinearity_and_bends_the_line() -> None:
    rates = np.array(case.PUBLISHED) * DEG
    found = exact(rates + np.where(np.isclose(np.abs(rates), 20 * DEG), case.ANOMALY * np.sign(rates), 0.0), rates)
    every, kept = found.fit("all points"), found.fit("without flagged")
    assert every.nonlinearity["largest_output"].value / PPM == pytest.approx(898.76, abs=0.01)
    assert (every.scale_factor.value - 1) / PPM == pytest.approx(113, abs=0.5)
    assert kept.nonlinearity["largest_output"].value / PPM < 60
    assert abs(kept.scale_factor.value - 1) < 1e-9
    assert sorted(round(f.rate / DEG) for f in found.flagged) == [-20, 20]
    assert abs(found.fit("robust").scale_factor.value - 1) < 1e-9


def test_the_fit_is_that_of_polyfit() -> None:
    rng = np.random.default_rng(1)
    rates = np.array(case.PUBLISHED) * DEG
    outputs = rates * (1 + 1e-3) + 1e-4 * rng.standard_normal(len(rates))
    fit = exact(outputs, rates).fit("all points")
    k, f0 = np.polyfit(rates, outputs, 1)
    assert (fit.scale_factor.value, fit.offset.value) == pytest.approx((k, f0), abs=1e-14)
    assert fit.residuals == pytest.approx((outputs - k * rates - f0)[np.argsort(rates)], abs=1e-14)


def test_each_normalisation_is_what_it_says() -> None:
    rates = np.sort(case.PUBLISHED) * DEG
    outputs = rates + 30 * PPM * np.abs(rates) + case.anomaly(rates)
    fit = exact(outputs, rates).fit("all points")
    k, left = fit.scale_factor.value, np.abs(fit.residuals)
    top = abs(outputs[np.abs(rates).argmax()])
    wanted = {
        "largest_output": left.max() / top,
        "fitted_output": left.max() / (k * 35 * DEG),
        "span": left.max() / (2 * k * 35 * DEG),
        "reading": (left / np.abs(k * rates)).max(),
        "rms": np.sqrt(np.mean(left**2)) / top,
    }
    assert set(wanted) == set(NORMALISATIONS) == set(fit.nonlinearity)
    for key, value in wanted.items():
        assert fit.nonlinearity[key].value == pytest.approx(value, rel=1e-3), key
    assert fit.nonlinearity["span"].value == pytest.approx(fit.nonlinearity["fitted_output"].value / 2)


def test_asymmetry_and_repeatability_are_those_that_were_put_in() -> None:
    rates = np.array(case.PUBLISHED) * DEG
    fit = exact(rates + 15 * PPM * np.abs(rates), rates).fit("all points")
    assert fit.asymmetry.value / PPM == pytest.approx(30, abs=1e-4)
    scale = np.array([-5.0, 2.0, 9.0]) * PPM
    rows = np.concatenate([np.stack([rates * (1 + e), rates], axis=1) for e in scale])
    found = exact(rows[:, 0].reshape(3, -1)[0], rates)
    assert np.isnan(found.repeatability["all points"].value)
    spread = rate_line_result._repeatability([exact(rates * (1 + e), rates).fit("all points") for e in scale])
    assert spread.value == pytest.approx(np.std(1 + scale, ddof=1) / np.mean(1 + scale), rel=1e-9)
    assert spread.sd == pytest.approx(spread.value / 2)


# ------------------------------------------------------------------------------------------------- on a recording


def test_dwells_are_averaged_over_whole_turns() -> None:
    rate = case.commanded(case.SHORT, SAMPLING)
    angle = np.cumsum(rate / SAMPLING)
    level = 10 * DEG_PER_HOUR * np.cos(angle - 0.5 * rate / SAMPLING) * np.sinc(0.5 * rate / SAMPLING / np.pi)
    plugin = RateLine(SHEET)
    found = plugin.result(followed([case.recording(rate, rate + level, SAMPLING)], plugin))  # type: ignore[arg-type]
    assert found is not None
    assert [round(d.rate / DEG) for d in found.dwells] == list(case.SHORT)
    assert all(d.turns >= 1 for d in found.dwells)
    # The static output is that at the azimuth of rest; over whole turns nothing is left of the level rate.
    # Turns end within a sample, whose mean is not that of its part: a share of dt / T of the amplitude.
    assert max(abs(d.output - d.rate) for d in found.dwells) < 0.02 * 10 * DEG_PER_HOUR


def test_rates_come_from_angle_rate_or_labels_alike() -> None:
    rate = case.commanded(case.SHORT, SAMPLING, extra=0.0)
    whole = case.recording(rate, case.read_out(rate, SAMPLING, 3, bias=1e-5), SAMPLING)
    edges = [0, *(np.flatnonzero(np.diff(rate)) + 1).tolist(), len(rate)]
    labels = ["zero", *(f"rate {r:+g} deg/s #1" for r in case.SHORT), "zero"]
    segments = tuple(Segment(n, a, b) for n, a, b in zip(labels, edges[:-1], edges[1:], strict=True))
    gyro = {"gyro": whole.channels["gyro"]}
    plugin = RateLine(SHEET)
    told = [
        whole,
        Recording(whole.t, {**gyro, "table_rate": Channel(rate, "rad/s", "interval")}),
        Recording(whole.t, gyro, segments),
    ]
    k = [plugin.estimate(followed([one], plugin)).of("scale_factor") for one in told]  # type: ignore[arg-type]
    assert k[1][0] == pytest.approx(k[0][0], abs=1e-9)
    assert abs(k[2][0] - k[0][0]) < 0.5 * k[0][1]  # by label a dwell has its first sample too, and no turn's end


@pytest.mark.parametrize("sizes", [(1,), (7, 13), (400,), (3, 1000)])
def test_chunks_make_no_difference(sizes: tuple[int, ...]) -> None:
    rate = case.commanded(case.SHORT[:6], SAMPLING)
    whole = case.recording(rate, case.read_out(rate, SAMPLING, 5, bias=1e-4), SAMPLING)
    plugin = RateLine(SHEET)
    one, many = (plugin.estimate(followed(c, plugin)) for c in ([whole], case.cut(whole, sizes)))  # type: ignore[arg-type]
    assert many.mean == pytest.approx(one.mean, rel=1e-10, abs=1e-16)
    assert many.cov == pytest.approx(one.cov, rel=1e-9, abs=1e-30)


def test_a_row_of_a_batch_is_the_run_alone() -> None:
    rate = np.stack([case.commanded(case.SHORT, SAMPLING), case.commanded(case.SHORT[::-1], SAMPLING)])
    gyro = np.stack([case.read_out(row, SAMPLING, seed) for seed, row in enumerate(rate)])
    plugin = RateLine(SHEET)
    batch = plugin.estimate(followed([case.recording(rate, gyro, SAMPLING)], plugin, 2))  # type: ignore[arg-type]
    for i in range(2):
        alone = plugin.estimate(followed([case.recording(rate[i], gyro[i], SAMPLING)], plugin))  # type: ignore[arg-type]
        assert batch.mean[i] == pytest.approx(alone.mean, rel=1e-12, abs=1e-18)
        assert batch.cov[i] == pytest.approx(alone.cov, rel=1e-12, abs=1e-30)


def test_before_any_data_there_is_the_prior() -> None:
    for estimate in (
        RateLine(SHEET).estimate(RateLine(SHEET).reset(3)),
        RateLine(SHEET).estimate(RateLine(SHEET).reset()),
    ):
        assert np.isfinite(estimate.mean).all() and (estimate.sd > 0).all()


def test_errors_are_as_large_as_told() -> None:
    # 200 runs: the standard deviation of z is known to 5 %, so 15 % is three of it; for both, false alarm below 1 %.
    runs, error, bias = 200, 50 * PPM, 3 * DEG_PER_HOUR
    rate = np.broadcast_to(case.commanded(case.SHORT, SAMPLING), (runs, len(case.commanded(case.SHORT, SAMPLING))))
    gyro = case.read_out(rate, SAMPLING, 11, k=1 + error, bias=bias)
    plugin = RateLine(SHEET)
    estimate = plugin.estimate(followed([case.recording(rate, gyro, SAMPLING)], plugin, runs))  # type: ignore[arg-type]
    for name, truth in (("scale_factor", error), ("bias", bias)):
        value, sd = estimate.of(name)
        z = (value - truth) / sd
        assert abs(z.std() - 1) < 0.15, name
        assert abs(z.mean()) < 4 / np.sqrt(runs), name


def test_errors_of_the_report_are_as_large_as_told() -> None:
    # 200 tests of 34 dwells with noise and a spread from setting to setting; limits as above, for eight figures.
    rng = np.random.default_rng(2)
    rates, n, z = np.array(case.PUBLISHED) * DEG, case.N, []
    time = 2 * np.pi / np.abs(rates)
    for _ in range(200):
        noise = rng.standard_normal(34) * np.sqrt(n**2 / time + (0.3 * DEG_PER_HOUR) ** 2)
        rows = np.zeros((34, rate_dwells.WIDTH))
        rows[:, rate_dwells.RATE], rows[:, rate_dwells.OUTPUT] = rates, rates * (1 + 7 * PPM) + noise + 1e-5
        rows[:, rate_dwells.TIME], rows[:, rate_dwells.POWER] = time, 1
        found = rate_line_result.result(rows, n, "none", float("nan"))
        assert found is not None
        pairs = [(fit.scale_factor, fit.bias) for fit in found.fits]
        z.append([((k.value - 1 - 7 * PPM) / k.sd, (b.value - 1e-5) / b.sd) for k, b in pairs])
    assert np.std(z, axis=0) == pytest.approx(np.ones((4, 2)), abs=0.15)


def repeated(seed: int, curve: Floats, repeats: int = 5) -> RateLineResult:
    """Power-ups of the published ladder with noise, a spread from setting to setting, and what repeats."""
    rng = np.random.default_rng(seed)
    rates = np.array(case.PUBLISHED) * DEG
    time = 2 * np.pi / np.abs(rates)
    rows = np.zeros((repeats, 34, rate_dwells.WIDTH))
    noise = rng.standard_normal((repeats, 34)) * np.sqrt(case.N**2 / time + (1.0 * DEG_PER_HOUR) ** 2)
    rows[..., rate_dwells.RATE], rows[..., rate_dwells.OUTPUT] = rates, rates + curve + noise
    rows[..., rate_dwells.TIME], rows[..., rate_dwells.POWER] = time, 1 + np.arange(repeats)[:, None]
    found = rate_line_result.result(rows.reshape(-1, rate_dwells.WIDTH), case.N, "none", float("nan"))
    assert found is not None
    return found


def test_what_repeats_is_no_uncertainty() -> None:
    # 120 tests: the standard deviation of z is known to 6.5 %; a quarter is four of it.
    rates = np.array(case.PUBLISHED) * DEG
    curve = 0.01 * DEG * np.sin(5 * rates / (35 * DEG))
    exactly = exact(rates + curve, rates).fit("all points")
    z = []
    for seed in range(120):
        found = repeated(seed, curve)
        fit = found.fit("all points")
        k, worst = fit.scale_factor, fit.nonlinearity["largest_output"]
        z.append((k.value - exactly.scale_factor.value) / k.sd)
        assert worst.value == pytest.approx(exactly.nonlinearity["largest_output"].value, abs=6 * worst.sd)
        assert not found.flagged
    assert found.setting_from == "of the power-ups about their mean"
    assert found.setting == pytest.approx(DEG_PER_HOUR, rel=0.3)
    assert fit.nonlinearity["largest_output"].sd < 0.1 * fit.nonlinearity["largest_output"].value
    assert np.std(z) == pytest.approx(1.0, abs=0.25)


def test_a_sound_instrument_has_no_flags() -> None:
    # 40 tests of a rule with a false alarm below 1e-3, here without a spread, where it is below 1e-5.
    rng = np.random.default_rng(4)
    rates = np.array(case.PUBLISHED) * DEG
    for _ in range(40):
        noise = rng.standard_normal(34) * case.N / np.sqrt(2 * np.pi / np.abs(rates))
        rows = np.zeros((34, rate_dwells.WIDTH))
        rows[:, rate_dwells.RATE], rows[:, rate_dwells.OUTPUT] = rates, rates + noise
        rows[:, rate_dwells.TIME], rows[:, rate_dwells.POWER] = 2 * np.pi / np.abs(rates), 1
        found = rate_line_result.result(rows, case.N, "none", float("nan"))
        assert found is not None and not found.flagged


def test_interleaved_zeros_take_a_drift_off() -> None:
    ladder = tuple(r for rate in case.SHORT for r in (rate, 0.0))
    rate = case.commanded(ladder, SAMPLING, rest=30.0)
    drift = 60 * DEG_PER_HOUR * np.linspace(0, 1, len(rate))
    whole = case.recording(rate, case.read_out(rate, SAMPLING, 6) + drift, SAMPLING)
    found = {z: RateLine(SHEET, zeros=z).result(followed([whole], RateLine(SHEET))) for z in ("auto", "ends")}  # type: ignore[arg-type]
    auto, ends = found["auto"], found["ends"]
    assert auto is not None and ends is not None
    assert (auto.zero_method, ends.zero_method) == ("interleaved", "ends")
    assert auto.setting < 0.5 * ends.setting
    fit = auto.fit("all points")
    assert abs(fit.offset.value) < 5 * fit.offset.sd  # false alarm 6e-7


def test_static_output_and_earth_rate_are_taken_off_the_bias() -> None:
    sheet = Datasheet(SAMPLING, 1e4, site=Site(latitude=32.03 * DEG))
    rate = case.commanded(case.SHORT, SAMPLING)
    earth = 7.977 * DEG_PER_HOUR
    gyro = rate + earth + 4 * DEG_PER_HOUR
    found = RateLine(sheet).result(followed([case.recording(rate, gyro, SAMPLING)], RateLine(sheet)))  # type: ignore[arg-type]
    assert found is not None
    fit = found.fit("all points")
    assert found.earth_rate == pytest.approx(earth, rel=1e-3)
    assert abs(fit.offset.value) < 1e-4 * DEG_PER_HOUR
    assert fit.bias.value == pytest.approx(4 * DEG_PER_HOUR, abs=2e-3 * DEG_PER_HOUR)


def test_what_cannot_be_used_is_refused_in_one_sentence() -> None:
    level = Datasheet(SAMPLING, 1e3, mounting=Mounting(tilt=0.0))
    for make in (
        lambda: RateLine(level),
        lambda: RateLine(SHEET, zeros="mean"),  # type: ignore[arg-type]
        lambda: RateLine(SHEET, power_ups="first"),  # type: ignore[arg-type]
        lambda: RateLine(SHEET, tolerance=0.0),
    ):
        with pytest.raises(InputError, match="rate_line"):
            make()
    bare = Recording(np.arange(1, 5) / SAMPLING, {"gyro": Channel(np.zeros(4), "rad/s")})
    with pytest.raises(InputError, match="nothing tells the table's rate"):
        RateLine(SHEET).update(RateLine(SHEET).reset(), bare)
    odd = Recording(bare.t, bare.channels, (Segment("turning", 0, 4),))
    with pytest.raises(InputError, match="'turning' tells no rate"):
        RateLine(SHEET).update(RateLine(SHEET).reset(), odd)


def test_one_rate_makes_no_line() -> None:
    rate = np.full(400, 10 * DEG)
    assert RateLine(SHEET).result(followed([case.recording(rate, rate, SAMPLING)], RateLine(SHEET))) is None  # type: ignore[arg-type]


def test_it_is_found_by_name() -> None:
    assert find(ESTIMATORS, "rate_line") is RateLine


def test_the_mean_of_the_largest_is_the_known_one() -> None:
    # Mean of the largest modulus of 36 unit normals, by quadrature elsewhere: 2.39.
    assert rate_line_fits.mean_of_largest(np.ones(36)) == pytest.approx(2.39, abs=0.005)
