"""Errors of the bias that follow the temperature T, known at the edges and linear between them.

    bias_temperature        c (T - T_ref) + c2 (T - T_ref)^2 + c3 (T - T_ref)^3
    bias_temperature_rate   c dT/dt
    bias_thermal_lag        c (T - L),    tau dL/dt = T - L,    L = T at the start of the run
    bias_thermal_hysteresis c (T - P) / r,    P what follows T through a play of radius r (`insenv.effects.forms.play`)

The lag is carried as its excess w = T - L. With T linear over an interval (slope m, x = dt / tau, E =
exp(-x)) the solution is exact:

    w1 = E w0 + m tau (1 - E)          mean w = g w0 + (1 - g) m tau,    g = (1 - E) / x
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self, final

import numpy as np

from insenv.core.motion import Motion, interval_mean, interval_slope, reading_noise
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, LinearEffect, MemoryEffect, Param
from insenv.effects.forms import (
    checked_order,
    columns,
    first_order,
    known,
    play,
    reversals,
    spread,
    time_constants,
    turning_points,
)

#: Radii of a hysteresis that a scan tries, as shares of the range of the temperature, and the least, in deviations of
#: the noise of its readings.
RADII, BEYOND = (0.02, 0.05, 0.1, 0.2, 0.35), 5.0
#: Radii of which the largest is looked for by which the temperature turns back and forth, and how often it does then.
WIDTHS, BOTH_WAYS = np.linspace(0.02, 0.5, 25), 2

_COEFFICIENTS = (
    Param("c", OUTPUT + "/K", sd=1e-2, bound=0.1),
    Param("c2", OUTPUT + "/K^2", sd=1e-4, bound=1e-2),
    Param("c3", OUTPUT + "/K^3", sd=1e-6, bound=1e-3),
)


@final
@dataclass(frozen=True)
class BiasTemperature(LinearEffect):
    """A polynomial of the temperature, of ``order`` 1 to 3, without a constant."""

    order: int = 1

    id = "bias_temperature"
    title = "bias over temperature"
    meaning = "the bias follows the temperature"
    needs = ("temperature",)
    source = "IEEE Std 952-1997 and 647-2006: bias temperature sensitivity"
    on_axes = ("gyro", "accelerometer")

    def __post_init__(self) -> None:
        checked_order(self.id, self.order, len(_COEFFICIENTS))

    @property
    def linear(self) -> tuple[Param, ...]:
        """One coefficient for each power."""
        return _COEFFICIENTS[: self.order]

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Exact means of the powers, shape (..., n, order)."""
        first, last = (kelvins - motion.reference_temperature for kelvins in temperatures(motion, self.id))
        powers = []
        for power in range(1, self.order + 1):
            # The mean of x^p from a to b is (a^p + a^(p-1) b + ... + b^p) / (p + 1).
            terms = [last**power, *(first**i * last ** (power - i) for i in range(1, power)), first**power]
            powers.append(sum(terms[1:], start=terms[0]) / (power + 1))
        return columns(u, *powers)


@final
@dataclass(frozen=True)
class BiasTemperatureRate(LinearEffect):
    """The Shupe effect: a changing temperature makes the two ways round a coil unequal."""

    id = "bias_temperature_rate"
    title = "bias over temperature rate"
    meaning = "the bias follows the speed of temperature change (in a fibre coil: the Shupe effect)"
    linear = (Param("c", OUTPUT + " s/K", sd=1.0, bound=100.0),)
    needs = ("temperature",)
    source = "D. M. Shupe, Appl. Opt. 19 (1980) 654"
    of_way = True
    on_axes = ("gyro", "accelerometer")

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Mean slope of the temperature, shape (..., n, 1)."""
        return columns(u, interval_slope(known(motion, "temperature", self.id), motion.dt))


@final
@dataclass(frozen=True)
class BiasThermalLag(MemoryEffect):
    """The difference of the thermometer to a part that follows it with a first-order lag."""

    id = "bias_thermal_lag"
    title = "thermal lag of the bias"
    meaning = "the bias follows temperature with a delay, a first-order lag behind the thermometer"
    linear = (Param("c", OUTPUT + "/K", sd=1e-2, bound=0.1),)
    shapes = (Param("tau", "s", sd=300.0, low=0.5),)
    needs = ("temperature",)
    becomes = ("bias_temperature_rate", "bias_temperature")
    source = "First-order thermal response; IEEE Std 952-1997: bias temperature gradient sensitivity"
    of_way = True
    on_axes = ("gyro", "accelerometer")
    of_base = True

    def begin(self, motion: Motion, theta: Floats) -> Floats:
        """Excess of the temperature over the lagged one: none at the start of a run; shape (...)."""
        temperature = known(motion, "temperature", self.id)
        return np.zeros(np.broadcast_shapes(temperature.shape[:-1], np.shape(theta)[:-1]))

    def carry(self, u: Floats, motion: Motion, theta: Floats, state: Any) -> tuple[Floats, Floats]:
        """Coefficient times the mean excess, shape (..., n), and the excess at the last edge, shape (...)."""
        temperature = known(motion, "temperature", self.id)
        x = motion.dt / theta[..., 1]
        decayed, share = np.exp(-x), -np.expm1(-x) / x
        # A ramp of one step per interval lags by 1 / x steps in the end.
        settled = np.diff(temperature, axis=-1) / x[..., None]
        excess, last = first_order(decayed, (1 - decayed)[..., None] * settled, np.asarray(state))
        mean = share[..., None] * excess + (1 - share)[..., None] * settled
        return spread(u, theta[..., 0, None] * mean), last

    def grid(self, motion: Motion) -> Floats:
        """Time constants, shape (g, 1)."""
        return time_constants(motion, 16)


@final
@dataclass(frozen=True)
class BiasThermalHysteresis(MemoryEffect):
    """A bias that is c higher where the temperature was last raised by more than 2 r, and c lower where lowered.

    Attributes
    ----------
    widest : float
        Largest radius by which the temperature turns back and forth [K]: of a wider one there is no loop.
    """

    widest: float = np.inf

    id = "bias_thermal_hysteresis"
    title = "thermal hysteresis of the bias"
    meaning = "at one temperature the bias depends on whether it was reached from below or from above"
    linear = (Param("c", OUTPUT, sd=1e-2, bound=0.1),)
    shapes = (Param("r", "K", sd=5.0, low=0.05),)
    needs = ("temperature",)
    source = "Play operator: Brokate and Sprekels, Hysteresis and Phase Transitions (1996), section 2.1"
    on_axes = ("gyro", "accelerometer")
    unusual = True
    of_one = True

    def over(self, motion: Motion) -> Self:
        """The effect with the largest radius that ``motion`` tells."""
        heat = self._turns(motion)
        tried = np.ptp(heat) * WIDTHS
        told = [r for r in tried.tolist() if reversals(heat, r) >= BOTH_WAYS]
        return replace(self, widest=max(told, default=np.inf))

    def begin(self, motion: Motion, theta: Floats) -> Floats:
        """In the middle of the play, shape (...)."""
        first = known(motion, "temperature", self.id)[..., 0]
        return np.broadcast_to(first, np.broadcast_shapes(first.shape, np.shape(theta)[:-1])).copy()

    def carry(self, u: Floats, motion: Motion, theta: Floats, state: Any) -> tuple[Floats, Floats]:
        """Coefficient times the mean side of the play, shape (..., n), and what follows at the last edge, (...)."""
        radius, heat = np.minimum(theta[..., 1, None], self.widest), known(motion, "temperature", self.id)
        heat = np.broadcast_to(heat, np.broadcast_shapes(heat.shape, radius.shape))
        behind = play(heat, radius, np.asarray(state))
        behind[..., 0] = state
        side = (heat - behind) / radius
        # Of points each is at the end of the way that led to it.
        of_interval = side[..., 1:] if motion.points else interval_mean(side)
        return spread(u, theta[..., 0, None] * of_interval), behind[..., -1].copy()

    def blind(self, motion: Motion) -> str:
        """Where the temperature does not turn back and forth: two slopes are no loop."""
        back = reversals(self._turns(motion), self._radii(motion)[0]) >= BOTH_WAYS
        return "" if back else "the temperature does not turn back and forth"

    def half_blind(self, motion: Motion) -> bool:
        """Whether the temperature turns back once: there is half a loop, which a lag may stand for."""
        return bool(self.blind(motion)) and reversals(self._turns(motion), self._radii(motion)[0]) == 1

    def grid(self, motion: Motion) -> Floats:
        """Radii beyond the noise of the thermometer, shape (g, 1)."""
        return self._radii(motion)[:, None]

    def _turns(self, motion: Motion) -> Floats:
        heat = known(motion, "temperature", self.id)
        return turning_points(heat.reshape(-1, heat.shape[-1])[0])

    def _radii(self, motion: Motion) -> Floats:
        radii = np.ptp(self._turns(motion)) * np.array(RADII)
        # Fourth differences of points are no noise of the thermometer.
        noise = 0.0 if motion.points else reading_noise(known(motion, "temperature", self.id))
        told = radii > BEYOND * noise
        told &= radii <= self.widest
        return radii[told] if told.any() else radii[:1]


def temperatures(motion: Motion, effect: str) -> tuple[Floats, Floats]:
    """Temperature at the start and at the end of each interval [K], shapes (..., n); of points one for both."""
    kelvins = known(motion, "temperature", effect)
    last = kelvins[..., 1:]
    return (last if motion.points else kelvins[..., :-1]), last


def temperature_excess(motion: Motion, effect: str) -> Floats:
    """Mean of T - T_ref over each interval [K], shape (..., n)."""
    first, last = temperatures(motion, effect)
    excess = first + last
    excess *= 0.5
    excess -= motion.reference_temperature
    return excess
