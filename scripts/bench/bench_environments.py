"""The bench's lines for environments, estimators and the strapdown mechanisation."""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Iterator
from functools import partial
from itertools import count

import gymnasium
import numpy as np
from bench_line import Line, cpu

import insenv  # noqa: F401  (registers the environments)
from estimators.common.rate_policies import Bidirectional, ConstantRate
from estimators.north_finder.gls import NorthGls
from estimators.north_finder.revolution import Revolution
from insenv.core.estimate import Datasheet, Estimate, Estimator
from insenv.core.recording import Floats, Recording
from insenv.envs.rollout import roll_out
from insenv.envs.task import Task
from insenv.navigation import strapdown
from insenv.navigation import truth as strapdown_truth
from insenv.scenario import datasheet, load
from insenv.systems.north_finder.env import NorthFinderEnv, north_finder

VECTOR, EPISODE = 64, 300
SEEDS, OF_ALL = 512, 10_000
PUBLISHED = "north_finder/published"


def stepping() -> Iterator[Line]:
    """Whole episodes of the north finder in its vector form, steps of 100 samples; beside it Gymnasium's loop."""
    native = gymnasium.make_vec("insenv/NorthFinder-v0", num_envs=VECTOR)
    sync = gymnasium.vector.SyncVectorEnv(VECTOR * [NorthFinderEnv])
    actions = np.zeros((VECTOR, 2))
    actions[:, 0] = np.radians(10.0)
    ours, theirs = (VECTOR / step_time(envs, actions, steps) for envs, steps in ((native, EPISODE), (sync, 20)))
    yield Line(
        f"NorthFinder-v0, vector form, {VECTOR} rows, steps",
        f"{ours / 1e3:.0f} k/s",
        ">= 200 k/s",
        "gymnasium.vector.SyncVectorEnv",
        f"{theirs / 1e3:.1f} k/s",
        ours / theirs,
    )


def step_time(
    envs: gymnasium.vector.VectorEnv[dict[str, Floats], Floats, Floats], actions: Floats, steps: int
) -> float:
    """CPU time of a step [s]: mean over an episode, which holds what is read ahead; the least of several."""
    means = []
    for _ in range(6):
        envs.reset(seed=0)
        start = time.process_time()
        for _ in range(steps):
            envs.step(actions)
        means.append((time.process_time() - start) / steps)
    return min(means)


def simulating() -> Iterator[Line]:
    """One episode in one step, a new run each time."""
    task, seeds, policy = north_finder(step_s=float(EPISODE)), count(), ConstantRate(datasheet(load(PUBLISHED)))
    ours = cpu(lambda: roll_out(task, policy, None, [next(seeds)], keep=False), 31)
    source, z = np.random.Generator(np.random.SFC64(0)), np.empty(30_000)
    bound = cpu(lambda: source.standard_normal(out=z), 31)
    yield Line(
        f"episode of {EPISODE} s at 100 Hz",
        f"{1e3 * ours:.2f} ms",
        "<= 5 ms",
        "its normals alone (NumPy, SFC64)",
        f"{1e3 * bound:.2f} ms",
        bound / ours,
    )


def estimating() -> Iterator[Line]:
    """Estimates of one episode's 30 000 samples, from reset to estimate."""
    sheet = datasheet(load(PUBLISHED))
    task = north_finder()
    recording = roll_out(task, Bidirectional(sheet), None, [3]).recording(0)
    theirs = cpu(lambda: _by_pinv(recording), 5)
    for name, made, bar in (("revolution", Revolution, 1.5), ("north_gls", NorthGls, 0.5)):
        estimator = made(sheet)
        whole = partial(_estimated, estimator, recording)
        ours = cpu(whole, 101)
        yield Line(
            f"{name}, {len(recording)} samples, update + estimate",
            f"{1e3 * ours:.2f} ms",
            f"<= {bar} ms",
            "least squares by numpy.linalg.pinv",
            f"{1e3 * theirs:.1f} ms",
            theirs / ours,
        )


def _estimated(estimator: Estimator, recording: Recording) -> Estimate:
    return estimator.estimate(estimator.update(estimator.reset(None), recording))


def _by_pinv(recording: Recording) -> Floats:
    """North, scale factor of second degree, bias and four encoder harmonics, all samples weighed alike."""
    angle, y, t = recording.values("table_angle", "rad"), recording.values("gyro", "rad/s"), recording.t
    rate = np.diff(angle, prepend=0.0) / recording.dt
    x = t / t[-1]
    waves = [wave(n * angle) for n in range(1, 5) for wave in (np.cos, np.sin)]
    turning = [rate * wave(n * angle) for n in range(1, 5) for wave in (np.cos, np.sin)]
    columns = [*waves[:2], rate, rate * x, rate * x * x, np.ones_like(t), *turning]
    solution: Floats = np.linalg.pinv(np.column_stack(columns)) @ y
    return solution


def playing() -> Iterator[Line]:
    """Whole studies: runs from seed to error, time on two cores told from one process."""
    task, sheet = north_finder(), datasheet(load(PUBLISHED))
    ours = OF_ALL / SEEDS / 2 * cpu(lambda: _played(task, sheet), 3)
    work = f"{OF_ALL} episodes with north_gls on two cores"
    yield Line(work, f"{ours:.0f} s", "< 60 s", f"({SEEDS} episodes in one process)", "", None)


def _played(task: Task, sheet: Datasheet) -> None:
    roll_out(task, Bidirectional(sheet), "north_gls", range(SEEDS), keep=False, every=EPISODE)


def mechanising() -> Iterator[Line]:
    """One run of six axes through both mechanisations, every 100th result kept; python-ins beside the full one."""
    n, dt, position = 1_000_000, 0.01, (0.66, 0.0, 380.0)
    still = strapdown_truth.increments_at_rest(np.eye(3), position, dt, n)
    gyro, accelerometer = (np.ascontiguousarray(x) for x in still)
    start = strapdown.initial(np.eye(3), position)
    both = (strapdown.static_mechanisation, strapdown.full_mechanisation)
    static, full = (n / cpu(partial(m, gyro, accelerometer, dt, start, 100), 5) / 1e6 for m in both)
    yield Line("strapdown, static, one run", f"{static:.1f} M/s", ">= 8 M/s", "", "", None)
    work, found, bar = "strapdown, full, one run", f"{full:.1f} M/s", ">= 8 M/s"
    if importlib.util.find_spec("pyins") is None:
        yield Line(work, found, bar, "pyins is not installed", "", None)
        return
    theirs = _by_pyins(gyro, accelerometer, dt, position)
    yield Line(work, found, bar, "pyins Integrator", f"{theirs:.2f} M/s", full / theirs)


def _by_pyins(gyro: Floats, accelerometer: Floats, dt: float, position: tuple[float, float, float]) -> float:
    """Samples that python-ins takes in [M/s]; its axes: forward, right, down, its angles in degrees."""
    import pandas as pd  # type: ignore[import-not-found, import-untyped, unused-ignore]
    from pyins import strapdown as pyins  # type: ignore[import-not-found, import-untyped, unused-ignore]
    from pyins import util  # type: ignore[import-not-found, import-untyped, unused-ignore]

    n = len(gyro)
    # A row before the first.
    six = np.vstack([np.zeros(6), np.hstack([gyro, accelerometer])])[:, [1, 0, 2, 4, 3, 5]] * [1, 1, -1, 1, 1, -1]
    imu = pd.DataFrame(six, index=np.arange(n + 1) * dt, columns=util.GYRO_COLS + util.ACCEL_COLS)
    values = [np.degrees(position[0]), 0.0, position[2], *6 * [0.0]]
    pva = pd.Series(values, index=util.LLA_COLS + util.VEL_COLS + util.RPH_COLS, name=0.0)
    work = cpu(lambda: pyins.Integrator(pva).integrate(pyins.compute_increments_from_imu(imu, "increment")), 2)
    return n / 1e6 / work


ALL = (stepping, simulating, estimating, playing, mechanising)
