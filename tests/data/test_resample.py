"""Means on an even grid: no delay of their own, no corner cut; and readings that were read twice."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.core.recording import Channel, Floats, Recording
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.resample import resampled


def swing(t: Floats, hertz: float = 3.0) -> tuple[Floats, Floats]:
    """Angle and rate of a swing [rad, rad/s]."""
    omega = 2 * np.pi * hertz
    return np.sin(omega * t) / omega, np.cos(omega * t)


@pytest.mark.parametrize("rows", [2, 3, 5])
def test_means_of_even_readings_at_instants_are_those_of_their_cells(rows: int) -> None:
    """Mean of the readings beside the difference of the angle: the same at 3 Hz, late by nothing."""
    t = 0.01 * np.arange(3000.0)
    angle, rate = swing(t)
    run = Recording(t, {"gyro": Channel(rate, "rad/s", "instant"), "table_angle": Channel(angle, "rad", "instant")})
    means = resampled(run, 100.0 / rows, "fit.resample")
    told = np.diff(means.channels["table_angle"].values) / means.dt
    read = means.channels["gyro"].values[1:]
    slope = np.gradient(told, means.dt)
    late = float((told - read) @ slope / (slope @ slope))
    gain = float(read @ told / (told @ told))
    assert abs(late) < 1e-5  # a cell that ends with its last reading would be late by half a row, 5 ms
    # Of a mean of instants (w h)^2 / 24 is left, of straight lines between the angles (w h)^2 / 8 more.
    assert abs(gain - 1) < 0.5 * (2 * np.pi * 3.0 * 0.01) ** 2 / 8


@pytest.mark.parametrize("longer", [0.0, 0.07])
def test_means_of_two_readings_and_a_half_are_not_late(longer: float) -> None:
    """Rows of 0.2 s, some of 0.3 s, in cells of 0.5 s: shared out whole they stood 0.05 s late in all cells."""
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.choice([0.2, 0.3], p=[1 - longer, longer], size=3000))
    angle, rate = swing(t, 0.2)
    run = Recording(t, {"gyro": Channel(rate, "rad/s", "instant"), "table_angle": Channel(angle, "rad", "instant")})
    means = resampled(run, 2.0, "fit.resample")
    told = np.diff(means.channels["table_angle"].values) / means.dt
    read = means.channels["gyro"].values[1:]
    slope = np.gradient(told, means.dt)
    assert abs(float((told - read) @ slope / (slope @ slope))) < 0.005


@pytest.mark.parametrize("more", ["", '[fit]\nresample = "50 Hz"\n'])
def test_readings_that_were_read_twice_are_left_out(tmp_path: Path, more: str) -> None:
    """A chip renews its output every 10 ms, and is asked about every 9.7 ms by a clock that ticks every 10 ms."""
    rng = np.random.default_rng(2)
    asked = np.cumsum(rng.choice([0.0094, 0.0098, 0.0099], 4000))
    chip = np.floor(asked / 0.01).astype(int)
    angle, rate = swing(0.01 * chip, 0.7)
    noise = 1e-3 * rng.standard_normal(chip.max() + 1)
    ticks = np.floor(asked / 0.01 + 0.3 * np.sin(asked)) * 0.01
    ticks = np.maximum.accumulate(ticks)
    rows = np.column_stack([ticks, rate + noise[chip], angle])
    np.savetxt(tmp_path / "run.csv", rows, "%.9g", ",", header="t,g,a", comments="")
    (tmp_path / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "g", unit = "rad/s" }\ntable_angle = { column = "a", unit = "rad", source = "encoder" }\n'
        f'[model]\ntarget = "gyro"\ndeclared = ["bias"]\n{more}'
    )
    (run,) = read_recordings(load_manifest(tmp_path / "run.toml"))
    assert any("the others keep a clock" in note for note in run.notes), run.notes
    apart = np.diff(run.t)
    np.testing.assert_allclose(apart[apart < 1.5 * run.dt], 0.02 if more else 0.01, rtol=1e-3)


@pytest.mark.parametrize("uneven", [False, True])
def test_means_of_rows_that_came_in_pairs_are_those_of_the_clock(tmp_path: Path, uneven: bool) -> None:
    """A link brings two rows at once, one of them a period late: the angle is smooth by the clock, no stamp is right.

    Of rows that were taken when their stamps say, as far apart as these, the stamps stand.
    """
    rng = np.random.default_rng(4)
    clock = 0.025 * np.arange(2000.0)
    stamps = clock + np.where(np.arange(2000) % 2, 4e-4, 0.025) - 2e-4 * rng.random(2000)
    stamps = np.maximum.accumulate(stamps)
    angle, rate = swing(stamps if uneven else clock, 0.7)
    rows = np.column_stack([stamps, rate + 1e-3 * rng.standard_normal(2000), angle])
    np.savetxt(tmp_path / "run.csv", rows, "%.9g", ",", header="t,g,a", comments="")
    (tmp_path / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "g", unit = "rad/s" }\ntable_angle = { column = "a", unit = "rad", source = "encoder" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias"]\n[fit]\nresample = "5 Hz"\n'
    )
    (run,) = read_recordings(load_manifest(tmp_path / "run.toml"))
    assert any("about an even clock" in note for note in run.notes) is not uneven
    told = np.diff(run.channels["table_angle"].values) / run.dt
    left = run.channels["gyro"].values[1:] - told
    assert np.std(left) < (0.08 if uneven else 0.015)
