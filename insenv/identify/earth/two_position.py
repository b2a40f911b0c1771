"""Two positions of one gyro at rest: the vertical Earth rate as the gyro measures it.

With the input axis up and then down, y = b + (1 + c) s W sin L, s = sin(tilt) = +1 and -1: the sum of the two means
gives the bias, their difference the vertical rate (1 + c) W sin L, to be compared with the known W sin L.
"""

from __future__ import annotations

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.recording import Recording
from insenv.effects.angle import EarthRate
from insenv.effects.rate.scale import ScaleFactor
from insenv.identify.findings import Estimate


def with_vertical_rate(recordings: tuple[Recording, ...], estimates: list[Estimate]) -> tuple[Estimate, ...]:
    """The estimates, with the measured vertical Earth rate beside a scale factor that rests at several tilts gave."""
    latitudes = {r.site.latitude for r in recordings}
    tilts = {r.mounting.tilt for r in recordings}
    turning = any(name in r.channels for r in recordings for name in ("table_angle", "table_rate"))
    scale = next((e for e in estimates if e.effect == ScaleFactor.id), None)
    if scale is None or turning or len(tilts) < 2 or len(latitudes) != 1 or None in latitudes:
        return tuple(estimates)
    vertical = EARTH_RATE * np.sin(next(iter(latitudes)))  # type: ignore[arg-type]
    measured = Estimate(
        EarthRate.id,
        "vertical",
        float((1 + scale.value) * vertical),
        float(scale.sd * abs(vertical)),
        "rad/s",
    )
    return (*estimates, measured)
