"""The references of a run that nobody has made yet: what a table or a vehicle would show of it.

The plants of `insenv.plants` make angle, rate and temperature; `insenv.data.exposure` reads them as it reads a file.
Other instruments of the run are taken as they were: as a wave of the table's angle and a share of its rate where it
turns, else as they were recorded.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from insenv.core.recording import Channel, Floats, Recording
from insenv.core.units import STANDARD_GRAVITY
from insenv.data.exposure import expose
from insenv.data.reference import is_set
from insenv.identify.clean.triads import turning
from insenv.identify.fit.bins import gather
from insenv.identify.fit.problem import Problem
from insenv.plants.profile import Piece, Profile
from insenv.plants.thermal import Points, Temperature
from insenv.plants.turntable import Turntable

#: Cells per turn of the table, at least, and bins of a further run, at most.
_CELLS_PER_TURN, _MOST_BINS = 16, 20000
#: Cells of a further run, at most: a table that turned at a rate that no table has is not followed turn by turn.
_MOST_CELLS = 2_000_000
#: Points that stand for a recorded temperature, and rows that tell the waves of other instruments.
_POINTS, _ROWS = 200, 20000


@dataclass(frozen=True)
class FurtherRun:
    """What a further run would do.

    Attributes
    ----------
    pieces : Profile
        Rates of the table [rad/s], as long as the run.
    temperature : Temperature, optional
        None: as in the first run.
    base_turned : float
        [rad]
    lean : float
        Angle by which the table's axis is tilted [rad].
    tilt : float, optional
        Of the input axis [rad]; None: as it was.
    """

    pieces: Profile
    temperature: Temperature | None = None
    base_turned: float = 0.0
    lean: float = 0.0
    tilt: float | None = None

    @property
    def duration(self) -> float:
        """Of the run [s]."""
        return sum(piece.duration for piece in self.pieces)

    @property
    def fastest(self) -> float:
        """Largest rate [rad/s]."""
        return max(abs(piece.rate) for piece in self.pieces)


@dataclass(frozen=True, eq=False)
class Recorded:
    """What the references of the first run are like.

    ``waves`` has for each other instrument the coefficients of 1, cos a, sin a and the rate, and what they leave.
    """

    recording: Recording
    temperature: Points | None
    waves: Mapping[str, Floats] = field(default_factory=dict)

    @classmethod
    def of(cls, recording: Recording) -> Recorded:
        """Temperature and waves of a run."""
        channels = recording.channels
        others = [n for n in channels if n.startswith(("accel", "gyro"))]
        rows = slice(None, None, max(1, len(recording) // _ROWS))
        columns = _columns(recording)[rows] if others else np.zeros((0, 4))
        waves: dict[str, Floats] = {
            n: np.asarray(np.linalg.lstsq(columns, channels[n].values[rows], rcond=1e-6)[0]) for n in others
        }
        return cls(recording, _smooth_temperature(recording), waves)

    @property
    def turns(self) -> bool:
        """Whether there is a table that turned."""
        angle = self.recording.channels.get("table_angle")
        return angle is not None and float(np.ptp(angle.values)) > 0.1


def further(
    plan: FurtherRun, like: Recorded, recorded: Problem, with_earth: bool, acceleration: float = np.inf
) -> Problem:
    """The further run as a problem of its own, with bins as long as the recorded ones; there is no data in it yet."""
    width = recorded.bins.width
    steps = max(1, int(np.ceil(plan.fastest * width / (2 * np.pi) * _CELLS_PER_TURN)))
    bins = min(max(2, round(plan.duration / width)), _MOST_BINS)
    steps = min(steps, _MOST_CELLS // bins)
    run = imagined(plan, like, recorded.target, width / steps, bins * steps + 1, acceleration)
    reference = recorded.exposures[0].motion.reference_temperature
    exposure = expose(run, recorded.target, 1, reference, with_earth)
    used = np.ones(len(run), bool)
    if run.mounting.table_axis and recorded.target.startswith("accel"):
        used &= ~turning(run)
    gathered = gather((exposure,), (used,), (~used & False,), steps, 1)
    return Problem(recorded.target, recorded.unit, (exposure,), gathered, np.zeros(gathered.n))


def imagined(
    plan: FurtherRun, like: Recorded, target: str, dt: float, rows: int, acceleration: float = np.inf
) -> Recording:
    """The channels of a further run at ``rows`` times that are ``dt`` [s] apart; ``target`` is zero."""
    recording = like.recording
    mounting = replace(recording.mounting, base_turned=recording.mounting.base_turned + plan.base_turned)
    if plan.tilt is not None:
        mounting = replace(mounting, tilt=plan.tilt)
    temperature = plan.temperature or like.temperature
    table = Turntable(max_acceleration=acceleration, profile=(*plan.pieces, Piece(np.inf)))
    if temperature is not None:
        table = replace(table, temperature=temperature)
    t = dt * np.arange(rows + 1.0)
    scene, _ = table.advance(table.begin(), None, t, np.zeros((0, rows)))
    channels = {target: Channel(np.zeros(rows), recording.channels[target].unit, "interval")}
    for name, over in (("table_angle", "instant"), ("table_rate", "interval"), ("temperature", "instant")):
        if name in recording.channels:
            reference = scene.references[name]
            channels[name] = Channel(np.asarray(reference.values), reference.unit, over)  # type: ignore[arg-type]
    made = Recording(t[1:], channels, (), recording.site, mounting, "a further run")
    return replace(made, channels={**channels, **_others(plan, like, made, target)})


def _others(plan: FurtherRun, like: Recorded, run: Recording, target: str) -> dict[str, Channel]:
    """The other instruments of a further run."""
    found = {}
    gravity = run.site.gravity or STANDARD_GRAVITY
    for name, wave in like.waves.items():
        if name == target:
            continue
        channel = like.recording.channels[name]
        if not like.turns:
            t = np.mod(run.t, like.recording.t[-1] - like.recording.t[0])
            values = np.interp(t, like.recording.t - like.recording.t[0], channel.values)
        else:
            values = _columns(run) @ wave
            if plan.lean and name.startswith("accel"):
                level = np.sqrt(max(0.0, 1 - (wave[0] / gravity) ** 2))
                phase = np.arctan2(wave[2], wave[1])
                lean = np.array([0.0, np.cos(phase), np.sin(phase), 0.0])
                values = values + gravity * np.sin(plan.lean) * level * (_columns(run) @ lean)
        found[name] = Channel(values, channel.unit, "interval")
    return found


def _columns(recording: Recording) -> Floats:
    """1, cos a, sin a and the rate, shape (rows, 4); zero where there is no table."""
    columns = np.zeros((len(recording), 4))
    columns[:, 0] = 1.0
    if "table_angle" in recording.channels:
        angle = recording.channels["table_angle"].values
        # A mean over the row's interval, which of a table that was set has one angle.
        before = angle if is_set(recording) else np.concatenate([2 * angle[:1] - angle[1:2], angle[:-1]])
        columns[:, 1], columns[:, 2] = np.cos(0.5 * (angle + before)), np.sin(0.5 * (angle + before))
        columns[:, 3] = (angle - before) / recording.dt
    return columns


def _smooth_temperature(recording: Recording) -> Points | None:
    """The temperature of a run as straight lines between means."""
    if "temperature" not in recording.channels:
        return None
    parts = np.array_split(np.arange(len(recording)), min(_POINTS, len(recording)))
    t = recording.t - recording.t[0]
    values = recording.channels["temperature"].values
    return Points(tuple(float(t[p].mean()) for p in parts), tuple(float(values[p].mean()) for p in parts))
