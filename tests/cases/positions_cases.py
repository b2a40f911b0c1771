"""A triad held still in many attitudes, simulated with matrices of its own: nothing of the effects is used.

accelerometers   M_a f + b_a + noise,    gyros   M_g w + b_g + G f + noise

Rests are as hands and jigs make them where a case says so: the unit settles after it was set down (an exponential of
its attitude), a hand trembles (some hertz, about all axes). `faces` is the six-position test of a laboratory, on a
table that is nearly level, and `least_squares` what a textbook makes of it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from insenv.core.earth import EARTH_RATE
from insenv.core.recording import Channel, Floats, Recording, Site
from insenv.data.manifest import HeldOut, Manifest, Model

G = 9.81
DT = 0.02
SYMMETRIC = ((0, 1), (0, 2), (1, 2))


@dataclass(frozen=True)
class Case:
    """What is simulated: errors as 3 x 3 matrices beside the identity, biases, and the noise of rests and samples."""

    rests: int = 40
    accel: Floats = field(default_factory=lambda: np.zeros((3, 3)))
    gyro: Floats = field(default_factory=lambda: np.zeros((3, 3)))
    g_sensitivity: Floats = field(default_factory=lambda: np.zeros((3, 3)))
    accel_bias: tuple[float, float, float] = (0.1, -0.2, 0.05)
    gyro_bias: tuple[float, float, float] = (2e-3, -1e-3, 3e-3)
    accel_scatter: float = 1e-3  # from rest to rest [m/s^2]
    gyro_scatter: float = 1e-4  # the same [rad/s]
    gyro_walk: float = 0.0  # of the bias, from rest to rest [rad/s]
    accel_noise: float = 0.02
    gyro_noise: float = 2e-3
    rest_s: float = 2.0
    turn_s: float = 1.2
    gravity: float | None = G
    latitude: float | None = None  # where gyros see the Earth turn [rad]
    settling: float = 0.0  # of the attitude at the start of a rest [rad]
    settling_s: float = 0.4
    tremor: float = 0.0  # of a hand's attitude, rms about each axis [rad]
    tremor_rests: int = 0  # rests from the first that are held by hand; the others lie on a bench


def recording(case: Case, seed: int) -> Recording:
    """One run: rests in random attitudes, smooth turns between them."""
    rng = np.random.default_rng(seed)
    still, moving = round(case.rest_s / DT), round(case.turn_s / DT)
    # The share of a turn that each interval has: a smooth start and a smooth end.
    shares = np.diff(0.5 - 0.5 * np.cos(np.linspace(0, np.pi, moving + 1)))
    attitude = Rotation.random(random_state=np.random.RandomState(seed))  # body to level axes
    earth = (
        np.zeros(3)
        if case.latitude is None
        else EARTH_RATE * np.array([0, np.cos(case.latitude), np.sin(case.latitude)])
    )
    rates, forces, resting = [], [], []
    for k in range(case.rests):
        swings = _swings(case, rng, still, k < case.tremor_rests)
        held = attitude * Rotation.from_rotvec(swings[1:])
        rates.append(np.diff(swings, axis=0) / DT + held.inv().apply(earth))
        forces.append(held.inv().apply([0, 0, G]))
        resting.append(np.full(still, k))
        if k == case.rests - 1:
            break
        axis = rng.standard_normal(3)
        angle = rng.uniform(0.7, 2.6)
        vector = angle * axis / np.linalg.norm(axis)
        turn = attitude * Rotation.from_rotvec(np.cumsum(shares)[:, None] * vector)
        rates.append(shares[:, None] * vector / DT + turn.inv().apply(earth))
        forces.append(turn.inv().apply([0, 0, G]))
        resting.append(np.full(moving, -1))
        attitude = turn[-1]
    return _measured(case, rng, np.concatenate(rates), np.concatenate(forces), np.concatenate(resting))


def _swings(case: Case, rng: np.random.Generator, rows: int, by_hand: bool) -> Floats:
    """Small turns about the attitude of a rest at its edges, shape (rows + 1, 3) [rad]; none at either end."""
    t = DT * np.arange(rows + 1.0)
    swings = np.zeros((rows + 1, 3))
    if case.settling:
        fall = case.settling * np.exp(-t / case.settling_s)
        rise = np.clip(t / 0.1, 0, 1) * np.clip((t[-1] - t) / 0.1, 0, 1)
        swings += (fall * rise)[:, None] * rng.standard_normal(3)
    if case.tremor and by_hand:
        window = np.clip(np.minimum(t, t[-1] - t) / 0.2, 0, 1)
        for frequency in (0.4, 1.1, 8.0):
            phase = 2 * np.pi * rng.uniform(size=3)
            size = case.tremor / np.sqrt(1.5) / max(frequency, 1.0)
            swings += window[:, None] * size * np.sin(2 * np.pi * frequency * t[:, None] + phase)
    return swings


def _measured(case: Case, rng: np.random.Generator, rate: Floats, force: Floats, rest: Floats) -> Recording:
    n = len(rate)
    at = np.where(rest < 0, 0, rest).astype(int)
    moving = (rest < 0)[:, None]
    own = np.where(moving, 0.0, (case.accel_scatter * rng.standard_normal((case.rests, 3)))[at])
    wander = np.cumsum(case.gyro_walk * rng.standard_normal((case.rests, 3)), axis=0)
    bias = (case.gyro_scatter * rng.standard_normal((case.rests, 3)) + wander)[at]
    accel = force @ (np.eye(3) + case.accel).T + case.accel_bias + own
    accel += case.accel_noise * rng.standard_normal((n, 3)) + 0.5 * moving * rng.standard_normal((n, 3))
    gyro = rate @ (np.eye(3) + case.gyro).T + case.gyro_bias + force @ case.g_sensitivity.T + bias
    gyro += case.gyro_noise * rng.standard_normal((n, 3))
    channels = {f"accel_{a}": Channel(accel[:, i], "m/s^2") for i, a in enumerate("xyz")}
    channels |= {f"gyro_{a}": Channel(gyro[:, i], "rad/s", "interval") for i, a in enumerate("xyz")}
    site = Site(gravity=case.gravity, latitude=case.latitude)
    return Recording(DT * np.arange(1.0, n + 1), channels, site=site, label="simulated")


def manifest(
    targets: tuple[str, ...], declared: tuple[str, ...], held_out: HeldOut | None = None, path: str = "simulated.toml"
) -> Manifest:
    """A manifest of nothing but a model."""
    model = Model(targets, declared, procedure="multi-position")
    return Manifest(Path(path), "Simulated", (), {}, model, {}, held_out or HeldOut(positions="even"))


def scales(*values: float) -> Floats:
    return np.diag(np.array(values))


def tied(xy: float, xz: float, yz: float, sign: float = 1.0) -> Floats:
    """Off-diagonal matrix of three coefficients: symmetric, or antisymmetric for ``sign`` -1."""
    matrix = np.zeros((3, 3))
    for (i, j), value in zip(SYMMETRIC, (xy, xz, yz), strict=True):
        matrix[i, j], matrix[j, i] = value, sign * value
    return matrix


ACCELS = ("accel_x", "accel_y", "accel_z")
GYROS = ("gyro_x", "gyro_y", "gyro_z")


# ------------------------------------------------------------------------------------------------- six positions

FACES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])


@dataclass(frozen=True)
class Bench:
    """A six-position test: rests of ``rest_s`` at ``rate``, errors, noise, how level the table is.

    ``noise`` is the standard deviation of a sample, ``walk`` that of the bias after a second; both in m/s^2.
    """

    matrix: Floats
    bias: tuple[float, float, float]
    rest_s: float = 180.0
    rate: float = 50.0
    noise: float = 3e-4
    walk: float = 1e-6
    level: float = 2e-5  # rad
    repeats: int = 1


#: A navigation-grade unit, and a phone.
NAVIGATION = Bench(
    np.diag([180e-6, -240e-6, 90e-6]) + 1e-4 * np.array([[0, 1, -2], [2, 0, 1], [-1, 2, 0.0]]), (3e-3, -2e-3, 1e-3)
)
PHONE = Bench(
    np.diag([4e-3, -6e-3, 9e-3]) + 1e-3 * np.array([[0, 1, -2], [2, 0, 1], [-1, 2, 0.0]]),
    (0.08, -0.05, 0.12),
    rest_s=30.0,
    rate=100.0,
    noise=0.02,
    walk=1e-4,
    level=0.01,
)


def faces(bench: Bench, seed: int, one_file: bool = True) -> tuple[Recording, ...]:
    """The six faces (``repeats`` times), in one recording with the handling between them, or one file each."""
    rng = np.random.default_rng(seed)
    n = round(bench.rest_s * bench.rate)
    runs, walk = [], np.zeros(3)
    for face in np.tile(FACES, (bench.repeats, 1)):
        lean = bench.level * rng.standard_normal(3)
        up = face + np.cross(lean, face)
        steps = bench.walk / np.sqrt(bench.rate) * rng.standard_normal((n, 3))
        wander = walk + np.cumsum(steps, axis=0)
        walk = wander[-1]
        force = G * up / np.linalg.norm(up)
        reading = force @ (np.eye(3) + bench.matrix).T + bench.bias + wander
        runs.append(reading + bench.noise * rng.standard_normal((n, 3)))
    if one_file:
        handled = [_handled(a[-1], b[0], rng, round(4 * bench.rate)) for a, b in zip(runs[:-1], runs[1:], strict=True)]
        runs = [np.concatenate([x for pair in zip(runs, [*handled, np.zeros((0, 3))], strict=True) for x in pair])]
    return tuple(
        Recording(
            np.arange(1.0, len(a) + 1) / bench.rate,
            {f"accel_{x}": Channel(a[:, i], "m/s^2") for i, x in enumerate("xyz")},
            site=Site(gravity=G),
            label=f"face {k}" if not one_file else "faces",
        )
        for k, a in enumerate(runs, start=1)
    )


def _handled(start: Floats, end: Floats, rng: np.random.Generator, rows: int) -> Floats:
    share = np.linspace(0, 1, rows)[:, None]
    path = np.cos(0.5 * np.pi * share) * start + np.sin(0.5 * np.pi * share) * end
    return path + 2.0 * rng.standard_normal((rows, 3))


def least_squares(runs: tuple[Recording, ...], bench: Bench) -> tuple[Floats, Floats]:
    """Bias [m/s^2] and scale factors of the textbook: 12 parameters from the six known faces, one file each."""
    means = np.array([[r.channels[f"accel_{x}"].values.mean() for x in "xyz"] for r in runs])
    design = np.column_stack([G * np.tile(FACES, (bench.repeats, 1)), np.ones(len(means))])
    found = np.linalg.lstsq(design, means, rcond=None)[0]
    return found[3], np.diag(found[:3]) - 1
