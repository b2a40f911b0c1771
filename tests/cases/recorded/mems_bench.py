"""A MEMS unit on a bench, as no simulator has it: lines that all axes share and whose phase wanders, bursts, settling.

Shares no code with what is fitted. Six channels at rest, 100 Hz: readings are coarse (steps of 3.33 mg and 0.05 deg/s),
white noise and flicker are each channel's own; the building hums at one frequency that drifts, on all accelerometers
together; somebody touches the bench for some seconds, and the unit settles when the recording begins.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from insenv.core.recording import Channel, Floats, Recording

G = 9.80665
ACCELS, GYROS = ("accel_x", "accel_y", "accel_z"), ("gyro_x", "gyro_y", "gyro_z")
#: Each axis' share of what all have in common.
COMMON = (1.0, 0.7, 0.6)


@dataclass(frozen=True)
class Bench:
    """What is on.

    Attributes
    ----------
    line : float
        Amplitude of the common line on the first axis [m/s^2].
    wander : float
        Random walk of its frequency [Hz/sqrt(s)].
    bursts : tuple of (start [s], length [s], size [m/s^2])
    settling : float
        What the first 25 s are off by [m/s^2].
    step : float
        A real step at 40 % of the time, on accel_x [m/s^2].
    rounded : bool
        Whether readings are rounded.
    """

    line: float = 0.0
    frequency: float = 0.56
    wander: float = 1e-4
    bursts: tuple[tuple[float, float, float], ...] = ()
    settling: float = 0.0
    step: float = 0.0
    rounded: bool = True


FULL = Bench(line=0.01, bursts=((310.0, 18.0, 0.03), (780.0, 14.0, -0.025)), settling=-0.03)


def bench(what: Bench = FULL, seed: int = 0, duration: float = 1000.0, dt: float = 0.01) -> Recording:
    """One recording."""
    rng = np.random.default_rng(seed)
    n = round(duration / dt)
    t = np.linspace(0.0, duration - dt, n)
    walk = np.cumsum(what.wander * np.sqrt(dt) * rng.standard_normal(n))
    phase = 2 * np.pi * np.cumsum(what.frequency + walk) * dt + rng.uniform(0, 6)
    common = what.line * np.cos(phase)
    for start, length, size in what.bursts:
        common = common + size * _touched(t, start, length, rng)
    channels = {}
    for axis, name in enumerate(ACCELS):
        level = (0.02, -0.01, G)[axis] + what.settling * (t < 25.0) * (0.8 + 0.2 * axis)
        level = level + what.step * (t > 0.4 * duration) * (axis == 0)
        own = 0.033 * rng.standard_normal(n) + flicker(n, dt, 0.001, rng)
        channels[name] = Channel(_rounded(level + COMMON[axis] * common + own, 3.33e-3 * G, what), "m/s^2")
    for name in GYROS:
        own = 6e-3 * rng.standard_normal(n) + flicker(n, dt, 1e-4, rng)
        channels[name] = Channel(_rounded(own, np.deg2rad(0.05), what), "rad/s")
    return Recording(t, channels, label=f"bench {seed}")


def _touched(t: Floats, start: float, length: float, rng: np.random.Generator) -> Floats:
    """Off the level for a while, uneven, with soft edges; 0 outside."""
    inside = (t > start) & (t < start + length)
    shape = np.minimum(1.0, np.minimum(t - start, start + length - t) / 1.5)
    return np.where(inside, shape * (1 + 0.2 * np.sin(2 * np.pi * (t - start) / rng.uniform(3, 6))), 0.0)


def flicker(n: int, dt: float, size: float, rng: np.random.Generator) -> Floats:
    """Sum of first-order processes, one an octave."""
    total, tau = np.zeros(n), 1.0
    while tau < 3e4:
        step = max(1, round(0.05 * tau / dt))
        count = n // step + 2
        rho = np.exp(-step * dt / tau)
        z = rng.standard_normal(count) * np.sqrt(1 - rho**2)
        z[0] /= np.sqrt(1 - rho**2)
        x = np.empty(count)
        x[0] = z[0]
        for i in range(1, count):
            x[i] = rho * x[i - 1] + z[i]
        total += size * np.interp(np.arange(n), np.arange(count) * step, x)
        tau *= 4.0
    return total


def _rounded(values: Floats, step: float, what: Bench) -> Floats:
    return np.rint(values / step) * step if what.rounded else values


def clipped(recording: Recording, name: str, low: float, high: float) -> Recording:
    """The recording with one channel that clips."""
    channel = recording.channels[name]
    return replace(
        recording,
        channels={**recording.channels, name: replace(channel, values=np.clip(channel.values, low, high))},
    )
