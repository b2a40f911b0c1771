"""A law that has a name explains a corner of the scale factor, and one that cannot be does so far better: said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from strangers import closed_rate_file

DT, TOP = 0.05, 0.5


@pytest.mark.parametrize("corner", [0.0, 4e-3])
def test_a_corner_of_the_scale_factor_is_no_cube_alone(tmp_path: Path, corner: float) -> None:
    """From half of the largest rate on the gain is larger, which a dead band of a hundredth fits better than a cube."""
    levels = TOP * np.concatenate([np.arange(1, 7), np.arange(-6, 0)]) / 6
    rate = np.repeat(np.tile(levels, 3), 160)
    t = DT * np.arange(1, len(rate) + 1)
    gyro = rate * 1.002 + corner * np.sign(rate) * np.maximum(np.abs(rate) - TOP / 2, 0)
    gyro += 3e-4 * np.random.default_rng(1).standard_normal(len(t))
    found = closed_rate_file(tmp_path, t, gyro, rate)
    said = [reason for reason in found.reasons if "would explain far more" in reason]
    assert bool(said) is bool(corner)
    assert (found.verdict == "nothing-significant") is not bool(corner)
