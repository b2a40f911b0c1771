"""A line of the instrument where the motion has power as well, beside an angle that is read in steps."""

from __future__ import annotations

import numpy as np
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Recording
from insenv.data.reference import with_reference
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Problem
from insenv.identify.prepare.problems import prepare
from insenv.identify.prepare.spectral.wandering import of_counts

RATE, SECONDS = 20.0, 660.0


def left_beside(line: float, frequency: float, bits: int = 14) -> bool:
    """Whether what is left at a frequency is taken for the steps' own, of a table on ramps and a gyro with a line."""
    t = np.arange(1, int(RATE * SECONDS)) / RATE
    fine = np.arange(0.0, SECONDS, 1e-2)
    rate = 0.17 * (2 * np.abs(np.mod(fine / 110.0, 2.0) - 1.0) - 1.0)
    angle = np.interp(t, fine, np.append(0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1]))) * 1e-2)
    noise = 1e-5 * np.random.default_rng(1).standard_normal(len(t))
    gyro = np.interp(t, fine, rate) + noise + line * np.cos(2 * np.pi * frequency * t)
    step = 2 * np.pi / 2**bits
    read = np.floor(angle / step) * step
    channels = {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(read, "rad", source="encoder")}
    run = with_reference(Recording(t, channels, label="run"))
    ready = prepare(manifest(), (run,), (use(len(t)),), "gyro", tones=False, holds=False)
    problem: Problem = ready.problem
    return of_counts(problem, solve(problem, ready.model), frequency) is not None


def test_a_slow_line_of_the_instrument_is_none_of_the_steps() -> None:
    """27 deg/h: a line of 21 deviations was taken for the steps', which may be as tall, and left out without a word."""
    assert not any(left_beside(1.3e-4, frequency) for frequency in (0.15, 0.2))


def test_a_line_that_the_reference_does_not_have_is_none_of_its_steps() -> None:
    """Steps of 12 bits make lines at each frequency somewhere; at that of the gyro's the reference has none."""
    assert not left_beside(5e-4, 0.92, bits=12)
