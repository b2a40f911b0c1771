"""`gymnasium.vector.VectorEnv` over a task: all rows in one step.

What it gives is what `gymnasium.vector.SyncVectorEnv` over as many `insenv.envs.single.TaskEnv` gives, bit for
bit: observations, rewards, ends and infos, in the autoreset modes NEXT_STEP and DISABLED.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.envs.batch import Batch, RowsPart, gathered
from insenv.envs.group import Blocks, Flags, Index
from insenv.envs.single import SEEDS, checked_mode, refuse_options
from insenv.envs.task import Task, checked

Steps = tuple[Blocks, Floats, Flags, Flags, dict[str, Any]]
MODES = (AutoresetMode.NEXT_STEP, AutoresetMode.DISABLED)


class TaskVectorEnv(VectorEnv[Blocks, Floats, Any]):
    """``num_envs`` runs at a time.

    Row i after ``reset(seed=s)`` is the run s + i. Each row has its own ``np_random``, from which the seeds of
    its further runs are drawn.

    Parameters
    ----------
    task : Task
    num_envs : int
    max_episode_steps : int, optional
        Truncate a run after so many steps, where time is not up before.
    autoreset_mode : AutoresetMode or str
        "NextStep": the step after an end begins the next run, whatever the action. "Disabled": rows that
        ended wait for ``reset(options={"reset_mask": ended})``.

    Raises
    ------
    InputError
        If a number is no positive whole one, or the mode is another.
    """

    def __init__(
        self,
        task: Task,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
    ) -> None:
        self.task = task
        self.num_envs = _whole("num_envs", num_envs)
        self._limit = task.steps + 1 if max_episode_steps is None else _whole("max_episode_steps", max_episode_steps)
        self._mode = _autoreset(autoreset_mode)
        self.metadata = {"render_modes": [], "autoreset_mode": self._mode}
        self.render_mode = checked_mode(render_mode, self.metadata)
        self.single_action_space = task.action_space
        self.single_observation_space = task.observation_space
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._batch = Batch(task, self.num_envs)
        self._generators: list[tuple[np.random.Generator, int] | None] = [None] * self.num_envs
        self._passed = np.zeros(self.num_envs, np.int64)
        self._ended = np.zeros(self.num_envs, bool)
        self._all = np.arange(self.num_envs)
        self._last: Blocks | None = None
        # True values of all rows in one array, and the mapping that they are of: the same in all steps of a run.
        self._truth: Mapping[str, Floats] | None = None
        self._values: Floats = np.empty((0, 0))

    @property  # type: ignore[misc]
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """Generator of each row, as a `SyncVectorEnv` has them."""
        return tuple(self._generator(row)[0] for row in range(self.num_envs))

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]
        """What the generator of each row was made with."""
        return tuple(self._generator(row)[1] for row in range(self.num_envs))

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Blocks, dict[str, Any]]:
        """Begin a run in every row, or in those of ``options["reset_mask"]`` alone.

        Raises
        ------
        InputError
            If the seeds or the mask do not fit the rows, or another option is given.
        """
        given = dict(options or {})
        mask = given.pop("reset_mask", None)
        refuse_options(self.task, given)
        seeds = self._seeds(seed)
        index = self._all if mask is None else self._masked(mask)
        if self._last is None and len(index) < self.num_envs:
            raise ResetNeeded(f"{self.task.name}: rows begin for the first time; call reset without a mask first")
        part = self._begin(index, seeds)
        seen, *_ = gathered([part], self.num_envs)
        if len(index) < self.num_envs:
            assert self._last is not None
            waiting = np.setdiff1d(self._all, index)
            for key, block in seen.items():
                block[waiting] = self._last[key][waiting]
        return self._kept(seen), self._info([part])

    def step(self, actions: Floats) -> Steps:
        """One step of every row.

        Raises
        ------
        ResetNeeded
            If no run has begun, or, with autoreset disabled, one has ended.
        InputError
            If an action cannot be used.
        """
        if self._last is None:
            raise ResetNeeded(f"{self.task.name}: no run has begun; call reset first")
        if np.count_nonzero(self._batch.alive | self._ended) < self.num_envs:
            raise ResetNeeded(f"{self.task.name}: the last step failed, and ended all runs; call reset first")
        resetting = np.count_nonzero(self._ended) > 0
        if not resetting:
            parts: tuple[RowsPart, ...] = self._batch.step(checked(self.task, actions, self.num_envs))
        else:
            if self._mode is AutoresetMode.DISABLED:
                row = int(np.flatnonzero(self._ended)[0])
                raise ResetNeeded(f"{self.task.name}: the run of row {row} has ended; call reset with a reset_mask")
            parts = self._restarted(checked(self.task, actions, self.num_envs, ~self._ended))
        seen, reward, terminated, truncated = gathered(parts, self.num_envs)
        if not resetting:
            self._passed += 1
        if self._limit <= self.task.steps:
            truncated |= self._passed >= self._limit
        self._ended = terminated | truncated
        return self._kept(seen), reward, terminated, truncated, self._info(parts)

    def _restarted(self, actions: Floats) -> tuple[RowsPart, ...]:
        """A step in which the rows that ended begin anew and the others go on."""
        index = np.flatnonzero(self._ended)
        actions = np.where(self._ended[:, None], self.task.action_space.low, actions)
        # Rows that were cut short are alive still, and must not step on.
        self._batch.leave(index)
        self._passed += 1
        stepped = self._batch.step(actions)
        return (*stepped, self._begin(index, [None] * self.num_envs))

    def _begin(self, index: Index, seeds: Sequence[int | None]) -> RowsPart:
        runs = []
        for row in index.tolist():
            seed = seeds[row]
            if seed is not None:
                self._generators[row] = np_random(seed)
            runs.append(int(self._generator(row)[0].integers(SEEDS)) if seed is None else seed)
        self._passed[index] = 0
        self._ended[index] = False
        return self._batch.begin(index, runs)

    def _generator(self, row: int) -> tuple[np.random.Generator, int]:
        made = self._generators[row]
        if made is None:
            made = self._generators[row] = np_random()
        return made

    def _seeds(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int):
            return range(seed, seed + self.num_envs)
        if len(seed) != self.num_envs:
            raise InputError(f"{self.task.name}: {len(seed)} seeds given; wanted {self.num_envs}, one for each row")
        return list(seed)

    def _masked(self, mask: Any) -> Index:
        wanted = f"wanted {self.num_envs} booleans, at least one of them True"
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            raise InputError(f"{self.task.name}: reset_mask is no array of booleans; {wanted}")
        if mask.shape != (self.num_envs,) or not mask.any():
            raise InputError(f"{self.task.name}: reset_mask of shape {mask.shape}, {mask.sum()} True; {wanted}")
        return np.flatnonzero(mask)

    def _kept(self, seen: Blocks) -> Blocks:
        """The observation, with a copy for the reset of single rows: what was given away is not ours any more."""
        self._last = {key: block.copy() for key, block in seen.items()}
        return seen

    def _info(self, parts: Sequence[RowsPart]) -> dict[str, Any]:
        """As `VectorEnv._add_info` lays out the truths of single environments; one mask serves for all of them."""
        first = parts[0].group.truth
        if len(parts) == 1 and len(parts[0].index) == self.num_envs:
            if self._truth is not first:
                self._truth, self._values = first, np.array([*first.values()], float)
            values, there = self._values.copy(), np.ones(self.num_envs, bool)
        else:
            values, there = np.zeros((len(first), self.num_envs)), np.zeros(self.num_envs, bool)
            for part in parts:
                there[part.index] = True
                values[:, part.index] = [*part.group.truth.values()]
        truth: dict[str, Any] = {}
        for name, own in zip(first, values, strict=True):
            truth[name], truth[f"_{name}"] = own, there
        return {"truth": truth, "_truth": there}


class SystemVectorEnv(TaskVectorEnv):
    """The vector form of a system's environment: settings of its ``maker``, and those of `TaskVectorEnv`.

    Attributes
    ----------
    maker : callable
        As of `insenv.envs.single.SystemEnv`.
    """

    maker: ClassVar[Callable[..., Task]]

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        super().__init__(type(self).maker(**settings), num_envs, max_episode_steps, autoreset_mode, render_mode)


def _whole(name: str, value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise InputError(f"{name} = {value!r}; wanted a whole number from 1")
    return int(value)


def _autoreset(mode: AutoresetMode | str) -> AutoresetMode:
    known = ", ".join(repr(m.value) for m in MODES)
    try:
        found = AutoresetMode(mode)
    except ValueError:
        raise InputError(f"autoreset_mode = {mode!r}; wanted one of {known}") from None
    if found not in MODES:
        raise InputError(f"autoreset_mode = {found.value!r} is not offered; wanted one of {known}")
    return found
