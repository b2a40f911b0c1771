"""Which column is which channel: by its heading, else by its numbers.

A file without headings is told apart by its numbers where these leave one reading: a column that runs forwards in even
steps is the time; of columns in threes, those of steady magnitude 9.8 or 1 are accelerometers, and those by which
gravity turns in them are gyros, in the order x, y, z. What is not told so is asked.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.units import STANDARD_GRAVITY
from insenv.data.guess import numbers
from insenv.data.guess.draft import Question, Sure
from insenv.data.guess.heading import Heading, kind_of, read_heading, unit_in
from insenv.data.guess.listing import Listed, Listing
from insenv.data.manifest.spec import CHANNELS
from insenv.data.readers.table import split_unit

AXES = ("x", "y", "z")
#: Attitudes in which a triad reads gravity that make it one of accelerometers, against the name of its file.
ATTITUDES = 3
#: No sampler is as fast [s].
SHORTEST = 5e-5
#: A name with a number behind it.
_COUNTED = re.compile(r"(.*?)[_ .-]?([012])")
#: Fields of a message of ROS, of which the unit is known whatever the stamps are.
_OF_MESSAGE = re.compile(r"(?:^|\.)(?:angular_velocity|linear_acceleration)\.[xyz]$")


@dataclass(frozen=True)
class Role:
    """A column with the channel that it is; of a time in two columns, ``beside`` it that of the nanoseconds."""

    column: Listed
    heading: Heading
    sure: Sure = "stated"
    beside: Listed | None = None


@dataclass(frozen=True)
class Roles:
    """Columns by channel, what is left out, and what must be asked of them."""

    by_channel: Mapping[str, Role]
    left_out: tuple[str, ...] = ()
    questions: tuple[Question, ...] = ()
    notes: tuple[str, ...] = ()

    def triad(self, kind: str) -> list[str]:
        """Channels x, y, z of a kind, if all three are there; else none."""
        names = [f"{kind}_{axis}" for axis in AXES]
        return names if all(name in self.by_channel for name in names) else []

    def of(self, kind: str) -> list[str]:
        """Channels of a kind: gyro, gyro_x, ..."""
        return [name for name in self.by_channel if name.split("_")[0] == kind]


def assign(listing: Listing, answers: Mapping[str, str]) -> Roles:
    """Channels of a file; ``answers`` may hold "columns" (headings for all) and "gyro.column" and the like.

    Raises
    ------
    InputError
        If an answer names a column that is not there.
    """
    columns = _headed(listing, answers)
    headings = [read_heading(c.heading, c.row_unit) for c in columns]
    headings = _counted(columns, _letters(columns, headings))
    known = _is_convention(columns)
    headings = [Heading("time", unit="s") if c.stamped else h for c, h in zip(columns, headings, strict=True)]
    named = [
        Role(c, _with_known_unit(c, h) if known or _OF_MESSAGE.search(c.heading) else h)
        for c, h in zip(columns, headings, strict=True)
    ]
    roles = _by_heading(_of_file(named, listing.file.stem)) if any(c.heading for c in columns) else _by_numbers(listing)
    return _with_question(_chosen(roles, columns, answers), listing, columns)


def _headed(listing: Listing, answers: Mapping[str, str]) -> tuple[Listed, ...]:
    """Columns with the headings that the user gave."""
    if "columns" not in answers:
        return listing.columns
    names = [name.strip() for name in answers["columns"].split(",")]
    if len(names) != len(listing.columns):
        found = f"{len(names)} names for {len(listing.columns)} columns"
        raise InputError(f"{listing.file}: columns: {found}; wanted one for each ('-': left out)")
    return tuple(replace(c, heading=name, row_unit=None) for c, name in zip(listing.columns, names, strict=True))


def _is_convention(columns: Sequence[Listed]) -> bool:
    """Whether headings are those of a tool whose units are known: its stamps run as they must, at 20 kHz or less."""
    stamps = [c for c in columns if c.known_unit in numbers.SECONDS]
    return bool(stamps) and all(
        numbers.clock(c.values).step * numbers.SECONDS[str(c.known_unit)] > SHORTEST for c in stamps
    )


def _of_file(named: Sequence[Role], stem: str) -> Sequence[Role]:
    """Columns that are headed by their axes alone are what the file's name says: Gyroscope.csv of a phone.

    A steady size that turns from axis to axis is gravity's, whatever the file is called.
    """
    kind = kind_of(re.sub("total", "", stem, flags=re.I))  # "total" is a column's magnitude, and no file's
    bare = [role.heading.kind == "" and bool(role.heading.axis) for role in named]
    three = [role.column for role, one in zip(named, bare, strict=True) if one]
    if kind == "gyro" and len(three) == len(AXES) and _feels_gravity(three):
        kind = "accel"
    if kind not in ("gyro", "accel") or any(role.heading.kind in ("gyro", "accel") for role in named):
        return named
    unit = [unit_in(r.heading.written, kind) if r.heading.written else r.heading.unit for r in named]
    return [
        replace(r, heading=replace(r.heading, kind=kind, unit=u)) if b else r
        for r, b, u in zip(named, bare, unit, strict=True)
    ]


def _with_known_unit(column: Listed, heading: Heading) -> Heading:
    """The heading with the unit that a format is known for (Kalibr, PX4)."""
    if column.known_unit is None or heading.kind == "other":
        return heading
    if heading.kind == "":
        heading = replace(heading, kind="accel" if column.known_unit == "m/s^2" else "")
    return replace(heading, unit=column.known_unit, written=None)


def _letters(columns: Sequence[Listed], headings: list[Heading]) -> list[Heading]:
    """Headings p, q, r are rates of turn where all three are there."""
    bare = [c.heading.split("[")[0].split("(")[0].strip().lower() for c in columns]
    if not {"p", "q", "r"} <= set(bare):
        return headings
    axis = dict(zip("pqr", AXES, strict=True))
    return [
        read_heading(f"gyro_{axis[b]}{c.heading[len(b) :]}", c.row_unit) if b in axis else h
        for c, b, h in zip(columns, bare, headings, strict=True)
    ]


def _counted(columns: Sequence[Listed], headings: list[Heading]) -> list[Heading]:
    """Gyros or accelerometers of one name that are counted 0, 1, 2 are x, y, z, as with an index in brackets."""
    found: dict[tuple[str, str], dict[str, int]] = {}
    for i, (column, heading) in enumerate(zip(columns, headings, strict=True)):
        match = _COUNTED.fullmatch(split_unit(column.heading)[0])
        if match and heading.kind in ("gyro", "accel") and not heading.axis:
            found.setdefault((heading.kind, match[1]), {})[match[2]] = i
    for places in found.values():
        if set(places) == {"0", "1", "2"}:
            for number, i in places.items():
                headings[i] = replace(headings[i], axis=AXES[int(number)])
    return headings


def _by_heading(named: Sequence[Role]) -> Roles:
    """Channels by what the headings say."""
    found: dict[str, list[Role]] = {}
    left: list[str] = []
    kinds = [role.heading.kind for role in named]
    for role in named:
        kind = role.heading.kind
        if kind == "rate":
            kind = "table_rate" if "gyro" in kinds else "gyro"
            role = replace(role, sure="assumed")
        if kind in ("gyro", "accel"):
            found.setdefault(f"{kind}_{role.heading.axis}" if role.heading.axis else kind, []).append(role)
        elif kind in ("time", "table", "table_rate", "table_angle", "temperature", "power"):
            found.setdefault(kind, []).append(role)
        else:
            left.append(role.column.heading or f"column {role.column.key}")
    if "time" in found:
        found["time"] = _joined(found["time"])
    else:
        found |= _time_by_unit(named, left)
    found = _alone(_sound(found, left))
    for kind in ("gyro", "accel"):
        if all(f"{kind}_{axis}" in found for axis in AXES) and kind in found:
            left += [role.column.heading for role in found.pop(kind)]  # beside a triad: its magnitude, a copy
    return _one_each(found, left)


def _time_by_unit(named: Sequence[Role], left: list[str]) -> dict[str, list[Role]]:
    """The one column with a unit of time that runs in even steps, whatever it is called (Zeit, tov, gps_tow)."""
    running = [
        (role, unit)
        for role in named
        if role.heading.kind in ("", "other")
        and (unit := unit_in(role.heading.written or "", "time"))
        and _runs(role.column)
    ]
    if len(running) != 1:
        return {}
    role, unit = running[0]
    left.remove(role.column.heading)
    return {"time": [replace(role, heading=Heading("time", unit=unit))]}


def _joined(times: list[Role]) -> list[Role]:
    """Columns of time, those of whole seconds with the nanoseconds beside them, as ROS writes a stamp, made one."""
    for whole, fine in permutations(times, 2):
        a, b = whole.column.values, fine.column.values
        parts = np.all(a == np.rint(a)) and np.all(b == np.rint(b)) and b.min() >= 0 and 1e8 < b.max() < 1e9
        both = a + 1e-9 * b
        if parts and np.any(np.diff(b) < 0) and np.mean(np.diff(both) > 0) > np.mean(np.diff(b) > 0):
            one = Role(replace(whole.column, values=both), Heading("time", unit="s"), "numbers", fine.column)
            return [one, *(role for role in times if role is not whole and role is not fine)]
    return times


def _sound(found: dict[str, list[Role]], left: list[str]) -> dict[str, list[Role]]:
    """Without columns whose numbers cannot be what the heading says: a time that does not run, watts for power-ups."""
    kept: dict[str, list[Role]] = {}
    for name, roles in found.items():
        sound = [r for r in roles if _is_sound(name, r)]
        left += [r.column.heading for r in roles if r not in sound]
        if sound:
            kept[name] = sound
    return kept


def _is_sound(name: str, role: Role) -> bool:
    values = role.column.values
    if name == "time":
        return numbers.clock(values).step > 0
    if name == "power":
        return bool(np.all(values >= 1) and np.all(values == np.rint(values)) and np.all(np.diff(values) >= 0))
    return True


def _alone(found: dict[str, list[Role]]) -> dict[str, list[Role]]:
    """A single gyro or accelerometer without its letter: which axis of what it is does not matter to a file of one."""
    for kind in ("gyro", "accel"):
        names = [name for name in found if name.split("_")[0] == kind]
        other = [name for name in found if name.split("_")[0] in ("gyro", "accel") and name not in names]
        if len(names) == 1 and not other and names[0] != kind:
            found[kind] = found.pop(names[0])
    return found


def _one_each(found: Mapping[str, Sequence[Role]], left: list[str]) -> Roles:
    """One column for each channel; a question where there are several."""
    roles: dict[str, Role] = {}
    questions: list[Question] = []
    for name, every in found.items():
        several = _of_all_force(every) if name.startswith("accel") else every
        several = _bare(several)
        left += [r.column.heading for r in every if r not in several]
        if len(several) == 1:
            roles[name] = several[0]
            continue
        headings = [r.column.heading for r in several]
        if name == "time" and (finest := _one_clock(several)) is not None:
            left += [r.column.heading for r in several if r is not finest]
            roles[name] = replace(finest, sure="assumed")
            continue
        if name in ("temperature", "power"):
            left += headings[1:]
            roles[name] = replace(several[0], sure="assumed")
            continue
        if len(set(headings)) < len(headings):
            headings = [_placed(r.column) for r in several]
        left += headings
        what = {"gyro": "a gyro", "accel": "an accelerometer"}.get(name, name.replace("_", " "))
        named = (h for h, r in zip(headings, several, strict=True) if r.heading.unit)
        hint = next(named, "") if name == "time" else ""
        text = f"Several columns read like {what}: {', '.join(headings)}. Which one?"
        questions.append(Question(f"{name}.column", text, hint, choices=(*headings, "-")))
    return Roles(roles, tuple(left), tuple(questions))


def _bare(several: Sequence[Role]) -> Sequence[Role]:
    """Of columns of one axis the one that its letter alone names, as PX4 writes it: not ``x_raw``, ``x_in[0]``."""
    bare = [role for role in several if role.column.heading.strip().lower() in AXES]
    return bare if len(bare) == 1 else several


def _of_all_force(several: Sequence[Role]) -> Sequence[Role]:
    """The readings of an accelerometer that hold gravity, where phones give those without it beside them."""
    whole = [role for role in several if "linear" not in role.column.heading.lower()]
    return whole or several


def _one_clock(several: Sequence[Role]) -> Role | None:
    """The finest of columns that show one clock, in other units from other zeros; None of several clocks."""
    finest = max(several, key=lambda r: (len(np.unique(r.column.values)), r.heading.unit is not None))
    t = finest.column.values - finest.column.values[0]
    for role in several:
        other = role.column.values - role.column.values[0]
        steps = np.diff(other)
        away = other - np.polyval(np.polyfit(t, other, 1), t)
        resolution = max(float(np.min(steps[steps > 0])), float(np.median(steps)))
        same_unit = role.heading.unit == finest.heading.unit is not None
        late = same_unit and abs(role.column.values[0] - finest.column.values[0]) > resolution
        if late or np.abs(away).max() > resolution:
            return None
    return finest


# ------------------------------------------------------------------------------------- without headings


def _by_numbers(listing: Listing) -> Roles:
    """Channels of columns without headings, where the numbers leave one reading."""
    columns = list(listing.columns)
    if _is_psins(columns):
        return Roles(_psins(columns), notes=("its seven columns are those of PSINS: increments in rad and m/s, time",))
    roles: dict[str, Role] = {}
    if columns and _runs(columns[0]):
        roles["time"] = Role(columns.pop(0), Heading("time"), "numbers")
    threes = [columns[i : i + 3] for i in range(0, len(columns), 3)] if len(columns) % 3 == 0 else []
    heavy = [three for three in threes if _is_gravity(three)]
    if len(heavy) == 1:
        roles |= _triad("accel", heavy[0])
        turned = [three for three in threes if three is not heavy[0] and _turns(three, heavy[0])]
        if len(turned) == 1:
            roles |= _triad("gyro", turned[0])
    used = [role.column for role in roles.values()]
    return Roles(roles, tuple(f"column {c.key}" for c in columns if c not in used))


def _is_psins(columns: Sequence[Listed]) -> bool:
    """Whether columns are a matrix of the PSINS toolbox: increments of gyros and accelerometers, time."""
    if len(columns) != 2 * len(AXES) + 1 or not _runs(columns[-1]):
        return False
    step = numbers.clock(columns[-1].values).step
    magnitude = numbers.gravity(_matrix(columns[3:6])) / step
    return abs(magnitude / STANDARD_GRAVITY - 1) < numbers.GRAVITY_TOLERANCE


def _psins(columns: Sequence[Listed]) -> dict[str, Role]:
    """Channels of such a matrix."""
    units = {"gyro": "rad", "accel": "m/s"}
    headings = [Heading(kind, axis, unit, increment=True) for kind, unit in units.items() for axis in AXES]
    named = {f"{h.kind}_{h.axis}": Role(c, h, "numbers") for c, h in zip(columns, headings, strict=False)}
    return {"time": Role(columns[-1], Heading("time", unit="s"), "numbers"), **named}


def _triad(kind: str, three: Sequence[Listed]) -> dict[str, Role]:
    return {f"{kind}_{a}": Role(c, Heading(kind, a), "numbers") for a, c in zip(AXES, three, strict=True)}


def _runs(column: Listed) -> bool:
    """Whether a column runs forwards all the time, in steps that are mostly even."""
    steps = np.diff(column.values)
    middle = float(np.median(steps)) if len(steps) else 0.0
    return middle > 0 and bool(np.mean(steps > 0) > 0.99) and bool(np.mean(np.abs(steps - middle) < 0.5 * middle) > 0.8)


def _matrix(three: Sequence[Listed]) -> Floats:
    return np.column_stack([c.values for c in three])


def _is_gravity(three: Sequence[Listed]) -> bool:
    """Whether a triad reads gravity: a steady magnitude that is 9.8, 1, or a count's."""
    force = _matrix(three)
    magnitude = np.linalg.norm(numbers.blocks(force, max(1, min(10, len(force) // 20))), axis=1)
    low, middle, high = np.quantile(magnitude, (0.2, 0.5, 0.8))
    whole = all(numbers.whole(c.values) for c in three)
    return bool(middle > 0 and high - low < 0.1 * middle and numbers.force_unit(float(middle), whole)[0])


def _feels_gravity(three: Sequence[Listed]) -> bool:
    """Whether a triad rests in several attitudes, as accelerometers do, and reads gravity in all: no bias does that."""
    return _is_gravity(three) and numbers.attitudes(_matrix(three)) >= ATTITUDES


def _turns(three: Sequence[Listed], heavy: Sequence[Listed]) -> bool:
    found = numbers.turning(_matrix(three), _matrix(heavy), 0.01)
    return found is not None and found.correlation > numbers.TURNED


# ---------------------------------------------------------------------------------------------- answers


def _placed(column: Listed) -> str:
    """A column of a heading that others have too, as a question calls it and an answer may."""
    return f"{column.heading} (column {column.key})"


def _chosen(roles: Roles, columns: Sequence[Listed], answers: Mapping[str, str]) -> Roles:
    """The roles with the columns that the user names for a channel, as "gyro.column" = "rate_1"."""
    by_channel = dict(roles.by_channel)
    questions = list(roles.questions)
    left = list(roles.left_out)
    for key, answer in answers.items():
        channel, _, what = key.rpartition(".")
        if what != "column" or channel not in CHANNELS:
            continue
        questions = [q for q in questions if q.key != key]
        if answer == "-":
            by_channel.pop(channel, None)
            continue
        match = [c for c in columns if answer in (c.heading, str(c.key), _placed(c))]
        if not match:
            there = ", ".join(c.heading or str(c.key) for c in columns)
            raise InputError(f"{key} = {answer!r}: no such column; there are {there}")
        heading = read_heading(match[0].heading, match[0].row_unit)
        kind, _, axis = channel.partition("_") if channel.startswith(("gyro_", "accel_")) else (channel, "", "")
        if heading.kind.split("_")[0] != kind.split("_")[0]:
            heading = read_heading(f"{channel} [{heading.written or heading.unit}]")
        by_channel[channel] = Role(match[0], replace(heading, kind=kind, axis=axis), "answered")
        left = [one for one in left if one != match[0].heading]
    return replace(roles, by_channel=by_channel, questions=tuple(questions), left_out=tuple(left))


def _with_question(roles: Roles, listing: Listing, columns: Sequence[Listed]) -> Roles:
    """The roles, with a question for the columns where no instrument was found, or some columns have no name."""
    names = [c.heading or str(c.key) for c in columns]
    bare = not any(c.heading for c in columns)
    found = roles.of("gyro") + roles.of("accel") + [q.key for q in roles.questions]
    if found and not (bare and roles.left_out):
        return roles
    told = {role.column.key: channel for channel, role in roles.by_channel.items()}
    known = [f"{told[c.key]}" if c.key in told else "?" for c in columns]
    if bare:
        text = (
            f"{listing.file.name} has no header line. Its {len(columns)} columns begin with {_row(columns)}. Name them "
            f"as a header would, '-' for what is not wanted, such as: {_example(len(columns))}"
        )
    else:
        text = (
            f"No heading of {', '.join(names)} says gyro or accelerometer. Name the columns as a header would, '-' for "
            f"what is not wanted, such as: {_example(len(columns))}"
        )
    hint = ",".join(known) if "?" not in known else ""
    return replace(roles, questions=(Question("columns", text, hint), *roles.questions))


def _row(columns: Sequence[Listed]) -> str:
    return ", ".join(f"{c.values[0]:.6g}" for c in columns[:10]) + (", ..." if len(columns) > 10 else "")


def _example(count: int) -> str:
    names = [
        "time [s]",
        "gyro_x [deg/s]",
        "gyro_y [deg/s]",
        "gyro_z [deg/s]",
        "accel_x [g]",
        "accel_y [g]",
        "accel_z [g]",
    ]
    if count in (3, 6):
        names = names[1:]
    if count == 1:
        names = ["gyro [deg/s]"]
    if count == 2:
        names = ["time [s]", "gyro [deg/s]"]
    return ",".join((names + ["-"] * count)[:count])
