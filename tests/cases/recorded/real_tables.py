"""Rate tables as laboratories have them, simulated without insenv's effects: real servos, controllers and encoders.

A controller logs what it asks for, which jumps; the table follows at a limited acceleration; the encoder reads the
angle, with its own noise, rounding and delay.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from insenv.core.recording import Channel, Floats, Recording

FINE = 20


@dataclass(frozen=True)
class Ramped:
    """A table that steps through ``levels`` [deg/s], ``dwell`` seconds each, at ``acceleration`` [deg/s^2].

    The command is logged as the value ``at`` the row, or as its mean over the row. ``scale`` is the gyro's scale-factor
    error, ``noise`` that of a row [rad/s], ``jitter`` the encoder's [rad], ``late`` how old its readings are [s].
    """

    levels: tuple[float, ...] = (10, -10, 30, -30, 60, -60, 20, -20, 45, -45)
    dwell: float = 30.0
    acceleration: float = 50.0
    dt: float = 0.1
    scale: float = 2e-3
    noise: float = 2e-5
    jitter: float = 2e-6
    late: float = 0.0
    at: Literal["instant", "interval"] = "interval"
    offset: float = 0.0

    def recording(self, seed: int, channels: tuple[str, ...] = ("table_angle", "table_rate")) -> Recording:
        """The gyro beside ``channels``."""
        rng = np.random.default_rng(seed)
        step = self.dt / FINE
        t = np.arange(0.0, self.dwell * len(self.levels) + step / 2, step)
        asked = np.deg2rad(self.levels)[np.minimum((t / self.dwell).astype(int), len(self.levels) - 1)]
        rate, most = np.empty_like(t), np.deg2rad(self.acceleration) * step
        now = asked[0]
        for i, goal in enumerate(asked.tolist()):
            now += min(max(goal - now, -most), most)
            rate[i] = now
        angle = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1])) * step])
        ends = np.arange(FINE, len(t), FINE)
        means = np.diff(angle[np.concatenate([[0], ends])]) / self.dt
        time = t[ends]
        gyro = (1 + self.scale) * means + 1e-4 + self.noise * rng.standard_normal(len(ends))
        read = np.interp(time - self.late, t, angle) + self.jitter * rng.standard_normal(len(ends))
        told = np.interp(time - self.offset, t, asked)
        if self.at == "interval":
            total = np.concatenate([[0.0], np.cumsum(asked[:-1]) * step])
            told = np.diff(total[np.concatenate([[0], ends])]) / self.dt
        made = {
            "gyro": Channel(gyro, "rad/s", "interval"),
            "table_angle": Channel(read, "rad"),
            "table_rate": Channel(told, "rad/s", self.at),
        }
        return Recording(time, {name: made[name] for name in ("gyro", *channels)})


def still(seed: int, rows: int = 9000, dt: float = 0.1, jitter: float = 1e-5) -> Recording:
    """A gyro on a table that stands, with the noise of the encoder."""
    rng = np.random.default_rng(seed)
    gyro = 2e-5 + 3e-5 * rng.standard_normal(rows) + 2e-7 * np.cumsum(rng.standard_normal(rows))
    angle: Floats = 1.0 + jitter * rng.standard_normal(rows)
    return Recording(
        dt * np.arange(1.0, rows + 1),
        {"gyro": Channel(gyro, "rad/s", "interval"), "table_angle": Channel(angle, "rad")},
    )
