"""The two-position calibration as pictures: what `insenv.systems.two_position.view` draws, gathered step by step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from insenv.core.attitude import dcm_from_angles
from insenv.core.earth import EARTH_RATE
from insenv.core.recording import Recording
from insenv.envs.group import Group
from insenv.envs.render import Frame
from insenv.envs.task import Task
from insenv.navigation.strapdown import Navigation, initial, static_mechanisation
from insenv.systems.two_position.frame import History, View
from insenv.systems.two_position.pose import ACCELEROMETERS, GYROS, Pose
from insenv.systems.two_position.view import Renderer


class TwoPositionFilm:
    """Frames of one run; see `insenv.envs.group.Film`."""

    def __init__(self, task: Task, title: str) -> None:
        self._task, self._title = task, title
        self._renderer = Renderer()
        self._view: View | None = None
        self._navigation: Navigation | None = None
        #: Angle turned by since the last sighting, by the gyro [rad].
        self._turned = 0.0

    def begin(self, group: Group) -> None:
        """The run begins."""
        self._navigation = None
        self._turned = 0.0
        self._view = self._seen(group, 0.0, History(), None)

    def add(self, group: Group, chunk: Recording) -> None:
        """A step of it."""
        assert self._view is not None
        dt = self._task.datasheet.dt
        values = {name: np.reshape(channel.values, -1) for name, channel in chunk.channels.items()}
        gyro, accel = (np.stack([values[name] for name in names], -1) * dt for names in (GYROS, ACCELEROMETERS))
        if self._navigation is None:
            self._navigation = self._begin(values)
        _, self._navigation = static_mechanisation(gyro, accel, dt, self._navigation, every=len(chunk))
        sighting, up = self._view.sighting, gyro[:, 2] - self._vertical * dt
        self._turned += float(up.sum())
        if len(there := np.flatnonzero(np.isfinite(values.get("sight_heading", np.zeros(0))))):
            sighting, self._turned = float(values["sight_heading"][there[-1]]), float(up[there[-1] + 1 :].sum())
        history = self._view.history.then(
            float(chunk.t[-1]), bool(values["turning"].any()), self._navigation.velocity[:2], _belief(group)
        )
        self._view = self._seen(group, float(chunk.t[-1]), history, sighting)

    def frame(self) -> Frame:
        """The present, shape (height, width, 3), of bytes."""
        assert self._view is not None
        return self._renderer.draw(self._view)

    @property
    def _vertical(self) -> float:
        """Vertical Earth rate [rad/s]."""
        return EARTH_RATE * float(np.sin(self._task.datasheet.site.latitude or 0.0))

    def _begin(self, values: dict[str, np.ndarray]) -> Navigation:
        """A mechanisation that takes the sight's heading and the level for the attitude, where they are told."""
        heading, pitch, roll = (
            float(values[name][0]) if name in values and np.isfinite(values[name][0]) else 0.0
            for name in ("sight_heading", "level_pitch", "level_roll")
        )
        site = self._task.datasheet.site
        return initial(dcm_from_angles(heading, pitch, roll), (site.latitude or 0.0, 0.0, site.altitude))

    def _seen(self, group: Group, time: float, history: History, sighting: float | None) -> View:
        pose, judge, step = group.memory, self._task.judge, self._task.step_s
        assert isinstance(pose, Pose)
        turned, before = float(pose.turned[0]), 0.0 if self._view is None or not time else self._view.turned
        view = View(
            time=time,
            duration=self._task.steps * step,
            heading=float(pose.heading[0]),
            turned=turned,
            rate=(turned - before) / step,
            installation=float(group.truth["installation_angle"][0]),
            believed_installation=_belief(group),
            sighting=sighting,
            history=history,
            title=self._title,
            demanded=None if judge is None else judge.quantities[0].demanded,
        )
        return replace(view, believed_heading=self._heading(group, view))

    def _heading(self, group: Group, view: View) -> tuple[float, float] | None:
        """As the estimator says; else the last sighting less the believed installation angle and the turn since."""
        estimate = group.estimate
        if estimate is not None and "heading" in estimate.names:
            means, deviations = estimate.of("heading")
            return float(means[0]), float(deviations[0])
        if view.believed_installation is None or view.sighting is None:
            return None
        mean, sd = view.believed_installation
        return view.sighting - mean - self._turned, sd


def _belief(group: Group) -> tuple[float, float] | None:
    """The installation angle as it is believed [rad]."""
    if not group.means.size:
        return None
    return float(group.means[0, 0]), float(group.deviations[0, 0])
