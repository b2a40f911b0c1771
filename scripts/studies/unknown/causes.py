"""Causes that laboratories have and catalogues lack, and ordinary ones beside them, as additions to the rows of a run.

Each takes a run and a size and returns what the gyro reads too much [rad/s] and what the encoder reads too much [rad],
both at the rows of the run. Sources: the operators of play and stop are those of M. Brokate and J. Sprekels, Hysteresis
and Phase Transitions (1996); the others are written beside the functions.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from world import Floats, Rng, Run

#: Run, size -> what the gyro and what the encoder read too much, both (n,).
Curve = Callable[[Run, float], tuple[Floats, Floats]]


@dataclass(frozen=True)
class Cause:
    """One thing that is wrong.

    Attributes
    ----------
    name : str
    accepted : tuple of str
        Names of the contract that do it justice.
    curve : callable
    size : float
        From which the search for a strength begins.
    harmless : tuple of str
        Names that may stand beside an accepted one: the cause's own higher orders.
    """

    name: str
    accepted: tuple[str, ...]
    curve: Curve
    size: float = 1e-5
    harmless: tuple[str, ...] = field(default=())


def play(x: Floats, radius: float) -> Floats:
    """What follows ``x`` through a gap of ``radius`` either way, from the middle of the gap."""
    out = np.empty_like(x)
    now = x[0]
    for i, value in enumerate(x):
        now = min(max(now, value - radius), value + radius)
        out[i] = now
    return out


def lagged(x: Floats, step: float, tau: float, start: float | None = None) -> Floats:
    """First-order lag of what is given at even times."""
    out = np.empty_like(x)
    now = x[0] if start is None else start
    decayed, before = np.exp(-step / tau), x[0]
    for i, value in enumerate(x):
        # Exact for what is linear between two times.
        behind = (value - before) / step * tau
        now = value - behind + (now - before + behind) * decayed
        before = value
        out[i] = now
    return out


def _gyro(of: Callable[[Run], Floats]) -> Curve:
    def curve(run: Run, size: float) -> tuple[Floats, Floats]:
        added = of(run)
        return size * added, np.zeros(run.n)

    return curve


def backlash() -> Cause:
    """An encoder on a coupling with play: it stays behind after each reversal."""

    def curve(run: Run, size: float) -> tuple[Floats, Floats]:
        angle = run.fine_angle
        wrong = (play(angle, 0.5 * size) - angle)[::4]
        return np.zeros(run.n), wrong[1:]

    return Cause("encoder_backlash", ("encoder_backlash",), curve, 1e-6)


def hysteresis_stop(top: float) -> Cause:
    """A scale factor that depends on the way to a rate: the stop operator of a tenth of the range."""

    def of(run: Run) -> Floats:
        return run.rows(run.fine - play(run.fine, 0.3 * top))

    return Cause("scale_factor_hysteresis", ("scale_factor_hysteresis",), _gyro(of), 1e-6)


def hysteresis_loop(top: float) -> Cause:
    """A loop between turning points: above on the way up, below on the way down, closed at the largest rates."""

    def of(run: Run) -> Floats:
        change = np.sign(np.diff(run.fine, prepend=run.fine[0]))
        last = np.maximum.accumulate(np.where(change != 0, np.arange(len(change)), 0))
        way = change[last]
        return run.rows(way * np.maximum(0.0, 1 - (run.fine / top) ** 2)) * top

    return Cause("scale_factor_hysteresis", ("scale_factor_hysteresis",), _gyro(of), 1e-6)


def backlash_soft() -> Cause:
    """Play with friction and a spring: the error goes over exponentially in the angle, within a third of a degree."""

    def curve(run: Run, size: float) -> tuple[Floats, Floats]:
        angle, reach, now, out = run.fine_angle, 0.3 * np.pi / 180, 0.0, np.zeros(len(run.fine))
        for i, step in enumerate(np.diff(angle)):
            now += (np.sign(step) - now) * (1 - np.exp(-abs(step) / reach))
            out[i + 1] = now
        return np.zeros(run.n), -0.5 * size * out[4::4]

    return Cause("encoder_backlash", ("encoder_backlash",), curve, 1e-6)


def hysteresis_wen(top: float) -> Cause:
    """The loop of Bouc and Wen: z' = u' (1 - 0.3 abs(z) / r) - 0.7 abs(u') z / r, r a fifth of the range."""

    def of(run: Run) -> Floats:
        reach, now, out = 0.2 * top, 0.0, np.zeros(len(run.fine))
        for i, step in enumerate(np.diff(run.fine)):
            now += step - 0.7 * abs(step) * now / reach - 0.3 * step * abs(now) / reach
            out[i + 1] = now
        return run.rows(out)

    return Cause("scale_factor_hysteresis", ("scale_factor_hysteresis",), _gyro(of), 1e-6)


def dead_band_soft() -> Cause:
    """A threshold that noise makes smooth: what is lost falls as a Gaussian of the rate."""

    def curve(run: Run, size: float) -> tuple[Floats, Floats]:
        return run.rows(-run.fine * np.exp(-((run.fine / size) ** 2))), np.zeros(run.n)

    return Cause("dead_band", ("dead_band", "lock_in"), curve, 1e-4)


def bandwidth_second() -> Cause:
    """Two first-order lags behind each other."""

    def curve(run: Run, size: float) -> tuple[Floats, Floats]:
        once = lagged(run.fine, run.dt / 4, 0.6 * size)
        return run.rows(lagged(once, run.dt / 4, 0.4 * size) - run.fine), np.zeros(run.n)

    return Cause("bandwidth", ("output_bandwidth", "timing_skew"), curve, 1e-3)


def self_heating_two(quick: float, slow: float) -> Cause:
    """Heat that comes by two ways."""

    def of(run: Run) -> Floats:
        heat = run.fine**2
        both = [0.4 * lagged(heat, run.dt / 4, quick, 0.0), 0.6 * lagged(heat, run.dt / 4, slow, 0.0)]
        return run.rows(both[0] + both[1])

    return Cause("self_heating", ("self_heating",), _gyro(of), 1e-6)


def dead_band() -> Cause:
    """Below a threshold nothing is read; above it all is."""

    def curve(run: Run, size: float) -> tuple[Floats, Floats]:
        return run.rows(np.where(np.abs(run.fine) < size, -run.fine, 0.0)), np.zeros(run.n)

    return Cause("dead_band", ("dead_band",), curve, 1e-4)


def dead_zone() -> Cause:
    """Below a threshold nothing is read; above it what exceeds it."""

    def curve(run: Run, size: float) -> tuple[Floats, Floats]:
        return run.rows(-np.clip(run.fine, -size, size)), np.zeros(run.n)

    return Cause("dead_zone", ("dead_band",), curve, 1e-7)


def bandwidth() -> Cause:
    """The output is a first-order lag of the rate, of ``size`` seconds."""

    def curve(run: Run, size: float) -> tuple[Floats, Floats]:
        return run.rows(lagged(run.fine, run.dt / 4, size) - run.fine), np.zeros(run.n)

    return Cause("bandwidth", ("output_bandwidth", "timing_skew"), curve, 1e-3)


def wobble(order: int, forward: bool, tilt: float, phase: float) -> Cause:
    """The table's axis moves on a circle ``order`` times a turn: Sensors 13 (2013) 2750."""

    def of(run: Run) -> Floats:
        k = order - 1 if forward else order + 1
        if k == 0:
            return np.zeros(run.n)
        wave = np.cos(k * run.fine_angle + phase)[::4]
        return np.asarray(np.diff(wave) / run.dt * order / k * np.cos(tilt))

    return Cause("wobble", ("wobble",), _gyro(of), 1e-7)


def self_heating(tau: float, power: float) -> Cause:
    """A motor, or the electronics, that heat the gyro with what was driven: bias after a first-order lag."""

    def of(run: Run) -> Floats:
        return run.rows(lagged(np.abs(run.fine) ** power, run.dt / 4, tau, 0.0))

    return Cause("self_heating", ("self_heating",), _gyro(of), 1e-6)


def centripetal(power: int) -> Cause:
    """g-sensitivity, or g^2-sensitivity, at a lever arm: u^2, u^4."""

    def of(run: Run) -> Floats:
        return run.rows(run.fine**power)

    return Cause("centripetal", ("centripetal_acceleration",), _gyro(of), 1e-7)


def settling_after_moves(tau: float) -> Cause:
    """The base, or the fluid of a support, comes to rest exponentially after each move."""

    def of(run: Run) -> Floats:
        moving = np.abs(run.rate) > 1e-3
        since = np.arange(run.n) - np.maximum.accumulate(np.where(moving, np.arange(run.n), 0))
        way = np.sign(run.rate)
        last = np.maximum.accumulate(np.where(moving, np.arange(run.n), 0))
        return np.asarray(np.where(moving, 0.0, way[last] * np.exp(-since * run.dt / tau)))

    return Cause("settling_after_moves", ("settling_after_turn",), _gyro(of), 1e-7)


def settling(tau: float) -> Cause:
    """A base that settles: a single gyro sees the rate of an exponential tilt, as it sees a warm-up."""
    return Cause("base_settling", ("base_settling", "bias_warm_up"), _gyro(lambda run: np.exp(-run.t / tau)))


# Ordinary causes, for controls and pairs.


def _angle(order: int, phase: float) -> Curve:
    def curve(run: Run, size: float) -> tuple[Floats, Floats]:
        return np.zeros(run.n), size * (np.cos(order * run.angle[1:] + phase) - np.cos(phase))

    return curve


def _late(run: Run, size: float) -> tuple[Floats, Floats]:
    return np.interp(run.t - size, run.t, run.rate) - run.rate, np.zeros(run.n)


def ordinary(name: str, run: Run, rng: Rng) -> Cause:
    """A cause of the contract, by its formula."""
    total, top = run.n * run.dt, max(float(np.abs(run.fine).max()), 1e-9)
    tau, when = total * rng.uniform(0.06, 0.15), total * rng.uniform(0.2, 0.45)
    phase = float(rng.uniform(0, 6))
    hertz = float(rng.uniform(30, 60) / total)
    curves: dict[str, tuple[Curve, float]] = {
        "bias_drift": (_gyro(lambda r: r.t), 1e-10),
        "bias_warm_up": (_gyro(lambda r: np.exp(-r.t / tau)), 1e-7),
        "bias_step": (_gyro(lambda r: np.asarray(r.t > when, float)), 1e-7),
        "bias_temperature": (_gyro(lambda r: r.temperature - 25), 1e-8),
        "scale_factor_temperature": (_gyro(lambda r: r.rate * (r.temperature - 25)), 1e-7),
        "scale_factor_asymmetry": (_gyro(lambda r: np.abs(r.rate)), 1e-7),
        "scale_factor_cubic": (_gyro(lambda r: r.rate * (r.rate / top) ** 2), 1e-7),
        "scale_factor_drift": (_gyro(lambda r: r.rate * r.t / total), 1e-7),
        "encoder_harmonic": (_angle(1, phase), 1e-7),
        "timing_skew": (_late, 1e-5),
        "tone": (_gyro(lambda r: np.cos(2 * np.pi * hertz * r.t + phase)), 1e-7),
    }
    curve, size = curves[name]
    # A wobble is the curve of a harmonic at one tilt: as a rival it is no fault, it only stands beside.
    harmless = ("bias_temperature",) if "temperature" in name else ()
    return Cause(name, (name,), curve, size, harmless)


def common(run: Run) -> dict[str, Callable[[Run], Floats]]:
    """Ordinary curves by name, (n,) or (n, k), "name/shape" where there are shapes: what could be taken for a cause."""
    total = run.n * run.dt
    out: dict[str, Callable[[Run], Floats]] = {
        "bias_drift": lambda r: r.t,
        "bias_temperature": lambda r: np.column_stack([r.temperature - 25, (r.temperature - 25) ** 2]),
        "scale_factor_temperature": lambda r: r.rate * (r.temperature - 25),
        "scale_factor_asymmetry": lambda r: np.abs(r.rate),
        "scale_factor_cubic": lambda r: r.rate**3,
        "scale_factor_drift": lambda r: r.rate * r.t,
        "timing_skew": lambda r: np.gradient(r.rate, r.dt),
    }
    for share in (0.03, 0.06, 0.1, 0.15, 0.25):
        out[f"bias_warm_up/{share}"] = partial(_decay, share * total)
    for order in (1, 2, 3, 4):
        out[f"encoder_harmonic/{order}"] = partial(_harmonic, order)
        out[f"angle_locked_rate/{order}"] = partial(_locked, order)
    return out


def _decay(tau: float, run: Run) -> Floats:
    return np.asarray(np.exp(-run.t / tau))


def _harmonic(order: int, run: Run) -> Floats:
    wave = np.column_stack([np.cos(order * run.angle), np.sin(order * run.angle)])
    return np.asarray(np.diff(wave, axis=0) / run.dt)


def _locked(order: int, run: Run) -> Floats:
    return np.column_stack([np.cos(order * run.angle[1:]), np.sin(order * run.angle[1:])])
