"""Rows that a loop reads unevenly, or loses, beside an encoder: its steps cancel from row to row all the same.

Seeds are fixed. The scale factor stands with 25 deviations; that it is off by 4 has the probability 6e-5 a case.
"""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import closed, manifest, use

from insenv.core.recording import Channel, Floats, Recording
from insenv.data.exposure import expose
from insenv.data.reference import with_reference
from insenv.identify.prepare.binned import binned

DT, COUNT = 0.01, 2 * np.pi / 2**13
SIZE = 3e-4


def angle(t: Floats) -> Floats:
    """A table that swings every 9 s [rad]."""
    return 2.3 * np.sin(2 * np.pi * t / 9)


def rate(t: Floats) -> Floats:
    return 2.3 * 2 * np.pi / 9 * np.cos(2 * np.pi * t / 9)


def uneven(seed: int, lost: float, scale: float = 0.0, noise: float = 0.0) -> Recording:
    """A minute or two at 100 Hz, each row off its time by 6 % of a period, a share of rows ``lost``."""
    rng = np.random.default_rng(seed)
    t = DT * (np.arange(12000) + 0.06 * np.clip(rng.standard_normal(12000), -3, 3))
    t = t[rng.random(len(t)) >= lost]
    gyro = (1 + scale) * rate(t) + 0.01 + noise * rng.standard_normal(len(t)) / np.sqrt(DT)
    shown = COUNT * np.floor((angle(t) + 0.2) / COUNT)
    return Recording(t, {"gyro": Channel(gyro, "rad/s"), "table_angle": Channel(shown, "rad")})


def test_the_period_is_that_of_the_clock_whatever_is_lost() -> None:
    """To a hundredth of a period over the whole run, so that rows and cells stay together."""
    run = uneven(1, 0.01)
    assert np.sum(np.diff(run.t) > 1.5 * DT) > 50
    assert abs(run.dt / DT - 1) * 12000 < 0.05


def test_each_row_has_a_cell_of_its_own() -> None:
    count = expose(uneven(1, 0.01), "gyro").count
    assert count.max() == 1 and np.mean(count == 0) < 0.015


@pytest.mark.parametrize("rows", [1, 7])
def test_the_steps_of_an_encoder_do_not_add_up_between_uneven_rows(rows: int) -> None:
    """The reference beside the true rate never leaves the angle by more than the encoder does, a few counts."""
    run = with_reference(uneven(2, 0.0))
    exposure = expose(run, "gyro", rows)
    assert run.table is not None and exposure.beside is not None
    away = np.cumsum((exposure.motion.rate - (exposure.y - 0.01))[exposure.count == rows]) * run.dt * rows
    assert np.ptp(away) < 1.5 * COUNT


@pytest.mark.parametrize("rows", [1, 2])
def test_they_do_not_add_up_over_lost_rows_either(rows: int) -> None:
    """Of means of one row a lost row leaves a hole, of two a half; together they miss the motion by a count or two."""
    run = with_reference(uneven(2, 0.01))
    problem = binned(manifest(), (run,), (use(len(run)),), "gyro", rows)
    away = np.cumsum(problem.y - 0.01) * problem.bins.width
    assert np.ptp(away) < 2.5 * COUNT


def test_a_scale_factor_beside_an_encoder_is_told_as_its_angle_tells_it() -> None:
    """The angle goes to and fro by 4.6 rad and is read to 2e-4 rad a row: what is left is the gyro's own noise."""
    (target,) = closed(uneven(3, 0.002, SIZE, 2e-5), manifest(declared=("bias",))).targets
    (found,) = [one for one in target.added if one.effect == "scale_factor"]
    (c,) = found.parameters
    assert abs(c.value - SIZE) < 4 * c.sd < SIZE / 6


@pytest.mark.parametrize("rows", [1, 7])
def test_increments_by_stamps_that_jitter_are_true_in_the_mean(rows: int) -> None:
    """Steps that are wrong by 2 % make rates 8e-4 too large; what was turned over the time of all is right."""
    rng = np.random.default_rng(4)
    taken = DT * (np.arange(12000) + 0.06 * np.clip(rng.standard_normal(12000), -3, 3))
    stamped = taken + 0.02 * DT * rng.standard_normal(len(taken))
    increments = np.diff(angle(taken), prepend=angle(np.array([-DT]))[0])
    read = increments / np.diff(stamped, prepend=-DT)
    shown = angle(taken) + 1e-6 * rng.standard_normal(len(taken))
    channels = {"gyro": Channel(read, "rad/s", "interval"), "table_angle": Channel(shown, "rad")}
    problem = binned(manifest(), (with_reference(Recording(stamped, channels)),), (use(12000),), "gyro", rows)
    u = problem.bins.mean(tuple(e.motion.rate for e in problem.exposures))
    assert abs(float(problem.y @ u / (u @ u))) < 1e-4
