"""A few instruments with the figures that were published of them, as sensors with their parameters.

Figures are typical ones of a kind of instrument, not a certificate of one: `Instrument.source` says where
they are from and what was assumed. Parameters stand in the units of the sources and are converted once,
here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, hypot, pi, sqrt

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
from insenv.effects.rate.lock_in import LockInWander, RateLock
from insenv.effects.rate.response import CompensationRipple, SineResponse
from insenv.effects.rate.scale import (
    ScaleFactor,
    ScaleFactorAnomaly,
    ScaleFactorAsymmetry,
    ScaleFactorTemperature,
    ScaleFactorWarmUp,
)
from insenv.effects.thermal import BiasTemperature, BiasTemperatureRate
from insenv.effects.tone import Tone
from insenv.sensors.chain import Sensor

#: Weight of one pulse of the ring-laser gyros: one fringe [rad].
RLG_PULSE = 0.46634601 * ARCSEC
#: Time constant of their warm-up [s].
RLG_WARM_UP = 850.0
#: Amplitude [rad/s] and frequency [Hz] of the dither.
DITHER_RATE, DITHER_FREQUENCY = 100 * DEG, 413.0
HOUR = 3600.0


@dataclass(frozen=True)
class Instrument:
    """A sensor with its parameters, shape (p,), its sampling rate [Hz] and where the figures are from.

    What has a ``pulse`` [rad] gives out whole pulses of its angle: `insenv.sensors.counter` makes them of its reading.
    Its chain has no ``quantization``, which would be the same again.
    """

    name: str
    sensor: Sensor
    theta: Floats
    rate: float
    source: str
    pulse: float = 0.0


def rate_biased_rlg(target: str = "gyro") -> Instrument:
    """Ring-laser gyro for a table that turns all the time, so that its lock-in is a small error of the scale factor.

    The threshold of lock-in settles and wanders, its path length settles and follows the temperature. The parameters
    of a warm-up are those of X (1 - exp(-t / tau)) with X reached after an hour.
    """
    settled = 1 - exp(-HOUR / RLG_WARM_UP)
    return _instrument(
        "rate-biased ring-laser gyro",
        target,
        [
            (AngleRandomWalk(), (3e-4 * DEG_PER_SQRT_HOUR,)),
            (LockInWander(), (0.05 * DEG, 0.2 / settled, RLG_WARM_UP, 0.01 / 300**0.5)),
            (ScaleFactorWarmUp(), (-5 * PPM / settled, RLG_WARM_UP)),
            (ScaleFactorTemperature(), (0.1 * PPM,)),
        ],
        100.0,
        "Zhang et al., Opt. Precis. Eng. 19 (2011) 146: pulse weight and warm-up; angle random walk, threshold of "
        "lock-in (20 % in an hour, 1 % random in 300 s) and scale factor (5 ppm in an hour, 0.1 ppm/K) assumed",
        RLG_PULSE,
    )


def dithered_rlg(target: str = "gyro") -> Instrument:
    """Ring-laser gyro that a spring rotates to and fro: lock-in becomes a random walk, and a line stays.

    The line is what a read-out with the dither taken out leaves of it.
    """
    walk = dither_random_walk(0.05 * DEG, RLG_PULSE, DITHER_RATE)
    return _instrument(
        "mechanically dithered ring-laser gyro",
        target,
        [
            (AngleRandomWalk(), (hypot(walk, 3e-4 * DEG_PER_SQRT_HOUR),)),
            (Tone(), (1e-4 * DITHER_RATE, 0.0, DITHER_FREQUENCY)),
            (ScaleFactorWarmUp(), (-5 * PPM / (1 - exp(-HOUR / RLG_WARM_UP)), RLG_WARM_UP)),
            (ScaleFactorTemperature(), (0.1 * PPM,)),
        ],
        100.0,
        "Aronowitz, in RTO AGARDograph 339 (1999): random walk of a dithered gyro; as the rate-biased one otherwise; "
        "dither of 100 deg/s at 413 Hz, of which 0.01 % stays in the reading, assumed",
        RLG_PULSE,
    )


def dither_random_walk(lock_in: float, fringe: float, dither_rate: float) -> float:
    r"""Angle random walk N [rad/sqrt(s)] of a ring-laser gyro with a randomised sinusoidal dither.

        N = W_L sqrt(K / (2 pi W_D))

    The beat phase psi' = (2 pi / K) (W - W_L sin psi) rushes by but where the rate passes zero, twice in a period of
    the dither. There W = W' t, and to first order in W_L the angle is kicked by the integral of -W_L sin(psi_0 + (pi /
    K) W' t^2), which is W_L sqrt(K / |W'|) sin(psi_0 +- pi/4), of variance W_L^2 K / (2 |W'|) where psi_0 is random
    from one time to the next. With W' = 2 pi f W_D and 2 f kicks in a second f drops out. Source: F. Aronowitz,
    Fundamentals of the ring laser gyro, in RTO AGARDograph 339 (1999).

    Parameters
    ----------
    lock_in : float
        Threshold W_L [rad/s].
    fringe : float
        Angle K for one period of the beat [rad]: the weight of a pulse where each fringe is counted once.
    dither_rate : float
        Amplitude W_D of the dither's rate [rad/s].
    """
    return float(lock_in * sqrt(fringe / (2 * pi * dither_rate)))


def fog_b215(target: str = "gyro", lock: bool = False) -> Instrument:
    """Closed-loop fibre-optic gyro like the B-215: quantised angle, a local fault at 20 deg/s.

    The fault is a bump, or with ``lock`` that of a loop which is pulled to a rate near it. An error of the 2 pi reset,
    where the sample of the reset is blanked, is an error of the scale factor: it is zero here.
    """
    fault: tuple[Effect, tuple[float, ...]] = (ScaleFactorAnomaly(), (0.033718 * DEG, 20 * DEG, 0.22 * DEG))
    if lock:
        fault = RateLock(), ((0.0345 * DEG) ** 2, 20.033718 * DEG)
    return _instrument(
        "fibre-optic gyro like the B-215",
        target,
        [
            *_fog_noise(0.12, 0.35, 0.15),
            (Quantization(), (0.35 * ARCSEC,)),
            (ScaleFactor(), (0.0,)),
            (ScaleFactorAsymmetry(), (15 * PPM,)),
            fault,
            (BiasWarmUp(), (-2.5 * 0.35 * DEG_PER_HOUR, 900.0)),
            *_fog_temperature(),
        ],
        2000.0,
        "Zhang, DOI 10.11857/j.issn.1674-5124.2016.12.001: fault at 20 deg/s from the printed nonlinearity; "
        "noise, asymmetry, warm-up and what the temperature does assumed so that its other results come out",
    )


def fog_kvh13(target: str = "gyro") -> Instrument:
    """Open-loop fibre-optic gyro like the KVH-13: what is left of the sine response, long warm-up."""
    return _instrument(
        "fibre-optic gyro like the KVH-13",
        target,
        [
            *_fog_noise(0.067, 0.35, 0.08),
            (ScaleFactor(), (0.0,)),
            (ScaleFactorAsymmetry(), (4 * PPM,)),
            (SineResponse(), (0.001, 0.253)),
            (CompensationRipple(), (0.09 * DEG, 15.0, 375 * DEG)),
            (BiasWarmUp(), (-14 * 1.8 * DEG_PER_HOUR, 2400.0)),
            *_fog_temperature(),
        ],
        100.0,
        "Zhang, DOI 10.11857/j.issn.1674-5124.2016.12.001; angle random walk and range of the maker's inertial unit, "
        "the rest assumed",
    )


def _fog_temperature() -> list[tuple[Effect, tuple[float, ...]]]:
    """Shupe effect, and the wavelength of the source over temperature."""
    return [
        (BiasTemperatureRate(), (20 * DEG_PER_HOUR,)),
        (ScaleFactorTemperature(), (1 * PPM,)),
    ]


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
    name: str,
    target: str,
    chain: Sequence[tuple[Effect, tuple[float, ...]]],
    rate: float,
    source: str,
    pulse: float = 0.0,
) -> Instrument:
    sensor = Sensor(target, tuple(effect for effect, _ in chain))
    return Instrument(name, sensor, sensor.theta([values for _, values in chain]), rate, source, pulse)
