r"""Least standard deviation of north from a gyro that a table turns at steady rates.

On the steady stretches of a course the regressors of

    earth_rate + scale-factor polynomial + bias + encoder_harmonic:1..4

have the Fisher information M (`insenv.information.fisher`). The angle random walk is enlarged by the density of the
drifts at one cycle per turn (`insenv.information.rate_noise`); pulses and encoder are a white angle error; what the
datasheet declares with a deviation enters as a prior. So a slow rate pays for the drift of a lock-in threshold (as
W^-2), a fast one in one direction for the encoder's 1/rev (as W), and every reversal for its dead time 2 W / a.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.recording import Floats
from insenv.effects.angle import EarthRate, EncoderHarmonic
from insenv.information.fisher import IncrementNoise, Information, information, north_bound
from insenv.information.polynomial import BIAS_SD, SCALE_SD, BiasPolynomial, ScaleFactorPolynomial
from insenv.information.rate_noise import density, white_angle
from insenv.information.table_motion import Course, motion, steady
from insenv.sensors.chain import Sensor

#: Deviation of an encoder harmonic that nothing is declared of [rad], and one that stands for none.
FREE_SD, KNOWN_SD = EncoderHarmonic().linear[0].sd, 1e-15
#: Largest turn and smallest and largest number of a prediction's intervals.
_TURN, _FEWEST, _MOST = 0.25, 120, 1200
_ORDERS = (1, 2, 3, 4)


def north_sd(datasheet: Datasheet, course: Course, duration: float, degree: int = 2) -> float:
    """Least standard deviation of the azimuth, root mean square over azimuths, as the datasheet is mounted [rad].

    Parameters
    ----------
    datasheet : Datasheet
        With a latitude.
    course : Course
    duration : float
        [s]
    degree : int
        Of the scale factor's polynomial.

    Returns
    -------
    float
        Infinite where the course tells nothing of north.

    Raises
    ------
    InputError
        Without a latitude or a finite duration.
    """
    latitude, tilt = datasheet.site.latitude, datasheet.mounting.tilt
    if latitude is None or not 0 < duration < np.inf:
        raise InputError("north: the datasheet has no latitude, or the duration is not finite; wanted both")
    rates = _rates(course, duration)
    n = int(np.clip(np.ceil(duration * rates.max(initial=0.0) / _TURN), _FEWEST, _MOST))
    exposure = motion(course, np.linspace(0.0, duration, n + 1), tilt, latitude, datasheet.limits.acceleration)
    stretches = steady(exposure)
    if not stretches or not rates.size:
        return float(np.inf)
    drift = float(np.mean(density(datasheet, rates, exposure.projection)))
    walk = float(np.hypot(datasheet.white("gyro"), np.sqrt(drift)))
    samples = max(duration * datasheet.sampling / n, 1.0)
    noise = IncrementNoise(walk, white_angle(datasheet) / samples**0.5)
    told = information(exposure, _gyro(degree, duration), noise, stretches=stretches)
    return north_bound(_with_priors(told, datasheet).bound(), EARTH_RATE * float(np.cos(latitude) * np.cos(tilt)))


@lru_cache(maxsize=8)
def _gyro(degree: int, duration: float) -> Sensor:
    """The gyro with what a course of this duration [s] tells of: a search asks for thousands of courses."""
    known = EarthRate(), ScaleFactorPolynomial(degree, duration), BiasPolynomial(0, duration)
    return Sensor("gyro", (*known, *map(EncoderHarmonic, _ORDERS)))


def _rates(course: Course, duration: float) -> Floats:
    """Magnitudes of the rates other than zero that are commanded within the time, shape (m,)."""
    at, rates = np.array(course.at), np.abs(course.rate)
    return np.asarray(rates[(at < duration) & (rates > 0)])


def _with_priors(told: Information, datasheet: Datasheet) -> Information:
    """Information with what is declared: an encoder that nothing is said of has no 1/rev."""
    sd = {name: SCALE_SD for name in told.names if name.startswith("scale_factor")}
    sd |= {name: BIAS_SD for name in told.names if name.startswith("bias")}
    for order in _ORDERS:
        declared = datasheet.told(EncoderHarmonic(order).key, "gyro")
        silent = KNOWN_SD if order == 1 else FREE_SD
        values = 2 * (silent,) if declared is None else declared.sd
        for name, value in zip("cs", values, strict=True):
            sd[f"{EncoderHarmonic(order).key}.{name}"] = 0.0 if value <= KNOWN_SD else value
    return told.given(sd)
