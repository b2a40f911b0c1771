"""A table of two or three axes that carries a unit of three gyros and three accelerometers.

A command is the next position (an angle of each axis), the share of the largest rate, and the time to dwell there. A
table that turns or dwells goes on with that, whatever it is told (`insenv.core.unit.turns`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from insenv.core.estimate import Limits
from insenv.core.recording import Floats, Mounting
from insenv.core.unit.gimbals import Gimbals
from insenv.core.unit.motion import AxesCourse, motions
from insenv.core.unit.turns import Turns, at_rest, turned
from insenv.effects.angle import EarthRate
from insenv.plants.base import Plant, Reference, Scene
from insenv.plants.thermal import Constant, Temperature

#: Share of the largest rate that is commanded at least.
LEAST_SHARE = 0.01


@dataclass(frozen=True)
class MultiAxisTable(Plant):
    """A table with its axes and errors.

    Attributes
    ----------
    gimbals : Gimbals
    errors : ndarray, shape (..., q)
        Of the table, as `Gimbals.names` [rad].
    max_rate, max_acceleration : float
        [rad/s], [rad/s^2]
    latitude : float, optional
        [rad]; without it the Earth does not turn.
    gravity : float
        [m/s^2]
    temperature : Temperature
        Of the unit.
    reference_temperature : float
        T_ref of the temperature effects [K].
    """

    gimbals: Gimbals
    errors: Floats
    max_rate: float
    max_acceleration: float
    latitude: float | None = None
    gravity: float = 9.80665
    temperature: Temperature = field(default_factory=Constant)
    reference_temperature: float = 298.15

    @property
    def section(self) -> str:
        """The [axes]."""
        return "axes"

    @property
    def draws(self) -> int:
        """Unit normals per sample: one for the encoder of each axis that has noise."""
        return len(self.gimbals.axes) if self.gimbals.noise > 0 else 0

    @property
    def by_chance(self) -> bool:
        """No: it goes where it is told."""
        return False

    @property
    def limits(self) -> Limits:
        """Of each axis."""
        return Limits(self.max_rate, self.max_acceleration)

    @property
    def mounting(self) -> Mounting:
        """A unit on axes."""
        return Mounting(gimbals=self.gimbals)

    @property
    def encoder_noise(self) -> float:
        """Of one reading [rad]."""
        return self.gimbals.noise

    @property
    def excludes(self) -> Mapping[str, str]:
        """The Earth's rate as an error: it is in the true input."""
        return {EarthRate.id: "earth_rate: the true rate of a unit on a table of several axes has the Earth's in it"}

    def turned(self, angle: float) -> Self:
        """Towards another heading."""
        return replace(self, gimbals=replace(self.gimbals, heading=self.gimbals.heading + angle))

    def begin(self) -> Turns:
        """At rest at zero, and free."""
        return at_rest(np.zeros((*self.errors.shape[:-1], len(self.gimbals.axes))))

    def advance(self, state: Turns, command: Floats | None, t: Floats, z: Floats) -> tuple[Scene, Turns]:
        """Go on over the intervals with edges ``t``, shape (n + 1,) [s]; ``z`` of shape (..., draws, n).

        ``command`` has shape (..., k + 2): angles [rad], share of the largest rate, dwell [s].

        Returns
        -------
        scene : Scene
            Exposure of gyro_x .. gyro_z and accel_x .. accel_z; references "axis_1" .. "axis_k" [rad], "turning",
            "commands" (carried out so far) and "temperature".
        state : Turns
        """
        if command is not None:
            most = np.array(self.gimbals.most)
            angles, rate = np.clip(command[..., :-2], -most, most), np.clip(command[..., -2], LEAST_SHARE, 1.0)
            dwell = np.clip(command[..., -1], 0.0, self.gimbals.longest)
            state = turned(state, angles, rate * self.max_rate, dwell, self.max_acceleration, t)
        grid = np.empty(2 * len(t) - 1)
        grid[::2], grid[1::2] = t, 0.5 * (t[1:] + t[:-1])
        angles, rates = state.at(grid)
        temperature, means = self.temperature.at(t), np.diff(angles[..., ::2], axis=-1)
        means *= (len(t) - 1) / (t[-1] - t[0])
        felt = motions(
            self.gimbals,
            self.errors,
            AxesCourse(t, angles, means, rates[..., ::2]),
            (self.latitude, self.gravity),
            temperature,
            self.reference_temperature,
        )
        return Scene(felt, self._log(state, t, angles[..., 2::2], temperature, z)), state

    def _log(self, state: Turns, t: Floats, angles: Floats, temperature: Floats, z: Floats) -> dict[str, Reference]:
        readings = self.gimbals.readings(angles, self.errors)
        if self.draws:
            readings += self.gimbals.noise * z
        log = {f"axis_{m + 1}": Reference(readings[..., m, :], "rad") for m in range(len(self.gimbals.axes))}
        log["turning"] = Reference(state.moving(t), "1", over_interval=True)
        counts = np.repeat(state.commands[..., None], len(t) - 1, axis=-1)
        return log | {"commands": Reference(counts, "1"), "temperature": Reference(temperature[1:], "K")}
