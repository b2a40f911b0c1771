"""A hysteresis whose loop is a few deviations of one reading wide, beside a second gyro that reads the same motion.

A loop repeats with each reversal, so it shows though one reading does not tell on which side of it the rate is. Fast
motion leaves fourth differences, as noise does: by the gyro that reads it too the noise is told to be less. Where no
loop was tried, a skew of 2 to 23 ms that is not there was named in its place or beside it (13 of 16 seeds of two
motions).

Without a loop none is named: of seeds 0 to 11 with motion of three speeds, and of 36 with a skew or a filter.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from strangers import closed_rate_file

from insenv.effects.forms import play

LOOP, RADIUS, NOISE = 6e-3, 0.03, 5e-3


@pytest.mark.parametrize("loop", [LOOP, 0.0])
def test_a_loop_of_six_deviations_of_a_reading_is_named_and_no_skew(tmp_path: Path, loop: float) -> None:
    rng, n, dt = np.random.default_rng(2), 1258, 0.04
    rate = gaussian_filter1d(rng.standard_normal(n), 3) * np.interp(np.arange(n) / n, [0, 0.25, 0.5, 1], [5, 10, 6, 4])
    rate *= 0.26 / np.abs(rate).max()
    side = (rate - play(rate, RADIUS, np.zeros(()))) / RADIUS
    gyro = rate + loop * side + 0.02 + NOISE * rng.standard_normal(n)
    target = closed_rate_file(tmp_path, dt * np.arange(n), gyro, rate + NOISE * rng.standard_normal(n))
    if not loop:
        assert target.added == ()
        return
    (found,) = target.added
    assert found.effect == "scale_factor_hysteresis"
    size, radius = found.parameters
    assert size.sd is not None
    assert abs(size.value - loop) < 4 * size.sd < 0.4 * loop
    assert radius.value == pytest.approx(RADIUS, rel=0.3)
