"""A turning table, a vehicle's instrument and noises, for the tests of information and bounds."""

from __future__ import annotations

import numpy as np
from north_cases import LATITUDE, TILT

from insenv.core.earth import EARTH_RATE
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.core.units import DEG
from insenv.effects.angle import EarthRate, EncoderHarmonic
from insenv.effects.noise import AngleRandomWalk, BiasInstability, Quantization, RateRandomWalk
from insenv.effects.rate.scale import ScaleFactor
from insenv.information.alignment import AlignedUnit
from insenv.information.means import Noise

EFFECTS = (EarthRate(), ScaleFactor(), EncoderHarmonic(2))
WHITE = (Noise(AngleRandomWalk(), 2e-6), Noise(Quantization(), 1e-6))
#: Of the size that each takes part beside the white noise.
EVERY = (*WHITE, Noise(RateRandomWalk(), 3e-7), Noise(BiasInstability(), 1e-6))
VEHICLE = AlignedUnit(0.66, 5e-8, 2e-5, (1.5e-3, 1e-3, 1.0), 3 * (5e-8,), (5e-4, 5e-4))


def turning(duration: float, sampling: float, rate: float = 10 * DEG) -> Motion:
    t: Floats = np.arange(round(duration * sampling) + 1) / sampling
    share = float(np.sin(TILT))
    vertical = EARTH_RATE * np.sin(LATITUDE) * share
    return Motion(t=t, rate=np.full(len(t) - 1, rate * share + vertical), angle=rate * t, projection=share)
