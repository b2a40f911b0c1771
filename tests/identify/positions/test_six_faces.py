"""Six faces with biases declared: six magnitudes tell six figures, and nothing confirms scale factors beside them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.units import STANDARD_GRAVITY
from insenv.identify.findings import Findings

FACES = [(axis, sign) for axis in range(3) for sign in (1, -1)]
#: Scatter of the rows, and what differs from rest to rest by itself [m/s^2].
ROW, REPEAT = 5e-3, 1e-3


def six_faces(folder: Path, scale: tuple[float, float, float], seed: int) -> Findings:
    """Six rests of 60 s, each placed to 3 mrad, of a unit with biases of 30 mm/s^2 and these scale factors."""
    rng, names = np.random.default_rng(seed), []
    bias = 30e-3 * rng.standard_normal(3)
    for number, (axis, sign) in enumerate(FACES):
        force = 3e-3 * STANDARD_GRAVITY * rng.standard_normal(3)
        force[axis] = sign * STANDARD_GRAVITY
        force *= STANDARD_GRAVITY / np.linalg.norm(force)
        mean = force * (1 + np.array(scale)) + bias + REPEAT * rng.standard_normal(3)
        rows = np.column_stack([0.05 * np.arange(1200), mean + ROW * rng.standard_normal((1200, 3))])
        np.savetxt(folder / f"{number}.csv", rows, delimiter=",", header="t,x,y,z", comments="", fmt="%.6f")
        names.append(f"{number}.csv")
    lines = [f"data = {json.dumps(names)}", "[channels]", 'time = { column = "t", unit = "s" }']
    lines += [f'accel_{axis} = {{ column = "{axis}", unit = "m/s^2" }}' for axis in "xyz"]
    lines += ["[site]", f'gravity = "{STANDARD_GRAVITY} m/s^2"', "[model]", 'procedure = "multi-position"']
    lines += ['target = ["accel_x", "accel_y", "accel_z"]', 'declared = ["accel_bias"]']
    (folder / "m.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return close(folder / "m.toml")


@pytest.mark.parametrize("seed", range(3))
def test_a_unit_that_repeats_itself_leaves_nothing(tmp_path: Path, seed: int) -> None:
    """What is left has three degrees of freedom and 1 mm/s^2: above 3 in 6 of a million seeds."""
    assert said(six_faces(tmp_path, (0.0, 0.0, 0.0), seed)) == ("nothing-significant", ())


def test_scale_factors_are_suspected_and_not_named(tmp_path: Path) -> None:
    verdict, reasons = said(six_faces(tmp_path, (-1.4e-3, -1.3e-3, 0.1e-3), 0))
    assert verdict == "unexplained-structure"
    assert any("accel_scale_factor would explain it, and more attitudes would tell" in r for r in reasons)


def said(found: Findings) -> tuple[str, tuple[str, ...]]:
    return found.verdict, found.targets[0].reasons
