"""A word or a sign that was written wrong in a list of points is left out, and what instruments do is not."""

from __future__ import annotations

import numpy as np
import pytest

from insenv.core.recording import Channel, Floats, Recording
from insenv.core.series.least_absolute import least_absolute
from insenv.identify.clean.outliers import blunders

LEVELS = np.linspace(-1.0, 1.0, 21)


def listed(rate: Floats, y: Floats, name: str = "table_rate", unit: str = "rad/s") -> Recording:
    t = np.linspace(0.0, 10.0 * (len(y) - 1), len(y))
    return Recording(t, {"gyro": Channel(y, "rad/s"), name: Channel(rate, unit, source="set")}, label="list")


def read(rate: Floats, seed: int = 1) -> Floats:
    return 1.003 * rate + 0.01 + 1e-4 * np.random.default_rng(seed).standard_normal(len(rate))


@pytest.mark.parametrize("size", [0.003, 0.1, -2.0])
def test_a_wrong_word_is_left_out(size: float) -> None:
    y = read(LEVELS)
    y[7] += size
    (found,) = blunders(listed(LEVELS, y), "gyro", 0)
    assert (found.start, found.stop) == (7, 8) and "off the other points" in found.reason


def test_sound_lists_lose_nothing() -> None:
    """Three of 400 or fewer, at 1 to 8 in ten thousand, in all but 1 in a hundred such sets."""
    lost = 0
    for seed in range(100):
        for rate in (LEVELS, np.tile(LEVELS, 2), LEVELS[::2], np.append(LEVELS, LEVELS[::-1])):
            lost += bool(blunders(listed(rate, read(rate, seed)), "gyro", 0))
    assert lost <= 3


@pytest.mark.parametrize(
    "fault",
    [
        lambda u: 0.01 * np.exp(-((u - 0.3) ** 2) / 0.01),  # a fault near one rate, at several levels
        lambda u: -np.where(np.abs(u) < 0.15, u, 0.0),  # a dead band
        lambda u: -np.maximum(u - 0.95, 0),  # the end of its range
    ],
)
def test_what_an_instrument_does_is_no_blunder(fault) -> None:  # type: ignore[no-untyped-def]
    assert not blunders(listed(LEVELS, read(LEVELS) + fault(LEVELS)), "gyro", 0)


def test_what_comes_again_at_the_same_rate_is_none() -> None:
    rate = np.append(LEVELS, LEVELS[::-1])
    y = read(rate)
    y[[7, 34]] += 0.01
    assert not blunders(listed(rate, y), "gyro", 0)
    y[34] -= 0.01
    assert [one.start for one in blunders(listed(rate, y), "gyro", 0)] == [7]


def test_least_absolute_deviations_are_not_pulled() -> None:
    x = np.linspace(0, 1, 50)
    columns = np.column_stack([np.ones(50), x])
    y = columns @ [2.0, 3.0]
    y[::7] += 1e3
    theta, left = least_absolute(columns, y)
    np.testing.assert_allclose(theta, [2.0, 3.0], atol=1e-3)
    assert np.count_nonzero(np.abs(left) > 1) == 8
