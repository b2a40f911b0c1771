r"""A run as learners want it: a flat observation and flat actions in single precision, all between -1 and 1.

    seen = (m_k, mean of m_0 ... m_k, time left, power-ups, signal, belief),     m: means over the samples of a step

scaled from the bounds of the spaces. Of each quantity the belief is its mean / limit, and how well it is known,

    ln(prior / sd) / ln(prior / demanded) - 1,      -1: nothing, 0: as demanded.

The first number of an action is the command (rate or turn) as a share of its largest, with a dead band, so that a
policy can stay. The second is the signal: stop, or switch off and on. It counts where it is given in two steps in a
row: a policy that knows nothing, uniform or Gaussian, seldom ends a run or cuts the power by chance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.envs.group import Blocks
from insenv.envs.single import TaskEnv
from insenv.envs.task import Task

Single = NDArray[np.float32]

#: Commands smaller than this share of the largest are none; signals count from this on.
DEAD_BAND, SIGNAL = 0.25, 0.9
#: Room for numbers that were rounded on their way here.
_SLACK = 1e-6
#: Observations that are numbers of their own, not readings.
_OWN = ("time_left", "power_ups", "belief")


@dataclass(frozen=True)
class SignalMemory:
    """What is remembered from step to step: the signal that was given, steps so far, and sums of the readings."""

    signal: float
    steps: int
    sums: Floats


class Normalised(gymnasium.Env[Single, Single]):
    """An environment of `insenv.envs` as learners want it.

    Truth, seeds, rewards, ends and pictures are those of ``env``.

    Parameters
    ----------
    env : TaskEnv
        With an estimator, for else there is no belief.
    """

    metadata = TaskEnv.metadata

    def __init__(self, env: TaskEnv) -> None:
        self.env, self.task = env, env.task
        self.render_mode = env.render_mode
        self._readings = tuple(name for name in sorted(self.task.observation_space) if name not in _OWN)
        bounds = [self._bounds(name) for name in self._readings]
        self._low, self._high = (np.concatenate([np.ravel(pair[k]) for pair in bounds]) for k in (0, 1))
        self._memory = self._begun()
        size = len(self._shown(env.observation_space.sample(), self._memory))
        self.observation_space = spaces.Box(-1.0, 1.0, (size,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Single, dict[str, Any]]:
        """As of the environment."""
        super().reset(seed=seed)
        seen, info = self.env.reset(seed=seed, options=options)
        self._memory = self._begun()
        return self._shown(seen, self._memory), info

    def step(self, action: Single) -> tuple[Single, float, bool, bool, dict[str, Any]]:
        """As of the environment.

        Raises
        ------
        InputError
            If the action is no two numbers from -1 to 1.
        """
        command, signal = self._checked(action)
        asked = float(np.sign(signal)) if abs(signal) >= SIGNAL else 0.0
        given = asked if asked == self._memory.signal else 0.0
        seen, reward, terminated, truncated, info = self.env.step(commanded(self.task, command, given))
        # A signal that was carried out has to be given twice again.
        memory = SignalMemory(0.0 if given else asked, self._memory.steps + 1, self._memory.sums + self._means(seen))
        self._memory = memory
        return self._shown(seen, memory), reward, terminated, truncated, info

    def render(self) -> Any:
        """As of the environment."""
        return self.env.render()

    def close(self) -> None:
        """As of the environment."""
        self.env.close()

    def _checked(self, action: Any) -> tuple[float, float]:
        given = np.asarray(action, float)
        if given.shape != (2,) or not np.all(np.abs(given) <= 1.0 + _SLACK):
            raise InputError(f"{self.task.name}: a normalised action {action}; wanted two numbers from -1 to 1")
        return float(given[0]), float(given[1])

    def _begun(self) -> SignalMemory:
        return SignalMemory(0.0, 0, np.zeros(len(self._low)))

    def _bounds(self, name: str) -> tuple[Floats, Floats]:
        """Of the mean over a step, or of a reading as it is."""
        box = self.task.observation_space[name]
        assert isinstance(box, spaces.Box)
        first = (0,) if box.shape[0] == self.task.samples else ()
        return box.low[first], box.high[first]

    def _means(self, seen: Blocks) -> Floats:
        """Readings of a step, one number for each component."""
        found = []
        for name in self._readings:
            block = np.asarray(seen[name])
            found.append(np.ravel(block.mean(axis=0) if block.shape[0] == self.task.samples else block))
        return np.concatenate(found)

    def _shown(self, seen: Blocks, memory: SignalMemory) -> Single:
        task = self.task
        width = np.where(self._high > self._low, self._high - self._low, 1.0)
        parts = [
            2.0 * (values - self._low) / width - 1.0
            for values in (self._means(seen), memory.sums / max(memory.steps, 1))
        ]
        parts.append(2.0 * np.asarray(seen["time_left"]) / (task.steps * task.step_s) - 1.0)
        if "power_ups" in seen:
            parts.append(2.0 * (np.asarray(seen["power_ups"]) - 1.0) / task.steps - 1.0)
        parts.append(np.array([memory.signal]))
        if "belief" in seen:
            parts.append(believed(task, np.asarray(seen["belief"])))
        return np.clip(np.concatenate(parts), -1.0, 1.0).astype(np.float32)


def commanded(task: Task, command: float, signal: float) -> Floats:
    """Action of the task for a command and a signal (-1, 0 or 1) that counts."""
    box = task.action_space
    share = np.sign(command) * max(abs(command) - DEAD_BAND, 0.0) / (1.0 - DEAD_BAND)
    action = np.zeros(box.shape)
    action[0] = np.clip(share, -1.0, 1.0) * box.high[0]
    action[-1] = np.clip(signal, box.low[-1], box.high[-1])
    return action


def believed(task: Task, belief: Floats) -> Floats:
    """Means and how well they are known, each between -1 and 1."""
    k = len(task.quantities)
    limit, prior, demanded = (
        np.array([getattr(q, n) for q in task.quantities]) for n in ("limit", "prior", "demanded")
    )
    scale = np.maximum(np.log(prior / demanded), 1.0)
    known = np.log(prior / np.maximum(belief[k:], 1e-300)) / scale - 1.0
    return np.concatenate([belief[:k] / limit, known])


@dataclass(frozen=True)
class Maker:
    """What `gymnasium.make` calls: the environment as it is, or ``normalised``.

    Attributes
    ----------
    env : type
        Of a `TaskEnv`.
    usual : str
        Estimator of a normalised one where none is named.
    """

    env: type[TaskEnv]
    usual: str

    @property
    def metadata(self) -> dict[str, Any]:
        """Of the environment."""
        return self.env.metadata

    def __call__(self, normalised: bool = False, **settings: Any) -> TaskEnv | Normalised:
        """The environment; settings are those of its class."""
        if not normalised:
            return self.env(**settings)
        return Normalised(self.env(**{**settings, "estimator": settings.get("estimator") or self.usual}))
