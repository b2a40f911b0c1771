"""An accelerometer that a level axis turns through gravity, logged while it turns.

Generated with NumPy, no effect of insenv; seeds are fixed. Each law has so many deviations of the noise beside bias,
scale factor and zero.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.recording import Floats
from insenv.identify.findings import TargetFindings

STRENGTH, NOISE, GRAVITY = 20.0, 0.01, 9.80665
MANIFEST = """data = "run.csv"
[channels]
time = { column = "t", unit = "s" }
accel = { column = "y", unit = "m/s^2" }
table_angle = { column = "a", unit = "deg" }
[site]
gravity = "9.80665 m/s^2"
[model]
target = "accel"
declared = ["accel_bias", "accel_scale_factor"]
"""
LAWS = {
    "accel_second_order": lambda f, p, t: f**2,
    "accel_cross_coupling": lambda f, p, t: f * p,
    "bias_drift": lambda f, p, t: t,
    "bias_step": lambda f, p, t: (t > 61.3) * 1.0,
    "": lambda f, p, t: 0 * f,
}


def turned(folder: Path, law: str, rate: float, back: bool, seed: int) -> TargetFindings:
    """120 s at ``rate`` deg/s, the second half ``back``; means over the 50 ms before each row."""
    rng = np.random.default_rng([8, seed, len(law)])
    t, fine = 0.05 * np.arange(1, 2401), 0.005 * np.arange(24001)
    angle = np.deg2rad(rate) * np.where(back & (fine > 60), 120 - fine, fine)
    zero = rng.uniform(0, 2 * np.pi)
    middle = 0.5 * (angle[1:] + angle[:-1])

    def means(values: Floats) -> Floats:
        return values.reshape(-1, 10).mean(axis=1)

    f, p = means(GRAVITY * np.sin(middle - zero)), means(GRAVITY * np.cos(middle - zero))
    added = LAWS[law](f, p, t)
    beside = np.linalg.qr(np.column_stack([np.ones(len(t)), f, p]))[0]
    size = np.linalg.norm(added - beside @ (beside.T @ added))
    y = 0.05 + 1.004 * f + NOISE * rng.standard_normal(len(t)) + STRENGTH * NOISE * added / (size or 1.0)
    np.savetxt(
        folder / "run.csv",
        np.column_stack([t, y, np.rad2deg(angle[10::10])]),
        delimiter=",",
        header="t,y,a",
        comments="",
        fmt="%.6f",
    )
    manifest = MANIFEST.replace('"m/s^2" }', '"m/s^2", covers = "interval" }')
    (folder / "run.toml").write_text(manifest, encoding="utf-8")
    return close(folder / "run.toml").targets[0]


@pytest.mark.parametrize("rate", [9.0, 30.0])
@pytest.mark.parametrize("law", list(filter(None, LAWS)))
def test_what_it_lacks_is_named(tmp_path: Path, law: str, rate: float) -> None:
    """Gravity was a line at the turns' frequency, or a warm-up of 1 g."""
    target = turned(tmp_path, law, rate, rate > 10, 1)
    assert law in [one.effect for one in target.added]


@pytest.mark.parametrize("seed", range(4))
def test_what_lacks_nothing_is_told_with_its_scale_factor(tmp_path: Path, seed: int) -> None:
    """Two estimates of four tests: a sum of squares of 8 within what chance does in 999 of 1000 each."""
    target = turned(tmp_path, "", (6.0, 20.0)[seed % 2], seed > 1, seed)
    told = {e.effect: e for e in target.estimates_after}
    assert not target.added
    assert abs(told["accel_bias"].value - 0.05) < 3.5 * told["accel_bias"].sd
    assert abs(told["accel_scale_factor"].value - 0.004) < 3.5 * told["accel_scale_factor"].sd


@pytest.mark.parametrize("law", ["", "accel_second_order"])
def test_rows_of_dwells_are_those_of_angles_that_were_set(tmp_path: Path, law: str) -> None:
    """5 s at each of 24 angles, with no row of the way between."""
    rng = np.random.default_rng([9, len(law)])
    at = np.repeat(np.deg2rad(15) * np.arange(24), 50)
    f, p = GRAVITY * np.sin(at - 0.3), GRAVITY * np.cos(at - 0.3)
    t, added = 0.1 * np.arange(len(at)), LAWS[law](f, p, 0.1 * np.arange(len(at)))
    size = np.std(added) * np.sqrt(len(at)) or 1.0
    y = 0.05 + 1.004 * f + NOISE * rng.standard_normal(len(at)) + STRENGTH * NOISE * added / size
    rows = np.column_stack([t, y, np.rad2deg(at)])
    np.savetxt(tmp_path / "run.csv", rows, delimiter=",", header="t,y,a", comments="", fmt="%.5f")
    (tmp_path / "run.toml").write_text(MANIFEST, encoding="utf-8")
    (target,) = close(tmp_path / "run.toml").targets
    assert [one.effect for one in target.added] == ([law] if law else [])
