r"""What a frame of the two-position calibration shows.

An error of the attitude, a bias or a misalignment gives a base at rest the velocities

    v_j(t) = a_0j + a_1j t + a_2j t^2 + a_3j t^3,     j = east, north

of a static mechanisation. The residual of a rest is what its cubic leaves: noise, sway, and whatever is undeclared.
Source: Guo, Li and He (2018), equation 5, with a constant for the velocity at the start of a rest.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from insenv.core.recording import Floats

#: Coefficients of a rest's polynomial; shorter rests leave no residual.
_TERMS = 4

_NOTHING: Floats = np.zeros(0)
_PAIRS: Floats = np.zeros((0, 2))


@dataclass(frozen=True)
class History:
    """What the strip charts show, one value for each step of the run so far.

    Attributes
    ----------
    time : ndarray, shape (k,)
        End of the step [s].
    turning : ndarray, shape (k,)
        1 where the vehicle turned in the step, else 0.
    velocity : ndarray, shape (k, 2)
        East and north by a static mechanisation at that time [m/s].
    installation : ndarray, shape (k, 2), or empty
        Mean and standard deviation of the believed installation angle [rad]; empty: there is no estimator.
    """

    time: Floats = field(default_factory=lambda: _NOTHING)
    turning: Floats = field(default_factory=lambda: _NOTHING)
    velocity: Floats = field(default_factory=lambda: _PAIRS)
    installation: Floats = field(default_factory=lambda: _PAIRS)

    def then(
        self, time: float, turning: bool, velocity: Floats, installation: tuple[float, float] | None = None
    ) -> History:
        """The history with one step more; ``velocity`` of shape (2,)."""
        believed = self.installation
        if installation is not None:
            believed = np.concatenate([believed, np.array([installation])])
        return History(
            np.append(self.time, time),
            np.append(self.turning, float(turning)),
            np.concatenate([self.velocity, velocity[None]]),
            believed,
        )


@dataclass(frozen=True)
class View:
    """One frame.

    Attributes
    ----------
    time, duration : float
        Since the start of the episode, and its length at most [s].
    heading : float
        True one of the body, clockwise from north [rad].
    turned : float
        Since the start, counter-clockwise seen from above [rad].
    rate : float
        Of the turn, counter-clockwise positive [rad/s]; 0: at rest.
    installation : float
        True installation angle, of the sight against the body, clockwise [rad].
    believed_heading : (float, float) or None
        Mean and standard deviation [rad]; None: nothing is believed.
    believed_installation : (float, float) or None
        Mean and standard deviation [rad]; None: there is no estimator.
    sighting : float or None
        What the sight read last [rad].
    history : History
    title : str
        Of the scenario.
    demanded : float or None
        Standard deviation of the installation angle that is wanted [rad].
    """

    time: float
    duration: float
    heading: float
    turned: float
    rate: float
    installation: float
    believed_heading: tuple[float, float] | None = None
    believed_installation: tuple[float, float] | None = None
    sighting: float | None = None
    history: History = field(default_factory=History)
    title: str = ""
    demanded: float | None = None


def residual(time: Floats, turning: Floats, velocity: Floats) -> Floats:
    """What the cubic of each rest leaves of the velocities, shape (k, 2) [m/s]; NaN in turns and very short rests.

    Parameters
    ----------
    time : ndarray, shape (k,)
    turning : ndarray, shape (k,)
        Not zero where the vehicle turns: what lies between is a rest.
    velocity : ndarray, shape (k, 2)
    """
    left: Floats = np.full(velocity.shape, np.nan)
    edges = np.flatnonzero(np.diff(np.concatenate([[1.0], turning, [1.0]]) != 0))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if last - first > _TERMS:
            t = _scaled(time[first:last])
            powers = t[:, None] ** np.arange(_TERMS)
            fitted = np.linalg.lstsq(powers, velocity[first:last], rcond=None)[0]
            left[first:last] = velocity[first:last] - powers @ fitted
    return left


def _scaled(time: Floats) -> Floats:
    """Times onto [-1, 1], where powers are well apart."""
    middle, half = 0.5 * (time[0] + time[-1]), 0.5 * (time[-1] - time[0])
    return (time - middle) / half
