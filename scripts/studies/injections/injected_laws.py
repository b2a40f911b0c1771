"""Effects of a known size, put into recordings with NumPy alone; nothing of the search is used.

A law gets what a run was exposed to and gives readings and reference anew: what is an error of the instrument alters
the reading, what is one of the encoder alters what was logged of the table.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

Floats = NDArray[np.float64]
#: What takes the place of a late output by the same right: a lag of whatever is behind.
LATE = ("timing_skew", "reference_lag", "bandwidth", "reference_bandwidth", "output_bandwidth", "settling_after_turn")


@dataclass(frozen=True)
class Exposure:
    """One run: reading and reference, and what the instrument was exposed to as the reading itself shows it."""

    t: Floats
    y: Floats
    u: Floats
    reference: Floats
    is_angle: bool
    angle: Floats
    kelvin: Floats | None
    top: float
    longest: bool = True

    @property
    def dt(self) -> float:
        """Step from row to row [s]."""
        return float(np.median(np.diff(self.t)))

    @property
    def length(self) -> float:
        """How long the run lasts [s]."""
        return float(self.t[-1])


Pair = tuple[Floats, Floats]


@dataclass(frozen=True)
class Law:
    """An effect: what it does to a run, how large it may credibly be, and by which names it is right."""

    of: Callable[[Exposure, float, Floats], Pair]
    high: float
    names: tuple[str, ...]
    low: float = 1e-9
    #: Whether it is seen from row to row alone.
    fast: bool = False
    #: Its coefficient in the report, and what that is for a size.
    value: tuple[str, Callable[[Exposure, float, Floats], float]] | None = None
    needs: tuple[str, ...] = ()


def _added(curve: Callable[[Exposure, Floats], Floats]) -> Callable[[Exposure, float, Floats], Pair]:
    return lambda e, size, shape: (e.y + size * curve(e, shape), e.reference)


def lagged(x: Floats, dt: float, tau: float) -> Floats:
    """First-order lag of x, at rest before its first row."""
    rest = np.exp(-dt / tau)
    return np.asarray(lfilter([1.0 - rest], [1.0, -rest], x, zi=[rest * x[0]])[0])


def play(x: Floats, radius: float) -> Floats:
    """What a link with so much play either way makes of x."""
    out, now = np.empty_like(x), float(x[0])
    for i, one in enumerate(x.tolist()):
        now = min(max(now, one - radius), one + radius)
        out[i] = now
    return out


def _between(shape: Floats, low: float, high: float) -> float:
    return float(low + shape[0] * (high - low))


def _anomaly(e: Exposure, shape: Floats) -> Floats:
    u0 = e.top * _between(shape, 0.3, 0.7)
    return np.sign(e.u) * np.exp(-((np.abs(e.u) - u0) ** 2) / (2 * (0.12 * e.top) ** 2))


def _decay(e: Exposure, shape: Floats) -> Floats:
    return np.exp(-e.t / (e.length * _between(shape, 0.08, 0.3)))


def _step(e: Exposure, shape: Floats) -> Floats:
    return np.where(e.longest & (e.t > e.length * _between(shape, 0.25, 0.55)), 1.0, 0.0)


def late(x: Floats, t: Floats, delay: float) -> Floats:
    """The same later; by whole rows where it is later by more than two, so that rounding and holds stay."""
    dt = float(np.median(np.diff(t)))
    if delay < 2.0 * dt:
        return np.interp(t - delay, t, x)
    rows = min(round(delay / dt), x.size - 1)
    return np.concatenate([np.full(rows, x[0]), x[:-rows]])


def _skew(e: Exposure, size: float, shape: Floats) -> Pair:
    if shape[1] < 0.5:
        return e.y, late(e.reference, e.t, size)
    return late(e.y, e.t, size), e.reference


def _bandwidth(e: Exposure, size: float, shape: Floats) -> Pair:
    del shape
    return lagged(e.y, e.dt, size), e.reference


def _delay(e: Exposure, size: float, shape: Floats) -> float:
    """By how much slow motion is late behind a lag of rows: of a time constant within a row it is less than that."""
    del shape
    rest = float(np.exp(-e.dt / size))
    return e.dt * rest / (1.0 - rest)


def _hold(e: Exposure, size: float, shape: Floats) -> Pair:
    rows = max(round(size / e.dt), 2)
    at = (np.arange(e.y.size) + int(shape[0] * rows)) // rows * rows - int(shape[0] * rows)
    return e.y[np.maximum(at, 0)], e.reference


def _dead_band(e: Exposure, size: float, shape: Floats) -> Pair:
    if shape[1] < 0.5:  # below it nothing is shown, above it all
        return np.where(np.abs(e.u) < size, e.y - e.u, e.y), e.reference
    return e.y - np.clip(e.u, -size, size), e.reference


def _lock_in(e: Exposure, size: float, shape: Floats) -> Pair:
    del shape
    return e.y + np.sign(e.u) * np.sqrt(np.maximum(e.u**2 - size**2, 0.0)) - e.u, e.reference


def _hysteresis(e: Exposure, shape: Floats) -> Floats:
    radius = e.top * _between(shape, 0.08, 0.2)
    return (e.u - play(e.u, radius)) / radius


def _referred(e: Exposure, angle: Floats) -> Pair:
    """The reference with another angle: what the angle gains, the rate gains by time."""
    gained = angle - e.angle
    return e.y, e.reference + (gained if e.is_angle else np.gradient(gained, e.t))


def _backlash(e: Exposure, size: float, shape: Floats) -> Pair:
    del shape
    return _referred(e, play(e.angle, 0.5 * size))


def _harmonic(order: int) -> Callable[[Exposure, float, Floats], Pair]:
    return lambda e, size, shape: _referred(e, e.angle + size * np.cos(order * e.angle + 6.28 * shape[0]))


def _waves(order: int) -> Callable[[Exposure, Floats], Floats]:
    return lambda e, shape: np.cos(order * e.angle + 6.28 * shape[0])


def _clipped(e: Exposure, size: float, shape: Floats) -> Pair:
    del shape
    most = e.top * (1.0 - size)
    return np.clip(e.y, -most, most), e.reference


def _warmth(e: Exposure) -> Floats:
    assert e.kelvin is not None
    return e.kelvin - e.kelvin.mean()


def _thermal_lag(e: Exposure, shape: Floats) -> Floats:
    assert e.kelvin is not None
    return e.kelvin - lagged(e.kelvin, e.dt, e.length * _between(shape, 0.03, 0.1))


def _burst(e: Exposure, shape: Floats) -> Floats:
    begin = e.length * _between(shape, 0.1, 0.85)
    there = (e.t > begin) & (e.t < begin + min(20.0, 0.04 * e.length)) & e.longest
    rough = np.random.default_rng(int(1e6 * shape[1])).standard_normal(e.t.size)
    return np.where(there, rough, 0.0)


def _tone(e: Exposure, shape: Floats) -> Floats:
    low, high = 10.0 / e.length, min(0.2 / e.dt, 5.0)
    frequency = low * (high / low) ** shape[0] if high > low else low
    return np.sin(2 * np.pi * frequency * e.t + 6.28 * shape[1])


def _over_length(e: Exposure, size: float, shape: Floats) -> float:
    del shape
    return size / e.length


def _itself(e: Exposure, size: float, shape: Floats) -> float:
    del e, shape
    return size


#: What goes with the angle is asked where the angle was logged: from a rate alone nobody knows where a turn begins.
ANGLE = ("table_angle",)
#: Of a gyro beside a table. Sizes are shares, rad/s, rad or s; what is relative to the fastest rate says so.
TURNED: Mapping[str, Law] = {
    "scale_factor": Law(_added(lambda e, s: e.u), 0.3, ("scale_factor",), value=("c", _itself)),
    "scale_factor_asymmetry": Law(
        _added(lambda e, s: np.abs(e.u)), 0.1, ("scale_factor_asymmetry",), value=("c", _itself)
    ),
    "scale_factor_cubic": Law(
        _added(lambda e, s: e.u**3 / e.top**2),
        0.2,
        ("scale_factor_cubic", "sine_response"),
        value=("c", lambda e, size, s: size / e.top**2),
    ),
    "centripetal_acceleration": Law(
        _added(lambda e, s: e.u**2 / e.top),
        0.2,
        ("centripetal_acceleration",),
        value=("c", lambda e, size, s: size / e.top),
    ),
    "scale_factor_anomaly": Law(_added(_anomaly), 0.3, ("scale_factor_anomaly", "compensation_ripple")),
    "bias_drift": Law(_added(lambda e, s: e.t / e.length), 0.3, ("bias_drift",), value=("c", _over_length)),
    "bias_warm_up": Law(_added(_decay), 0.3, ("bias_warm_up",), value=("c", _itself)),
    "bias_step": Law(_added(_step), 0.3, ("bias_step",), value=("c", _itself)),
    "scale_factor_drift": Law(
        _added(lambda e, s: e.u * e.t / e.length), 0.2, ("scale_factor_drift",), value=("c", _over_length)
    ),
    "scale_factor_warm_up": Law(_added(lambda e, s: e.u * _decay(e, s)), 0.2, ("scale_factor_warm_up",)),
    "timing_skew": Law(_skew, 0.3, LATE, 1e-4, fast=True, value=("c", _itself)),
    "output_bandwidth": Law(_bandwidth, 0.3, LATE, 1e-3, fast=True, value=("c", _delay)),
    "sample_hold": Law(_hold, 0.4, ("sample_hold",), 1e-2, fast=True, value=("hold", _itself)),
    "dead_band": Law(_dead_band, 0.5, ("dead_band",), 1e-4, fast=True),
    "lock_in": Law(_lock_in, 0.5, ("lock_in", "rate_lock"), 1e-4, fast=True),
    "scale_factor_hysteresis": Law(_added(_hysteresis), 0.1, ("scale_factor_hysteresis",)),
    "encoder_backlash": Law(_backlash, 0.1, ("encoder_backlash",), 1e-5, fast=True, needs=ANGLE),
    "encoder_harmonic": Law(_harmonic(1), 0.1, ("encoder_harmonic",), 1e-6, value=("c", _itself), needs=ANGLE),
    "encoder_harmonic:2": Law(_harmonic(2), 0.05, ("encoder_harmonic",), 1e-6, value=("c", _itself), needs=ANGLE),
    "angle_locked_rate": Law(_added(_waves(1)), 0.1, ("angle_locked_rate",), value=("c", _itself), needs=ANGLE),
    "angle_locked_rate:2": Law(_added(_waves(2)), 0.1, ("angle_locked_rate",), value=("c", _itself), needs=ANGLE),
    "saturation": Law(_clipped, 0.5, ("saturation",), 0.02, fast=True),
    "bias_temperature": Law(
        _added(lambda e, s: _warmth(e)), 0.01, ("bias_temperature",), value=("c", _itself), needs=("temperature",)
    ),
    "scale_factor_temperature": Law(
        _added(lambda e, s: e.u * _warmth(e)), 0.01, ("scale_factor_temperature",), needs=("temperature",)
    ),
}
#: In rad/s or m/s^2 as they stand; the others are shares of the fastest rate.
ABSOLUTE = ("scale_factor", "scale_factor_asymmetry", "scale_factor_drift", "scale_factor_warm_up")
#: Of an instrument at rest.
RESTED: Mapping[str, Law] = {
    "bias_step": Law(_added(_step), 1.0, ("bias_step",), value=("c", _itself)),
    "bias_drift": Law(_added(lambda e, s: e.t / e.length), 1.0, ("bias_drift",), value=("c", _over_length)),
    "bias_warm_up": Law(_added(_decay), 1.0, ("bias_warm_up",), value=("c", _itself)),
    "tone": Law(_added(_tone), 1.0, ("tone",), value=("c", _itself), fast=True),
    "burst": Law(_added(_burst), 1.0, ("burst", "outliers"), fast=True),
    "common_line": Law(_added(_tone), 1.0, ("tone", "common_mode"), fast=True),
    "bias_temperature": Law(
        _added(lambda e, s: _warmth(e)), 0.1, ("bias_temperature",), value=("c", _itself), needs=("temperature",)
    ),
    "bias_thermal_lag": Law(
        _added(_thermal_lag),
        0.1,
        ("bias_thermal_lag", "bias_temperature_rate"),
        needs=("temperature",),
    ),
}


@dataclass(frozen=True)
class Triads:
    """A unit in attitudes: accelerometers and gyros by name, shape (n,)."""

    t: Floats
    values: Mapping[str, Floats]
    target: str
    other: str
    #: Whether each row is the mean of a rest.
    each: bool = False
    accels: tuple[str, ...] = field(default=("accel_x", "accel_y", "accel_z"))

    @property
    def forces(self) -> list[Floats]:
        """What the accelerometers read, x to z."""
        return [self.values[a] for a in self.accels]


@dataclass(frozen=True)
class UnitLaw:
    """An effect on a unit: the channels anew."""

    of: Callable[[Triads, float], Mapping[str, Floats]]
    high: float
    names: tuple[str, ...]
    gyro: bool = False
    #: Whether turns from rest to rest show it, not the means at rest.
    of_turns: bool = False
    #: Whether it is among the constants that any model of a triad has.
    declared: bool = False
    value: tuple[str, float] | None = None
    #: Sizes are drawn, not found: shares or radians between these.
    drawn: tuple[float, float] | None = None


def _plus(curve: Callable[[Triads], Floats]) -> Callable[[Triads, float], Mapping[str, Floats]]:
    return lambda x, size: {x.target: x.values[x.target] + size * curve(x)}


def _exchanged(x: Triads, size: float) -> Mapping[str, Floats]:
    del size
    return {x.target: x.values[x.other], x.other: x.values[x.target]}


def _flipped(x: Triads, size: float) -> Mapping[str, Floats]:
    del size
    return {x.target: -x.values[x.target]}


def _own(x: Triads) -> Floats:
    return x.values[x.target]


G = 9.80665
TURNED_WRONG = (
    "sign",
    "reversed",
    "exchang",
    "swap",
    "which axis",
    "order of the axes",
    "mirror",
    "left-handed",
    "axes",
)
IN_ATTITUDES: Mapping[str, UnitLaw] = {
    "accel_bias": UnitLaw(
        _plus(lambda x: 0.0 * _own(x) + 1.0), 2.0, ("accel_bias", "bias"), declared=True, value=("c", 1.0)
    ),
    "accel_scale_factor": UnitLaw(
        _plus(_own), 0.2, ("accel_scale_factor", "scale_factor"), declared=True, value=("c", 1.0)
    ),
    "non_orthogonality": UnitLaw(
        _plus(lambda x: x.values[x.other]), 0.1, ("non_orthogonality", "cross_axis"), value=None
    ),
    "accel_second_order": UnitLaw(_plus(lambda x: _own(x) ** 2 / G), 0.03, ("accel_second_order",)),
    "accel_asymmetry": UnitLaw(_plus(lambda x: np.abs(_own(x))), 0.03, ("accel_asymmetry",)),
    "bias_drift": UnitLaw(_plus(lambda x: x.t / x.t[-1]), 0.5, ("bias_drift",)),
    "gyro_scale_factor": UnitLaw(_plus(_own), 0.1, ("scale_factor",), gyro=True, of_turns=True, value=("c", 1.0)),
    "gyro_cross_axis": UnitLaw(
        _plus(lambda x: x.values[x.other]),
        0.1,
        ("cross_axis", "misalignment", "non_orthogonality"),
        gyro=True,
        of_turns=True,
    ),
    "g_sensitivity": UnitLaw(_plus(lambda x: x.forces[0]), 0.005, ("g_sensitivity",), gyro=True),
    "flipped": UnitLaw(_flipped, 1.0, TURNED_WRONG, gyro=True, drawn=(1.0, 1.0)),
    "exchanged": UnitLaw(_exchanged, 1.0, TURNED_WRONG, gyro=True, drawn=(1.0, 1.0)),
}
