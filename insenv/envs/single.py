"""`gymnasium.Env` over a task: a batch of one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, ClassVar, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded

from insenv.core.errors import InputError
from insenv.core.recording import Floats, Recording
from insenv.envs.batch import Batch, RowsPart
from insenv.envs.group import Blocks, Film, Group
from insenv.envs.task import Task, checked

if TYPE_CHECKING:
    from insenv.envs.render import Window

#: Seeds of runs that nobody gave a seed are drawn below this.
SEEDS = 2**62


class TaskEnv(gymnasium.Env[Blocks, Floats]):
    """One run after the other.

    ``reset(seed=s)`` plays run s, which is row 0 of a vector environment that is reset with s; without a seed
    the next run's is drawn from ``np_random``. ``info["truth"]`` holds the true values, and nothing else
    does.

    Attributes
    ----------
    task : Task
    chunk : Recording, optional
        What the last step recorded; None where no time passed.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array", "human"], "render_fps": 10}

    def __init__(self, task: Task, render_mode: str | None = None) -> None:
        self.render_mode = checked_mode(render_mode, self.metadata)
        self.task = task
        # Spaces do not say in their types what `Blocks` and `Floats` are.
        self.action_space = cast(spaces.Space[Floats], task.action_space)
        self.observation_space = cast(spaces.Space[Blocks], task.observation_space)
        self.chunk: Recording | None = None
        self._batch = Batch(task, 1)
        self._group: Group | None = None
        self._film: Film | None = None if self.render_mode is None else task.world.film(task)
        self._window: Window | None = None

    @property
    def group(self) -> Group:
        """The state of the run, a batch of one; for renderers and recorders.

        Raises
        ------
        ResetNeeded
            If no run has begun.
        """
        if self._group is None:
            raise ResetNeeded(f"{self.task.name}: no run has begun; call reset first")
        return self._group

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Blocks, dict[str, Any]]:
        """Begin a run.

        Raises
        ------
        InputError
            If an option is given: there are none.
        """
        super().reset(seed=seed)
        refuse_options(self.task, options)
        run = int(self.np_random.integers(SEEDS)) if seed is None else seed
        part = self._batch.begin(np.zeros(1, np.int64), (run,))
        if self._film is not None:
            self._film.begin(part.group)
            self._show()
        return self._shown(part), self._info(part)

    def step(self, action: Floats) -> tuple[Blocks, float, bool, bool, dict[str, Any]]:
        """One step, or the end of the run.

        Raises
        ------
        ResetNeeded
            If no run has begun, or it has ended.
        InputError
            If the action cannot be used.
        """
        group = self.group
        if not self._batch.alive[0]:
            raise ResetNeeded(f"{self.task.name}: the run of seed {group.seeds[0]} has ended; call reset first")
        (part,) = self._batch.step(checked(self.task, self._alone(action), 1))
        shown = self._shown(part)
        if self._film is not None and self.chunk is not None:
            self._film.add(part.group, self.chunk)
            self._show()
        return shown, float(part.seen.reward[0]), part.terminated, part.truncated, self._info(part)

    def _alone(self, action: Any) -> Any:
        """The action as a batch of one, refused in the words of one."""
        wanted = self.task.action_space.shape
        try:
            found = np.shape(action)
        except ValueError:
            raise InputError(f"{self.task.name}: an action of numbers and lists; wanted shape {wanted}") from None
        if found != wanted:
            raise InputError(f"{self.task.name}: an action of shape {found}; wanted {wanted}")
        return [action]

    def render(self) -> Any:
        """The frame of "rgb_array", shape (height, width, 3); None in the mode "human", which shows every step itself.

        Raises
        ------
        InputError
            If the environment was made without a render mode.
        """
        if self._film is None:
            raise InputError(f"{self.task.name}: made without render_mode; wanted 'rgb_array' or 'human' to render")
        _ = self.group  # a run has begun
        return self._film.frame() if self.render_mode == "rgb_array" else None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
        super().close()

    def _show(self) -> None:
        """The present in the window of the mode "human"."""
        if self.render_mode != "human" or self._film is None:
            return
        if self._window is None:
            from insenv.envs.render import Window  # matplotlib only where a picture is wanted

            self._window = Window(self.task.name, self.metadata["render_fps"])
        self._window.show(self._film.frame())

    def _shown(self, part: RowsPart) -> Blocks:
        self._group = part.group
        self.chunk = part.seen.chunk
        return {key: block[0] for key, block in part.seen.observation.items()}

    @staticmethod
    def _info(part: RowsPart) -> dict[str, Any]:
        return {"truth": {name: float(values[0]) for name, values in part.group.truth.items()}}


class SystemEnv(TaskEnv):
    """A system's environment, of the settings that its ``maker`` takes.

    Attributes
    ----------
    maker : callable
        The system's task of its settings, a static method of each class: its first parameter is the scenario.
    """

    maker: ClassVar[Callable[..., Task]]

    def __init__(
        self,
        scenario: str | None = None,
        changes: Mapping[str, Any] | None = None,
        estimator: str | None = None,
        step_s: float | None = None,
        sampling: float | None = None,
        render_mode: str | None = None,
    ) -> None:
        named = () if scenario is None else (scenario,)
        settings = {"changes": changes, "estimator": estimator, "step_s": step_s, "sampling": sampling}
        super().__init__(type(self).maker(*named, **settings), render_mode)


def checked_mode(mode: str | None, metadata: Mapping[str, Any]) -> str | None:
    """The render mode, if there is such a one."""
    if mode is not None and mode not in metadata["render_modes"]:
        known = ", ".join((*(repr(known) for known in metadata["render_modes"]), "None"))
        raise InputError(f"render_mode = {mode!r}; wanted {known}")
    return mode


def refuse_options(task: Task, options: Mapping[str, Any] | None) -> None:
    """A run has no options: what is meant by one must not be passed over in silence."""
    if options:
        raise InputError(f"{task.name}: option {next(iter(options))!r} given to reset; wanted none")
