"""Recordings with sound declarations, and the same with one declaration that is wrong; numpy only, no effect of insenv.

A bench is drawn from a seed: a rate table with an angle, a command or both, or a triad of accelerometers at rest or on
six faces. Gains of instruments are within 5 % of one, biases those of cheap sensors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

G = 9.80665


@dataclass(frozen=True)
class Bench:
    """Columns of a file and what a manifest says of each: channel -> (column, unit, further keys)."""

    columns: Mapping[str, np.ndarray]
    says: Mapping[str, tuple[str, str, str]]
    targets: tuple[str, ...]

    def write(self, folder: Path, name: str) -> Path:
        np.savez(folder / f"{name}.npz", **self.columns)  # type: ignore[arg-type]
        lines = [f'data = "{name}.npz"', "[channels]"]
        for channel, (column, unit, more) in self.says.items():
            lines.append(f'{channel} = {{ column = "{column}", unit = "{unit}"{more} }}')
        targets = ", ".join(f'"{t}"' for t in self.targets)
        lines += ["[model]", f"target = [{targets}]", 'declared = ["bias"]']
        path = folder / f"{name}.toml"
        path.write_text("\n".join(lines) + "\n")
        return path


def bench(seed: int) -> Bench:
    """A sound one."""
    rng = np.random.default_rng(seed)
    return (_table, _faces)[int(rng.random() < 0.3)](rng)


def _table(rng: np.random.Generator) -> Bench:
    dt = float(rng.choice([0.005, 0.01, 0.02, 0.05]))
    n = int(rng.integers(1500, 4000))
    t = np.arange(n) * dt
    rates = rng.choice([5.0, 10.0, 20.0, 50.0, 100.0], 6) * np.array([1, -1, 1, -1, 1, -1])
    rate = rates[np.minimum((6 * np.arange(n)) // n, 5)]
    rate = np.convolve(np.append(np.zeros(20), rate), np.ones(21) / 21, "valid")[:n]
    angle = np.cumsum(rate) * dt
    gyro = rng.normal(1, 0.02) * rate + rng.normal(0, 0.5) + rng.normal(0, 0.2, n)
    columns = {"time": t, "gyro": gyro, "angle": angle + rng.normal(0, 0.01, n), "rate": rate}
    says = {"time": ("time", "s", ""), "gyro": ("gyro", "deg/s", "")}
    if rng.random() < 0.3:
        columns["gyro"] = gyro * dt
        says["gyro"] = ("gyro", "deg", ', quantity = "increment"')
    which = int(rng.integers(3))
    if which != 1:
        says["table_angle"] = ("angle", "deg", "")
    if which != 0:
        says["table_rate"] = ("rate", "deg/s", "")
    return Bench(columns, says, ("gyro",))


def _faces(rng: np.random.Generator) -> Bench:
    dt, n = 0.01, 1800
    face = (6 * np.arange(n)) // n if rng.random() < 0.5 else np.zeros(n, int)
    up = np.concatenate([np.eye(3), -np.eye(3)])[face]
    force = up * G * rng.normal(1, 0.02, 3) + rng.normal(0, 0.2, 3) + rng.normal(0, 0.02, (n, 3))
    columns = {"time": np.arange(n) * dt, **{f"a{axis}": force[:, i] for i, axis in enumerate("xyz")}}
    says = {"time": ("time", "s", "")} | {f"accel_{axis}": (f"a{axis}", "m/s^2", "") for axis in "xyz"}
    return Bench(columns, says, ("accel_x", "accel_y", "accel_z"))


Damage = Callable[[Bench], Bench]


def _unit(channel: str, unit: str) -> Damage:
    def spoil(b: Bench) -> Bench:
        return replace(b, says={n: (c, unit if n.startswith(channel) else u, m) for n, (c, u, m) in b.says.items()})

    return spoil


def _quantity(b: Bench) -> Bench:
    column, _, more = b.says["gyro"]
    said = ("deg/s", "") if more else ("deg", ', quantity = "increment"')
    return replace(b, says={**b.says, "gyro": (column, *said)})


def _scaled(column: str, factor: float) -> Damage:
    return lambda b: replace(b, columns={**b.columns, column: b.columns[column] * factor})


def _forces(factor: float) -> Damage:
    return lambda b: replace(b, columns={n: x * factor if n[0] == "a" else x for n, x in b.columns.items()})


def _dead(column: str) -> Damage:
    return lambda b: replace(b, columns={**b.columns, column: np.zeros(len(b.columns[column]))})


def _across(b: Bench) -> Bench:
    """The gyro of another axis, which sees nothing of the table."""
    gyro = b.columns["gyro"]
    steps = np.diff(gyro, append=gyro[-1])
    return replace(b, columns={**b.columns, "gyro": 0.1 * np.median(np.abs(gyro)) + np.clip(steps, -0.5, 0.5)})


def damages(b: Bench) -> dict[str, Damage]:
    """What may be wrong with such a bench: a name and how to bring it about."""
    if "gyro" not in b.says:
        return {
            "forces in g": _forces(1 / G),
            "forces in mg": _forces(1000 / G),
            "declared g": _unit("accel", "g"),
            "declared mg": _unit("accel", "mg"),
            "dead axis": _dead("ay"),
            "half the range": _forces(0.5),
        }
    increment = bool(b.says["gyro"][2])
    found = {
        "gyro in rad": _scaled("gyro", np.pi / 180),
        "gyro declared rad": _unit("gyro", "rad" if increment else "rad/s"),
        "gyro in thousandths": _scaled("gyro", 1000.0),
        "quantity": _quantity,
        "reversed": _scaled("gyro", -1.0),
        "dead gyro": _dead("gyro"),
        "gyro across": _across,
    }
    if not increment:
        found["gyro in deg/h"] = _scaled("gyro", 3600.0)
        found["gyro twice turned into rad"] = lambda b: _unit("gyro", "rad/s")(_scaled("gyro", (np.pi / 180) ** 2)(b))
    if "table_rate" in b.says:
        found["command in rad"] = _scaled("rate", np.pi / 180)
        found["command in rpm"] = _scaled("rate", 1 / 6)
    if "table_angle" in b.says:
        found["angle in rad"] = _scaled("angle", np.pi / 180)
        found["angle in turns"] = _scaled("angle", 1 / 360)
    if increment != ("table_angle" in b.says) or {"table_rate", "table_angle"} <= b.says.keys():
        found["time in ms"] = _scaled("time", 1000.0)
    return found
