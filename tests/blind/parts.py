"""What may be wrong with a gyro, its reference or its environment: an addition of adjustable size."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from blind import curves
from blind.table import Floats
from blind.world import World

Curve = Callable[[float], Floats]


@dataclass(frozen=True)
class Part:
    """One undeclared cause.

    Attributes
    ----------
    key : str
        Name in the contract; empty for what no catalogue has.
    addition : callable
        Size -> what it adds to measured minus reference, shape (n,) [rad/s].
    size : float
        A size to start from.
    reading : callable, optional
        Size -> what the encoder then reads too much, shape (n,) [rad]; the gyro itself is then sound.
    also : tuple of str
        Further names that belong to this cause: a second harmonic, the quadratic of a temperature curve.
    """

    key: str
    addition: Curve
    size: float
    reading: Curve | None = None
    also: tuple[str, ...] = field(default=())


def gyro(key: str, curve: Floats, *also: str) -> Part:
    """Proportional to its size."""
    unit = curve / max(float(np.ptp(curve)), 1e-300)
    return Part(key, lambda c: c * unit, 1e-5, None, also)


def encoder(w: World, key: str, error: Floats, *also: str) -> Part:
    shift = w.encoder_shift(error)
    return Part(key, lambda c: c * shift, 1e-6, lambda c: c * error, also)


def _tau(w: World, rng: np.random.Generator) -> float:
    return float(w.duration * rng.uniform(0.05, 0.2))


def _moment(w: World, rng: np.random.Generator) -> float:
    return float(w.duration * rng.uniform(0.12, 0.48))


def top(w: World) -> float:
    return float(np.abs(w.u).max())


def favourite(w: World, rng: np.random.Generator) -> float:
    """A rate that the table stays at or passes, in the upper part of its range."""
    speeds = np.abs(w.u).ravel()
    high = speeds[(speeds > 0.3 * speeds.max()) & (speeds < 0.85 * speeds.max())]
    return float(rng.choice(high if len(high) else speeds))


def frequency(w: World, rng: np.random.Generator) -> float:
    """Many cycles in the fitted part, well below the sampling rate, off the table's own frequencies."""
    low, high = 20 / w.duration, min(0.2 / w.dt, 0.3)
    return float(np.exp(rng.uniform(np.log(low), np.log(max(high, 2 * low)))))


def _lock(w: World, key: str, curve: Callable[[World, float], Floats]) -> Part:
    return Part(key, lambda c: curve(w, np.sqrt(abs(c))), (0.01 * top(w)) ** 2)


def _late(w: World) -> Part:
    def reading(c: float) -> Floats:
        return curves.late(w, c)

    return Part("timing_skew", lambda c: w.encoder_shift(reading(c)), 1e-4, reading)


def _harmonic(order: int) -> Callable[[World, np.random.Generator], Part]:
    key = f"encoder_harmonic:{order}"
    return lambda w, r: encoder(w, key, curves.encoder(w, order, r.uniform(0, 6)))


def _locked(order: int) -> Callable[[World, np.random.Generator], Part]:
    key = f"angle_locked_rate:{order}"
    return lambda w, r: gyro(key, curves.locked(w, order, r.uniform(0, 6)))


#: Exact shapes by name: the contract's own formulas.
EXACT: dict[str, Callable[[World, np.random.Generator], Part]] = {
    "bias_drift": lambda w, r: gyro("bias_drift", curves.drift(w)),
    "bias_warm_up": lambda w, r: gyro("bias_warm_up", curves.warm_up(w, _tau(w, r))),
    "bias_step": lambda w, r: gyro("bias_step", curves.step(w, _moment(w, r))),
    "bias_temperature:1": lambda w, r: gyro("bias_temperature:1", curves.temperature(w)),
    "bias_temperature:2": lambda w, r: gyro("bias_temperature:2", curves.temperature(w, 2)),
    "bias_temperature_rate": lambda w, r: gyro("bias_temperature_rate", curves.temperature_rate(w)),
    "bias_thermal_lag": lambda w, r: gyro("bias_thermal_lag", curves.thermal_lag(w, _tau(w, r))),
    "scale_factor": lambda w, r: gyro("scale_factor", curves.scale(w)),
    "scale_factor_drift": lambda w, r: gyro("scale_factor_drift", curves.scale_drift(w)),
    "scale_factor_warm_up": lambda w, r: gyro("scale_factor_warm_up", curves.scale_warm_up(w, _tau(w, r))),
    "scale_factor_temperature": lambda w, r: gyro("scale_factor_temperature", curves.scale_temperature(w)),
    "scale_factor_asymmetry": lambda w, r: gyro("scale_factor_asymmetry", curves.asymmetry(w)),
    "scale_factor_cubic": lambda w, r: gyro("scale_factor_cubic", curves.cubic(w)),
    "scale_factor_anomaly": lambda w, r: gyro(
        "scale_factor_anomaly", curves.anomaly(w, favourite(w, r), top(w) * r.uniform(0.04, 0.12))
    ),
    "lock_in": lambda w, r: _lock(w, "lock_in", curves.lock_in),
    **{f"encoder_harmonic:{k}": _harmonic(k) for k in (1, 2, 3, 4)},
    **{f"angle_locked_rate:{k}": _locked(k) for k in (1, 2, 3, 4)},
    "timing_skew": lambda w, r: _late(w),
    "tone": lambda w, r: gyro("tone", curves.tone(w, frequency(w, r), r.uniform(0, 6))),
}

_TIME = ("rest", "rest", "reversal", "staircase", "sine", "with_stops")
_TURN = ("reversal", "staircase", "sine", "with_stops", "sweep")
_RICH = ("staircase", "with_stops", "sweep", "sine")
_STEPS = ("staircase", "with_stops")

#: Procedures in which a laboratory would look for each cause.
PROCEDURES: dict[str, tuple[str, ...]] = {
    "bias_drift": _TIME,
    "bias_warm_up": _TIME,
    "bias_step": _TIME,
    "bias_temperature:1": _TIME,
    "bias_temperature:2": _TIME,
    "bias_temperature_rate": _TIME,
    "bias_thermal_lag": _TIME,
    "scale_factor": _TURN,
    "scale_factor_drift": _TURN,
    "scale_factor_warm_up": _TURN,
    "scale_factor_temperature": _TURN,
    "scale_factor_asymmetry": _RICH,
    "scale_factor_cubic": _RICH,
    "scale_factor_anomaly": ("staircase", "sweep", "sine"),
    "lock_in": _RICH,
    **{f"encoder_harmonic:{k}": _TURN for k in (1, 2, 3, 4)},
    **{f"angle_locked_rate:{k}": _TURN for k in (1, 2, 3, 4)},
    "timing_skew": ("sine", "staircase", "reversal"),
    "tone": (*_TIME, "constant"),
}


THERMAL = ("bias_temperature:1", "bias_temperature:2", "bias_temperature_rate", "bias_thermal_lag",
           "scale_factor_temperature")  # fmt: skip


def grades(*keys: str) -> tuple[str, ...]:
    """Gyros that can have all of these: a lock is a laser gyro's."""
    return ("laser",) if "lock_in" in keys else ("laser", "fibre", "mems")


def needs_encoder(key: str) -> bool:
    return key.startswith(("encoder_harmonic", "timing_skew"))
