"""Lines above the bin rate: found where they are, none where there is none."""

from dataclasses import replace

import numpy as np
import pytest
from motions import edges
from simulated_runs import DEG_PER_HOUR, closed, gyro_run, manifest, simulated_noise

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.prepare.spectral.lines import SAME_LINE, Line, find_lines, of_reference, quantum

DT = 0.01
N = 12_000
T = edges(N - 1, DT)


def white(seed: int, n: int = N) -> Floats:
    return np.random.default_rng(seed).standard_normal(n)


def lines(values: Floats, step: float = 0.0, lowest: float = 0.5) -> tuple[Line, ...]:
    return find_lines(T[: len(values)], DT, values, step, 0, lowest)


@pytest.mark.parametrize("frequency", [0.8137, 9.2, 29.9, 47.31])
@pytest.mark.parametrize("amplitude", [2.0, 30.0])
def test_a_line_is_found_where_it_is(frequency: float, amplitude: float) -> None:
    """Within five standard deviations: 8 cases of three, false alarm 1.4e-5."""
    phase = 1.1
    found = lines(white(1) + amplitude * np.cos(2 * np.pi * frequency * T + phase))
    assert len(found) == 1
    line = found[0]
    assert line.steady
    assert line.frequency_sd == pytest.approx(np.sqrt(6) / (np.pi * N * DT * amplitude) * np.sqrt(2 / N), rel=0.2)
    assert abs(line.frequency - frequency) < 5 * line.frequency_sd
    assert abs(line.amplitude - amplitude) < 5 * line.amplitude_sd
    # Phase at the first sample, correlated with the frequency: twice the deviation at the middle.
    assert abs(line.phase - phase) < 5 * 2 * line.amplitude_sd / amplitude
    assert line.p_value < 1e-4
    assert line.share == pytest.approx(amplitude**2 / (amplitude**2 + 2), rel=0.1)


def test_a_line_between_two_frequencies_is_found_as_often_as_one_at_either() -> None:
    """At half of its power it is 0.72 as tall at each of them: 9 of 40 such weak lines were found, 17 of the others."""
    n = 1024
    noise = [white(seed, n) for seed in range(40)]

    def found(at: float) -> int:
        weak = 0.3 * np.cos(2 * np.pi * at / (n * DT) * T[:n] + np.arange(40)[:, None])
        return sum(bool(lines(x + line, lowest=5.0)) for x, line in zip(noise, weak, strict=True))

    assert found(200.5) >= 0.75 * found(200.0) > 10


def test_a_weak_steady_line_is_steady() -> None:
    """Its amplitude is 23 times its standard deviation: one sinusoid takes it out."""
    found = lines(white(1) + 0.3 * np.cos(2 * np.pi * 47.31 * T + 1.1))
    assert [line.steady for line in found] == [True]
    assert found[0].frequency == pytest.approx(47.31, abs=0.002)
    assert found[0].amplitude == pytest.approx(0.3, abs=5 * found[0].amplitude_sd)


def test_a_steady_line_is_taken_out_by_its_own_sinusoid() -> None:
    noise = white(2)
    values = noise + 5 * np.sin(2 * np.pi * 17.77 * T)
    left = values - lines(values)[0].at(T)
    assert np.std(left) == pytest.approx(np.std(noise), rel=1e-3)


def test_a_line_that_wanders_is_one_line() -> None:
    """As a dithered laser gyro's may: by some hundredths of a hertz, in some tens of seconds."""
    offset = 0.04 * np.sin(2 * np.pi * T / 47) + 0.03 * np.sin(2 * np.pi * T / 19 + 1)
    found = lines(white(4) + 10 * np.cos(2 * np.pi * np.cumsum(19.0 + offset) * DT))
    assert [line.steady for line in found] == [False]
    assert found[0].frequency == pytest.approx(19.0, abs=0.1)
    assert found[0].amplitude == pytest.approx(10.0, rel=0.15)
    assert 0 < found[0].frequency_sd < SAME_LINE
    assert not found[0].at(T).any()


def test_several_lines_are_listed_strongest_first() -> None:
    values = white(5) + sum(a * np.sin(2 * np.pi * f * T) for a, f in ((1.0, 9.2), (4.0, 29.9), (2.0, 19.0)))
    assert [round(line.frequency, 1) for line in lines(values)] == [29.9, 19.0, 9.2]


def test_a_line_below_the_bin_rate_is_left_to_the_bins() -> None:
    values = white(6) + 3 * np.sin(2 * np.pi * 1.5 * T)
    assert len(lines(values, lowest=0.5)) == 1
    assert lines(values, lowest=2.0) == ()


@pytest.mark.parametrize("colour", ["white", "coloured"])
def test_noise_has_no_lines(colour: str) -> None:
    """1e-4 of a false line per recording; three or more in 300 have the probability 5e-6."""
    noise = {"angle_random_walk": 1.0}
    if colour == "coloured":
        noise |= {"bias_instability": 2.0, "rate_random_walk": 1.0}
    false = 0
    for seed in range(300):
        values = simulated_noise(noise, 4096, DT, np.random.default_rng(seed))
        false += bool(lines(values))
    assert false <= 2


def test_the_pattern_of_a_counter_is_no_line() -> None:
    """Whole pulses at a steady rate make a comb; without the step of the readings it would be listed."""
    pulse, rate = 1e-5, 3.21e-4
    angle = rate * DT * np.arange(N + 1) + 1e-7 * np.cumsum(white(7, N + 1)) * np.sqrt(DT)
    values = np.diff(np.floor(angle / pulse)) * pulse / DT
    step = quantum(values)
    assert step == pytest.approx(pulse / DT)
    assert lines(values, 0.0) != ()
    assert lines(values, step * DT) == ()


def rounded(sd: float, size: float, seed: int) -> Floats:
    """A rate read in whole counts, with noise of ``sd`` of them and a line of ``size`` near half the sampling rate."""
    return np.round(0.3 + sd * white(seed) + size * np.cos(2 * np.pi * 47.31 * T + 1.1))


def test_a_weak_line_in_noise_of_some_counts_is_listed() -> None:
    """A third of a count in two of noise, as an MPU has at a plate that shakes: no pattern of counts is as tall."""
    values = rounded(2.0, 0.35, 5)
    assert quantum(values) == 1.0
    assert [line.frequency for line in lines(values, DT)] == [pytest.approx(47.31, abs=0.01)]
    # Noise of less than a count leaves room for a pattern.
    assert lines(rounded(0.3, 0.35, 5), 0.0) != ()
    assert lines(rounded(0.3, 0.35, 5), DT) == ()


def test_counts_of_noise_alone_have_no_line() -> None:
    """One in ten thousand by chance: 60 recordings, whose rate falls anywhere between two counts."""
    assert not any(lines(rounded(1.0 + seed % 3, 0.0, seed), DT) for seed in range(60))


def test_a_line_larger_than_the_pulse_is_listed_all_the_same() -> None:
    pulse = 1e-5
    swing = 8 * pulse * np.sin(2 * np.pi * 9.2 * np.append(T, N * DT))
    angle = 3.21e-4 * DT * np.arange(N + 1) + swing
    values = np.diff(np.floor(angle / pulse)) * pulse / DT
    found = lines(values, quantum(values) * DT)
    assert found[0].frequency == pytest.approx(9.2, abs=0.01)
    assert all(line.amplitude < 0.2 * found[0].amplitude for line in found[1:])


@pytest.mark.parametrize("step", [1e-7, 0.25, 3.0])
def test_the_step_of_quantised_readings_is_found(step: float) -> None:
    values = np.round(10 * white(8)) * step
    assert quantum(values) == pytest.approx(step, rel=1e-6)


def test_readings_that_are_not_quantised_have_no_step() -> None:
    assert quantum(white(9)) == 0.0
    assert quantum(np.full(100, 3.0)) == 0.0


def test_too_short_a_stretch_has_no_lines() -> None:
    assert lines(10 * np.sin(2 * np.pi * 20 * T[:200])) == ()


def shaken(error: float, seed: int = 1) -> Recording:
    """A table that shakes at 1.3 Hz on top of a slow turn; 400 s at 25 Hz."""
    dt, n = 0.04, 10_000
    t = edges(n, dt)
    angle = 0.05 * t + 0.02 * np.sin(2 * np.pi * 1.3 * t) + 0.5 * np.sin(2 * np.pi * t / 50)
    rate = np.diff(angle) / dt
    rng = np.random.default_rng(seed)
    y = (1 + error) * rate + simulated_noise({"angle_random_walk": 0.5 * DEG_PER_HOUR}, n, dt, rng)
    channels = {
        "gyro": Channel(y, "rad/s", "interval"),
        "table_angle": Channel(angle[1:], "rad"),
        "table_rate": Channel(rate, "rad/s", "interval"),
    }
    return Recording(t[1:], channels)


@pytest.mark.parametrize("error", [0.0, 3e-4])
def test_commanded_motion_is_no_line(error: float) -> None:
    """Not as it is commanded, and not as the declared scale factor leaves it."""
    found = closed(shaken(error), manifest(averaging=2.0)).targets[0]
    assert [added.effect for added in found.added] == []


@pytest.mark.parametrize("kind", ["staircase", "reversal", "sine"])
def test_a_table_that_starts_and_stops_makes_no_lines(kind: str) -> None:
    found = closed(gyro_run(kind, 2, duration=1200.0).recording).targets[0]
    assert "tone" not in [added.effect for added in found.added]


def test_a_line_above_the_bin_rate_is_reported_as_a_tone_and_taken_out() -> None:
    run = gyro_run("rest", 4, duration=1200.0, noise={"angle_random_walk": 0.5 * DEG_PER_HOUR})
    gyro = run.recording.channels["gyro"]
    t = run.recording.t - run.recording.t[0]
    noisy = gyro.values + 60 * DEG_PER_HOUR * np.cos(2 * np.pi * 3.217 * t)
    shaking = replace(run.recording, channels={**run.recording.channels, "gyro": replace(gyro, values=noisy)})
    plain, found = closed(run.recording).targets[0], closed(shaking).targets[0]
    assert plain.added == ()
    assert [added.effect for added in found.added] == ["tone"]
    values = {p.parameter: p for p in found.added[0].parameters}
    assert abs(values["f"].value - 3.217) < 5 * values["f"].sd
    assert values["amplitude"].value == pytest.approx(60 * DEG_PER_HOUR, rel=0.02)
    assert found.held_out.after < found.held_out.before
    assert found.held_out.after == pytest.approx(plain.held_out.after, rel=0.02)
    assert found.verdict == "effects-found"


@pytest.mark.parametrize("ours", [True, False])
def test_a_line_of_the_reference_alone_is_none_of_the_readings(ours: bool) -> None:
    """Beside a table that turns there and back, both of them noisy; the line is 30 deviations of what is left tall.

    Of noise alone a tenth of the line's power is rarer than exp(-400).
    """
    rate, line = np.where((T // 20.0).astype(int) % 2, 0.5, -0.5), 0.03 * np.cos(2 * np.pi * 9.2 * T)
    reference = rate + 0.05 * white(3) + (0.0 if ours else line)
    reading = rate + 0.02 * white(4) + (line if ours else 0.0)
    assert of_reference(9.2, DT, reading - reference, reference) is not ours


@pytest.mark.parametrize("ours", [True, False])
def test_changes_of_the_motion_hide_no_line_of_the_reference(ours: bool) -> None:
    """A table that reverses each minute has power at each frequency: 8e-3 rad/s, the line is 1e-3 rad/s tall."""
    t = edges(239, 1.0)
    rate, line = np.where((t // 60.0).astype(int) % 2, 0.5, -0.5), 1e-3 * np.cos(2 * np.pi * 0.335 * t)
    reference = rate + 1e-4 * white(5, len(t)) + (0.0 if ours else line)
    reading = rate + 1e-5 * white(6, len(t)) + (line if ours else 0.0)
    assert of_reference(0.335, 1.0, reading - reference, reference) is not ours
