"""All effects, by their names in the contract."""

from __future__ import annotations

from dataclasses import replace

from insenv.core.errors import InputError
from insenv.effects.angle import AngleLockedRate, EarthRate, EncoderHarmonic
from insenv.effects.base import Effect
from insenv.effects.bias import Bias, BiasDrift, BiasStep, BiasWarmUp
from insenv.effects.cross import CrossAxis, GSensitivity
from insenv.effects.lock_in import LockIn, LockInWander, RateLock
from insenv.effects.noise import AngleRandomWalk, BiasInstability, Quantization, RateRandomWalk
from insenv.effects.response import CompensationRipple, SineResponse
from insenv.effects.scale import (
    ScaleFactor,
    ScaleFactorAnomaly,
    ScaleFactorAsymmetry,
    ScaleFactorCubic,
    ScaleFactorDrift,
    ScaleFactorTemperature,
    ScaleFactorWarmUp,
)
from insenv.effects.spline import SplineAngle, SplineRate, SplineTemperature, SplineTime
from insenv.effects.thermal import BiasTemperature, BiasTemperatureRate, BiasThermalLag
from insenv.effects.tilt import BaseTilt
from insenv.effects.timing import SampleHold, TimingSkew
from insenv.effects.tone import Tone
from insenv.effects.wobble import Wobble

#: The effects that a search tries and that a manifest may name.
CATALOGUE: tuple[Effect, ...] = (
    Bias(),
    BiasDrift(),
    BiasWarmUp(),
    BiasStep(),
    *(BiasTemperature(order) for order in (1, 2, 3)),
    BiasTemperatureRate(),
    BiasThermalLag(),
    ScaleFactor(),
    ScaleFactorDrift(),
    ScaleFactorWarmUp(),
    ScaleFactorTemperature(),
    ScaleFactorAsymmetry(),
    ScaleFactorCubic(),
    ScaleFactorAnomaly(),
    LockIn(),
    *(EncoderHarmonic(order) for order in (1, 2, 3, 4)),
    *(AngleLockedRate(order) for order in (1, 2, 3, 4)),
    EarthRate(),
    TimingSkew(),
    SampleHold(),
    GSensitivity(),
    CrossAxis(),
    Tone(),
    BaseTilt(),
    SplineTime(),
    SplineTemperature(),
    SplineRate(),
    SplineAngle(),
    AngleRandomWalk(),
    BiasInstability(),
    RateRandomWalk(),
    Quantization(),
)

#: Those and what only a scenario may name: at one tilt, from one record, or at the rates of a usual test they cannot be
#: told from others (the forms of a fibre-optic gyro from a cubic and from a local anomaly).
ALL: tuple[Effect, ...] = (
    *CATALOGUE,
    *(Wobble(order) for order in (1, 2, 3)),
    LockInWander(),
    RateLock(),
    SineResponse(),
    CompensationRipple(),
)


def by_key(key: str) -> Effect:
    """The effect of an identifier, with its order where one is given: "bias", "bias_temperature:3".

    Raises
    ------
    InputError
        If there is no such effect, or it has no such order.
    """
    name, colon, order = key.partition(":")
    found = next((effect for effect in ALL if effect.id == name), None)
    if found is None:
        names = ", ".join(dict.fromkeys(effect.id for effect in ALL))
        raise InputError(f"unknown effect {key!r}, wanted one of {names}")
    if not colon:
        return found
    if not hasattr(found, "order"):
        raise InputError(f"effect {key!r} given, but {name!r} has no order")
    if not (order.isascii() and order.isdecimal() and len(order) < 5):
        raise InputError(f"effect {key!r}: order {order!r} given, wanted a whole number")
    return replace(found, order=int(order))  # type: ignore[call-arg]
