"""What several channels of a unit at rest have in common is no noise of each; what each has for itself may be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Recording
from insenv.identify.loop import trace

AXES = ("accel_x", "accel_y", "accel_z")
ROWS, HZ = 4000, 2.0


def said(seed: int, common: float, kind: str = "m/s^2") -> tuple[str, ...]:
    """What is said of three axes with walks of their own, and ``common`` times as much that all have."""
    rng = np.random.default_rng(seed)
    shared = common * np.cumsum(rng.standard_normal(ROWS))
    names = AXES if kind == "m/s^2" else tuple(name.replace("accel", "gyro") for name in AXES)
    channels = {}
    for name, sign in zip(names, (1.0, 1.0, -1.0), strict=True):
        walk = np.cumsum(rng.standard_normal(ROWS)) + sign * shared
        channels[name] = Channel(1e-3 * (rng.standard_normal(ROWS) + 0.05 * walk), kind)
    recording = Recording(np.arange(ROWS) / HZ, channels)
    model = manifest(declared=("bias",))
    model = replace(model, model=replace(model.model, targets=names, procedure="static"))
    return tuple(track.in_common for track in trace(model, (recording,), (use(ROWS),)).tracks)


@pytest.mark.parametrize("seed", range(3))
def test_what_all_axes_have_in_common_is_said_of_each(seed: int) -> None:
    told = said(seed, 3.0)
    assert all("wanders with that of" in each for each in told)
    assert "accel_y and accel_z" in told[0]


def test_axes_alone_have_nothing_in_common() -> None:
    # One of ten units has it by chance once in a hundred runs of this test.
    assert not any(any(said(seed, 0.0, "rad/s")) for seed in range(10))
