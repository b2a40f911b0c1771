"""A discrete form of the calibration of a unit: an action is the number of a position of a list."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.unit.gimbals import Gimbals
from insenv.envs.single import TaskEnv
from insenv.information.positions import Angles, nineteen, right_angles, six, twenty_four

#: Published lists of positions, and all right angles, by name.
LISTS: Mapping[str, Callable[[Gimbals], tuple[Angles, ...]]] = {
    "six": six,
    "nineteen": nineteen,
    "twenty_four": twenty_four,
    "right_angles": right_angles,
}


class AtPositions(gymnasium.ActionWrapper[Any, Any, Any]):
    """``Discrete(n)``: go to position i of a list and dwell there; the last number, n - 1, stops.

    Parameters
    ----------
    env : gymnasium.Env
        ``insenv/SystemCalibration-v0``.
    positions : str or sequence of sequence of float
        One of `LISTS`, whose repetitions count once, or angles of the axes [rad].
    dwell : float
        At each position [s].

    Raises
    ------
    InputError
        If the environment is another, there is no such list, or the table does not reach a position.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        positions: str | Sequence[Sequence[float]] = "right_angles",
        dwell: float = 30.0,
    ) -> None:
        super().__init__(env)
        inner = env.unwrapped
        gimbals = inner.task.datasheet.mounting.gimbals if isinstance(inner, TaskEnv) else None
        if gimbals is None:
            raise InputError(f"{env} given to AtPositions; wanted insenv/SystemCalibration-v0")
        if isinstance(positions, str):
            if positions not in LISTS:
                raise InputError(f"positions = {positions!r}; wanted one of {', '.join(LISTS)}, or angles")
            positions = tuple(dict.fromkeys(LISTS[positions](gimbals)))
        self.angles = np.asarray(positions, float)
        most = np.array(gimbals.most)
        if self.angles.ndim != 2 or self.angles.shape[1] != len(most) or np.any(np.abs(self.angles) > most + 1e-9):
            raise InputError(
                f"positions of shape {self.angles.shape}; wanted (n, {len(most)}), within the table's limits"
            )
        self._shares, self._dwell = self.angles / most, min(dwell / gimbals.longest, 1.0)
        self.action_space = spaces.Discrete(len(self.angles) + 1)

    def action(self, action: Any) -> Floats:
        """The continuous action."""
        stop = int(action) == len(self.angles)
        position = self._shares[0] if stop else self._shares[int(action)]
        return np.array([*position, 0.0, self._dwell, float(stop)])
