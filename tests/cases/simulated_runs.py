"""Simulated runs for tests: a gyro on a rate table or at rest, triads on a rocking base, with manifests.

Everything is drawn from one seed: profile, temperature, noise, the gyro's own bias and scale factor.
The signal-to-noise ratio of an effect is the norm of its whitened means beside bias and scale factor,

    snr^2 = min_b || W (a - X b) ||^2,        W W' = inverse covariance of the noise,

with the true noise on the rows that are fitted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from motions import edges
from scipy.fft import dct

from insenv.core.motion import Motion
from insenv.core.recording import Channel, Floats, Mounting, Recording, Site
from insenv.data.manifest import Manifest
from insenv.data.manifest.spec import HeldOut, Model
from insenv.data.split import RowUse
from insenv.effects.base import CurveEffect, Effect, LinearEffect, NoiseEffect
from insenv.effects.catalogue import CATALOGUE, by_key
from insenv.identify.assemble import findings
from insenv.identify.findings import Findings
from insenv.identify.loop import trace

DEG_PER_HOUR = np.pi / 180 / 3600
KINDS = ("constant", "staircase", "reversal", "sine", "rest")
#: Share of a run that is fitted where a test does not say.
FITTED = 0.6
GRAVITY = 9.81

Injection = tuple[str, Floats]


@dataclass(frozen=True)
class Simulated:
    """A recording, the exposure it came from, and its noise, bias and scale factor (by effect id, SI)."""

    recording: Recording
    motion: Motion
    noise: Mapping[str, float]
    own: Mapping[str, float]


def table_rates(kind: str, n: int, dt: float, rng: np.random.Generator) -> Floats:
    """Mean rate of the table in each interval [rad/s]; steps take a second."""
    t = np.arange(n) * dt
    if kind == "constant":
        rate = np.full(n, rng.uniform(5, 40))
    elif kind == "staircase":
        levels = np.array([10.0, 15, 20, 30, 40, 60]) * rng.uniform(0.5, 1.5)
        levels = rng.permutation(np.concatenate([levels, -levels]))
        rate = levels[(np.arange(n) * 2 * len(levels) // n) % len(levels)]
    elif kind == "reversal":
        rate = rng.uniform(8, 30) * np.where((t // 150) % 2 == 0, 1.0, -1.0)
    elif kind == "sine":
        rate = rng.uniform(20, 60) * np.sin(2 * np.pi * t / rng.uniform(60, 200))
    else:
        rate = np.zeros(n)
    ramp = max(1, round(1 / dt))
    eased = np.convolve(np.concatenate([np.full(ramp, rate[0]), rate]), np.full(ramp, 1 / ramp))[ramp : ramp + n]
    return np.deg2rad(eased)


def gyro_motion(kind: str, rng: np.random.Generator, duration: float, dt: float) -> Motion:
    """Exposure of a gyro whose axis is the table's, warming up in a room that is cooled and heated."""
    n = round(duration / dt)
    t = edges(n, dt)
    rate = table_rates(kind, n, dt, rng)
    rise, swing, phase = rng.uniform(2, 10), rng.uniform(1, 4), rng.uniform(0, 6)
    warm_up, period = rng.uniform(0.1, 0.5) * duration, rng.uniform(0.4, 1.1) * duration
    return Motion(
        t=t,
        rate=rate,
        angle=None if kind == "rest" else np.concatenate([[0.0], np.cumsum(rate * dt)]),
        rate_edges=np.concatenate([rate[:1], 0.5 * (rate[1:] + rate[:-1]), rate[-1:]]),
        temperature=298.15 + rise * (1 - np.exp(-t / warm_up)) + swing * np.sin(2 * np.pi * t / period + phase),
    )


def drawn_noise(rng: np.random.Generator) -> dict[str, float]:
    """Coefficients of a gyro between a good and a fair one."""
    return {
        "angle_random_walk": rng.uniform(0.3, 1.2) * DEG_PER_HOUR,
        "bias_instability": float(np.exp(rng.uniform(np.log(0.02), np.log(0.3)))) * DEG_PER_HOUR,
        "rate_random_walk": float(np.exp(rng.uniform(np.log(0.0005), np.log(0.015)))) * DEG_PER_HOUR,
    }


def simulated_noise(noise: Mapping[str, float], n: int, dt: float, rng: np.random.Generator) -> Floats:
    """Sum of noise effects, each in its stationary state, shape (n,)."""
    total = np.zeros(n)
    for key, coefficient in noise.items():
        effect = by_key(key)
        assert isinstance(effect, NoiseEffect)
        state = effect.start(rng.standard_normal(effect.draws_at_start))
        total += effect.drive(np.array([coefficient]), dt, state, rng.standard_normal((1, n)))[0]
    return total


def gyro_run(
    kind: str,
    seed: int,
    added: tuple[Injection, ...] = (),
    duration: float = 3600.0,
    dt: float = 0.1,
    noise: Mapping[str, float] | None = None,
    with_temperature: bool = True,
) -> Simulated:
    """One run of a gyro with bias, scale factor, noise and the ``added`` effects."""
    rng = np.random.default_rng(seed)
    motion = gyro_motion(kind, rng, duration, dt)
    noise = drawn_noise(rng) if noise is None else noise
    own = {"scale_factor": 3e-4 * rng.standard_normal(), "bias": 5 * DEG_PER_HOUR * rng.standard_normal()}
    y = motion.rate * (1 + own["scale_factor"]) + own["bias"]
    y += simulated_noise(noise, motion.n, dt, rng)
    for key, theta in added:
        effect = by_key(key)
        y += effect.apply(motion.rate, motion, theta, effect.begin(motion, theta))[0]
    channels = {"gyro": Channel(y, "rad/s", "interval")}
    if motion.angle is not None:
        channels["table_angle"] = Channel(motion.angle[1:], "rad")
        channels["table_rate"] = Channel(motion.rate, "rad/s", "interval")
    if with_temperature:
        assert motion.temperature is not None
        channels["temperature"] = Channel(motion.temperature[1:] + 0.02 * rng.standard_normal(motion.n), "K")
    recording = Recording(motion.t[1:], channels, mounting=Mounting(np.pi / 2), label=f"{kind} {seed}")
    return Simulated(recording, motion, noise, own)


def strength(run: Simulated, key: str, theta: Floats, width: float = 1.0) -> float:
    """Signal-to-noise ratio of an effect on the fitted rows of a run, in means over ``width`` seconds."""
    effect, motion = by_key(key), run.motion
    added = effect.apply(motion.rate, motion, theta, effect.begin(motion, theta))[0]
    per_bin = round(width / motion.dt)
    bins = int(FITTED * motion.n) // per_bin

    def modes(values: Floats) -> Floats:
        means = values[: bins * per_bin].reshape(bins, per_bin).mean(axis=1)
        return dct(means, type=2, norm="ortho")[1:]

    lam = 4 * np.sin(0.5 * np.pi * np.arange(1, bins) / bins) ** 2
    spectra = [c**2 * _noise(k).spectrum(lam, width) for k, c in run.noise.items()]
    root = np.sqrt(np.sum(spectra, axis=0))
    x = (modes(motion.rate) / root)[:, None]
    a = modes(added) / root
    return float(np.linalg.norm(a - x @ np.linalg.lstsq(x, a, rcond=None)[0]))


def _noise(key: str) -> NoiseEffect:
    effect = by_key(key)
    assert isinstance(effect, NoiseEffect)
    return effect


def scaled(run: Simulated, key: str, theta: Floats, snr: float) -> Floats:
    """``theta`` with its linear parameters sized for a signal-to-noise ratio."""
    k = len(by_key(key).linear)
    theta = np.array(theta, float)
    theta[:k] *= snr / strength(run, key, theta)
    return theta


def with_effects(
    kind: str, seed: int, wanted: tuple[Injection, ...], snr: float, duration: float = 3600.0
) -> tuple[Simulated, tuple[Injection, ...]]:
    """A run with effects of a given strength each, and their parameters."""
    bare = gyro_run(kind, seed, duration=duration)
    sized = tuple((key, scaled(bare, key, np.asarray(theta, float), snr)) for key, theta in wanted)
    return gyro_run(kind, seed, sized, duration), sized


def manifest(
    targets: tuple[str, ...] = ("gyro",),
    declared: tuple[str, ...] = ("bias", "scale_factor"),
    bias: Literal["common", "per-run"] | None = None,
    averaging: float | None = None,
    noise: Mapping[str, float] | None = None,
) -> Manifest:
    """A manifest for recordings that are already in memory; ``noise`` is declared for every target."""
    return Manifest(
        path=Path("run.toml"),
        title="simulated",
        runs=(),
        channels={},
        model=Model(targets, declared, bias=bias),
        noise={target: noise or {} for target in targets},
        held_out=HeldOut(averaging=averaging),
    )


def use(n: int, fitted: float = FITTED) -> RowUse:
    """The first share of ``n`` rows fitted, the others held out."""
    fit = np.arange(n) < int(n * fitted)
    return RowUse(fit, ~fit)


def closed(
    recordings: tuple[Recording, ...] | Recording,
    asked: Manifest | None = None,
    uses: tuple[RowUse, ...] | None = None,
    catalogue: tuple[Effect, ...] = CATALOGUE,
    seed: int = 0,
) -> Findings:
    """The findings of closing the loop."""
    recordings = recordings if isinstance(recordings, tuple) else (recordings,)
    asked = asked or manifest(declared=declared_for(recordings[0]))
    uses = uses or tuple(use(len(r)) for r in recordings)
    return findings(asked, recordings, trace(asked, recordings, uses, catalogue, seed=seed))


def declared_for(recording: Recording) -> tuple[str, ...]:
    """What a maker declares at least: a scale factor too, where the table turns."""
    return ("bias", "scale_factor") if "table_angle" in recording.channels else ("bias",)


def without_rows(recording: Recording, *ranges: tuple[int, int]) -> Recording:
    """The recording with gaps: rows of half-open ``ranges`` are lost."""
    kept = np.ones(len(recording), bool)
    for start, stop in ranges:
        kept[start:stop] = False
    channels = {name: replace(c, values=c.values[kept]) for name, c in recording.channels.items()}
    return replace(recording, t=recording.t[kept], channels=channels)


def rocking_base(seed: int, duration: float = 1200.0, dt: float = 0.2, axes: str = "RFU") -> Recording:
    """Triads on a base that rocks by milliradians: accelerometers feel gravity tilt, gyros its rate.

    To first order a base turned by th reads the specific force up - th x up, times gravity.
    """
    rng = np.random.default_rng(seed)
    n = round(duration / dt)
    walk = np.cumsum(rng.standard_normal((2, n + 1)), axis=1) * 2e-5
    # In the directions right, forward, up; the base does not turn about the vertical.
    world = np.vstack([walk - walk[:, :1], np.zeros(n + 1)])
    rows = {"R": (0, 1), "F": (1, 1), "U": (2, 1), "L": (0, -1), "B": (1, -1), "D": (2, -1)}
    turn = np.array([sign * world[index] for index, sign in (rows[letter] for letter in axes)])
    up = np.array([float(letter == "U") - float(letter == "D") for letter in axes])
    mean_turn = 0.5 * (turn[:, 1:] + turn[:, :-1])
    force = GRAVITY * (up[:, None] - np.cross(mean_turn.T, up).T)
    channels = {}
    for k, axis in enumerate("xyz"):
        rate = np.diff(turn[k]) / dt + 1e-7 * rng.standard_normal(n)
        channels[f"gyro_{axis}"] = Channel(rate, "rad/s", "interval")
        noise = 3e-4 * rng.standard_normal(n) + 1e-3 * rng.standard_normal()
        channels[f"accel_{axis}"] = Channel(force[k] + noise, "m/s^2", "interval")
    t = edges(n, dt)[1:]
    return Recording(t, channels, site=Site(0.6), mounting=Mounting(axes=axes), label="rocking base")


def shaped(key: str, theta: tuple[float, ...]) -> Floats:
    """Parameters as an array, checked to be as many as the effect has."""
    effect = by_key(key)
    assert isinstance(effect, LinearEffect | CurveEffect) and len(theta) == len(effect.params)
    return np.array(theta)
