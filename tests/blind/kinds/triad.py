"""Three gyros and three accelerometers at rest: one of the six drifts, steps, warms, hums, or tilts with its base."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from blind import climate, curves, noise, table
from blind.files import UNITS, Column, Layout, rounded_up
from blind.noise import DEG_H, ROOT_H, Noise
from blind.parts import Part, frequency, gyro
from blind.strength import Ruler
from blind.table import Floats
from blind.world import GRAVITY, World

Rng = np.random.Generator
#: Accelerometers: log-uniform ranges of N [m/s/sqrt h] and B [ug].
ACCEL = ((0.003, 0.1), (1.0, 60.0))


@dataclass(frozen=True)
class Bench:
    """A unit on a slab; ``world`` rests, ``target`` is the channel that is wrong."""

    world: World
    target: str
    noises: dict[str, Noise]
    tilt: Floats  # of the base about y [rad], at the rows
    layout: Layout

    @property
    def own(self) -> Noise:
        return self.noises[self.target]


def bench(rng: Rng, target: str) -> Bench:
    n, rate = int(rng.integers(6000, 40_000)), float(rng.choice([10.0, 20.0, 50.0]))
    w = World(
        n=n,
        dt=1 / rate,
        profile="rest",
        trajectory=table.draw("rest", n / rate, 1.0, rng),
        climate=climate.draw(str(rng.choice(climate.KINDS)), n / rate, rng),
        tilt=np.pi / 2,
        latitude=0.0,
    )
    grade = str(rng.choice(["fibre", "mems"]))
    kinds = {f"gyro_{a}": noise.draw(grade, rng) for a in "xyz"} | {f"accel_{a}": _accel_noise(rng) for a in "xyz"}
    return Bench(w, target, kinds, np.zeros(n), Layout(".csv", ",", True))


def _accel_noise(rng: Rng) -> Noise:
    n, b = (float(np.exp(rng.uniform(np.log(low), np.log(high)))) for low, high in ACCEL)
    return Noise(n / 60, b * 1e-6 * 9.80665, b * 1e-6 * 9.80665 / 500)


def columns(rig: Bench, addition: Floats, rng: Rng) -> tuple[list[Column], Floats]:
    """All channels, and the noise of the target."""
    w, made, kept = rig.world, [], np.zeros(rig.world.n)
    level = {"accel_z": GRAVITY}
    for channel, coefficients in rig.noises.items():
        z = noise.rates(coefficients, w.n, w.dt, rng)
        value = level.get(channel, 0.0) + z + 5 * coefficients.b * rng.standard_normal()
        if channel == "gyro_y":
            value = value + np.gradient(rig.tilt, w.dt)
        if channel == "accel_x":
            value = value - GRAVITY * rig.tilt
        if channel == rig.target:
            value, kept = value + addition, z
        unit = "m/s^2" if channel.startswith("accel") else "deg/s"
        step = rounded_up(coefficients.n / np.sqrt(w.dt) * 0.1 / UNITS[unit])
        made.append(Column(channel, channel, np.round(value / UNITS[unit] / step) * step, 12, unit,
                           {"covers": '"interval"'}))  # fmt: skip
    reading = climate.thermometer(w.climate, w.rows, rng)
    return [*made, Column("temperature", "temp", reading, 4, "degC")], kept


def measure(rig: Bench, fitted: int) -> Ruler:
    return Ruler(rig.own, rig.world.dt, [np.arange(fitted)], np.zeros((rig.world.n, 0)))


#: Causes on one channel of a unit at rest.
CAUSES: dict[str, Callable[[World, Rng], Part]] = {
    "bias_drift": lambda w, r: gyro("bias_drift", curves.drift(w)),
    "bias_step": lambda w, r: gyro("bias_step", curves.step(w, w.duration * r.uniform(0.12, 0.48))),
    "bias_temperature:1": lambda w, r: gyro("bias_temperature:1", curves.temperature(w)),
    "bias_warm_up": lambda w, r: gyro("bias_warm_up", curves.warm_up(w, w.duration * r.uniform(0.05, 0.2))),
    "tone": lambda w, r: gyro("tone", curves.tone(w, frequency(w, r))),
}


def tilting(rig: Bench, strength: float, fitted: int, rng: Rng) -> Bench:
    """The slab sways: gyro y feels its rate, accelerometer x its angle."""
    w = rig.world
    way = np.zeros(w.n)
    for _ in range(3):
        way += rng.uniform(0.3, 1) * curves.tone(w, rng.uniform(4, 25) / w.duration, rng.uniform(0, 6))
    felt = measure(rig, fitted).beside(-GRAVITY * way)
    # The gyros must feel it too, or nobody can trace it: quiet gyros, as a unit for such work has.
    quiet = {f"gyro_{a}": Noise(1e-3 * ROOT_H, 1e-3 * DEG_H, 1e-4 * DEG_H / 60) for a in "xyz"}
    return replace(rig, tilt=way * strength / felt, noises=rig.noises | quiet)
