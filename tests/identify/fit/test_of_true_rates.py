"""What is stated of a law of the rate is of the rate itself, whatever the gain of the output.

Generated with NumPy; seeds are fixed. A deviation beyond 4 sd is one of 16000.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close

MANIFEST = """data = "run.csv"
[channels]
time = { column = "t", unit = "s" }
gyro = { column = "y", unit = "rad/s" }
table_rate = { column = "u", unit = "rad/s" }
temperature = { column = "T", unit = "degC" }
[model]
target = "gyro"
declared = ["bias", "scale_factor"]
"""
LAWS = {
    "scale_factor_cubic": (0.01, lambda u, T: u**3),
    "scale_factor_asymmetry": (0.01, lambda u, T: np.abs(u)),
    "scale_factor_temperature": (3e-4, lambda u, T: u * (T - 25)),
    "scale_factor_knee": (0.02, lambda u, T: np.sign(u) * np.maximum(np.abs(u) - 1.0, 0)),
}


@pytest.mark.parametrize("gain", [-0.87, 0.5, 1.0, 1.6])
@pytest.mark.parametrize("law", LAWS)
def test_a_law_beside_a_gain_is_told_as_the_contract_has_it(tmp_path: Path, law: str, gain: float) -> None:
    """A cubic that bends the scale by 2 % was told 7 % too small beside a gain of one, by 37 deviations."""
    rng = np.random.default_rng(list(LAWS).index(law))
    t = 0.05 * np.arange(3000)
    u, heat = 1.5 * np.sin(2 * np.pi * t / 20) * (0.2 + 0.8 * t / 150), 25 + 10 * np.sin(2 * np.pi * t / 97)
    size, curve = LAWS[law]
    y = 0.002 + gain * u + size * curve(u, heat) + 2e-4 * rng.standard_normal(len(t))
    rows = np.column_stack([t, y, u, heat])
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header="t,y,u,T", comments="", fmt="%.9f")
    (tmp_path / "run.toml").write_text(MANIFEST, encoding="utf-8")
    (target,) = close(tmp_path / "run.toml").targets
    (found,) = [one for one in target.added if one.effect == law]
    told = {p.parameter: p for p in found.parameters}
    assert abs(told["c"].value - size) < 4 * told["c"].sd
    if law == "scale_factor_knee":
        assert abs(told["d"].value - 1.0) < 4 * told["d"].sd
