"""A line whose phase does not hold is one line with one name; one that holds is a tone; what is no line has no name."""

from __future__ import annotations

import numpy as np
import pytest
from motions import edges
from simulated_runs import DEG_PER_HOUR, closed, gyro_run, manifest

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.prepare.spectral.lines import find_lines

DT, N = 0.01, 60_000
T = edges(N - 1, DT)


def wandering(frequency: float, walk: float, seed: int, t: Floats) -> Floats:
    """A wave of amplitude 1 whose frequency is held to its mean and walks about it, in a few seconds."""
    rng, dt = np.random.default_rng(seed), float(t[1] - t[0])
    rho = np.exp(-dt / 5.0)
    z = rng.standard_normal(len(t)) * np.sqrt(1 - rho**2)
    offset = np.empty(len(t))
    offset[0] = rng.standard_normal()
    for i in range(1, len(t)):
        offset[i] = rho * offset[i - 1] + z[i]
    return np.cos(2 * np.pi * np.cumsum(frequency + walk * offset) * dt)


@pytest.mark.parametrize("walk", [0.05, 0.1, 0.15])
@pytest.mark.parametrize("seed", range(3))
def test_a_wide_line_is_one_line(walk: float, seed: int) -> None:
    """33.1, 33.4 and 33.5 Hz were three."""
    noise = np.random.default_rng(50 + seed).standard_normal(N)
    found = find_lines(T, DT, noise + 3 * wandering(33.3, walk, seed, T), 0.0, 0, 0.5)
    assert [line.steady for line in found] == [False]
    assert abs(found[0].frequency - 33.3) < 0.15
    assert found[0].amplitude == pytest.approx(3.0, rel=0.15)


@pytest.mark.parametrize("seed", range(4))
def test_a_frequency_is_told_within_its_resolution(seed: int) -> None:
    """Something short in the samples has a peak, and no sinusoid: no frequency of 34 +- 340 Hz."""
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(N)
    at = int(rng.integers(1000, N - 1000))
    values[at : at + 300] += 40 * np.cos(2 * np.pi * 34.0 * T[:300])
    for line in find_lines(T, DT, values, 0.0, 0, 0.5):
        assert line.frequency_sd < max(1.0 / (N * DT), 0.1 * line.frequency)


def resting(wave: Floats, dt: float, seed: int) -> Recording:
    run = gyro_run("rest", seed, duration=len(wave) * dt, dt=dt, noise={"angle_random_walk": 0.5 * DEG_PER_HOUR})
    gyro = run.recording.channels["gyro"]
    return Recording(run.recording.t, {"gyro": Channel(gyro.values + wave, "rad/s", "interval")})


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("walk", [0.004, 0.02])
def test_a_line_of_the_bins_that_wanders_has_one_name(seed: int, walk: float) -> None:
    dt = 0.1
    t = edges(12_000 - 1, dt)
    found = closed(resting(1.5e-5 * wandering(0.56, walk, seed, t), dt, seed), manifest(declared=("bias",))).targets[0]
    assert [a.effect for a in found.added] == ["tone"]
    f, amplitude = found.added[0].parameters
    assert abs(f.value - 0.56) < 4 * max(walk, 2e-3)
    assert amplitude.value == pytest.approx(1.5e-5, rel=0.3)
    assert "phase does not hold" in found.added[0].remark
    assert found.held_out.after < 1.1 * found.held_out.noise_floor


@pytest.mark.parametrize("seed", [0, 1])
def test_a_line_of_the_bins_that_holds_is_a_tone_with_a_phase(seed: int) -> None:
    dt = 0.1
    t = edges(12_000 - 1, dt)
    found = closed(resting(4e-5 * np.cos(2 * np.pi * 0.56 * t), dt, seed), manifest(declared=("bias",))).targets[0]
    assert [a.effect for a in found.added] == ["tone"]
    assert {p.parameter for p in found.added[0].parameters} == {"c", "s", "f"}
    assert found.held_out.after < 0.9 * found.held_out.before
