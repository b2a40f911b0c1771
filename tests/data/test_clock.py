"""Stamps that are wrong by themselves: late, early, doubled, rushed, set, rounded; the answer is that of sound ones."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from strangers import Columns, write

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.recording import Floats, Recording
from insenv.data.clock import clock_of
from insenv.data.exposure import expose
from insenv.data.load import read_recordings
from insenv.data.manifest import load_manifest
from insenv.data.reference import with_reference
from insenv.data.sampling import after_rollovers, check_one_unit, sampling
from insenv.identify.findings import Findings

N, DT = 3000, 0.01
DAY = 86400.0


def rng() -> np.random.Generator:
    return np.random.default_rng(1)


def late(share: float, least: float = 0.3, most: float = 0.9, sign: int = 1) -> Callable[[Floats], Floats]:
    """Stamps off by a part of a period, rows apart."""

    def spoil(t: Floats) -> Floats:
        rows = 3 + 3 * rng().choice(N // 3 - 2, max(1, round(share * N)), replace=False)
        out = t.copy()
        out[rows] += sign * DT * rng().uniform(least, most, len(rows))
        return out

    return spoil


def rushed(rows: int) -> Callable[[Floats], Floats]:
    """A logger that is busy, and then writes what has come in a rush."""

    def spoil(t: Floats) -> Floats:
        out = t.copy()
        for first in (500, 1234, 2200):
            end = t[first + rows] - 1e-6 * np.arange(rows, 0, -1)
            out[first : first + rows] = np.maximum(out[first : first + rows], end)
        return out

    return spoil


def doubled(t: Floats) -> Floats:
    out = t.copy()
    out[[300, 1234, 2000]] = out[[299, 1233, 1999]]
    return out


WRONG = {
    "one late": late(1e-9),
    "half a per cent late": late(0.005),
    "a tenth late": late(0.1),
    "half a per cent early": late(0.005, sign=-1),
    "almost a period late": late(0.005, 0.9, 0.99),
    "a rush of five": rushed(5),
    "a rush of forty": rushed(40),
    "doubled": doubled,
}
SAME = {  # the stamps in the unit of the manifest
    "seconds since 1970": (lambda t: t + 1.7e9, "s"),
    "microseconds since 1970": (lambda t: np.round((t + 1.7e9) * 1e6), "us"),
    "nanoseconds since 1970": (lambda t: np.round((t + 1.7e9) * 1e9), "ns"),
    "date numbers": (lambda t: t / DAY + 739_000, "day"),
    "days since 1900": (lambda t: t / DAY + 45_000, "day"),
    "day fractions": (lambda t: t / DAY, "day"),
    "single precision": (lambda t: (t + 1000).astype(np.float32).astype(float), "s"),
}


@pytest.mark.parametrize("name", WRONG)
@pytest.mark.parametrize("origin", [0.0, 1.7e9])
def test_a_wrong_stamp_gets_the_time_of_the_clock(name: str, origin: float) -> None:
    t = np.asarray(DT * np.arange(N), np.float64)
    spoilt = WRONG[name](t) + origin
    clock = clock_of(spoilt - spoilt[0])
    np.testing.assert_allclose(clock.even, t, rtol=0, atol=1e-6)
    wrong = np.abs(spoilt - origin - t) > 0.01 * DT
    np.testing.assert_array_equal(clock.off, wrong)
    assert not clock.leaps.any()


@pytest.mark.parametrize("share", [0.01, 0.3])
@pytest.mark.parametrize("seed", range(3))
def test_stamps_are_late_and_rows_are_lost(share: float, seed: int) -> None:
    """Where it is not sure which row was lost the row is said to be doubtful: all others have their time."""
    draw = np.random.default_rng(seed)
    t = 0.02 * np.flatnonzero(draw.random(5000) > share).astype(float)
    late_ones = draw.random(len(t)) < 0.02
    spoilt = t + np.where(late_ones, 0.02 * draw.uniform(0.1, 0.9, len(t)), 0.0)
    clock = clock_of(spoilt - spoilt[0])
    sure = ~clock.unsure
    assert sure.mean() > 0.95
    np.testing.assert_allclose(clock.even[sure], (t - spoilt[0])[sure], rtol=0, atol=1e-9)


@pytest.mark.parametrize("by", [0.4, -0.4])
def test_a_clock_that_is_set_is_said_and_its_row_left_out(by: float) -> None:
    t = np.asarray(DT * np.arange(N), np.float64)
    t[1234:] += by * DT
    clock = clock_of(t)
    assert np.flatnonzero(clock.leaps).tolist() == [1234]
    np.testing.assert_allclose(clock.even, t, rtol=0, atol=1e-9)


@pytest.mark.parametrize("period", [0.007, 0.0073, 0.0099, 0.0101])
def test_stamps_in_whole_milliseconds_follow_one_line(period: float) -> None:
    t = np.asarray(period * np.arange(5000), np.float64)
    clock = clock_of(np.asarray(np.round(t, 3), np.float64))
    assert clock.period == pytest.approx(period, rel=1e-6)
    assert np.ptp(clock.even - t) < 1e-4
    assert not clock.leaps.any() and not clock.off.any()


def bench() -> Columns:
    """A quiet gyro of 50 ppm on a table whose angle is read; its increments are of the interval."""
    draw = rng()
    levels = np.deg2rad([10.0, -10, 20, -20, 40, -40, 60, -60, 30, -30])
    rate = levels[(np.arange(N) // 150) % len(levels)]
    rate = np.convolve(np.append(np.full(20, rate[0]), rate), np.full(20, 1 / 20))[20 : 20 + N]
    noise = 3e-6 * draw.standard_normal(N)
    t = np.asarray(DT * np.arange(1, N + 1), np.float64)
    return {"time": t, "gyro": rate * (1 + 50e-6) + 2e-6 + noise, "table_angle": np.cumsum(rate) * DT}


def closed(folder: Path, c: Columns, unit: str = "s") -> Findings:
    says = {"time": f'unit = "{unit}"', "": '[held_out]\naveraging = "0.1 s"\n'}
    return close(write(folder, [c], says, ("bias", "scale_factor")))


def scale_factor(found: Findings) -> tuple[float, float]:
    (estimate,) = [e for e in found.targets[0].estimates_after if e.effect == "scale_factor"]
    return estimate.value, estimate.sd


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> tuple[float, float]:
    found = scale_factor(closed(tmp_path_factory.mktemp("sound"), bench()))
    assert abs(found[0] - 50e-6) < 3 * found[1]
    return found


@pytest.mark.parametrize("name", WRONG)
def test_wrong_stamps_do_not_change_the_answer(tmp_path: Path, name: str, sound: tuple[float, float]) -> None:
    c = bench()
    found = closed(tmp_path, {**c, "time": WRONG[name](c["time"])})
    assert scale_factor(found) == pytest.approx(sound, abs=0.1 * sound[1])
    assert found.verdict == "nothing-significant"
    assert any("off the clock" in remark for remark in found.remarks)


@pytest.mark.parametrize("name", SAME)
def test_the_unit_of_time_does_not_change_the_answer(tmp_path: Path, name: str, sound: tuple[float, float]) -> None:
    stamps, unit = SAME[name]
    c = bench()
    found = closed(tmp_path, {**c, "time": stamps(c["time"])}, unit)
    assert scale_factor(found) == pytest.approx(sound, abs=0.3 * sound[1])
    assert found.verdict == "nothing-significant"
    assert not any("stamp" in remark or "clock" in remark for remark in found.remarks)


def test_a_sampler_that_was_late_itself_is_left_out_there(tmp_path: Path) -> None:
    """The table's angle tells a late reading from a late stamp: its increment is of another interval."""
    c = bench()
    t = late(0.005, 0.4, 0.6)(c["time"])
    angle = np.interp(t, c["time"], c["table_angle"])
    path = write(tmp_path, [{**c, "time": t, "table_angle": angle}], {}, ("bias", "scale_factor"))
    recording: Recording = read_recordings(load_manifest(path))[0]
    wrong = np.flatnonzero(t != c["time"])
    assert set(wrong.tolist()) <= set(np.flatnonzero(recording.left_out["gyro"]).tolist())
    np.testing.assert_allclose(recording.channels["table_angle"].values, c["table_angle"], rtol=0, atol=5e-4)


@pytest.mark.parametrize(("jitter", "decimals"), [(1.5e-4, 4), (1e-3, 3)])
@pytest.mark.parametrize("bits", [12, 14])
def test_stamps_that_an_encoder_cannot_confirm_are_those_of_the_clock(
    tmp_path: Path, jitter: float, decimals: int, bits: int
) -> None:
    """Rates by stamps that jitter by s of a period are 1 + 2 s^2 too large: a scale factor of -0.9e-3 was told."""
    for seed in range(3):
        draw = np.random.default_rng(seed)
        t = 0.005 * np.arange(1, 20001)
        angle = np.radians(50.0) / (0.4 * np.pi) * (1 - np.cos(0.4 * np.pi * t))
        step = 2 * np.pi / 2**bits
        stamps = np.maximum.accumulate(np.round(t + jitter * 0.5 * draw.standard_normal(len(t)), decimals + 1))
        rows = np.column_stack([stamps + 1e-7 * np.arange(len(t)), np.floor(angle / step) * step])
        np.savetxt(
            tmp_path / "run.csv", np.column_stack([rows, draw.standard_normal(len(t))]), "%.9f", ",", header="t,a,g"
        )
        (tmp_path / "run.toml").write_text(
            'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
            'gyro = { column = "g", unit = "rad/s" }\ntable_angle = { column = "a", unit = "rad" }\n'
            '[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
        )
        (run,) = read_recordings(load_manifest(tmp_path / "run.toml"))
        assert np.ptp(np.diff(run.t)) < 1e-6, (seed, run.notes)


@pytest.mark.parametrize("seed", range(3))
def test_turns_of_a_wrapped_angle_hide_no_steps_of_its_encoder(tmp_path: Path, seed: int) -> None:
    """Stamps 3 % of a period off were taken, and a gain of -2 promille told: wraps hid that the angle has steps."""
    draw = np.random.default_rng(seed)
    t = 0.05 * np.arange(1, 12001)
    angle = 5.0 / (0.04 * np.pi) * (1 - np.cos(0.04 * np.pi * t)) - 5.0
    step = 360 / 2**13
    stamps = np.round(t + 1.5e-3 * draw.standard_normal(len(t)), 3)
    read = np.mod(np.floor(angle / step) * step, 360.0)
    np.savez(tmp_path / "run.npz", t=stamps, a=read, g=draw.standard_normal(len(t)))
    (tmp_path / "run.toml").write_text(
        'data = "run.npz"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "g", unit = "rad/s" }\ntable_angle = { column = "a", unit = "deg", wrapped = true }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    )
    (run,) = read_recordings(load_manifest(tmp_path / "run.toml"))
    assert np.ptp(np.diff(run.t)) < 1e-6, run.notes
    assert np.ptp(run.channels["table_angle"].values) < np.pi


def test_a_median_between_two_steps_is_no_fault() -> None:
    """Of an even number of uneven steps none need be like the median."""
    random = np.random.default_rng(1)
    steps = np.concatenate([random.choice([0.01, 0.02, 0.04], 250), random.choice([0.05, 0.07, 0.3], 250)])
    t = np.cumsum(random.permutation(steps + 1e-3 * random.random(500)))
    assert np.isfinite(clock_of(t - t[0]).period)


def read_back(folder: Path, rows: Floats) -> Recording:
    """Times, a gyro and the angle of an encoder, shape (n, 3), as they are read of a file."""
    np.savetxt(folder / "run.csv", rows, "%.9f", ",", header="t,g,a", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "g", unit = "rad/s" }\n'
        'table_angle = { column = "a", unit = "rad", source = "encoder" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    )
    (run,) = read_recordings(load_manifest(folder / "run.toml"))
    return run


def test_rows_pressed_to_one_instant_are_left_out(tmp_path: Path) -> None:
    """A clock that runs ahead and is set back by 0.13 s every 5 s, in a recorder that lets no time run backwards."""
    taken = DT * np.arange(N)
    random = rng()
    fast = taken + 0.026 * np.mod(taken, 5.0) + 1e-5 * random.standard_normal(N)
    t = fast.copy()
    for i in range(1, N):
        t[i] = max(fast[i], t[i - 1] + 1e-6)
    pressed = np.diff(t) < 2e-6
    angle = 2.0 * np.sin(1.3 * taken)
    rate = 2.6 * np.cos(1.3 * taken)
    # An attitude at the instants of its own stamps stands still while time does.
    own = np.append(True, ~pressed)
    angle = np.interp(t, t[own], angle[own])
    rows = np.column_stack([t, rate + 1e-3 * random.standard_normal(N), angle])
    run = read_back(tmp_path, rows)
    assert any("rows stand at one instant with others" in note for note in run.notes), run.notes
    left = run.left_out["gyro"]
    assert pressed.sum() < left.sum() < 2 * pressed.sum()
    cells = expose(run, "gyro")
    full = cells.count > 0
    off = cells.y[full] - cells.motion.rate[full]
    assert np.abs(off).max() < 1.0  # with those rows 4 to 40 rad/s


def test_a_wrong_tick_is_no_leap_of_the_table(tmp_path: Path) -> None:
    """Of two late stamps before a lost row nobody knows the tick of one: 34 deg/s off, of which the lag was made."""
    taken = np.delete(DT * np.arange(N), 1501)
    t = taken.copy()
    t[1499:1501] += 0.018, 0.0084
    angle = np.floor(0.6 * taken / 4e-4) * 4e-4
    rows = np.column_stack([t, 0.6 + 1e-4 * rng().standard_normal(N - 1), angle])
    run = read_back(tmp_path, rows)
    assert any("nobody can tell" in note for note in run.notes), run.notes
    left = run.channels["table_angle"].values - 0.6 * run.t
    assert np.ptp(left) < 2 * 4e-4  # a tick is 60e-4


def of_an_uneven_sampler(n: int) -> tuple[Floats, Floats]:
    """Rows that are taken 5 % of a period off an even clock, and their stamps, of which one in 300 comes rows late."""
    random = rng()
    taken = DT * (np.arange(n) + 0.05 * random.standard_normal(n))
    t = taken.copy()
    for row in random.choice(n - 20, n // 300, replace=False):
        come = t[row] + DT * random.uniform(1, 6)
        held = slice(row, row + int((come - t[row]) / DT) + 1)
        t[held] = np.maximum(t[held], come + 0.02 * DT * np.arange(len(t[held])))
    return taken, np.maximum.accumulate(t - 1e-3 * DT * np.arange(n)) + 1e-3 * DT * np.arange(n)


def test_late_stamps_of_an_uneven_sampler_are_mended_beside_its_own() -> None:
    taken, t = of_an_uneven_sampler(6000)
    found = sampling(Path("run.csv"), t, str, 2.0 * np.sin(1.3 * taken))
    assert np.abs(t - taken).max() > 0.9 * DT
    assert np.abs(found.t - taken).max() < 0.5 * DT
    assert np.median(np.abs(found.t - taken)) < 1e-9
    assert 0 < found.doubtful.mean() < 0.03


def test_the_motion_passes_by_readings_of_which_nobody_knows_when_they_were_taken(tmp_path: Path) -> None:
    """A table at 1.7 rad/s, its encoder 4e-4 rad fine: beside late stamps its rate was 1.4e-3 off, and is 5e-4."""
    taken, t = of_an_uneven_sampler(6000)
    angle = np.floor((1.7 * taken + 0.3 * np.sin(0.2 * taken)) / 4e-4) * 4e-4
    run = with_reference(read_back(tmp_path, np.column_stack([t, 1.7 + 1e-3 * rng().standard_normal(len(t)), angle])))
    assert run.table is not None
    off = np.abs(run.table.rate_at(run.t) - (1.7 + 0.06 * np.cos(0.2 * run.t)))[~run.left_out["gyro"]]
    assert off.max() < 1e-3


def remarks_of(folder: Path, stamps: Floats) -> tuple[str, ...]:
    return closed(folder, {**bench(), "time": stamps}).remarks


def test_a_clock_that_is_set_is_told_from_stamps_that_go_to_and_fro(tmp_path: Path) -> None:
    """Rows whose phase changes again and again three times a second: no clock is set like that."""
    t = bench()["time"]
    (found,) = [one for one in remarks_of(tmp_path, t + 0.4 * DT * (t > t[1500])) if "clock was set" in one]
    assert "set once" in found
    half = np.arange(N) // 28 % 2 * ((np.arange(N) > 1000) & (np.arange(N) < 1300))
    told = remarks_of(tmp_path, t + 0.4 * DT * half)
    assert any("stamps go to and fro about the clock in one stretch from line" in one for one in told), told
    assert not any("clock was set" in one for one in told)


def test_the_first_of_several_stamps_is_told_in_a_whole_sentence(tmp_path: Path) -> None:
    told = remarks_of(tmp_path, late(0.01)(bench()["time"]))
    (found,) = [one for one in told if "off the clock" in one]
    assert ", the first at line " in found and found.endswith(": the clock's time is taken for them")


@pytest.mark.parametrize("at", [20, 1200, 1970])
@pytest.mark.parametrize("factor", [1e3, 1e6, 1e-3])
def test_a_unit_of_time_that_changes_in_the_file_is_refused(factor: float, at: int) -> None:
    """Of a clock that jitters and loses rows; 1 % of them."""
    t = np.sort((np.arange(2000) + rng().normal(0, 0.1, 2000)) * DT + 5.0)
    t = np.delete(t, rng().integers(30, 1980, 20))
    t[at:] *= factor
    unit = f"{max(factor, 1 / factor):g} times {'smaller' if factor > 1 else 'larger'}"
    with pytest.raises(
        InputError, match=rf"a\.csv: row {at}: time goes on in a unit {re.escape(unit)} .*wanted one unit"
    ):
        check_one_unit(Path("a.csv"), t, lambda row: f"row {row}")


@pytest.mark.parametrize("start", [0.0, 5.0])
def test_gaps_strays_slower_rows_and_clocks_that_begin_anew_are_no_other_unit(start: float) -> None:
    t = np.linspace(start, start + 1999 * DT, 2000)
    late = np.where(np.arange(2000) < 1000, t, t + 999 * t[999])  # by a thousand times what has passed
    stray = t.copy()
    stray[700] *= 1000
    slower = np.append(t, t[-1] + 1000 * DT * np.arange(1, 50))
    anew = np.append(t, DT * np.arange(50))
    for stamps in (t, late, stray, slower, anew):
        check_one_unit(Path("a.csv"), stamps, str)


def test_a_counter_that_begins_anew_goes_on_and_a_clock_that_was_set_is_left_alone() -> None:
    """Counts of a millisecond, 100 rows a second, some lost; 65.536 s is the end of 16 bits."""
    t = np.delete(np.arange(20_000), rng().integers(1, 19_999, 200)) * DT
    wrapped = np.asarray(t % 65.536, np.float64)
    whole, notes = after_rollovers(wrapped, 1e-3, str)
    assert np.allclose(whole, t) and "3 times" in notes[0] and "16 bits" in notes[0]
    for jump in (-65.0, -66.0, -1.0, -3600.0):
        was_set = np.asarray(np.where(t < 100, t, t + jump), np.float64)
        left, notes = after_rollovers(was_set, 1e-3, str)
        assert left is was_set and notes == ()


def test_rows_of_an_unsure_tick_count_at_rest_and_are_said_beside_a_table(tmp_path: Path) -> None:
    """A phone that was taken up in its last seconds: a lost row beside a late stamp took them all without a word."""
    c, draw = bench(), rng()
    kept = np.flatnonzero(draw.random(len(c["time"])) > 0.3)
    lost = {name: values[kept] for name, values in c.items()}
    lost["time"] = lost["time"] + np.where(draw.random(len(kept)) < 0.02, DT * draw.uniform(0.1, 0.9, len(kept)), 0.0)
    turned: Recording = read_recordings(load_manifest(write(tmp_path, [lost], {}, ("bias",))))[0]
    assert turned.left_out["gyro"].any()
    assert any("nobody can tell which tick" in note for note in turned.notes)
    np.savetxt(
        tmp_path / "rest.csv", np.column_stack([lost["time"], lost["gyro"]]), header="t,g", delimiter=",", comments=""
    )
    rest = (
        'data = "rest.csv"\n[channels]\ntime = { column = "t", unit = "s" }\ngyro = { column = "g", unit = "rad/s" }\n'
    )
    (tmp_path / "rest.toml").write_text(rest + '[model]\ntarget = "gyro"\ndeclared = ["bias"]\n')
    assert not read_recordings(load_manifest(tmp_path / "rest.toml"))[0].left_out


@pytest.mark.parametrize("seed", range(8))
def test_a_loop_whose_steps_change_with_its_load_keeps_no_clock(seed: int) -> None:
    """Steps of 24 and of 34 ms, fifty of a kind: no tick can be counted, however clear each step seems."""
    rng = np.random.default_rng(seed)
    busy = np.cumsum(rng.random(2200) < 0.02) % 2
    steps = np.where(busy == 1, 0.034, 0.024) * (1 + 0.04 * rng.standard_normal(2200))
    assert not clock_of(np.cumsum(steps)).steady


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rows_lost_at_random_are_no_jitter(seed: int) -> None:
    """Of a row in thirty nothing was written: the times of a clock of 97 Hz were taken, 46 ms off."""
    rng = np.random.default_rng(seed)
    true = 0.01 * np.flatnonzero(rng.random(1410) > 0.03)
    stamps = np.round(true + 4e-4 * rng.standard_normal(len(true)), 3)
    clock = clock_of(stamps - stamps[0])
    assert clock.steady and clock.period == pytest.approx(0.01, rel=1e-3)
    assert np.abs(clock.even - (true - true[0])).max() < 2e-3


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_uneven_steps_of_a_short_recording_add_up(seed: int) -> None:
    """Steps of 19 to 28 ms: about an even clock the stamps were said to jitter by 81 %, and its times were taken."""
    rng = np.random.default_rng(seed)
    stamps: Floats = np.cumsum(
        np.round(np.clip(0.022 + 2e-3 * rng.standard_normal(2054), 0.018, 0.029), 3), dtype=float
    )
    clock = clock_of(stamps)
    assert not clock.steady or np.abs(clock.even - stamps).max() < 0.0155
    jitter = 0.022 * np.arange(2054) + 0.3 * 0.022 * rng.uniform(-1, 1, 2054)
    assert clock_of(jitter - jitter[0]).steady


@pytest.mark.parametrize("late", [0.0, 0.001])
def test_rows_in_packets_of_one_size_follow_the_clock_of_these(late: float) -> None:
    """Eight readings of a serial port at once, at 100 Hz; some packets are lost. They were refused beside a table."""
    rng = np.random.default_rng(8)
    taken = 0.01 * np.arange(4000.0)
    came = taken.reshape(-1, 8)[:, -1] + late * rng.random(500)
    t = (came[:, None] + 2e-4 * np.arange(8)).ravel()
    kept = np.ones(500, bool)
    kept[[77, 78, 300]] = False
    rows = np.repeat(kept, 8)
    clock = clock_of(t[rows])
    assert clock.steady and clock.packet == 8
    assert clock.period == pytest.approx(0.01, rel=1e-4)
    left = clock.even - taken[rows]
    assert np.ptp(left) < 0.002


def test_packets_of_any_size_keep_no_clock() -> None:
    rng = np.random.default_rng(9)
    taken = 0.01 * np.arange(4000.0)
    written = np.cumsum(rng.uniform(0.06, 0.2, 400))
    t = written[np.searchsorted(written, taken)] + 1e-4 * np.arange(4000.0) % 1e-3
    assert clock_of(np.sort(t)).packet == 1
