"""What follows the rate's past by a first-order lag: the output itself, the heat of driving, what settles after a move.

    output_bandwidth      c (L_tau(u) - u)          a share c of the output comes through a filter of time constant tau
    self_heating          c L_tau(u^2)              power that driving leaves in the gyro or below it; of a motor's
                                                    friction c L_tau(|u|), with c a number
    settling_after_turn   c s exp(-(t - t_s)/tau)   after a turn that ends at t_s, with s the sense of the turn, or 1,
                                                    or the angle that was turned, in radians

L_tau is the lag, tau dL/dt = x - L; L = u(0) at the start of a run for the output, 0 for heat. With x constant over an
interval (E = exp(-dt / tau), g = tau (1 - E) / dt) the solution is exact:

    L1 = E L0 + (1 - E) x,    mean L = x + g (L0 - x)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, Self, final

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, MemoryEffect, Param
from insenv.effects.forms import behind_the_table, first_order, known, spread, time_constants
from insenv.effects.rate.scale import LEAST_RATE

#: Time constants of an output, in intervals, and the longest [s].
OUTPUTS, SLOWEST = (0.3, 100.0), 5.0
#: Magnitudes of the rate that are one, as a share of the largest, and the share of the time at other rates below
#: which it was run at one: heat of a table at one rate is a warm-up.
SAME, OTHERS = 0.1, 0.1
#: Rate from which on a table moves [rad/s].
MOVES = 0.02
#: Fewest rests after a turn, and least share of the time at rest.
LEAST_RESTS, RESTS = 3, 0.2

Sense = Literal["sense", "each", "angle"]


def lagged(x: Floats, tau: Floats, dt: float, start: Floats) -> tuple[Floats, Floats]:
    """Mean of the lag of ``x`` over each interval, shape (..., n), and the lag at the last edge, shape (...)."""
    ratio = dt / tau
    decayed, share = np.exp(-ratio), -np.expm1(-ratio) / ratio
    at_edges, last = first_order(decayed, (1 - decayed)[..., None] * x, start)
    return x + share[..., None] * (at_edges - x), last


@final
@dataclass(frozen=True)
class OutputBandwidth(MemoryEffect):
    """An output that comes through a first-order filter: fast motion is late and too small."""

    id = "output_bandwidth"
    title = "bandwidth of the output"
    meaning = "the output comes through a low-pass: fast motion is late and too small"
    linear = (Param("c", "1", sd=0.5, bound=1.5, low=0.0),)
    shapes = (Param("tau", "s", sd=0.1, low=1e-3),)
    becomes = ("timing_skew",)
    source = "IEEE Std 952-1997: bandwidth; first-order low-pass"
    of_response = True
    of_way = True
    instruments = ("gyro",)
    of_rate = True
    unusual = True

    def begin(self, motion: Motion, theta: Floats) -> None:
        """The output is settled at the first rate."""

    def carry(self, u: Floats, motion: Motion, theta: Floats, state: Any) -> tuple[Floats, Floats]:
        """Share times what the filter lacks, shape (..., n), and its output at the last edge, shape (...)."""
        start = u[..., 0] if state is None else np.asarray(state)
        mean, last = lagged(u, theta[..., 1], motion.dt, start)
        return spread(u, theta[..., 0, None] * (mean - u)), last

    def blind(self, motion: Motion) -> str:
        """Beside a late reference."""
        return behind_the_table(motion)

    def grid(self, motion: Motion) -> Floats:
        """Time constants, shape (g, 1)."""
        shortest, longest = (k * motion.dt for k in OUTPUTS)
        longest = min(longest, SLOWEST, 0.05 * motion.dt * motion.n)
        return np.geomspace(shortest, longest, 10)[:, None] if longest > shortest else np.empty((0, 1))


@final
@dataclass(frozen=True)
class SelfHeating(MemoryEffect):
    """A bias that follows the heat of what was driven before.

    Attributes
    ----------
    power : int
        Of the rate: 2 of a motor's current and of the fluid, 1 of friction.
    """

    power: int = 2

    id = "self_heating"
    title = "self-heating"
    meaning = "the bias follows the heat that driving left, later than the rate"
    shapes = (Param("tau", "s", sd=300.0, low=0.5),)
    source = "First-order thermal response to a power; IEEE Std 1554-2005: effects of the table's motor"
    instruments = ("gyro",)
    of_rate = True
    unusual = True

    @property
    def linear(self) -> tuple[Param, ...]:
        """One coefficient, whose unit is that of the power."""
        unit, sd = ("1", 1e-4) if self.power == 1 else (f"1/({OUTPUT})", 1e-4)
        return (Param("c", unit, sd=sd, bound=1e-2),)

    def variants(self, motion: Motion) -> tuple[Self, ...]:
        """Both powers."""
        return (self, replace(self, power=1))

    def begin(self, motion: Motion, theta: Floats) -> Floats:
        """Cold: shape (...)."""
        return np.zeros(np.shape(theta)[:-1])

    def carry(self, u: Floats, motion: Motion, theta: Floats, state: Any) -> tuple[Floats, Floats]:
        """Coefficient times the mean heat, shape (..., n), and the heat at the last edge, shape (...)."""
        heat = np.abs(u) if self.power == 1 else u * u
        mean, last = lagged(heat, theta[..., 1], motion.dt, np.asarray(state))
        return spread(u, theta[..., 0, None] * mean), last

    def blind(self, motion: Motion) -> str:
        """At one rate what it adds is a warm-up."""
        magnitude = np.abs(motion.rate).ravel()
        largest = float(magnitude.max(initial=0.0))
        if largest < LEAST_RATE:
            return "the table does not turn"
        share = np.bincount((magnitude / (SAME * largest)).astype(int)) / len(magnitude)
        # Neighbouring cells may be one rate; many rates, each for a short while, are not.
        one = float((share[1:] + share[:-1]).max(initial=0.0))
        return "at one rate it is a warm-up of the bias" if one > 1 - OTHERS else ""

    def grid(self, motion: Motion) -> Floats:
        """Time constants, shape (g, 1)."""
        return time_constants(motion, 10)


@final
@dataclass(frozen=True)
class SettlingAfterTurn(MemoryEffect):
    """A base, a support or a fluid that comes to rest after each turn of the table.

    Attributes
    ----------
    by : "sense", "each" or "angle"
        Whether what settles has the sense of the turn, is the same after each, or grows with the angle.
    """

    by: Sense = "sense"

    id = "settling_after_turn"
    title = "settling after turns"
    meaning = "after each turn of the table something comes to rest exponentially: base, support or fluid"
    shapes = (Param("tau", "s", sd=30.0, low=0.5),)
    needs = ("angle",)
    source = "First-order relaxation after a step; IEEE Std 1554-2005: settling of the test station"
    instruments = ("gyro",)
    belongs = "place"
    unusual = True

    @property
    def linear(self) -> tuple[Param, ...]:
        """One coefficient, for each radian where what settles grows with the angle."""
        unit = f"{OUTPUT}/rad" if self.by == "angle" else OUTPUT
        return (Param("c", unit, sd=1e-5, bound=1e-2),)

    def variants(self, motion: Motion) -> tuple[Self, ...]:
        """All forms."""
        return (self, replace(self, by="each"), replace(self, by="angle"))

    def begin(self, motion: Motion, theta: Floats) -> Floats:
        """What is left of the turn before, and the angle turned so far; shape (..., 2)."""
        angle = known(motion, "angle", self.id)
        return np.zeros((*np.broadcast_shapes(angle.shape[:-1], np.shape(theta)[:-1]), 2))

    def carry(self, u: Floats, motion: Motion, theta: Floats, state: Any) -> tuple[Floats, Floats]:
        """What is left of the last turn at each rest, zero in turns, shape (..., n), and the state, (..., 2)."""
        angle = known(motion, "angle", self.id)
        tau, state = theta[..., 1], np.asarray(state)
        shape = np.broadcast_shapes(angle.shape[:-1], tau.shape)
        step = np.broadcast_to(np.diff(angle, axis=-1), (*shape, motion.n))
        out, end = np.zeros((*shape, motion.n)), np.zeros((*shape, 2))
        tau, state = np.broadcast_to(tau, shape), np.broadcast_to(state, (*shape, 2))
        for row in np.ndindex(shape):
            out[row], end[row] = self._one(step[row], motion.dt, float(tau[row]), state[row])
        return spread(u, theta[..., 0, None] * out), end

    def _one(self, step: Floats, dt: float, tau: float, state: Floats) -> tuple[Floats, Floats]:
        """The same for one run, with c = 1."""
        n = len(step)
        moves = np.abs(step) > MOVES * dt
        place = np.arange(n)
        # Angle turned since the last rest, and what that is worth at its end.
        since = np.maximum.accumulate(np.where(~moves, place, -1))
        total = np.concatenate([[0.0], np.cumsum(step)])
        turned = total[1:] - total[since + 1] + np.where(since < 0, state[1], 0.0)
        worth = {"sense": np.sign(turned), "each": np.ones(n), "angle": turned}[self.by]
        last = np.maximum.accumulate(np.where(moves, place, -1))
        first = last < 0
        age = np.maximum(place - np.where(first, -1, last) - 1, 0)  # in a turn it counts for nothing
        decay = np.exp(-age * dt / tau)
        size = np.where(first, state[0], worth[np.maximum(last, 0)])
        mean = np.where(moves, 0.0, size * decay * -np.expm1(-dt / tau) / (dt / tau))
        left = worth[-1] if moves[-1] else size[-1] * decay[-1] * np.exp(-dt / tau)
        return mean, np.array([left, turned[-1] if moves[-1] else 0.0])

    def blind(self, motion: Motion) -> str:
        """Nothing settles where the table never stops."""
        rests, share = self._rests(motion)
        return "" if rests >= LEAST_RESTS and share >= RESTS else "the table does not rest between turns"

    def _rests(self, motion: Motion) -> tuple[int, float]:
        """Rests after a turn, and the share of the time at rest."""
        moves = np.abs(np.diff(np.atleast_2d(known(motion, "angle", self.id))[0])) > MOVES * motion.dt
        return int(np.sum(moves[:-1] & ~moves[1:])), 1.0 - float(np.mean(moves))

    def grid(self, motion: Motion) -> Floats:
        """Time constants, shape (g, 1): shares of the mean rest."""
        rests, share = self._rests(motion)
        rest = motion.n * motion.dt * max(share, 0.1) / max(rests, 1)
        return np.geomspace(max(motion.dt, 0.03 * rest), max(rest, 2 * motion.dt), 8)[:, None]
