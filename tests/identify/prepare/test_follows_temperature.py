"""What is left that follows the temperature with no form that an effect has: fringes, a change of the material."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.identify.prepare.excess import OF_TEMPERATURE

MANIFEST = """
data = "run.csv"
[channels]
time = { column = "t", unit = "s" }
gyro = { column = "x", unit = "deg/h" }
temperature = { column = "T", unit = "degC" }
[model]
target = "gyro"
declared = ["bias", "bias_temperature:3"]
reference_temperature = "30 degC"
"""


@pytest.mark.parametrize(("fringes", "wander"), [(0.15, 0.0), (0.0, 0.0), (0.0, 0.02)])
def test_fringes_of_the_temperature_are_said(tmp_path: Path, fringes: float, wander: float) -> None:
    """Fringes 5 K apart, half a row's noise tall; noise gives as much in one recording of a thousand."""
    rng, n = np.random.default_rng(3), 5400
    t = 2.0 * np.arange(n)
    heat = 31 + 9 * np.sin(2 * np.pi * t / 2900) + 4 * np.sin(2 * np.pi * t / 1130)
    rate = 8 + fringes * np.sin(2 * np.pi * heat / 5) + 0.3 * rng.standard_normal(n)
    rate += wander * np.cumsum(rng.standard_normal(n)) / 3
    np.savetxt(tmp_path / "run.csv", np.column_stack([t, rate, heat]), "%.9g", ",", header="t,x,T", comments="")
    (tmp_path / "run.toml").write_text(MANIFEST)
    (found,) = close(tmp_path / "run.toml").targets
    assert any(OF_TEMPERATURE in reason for reason in found.reasons) is bool(fringes)
    assert all(one.generic for one in found.added)
