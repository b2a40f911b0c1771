"""Knocks: for a second a unit at rest rings, and what is left of that in the fit makes the noise louder and slower."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Floats, Recording, Site
from insenv.identify.clean.knocks import knocks
from insenv.identify.fit.gls import solve
from insenv.identify.prepare.problems import prepare

RATE, SECONDS, WHITE = 50.0, 60.0, 1e-3


def rest(seed: int, touched: tuple[float, ...] = (), height: float = 7.0, tails: float = np.inf) -> Recording:
    """A gyro at rest for a minute, that rings from each instant on for some tenths of a second."""
    rng = np.random.default_rng(seed)
    t = np.arange(1.0, SECONDS * RATE + 1) / RATE
    noise = rng.standard_normal(len(t)) if np.isinf(tails) else rng.standard_t(tails, len(t))
    return recorded(t, WHITE * (noise + sum((ringing(t - at, height) for at in touched), np.zeros(len(t)))))


def ringing(t: Floats, height: float) -> Floats:
    """What dies away at 2 Hz after an instant, in deviations of the noise."""
    return np.where(t > 0, height * np.sin(4 * np.pi * t) * np.exp(-np.maximum(t, 0.0) / 0.25), 0.0)


def recorded(t: Floats, values: Floats) -> Recording:
    """A gyro of a unit at rest."""
    return Recording(t, {"gyro_x": Channel(values, "rad/s")}, site=Site(gravity=9.8), label="touched")


def test_a_touch_is_found_where_it_is_and_nothing_else() -> None:
    for seed in range(10):
        first, second = knocks(rest(seed, (0.0, 20.1), 30.0), "gyro_x")
        assert first.start == 0
        assert second.start <= 20.1 * RATE + 5 < second.stop
        assert max(first.stop - first.start, second.stop - second.start) <= 2 * RATE


def test_noise_and_its_tails_are_none() -> None:
    assert not any(knocks(rest(seed), "gyro_x") for seed in range(20))
    assert not any(knocks(rest(seed, tails=5.0), "gyro_x") for seed in range(20))


def test_what_lasts_or_comes_all_the_time_is_how_the_unit_is() -> None:
    t = np.arange(1.0, SECONDS * RATE + 1) / RATE
    noise = np.random.default_rng(1).standard_normal(len(t))
    assert knocks(recorded(t, noise * np.where(t > 50, 8.0, 1.0)), "gyro_x") == ()
    assert knocks(rest(1, tuple(np.arange(0.0, 60.0, 4.0)), 30.0), "gyro_x") == ()


def test_a_touch_is_found_in_twelve_seconds_as_well() -> None:
    t: Floats = np.arange(1.0, 1201.0) / 100.0
    for seed in range(10):
        noise = np.random.default_rng(seed).standard_normal(len(t))
        (found,) = knocks(recorded(t, noise + ringing(t - 5.0, 40.0)), "gyro_x")
        assert 470 <= found.start <= 505 < found.stop <= 700
        assert knocks(recorded(t, noise), "gyro_x") == ()


@pytest.mark.parametrize("rate", [50.0, 16.0])
def test_a_burst_of_noise_of_a_twentieth_of_the_run_is_an_event(rate: float) -> None:
    """Eight times as loud for 3 s of a minute: too long for a knock, and no mean leaves its level. It was not told."""
    t: Floats = np.arange(1.0, SECONDS * rate + 1) / rate
    noise = np.random.default_rng(2).standard_normal(len(t))
    (found,) = knocks(recorded(t, noise * np.where((t > 40) & (t < 43), 8.0, 1.0)), "gyro_x")
    assert found.cause == "burst"
    assert found.start <= 40 * rate + 1 and 43 * rate - 2 <= found.stop
    assert found.stop - found.start < 5 * rate


@pytest.mark.parametrize("touched", [(0.0,), (0.0, 3.0)])
def test_the_noise_is_that_of_the_rest(touched: tuple[float, ...]) -> None:
    """With what outliers leave of one touch there is no white noise any more, and flicker as large as its deviation."""
    run = rest(5, touched, 30.0)
    problem = prepare(manifest(("gyro_x",), ("bias",)), (run,), (use(len(run)),), "gyro_x", False, False)
    fit = solve(problem.problem, problem.model)
    white, flicker = np.sqrt(fit.noise.power[:2])
    assert white == pytest.approx(WHITE / np.sqrt(RATE), rel=0.05)
    assert flicker < 0.3 * WHITE


@pytest.mark.parametrize("shaken", ["xy", "x"])
def test_what_two_axes_of_a_triad_show_is_a_knock_on_the_third(shaken: str) -> None:
    """Of the last axis a rest of it stayed in the noise. What shakes another triad may be what moves a bias."""
    t = np.arange(1.0, SECONDS * RATE + 1) / RATE
    rng = np.random.default_rng(6)
    channels: dict[str, Channel] = {}
    for axis in "xyz":
        values = WHITE * (rng.standard_normal(len(t)) + ringing(t - 20.1, 40.0 * (axis in shaken)))
        channels |= {f"accel_{axis}": Channel(values, "m/s^2")}
        channels |= {f"gyro_{axis}": Channel(WHITE * rng.standard_normal(len(t)), "rad/s")}
    unit = Recording(t, channels, site=Site(gravity=9.8), label="touched")
    assert bool(knocks(unit, "accel_z")) == (shaken == "xy")
    assert not knocks(unit, "gyro_z")
