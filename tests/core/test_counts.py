"""The counts of an encoder behind an angle, or behind a rate that was differenced from it."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.recording import Floats
from insenv.core.series.counts import counts_of_angle, counts_of_rate
from insenv.core.series.trajectory import trajectory

DT, STEP = 0.01, 2 * np.pi / 2**14


def turned(seed: int = 0) -> tuple[Floats, Floats]:
    """Rates of a table that holds one for some seconds each, and its angle, with half a step of blur in the counts."""
    rng = np.random.default_rng(seed)
    rate = np.repeat(rng.uniform(-0.5, 0.5, 12), 400)
    angle = np.cumsum(rate) * DT
    return rate, STEP * np.floor(angle / STEP + 0.3 * rng.standard_normal(len(angle)))


@pytest.mark.parametrize("rows", [1, 3, 10])
def test_a_differenced_rate_tells_its_step_and_over_how_many_rows(rows: int) -> None:
    rate, read = turned()
    made, motion = ((x[rows:] - x[:-rows]) / (rows * DT) for x in (read, np.cumsum(rate) * DT))
    found = counts_of_rate(made, motion, DT)
    assert found is not None and found.rows == rows
    assert found.step == pytest.approx(STEP, rel=1e-3)


def test_counts_of_an_angle_and_of_numbers_that_were_not_counted() -> None:
    rate, read = turned()
    found = counts_of_angle(read)
    assert found is not None and found.rows == 0 and found.step == pytest.approx(STEP, rel=1e-3)
    noisy = rate + 1e-3 * np.random.default_rng(1).standard_normal(len(rate))
    assert counts_of_rate(noisy, rate, DT) is None


@pytest.mark.parametrize("rows", [1, 4])
def test_errors_of_a_rate_are_made_up_for_by_the_next(rows: int) -> None:
    """The integral of the rate has the mean error of the angle over the rows of the difference."""
    rate, read = turned()
    errors = read - np.cumsum(rate) * DT
    padded = np.concatenate([np.repeat(errors[:1], rows), errors])
    of_reading, motion = ((x[rows:] - x[:-rows]) / (rows * DT) for x in (read, np.cumsum(rate) * DT))
    found = counts_of_rate(of_reading, motion, DT)
    assert found is not None
    of_rate = (padded[rows:] - padded[:-rows]) / (rows * DT)
    integrated = np.cumsum(of_rate) * DT
    np.testing.assert_allclose(np.diff(found.of_rows(errors[None])[0]), np.diff(integrated), atol=1e-12)


def test_a_rate_of_single_counts_is_one_of_a_table_that_swings() -> None:
    """To and fro at a fifth of a count a row; beside it a table that stands, whose counts flicker."""
    rng = np.random.default_rng(0)
    t: Floats = DT * np.arange(20000.0)
    q = 2e-3
    for rate, stands in ((0.2 * q / DT * np.sign(np.sin(0.3 * t)), False), (np.zeros(len(t)), True)):
        read = q * np.floor(np.cumsum(rate) * DT / q + 0.4 * rng.standard_normal(len(t)))
        found = trajectory(t[1:], DT, np.diff(read) / DT, "rate")
        assert found is not None and found.still is stands


def test_a_step_that_a_few_digits_hide_in_large_angles_is_told_by_small_ones() -> None:
    """200 deg/s for three minutes, seven digits: 0.044 deg beside 0.01 deg at the end."""
    rng = np.random.default_rng(3)
    angle = np.cumsum(np.minimum(20.0, np.arange(2000) / 5)) + 0.02 * rng.standard_normal(2000)
    step = 360 / 2**13
    read = np.array([float(f"{x:.7g}") for x in step * np.floor(angle / step)])
    found = counts_of_angle(np.deg2rad(read))
    assert found is not None and found.step == pytest.approx(np.deg2rad(step), rel=1e-3)
    assert counts_of_angle(np.deg2rad(angle)) is None
