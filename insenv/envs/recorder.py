"""A wrapper that keeps the episode as a recording, ready for closing the loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from insenv.core.errors import InputError
from insenv.core.manifest.spec import CHANNELS
from insenv.core.recording import Channel, Floats, Recording
from insenv.core.save import save
from insenv.envs.group import Blocks
from insenv.envs.single import TaskEnv
from insenv.envs.task import Task


class Recorder(gymnasium.Wrapper[Blocks, Floats, Blocks, Floats], RecordConstructorArgs):
    """Keeps what the instruments of an `insenv.envs.single.TaskEnv` record from reset to reset.

    It holds what an estimator is given, and nothing of the truth.

    Raises
    ------
    InputError
        If the environment is no such.
    """

    def __init__(self, env: gymnasium.Env[Blocks, Floats]) -> None:
        RecordConstructorArgs.__init__(self)
        gymnasium.Wrapper.__init__(self, env)
        if not isinstance(env.unwrapped, TaskEnv):
            raise InputError(f"{env} given to Recorder; wanted one of insenv's environments")
        self._inner = env.unwrapped
        self._chunks: list[Recording] = []

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Blocks, dict[str, Any]]:
        """Begin a run, and forget the one before."""
        self._chunks = []
        return self.env.reset(seed=seed, options=options)

    def step(self, action: Floats) -> tuple[Blocks, Any, bool, bool, dict[str, Any]]:
        """One step."""
        shown = self.env.step(action)
        if self._inner.chunk is not None:
            self._chunks.append(row_of(self._inner.chunk, 0))
        return shown

    def recording(self) -> Recording:
        """The run so far.

        Raises
        ------
        InputError
            If no time has passed.
        """
        return joined(self._chunks, f"seed {self._inner.group.seeds[0]}")

    def save(self, folder: Path | str) -> Path:
        """Write the recording and its manifest, which declares what the scenario declares, into ``folder``.

        Channels that a manifest does not know, such as the readings of a sight, are left out.

        Returns
        -------
        Path
            Of the manifest, for ``insenv close-loop``.

        Raises
        ------
        InputError
            If no time has passed, or a file cannot be written.
        """
        task, recording = self._inner.task, self.recording()
        known = {name: channel for name, channel in recording.channels.items() if name in CHANNELS}
        path = Path(folder) / "manifest.toml"
        save(
            path,
            [replace(recording, channels=known)],
            task.model,
            title=f"{task.name}, {recording.label}",
            noise=_noise(task),
            held_out=task.held_out,
        )
        return path


def _noise(task: Task) -> dict[str, dict[str, float]]:
    """The makers' figures for what is to be explained; whole pulses are a quantization too."""
    sheet = task.datasheet
    noise = {target: dict(sheet.noise.get(target, {})) for target in task.model.targets}
    if sheet.pulse and "gyro" in noise:
        noise["gyro"]["quantization"] = sheet.pulse / np.sqrt(12.0)
    return noise


def row_of(chunk: Recording, row: int) -> Recording:
    """One run of a batch; what all runs share it has too."""
    channels = {
        name: replace(channel, values=channel.values[row] if channel.values.ndim > 1 else channel.values)
        for name, channel in chunk.channels.items()
    }
    return replace(chunk, channels=channels)


def joined(chunks: Sequence[Recording], label: str) -> Recording:
    """The chunks of one run, one after the other.

    Raises
    ------
    InputError
        If there is none.
    """
    if not chunks:
        raise InputError(f"{label}: no time has passed; wanted a recording of one step at least")
    first = chunks[0]
    channels = {
        name: Channel(
            np.concatenate([c.channels[name].values for c in chunks]), channel.unit, channel.covers, channel.delay
        )
        for name, channel in first.channels.items()
    }
    return replace(first, t=np.concatenate([c.t for c in chunks]), channels=channels, label=label)
