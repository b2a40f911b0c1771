"""A triad held still in many attitudes, simulated with matrices of its own: nothing of the effects is used.

accelerometers   M_a f + b_a + noise,    gyros   M_g w + b_g + G f + noise
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from insenv.core.manifest import HeldOut, Manifest, Model
from insenv.core.recording import Channel, Floats, Recording, Site

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


def recording(case: Case, seed: int) -> Recording:
    """One run: rests in random attitudes, smooth turns between them."""
    rng = np.random.default_rng(seed)
    still, moving = round(case.rest_s / DT), round(case.turn_s / DT)
    # The share of a turn that each interval has: a smooth start and a smooth end.
    shares = np.diff(0.5 - 0.5 * np.cos(np.linspace(0, np.pi, moving + 1)))
    attitude = Rotation.random(random_state=np.random.RandomState(seed))  # body to level axes
    rates, forces, resting = [], [], []
    for k in range(case.rests):
        here = np.tile(attitude.inv().apply([0, 0, G]), (still, 1))
        rates.append(np.zeros((still, 3)))
        forces.append(here)
        resting.append(np.full(still, k))
        if k == case.rests - 1:
            break
        axis = rng.standard_normal(3)
        angle = rng.uniform(0.7, 2.6)
        vector = angle * axis / np.linalg.norm(axis)
        turn = attitude * Rotation.from_rotvec(np.cumsum(shares)[:, None] * vector)
        rates.append(shares[:, None] * vector / DT)
        forces.append(turn.inv().apply([0, 0, G]))
        resting.append(np.full(moving, -1))
        attitude = turn[-1]
    return _measured(case, rng, np.concatenate(rates), np.concatenate(forces), np.concatenate(resting))


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
    return Recording(DT * np.arange(1.0, n + 1), channels, site=Site(gravity=case.gravity), label="simulated")


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
