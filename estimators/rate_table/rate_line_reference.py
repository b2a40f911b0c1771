r"""Dwells at the reference temperature: their outputs less what the declared effects of the temperature foretell.

y - sum_k c_k phi_k(rate, T - T_ref),    variance + sum_k sd(c_k)^2 phi_k^2
"""

from __future__ import annotations

import numpy as np

from insenv.core.estimate import Datasheet
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import LinearEffect
from insenv.effects.catalogue import by_key
from insenv.effects.rate.scale import ScaleFactorTemperature
from insenv.effects.thermal import BiasTemperature

#: Effects of which a dwell's mean temperature tells all.
_EFFECTS = (BiasTemperature.id, ScaleFactorTemperature.id)


def at_reference(
    output: Floats, variance: Floats, rate: Floats, temperature: Floats, sheet: Datasheet
) -> tuple[Floats, Floats]:
    """Output [rad/s] and variance of each dwell, of the shape of ``rate``; as they are where no temperature is told."""
    known = np.isfinite(temperature) & (temperature > 0)
    kelvin = np.where(known, temperature, sheet.reference_temperature)
    u = rate[..., None]
    motion = Motion(
        t=np.array([0.0, 1.0]),
        rate=u,
        temperature=np.stack([kelvin, kelvin], axis=-1),
        reference_temperature=sheet.reference_temperature,
    )
    for declared in sheet.declared:
        effect = by_key(declared.effect)
        if declared.target == "gyro" and effect.id in _EFFECTS and isinstance(effect, LinearEffect):
            basis = effect.basis(u, motion)[..., 0, :]
            output = output - basis @ np.array(declared.mean)
            variance = variance + basis**2 @ np.square(declared.sd)
    return output, variance
