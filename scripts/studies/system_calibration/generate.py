r"""Recordings of a unit on a table of several axes, with one cause that nobody declared: numpy alone, of its own.

Nothing of insenv's effects or kinematics is used. The attitude is a product of matrices at every sub-step; gyros read
the rotation vectors between sub-steps, accelerometers gravity and the second differences of where they are:

    C = M_seat T_k(theta_k) ... S T_1(theta_1) B,      w dt = log(C_(i+1) C_i'),      f = C (g k + d^2 (C' r) / dt^2)

A cause is sized so that what it adds, beside everything that is declared, is ``strength`` standard deviations of the
noise (white, and a flicker that is a sum of Gauss and Markov processes):

    strength^2 = min over beta of (d - J beta)' V^-1 (d - J beta) + beta' P^-1 beta

python scripts/studies/system_calibration/generate.py FOLDER [--cases 110] [--nulls 0] [--first 0] [--strength 10]
writes FOLDER/case_0000/manifest.toml ... and FOLDER/truth_0.json, which grows case by case.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
G, EARTH = 9.8017, 7.292115e-5
DEG, ARCSEC, PPM = np.pi / 180, np.pi / 180 / 3600, 1e-6
SAMPLING, SUB = 20.0, 4
BLOCK = int(SAMPLING)  # samples of a block of one second
#: Gauss and Markov times of the flicker [s], by factors of 4.
FLICKER = 4.0 ** np.arange(0, 7)


@dataclass(frozen=True)
class Set:
    """An instrument and its table: noises, and standard deviations of what is declared."""

    white: tuple[float, float]
    flicker: tuple[float, float]
    bias: tuple[float, float]
    scale: float
    skew: float
    seat: float
    tilt: float
    heading: float
    encoder: float


SETS = {
    "fog": Set(
        (2.9e-6, 3.9e-4), (9.7e-8, 4.9e-5), (1e-5, 1e-2), 3e-4, 3e-4,
        60 * ARCSEC, 10 * ARCSEC, 60 * ARCSEC, 0.05 * ARCSEC,
    ),
    "mems": Set(
        (8.7e-5, 2e-3), (2.4e-5, 4e-4), (8.7e-3, 0.3), 1e-2, 5e-3,
        600 * ARCSEC, 60 * ARCSEC, 3600 * ARCSEC, 2 * ARCSEC,
    ),
}  # fmt: skip


def rotation(axis: str, angle: Floats | float) -> Floats:
    """Matrices that take components into axes turned by ``angle``, shape (n, 3, 3)."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    m = np.zeros((*np.shape(angle), 3, 3))
    m[..., i, i] = 1.0
    m[..., j, j] = m[..., k, k] = np.cos(angle)
    m[..., j, k], m[..., k, j] = np.sin(angle), -np.sin(angle)
    return m


def small(vector: Floats) -> Floats:
    """Matrix of a small rotation."""
    found: Floats = rotation("z", vector[2]) @ rotation("y", vector[1]) @ rotation("x", vector[0])
    return found


@dataclass(frozen=True)
class Course:
    """Angles of the axes at the sub-steps, (k, n sub + 1), where they turn, (n,), and begins of the turns [s]."""

    axes: str
    angles: Floats
    turning: Floats
    begins: Floats


def course_of(axes: str, positions: Floats, dwell: float, rate: float, acceleration: float = 30 * DEG) -> Course:
    """From position to position, one axis after the other."""
    h = 1 / SAMPLING / SUB
    now, angles, flags, begins = np.zeros(len(axes)), [np.zeros((len(axes), 1))], [], []
    for target in positions:
        rest = int(round(dwell * SAMPLING))
        angles.append(np.repeat(now[:, None], rest * SUB, axis=1))
        flags.append(np.zeros(rest))
        begins.append(sum(len(f) for f in flags) / SAMPLING)
        for m in range(len(axes)):
            move = target[m] - now[m]
            if not move:
                continue
            ramp = rate / acceleration
            time = abs(move) / rate + ramp if abs(move) > rate * ramp else 2 * np.sqrt(abs(move) / acceleration)
            whole = np.ceil(time * SAMPLING - 1e-9) / SAMPLING
            s = np.arange(1, int(round(whole / h)) + 1) * h / whole
            r = min(ramp / time, 0.5)
            shape = np.where(
                s < r, s * s / (2 * r), np.where(s > 1 - r, (1 - r) - (1 - s) ** 2 / (2 * r), s - r / 2)
            ) / (1 - r)
            part = np.repeat(now[:, None], len(s), axis=1)
            part[m] = now[m] + move * shape
            angles.append(part)
            flags.append(np.ones(len(s) // SUB))
            now = now.copy()
            now[m] = target[m]
    return Course(axes, np.concatenate(angles, axis=1), np.concatenate(flags), np.array(begins))


@dataclass(frozen=True)
class Table:
    """What is wrong with a table and the unit's seat."""

    seat: Floats
    tilt: Floats
    heading: float
    square: Floats
    eccentric: Floats
    slip: tuple[float, Floats] = (np.inf, np.zeros(3))


def attitudes(p: Course, table: Table, latitude: float) -> tuple[Floats, Floats]:
    """C at the sub-steps from the local level (east, north, up), and rotation vectors between them."""
    true = p.angles.copy()  # readings; true angles are off by the encoders' eccentricity
    for m in range(len(p.axes)):
        c, s = table.eccentric[2 * m : 2 * m + 2]
        true[m] -= c * np.cos(p.angles[m]) + s * np.sin(p.angles[m])
    matrix = np.broadcast_to(
        rotation("y", table.tilt[1]) @ rotation("x", table.tilt[0]) @ rotation("z", -table.heading),
        (true.shape[1], 3, 3),
    )
    for m, letter in enumerate(p.axes):
        matrix = rotation(letter, true[m]) @ matrix
        if m + 1 < len(p.axes):
            normal = next(a for a in "xyz" if a not in p.axes[m : m + 2])
            matrix = rotation(normal, table.square[m]) @ matrix
    matrix = small(table.seat) @ matrix
    h = 1 / SAMPLING / SUB
    if np.isfinite(table.slip[0]):
        late = np.arange(true.shape[1]) * h >= table.slip[0]
        matrix = np.where(late[:, None, None], small(table.slip[1]) @ matrix, matrix)
    step = matrix[1:] @ np.swapaxes(matrix[:-1], 1, 2)
    vector = 0.5 * np.stack(
        [step[:, 1, 2] - step[:, 2, 1], step[:, 2, 0] - step[:, 0, 2], step[:, 0, 1] - step[:, 1, 0]], 1
    )
    size = np.linalg.norm(vector, axis=1)
    vector *= np.where(size > 1e-9, np.arcsin(np.minimum(size, 1)) / np.maximum(size, 1e-12), 1.0)[:, None]
    earth = EARTH * np.array([0.0, np.cos(latitude), np.sin(latitude)])
    felt = 0.5 * (matrix[1:] + matrix[:-1]) @ earth
    return matrix, vector + felt * h


def means(values: Floats, per: int) -> Floats:
    """Means over ``per`` values along the first axis."""
    n = len(values) // per
    return values[: n * per].reshape(n, per, *values.shape[1:]).mean(axis=1)


def felt(
    p: Course, table: Table, latitude: float, arms: Floats | None = None, late: float = 0.0
) -> tuple[Floats, Floats]:
    """Mean rates and specific forces of the samples, each (n, 3)."""
    h = 1 / SAMPLING / SUB
    matrix, turned = attitudes(p, table, latitude)
    force = matrix[:, :, 2] * G
    if arms is not None:
        for i in range(3):
            place = np.einsum("nji,j->ni", matrix, arms[i])  # of the accelerometer, in the level's axes
            second = np.zeros_like(place)
            second[1:-1] = (place[2:] - 2 * place[1:-1] + place[:-2]) / h**2
            force[:, i] += np.einsum("ni,ni->n", matrix[:, i, :], second)
    if late:
        at = np.arange(len(force)) * h
        force = np.stack([np.interp(at - late, at, force[:, i]) for i in range(3)], axis=1)
    middle = 0.5 * (force[1:] + force[:-1])
    return means(turned, SUB) / h, means(middle, SUB)


def covariance(white: float, flicker: float, n: int) -> Floats:
    """Of means over blocks of a second."""
    lag = np.abs(np.arange(n)[:, None] - np.arange(n)[None, :]).astype(float)
    total = white**2 * np.eye(n)
    for tau in FLICKER:
        total = total + flicker**2 * np.log(4.0) / np.pi * np.exp(-lag / tau)
    return total


def noise(white: float, flicker: float, n: int, rng: np.random.Generator) -> Floats:
    """Of the samples, shape (n,)."""
    dt = 1 / SAMPLING
    found = white / np.sqrt(dt) * rng.standard_normal(n)
    for tau in FLICKER:
        decay = np.exp(-dt / tau)
        z = rng.standard_normal(n) * np.sqrt(1 - decay**2)
        z[0] = rng.standard_normal()
        found += flicker * np.sqrt(np.log(4.0) / np.pi) * _first_order(z, decay)
    return found


def _first_order(z: Floats, decay: float) -> Floats:
    out, chunk, last = np.empty_like(z), 256, 0.0
    powers = decay ** np.arange(chunk + 1)
    lower = np.tril(decay ** np.maximum(np.arange(chunk)[:, None] - np.arange(chunk)[None, :], 0))
    for a in range(0, len(z), chunk):
        part = z[a : a + chunk]
        out[a : a + chunk] = lower[: len(part), : len(part)] @ part + powers[1 : len(part) + 1] * last
        last = out[a + len(part) - 1]
    return out


def case(
    number: int, cause: str | None, strength: float, positions: str = "random"
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Channels, and the truth with what the manifest says."""
    rng = np.random.default_rng([20261123, number])
    kind = "fog" if rng.random() < 0.6 else "mems"
    one, latitude = SETS[kind], float(rng.uniform(20, 60)) * DEG
    axes = str(rng.choice(["zxy", "xyz", "yxz", "yz"])) if positions == "random" else "zxy"
    rate = (20 if kind == "fog" else 60) * DEG
    course = course_of(axes, _positions(len(axes), rng, positions), float(rng.uniform(25, 45)), rate)
    warm = cause == "thermal_lag" or rng.random() < 0.3
    stated = {"seat": one.seat, "tilt": 0.0 if cause == "axis_tilt" else one.tilt, "heading": one.heading}
    table = Table(
        stated["seat"] * rng.standard_normal(3),
        stated["tilt"] * rng.standard_normal(2),
        stated["heading"] * rng.standard_normal(),
        np.zeros(len(axes) - 1),
        np.zeros(2 * len(axes)),
    )
    rates, forces = felt(course, table, latitude)
    n = len(rates) // BLOCK * BLOCK
    temperature = 25 + _warming(np.arange(n) / SAMPLING / 60, rng) * warm
    unit = Played(course, table, latitude, rates[:n], forces[:n], temperature)
    out, size = unit.both + _declared_errors(unit, one, cause != "misalignment", warm, rng), 1.0
    if cause is not None:
        add = CAUSES[cause][0](unit, rng)
        size = strength / strength_of(add(1.0), unit, one, stated, warm, cause != "misalignment")
        out += add(size)
    for c in range(6):
        out[:, c] += noise(one.white[c // 3], one.flicker[c // 3], n, rng)
    readings = course.angles[:, SUB::SUB][:, :n] + one.encoder * rng.standard_normal((len(axes), n))
    channels: dict[str, Any] = {"time": (np.arange(n) + 1) / SAMPLING}
    channels |= {f"{t}_{a}": out[:, 3 * i + j] for i, t in enumerate(("gyro", "accel")) for j, a in enumerate("xyz")}
    channels |= {f"axis_{m + 1}": reading for m, reading in enumerate(readings)}
    channels |= {"turning": course.turning[:n], "temperature": temperature + 273.15}
    names = list(CAUSES[cause][1]) if cause else []
    said = {"axes": axes, "latitude": latitude, "stated": stated, "kind": kind, "warm": bool(warm)}
    return channels, {"cause": cause, "names": names, "size": size, **said}


def _warming(minutes: Floats, rng: np.random.Generator) -> Floats:
    rise, period, settling = rng.uniform(5, 15), rng.uniform(15, 40), rng.uniform(4, 10)
    return rise * (1 - np.exp(-minutes / settling)) + 3 * np.sin(2 * np.pi * minutes / period)


def _positions(k: int, rng: np.random.Generator, named: str) -> Floats:
    if named == "six":
        q = 90 * DEG
        return np.array([[0, 0, 0], [0, q, 0], [0, -q, 0], [0, 0, q], [0, 0, -q], [0, 2 * q, 0]])
    now, found, last = np.zeros(k), [], -1
    for _ in range(int(rng.integers(22, 30))):
        last = int(rng.choice([i for i in range(k) if i != last]))
        step = rng.choice([-180, -90, -90, 90, 90, 180, 45, -45]) * DEG
        now = now.copy()
        now[last] += step if abs(now[last] + step) <= 360 * DEG else -step
        found.append(now)
    return np.array(found)


def _declared_errors(u: Played, noises: Set, skewed: bool, warm: bool, rng: np.random.Generator) -> Floats:
    skew = noises.skew * skewed
    gyro = np.diag(noises.scale * rng.standard_normal(3)) + skew * rng.standard_normal((3, 3)) * (1 - np.eye(3))
    lower = np.diag(noises.scale * rng.standard_normal(3)) + skew * np.tril(rng.standard_normal((3, 3)), -1)
    bias = np.repeat(noises.bias, 3)
    out = np.concatenate([u.rates @ gyro.T, u.forces @ lower.T], axis=1) + bias * rng.standard_normal(6)
    return out + warm * (u.temperature - 25)[:, None] * 0.02 * bias * rng.standard_normal(6)


@dataclass(frozen=True)
class Played:
    """A unit without errors of its own on its table: what the samples sense, (n, 3) each, and the temperature."""

    course: Course
    table: Table
    latitude: float
    rates: Floats
    forces: Floats
    temperature: Floats

    @property
    def both(self) -> Floats:
        """Rates and forces, shape (n, 6)."""
        return np.concatenate([self.rates, self.forces], axis=1)

    def on(self, table: Table) -> Floats:
        """What another table adds, shape (n, 6)."""
        return np.concatenate(felt(self.course, table, self.latitude), axis=1)[: len(self.rates)] - self.both

    def forced(self, forces: Floats) -> Floats:
        """What other forces add, shape (n, 6)."""
        return np.concatenate([np.zeros_like(self.rates), forces[: len(self.forces)] - self.forces], axis=1)

    def alone(self, channel: int, values: Floats) -> Floats:
        """An addition to one channel, shape (n, 6)."""
        found = np.zeros((len(values), 6))
        found[:, channel] = values
        return found


Adding = Callable[[float], Floats]


def axis_angle(u: Played, rng: np.random.Generator) -> Adding:
    """Axes of the table that are not square."""
    direction = rng.standard_normal(len(u.course.axes) - 1) * 1e-4
    return lambda s: u.on(replace(u.table, square=s * direction))


def axis_tilt(u: Played, rng: np.random.Generator) -> Adding:
    """A base that is not level."""
    direction = rng.standard_normal(2) * 1e-4
    return lambda s: u.on(replace(u.table, tilt=s * direction))


def encoder(u: Played, rng: np.random.Generator) -> Adding:
    """An encoder that is not centred."""
    direction, m = np.zeros(2 * len(u.course.axes)), int(rng.integers(len(u.course.axes)))
    direction[2 * m : 2 * m + 2] = rng.standard_normal(2) * 1e-4
    return lambda s: u.on(replace(u.table, eccentric=s * direction))


def loose_mounting(u: Played, rng: np.random.Generator) -> Adding:
    """A unit that slips in one turn."""
    quarter = len(u.course.begins) // 4
    direction = rng.standard_normal(3) * 1e-4
    at = float(rng.choice(u.course.begins[quarter:-quarter])) + 1.0
    return lambda s: u.on(replace(u.table, slip=(at, s * direction)))


def asynchrony(u: Played, rng: np.random.Generator) -> Adding:
    """Accelerometers that are late."""
    late = 2e-3 * float(rng.choice([-1, 1]))
    return lambda s: u.forced(felt(u.course, u.table, u.latitude, late=late * s)[1])


def lever_arms(u: Played, rng: np.random.Generator) -> Adding:
    """Accelerometers that are not where the axes meet."""
    d = u.forced(felt(u.course, u.table, u.latitude, rng.standard_normal((3, 3)) * 0.03)[1])
    return lambda s: s * d


def g_sensitivity(u: Played, rng: np.random.Generator) -> Adding:
    """Gyros that feel forces: along their own axes, or along all."""
    matrix = rng.standard_normal((3, 3)) * 1e-7 * (np.eye(3) if rng.random() < 0.5 else 1.0)
    d = np.concatenate([u.forces @ matrix.T, np.zeros_like(u.forces)], axis=1)
    return lambda s: s * d


def thermal_lag(u: Played, rng: np.random.Generator) -> Adding:
    """A bias of one channel that follows the temperature late."""
    channel, tau = int(rng.integers(6)), float(np.exp(rng.uniform(np.log(60), np.log(600))))
    decay = np.exp(-1 / SAMPLING / tau)
    late = _first_order((1 - decay) * (u.temperature - u.temperature[0]), decay) + u.temperature[0]
    d = u.alone(channel, 1e-7 * (u.temperature - late))
    return lambda s: s * d


def asymmetry(u: Played, rng: np.random.Generator) -> Adding:
    """A channel whose scale differs between the two senses."""
    channel = int(rng.integers(6))
    d = u.alone(channel, 1e-5 * np.abs(u.both[:, channel]))
    return lambda s: s * d


def misalignment(u: Played, rng: np.random.Generator) -> Adding:
    """Gyros that see the other axes."""
    matrix, keep = rng.standard_normal((3, 3)) * (1 - np.eye(3)) * 1e-4, rng.random((3, 3)) < 0.5
    keep[0, 1] = True
    d = np.concatenate([u.rates @ (matrix * keep).T, np.zeros_like(u.rates)], axis=1)
    return lambda s: s * d


def second_order(u: Played, rng: np.random.Generator) -> Adding:
    """Accelerometers that follow the square of the force."""
    d = np.concatenate([np.zeros_like(u.forces), 1e-6 * u.forces**2 * rng.standard_normal(3)], axis=1)
    return lambda s: s * d


#: Cause -> how it adds, and effects that name it.
CAUSES: dict[str, tuple[Callable[[Played, np.random.Generator], Adding], tuple[str, ...]]] = {
    "axis_angle": (axis_angle, ("axis_non_orthogonality",)),
    "axis_tilt": (axis_tilt, ("base_level",)),
    "encoder": (encoder, ("encoder_eccentricity",)),
    "g_sensitivity": (g_sensitivity, ("g_sensitivity",)),
    "lever_arms": (lever_arms, ("size_effect",)),
    "asynchrony": (asynchrony, ("force_delay",)),
    "thermal_lag": (thermal_lag, ("bias_thermal_lag", "bias_temperature_rate")),
    "loose_mounting": (loose_mounting, ("mounting_shift",)),
    "asymmetry": (asymmetry, ("scale_factor_asymmetry", "accel_asymmetry")),
    "misalignment": (misalignment, ("misalignment", "non_orthogonality", "cross_axis")),
    "second_order": (second_order, ("accel_second_order",)),
}


def strength_of(d: Floats, u: Played, noises: Set, stated: dict[str, float], warm: bool, skewed: bool) -> float:
    """Whitened norm of an addition beside the declared model with the table's priors."""
    n = len(u.rates) // BLOCK
    roots = [np.linalg.inv(np.linalg.cholesky(covariance(noises.white[i], noises.flicker[i], n))) for i in range(2)]

    def white(values: Floats) -> Floats:
        cells = means(values, BLOCK)
        return np.concatenate([roots[c // 3] @ cells[:, c] for c in range(6)])

    columns = []
    for c in range(6):
        others = [j for j in range(3) if j == c % 3 or (skewed and (c < 3 or j < c - 3))]
        own = [np.ones(len(u.rates)), *(u.both[:, 3 * (c // 3) + j] for j in others)]
        own += [u.temperature - 25] if warm else []
        columns += [white(u.alone(c, values)) for values in own]
    prior, step = [], 1e-5
    for name in ("seat", "tilt", "heading"):
        value = np.atleast_1d(getattr(u.table, name))
        for j in range(len(value) if stated[name] > 0 else 0):
            moved = value + step * np.eye(len(value))[j]
            changed: dict[str, Any] = {name: float(moved[0]) if name == "heading" else moved}
            table = replace(u.table, **changed)
            columns.append(white((u.on(table) - u.on(u.table)) / step))
            prior.append((len(columns) - 1, 1 / stated[name]))
    design = np.column_stack(columns)
    rows = np.zeros((len(prior), design.shape[1]))
    for i, (j, weight) in enumerate(prior):
        rows[i, j] = weight
    whole, right = np.vstack([design, rows]), np.concatenate([white(d), np.zeros(len(rows))])
    q, _ = np.linalg.qr(whole / np.linalg.norm(whole, axis=0))
    return float(np.linalg.norm(right - q @ (q.T @ right)))


def write(folder: Path, channels: dict[str, Any], truth: dict[str, Any]) -> None:
    """The data and a manifest as insenv/SystemCalibration-v0 saves them."""
    folder.mkdir(parents=True, exist_ok=True)
    np.savez(folder / "manifest_1.npz", **channels)
    one, stated = SETS[truth["kind"]], truth["stated"]
    lines = [
        f'title = "{folder.name}"',
        "",
        "[[runs]]",
        'file = "manifest_1.npz"',
        'label = "run"',
        "[runs.site]",
        f'latitude = "{truth["latitude"]!r} rad"',
        f'gravity = "{G} m/s^2"',
        "[runs.mounting]",
        'axes = "RFU"',
        "[runs.mounting.gimbals]",
        f'order = "{truth["axes"]}"',
        f'encoder_noise = "{one.encoder!r} rad"',
    ]
    for key, name in (("seat", "mounting"), ("tilt", "tilt"), ("heading", "heading_error")):
        if stated[key]:
            lines.append(f'{name} = "{stated[key]!r} rad"')
    lines += ["", "[channels.time]", 'unit = "s"']
    for name in channels:
        if name.startswith(("gyro", "accel")):
            unit = "rad/s" if name.startswith("gyro") else "m/s^2"
            lines += [f"[channels.{name}]", f'unit = "{unit}"', 'covers = "interval"']
        elif name.startswith("axis"):
            lines += [f"[channels.{name}]", 'unit = "rad"']
    lines += [
        "[channels.turning]",
        'column = "turning"',
        'covers = "interval"',
        "[channels.temperature]",
        'unit = "K"',
        "",
    ]
    declared = ["bias", "scale_factor", "accel_bias", "accel_scale_factor"]
    declared += [] if truth["cause"] == "misalignment" else ["misalignment", "non_orthogonality"]
    declared += ["bias_temperature"] if truth["warm"] else []
    targets = [f"{t}_{a}" for t in ("gyro", "accel") for a in "xyz"]
    lines += ["[model]", f"target = {json.dumps(targets)}", f"declared = {json.dumps(declared)}",
              'reference_temperature = "298.15 K"', 'procedure = "multi-position"', ""]  # fmt: skip
    for target in targets:
        i = int(target[0] == "a")
        walk, level = ("rad/sqrt(s)", "rad/s") if not i else ("m/s/sqrt(s)", "m/s^2")
        lines += [
            f"[noise.{target}]",
            f'angle_random_walk = "{one.white[i]!r} {walk}"',
            f'bias_instability = "{one.flicker[i]!r} {level}"',
        ]
    (folder / "manifest.toml").write_text("\n".join(lines) + "\n")


def main() -> None:
    """Write the cases."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cases", type=int, default=110)
    parser.add_argument("--nulls", type=int, default=0)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--strength", type=float, default=10.0)
    asked = parser.parse_args()
    truths = {}
    names = list(CAUSES)
    wanted: list[tuple[int, str | None]] = [
        (i, names[i % len(names)]) for i in range(asked.first, asked.first + asked.cases)
    ]
    wanted += [(100000 + i, None) for i in range(asked.first, asked.first + asked.nulls)]
    for number, cause in wanted:
        channels, truth = case(number, cause, asked.strength)
        name = f"case_{number:04d}"
        write(asked.folder / name, channels, truth)
        truths[name] = truth
        (asked.folder / f"truth_{asked.first}.json").write_text(json.dumps(truths, indent=1))


if __name__ == "__main__":
    main()
