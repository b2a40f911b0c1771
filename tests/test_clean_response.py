"""A late encoder: told whether it is delayed or smoothed by a first-order filter.

The motion is 0.2 to 2 Hz; a filter of 20 ms makes 2 Hz smaller by 3 % where a delay leaves its size. Generated with
NumPy and SciPy, no effect of insenv; seeds are fixed.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from insenv.core.recording import Channel, Floats, Recording, Response
from insenv.core.reference import with_reference
from insenv.identify.clean.response import responding

DT, N, LATE = 0.01, 6000, 0.02
GAIN = -0.87


def bench(form: str, seed: int) -> Recording:
    """A reversed gyro beside an encoder's rate that is late by `LATE` in one of two ways."""
    rng = np.random.default_rng(seed)
    fine = DT / 20
    t = np.linspace(0.0, (20 * N - 1) * fine, 20 * N)
    waves = ((1.0, 0.2, 0.3), (0.8, 0.7, 1.0), (0.7, 2.0, 2.0))
    rate: Floats = np.sum([a * np.sin(2 * np.pi * f * t + p) for a, f, p in waves], axis=0)
    if form == "filter":
        share = 1 - np.exp(-fine / LATE)
        late = lfilter([share], [1, share - 1], rate)
    else:
        late = np.interp(t - LATE, t, rate)
    rows = slice(200, None, 20)
    encoder = late[rows] + 0.02 * rng.standard_normal(len(t[rows]))
    gyro = GAIN * rate[rows] + 0.01 * rng.standard_normal(len(t[rows]))
    channels = {"gyro": Channel(gyro, "rad/s"), "table_rate": Channel(encoder, "rad/s", source="encoder")}
    return with_reference(Recording(t[rows], channels))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("form", ["filter", "delay"])
def test_a_filter_is_told_from_a_delay(form: str, seed: int) -> None:
    run = bench(form, seed)
    (found,) = responding((run,), (slice(0, len(run)),), "gyro", ())
    response = found.responses.get("gyro", Response())
    assert response.filtered == (form == "filter")
    assert response.lag == pytest.approx(-LATE, abs=5e-4)
    assert response.gain == pytest.approx(GAIN, abs=2e-3)
