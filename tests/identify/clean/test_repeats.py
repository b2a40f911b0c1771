"""A held output shows itself where readings change in every k-th row alone; readings that are only coarse do not.

Seeds are fixed. 48 changes fall into one class of rows modulo 2 by chance once in 2^47.
"""

from __future__ import annotations

import numpy as np
import pytest
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Floats, Recording
from insenv.data.reference import with_reference
from insenv.identify.clean.repeats import repeats
from insenv.identify.prepare.problems import prepare

ROW = 0.01
T: Floats = ROW * np.arange(2400, dtype=np.float64)


def bench(seed: int, rows: int, phase: int = 0, top: float = 1.5, late: float = 0.02, noise: float = 0.02) -> Recording:
    """A gyro rounded to 0.01 rad/s, read ``rows`` times for each renewal, beside an encoder that is late and noisy."""
    rng = np.random.default_rng([seed, rows, phase])
    f = rng.uniform(0.2, 0.6)
    age = (np.arange(len(T)) + phase) % rows
    true = top * np.sin(2 * np.pi * f * (T - ROW * age) + 1.0)
    fresh = (np.arange(len(T)) + phase) // rows
    gyro = 0.01 * np.rint((-0.87 * true + 0.004 * rng.standard_normal(len(T) + 1)[fresh]) / 0.01)
    read = top * np.sin(2 * np.pi * f * (T - late) + 1.0) + noise * rng.standard_normal(len(T))
    return Recording(T, {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(read, "rad/s", source="encoder")})


def spans(*recordings: Recording) -> tuple[slice, ...]:
    return tuple(slice(0, len(r)) for r in recordings)


@pytest.mark.parametrize("rows", [2, 3, 4, 10])
def test_hold_and_phases_are_read_off(rows: int) -> None:
    runs = tuple(bench(1, rows, phase) for phase in range(min(rows, 3)))
    found = repeats(runs, spans(*runs), "gyro")
    assert found is not None
    assert (found.rows, found.phases) == (rows, tuple(range(min(rows, 3))))


@pytest.mark.parametrize("top", [0.02, 0.1, 1.5])
def test_coarse_readings_are_no_hold(top: float) -> None:
    for seed in range(20):
        one = bench(seed, 1, top=top)
        assert repeats((one,), spans(one), "gyro") is None


def test_a_run_that_does_not_move_has_no_phase_and_no_veto() -> None:
    moving, still = bench(2, 3, 1), bench(2, 3, top=0.0)
    still = Recording(still.t, {**still.channels, "gyro": Channel(np.zeros(len(T)), "rad/s")})
    found = repeats((moving, still), spans(moving, still), "gyro")
    assert found is not None
    assert found.phases == (1, None)


@pytest.mark.parametrize("damage", ["rail", "reference that fails"])
def test_a_hold_is_found_where_the_reference_or_a_rail_would_hide_it(damage: str) -> None:
    """The half of a run that shows another share once refused it, and tones at its rate were named instead."""
    one = bench(3, 3, 2)
    gyro, read = one.values("gyro", "rad/s").copy(), one.values("table_rate", "rad/s").copy()
    if damage == "rail":
        gyro = np.clip(gyro, -0.9, 0.9)
    else:
        rows = slice(1200, 2000)
        read[rows] = np.convolve(read, np.ones(41) / 41, mode="same")[rows]
    one = Recording(T, {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(read, "rad/s", source="encoder")})
    found = prepare(manifest(), (with_reference(one),), (use(len(T), 0.85),), "gyro")
    hold = found.held.hold
    assert hold is not None
    assert (hold.share, hold.whole) == (1.0, True)
    assert hold.hold == pytest.approx(0.03, abs=1e-9)
    assert hold.phases[0] == pytest.approx(0.02, abs=1e-9)
    assert not [line for line in found.lines if abs(line.frequency - 100 / 3) < 2]
