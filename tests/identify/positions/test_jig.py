"""A triad in the eighteen attitudes of a jig whose groups differ: what a walk of the biases explains nearly as well."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from insenv.close import close
from insenv.core.units import STANDARD_GRAVITY
from insenv.identify.findings import Findings

MANIFEST = """\
data = "jig.csv"
[channels]
segment = { column = "row" }
accel_x = { column = "x", unit = "m/s^2" }
accel_y = { column = "y", unit = "m/s^2" }
accel_z = { column = "z", unit = "m/s^2" }
[model]
target = ["accel_x", "accel_y", "accel_z"]
procedure = "multi-position"
declared = ["accel_bias"]
"""


def jig(folder: Path, skew: float, seed: int) -> Findings:
    """Down, level, up by halves about z, then the faces; level edges and faces read +-20 mm/s^2 apart."""
    about = np.array([[-1, 0], [0, -1], [1, 0], [0, 1]])
    level = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    edges = [np.column_stack([about, np.full(4, -1)]), level, np.column_stack([about, np.full(4, 1)])]
    faces = np.repeat(np.eye(3), 2, axis=0) * np.tile([-1, 1], 3)[:, None]
    up = STANDARD_GRAVITY * np.concatenate([*(edge / np.sqrt(2) for edge in edges), faces])
    gain = np.diag([1.014, 0.998, 0.99])
    gain[2, 0] = skew
    group = np.repeat([0.0, -0.002, 0.0, 0.002], [4, 4, 4, 6])
    noise = np.random.default_rng(seed).normal(0.0, 0.005, up.shape)
    rows = (1 + group)[:, None] * (up @ gain.T) + [-0.05, -0.1, -0.09] + noise
    np.savetxt(folder / "jig.csv", rows, delimiter=",", header="x,y,z", comments="")
    (folder / "jig.toml").write_text(MANIFEST)
    return close(folder / "jig.toml")


@pytest.mark.parametrize("seed", [1, 2])
def test_an_angle_between_axes_is_named_or_said(tmp_path: Path, seed: int) -> None:
    first = jig(tmp_path, 0.0168, seed).targets[0]
    named = {step.effect for step in first.added} | {word.split()[0] for word in first.reasons}
    assert "non_orthogonality" in named and not first.noise


@pytest.mark.parametrize("seed", [1, 2])
def test_where_there_is_none_nothing_of_it_is_said(tmp_path: Path, seed: int) -> None:
    # It must be significant without a walk (p < 0.01): of the four chances here at most 0.04 would say it.
    assert not [word for word in jig(tmp_path, 0.0, seed).targets[0].reasons if "non_orthogonality" in word]
