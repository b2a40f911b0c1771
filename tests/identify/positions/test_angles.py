"""A non-orthogonality as an angle between two axes."""

from __future__ import annotations

import re

import numpy as np
import pytest

from insenv.identify.findings import Estimate
from insenv.identify.positions.angles import apart


@pytest.mark.parametrize("c", [0.0075, -0.02])
def test_it_is_the_angle_between_axes_that_lean_alike(c: float) -> None:
    x, y = np.array([1.0, c, 0.0]), np.array([c, 1.0, 0.0])
    angle = np.rad2deg(np.arccos(x @ y / np.linalg.norm(x) / np.linalg.norm(y)))
    said = apart("non_orthogonality", "x", (Estimate("non_orthogonality", "c_y", c, 1e-4, "1"),))
    found = re.match(r"x and y are (\S+) ± 0\.011 deg apart \((\S+) if one of them leans alone\)$", said)
    assert found and float(found[1]) == pytest.approx(angle, abs=2e-3) and float(found[2]) == pytest.approx(2 * c)


def test_what_is_not_certain_and_other_effects_say_nothing() -> None:
    row = Estimate("non_orthogonality", "c_z", 1e-4, 1e-4, "1")
    assert apart("non_orthogonality", "x", (row,)) == "" == apart("misalignment", "x", (row,))
