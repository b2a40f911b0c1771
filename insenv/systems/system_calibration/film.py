"""The calibration of a unit as pictures: the unit in space with its axes, and what is left of each uncertainty.

The unit is seen from the south, above and to the right, in parallel projection: a point at e (east), n (north), u (up)
stands at x = e cos a - n sin a, y = u cos b + (e sin a + n cos a) sin b. A bar is a parameter's deviation as a share of
what was not known before, on a logarithmic scale; its error stands beside it as a dot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from insenv.core.recording import Floats, Recording
from insenv.core.unit.gimbals import Gimbals
from insenv.core.unit.motion import UNIT
from insenv.envs.group import Group
from insenv.envs.render import BELIEVED, FAINT, INSTRUMENT, QUIET, TRUE, Canvas, Drawing, Frame, Header
from insenv.envs.task import Task
from insenv.information.positions import attitude
from insenv.systems.system_calibration.plant import MultiAxisTable

#: Azimuth and height from which the unit is seen [rad].
_ASIDE, _ABOVE = np.radians(28.0), np.radians(22.0)
#: Least share that is shown, and colours of the unit's x, y and z.
_LEAST, _COLORS = 1e-4, (INSTRUMENT, BELIEVED, TRUE)
_BOX = np.array([0.55, 0.4, 0.28])


@dataclass(frozen=True)
class View:
    """One frame.

    Attributes
    ----------
    time, duration : float
        [s]
    angles : tuple of float
        Of the table's axes [rad].
    to_level : ndarray, shape (3, 3)
        Matrix from the unit's axes to east, north, up.
    turning : bool
    names : tuple of str
        Of what is sought.
    shares, errors : ndarray, shape (q,)
        Believed deviations and true errors, as shares of the prior deviations; empty: nothing is believed.
    demanded : float
        Share that is wanted.
    title : str
    """

    time: float
    duration: float
    angles: tuple[float, ...]
    to_level: Floats
    turning: bool
    names: tuple[str, ...]
    shares: Floats
    errors: Floats
    demanded: float
    title: str


class UnitFilm:
    """Frames of one run; see `insenv.envs.group.Film`."""

    def __init__(self, task: Task, title: str) -> None:
        self._task, self._title = task, title
        self._renderer = Renderer()
        self._view: View | None = None

    def begin(self, group: Group) -> None:
        """The run begins."""
        self._view = self._seen(group, 0.0, False)

    def add(self, group: Group, chunk: Recording) -> None:
        """A step of it."""
        turning = bool(np.ravel(chunk.channels["turning"].values)[-1])
        self._view = self._seen(group, float(chunk.t[-1]), turning)

    def frame(self) -> Frame:
        """The present, shape (height, width, 3), of bytes."""
        assert self._view is not None
        return self._renderer.draw(self._view)

    def _seen(self, group: Group, time: float, turning: bool) -> View:
        plant, quantities = group.rig.plant, self._task.quantities
        assert isinstance(plant, MultiAxisTable)
        angles = group.state.plant.at(np.array([time]))[0][0, :, 0]
        shares = errors = np.zeros(0)
        if group.means.size:
            prior = np.array([q.prior for q in quantities])
            true = np.array([group.truth[q.name][0] for q in quantities])
            shares, errors = group.deviations[0] / prior, (group.means[0] - true) / prior
        return View(
            time=time,
            duration=self._task.steps * self._task.step_s,
            angles=tuple(angles.tolist()),
            to_level=_turned_by_heading(plant.gimbals) @ attitude(plant.gimbals, angles).T,
            turning=turning,
            names=tuple(q.name for q in quantities),
            shares=shares,
            errors=errors,
            demanded=quantities[0].demanded / quantities[0].prior,
            title=self._title,
        )


class Renderer(Drawing):
    """Pictures of a `View`."""

    def kind(self, view: View) -> tuple[object, ...]:
        """Names of what is sought, and whether anything is believed."""
        return view.names, bool(view.shares.size), view.demanded

    def layout(self, size: tuple[int, int], *kind: object) -> _Picture:
        """The unit on the left, the belief on the right."""
        names, believes, demanded = kind
        assert isinstance(names, tuple) and isinstance(demanded, float)
        return _Picture(size, names, bool(believes), demanded)


class _Picture:
    def __init__(self, size: tuple[int, int], names: tuple[str, ...], believes: bool, demanded: float) -> None:
        self._canvas = Canvas(size)
        self._header = Header(self._canvas, "calibration of a unit")
        self._unit = _Unit(self._canvas.axes(0.02, 0.10, 0.44 if believes else 0.96, 0.78))
        self._belief = _Belief(self._canvas.axes(0.62, 0.10, 0.36, 0.78), names, demanded) if believes else None

    def draw(self, view: View) -> Frame:
        self._header.set(view.title, view.time, view.duration)
        self._unit.set(view)
        if self._belief is not None:
            self._belief.set(view)
        return self._canvas.pixels()


class _Unit:
    """A box, its three axes, and the direction up."""

    def __init__(self, ax: Axes) -> None:
        ax.set_xlim(-1.5, 1.5)
        ax.set_ylim(-1.4, 1.4)
        ax.set_aspect("equal")
        ax.axis("off")
        ring = np.linspace(0, 2 * np.pi, 91)
        floor = _projected(np.stack([1.2 * np.cos(ring), 1.2 * np.sin(ring), np.full(91, -0.95)]))
        ax.fill(*floor, fc=FAINT, ec=QUIET, lw=0.8, zorder=1)
        north = _projected(np.array([[0.0, 0.0], [0.0, 1.15], [-0.95, -0.95]]))
        ax.plot(*north, color=QUIET, lw=1.0, zorder=1.5)
        ax.text(north[0, 1], north[1, 1], " N", color=QUIET, fontsize=9)
        self._edges = [ax.plot([], [], color=TRUE, lw=1.3, animated=True, zorder=4)[0] for _ in range(12)]
        self._axes = [ax.plot([], [], color=c, lw=2.4, animated=True, zorder=5)[0] for c in _COLORS]
        self._names = [
            ax.text(0, 0, n, color=c, fontsize=11, animated=True) for n, c in zip("xyz", _COLORS, strict=True)
        ]
        self._said = ax.text(0.5, 0.0, "", transform=ax.transAxes, ha="center", fontsize=9, color=TRUE, animated=True)

    def set(self, view: View) -> None:
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * _BOX
        pairs = [(a, b) for a in range(8) for b in range(a) if np.count_nonzero(corners[a] != corners[b]) == 1]
        seen = _projected(view.to_level @ corners.T)
        for line, (a, b) in zip(self._edges, pairs, strict=True):
            line.set_data(seen[0, [a, b]], seen[1, [a, b]])
        tips = _projected(view.to_level * 1.05)
        for i, (line, name) in enumerate(zip(self._axes, self._names, strict=True)):
            line.set_data([0.0, tips[0, i]], [0.0, tips[1, i]])
            name.set_position((1.08 * tips[0, i], 1.08 * tips[1, i]))
        angles = ", ".join(f"{np.degrees(a):.0f}°" for a in view.angles).replace("-", "−")
        self._said.set_text(f"axes at {angles}: {'turning' if view.turning else 'at rest'}")


class _Belief:
    """A bar for each parameter, grouped by channel."""

    def __init__(self, ax: Axes, names: tuple[str, ...], demanded: float) -> None:
        place = np.arange(len(names))[::-1]
        ax.set_xscale("log")
        ax.set_xlim(_LEAST, 1.5)
        ax.set_ylim(-1, len(names))
        ax.set_xlabel("share of the prior deviation", labelpad=1)
        ax.set_yticks(place, [_short(name) for name in names], fontsize=max(3.5, min(8.0, 260 / len(names))))
        ax.axvline(demanded, color=QUIET, lw=1.0, ls=":")
        for target in UNIT:
            own = [p for p, name in zip(place, names, strict=True) if name.startswith(f"{target}.")]
            if own:
                ax.axhline(min(own) - 0.5, color=FAINT, lw=0.8)
        ax.spines[["top", "right"]].set_visible(False)
        self._place = place
        self._bars = [ax.plot([], [], color=BELIEVED, lw=2.0, animated=True)[0] for _ in names]
        (self._errors,) = ax.plot([], [], "o", color=TRUE, ms=2.2, animated=True, label="true error")
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=8)

    def set(self, view: View) -> None:
        for bar, y, share in zip(self._bars, self._place, view.shares, strict=True):
            bar.set_data([_LEAST, max(share, _LEAST)], [y, y])
        self._errors.set_data(np.clip(np.abs(view.errors), _LEAST, 1.5), self._place)


def _short(name: str) -> str:
    return name.replace("accel_", "a_", 1).replace("gyro_", "g_", 1).replace(".c", "", 1).replace("_", " ")


def _projected(points: Floats) -> Floats:
    """Points in east, north, up, shape (3, n), on the picture, shape (2, n)."""
    east, north, up = points
    depth = east * np.sin(_ASIDE) + north * np.cos(_ASIDE)
    return np.stack([east * np.cos(_ASIDE) - north * np.sin(_ASIDE), up * np.cos(_ABOVE) + depth * np.sin(_ABOVE)])


def _turned_by_heading(gimbals: Gimbals) -> Floats:
    """Matrix from the base's axes to east, north, up, shape (3, 3)."""
    c, s = np.cos(gimbals.heading), np.sin(gimbals.heading)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
