"""The rate table's run as pictures: what `insenv.systems.rate_table.view` draws, gathered step by step."""

from __future__ import annotations

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats, Recording
from insenv.effects.rate.scale import ScaleFactor
from insenv.envs.group import Group
from insenv.envs.render import Frame
from insenv.envs.task import Task
from insenv.plants.turntable import Turntable
from insenv.systems.rate_table.frame import History, View
from insenv.systems.rate_table.view import Renderer

#: Rates at which the true curve is drawn.
_RATES = 2001


class RateTableFilm:
    """Frames of one run; see `insenv.envs.group.Film`."""

    def __init__(self, task: Task, title: str) -> None:
        self._task, self._title = task, title
        self._renderer = Renderer()
        self._view: View | None = None
        self._angle = 0.0

    def begin(self, group: Group) -> None:
        """The run begins."""
        self._angle = 0.0
        self._view = self._seen(group, 0.0, History())

    def add(self, group: Group, chunk: Recording) -> None:
        """A step of it."""
        assert self._view is not None
        gyro, angle = (np.reshape(chunk.channels[name].values, -1) for name in ("gyro", "table_angle"))
        mean = (float(angle[-1]) - self._angle) / self._task.step_s
        self._angle = float(angle[-1])
        view = self._seen(group, float(chunk.t[-1]), self._view.history)
        even = view.rate == self._view.rate
        believed = [group.means[0, 0], group.deviations[0, 0]] if group.means.size else [np.nan, np.nan]
        known = np.array([group.truth[ScaleFactor.id][0], *believed])
        rate = view.rate if even else mean
        values = (view.time, rate, float(even), float(gyro.mean()) - mean, float(group.power_ups[0]))
        history = view.history.then(values, known)
        self._view = self._seen(group, view.time, history)

    def frame(self) -> Frame:
        """The present, shape (height, width, 3), of bytes."""
        assert self._view is not None
        return self._renderer.draw(self._view)

    def _seen(self, group: Group, time: float, history: History) -> View:
        plant, judge = group.rig.plant, self._task.judge
        assert isinstance(plant, Turntable)
        now = np.array([time - group.switched_on])
        angle, rate = group.state.plant.at(now, plant.max_acceleration)
        if self._view is not None and self._view.power_up == group.power_ups[0] and len(history.time):
            curve = self._view.true_rates, self._view.true_errors
        else:
            curve = _true_curve(group, plant)
        return View(
            time=time,
            duration=self._task.steps * self._task.step_s,
            table_angle=float(np.ravel(angle)[0]),
            rate=float(np.ravel(rate)[0]),
            largest=plant.max_rate,
            temperature=float(plant.temperature.at(now)[0]),
            power_up=int(group.power_ups[0]),
            noise=self._task.datasheet.white("gyro"),
            true_rates=curve[0],
            true_errors=curve[1],
            history=history,
            title=self._title,
            demanded=None if judge is None or not judge.quantities else judge.quantities[0].demanded,
        )


def _true_curve(group: Group, plant: Turntable) -> tuple[Floats, Floats]:
    """Table rates, and what the effects of the rate add to them while the gyro is warm [rad/s]."""
    rate = np.linspace(-plant.max_rate, plant.max_rate, _RATES)
    t = np.arange(_RATES + 1.0)
    warm = plant.temperature.at(np.full(_RATES + 1, np.inf))
    motion = Motion(t=t, rate=rate, temperature=warm, reference_temperature=plant.reference_temperature)
    total, first = np.zeros(_RATES), 0
    (fitted,) = (f for f in group.rig.instruments if f.sensor.target == "gyro")
    for effect in fitted.sensor.effects:
        theta = fitted.theta[0, first : first + len(effect.params)]
        first += len(effect.params)
        if effect.steady(motion):
            total = total + effect.apply(rate, motion, theta)[0]
    return rate, total
