"""A body that swings fast to one side and turns back slowly, beside a heading that shows six tenths of the slow way.

The slow way alone would tell the scale of the other side, and it tells of the heading: an asymmetry of a third of the
scale was named. No gyro has one of a fifth; one that is there by less is told. The seed is fixed, the level of a false
name 1 %.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from strangers import closed_rate_file


@pytest.mark.parametrize(("lost", "asymmetry", "named"), [(0.4, 0.0, False), (0.0, 0.1, True)])
def test_an_asymmetry_is_no_half_of_the_scale(tmp_path: Path, lost: float, asymmetry: float, named: bool) -> None:
    rng, dt = np.random.default_rng(0), 0.02
    t = dt * np.arange(2000)
    rate = 0.8 * np.exp(-0.5 * ((t % 20 - 5) / 0.8) ** 2) - 0.12 * ((t % 20 > 9) & (t % 20 < 18))
    gyro = rate + asymmetry * np.abs(rate) + 2e-3 * rng.standard_normal(len(t))
    shown = np.where(rate < 0, (1 - lost) * rate, rate) if lost else rate
    target = closed_rate_file(tmp_path, t, gyro, shown)
    effects = [one.effect for one in target.added]
    assert ("scale_factor_asymmetry" in effects) == named
    assert named or target.verdict not in ("effects-found", "nothing-significant")
