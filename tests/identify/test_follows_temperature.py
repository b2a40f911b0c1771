"""What follows the temperature: a hysteresis, which is told from a lag, and fringes, which have no name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.recording import Floats
from insenv.core.units import DEG
from insenv.effects.forms import play
from insenv.identify.findings import TargetFindings
from insenv.identify.prepare.excess import OF_TEMPERATURE

MANIFEST = """
data = "run.csv"
[channels]
time = { column = "t", unit = "s" }
gyro = { column = "x", unit = "deg/h" }
temperature = { column = "T", unit = "degC" }
[model]
target = "gyro"
declared = ["bias", "bias_temperature:ORDER"]
reference_temperature = "30 degC"
"""
DEG_PER_HOUR = DEG / 3600
T = 2.0 * np.arange(5400)
HEAT = 31 + 9 * np.sin(2 * np.pi * T / 2900) + 4 * np.sin(2 * np.pi * T / 1130)


def closed(folder: Path, bias: Floats, order: int, heat: Floats = HEAT) -> TargetFindings:
    """The findings on a gyro at rest for three hours in a chamber, 0.3 deg/h of noise a row, beside a ``bias``."""
    rate = 8 + bias + 0.3 * np.random.default_rng(3).standard_normal(len(T))
    np.savetxt(folder / "run.csv", np.column_stack([T, rate, heat]), "%.9g", ",", header="t,x,T", comments="")
    (folder / "run.toml").write_text(MANIFEST.replace("ORDER", str(order)))
    (found,) = close(folder / "run.toml").targets
    return found


@pytest.mark.parametrize(("fringes", "wander"), [(0.15, 0.0), (0.0, 0.0), (0.0, 0.02)])
def test_fringes_of_the_temperature_are_said(tmp_path: Path, fringes: float, wander: float) -> None:
    """Fringes 5 K apart, half a row's noise tall; noise gives as much in one recording of a thousand."""
    walk = wander * np.cumsum(np.random.default_rng(4).standard_normal(len(T))) / 3
    found = closed(tmp_path, fringes * np.sin(2 * np.pi * HEAT / 5) + walk, order=3)
    assert any(OF_TEMPERATURE in reason for reason in found.reasons) is bool(fringes)
    assert all(one.generic for one in found.added)


def test_modes_of_a_laser_in_a_chamber_that_rises_and_falls_once_are_said(tmp_path: Path) -> None:
    """Neither the fitted nor the held-out rows have the whole range of the temperature: no wave of it was tried."""
    heat = np.interp(T, [0, 5400, 10800], [0.0, 43.0, 3.0])
    found = closed(tmp_path, 0.3 * (heat / 4.7 % 1.0), order=1, heat=heat)
    assert any(OF_TEMPERATURE in reason and "as a wave of 4." in reason for reason in found.reasons)


@pytest.mark.parametrize("radius", [0.7, 3.0])
def test_a_thermal_hysteresis_is_told_from_a_lag(tmp_path: Path, radius: float) -> None:
    """Of 0.12 deg/h either way, 25 deviations; it was a lag that explains most of it, stated as found."""
    side = (HEAT - play(HEAT, radius, HEAT[0])) / radius
    (one,) = closed(tmp_path, 0.1 * HEAT + 0.12 * side, order=1).added
    assert one.effect == "bias_thermal_hysteresis"
    c, r = one.parameters
    assert abs(c.value - 0.12 * DEG_PER_HOUR) < 4 * c.sd
    assert abs(r.value - radius) < 4 * r.sd


def test_a_thermal_lag_stays_one(tmp_path: Path) -> None:
    lag, tau = np.empty(len(T)), 400.0
    lag[0] = HEAT[0]
    for k in range(1, len(T)):
        lag[k] = HEAT[k] + (lag[k - 1] - HEAT[k]) * np.exp(-2.0 / tau)
    (one,) = closed(tmp_path, 0.03 * (HEAT - lag), order=1).added
    assert one.effect == "bias_thermal_lag"


def test_of_several_axes_a_hysteresis_is_not_asked(tmp_path: Path) -> None:
    """What they have together comes first: of two gyros in a chamber a lag was lost to a loop on one of them."""
    noise = 0.3 * np.random.default_rng(6).standard_normal((2, len(T)))
    np.savez(tmp_path / "run.npz", t=T, x=noise[0], y=noise[1], T=HEAT)
    text = (
        MANIFEST.replace("ORDER", "1")
        .replace("run.csv", "run.npz")
        .replace('target = "gyro"', 'target = ["gyro_x", "gyro_y"]')
    )
    gyros = "".join(f'gyro_{a} = {{ column = "{a}", unit = "deg/h" }}\n' for a in "xy")
    (tmp_path / "run.toml").write_text(text.replace('gyro = { column = "x", unit = "deg/h" }\n', gyros))
    for found in close(tmp_path / "run.toml").targets:
        assert {n.effect: n.reason for n in found.not_testable}["bias_thermal_hysteresis"].startswith("of several axes")
