r"""Sway of a vehicle as a sum of sines about one axis, and what settles after a turn.

    theta(t) = sum_i A_i sin(w_i t + p_i)

A line of rms value R has A = sqrt(2) R and a phase that is uniform. Noise of rms value R between two frequencies is
`LINES` sines, one at a random place of each of as many equal parts of the band, with Gaussian coefficients of sine and
cosine of variance R^2 / LINES: Gaussian itself, and of the same spectrum run after run (Shinozuka and Jan, J. Sound
Vib. 25 (1972) 111). A sum of sines is known at any time, so that a run may be cut anywhere and its derivatives are
exact. Wind moves a vehicle at about 1.5 Hz, an engine at about 25 Hz.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats

#: Sines that stand for a band of noise.
LINES = 24


@dataclass(frozen=True)
class SwayLine:
    """A sine of ``frequency`` [Hz] and ``rms`` value [rad]."""

    frequency: float
    rms: float


@dataclass(frozen=True)
class Band:
    """Noise from ``low`` to ``high`` [Hz] of ``rms`` value [rad]."""

    low: float
    high: float
    rms: float


@dataclass(frozen=True)
class Sway:
    """Sway about a roll centre.

    Attributes
    ----------
    arm : tuple of float
        From the roll centre to the instruments, along the vehicle's right, forward, up [m].
    axis : float
        Azimuth of the axis in the vehicle, clockwise from forward [rad]: 0 is roll, pi / 2 pitch.
    waves : ndarray, shape (..., L, 3)
        Amplitude [rad], angular frequency [rad/s] and phase [rad] of each sine.
    fastest : float
        No sine of any run is faster [Hz].
    """

    arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: float = 0.0
    waves: Floats | None = None

    fastest: float = 0.0

    def __post_init__(self) -> None:
        if self.waves is not None and self.waves.size:
            found = float(self.waves[..., 1].max() / (2 * np.pi))
            if found > self.fastest * (1 + 1e-9):
                raise InputError(f"a sway of {found:g} Hz was given as at most {self.fastest:g} Hz; wanted the highest")


@dataclass(frozen=True)
class Settling:
    """A velocity forward that a turn ends with and that fades: ``velocity`` [m/s], ``time_constant`` [s].

    Creep by a distance d is a velocity of d / time_constant.
    """

    velocity: float = 0.0
    time_constant: float = 1.0


def highest(lines: Sequence[SwayLine], band: Band | None) -> float:
    """Highest frequency of a sway [Hz]."""
    return max([line.frequency for line in lines] + ([] if band is None else [band.high]), default=0.0)


def waves(lines: Sequence[SwayLine], band: Band | None, draw: np.random.Generator | None = None) -> Floats:
    """The sines of a sway, shape (L, 3); without ``draw`` phases are zero, and a band has its mean amplitudes."""
    phases = np.zeros(len(lines)) if draw is None else draw.uniform(0.0, 2 * np.pi, len(lines))
    found = [
        (np.sqrt(2) * line.rms, 2 * np.pi * line.frequency, phase) for line, phase in zip(lines, phases, strict=True)
    ]
    if band is not None:
        place = np.full(LINES, 0.5) if draw is None else draw.random(LINES)
        frequency = band.low + (band.high - band.low) * (np.arange(LINES) + place) / LINES
        sine, cosine = np.ones((2, LINES)) if draw is None else draw.standard_normal((2, LINES))
        amplitude = band.rms / np.sqrt(LINES) * np.hypot(sine, cosine)
        found += list(zip(amplitude, 2 * np.pi * frequency, np.arctan2(cosine, sine), strict=True))
    return np.array(found, float).reshape(-1, 3)
