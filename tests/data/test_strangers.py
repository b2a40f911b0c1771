"""Recordings as strangers bring them: what jitters is mended, what is lost is lived with, what cannot be is refused.

Each shape is tried on a run that lacks nothing and on one with an effect of twenty deviations. A search at 1 % invents
something in one null of a hundred: the seeds are fixed, and those below are sound.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from simulated_runs import gyro_run
from strangers import MEANS, Columns, Shape, closed_file, columns, kept, lost, merged, write

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Channel, Recording
from insenv.data.clock import clock_of
from insenv.data.exposure import expose
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.resample import spread
from insenv.data.split import split
from insenv.identify.findings import Findings
from insenv.identify.fit.bins import gather
from insenv.report.words import key_of

RNG = np.random.Generator
DT = 0.1


def with_(c: Columns, **changed: np.ndarray) -> Columns:
    return {**c, **changed}


def without(c: Columns, name: str) -> Columns:
    return {n: v for n, v in c.items() if n != name}


def some_lost(share: float):  # type: ignore[no-untyped-def]
    return lambda c, r: kept(c, np.flatnonzero(r.random(len(c["time"])) > share))


def cut(count: int, length: float):  # type: ignore[no-untyped-def]
    def spoil(c: Columns, r: RNG) -> Columns:
        for start in np.sort(r.uniform(0, c["time"][-1] - length, count)):
            c = lost(c, start, start + length)
        return c

    return spoil


def jittered(sd: float):  # type: ignore[no-untyped-def]
    def spoil(c: Columns, r: RNG) -> Columns:
        return with_(c, time=np.maximum.accumulate(c["time"] + sd * r.standard_normal(len(c["time"]))))

    return spoil


def doubled(c: Columns, r: RNG) -> Columns:
    n = len(c["time"])
    return kept(c, np.sort(np.concatenate([np.arange(n), r.integers(0, n, 20)])))


def uneven(c: Columns, r: RNG) -> Columns:
    n = len(c["time"])
    steps = np.maximum(1, np.round(5 * (1 + 0.6 * r.standard_normal(n // 4)))).astype(int)
    return merged(c, np.cumsum(steps) - 1)


def sampled_late(c: Columns, r: RNG) -> Columns:
    n = len(c["time"]) // 10
    return merged(c, 10 * np.arange(1, n + 1) - 1 + r.integers(-2, 3, n))


def held(every: int, quantum: float):  # type: ignore[no-untyped-def]
    def spoil(c: Columns, r: RNG) -> Columns:
        t = np.repeat(c["temperature"][::every], every)[: len(c["time"])]
        return with_(c, temperature=np.round(t / quantum) * quantum if quantum else t)

    return spoil


def wrapped(c: Columns, r: RNG) -> Columns:
    return with_(c, table_angle=np.mod(c["table_angle"], 2 * np.pi))


def backwards(c: Columns, r: RNG) -> Columns:
    return with_(c, table_angle=-c["table_angle"], table_rate=-c["table_rate"], gyro=-c["gyro"])


def late_gyro(c: Columns, r: RNG) -> Columns:
    return with_(kept(c, np.arange(len(c["time"])) >= 3), gyro=c["gyro"][:-3])


def increments(c: Columns, r: RNG) -> Columns:
    return with_(some_lost(0.05)(c, r), gyro=some_lost(0.05)(c, np.random.default_rng(10_001))["gyro"] * DT)


def counts(c: Columns, r: RNG) -> Columns:
    return with_(jittered(0.02)(c, r), gyro=c["gyro"] * DT)


SHAPES = {
    "stamps that jitter by a tenth": Shape(jittered(0.01)),
    "stamps that jitter by a third": Shape(jittered(0.03)),
    "stamps rounded to whole seconds": Shape(lambda c, r: with_(c, time=np.round(c["time"]))),
    "a sampler that is late at times": Shape(sampled_late, dt=0.02),
    "steps of any length, resampled": Shape(uneven, {"": MEANS + '[fit]\nresample = "2 Hz"\n'}, dt=0.02),
    "rows written twice": Shape(doubled),
    "a tenth of the rows lost": Shape(some_lost(0.1)),
    "a hundred gaps": Shape(cut(100, 1.0)),
    "gaps of minutes": Shape(cut(2, 90.0)),
    "seconds since 1970": Shape(lambda c, r: with_(c, time=c["time"] + 1.7e9)),
    "microseconds": Shape(lambda c, r: with_(c, time=np.round(c["time"] * 1e6) - 3e8), {"time": 'unit = "us"'}),
    "an angle that wraps": Shape(wrapped, {"table_angle": "wrapped = true"}),
    "an angle that falls": Shape(backwards),
    "no angle": Shape(lambda c, r: without(c, "table_angle")),
    "no commanded rate": Shape(lambda c, r: without(c, "table_rate")),
    "temperature every 30 s": Shape(held(300, 0.0)),
    "temperature in whole kelvin": Shape(held(10, 1.0)),
    "a gyro that is late by 0.3 s": Shape(late_gyro, {"gyro": 'delay = "300 ms"'}),
    "counts at stamps that jitter": Shape(counts, {"gyro": 'unit = "rad", quantity = "increment"'}),
}


def keys(found: Findings) -> list[str]:
    return [key_of(added) for added in found.targets[0].added]


@pytest.mark.parametrize("name", SHAPES)
def test_nothing_is_found_where_nothing_is(tmp_path: Path, name: str) -> None:
    found = closed_file(tmp_path, SHAPES[name], "reversal", 3, duration=900)
    assert (found.verdict, keys(found)) == ("nothing-significant", [])


@pytest.mark.parametrize("name", SHAPES)
def test_an_effect_is_named(tmp_path: Path, name: str) -> None:
    found = closed_file(tmp_path, SHAPES[name], "reversal", 3, (("encoder_harmonic:1", np.array([1e-5, 1e-5])),), 900)
    assert keys(found) == ["encoder_harmonic:1"]


def read(folder: Path, c: Columns, tail: str = MEANS):  # type: ignore[no-untyped-def]
    return read_recordings(load_manifest(write(folder, [c], {"": tail}, ("bias",))))[0]


def sound(duration: float = 300.0) -> Columns:
    return columns(gyro_run("reversal", 5, duration=duration))


def test_steps_of_any_length_are_made_means_and_it_is_said(tmp_path: Path) -> None:
    c = uneven(columns(gyro_run("reversal", 5, duration=600.0, dt=0.02)), np.random.default_rng(0))
    means = read(tmp_path, c)
    assert any("resampled to" in note and "over 0.5 s" in note for note in means.notes)
    asked = read(tmp_path, c, '[fit]\nresample = "2 Hz"\n')
    np.testing.assert_array_equal(means.channels["gyro"].values, asked.channels["gyro"].values)


def test_steps_of_any_length_are_refused_where_rows_of_several_runs_are_counted(tmp_path: Path) -> None:
    c = uneven(columns(gyro_run("reversal", 5, duration=600.0, dt=0.02)), np.random.default_rng(0))
    path = write(tmp_path, [c, c], {"": "[fit]\nrows = [[0, 100]]\n"}, ("bias",))
    with pytest.raises(InputError, match=r'not evenly sampled \(steps of .* to .* s, .*fit.resample = "2 Hz"'):
        read_recordings(load_manifest(path))


def test_means_finer_than_the_rows_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"fit.resample = 10 Hz; the median step .* wanted at most 5 Hz"):
        read(tmp_path, sound(), '[fit]\nresample = "10 Hz"\n')
    own = sound()
    own["time"] = np.asarray(0.0358 * np.arange(len(own["time"])), np.float64)
    with pytest.raises(InputError, match=r"fit.resample = 14 Hz; .* wanted at most 13.9 Hz"):
        read(tmp_path, own, '[fit]\nresample = "14 Hz"\n')
    tail = '[fit]\nresample = "2 Hz"\nrows = [[0, 100]]\n'
    with pytest.raises(InputError, match=r"fit.rows beside fit.resample.* of 2 runs"):
        load_manifest(write(tmp_path, [sound(), sound()], {"": tail}, ("bias",)))


def test_rows_are_counted_in_the_file_beside_means(tmp_path: Path) -> None:
    """Who resamples for uneven steps still names the rows of the file that are good: a mean is one if all of it is."""
    manifest = load_manifest(
        write(tmp_path, [sound()], {"": '[fit]\nresample = "2 Hz"\nrows = [[1001, 2000]]\n'}, ("bias",))
    )
    recordings = read_recordings(manifest)
    (use,) = split(manifest, recordings)
    fitted = np.flatnonzero(use.fit | use.held_out)
    made_of = recordings[0].made_of
    assert made_of is not None
    assert made_of[fitted[0], 0] in range(1001, 1007)
    assert made_of[fitted[-1], 1] in range(1995, 2001)
    assert len(fitted) == fitted[-1] - fitted[0] + 1


def test_means_over_uneven_rows_keep_the_turned_angle(tmp_path: Path) -> None:
    """To rounding of the file: the integral of the whole is kept, whatever the steps."""
    fine = columns(gyro_run("sine", 5, duration=300.0, dt=0.02))
    c = uneven(fine, np.random.default_rng(0))
    means = read(tmp_path, c, '[fit]\nresample = "2 Hz"\n')
    angle = means.channels["table_angle"].values
    rate = means.channels["table_rate"].values
    whole = np.diff(means.t) < 0.51
    np.testing.assert_allclose(np.diff(angle)[whole], 0.5 * rate[1:][whole], rtol=0, atol=2e-3)
    assert "resampled" in means.notes[0]


def test_no_mean_reaches_over_a_gap(tmp_path: Path) -> None:
    means = read(tmp_path, lost(sound(), 100.0, 160.0), '[fit]\nresample = "1 Hz"\n')
    assert not ((means.t > 100.5) & (means.t < 160.5)).any()


@pytest.mark.parametrize("sd", [0.004, 0.01, 0.03, 0.1])
def test_a_clock_is_found_behind_stamps_that_jitter(sd: float) -> None:
    t = 7.0 + 0.1 * np.arange(5000)
    clock = clock_of(np.maximum.accumulate(t + sd * np.random.default_rng(1).standard_normal(5000)))
    assert clock.steady
    assert clock.period == pytest.approx(0.1, rel=1e-4)
    assert np.ptp(clock.even - t) < 0.02  # a line through 5000 stamps; 0.1 s of jitter reorders some


@pytest.mark.parametrize("quantum", [0.01, 0.04, 1.0])
def test_rounded_stamps_are_no_lost_rows(quantum: float) -> None:
    t = np.arange(8000) / 80
    clock = clock_of(np.round(t / quantum) * quantum)
    assert clock.steady
    assert clock.period == pytest.approx(1 / 80, rel=1e-4)
    assert np.ptp(clock.even - t) < 0.01


def test_lost_rows_leave_the_stamps_alone() -> None:
    t = 0.1 * np.flatnonzero(np.random.default_rng(2).random(5000) > 0.3)
    clock = clock_of(np.asarray(t, float))
    assert clock.period == pytest.approx(0.1, rel=1e-9)
    np.testing.assert_array_equal(clock.even, t)


@pytest.mark.parametrize("spread", [0.2, 0.6])
def test_steps_that_add_up_have_no_clock(spread: float) -> None:
    steps = 0.1 * np.maximum(0.01, 1 + spread * np.random.default_rng(3).standard_normal(20_000))
    assert not clock_of(np.asarray(np.cumsum(steps), float)).steady


def test_copies_of_rows_are_left_out_unless_rows_are_counted(tmp_path: Path) -> None:
    c = doubled(sound(), np.random.default_rng(0))
    found = read(tmp_path, c)
    assert len(found) == 3000 and "repeat the row before" in found.notes[0]
    with pytest.raises(InputError, match="repeats the row before, one of .* such rows"):
        read(tmp_path, c, "[held_out]\nrows = [[2000, 3000]]\n")


def test_two_readings_at_one_time_are_refused(tmp_path: Path) -> None:
    c = kept(sound(), np.sort(np.append(np.arange(3000), 49)))
    c["gyro"][50] += 1e-3
    with pytest.raises(InputError, match="time stands still"):
        read(tmp_path, c)


def test_runs_of_different_length_tilt_and_site(tmp_path: Path) -> None:
    whole = columns(gyro_run("reversal", 1, duration=1950.0))
    runs = [kept(whole, np.arange(a, b)) for a, b in ((0, 9000), (9000, 13_000), (13_000, 19_500))]
    for c in runs:
        c["time"] -= c["time"][0]
    tables = "".join(
        f'[[runs]]\nfile = "run_{i}.csv"\nlabel = "{label}"\n[runs.mounting]\ntilt = "{tilt} deg"\n'
        for i, (label, tilt) in enumerate((("upright", 90), ("again", 90), ("turned over", -90)), start=1)
    )
    runs[2]["gyro"] = -runs[2]["gyro"]
    path = write(tmp_path, runs, {"": f'bias = "per-run"\n{MEANS}{tables}'}, ("bias", "scale_factor"))
    found = close(path)
    assert found.verdict == "nothing-significant"
    assert found.rows == 9000 + 4000 + 6500


def test_a_run_in_many_pieces_is_not_as_many_blocks() -> None:
    """Hundreds of transforms of a few bins each would be slow, and their levels would tell nothing."""
    c = cut(200, 1.0)(columns(gyro_run("rest", 4, duration=1800.0)), np.random.default_rng(0))
    whole = np.ones(len(c["time"]), bool)
    channel = Channel(c["gyro"], "rad/s", "interval")
    exposure = expose(Recording(c["time"], {"gyro": channel}), "gyro")
    bins = gather((exposure,), (whole,), (~whole,), 5, 1)
    assert len(bins.blocks) <= 20
    assert sum(block.n for block in bins.blocks) == bins.n


def test_a_few_gaps_part_blocks() -> None:
    c = lost(lost(columns(gyro_run("rest", 4, duration=600.0)), 100.0, 102.0), 300.0, 301.0)
    whole = np.ones(len(c["time"]), bool)
    exposure = expose(Recording(c["time"], {"gyro": Channel(c["gyro"], "rad/s", "interval")}), "gyro")
    assert len(gather((exposure,), (whole,), (~whole,), 5, 1).blocks) == 3


def test_rows_that_share_a_stamp_stand_in_the_time_since_the_stamp_before(tmp_path: Path) -> None:
    own, untold = spread(np.array([0.0, 1.0, 2.5]))
    np.testing.assert_array_equal(own, [0.0, 1.0, 2.5])
    shared, told = spread(np.array([0.0, 0.0, 1.0, 3.0, 3.0, 3.0, 3.0, 4.0]))
    np.testing.assert_allclose(shared, [-0.5, 0.0, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0])
    assert untold == () and "6 rows share" in told[0]
    c = uneven(columns(gyro_run("sine", 5, duration=300.0, dt=0.02)), np.random.default_rng(0))
    c["time"] = np.floor(c["time"] / 0.03) * 0.03  # many rows share a stamp then
    means = read(tmp_path, c, '[fit]\nresample = "2 Hz"\n')
    assert np.all(np.diff(means.t) > 0) and any("share their time stamp" in note for note in means.notes)
