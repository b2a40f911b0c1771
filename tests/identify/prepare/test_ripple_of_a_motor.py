"""A wave that is there while the table turns and not while it rests is none of what the gyro adds."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Recording
from insenv.data.reference import with_reference
from insenv.identify.fit.gls import solve
from insenv.identify.prepare.problems import prepare
from insenv.identify.prepare.spectral.lines import Line
from insenv.identify.prepare.spectral.wandering import each_turn, of_poles, stops_at_rest

RATE, SECONDS, FREQUENCY = 20.0, 300.0, 0.3


def stops(resting: float, rounded: float = 0.0) -> bool:
    """Of a table that rests for 60 s, with a share of the wave, and turns faster and faster; readings in steps."""
    t = np.arange(1, int(RATE * SECONDS)) / RATE
    command = np.where(t < 60.0, 0.0, 0.1 + 2e-4 * t)
    wave = 2e-4 * np.where(t < 60.0, resting, 1.0) * np.cos(2 * np.pi * FREQUENCY * t + 0.3)
    gyro = command + wave + 1e-4 * np.random.default_rng(2).standard_normal(len(t))
    read = np.round(gyro / rounded) * rounded if rounded else gyro
    channels = {"gyro": Channel(read, "rad/s"), "table_rate": Channel(command, "rad/s", source="command")}
    run = Recording(t, channels, label="run")
    ready = prepare(manifest(), (run,), (use(len(t)),), "gyro", tones=False, holds=False)
    return stops_at_rest(ready.problem, solve(ready.problem, ready.model), FREQUENCY)


@pytest.mark.parametrize(("resting", "found"), [(0.0, True), (0.7, False), (1.0, False)])
def test_a_wave_of_the_motion_stops_where_it_rests(resting: float, found: bool) -> None:
    """The amplitude at rest is known to 4e-6 rad/s, 2 % of the wave's."""
    assert stops(resting) is found


def test_rounding_at_rest_hides_a_wave_and_tells_nothing() -> None:
    """Steps of eight times the noise: at rest readings are nearly always zero."""
    assert not stops(1.0, rounded=8e-4)


@pytest.mark.parametrize(
    ("frequency", "steady", "found"),
    [(0.0556, True, True), (0.1667, True, True), (0.08, True, False), (0.0556, False, False)],
)
def test_a_line_comes_each_turn_of_a_table_that_turns_steadily(frequency: float, steady: bool, found: bool) -> None:
    """At 20 deg/s either way, or swinging: a magnet that warms up was a line whose phase does not hold."""
    t = np.arange(1, int(RATE * SECONDS)) / RATE
    rate = np.radians(20) * (np.sign(np.sin(2 * np.pi * t / 120)) if steady else np.sin(2 * np.pi * t / 120))
    angle = np.cumsum(rate) / RATE
    channels = {"gyro": Channel(rate, "rad/s"), "table_angle": Channel(angle, "rad", source="encoder")}
    run = with_reference(Recording(t, channels, label="run"))
    problem = prepare(manifest(), (run,), (use(len(t)),), "gyro", tones=False, holds=False).problem
    assert each_turn(problem, frequency) is found


@pytest.mark.parametrize(("frequency", "found"), [(3.0, True), (20.0 - 16.5, True), (3.27, False)])
def test_a_line_of_samples_is_one_of_poles_at_one_rate(frequency: float, found: bool) -> None:
    """At half a turn a second 6 and 33 to a turn, the latter too fast for 20 Hz; chance makes 1 % of others so."""
    t = np.arange(1, int(RATE * SECONDS)) / RATE
    rate = np.full(len(t), np.pi) * np.where(t < 150.0, 1.0, -1.0)
    channels = {"gyro": Channel(rate, "rad/s"), "table_rate": Channel(rate, "rad/s", source="encoder")}
    run = Recording(t, channels, label="run")
    problem = prepare(manifest(), (run,), (use(len(t)),), "gyro", tones=False, holds=False).problem
    line = Line(0, frequency, 1e-4, 1e-3, 1e-4, 0.0, True, 0.2, 1e-20)
    assert of_poles(problem, line, 1 / RATE) is found
