r"""The fitted horizontal Earth rate against the one that latitude and tilt make.

    (c, s) = level (cos az, sin az),        level = W_E cos(latitude) |cos(tilt)|

The azimuth az of the input axis is not known, the magnitude is. An effect that repeats with the table's angle just as
the Earth rate does (the encoder's first harmonic at one rate in one direction; a rate locked to the table always)
leaves no residual: it goes into c and s, and the part of it that lies along (c, s) changes their magnitude,

    z = (|(c, s)| - level) / sqrt(n' C n + sd(level)^2),        n = (c, s) / |(c, s)|.

The part across n turns (c, s) and stays hidden: `insenv.identify.earth.hidden`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtr

from insenv.core.earth import EARTH_RATE
from insenv.core.recording import Floats, Recording
from insenv.effects.angle import LEAST_SHARE, EarthRate
from insenv.effects.rate.scale import ScaleFactor
from insenv.identify.fit.gls import Fit, noise_freedom, spectrum
from insenv.identify.fit.problem import Design, Problem

#: Standard deviations with which latitude and tilt of a manifest are taken as known [rad]: 0.01 and 0.02 degrees.
LATITUDE_SD = np.deg2rad(0.01)
TILT_SD = np.deg2rad(0.02)
#: The level must exceed its own standard deviation this many times, and that of the fitted rate `LEAST_SIGNAL` times:
#: below, there is no horizontal part worth the name, and the magnitude of a vector of noise is no normal variate.
LEAST_LEVEL = 10.0
LEAST_SIGNAL = 5.0
#: Standard deviation of an angle of which nothing is known [rad].
ANY_ANGLE = np.pi / np.sqrt(3)


@dataclass(frozen=True)
class Level:
    """Magnitude of the horizontal Earth rate that latitude and tilt make, with its standard deviation [rad/s]."""

    value: float
    sd: float
    latitude: float
    tilt: float


@dataclass(frozen=True)
class Horizontal:
    """The fitted horizontal Earth rate: ``theta`` = (c, s) [rad/s], shape (2,), and its covariance, shape (2, 2)."""

    theta: Floats
    cov: Floats

    @property
    def magnitude(self) -> float:
        """Length of ``theta`` [rad/s]."""
        return float(np.hypot(*self.theta))

    @property
    def along(self) -> Floats:
        """Unit vector along ``theta``, shape (2,)."""
        return self.theta / max(self.magnitude, 1e-300)

    @property
    def across(self) -> Floats:
        """Unit vector across it, to growing azimuth, shape (2,)."""
        return np.array([-self.along[1], self.along[0]])

    @property
    def azimuth(self) -> float:
        """Azimuth of the input axis at table angle 0 [rad]."""
        return float(np.arctan2(self.theta[1], self.theta[0]))

    @property
    def azimuth_sd(self) -> float:
        """Standard deviation of ``azimuth`` [rad], that of an unknown angle at most."""
        sd = np.sqrt(self.across @ self.cov @ self.across) / max(self.magnitude, 1e-300)
        return float(min(sd, ANY_ANGLE))


@dataclass(frozen=True)
class Check:
    """The fitted magnitude against the one that is due.

    ``departure`` [rad/s] has the standard deviation ``sd``, of which ``noise_sd`` is noise; ``p_value`` is that of the
    whole search.
    """

    level: Level
    earth: Horizontal
    departure: float
    sd: float
    noise_sd: float
    p_value: float

    @property
    def deviate(self) -> float:
        """Departure in standard deviations."""
        return self.departure / self.sd

    @property
    def latitude(self) -> float:
        """Latitude that would make the fitted magnitude [rad]; NaN where none would."""
        return self._instead(self.level.latitude)

    @property
    def tilt(self) -> float:
        """Tilt that would make the fitted magnitude [rad]; NaN where none would."""
        return self._instead(self.level.tilt)

    def _instead(self, angle: float) -> float:
        """The angle of the same sign whose cosine is larger by the ratio of the magnitudes."""
        cosine = float(np.cos(angle)) * (1 + self.departure / self.level.value)
        return float(np.copysign(np.arccos(cosine), angle)) if abs(cosine) <= 1 else float("nan")


def due_level(recordings: tuple[Recording, ...]) -> Level | None:
    """The level of the first run that sees one by latitude and tilt, others see their shares of it; None of none."""
    places = [(r.site.latitude, r.mounting.tilt) for r in recordings]
    latitude, tilt = next((place for place in places if abs(np.cos(place[1])) > LEAST_SHARE), places[0])
    if latitude is None:
        return None
    value = float(EARTH_RATE * np.cos(latitude) * abs(np.cos(tilt)))
    sd = EARTH_RATE * np.hypot(
        np.sin(latitude) * np.cos(tilt) * LATITUDE_SD,
        np.cos(latitude) * np.sin(tilt) * TILT_SD,
    )
    return Level(value, float(sd), latitude, tilt) if value > LEAST_LEVEL * sd else None


def horizontal(problem: Problem, fit: Fit) -> Horizontal | None:
    """The horizontal Earth rate of a fit; None where the model has none or the recording does not tell both parts."""
    places = earth_places(fit.design)
    if len(places) != 2:
        return None
    return _inflated(problem, fit, Horizontal(fit.theta[places], covariance(fit.design, fit.cov, places)))


def check(problem: Problem, fit: Fit, level: Level | None, family: int) -> Check | None:
    """The magnitude of the fitted horizontal Earth rate against ``level``; None where it cannot be judged.

    ``family`` is the number of tests of the whole search, this one included.
    """
    earth = None if level is None else horizontal(problem, fit)
    if level is None or earth is None:
        return None
    noise = float(np.sqrt(np.linalg.eigvalsh(earth.cov)[-1]))
    sd_level = float(np.hypot(level.sd, level.value * _scale_error(problem, fit)))
    if level.value < LEAST_SIGNAL * max(noise, sd_level):
        return None
    # Noise across n makes the vector longer on average.
    longer = float(earth.across @ earth.cov @ earth.across) / (2 * earth.magnitude)
    departure = earth.magnitude - longer - level.value
    noise_sd = float(np.sqrt(earth.along @ earth.cov @ earth.along))
    sd = float(np.hypot(noise_sd, sd_level))
    p = 2 * float(stdtr(_freedom(problem, fit), -abs(departure) / sd))
    return Check(replace(level, sd=sd_level), earth, departure, sd, noise_sd, min(1.0, p * family))


def earth_places(design: Design) -> list[int]:
    """Columns of the Earth rate, cosine first."""
    return [j for j, label in enumerate(design.labels) if label[0] == EarthRate.id]


def covariance(design: Design, cov: Floats, places: Sequence[int]) -> Floats:
    """Covariance of some of the coefficients, SI."""
    scale = design.scale[list(places)]
    return cov[np.ix_(places, places)] / np.outer(scale, scale)


def _inflated(problem: Problem, fit: Fit, earth: Horizontal) -> Horizontal:
    """With the variance of Student's t, because the noise is fitted too."""
    freedom = max(_freedom(problem, fit), 4.0)
    return replace(earth, cov=earth.cov * freedom / (freedom - 2))


def _freedom(problem: Problem, fit: Fit) -> float:
    """Degrees of freedom with which the noise is known where the Earth rate lives."""
    columns = fit.design.transformed[:, earth_places(fit.design)]
    energy = np.sum(columns**2, axis=1) / spectrum(problem, fit.noise.power)
    return noise_freedom(problem, fit.noise.power, energy)


def _scale_error(problem: Problem, fit: Fit) -> float:
    """Share by which the instrument's scale may be off: it multiplies the Earth rate too.

    The fitted scale factor where there is one. At a single rate it cannot be told from the bias: then all that the
    model has beside the Earth rate, as a share of the input rate.
    """
    places = [j for j, label in enumerate(fit.design.labels) if label[0] == ScaleFactor.id]
    if places:
        return float(np.hypot(fit.theta[places[0]], fit.sd[places[0]]))
    beta = fit.beta.copy()
    beta[earth_places(fit.design)] = 0.0
    rest = fit.design.matrix @ (beta * (fit.design.term >= 0))
    rate = problem.bins.mean(tuple(e.u for e in problem.exposures))
    return float(np.sqrt(np.mean(rest**2) / np.maximum(np.mean(rate**2), 1e-300)))
