"""All effects of insenv, by their names in the contract."""

from __future__ import annotations

from insenv.effects.acceleration import CentripetalAcceleration, LeverArm, SizeEffect, VibrationRectification
from insenv.effects.angle import AngleLockedRate, EarthRate, EncoderHarmonic, MagneticField, TableTilt
from insenv.effects.base import Effect
from insenv.effects.bias import Bias, BiasDrift, BiasStep, BiasWarmUp
from insenv.effects.cross import CrossAxis, GSensitivity
from insenv.effects.noise import AngleRandomWalk, BiasInstability, Quantization, RateRandomWalk
from insenv.effects.rate.hysteresis import EncoderBacklash, ScaleFactorHysteresis
from insenv.effects.rate.lag import OutputBandwidth, SelfHeating, SettlingAfterTurn
from insenv.effects.rate.lock_in import LockIn, LockInWander, RateLock
from insenv.effects.rate.response import CompensationRipple, SineResponse
from insenv.effects.rate.scale import (
    ScaleFactor,
    ScaleFactorAnomaly,
    ScaleFactorAsymmetry,
    ScaleFactorCubic,
    ScaleFactorDrift,
    ScaleFactorTemperature,
    ScaleFactorWarmUp,
)
from insenv.effects.rate.threshold import BiasDirection, DeadBand, ScaleFactorKnee
from insenv.effects.spline import SplineAngle, SplineRate, SplineTemperature, SplineTime
from insenv.effects.thermal import BiasTemperature, BiasTemperatureRate, BiasThermalHysteresis, BiasThermalLag
from insenv.effects.tilt import BaseSettling, BaseTilt
from insenv.effects.timing import ForceDelay, SampleHold, TimingSkew
from insenv.effects.tone import Tone
from insenv.effects.triad import (
    AccelAsymmetry,
    AccelBias,
    AccelCrossCoupling,
    AccelMisalignment,
    AccelScaleFactor,
    AccelSecondOrder,
    AccelThirdOrder,
    Misalignment,
    NonOrthogonality,
)
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
    BiasThermalHysteresis(),
    ScaleFactor(),
    ScaleFactorDrift(),
    ScaleFactorWarmUp(),
    ScaleFactorTemperature(),
    ScaleFactorAsymmetry(),
    ScaleFactorCubic(),
    ScaleFactorAnomaly(),
    CompensationRipple(),
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
    EncoderBacklash(),
    ScaleFactorHysteresis(),
    DeadBand(),
    BiasDirection(),
    ScaleFactorKnee(),
    SelfHeating(),
    SettlingAfterTurn(),
    CentripetalAcceleration(1),
    CentripetalAcceleration(2),
    VibrationRectification(),
    LeverArm(),
    TableTilt(),
    SplineTime(),
    SplineTemperature(),
    SplineRate(),
    SplineAngle(),
    AngleRandomWalk(),
    BiasInstability(),
    RateRandomWalk(),
    Quantization(),
)

#: Effects that only a triad held still in several attitudes tells (`insenv.identify.positions.rests`).
TRIAD: tuple[Effect, ...] = (AccelBias(), AccelScaleFactor(), NonOrthogonality(), Misalignment())

#: Effects of accelerometers that only a unit shows which is turned about several axes.
UNIT: tuple[Effect, ...] = (AccelAsymmetry(), AccelSecondOrder(), SizeEffect(), ForceDelay())

#: Effects of an accelerometer that is turned through gravity on a dividing head (`insenv.data.cells.tumble`); the last
#: is part of every model there.
TUMBLE: tuple[Effect, ...] = (
    AccelScaleFactor(),
    AccelAsymmetry(),
    AccelSecondOrder(),
    AccelThirdOrder(),
    AccelCrossCoupling(),
    AccelMisalignment(),
)

#: Those and what only a scenario may name: at one tilt, from one record, or at the rates of a usual test they cannot be
#: told from others (a sine from a cubic, a lock from a local anomaly, a low-pass from a late reference or the servo's),
#: or by no turning at all (a field from the Earth's rate). Some stand in a report as rivals nonetheless
#: (`insenv.identify.search.twins`).
ALL: tuple[Effect, ...] = (
    *CATALOGUE,
    *TRIAD,
    *UNIT,
    AccelThirdOrder(),
    AccelCrossCoupling(),
    AccelMisalignment(),
    *(Wobble(order) for order in (1, 2, 3)),
    LockInWander(),
    RateLock(),
    SineResponse(),
    MagneticField(),
    BaseSettling(),
    OutputBandwidth(),
)

#: Names that a report may have and no class: effects that this version does not have, and errors of a table of several
#: axes (`insenv.core.unit.gimbals`) and of a unit's seat on it. With their words: title and meaning.
RESERVED = {
    "saturation": ("saturation", "beyond a largest or smallest value nothing more is read"),
    "unit_mounting": ("mounting of the unit", "the unit is turned against the table by more than is stated"),
    "mounting_shift": ("loose mounting", "the unit slipped on the table during a turn"),
    "base_level": ("tilt of the table's base", "the base is not level by more than is stated"),
    "base_heading": ("heading of the table's base", "the base points elsewhere than is stated, by more than is stated"),
    "axis_non_orthogonality": ("table axes out of square", "axes of the table are not at right angles"),
    "encoder_eccentricity": ("eccentricity of an encoder", "the reading of an axis of the table is off once a turn"),
}
