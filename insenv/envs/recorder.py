"""A wrapper that keeps the episode as a recording, ready for closing the loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from insenv.core.errors import InputError
from insenv.core.recording import Channel, Floats, Recording
from insenv.core.rows import row_of
from insenv.core.series.allan import QUANTIZATION
from insenv.data.manifest import HeldOut, Model
from insenv.data.manifest.spec import CHANNELS
from insenv.data.save import save
from insenv.effects.angle import EarthRate
from insenv.effects.bias import Bias
from insenv.effects.catalogue import by_key
from insenv.envs.group import Blocks
from insenv.envs.single import TaskEnv
from insenv.envs.task import Task
from insenv.envs.turns import Command, turn_angle
from insenv.information.unit.calibration import is_by_eye
from insenv.scenario.measured import sheet_table

#: Share of a rest that is held out.
HELD_OUT = 0.25


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
        self._commands: list[Command] = []

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Blocks, dict[str, Any]]:
        """Begin a run, and forget the one before."""
        self._chunks, self._commands = [], []
        return self.env.reset(seed=seed, options=options)

    def step(self, action: Floats) -> tuple[Blocks, Any, bool, bool, dict[str, Any]]:
        """One step."""
        shown = self.env.step(action)
        if self._inner.chunk is not None:
            chunk, task = row_of(self._inner.chunk, 0), self._inner.task
            began = float(chunk.t[0]) - task.datasheet.dt
            told, _ = task.world.command(np.asarray(action, float)[None])
            self._commands.append((round(began, 9), float(np.ravel(told)[0])))
            self._chunks.append(chunk)
        return shown

    @property
    def chunk(self) -> Recording | None:
        """What the last step recorded: what a policy or an estimator takes; None before the first step."""
        return self._chunks[-1] if self._chunks else None

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

        The datasheet is written, too: ``insenv estimate`` knows what an estimator in the environment did. Of a vehicle
        that turned, the angle that it was commanded to turn by is written as ``table_angle``, the Earth rate is
        declared, and where the scenario holds nothing out, the middle of each rest is.

        Returns
        -------
        Path
            Of the manifest, for ``insenv close-loop``.

        Raises
        ------
        InputError
            If no time has passed, or a file cannot be written.
        """
        return save_runs(folder, self._inner.task, [Played(self.recording(), tuple(self._commands))])


@dataclass(frozen=True)
class Played:
    """A run that was played: what was recorded, what was commanded, and how far the base had been turned [rad]."""

    recording: Recording
    commands: tuple[Command, ...]
    base_turned: float = 0.0


def save_runs(folder: Path | str, task: Task, runs: Sequence[Played]) -> Path:
    """Write runs of one instrument and their manifest; as `Recorder.save`, which does so for one.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    kept, model = [], task.model
    unit = task.datasheet.mounting.gimbals is not None
    by_eye = unit and is_by_eye(task.datasheet.mounting)
    vehicle = "turning" in runs[0].recording.channels and not unit
    turned = vehicle and any(turn for run in runs for _, turn in run.commands)
    for run in runs:
        known = {name: channel for name, channel in run.recording.channels.items() if name in CHANNELS}
        mounting = replace(run.recording.mounting, base_turned=run.base_turned)
        if by_eye:
            known = {name: channel for name, channel in known.items() if not name.startswith("axis_")}
            mounting = replace(mounting, gimbals=None)
        one = replace(run.recording, channels=known, mounting=mounting)
        if turned:
            one, model = _turned(one, task, run.commands)
        kept.append(one)
    if unit:
        model = _in_positions(model, by_eye)
    title = f"{task.name}, {kept[0].label}" + (f" and {len(kept) - 1} more" if len(kept) > 1 else "")
    path = Path(folder) / "manifest.toml"
    sheet = sheet_table(task.datasheet)
    save(path, kept, model, title=title, noise=_noise(task), held_out=_held_out(task, kept), datasheet=sheet)
    return path


def _turned(recording: Recording, task: Task, commands: Sequence[Command]) -> tuple[Recording, Model]:
    """The recording of a vehicle with its turn angle, and the model that holds for it."""
    angle = turn_angle(recording.t, commands, task.datasheet.limits)
    channels = {**recording.channels, "table_angle": Channel(angle, "rad")}
    declared = task.model.declared
    if recording.site.latitude is not None and EarthRate.id not in declared:
        declared = (*declared, EarthRate.id)
    mounting = replace(recording.mounting, table_axis="U")
    return replace(recording, channels=channels, mounting=mounting), replace(task.model, declared=declared)


def _in_positions(model: Model, by_eye: bool) -> Model:
    """The model of a unit that was turned from rest to rest: what rests and turns can tell is declared.

    ``by_eye``: nothing reads its attitude. What shows in the turns alone (delays, lever arms) is then left to the
    environment's own estimators; the loop may name it by what it does to the rests.
    """
    from insenv.identify.positions import part  # where they are used
    from insenv.identify.positions.on_axes import terms

    able = terms.able()
    if by_eye:
        able = {Bias.id, part.WHOLE, *part.OF_ACCELEROMETERS, *part.OF_ROTATIONS, *part.OF_RESTS}
    declared = tuple(key for key in model.declared if by_key(key).id in able)
    return replace(model, procedure="multi-position", declared=declared)


def _held_out(task: Task, recordings: Sequence[Recording]) -> HeldOut:
    """What the scenario holds out; else every second rest of a unit in the hand, of a vehicle the middle of each rest.

    Of a unit on axes that are read nothing is said: the loop holds out some rests with the turns after them.

    That of a vehicle that turned is a share `HELD_OUT` of the rest.

    Each rest has a level of its own, which none of the others foretells, and its ends tell most of what drifts.
    """
    if task.held_out == HeldOut() and task.datasheet.mounting.gimbals is not None:
        return HeldOut(positions="even") if is_by_eye(task.datasheet.mounting) else HeldOut()
    if task.held_out != HeldOut() or not recordings[0].mounting.table_axis:
        return task.held_out
    rows: list[tuple[int, int]] = []
    before, (low, high) = 0, (0.5 - HELD_OUT / 2, 0.5 + HELD_OUT / 2)
    for recording in recordings:
        still = np.diff(recording.channels["table_angle"].values) == 0
        edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]]))) + before
        rests = [(a, b) for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)]
        rows += [(a + round(low * (b - a)), a + round(high * (b - a))) for a, b in rests if (b - a) * HELD_OUT >= 1]
        before += len(recording)
    return HeldOut(rows=tuple(rows)) if rows else task.held_out


def _noise(task: Task) -> dict[str, dict[str, float]]:
    """The makers' figures for what is to be explained; whole pulses are a quantization too."""
    sheet = task.datasheet
    noise = {target: dict(sheet.noise.get(target, {})) for target in task.model.targets}
    if sheet.pulse and "gyro" in noise:
        noise["gyro"][QUANTIZATION] = sheet.pulse / np.sqrt(12.0)
    return noise


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
