r"""The table rate and the directions that tell most of north, for the instrument at hand.

For each rate, plan and tilt the motion is predicted with the table's acceleration, the regressors of

    earth_rate + scale-factor polynomial + bias + encoder_harmonic:1..4

are taken on its steady stretches, and their Fisher information gives the least standard deviation of the azimuth
(`insenv.design`). The angle random walk is enlarged by the density of the drifts at one cycle per turn; pulses and
encoder are a white angle error; what the datasheet declares with a deviation enters as a prior. So a slow rate pays
for the drift of the lock-in threshold (as W^-2), a fast one in one direction for the encoder's 1/rev (as W), and every
reversal for its dead time 2 W / a.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimators.north_gls import FREE_SD, KNOWN_SD
from estimators.rate_policies import Clockwork
from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.recording import Mounting
from insenv.core.units import ARCSEC, DEG
from insenv.design.information import IncrementNoise, Information, information, north_bound
from insenv.design.polynomial import BiasPolynomial, ScaleFactorPolynomial
from insenv.design.rate_noise import density, white_angle
from insenv.design.table_motion import Course, back_and_forth, motion, steady
from insenv.effects.angle import EarthRate, EncoderHarmonic

#: Rates that are tried [rad/s], as far as the table has them.
RATES = tuple(rate * DEG for rate in (2, 3, 5, 7.5, 10, 15, 20, 30, 45, 60, 100))
#: Reversals that are tried: none, one (both ways), three.
REVERSALS = (0, 1, 3)
#: Largest turn and largest number of a prediction's intervals.
_TURN, _MOST = 0.25, 1200
_ORDERS = (1, 2, 3, 4)


@dataclass(frozen=True)
class Candidate:
    """One way to run the table.

    Attributes
    ----------
    rate, tilt : float
        [rad/s], [rad]
    reversals : int
        0: one direction.
    sd : float
        Least standard deviation of the azimuth, root mean square over azimuths [rad]; infinite where nothing is told.
    """

    rate: float
    tilt: float
    reversals: int
    sd: float

    def __str__(self) -> str:
        ways = {0: "one way", 1: "both ways"}.get(self.reversals, f"{self.reversals} reversals")
        return f"{self.rate / DEG:g} deg/s, tilt {self.tilt / DEG:g} deg, {ways}: {self.sd / ARCSEC:.2f} arcsec"


@dataclass(frozen=True)
class Plan:
    """The best candidate with its course, and all of them, best first."""

    best: Candidate
    course: Course
    candidates: tuple[Candidate, ...]

    @property
    def rate(self) -> float:
        """Table rate [rad/s]."""
        return self.best.rate

    @property
    def tilt(self) -> float:
        """Of the input axis above the table plane [rad]."""
        return self.best.tilt

    @property
    def reversals(self) -> int:
        """Of the table."""
        return self.best.reversals

    @property
    def sd(self) -> float:
        """Expected standard deviation of the azimuth [rad]."""
        return self.best.sd


class RateChoice(Clockwork):
    """A policy that follows the best plan at the tilt that the instrument is mounted with.

    Parameters
    ----------
    datasheet : Datasheet
    rates : sequence of float
        That are tried [rad/s].
    reversals : sequence of int
        Numbers of reversals that are tried.

    Raises
    ------
    InputError
        As `plan`.
    """

    def __init__(
        self, datasheet: Datasheet, rates: Sequence[float] = RATES, reversals: Sequence[int] = REVERSALS
    ) -> None:
        self.plan = plan(datasheet, rates=rates, reversals=reversals)
        super().__init__(self.plan.course, datasheet.duration, datasheet.sampling)


def plan(
    datasheet: Datasheet,
    tilts: Sequence[float] | None = None,
    rates: Sequence[float] = RATES,
    reversals: Sequence[int] = REVERSALS,
) -> Plan:
    """Compare all candidates.

    Parameters
    ----------
    datasheet : Datasheet
    tilts : sequence of float, optional
        At which the instrument may be mounted [rad]; default: as it is.
    rates, reversals : sequences
        As of `RateChoice`.

    Raises
    ------
    InputError
        Without a latitude or a finite duration, or if the table has none of the rates.
    """
    if datasheet.site.latitude is None or not 0 < datasheet.duration < np.inf:
        raise InputError("rate_choice: the datasheet has no latitude or no finite duration; wanted both")
    able = [rate for rate in rates if 0 < abs(rate) <= datasheet.limits.rate * (1 + 1e-9)]
    if not able or not reversals:
        raise InputError(
            f"rate_choice: the table reaches {datasheet.limits.rate / DEG:g} deg/s and has none of the rates; "
            "wanted at least one rate and one number of reversals"
        )
    found = []
    for tilt in (datasheet.mounting.tilt,) if tilts is None else tilts:
        mounted = replace(datasheet, mounting=Mounting(tilt, datasheet.mounting.axes))
        found += [Candidate(w, tilt, r, expected_sd(mounted, w, r)) for w in able for r in reversals]
    # Of equal candidates (nothing is told by any) the first that was asked for.
    ranked = tuple(sorted(found, key=lambda candidate: candidate.sd))
    return Plan(ranked[0], _course(datasheet, ranked[0].rate, ranked[0].reversals), ranked)


def expected_sd(datasheet: Datasheet, rate: float, reversals: int = 0, degree: int = 2) -> float:
    """Least standard deviation of the azimuth [rad], as the datasheet is mounted.

    Parameters
    ----------
    datasheet : Datasheet
    rate : float
        [rad/s]
    reversals : int
    degree : int
        Of the scale factor's polynomial.
    """
    latitude, tilt = datasheet.site.latitude, datasheet.mounting.tilt
    assert latitude is not None
    course, n = _course(datasheet, rate, reversals), _intervals(datasheet.duration, rate)
    exposure = motion(
        course,
        np.linspace(0.0, datasheet.duration, n + 1),
        tilt,
        latitude,
        datasheet.limits.acceleration,
    )
    drift = float(density(datasheet, np.array(rate), exposure.projection))
    walk = float(np.hypot(datasheet.coefficient("gyro", "angle_random_walk"), np.sqrt(drift)))
    samples = max(datasheet.duration * datasheet.sampling / n, 1.0)
    noise = IncrementNoise(walk, white_angle(datasheet) / samples**0.5)
    effects = (
        EarthRate(),
        ScaleFactorPolynomial(degree, datasheet.duration),
        BiasPolynomial(0, datasheet.duration),
        *map(EncoderHarmonic, _ORDERS),
    )
    told = information(exposure, effects, noise, stretches=steady(exposure))
    return north_bound(_with_priors(told, datasheet).bound(), EARTH_RATE * float(np.cos(latitude) * np.cos(tilt)))


def _with_priors(told: Information, datasheet: Datasheet) -> Information:
    """Information with what is declared: an encoder that nothing is said of has no 1/rev, as in `NorthGls`."""
    sd = {name: 1e-2 for name in told.names if name.startswith("scale_factor")}
    sd |= {name: 1e-4 for name in told.names if name.startswith("bias")}
    for order in _ORDERS:
        declared = datasheet.told(f"encoder_harmonic:{order}", "gyro")
        silent = KNOWN_SD if order == 1 else FREE_SD
        values = 2 * (silent,) if declared is None else declared.sd
        for name, value in zip("cs", values, strict=True):
            sd[f"encoder_harmonic:{order}.{name}"] = 0.0 if value <= KNOWN_SD else value
    return told.given(sd)


def _course(datasheet: Datasheet, rate: float, reversals: int) -> Course:
    return back_and_forth(rate, datasheet.duration, reversals, datasheet.limits.acceleration)


def _intervals(duration: float, rate: float) -> int:
    """Intervals of a prediction: short enough for the turn, few enough to be quick."""
    return int(np.clip(np.ceil(duration * abs(rate) / _TURN), 120, _MOST))
