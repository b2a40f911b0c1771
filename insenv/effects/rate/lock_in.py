"""Lock-in: of a ring-laser gyro at rest, and of a closed-loop fibre-optic gyro at single rates.

    lock_in          f(u, W_L^2)
    lock_in_wander   f(u, W^2),    W = W_L (1 + rise (1 - exp(-t / tau)) + K B(t))
    rate_lock        f(u - u0, W_L^2) + f(u + u0, W_L^2)

    f(u, c) = sign(u) sqrt(u^2 - c) - u        where u^2 > c    (nearly -c / (2 u) at high rates)
            = -u                               within the dead zone

f is the exact mean rate of Adler's equation, psi' = w - w_L sin psi, in rates of the gyro; B is a Wiener process. The
parameter of ``lock_in`` is c = W_L^2, in which it is linear at high rates; a slightly negative c, as a fit may try,
is the same formula. The difference of the square root to u is written without cancellation: sqrt(u^2 - c) - |u| = -c
/ (sqrt(u^2 - c) + |u|). Of a threshold that moves, an interval has the mean.

A closed loop resets its phase ramp in steps of the Sagnac phase K_s u. Where a step is the share p/q of a turn the ramp
repeats after q samples, and an error of the modulator that is synchronous with it pulls the loop to that rate: with an
error k sin(2 pi q V) of the demodulated signal at the ramp V the half-width is W_L = k / K_s.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, CurveEffect, DrivenEffect, Param, central_differences
from insenv.effects.forms import decay, spread
from insenv.effects.noise import RateRandomWalk

#: Thresholds about which a search tries the curve [rad/s]: 2 deg/h to the largest credible one.
_THRESHOLDS = np.geomspace(1e-5, 0.03, 24)
_SOURCE = "F. Aronowitz, The laser gyro, in Laser Applications 1 (1971); Adler's equation"


@final
@dataclass(frozen=True)
class LockIn(CurveEffect):
    """Two counter-propagating waves that pull each other's frequency.

    Attributes
    ----------
    about : float
        Threshold W_0 [rad/s] near which the curve is linear in the fit, f(u, W_0^2) W_L^2 / W_0^2; 0: at high rates.
    """

    about: float = 0.0

    id = "lock_in"
    title = "lock-in"
    meaning = "small rates are lost at a threshold, as the coupling of a ring laser's beams makes one"
    # A lock-in rate of 3e-3 rad/s (650 deg/h) is one standard deviation; 0.03 rad/s the largest credible one.
    linear = (Param("W_L_squared", "rad^2/s^2", sd=1e-5, bound=1e-3, low=0.0),)
    source = _SOURCE
    hides = "rate"
    instruments = ("gyro",)
    of_rate = True

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Departure from the true rate, shape (..., n)."""
        return _pulled(u, theta[..., 0, None])

    def grid(self, motion: Motion) -> Floats:
        """One row without shapes, shape (1, 0), where there is any rate; no row, shape (0, 0), elsewhere."""
        return np.empty((1 if np.any(motion.rate) else 0, 0))

    def variants(self, motion: Motion) -> tuple[LockIn, ...]:
        """The effect about each of the thresholds that a table can pass through on its way from rate to rate."""
        largest = float(np.abs(motion.rate).max(initial=0.0))
        return tuple(replace(self, about=float(w)) for w in _THRESHOLDS if w < largest)

    def profile(self, u: Floats, motion: Motion, shape: Floats) -> Floats:
        """What W_L^2 = 1 adds, shape (..., n, 1), were the curve as linear as it is about `about`."""
        if not self.about:
            return super().profile(u, motion, shape)
        square = self.about**2
        return _pulled(u, np.asarray(square))[..., None] / square


@final
@dataclass(frozen=True)
class RateLock(CurveEffect):
    """A loop that is pulled to the rate u0, and alike to -u0: within W_L of it the output stands still.

    For simulation: a search finds it as ``scale_factor_anomaly``, for the rates of a test are seldom so dense that they
    show the form.
    """

    id = "rate_lock"
    title = "lock to a rate"
    meaning = "cross-coupling pulls a closed loop to one rate, and near it the output stands still"
    linear = (Param("W_L_squared", "rad^2/s^2", sd=1e-6, bound=1e-4, low=0.0),)
    shapes = (Param("u0", OUTPUT, sd=1e-3, low=0.0),)
    source = "H. C. Lefevre, The Fiber-Optic Gyroscope (2014), closed loop: cross-coupling; Adler's equation"
    instruments = ("gyro",)
    of_rate = True
    local = True

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Departure from the true rate, shape (..., n)."""
        square, centre = theta[..., 0, None], theta[..., 1, None]
        return _pulled(u - centre, square) + _pulled(u + centre, square)

    def grid(self, motion: Motion) -> Floats:
        """Rates up to the largest one of the recording, shape (g, 1); none where there is no rate."""
        largest = float(np.abs(motion.rate).max(initial=0.0))
        return np.linspace(0.0, largest, 102)[1:-1, None] if largest else np.empty((0, 1))


@final
@dataclass(frozen=True)
class LockInWander(DrivenEffect):
    """Lock-in whose threshold settles after switching on, and walks, as its mirrors do.

    For simulation: no search tries it, as one record tells little of a walk that only its square shows.
    """

    id = "lock_in_wander"
    title = "wander of the lock-in"
    meaning = "the lock-in threshold wanders at random"
    linear = (Param("W_L", "rad/s", sd=3e-3, bound=0.03, low=0.0),)
    shapes = (
        Param("rise", "1", sd=0.2, bound=2.0),
        Param("tau", "s", sd=300.0, low=0.5),
        Param("K", "1/sqrt(s)", sd=1e-3, bound=0.1, low=0.0),
    )
    source = _SOURCE + "; drift of the backscatter: Aronowitz, in RTO AGARDograph 339 (1999)"
    instruments = ("gyro",)
    of_rate = True

    def apply(
        self, u: Floats, motion: Motion, theta: Floats, state: Any = None, z: Floats | None = None
    ) -> tuple[Floats, Any]:
        """Departure from the true rate, shape (..., n), and where the relative walk stands, shape (...)."""
        walk, after = RateRandomWalk().drive(theta[..., 3:], motion.dt, state, self.normals(z))
        return self._pulled(u, motion, theta, walk), after

    def jacobian(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Derivative of the addition with a threshold that does not walk, shape (..., n, 4)."""
        return central_differences(lambda th: self._pulled(u, motion, th), theta, self.params)

    def _pulled(self, u: Floats, motion: Motion, theta: Floats, walk: Floats | float = 0.0) -> Floats:
        level, rise, tau = (theta[..., j, None] for j in range(3))
        threshold = level * (1.0 + rise * (1.0 - decay(motion, tau)) + walk)
        return spread(u, _pulled(u, threshold * threshold))


def _pulled(u: Floats, c: Floats) -> Floats:
    """Adler's mean rate less the input, shape (..., n), for the square ``c`` of the threshold."""
    square = u * u - c
    root = np.sqrt(np.maximum(square, 0.0))
    out = square > 0.0
    pulled = -np.sign(u) * c / np.where(out, root + np.abs(u), 1.0)
    return np.where(out, pulled, -u)
