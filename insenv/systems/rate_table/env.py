r"""The rate table: the scale factor of a gyro, over rates and power cycles.

    gyro_k = y_k dt  (or whole pulses, counted),    encoder_k = reading_k - reading_{k-1}

with the gyro's output y. The table takes up the rate that it is told; the gyro may be switched off and on while the
table goes on: then it is cold, and its bias and scale factor are others (``[run_to_run]`` of the scenario). Sought is

    K - 1 = sum(u e(u)) / sum(u^2),    u = -range ... range

the slope of the line through the errors e(u) of the warm gyro of this power-up at rates that are evenly spread, local
faults left out. `insenv/RateTable-v0` and its vector form are made here from a scenario.
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
from insenv.effects.rate.scale import ScaleFactor
from insenv.envs.belief import SoughtQuantity
from insenv.envs.group import Blocks, Film, Flags
from insenv.envs.normalised import Maker
from insenv.envs.setup import Setup, scenario_task
from insenv.envs.single import SystemEnv
from insenv.envs.task import Task
from insenv.envs.vector import SystemVectorEnv
from insenv.information.scale_factor import ScaleFactorLine
from insenv.plants.profile import rest
from insenv.plants.servo import Knots
from insenv.plants.thermal import Constant, Temperature, WarmUp
from insenv.plants.turntable import Turntable
from insenv.rig import Fitted, Readings, Rig
from insenv.scenario import Scenario
from insenv.scenario.spec import TaskSpec
from insenv.sensors.counter import count

#: The scenario of the environment that is given none.
PUBLISHED = "rate_table/b215"
#: From this signal on the run stops, and from its negative on downwards the gyro is switched off and on.
SIGNAL = 0.5
#: Error of a scale factor of which nothing is told, one standard deviation, and the largest that is shown.
ANY_ERROR, MOST_ERROR = 0.05, 1.0
#: Bounds of the observation: noise in standard deviations, and what undeclared errors may add [rad/s].
_DEVIATIONS, _ROOM = 40.0, 0.1


@dataclass(frozen=True)
class Electronics:
    """Part of a pulse that is left, and the angle reading before [rad]; shape (R,)."""

    phase: Floats
    reading: Floats


@dataclass(frozen=True)
class Later:
    """A temperature that does not begin anew when an instrument is switched on ``passed`` seconds after the start."""

    temperature: Temperature
    passed: float

    def at(self, t: Floats) -> Floats:
        """Temperature [K] at times ``t`` [s] since then."""
        return self.temperature.at(t + self.passed)


@dataclass(frozen=True)
class RateTable:
    """The world of a scenario with a rate table; see `insenv.envs.task.World` and `insenv.envs.restart.Restarts`."""

    scenario: Scenario
    datasheet: Datasheet
    samples: int
    range: float

    @cached_property
    def action(self) -> spaces.Box:
        """Table rate [rad/s], and a signal: stop from 0.5 on, switch off and on from -0.5 downwards."""
        rate = self.datasheet.limits.rate
        return spaces.Box(np.array([-rate, -1.0]), np.array([rate, 1.0]), dtype=np.float64)

    @cached_property
    def blocks(self) -> Mapping[str, spaces.Box]:
        """Spaces of the blocks of samples."""
        sheet, n = self.datasheet, self.samples
        turn = (2 * sheet.limits.rate + _ROOM) * sheet.dt
        white = sheet.white("gyro") * np.sqrt(sheet.dt)
        noise = _DEVIATIONS * (white + 2 * sheet.quantization("gyro"))
        return {
            "gyro": _box(turn + noise + 2 * sheet.pulse, n),
            "encoder": _box(turn + _DEVIATIONS * sheet.encoder_noise, n),
            "temperature": spaces.Box(0.0, 1000.0, (1,), np.float64),
        }

    def cast(self, seeds: Sequence[int]) -> Rig:
        """The scenario's rig, its table at rest until it is commanded."""
        return self.recast(seeds, len(seeds) * [1], 0.0)

    def recast(self, seeds: Sequence[int], power_ups: Sequence[int], time: float) -> Rig:
        """The same, switched on again at ``time``: a gyro that heats itself is cold, other temperatures go on."""
        rig = self.scenario.cast(seeds, power_ups)
        assert isinstance(rig.plant, Turntable)
        temperature = rig.plant.temperature
        if time and not isinstance(temperature, WarmUp | Constant):
            temperature = Later(temperature, time)
        return replace(rig, plant=replace(rig.plant, profile=rest(np.inf), temperature=temperature))

    def command(self, actions: Floats) -> tuple[Floats, Flags]:
        """Rates of the table [rad/s], and where to stop."""
        return actions[:, 0], actions[:, 1] >= SIGNAL

    def restarts(self, actions: Floats) -> Flags:
        """Where to switch the gyro off and on."""
        return actions[:, 1] <= -SIGNAL

    def went_on(self, plant: Knots, passed: float) -> Knots:
        """The servo, told of its commands on the later clock."""
        return replace(plant, start=plant.start - passed)

    def begin(self, rig: Rig, seeds: Sequence[int]) -> Electronics:
        """A counter somewhere within a pulse."""
        return Electronics(np.asarray(self.scenario.phases(seeds, "gyro")), np.zeros(len(seeds)))

    def still(self, rig: Rig, time: float, batch: int) -> Blocks:
        """No turn; the temperature as it is."""
        assert isinstance(rig.plant, Turntable)
        seen = {name: np.zeros((batch, *space.shape)) for name, space in self.blocks.items()}
        seen["temperature"][:] = rig.plant.temperature.at(np.array([time]))
        return seen

    def read(self, readings: Readings, memory: Electronics) -> tuple[Blocks, Electronics]:
        """Increments of gyro and encoder; the temperature at the end."""
        rate, angle = readings.outputs["gyro"], readings.references["table_angle"].values
        turned = np.empty(angle.shape)
        np.subtract(angle[:, 1:], angle[:, :-1], out=turned[:, 1:])
        np.subtract(angle[:, 0], memory.reading, out=turned[:, 0])
        phase, dt, pulse = memory.phase, self.datasheet.dt, self.datasheet.pulse
        if pulse:
            pulses, phase = count(rate, phase, dt / pulse)
            gyro = pulses * pulse
        else:
            gyro = rate * dt
        temperature = np.empty((len(angle), 1))
        temperature[:] = readings.references["temperature"].values[..., -1:]
        seen = {"gyro": gyro, "encoder": turned, "temperature": temperature}
        return seen, Electronics(phase, angle[:, -1].copy())

    def record(self, readings: Readings, blocks: Blocks) -> Mapping[str, Channel]:
        """Gyro [rad/s], angle reading and temperature."""
        rate = blocks["gyro"] / self.datasheet.dt if self.datasheet.pulse else readings.outputs["gyro"]
        return {
            "gyro": Channel(rate, "rad/s", "interval"),
            "table_angle": Channel(readings.references["table_angle"].values, "rad"),
            "temperature": Channel(readings.references["temperature"].values, "K"),
        }

    def truth(self, rig: Rig, batch: int) -> Mapping[str, Floats]:
        """Error of the scale factor, and every parameter of the gyro at this power-up, such as "gyro.bias.c"."""
        plant = rig.plant
        assert isinstance(plant, Turntable)
        east, north = plant.level_error
        (fitted,) = (f for f in rig.instruments if f.sensor.target == "gyro")
        true: dict[str, Any] = {ScaleFactor.id: line_slope(fitted, plant, self.range)}
        true |= {"azimuth": plant.azimuth, "level_east": east, "level_north": north}
        true |= {f"gyro.{name}": fitted.theta[..., j] for j, name in enumerate(fitted.sensor.names)}
        return {name: np.array(np.broadcast_to(values, batch), float) for name, values in true.items()}

    def film(self, task: Task) -> Film:
        """The table from above, the rates so far, and what a line leaves of them."""
        from insenv.systems.rate_table.film import RateTableFilm  # matplotlib only where a picture is wanted

        return RateTableFilm(task, self.scenario.table.output.title or self.scenario.path.stem)


def line_slope(fitted: Fitted, plant: Turntable, largest: float) -> Floats:
    """Slope of the line through the errors of a warm gyro at table rates up to ``largest`` [rad/s], shape (...).

    Per table rate, so that a gyro that leans has the cosine of it: sin(tilt) (1 + e) - 1.
    """
    settled = float(plant.temperature.at(np.array([np.inf]))[0])
    line = ScaleFactorLine(float(np.sin(plant.tilt)), largest, settled, plant.reference_temperature)
    return line.error(fitted.sensor.effects, fitted.theta)


def rate_table(
    scenario: str = PUBLISHED,
    changes: Mapping[str, Any] | None = None,
    estimator: str | None = None,
    step_s: float | None = None,
    sampling: float | None = None,
) -> Task:
    """The rate table's task; parameters as of `insenv.systems.north_finder.env.north_finder`.

    Raises
    ------
    InputError
        If the scenario or the estimator cannot be used.
    """
    return scenario_task(_SETUP, scenario, changes, estimator, step_s, sampling)


def _world(scenario: Scenario, sheet: Datasheet, spec: TaskSpec) -> RateTable:
    return RateTable(scenario, sheet, spec.samples, min(spec.range, sheet.limits.rate))


def _scale_factor(spec: TaskSpec, sheet: Datasheet) -> tuple[SoughtQuantity, ...]:
    known = sheet.told(ScaleFactor.id, "gyro")
    prior = known.sd[0] if known is not None and known.sd[0] > 0 else ANY_ERROR
    return (SoughtQuantity(ScaleFactor.id, prior, MOST_ERROR, spec.demanded, unit="1"),)


_SETUP = Setup("rate table", "RateTable", "[table]", _world, _scale_factor)


class RateTableEnv(SystemEnv):
    """``insenv/RateTable-v0``; parameters as of `rate_table`."""

    maker = staticmethod(rate_table)


#: What `gymnasium.make` calls.
made = Maker(RateTableEnv, "rate_line")


class RateTableVectorEnv(SystemVectorEnv):
    """The vector form of ``insenv/RateTable-v0``; parameters as of `rate_table` and `TaskVectorEnv`."""

    maker = staticmethod(rate_table)


def _box(limit: float, n: int) -> spaces.Box:
    return spaces.Box(-limit, limit, (n,), np.float64)
