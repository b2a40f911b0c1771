"""The bench's lines for the two-position calibration: vehicle, mechanisation, recursive least squares, whole runs."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import gymnasium
import numpy as np
from bench_environments import step_time
from bench_line import Line, cpu

import insenv  # noqa: F401 - registers the environments
from estimators.common.least_squares import Polynomial
from insenv.core.attitude import dcm_from_angles
from insenv.core.recording import Floats
from insenv.envs.rollout import roll_out
from insenv.navigation.strapdown import initial, static_mechanisation
from insenv.rig import Normals, Rig
from insenv.scenario import load
from insenv.systems.two_position.env import TwoPositionEnv, two_position

PUBLISHED = "two_position/published_a"
VECTOR, STEPS = 64, 600
SAMPLES, DT = 62_000, 0.01
SEEDS, OF_ALL, CORES = 64, 1000, 2


def stepping() -> Iterator[Line]:
    """Whole episodes at rest in the vector form, steps of 100 samples of six axes; beside it Gymnasium's loop."""
    native = gymnasium.make_vec("insenv/TwoPosition-v0", num_envs=VECTOR)
    sync = gymnasium.vector.SyncVectorEnv(VECTOR * [TwoPositionEnv])
    still = np.zeros((VECTOR, 2))
    ours, theirs = (VECTOR / step_time(envs, still, steps) for envs, steps in ((native, STEPS), (sync, 20)))
    yield Line(
        f"TwoPosition-v0, vector form, {VECTOR} rows, steps",
        f"{ours / 1e3:.0f} k/s",
        ">= 20 k/s",
        "gymnasium.vector.SyncVectorEnv",
        f"{theirs / 1e3:.1f} k/s",
        ours / theirs,
    )


def episode() -> Iterator[Line]:
    """620 s at 100 Hz, six axes, with the turn: simulated and mechanised; beside it the normals alone."""
    rig = load(PUBLISHED).cast(1)
    state = initial(dcm_from_angles(0.0, 0.0, 0.0), (np.radians(38.0), 0.0, 380.0))

    def played() -> object:
        outputs = rig.run(1, SAMPLES).outputs
        gyro, accel = (np.stack([outputs[f"{kind}_{axis}"] for axis in "xyz"], axis=-1) for kind in ("gyro", "accel"))
        return static_mechanisation(gyro * DT, accel * DT, DT, state, every=100)

    ours, normals = cpu(played, 5), cpu(partial(_draw, rig), 5)
    yield Line(
        "620 s episode at 100 Hz, six axes, mechanised",
        f"{1e3 * ours:.0f} ms",
        "<= 60 ms",
        "its normals alone (NumPy, SFC64)",
        f"{1e3 * normals:.1f} ms",
        normals / ours,
    )


def _draw(rig: Rig) -> Floats:
    return Normals(rig, 1).draw(SAMPLES)


def recursion() -> Iterator[Line]:
    """Recursive least squares of three parameters; beside it the same recursion in a loop of NumPy."""
    cubic, few = Polynomial(DT, SAMPLES * DT), 2000
    h = cubic.columns(SAMPLES)
    y = h @ np.array([1.0, -2.0, 0.5])
    ours = cpu(lambda: cubic.update(cubic.begin(), y[:, None]), 5) / SAMPLES
    theirs = cpu(lambda: _loop(h[:few], y[:few]), 3) / few
    yield Line(
        "recursive least squares, 3 parameters, updates",
        f"{1e-6 / ours:.0f} M/s",
        ">= 10 M/s",
        "the recursion in a loop of NumPy",
        f"{1e-6 / theirs:.2f} M/s",
        theirs / ours,
    )


def _loop(h: Floats, y: Floats) -> Floats:
    p, x = 1e8 * np.eye(3), np.zeros(3)
    for row, value in zip(h, y, strict=True):
        gain = p @ row / (1 + row @ p @ row)
        x = x + gain * (value - row @ x)
        p = (np.eye(3) - np.outer(gain, row)) @ p
    return x


def seeds() -> Iterator[Line]:
    """Whole runs of the published procedure with its tied estimator."""
    task = two_position(PUBLISHED)

    def played(estimator: str | None) -> object:
        return roll_out(task, "published_schedule", estimator, range(SEEDS), keep=False, every=task.steps)

    scale = OF_ALL / SEEDS / CORES
    ours, bare = (scale * cpu(partial(played, name), 1) for name in ("two_position_tied", None))
    yield Line(
        f"{OF_ALL} runs of 620 s with two_position_tied, {CORES} cores",
        f"{ours:.0f} s",
        "<= 90 s",
        "the same without an estimator",
        f"{bare:.0f} s",
        bare / ours,
    )


ALL = (stepping, episode, recursion, seeds)
