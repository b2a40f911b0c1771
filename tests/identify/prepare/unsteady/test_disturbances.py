"""What comes and goes in the rows, faster than means are: the loop says when, and at which frequencies.

Generated with NumPy and SciPy, no effect of insenv; seeds are fixed. Strengths are in deviations of a row.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfilt

from insenv.close import close
from insenv.core.recording import Floats
from insenv.identify.findings import TargetFindings
from insenv.identify.prepare.unsteady.spectrogram import RowsLeft
from insenv.identify.prepare.unsteady.told import unsteady

HZ, NOISE = 100.0, 0.01
T = np.arange(30000) / HZ
LEVELS = (0, 10, -10, 20, -20, 40, -40, 60, -60, 0)


def at_rest(folder: Path, more: Floats, seed: int = 1, noise: str = "") -> TargetFindings:
    """The loop on 300 s of a gyro [deg/s] at rest, with ``more`` in its rows, of declared ``noise``."""
    t = np.arange(1, len(more) + 1) / HZ
    gyro = NOISE * (np.random.default_rng(seed).standard_normal(len(t)) + more) + 0.05
    np.savez(folder / "run.npz", t=t, gyro=gyro)
    return judged(folder, "", "", '["bias"]\nprocedure = "static"', noise)


def on_a_table(folder: Path, more: Floats, rate: Floats, seed: int = 1) -> TargetFindings:
    """The same beside the angle of a table that turns at a ``rate`` [deg/s], mean over each row."""
    noise = NOISE * (np.random.default_rng(seed).standard_normal(len(rate)) + more)
    t = np.arange(1, len(rate) + 1) / HZ
    np.savez(folder / "run.npz", t=t, gyro=1.0002 * rate + noise + 0.05, angle=np.cumsum(rate) / HZ)
    angle = 'table_angle = { column = "angle", unit = "deg" }\n'
    return judged(folder, ', covers = "interval"', angle, '["bias", "scale_factor"]')


def judged(folder: Path, covers: str, angle: str, declared: str, noise: str = "") -> TargetFindings:
    path = folder / "run.toml"
    path.write_text(
        'data = "run.npz"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        f'gyro = {{ column = "gyro", unit = "deg/s"{covers} }}\n{angle}'
        f'[model]\ntarget = "gyro"\ndeclared = {declared}\n{noise}'
    )
    return close(path).targets[0]


def dwells() -> Floats:
    """Rate of a table that goes from level to level at 20 deg/s^2, 40 s each, mean over each row [deg/s]."""
    times, rates = [0.0], [0.0]
    for before, after in zip(LEVELS[:-1], LEVELS[1:], strict=True):
        times += [times[-1] + 40, times[-1] + 40 + abs(after - before) / 20]
        rates += [before, after]
    n = round((times[-1] + 40) * HZ)
    fine = np.interp((np.arange(10 * n) + 0.5) / HZ / 10, times, rates)
    return np.asarray(fine.reshape(n, 10).mean(axis=1))


def run_up(n: int, start: float, stop: float) -> Floats:
    """A motor that goes from 5 to 18 Hz."""
    t = np.arange(n) / HZ
    x = t - start
    return np.sin(2 * np.pi * (5 * x + 13 * x**2 / 2 / (stop - start))) * ((t >= start) & (t < stop))


def shaken(n: int, start: float, stop: float) -> Floats:
    """Somebody shakes the pier: 10 to 30 Hz for some seconds."""
    t = np.arange(n) / HZ
    wave = sosfilt(butter(2, [0.2, 0.6], "band", output="sos"), np.random.default_rng(9).standard_normal(n))
    return np.asarray(wave / np.std(wave) * ((t >= start) & (t < stop)))


def rough(n: int) -> Floats:
    """Noise of an angle: means feel little of it."""
    return np.diff(np.random.default_rng(8).standard_normal(n + 1)) / np.sqrt(2)


def either(folder: Path, turning: bool, more: Callable[[int], Floats]) -> TargetFindings:
    """The loop on a table that goes from level to level, or at rest, with ``more`` in so many rows."""
    rate = dwells()
    return on_a_table(folder, more(len(rate)), rate) if turning else at_rest(folder, more(30000))


def about_rows(found: TargetFindings) -> list[str]:
    return [reason for reason in found.reasons if reason.startswith("the rows")]


def numbers(text: str) -> list[float]:
    return [float(one) for one in re.findall(r"\d+\.?\d*", text.split("(p")[0])]


def test_rows_of_white_noise_hold_nothing(tmp_path: Path) -> None:
    assert at_rest(tmp_path, np.zeros(30000)).verdict == "nothing-significant"
    rate = dwells()
    assert on_a_table(tmp_path, np.zeros(len(rate)), rate).verdict == "nothing-significant"


@pytest.mark.parametrize("turning", [False, True])
def test_a_motor_that_runs_up_is_a_line_that_moves(tmp_path: Path, turning: bool) -> None:
    """0.6 of the noise of a row; of a table nothing was said before."""
    found = either(tmp_path, turning, lambda n: 0.6 * run_up(n, 60.0, 120.0))
    (said,) = about_rows(found)
    assert (found.verdict, found.added) == ("unexplained-structure", ())
    assert "a line that moves from" in said
    assert numbers(said)[:4] == pytest.approx([5, 18, 60, 120], abs=4)


@pytest.mark.parametrize("turning", [False, True])
def test_who_shakes_the_pier_for_six_seconds_is_told(tmp_path: Path, turning: bool) -> None:
    found = either(tmp_path, turning, lambda n: 1.5 * shaken(n, 100.3, 106.3))
    (said,) = about_rows(found)
    assert found.verdict == "unexplained-structure"
    assert "a disturbance at" in said
    assert numbers(said)[:2] == pytest.approx([100.3, 106.3], abs=2.0)


def test_noise_that_doubles_in_the_second_half_is_told(tmp_path: Path) -> None:
    """Where means feel hardly anything of it."""
    more = np.where(np.arange(30000) < 15000, 0.0, np.sqrt(2**2 - 1)) * rough(30000)
    (said,) = about_rows(found := at_rest(tmp_path, more))
    assert found.verdict == "unexplained-structure"
    assert "times as much noise at" in said
    assert numbers(said)[1:3] == pytest.approx([150, 300], abs=10)


def test_a_quiet_start_of_a_loud_run_is_told(tmp_path: Path) -> None:
    """Half as loud again for most of the time: no window of half the run is much louder than all else."""
    more = np.where(np.arange(30000) < 5000, 0.0, np.sqrt(1.5**2 - 1)) * rough(30000)
    (said,) = about_rows(found := at_rest(tmp_path, more))
    assert found.verdict == "unexplained-structure"
    assert "times less noise at" in said
    assert numbers(said)[1:3] == pytest.approx([0, 50], abs=11)


def test_a_weak_line_that_moves_slowly_is_told(tmp_path: Path) -> None:
    """A quarter of a row's noise, from 5 to 25 Hz in the whole run: it is in segments of one length alone."""
    (said,) = about_rows(at_rest(tmp_path, 0.25 * np.sin(2 * np.pi * (5 * T + 10 * T**2 / T[-1]))))
    assert "a line that moves from" in said
    assert numbers(said)[0] == pytest.approx(5, abs=3)


def test_noise_that_is_louder_while_the_table_turns_is_told(tmp_path: Path) -> None:
    rate = dwells()
    more = np.sqrt(2**2 - 1) * np.random.default_rng(7).standard_normal(len(rate)) * (np.abs(rate) > 0.5)
    found = on_a_table(tmp_path, more, rate)
    (said,) = about_rows(found)
    assert said.startswith("the rows hold 2 times as much noise while the table turns")
    assert found.verdict == "unexplained-structure"


@pytest.mark.parametrize("times", [1.0, 3.0])
def test_what_the_steps_of_an_angle_make_while_it_turns_is_no_noise_of_the_gyro(times: float) -> None:
    """Differences of an angle in steps of a thousandth have 41 mrad/s at 100 Hz; three times that is the gyro's."""
    rng, rate = np.random.default_rng(7), np.deg2rad(dwells())
    turning = np.abs(rate) > 0.01
    values = np.where(turning, times * 1e-3 * HZ / np.sqrt(6), 1e-3) * rng.standard_normal(len(rate))
    said = unsteady([RowsLeft(0, 0.0, 1 / HZ, values, rate, encoder=1e-3)], 1.0)
    assert any("times as much noise while the table turns" in one for one in said) == (times > 1)


def test_a_named_effect_keeps_its_name_beside_a_disturbance(tmp_path: Path) -> None:
    """A drift of 60 deviations of its own, found with and without."""
    drift = 0.5 * np.arange(30000) / 30000
    plain = at_rest(tmp_path, drift)
    found = at_rest(tmp_path, drift + 1.5 * shaken(30000, 100.3, 106.3))
    assert {one.effect for one in plain.added} == {one.effect for one in found.added} != set()
    assert (plain.verdict, found.verdict) == ("effects-found", "effects-found-incomplete")


@pytest.mark.parametrize("apart", [2.0, 4.0])
def test_levels_that_flip_faster_than_means_are_told(tmp_path: Path, apart: float) -> None:
    """Five times a second, for which means are made longer: a hump of the spectrum to all else."""
    rng = np.random.default_rng(6)
    edges = np.cumsum(rng.exponential(0.2, 2000))
    flipped = np.searchsorted(edges, np.arange(30000) / HZ) % 2
    found = at_rest(tmp_path, np.asarray(apart * flipped, np.float64))
    assert found.verdict == "unexplained-structure"
    assert any("hold two levels" in said for said in about_rows(found))


def test_a_hump_of_the_rows_is_no_noise_that_was_declared(tmp_path: Path) -> None:
    """From 20 to 35 Hz, which means leave out: a remark where no noise is declared, a doubt where white noise is."""
    wave = sosfilt(butter(3, [0.4, 0.7], "band", output="sos"), np.random.default_rng(5).standard_normal(30000))
    declared = f'[noise]\nangle_random_walk = "{NOISE / np.sqrt(HZ)} deg/sqrt(s)"\n'
    assert at_rest(tmp_path, wave / np.std(wave)).verdict == "nothing-significant"
    assert at_rest(tmp_path, np.zeros(30000), noise=declared).verdict == "nothing-significant"
    found = at_rest(tmp_path, wave / np.std(wave), noise=declared)
    (said,) = about_rows(found)
    assert found.verdict == "unexplained-structure"
    assert "times the declared power at 2" in said
