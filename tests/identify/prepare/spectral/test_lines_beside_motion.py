"""A line that wanders is not rejected at the price of the motion that tells of the instrument."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.prepare.lines_of_samples import tamed
from insenv.identify.prepare.problems import prepare
from insenv.identify.prepare.spectral.lines import find_lines, of_motion

DT = 0.01
N = 9000


@pytest.mark.parametrize(("hertz", "longest"), [(0.02, 5.0), (1.0, 0.3)])
def test_means_that_reject_a_line_keep_the_motion(hertz: float, longest: float) -> None:
    """A table that swings once a second, and a line that wanders about 9 Hz: its bins would be a swing long."""
    rng = np.random.default_rng(3)
    t: Floats = DT * np.arange(N, dtype=np.float64)
    omega = 2 * np.pi * hertz
    wander = 9.0 + 0.08 * np.sin(2 * np.pi * t / 17) + 0.05 * np.sin(2 * np.pi * t / 7)
    line = 0.3 * np.cos(2 * np.pi * np.cumsum(wander) * DT)
    gyro = np.cos(omega * t) + line + 0.05 * rng.standard_normal(N)
    channels = {
        "gyro": Channel(gyro, "rad/s", "instant"),
        "table_angle": Channel(np.sin(omega * t) / omega, "rad", "instant", source="encoder"),
    }
    run = Recording(t, channels)
    found = prepare(manifest(), (run,), (use(N, 0.6),), "gyro", holds=False, width=0.2)
    assert found.problem.bins.width <= longest
    assert any(not one.steady for one in found.lines) is (longest > 1)


def carried(seed: int, of_unit: float) -> Recording:
    """A unit that a walker turns to and fro: steps at 2.1 Hz, which the reference reads a tenth too large.

    ``of_unit`` is a line of the instrument at 11 Hz, where nothing moves.
    """
    rng = np.random.default_rng(seed)
    t: Floats = DT * np.arange(N, dtype=np.float64)
    wander = 2.1 + 0.004 * np.cumsum(rng.standard_normal(N)) / np.sqrt(N)
    step = 2 * np.pi * np.cumsum(wander) * DT
    slow = np.cumsum(rng.standard_normal(N)) * 0.02
    slow = np.convolve(slow, np.hanning(400) / np.hanning(400).sum(), "same")
    gyro = slow + 0.30 * np.cos(step) + of_unit * np.cos(2 * np.pi * 11.0 * t) + 0.02 * rng.standard_normal(N)
    angle = np.cumsum(slow + 0.33 * np.cos(step)) * DT
    channels = {
        "gyro": Channel(gyro, "rad/s", "instant"),
        "table_angle": Channel(angle, "rad", "instant", source="encoder"),
    }
    return Recording(t, channels)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_steps_of_who_carries_a_unit_are_no_line_of_it(seed: int) -> None:
    lines = [
        prepare(manifest(), (carried(seed, own),), (use(N, 0.6),), "gyro", holds=False, width=0.5).lines
        for own in (0.0, 0.03)
    ]
    assert lines[0] == ()
    assert [round(line.frequency) for line in lines[1]] == [11]


@pytest.mark.parametrize("amplitude", [0.0, 1.5])
def test_what_a_servo_leaves_of_jumps_again_and_again_is_no_line(amplitude: float) -> None:
    """Of a table that reverses every 37 rows: each multiple of that is a line of the samples, and none of the tame."""
    rng, n, dt = np.random.default_rng(3), 3000, 0.1
    t = dt * np.arange(float(n))
    left = rng.standard_normal(n) + amplitude * np.cos(2 * np.pi * 3.3 * t + 0.4)
    left[::37] += 40.0 * np.resize([1.0, -1.0], len(left[::37]))
    jumping, tame = (find_lines(t, dt, values, 0.0, 0, 1.0) for values in (left, tamed(left)))
    assert len(jumping) > 3
    assert [round(line.frequency, 2) for line in tame] == ([3.3] if amplitude else [])


@pytest.mark.parametrize(("share", "moved"), [(0.0, False), (0.05, False), (0.3, True), (1.0, True)])
def test_a_ripple_of_which_a_drive_leaves_a_third_is_one_of_the_motion(share: float, moved: bool) -> None:
    """36 to a turn at 100 deg/s, beside an encoder behind a filter; a twentieth may leak into it from what it reads."""
    rng, t = np.random.default_rng(4), DT * np.arange(N, dtype=np.float64)
    ripple = np.cos(2 * np.pi * 10.0 * t)
    left = ripple + 0.3 * rng.standard_normal(N)
    assert of_motion(10.0, DT, left, share * ripple + 0.01 * rng.standard_normal(N)) is moved
