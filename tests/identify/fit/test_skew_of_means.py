"""A skew by the means that are judged is no surer than the shorter ones bear it out."""

from __future__ import annotations

import math

import numpy as np

from insenv.identify.findings import Estimate
from insenv.identify.fit.clocks import skew_of_means

#: Of a robot beside its wheels, which slip: length of means [s], skew and its deviation [s].
ROBOT = ((0.5, -19.06e-3, 1.18e-3), (1.0, -15.72e-3, 1.05e-3), (2.0, -14.48e-3, 1.83e-3), (4.0, -23.61e-3, 0.71e-3))
#: What was there.
TRUE = -18.4e-3


def _own(skew: float, sd: float) -> Estimate:
    return Estimate("timing_skew", "c", skew, sd, "s")


def test_means_that_contradict_each_other_widen_the_deviation() -> None:
    """Seven deviations from what was there by one length alone, less than one with the difference."""
    (_, skew, sd) = ROBOT[-1]
    assert abs(skew - TRUE) > 7 * sd
    added, said = skew_of_means(ROBOT, 4.0, _own(skew, sd))
    stated = math.hypot(sd, math.sqrt(added))
    assert abs(skew - TRUE) < stated < 0.5 * abs(skew)
    assert "over 2 s (-14.5 ± 2 ms) and over 4 s (-23.6 ± 0.7 ms)" in said


def test_longer_means_than_are_judged_have_no_say() -> None:
    assert skew_of_means(ROBOT, 0.5, _own(*ROBOT[0][1:])) == (0.0, "")


def test_chance_widens_hardly_any() -> None:
    """Of 4000 draws by four lengths of which each holds what the longer ones have: 0.3 % for the two farthest apart."""
    rng, widened = np.random.default_rng(0), 0
    lengths, deviations = (0.5, 1.0, 2.0, 4.0), np.array([1.0, 1.2, 1.6, 2.2]) * 1e-3
    more = np.sqrt(np.diff(deviations**2, prepend=0.0))
    for drawn in np.cumsum(more * rng.standard_normal((4000, 4)), axis=1):
        told = tuple(zip(lengths, drawn, deviations, strict=True))
        widened += skew_of_means(told, 4.0, _own(float(drawn[-1]), float(deviations[-1])))[0] > 0
    assert widened <= 24
