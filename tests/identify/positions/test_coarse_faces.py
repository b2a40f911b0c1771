"""Faces of an accelerometer in coarse steps, and rests that are all of one face."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.errors import InputError
from insenv.core.units import STANDARD_GRAVITY

MANIFEST = """data = "run.csv"
[channels]
time = { column = "t", unit = "s" }
accel_x = { column = "x", unit = "standard_gravity" }
accel_y = { column = "y", unit = "standard_gravity" }
accel_z = { column = "z", unit = "standard_gravity" }
segment = { column = "face" }
[site]
gravity = "9.80665 m/s^2"
[model]
procedure = "multi-position"
target = ["accel_x", "accel_y", "accel_z"]
declared = ["accel_bias", "accel_scale_factor"]
"""


def written(folder: Path, faces: np.ndarray, step: float, noise: float) -> Path:
    """Labelled rests of 3 s at 200 Hz, readings in steps of ``step`` [g]."""
    rng = np.random.default_rng(3)
    force = np.repeat(faces, 600, axis=0) * [1.001, 1.003, 1.0104] + [0.019, 0.017, -0.1]
    read = np.round((force + noise * rng.standard_normal(force.shape)) / step) * step
    t, label = 0.005 * np.arange(len(read)), np.repeat(np.arange(1, len(faces) + 1), 600)
    rows = np.column_stack([t, read, label])
    np.savetxt(folder / "run.csv", rows, delimiter=",", header="t,x,y,z,face", comments="", fmt="%.6g")
    (folder / "run.toml").write_text(MANIFEST, encoding="utf-8")
    return folder / "run.toml"


def test_faces_of_which_some_stand_at_one_step_are_rests(tmp_path: Path) -> None:
    """The quietest had no noise at all, beside which readings that go between two steps moved: one rest was found."""
    faces = np.array([sign * np.eye(3)[axis] for axis in range(3) for sign in (1, -1)])
    for target, bias in zip(close(written(tmp_path, faces, 0.01, 0.002)).targets, (0.019, 0.017, -0.1), strict=True):
        told = {e.effect: e for e in target.estimates_after}
        assert abs(told["accel_bias"].value - bias * STANDARD_GRAVITY) < 0.05


def test_rests_in_one_attitude_tell_no_scale_factors(tmp_path: Path) -> None:
    """They had scale factors of ten million and nothing missing."""
    faces = np.tile([0.03, 0.02, 1.0], (8, 1)) + 2e-3 * np.random.default_rng(1).standard_normal((8, 3))
    with pytest.raises(InputError, match="points one way in all 8 rests"):
        close(written(tmp_path, faces / np.linalg.norm(faces, axis=1)[:, None], 0.001, 0.002))
