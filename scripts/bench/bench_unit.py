"""The bench's line for the whole unit on its table: the vector form beside the single form, steps of 500 samples."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np
from bench_line import Line

from insenv.core.recording import Floats
from insenv.systems.system_calibration.env import SystemCalibrationEnv, SystemCalibrationVectorEnv

VECTOR, STEPS, EPISODES = 64, 12, 12


def stepping() -> Iterator[Line]:
    """Turns and rests in turn; the episodes of both alternate, so that what else the machine does falls on both."""
    native, single = SystemCalibrationVectorEnv(num_envs=VECTOR), SystemCalibrationEnv()
    actions = np.tile([0.25, -0.25, 1.0, 0.03, 0.0], (VECTOR, 1))
    ours, theirs = (
        min(times) for times in zip(*(_both(native, single, actions) for _ in range(EPISODES)), strict=True)
    )
    yield Line(
        f"SystemCalibration-v0, vector form, {VECTOR} rows, steps",
        f"{VECTOR / ours / 1e3:.1f} k/s",
        ">= 5 x single",
        "the single form",
        f"{1e-3 / theirs:.1f} k/s",
        VECTOR * theirs / ours,
    )


def _both(native: SystemCalibrationVectorEnv, single: SystemCalibrationEnv, actions: Floats) -> tuple[float, float]:
    """CPU time of a step of each [s]."""
    return _episode(native.reset, lambda: native.step(actions)), _episode(single.reset, lambda: single.step(actions[0]))


def _episode(reset: Callable[..., object], step: Callable[[], object]) -> float:
    reset(seed=0)
    start = time.process_time()
    for _ in range(STEPS):
        step()
    return (time.process_time() - start) / STEPS


ALL = (stepping,)
