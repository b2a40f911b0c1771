"""What the channels of a table are: the reading of an encoder, or what the table was told.

A command holds and jumps, or is computed to the last digit; what was measured has noise, or the steps of its numbers.
Where both are logged the encoder is the reference and the command the programme; their difference is the servo's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from insenv.core.recording import GAP, Channel, Floats, Origin, Recording
from insenv.core.series.trajectory import Of, Trajectory, reading_noise, trajectory
from insenv.data.follow import follows

#: Share of the rows at which a command that holds may change.
HOLDS = 0.05
#: Noise of what was computed, as a share of its largest value: the digits of a file.
COMPUTED = 1e-5
#: Channels of a table, and what each reads.
TABLE: dict[str, Of] = {"table_angle": "angle", "table_rate": "rate"}


def with_reference(recording: Recording) -> Recording:
    """The recording with the source of its table's channels said, and the motion behind a noisy encoder."""
    found = {name: recording.channels[name] for name in TABLE if name in recording.channels}
    if not found:
        return recording
    told = {name: replace(c, source=c.source or found_source(name, c)) for name, c in found.items()}
    recording = replace(recording, channels={**recording.channels, **told})
    encoder = next((name for name in order(recording) if told[name].source == "encoder"), None)
    if encoder is None:
        return recording
    channel = told[encoder]
    over = channel.covers == "interval"
    table = trajectory(recording.t - channel.delay, recording.dt, channel.values, TABLE[encoder], over)
    if table is not None and not table.still and _is_motion(recording, encoder, table):
        table = None
    return replace(recording, table=table)


def _is_motion(recording: Recording, encoder: str, table: Trajectory) -> bool:
    """Whether a gyro reads nearly all of what is taken for noise of the encoder.

    Differences tell no noise where the table swings within a few rows: of an angle that was read at 5 Hz and goes to
    and fro in 0.8 s they are motion.
    """
    channel = recording.channels[encoder]
    t = recording.t - channel.delay
    apart = np.diff(t) <= GAP * recording.dt
    if TABLE[encoder] == "angle":
        change, smooth = np.diff(channel.values), np.diff(table.angle_at(t))
    else:
        own = channel.values, table.rate_at(t)
        change, smooth = (0.5 * (v[1:] + v[:-1]) * np.diff(t) for v in own)
    gyros = [c for name, c in recording.channels.items() if name.partition("_")[0] == "gyro"]
    return any(follows(change, smooth, _turned(gyro, recording.t), apart) for gyro in gyros)


def _turned(gyro: Channel, t: Floats) -> Floats:
    """How far a gyro says that it has turned from row to row, shape (n - 1,)."""
    mean = gyro.values[1:] if gyro.covers == "interval" else 0.5 * (gyro.values[1:] + gyro.values[:-1])
    return np.asarray(mean * np.diff(t))


def order(recording: Recording) -> tuple[str, ...]:
    """Channels of the table that are there, the best reference first: what was measured, then the angle."""
    there = [name for name in TABLE if name in recording.channels]
    return tuple(sorted(there, key=lambda name: recording.channels[name].source == "command" and len(there) > 1))


def programme(recording: Recording) -> str | None:
    """The channel that tells what the table was asked for, beside another that was measured."""
    rate = recording.channels.get("table_rate")
    if rate is None or "table_angle" not in recording.channels or rate.source == "encoder":
        return None
    return None if recording.channels["table_angle"].source == "command" else "table_rate"


def found_source(name: str, channel: Channel) -> Origin:
    """What a channel must be, by its numbers: an angle is read, a rate is told if it holds or has no noise."""
    return "encoder" if name == "table_angle" or not _is_command(channel.values) else "command"


def _is_command(values: Floats) -> bool:
    size = float(np.abs(values).max(initial=0.0))
    if not size or float(np.mean(np.abs(np.diff(values)) > COMPUTED * size)) < HOLDS:
        return True
    return reading_noise(values) < COMPUTED * size


def sentences(recordings: Sequence[Recording], said: Sequence[str] = ()) -> tuple[str, ...]:
    """What the channels of the table are taken for, where the manifest does not say; ``said`` are those it does."""
    found: dict[str, list[str]] = {}
    for recording in recordings:
        for name in TABLE:
            if name in recording.channels and name not in said:
                channel = recording.channels[name]
                source = channel.source or found_source(name, channel)
                found.setdefault(f"{name} is taken for {_WORDS[source]}", []).append(recording.label)
    return tuple(
        f"{text}{'' if len(labels) == len(recordings) else ' in ' + ', '.join(labels)}"
        for text, labels in found.items()
    )


_WORDS = {
    "encoder": 'the reading of an encoder (source = "encoder")',
    "command": 'what the table was told (source = "command")',
}
