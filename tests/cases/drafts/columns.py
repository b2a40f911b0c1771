"""Columns of units turned by hand and of gyros on tables, written as files, and the drafts that are made of them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

from insenv.core.recording import Floats
from insenv.core.units import STANDARD_GRAVITY
from insenv.data.guess.decide import draft
from insenv.data.guess.draft import Draft
from insenv.data.guess.listing import listing

DT = 0.01
TIME = {"time": np.arange(8000.0) * DT}


def table(path: Path, columns: Mapping[str, Floats], delimiter: str = ",", header: bool = True) -> Path:
    lines = [delimiter.join(columns)] if header else []
    lines += [delimiter.join(f"{value:.12g}" for value in row) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join(lines) + "\n")
    return path


def drafted(path: Path, **answers: str) -> Draft:
    return draft([listing(path)], {key.replace("__", "."): value for key, value in answers.items()})


def units(found: Draft) -> dict[str, str | None]:
    return {channel.name: channel.unit.value for channel in found.channels}


def asked(found: Draft) -> dict[str, str]:
    return {question.key: question.hint for question in found.questions}


def turned_by_hand(gyro: float = 1.0, accel: float = 1.0, seed: int = 1) -> dict[str, Floats]:
    """A triad that rests in eight attitudes and is turned in between; gyros and forces in units of rad/s and m/s^2."""
    rate, force = _by_hand(seed)
    return {
        **{f"gyro_{a}": rate[:, i] / gyro for i, a in enumerate("xyz")},
        **{f"accel_{a}": force[:, i] / accel for i, a in enumerate("xyz")},
    }


@cache
def _by_hand(seed: int) -> tuple[Floats, Floats]:
    """Rates [rad/s] and forces [m/s^2], shape (rows, 3) each."""
    random = np.random.default_rng(seed)
    rate = np.zeros((8000, 3))
    for start in range(500, 8000, 1000):
        axis = random.standard_normal(3)
        rate[start : start + 200] = (axis / np.linalg.norm(axis)) * np.sin(np.linspace(0, np.pi, 200))[:, None]
    up = np.empty_like(rate)
    now = np.array([0.0, 0.0, 1.0])
    for i, w in enumerate(rate):
        now = now - np.cross(w, now) * DT
        now /= np.linalg.norm(now)
        up[i] = now
    rate += 2e-3 * random.standard_normal(rate.shape)
    return rate, STANDARD_GRAVITY * up + 0.02 * random.standard_normal(up.shape)


def on_table(gain: float = 1.0, unit: float = 1.0, seed: int = 1) -> dict[str, Floats]:
    """A gyro in deg/s that follows a table with a gain; the table's rate in a unit of so many deg/s."""
    t = np.arange(4000) * 0.1
    rate = np.array([10.0, -10.0, 4.0, -4.0])[(t // 20 % 4).astype(int)]
    noise = 0.05 * np.random.default_rng(seed).standard_normal(len(t))
    return {"time": t, "gyro (deg/s)": gain * rate + 0.01 + noise, "table_rate": rate / unit}
