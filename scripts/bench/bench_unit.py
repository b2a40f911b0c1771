"""The bench's line for the whole unit on its table: the vector form beside the single form, steps of 100 samples."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
from bench_environments import step_time
from bench_line import Line

from insenv.core.recording import Floats
from insenv.systems.system_calibration.env import SystemCalibrationEnv, SystemCalibrationVectorEnv

VECTOR, STEPS = 64, 100


def stepping() -> Iterator[Line]:
    """Turns and rests in turn."""
    native = SystemCalibrationVectorEnv(num_envs=VECTOR, step_s=1.0)
    actions = np.tile([0.25, -0.25, 1.0, 0.03, 0.0], (VECTOR, 1))
    ours, theirs = VECTOR / step_time(native, actions, STEPS), 1 / _single(actions[0])
    yield Line(
        f"SystemCalibration-v0, vector form, {VECTOR} rows, steps",
        f"{ours / 1e3:.1f} k/s",
        ">= 5 x single",
        "the single form",
        f"{theirs / 1e3:.1f} k/s",
        ours / theirs,
    )


def _single(action: Floats) -> float:
    env, means = SystemCalibrationEnv(step_s=1.0), []
    for _ in range(6):
        env.reset(seed=0)
        start = time.process_time()
        for _ in range(STEPS):
            env.step(action)
        means.append((time.process_time() - start) / STEPS)
    return min(means)


ALL = (stepping,)
