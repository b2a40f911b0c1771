"""The rests of a recording: found by themselves or by labels, counted through, and which of them are held out."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from attitudes.traced import CALIBRATED, found_rows, names
from hypothesis import given, settings
from hypothesis import strategies as st
from positions_cases import (
    ACCELS,
    DT,
    GYROS,
    Case,
    manifest,
    recording,
)

from insenv.core.recording import Channel, Recording, Segment, Site
from insenv.data.manifest import HeldOut
from insenv.identify.positions.rests import find_rests
from insenv.identify.positions.trace import trace_positions


@settings(max_examples=25, deadline=None)
@given(
    rests=st.integers(3, 12),
    rest_s=st.floats(2.2, 6.0),
    turn_s=st.floats(0.8, 3.0),
    noise=st.floats(1e-4, 0.1),
    unit=st.sampled_from([1.0, 1e-3, 415.0]),
    seed=st.integers(0, 10**6),
)
def test_every_rest_is_found_and_nothing_that_moves(
    rests: int, rest_s: float, turn_s: float, noise: float, unit: float, seed: int
) -> None:
    case = Case(rests=rests, rest_s=rest_s, turn_s=turn_s, accel_noise=noise, gyro_noise=0.05 * noise)
    run = recording(case, seed)
    # The unit does not matter: the quiet level is the recording's own.
    run = replace(run, channels={n: replace(c, values=unit * c.values) for n, c in run.channels.items()})
    still, period = round(rest_s / DT), round(rest_s / DT) + round(turn_s / DT)
    found = found_rows(run)
    assert len(found) == rests
    for k, (start, stop) in enumerate(found):
        assert k * period <= start < stop <= k * period + still
        assert stop - start >= 0.5 * still - 2 * round(0.5 / DT)


def test_a_gap_in_time_ends_a_rest() -> None:
    run = recording(Case(rests=3, rest_s=6.0), 1)
    later = run.t + np.where(np.arange(len(run)) >= 150, 10.0, 0.0)  # in the middle of the first rest
    assert len(found_rows(replace(run, t=later))) == 4


def test_a_knock_parts_a_rest_and_what_is_too_short_is_counted() -> None:
    run = recording(Case(rests=3, rest_s=4.0), 1)
    accel = run.channels["accel_x"].values.copy()
    accel[60:66] += 8.0  # 1.2 s after the start of the first rest
    knocked = replace(run, channels={**run.channels, "accel_x": Channel(accel, "m/s^2")})
    found = find_rests(manifest(ACCELS, CALIBRATED), (knocked,), list(run.channels))
    assert len(found.rests) == 3
    assert found.rests[0].start > 66
    assert any("1 still stretch left out, shorter than 2 s" in text for text in found.remarks)


def test_labels_are_rests_but_for_those_that_move() -> None:
    case = Case(rests=4, rest_s=3.0, turn_s=2.0)
    run = recording(case, 2)
    segments = tuple(Segment(f"at {k}", 250 * k, 250 * k + 150) for k in range(4)) + (Segment("turn", 150, 250),)
    found = find_rests(manifest(ACCELS, CALIBRATED), (replace(run, segments=segments),), list(run.channels))
    assert [(r.start, r.stop) for r in found.rests] == [(250 * k, 250 * k + 150) for k in range(4)]
    assert any("segment turn left out" in text for text in found.remarks)


@pytest.mark.parametrize("early", [1, 3, -2])
def test_rows_of_another_label_at_an_end_are_left_out(early: int) -> None:
    """Labels that come some rows early, or late: these rows are gravities off."""
    rng, rows = np.random.default_rng(3), 200
    faces = 9.81 * np.repeat(np.vstack([np.eye(3), -np.eye(3)]), rows, axis=0)
    values = faces + 0.02 * rng.standard_normal(faces.shape)
    channels = {f"accel_{axis}": Channel(values[:, k], "m/s^2") for k, axis in enumerate("xyz")}
    edges = np.clip(rows * np.arange(7) - early, 0, 6 * rows)
    segments = tuple(Segment(str(k), int(a), int(b)) for k, (a, b) in enumerate(pairwise(edges)))
    run = Recording(0.02 * np.arange(float(len(values))), channels, segments, Site(gravity=9.81), label="table")
    found = find_rests(manifest(ACCELS, CALIBRATED), (run,), list(channels))
    assert all(one.start // rows == (one.stop - 1) // rows for one in found.rests)
    assert sum(one.stop - one.start for one in found.rests) > 6 * (rows - 12)
    assert any(f"{5 * abs(early)} rows at the ends of labelled stretches left out" in text for text in found.remarks)


@pytest.mark.parametrize("rows", [2, 4, 7, 8])
def test_a_label_of_few_rows_is_a_rest_whatever_the_next_position_is(rows: int) -> None:
    """A table of positions, each with a few readings: no window is of one position alone."""
    run = recording(Case(rests=12, rest_s=3.0, turn_s=1.0), 4)
    still = np.concatenate([np.arange(200 * k + 20, 200 * k + 20 + rows) for k in range(12)])
    channels = {n: replace(c, values=c.values[still]) for n, c in run.channels.items()}
    segments = tuple(Segment(f"at {k}", rows * k, rows * k + rows) for k in range(12))
    table = replace(run, t=run.t[: len(still)], channels=channels, segments=segments)
    found = find_rests(manifest(ACCELS, CALIBRATED), (table,), list(table.channels))
    assert len(found.rests) == 12 and not any("moves" in text for text in found.remarks)


def test_gyros_in_a_table_of_positions_are_judged_by_their_means() -> None:
    """The turns between the rows were not recorded; a g-sensitivity shows all the same."""
    rng = np.random.default_rng(5)
    up = rng.standard_normal((30, 3))
    force = 9.81 * up / np.linalg.norm(up, axis=1, keepdims=True) + 1e-3 * rng.standard_normal((30, 3))
    rate = 0.01 + 2e-4 * force[:, [1, 2, 0]] + 1e-4 * rng.standard_normal((30, 3))
    channels = {f"accel_{a}": Channel(force[:, i], "m/s^2") for i, a in enumerate("xyz")}
    channels |= {f"gyro_{a}": Channel(rate[:, i], "rad/s") for i, a in enumerate("xyz")}
    segments = tuple(Segment(str(k), k, k + 1) for k in range(30))
    run = Recording(np.arange(30.0), channels, segments, Site(gravity=9.81), label="table")
    found = trace_positions(manifest((*GYROS, *ACCELS), ("accel_bias", "bias")), (run,))
    assert found.gyro is None
    assert [names(part.outcome) for part in found.at_rest] == [["g_sensitivity"]] * 3


@pytest.mark.parametrize(("positions", "held"), [("even", [2, 4, 6]), ("odd", [1, 3, 5]), ((3, 4), [3, 4])])
def test_what_is_held_out(positions: str | tuple[int, ...], held: list[int]) -> None:
    model = manifest(ACCELS, CALIBRATED, HeldOut(positions=positions))
    run = recording(Case(rests=6), 3)
    assert [r.number for r in find_rests(model, (run,), list(run.channels)).rests if r.held_out] == held


def test_rests_of_two_runs_are_counted_through() -> None:
    runs = tuple(recording(Case(rests=3), seed) for seed in (1, 2))
    model = manifest(ACCELS, CALIBRATED, HeldOut(runs=(2,)))
    model = replace(model, runs=(None, None))  # type: ignore[arg-type]
    found = find_rests(model, runs, list(runs[0].channels)).rests
    assert [(r.number, r.run, r.held_out) for r in found] == [
        *((k, 0, False) for k in (1, 2, 3)),
        *((k, 1, True) for k in (4, 5, 6)),
    ]


def test_a_rest_on_a_moving_bench_is_left_out_and_named() -> None:
    run = recording(Case(), 11)
    values = run.channels["accel_z"].values.copy()
    start, stop = found_rows(run)[4]
    values[start - 5 : stop + 5] += 0.1
    bumped = replace(run, channels={**run.channels, "accel_z": Channel(values, "m/s^2")})
    found = trace_positions(manifest(ACCELS, CALIBRATED), (bumped,))
    assert any(text.startswith("rest 5 (simulated, ") for text in found.remarks)
    assert names(found.accel.outcome) == []
