r"""The two-position calibration: a parked vehicle finds the angle at which its sight stands to its inertial system.

    gyro_k = mean rate dt,   accel_k = mean specific force dt

of six axes, right-forward-up. An action is the angle that the vehicle is to turn by from now on, in half turns, and
whether to stop: from a half on, the run ends and no time passes. A vehicle that turns goes on turning, whatever it is
told. The sight gives a heading, and what levels the vehicle gives pitch and roll, in the first sample; the sight also
after each turn, where the scenario says so. `insenv/TwoPosition-v0` and its vector form are made here from a scenario;
everything that is not this system's own is in the modules beside. Source of the procedure: Guo, Li and He (2018), as
in `insenv.plants.vehicle_sight`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from gymnasium import spaces

from insenv.core.attitude import angles_from_dcm
from insenv.core.estimate import Datasheet
from insenv.core.recording import Channel, Floats
from insenv.envs.belief import SoughtQuantity
from insenv.envs.group import Blocks, Film, Flags
from insenv.envs.normalised import Maker
from insenv.envs.setup import Setup, scenario_task
from insenv.envs.single import SystemEnv
from insenv.envs.task import Task
from insenv.envs.vector import SystemVectorEnv
from insenv.plants.vehicle import Vehicle
from insenv.rig import Readings, Rig
from insenv.scenario import Scenario
from insenv.scenario.spec import TaskSpec
from insenv.systems.two_position.pose import ACCELEROMETERS, GYROS, Pose

#: The scenario of the environment that is given none.
PUBLISHED = "two_position/published_a"
#: An action of 1 is this angle [rad].
HALF_TURN = np.pi
#: Standard deviation of an angle of which nothing is known: uniform on the circle.
ANY_ANGLE = np.pi / np.sqrt(3)
#: Bounds of the observation: noise in standard deviations, what sway and undeclared errors may add [rad/s], specific
#: force [m/s^2], and a jump of the velocity where a turn ends [m/s].
_DEVIATIONS, _ROOM, _FORCE, _JUMP = 40.0, 1.0, 50.0, 1.0


@dataclass(frozen=True)
class TwoPosition:
    """The world of a scenario with a vehicle; see `insenv.envs.task.World`."""

    scenario: Scenario
    datasheet: Datasheet
    samples: int

    @cached_property
    def action(self) -> spaces.Box:
        """Angle to turn by [half turns, counter-clockwise; 0: stay], and stop from 0.5 on."""
        return spaces.Box(np.array([-1.0, 0.0]), np.array([1.0, 1.0]), dtype=np.float64)

    @cached_property
    def blocks(self) -> Mapping[str, spaces.Box]:
        """Spaces of the blocks of samples and of the readings."""
        sheet, n = self.datasheet, self.samples
        noise = [max(sheet.white(name) for name in names) for names in (GYROS, ACCELEROMETERS)]
        turn, push = (_DEVIATIONS * np.sqrt(sheet.dt) * coefficient for coefficient in noise)
        turn += (2 * sheet.limits.rate + _ROOM) * sheet.dt
        push += _FORCE * sheet.dt + _JUMP
        angle = np.pi
        return {
            "gyro": spaces.Box(-turn, turn, (n, 3), np.float64),
            "accel": spaces.Box(-push, push, (n, 3), np.float64),
            "sight": spaces.Box(np.array([-angle, 0.0]), np.array([angle, 1.0]), dtype=np.float64),
            "level": spaces.Box(np.array([-angle, -angle, 0.0]), np.array([angle, angle, 1.0]), dtype=np.float64),
            "turning": spaces.Box(0.0, 1.0, (1,), np.float64),
        }

    def cast(self, seeds: Sequence[int]) -> Rig:
        """The scenario's rig, its vehicle at rest until it is commanded."""
        rig = self.scenario.cast(seeds)
        assert isinstance(rig.plant, Vehicle)
        return replace(rig, plant=replace(rig.plant, profile=())) if rig.plant.profile else rig

    def command(self, actions: Floats) -> tuple[Floats, Flags]:
        """Angles to turn by [rad], and where to stop."""
        return actions[:, 0] * HALF_TURN, actions[:, 1] >= 0.5

    def begin(self, rig: Rig, seeds: Sequence[int]) -> Pose:
        """The vehicle as it stands."""
        batch = len(seeds)
        return Pose(_listed(_angles(rig)[0], batch), np.zeros(batch))

    def still(self, rig: Rig, time: float, batch: int) -> Blocks:
        """No turn and no reading."""
        return {name: np.zeros((batch, *space.shape)) for name, space in self.blocks.items()}

    def read(self, readings: Readings, memory: Pose) -> tuple[Blocks, Pose]:
        """Increments of six axes; the readings of sight and level, where there are any."""
        batch, references = len(memory.turned), readings.references
        seen = {
            "gyro": self._increments(readings, GYROS, batch),
            "accel": self._increments(readings, ACCELEROMETERS, batch),
            "sight": _latest(readings, ("sight_heading",), batch),
            "level": _latest(readings, ("level_pitch", "level_roll"), batch),
            "turning": np.empty((batch, 1)),
        }
        seen["turning"][:, 0] = references["turning"].values.max(axis=-1)
        heading, turned = (references[name].values[..., -1] for name in ("heading", "turn_angle"))
        return seen, Pose(_listed(heading, batch), _listed(turned, batch))

    def record(self, readings: Readings, blocks: Blocks) -> Mapping[str, Channel]:
        """Rates and specific forces as means over the sampling intervals; sight, level and whether it turns."""
        shape = blocks["gyro"].shape[:-1]
        outputs = {name: _whole(readings.outputs[name], shape) for name in (*GYROS, *ACCELEROMETERS)}
        channels = {name: Channel(outputs[name], "rad/s", "interval") for name in GYROS}
        channels |= {name: Channel(outputs[name], "m/s^2", "interval") for name in ACCELEROMETERS}
        for name in ("sight_heading", "level_pitch", "level_roll"):
            if name in readings.references:
                channels[name] = Channel(_whole(readings.references[name].values, shape), "rad")
        channels["turning"] = Channel(_whole(readings.references["turning"].values, shape), "1", "interval")
        return channels

    def truth(self, rig: Rig, batch: int) -> Mapping[str, Floats]:
        """Installation angle, attitude at the start, errors of sight and level, parameters of the instruments."""
        plant = rig.plant
        assert isinstance(plant, Vehicle) and plant.sight is not None
        heading, pitch, roll = _angles(rig)
        true: dict[str, Any] = {
            "installation_angle": plant.sight.installation,
            "heading": heading,
            "pitch": pitch,
            "roll": roll,
            "sight.orientation": plant.sight.orientation,
        }
        if plant.level_error is not None:
            true |= {"level.pitch": plant.level_error[0], "level.roll": plant.level_error[1]}
        for fitted in rig.instruments:
            names = fitted.sensor.names
            true |= {f"{fitted.sensor.target}.{name}": fitted.theta[..., j] for j, name in enumerate(names)}
        return {name: _listed(values, batch) for name, values in true.items()}

    def film(self, task: Task) -> Film:
        """The vehicle from above and strip charts."""
        from insenv.systems.two_position.film import TwoPositionFilm  # matplotlib only where a picture is wanted

        return TwoPositionFilm(task, self.scenario.table.output.title or self.scenario.path.stem)

    def _increments(self, readings: Readings, names: Sequence[str], batch: int) -> Floats:
        """Outputs of three axes, integrated, shape (R, n, 3)."""
        found = np.empty((batch, len(readings.t), 3))
        for j, name in enumerate(names):
            np.multiply(readings.outputs[name], self.datasheet.dt, out=found[..., j])
        return found


def two_position(
    scenario: str = PUBLISHED,
    changes: Mapping[str, Any] | None = None,
    estimator: str | None = None,
    step_s: float | None = None,
    sampling: float | None = None,
) -> Task:
    """The task of a two-position calibration.

    Parameters
    ----------
    scenario : str
        Name or path of a scenario with a vehicle.
    changes : mapping, optional
        Of the scenario's entries: ``{"vehicle.max_rate": "5 deg/s"}``.
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


def _world(scenario: Scenario, sheet: Datasheet, spec: TaskSpec) -> TwoPosition:
    return TwoPosition(scenario, sheet, spec.samples)


def _installation(spec: TaskSpec, sheet: Datasheet) -> tuple[SoughtQuantity, ...]:
    told = np.inf if sheet.sight is None else sheet.sight.installation
    return (
        SoughtQuantity("installation_angle", min(ANY_ANGLE, told), np.pi, spec.demanded, circular=True, unit="rad"),
    )


_SETUP = Setup("two-position calibration", "TwoPosition", "[vehicle]", _world, _installation)


class TwoPositionEnv(SystemEnv):
    """``insenv/TwoPosition-v0``; parameters as of `two_position`."""

    maker = staticmethod(two_position)


#: What `gymnasium.make` calls.
made = Maker(TwoPositionEnv, "two_position_joint")


class TwoPositionVectorEnv(SystemVectorEnv):
    """The vector form of ``insenv/TwoPosition-v0``; parameters as of `two_position` and `TaskVectorEnv`."""

    maker = staticmethod(two_position)


def _angles(rig: Rig) -> tuple[Floats, Floats, Floats]:
    """Heading, pitch and roll at the start [rad], shape (...)."""
    assert isinstance(rig.plant, Vehicle)
    return angles_from_dcm(rig.plant.attitude)


def _listed(values: Any, batch: int) -> Floats:
    """Values of each run, in an array of its own."""
    return np.array(np.broadcast_to(values, batch), float)


def _whole(values: Floats, shape: tuple[int, ...]) -> Floats:
    """Values of shape (R, n) where all runs may share them."""
    return np.ascontiguousarray(np.broadcast_to(values, shape))


def _latest(readings: Readings, names: Sequence[str], batch: int) -> Floats:
    """The last readings of a step and 1, or all zero where there is none, shape (R, k + 1)."""
    found = np.zeros((batch, len(names) + 1))
    if names[0] not in readings.references:
        return found
    known = ~np.isnan(readings.references[names[0]].values)
    if not known.any():
        return found
    there = np.broadcast_to(known.any(axis=-1), batch)
    last = np.broadcast_to(known.shape[-1] - 1 - np.argmax(known[..., ::-1], axis=-1), batch)
    for j, name in enumerate(names):
        values = np.broadcast_to(readings.references[name].values, (batch, known.shape[-1]))
        found[there, j] = values[there, last[there]]
    found[there, -1] = 1.0
    return found
