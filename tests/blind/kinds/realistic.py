"""The same causes as instruments have them: near the textbook's shape, never on it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from blind import curves
from blind.parts import Part, encoder, favourite, frequency, gyro, top
from blind.table import Floats
from blind.world import World

Rng = np.random.Generator


def late(w: World, r: Rng) -> float:
    """How far the sensing element is behind the thermometer: little beside what the temperature takes to change."""
    return float(w.duration * r.uniform(0.002, 0.008))


def drift(w: World, r: Rng) -> Part:
    """Slows down: an instrument ages fastest when it is new."""
    x = w.t / w.duration
    return gyro("bias_drift", w.mean(x - r.uniform(0.05, 0.2) * x**2))


def warm_up(w: World, r: Rng) -> Part:
    """Two bodies warm up: coil and housing."""
    tau = w.duration * r.uniform(0.08, 0.2)
    share = r.uniform(0.2, 0.4)
    both = (1 - share) * np.exp(-w.t / tau) + share * np.exp(-w.t / (tau * r.uniform(0.15, 0.35)))
    return gyro("bias_warm_up", w.mean(both))


def step(w: World, r: Rng) -> Part:
    """A step that relaxes by a part."""
    t0, tau = w.duration * r.uniform(0.12, 0.45), w.duration * r.uniform(0.01, 0.05)
    since = np.maximum(w.t - t0, 0.0)
    return gyro("bias_step", w.mean((w.t > t0) * (1 + r.uniform(0.2, 0.5) * np.exp(-since / tau))))


def temperature(w: World, r: Rng) -> Part:
    """The sensing element follows the thermometer late, and its curve is bent."""
    body = w.seen(w.climate.behind(late(w, r))) - w.reference
    width = max(float(np.ptp(body)), 1.0)
    bent = body + r.uniform(0.1, 0.25) * r.choice([-1, 1]) * body**2 / width
    return gyro("bias_temperature:1", w.mean(bent), "bias_temperature:2", "bias_temperature:3", "bias_temperature_rate",
                "bias_thermal_lag")  # fmt: skip


def temperature_rate(w: World, r: Rng) -> Part:
    body = w.climate.behind(late(w, r))
    return gyro("bias_temperature_rate", w.mean(body.slope(w.t.ravel()).reshape(w.t.shape)), "bias_thermal_lag")


def thermal_lag(w: World, r: Rng) -> Part:
    """Two lags: a gradient across a coil and one across its housing."""
    tau = w.duration * r.uniform(0.06, 0.2)
    slow, fast = w.seen(w.climate.behind(tau)), w.seen(w.climate.behind(tau * r.uniform(0.2, 0.4)))
    share = r.uniform(0.2, 0.4)
    return gyro("bias_thermal_lag", w.mean(w.kelvins - (1 - share) * slow - share * fast), "bias_temperature_rate")


def scale_drift(w: World, r: Rng) -> Part:
    x = w.t / w.duration
    return gyro("scale_factor_drift", w.mean(w.u * (x - r.uniform(0.05, 0.2) * x**2)))


def scale_warm_up(w: World, r: Rng) -> Part:
    tau, share = w.duration * r.uniform(0.08, 0.2), r.uniform(0.2, 0.4)
    both = (1 - share) * np.exp(-w.t / tau) + share * np.exp(-w.t / (tau * r.uniform(0.15, 0.35)))
    return gyro("scale_factor_warm_up", w.mean(w.u * both))


def scale_temperature(w: World, r: Rng) -> Part:
    body = w.seen(w.climate.behind(late(w, r))) - w.reference
    return gyro("scale_factor_temperature", w.mean(w.u * body))


def asymmetry(w: World, r: Rng) -> Part:
    """Smooth through zero, and a little stronger than proportional."""
    soft = top(w) * r.uniform(0.03, 0.1)
    return gyro("scale_factor_asymmetry", w.mean(w.u * np.tanh(w.u / soft) * (1 + 0.1 * np.abs(w.u) / top(w))))


def cubic(w: World, r: Rng) -> Part:
    x = w.u / top(w)
    return gyro("scale_factor_cubic", w.mean(x**3 + r.uniform(-0.25, 0.25) * x**5))


def anomaly(w: World, r: Rng) -> Part:
    """A resonance: Lorentzian, with long wings."""
    centre, width = favourite(w, r), top(w) * r.uniform(0.04, 0.1)
    return gyro("scale_factor_anomaly", w.mean(np.sign(w.u) / (1 + ((np.abs(w.u) - centre) / width) ** 2)))


def lock_in(w: World, r: Rng) -> Part:
    """The lock width itself warms up by a fifth; below it the beat is dead."""
    middle = w.rows - 0.5 * w.dt
    swell = 1 + r.uniform(-0.2, 0.2) * np.exp(-middle / (0.3 * w.duration))

    def addition(c: float) -> Floats:
        return curves.lock_in(w, np.sqrt(abs(c)) * swell)

    return Part("lock_in", addition, (0.01 * top(w)) ** 2)


def harmonics(order: int) -> Callable[[World, Rng], Part]:
    """Eccentricity comes with swash and graduation errors: further harmonics."""

    def part(w: World, r: Rng) -> Part:
        more = [k for k in (1, 2, 3, 4) if k != order]
        sizes = {order: 1.0, **{int(k): s for k, s in zip(r.permutation(more)[:2], (0.3, 0.15), strict=True)}}
        error = np.sum([s * curves.encoder(w, k, r.uniform(0, 6)) for k, s in sizes.items()], axis=0)
        return encoder(w, f"encoder_harmonic:{order}", error, *(f"encoder_harmonic:{k}" for k in sizes))

    return part


def locked(order: int) -> Callable[[World, Rng], Part]:
    """The field of a motor: not a pure sine."""

    def part(w: World, r: Rng) -> Part:
        curve = curves.locked(w, order, r.uniform(0, 6)) + 0.25 * curves.locked(w, 2 * order, r.uniform(0, 6))
        return gyro(f"angle_locked_rate:{order}", curve, f"angle_locked_rate:{2 * order}")

    return part


def skew(w: World, r: Rng) -> Part:
    """Encoder and gyro have different delays, and the encoder's filter rings down: two echoes."""
    share = r.uniform(0.2, 0.4)

    def reading(c: float) -> Floats:
        return (1 - share) * curves.late(w, c) + share * curves.late(w, 3 * c)

    return Part("timing_skew", lambda c: w.encoder_shift(reading(c)), 1e-4, reading)


def tone(w: World, r: Rng) -> Part:
    """Two machines of nearly one speed."""
    f = frequency(w, r)
    near = f + r.choice([-1, 1]) * r.uniform(1.5, 4) / w.duration
    return gyro("tone", curves.tone(w, f, r.uniform(0, 6)) + 0.35 * curves.tone(w, near, r.uniform(0, 6)))


def bent_scale(w: World, r: Rng) -> Part:
    """A wrong scale factor that bends slightly at high rates."""
    x = w.u / top(w)
    return gyro("scale_factor", w.mean(x + 0.05 * x**3))


REALISTIC: dict[str, Callable[[World, Rng], Part]] = {
    "bias_drift": drift,
    "bias_warm_up": warm_up,
    "bias_step": step,
    "bias_temperature:1": temperature,
    "bias_temperature_rate": temperature_rate,
    "bias_thermal_lag": thermal_lag,
    "scale_factor": bent_scale,
    "scale_factor_drift": scale_drift,
    "scale_factor_warm_up": scale_warm_up,
    "scale_factor_temperature": scale_temperature,
    "scale_factor_asymmetry": asymmetry,
    "scale_factor_cubic": cubic,
    "scale_factor_anomaly": anomaly,
    "lock_in": lock_in,
    **{f"encoder_harmonic:{k}": harmonics(k) for k in (1, 2, 3, 4)},
    **{f"angle_locked_rate:{k}": locked(k) for k in (1, 2)},
    "timing_skew": skew,
    "tone": tone,
}
