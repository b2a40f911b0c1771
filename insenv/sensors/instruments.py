"""A few instruments with the figures that were published of them, as sensors with their parameters.

Figures are typical ones of a kind of instrument, not a certificate of one: `Instrument.source` says where
they are from and what was assumed. Parameters stand in the units of the sources and are converted once,
here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from insenv.core.recording import Floats
from insenv.core.units import (
    ARCSEC,
    DEG,
    DEG_PER_HOUR,
    DEG_PER_HOUR_PER_SQRT_HOUR,
    DEG_PER_SQRT_HOUR,
    PPM,
    UG,
)
from insenv.effects.base import Effect
from insenv.effects.bias import BiasWarmUp
from insenv.effects.noise import AngleRandomWalk, BiasInstability, Quantization, RateRandomWalk
from insenv.effects.scale import ScaleFactorAnomaly, ScaleFactorAsymmetry
from insenv.effects.thermal import BiasTemperature
from insenv.sensors.chain import Sensor

#: Weight of one pulse of the rate-biased ring-laser gyro [rad].
RLG_PULSE = 0.46634601 * ARCSEC


@dataclass(frozen=True)
class Instrument:
    """A sensor with its parameters, shape (p,), its sampling rate [Hz] and where the figures are from."""

    name: str
    sensor: Sensor
    theta: Floats
    rate: float
    source: str


def rate_biased_rlg(target: str = "gyro") -> Instrument:
    """Ring-laser gyro on a table that turns all the time: angle random walk and pulses.

    A pulse q rounds the angle: Q = q / sqrt(12).
    """
    return _instrument(
        "rate-biased ring-laser gyro",
        target,
        [(AngleRandomWalk(), (3e-4 * DEG_PER_SQRT_HOUR,)), (Quantization(), (RLG_PULSE / 12**0.5,))],
        100.0,
        "Zhang et al., Opt. Precis. Eng. 19 (2011) 146: pulse weight; angle random walk assumed",
    )


def fog_b215(target: str = "gyro") -> Instrument:
    """Fibre-optic gyro like the B-215: quantised angle, a local scale-factor fault at 20 deg/s."""
    return _instrument(
        "fibre-optic gyro like the B-215",
        target,
        [
            *_fog_noise(0.12, 0.35, 0.15),
            (Quantization(), (0.35 * ARCSEC,)),
            (ScaleFactorAsymmetry(), (30 * PPM,)),
            (ScaleFactorAnomaly(), (0.033718 * DEG, 20 * DEG, 0.22 * DEG)),
            (BiasWarmUp(), (-2.5 * 0.35 * DEG_PER_HOUR, 900.0)),
        ],
        2000.0,
        "Zhang, DOI 10.11857/j.issn.1674-5124.2016.12.001: fault at 20 deg/s from the printed nonlinearity; "
        "noise, asymmetry and warm-up assumed so that its other results come out",
    )


def fog_kvh13(target: str = "gyro") -> Instrument:
    """Fibre-optic gyro like the KVH-13: open loop, long warm-up."""
    return _instrument(
        "fibre-optic gyro like the KVH-13",
        target,
        [
            *_fog_noise(0.067, 0.35, 0.08),
            (ScaleFactorAsymmetry(), (8 * PPM,)),
            (BiasWarmUp(), (-14 * 1.8 * DEG_PER_HOUR, 2400.0)),
        ],
        100.0,
        "Zhang, DOI 10.11857/j.issn.1674-5124.2016.12.001; angle random walk of the maker's inertial unit, "
        "the rest assumed",
    )


def quartz_accelerometer(target: str = "accel_x") -> Instrument:
    """Quartz pendulous accelerometer of navigation grade.

    A noise of 70 ug rms between 10 Hz and 500 Hz is a one-sided density of 3.2 ug/sqrt(Hz), hence the
    coefficient 3.2 / sqrt(2) ug sqrt(s).
    """
    return _instrument(
        "quartz pendulous accelerometer",
        target,
        [
            (AngleRandomWalk(), (70 * UG / (2 * 490.0) ** 0.5,)),
            (BiasInstability(), (2 * UG,)),
            (BiasTemperature(1), (30 * UG,)),
        ],
        100.0,
        "figures usual for the class (intrinsic noise below 70 ug rms, 10-500 Hz; bias below 30 ug/K); "
        "bias instability assumed",
    )


def _fog_noise(n: float, b: float, k: float) -> list[tuple[Effect, tuple[float, ...]]]:
    """Angle random walk [deg/sqrt(h)], bias instability [deg/h] and rate random walk [deg/h/sqrt(h)]."""
    return [
        (AngleRandomWalk(), (n * DEG_PER_SQRT_HOUR,)),
        (BiasInstability(), (b * DEG_PER_HOUR,)),
        (RateRandomWalk(), (k * DEG_PER_HOUR_PER_SQRT_HOUR,)),
    ]


def _instrument(
    name: str, target: str, chain: Sequence[tuple[Effect, tuple[float, ...]]], rate: float, source: str
) -> Instrument:
    sensor = Sensor(target, tuple(effect for effect, _ in chain))
    return Instrument(name, sensor, sensor.theta([values for _, values in chain]), rate, source)
