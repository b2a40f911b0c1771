"""Layout of a scenario: which tables and keys there are, and of which type.

A scenario says what a plant does, which instruments it carries, which of their effects the manifest will
declare and which it will not. Every quantity is a text with its unit. Keys that depend on a ``kind`` are
checked in `insenv.scenario.plant`.
"""

from __future__ import annotations

from typing import Any, Literal

from msgspec import field

from insenv.data.manifest.schema import HeldOutTable, Names, SiteTable, TomlTable

#: Azimuth of a table that nobody set: uniform on the circle, another one in every run.
RANDOM = "random"


#: Units of the columns, where the scenario names none.
UNITS = {
    "time": "s",
    "rate": "deg/s",
    "angle": "deg",
    "acceleration": "m/s^2",
    "velocity": "m/s",
    "temperature": "degC",
}


class RippleTable(TomlTable):
    """``[table.ripple]``: relative amplitude of the rate and periods per turn."""

    fraction: str | float
    order: int = 1


class EncoderTable(TomlTable):
    """``[table.encoder]``: errors of the angle reading itself."""

    resolution: str | None = None
    noise: str | None = None
    eccentricity: str | None = None
    phase: str | None = None
    skew: str | None = None


class TurntableTable(TomlTable):
    """``[table]``: ``tilt`` of the input axis above its plane, ``azimuth`` at table angle 0, limits.

    ``azimuth`` may be "random" or "65 deg +- 10 deg"; ``level_error`` is a small rotation of the table about east and
    north. The recording has the encoder's ``logged_angle``, and as ``logged_rate`` that of the servo, the controller's
    command, which jumps, or the change of the encoder's reading.
    """

    tilt: str | None = None
    azimuth: str | None = None
    level_error: tuple[str, str] | None = None
    max_rate: str | None = None
    max_acceleration: str | None = None
    ripple: RippleTable | None = None
    encoder: EncoderTable = field(default_factory=EncoderTable)
    logged_rate: Literal["servo", "command", "encoder", "none"] = "servo"
    logged_angle: bool = True


class ProfileTable(TomlTable):
    """``[profile]``: what the table or the vehicle is commanded to do."""

    kind: Literal["constant", "staircase", "reversal", "sine", "rest", "steps", "turns"]
    rate: str | None = None
    rates: list[str] | None = None
    dwell: str | None = None
    cycles: int | None = None
    amplitude: str | None = None
    frequency: str | None = None
    steps: list[tuple[str, str]] | None = None
    turns: list[tuple[str, str]] | None = None


class DisturbanceTable(TomlTable):
    """``[base.disturbance]``: random tilt of the base."""

    sd: str
    time_constant: str


class BaseTable(TomlTable):
    """``[base]``: a base at rest with a triad of gyros and one of accelerometers, axes right-forward-up."""

    heading: str | None = None
    pitch: str | None = None
    roll: str | None = None
    disturbance: DisturbanceTable | None = None


class LineTable(TomlTable):
    """An entry of ``vehicle.sway.lines``."""

    frequency: str
    rms: str


class BandTable(TomlTable):
    """``vehicle.sway.band``: noise between two frequencies."""

    low: str
    high: str
    rms: str


class SwayTable(TomlTable):
    """``[vehicle.sway]``: about a level axis, ``arm`` below the instruments; phases differ from run to run."""

    arm: tuple[str, str, str] | None = None
    axis: str | None = None
    lines: list[LineTable] = field(default_factory=list)
    band: BandTable | None = None


class ResidualTable(TomlTable):
    """``vehicle.residual``: the velocity that a turn ends with, and how it fades."""

    velocity: str
    time_constant: str


class CreepTable(TomlTable):
    """``vehicle.creep``: the way that suspension and tyres creep after a turn."""

    distance: str
    time_constant: str


class VehicleTable(TomlTable):
    """``[vehicle]``: parked, turns on the spot, with a triad of gyros and one of accelerometers, right-forward-up.

    ``heading`` may be "random"; ``level_error`` is that of pitch and roll as they are told at the start.
    """

    heading: str | None = None
    pitch: str | None = None
    roll: str | None = None
    max_rate: str | None = None
    max_acceleration: str | None = None
    level_error: tuple[str, str] | None = None
    slope: str | None = None
    slope_towards: str | None = None
    deflection: tuple[str, str] | None = None
    lever_arm: tuple[str, str, str] | None = None
    sway: SwayTable | None = None
    residual: ResidualTable | None = None
    creep: CreepTable | None = None


class SightTable(TomlTable):
    """``[sight]`` of a vehicle: ``orientation``, or ``position_error`` and ``distance`` that it follows from."""

    installation: str
    orientation: str | None = None
    position_error: str | None = None
    distance: str | None = None
    tracking: str | None = None
    readings: Literal["start", "turns"] = "start"


class TemperatureTable(TomlTable):
    """``[temperature]`` of the instrument."""

    kind: Literal["constant", "ramp", "warm_up", "cycle", "points"]
    value: str | None = None
    start: str | None = None
    end: str | None = None
    slope: str | None = None
    rise: str | None = None
    time_constant: str | None = None
    levels: list[str] | None = None
    soak: str | None = None
    points: list[tuple[str, str]] | None = None


class OutputTable(TomlTable):
    """``[instrument.gyro]``, ``[instrument.accel]``: what is written, and the noise that the maker declares.

    ``pulses`` writes whole pulses of ``unit``, as a counter does. What is logged of a rate is ``gain`` times the
    output, renewed once in ``renewed`` from another phase in every file, and rounded to ``resolution``: no manifest
    says so.
    """

    quantity: Literal["rate", "increment"] = "rate"
    unit: str | None = None
    pulses: bool = False
    gain: float | None = None
    renewed: str | None = None
    resolution: str | None = None
    noise: dict[str, str] = field(default_factory=dict)


class InstrumentTable(TomlTable):
    """``[instrument]``; ``slow_noise`` is how often flicker and rate random walk change, each sample if left out."""

    sampling: str
    reference_temperature: str | None = None
    slow_noise: str | None = None
    gyro: OutputTable = field(default_factory=OutputTable)
    accel: OutputTable | None = None


class TaskTable(TomlTable):
    """``[task]``: what an environment asks for, in steps of ``step`` until ``duration`` has passed.

    ``kind`` is one of a system's (`insenv.core.system.TaskKind`), ``demanded`` the standard deviation that is wanted,
    ``cost`` the price of a second [nats], ``range`` the largest rate of the line that a rate table asks for.
    """

    kind: str
    demanded: str
    range: str | None = None
    step: str = "1 s"
    cost: float = 0.0


class FaultTable(TomlTable):
    """``design.fault``: a local fault, how plainly it must show in two dwells, and at which share of its places."""

    height: str
    width: str
    sigma: float = 7.0
    share: float = 0.99


class DesignTable(TomlTable):
    """``[design]``: what `insenv design` may choose, as [low, high], and what its procedures are told to face.

    ``rates``, ``reversals`` and ``tilt`` of a table, ``turns``, ``angles`` and ``rest`` of a vehicle, ``spacing``,
    ``dwell`` and ``visits`` of a rate test with the local ``fault`` that it must not miss. ``possible`` lists effects
    with their parameters; ``quantity`` is what is sought where a task has more than one.
    """

    rates: tuple[str, str] | None = None
    tilt: tuple[str, str] | None = None
    reversals: tuple[int, int] | None = None
    turns: tuple[int, int] | None = None
    angles: tuple[str, str] | None = None
    rest: tuple[str, str] | None = None
    spacing: tuple[str, str] | None = None
    dwell: tuple[str, str] | None = None
    visits: tuple[int, int] | None = None
    fault: FaultTable | None = None
    time: tuple[str, str] | None = None
    demanded: str | None = None
    quantity: str | None = None
    possible: list[dict[str, Any]] | None = None


class ScenarioModelTable(TomlTable):
    """``[model]``: the channels that the manifest wants explained."""

    target: Names | None = None


class FileTable(TomlTable):
    """``[output]``: ``decimals`` of a text file; ``truth`` writes what was simulated to a file of its own.

    ``files`` of one unit, each with a power-up of its own.
    """

    format: Literal["csv", "npz", "parquet"] = "csv"
    decimals: int = 9
    title: str | None = None
    truth: bool = False
    files: int = 1


class ScenarioTable(TomlTable):
    """The whole scenario; ``declared``, ``undeclared`` and ``run_to_run`` are checked against the catalogue.

    ``carriers`` are no table of a file: under their names, the tables of plants that a system brings.
    """

    instrument: InstrumentTable
    duration: str | None = None
    site: SiteTable = field(default_factory=SiteTable)
    table: TurntableTable | None = None
    profile: ProfileTable | None = None
    base: BaseTable | None = None
    vehicle: VehicleTable | None = None
    sight: SightTable | None = None
    carriers: dict[str, Any] = field(default_factory=dict)
    temperature: TemperatureTable | None = None
    task: TaskTable | None = None
    design: DesignTable | None = None
    model: ScenarioModelTable = field(default_factory=ScenarioModelTable)
    declared: dict[str, Any] = field(default_factory=dict)
    undeclared: dict[str, Any] = field(default_factory=dict)
    run_to_run: dict[str, Any] = field(default_factory=dict)
    held_out: HeldOutTable = field(default_factory=HeldOutTable)
    output: FileTable = field(default_factory=FileTable)


def family_name(target: str) -> str:
    """Which instrument a channel belongs to: "gyro" or "accel"."""
    return "accel" if target.startswith("accel") else "gyro"


def family(table: ScenarioTable, target: str) -> OutputTable:
    """The instrument that a channel belongs to."""
    return table.instrument.accel or OutputTable() if family_name(target) == "accel" else table.instrument.gyro
