"""The bench's lines for the whole unit on its table: the vector form beside the single form, and its filter.

A step has 500 samples. The filter has 30 states and takes samples of 100 Hz, one by one, on one core.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np
from bench_line import Line, cpu

from estimators.system_calibration.batch_gls import BatchGls
from estimators.system_calibration.system_kalman import SystemKalman
from insenv.core.recording import Floats
from insenv.envs.rollout import roll_out
from insenv.scenario import load
from insenv.systems.system_calibration.env import (
    SystemCalibrationEnv,
    SystemCalibrationVectorEnv,
    system_calibration,
)

SCENARIO = "system_calibration/tactical_fog"
VECTOR, STEPS, EPISODES = 64, 12, 12
#: What the published filter has no states of.
WITHOUT = ("scale_factor_asymmetry", "g_sensitivity", "size_effect", "force_delay")


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


def filtering() -> Iterator[Line]:
    """The published filter of 30 states; beside it all samples at once by least squares."""
    declared = load(SCENARIO).table.declared
    assert declared is not None
    changes = {
        "duration": "120 s",
        "declared": {name: entry for name, entry in declared.items() if name not in WITHOUT},
        "instrument.gyro.noise": {"angle_random_walk": "0.01 deg/sqrt(h)"},
        "instrument.accel.noise": {"velocity_random_walk": "40 ug/sqrt(Hz)"},
    }
    task = system_calibration(SCENARIO, changes)
    run = roll_out(task, "nineteen_positions", None, range(1)).recording(0)
    one, all_ = SystemKalman(task.datasheet), BatchGls(task.datasheet)
    ours = cpu(lambda: one.estimate(one.update(one.reset(), run)), 5)
    theirs = cpu(lambda: all_.estimate(all_.update(all_.reset(), run)), 5)
    speeds = [60e-6 * len(run) / spent for spent in (ours, theirs)]
    yield Line(
        f"system_kalman, {one.states} states, samples of {task.datasheet.sampling:.0f} Hz",
        f"{speeds[0]:.2f} M/min",
        ">= 0.5 M/min",
        "batch_gls, all samples at once",
        f"{speeds[1]:.1f} M/min",
        theirs / ours,
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


ALL = (stepping, filtering)
