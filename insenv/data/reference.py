"""What the channels of a table are: the reading of an encoder, or what the table was told.

A command holds and jumps, or is computed to the last digit; what was measured has noise, or the steps of its numbers.
Where both are logged the encoder is the reference and the command the programme; their difference is the servo's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import GAP, Channel, Floats, Origin, Recording
from insenv.core.series.outlying import MOST, unseen
from insenv.core.series.positions import angles_are_points, dwells, rates_were_set, were_set
from insenv.core.series.trajectory import Of, Trajectory, reading_noise, trajectory
from insenv.data.cells.follow import follows

#: Share of the rows at which a command that holds may change.
HOLDS = 0.05
#: Noise of what was computed, as a share of its largest value: the digits of a file.
COMPUTED = 1e-5
#: Share of the turns that a gyro reads where they are in the rows, and rows beside one that may be part of it at most.
READ, BESIDE = 0.1, 500
#: Share of the motion that a gyro reads which follows it, and fewest rows in which leaps of a rate are looked for.
FOLLOWS, FEWEST = 0.3, 64
#: Rows on either side in which a gyro may have seen what a reference that is early or late has.
LATE = 8
#: Channels of a table, and what each reads.
TABLE: dict[str, Of] = {"table_angle": "angle", "table_rate": "rate"}
#: Channels by which attitudes are told, and what stands for them among the channels of which rows are points.
ACCELEROMETER_TRIAD, ATTITUDE = ("accel_x", "accel_y", "accel_z"), "attitude"
#: What a point is one of.
OF_POINTS = {
    "table_rate": "rate of the table",
    "table_angle": "angle of the table",
    "temperature": "temperature",
    ATTITUDE: "attitude",
}


def with_reference(recording: Recording) -> Recording:
    """The recording with the source of its table's channels said, and the motion behind a noisy encoder."""
    recording = with_positions(recording)
    found = {name: recording.channels[name] for name in TABLE if name in recording.channels}
    if not found:
        return recording
    told = {name: replace(c, source=c.source or found_source(name, c)) for name, c in found.items()}
    recording = replace(recording, channels={**recording.channels, **told})
    if is_set(recording) or is_in_points(recording):
        return recording
    encoder = next((name for name in order(recording) if told[name].source == "encoder"), None)
    if encoder is None:
        return recording
    channel = told[encoder]
    over = channel.covers == "interval"
    doubtful = _doubtful(recording, encoder)
    table = trajectory(recording.t - channel.delay, recording.dt, channel.values, TABLE[encoder], over, doubtful)
    if table is not None and _is_motion(recording, encoder, table):
        table = None
    return replace(recording, table=table)


def _doubtful(recording: Recording, encoder: str) -> NDArray[np.bool_] | None:
    """Rows of an encoder that say nothing of the motion: those left out, and leaps of a rate that no gyro has seen.

    One wrong word of a wheel bends the motion on both sides of it, and what multiplies its change hangs on that.
    """
    left_out, channel = recording.left_out.get(encoder), recording.channels[encoder]
    if TABLE[encoder] != "rate" or len(recording) < FEWEST:
        return left_out
    u = channel.values
    gyros = [c.values for name, c in recording.channels.items() if name.partition("_")[0] == "gyro"]
    along = [y for y in gyros if abs(float(u @ y)) > FOLLOWS * float(u @ u) > 0]
    if not along:
        return left_out
    wrong = np.logical_and.reduce([unseen(y, u, beside=LATE)[0] for y in along])
    if not 0 < wrong.mean() <= MOST:
        return left_out
    return wrong if left_out is None else wrong | left_out


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


def with_positions(recording: Recording, t: Floats | None = None) -> Recording:
    """The recording with it said that its table's angle or rate was set, where it looks so and nobody said otherwise.

    Rates that were told, or of which nobody said what they are, are those of points where they look so. ``t`` are the
    times to go by where those of the recording are none, shape (n,) [s].
    """
    there = [name for name in TABLE if name in recording.channels]
    if len(there) != 1:
        return recording
    (name,), channel = there, recording.channels[there[0]]
    t = recording.t if t is None else t
    if name == "table_rate":
        was_set = channel.source != "encoder" and rates_were_set(t, channel.values)
    else:
        # Of a gyro such a column may be an angle that is told less often than the gyro is read.
        steps = were_set(t, channel.values) or (not _has_gyros(recording) and dwells(t, channel.values))
        was_set = channel.source is None and steps and not _read(recording, channel)
    if not was_set:
        return recording
    return replace(recording, channels={**recording.channels, name: replace(channel, source="set")})


def _has_gyros(recording: Recording) -> bool:
    return any(name.partition("_")[0] == "gyro" for name in recording.channels)


def points_of(recording: Recording) -> str | None:
    """What each row is a point of, with no row of the changes between; None where rows follow each other.

    A rate or an angle of the table, one to a row; without a table an attitude or a temperature.
    """
    there = [name for name in TABLE if name in recording.channels] or ["temperature"]
    if all(name in recording.channels and recording.channels[name].source == "set" for name in ACCELEROMETER_TRIAD):
        return ATTITUDE
    channel = recording.channels.get(there[0])
    if len(there) > 1 or channel is None or channel.source != "set":
        return None
    return there[0] if there[0] != "table_angle" or angles_are_points(recording.t, channel.values) else None


def is_in_points(recording: Recording) -> bool:
    """Whether each of its rows is a point, with no row of the changes between."""
    return points_of(recording) is not None


def is_set(recording: Recording) -> bool:
    """Whether the table's angle was set, and is no motion."""
    channel = recording.channels.get("table_angle")
    return channel is not None and channel.source == "set"


def _read(recording: Recording, channel: Channel) -> bool:
    """Whether a gyro reads the turns: what it turns by around each of them goes with the change of the angle."""
    change = np.diff(channel.values)
    at = np.flatnonzero((change != 0) & (np.diff(recording.t) <= GAP * recording.dt))
    if not len(at):
        return False
    beside = min(BESIDE, int(np.median(np.diff(at))) // 2)
    first, last = np.maximum(at - beside, 0), np.minimum(at + 2 + beside, len(recording))
    gyros = [c for name, c in recording.channels.items() if name.partition("_")[0] == "gyro"]
    turned = (np.cumsum(np.append(0.0, c.values - np.median(c.values))) * recording.dt for c in gyros)
    return any(_share(change[at], total[last] - total[first]) > READ for total in turned)


def _share(change: Floats, turned: Floats) -> float:
    """By how much an instrument turns, for each radian of a change."""
    return abs(float(change @ turned)) / float(change @ change)


def at_cells(channel: Channel, cell_of_row: NDArray[np.int64], n: int) -> Floats:
    """A state at the edges of ``n`` cells, shape (n + 1,): that at the end of each is the one in it."""
    position, known = np.zeros(n), np.zeros(n, bool)
    inside = cell_of_row >= 0
    position[cell_of_row[inside]], known[cell_of_row[inside]] = channel.values[inside], True
    if not known.any():
        return np.full(n + 1, float(channel.values[0]))
    last = np.maximum.accumulate(np.where(known, np.arange(n), -1))
    position = position[np.where(last < 0, int(np.argmax(known)), last)]
    return np.append(position[:1], position)


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
    """What the channels of the table are taken for, where the manifest does not say; ``said`` are those it does.

    And a temperature, where each row is a point of it.
    """
    found: dict[str, list[str]] = {}
    for recording in recordings:
        points = points_of(recording)
        if points == ATTITUDE:
            found.setdefault(_ATTITUDES, []).append(recording.label)
        for name in (*TABLE, *(["temperature"] if points == "temperature" else [])):
            if name in recording.channels and name not in said:
                channel = recording.channels[name]
                source = channel.source or found_source(name, channel)
                words = _WORDS[source] if points is None else _POINTS[name]
                found.setdefault(f"{name} is taken for {words}", []).append(recording.label)
    return tuple(
        f"{text}{'' if len(labels) == len(recordings) else ' in ' + ', '.join(labels)}"
        for text, labels in found.items()
    )


_ATTITUDES = (
    "the accelerometers read gravity from another side in each row: a row is taken for a mean in one attitude, with no "
    'row of the turns between. procedure = "multi-position" calibrates the accelerometers by it too'
)
_POINTS = {
    "table_rate": "what the table was set to, each row a mean at one rate with no row of the changes between "
    '(source = "set")',
    "table_angle": "what the table was set to, each row a mean at one angle with no row of the turns between "
    '(source = "set")',
    "temperature": "one that was waited for, each row a mean at one temperature with no row of the changes between "
    '(source = "set")',
}
_WORDS = {
    "encoder": 'the reading of an encoder (source = "encoder")',
    "command": 'what the table was told (source = "command")',
    "set": 'what the table was set to from rest to rest, with no row of the turns between (source = "set")',
}
