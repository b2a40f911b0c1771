"""Attitudes that lie on one side: bias and scale factor of an axis are told apart by little, and that is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.units import STANDARD_GRAVITY
from insenv.identify.findings import Findings

HZ, REST, NOISE = 50, 4.0, 5e-3


def closed(folder: Path, most: float) -> Findings:
    """Accelerometers held still in 24 attitudes with z down but for ``most`` [rad], turned between."""
    rng = np.random.default_rng(1)
    rows = []
    for _ in range(24):
        away, about = most * np.sqrt(rng.uniform()), rng.uniform(0, 2 * np.pi)
        down = np.array([np.sin(away) * np.cos(about), np.sin(away) * np.sin(about), -np.cos(away)])
        before = rows[-1][-1] / np.linalg.norm(rows[-1][-1]) if rows else down
        way = np.linspace(before, down, HZ)
        rows += [STANDARD_GRAVITY * way / np.linalg.norm(way, axis=1)[:, None] + 0.3 * rng.standard_normal((HZ, 3))]
        rows += [np.tile(STANDARD_GRAVITY * down, (round(REST * HZ), 1))]
    read = np.concatenate(rows)
    read += NOISE * rng.standard_normal(read.shape)
    t = np.arange(len(read)) / HZ
    np.savetxt(folder / "run.csv", np.column_stack([t, read]), "%.6f", ",", header="t,x,y,z", comments="")
    (folder / "run.toml").write_text(
        'data = "run.csv"\n[channels]\ntime = { column = "t", unit = "s" }\n'
        + "".join(f'accel_{axis} = {{ column = "{axis}", unit = "m/s^2" }}\n' for axis in "xyz")
        + f'[site]\ngravity = "{STANDARD_GRAVITY} m/s^2"\n[model]\nprocedure = "multi-position"\n'
        'target = ["accel_x", "accel_y", "accel_z"]\ndeclared = ["accel_bias", "accel_scale_factor"]\n'
    )
    return close(folder / "run.toml")


@pytest.mark.parametrize(("most", "said"), [(0.6, True), (np.pi, False)])
def test_an_axis_that_points_one_way_in_all_rests_is_told(tmp_path: Path, most: float, said: bool) -> None:
    (z,) = (one for one in closed(tmp_path, most).targets if one.target == "accel_z")
    assert any("up and down tell" in caution for caution in z.cautions) is said
