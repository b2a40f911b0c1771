"""Gyros as other people simulate them beside an exact table: half a row is said to be what means have.

A gyro made of the differences of an angle is a mean over its row, a command that is ramped is the motion itself, and
jumps that all fall on one row in five hold nothing. Generated with NumPy, no effect of insenv; seeds are fixed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.recording import Floats
from insenv.identify.findings import Findings, TargetFindings

HZ = 100.0


def wave(n: int = 18000) -> tuple[Floats, Floats]:
    """Time [s] and angle [deg] of a table that swings at two frequencies."""
    t = np.arange(n) / HZ
    slow, fast = 2 * np.pi * 0.1, 2 * np.pi * 0.33
    return t, 50 / slow * (1 - np.cos(slow * t)) + 30 / fast * (1 - np.cos(fast * t))


def ramps(levels: tuple[float, ...], dwell: float, slope: float) -> tuple[Floats, Floats]:
    """Time [s] and rate [deg/s] of a table that goes from rate to rate on ramps of ``slope`` [deg/s^2]."""
    times, rates = [0.0], [levels[0]]
    for before, after in zip(levels[:-1], levels[1:], strict=True):
        times += [times[-1] + dwell, times[-1] + dwell + abs(after - before) / slope]
        rates += [before, after]
    t = np.arange(0.0, times[-1] + dwell, 1 / HZ)
    return t, np.interp(t, times, rates)


def judged(  # noqa: PLR0913 -- what a manifest of one gyro says
    folder: Path,
    t: Floats,
    reference: str,
    values: Floats,
    gyro: Floats,
    more: str = "",
    declared: str = '["bias", "scale_factor"]',
) -> Findings:
    """The loop on a gyro [deg/s] beside an angle or a rate, as a modest user declares it."""
    unit = "deg" if reference == "table_angle" else "deg/s"
    np.savez(folder / "run.npz", t=t, reference=values, gyro=gyro)
    text = (
        'data = "run.npz"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        f'gyro = {{ column = "gyro", unit = "deg/s"{more} }}\n'
        f'{reference} = {{ column = "reference", unit = "{unit}" }}\n'
        f'[model]\ntarget = "gyro"\ndeclared = {declared}\n'
    )
    path = folder / "run.toml"
    path.write_text(text)
    return close(path)


def names(found: Findings) -> tuple[str, ...]:
    return tuple(one.effect for one in of(found).added)


def of(found: Findings) -> TargetFindings:
    return found.targets[0]


@pytest.mark.parametrize("ahead", [False, True])
def test_a_skew_of_half_a_row_is_said_to_be_one_of_means(tmp_path: Path, ahead: bool) -> None:
    t, angle = wave()
    gyro = np.diff(angle, append=angle[-1:]) * HZ if ahead else np.diff(angle, prepend=angle[:1]) * HZ
    gyro += 0.1 + 0.1 * np.random.default_rng(1).standard_normal(len(t))
    found = judged(tmp_path, t, "table_angle", angle, gyro)
    assert names(found) == ("timing_skew",)
    assert of(found).added[0].parameters[0].value == pytest.approx(-0.005 if ahead else 0.005, abs=1e-4)
    assert ("begins at their time" if ahead else 'covers = "interval" says so') in of(found).added[0].remark


def test_said_to_be_means_they_have_none(tmp_path: Path) -> None:
    t, angle = wave()
    gyro = np.diff(angle, prepend=angle[:1]) * HZ + 0.1 * np.random.default_rng(2).standard_normal(len(t))
    found = judged(tmp_path, t, "table_angle", angle, gyro, ', covers = "interval"')
    assert of(found).verdict == "nothing-significant" and names(found) == ()


@pytest.mark.parametrize("rows", [1.0, 4.0])
def test_a_delay_of_whole_rows_stays_a_skew(tmp_path: Path, rows: float) -> None:
    t, angle = wave()
    gyro = np.interp(t - rows / HZ, t, np.gradient(angle, t))
    gyro += 0.1 * np.random.default_rng(3).standard_normal(len(t))
    found = judged(tmp_path, t, "table_angle", angle, gyro)
    assert names(found) == ("timing_skew",)
    assert of(found).added[0].parameters[0].value == pytest.approx(rows / HZ, abs=2e-4)
    assert "half a row" not in of(found).added[0].remark


def test_a_gyro_that_is_late_behind_a_ramped_command_has_a_skew(tmp_path: Path) -> None:
    """Eight rows late, and the command is what the table does: nothing was named for it."""
    t, rate = ramps((0, 40, 0, -40, 0, 80, 0, -80, 0), 10.0, 50.0)
    gyro = np.interp(t - 0.08, t, rate) + 0.1 * np.random.default_rng(4).standard_normal(len(t))
    found = judged(tmp_path, t, "table_rate", rate, gyro)
    assert of(found).verdict == "effects-found" and names(found) == ("timing_skew",)
    assert of(found).added[0].parameters[0].value == pytest.approx(0.08, abs=1e-3)


def test_jumps_of_an_angle_that_was_read_hold_nothing(tmp_path: Path) -> None:
    """Jumps that all fall on a whole number of rows, an angle with seven digits, a rate that begins at its row."""
    levels = np.array([0, 10, 20, 40, 80, 40, 20, 10, 0, -10, -20, -40, -80, -40, -20, -10, 0.0])
    rate = np.repeat(levels, 800)
    t = np.arange(len(rate)) / HZ
    angle = np.concatenate([[0.0], np.cumsum(rate)[:-1]]) / HZ
    angle = np.array([float(f"{x:.7g}") for x in angle])
    gyro = rate + 0.2 + 0.3 * np.random.default_rng(5).standard_normal(len(t))
    assert names(judged(tmp_path, t, "table_angle", angle, gyro)) in ((), ("timing_skew",))


def ramped(command: Floats, most: float) -> Floats:
    """Rates of a table that follows a command by at most so much from sample to sample."""
    rate = np.empty_like(command)
    now = 0.0
    for k, wanted in enumerate(command.tolist()):  # a number at a time: NumPy's clip takes fifty times as long for one
        now += max(-most, min(wanted - now, most))
        rate[k] = now
    return rate


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_slow_rows_on_ramps_are_not_held(tmp_path: Path, seed: int) -> None:
    """Ten rows a second, ramps of some rows, an encoder of 15 bits: holds of 0.6 s were named, with skews for them."""
    rng = np.random.default_rng([seed, 28])
    fine = np.arange(0.0, 120.0, 1e-3)
    command = np.repeat(50 * rng.uniform(-1, 1, 7), len(fine) // 7 + 1)[: len(fine)]
    rate = ramped(command, 0.1)
    t = fine[100::100]
    angle = np.interp(t, fine, np.cumsum(rate) * 1e-3)
    step = 360 / 2**15
    gyro = np.interp(t, fine, rate) + 0.01 * rng.standard_normal(len(t))
    assert "sample_hold" not in names(judged(tmp_path, t, "table_angle", np.floor(angle / step) * step, gyro))


def swing(hz: float, seconds: float) -> tuple[Floats, Floats, Floats]:
    """Time [s], rate [deg/s] and mean rate over the step that ends there, of a slow swing of 50 deg/s."""
    t = np.arange(1, round(seconds * hz)) / hz
    w = 2 * np.pi * 0.02
    before = t - 1 / hz
    return t, 50 * np.sin(w * t), 50 * (np.cos(w * before) - np.cos(w * t)) / (w / hz)


def test_between_rates_that_were_read_at_instants_stands_a_curve(tmp_path: Path) -> None:
    """The straight line between them is 13 ppm short of a swing in 50 s: a scale factor was named."""
    t, rate, mean = swing(10.0, 600.0)
    gyro = mean + 0.001 + 1e-4 * np.random.default_rng(6).standard_normal(len(t))
    found = judged(tmp_path, t, "table_rate", rate, gyro, ', covers = "interval"', '["bias"]')
    assert "scale_factor" not in names(found)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_ramps_that_begin_between_rows_are_no_skew(tmp_path: Path, seed: int) -> None:
    """A rate that was read at instants beside means: what it misses where ramps begin was a skew of 0.6 ms."""
    rng = np.random.default_rng([seed, 22])
    fine = np.arange(0.0, 600.0, 1e-3)
    command = np.repeat(5 * rng.uniform(-1, 1, 11), len(fine) // 11 + 1)[: len(fine)]
    rate = ramped(command, 0.0137)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1])) * 1e-3])
    t, rows = fine[50::50], slice(50, None, 50)
    gyro = np.diff(angle[::50]) / 0.05 + 5e-4 * rng.standard_normal(len(t))
    found = judged(tmp_path, t, "table_rate", rate[rows], gyro, ', covers = "interval"', '["bias"]')
    assert "timing_skew" not in names(found) and of(found).verdict != "effects-found"


@pytest.mark.parametrize(("cut", "seed"), [(True, 0), (True, 1), (False, 0)])
def test_numbers_cut_towards_zero_lose_half_a_step_and_rounded_ones_nothing(
    tmp_path: Path, cut: bool, seed: int
) -> None:
    step, rng = 1 / 16, np.random.default_rng(seed)
    t = np.arange(3000) / HZ
    slow, fast = 2 * np.pi * 0.4, 2 * np.pi * 1.1
    rate = 25 * np.sin(slow * t) + 14 * np.sin(fast * t) + 0.05 * rng.standard_normal(len(t))
    angle = 25 / slow * (1 - np.cos(slow * t)) + 14 / fast * (1 - np.cos(fast * t))
    gyro = step * (np.trunc(rate / step) if cut else np.rint(rate / step))
    (found,) = judged(tmp_path, t, "table_angle", angle, gyro, declared='["bias"]').targets
    assert [(a.effect, "cut off towards zero" in a.remark) for a in found.added] == (
        [("dead_band", True)] if cut else []
    )


def hand(n: int, hz: float, seed: int) -> Floats:
    """A motion by hand, a few tenths of a hertz, of one as its root mean square."""
    rng, f = np.random.default_rng(seed), np.fft.rfftfreq(n, 1 / hz)
    x = np.fft.irfft(np.exp(-2.0 * (f - 0.3) ** 2 + 2j * np.pi * rng.random(len(f))), n)
    return np.asarray(x / x.std())


@pytest.mark.parametrize("seed", [7, 13])
def test_a_skew_that_another_axis_may_make_is_said_to_have_no_sign(tmp_path: Path, seed: int) -> None:
    """Two units on a body, one a little turned: the axis that leaks in leads, as of a hand that goes round."""
    hz, n = 75.0, 6375
    t, rng = np.arange(n) / hz, np.random.default_rng(seed + 100)
    own, other = 30 * hand(n, hz, seed), hand(n, hz, seed + 1)
    leading = np.gradient(own)
    gyro = own + 0.03 * (12 * other + 15 * leading / leading.std()) + 0.2 * rng.standard_normal(n)
    (found,) = judged(tmp_path, t, "table_rate", own + 0.2 * rng.standard_normal(n), gyro, declared='["bias"]').targets
    skews = [p for a in found.added if a.effect == "timing_skew" for p in a.parameters]
    assert skews and all(abs(p.value) < 2.5 * p.sd for p in skews)  # there is none
    assert found.verdict == "effects-found-incomplete"
    assert any("timing_skew is" in reason and "of either sign" in reason for reason in found.reasons)


def test_wheels_that_slip_otherwise_in_the_first_turns_are_no_warm_up(tmp_path: Path) -> None:
    """A gain that settles by some tens of per cent is no gyro's: it is short beside wheels, by what they slip."""
    hz, n, rng = 50.0, 4700, np.random.default_rng(4)
    t = np.arange(n) / hz
    rate = 25 * hand(n, hz, 4)
    slips = np.where(t < 14, 0.6, 0.9) + 0.02 * rng.standard_normal(n)
    wheels = np.cumsum(rate / slips) / hz
    (found,) = judged(
        tmp_path, t, "table_angle", wheels, rate + 0.5 * rng.standard_normal(n), declared='["bias"]'
    ).targets
    assert "scale_factor_warm_up" not in {a.effect for a in found.added}
    assert found.verdict == "unexplained-structure"


@pytest.mark.parametrize("recorded", [False, True])
def test_a_gain_that_the_rate_of_the_rows_would_make_is_said_to_be_that_where_none_was_recorded(
    tmp_path: Path, recorded: bool
) -> None:
    """Rows come 104 times a second, and the manifest says 100."""
    t, angle = wave()
    rng = np.random.default_rng(6)
    gyro = np.gradient(angle, t) + 0.05 * rng.standard_normal(len(t))
    np.savez(tmp_path / "run.npz", t=t, angle=angle, gyro=gyro / 0.96 if recorded else 1.04 * gyro)
    time = '{ column = "t", unit = "s" }' if recorded else '{ rate = "100 Hz" }'
    text = (
        f'data = "run.npz"\n[channels]\ntime = {time}\ngyro = {{ column = "gyro", unit = "deg/s" }}\n'
        'table_angle = { column = "angle", unit = "deg" }\n[model]\ntarget = "gyro"\ndeclared = ["bias"]\n'
    )
    (tmp_path / "run.toml").write_text(text)
    (found,) = close(tmp_path / "run.toml").targets
    assert "scale_factor" in {a.effect for a in found.added}
    assert any("rate of the rows is stated, 100 Hz" in caution for caution in found.cautions) is not recorded


def test_means_of_ten_seconds_at_nine_rates_are_an_ordinary_test(tmp_path: Path) -> None:
    """Two runs of a table's own means, one held out: nine of them were said to be too few for three parameters."""
    rates = np.concatenate([np.linspace(-50, 50, 11), np.linspace(-80, 80, 9)])
    gyro = 1.0008 * rates + 0.04 + 2e-3 * np.random.default_rng(1).standard_normal(20)
    for name, rows in (("a", slice(0, 11)), ("b", slice(11, 20))):
        table = np.column_stack([13.0 * np.arange(len(rates[rows])), rates[rows], gyro[rows]])
        np.savetxt(tmp_path / f"{name}.csv", table, "%.9g", ",", header="t,u,y", comments="")
    (tmp_path / "run.toml").write_text(
        'data = ["a.csv", "b.csv"]\n[channels]\ntime = { column = "t", unit = "s" }\n'
        'gyro = { column = "y", unit = "deg/s" }\n'
        'table_rate = { column = "u", unit = "deg/s", source = "command" }\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n[held_out]\nruns = [1]\n'
    )
    found = of(close(tmp_path / "run.toml"))
    (scale,) = [e for e in found.estimates_after if e.effect == "scale_factor"]
    assert abs(scale.value - 8e-4) < 4 * scale.sd < 1e-3


@pytest.mark.parametrize(("share", "made"), [(1 / 24, "the chord of"), (1 / 6, "the sine of")])
def test_a_rate_made_of_attitudes_is_said_to_be_a_chord(tmp_path: Path, share: float, made: str) -> None:
    """Twice the vector part of the turn of a row, or half the antisymmetric part of its matrix, over the row."""
    t = np.arange(6000) / 25
    turn = np.deg2rad(6) * np.sin(2 * np.pi * 0.05 * t)  # a row: up to 150 deg/s
    read = 2 * np.sin(turn / 2) * 25 if share == 1 / 24 else np.sin(turn) * 25
    angle = np.rad2deg(np.cumsum(turn))
    gyro = np.rad2deg(read) + 0.01 * np.random.default_rng(4).standard_normal(len(t))
    found = judged(tmp_path, t, "table_angle", angle, gyro, ', covers = "interval"')
    (cubic,) = of(found).added
    assert cubic.effect == "scale_factor_cubic"
    assert cubic.parameters[0].value == pytest.approx(-share / 25**2, rel=0.02)
    assert f"as of a reading that is {made}" in cubic.remark
