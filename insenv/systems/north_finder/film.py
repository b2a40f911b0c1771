"""The north finder's run as pictures: what `insenv.systems.north_finder.view` draws, gathered step by step."""

from __future__ import annotations

import numpy as np

from insenv.core.earth import EARTH_RATE
from insenv.core.recording import Floats, Recording
from insenv.effects.rate.scale import ScaleFactor
from insenv.envs.group import Group
from insenv.envs.render import Frame
from insenv.envs.task import Task
from insenv.plants.turntable import Turntable
from insenv.systems.north_finder.frame import IGNORANT, History, View, horizontal_earth_rate, residual
from insenv.systems.north_finder.scale_factor import scale_factor
from insenv.systems.north_finder.view import Renderer

_GYRO = "gyro"


class NorthFinderFilm:
    """Frames of one run; see `insenv.envs.single.Film`."""

    def __init__(self, task: Task, title: str) -> None:
        self._task, self._title = task, title
        self._renderer = Renderer()
        self._view: View | None = None

    def begin(self, group: Group) -> None:
        """The run begins."""
        self._view = self._seen(group, 0.0, History())

    def add(self, group: Group, chunk: Recording) -> None:
        """A step of it."""
        assert self._view is not None
        plant, history = group.rig.plant, self._view.history
        assert isinstance(plant, Turntable) and plant.latitude is not None
        gyro, angle = (np.reshape(chunk.channels[name].values, -1) for name in (_GYRO, "table_angle"))
        # The table begins at its zero mark.
        edges = np.concatenate([history.angle[-1:] if len(history.angle) else [0.0], angle])
        rate = np.diff(edges) * self._task.datasheet.sampling
        left, north = residual(gyro, rate, plant.tilt, plant.latitude), self._belief(group)
        unexplained = None
        if north is not None:
            middle = 0.5 * (edges[1:] + edges[:-1])
            believed = horizontal_earth_rate(north[0], middle, plant.tilt, plant.latitude)
            unexplained = left - believed if north[1] < IGNORANT else np.nan
        history = history.then(
            float(chunk.t[-1]),
            float(angle[-1]),
            left,
            self._scale_factor(group, chunk, rate),
            unexplained=unexplained,
            believed_scale_factor=_believed_scale_factor(group),
            north=north,
        )
        self._view = self._seen(group, float(chunk.t[-1]), history)

    def _scale_factor(self, group: Group, chunk: Recording, rate: Floats) -> float:
        """True error of the scale factor at the end of a step, as an estimator means it."""
        plant = group.rig.plant
        assert isinstance(plant, Turntable) and plant.latitude is not None
        vertical = EARTH_RATE * np.sin(plant.latitude)
        u = float(rate.mean() + vertical) * float(np.sin(plant.tilt))
        return float(scale_factor(group.rig, group.state, np.full(1, u), self._task.datasheet)[0])

    def _seen(self, group: Group, time: float, history: History) -> View:
        plant, judge = group.rig.plant, self._task.judge
        assert isinstance(plant, Turntable)
        angle, rate = group.state.plant.at(np.array([time]), plant.max_acceleration)
        return View(
            time=time,
            duration=self._task.steps * self._task.step_s,
            table_angle=float(np.ravel(angle)[0]),
            azimuth_true=float(group.truth["azimuth"][0]),
            belief=self._belief(group),
            rate=float(np.ravel(rate)[0]),
            tilt=plant.tilt,
            history=history,
            title=self._title,
            demanded=None if judge is None else judge.quantities[0].demanded,
        )

    def frame(self) -> Frame:
        """The present, shape (height, width, 3), of bytes."""
        assert self._view is not None
        return self._renderer.draw(self._view)

    def _belief(self, group: Group) -> tuple[float, float] | None:
        if not group.means.size:
            return None
        return float(group.means[0, 0]), float(group.deviations[0, 0])


def _believed_scale_factor(group: Group) -> tuple[float, float] | None:
    estimate = group.estimate
    if estimate is None or ScaleFactor.id not in estimate.names:
        return None
    mean, sd = estimate.of(ScaleFactor.id)
    return float(mean[0]), float(sd[0])
