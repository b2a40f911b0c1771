r"""Motion of a table under a servo that obeys a limit of acceleration, in closed form.

After a command ``r + A sin(2 pi f s)`` at ``s = 0``, with the table at rate W0 and the acceleration limit a,

    d = r - W0,   S = |d| / (a - 2 pi f |A|),   m = min(s, S)
    rate   W(s) = W0 + d m / S + A sin(2 pi f s)
    angle  b(s) = b0 + W0 s + (d m / S) (s - m/2) + A (1 - cos(2 pi f s)) / (2 pi f)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.plants.profile import Piece

#: What is left of the acceleration for changes of rate, at least, while a sine takes the rest.
_LEAST_SPARE = 1e-6
#: Relative difference of two rates that rounding makes.
_SAME = 1e-15
#: Amplitude and frequency of a command without a sine.
_NONE = np.zeros(1)


@dataclass(frozen=True)
class Knots:
    """State of the servo: the commands that it follows, J of them, and where the table was when each began.

    ``start`` [s], ``amplitude`` [rad/s] and ``frequency`` [Hz] have shape (J,); ``angle`` [rad], ``rate`` and
    ``command`` [rad/s] have shape (J,), or (..., J) where they differ from run to run.
    """

    start: Floats
    angle: Floats
    rate: Floats
    command: Floats
    amplitude: Floats
    frequency: Floats

    def take(self, j: slice | NDArray[np.int64]) -> Knots:
        """Knots ``j`` alone."""
        return Knots(
            self.start[j],
            self.angle[..., j],
            self.rate[..., j],
            self.command[..., j],
            self.amplitude[j],
            self.frequency[j],
        )

    def rows(self, index: NDArray[np.int64]) -> Knots:
        """Knots of the runs ``index`` of a batch; what all runs share stays shared."""
        angle, rate, command = (a[index] if a.ndim > 1 else a for a in (self.angle, self.rate, self.command))
        return replace(self, angle=angle, rate=rate, command=command)

    @cached_property
    def _swings(self) -> bool:
        """Whether a sine is commanded."""
        return bool(np.count_nonzero(self.amplitude))

    @cached_property
    def _even(self) -> bool:
        """Whether every command is the rate that the table has already: nothing is to be slewed."""
        return not np.count_nonzero(self.command != self.rate)

    def at(self, t: Floats, acceleration: float) -> tuple[Floats, Floats]:
        """Angle and rate at times ``t``, shape (..., n), under the limit ``acceleration`` [rad/s^2].

        The rate has shape (..., 1) where it is the same at all times.

        Before the first knot the table turned at that knot's rate.
        """
        k = self._during(t)
        s = t - k.start
        w = 2 * np.pi * k.frequency if k._swings else 0.0
        if acceleration == np.inf or k._even:
            # As the general case would have it, but of few operations: most tables turn evenly most of the time.
            angle = k.command * s + k.angle
            rate = k.command
        else:
            # What the sine takes of the acceleration is not there to slew with.
            change, least = k.command - k.rate, _LEAST_SPARE * acceleration
            spare = np.maximum(acceleration - w * np.abs(k.amplitude), least) if k._swings else acceleration
            whole = np.abs(change) / spare
            reached = len(k.start) == 1 and s[0] >= whole.max()  # the same numbers, one for all times
            m = whole if reached else np.minimum(s, whole)
            if s[0] < 0:
                m = np.maximum(m, 0.0)
            slope = np.copysign(spare, change)
            rate = slope * m
            rate += k.rate
            # As above, in the order r' s - slope m^2 / 2 with the rate r' that is reached.
            m *= m
            m *= -0.5 * slope
            angle = rate * s
            angle += m
            angle += k.angle
        if k._swings:
            angle = angle + k.amplitude * (2 * np.sin(0.5 * w * s) ** 2) / np.where(w > 0, w, 1.0)
            rate = rate + k.amplitude * np.sin(w * s)
        return angle, rate

    def setpoint(self, t: Floats) -> Floats:
        """What the servo is asked for at times ``t``, shape (..., n): a rate that jumps, which no table does."""
        k = self._during(t)
        swing = k.amplitude * np.sin(2 * np.pi * k.frequency * (t - k.start)) if k._swings else 0.0
        return np.broadcast_to(k.command + swing, (*k.command.shape[:-1], len(t)))

    def commanded(self, t: float, rate: Floats, acceleration: float, memory: float = 0.0) -> Knots:
        """Knots of a table that is told at time ``t`` to take up ``rate``, shape (...).

        The last ``memory`` seconds before ``t`` stay known.
        """
        angle, now = self.at(np.array([t]), acceleration)
        wanted = np.asarray(rate, float)[..., None]
        if np.count_nonzero(wanted != now):
            # A table told what it does already, but for the rounding of getting there, goes on evenly.
            now = np.where(np.abs(wanted - now) <= _SAME * np.abs(wanted), wanted, now)
        new = Knots(np.array([t]), angle, now, wanted, _NONE, _NONE)
        if not memory:
            return new
        first, last = np.searchsorted(self.start, [t - memory, t], side="right") - 1
        return joined(self.take(slice(max(first, 0), last + 1)), new)

    def _during(self, t: Floats) -> Knots:
        """The knots that hold at times ``t``: one for all of them, or one for each."""
        if len(self.start) == 1:
            return self
        first, last = np.maximum(np.searchsorted(self.start, t[[0, -1]], side="right") - 1, 0)
        if first == last:
            return self.take(slice(first, first + 1))
        return self.take(np.maximum(np.searchsorted(self.start, t, side="right") - 1, 0))


def knot(start: float, angle: Floats, rate: Floats, piece: Piece) -> Knots:
    """One knot, with which a piece begins; ``angle`` and ``rate`` of shape (..., 1)."""
    return Knots(
        start=np.array([start]),
        angle=angle,
        rate=rate,
        command=np.array([piece.rate]),
        amplitude=np.array([piece.amplitude]),
        frequency=np.array([piece.frequency]),
    )


def joined(*knots: Knots) -> Knots:
    """Knots one after the other."""

    def row(name: str) -> Floats:
        parts = [getattr(k, name) for k in knots]
        batch = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
        return np.concatenate([np.broadcast_to(part, (*batch, part.shape[-1])) for part in parts], axis=-1)

    return Knots(*(row(name) for name in Knots.__dataclass_fields__))
