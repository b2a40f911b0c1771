r"""How a table of several axes goes from position to position.

The axes turn one after the other, the outer first, each from rest to rest: even acceleration, even rate, even
deceleration, with s the time since the turn's begin,

    theta(s) = p s^2 / (2 r) (s < r),   p (s - r / 2),   A - p (T - s)^2 / (2 r) (s > T - r),     p = A / (T - r),

and T rounded up to whole samples, so that in a sample one axis turns at most.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from insenv.core.unit.gimbals import turn_time
from insenv.core.unit.rotations import Floats

#: Of a sample: what stands for rounding.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Turns:
    """Turns of the axes, one for each, of every run.

    Attributes
    ----------
    start, angle : ndarray, shape (..., k)
        Angle before, and by which the axis turns [rad].
    begin, time, ramp : ndarray, shape (..., k)
        When it begins, how long it and its acceleration take [s].
    free : ndarray, shape (...)
        When the dwell is over [s].
    commands : ndarray, shape (...)
        Carried out so far.
    """

    start: Floats
    angle: Floats
    begin: Floats
    time: Floats
    ramp: Floats
    free: Floats
    commands: Floats

    def at(self, t: Floats) -> tuple[Floats, Floats]:
        """Angles [rad] and rates [rad/s] at times of shape (n,), each of shape (..., k, n)."""
        from insenv.core.unit.turns_kernel import at  # Numba where an axis turns

        given = [np.ravel(v) for v in (self.begin, self.time, self.ramp, self.start, self.angle)]
        out = np.empty((2, len(given[0]), len(t)))
        at(np.ascontiguousarray(t), *given, out)
        angles, rates = out.reshape(2, *self.start.shape, len(t))
        return angles, rates

    def moving(self, t: Floats) -> Floats:
        """1 on the intervals with edges ``t`` on which an axis turns, else 0, shape (..., n)."""
        begin, end = self.begin[..., None], (self.begin + self.time)[..., None]
        slack = _ROUNDING * (t[1] - t[0])
        turns = (begin < t[1:] - slack) & (end > t[:-1] + slack) & (self.angle[..., None] != 0)
        flags: Floats = turns.any(axis=-2).astype(float)
        return flags


def at_rest(angles: Floats) -> Turns:
    """At rest at these angles, shape (..., k), and free."""
    axes, runs = np.zeros(np.shape(angles)), np.zeros(np.shape(angles)[:-1])
    return Turns(np.asarray(angles, float), axes, axes, axes, axes, runs, runs)


def turned(state: Turns, angles: Floats, rate: Floats, dwell: Floats, acceleration: float, t: Floats) -> Turns:
    """The turns to another position, where a run is free to take it.

    Parameters
    ----------
    state : Turns
    angles : ndarray, shape (..., k)
        [rad]
    rate, dwell : ndarray, shape (...)
        Largest rate [rad/s], and rest at the position [s].
    acceleration : float
        [rad/s^2]
    t : ndarray, shape (n + 1,)
        Edges of the samples; the turns begin with the first.
    """
    dt = (t[-1] - t[0]) / (len(t) - 1)
    taken = state.free <= t[0] + _ROUNDING * dt
    if not np.any(taken):
        return state
    now = state.start + state.angle
    angle, most = angles - now, np.asarray(rate)[..., None]
    time = turn_time(angle, most, acceleration)
    peak = np.minimum(most, np.sqrt(np.abs(angle) * acceleration))
    whole = dt * np.ceil(time / dt - _ROUNDING)
    ramp = peak / acceleration * np.divide(whole, time, out=np.ones_like(time), where=time > 0)
    end = t[0] + np.cumsum(whole, axis=-1)
    begun = Turns(now, angle, end - whole, whole, ramp, end[..., -1] + dwell, state.commands + 1.0)
    found = {}
    for f in fields(Turns):
        before = getattr(state, f.name)
        found[f.name] = np.where(
            taken[..., None] if before.ndim > taken.ndim else taken, getattr(begun, f.name), before
        )
    return Turns(**found)
