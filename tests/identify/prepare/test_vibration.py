"""A unit at rest is judged on means that vibration no longer shapes; lines keep their names; what moved is something.

Generated with NumPy; seeds are fixed. 1 % of recordings of vibration alone may have a false name.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfilt
from simulated_runs import gyro_run, manifest, use

from insenv.close import close
from insenv.core.recording import Channel, Floats, Recording, Site
from insenv.effects.catalogue import by_key
from insenv.identify.findings import Findings, TargetFindings
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Term
from insenv.identify.prepare.problems import prepare
from insenv.identify.prepare.samples import humps, sample_spectrum
from insenv.identify.prepare.spectral.lines import BETWEEN, FALSE_ALARM, Line, heights, periodogram, with_others
from insenv.identify.prepare.vibration import affordable, averaged, doublings, is_folded, unnamed

RATE, DURATION = 100.0, 150.0
WHITE = 1e-3
T: Floats = np.arange(1.0, RATE * DURATION + 1) / RATE


def hummed(seed: int) -> Floats:
    """White noise of a gyro and vibration between 4 and 15 Hz, five times as strong there [rad/s]."""
    rng = np.random.default_rng(seed)
    band = butter(2, [4.0, 15.0], "bandpass", fs=RATE, output="sos")
    return WHITE * (rng.standard_normal(T.size) + 5.0 * sosfilt(band, rng.standard_normal(T.size)))


def closed(values: Floats, folder: Path, noise: str = "") -> TargetFindings:
    return whole(values, folder, noise).targets[0]


def whole(values: Floats, folder: Path, noise: str = "") -> Findings:
    np.savez(folder / "rest.npz", gyro=values)
    (folder / "rest.toml").write_text(
        f'data = "rest.npz"\n[channels]\ntime = {{ rate = "{RATE} Hz" }}\n'
        'gyro = { column = "gyro", unit = "rad/s" }\n'
        f'[model]\ntarget = "gyro"\ndeclared = ["bias"]\n{noise}'
    )
    return close(folder / "rest.toml")


@pytest.mark.parametrize("seed", [1, 2])
def test_a_drift_beneath_vibration_is_named(tmp_path: Path, seed: int) -> None:
    # 30 times the deviation that white noise alone would leave of it.
    slope = 30 * WHITE * np.sqrt(12 / (RATE * DURATION)) / DURATION
    found = closed(hummed(seed) + slope * T, tmp_path)
    assert [a.effect for a in found.added] == ["bias_drift"]
    told = found.added[0].parameters[0]
    assert abs(told.value - slope) < 4 * told.sd and slope > 3 * told.sd


@pytest.mark.parametrize("seed", [3, 4])
def test_vibration_alone_is_nothing(tmp_path: Path, seed: int) -> None:
    found = closed(hummed(seed), tmp_path)
    assert found.added == () and found.verdict == "nothing-significant"


@pytest.mark.parametrize(("low", "high", "said"), [(8.0, 10.0, True), (4.0, 25.0, False)])
def test_where_vibration_is_loudest_is_said(tmp_path: Path, low: float, high: float, *, said: bool) -> None:
    rng = np.random.default_rng(9)
    band = butter(2, [low, high], "bandpass", fs=RATE, output="sos")
    values = WHITE * (rng.standard_normal(T.size) + 5.0 * sosfilt(band, rng.standard_normal(T.size)))
    (word,) = (r for r in whole(values, tmp_path).remarks if "hold vibration" in r)
    assert ("loudest about" in word and 7.5 < float(word.split("about ")[1].split()[0]) < 10.5) == said


def test_a_line_beneath_vibration_keeps_its_name(tmp_path: Path) -> None:
    """At 2.3 Hz, which the short means resolve and the longer ones do not."""
    found = closed(hummed(5) + 8e-4 * np.cos(2 * np.pi * 2.3 * T + 0.5), tmp_path)
    assert [a.effect for a in found.added] == ["tone"]
    told = {p.parameter: p for p in found.added[0].parameters}
    assert abs(told["f"].value - 2.3) < 4 * told["f"].sd
    assert abs(told["amplitude"].value - 8e-4) < 4 * told["amplitude"].sd
    assert found.held_out.averaging > 0.3


def test_a_bias_that_went_elsewhere_beneath_vibration_is_not_nothing(tmp_path: Path) -> None:
    walk = np.cumsum(np.random.default_rng(6).standard_normal(T.size)) * 5e-5
    found = closed(hummed(6) + walk, tmp_path)
    assert found.added or any("which this record does not tell apart" in reason for reason in found.reasons)


def test_means_of_means_are_those_of_the_samples() -> None:
    run = gyro_run("rest", 3, duration=600.0, noise={"angle_random_walk": 1e-5}).recording
    fine, coarse = (
        prepare(manifest(averaging=width), (run,), (use(len(run)),), "gyro").problem for width in (0.5, 2.0)
    )
    merged = averaged(fine, 2)
    assert merged.bins.width == pytest.approx(coarse.bins.width)
    n = min(merged.bins.n, coarse.bins.n)
    np.testing.assert_allclose(merged.y[: n // 2], coarse.y[: n // 2], rtol=1e-12)
    for key, shape in (("bias_drift", ()), ("bias_warm_up", (100.0,))):
        term = Term(by_key(key), shape)
        np.testing.assert_allclose(merged.columns(term)[: n // 2], coarse.columns(term)[: n // 2], rtol=1e-9)
    assert [b.fitted for b in merged.bins.blocks] == [b.fitted for b in fine.bins.blocks]


def test_white_noise_and_a_unit_that_moves_are_left_as_they_are() -> None:
    run = gyro_run("rest", 4, duration=600.0, noise={"angle_random_walk": 1e-5}).recording
    problem = prepare(manifest(), (run,), (use(len(run)),), "gyro").problem
    fit = solve(problem, (Term(by_key("bias")),))
    assert doublings(problem, fit, ()) == 0
    assert doublings(problem, fit, (by_key("g_sensitivity"),)) == 0


def passed_low(seed: int, hertz: float) -> Floats:
    """White noise, half of it behind a low pass of the first order as chips have one, for a minute at 50 Hz."""
    rng = np.random.default_rng(seed)
    inner, own = rng.standard_normal((2, 3000))
    slow = sosfilt(butter(1, hertz, fs=50.0, output="sos"), inner) if hertz else inner
    return WHITE * (slow / slow.std() + own)


def merged_by(values: Floats) -> int:
    """How often means of a gyro at rest are to be merged."""
    run = Recording(
        np.arange(1.0, len(values) + 1) / 50.0, {"gyro_x": Channel(values, "rad/s")}, site=Site(gravity=9.8)
    )
    made = prepare(manifest(("gyro_x",), ("bias",)), (run,), (use(len(values)),), "gyro_x", tones=False, holds=False)
    return doublings(made.problem, solve(made.problem, made.model), ())


@pytest.mark.parametrize("hertz", [3.0, 5.0])
def test_noise_behind_a_low_pass_is_judged_on_longer_means(hertz: float) -> None:
    """No hump stands out of it; but its slope is flicker to the noise, which then hides every drift."""
    assert all(merged_by(passed_low(seed, hertz)) > 0 for seed in range(4))


def test_white_noise_and_a_walk_are_judged_on_short_ones() -> None:
    walks = (1e-2 * WHITE * np.cumsum(np.random.default_rng(seed).standard_normal(3000)) for seed in range(10))
    assert not any(merged_by(passed_low(seed, 0.0) + walk) for seed, walk in enumerate(walks))


#: Lines of a motor [Hz].
MOTOR = (20.3, 23.8, 27.1, 32.2, 36.7, 41.4)


def motor(seed: int, loud: float) -> Floats:
    """40 s of a gyro on a motor [rad/s]: a hum from 4 to 15 Hz, and lines of the shaft, whose phases do not hold."""
    rng = np.random.default_rng(seed)
    n = 4000
    band = butter(2, [4.0, 15.0], "bandpass", fs=RATE, output="sos")
    values = rng.standard_normal(n) + 5.0 * sosfilt(band, rng.standard_normal(n))
    for hertz in MOTOR:
        slip = np.cumsum(rng.standard_normal(n)) * np.sqrt(2 * np.pi * 0.3 / RATE)
        values = values + loud * np.cos(2 * np.pi * hertz * np.arange(n) / RATE + slip)
    return WHITE * values


@pytest.mark.parametrize("seed", [12, 13, 14])
def test_lines_of_a_motor_are_named_though_short_means_have_no_wave_of_them(tmp_path: Path, seed: int) -> None:
    """The noise of short means takes such lines in, and longer means have nothing of them."""
    found = closed(motor(seed, 8.0), tmp_path)
    named = [p.value for a in found.added if a.effect == "tone" for p in a.parameters if p.parameter == "f"]
    assert len(named) == len(found.added)
    assert all(min(abs(f - hertz) for hertz in MOTOR) < 0.4 for f in named)
    assert sum(min(abs(f - hertz) for f in named) < 0.4 for hertz in MOTOR) >= 5
    assert found.held_out.averaging > 0.1


@pytest.mark.parametrize("seed", [15, 16, 17, 18])
def test_a_motor_that_hums_in_a_band_has_no_line(tmp_path: Path, seed: int) -> None:
    assert closed(motor(seed, 0.0), tmp_path).added == ()


def test_half_of_a_hump_that_has_a_name_is_no_other_line() -> None:
    recording = Recording(T, {"gyro": Channel(hummed(0), "rad/s")}, label="run")
    problem = prepare(manifest(), (recording,), (use(T.size),), "gyro").problem
    found = Line(0, 7.76, 0.34, 0.0175, 1e-3, 0.0, steady=False, share=0.39, p_value=1e-9)
    assert unnamed(problem, (found,), (8.2,)) == ()
    assert [line.frequency for line in unnamed(problem, (found,), (8.5,))] == [7.76]


def test_rows_lost_here_and_there_leave_the_longer_means(tmp_path: Path) -> None:
    """One row of six is lost at random: none of the means over 32 rows was left."""
    rng = np.random.default_rng(11)
    there = (rng.random(T.size) > 1 / 6) & (T < 50.0)  # so short that a bin is a row
    slope = 30 * WHITE * np.sqrt(12 / (RATE * 50.0)) / 50.0
    np.savez(tmp_path / "rest.npz", t=T[there], gyro=(hummed(1) + slope * T)[there])
    (tmp_path / "rest.toml").write_text(
        'data = "rest.npz"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "gyro", unit = "rad/s" }\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    )
    found = close(tmp_path / "rest.toml").targets[0]
    assert [a.effect for a in found.added] == ["bias_drift"]
    told = found.added[0].parameters[0]
    assert abs(told.value - slope) < 4 * told.sd and slope > 3 * told.sd


def test_means_are_merged_no_further_than_the_model_can_be_fitted() -> None:
    run = gyro_run("rest", 4, duration=600.0, noise={"angle_random_walk": 1e-5}).recording
    model = (Term(by_key("bias")),)
    problem = prepare(manifest(averaging=4.0), (run,), (use(len(run)),), "gyro").problem
    assert sum(b.n for b in problem.fitted) == 89
    assert affordable(problem, model, 2) == 2
    assert affordable(problem, model, 8) == 3  # of 89 means 11 are left, and 5 once more


def test_a_line_of_longer_means_is_not_what_they_make_of_a_motor() -> None:
    """Means over 7.84 ms see 114.2 Hz, whose phase does not hold, at 13.4 Hz, as samples of such a wave do."""
    width, motor = 7.836e-3, 114.2
    wave = np.sin(2 * np.pi * motor * width * np.arange(400))
    peak = np.abs(np.fft.rfft(wave * np.hanning(400))).argmax() / 400 / width
    assert is_folded(Term(by_key("tone"), (float(peak),)), (motor,), width)
    assert not is_folded(Term(by_key("tone"), (float(peak) + 0.03 * motor,)), (motor,), width)
    assert not is_folded(Term(by_key("tone"), (float(peak),)), (), width)
    assert not is_folded(Term(by_key("bias_step"), (float(peak),)), (motor,), width)


def stand_out(values: Floats) -> tuple[bool, bool]:
    """Whether a peak of the first 60 % of values stands out of noise, by these alone and with the others."""
    first = 3 * len(values) // 5
    found = periodogram(values[:first], 1.0)
    alone, bar = heights(values[:first], found), np.log(BETWEEN * first / 2 / FALSE_ALARM)
    both = with_others(found, alone, 1.0, values[first:])
    return bool(alone[8:-8].max() > bar), bool(both[8:-8].max() > bar)


def test_a_line_that_held_out_rows_have_too_stands_out_with_them() -> None:
    """Where another axis shook, it was dropped in silence: 18 of 40 stood out by the fitted rows alone, 30 with both.

    Of 1000 runs of noise none has one; two of these 100 have a chance of 2e-4.
    """
    rng = np.random.default_rng(3)
    line = 0.4 * np.cos(2 * np.pi * 0.4152 * np.arange(973) + 1.0)
    alone, both = np.sum([stand_out(line + rng.standard_normal(line.size)) for _ in range(20)], axis=0)
    assert both >= alone + 3 and both >= 10
    assert sum(any(stand_out(rng.standard_normal(line.size))) for _ in range(100)) <= 1


@pytest.mark.parametrize(("size", "width"), [(0.0, 1.0), (0.25, 1.0), (0.25, 0.02)])
def test_a_hump_above_the_bin_rate_is_told_and_noise_has_none(size: float, width: float) -> None:
    """Microseism about 0.9 Hz, twice the noise beside it; bins that follow it are asked themselves.

    Of 60 draws of noise alone, through a mean of four rows, none is a hump: seven deviations, of 300 bands that may be.
    """
    rng, n, dt = np.random.default_rng(8), 30_000, 0.05
    f = np.fft.rfftfreq(n, dt)
    for _ in range(60 if not size else 1):
        band = np.fft.irfft(np.fft.rfft(rng.standard_normal(n)) * (np.abs(f - 0.9) < 0.1), n)
        x = rng.standard_normal(n) + size * band / band.std()
        spectrum = sample_spectrum(np.convolve(x, np.full(4, 0.25), "valid"), dt, (), width)
        assert spectrum is not None
        found = humps(spectrum)
        assert bool(found) is (size > 0 and width == 1.0)
    for low, high, times in found:
        assert 0.78 < low < 0.84 and 0.96 < high < 1.02 and 2.0 < times < 5.0
