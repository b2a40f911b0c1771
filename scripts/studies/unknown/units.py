"""Units with six axes, at rest, turned about the vertical, and in many attitudes: NumPy alone.

Axes are right, forward, up. A small tilt th of the base turns gravity into the level accelerometers and is a rate to
the gyros: f_x = -g th_y, f_y = g th_x, w = d th / dt.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from world import GRADES, GRAVITY, Floats, Grade, Rng, noise, room, span

#: Channels in their order.
GYROS, ACCELS = ("gyro_x", "gyro_y", "gyro_z"), ("accel_x", "accel_y", "accel_z")
#: Flicker and walk of an accelerometer, as shares of its white noise at a second.
FLICKER, WALK = 0.02, 0.002


@dataclass(frozen=True)
class Unit:
    """A unit with its noise: gyros in rad/s, accelerometers in m/s^2, one row every ``dt``."""

    grade: Grade
    dt: float
    gyros: Floats
    accels: Floats
    temperature: Floats
    rate: Floats | None = None
    segment: Floats | None = None

    @property
    def t(self) -> Floats:
        """Ends of the rows [s]."""
        return np.asarray(np.arange(1, len(self.gyros) + 1) * self.dt, np.float64)

    def tilted(self, theta: Floats) -> Unit:
        """With a small tilt (n, 2) about x and y."""
        gyros, accels = self.gyros.copy(), self.accels.copy()
        gyros[:, :2] += np.gradient(theta, self.dt, axis=0)
        accels[:, 0] -= GRAVITY * theta[:, 1]
        accels[:, 1] += GRAVITY * theta[:, 0]
        return replace(self, gyros=gyros, accels=accels)


def accelerometer(grade: Grade) -> Grade:
    """The density of an accelerometer [m/s^2]."""
    n = grade.accel
    return replace(grade, n=n, b=FLICKER * n, k=WALK * n)


def at_rest(name: str, duration: float, dt: float, rng: Rng, climate: str = "room") -> Unit:
    """A unit on a bench."""
    grade, n = GRADES[name], int(duration / dt)
    bias = 300 * grade.b
    gyros = np.column_stack([noise(grade, n, dt, rng) + bias * rng.standard_normal() for _ in GYROS])
    accels = np.column_stack([noise(accelerometer(grade), n, dt, rng) for _ in ACCELS])
    accels += np.array([0.0, 0.0, GRAVITY]) + 0.01 * rng.standard_normal(3)
    return Unit(grade, dt, gyros, accels, room(n, dt, rng, climate))


def strength(grade: Grade, dt: float, addition: Floats, accelerometers: bool) -> float:
    """As `world.Ruler` has it, beside a bias."""
    from world import Ruler

    own = accelerometer(grade) if accelerometers else grade
    return Ruler(own, dt).strength([addition], [np.zeros((len(addition), 0))])


def vibrating(unit: Unit, rng: Rng, level: float) -> tuple[Unit, Floats]:
    """A motor nearby that runs at times: accelerometers shake along z; and the square of the vibration, (n,)."""
    n, t = len(unit.t), unit.t
    on = (np.sin(2 * np.pi * t / (0.13 * t[-1])) > 0.2) * (1 + 0.5 * np.sin(2 * np.pi * t / (0.31 * t[-1])))
    shake = level * on * rng.standard_normal(n)
    accels = unit.accels.copy()
    accels[:, 2] += shake
    accels[:, 0] += 0.3 * level * on * rng.standard_normal(n)
    return replace(unit, accels=accels), shake**2


def turned(name: str, rates: Floats, dt: float, rng: Rng, lever: float, lean: float) -> Unit:
    """A unit on a table whose axis is vertical, ``rates`` (n,); a lever arm along x [m], a lean about y [rad]."""
    unit = at_rest(name, len(rates) * dt, dt, rng)
    gyros, accels = unit.gyros.copy(), unit.accels.copy()
    gyros[:, 2] += rates * np.cos(lean)
    gyros[:, 0] += rates * np.sin(lean)
    accels[:, 0] -= lever * rates**2
    accels[:, 1] += lever * np.gradient(rates, dt)
    accels[:, 0] -= GRAVITY * lean
    return replace(unit, gyros=gyros, accels=accels, rate=rates)


def attitudes(name: str, count: int, dwell: float, dt: float, rng: Rng) -> tuple[Unit, Floats, Floats]:
    """Rests in ``count`` attitudes, turned by hand in between; the specific force (n, 3) and the number of the rest."""
    force, rate, segment = [], [], []
    attitude, quiet, move = np.eye(3), int(dwell / dt), int(4.0 / dt)
    up = _directions(count, rng)
    for k in range(count):
        force.append(np.tile(attitude.T @ [0, 0, GRAVITY], (quiet, 1)))
        rate.append(np.zeros((quiet, 3)))
        segment.append(np.full(quiet, float(k)))
        if k == count - 1:
            break
        body = attitude.T @ [0, 0, 1.0]
        axis = np.cross(body, up[k + 1])
        sine = float(np.linalg.norm(axis))
        angle = float(np.arctan2(sine, body @ up[k + 1]))
        axis = axis / max(sine, 1e-9)
        share = 0.5 * (1 - np.cos(np.pi * np.arange(1, move + 1) / move))
        speed = np.diff(share, prepend=0.0) / dt * angle
        for step in range(move):
            # The body turns the other way than "up" does in it.
            attitude = attitude @ _rotation(-axis * speed[step] * dt)
            force.append((attitude.T @ [0, 0, GRAVITY])[None] + 0.3 * rng.standard_normal((1, 3)))
            rate.append((-axis * speed[step])[None] + 0.02 * rng.standard_normal((1, 3)))
        segment.append(np.full(move, -1.0))
    f, w, s = np.concatenate(force), np.concatenate(rate), np.concatenate(segment)
    unit = at_rest(name, len(f) * dt + 0.5 * dt, dt, rng)
    still = unit.accels - np.array([0, 0, GRAVITY])
    return replace(unit, gyros=unit.gyros + w, accels=still + f), f, s


def _directions(count: int, rng: Rng) -> Floats:
    """Where up is in the body: the six faces, then edges and corners, in an order by chance."""
    faces = np.concatenate([np.eye(3), -np.eye(3)])
    others = rng.standard_normal((max(0, count - 6), 3))
    others /= np.linalg.norm(others, axis=1, keepdims=True)
    order = rng.permutation(count)
    every = np.concatenate([faces, others])[:count][order]
    # Not twice beside its own opposite: a turn by 180 deg has no axis.
    for k in range(1, count):
        if every[k] @ every[k - 1] < -0.9:
            every[k] = every[k] + 0.3 * rng.standard_normal(3)
            every[k] /= np.linalg.norm(every[k])
    every[0] = [0, 0, 1.0]
    return np.asarray(every)


def _rotation(vector: Floats) -> Floats:
    angle = float(np.linalg.norm(vector))
    if angle < 1e-15:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def rest_strength(addition: Floats, force: Floats, segment: Floats, white: float, dt: float) -> float:
    """Strength in the magnitude of gravity of each rest, beside bias, scale factor and cross-coupling."""
    rests = np.unique(segment[segment >= 0])
    mean = np.array([force[segment == k].mean(axis=0) for k in rests]) / GRAVITY
    wrong = np.array([addition[segment == k].mean(axis=0) for k in rests])
    seen = np.sum(mean * wrong, axis=1)
    x = np.column_stack([mean, mean**2, mean[:, [0]] * mean[:, [1, 2]], mean[:, [1]] * mean[:, [2]]])
    sd = white / np.sqrt(float(np.sum(segment == rests[0])) * dt)
    return float(np.linalg.norm(seen - span(x) @ (span(x).T @ seen)) / sd)
