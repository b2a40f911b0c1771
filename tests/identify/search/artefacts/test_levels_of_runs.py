"""The soaks of a chamber, and the rates of a table, with a file each: a run is one number, and numbers scatter.

Generated with NumPy; seeds are fixed. Of six tests whose biases come back to 0.01 deg/s and depend on nothing none may
name a law: each does by chance in less than 1 %.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.findings import TargetFindings

DEG = np.deg2rad(1.0)
TEMPERATURES = 298.15 + np.array([-60.0, -50, -40, -30, -20, -10, 0, 10, 20, 30, 40])
RATES = np.deg2rad([0.0, 10, -10, 30, -30, 60, -60, 100, -100, 150, -150])
#: Angle random walk [rad/sqrt(s)]; how exact a minute makes a level: 0.0004 deg/s.
WHITE = 3e-3 * DEG
T = 0.1 * np.arange(1.0, 601.0)

Law = Callable[[Floats, int], Floats]


def soaks(law: Law, seed: int, repeats_to: float = 0.0) -> TargetFindings:
    """A gyro at rest, a minute at each temperature; ``law`` of the excess over 25 degC [K] and the run, in rad/s."""
    rng, runs = np.random.default_rng(seed), []
    for k, heat in enumerate(TEMPERATURES):
        kelvins = heat + 0.3 * rng.standard_normal() + 0.1 * np.sin(T / 9 + 6 * rng.random())
        level = 0.5 * DEG + law(kelvins - 298.15, k) + repeats_to * rng.standard_normal()
        y = level + WHITE * rng.standard_normal(len(T)) / np.sqrt(0.1)
        channels = {"gyro": Channel(y, "rad/s", "interval"), "temperature": Channel(kelvins, "K")}
        runs.append(Recording(T, channels, label=f"{heat:g}"))
    return closed(tuple(runs), manifest(declared=("bias",))).targets[0]


def rates(extra: Floats, seed: int) -> TargetFindings:
    """A gyro on a table, a minute at each rate, whose bias is larger by ``extra`` in each run [rad/s]."""
    rng, runs = np.random.default_rng(seed), []
    for rate, more in zip(RATES, extra, strict=True):
        y = 1.003 * rate + 0.4 * DEG + more + WHITE * rng.standard_normal(len(T)) / np.sqrt(0.1)
        command = Channel(np.full(len(T), rate), "rad/s", "interval", source="command")
        runs.append(Recording(T, {"gyro": Channel(y, "rad/s", "interval"), "table_rate": command}, label=f"{rate:g}"))
    return closed(tuple(runs), manifest(declared=("bias", "scale_factor"))).targets[0]


def off_by(extra: float, run: int, runs: int) -> Floats:
    """Nothing but in one run."""
    return np.where(np.arange(runs) == run, extra, 0.0)


@pytest.mark.parametrize(("order", "c"), [(1, 1e-4), (2, 4e-6), (3, 1e-7)])
def test_a_law_of_the_temperature_stands_between_soaks(order: int, c: float) -> None:
    """Of one order or a higher one that noise suggests, its coefficients those of the law."""
    found = soaks(lambda kelvins, _: c * DEG * kelvins**order, seed=1)
    (added,) = found.added
    assert added.effect == "bias_temperature" and (added.order or 0) >= order and not found.reasons
    for power, size in enumerate(added.parameters, start=1):
        assert abs(size.value - c * DEG * (power == order)) < 4 * size.sd
    assert found.held_out.after < found.held_out.before


def test_soaks_that_depend_on_nothing_name_nothing() -> None:
    assert soaks(lambda kelvins, _: 0 * kelvins, seed=1).verdict == "nothing-significant"


@pytest.mark.slow
def test_biases_that_come_back_badly_are_no_law_of_the_temperature() -> None:
    for seed in range(6):
        found = soaks(lambda kelvins, _: 0 * kelvins, seed, repeats_to=0.01 * DEG)
        assert (found.added, found.verdict) == ((), "unexplained-structure")
        assert any("not the same in the runs" in reason for reason in found.reasons)


@pytest.mark.slow
def test_a_coefficient_is_as_uncertain_as_the_runs_scatter() -> None:
    """Five of 8 sd: chi-square on as many degrees is below 20.5 in 99.9 %; by noise within runs it was 100."""
    c, z = 8e-4 * DEG, []
    for seed in range(5):
        added = soaks(lambda kelvins, _: c * kelvins, seed, repeats_to=0.01 * DEG).added
        (size, *_) = added[0].parameters
        assert added[0].effect == "bias_temperature"
        z.append((size.value - c) / size.sd)
    assert np.sum(np.square(z)) < 20.5


def test_one_run_that_is_off_is_named() -> None:
    """Beside a law of the others, of soaks; beside a scale factor, of rates."""
    soaked = soaks(lambda kelvins, k: DEG * (1e-4 * kelvins + 0.03 * (k == 4)), seed=1)
    turned = rates(off_by(0.15 * DEG, 6, len(RATES)), seed=1)
    assert any("run 5 (278.15) is off by" in reason and "the others agree" in reason for reason in soaked.reasons)
    assert any("run 7 (-1.0472) is off by" in reason and "the others agree" in reason for reason in turned.reasons)
    assert not turned.added


def test_rates_whose_biases_agree_say_nothing() -> None:
    assert rates(np.zeros(len(RATES)), seed=1).verdict == "nothing-significant"


def test_a_drift_over_the_test_is_said_to_go_one_way() -> None:
    """Rates that were run in their order make an asymmetry of it, which is named under that doubt."""
    found = rates(2e-3 * DEG * np.arange(len(RATES)), seed=1)
    assert any("go one way from run to run" in reason for reason in found.reasons)


def staircases(gain: Callable[[float], float], repeats_to: float, seed: int) -> TargetFindings:
    """A staircase of rates at each of six temperatures, by an encoder; ``gain`` of the excess over 25 degC [K]."""
    rng, dt, runs = np.random.default_rng(seed), 0.05, []
    steps = np.deg2rad(np.repeat([0.0, 20, -20, 50, -50, 100, -100, 0], 240))
    rate = np.convolve(np.pad(steps, (0, 19), "edge"), np.full(20, 0.05), "valid")
    t, angle = dt * np.arange(1.0, len(rate) + 1), np.cumsum(rate) * dt
    for heat in TEMPERATURES[::2]:
        own = 1.002 + gain(heat - 298.15) + repeats_to * rng.standard_normal()
        y = 0.1 * DEG + own * rate + 0.02 * DEG * rng.standard_normal(len(t))
        channels = {
            "gyro": Channel(y, "rad/s", "interval"),
            "table_angle": Channel(angle + 1e-5 * rng.standard_normal(len(t)), "rad", source="encoder"),
            "temperature": Channel(heat + 0.2 * np.sin(t / 20), "K"),
        }
        runs.append(Recording(t, channels, label=f"{heat:g}"))
    return closed(tuple(runs), manifest(declared=("bias", "scale_factor"))).targets[0]


def test_a_gain_over_the_temperature_stands_between_staircases() -> None:
    """It was not told beside a gain of its own in each run, which is all that it is."""
    found = staircases(lambda kelvins: 2e-5 * kelvins, 0.0, seed=1)
    size = {added.effect: added.parameters[0] for added in found.added}["scale_factor_temperature"]
    assert found.verdict == "effects-found" and abs(size.value - 2e-5) < 4 * size.sd < 2e-5


def test_gains_that_come_back_badly_are_no_law_of_the_temperature() -> None:
    """Of two tests each names one by chance in less than 1 %."""
    for seed in (1, 2):
        found = staircases(lambda _: 0.0, 5e-4, seed)
        assert "scale_factor_temperature" not in {added.effect for added in found.added}
        assert any("the gain is not the same in the runs" in reason for reason in found.reasons)
