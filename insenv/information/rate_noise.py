"""Noise of a gyro on a table that turns, as its datasheet tells it.

What drifts matters to north at one frequency, once a turn. With the two-sided density S there the coefficients of
cosine and sine have the variance 2 S / T, as if N^2 were larger by S:

    rate random walk    K^2 / (2 pi f)^2         bias instability    B^2 / (2 pi f)
    lock-in that walks  the rate error -W^2 / (2 u) of W = W_L (1 + k B(t)) is a walk of K = W_L^2 k / u, u the input

Of few turns a walk leaks more or less into them than that density says: `leak`. A polynomial of the scale factor is
behind it at the end: `misfit`. Pulses are no white error of the angle: `pulses`.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.estimate import Datasheet
from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import CurveEffect, LinearEffect
from insenv.effects.catalogue import by_key
from insenv.effects.rate.lock_in import LockIn, LockInWander

#: Harmonics of a pulse's sawtooth that are followed, places on a turn, times in a run.
_HARMONICS, _PLACES, _TIMES = 12, 240, 16


def white_angle(datasheet: Datasheet) -> float:
    """White error of the residual angle at each sample, one standard deviation [rad]: pulses and encoder."""
    pulse = datasheet.pulse / 12**0.5 or datasheet.quantization("gyro")
    return float(np.hypot(pulse, np.sin(datasheet.mounting.tilt) * datasheet.encoder_noise))


def density(datasheet: Datasheet, rate: Floats, share: float) -> Floats:
    """Two-sided density of the drifts at one cycle per turn [(rad/s)^2 / Hz], for table rates [rad/s]."""
    turning = np.maximum(np.abs(rate), 1e-9)
    walk = np.full(np.shape(turning), datasheet.walk("gyro") ** 2)
    flicker = datasheet.flicker("gyro") ** 2
    locked = datasheet.told(LockInWander.id, "gyro")
    if locked is not None:
        threshold, rise, tau, wander = locked.mean
        span = datasheet.duration if 0 < datasheet.duration < np.inf else 0.0
        warm = threshold * (1 + rise * -np.expm1(-0.5 * span / tau))  # in the middle of a run
        walk = walk + (warm**2 * wander / np.maximum(turning * share, 1e-9)) ** 2
    return np.asarray(walk / turning**2 + flicker / turning)


def walk_density(datasheet: Datasheet, rate: Floats, share: float) -> Floats:
    """The part of `density` that is of random walks."""
    flicker = datasheet.flicker("gyro") ** 2 / np.maximum(np.abs(rate), 1e-9)
    return np.asarray(density(datasheet, rate, share) - flicker)


@lru_cache(maxsize=256)
def leak(turns: float, degree: int) -> float:
    """Variance that a random walk gives to cosine and sine of so many steady turns, of what its density says.

    Of least squares with a polynomial of ``degree`` beside, mean of all azimuths: sum H^2 of the running sums H of the
    weights. For many turns 2 with a constant beside, 1.2 with a parabola.
    """
    n = int(200 * max(turns, 1.0))
    x = (np.arange(n) + 0.5) / n
    a = 2 * np.pi * turns * x
    columns = np.stack([np.cos(a), np.sin(a), *np.polynomial.legendre.legvander(2 * x - 1, degree).T], axis=1)
    weights = np.linalg.pinv(columns)[:2]
    later = np.cumsum(weights[:, ::-1], axis=1)
    return float(np.mean(np.sum(later**2, axis=1)) / n * (2 * np.pi * turns) ** 2 / 2)


@lru_cache(maxsize=1024)
def misfit(present: float, degree: int, bias_degree: int) -> float:
    """Variance of what a unit random walk of the scale factor, a unit of time long, leaves at the end of its fit.

    Of least squares with a polynomial of ``degree``, and with one of ``bias_degree`` that changes its sign where the
    table turned over; ``present`` is the share of the time since then. For one way 2 / 15 with a straight line, 0.086
    with a parabola.
    """
    n = 400
    x = (np.arange(n) + 0.5) / n
    sense = np.where(x > 1 - present, 1.0, -1.0)[:, None]
    each = [np.polynomial.legendre.legvander(2 * x - 1, k) for k in (degree, bias_degree)]
    columns = np.hstack([each[0], sense * each[1]])
    left = -columns[-1] @ np.linalg.pinv(columns)
    left[-1] += 1.0
    later = np.cumsum(left[::-1])
    return float(np.mean(later**2))


def pulses(datasheet: Datasheet, rate: float) -> float:
    r"""Density of the pulses' error at one cycle a turn of a table that holds ``rate`` [rad/s], of a white error's.

    A count is floor(theta / q), whose error is a sawtooth: of its harmonics k, with the power 6 / (pi k)^2 of all, each
    runs through k x cycles from reading to reading, x = u dt / q. With the horizontal Earth rate x swings once a turn,

        x = x_0 + m cos(a - az),     error of the azimuth ~ sum e_k cos(a - az),

    and a harmonic is seen where k x is near a whole number (stationary phase), so that its density is that of k x
    there, weighed by 2 cos^2(a - az). A scale factor or bias that is told with a deviation spreads x. One where there
    is no pulse.
    """
    q, dt, tilt = datasheet.pulse, datasheet.dt, datasheet.mounting.tilt
    latitude = datasheet.site.latitude
    if not q or latitude is None or not rate:
        return 1.0
    swing = EARTH_RATE * np.cos(latitude) * np.cos(tilt) * dt / q
    x, spread = _counts(datasheet, rate * np.sin(tilt) + EARTH_RATE * np.sin(latitude) * np.sin(tilt))
    place = 2 * np.pi * (np.arange(_PLACES) + 0.5) / _PLACES
    cosine = np.cos(place)
    bend = 0.5 * swing * (rate * dt) ** 2  # how fast x turns back where it does
    total = left = 1.0
    for k in range(1, _HARMONICS + 1):
        power = 6 / (np.pi * k) ** 2
        near = k * (x[:, None] + swing * cosine)
        near = near - np.rint(near)
        width = np.hypot(np.hypot(k * spread, np.cbrt(k * bend)), k * swing * np.pi / _PLACES + 1e-6)
        width = min(width, 0.5)  # beyond, all phases are alike
        bells = sum(np.exp(-0.5 * ((near - j) / width) ** 2) for j in range(-2, 3)) / (width * np.sqrt(2 * np.pi))
        total += power * (float(np.mean(2 * cosine**2 * bells)) - 1)
        left -= power
    return total


def _counts(datasheet: Datasheet, u: float) -> tuple[Floats, float]:
    """Pulses from reading to reading at the rate ``u`` over a run as it is told, shape (n,), and their deviation."""
    duration = datasheet.duration if 0 < datasheet.duration < np.inf else 300.0
    motion = Motion(t=np.linspace(0.0, duration, _TIMES + 1), rate=np.full(_TIMES, u))
    rate, variance = motion.rate.copy(), 0.0
    for told in datasheet.declared:
        effect = by_key(told.effect)
        if told.target == "gyro" and isinstance(effect, LinearEffect | CurveEffect) and not effect.missing(motion):
            mean = np.array(told.mean)
            rate += effect.apply(motion.rate, motion, mean)[0]
            variance += float(np.mean(np.square(effect.jacobian(motion.rate, motion, mean) * told.sd).sum(axis=-1)))
    per = datasheet.dt / datasheet.pulse
    return rate * per, float(np.sqrt(variance)) * per


def lock_in(datasheet: Datasheet) -> float:
    """Square of the lock-in threshold that is told of [rad^2/s^2]; zero where none is."""
    square, wandering = datasheet.told(LockIn.id, "gyro"), datasheet.told(LockInWander.id, "gyro")
    total = 0.0 if square is None else max(square.mean[0], 0.0)
    return total if wandering is None else total + wandering.mean[0] ** 2
