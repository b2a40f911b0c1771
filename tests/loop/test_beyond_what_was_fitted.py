"""A declared law that the fitted rows do not tell where others are held out: these refuse nothing.

Generated with NumPy; the seeds are fixed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close

MANIFEST = """data = "run.csv"
[channels]
time = { column = "t", unit = "s" }
gyro = { column = "y", unit = "deg/h" }
table_rate = { column = "u", unit = "deg/s", source = "command" }
temperature = { column = "T", unit = "degC" }
[model]
target = "gyro"
declared = ["bias", "bias_temperature:3", "scale_factor"]
"""


@pytest.mark.parametrize("seed", range(3))
def test_a_cubic_of_temperatures_that_were_not_fitted_is_no_structure(tmp_path: Path, seed: int) -> None:
    """The first 60 % see 15 to 25 degC, the others up to 65: three of three were unexplained."""
    rng = np.random.default_rng([3, seed])
    t = np.arange(4000.0)
    heat = np.interp(t, [0, 1200, 2400, 3600, 4000], [25, 15, 25, 65, 65])
    u = np.resize(np.repeat([0.0, 10.0, -10.0, 0.0, 20.0, -20.0], 100), 4000)
    x = heat - 25
    y = 3600 * 1.002 * u - 60 + 7 * x + 0.01 * x**2 + 2e-3 * x**3 + 12 * rng.standard_normal(4000)
    rows = np.column_stack([t, y, u, heat + 0.005 * rng.standard_normal(4000)])
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header="t,y,u,T", comments="", fmt="%.6f")
    (tmp_path / "run.toml").write_text(MANIFEST, encoding="utf-8")
    found = close(tmp_path / "run.toml")
    (target,) = found.targets
    assert target.verdict == "nothing-significant"
    assert any("others are held out here" in remark for remark in found.remarks)
