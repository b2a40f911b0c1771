"""Runs of a north finder for tests: a laser gyro on a table, straight from the rig."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.estimate import Datasheet, Declared, Limits, Policy
from insenv.core.recording import Channel, Floats, Mounting, Recording, Site
from insenv.core.units import ARCSEC, DEG, DEG_PER_SQRT_HOUR
from insenv.effects.base import Effect
from insenv.effects.catalogue import by_key
from insenv.plants.profile import Piece, Profile, constant
from insenv.plants.turntable import Encoder, Ripple, Turntable
from insenv.rig import Fitted, Normals, Rig, RigState
from insenv.scenario import Scenario, datasheet
from insenv.sensors.chain import Sensor
from insenv.sensors.counter import count

PULSE = 0.46634601 * ARCSEC
WALK = 3e-4 * DEG_PER_SQRT_HOUR
LATITUDE, TILT, RATE = 40 * DEG, 30 * DEG, 10 * DEG


@dataclass(frozen=True)
class Case:
    """An instrument and a run; ``effects`` are (key, values) on the gyro beside the Earth's rate and the noise."""

    duration: float = 300.0
    sampling: float = 100.0
    tilt: float = TILT
    latitude: float = LATITUDE
    acceleration: float = np.inf
    profile: Profile = constant(RATE, np.inf)
    walk: float = WALK
    pulse: float = PULSE
    encoder_noise: float = 0.0
    effects: tuple[tuple[str, tuple[float, ...]], ...] = ()
    declared: tuple[Declared, ...] = ()
    noise: dict[str, float] = field(default_factory=dict)
    ripple: float = 0.0

    def datasheet(self) -> Datasheet:
        return Datasheet(
            sampling=self.sampling,
            duration=self.duration,
            site=Site(latitude=self.latitude),
            mounting=Mounting(tilt=self.tilt),
            limits=Limits(100 * DEG, self.acceleration),
            noise={"gyro": {"angle_random_walk": self.walk, **self.noise}},
            pulse=self.pulse,
            encoder_noise=self.encoder_noise,
            declared=self.declared,
        )

    @property
    def level(self) -> float:
        return float(EARTH_RATE * np.cos(self.latitude) * np.cos(self.tilt))

    def run(self, azimuth: Floats, seed: int = 0) -> Recording:
        """Recording of a batch, one row for each azimuth."""
        chain = [(e, v) for e, v in ((by_key(k), v) for k, v in self.effects)]
        chain += [(by_key(k), (v,)) for k, v in {"angle_random_walk": self.walk, **self.noise}.items() if v]
        effects: tuple[Effect, ...] = (by_key("earth_rate"), *(e for e, _ in chain))
        flat = np.array([x for _, v in chain for x in v])
        earth = self.level * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
        theta = np.concatenate([earth, np.broadcast_to(flat, (len(azimuth), len(flat)))], axis=-1)
        table = Turntable(
            tilt=self.tilt,
            latitude=self.latitude,
            max_acceleration=self.acceleration,
            encoder=Encoder(noise=self.encoder_noise),
            ripple=Ripple(self.ripple),
            profile=self.profile,
        )
        rig = Rig(table, (Fitted(Sensor("gyro", effects), theta),), self.sampling)
        n = round(self.duration * self.sampling)
        normals = Normals(rig, seed, len(azimuth))
        readings, _ = rig.advance(rig.begin(normals.start()), None, n, normals.draw(n))
        gyro = np.broadcast_to(readings.outputs["gyro"], (len(azimuth), n))
        if self.pulse:
            phase = np.random.default_rng(seed).random(len(azimuth))
            gyro = count(gyro / (self.sampling * self.pulse), phase)[0] * (self.pulse * self.sampling)
        angle = np.broadcast_to(readings.references["table_angle"].values, (len(azimuth), n))
        return Recording(readings.t, {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(angle, "rad")})


def there_and_back(rate: float = RATE, at: float = 149.75) -> Profile:
    """From rest, one way and the other."""
    return (Piece(1e-9, 0.0), Piece(at, rate), Piece(np.inf, -rate))


def azimuths(count: int, seed: int = 1) -> Floats:
    return np.pi * (1 - 2 * np.random.default_rng(seed).random(count))


def row(recording: Recording, index: int) -> Recording:
    channels = {k: replace(c, values=c.values[index]) for k, c in recording.channels.items()}
    return replace(recording, channels=channels)


def piece(recording: Recording, start: int, stop: int) -> Recording:
    channels = {k: replace(c, values=c.values[..., start:stop]) for k, c in recording.channels.items()}
    return replace(recording, t=recording.t[start:stop], channels=channels)


def wrapped(x: Floats) -> Floats:
    return np.pi - np.mod(np.pi - x, 2 * np.pi)


def play(scenario: Scenario, policy: Policy, seeds: range) -> tuple[Recording, Floats]:
    """A batch of runs of a packaged scenario in steps of its task, and their true azimuths."""
    recording, rig, _ = played(scenario, policy, seeds)
    assert isinstance(rig.plant, Turntable)
    return recording, np.asarray(rig.plant.azimuth)


def played(scenario: Scenario, policy: Policy, seeds: range) -> tuple[Recording, Rig, RigState]:
    """The same, with the rig and where it stands at the end."""
    assert scenario.task is not None
    rig, sheet = scenario.cast(seeds), datasheet(scenario)
    normals, phase = Normals(rig, seeds), scenario.phases(seeds, "gyro")
    state, memory = rig.begin(normals.start()), policy.reset(len(seeds))
    weight = sheet.pulse * sheet.sampling
    parts: list[Recording] = []
    for _ in range(scenario.task.steps):
        action, memory = policy.act(memory, parts[-1] if parts else None, None)
        n = scenario.task.samples
        readings, state = rig.advance(state, action[:, 0], n, normals.draw(n))
        counts, phase = count(readings.outputs["gyro"] / weight, phase)
        channels = {"gyro": Channel(counts * weight, "rad/s", "interval")}
        channels["table_angle"] = Channel(readings.references["table_angle"].values, "rad")
        if "accel_x" in readings.outputs:
            channels["accel_x"] = Channel(readings.outputs["accel_x"], "m/s^2", "interval")
        parts.append(Recording(readings.t, channels))
    return joined(parts), rig, state


def joined(parts: list[Recording]) -> Recording:
    channels = {
        name: replace(first, values=np.concatenate([p.channels[name].values for p in parts], axis=-1))
        for name, first in parts[0].channels.items()
    }
    return replace(parts[0], t=np.concatenate([p.t for p in parts]), channels=channels)
