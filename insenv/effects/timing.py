"""Errors of timing.

    timing_skew   -c du/dt         the reading is late (c > 0) or early by c seconds
    force_delay   c [W x f]_i      an accelerometer on axis i of a turning unit is late by c seconds: -c df/dt
    sample_hold   c (held(u) - u)  the output repeats one value for a hold time

A skew of many milliseconds is no straight line in c. Once about c0 is known the column of ``timing_skew`` is

    c (u(t - c0) - u) / c0

where the reference is late by a filter of first order -c du/dt exactly, and where it is a mean over a window the u
whose mean it is stands for u(t - c0). A lag that is no delay has k (u(t - c0) - 2 u + u(t + c0)) as well. That k is
given by the form of the lag and is no parameter: of mean delay c and spread s it is s^2 / (2 c^2), which is 0 for a
delay, 1/6 for a mean, 1/2 for a first-order lag and -0.2 for a servo of damping 0.6.

``held(u)`` is, on every interval, the input of the first interval whose middle lies in the same cell of one
hold time, counted from the start of the run. A hold time of one interval or less holds nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Self, final

import numpy as np
from numpy.typing import NDArray

from insenv.core.motion import Motion, interval_mean, interval_slope
from insenv.core.recording import Floats
from insenv.effects.base import LinearEffect, MemoryEffect, Param
from insenv.effects.forms import columns, cyclic, known

#: Hold times that a scan tries, in intervals: output rates of a half to a hundredth of the sampling rate.
HOLDS = (2.0, 3.0, 4.0, 5.0, 8.0, 10.0, 20.0, 50.0, 100.0)
#: Keeps a boundary that falls on the middle of an interval from being decided by rounding.
_ROUNDING = 1e-6


@final
@dataclass(frozen=True)
class TimingSkew(LinearEffect):
    """A reading and a reference that are not of the same instant, to first order in the skew.

    Attributes
    ----------
    about : float
        Skew at which it is exact [s]: there the secant stands for the derivative, which at a corner of the rate is
        wrong by as much as the rate changes in a skew. 0: at the motion's own ``lag``.
    form : float
        The k of a lag that is no delay.
    """

    about: float = 0.0
    form: float = 0.0

    id = "timing_skew"
    title = "timing skew"
    meaning = "gyro and reference are not sampled at the same time"
    linear = (Param("c", "s", sd=0.01, bound=1.0, rows=20.0),)
    needs = ("rate_edges",)
    source = "First-order Taylor expansion of u(t - c)"
    exact = True
    of_response = True
    of_way = True
    hides = "rate"
    instruments = ("gyro",)
    belongs = "reference"
    of_rate = True
    of_run = True

    def near(self, theta: Floats) -> Self:
        """The effect exact at the skew ``theta``; as it is where that is so already, to a thousandth of the skew."""
        skew = float(theta[0])
        return self if abs(skew - self.about) <= 1e-3 * abs(skew) else replace(self, about=skew)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Mean rate derivative, reversed, or the secant, shape (..., n, 1)."""
        edges = known(motion, "rate_edges", self.id)
        about = self.about or motion.lag
        if motion.filtered or not about:
            return columns(u, -interval_slope(edges, motion.dt))
        whole, at_edges = before_mean(u, edges, motion)
        past = earlier(whole, at_edges, motion, about)
        if self.form:
            past = past + self.form * (past + earlier(whole, at_edges, motion, -about) - 2 * whole)
        return columns(u, (past - u) / about)


def earlier(u: Floats, edges: Floats, motion: Motion, skew: float) -> Floats:
    """Mean of the input a skew earlier than each interval, shape (..., n).

    Its integral goes by cubics, with the rates at the edges for slopes; beyond the ends the rate stays as it is there.
    """
    return interval_slope(_integral(u, edges, motion)(-skew), motion.dt)


def before_mean(u: Floats, edges: Floats, motion: Motion) -> tuple[Floats, Floats]:
    """The rate of which ``u`` is the mean over ``motion.window`` around each time, over the intervals and at the edges.

    With M the mean over the window, u = M x. For x stands, with D = 1 - M,

        u + M^p (D + (p + 1) D D) u,        p = 4

    right to the second order in D: 0.4 % off where the motion swings once in five windows. Faster motion is mostly
    noise, and is made larger by a sixth at most.
    """
    if not motion.window:
        return u, edges
    power, whole, at_edges = (u, edges), u, edges
    for share in _UNDONE:
        power = _averaged(*power, motion)
        whole, at_edges = whole + share * power[0], at_edges + share * power[1]
    return whole, at_edges


#: Coefficients of M, M M, ... there.
_UNDONE = (0.0, 0.0, 0.0, 6.0, -11.0, 5.0)


def _averaged(u: Floats, edges: Floats, motion: Motion) -> tuple[Floats, Floats]:
    """Means over the window around each interval and edge: at the edges exact, over an interval by Simpson's rule."""
    turned, half, middle = _integral(u, edges, motion), 0.5 * motion.window, 0.5 * motion.dt
    at_edges, between = ((turned(at + half) - turned(at - half)) / motion.window for at in (0.0, middle))
    return (at_edges[..., 1:] + 4 * between[..., :-1] + at_edges[..., :-1]) / 6, at_edges


def _integral(u: Floats, edges: Floats, motion: Motion) -> Callable[[float], Floats]:
    """Integral of the input from the start of the run, at all edges of its intervals, some time later than each.

    All edges then lie equally far into their intervals: a cubic is the same four weights throughout.
    """
    rates = np.broadcast_to(edges, (*np.broadcast_shapes(u.shape[:-1], edges.shape[:-1]), edges.shape[-1]))
    total, n, dt = np.zeros(rates.shape), motion.n, motion.dt
    np.cumsum(u * dt, axis=-1, out=total[..., 1:])

    def turned(later: float) -> Floats:
        whole = int(np.floor(later / dt))
        x = later / dt - whole
        after = x * x * (3 - 2 * x)
        curve = (1 - after) * total[..., :-1] + after * total[..., 1:]
        curve += (dt * x * (1 - x) ** 2) * rates[..., :-1] - (dt * x * x * (1 - x)) * rates[..., 1:]
        # Edge i is looked up in interval i + whole; before the first and behind the last one the rate stays.
        first, last = min(max(-whole, 0), n + 1), max(min(n - whole, n + 1), 0)
        at = np.empty(rates.shape)
        at[..., first:last] = curve[..., first + whole : last + whole]
        away = (np.arange(n + 1) + whole + x) * dt
        at[..., :first] = total[..., :1] + rates[..., :1] * away[:first]
        at[..., last:] = total[..., -1:] + rates[..., -1:] * (away[last:] - n * dt)
        return at

    return turned


@final
@dataclass(frozen=True)
class ForceDelay(LinearEffect):
    """An accelerometer of a turning unit that is late against the gyros, to first order in the delay.

    Gravity stands still and the unit turns at the rate W: df/dt = -W x f, what a lever arm adds left out.
    """

    id = "force_delay"
    title = "delay of an accelerometer"
    meaning = "gyros and accelerometers are not sampled at the same time"
    linear = (Param("c", "s", sd=0.01, bound=1.0),)
    needs = ("body_rate", "force")
    source = "First-order Taylor expansion of f(t - c); df/dt in a rotating frame"
    on_axes = ("accelerometer",)
    instruments = ("accelerometer",)

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Cross product of mean rate and mean force along the input axis, shape (..., n, 1)."""
        _, j, k = cyclic(motion, self.id)
        rate = {axis: interval_mean(motion.body_rate[axis]) for axis in (j, k)}
        return columns(u, rate[j] * motion.force[k] - rate[k] * motion.force[j])


@final
@dataclass(frozen=True)
class SampleHold(MemoryEffect):
    """An output that is renewed less often than it is read."""

    id = "sample_hold"
    title = "sample and hold"
    meaning = "the output repeats its last value for a while"
    linear = (Param("c", "1", sd=0.5, bound=1.5, least=0.8),)  # an output is held whole, or it is something else
    shapes = (Param("hold", "s", sd=0.1, low=0.0),)
    source = "Zero-order hold: Oppenheim and Schafer, Discrete-Time Signal Processing, section 4.8"
    exact = True
    of_response = True
    of_way = True
    hides = "rate"
    instruments = ("gyro",)
    of_time = True
    of_rate = True

    def begin(self, motion: Motion, theta: Floats) -> None:
        """No value is held before the first one."""

    def carry(self, u: Floats, motion: Motion, theta: Floats, state: Any) -> tuple[Floats, Floats]:
        """Share times held minus true input, shape (..., n), and the value held last, shape (...)."""
        before = u[..., 0] if state is None else np.asarray(state)
        # In intervals; a hold below one of them would need countless cells, and holds no more than one does.
        ratio = np.maximum(theta[..., 1] / motion.dt, 1.0)
        start, batch = round(float(motion.t[0]) / motion.dt), np.broadcast_shapes(u.shape[:-1], ratio.shape)
        # Column 0 is the value from the chunk before; the first interval of a run always begins a cell.
        source = np.empty((*batch, motion.n + 1))
        source[..., 0], source[..., 1:] = before, u
        held = np.empty((*batch, motion.n))
        # Rows of a batch that differ in their hold are renewed at times of their own.
        each = np.broadcast_to(ratio, batch) if ratio.ndim else ratio
        for row in np.ndindex(each.shape):
            held[row] = held_values(source[row], float(each[row]), start)
        return theta[..., 0, None] * (held - u), held[..., -1].copy()

    def grid(self, motion: Motion) -> Floats:
        """Hold times of a few intervals, shape (g, 1)."""
        return np.array([[hold * motion.dt] for hold in HOLDS if 2 * hold <= motion.n]).reshape(-1, 1)


def held_values(source: Floats, ratio: float, start: int) -> Floats:
    """What is held for ``ratio`` intervals each, shape (..., n), of values of which the first was held before them.

    ``source`` has the shape (..., n + 1); the intervals are those from ``start`` on.
    """
    first, count = _renewals(ratio, start, source.shape[-1] - 1)
    return np.repeat(source[..., first], count, axis=-1)


def _renewals(ratio: float, start: int, n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which of the n intervals from ``start`` on each cell of one hold repeats, counted from 1, and how often.

    0 is what was held before them.
    """
    low, high = (int(np.floor((start + k + 0.5) / ratio + _ROUNDING)) for k in (0, n - 1))
    cells = np.arange(low, high + 1)
    first = np.ceil((cells - _ROUNDING) * ratio - 0.5).astype(int) - start
    begin = np.concatenate([[0], first[1:], [n]])
    return np.maximum(first + 1, 0), np.diff(begin)
