r"""Calibration of a whole inertial unit: three gyros and three accelerometers on a table of two or three axes.

    action = (angle of each axis, rate, dwell, stop)

All but stop are shares of what is largest, a turn of 360 deg and five minutes where the scenario says nothing; a rate
of 0 is the largest too. From a half on, stop ends the run and no time passes. A table that turns or dwells goes on with
that, whatever it is told: the next action counts when the dwell is over, at the beginning of a step. What is seen of a
step are means: of a rest the mean, of a turn the integral over the time. Sought are all parameters of the unit of which
the scenario gives a deviation, and `demanded` is the share of it that may be left. `insenv/SystemCalibration-v0` and
its vector form are made here from a scenario.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from gymnasium import spaces

from insenv.core.estimate import Datasheet
from insenv.core.recording import Channel, Floats
from insenv.core.unit.motion import ACCELEROMETERS, GYROS
from insenv.envs.belief import SoughtQuantity
from insenv.envs.group import Blocks, Film, Flags
from insenv.envs.normalised import Maker
from insenv.envs.setup import Setup, scenario_task
from insenv.envs.single import SystemEnv
from insenv.envs.task import Task
from insenv.envs.vector import SystemVectorEnv
from insenv.information.unit.calibration import sought
from insenv.rig import Readings, Rig
from insenv.scenario import Scenario
from insenv.scenario.spec import TaskSpec
from insenv.systems.system_calibration.plant import MultiAxisTable

#: The scenario of the environment that is given none.
TACTICAL = "system_calibration/tactical_fog"
#: A mean is shown within this many prior deviations.
_MOST_DEVIATIONS = 10.0
#: Bounds of what is seen: noise in deviations, and what errors of a unit may add, as a share of the largest input.
_DEVIATIONS, _ROOM, _FORCE = 40.0, 0.2, 30.0


@dataclass(frozen=True)
class SystemCalibration:
    """The world of a scenario with ``[axes]``; see `insenv.envs.task.World`."""

    scenario: Scenario
    datasheet: Datasheet
    samples: int

    @property
    def plant(self) -> MultiAxisTable:
        """The table without its errors."""
        plant = self.scenario.rig.plant
        assert isinstance(plant, MultiAxisTable)
        return plant

    @cached_property
    def action(self) -> spaces.Box:
        """Angles, rate and dwell as shares of their largest, and stop from 0.5 on."""
        k = len(self.plant.gimbals.axes)
        return spaces.Box(np.array([*k * (-1.0,), 0.0, 0.0, 0.0]), np.ones(k + 3), dtype=np.float64)

    @cached_property
    def blocks(self) -> Mapping[str, spaces.Box]:
        """Spaces of the means, of the axes' readings and of the share of the step in which the table turned."""
        sheet, step = self.datasheet, self.samples * self.datasheet.dt
        noise = [max(sheet.white(name) for name in names) for names in (GYROS, ACCELEROMETERS)]
        turn, push = (_DEVIATIONS * coefficient / np.sqrt(step) for coefficient in noise)
        turn += (1 + _ROOM) * np.sqrt(len(self.plant.gimbals.axes)) * self.plant.max_rate + _ROOM
        push += _FORCE
        most = 1.01 * np.array(self.plant.gimbals.most)
        return {
            "gyro": spaces.Box(-turn, turn, (3,), np.float64),
            "accel": spaces.Box(-push, push, (3,), np.float64),
            "axes": spaces.Box(-most, most, dtype=np.float64),
            "turning": spaces.Box(0.0, 1.0, (1,), np.float64),
        }

    def cast(self, seeds: Sequence[int]) -> Rig:
        """The scenario's rig."""
        return self.scenario.cast(seeds)

    def command(self, actions: Floats) -> tuple[Floats, Flags]:
        """Next positions [rad], shares of the largest rate and dwells [s], shape (R, k + 2), and where to stop."""
        k, table = len(self.plant.gimbals.axes), self.plant.gimbals
        rate = np.where(actions[:, k] > 0, actions[:, k], 1.0)
        dwell = actions[:, k + 1] * table.longest
        angles = actions[:, :k] * np.array(table.most)
        return np.concatenate([angles, rate[:, None], dwell[:, None]], axis=-1), actions[:, k + 2] >= 0.5

    def begin(self, rig: Rig, seeds: Sequence[int]) -> Floats:
        """Readings of the axes, shape (R, k)."""
        assert isinstance(rig.plant, MultiAxisTable)
        zero = np.zeros((len(seeds), len(rig.plant.gimbals.axes), 1))
        return rig.plant.gimbals.readings(zero, rig.plant.errors)[..., 0]

    def still(self, rig: Rig, time: float, batch: int) -> Blocks:
        """Nothing is measured where no time passes."""
        return {name: np.zeros((batch, *space.shape)) for name, space in self.blocks.items()}

    def read(self, readings: Readings, memory: Floats) -> tuple[Blocks, Floats]:
        """Means of six axes; the last readings of the table's."""
        k = memory.shape[-1]
        seen = {
            "gyro": np.stack([readings.outputs[name].mean(axis=-1) for name in GYROS], axis=-1),
            "accel": np.stack([readings.outputs[name].mean(axis=-1) for name in ACCELEROMETERS], axis=-1),
            "axes": np.stack([readings.references[f"axis_{m + 1}"].values[..., -1] for m in range(k)], axis=-1),
            "turning": readings.references["turning"].values.mean(axis=-1, keepdims=True),
        }
        return seen, seen["axes"].copy()

    def record(self, readings: Readings, blocks: Blocks) -> Mapping[str, Channel]:
        """Rates and specific forces as means over the sampling intervals; the axes, whether they turn, the command."""
        shape = (len(blocks["gyro"]), len(readings.t))
        channels = {name: Channel(_whole(readings.outputs[name], shape), "rad/s", "interval") for name in GYROS}
        channels |= {
            name: Channel(_whole(readings.outputs[name], shape), "m/s^2", "interval") for name in ACCELEROMETERS
        }
        for name, reference in readings.references.items():
            values = _whole(reference.values, shape)
            channels[name] = Channel(values, reference.unit, "interval" if reference.over_interval else "instant")
        return channels

    def truth(self, rig: Rig, batch: int) -> Mapping[str, Floats]:
        """Parameters of the six instruments, and errors of the table."""
        plant = rig.plant
        assert isinstance(plant, MultiAxisTable)
        true: dict[str, Any] = {name: plant.errors[..., j] for j, name in enumerate(plant.gimbals.names)}
        for fitted in rig.instruments:
            names = fitted.sensor.names
            true |= {f"{fitted.sensor.target}.{name}": fitted.theta[..., j] for j, name in enumerate(names)}
        return {name: np.array(np.broadcast_to(values, batch), float) for name, values in true.items()}

    def film(self, task: Task) -> Film:
        """The unit in space and what is believed of it."""
        from insenv.systems.system_calibration.film import UnitFilm  # matplotlib only where a picture is wanted

        return UnitFilm(task, self.scenario.table.output.title or self.scenario.path.stem)


def system_calibration(
    scenario: str = TACTICAL,
    changes: Mapping[str, Any] | None = None,
    estimator: str | None = None,
    step_s: float | None = None,
    sampling: float | None = None,
) -> Task:
    """The task of a calibration of a unit.

    Parameters
    ----------
    scenario : str
        Name or path of a scenario with ``[axes]``.
    changes : mapping, optional
        Of the scenario's entries: ``{"axes.max_rate": "5 deg/s"}``.
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


def _world(scenario: Scenario, sheet: Datasheet, asked: TaskSpec) -> SystemCalibration:
    return SystemCalibration(scenario, sheet, asked.samples)


def _quantities(asked: TaskSpec, sheet: Datasheet) -> tuple[SoughtQuantity, ...]:
    """All parameters of the unit that are not known, each to a share of its deviation."""
    return tuple(
        SoughtQuantity(p.name, p.sd, abs(p.mean) + _MOST_DEVIATIONS * p.sd, asked.demanded * p.sd, unit=p.unit)
        for p in sought(sheet)
    )


_SETUP = Setup("calibration of a unit", "SystemCalibration", "[axes]", _world, _quantities)


class SystemCalibrationEnv(SystemEnv):
    """``insenv/SystemCalibration-v0``; parameters as of `system_calibration`."""

    maker = staticmethod(system_calibration)


#: What `gymnasium.make` calls.
made = Maker(SystemCalibrationEnv, "batch_gls")


class SystemCalibrationVectorEnv(SystemVectorEnv):
    """The vector form of ``insenv/SystemCalibration-v0``; parameters as of `system_calibration` and `TaskVectorEnv`."""

    maker = staticmethod(system_calibration)


def _whole(values: Floats, shape: tuple[int, ...]) -> Floats:
    """Values of shape (R, n) where all runs may share them."""
    return np.ascontiguousarray(np.broadcast_to(values, shape))
