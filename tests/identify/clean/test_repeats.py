"""A held output shows itself where readings change in every k-th row alone; readings that are only coarse do not.

Seeds are fixed. 48 changes fall into one class of rows modulo 2 by chance once in 2^47.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import manifest, use

from insenv.core.recording import Channel, Floats, Recording
from insenv.data.reference import with_reference
from insenv.effects.timing import SampleHold
from insenv.identify.clean.repeats import repeats
from insenv.identify.loop import trace
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


def test_a_hold_whose_phase_slips_at_lost_rows_has_its_length_and_is_left_in() -> None:
    """A logger lost rows and repeated each reading six times after that: half the hold was named."""
    one = bench(4, 6)
    lost = np.isin(np.arange(len(T)), [401, 402, 803, 1404])
    gyro = one.values("gyro", "rad/s")[: int(np.sum(~lost))]
    read = one.channels["table_rate"]
    one = Recording(T[~lost], {"gyro": Channel(gyro, "rad/s"), "table_rate": replace(read, values=read.values[~lost])})
    found = repeats((one,), spans(one), "gyro")
    assert found is not None
    assert (found.rows, found.phases, found.slips) == (6, (None,), True)
    (track,) = trace(manifest(), (one,), (use(len(one), 0.85),), (SampleHold(),)).tracks
    hold = track.prepared.held.hold
    assert hold is not None
    assert (hold.whole, hold.taken) == (True, False)
    assert hold.hold == pytest.approx(0.06, rel=1e-3)


def test_a_hold_that_readings_show_stays_where_taking_it_out_makes_held_out_data_worse() -> None:
    """The reference is that of another table in the held-out part: it tells nothing from one renewal to the next."""
    one = bench(5, 4, 1)
    read = one.values("table_rate", "rad/s").copy()
    noise = 1.5 * np.random.default_rng(6).standard_normal(len(T))
    read += np.convolve(noise, np.ones(3) / 3, mode="same")
    one = Recording(T, {**one.channels, "table_rate": Channel(read, "rad/s", source="encoder")})
    (track,) = trace(manifest(), (one,), (use(len(T), 0.6),), (SampleHold(),)).tracks
    assert track.prepared.held.hold is not None
    assert track.prepared.held.hold.hold == pytest.approx(0.04, abs=1e-9)


def test_few_renewals_of_a_long_hold_are_as_certain_as_many_of_a_short_one() -> None:
    one = bench(7, 5)
    some = slice(0, 5 * 30)
    assert repeats((one,), (some,), "gyro") is not None
    assert repeats((bench(7, 2),), (slice(0, 2 * 30),), "gyro") is None
