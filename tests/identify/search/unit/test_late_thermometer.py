"""A thermometer that is behind the sensor, or before it: a law of what it reads and one of its change together.

Generated with NumPy and SciPy alone; the seed is fixed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from insenv.close import close
from insenv.core.recording import Floats
from insenv.identify.findings import TargetFindings

DT, N, PER_KELVIN, BEHIND = 0.5, 7200, 0.002, 150.0


def lagged(x: Floats, tau: float, dt: float = DT) -> Floats:
    a = float(np.exp(-dt / tau))
    return np.asarray(lfilter([1 - a], [1, -a], x, zi=[a * x[0]])[0])


def closed(folder: Path, t: Floats, gyro: Floats, read: Floats, unit: str) -> TargetFindings:
    """The findings on a gyro at rest beside what a thermometer reads [degC]."""
    np.savez(folder / "run.npz", t=t, gyro=gyro, temp=read)
    (folder / "run.toml").write_text(
        'data = "run.npz"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        f'gyro = {{ column = "gyro", unit = "{unit}" }}\ntemperature = {{ column = "temp", unit = "degC" }}\n'
        '[model]\ntarget = "gyro"\ndeclared = ["bias"]\nprocedure = "static"\n'
    )
    (found,) = close(folder / "run.toml").targets
    return found


@pytest.mark.parametrize("late", [BEHIND, 0.0])
@pytest.mark.parametrize("kind", ["soak", "cycle"])
def test_both_laws_are_named_of_a_late_thermometer(late: float, kind: str, tmp_path: Path) -> None:
    """An hour at 2 Hz with 0.03 deg/s a row at 10 Hz; of one that is not late the law of the temperature alone."""
    rng, t = np.random.default_rng(8), DT * np.arange(float(N))
    soak = 20 + 30 * np.interp(t, [0, 300, 1800, 2100, 3600], [0, 0, 1, 1, 0])
    true = soak if kind == "soak" else 25 + 8 * np.sin(2 * np.pi * t / 1200)
    read = np.round((lagged(true, late) if late else true) / 0.0625) * 0.0625
    gyro = 0.5 + PER_KELVIN * (true - 25) + 0.03 / np.sqrt(5) * rng.standard_normal(N)
    found = closed(tmp_path, t, gyro, read, "deg/s")
    values = {a.effect: {p.parameter: p for p in a.parameters} for a in found.added}
    assert set(values) == {"bias_temperature", *(["bias_temperature_rate"] if late else [])}
    due = {"bias_temperature": PER_KELVIN, "bias_temperature_rate": PER_KELVIN * late}
    for effect, each in values.items():
        c = each["c"]
        assert c.sd is not None and abs(c.value - np.radians(due[effect])) < 4 * c.sd < np.radians(due[effect])


def test_a_sensor_behind_the_thermometer_is_told_by_both_laws(tmp_path: Path) -> None:
    """A bias c L of what follows the chamber in 900 s is c T - c (T - L): its walk of the noise explained it all."""
    rng, t, c = np.random.default_rng(3), 2.0 * np.arange(4500.0), 0.016
    read = np.interp(t, [0, 1200, 2400, 4200, 5400, 7200, 9000], [25, 25, 50, 50, 10, 10, 40])
    gyro = 5 + c * (lagged(read, 900.0, dt=2.0) - 25) + 0.21 * rng.standard_normal(len(t))
    found = closed(tmp_path, t, gyro, read, "deg/h")
    values = {one.effect: one.parameters[0] for one in found.added}
    assert set(values) == {"bias_temperature", "bias_thermal_lag"}
    for effect, sign in (("bias_temperature", 1), ("bias_thermal_lag", -1)):
        size = values[effect]
        assert abs(size.value - sign * np.radians(c) / 3600) < 4 * size.sd
