"""What a table's motor and servo make of its motion is no effect of the gyro on it."""

from __future__ import annotations

from typing import Literal

import numpy as np
from simulated_runs import closed, manifest, use

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.findings import TargetFindings
from insenv.identify.fit.gls import solve
from insenv.identify.prepare.problems import prepare
from insenv.identify.prepare.spectral.wandering import moves_there

RATE, SECONDS = 100.0, 60.0
FINE = 1e-3


def read(x: Floats, late: float = 0.0) -> Floats:
    """A motion at fine times by a reading at `RATE`, behind a filter of the first order."""
    if late:
        x = x.copy()
        kept = np.exp(-FINE / late)
        for k in range(1, len(x)):
            x[k] = kept * x[k - 1] + (1 - kept) * x[k]
    return x[:: round(1 / RATE / FINE)]


def run(gyro: Floats, reference: Floats, source: Literal["encoder", "command"]) -> Recording:
    """A gyro of 2 mrad/s a row beside a rate."""
    noise = 2e-3 * np.random.default_rng(1).standard_normal(len(gyro))
    t = np.arange(1, len(gyro) + 1) / RATE
    channels = {
        "gyro": Channel(gyro + noise, "rad/s", "instant"),
        "table_rate": Channel(reference, "rad/s", "instant", source=source),
    }
    return Recording(t, channels, label="run")


def test_a_motors_ripple_is_no_line_of_the_gyro() -> None:
    """Of 36 poles at 0.52 rad/s to and fro 3 Hz, of which the drive's filter leaves a quarter; 7 Hz are the gyro's."""
    t = np.arange(0.0, SECONDS, FINE)
    rate = np.convolve(0.52 * np.sign(np.mod(t / 20.0, 2.0) - 1.0), np.full(500, 2e-3), "same")
    rate = rate * (1 + 0.02 * np.cos(36 * np.cumsum(rate) * FINE))
    gyro = read(rate + 3e-3 * np.cos(2 * np.pi * 7.0 * t))
    rippled = run(gyro, read(rate, 0.015), "encoder")
    ready = prepare(manifest(), (rippled,), (use(len(gyro)),), "gyro", tones=False, holds=False)
    fit = solve(ready.problem, ready.model)
    strongest = 36 * 0.52 / (2 * np.pi)
    assert moves_there(ready.problem, fit, strongest)
    assert not moves_there(ready.problem, fit, 7.0)


def swung(scale: float) -> TargetFindings:
    """A table told to swing at 0.3 Hz by a servo of the second order, 6 Hz and damped by 0.92; a bias is declared."""
    t = np.arange(0.0, SECONDS, FINE)
    told = 0.35 * np.sin(2 * np.pi * 0.3 * t)
    own, damping = 2 * np.pi * 6.0, 0.92
    rate, speed = np.zeros(len(t)), 0.0
    for k in range(1, len(t)):
        speed += FINE * (own**2 * (told[k - 1] - rate[k - 1]) - 2 * damping * own * speed)
        rate[k] = rate[k - 1] + FINE * speed
    swings = run(read((1 + scale) * rate), read(told), "command")
    (target,) = closed(swings, manifest(("gyro",), ("bias",))).targets
    return target


def test_a_servo_that_swings_less_than_it_is_told_is_no_scale_factor() -> None:
    """By 0.2 %, which was stated; ten times as much is the gyro's."""
    assert "scale_factor" not in [one.effect for one in swung(0.0).added]
    assert "scale_factor" in [one.effect for one in swung(-0.02).added]
