"""Runs of a vehicle that rests, turns and rests, from exact increments with biases and white noise."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from insenv.core.attitude import dcm_from_angles
from insenv.core.estimate import Datasheet, Declared, Estimator, Limits, Policy, Sight
from insenv.core.recording import Channel, Floats, Recording, Site
from insenv.core.units import ARCMIN, ARCSEC, DEG, DEG_PER_HOUR, DEG_PER_SQRT_HOUR
from insenv.navigation.truth import increments, increments_at_rest, turn

LATITUDE, ALTITUDE = 38 * DEG, 380.0
#: Micro-g of the published study.
UG = 9.8e-6
#: Angle random walk and velocity random walk of the readings of Table 1.
A = (1.67e-5 * DEG_PER_SQRT_HOUR, 2 * UG)
A2 = (1.67e-4 * DEG_PER_SQRT_HOUR, 2 * UG)
B = (1e-3 * DEG_PER_SQRT_HOUR, 2 * UG)
TURN_S = 20.0
GYRO, ACCEL = 0.01 * DEG_PER_HOUR, 50 * UG
INSTALLATION, PITCH, ROLL = 30 * ARCMIN, 5 * ARCMIN, 3 * ARCMIN
SIGHT = 20 * ARCSEC
_AXES = "xyz"


@dataclass(frozen=True)
class Case:
    """A procedure: rests [s] with turns [rad] between them, an instrument's noise, declared biases."""

    rests: tuple[float, ...] = (300.0, 300.0)
    turns: tuple[float, ...] = (170 * DEG,)
    sampling: float = 100.0
    noise: tuple[float, float] = (0.0, 0.0)
    heading: float = 0.0
    gyro_sd: tuple[float, float, float] = (GYRO, GYRO, GYRO)
    accel_sd: float = ACCEL
    accel_z_sd: float | None = None
    told_noise: tuple[float, float] | None = None
    turn_s: float = TURN_S

    @property
    def duration(self) -> float:
        return sum(self.rests) + len(self.turns) * self.turn_s

    @property
    def n(self) -> int:
        return round(self.duration * self.sampling)

    def datasheet(self) -> Datasheet:
        walk, velocity_walk = self.told_noise or self.noise
        declared = [Declared("bias", f"gyro_{a}", (0.0,), (s,)) for a, s in zip(_AXES, self.gyro_sd, strict=True)]
        z_sd = self.accel_sd if self.accel_z_sd is None else self.accel_z_sd
        accels = zip(_AXES, (self.accel_sd, self.accel_sd, z_sd), strict=True)
        declared += [Declared("bias", f"accel_{a}", (0.0,), (s,)) for a, s in accels]
        return Datasheet(
            self.sampling,
            self.duration,
            Site(LATITUDE, ALTITUDE),
            limits=Limits(20 * DEG, 2 * DEG),
            noise={f"gyro_{a}": {"angle_random_walk": walk} for a in _AXES}
            | {f"accel_{a}": {"angle_random_walk": velocity_walk} for a in _AXES},
            declared=tuple(declared),
            sight=Sight(SIGHT, SIGHT, INSTALLATION),
            level_sd=(PITCH, ROLL),
        )

    def path(self) -> tuple[Floats, Floats]:
        """Exact increments over the run, shape (n, 3) each."""
        return exact(self)

    def turning(self) -> Floats:
        flags, at = np.zeros(self.n), 0.0
        for rest, _ in zip(self.rests, self.turns, strict=False):
            a, b = round((at + rest) * self.sampling), round((at + rest + self.turn_s) * self.sampling)
            flags[a:b] = 1.0
            at += rest + self.turn_s
        return flags

    def angle(self, t: Floats) -> tuple[Floats, Floats]:
        """Turn angle and rate: each turn a trapezoid with a quarter of its time to gather speed."""
        angle, rate, at = np.zeros_like(t), np.zeros_like(t), 0.0
        for rest, size in zip(self.rests, self.turns, strict=False):
            x = np.clip((t - at - rest) / self.turn_s, 0.0, 1.0)
            ramp, speed = 0.25, 1 / 0.75
            up, down = np.minimum(x, ramp), np.maximum(x - (1 - ramp), 0.0)
            angle += (
                size * speed * (up**2 / (2 * ramp) + np.clip(x - ramp, 0, 1 - 2 * ramp) + down - down**2 / (2 * ramp))
            )
            slope = np.where(x < ramp, x / ramp, np.where(x > 1 - ramp, (1 - x) / ramp, 1.0))
            rate += np.where((x > 0) & (x < 1), size * speed * slope / self.turn_s, 0.0)
            at += rest + self.turn_s
        return angle, rate


@dataclass(frozen=True)
class Errors:
    """Errors of R runs, shapes (R,) or (R, 3): biases, and of the first attitude pitch, roll and heading."""

    gyro: Floats
    accel: Floats
    pitch: Floats
    roll: Floats
    installation: Floats
    sight: Floats = field(default_factory=lambda: np.zeros(1))

    @property
    def batch(self) -> int:
        return len(self.gyro)


def table_1(batch: int = 1, vertical: float = GYRO) -> Errors:
    """The published errors, the same in all runs; without the sight's."""
    gyro = np.tile([GYRO, GYRO, vertical], (batch, 1))
    one = np.ones(batch)
    # phi_E = 5 arcmin and phi_N = 3 arcmin: computed pitch and roll are too small.
    return Errors(gyro, np.full((batch, 3), ACCEL), -PITCH * one, -ROLL * one, INSTALLATION * one, 0 * one)


def drawn(case: Case, batch: int, seed: int) -> Errors:
    """Errors drawn from what the datasheet tells."""
    rng = np.random.default_rng(seed)
    z = rng.standard_normal((batch, 10))
    sight = SIGHT * (z[:, 9] + rng.standard_normal(batch))
    return Errors(
        np.array(case.gyro_sd) * z[:, :3],
        case.accel_sd * z[:, 3:6],
        PITCH * z[:, 6],
        ROLL * z[:, 7],
        INSTALLATION * z[:, 8],
        sight,
    )


_CACHE: dict[Case, tuple[Floats, Floats]] = {}


def exact(case: Case) -> tuple[Floats, Floats]:
    """Increments without errors; kept, since all seeds share them."""
    key = replace(case, noise=(0.0, 0.0), told_noise=None, gyro_sd=(0, 0, 0), accel_sd=0.0)
    if key not in _CACHE:
        _CACHE[key] = _exact(key)
    return _CACHE[key]


def _exact(case: Case) -> tuple[Floats, Floats]:
    dt, at = 1 / case.sampling, 0
    start, position = dcm_from_angles(case.heading, 0.0, 0.0), (LATITUDE, 0.0, ALTITUDE)
    gyro, accel = np.empty((case.n, 3)), np.empty((case.n, 3))
    t: Floats = np.arange(case.n + 1) * np.float64(dt)
    angle, rate = case.angle(t)
    flags = case.turning()
    edges = np.flatnonzero(np.diff(flags)) + 1
    for a, b in zip([0, *edges], [*edges, case.n], strict=True):
        if flags[a]:
            path = turn(t[a : b + 1], angle[a : b + 1], rate[a : b + 1], start, position)
            gyro[a:b], accel[a:b] = increments(path, t[a : b + 1])
        else:
            here = dcm_from_angles(case.heading - angle[a], 0.0, 0.0)
            gyro[a:b], accel[a:b] = increments_at_rest(here, position, dt, b - a)
        at = b
    assert at == case.n
    return gyro, accel


def recording(case: Case, errors: Errors, seed: int = 0, sway: tuple[Floats, Floats] | None = None) -> Recording:
    """A batch of runs at full rate; ``sway`` adds increments (gyro, accel) of shape (n, 3)."""
    gyro, accel = case.path()
    dt, rng, shape = 1 / case.sampling, np.random.default_rng(seed), (errors.batch, case.n, 3)
    if sway is not None:
        gyro, accel = gyro + sway[0], accel + sway[1]
    gyro = gyro + errors.gyro[:, None] * dt + case.noise[0] * np.sqrt(dt) * _normals(rng, shape, case.noise[0])
    accel = accel + errors.accel[:, None] * dt + case.noise[1] * np.sqrt(dt) * _normals(rng, shape, case.noise[1])
    first = np.full((errors.batch, case.n), np.nan)
    level_pitch, level_roll = first.copy(), first.copy()
    first[:, 0] = wrapped(case.heading + errors.installation + errors.sight)
    level_pitch[:, 0], level_roll[:, 0] = errors.pitch, errors.roll
    channels = {f"gyro_{a}": Channel(gyro[..., j] / dt, "rad/s", "interval") for j, a in enumerate(_AXES)}
    channels |= {f"accel_{a}": Channel(accel[..., j] / dt, "m/s^2", "interval") for j, a in enumerate(_AXES)}
    channels |= {
        "sight_heading": Channel(first, "rad"),
        "level_pitch": Channel(level_pitch, "rad"),
        "level_roll": Channel(level_roll, "rad"),
        "turning": Channel(case.turning(), "1"),
    }
    return Recording(np.arange(1, case.n + 1) * np.float64(dt), channels)


def truth(case: Case, errors: Errors) -> dict[str, Floats]:
    """What is sought, at the end of the run."""
    one = np.ones(errors.batch)
    return {
        "installation_angle": errors.installation,
        "heading": wrapped(case.heading - sum(case.turns[: len(case.rests) - 1]) * one),
        "pitch": 0 * one,
        "roll": 0 * one,
        **{f"gyro_{a}": errors.gyro[:, j] for j, a in enumerate(_AXES)},
        "accel_x": errors.accel[:, 0],
        "accel_y": errors.accel[:, 1],
    }


def wrapped(x: Floats) -> Floats:
    return np.pi - np.mod(np.pi - x, 2 * np.pi)


def _normals(rng: np.random.Generator, shape: tuple[int, ...], size: float) -> Floats | float:
    return rng.standard_normal(shape) if size else 0.0


def play(
    policy: Policy, estimator: Estimator, case: Case, errors: Errors, seed: int, last: int
) -> tuple[Floats, Floats, list[tuple[float, float]]]:
    """A batch under a policy in steps of a second, each run until it stops, 900 s at most.

    What the estimator knows is told after the turn number ``last``: before its last turn the policy does not ask.
    Returns the installation angle as known at each run's end, the time used, and the turns (time, angle), which all
    runs take at once.
    """
    n, dt, rng, batch = round(case.sampling), 1 / case.sampling, np.random.default_rng(seed), errors.batch
    state, memory = policy.reset(batch), estimator.reset(batch)
    found, used, turned = np.full(batch, np.nan), np.full(batch, np.nan), 0.0
    plan: list[Floats] = []
    turns: list[tuple[float, float]] = []
    chunk, estimate = None, None
    position = (LATITUDE, 0.0, ALTITUDE)
    for step in range(900):
        action, state = policy.act(state, chunk, estimate)
        stops = (action[:, 1] >= 0.5) & np.isnan(used)
        if estimate is not None:
            found[stops], used[stops] = estimate.of("installation_angle")[0][stops], step
        if not np.isnan(used).any():
            break
        if action[0, 0] != 0 and not plan:
            np.testing.assert_array_equal(action[:, 0], action[0, 0])
            angle = np.pi * float(action[0, 0])
            turns.append((float(step), angle))
            one = Case((0.0, 0.0), (angle,), case.sampling, turn_s=case.turn_s)
            t: Floats = np.arange(one.n + 1) * np.float64(dt)
            path = turn(t, *one.angle(t), dcm_from_angles(case.heading - turned, 0.0, 0.0), position)
            both = np.stack(increments(path, t))
            plan, turned = np.split(both, round(case.turn_s), axis=1), turned + angle
        moves = bool(plan)
        here = dcm_from_angles(case.heading - turned, 0.0, 0.0)
        gyro, accel = plan.pop(0) if plan else increments_at_rest(here, position, dt, n)
        z = rng.standard_normal((2, batch, n, 3))
        chunk = _chunk(case, errors, (gyro, accel), z, step, moves)
        memory = estimator.update(memory, chunk)
        estimate = estimator.estimate(memory) if len(turns) == last and not plan else None
    return found, used, turns


def _chunk(case: Case, errors: Errors, true: tuple[Floats, Floats], z: Floats, step: int, moves: bool) -> Recording:
    dt = 1 / case.sampling
    gyro = true[0] / dt + errors.gyro[:, None] + case.noise[0] / np.sqrt(dt) * z[0]
    accel = true[1] / dt + errors.accel[:, None] + case.noise[1] / np.sqrt(dt) * z[1]
    n = gyro.shape[1]
    reading = np.full((3, errors.batch, n), np.nan)
    if step == 0:
        reading[:, :, 0] = wrapped(case.heading + errors.installation + errors.sight), errors.pitch, errors.roll
    channels = {f"gyro_{a}": Channel(gyro[..., j], "rad/s", "interval") for j, a in enumerate(_AXES)}
    channels |= {f"accel_{a}": Channel(accel[..., j], "m/s^2", "interval") for j, a in enumerate(_AXES)}
    names = ("sight_heading", "level_pitch", "level_roll")
    channels |= {name: Channel(reading[j], "rad") for j, name in enumerate(names)}
    channels["turning"] = Channel(np.full(n, float(moves)), "1")
    return Recording((step * n + np.arange(1, n + 1)) * dt, channels)
