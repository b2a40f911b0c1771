"""One run that is played as time passes, and whoever watches it.

A session has one thread, which alone touches the environment: what is asked of it from outside waits in a queue until
the step is over. What it has to tell is a list of events that only grows, until a new run begins it anew: whoever comes
late reads it from its beginning and misses nothing.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.errors import InputError
from insenv.core.plugins import POLICIES, names
from insenv.core.quantities import unit_for
from insenv.core.recording import Recording
from insenv.core.system import System, TaskKind, kinds, part, system
from insenv.core.units import ARCSEC, DEG, PPM, ZERO_CELSIUS
from insenv.envs.recorder import Recorder
from insenv.envs.rollout import made
from insenv.envs.single import TaskEnv
from insenv.envs.task import Task
from insenv.evaluate.bounds import bounds
from insenv.play.closing import Closing
from insenv.play.scene import Scene, scene_of
from insenv.play.scene import bounds as limits
from insenv.scenario import Scenario, load

#: Simulated seconds for one of the clock: the least and the most that may be asked for.
SLOWEST, FASTEST = 1.0, 200.0
#: Seconds in which a run is to be over at first; nobody waits longer.
_PATIENCE = 45.0
#: Share of the time that may be spent on bounds.
_FOR_BOUNDS = 0.15
#: Units of what is sought, whatever its size: SI unit -> name, factor.
_SHOWN = {
    "rad": ("arcsec", ARCSEC),
    "1": ("ppm", PPM),
}
#: Units for people: SI unit -> name, factor, offset.
_PLAIN = {
    "rad": ("deg", DEG, 0.0),
    "rad/s": ("deg/s", DEG, 0.0),
    "K": ("°C", 1.0, ZERO_CELSIUS),
    "m/s^2": ("m/s²", 1.0, 0.0),
    "1": ("", 1.0, 0.0),
}

Event = dict[str, Any]


@dataclass(frozen=True)
class Game:
    """What is played: a system in a scenario, with an estimator that believes."""

    system: System
    kind: TaskKind
    scenario: str
    estimator: str
    loaded: Scenario
    task: Task
    scene: Scene

    @property
    def policies(self) -> tuple[str, ...]:
        """That suit the task, and those of other packages, of which nobody says what they are for."""
        ours = {name for _, kind in kinds().values() for name in kind.policies}
        return (*self.kind.policies, *(name for name in names(POLICIES) if name not in ours))


def game(name: str | None, scenario: str | None, estimator: str | None, step_s: float | None = None) -> Game:
    """What is to be played; what is not named is the usual.

    Raises
    ------
    InputError
        If there is no such system, scenario or estimator, or they do not belong together.
    """
    one = None if name is None else system(name.removeprefix("insenv/").removesuffix("-v0"))
    if scenario is None:
        one = one or system("NorthFinder")
        scenario = one.scenario
    loaded = load(scenario)
    if loaded.task is None:
        raise InputError(f"{loaded.path}: [task] is missing; wanted it, for an environment is played for one")
    owner, kind = kinds()[loaded.task.kind]
    one = one or owner
    estimator = estimator or kind.estimator
    task: Task = part(one.task)(scenario, None, estimator, step_s, None)
    found = scene_of(task, part(one.scene) if one.scene else None)
    return Game(one, kind, scenario, estimator, loaded, task, found)


class Session:
    """A game, going on.

    Parameters
    ----------
    played : Game
    seed : int
    policy : str, optional
        That drives; else a person does.
    out : Path
        Folder in which runs are saved.
    """

    def __init__(self, played: Game, seed: int = 1, policy: str | None = None, out: Path = Path("played")) -> None:
        self.game, self.out = played, out
        self._env = Recorder(TaskEnv(played.task))
        self._asked: queue.Queue[tuple[str, Any]] = queue.Queue()
        self._told = threading.Condition()
        self._events: list[Event] = []
        self._number, self._watchers, self._open = 0, 0, True
        self._closing = Closing(self._tell)
        self._paused = False
        self._speed = self._usual_speed()
        self._begin(seed)
        if policy is not None:
            self._drive(policy)
        self._thread = threading.Thread(target=self._go, name="insenv play", daemon=True)

    # ------------------------------------------------------------------------------------------- from outside

    def start(self) -> None:
        """Let time pass, as long as somebody watches."""
        self._thread.start()

    def ask(self, what: str, value: Any = None) -> None:
        """Ask for something, which is done between two steps: a key of `_Doing`."""
        self._asked.put((what, value))

    def close(self) -> None:
        """The end: nothing more is told."""
        self._open = False
        self._closing.stop()
        with self._told:
            self._told.notify_all()
        if self._thread.is_alive():
            self._thread.join(5.0)

    @property
    def watchers(self) -> int:
        """How many watch."""
        return self._watchers

    @property
    def saved(self) -> tuple[Path, ...]:
        """Manifests that were written."""
        return tuple(self._closing.manifests)

    def report(self, number: int) -> Path | None:
        """The page of the loop that was closed on a saved run."""
        return self._closing.report(number)

    def watch(self, pause: float) -> Iterator[list[Event]]:
        """Events as they happen, those of ``pause`` seconds together; nothing in a list: still there."""
        with self._told:
            self._watchers += 1
        run, seen = -1, 0
        try:
            while self._open:
                with self._told:
                    if run != self._number:
                        run, seen = self._number, 0
                    if seen == len(self._events):
                        self._told.wait(1.0)
                    if run != self._number:
                        continue
                    news = self._events[seen:]
                    seen = len(self._events)
                yield news
                time.sleep(pause)
        finally:
            with self._told:
                self._watchers -= 1

    # --------------------------------------------------------------------------------------------- the thread

    def _go(self) -> None:
        due = time.monotonic()
        while self._open:
            try:
                self._do(*self._asked.get(timeout=max(0.0, min(due - time.monotonic(), 0.2))))
                continue
            except queue.Empty:
                pass
            now = time.monotonic()
            if self._paused or self._over or self._watchers == 0:
                due = now + 0.2
            elif now >= due:
                self._step()
                # Who was late does not run after what is past.
                due = max(due + self.game.task.step_s / self._speed, time.monotonic() - 0.1)

    def _do(self, what: str, value: Any) -> None:
        """What was asked for; what cannot be done is said."""
        try:
            _DOING[what](self, value)
        except InputError as error:
            self._tell({"note": str(error), "bad": True})
        except (KeyError, TypeError, ValueError, IndexError):
            self._tell({"note": f"{what} {value!r} was asked for, which has no meaning here", "bad": True})

    def _tell(self, event: Event) -> None:
        with self._told:
            self._events.append(event)
            self._told.notify_all()

    # -------------------------------------------------------------------------------------------------- a run

    def _begin(self, seed: Any) -> None:
        if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 2**53:
            raise InputError(f"seed {seed!r} given; wanted a whole number from 0")
        self._env.reset(seed=seed)
        task, scene = self.game.task, self.game.scene
        edges = [limits(task, control) for control in scene.controls]
        self._seed, self._over, self._score = seed, False, 0.0
        self._values = [min(max(0.0, low), high) for low, high in edges]
        self._once: list[tuple[int, float]] = []
        self._policy: Any = None
        self._policy_name, self._policy_state = "", None
        self._bound_s, self._bounded = 0.0, time.monotonic()
        self._angle: float | None = 0.0 if self.game.system.scene else None
        self._chunk: Recording | None = None
        with self._told:
            self._number += 1
            self._events = [{"run": self._described(edges)}, {"frame": self._frame({})}]
            self._events += [{"saved": one} for one in self._closing.known()]
            self._told.notify_all()

    def _step(self) -> None:
        group = self._unwrapped.group
        action = self._action()
        try:
            if self._policy is not None:
                given, self._policy_state = self._policy.act(self._policy_state, self._unwrapped.chunk, group.estimate)
                action = np.asarray(given, float)[0]
            _, reward, terminated, truncated, _ = self._env.step(action)
        except Exception as error:
            if self._policy is None:
                self._over = True
                self._tell({"note": f"the run ended: {error}", "bad": True})
                return
            self._tell({"note": f"policy {self._policy_name!r} cannot go on: {error}", "bad": True})
            self._drive("")
            return
        self._once = []
        self._score += reward
        self._over = terminated or truncated
        chunk = self._unwrapped.chunk
        if chunk is not None:
            self._chunk = chunk
            turned = self.game.scene.turned(self._unwrapped.group, chunk)
            self._angle = self._angle if turned is None else turned
        for k, control in enumerate(self.game.scene.controls):
            if self._policy is not None and control.held:
                self._values[k] = float(action[control.axis]) * control.scale
        self._tell({"frame": self._frame(self._least(self._over), action)})

    def _action(self) -> Any:
        action = np.zeros(self.game.task.action_space.shape)
        for value, control in zip(self._values, self.game.scene.controls, strict=True):
            if control.held:
                action[control.axis] = value / control.scale
        for axis, value in self._once:
            action[axis] = value
        box = self.game.task.action_space
        return np.clip(action, box.low, box.high)

    def _least(self, now: bool) -> dict[str, float]:
        """The bound for the motion so far, where there is time to compute it."""
        began = time.monotonic()
        if self._chunk is None or (not now and (began - self._bounded) * _FOR_BOUNDS < self._bound_s):
            return {}
        task = self.game.task
        sought = tuple(q.name for q in task.quantities)
        try:
            found = bounds(task.datasheet, self._env.recording(), sought, self.game.loaded)
        except InputError:
            found = {}
        self._bounded = time.monotonic()
        self._bound_s = self._bounded - began
        return found

    # ------------------------------------------------------------------------------------------ what is shown

    @property
    def _unwrapped(self) -> TaskEnv:
        inner = self._env.unwrapped
        assert isinstance(inner, TaskEnv)
        return inner

    def _usual_speed(self) -> float:
        task = self.game.task
        asked = task.steps * task.step_s / _PATIENCE
        return float(min(FASTEST, next((s for s in (1, 2, 5, 10, 20, 50, 100) if s >= asked), FASTEST)))

    def _described(self, edges: list[tuple[float, float]]) -> Event:
        task, scene = self.game.task, self.game.scene
        quantities = task.quantities if task.judge is not None else ()
        return {
            "number": self._number,
            "environment": self.game.system.name,
            "scenario": self.game.scenario,
            "title": self.game.loaded.table.output.title or self.game.loaded.path.stem,
            "estimator": self.game.estimator,
            "seed": self._seed,
            "duration": task.steps * task.step_s,
            "step": task.step_s,
            "speed": self._speed,
            "paused": self._paused,
            "quantities": [
                {"name": q.name, "circular": q.circular, "prior": q.prior, "demanded": q.demanded} | _unit(q)
                for q in quantities
            ],
            "controls": [
                {"name": c.name, "held": c.held, "verb": c.verb, "follows": c.follows, "low": low, "high": high}
                | dict(zip(("unit", "scale"), _PLAIN.get(c.unit, (c.unit, 1.0, 0.0))[:2], strict=True))
                for c, (low, high) in zip(scene.controls, edges, strict=True)
            ],
            "signals": [{"name": s.name, "key": s.key, "ends": s.ends} for s in scene.signals],
            "pointers": [vars(p) for p in scene.pointers],
            "body": scene.body,
            "zero": scene.zero,
            "policies": self.game.policies,
        }

    def _frame(self, least: dict[str, float], action: Any = None) -> Event:
        group, task = self._unwrapped.group, self.game.task
        quantities = task.quantities if task.judge is not None else ()
        given = np.zeros(task.action_space.shape) if action is None else action
        return {
            "t": group.passed * task.step_s,
            "angle": self._angle,
            "mean": [_finite(v) for v in group.means[0]],
            "sd": [_finite(v) for v in group.deviations[0]],
            "true": [_finite(group.truth[q.name][0]) if q.name in group.truth else None for q in quantities],
            "bound": [least.get(q.name) for q in quantities],
            "values": list(self._values),
            "given": [float(given[c.axis]) * c.scale for c in self.game.scene.controls],
            "readings": [] if self._chunk is None else _readings(self._chunk),
            "policy": self._policy_name,
            "score": self._score,
            "over": self._over,
        }

    # ------------------------------------------------------------------------------------- what is asked for

    def _control(self, value: Any) -> None:
        """Set a control: its number, and its value [SI]."""
        k, to = int(value[0]), float(value[1])
        control = self.game.scene.controls[k]
        low, high = limits(self.game.task, control)
        to = min(max(to, low), high)
        if self._policy is not None:
            self._drive("")
        if control.held:
            self._values[k] = to
        else:
            self._once = [*(one for one in self._once if one[0] != control.axis), (control.axis, to / control.scale)]

    def _signal(self, value: Any) -> None:
        signal = self.game.scene.signals[int(value)]
        self._once = [*(one for one in self._once if one[0] != signal.axis), (signal.axis, signal.value)]
        self._paused = False

    def _drive(self, name: Any) -> None:
        """A policy takes over, or a person does."""
        if not name:
            self._policy, self._policy_name, self._policy_state = None, "", None
        else:
            found = made(str(name), self.game.task.datasheet)
            self._policy, self._policy_name, self._policy_state = found, str(name), found.reset(1)
            self._once = []
        self._tell({"drives": self._policy_name})

    def _set_speed(self, value: Any) -> None:
        self._speed = float(min(max(float(value), SLOWEST), FASTEST))

    def _pause(self, value: Any) -> None:
        self._paused = bool(value)
        self._tell({"paused": self._paused})

    def _save(self, value: Any) -> None:
        """Write the run so far, and close the loop on it where that is asked for."""
        stem = f"{self.game.system.name.lower()}-seed{self._seed}"
        number = next(n for n in range(1, 10**6) if not (self.out / f"{stem}-{n}").exists())
        path = self._env.save(self.out / f"{stem}-{number}")
        self._closing.add(path, close=bool(value))


_DOING: dict[str, Callable[[Session, Any], None]] = {
    "control": Session._control,
    "signal": Session._signal,
    "drive": Session._drive,
    "speed": Session._set_speed,
    "pause": Session._pause,
    "save": Session._save,
    "seed": Session._begin,
}


def _unit(quantity: Any) -> dict[str, Any]:
    """The unit of a quantity for people, and what one of it is in SI: that of what is demanded of it."""
    if quantity.unit in _SHOWN:
        return dict(zip(("unit", "scale"), _SHOWN[quantity.unit], strict=True))
    found = unit_for(quantity.unit, quantity.demanded)
    return {"unit": found.label, "scale": found.factor}


def _finite(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None


def _readings(chunk: Recording) -> list[tuple[str, float | None, str]]:
    """Mean of each channel over a step, in a unit for people."""
    found = []
    for name, channel in chunk.channels.items():
        unit, factor, offset = _PLAIN.get(channel.unit, (channel.unit, 1.0, 0.0))
        values = np.ravel(channel.values)
        seen = values[np.isfinite(values)]
        found.append((name, _finite((seen.mean() - offset) / factor) if len(seen) else None, unit))
    return found
