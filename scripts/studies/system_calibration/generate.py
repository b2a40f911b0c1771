r"""Recordings of a unit on a table of several axes, with one cause that nobody declared: numpy alone, of its own.

Nothing of insenv's effects or kinematics is used. The attitude is a product of matrices at every sub-step; gyros read
the rotation vectors between sub-steps, accelerometers gravity and the second differences of where they are:

    C = M_seat T_k(theta_k) ... S T_1(theta_1) B,      w dt = log(C_(i+1) C_i'),      f = C (g k + d^2 (C' r) / dt^2)

A cause is sized so that what it adds, beside everything that is declared, is ``strength`` standard deviations of the
noise (white, and a flicker that is a sum of Gauss and Markov processes):

    strength^2 = min over beta of (d - J beta)' V^-1 (d - J beta) + beta' P^-1 beta

python scripts/studies/system_calibration/generate.py FOLDER [--cases 110] [--nulls 0] [--first 0] [--strength 10]
writes FOLDER/case_0000/manifest.toml ... and FOLDER/truth.json.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
G, EARTH = 9.8017, 7.292115e-5
DEG, ARCSEC, PPM = np.pi / 180, np.pi / 180 / 3600, 1e-6
SAMPLING, SUB = 20.0, 4
BLOCK = int(SAMPLING)  # samples of a block of one second
#: Cause -> effects that name it.
CAUSES: dict[str, tuple[str, ...]] = {
    "axis_angle": ("axis_non_orthogonality",),
    "axis_tilt": ("base_level",),
    "encoder": ("encoder_eccentricity",),
    "g_sensitivity": ("g_sensitivity",),
    "lever_arms": ("size_effect",),
    "asynchrony": ("force_delay",),
    "thermal_lag": ("bias_thermal_lag", "bias_temperature_rate"),
    "loose_mounting": ("mounting_shift",),
    "asymmetry": ("scale_factor_asymmetry", "accel_asymmetry"),
    "misalignment": ("misalignment", "non_orthogonality"),
    "second_order": ("accel_second_order",),
}
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
    "fog": Set((2.9e-6, 3.9e-4), (9.7e-8, 4.9e-5), (1e-5, 1e-2), 3e-4, 3e-4, 60 * ARCSEC, 10 * ARCSEC, 60 * ARCSEC, 0.05 * ARCSEC),
    "mems": Set((8.7e-5, 2e-3), (2.4e-5, 4e-4), (8.7e-3, 0.3), 1e-2, 5e-3, 600 * ARCSEC, 60 * ARCSEC, 3600 * ARCSEC, 2 * ARCSEC),
}  # fmt: skip


def rotation(axis: str, angle: Floats) -> Floats:
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
    return rotation("z", vector[2]) @ rotation("y", vector[1]) @ rotation("x", vector[0])


@dataclass(frozen=True)
class Path_:
    """Angles of the axes at the sub-steps, (k, n sub + 1), where they turn, (n,), and begins of the turns [s]."""

    axes: str
    angles: Floats
    turning: Floats
    begins: Floats


def path(axes: str, positions: Floats, dwell: float, rate: float, acceleration: float) -> Path_:
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
            shape = np.where(s < r, s * s / (2 * r), np.where(s > 1 - r, (1 - r) - (1 - s) ** 2 / (2 * r), s - r / 2)) / (1 - r)
            part = np.repeat(now[:, None], len(s), axis=1)
            part[m] = now[m] + move * shape
            angles.append(part)
            flags.append(np.ones(len(s) // SUB))
            now = now.copy()
            now[m] = target[m]
    return Path_(axes, np.concatenate(angles, axis=1), np.concatenate(flags), np.array(begins))


@dataclass(frozen=True)
class Table:
    """What is wrong with a table and the unit's seat."""

    seat: Floats
    tilt: Floats
    heading: float
    square: Floats
    eccentric: Floats
    slip: tuple[float, Floats] = (np.inf, np.zeros(3))


def attitudes(p: Path_, table: Table, latitude: float) -> tuple[Floats, Floats]:
    """C at the sub-steps from the local level (east, north, up), and rotation vectors between them."""
    true = p.angles.copy()  # readings; true angles are off by the encoders' eccentricity
    for m in range(len(p.axes)):
        c, s = table.eccentric[2 * m : 2 * m + 2]
        true[m] -= c * np.cos(p.angles[m]) + s * np.sin(p.angles[m])
    matrix = np.broadcast_to(
        rotation("y", table.tilt[1]) @ rotation("x", table.tilt[0]) @ rotation("z", -table.heading), (true.shape[1], 3, 3)
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
    vector = 0.5 * np.stack([step[:, 1, 2] - step[:, 2, 1], step[:, 2, 0] - step[:, 0, 2], step[:, 0, 1] - step[:, 1, 0]], 1)
    size = np.linalg.norm(vector, axis=1)
    vector *= np.where(size > 1e-9, np.arcsin(np.minimum(size, 1)) / np.maximum(size, 1e-12), 1.0)[:, None]
    if np.isfinite(table.slip[0]):  # a slip within a sub-step is felt as the turn that it is
        pass
    earth = EARTH * np.array([0.0, np.cos(latitude), np.sin(latitude)])
    felt = 0.5 * (matrix[1:] + matrix[:-1]) @ earth
    return matrix, vector + felt * h


def means(values: Floats, per: int) -> Floats:
    """Means over ``per`` values along the first axis."""
    n = len(values) // per
    return values[: n * per].reshape(n, per, *values.shape[1:]).mean(axis=1)


def felt(p: Path_, table: Table, latitude: float, arms: Floats | None = None, late: float = 0.0) -> tuple[Floats, Floats]:
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


def case(number: int, cause: str | None, strength: float, positions: str = "random") -> tuple[dict[str, Any], dict[str, Any]]:
    """Channels, and the truth with what the manifest says."""
    rng = np.random.default_rng([20261123, number])
    kind = "fog" if rng.random() < 0.6 else "mems"
    one, latitude = SETS[kind], float(rng.uniform(20, 60)) * DEG
    axes = str(rng.choice(["zxy", "xyz", "yxz", "yz"] if positions == "random" else ["zxy"]))
    k = len(axes)
    p = path(axes, _positions(axes, rng, positions), float(rng.uniform(25, 45)), 20 * DEG if kind == "fog" else 60 * DEG, 30 * DEG)
    warm = cause == "thermal_lag" or rng.random() < 0.3
    stated = {"seat": one.seat, "tilt": one.tilt, "heading": one.heading}
    if cause == "axis_tilt":
        stated["tilt"] = 0.0
    table = Table(
        stated["seat"] * rng.standard_normal(3), stated["tilt"] * rng.standard_normal(2),
        stated["heading"] * rng.standard_normal(), np.zeros(k - 1), np.zeros(2 * k),
    )  # fmt: skip
    w, f = felt(p, table, latitude)
    n = len(w) // BLOCK * BLOCK
    w, f = w[:n], f[:n]
    minutes = np.arange(n) / SAMPLING / 60
    rise, period = rng.uniform(5, 15), rng.uniform(15, 40)
    temperature = 25 + (rise * (1 - np.exp(-minutes / rng.uniform(4, 10))) + 3 * np.sin(2 * np.pi * minutes / period) if warm else 0 * minutes)
    out = np.concatenate([w, f], axis=1)
    own = _declared_errors(w, f, one, cause, temperature if warm else None, rng)
    out = out + own
    size = 1.0
    if cause is not None:
        add = _cause(cause, p, table, latitude, (w, f), temperature, one, rng)
        added = add(1.0)[:n]
        reached = _strength(added, p, table, latitude, (w, f), temperature if warm else None, one, stated, cause)
        size = strength / reached
        out = out + (add(size)[:n] if cause in ("asynchrony", "loose_mounting", "axis_angle", "encoder", "axis_tilt") else size * added)
    for c in range(6):
        out[:, c] += noise(one.white[c // 3], one.flicker[c // 3], n, rng)
    readings = p.angles[:, SUB::SUB][:, :n] + one.encoder * rng.standard_normal((k, n))
    channels: dict[str, Any] = {"time": (np.arange(n) + 1) / SAMPLING}
    channels |= {f"{t}_{a}": out[:, 3 * i + j] for i, t in enumerate(("gyro", "accel")) for j, a in enumerate("xyz")}
    channels |= {f"axis_{m + 1}": readings[m] for m in range(k)}
    channels |= {"turning": p.turning[:n], "temperature": temperature + 273.15}
    said = {"axes": axes, "latitude": latitude, "stated": stated, "kind": kind, "warm": warm}
    return channels, {"cause": cause, "names": list(CAUSES[cause]) if cause else [], "size": size, **said}


def _positions(axes: str, rng: np.random.Generator, named: str) -> Floats:
    k = len(axes)
    if named == "six":
        q = 90 * DEG
        return np.array([[0, 0, 0], [0, q, 0], [0, -q, 0], [0, 0, q], [0, 0, -q], [0, 2 * q, 0]])
    now, found = np.zeros(k), []
    last = -1
    for _ in range(int(rng.integers(22, 30))):
        m = int(rng.choice([i for i in range(k) if i != last]))
        step = rng.choice([-180, -90, -90, 90, 90, 180, 45, -45]) * DEG
        now = now.copy()
        now[m] = now[m] + step if abs(now[m] + step) <= 360 * DEG else now[m] - step
        found.append(now)
        last = m
    return np.array(found)


def _declared_errors(w: Floats, f: Floats, one: Set, cause: str | None, temperature: Floats | None, rng: np.random.Generator) -> Floats:
    skew = 0.0 if cause == "misalignment" else one.skew
    gyro = np.diag(one.scale * rng.standard_normal(3)) + skew * rng.standard_normal((3, 3)) * (1 - np.eye(3))
    lower = np.diag(one.scale * rng.standard_normal(3)) + skew * np.tril(rng.standard_normal((3, 3)), -1)
    bias = np.repeat(one.bias, 3) * rng.standard_normal(6)
    out = np.concatenate([w @ gyro.T, f @ lower.T], axis=1) + bias
    if temperature is not None:
        out += (temperature - 25)[:, None] * 0.02 * np.repeat(one.bias, 3) * rng.standard_normal(6)
    return out


def _cause(cause: str, p: Path_, table: Table, latitude: float, true: tuple[Floats, Floats], temperature: Floats, one: Set, rng: np.random.Generator):  # noqa: ANN202, C901, PLR0911, PLR0912, PLR0913
    """What the cause adds for a size, as a function of it, shape (n, 6)."""
    from dataclasses import replace

    w, f = true
    base = np.concatenate([w, f], axis=1)
    k, zero = len(p.axes), np.zeros_like(w)

    def of_table(changed):  # noqa: ANN001, ANN202
        def add(size: float) -> Floats:
            return np.concatenate(felt(p, changed(size), latitude), axis=1)[: len(base)] - base

        return add

    if cause == "axis_angle":
        direction = rng.standard_normal(k - 1) * 1e-4
        return of_table(lambda s: replace(table, square=s * direction))
    if cause == "axis_tilt":
        direction = rng.standard_normal(2) * 1e-4
        return of_table(lambda s: replace(table, tilt=s * direction))
    if cause == "encoder":
        direction = np.zeros(2 * k)
        m = int(rng.integers(k))
        direction[2 * m : 2 * m + 2] = rng.standard_normal(2) * 1e-4
        return of_table(lambda s: replace(table, eccentric=s * direction))
    if cause == "loose_mounting":
        direction, moves = rng.standard_normal(3) * 1e-4, p.begins[len(p.begins) // 4 : -len(p.begins) // 4]
        at = float(rng.choice(moves)) + 1.0
        return of_table(lambda s: replace(table, slip=(at, s * direction)))
    if cause == "asynchrony":
        return lambda s: np.concatenate([zero, felt(p, table, latitude, late=2e-3 * s)[1][: len(f)] - f], axis=1)
    if cause == "lever_arms":
        arms = rng.standard_normal((3, 3)) * 0.03
        d = felt(p, table, latitude, arms)[1][: len(f)] - f
        return lambda s: s * np.concatenate([zero, d], axis=1)
    if cause == "g_sensitivity":
        matrix = rng.standard_normal((3, 3)) * 1e-7
        if rng.random() < 0.5:
            matrix = np.diag(rng.standard_normal(3)) * 1e-7
        d = np.concatenate([f @ matrix.T, zero], axis=1)
    elif cause == "thermal_lag":
        c, tau, d = int(rng.integers(6)), float(np.exp(rng.uniform(np.log(60), np.log(600)))), np.zeros_like(base)
        decay = np.exp(-1 / SAMPLING / tau)
        start = temperature - temperature[0]
        late = _first_order((1 - decay) * start, decay) + temperature[0]
        d[:, c] = temperature - late
        d *= 1e-7
    elif cause == "asymmetry":
        d = np.zeros_like(base)
        c = int(rng.integers(6))
        d[:, c] = 1e-5 * np.abs(base[:, c])
    elif cause == "misalignment":
        matrix = rng.standard_normal((3, 3)) * (1 - np.eye(3)) * 1e-4
        keep = rng.random((3, 3)) < 0.5
        keep[0, 1] = True
        d = np.concatenate([w @ (matrix * keep).T, zero], axis=1)
    elif cause == "second_order":
        d = np.concatenate([zero, 1e-6 * f * f * rng.standard_normal(3)], axis=1)
    else:
        raise ValueError(cause)
    return lambda s: s * d


def _strength(d: Floats, p: Path_, table: Table, latitude: float, true: tuple[Floats, Floats], temperature: Floats | None, one: Set, stated: dict[str, float], cause: str) -> float:  # noqa: PLR0913
    """Whitened norm of what is added, beside the declared model with its prior of the table."""
    from dataclasses import replace

    w, f = true
    n = len(w) // BLOCK
    roots = [np.linalg.inv(np.linalg.cholesky(covariance(one.white[i], one.flicker[i], n))) for i in range(2)]
    base = np.concatenate([w, f], axis=1)

    def white(values: Floats) -> Floats:
        cells = means(values, BLOCK)
        return np.concatenate([roots[c // 3] @ cells[:, c] for c in range(6)])

    columns = []
    for c in range(6):
        own = [np.ones(len(w)), *(base[:, 3 * (c // 3) + j] for j in range(3) if c < 3 or j <= c - 3)]
        if cause == "misalignment":
            own = [np.ones(len(w)), base[:, c]]
        if temperature is not None:
            own.append(temperature - 25)
        for values in own:
            column = np.zeros_like(base)
            column[:, c] = values
            columns.append(white(column))
    prior = []
    for name, sd in (("seat", stated["seat"]), ("tilt", stated["tilt"]), ("heading", stated["heading"])):
        for j in range(1 if name == "heading" else 2 if name == "tilt" else 3):
            if not sd > 0:
                continue
            value = getattr(table, name)
            step = 1e-5
            moved = value + step if name == "heading" else value + step * np.eye(len(value))[j]
            columns.append(white((np.concatenate(felt(p, replace(table, **{name: moved}), latitude), axis=1)[: len(base)] - base) / step))
            prior.append((len(columns) - 1, 1 / sd))
    design = np.column_stack(columns)
    rows = np.zeros((len(prior), design.shape[1]))
    for i, (j, weight) in enumerate(prior):
        rows[i, j] = weight
    whole = np.vstack([design, rows])
    right = np.concatenate([white(d), np.zeros(len(rows))])
    q, _ = np.linalg.qr(whole / np.linalg.norm(whole, axis=0))
    return float(np.linalg.norm(right - q @ (q.T @ right)))


def write(folder: Path, channels: dict[str, Any], truth: dict[str, Any]) -> None:
    """The data and a manifest as insenv/SystemCalibration-v0 saves them."""
    folder.mkdir(parents=True, exist_ok=True)
    np.savez(folder / "manifest_1.npz", **channels)
    one, stated = SETS[truth["kind"]], truth["stated"]
    lines = [f'title = "{folder.name}"', "", "[[runs]]", 'file = "manifest_1.npz"', 'label = "run"', "[runs.site]",
             f'latitude = "{truth["latitude"]!r} rad"', f'gravity = "{G} m/s^2"', "[runs.mounting]", 'axes = "RFU"',
             "[runs.mounting.gimbals]", f'order = "{truth["axes"]}"', f'encoder_noise = "{one.encoder!r} rad"']  # fmt: skip
    for key, name in (("seat", "mounting"), ("tilt", "tilt"), ("heading", "heading_error")):
        if stated[key]:
            lines.append(f'{name} = "{stated[key]!r} rad"')
    lines += ["", "[channels.time]", 'unit = "s"']
    for name in channels:
        if name.startswith(("gyro", "accel")):
            lines += [f"[channels.{name}]", f'unit = "{"rad/s" if name[0] == "g" else "m/s^2"}"', 'covers = "interval"']
        elif name.startswith("axis"):
            lines += [f"[channels.{name}]", 'unit = "rad"']
    lines += ["[channels.turning]", 'column = "turning"', 'covers = "interval"', "[channels.temperature]", 'unit = "K"', ""]
    declared = ["bias", "scale_factor", "accel_bias", "accel_scale_factor"]
    declared += [] if truth["cause"] == "misalignment" else ["misalignment", "non_orthogonality"]
    declared += ["bias_temperature"] if truth["warm"] else []
    targets = [f"{t}_{a}" for t in ("gyro", "accel") for a in "xyz"]
    lines += ["[model]", f"target = {json.dumps(targets)}", f"declared = {json.dumps(declared)}",
              'reference_temperature = "298.15 K"', 'procedure = "multi-position"', ""]  # fmt: skip
    for target in targets:
        i = int(target[0] == "a")
        walk, level = ("rad/sqrt(s)", "rad/s") if not i else ("m/s/sqrt(s)", "m/s^2")
        lines += [f"[noise.{target}]", f'angle_random_walk = "{one.white[i]!r} {walk}"', f'bias_instability = "{one.flicker[i]!r} {level}"']
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
    wanted = [(i, names[i % len(names)]) for i in range(asked.first, asked.first + asked.cases)]
    wanted += [(100000 + i, None) for i in range(asked.first, asked.first + asked.nulls)]
    for number, cause in wanted:
        channels, truth = case(number, cause, asked.strength)
        name = f"case_{number:04d}"
        write(asked.folder / name, channels, truth)
        truths[name] = truth
    (asked.folder / f"truth_{asked.first}.json").write_text(json.dumps(truths, indent=1))


if __name__ == "__main__":
    main()
