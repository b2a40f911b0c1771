"""Outlying rows: found on a turning table and in held-out data too, named in the report, and nothing real among them.

A Gaussian sample lies eight deviations off with probability 1e-15: the nulls below have no false alarm by chance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import KINDS, closed, declared_for, gyro_run, manifest, scaled, without_rows

from insenv.core.recording import Channel, Floats, Recording
from insenv.effects.catalogue import by_key
from insenv.identify.clean.outliers import too_many, without_outliers
from insenv.identify.findings import RejectedRows
from insenv.report.json import to_json
from insenv.report.text import summary

SEEDS = range(6)


def changed(recording: Recording, name: str, rows: slice | list[int], values: Floats | float) -> Recording:
    channel = recording.channels[name]
    new = channel.values.copy()
    new[rows] = values
    return replace(recording, channels={**recording.channels, name: replace(channel, values=new)})


def scatter(recording: Recording) -> float:
    """Deviation of a row of the gyro, table at rest or not."""
    steps = np.abs(np.diff(recording.channels["gyro"].values))
    return float(np.median(steps) / 0.6745 / np.sqrt(2))


def rejected(recording: Recording, longest: int = 10) -> tuple[RejectedRows, ...]:
    return without_outliers((recording,), "gyro", longest)[1]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", SEEDS)
def test_a_sound_run_keeps_every_row(kind: str, seed: int) -> None:
    assert rejected(gyro_run(kind, seed, duration=900.0).recording) == ()


@pytest.mark.parametrize("kind", ["constant", "reversal", "rest"])
@pytest.mark.parametrize("row", [1000, 7000])
def test_spikes_are_found_wherever_they_are(kind: str, row: int) -> None:
    recording = gyro_run(kind, 1, duration=900.0).recording
    level = recording.channels["gyro"].values
    spiked = changed(recording, "gyro", [row, row + 1], level[row] + 20 * scatter(gyro_run("rest", 1).recording))
    assert [(r.start, r.stop) for r in rejected(spiked)] == [(row, row + 2)]


@pytest.mark.parametrize("kind", ["constant", "reversal", "sine", "rest"])
def test_a_value_that_sticks_is_found(kind: str) -> None:
    recording = gyro_run(kind, 2, duration=900.0).recording
    stuck = changed(recording, "gyro", slice(3000, 3020), recording.channels["gyro"].values[3000])
    found = rejected(stuck)
    assert [(r.start, r.stop) for r in found] == [(3001, 3020)]
    assert "equal values" in found[0].reason


@pytest.mark.parametrize("kind", ["constant", "sine"])
def test_a_wrong_angle_is_no_rate(kind: str) -> None:
    recording = gyro_run(kind, 2, duration=900.0).recording
    angle = recording.channels["table_angle"].values
    leap = changed(recording, "table_angle", [4000], angle[4000] + np.deg2rad(1))
    assert [(r.start, r.stop) for r in rejected(leap)] == [(4000, 4002)]


def test_coarse_readings_do_not_stick() -> None:
    """A counter at rest shows the same number of pulses most of the time."""
    recording = gyro_run("rest", 2, duration=900.0).recording
    values = recording.channels["gyro"].values
    quantum = 6 * scatter(recording)
    assert rejected(changed(recording, "gyro", slice(None), np.floor(values / quantum) * quantum)) == ()


def test_a_count_more_of_a_counter_at_rates_of_whole_counts_is_no_outlier() -> None:
    """A laser gyro on a table of four rates: nearly every row has the same counts, and no scatter; ten more are one."""
    step, dt, rng = 1e-5, 0.002, np.random.default_rng(6)
    rate = np.repeat([0.0, 9.0, 0.0, -9.0], 3000) * step / dt
    angle = np.cumsum(rate) * dt / step + 0.5 + np.cumsum(0.02 * rng.standard_normal(rate.size))
    counts = np.diff(np.floor(angle), prepend=0.0)
    channels = {
        "gyro": Channel(counts * step / dt, "rad/s", "interval"),
        "table_rate": Channel(rate, "rad/s", source="encoder"),
    }
    recording = Recording(dt * np.arange(1.0, rate.size + 1), channels, label="a")
    assert 20 < np.count_nonzero(np.abs(counts - rate * dt / step) > 0.5) < 0.05 * counts.size
    assert not [r for r in rejected(recording, 512) if r.cause == "outlier"]
    spiked = changed(recording, "gyro", [1200], 10 * step / dt)
    assert [(r.start, r.stop) for r in rejected(spiked, 512) if r.cause == "outlier"] == [(1200, 1201)]


def test_a_disturbance_at_one_angle_is_the_tables() -> None:
    run = gyro_run("constant", 3, duration=900.0)
    angle = run.recording.channels["table_angle"].values
    passing = np.flatnonzero(np.diff(np.floor(angle / (2 * np.pi))) > 0)
    values = run.recording.channels["gyro"].values
    disturbed = changed(
        run.recording, "gyro", passing.tolist(), values[passing] + 30 * scatter(gyro_run("rest", 3).recording)
    )
    assert rejected(disturbed) == ()


STRONG = {
    "bias_step": (1.0, 250.0),
    "bias_warm_up": (1.0, 20.0),
    "encoder_harmonic:4": (1.0, 1.0),
    "angle_locked_rate:1": (1.0, 1.0),
    "tone": (1.0, 1.0, 0.4),
    "scale_factor_anomaly": (1.0, np.deg2rad(20), np.deg2rad(0.5)),
    "timing_skew": (1.0,),
    "bias_temperature:1": (1.0,),
}


@pytest.mark.parametrize("kind", ["staircase", "sine", "rest"])
@pytest.mark.parametrize("key", STRONG)
def test_a_strong_effect_is_not_eaten(kind: str, key: str) -> None:
    bare = gyro_run(kind, 3, duration=900.0)
    if bare.motion.angle is None and ("angle" in by_key(key).needs or by_key(key).of_rate):
        pytest.skip("needs a table that turns")
    sized = scaled(bare, key, np.array(STRONG[key]), 300.0)
    if not np.isfinite(sized).all():
        pytest.skip("not excited")
    assert rejected(gyro_run(kind, 3, ((key, sized),), duration=900.0).recording) == ()


@pytest.mark.parametrize("kind", ["staircase", "sine"])
def test_lock_in_is_not_eaten(kind: str) -> None:
    lock = ("lock_in", np.array([np.deg2rad(0.5)]))
    assert rejected(gyro_run(kind, 3, (lock,), duration=900.0).recording) == ()


def test_rows_are_named_after_their_place_in_a_file_with_gaps() -> None:
    recording = without_rows(gyro_run("rest", 4, duration=900.0).recording, (1000, 1500))
    values = recording.channels["gyro"].values
    spiked = changed(recording, "gyro", [2000], values[2000] - 50 * scatter(recording))
    assert [(r.start, r.stop) for r in rejected(spiked)] == [(2000, 2001)]


@pytest.mark.parametrize("every, told", [(20, True), (8, True), (5, False), (500, False)])
def test_single_rows_that_are_too_many_to_be_left_out_are_told(every: int, told: bool) -> None:
    """Of a link one row in twenty was wrong, by either sign: it was kept as how the unit is, and no word said so."""
    recording = gyro_run("rest", 5, duration=900.0).recording
    rng = np.random.default_rng(1)
    rows = np.sort(rng.choice(np.arange(50, len(recording) - 50), len(recording) // every, replace=False)).tolist()
    signs = rng.choice([-1.0, 1.0], len(rows))
    wrong = changed(recording, "gyro", rows, recording.channels["gyro"].values[rows] + 20 * signs * scatter(recording))
    left_out = without_outliers((wrong,), "gyro", 1)[1]
    said = too_many((wrong,), "gyro", left_out)
    assert bool(left_out) is (every == 500)
    assert bool(said) is told
    if told:
        assert int(said[0].split()[0]) == pytest.approx(len(rows), rel=0.1)
        found = closed(wrong, manifest(declared=declared_for(recording)))
        assert found.verdict == "unexplained-structure"
        assert said[0] in found.targets[0].reasons
    assert too_many((recording,), "gyro", ()) == ()


def test_the_report_counts_and_names_what_was_left_out() -> None:
    """One spike of a thousand deviations in the fitted data and one in the held-out data change neither error."""
    recording = gyro_run("reversal", 6, duration=900.0).recording
    values, size = recording.channels["gyro"].values, 1000 * scatter(gyro_run("rest", 6).recording)
    spiked = changed(recording, "gyro", [2000, 7000], values[[2000, 7000]] + size)
    asked = manifest(declared=declared_for(recording), averaging=1.0)
    clean, found = closed(recording, asked), closed(spiked, asked)
    assert found.verdict == clean.verdict == "nothing-significant"
    assert found.targets[0].held_out.before == pytest.approx(clean.targets[0].held_out.before, rel=0.01)
    document = to_json(found)
    assert [(r["run"], r["rows"]) for r in document["rows_rejected"]] == [(1, [2000, 2001]), (1, [7000, 7001])]
    assert "2 rows left out as outliers" in " ".join(summary(found).split())
    assert to_json(clean)["rows_rejected"] == []


@pytest.mark.parametrize("kind", ["constant", "reversal"])
@pytest.mark.parametrize("number", [0.0, -1.0])
def test_rows_that_were_not_read_are_found_however_many(kind: str, number: float) -> None:
    """Three in a hundred read one number, single ones and pairs: too many to be outliers, and all alike."""
    recording = gyro_run(kind, 2, duration=300.0).recording
    sound = recording.channels["gyro"].values
    at = np.random.default_rng(3).choice(np.arange(10, len(recording) - 10, 5), int(0.025 * len(recording)), False)
    rows = np.sort(np.concatenate([at, at[::5] + 1]))
    found = [one for one in rejected(changed(recording, "gyro", rows.tolist(), number)) if "not read" in one.reason]
    missing = np.concatenate([np.arange(one.start, one.stop) for one in found])
    far = rows[np.abs(sound[rows] - number) > 6 * scatter(recording)]
    assert np.isin(far, missing).all() and np.isin(missing, rows).all()


def test_a_table_that_stops_again_and_again_reads_nothing_there() -> None:
    """A motor that is pulsed: nought between others for three rows of ten, and again; that is how it turns."""
    pulses = np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0], 300)
    values = pulses + 0.01 * np.random.default_rng(4).standard_normal(3000) * pulses
    recording = Recording(0.01 * np.arange(3000.0), {"gyro": Channel(values, "rad/s")})
    assert not [one for one in rejected(recording) if "not read" in one.reason]


@pytest.mark.parametrize("spread", [0.3, 0.6])
def test_a_counter_of_few_numbers_was_read_in_all_rows(spread: float) -> None:
    """One count more now and then, written in two lengths: a row in nine of a navigator was taken for unread."""
    rng = np.random.default_rng(5)
    counts = np.round(spread * rng.standard_normal(6000) + 0.15)
    values = counts * np.where(rng.random(6000) < 0.9, 4.8856e-4, 4.8832e-4)
    recording = Recording(0.01 * np.arange(6000.0), {"gyro": Channel(values, "rad/s")})
    assert not [one for one in rejected(recording) if "not read" in one.reason]


@pytest.mark.parametrize("seed", range(3))
def test_a_table_that_goes_by_whole_steps_from_row_to_row_is_no_rounded_angle(seed: int) -> None:
    """At rates of 2.5 deg/s all angles are multiples of a quarter of a degree, and no row is uncertain by one."""
    rng = np.random.default_rng(seed)
    rates = np.radians(np.repeat([0.0, 50.0, -100.0, 10.0, 0.0, -50.0], 500))
    angle = np.cumsum(rates) * 0.1
    values = np.diff(angle, prepend=0.0) / 0.1 + 3e-4 * rng.standard_normal(len(rates))
    spikes = np.array([120, 730, 1310, 1820, 2270, 2760])
    values[spikes] += 0.03 * rng.choice([-1.0, 1.0], len(spikes))
    channels = {"gyro": Channel(values, "rad/s", "interval"), "table_angle": Channel(angle, "rad")}
    recording = Recording(0.1 * np.arange(1.0, len(rates) + 1), channels)
    _, rejected = without_outliers((recording,), "gyro", 64)
    assert [row for one in rejected for row in range(one.start, one.stop)] == spikes.tolist()
