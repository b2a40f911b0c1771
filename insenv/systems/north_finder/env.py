r"""The north finder: a laser gyro, tilted on a turntable, finds the azimuth of the table's zero mark.

    counts_k = floor(p_k),   p_k = p_{k-1} + y_k dt / q,   encoder_k = reading_k - reading_{k-1}

with the gyro's output y, the pulse q and a random start phase; the reading before the first is zero, as the
table starts at rest at its zero mark. An action is the rate that the table is to take up and whether to stop:
from a half on, the run ends and no time passes. `insenv/NorthFinder-v0` and its vector form are made here from a
scenario; everything that is not the north finder's own is in the modules beside.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from gymnasium import spaces

from insenv.core.estimate import Datasheet
from insenv.core.recording import Channel, Floats
from insenv.envs.belief import SoughtQuantity
from insenv.envs.group import Blocks, Film, Flags
from insenv.envs.normalised import Maker
from insenv.envs.setup import Setup, scenario_task
from insenv.envs.single import SystemEnv
from insenv.envs.task import Task
from insenv.envs.vector import SystemVectorEnv
from insenv.plants.profile import rest
from insenv.plants.turntable import Turntable
from insenv.rig import Readings, Rig
from insenv.scenario import Scenario
from insenv.scenario.spec import TaskSpec
from insenv.sensors.counter import count

#: The scenario of the environment that is given none.
PUBLISHED = "north_finder/published"
#: Standard deviation of an angle of which nothing is known: uniform on the circle.
ANY_AZIMUTH = np.pi / np.sqrt(3)
#: Bounds of the observation: noise in standard deviations, and what undeclared errors may add [rad/s].
_DEVIATIONS, _ROOM = 40.0, 0.1


@dataclass(frozen=True)
class Electronics:
    """Part of a pulse that is left, and the angle reading before [rad]; shape (R,)."""

    phase: Floats
    reading: Floats


@dataclass(frozen=True)
class NorthFinder:
    """The world of a scenario with a turntable; see `insenv.envs.task.World`."""

    scenario: Scenario
    datasheet: Datasheet
    samples: int

    @cached_property
    def action(self) -> spaces.Box:
        """Table rate [rad/s], and stop from 0.5 on."""
        rate = self.datasheet.limits.rate
        return spaces.Box(np.array([-rate, 0.0]), np.array([rate, 1.0]), dtype=np.float64)

    @cached_property
    def blocks(self) -> Mapping[str, spaces.Box]:
        """Spaces of the blocks of samples."""
        sheet, n = self.datasheet, self.samples
        turn = (2 * sheet.limits.rate + _ROOM) * sheet.dt
        noise = _DEVIATIONS * sheet.white("gyro") * np.sqrt(sheet.dt)
        found = {
            "encoder": _box(turn + _DEVIATIONS * sheet.encoder_noise, n),
            "temperature": spaces.Box(0.0, 1000.0, (1,), np.float64),
            "zero_pulse": spaces.Box(0.0, 1.0, (n,), np.float64),
        }
        if sheet.pulse:
            found["pulses"] = _box(np.ceil((turn + noise) / sheet.pulse) + 1, n)
        else:
            found["increments"] = _box(turn + noise, n)
        if self._levels:
            found["accel_x"] = _box(20.0, n)
        return found

    def cast(self, seeds: Sequence[int]) -> Rig:
        """The scenario's rig, its table at rest until it is commanded."""
        rig = self.scenario.cast(seeds)
        assert isinstance(rig.plant, Turntable)
        return replace(rig, plant=replace(rig.plant, profile=rest(np.inf)))

    def command(self, actions: Floats) -> tuple[Floats, Flags]:
        """Rates of the table [rad/s], and where to stop."""
        return actions[:, 0], actions[:, 1] >= 0.5

    def begin(self, rig: Rig, seeds: Sequence[int]) -> Electronics:
        """A counter somewhere within a pulse."""
        return Electronics(np.asarray(self.scenario.phases(seeds, "gyro")), np.zeros(len(seeds)))

    def still(self, rig: Rig, time: float, batch: int) -> Blocks:
        """No pulse, no turn; the temperature as it is."""
        seen = {name: np.zeros((batch, *space.shape)) for name, space in self.blocks.items()}
        seen["temperature"][:] = rig.plant.temperature.at(np.array([time]))  # type: ignore[attr-defined]
        return seen

    def read(self, readings: Readings, memory: Electronics) -> tuple[Blocks, Electronics]:
        """Counts and encoder increments; the temperature at the end."""
        rate, angle = readings.outputs["gyro"], readings.references["table_angle"].values
        turned = np.empty(angle.shape)
        np.subtract(angle[:, 1:], angle[:, :-1], out=turned[:, 1:])
        np.subtract(angle[:, 0], memory.reading, out=turned[:, 0])
        seen = {"encoder": turned, "zero_pulse": readings.references["zero_pulse"].values}
        phase, dt = memory.phase, self.datasheet.dt
        if self.datasheet.pulse:
            seen["pulses"], phase = count(rate, phase, dt / self.datasheet.pulse)
        else:
            seen["increments"] = rate * dt
        seen["temperature"] = np.empty((len(angle), 1))
        seen["temperature"][:] = readings.references["temperature"].values[..., -1:]
        if self._levels:
            seen["accel_x"] = readings.outputs["accel_x"].copy()
        return seen, Electronics(phase, angle[:, -1].copy())

    def record(self, readings: Readings, blocks: Blocks) -> Mapping[str, Channel]:
        """Gyro [rad/s] as it is counted, angle reading, temperature, and the accelerometer if there is one."""
        rate, pulse = readings.outputs["gyro"], self.datasheet.pulse
        if pulse:
            rate = blocks["pulses"] * (pulse / self.datasheet.dt)
        channels = {
            "gyro": Channel(rate, "rad/s", "interval"),
            "table_angle": Channel(readings.references["table_angle"].values, "rad"),
            "temperature": Channel(readings.references["temperature"].values, "K"),
        }
        if self._levels:
            channels["accel_x"] = Channel(readings.outputs["accel_x"], "m/s^2", "interval")
        return channels

    def truth(self, rig: Rig, batch: int) -> Mapping[str, Floats]:
        """Azimuth, level error and every parameter of the instruments, such as "gyro.scale_factor.c"."""
        plant = rig.plant
        assert isinstance(plant, Turntable)
        east, north = plant.level_error
        true: dict[str, Any] = {"azimuth": plant.azimuth, "level_east": east, "level_north": north}
        for fitted in rig.instruments:
            names = fitted.sensor.names
            true |= {f"{fitted.sensor.target}.{name}": fitted.theta[..., j] for j, name in enumerate(names)}
        return {name: np.array(np.broadcast_to(values, batch), float) for name, values in true.items()}

    def film(self, task: Task) -> Film:
        """The table from above and strip charts."""
        from insenv.systems.north_finder.film import NorthFinderFilm  # matplotlib only where a picture is wanted

        return NorthFinderFilm(task, self.scenario.table.output.title or self.scenario.path.stem)

    @cached_property
    def _levels(self) -> bool:
        return any(fitted.sensor.target == "accel_x" for fitted in self.scenario.rig.instruments)


def north_finder(
    scenario: str = PUBLISHED,
    changes: Mapping[str, Any] | None = None,
    estimator: str | None = None,
    step_s: float | None = None,
    sampling: float | None = None,
) -> Task:
    """The north finder's task.

    Parameters
    ----------
    scenario : str
        Name or path of a scenario with a turntable.
    changes : mapping, optional
        Of the scenario's entries: ``{"table.tilt": "12 deg"}``.
    estimator : str, optional
        Name of a plug-in whose belief is observed and rewarded.
    step_s : float, optional
        Length of a step [s]; as in the scenario.
    sampling : float, optional
        Sampling rate [Hz]; as in the scenario.

    Raises
    ------
    InputError
        If the scenario or the estimator cannot be used.
    """
    return scenario_task(_SETUP, scenario, changes, estimator, step_s, sampling)


def _world(scenario: Scenario, sheet: Datasheet, spec: TaskSpec) -> NorthFinder:
    return NorthFinder(scenario, sheet, spec.samples)


def _north(spec: TaskSpec, sheet: Datasheet) -> tuple[SoughtQuantity, ...]:
    azimuth = SoughtQuantity("azimuth", ANY_AZIMUTH, np.pi, spec.demanded, circular=True, unit="rad")
    return (azimuth,) if spec.kind == "north-finder" else ()


_SETUP = Setup("north finder", "NorthFinder", "[table]", _world, _north)


class NorthFinderEnv(SystemEnv):
    """``insenv/NorthFinder-v0``; parameters as of `north_finder`."""

    maker = staticmethod(north_finder)


#: What `gymnasium.make` calls.
made = Maker(NorthFinderEnv, "north_gls")


class NorthFinderVectorEnv(SystemVectorEnv):
    """The vector form of ``insenv/NorthFinder-v0``; parameters as of `north_finder` and `TaskVectorEnv`."""

    maker = staticmethod(north_finder)


def _box(limit: float, n: int) -> spaces.Box:
    return spaces.Box(-limit, limit, (n,), np.float64)
