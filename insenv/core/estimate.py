"""What an estimator and a policy are, and what they are told.

    state_{k+1} = update(state_k, chunk_k)        (m, P) = estimate(state_k)

A plug-in is a class whose first argument is a `Datasheet`, all that is known before anything is measured. It
holds settings only: what it learns stands in a state that goes in and comes out. The arrays of a state, of a
chunk and of an estimate have the batch of runs in front; a single run has no batch axis. How a record is cut
into chunks makes no difference.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from insenv.core.filing import Filing
from insenv.core.recording import Floats, Mounting, Recording, Site
from insenv.core.series.allan import FLICKER, QUANTIZATION, WALK, WHITE


@dataclass(frozen=True)
class Declared:
    """An effect that the maker or an earlier calibration tells of.

    Attributes
    ----------
    effect : str
        Key in the catalogue: "scale_factor_warm_up", "encoder_harmonic:1".
    target : str
        Channel that has it.
    mean, sd : tuple of float
        Value and standard deviation of each parameter, SI; a deviation of zero: the value is exact.
    """

    effect: str
    target: str
    mean: tuple[float, ...]
    sd: tuple[float, ...]


@dataclass(frozen=True)
class Limits:
    """What a rate table or a vehicle can do when it turns: rate [rad/s] and acceleration [rad/s^2]."""

    rate: float = np.inf
    acceleration: float = np.inf


@dataclass(frozen=True)
class Sight:
    """What is told of an optical sight, as standard deviations [rad].

    Attributes
    ----------
    orientation : float
        Of the target's azimuth: one error for all sightings of a run.
    tracking : float
        Of each sighting.
    installation : float
        Of the installation angle about zero, before anything is measured.
    """

    orientation: float = 0.0
    tracking: float = 0.0
    installation: float = np.inf


@dataclass(frozen=True)
class Datasheet:
    """What is known of the instruments and their set-up before anything is measured.

    Attributes
    ----------
    sampling : float
        Sampling rate [Hz].
    duration : float
        Time that there is [s].
    site : Site
    mounting : Mounting
    limits : Limits
    noise : mapping of str to mapping of str to float
        Channel to noise effect to its coefficient, SI: ``noise["gyro"]["angle_random_walk"]``.
    pulse : float
        Weight of a gyro's pulse [rad]; 0: its output is continuous.
    encoder_noise : float
        White noise of an angle reading, one standard deviation [rad].
    declared : tuple of Declared
    sight : Sight, optional
    level_sd : tuple of float
        Standard deviations of pitch and roll as they are told at the start [rad]; infinite: they are not told.
    reference_temperature : float
        Of the declared effects of temperature [K].
    """

    sampling: float
    duration: float
    site: Site = field(default_factory=Site)
    mounting: Mounting = field(default_factory=Mounting)
    limits: Limits = field(default_factory=Limits)
    noise: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    pulse: float = 0.0
    encoder_noise: float = 0.0
    declared: tuple[Declared, ...] = ()
    sight: Sight | None = None
    level_sd: tuple[float, float] = (np.inf, np.inf)
    reference_temperature: float = 298.15

    @property
    def dt(self) -> float:
        """Sampling period [s]."""
        return 1.0 / self.sampling

    def coefficient(self, target: str, noise: str) -> float:
        """Coefficient of a noise effect on a channel; zero where none is told of."""
        return self.noise.get(target, {}).get(noise, 0.0)

    def white(self, target: str) -> float:
        """Coefficient of the white noise of a channel, an angle random walk; zero where none is told of."""
        return self.coefficient(target, WHITE)

    def flicker(self, target: str) -> float:
        """Coefficient of the flicker of a channel, its bias instability; zero where none is told of."""
        return self.coefficient(target, FLICKER)

    def walk(self, target: str) -> float:
        """Coefficient of the random walk of a channel's rate; zero where none is told of."""
        return self.coefficient(target, WALK)

    def quantization(self, target: str) -> float:
        """Coefficient of the quantization of a channel; zero where none is told of."""
        return self.coefficient(target, QUANTIZATION)

    def told(self, effect: str, target: str) -> Declared | None:
        """What is told of an effect on a channel, if anything."""
        return next((d for d in self.declared if (d.effect, d.target) == (effect, target)), None)


@dataclass(frozen=True)
class Estimate:
    """Values with their covariance.

    Attributes
    ----------
    names, units : tuple of str
        Of the k quantities; angles in rad, wrapped into (-pi, pi] where they are azimuths.
    mean : ndarray, shape (..., k)
    cov : ndarray, shape (..., k, k)
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    mean: Floats
    cov: Floats

    @property
    def sd(self) -> Floats:
        """Standard deviations, shape (..., k)."""
        deviation: Floats = np.sqrt(np.diagonal(self.cov, axis1=-2, axis2=-1))
        return deviation

    def of(self, name: str) -> tuple[Floats, Floats]:
        """Value and standard deviation of one quantity, each of shape (...).

        Raises
        ------
        KeyError
            If it is not estimated.
        """
        if name not in self.names:
            raise KeyError(f"{name!r} is not estimated; there are {', '.join(self.names)}")
        j = self.names.index(name)
        return self.mean[..., j], np.sqrt(self.cov[..., j, j])


@dataclass(frozen=True)
class Estimated:
    """What an estimator makes of one run.

    Attributes
    ----------
    label : str
    rows : int
    duration : float
        [s]
    estimate : Estimate
        Shapes (k,) and (k, k).
    prior : Estimate
        What the datasheet alone tells.
    """

    label: str
    rows: int
    duration: float
    estimate: Estimate
    prior: Estimate


@dataclass(frozen=True)
class Estimation:
    """Estimates of all runs of a recording, in SI units."""

    manifest: str
    title: str
    estimator: str
    runs: tuple[Estimated, ...]
    filing: Filing = Filing()


class Estimator(Protocol):
    """Turns recordings into estimates.

    A chunk is a `Recording` whose arrays have shape (..., n): the rows since the chunk before. The first row
    of a run closes an interval whose beginning no angle is known for.
    """

    def reset(self, batch: int | None = None) -> Any:
        """State before any data, for one run (None) or ``batch`` of them."""

    def update(self, state: Any, chunk: Recording) -> Any:
        """State after a chunk."""

    def estimate(self, state: Any) -> Estimate:
        """What is known; before any data what the datasheet tells: the prior."""


class Policy(Protocol):
    """Chooses what the plant does next."""

    def reset(self, batch: int | None = None) -> Any:
        """State at the start of a run."""

    def act(self, state: Any, chunk: Recording | None, estimate: Estimate | None) -> tuple[Floats, Any]:
        """Action, shape (..., a) in the environment's units, and the state afterwards.

        ``chunk`` is what was recorded since the action before (None: nothing yet), ``estimate`` what an
        estimator makes of all of it (None: there is no estimator).
        """
