"""A dithered laser gyro at rest: once its loud lines are rejected, others that they hid are most of what means hold."""

from __future__ import annotations

import numpy as np
from simulated_runs import closed, manifest

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.findings import TargetFindings

HZ, DURATION, WHITE = 64.0, 300.0, 3e-7
#: Lines: frequency [Hz], amplitude [rad/s] and by how much the frequency wanders [Hz].
LINES = ((29.9, 9e-4, 0.02), (9.19, 5e-4, 0.015), (20.8, 2e-4, 0.02), (4.17, 3e-5, 0.03), (2.9, 1e-5, 0.03))


def at_rest(seed: int, warm_up: float = 0.0) -> TargetFindings:
    """The loop on the gyro, of which ``warm_up`` [rad/s] settles in 40 s."""
    rng = np.random.default_rng(seed)
    t: Floats = np.arange(round(DURATION * HZ)) / HZ
    read = WHITE * np.sqrt(HZ) * rng.standard_normal(len(t)) + warm_up * np.exp(-t / 40)
    for frequency, amplitude, wanders in LINES:
        slow = np.interp(t, np.arange(0, DURATION + 10, 5.0), rng.standard_normal(62))
        read += amplitude * np.sin(2 * np.pi * np.cumsum(frequency + wanders * slow) / HZ)
    recording = Recording(t, {"gyro": Channel(read, "rad/s")}, label="a")
    (found,) = closed(recording, manifest(declared=("bias",))).targets
    return found


def noise(found: TargetFindings) -> float:
    return next((n.value for n in found.noise if n.effect == "angle_random_walk"), 0.0)


def test_the_noise_is_that_of_the_gyro_and_not_what_lines_leave() -> None:
    """But for the window that rejects them, which weighs the middle of each mean most."""
    for seed in (1, 2):
        found = at_rest(seed)
        assert noise(found) < 2 * WHITE
        assert found.verdict == "effects-found" and {one.effect for one in found.added} == {"tone"}


def test_a_warm_up_of_a_thousandth_of_the_dither_is_seen() -> None:
    names = {one.effect for one in at_rest(3, warm_up=1.5e-6).added}
    assert "bias_warm_up" in names
