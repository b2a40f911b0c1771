"""A unit on a table of three axes: recordings of its six channels, and what the loop finds in them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from insenv.close import close
from insenv.core.recording import Channel, Floats, Mounting, Recording, Site
from insenv.core.unit.gimbals import Gimbals
from insenv.core.unit.motion import GYROS, UNIT, AxesCourse, motions
from insenv.data.manifest import Model
from insenv.data.save import save
from insenv.effects.catalogue import by_key
from insenv.identify.findings import Findings
from insenv.sensors.chain import Sensor

TABLE = Gimbals("zxy", sd=(3e-4, 3e-4, 3e-4, 5e-5, 5e-5, 3e-4, *8 * (0.0,)), most=3 * (2 * np.pi,), noise=2e-7)
SITE = Site(0.7, 0.0, 9.8)
#: Deviation of a sample's white noise: of rates, of forces.
WHITE = {True: 1.3e-5, False: 1.8e-3}
RATE, DWELL = 20, 12
DECLARED = ("bias", "scale_factor", "misalignment", "accel_bias", "accel_scale_factor", "non_orthogonality")
TARGETS = {name: "gyro" if name in GYROS else "accel" for name in UNIT}


#: Positions of the axes [quarters of a turn]: right angles but for every seventh step.
Path3 = list[tuple[float, ...]]


def usual(eighths: bool = True) -> Path3:
    now, found = np.zeros(3), list[tuple[float, ...]]([(0.0, 0.0, 0.0)])
    for k in range(26):
        now[(k * 2 + k // 5) % 3] += (0.5 if eighths and k % 7 == 0 else 1.0) * (1 if k % 4 < 2 else -1)
        found.append((float(now[0]), float(now[1]), float(now[2])))
    return found


def angles(path: Path3) -> tuple[Floats, Floats]:
    """Angles of the axes at edges and middles, shape (3, 2 n + 1), by turns of five seconds; which samples move."""
    grid, quarter = np.linspace(0, 1, 10 * RATE + 1)[1:], 0.5 * np.pi
    smooth = grid - np.sin(2 * np.pi * grid) / (2 * np.pi)
    parts, begun = [], np.array(path[0]) * quarter
    for before, after in pairwise(np.array(path) * quarter):
        parts += [
            np.repeat(before[:, None], 2 * DWELL * RATE, axis=1),
            before[:, None] + np.outer(after - before, smooth),
        ]
    moving = np.tile(np.repeat([0.0, 1.0], [DWELL * RATE, 5 * RATE]), len(path) - 1)
    return np.concatenate([begun[:, None], *parts], axis=1), moving


def six_positions() -> Path3:
    """Each axis of the unit up and down, twice: the outer axis of the table rests."""
    between: tuple[float, ...] = (0.0, 0.0, 0.0)
    own: Path3 = [(0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.0, 2.0, 0.0)]
    return 2 * [between, *(at for position in own for at in (position, between))]


def proposed(procedure: str) -> Path3:
    """Positions of a proposal, one axis after the other."""
    found = Path3()
    for text in procedure.rpartition(": ")[2].removesuffix(" deg").split("; "):
        after = [float(a) / 90 for a in text.split()]
        now = list(found[-1] if found else after)
        for m in [m for m in range(3) if now[m] != after[m]] or [0]:
            now[m] = after[m]
            found.append(tuple(now))
    return found


def outputs(
    errors: dict[str, float],
    effects: dict[str, dict[str, tuple[float, ...]]],
    path: Path3 | None = None,
    table: Gimbals = TABLE,
) -> dict[str, Floats]:
    """Of the six channels without noise; ``effects`` by channel and key."""
    at, _ = angles(path or usual())
    n = (at.shape[1] - 1) // 2
    t = np.arange(n + 1) / RATE
    wrong = np.array([errors.get(name, 0.0) for name in TABLE.names])
    true = table.true_angles(at, wrong)
    rates = np.gradient(true[:, ::2], 1 / RATE, axis=1)
    course = AxesCourse(t, true, np.diff(true[:, ::2], axis=1) * RATE, rates)
    felt = motions(table, wrong, course, (SITE.latitude, 9.8), np.full(n + 1, 298.15), 298.15)
    found = {}
    for name in UNIT:
        own = effects.get(name, {})
        sensor = Sensor(name, tuple(by_key(key) for key in own))
        found[name] = sensor.measure(felt[name], sensor.theta(list(own.values())))[0]
    return found


def recording(out: dict[str, Floats], seed: int, path: Path3 | None = None, **changes: Any) -> Recording:
    rng, (at, moving) = np.random.default_rng(seed), angles(path or usual())
    n = len(moving)
    channels = {
        name: Channel(
            out[name] + WHITE[name in GYROS] * rng.standard_normal(n), "rad/s" if name in GYROS else "m/s^2", "interval"
        )
        for name in UNIT
    }
    readings = at[:, 2::2] + TABLE.noise * rng.standard_normal((3, n))
    channels |= {f"axis_{m + 1}": Channel(readings[m], "rad") for m in range(3)}
    channels["turning"] = Channel(moving, "1", "interval")
    t = (np.arange(n) + 1.0) / RATE
    return replace(Recording(t, channels, (), SITE, Mounting(gimbals=TABLE), "run"), **changes)


def found(tmp_path: Path, *runs: Recording, declared: tuple[str, ...] = DECLARED, **more: Any) -> Findings:
    path = tmp_path / "unit.toml"
    noise = {name: {"angle_random_walk": WHITE[name in GYROS] / np.sqrt(RATE)} for name in UNIT}
    save(path, runs, Model(UNIT, declared, procedure="multi-position"), noise=noise, **more)
    return close(path)
