"""What a manifest says, checked: frozen settings in SI units and radians."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from insenv.core.filing import Filing, hashed
from insenv.core.recording import Covers, Mounting, Origin, Site
from insenv.data.manifest.schema import DatasheetTable

Quantity = Literal["rate", "increment"]
Procedure = Literal["static", "rate-table", "multi-position"]
RowRanges = tuple[tuple[int, int], ...]

GYROS = ("gyro", "gyro_x", "gyro_y", "gyro_z")
ACCELEROMETERS = ("accel", "accel_x", "accel_y", "accel_z")
#: The PSINS log has fixed columns, so that its channels need not be listed.
PSINS_CHANNELS = (*GYROS[1:], *ACCELEROMETERS[1:])
#: Dimension of each channel that a manifest may name; of an increment: `INCREMENTS`.
CHANNELS: Mapping[str, str] = {
    "time": "time",
    **dict.fromkeys(GYROS, "rate"),
    **dict.fromkeys(ACCELEROMETERS, "acceleration"),
    "table_angle": "angle",
    "table_rate": "rate",
    **dict.fromkeys(("axis_1", "axis_2", "axis_3"), "angle"),
    "temperature": "temperature",
    "power": "number",
    "turning": "number",
    "sight_heading": "angle",
    "level_pitch": "angle",
    "level_roll": "angle",
    "segment": "label",
}
#: Channels without a unit.
BARE = ("power", "turning", "segment")
#: Readings that are there in some rows alone: an empty cell or NaN where there is none.
EVENTS = ("sight_heading", "level_pitch", "level_roll")
#: Dimension of the integral of a rate-type channel over a sampling period.
INCREMENTS: Mapping[str, str] = {"rate": "angle", "acceleration": "velocity"}


@dataclass(frozen=True)
class Source:
    """Where a recording comes from; ``url``, ``path`` and ``sha256`` have one entry per file, or none."""

    repository: str = ""
    commit: str = ""
    url: tuple[str, ...] = ()
    path: tuple[str, ...] = ()
    licence: str = ""
    sha256: tuple[str, ...] = ()


@dataclass(frozen=True)
class Reading:
    """What of a data file is not looked at.

    Attributes
    ----------
    skip : int
        Rows of data at its beginning.
    skip_lines : int
        Lines of a text file above its header.
    incomplete : bool
        Whether rows in which a wanted value is missing or no finite number are left out, instead of refused.
    lines : str
        The word with which a line of text begins that is a row, in a log of several kinds of lines; "": all are.
    """

    skip: int = 0
    skip_lines: int = 0
    incomplete: bool = False
    lines: str = ""


#: All of a file is read.
WHOLE = Reading()


@dataclass(frozen=True)
class RunSpec:
    """One data file = one run of the instrument.

    ``stated`` are channels that no file has and that are the same in all of its rows: name and value [SI].
    """

    file: Path
    format: str
    label: str
    mounting: Mounting
    site: Site
    reading: Reading = WHOLE
    stated: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class ChannelSpec:
    """Where a channel is in its file, and what it is.

    Attributes
    ----------
    column : str or int
        Name, or 0-based index; "row" of the time means the row's index, of the segments that each row is one.
    unit : str or None
        None: as the file's header says.
    quantity : "rate", "increment" or None
        None: as the file's format says, else a rate.
    covers : "instant", "interval" or None
        None: interval for an increment, else instant.
    delay : float
        Age of the value at the row's time [s].
    wrapped : bool
        Whether a table angle jumps at a full turn.
    rate : float or None
        Of the time channel without a column: sampling rate [Hz].
    offset : float
        What the file shows at zero input, in its own numbers: taken off before the unit.
    file : Path or None
        The channel's own data file, row by row beside the run's; None: the run's.
    format : str
        Format of that file.
    source : "encoder", "command", "set" or None
        Of a table's angle or rate; None: found out from the data.
    nanoseconds : str, int or None
        Of a time in two columns: that of the nanoseconds since its whole second.
    stated : bool
        Whether each run states its value, and no file has it.
    """

    column: str | int
    unit: str | None = None
    quantity: Quantity | None = None
    covers: Covers | None = None
    delay: float = 0.0
    wrapped: bool = False
    rate: float | None = None
    offset: float = 0.0
    file: Path | None = None
    format: str = ""
    source: Origin | None = None
    nanoseconds: str | int | None = None
    stated: bool = False


@dataclass(frozen=True)
class Model:
    """What is to be explained and what the declared model has; ``reference_temperature`` in kelvin.

    ``effects`` are those of other authors that are tried beside the catalogue.
    """

    targets: tuple[str, ...]
    declared: tuple[str, ...]
    reference_temperature: float = 298.15
    procedure: Procedure | None = None
    bias: Literal["common", "per-run"] | None = None
    effects: tuple[str, ...] = ()


@dataclass(frozen=True)
class HeldOut:
    """Data that no fit may see: one of the first four.

    Where none is given, the last 40 % of each run's time, or of the rows that fit.rows names.

    Attributes
    ----------
    runs : tuple of int
        Whole runs, counted from 1.
    start : float or None
        From so many seconds after each run's first row.
    rows : tuple of (int, int)
        Half-open ranges, 0-based, counted through all runs in order.
    positions : str, tuple of int or None
        "even" or "odd": every second rest of a multi-position recording; or rests, counted from 1 through all runs.
    averaging : float or None
        Length of the means that are scored [s].
    """

    runs: tuple[int, ...] = ()
    start: float | None = None
    rows: RowRanges = ()
    positions: str | tuple[int, ...] | None = None
    averaging: float | None = None

    @property
    def names_nothing(self) -> bool:
        """Whether it is left to the program what is held out."""
        return not self.runs and self.start is None and not self.rows and self.positions is None


@dataclass(frozen=True)
class KnownPositions:
    """What is stated of the rests of a triad.

    Attributes
    ----------
    up : tuple
        Attitudes in order, unit vectors in the triad's axes; empty where none are stated.
    tolerance : float
        Standard deviation of a stated attitude [rad].
    repeatability : float or None
        Standard deviation of an accelerometer's bias from rest to rest [m/s^2].
    """

    up: tuple[tuple[float, float, float], ...] = ()
    tolerance: float = 0.0087
    repeatability: float | None = None


@dataclass(frozen=True)
class Manifest:
    """A manifest, checked, in SI units.

    ``noise`` maps each target to its declared noise parameters; ``resample`` is the rate at which means of uneven rows
    are wanted [Hz], or None. ``datasheet`` is what `insenv.scenario.measured` reads, as written, ``report`` what the
    head of a page says.
    """

    path: Path
    title: str
    runs: tuple[RunSpec, ...]
    channels: Mapping[str, ChannelSpec]
    model: Model
    noise: Mapping[str, Mapping[str, float]]
    held_out: HeldOut = HeldOut()
    fit_rows: RowRanges = ()
    columns: int | None = None
    resample: float | None = None
    source: Source | None = None
    positions: KnownPositions | None = None
    datasheet: DatasheetTable | None = None
    report: Filing = Filing()

    @property
    def procedure(self) -> Procedure:
        """The declared procedure; else "rate-table" where a channel tells of a table, else "static"."""
        table = "table_angle" in self.channels or "table_rate" in self.channels
        return self.model.procedure or ("rate-table" if table else "static")

    def filing(self) -> Filing:
        """The head of a page, with the hash of every data file: each is read once more for it."""
        beside = [channel.file for channel in self.channels.values() if channel.file is not None]
        return replace(self.report, files=hashed((*(run.file for run in self.runs), *beside)))

    @property
    def time_is_row(self) -> bool:
        """Whether the recording's time is its row index, one row counted as one second."""
        return self._is_row("time")

    @property
    def timed(self) -> bool:
        """Whether rows have a time, and not their number alone."""
        spec = self.channels.get("time")
        return spec is None or spec.rate is not None or spec.column != "row"

    @property
    def segment_is_row(self) -> bool:
        """Whether each row is a segment: a table of positions, with the means of each."""
        return self._is_row("segment")

    def _is_row(self, name: str) -> bool:
        return name in self.channels and self.channels[name].column == "row"
