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
