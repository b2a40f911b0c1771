"""Bins as long as it takes until a gain beside a coarse reference is that of longer ones."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Floats, Recording
from insenv.data.reference import with_reference
from insenv.data.renewals import with_renewals
from insenv.identify.findings import Estimate
from insenv.identify.fit.gls import solve
from insenv.identify.fit.uncertainty import estimates
from insenv.identify.prepare.declared import declared_model
from insenv.identify.prepare.means import by_means, of_known_errors
from insenv.identify.prepare.problems import prepare

STEP = np.deg2rad(0.1)


def wandering(rng: np.random.Generator, n: int, time: float, rms: float) -> Floats:
    """A slow rate [rad/s], rows of 10 ms."""
    rate = gaussian_filter1d(rng.standard_normal(n), time / 0.01)
    return np.asarray(rms * rate / rate.std())


def flight(seed: int) -> Recording:
    """A yaw that turns thrice by 20 mrad/s, in noisy steps of 0.1 deg at 12.5 Hz; the gyro reads some of the roll."""
    rng = np.random.default_rng(seed)
    n = 13000
    t: Floats = 0.01 * np.arange(n, dtype=np.float64)
    yaw, roll = wandering(rng, n, 6.0, 5e-4), wandering(rng, n, 2.0, 4e-2)
    for at, size in ((2500, 0.02), (5200, -0.015), (9000, 0.02)):  # turns of ten seconds
        yaw = yaw + size * np.exp(-0.5 * ((np.arange(n) - at) / 250.0) ** 2)
    gyro = 1.02 * yaw - 2e-3 + 0.01 * roll + 5e-4 * rng.standard_normal(n)
    angle = np.cumsum(yaw) * 0.01
    read = np.round((angle[::8] + 1.0 * STEP * rng.standard_normal(-(-n // 8))) / STEP) * STEP
    drawn = np.interp(t, t[::8], read)
    return Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(drawn, "rad", source="encoder")})


def told(seed: int) -> dict[str, Estimate]:
    run = with_reference(with_renewals(flight(seed)))
    prepared = prepare(manifest(), (run,), (use(len(run.t)),), "gyro", holds=False)
    fit = solve(prepared.problem, prepared.model)
    return {row.effect: row for rows in estimates(prepared.problem, fit).values() for row in rows}


def test_a_slow_turn_beside_a_coarse_angle_has_its_gain() -> None:
    """Means of 0.4 s, of which 200 are left, read 0.8 of such turns and said so to 0.035."""
    found = [told(seed) for seed in range(4)]
    off = np.array([(one["scale_factor"].value - 0.02, one["scale_factor"].sd) for one in found])
    assert np.sqrt(np.mean((off[:, 0] / off[:, 1]) ** 2)) < 2.2
    assert np.mean(np.abs(off[:, 0])) < 0.1
    assert all(abs(one["bias"].value + 2e-3) < 4 * one["bias"].sd for one in found)


def course(seed: int) -> Recording:
    """A car that turns now and then, its course of once a second on straight lines; the gyro has a bias."""
    rng = np.random.default_rng(seed)
    n, dt = 12_000, 0.025
    t: Floats = dt * np.arange(n, dtype=np.float64)
    rate, at = np.zeros(n), 0.0
    while at < t[-1]:
        at, lasts = at + rng.uniform(3, 15), rng.uniform(2, 6)
        inside = (t > at) & (t < at + lasts)
        turn = rng.choice([-1, 1]) * rng.uniform(0.15, 0.5)
        rate[inside] += turn * np.sin(np.pi * (t[inside] - at) / lasts) ** 2
        at += lasts
    fixes = np.arange(-0.5, t[-1] + 1.0, 1.0) + 0.013
    read = np.interp(fixes, t, np.cumsum(rate) * dt) + 0.01 * rng.standard_normal(len(fixes))
    gyro = rate + 3e-3 + 5e-3 * rng.standard_normal(n)
    drawn = np.interp(t, fixes, read)
    return Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(drawn, "rad", source="encoder")})


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_gain_beside_a_course_of_once_a_second_is_that_of_means_over_fixes(seed: int) -> None:
    """In means of 0.1 s it was 0.70 +- 0.09, and a skew was named."""
    run = with_reference(with_renewals(course(seed)))
    prepared = prepare(manifest(), (run,), (use(len(run.t)),), "gyro", holds=False)
    fit = solve(prepared.problem, prepared.model)
    told = {row.effect: row for rows in estimates(prepared.problem, fit).values() for row in rows}
    assert abs(told["scale_factor"].value) < 0.01
    assert abs(told["bias"].value - 3e-3) < 5e-4


def test_however_gains_differ_bins_keep_half_of_the_motion() -> None:
    """A thigh that swings once a second: gains in bins as long as a stride may agree, and tell nothing."""
    t: Floats = 0.01 * np.arange(9000, dtype=np.float64)
    gyro = 2.0 * np.cos(2 * np.pi * t) + 0.05 * np.random.default_rng(1).standard_normal(len(t))
    angle = np.sin(2 * np.pi * t) / np.pi
    run = Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(angle, "rad", source="encoder")})
    asked, uses = manifest(), (use(len(t)),)
    gains = of_known_errors(by_means(asked, (run,), uses, "gyro", 5, declared_model(asked, (run,), "gyro"))).gains
    assert gains[-1][0] == 40  # a mean over T keeps sinc(T f)^2 of the power: 0.57 at 0.4 s, 0.05 at 0.8 s


def drawn_course(seed: int) -> Recording:
    """A robot that turns all the time beside the course of its positions, five a second with straight lines between."""
    rng = np.random.default_rng(seed)
    n, dt = 6000, 0.107
    t: Floats = dt * np.arange(n, dtype=np.float64)
    rate = gaussian_filter1d(rng.standard_normal(n), 30)
    rate *= 0.3 / rate.std()
    fixes = np.arange(-0.2, t[-1] + 0.2, 0.2)
    course = np.interp(fixes, t, np.cumsum(rate) * dt) + 0.1 * rng.standard_normal(len(fixes))
    gyro = 1.01 * rate + 3e-3 + 2e-3 * rng.standard_normal(n)
    angle = Channel(np.interp(t, fixes, course), "rad", source="encoder")
    return Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_angle": angle})


@pytest.mark.parametrize("seed", [1, 2])
def test_a_gain_beside_errors_that_nobody_knows_of_is_that_of_longer_means(seed: int) -> None:
    """Means of a few rows read hardly any of the motion, which the fitted noise took for its own walk."""
    run = drawn_course(seed)
    prepared = prepare(manifest(), (run,), (use(len(run.t)),), "gyro", holds=False)
    fit = solve(prepared.problem, prepared.model)
    told = {row.effect: row for rows in estimates(prepared.problem, fit).values() for row in rows}
    assert abs(told["scale_factor"].value - 0.01) < 4 * told["scale_factor"].sd
