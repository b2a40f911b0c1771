"""What an instrument, its reference or its test may do beside what is declared, each by its own physics.

A fault adds to the rate on the fine grid, or to the angle that the encoder shows, or changes the instants at which the
gyro is read. `names` are what a catalogue may call it; an unknown cause has none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from motion import Floats
from scipy.signal import lfilter


@dataclass(frozen=True)
class Exposed:
    """What the gyro is exposed to, on the fine grid: shapes (n,)."""

    t: Floats
    u: Floats
    angle: Floats
    temperature: Floats
    top: float

    @property
    def step(self) -> float:
        """Step of the grid [s]."""
        return float(self.t[1] - self.t[0])

    def lagged(self, x: Floats, tau: float) -> Floats:
        """First-order lag of x, which it equals at the start."""
        e = np.exp(-self.step / tau)
        return np.asarray(lfilter([1 - e], [1, -e], x - x[0])) + x[0]


Law = Callable[[Exposed, float, float, np.random.Generator], Any]


@dataclass(frozen=True)
class Fault:
    """A cause: ``law(exposed, size, shape, rng)`` with ``shape`` drawn evenly from 0 to 1.

    ``on``: "rate", "angle" of the encoder, "late" (a delay [s] of the reading), "held" (whole rows), "world" (it is
    there anyhow).
    """

    names: tuple[str, ...]
    law: Law
    on: str = "rate"
    needs: str = ""
    #: A size where the search for the wanted strength begins, in units of what the law is linear in.
    size: float = 1e-4
    #: What a catalogue calls it where the table has one speed, forwards and backwards, beside rests.
    at_one_speed: tuple[str, ...] = ()
    #: What it calls it where the table turns one way only.
    one_way: tuple[str, ...] = ()
    #: What it calls it on any table.
    anywhere: tuple[str, ...] = ()


def _play(x: Floats, radius: float) -> Floats:
    """Play operator, step by step on the turning points only."""
    out = np.empty_like(x)
    p = x[0]
    turn = np.flatnonzero(np.diff(np.sign(np.diff(x))) != 0) + 1
    edges: list[int] = [0, *turn.tolist(), len(x)]
    for start, stop in zip(edges[:-1], edges[1:], strict=True):
        piece = x[start:stop]
        if not len(piece):
            continue
        rising = piece[-1] >= piece[0]
        if start and stop - start == 1:
            rising = piece[0] >= x[start - 1]
        out[start:stop] = np.maximum(p, piece - radius) if rising else np.minimum(p, piece + radius)
        p = out[stop - 1]
    return out


def _wave(order: int) -> Law:
    return lambda e, c, s, rng: c * np.cos(order * e.angle + 2 * np.pi * s)


def _line(e: Exposed, c: float, s: float, rng: np.random.Generator) -> Floats:
    f = 0.05 * float(200**s)
    return np.asarray(c * np.cos(2 * np.pi * f * e.t + 1.0))


def _drift_time(e: Exposed, s: float) -> float:
    return float(e.t[-1] * (0.03 + 0.25 * s))


def _lock(e: Exposed, c: float, s: float, rng: np.random.Generator) -> Floats:
    inside = np.abs(e.u) <= np.sqrt(abs(c))
    return np.where(inside, -e.u, np.sign(e.u) * np.sqrt(np.maximum(e.u**2 - c, 0)) - e.u)


def _settling(e: Exposed, c: float, s: float, rng: np.random.Generator) -> Floats:
    tau = 2 * (15**s)
    turning = np.abs(e.u) > 0.002 * e.top
    ends = np.flatnonzero(turning[:-1] & ~turning[1:]) + 1
    out = np.zeros_like(e.t)
    for k in ends.tolist():
        back = max(int(k) - 5, 0)
        out[k:] += np.sign(e.u[back]) * np.exp(-(e.t[k:] - e.t[k]) / tau)
    return c * out


def _hysteresis(e: Exposed, c: float, s: float, rng: np.random.Generator) -> Floats:
    r = e.top * (0.1 + 0.5 * s)
    return c * (e.u - _play(e.u, r)) / r


def _anomaly(e: Exposed, c: float, s: float, rng: np.random.Generator) -> Floats:
    centre, width = e.top * (0.3 + 0.4 * s), 0.12 * e.top
    return c * np.sign(e.u) * np.exp(-((np.abs(e.u) - centre) ** 2) / (2 * width**2))


def _telegraph(e: Exposed, c: float, s: float, rng: np.random.Generator) -> Floats:
    edges = np.cumsum(rng.exponential(e.t[-1] * (0.02 + 0.05 * s), 200))
    return np.asarray(c * (np.searchsorted(edges, e.t) % 2), np.float64)


def _sector(e: Exposed, c: float, s: float, rng: np.random.Generator) -> Floats:
    return c * np.exp(-(((np.mod(e.angle - 2 * np.pi * s, 2 * np.pi) - np.pi) / 0.35) ** 2))


def _breathing(e: Exposed, c: float, s: float, rng: np.random.Generator) -> Floats:
    return c * np.sin(2 * np.pi * e.t * 3.7 / e.t[-1]) * np.cos(2 * np.pi * (0.3 + s) * e.t)


def _noise_with_rate(e: Exposed, c: float, s: float, rng: np.random.Generator) -> Floats:
    z = rng.standard_normal(int(e.t[-1] / 0.5) + 2)
    return c * np.interp(e.t, 0.5 * np.arange(len(z)), z) * np.abs(e.u) / e.top


def _u(power: int) -> Law:
    return lambda e, c, s, rng: c * e.u**power


def _dead(e: Exposed, c: float, s: float, rng: np.random.Generator) -> Floats:
    return -np.where(np.abs(e.u) < c, e.u, 0.0)


def _threshold(e: Exposed, c: float, s: float, rng: np.random.Generator) -> Floats:
    return -np.clip(e.u, -c, c)


WARM = "warm"
FAULTS: dict[str, Fault] = {
    "bias_drift": Fault(("bias_drift",), lambda e, c, s, r: c * e.t / e.t[-1]),
    "bias_warm_up": Fault(("bias_warm_up",), lambda e, c, s, r: c * np.exp(-e.t / _drift_time(e, s))),
    "bias_step": Fault(("bias_step",), lambda e, c, s, r: c * (e.t > e.t[-1] * (0.12 + 0.36 * s))),
    "bias_temperature": Fault(("bias_temperature",), lambda e, c, s, r: c * (e.temperature - 25), needs=WARM),
    "bias_temperature_rate": Fault(
        ("bias_temperature_rate", "bias_thermal_lag"),
        lambda e, c, s, r: c * np.gradient(e.temperature, e.t),
        needs=WARM,
    ),
    "bias_thermal_lag": Fault(
        ("bias_thermal_lag", "bias_temperature_rate"),
        lambda e, c, s, r: c * (e.temperature - e.lagged(e.temperature, e.t[-1] * (0.03 + 0.1 * s))),
        needs=WARM,
    ),
    "scale_factor": Fault(("scale_factor",), _u(1), needs="bias alone"),
    "scale_factor_drift": Fault(("scale_factor_drift",), lambda e, c, s, r: c * e.u * e.t / e.t[-1]),
    "scale_factor_warm_up": Fault(
        ("scale_factor_warm_up",), lambda e, c, s, r: c * e.u * np.exp(-e.t / _drift_time(e, s))
    ),
    "scale_factor_temperature": Fault(
        ("scale_factor_temperature",), lambda e, c, s, r: c * e.u * (e.temperature - 25), needs=WARM
    ),
    "scale_factor_asymmetry": Fault(
        ("scale_factor_asymmetry",), lambda e, c, s, r: c * np.abs(e.u), needs="both signs"
    ),
    "scale_factor_cubic": Fault(("scale_factor_cubic", "sine_response"), _u(3), needs="rates"),
    "scale_factor_anomaly": Fault(("scale_factor_anomaly",), _anomaly, needs="rates"),
    "lock_in": Fault(("lock_in",), _lock, needs="rates", size=1e-9),
    "encoder_harmonic": Fault(("encoder_harmonic",), _wave(1), on="angle", needs="turns"),
    "encoder_harmonic:2": Fault(("encoder_harmonic",), _wave(2), on="angle", needs="turns"),
    "angle_locked_rate": Fault(("angle_locked_rate", "magnetic_field", "earth_rate"), _wave(1), needs="turns"),
    "angle_locked_rate:2": Fault(("angle_locked_rate",), _wave(2), needs="turns"),
    "earth_rate": Fault(
        ("earth_rate", "angle_locked_rate", "magnetic_field"),
        lambda e, c, s, r: np.zeros_like(e.t),
        on="world",
        needs="turns",
    ),
    "timing_skew": Fault(("timing_skew",), lambda e, c, s, r: np.array([c]), on="late", size=1e-3),
    "sample_hold": Fault(("sample_hold", "output_bandwidth"), lambda e, c, s, r: np.array([2 + int(3 * s)]), on="held"),
    "tone": Fault(("tone",), _line),
    "encoder_backlash": Fault(
        ("encoder_backlash",), lambda e, c, s, r: _play(e.angle, 0.5 * abs(c)) - e.angle, on="angle", needs="reverses"
    ),
    "scale_factor_hysteresis": Fault(("scale_factor_hysteresis",), _hysteresis, needs="reverses"),
    "dead_band": Fault(("dead_band",), _dead, needs="rests", size=1e-3),
    "threshold": Fault(("dead_band",), _threshold, needs="rests", size=1e-4),
    "self_heating": Fault(
        ("self_heating",), lambda e, c, s, r: c * e.lagged(e.u**2, e.t[-1] * (0.02 + 0.1 * s)), needs="rates"
    ),
    "settling_after_turn": Fault(("settling_after_turn",), _settling, needs="rests"),
    "centripetal_acceleration": Fault(("centripetal_acceleration",), _u(2), needs="rates"),
    "output_bandwidth": Fault(
        ("output_bandwidth", "timing_skew"), lambda e, c, s, r: c * (e.lagged(e.u, 0.05 + 0.3 * s) - e.u), size=0.1
    ),
}

UNKNOWN: dict[str, Fault] = {
    "telegraph": Fault((), _telegraph),
    "sector": Fault(("angle_locked_rate",), _sector, needs="turns"),
    # As the kink: since waves of any order have a name.
    "order 6": Fault(
        ("encoder_harmonic",),
        _wave(6),
        on="angle",
        needs="turns",
        anywhere=("encoder_harmonic",),
        at_one_speed=("angle_locked_rate", "tone"),
    ),
    # Two lines to the last digit: of the sum and of the difference of its frequencies.
    "breathing line": Fault(("tone",), _breathing, anywhere=("tone",)),
    "noise with rate": Fault((), _noise_with_rate),
    "heated twice": Fault(
        (),
        lambda e, c, s, r: c * np.abs(e.u) * (e.temperature - 25),
        needs=WARM,
        at_one_speed=("bias_temperature",),
        one_way=("scale_factor_temperature",),
    ),
    # A knee of the scale factor since there is one in the catalogue; before that nobody had a name for it.
    "kink": Fault(
        ("scale_factor_knee",),
        lambda e, c, s, r: c * np.sign(e.u) * np.maximum(np.abs(e.u) - 0.5 * e.top, 0),
        needs="rates",
        anywhere=("scale_factor_knee",),
    ),
    "angle and rate": Fault(
        (),
        lambda e, c, s, r: c * e.u * np.abs(e.u) * np.cos(e.angle + 6 * s),
        needs="turns",
        at_one_speed=("encoder_harmonic", "angle_locked_rate"),
    ),
    "parabola": Fault(("bias_drift", "bias_warm_up"), lambda e, c, s, r: c * (e.t / e.t[-1] - 0.4) ** 2),
    "acceleration": Fault((), lambda e, c, s, r: c * np.abs(np.gradient(e.lagged(e.u, 0.1), e.t)), needs="rates"),
    "index mark": Fault(
        ("encoder_harmonic",),
        lambda e, c, s, r: c * (np.mod(e.angle / (2 * np.pi) + s, 1.0) < 0.3),
        on="angle",
        needs="turns",
    ),
}
