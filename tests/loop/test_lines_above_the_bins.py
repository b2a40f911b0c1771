"""Lines faster than means beside a table that goes from rate to rate, and a unit's accelerometers on one.

Steps of a staircase have power at all frequencies, far more than a line of the gyro. Generated with NumPy, no effect of
insenv; seeds are fixed.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from insenv.close import close
from insenv.core.recording import Floats

HZ = 50.0
LEVELS = (0, 10, -10, 30, -30, 60, -60, 45, -45, 20, -20, 0)


def staircase() -> Floats:
    """Mean rate over each row of a table that goes from level to level in a second, 30 s each [deg/s]."""
    times, rates = [0.0], [0.0]
    for before, after in zip(LEVELS[:-1], LEVELS[1:], strict=True):
        times += [times[-1] + 30, times[-1] + 31]
        rates += [before, after]
    n = int((times[-1] + 30) * HZ)
    fine = np.interp((np.arange(10 * n) + 0.5) / HZ / 10, times, rates)
    return np.asarray(fine.reshape(n, 10).mean(axis=1))


def written(folder: Path, columns: dict[str, Any], channels: str, model: str) -> Path:
    np.savez(folder / "run.npz", t=np.arange(1, len(columns["angle"]) + 1) / HZ, **columns)
    path = folder / "run.toml"
    path.write_text(
        'data = "run.npz"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        f'table_angle = {{ column = "angle", unit = "deg" }}\n{channels}{model}'
    )
    return path


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("frequency", [6.85, 17.3])
def test_a_line_above_the_bin_rate_has_its_frequency_beside_a_staircase(
    tmp_path: Path, seed: int, frequency: float
) -> None:
    """Of 25 deviations by all rows: it had the frequency to which means fold it, or was missed."""
    rng, rate = np.random.default_rng(seed), staircase()
    t = np.arange(1, len(rate) + 1) / HZ
    noise = 3e-4
    line = 25 * noise * np.sqrt(2 / len(t)) * np.cos(2 * np.pi * frequency * t + 1.0)
    gyro = 1.0003 * rate + 0.01 + noise * rng.standard_normal(len(t)) + line
    channels = 'gyro = { column = "gyro", unit = "deg/s", covers = "interval" }\n'
    model = '[model]\ntarget = "gyro"\ndeclared = ["bias", "scale_factor"]\n'
    (found,) = close(written(tmp_path, {"angle": np.cumsum(rate) / HZ, "gyro": gyro}, channels, model)).targets
    (added,) = found.added
    told = next(p for p in added.parameters if p.parameter == "f")
    assert added.effect == "tone" and told.value == pytest.approx(frequency, abs=5 * told.sd)


@pytest.mark.parametrize("cause", ["lever_arm", "table_tilt", ""])
def test_an_accelerometer_on_a_table_that_turns_most_of_the_time_is_judged_as_it_turns(
    tmp_path: Path, cause: str
) -> None:
    """It was judged at rest alone, where a lever arm is what the model already has, and such an axis a level."""
    rng, rate = np.random.default_rng(4), staircase()
    angle = np.cumsum(rate) / HZ
    felt = 0.02 + 2e-3 * rng.standard_normal(len(rate))
    if cause == "lever_arm":
        felt = felt + 0.002 * np.deg2rad(rate) ** 2
    elif cause:
        felt = felt + 9.80665 * 1e-4 * np.cos(np.deg2rad(angle - rate / HZ / 2))
    channels = 'accel_x = { column = "accel", unit = "m/s^2" }\n'
    model = '[mounting]\naxes = "RFU"\ntable_axis = "U"\n[model]\ntarget = "accel_x"\ndeclared = ["bias"]\n'
    (found,) = close(written(tmp_path, {"angle": angle, "accel": felt}, channels, model)).targets
    assert [one.effect for one in found.added] == ([cause] if cause else [])
