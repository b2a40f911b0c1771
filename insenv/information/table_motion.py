"""The motion that a rate table will make of a sequence of commanded rates.

Between knots the table accelerates evenly, so with the rate r_k at the knot t_k and the acceleration a_k

    rate r_k + a_k s,   angle b_k + r_k s + a_k s^2 / 2,   s = t - t_k.

A prediction for design only: without ripple, encoder or temperature. (What plants do is not visible from here:
estimators, which may not see the simulator, plan with this.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.motion import Motion
from insenv.core.recording import Floats

#: A table without a limit of acceleration is taken to need no more than this for any change of rate [s].
_AT_ONCE = 1e-6


@dataclass(frozen=True)
class Course:
    """Rates in the order of their commands: ``at`` [s] the time of each, ``rate`` [rad/s]; at rest before."""

    at: tuple[float, ...]
    rate: tuple[float, ...]

    def command(self, t: float) -> float:
        """Rate asked for at a time [rad/s]; before the first command zero."""
        k = int(np.searchsorted(self.at, t, side="right")) - 1
        return self.rate[k] if k >= 0 else 0.0


def one_way(rate: float) -> Course:
    """One rate [rad/s] all the time."""
    return Course((0.0,), (rate,))


def back_and_forth(rate: float, duration: float, reversals: int, acceleration: float = np.inf) -> Course:
    """``reversals`` + 1 stretches of steady turning of the same length, in alternating sense.

    The table needs w / a to start and 2 w / a to turn over; what is left of the duration is shared evenly.

    Parameters
    ----------
    rate : float
        [rad/s]
    duration : float
        [s]
    reversals : int
    acceleration : float
        Of the table [rad/s^2].
    """
    start = abs(rate) / acceleration
    steady = max(duration - start * (1 + 2 * reversals), 0.0) / (reversals + 1)
    times = [0.0, *(start + k * steady + (k - 1) * 2 * start for k in range(1, reversals + 1))]
    return Course(tuple(times), tuple(rate * (-1.0) ** k for k in range(reversals + 1)))


def motion(course: Course, t: Floats, tilt: float, latitude: float, acceleration: float = np.inf) -> Motion:
    """Exposure of the gyro on a table that starts at rest at its zero mark.

    Parameters
    ----------
    course : Course
    t : ndarray, shape (n + 1,)
        Edges of the intervals, evenly spaced [s].
    tilt, latitude : float
        Of the input axis above the table plane, and of the site [rad].
    acceleration : float
        [rad/s^2]
    """
    knots, rates = _knots(course, acceleration)
    lengths, means = np.diff(knots), 0.5 * (rates[1:] + rates[:-1])
    angles = np.concatenate([[0.0], np.cumsum(lengths * means)])
    slopes = np.append(np.diff(rates) / lengths, 0.0)
    k = np.maximum(np.searchsorted(knots, t, side="right") - 1, 0)
    s = t - knots[k]
    angle = angles[k] + s * (rates[k] + 0.5 * slopes[k] * s)
    share = float(np.sin(tilt))
    vertical = EARTH_RATE * float(np.sin(latitude)) * share
    dt = float(t[-1] - t[0]) / (len(t) - 1)
    return Motion(
        t=t,
        rate=np.diff(angle) * (share / dt) + vertical,
        angle=angle,
        rate_edges=(rates[k] + slopes[k] * s) * share + vertical,
        projection=share,
    )


def steady(motion: Motion, tolerance: float = 2e-3) -> tuple[slice, ...]:
    """Stretches of intervals on which the table turns, and its rate changes by less than ``tolerance`` of it."""
    assert motion.rate_edges is not None
    edges, peak = motion.rate_edges, float(np.abs(motion.rate_edges).max(initial=0.0))
    slower = np.minimum(np.abs(edges[1:]), np.abs(edges[:-1]))
    even = (np.abs(np.diff(edges)) <= tolerance * slower) & (slower > 1e-3 * peak)
    even &= np.abs(motion.rate - 0.5 * (edges[1:] + edges[:-1])) <= tolerance * slower
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], even, [False]]).astype(np.int8)))
    return tuple(slice(int(a), int(b)) for a, b in zip(bounds[::2], bounds[1::2], strict=True))


def _knots(course: Course, acceleration: float) -> tuple[Floats, Floats]:
    """Times and rates between which the table accelerates evenly; the last rate is held for ever."""
    knots, rates = [0.0], [0.0]
    for k, (at, wanted) in enumerate(zip(course.at, course.rate, strict=True)):
        until = course.at[k + 1] if k + 1 < len(course.at) else np.inf
        if at > knots[-1]:
            knots.append(at)
            rates.append(rates[-1])
        need = max(abs(wanted - rates[-1]) / acceleration, _AT_ONCE)
        time = min(need, until - at)  # a command that comes too early finds the table still changing
        rates.append(rates[-1] + (wanted - rates[-1]) * time / need)
        knots.append(at + time)
    return np.array(knots), np.array(rates)
