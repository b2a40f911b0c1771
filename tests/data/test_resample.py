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


def broken(kind: str, seed: int = 1) -> np.ndarray:
    """Time [s], gyro [rad/s] of gain 1.054 and angle [deg] in counts of 1/16 deg, of which some rows are ``kind``."""
    rng = np.random.default_rng(seed)
    n = 8000
    t = np.cumsum(rng.choice([0.0022, 0.0024, 0.0035, 0.0044], n))
    swung, rate = swing(t, 0.3)
    gyro = 1.054 * rate + 0.005 * rng.standard_normal(n)
    angle = np.round(np.rad2deg(swung) * 16) / 16
    if kind in ("gyro", "both"):
        gyro[rng.choice(n, 24, replace=False)] += 36.0 * rng.choice([-1, 1], 24)
    if kind in ("angle", "both"):
        angle[rng.choice(n, 10, replace=False)] += 2048.0
        angle[[3000, 3006]] += 2048.0  # two words near each other
    rows = np.column_stack([t, gyro, angle])
    if kind == "doubled":
        rows = rows[np.sort(np.append(np.arange(n), rng.choice(n, 400, replace=False)))]
    return np.delete(rows, slice(3000, 3400), axis=0) if kind == "gap" else rows


@pytest.mark.parametrize("kind", ["sound", "gyro", "angle", "both", "doubled", "gap"])
def test_broken_rows_are_in_no_mean(tmp_path: Path, kind: str) -> None:
    """Rows at uneven steps beside a table: the gain of means over four is 0.05 off with one broken row in 300 in them.

    Without them its deviation is 3e-4, and 1.5 counts of the angle are the most that a mean is off by.
    """
    np.savetxt(tmp_path / "run.csv", broken(kind), "%.9g", ",", header="t,g,a", comments="")
    (tmp_path / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\ngyro = { column = "g", unit = "rad/s" }\n'
        'table_angle = { column = "a", unit = "deg", wrapped = true, source = "encoder" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias"]\n[fit]\nresample = "100 Hz"\n'
    )
    (run,) = read_recordings(load_manifest(tmp_path / "run.toml"))
    beside = np.isclose(np.diff(run.t), run.dt)
    told = (np.diff(run.channels["table_angle"].values) / run.dt)[beside]
    read = run.channels["gyro"].values[1:][beside]
    share, before = np.polyfit(read, told, 1)  # the counts of the angle are the noise of its rate
    gain, bias = 1 / share, -before / share
    assert gain == pytest.approx(1.054, abs=0.003)
    assert np.abs(read - gain * told - bias).max() < 1.5 * np.deg2rad(1 / 16) / run.dt + 0.03
    said = " ".join(run.notes)
    assert ("far off the neighbours" in said) is (kind in ("gyro", "both"))
    assert ("leaps" in said) is (kind in ("angle", "both"))
