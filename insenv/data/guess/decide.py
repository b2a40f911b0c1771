"""Files and answers -> the draft of a manifest: units, time, table, mounting and procedure, each decided or asked.

The decisions follow one another: the time gives the period, with which gravity tells the unit of gyros; a gyro's unit
and its table's settle each other. So a draft is made anew after every answer, and asks no more than it must.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.series.moving import LEAST_REST, TIPPED, TURNING, departs, longest_rest
from insenv.core.series.positions import (
    angles_are_points,
    of_untimed,
    rates_were_set,
    temperatures_were_set,
    were_set,
)
from insenv.core.units import DEG, quantity, scale_to_si
from insenv.data.guess import numbers, rates
from insenv.data.guess.columns import AXES, Role, Roles, assign
from insenv.data.guess.draft import DECLARED, Channel, Choice, Draft, Extra, Question
from insenv.data.guess.heading import is_unit, read_heading
from insenv.data.guess.listing import Listing
from insenv.data.guess.rates import Units
from insenv.data.sampling import UnevenError, sampling
from insenv.data.split import HELD_OUT_SHARE
from insenv.data.words import signed_columns

#: Attitudes in which a triad rested from which on the recording is one of several positions.
SEVERAL = 5
#: Axes of a triad of which one points up or down, so that the triad is right-handed.
AXES_BY_UP: Mapping[str, str] = {"+z": "RFU", "-z": "FRD", "+x": "URF", "-x": "DFR", "+y": "FUR", "-y": "RDF"}
#: No sampler is as fast [Hz]: a stated unit of time is doubted there.
FASTEST = 2e4
#: Steps of a sampler for which a unit of time is proposed [s]: rows of inertial instruments seldom come slower.
SLOWEST = 1.0
#: Share by which a stated rate may differ from that of the stamps.
SAME_RATE = 0.02
#: Rows at either end that are not looked at for the clock: there may be strays.
ENDS = 6
#: What is declared of accelerometers in several positions, and on a dividing head beside it.
_OF_ACCELEROMETERS = "accel_bias"
#: The scale factor of a gyro; that of an accelerometer has its name behind another word.
_SCALE = "scale_factor"
#: Procedures without a table.
PROCEDURES = ("static", "multi-position")
#: What is looked at for motion: readings, no increments.
DIMENSION_OF: Mapping[str, str] = {"gyro": "rate", "accel": "acceleration"}
_PSINS = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")


@dataclass
class _Said:
    """What was decided so far."""

    channels: list[Channel] = field(default_factory=list)
    questions: list[Question] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def draft(listings: Sequence[Listing], answers: Mapping[str, str]) -> Draft:
    """The draft of one manifest for files that are runs of one instrument.

    Parameters
    ----------
    listings : sequence of Listing
        A run each, all of the same columns.
    answers : mapping
        Question to its answer.

    Raises
    ------
    InputError
        If the files differ in their columns, or an answer is none to its question.
    """
    _check_alike(listings)
    listings, words = _with_words(listings)
    files = tuple(listing.file for listing in listings)
    if listings[0].format == "psins-imu":
        return _psins(files)
    longest = max(listings, key=lambda one: one.rows)
    roles = assign(longest, answers)
    notes = dict.fromkeys([*(n for one in listings for n in one.notes), *words, *roles.notes])
    said = _Said(questions=list(roles.questions), notes=list(notes))
    positions = _are_positions(roles, listings)
    period = _time(said, roles, longest, answers, positions)
    units = rates.decided(roles, period, answers)
    said.questions += units.questions
    said.notes += units.notes
    for name in roles.by_channel:
        if name.split("_")[0] in ("gyro", "accel"):
            said.channels.append(_instrument(roles, units, name))
    _table(said, roles, units)
    _others(said, roles, answers)
    if positions:
        said.channels.append(Channel("segment", "row", "", Choice("", "each row is a position", "numbers")))
    procedure = _procedure(roles, listings, positions)
    motion = _motion(listings, said.channels, period) if procedure.value == "static" else _Motion()
    if procedure.value == "static" and not any(q.key.startswith("table") for q in said.questions):
        procedure = _at_rest(said, procedure, motion, answers)
    resample = _resample(listings, said.channels[0], roles)
    mounting = dict(units.mounting)
    if procedure.value == "static" and "axes" not in mounting:
        _axes(mounting, roles, units)
    targets, declared = _model(roles, procedure.value or "static")
    return Draft(
        files=files,
        format=longest.format,
        rows=sum(one.rows for one in listings),
        channels=tuple(said.channels),
        questions=tuple(said.questions),
        targets=targets,
        declared=declared,
        procedure=procedure,
        mounting=mounting,
        read=_reading(listings),
        resample=resample,
        rest=motion.rest if procedure.value == "static" and resample is None else None,
        left_out=(*roles.left_out, *_unused(roles, said.channels[0])),
        notes=tuple(said.notes),
    )


def _with_words(listings: Sequence[Listing]) -> tuple[Sequence[Listing], list[str]]:
    """The files with words that were read without their sign mended, as they will be read, and what is said of them."""
    mended, said = [], []
    for one in listings:
        values, words = signed_columns({str(c.key): c.values for c in one.columns})
        mended.append(replace(one, columns=tuple(replace(c, values=values[str(c.key)]) for c in one.columns)))
        said += [f"{one.file.name}: {words}"] if words else []
    return mended, said


def _check_alike(listings: Sequence[Listing]) -> None:
    first = listings[0]
    for other in listings[1:]:
        same = [(c.key, c.heading) for c in other.columns] == [(c.key, c.heading) for c in first.columns]
        if not same or other.format != first.format:
            raise InputError(f"{other.file}: its columns are not those of {first.file.name}; wanted runs of one kind")


def _psins(files: tuple[Path, ...]) -> Draft:
    """A log of PSINS says everything itself."""
    channels = tuple(
        Channel(name, name, name, Choice("", "the log's header", "stated"), {"quantity": "increment"})
        for name in _PSINS
    )
    return Draft(files, "psins-imu", 0, channels, targets=_PSINS, notes=("units, time and site: the log's header",))


# ----------------------------------------------------------------------------------------------------- time


def _time(said: _Said, roles: Roles, listing: Listing, answers: Mapping[str, str], positions: bool) -> float | None:
    """The channel time; the period of the rows [s], where it is known: ``positions`` need none."""
    role = roles.by_channel.get("time")
    if positions and "time.rate" not in answers and (role is None or not (role.heading.unit or "time.unit" in answers)):
        said.channels.append(Channel("time", "row", "", Choice("", "positions in their order", "assumed")))
        return None
    if role is None:
        return _rate(said, roles, listing, answers)
    clock = numbers.clock(role.column.values)
    heading, column = role.column.heading, role.column.key
    stated = role.heading.unit
    if stated is None and "time.unit" not in answers and (unit := _unit_at(listing.rate, clock.step)):
        choice = Choice(unit, f"steps of {clock.step:.6g}; {listing.rate:g} Hz above the header", "stated")
    else:
        choice = _time_unit(said, stated, clock, answers, heading or f"column {column}", listing.rate is None)
    extra: Extra = {} if role.beside is None else {"nanoseconds": role.beside.key}
    said.channels.append(Channel("time", column, heading, choice, extra))
    if choice.value is None:
        return None
    return scale_to_si(choice.value, "time", "time.unit")[0] * clock.step


def _unused(roles: Roles, time: Channel) -> tuple[str, ...]:
    """A column of time that positions do without."""
    there = "time" in roles.by_channel and time.column == "row"
    return (str(roles.by_channel["time"].column.heading),) if there else ()


def _rate(said: _Said, roles: Roles, listing: Listing, answers: Mapping[str, str]) -> float | None:
    """A time that is known by its rate, or asked."""
    if answers.get("time.rate") == "row":
        said.channels.append(Channel("time", "row", "", Choice("", "a row counts as a second", "answered")))
        return 1.0
    if "time.rate" in answers:
        rate = quantity(answers["time.rate"], "frequency", "time.rate")
        said.channels.append(Channel("time", None, "", Choice(answers["time.rate"], "your answer", "answered")))
        return 1.0 / rate if rate > 0 else None
    if listing.rate is not None:
        choice = Choice(f"{listing.rate:g} Hz", "a line above the header", "stated")
        said.channels.append(Channel("time", None, "", choice))
        return 1.0 / listing.rate
    if any(question.key == "time.column" for question in said.questions):
        said.channels.append(Channel("time", None, "", Choice(None, "several columns of time", "open")))
        return None
    if points := _points(roles):
        said.channels.append(Channel("time", "row", "", Choice("", f"{points} each, in their order", "assumed")))
        return None
    text = f"{_no_time(listing)}. At which rate were the rows taken? ('row': a row counts as a second)"
    said.questions.append(Question("time.rate", text, "", ("frequency",), ("row",), quantity=True))
    said.channels.append(Channel("time", None, "", Choice(None, "no column of time", "open")))
    return None


def _points(roles: Roles) -> str:
    """What rows without a time are points of, with nothing recorded between; "" where they are none."""
    there = {name: role.column.values for name, role in roles.by_channel.items()}
    t = of_untimed(max(map(len, there.values()), default=0))
    if "table_rate" in there and rates_were_set(t, there["table_rate"]):
        return "points at one rate"
    if _at_angles(roles):
        return "points at one angle"
    if not _of_table(roles) and "temperature" in there and temperatures_were_set(t, there["temperature"]):
        return "points at one temperature"
    return ""


def _at_angles(roles: Roles) -> bool:
    """Whether a table was set to another angle from row to row [deg], and no rate of it is there."""
    role = roles.by_channel.get("table_angle")
    if role is None or "table_rate" in roles.by_channel:
        return False
    angle = role.column.values * (1.0 if role.heading.unit == "rad" else DEG)
    t = of_untimed(len(angle))
    return angles_are_points(t, angle) and were_set(t, angle)


def _no_time(listing: Listing) -> str:
    """Why no column is a time: there is none, or that which is called so stands still in most rows."""
    for column in listing.columns:
        steps = np.diff(column.values)
        if read_heading(column.heading).kind != "time" or not len(steps):
            continue
        if not np.any(steps > 0):
            return f"{column.heading} {'runs backwards' if np.any(steps < 0) else 'stands still'}"
        if np.all(steps >= 0):
            share = 100 * float(np.mean(steps == 0))
            return f"{column.heading} has the stamp of the row before in {share:.0f} % of the rows, as packets give it"
    for label in listing.labels:
        if read_heading(label).kind == "time":
            return f"{label} holds texts that are no date or time of day of a known form"
    return "No column is a time that runs forwards"


def _time_unit(
    said: _Said, stated: str | None, clock: numbers.Clock, answers: Mapping[str, str], heading: str, may_hint: bool
) -> Choice:
    """The unit of the stamps."""
    if "time.unit" in answers:
        scale_to_si(answers["time.unit"], "time", "time.unit")
        return Choice(answers["time.unit"], "your answer", "answered")
    step = f"steps of {clock.step:.6g}"
    if stated is not None and clock.step * scale_to_si(stated, "time", "time.unit")[0] * FASTEST > 1:
        return Choice(stated, f"the heading; {step}", "stated")
    if stated is None and clock.unit:
        return Choice(clock.unit, step, "numbers")
    may = [u for u in ("ms", "us", "s", "ns") if u in clock.others and may_hint]
    fast = (u for u in may if clock.step * scale_to_si(u, "time", "time.unit")[0] <= SLOWEST)
    hint = next(fast, next(iter(may), ""))
    why = f"The heading says {stated}, which {step} make too fast" if stated else f"{heading} runs in {step}"
    shown = ", ".join(f"{u}: {_hertz(clock.step, u)}" for u in clock.others)
    said.questions.append(Question("time.unit", f"{why}. In which unit? ({shown})", hint, ("time",)))
    return Choice(None, step, "open")


def _unit_at(rate: float | None, step: float) -> str:
    """The unit in which rows of a stated rate [Hz] are so many steps apart; "" for none that clocks have."""
    sizes = {**numbers.SECONDS, "0.1 ms": 1e-4, "10 us": 1e-5, "0.1 us": 1e-7}
    return next((u for u, size in sizes.items() if rate and abs(step * size * rate - 1) < SAME_RATE), "")


def _hertz(step: float, unit: str) -> str:
    return f"{1 / (step * numbers.SECONDS[unit]):.4g} Hz"


def _resample(listings: Sequence[Listing], time: Channel, roles: Roles) -> str | None:
    """A rate of means where rows follow no clock, as `insenv close-loop` would propose it."""
    if time.unit.value in (None, "") or "time" not in roles.by_channel:
        return None
    factor = scale_to_si(time.unit.value, "time", "time.unit")[0]
    found: list[float] = []
    even: list[float] = []
    for listing in listings:
        stamps = next(c.values for c in listing.columns if c.key == time.column)[ENDS:-ENDS] * factor
        try:
            even.append(0.5 / float(np.median(np.diff(sampling(listing.file, stamps, str, None).t))))
        except UnevenError as error:
            found.append(error.rate)
        except (InputError, ValueError, ZeroDivisionError):
            continue  # what is wrong with the time is told by the readers
    if not found:
        return None
    rate = min([*found, *even])
    nice = 10.0 ** np.floor(np.log10(rate))
    return f"{nice * max(m for m in (1, 2, 5) if m * nice <= rate * (1 + 1e-9)):g} Hz"


# ------------------------------------------------------------------------------------------------- channels


def _instrument(roles: Roles, units: Units, name: str) -> Channel:
    """A gyro or an accelerometer."""
    kind = name.split("_")[0]
    role, choice = roles.by_channel[name], units.by_name.get(name) or units.by_kind[kind]
    extra: dict[str, str | bool | float] = {}
    dimension = {"gyro": "angle", "accel": "velocity"}[kind]
    if role.heading.increment or (choice.value is not None and is_unit(choice.value, dimension)):
        extra["quantity"] = "increment"
    elif kind == "gyro" and units.covers:
        extra["covers"] = units.covers
    if kind in units.offsets:
        extra["offset"] = units.offsets[kind]
    return Channel(name, role.column.key, role.column.heading, choice, extra)


def _table(said: _Said, roles: Roles, units: Units) -> None:
    """The table's rate and angle."""
    for name in ("table_rate", "table_angle"):
        if name not in units.table:
            continue
        role, choice, wrapped = units.table[name]
        extra: dict[str, str | bool | float] = {"wrapped": True} if wrapped else {}
        if name == "table_rate" and units.covers:
            extra["covers"] = units.covers
        said.channels.append(Channel(name, role.column.key, role.column.heading, choice, extra))


def _others(said: _Said, roles: Roles, answers: Mapping[str, str]) -> None:
    """Temperature and power-ups."""
    if "temperature" in roles.by_channel and answers.get("temperature.unit") != "-":
        role = roles.by_channel["temperature"]
        choice = _temperature(role, answers)
        if choice.value is None:
            text = f"In which unit is {role.column.heading} (it reads {np.median(role.column.values):.4g})?"
            text += " Wanted: degC, K, degF, or '-', which leaves it out."
            said.questions.append(Question("temperature.unit", text, "", ("temperature",), ("-",)))
        said.channels.append(Channel("temperature", role.column.key, role.column.heading, choice))
    if "power" in roles.by_channel:
        role = roles.by_channel["power"]
        said.channels.append(
            Channel("power", role.column.key, role.column.heading, Choice("", "whole, never falling", "assumed"))
        )


def _temperature(role: Role, answers: Mapping[str, str]) -> Choice:
    """The unit of a temperature; counts of a chip, and what stands in brackets and is no unit, are asked."""
    stated, values = role.heading.unit, role.column.values
    if "temperature.unit" in answers:
        scale_to_si(answers["temperature.unit"], "temperature", "temperature.unit")
        return Choice(answers["temperature.unit"], "your answer", "answered")
    low, middle, high = float(values.min()), float(np.median(values)), float(values.max())
    reads = f"it reads {middle:.4g}"
    if stated is not None:
        return Choice(stated, "the heading", "stated")
    if role.heading.written:
        return Choice(None, f"the heading says {role.heading.written}", "open")
    if low > 200 and high < 420 and np.any(values != np.rint(values)):
        return Choice("K", reads, "numbers")
    # Sensors give degC; degF would be written beside it.
    return (
        Choice("degC", f"{reads}; no unit in the file", "assumed")
        if low > -70 and high < 150
        else Choice(None, reads, "open")
    )


# ---------------------------------------------------------------------------------------------------- model


def _procedure(roles: Roles, listings: Sequence[Listing], positions: bool) -> Choice:
    """Table, several positions or static."""
    if _of_table(roles):
        return Choice("rate-table", "a column of the table", "stated")
    if positions:
        return Choice("multi-position", "neighbouring rows read gravity from elsewhere", "numbers")
    force = _force(roles, listings)
    if force is None:
        return Choice("static", "no table, no accelerometers that tell of attitudes", "assumed")
    count = numbers.attitudes(np.concatenate(force))
    if count >= SEVERAL:
        return Choice("multi-position", f"rests in {count} attitudes", "numbers")
    return Choice("static", "no table; rests in few attitudes", "numbers")


@dataclass(frozen=True)
class _Motion:
    """What moves too much to be taken for a unit at rest, "" for nothing, and the rows of its longest rest."""

    said: str = ""
    rest: tuple[int, int] | None = None


def _motion(listings: Sequence[Listing], channels: Sequence[Channel], period: float | None) -> _Motion:
    """Whether a channel moves in so many rows, of those that would be fitted or held out, that the loop refuses it.

    A gyro may stand still about its own axis; an accelerometer feels every turn.
    """
    if period is None:
        return _Motion()
    runs: dict[str, list[Floats]] = {}
    for channel in channels:
        kind = channel.name.split("_")[0]
        if kind in DIMENSION_OF and is_unit(channel.unit.value or "", DIMENSION_OF[kind]):
            factor = scale_to_si(str(channel.unit.value), DIMENSION_OF[kind], "unit")[0]
            runs[channel.name] = [factor * c.values for one in listings for c in one.columns if c.key == channel.column]
    own = {name: [departs(run, period, _limit(name)) for run in every] for name, every in runs.items()}
    whole = [np.any(masks, axis=0) for masks in zip(*own.values(), strict=True)]
    moving = {name: whole if name.startswith("accel") else masks for name, masks in own.items()}
    worst = max(moving, key=lambda name: _most_of_a_part(moving[name]), default="")
    if not worst or _most_of_a_part(moving[worst]) <= 1.0 - LEAST_REST:
        return _Motion()
    most = max(float(np.abs(run - np.median(run)).max()) for run in runs[worst])
    size = f"{most:.3g} m/s^2" if worst.startswith("accel") else f"{most / DEG:.3g} deg/s"
    said = f"{worst} moves in {100 * float(np.mean(np.concatenate(moving[worst]))):.0f} % of its rows, by up to {size}"
    if len(listings) > 1 or listings[0].incomplete:
        return _Motion(said)
    gyros, accels = ([one[0] for name, one in runs.items() if name.startswith(kind)] for kind in ("gyro", "accel"))
    return _Motion(said, longest_rest(gyros, accels, period))


def _limit(name: str) -> float:
    return TIPPED if name.startswith("accel") else TURNING


def _most_of_a_part(moving: Sequence[NDArray[np.bool_]]) -> float:
    """The larger share of rows that move, of those that are fitted and those that are held out by default."""
    parts = [np.split(mask, [int((1 - HELD_OUT_SHARE) * len(mask))]) for mask in moving]
    return max(float(np.mean(np.concatenate(part))) for part in zip(*parts, strict=True))


def _at_rest(said: _Said, static: Choice, motion: _Motion, answers: Mapping[str, str]) -> Choice:
    """A unit without a table that moves most of the time is not at rest: what its errors are judged by is asked."""
    if answers.get("procedure") in PROCEDURES:
        return Choice(answers["procedure"], "your answer", "answered")
    if not motion.said:
        return static
    rest = "these rows under [fit] as rows = [[from, to]]"
    if motion.rest is not None:
        rest = f"the longest rest, [fit] rows = [[{motion.rest[0]}, {motion.rest[1]}]], alone"
    text = (
        f"{motion.said}, and no column is a table's: nothing tells its errors from the motion. Was it held still in "
        f"many attitudes (multi-position), or at rest in some rows (static, with {rest})? Beside another instrument or "
        "an attitude, name that in a column: table_rate or table_angle"
    )
    said.questions.append(Question("procedure", text, "", choices=PROCEDURES))
    return Choice(None, motion.said, "open")


def _of_table(roles: Roles) -> bool:
    return bool({"table", "table_rate", "table_angle"} & set(roles.by_channel))


def _force(roles: Roles, listings: Sequence[Listing]) -> list[Floats] | None:
    """The accelerometers of each file, shape (n, 3), in the file's unit; None where they are no triad of readings."""
    names = roles.triad("accel")
    if not names or any(roles.by_channel[name].heading.increment for name in names):
        return None
    keys = [roles.by_channel[name].column.key for name in names]
    return [np.column_stack([c.values for k in keys for c in one.columns if c.key == k]) for one in listings]


def _are_positions(roles: Roles, listings: Sequence[Listing]) -> bool:
    """Whether the files are tables of positions, with the means of each in a row."""
    force = None if _of_table(roles) else _force(roles, listings)
    return force is not None and all(map(numbers.are_positions, force))


def _axes(mounting: dict[str, Choice], roles: Roles, units: Units) -> None:
    """Where the axes of a resting triad point, as gravity says; not one whose readings are none of gravity's."""
    names, unit = roles.triad("accel"), units.by_kind.get("accel")
    if not names or unit is None or unit.value is None or not is_unit(unit.value, "acceleration"):
        return
    force = np.column_stack([roles.by_channel[name].column.values for name in names])
    if not numbers.force_fits(numbers.gravity(force), scale_to_si(unit.value, "acceleration", "accel.unit")[0]):
        return
    up = numbers.up(force)
    if up not in ("", "+z"):
        which = f"{'minus ' if up[0] == '-' else ''}{up[1]} points up, as gravity says"
        mounting["axes"] = Choice(AXES_BY_UP[up], which, "numbers")


def _model(roles: Roles, procedure: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Targets and declared effects: a bias each, with a table the scale factor."""
    gyros, accels = sorted(roles.of("gyro")), sorted(roles.of("accel"))
    if procedure == "multi-position":
        gyros = gyros if len(gyros) == len(AXES) and "gyro" not in gyros else []
        return (*accels, *gyros), (_OF_ACCELEROMETERS, *DECLARED) if gyros else (_OF_ACCELEROMETERS,)
    if procedure == "rate-table" and _at_angles(roles):  # which tell no scale factor of a gyro
        return (tuple(gyros), DECLARED) if gyros else (tuple(accels), (_OF_ACCELEROMETERS, f"accel_{_SCALE}"))
    if procedure == "rate-table" and gyros:
        return tuple(gyros), (*DECLARED, _SCALE)
    return (*gyros, *accels), DECLARED


def _reading(listings: Sequence[Listing]) -> dict[str, str | int]:
    """Keys of ``[read]``."""
    found: dict[str, str | int] = {}
    if skip := max(one.skip_lines for one in listings):
        found["skip_lines"] = skip
    if any(one.incomplete for one in listings):
        found["incomplete"] = "leave out"
    if lines := next((one.lines for one in listings if one.lines), ""):
        found["lines"] = lines
    return found
