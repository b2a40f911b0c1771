"""Units of gyros, accelerometers and tables, and how they are mounted: stated, told by the numbers, or asked.

A stated unit is held against the numbers: gravity must be 9.8 m/s^2 and turn as the gyros say, and a gyro must follow
its table with a gain near one. Where they contradict it and speak for another unit, it is asked.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.units import quantity, scale_to_si
from insenv.data.guess import numbers
from insenv.data.guess.columns import Role, Roles
from insenv.data.guess.draft import Choice, Question
from insenv.data.guess.heading import is_unit

#: A gain so near to one needs no word about the mounting.
ALONG = 0.03
#: Words for raw counts.
COUNTS = "raw counts"
#: Period of the rows where it is open [s]: within a factor of ten of those that are turned by hand.
ANY_PERIOD = 0.01
#: Zero of raw counts of 16 bits without a sign.
UNSIGNED = 32768


@dataclass
class Units:
    """Units by kind ("gyro", "accel"), offsets of raw counts, the table's columns, the mounting, and what is open.

    ``by_name`` are units of headings that differ within a kind: each column has its own.

    ``covers`` is "interval" where a gyro and its table's rate are means over their rows' intervals.
    """

    by_kind: dict[str, Choice] = field(default_factory=dict)
    by_name: dict[str, Choice] = field(default_factory=dict)
    offsets: dict[str, float | str] = field(default_factory=dict)
    table: dict[str, tuple[Role, Choice, bool]] = field(default_factory=dict)
    mounting: dict[str, Choice] = field(default_factory=dict)
    covers: str = ""
    questions: list[Question] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def decided(roles: Roles, period: float | None, answers: Mapping[str, str]) -> Units:
    """Units of what measures and of the table; ``period`` of the rows [s], where it is known."""
    units = Units()
    for kind in ("accel", "gyro"):
        if roles.of(kind):
            _offset(units, roles, kind, answers)
            _each_its_own(units, roles, kind, answers)
    if roles.of("accel") and "accel" not in units.by_kind:
        _force(units, roles, answers)
    table = _table_role(units, roles, period, answers)
    if roles.of("gyro") and "gyro" not in units.by_kind:
        _gyro(units, roles, period, table, answers)
    if table is not None:
        _table_unit(units, roles, period, table, answers)
        _mounting(units, roles, period, table, answers)
        _covers(units, roles, period, table)
    return units


def _covers(units: Units, roles: Roles, period: float | None, table: tuple[str, Role]) -> None:
    """Whether gyro and command are means over their rows' intervals: a command that jumps tells."""
    name, gain = _gain(roles, period, table)
    if table[0] != "table_rate" or gain is None:
        return
    if numbers.jumps_at_once(roles.by_channel[name].column.values, table[1].column.values, gain):
        units.covers = "interval"
        units.notes.append("the gyro jumps with the command within a row: both hold for the interval that ends there")


def _matrix(roles: Roles, names: list[str]) -> Floats:
    return np.column_stack([roles.by_channel[name].column.values for name in names])


def _stated(roles: Roles, kind: str) -> tuple[str | None, str | None, bool]:
    """Unit of the headings, what else stands there, and whether they speak of increments."""
    headings = [roles.by_channel[name].heading for name in roles.of(kind)]
    found = {h.unit for h in headings}
    unit = found.pop() if len(found) == 1 else None
    return unit, next((h.written for h in headings if h.written), None), any(h.increment for h in headings)


def _each_its_own(units: Units, roles: Roles, kind: str, answers: Mapping[str, str]) -> None:
    """Columns of a kind whose headings state different units keep them; one question for those that state none."""
    stated = {name: roles.by_channel[name].heading.unit for name in roles.of(kind)}
    if f"{kind}.unit" in answers or len({unit for unit in stated.values() if unit}) < 2:
        return
    units.by_name = {
        **units.by_name,
        **{name: Choice(unit, "the heading", "stated") for name, unit in stated.items() if unit},
    }
    if all(stated.values()):
        units.by_kind[kind] = Choice(None, "the headings, each its own", "stated")


def _answered(answers: Mapping[str, str], key: str, dimensions: tuple[str, ...]) -> Choice | None:
    """The answer to a question of a unit, if there is one.

    Raises
    ------
    InputError
        If it is no such unit.
    """
    if key not in answers:
        return None
    answer = answers[key].strip()
    if not any(is_unit(answer, d) for d in dimensions):
        scale_to_si(answer, dimensions[0], key)
    return Choice(answer, "your answer", "answered")


def _offset(units: Units, roles: Roles, kind: str, answers: Mapping[str, str]) -> None:
    """What raw counts without a sign read at zero input."""
    key, names = f"{kind}.offset", roles.of(kind)
    if key in answers:
        try:
            units.offsets[kind] = float(answers[key])
        except ValueError:
            raise InputError(f"{key} = {answers[key]!r}; wanted a number") from None
        return
    values = _matrix(roles, names)
    middle = np.median(values, axis=0)
    unsigned = bool(np.all(values >= 0) and np.all(values <= 2 * UNSIGNED) and values.min() > 1000)
    if unsigned and all(map(numbers.whole, values.T)) and np.all(np.abs(middle / UNSIGNED - 1) < 0.3):
        text = f"{_words(kind)} are whole numbers about {middle.mean():.5g}. What do they read at zero input?"
        units.offsets[kind] = "?"
        units.questions.append(Question(key, text, str(UNSIGNED), choices=(str(UNSIGNED), "0")))


def _words(kind: str) -> str:
    return "The accelerometers" if kind == "accel" else "The gyros"


# -------------------------------------------------------------------------------------------- accelerometers


def _force(units: Units, roles: Roles, answers: Mapping[str, str]) -> None:
    """The unit of the accelerometers: gravity tells it, where all three are there."""
    stated, written, increment = _stated(roles, "accel")
    dimensions = ("velocity",) if increment else ("acceleration", "velocity")
    if (choice := _answered(answers, "accel.unit", dimensions)) is not None:
        units.by_kind["accel"] = choice
        return
    names = roles.triad("accel")
    told, sure, reads = "", False, ""
    if names and not increment and "accel" not in units.offsets:
        values = _matrix(roles, names)
        size = numbers.gravity(values)
        told, sure = numbers.force_unit(size, all(map(numbers.whole, values.T)) and size > 100)
        reads = f"gravity reads {size:.4g}"
        if stated is not None and not is_unit(stated, "velocity"):
            factor = scale_to_si(stated, "acceleration", "accel.unit")[0]
            doubtful = not numbers.force_fits(size, factor)
            if doubtful and not told:
                units.notes.append(f"{reads} {stated}, {_less_gravity(roles, names)}")
            stated = None if doubtful and told else stated
            written = written if stated or not doubtful else "another unit"
    if stated is not None:
        units.by_kind["accel"] = Choice(stated, f"the heading{f'; {reads}' if reads else ''}", "stated")
    elif told and sure and not written:
        units.by_kind["accel"] = Choice(told, reads, "numbers")
    else:
        _ask(units, "accel", reads, _decimal(told), written, dimensions)


def _less_gravity(roles: Roles, names: Sequence[str]) -> str:
    """Why accelerometers do not read gravity: a program took it out, as their headings say, or the range is wrong."""
    words = " ".join(roles.by_channel[name].column.heading.lower() for name in names)
    if any(word in words for word in ("linear", "user", "without g")):
        return "for a program has taken gravity out: what a bias is of, is what it left, not the accelerometers"
    return "where 9.8 m/s^2 were expected: is the range set right?"


def _ask(units: Units, kind: str, reads: str, hint: str, written: str | None, dimensions: tuple[str, ...]) -> None:
    """A question for the unit of a kind."""
    who = {"accel": "an accelerometer", "gyro": "a gyro"}[kind]
    said = f" (the heading says {written})" if written else ""
    facts = f" {reads[0].upper()}{reads[1:]}." if reads else ""
    example = {
        "accel": "m/s^2, g; of raw counts one's size, as 0.000061 g",
        "gyro": "deg/s, rad/s; of raw counts one's size",
    }
    step = {"accel": "m/s, where a row holds an increment", "gyro": "deg, where a row holds an increment"}
    wanted = f"{example[kind]}; {step[kind]}" if len(dimensions) > 1 else step[kind].partition(",")[0]
    text = f"In which unit does {who} read{said}?{facts} Wanted: {wanted}."
    units.questions.append(Question(f"{kind}.unit", text, hint, dimensions))
    why = reads or (f"the heading says {written}" if written else "no unit in the heading")
    units.by_kind[kind] = Choice(None, why, "open")


def _decimal(unit: str) -> str:
    """A unit with a decimal for a fraction: "1/131 deg/s" as a manifest reads it."""
    number, _, rest = unit.partition(" ")
    if not rest or "/" not in number:
        return unit if not rest or number[:1].isdigit() else f"1 {unit}"
    above, _, below = number.partition("/")
    return f"{float(above) / float(below):.8g} {rest}"


# ----------------------------------------------------------------------------------------------------- gyros


def _gyro(
    units: Units, roles: Roles, period: float | None, table: tuple[str, Role] | None, answers: Mapping[str, str]
) -> None:
    """The unit of the gyros: gravity in the accelerometers tells it where they were turned, or the table."""
    stated, written, increment = _stated(roles, "gyro")
    dimensions = ("angle",) if increment else ("rate", "angle")
    if (choice := _answered(answers, "gyro.unit", dimensions)) is not None:
        units.by_kind["gyro"] = choice
        return
    turned = None if increment else _turned(roles, period or ANY_PERIOD)
    told = (numbers.rate_unit(turned.scale) if period is not None else _hint(turned.scale, None)) if turned else ""
    reads = "gravity turns with them" if turned else ""
    if stated is not None and not is_unit(stated, "angle"):
        against = told and abs(scale_to_si(told, "rate", "")[0] / scale_to_si(stated, "rate", "")[0] - 1) > 0.5
        if against:
            reads, written, stated = f"gravity turns as if in {told}", stated, None
    if stated is not None:
        units.by_kind["gyro"] = Choice(stated, f"the heading{f'; {reads}' if reads else ''}", "stated")
    elif told and not written and period is not None:
        units.by_kind["gyro"] = Choice(told, reads, "numbers")
    else:
        hint = told or (_hint(turned.scale, period) if turned else "")
        if turned and not told and period is not None:
            reads = f"gravity turns with them as if one were {np.degrees(turned.scale):.3g} deg/s"
        if table is not None:
            hint, reads = _by_table(roles, period, table, hint, reads)
        _ask(units, "gyro", reads, hint, written, dimensions)


def _hint(scale: float, period: float | None) -> str:
    """What a scale speaks for: a count, or, where the rate of the rows is open, one of two units 57 times apart."""
    if period is not None:
        return _decimal(numbers.counts_unit(scale))
    return next((unit for unit in ("rad/s", "deg/s") if 0.1 < scale / numbers.RATES[unit] < 5), "")


def _turned(roles: Roles, period: float) -> numbers.Turning | None:
    """How gravity turned, if it did and the axes agree."""
    gyros, accels = roles.triad("gyro"), roles.triad("accel")
    if not gyros or not accels or any(roles.by_channel[name].heading.increment for name in accels):
        return None
    found = numbers.turning(_matrix(roles, gyros), _matrix(roles, accels), period)
    return found if found is not None and found.correlation > 0.7 else None


def _by_table(roles: Roles, period: float | None, table: tuple[str, Role], hint: str, reads: str) -> tuple[str, str]:
    """What the table says of a gyro's unit: a hint, for a tilted gyro sees a part of its rate."""
    name, gain = _gain(roles, period, table)
    if gain is None:
        return hint, reads
    stated = table[1].heading.unit
    tables = [stated] if stated is not None and stated in numbers.RATES else ["deg/s", "rad/s", "rpm"]
    if table[0] == "table_angle":
        tables = ["rad/s"] if stated else []
    found = numbers.pairs(abs(gain), ("deg/s", "rad/s"), tables, 0.25) or numbers.pairs(
        abs(gain), ("deg/s", "rad/s"), ("deg/s", "rad/s", "rpm"), 0.25
    )
    said = f"{name} reads {gain:.3g} times the table's rate{'' if table[0] == 'table_rate' else ' in rad/s'}"
    return (found[0][0] if found else hint), said


# ----------------------------------------------------------------------------------------------------- table


def _table_role(
    units: Units, roles: Roles, period: float | None, answers: Mapping[str, str]
) -> tuple[str, Role] | None:
    """The table's column, and whether it is rate or angle; one that says neither is told by the gyro."""
    for name in ("table_rate", "table_angle"):
        if name in roles.by_channel:
            return name, roles.by_channel[name]
    if "table" not in roles.by_channel:
        return None
    role = roles.by_channel["table"]
    kind = answers.get("table.is", "")
    if kind not in ("", "rate", "angle"):
        raise InputError(f"table.is = {kind!r}; wanted 'rate' or 'angle'")
    if not kind and roles.of("gyro"):
        gyro = roles.by_channel[roles.of("gyro")[0]].column.values
        as_rate = abs(numbers.gain(gyro, role.column.values).correlation)
        as_angle = abs(numbers.gain(gyro, np.gradient(_unwrapped(role.column.values))).correlation)
        if max(as_rate, as_angle) > numbers.FOLLOWS and min(as_rate, as_angle) < 0.7:
            kind = "rate" if as_rate > as_angle else "angle"
    if not kind:
        text = f"Is {role.column.heading} the table's rate or its angle?"
        units.questions.append(Question("table.is", text, "", choices=("rate", "angle")))
        return None
    return f"table_{kind}", role


def _unwrapped(angle: Floats) -> Floats:
    unit, wrapped = numbers.turn_unit(angle)
    turn = {"deg": 360.0, "rad": 2 * np.pi, "turn": 1.0, "arcsec": 1296000.0}.get(unit)
    return np.unwrap(angle, period=turn) if wrapped and turn else angle


def _gain(roles: Roles, period: float | None, table: tuple[str, Role]) -> tuple[str, float | None]:
    """The gyro that follows the table best, and its gain in the numbers of both; of an angle its rate [rad/s]."""
    values = table[1].column.values
    if table[0] == "table_angle":
        if period is None or table[1].heading.unit is None:
            return "", None
        unit = table[1].heading.unit
        values = np.gradient(_unwrapped(values)) * scale_to_si(unit, "angle", "table_angle.unit")[0] / period
    found = {name: numbers.gain(roles.by_channel[name].column.values, values) for name in roles.of("gyro")}
    if not found:
        return "", None
    best = max(found, key=lambda name: abs(found[name].correlation))
    return best, found[best].gain if abs(found[best].correlation) > numbers.FOLLOWS else None


def _table_unit(
    units: Units, roles: Roles, period: float | None, table: tuple[str, Role], answers: Mapping[str, str]
) -> None:
    """The unit of the table's column."""
    name, role = table
    key, stated = f"{name}.unit", role.heading.unit
    if name == "table_angle":
        _angle_unit(units, role, stated, answers)
        return
    choice = _answered(answers, key, ("angle",) if role.heading.increment else ("rate", "angle"))
    gyro = units.by_kind.get("gyro")
    _, gain = _gain(roles, period, table)
    told, reads = "", ""
    if gain is not None and gyro is not None:
        known = _spelled(gyro.value)
        tables = ("deg/s", "rad/s", "rpm")
        if known:
            near = numbers.pairs(abs(gain), (known,), tables, ALONG)
            told = near[0][1] if near else ""
            reads = f"the gyro reads {abs(gain):.3g} times it"
        near = numbers.pairs(abs(gain), (known,) if known else ("deg/s", "rad/s"), tables, 0.25)
        if choice is None and stated is not None and near and all(t != (_spelled(stated) or stated) for _, t in near):
            fitting = f"as with a gyro in {near[0][0]} and a table in {near[0][1]}"
            reads = f"the heading says {stated}, but the gyro reads {abs(gain):.3g} times it, {fitting}"
            stated = None
        hint = near[0][1] if near else ""
    else:
        hint = ""
    if choice is None and stated is not None:
        choice = Choice(stated, "the heading", "stated")
    if choice is None and told and reads and "heading" not in reads:
        choice = Choice(told, reads, "numbers")
    if choice is None:
        facts = f" {reads[0].upper()}{reads[1:]}." if reads else ""
        text = f"In which unit is the table's rate, {role.column.heading}?{facts} Wanted: deg/s, rad/s, rpm."
        units.questions.append(Question(key, text, hint, ("rate", "angle")))
        choice = Choice(None, reads or "no unit in the heading", "open")
    units.table[name] = (role, choice, False)


def _spelled(unit: str | None) -> str | None:
    """A unit of rate as `numbers.RATES` spells it: dps is deg/s; None for others."""
    if unit is None or not is_unit(unit, "rate"):
        return None
    size = scale_to_si(unit, "rate", "")[0]
    return next((one for one, known in numbers.RATES.items() if abs(size / known - 1) < 1e-9), None)


def _angle_unit(units: Units, role: Role, stated: str | None, answers: Mapping[str, str]) -> None:
    """The unit of the table's angle: where it jumps, it jumps by a full turn."""
    told, wrapped = numbers.turn_unit(role.column.values)
    choice = _answered(answers, "table_angle.unit", ("angle",))
    if choice is None and stated is not None:
        choice = Choice(stated, "the heading", "stated")
    if choice is None and wrapped:
        choice = Choice(told, "jumps by a full turn", "numbers")
    if choice is None:
        low, high = float(role.column.values.min()), float(role.column.values.max())
        text = f"In which unit is the table's angle, {role.column.heading}, from {low:.6g} to {high:.6g}? (deg, rad)"
        units.questions.append(Question("table_angle.unit", text, "", ("angle",)))
        choice = Choice(None, "no jumps by a full turn", "open")
    units.table["table_angle"] = (role, choice, wrapped)


# -------------------------------------------------------------------------------------------------- mounting


def _mounting(
    units: Units, roles: Roles, period: float | None, table: tuple[str, Role], answers: Mapping[str, str]
) -> None:
    """How the gyro stands on the table, where its gain is not one."""
    names = roles.of("gyro")
    if len(names) > 1:
        _table_axis(units, answers)
    if len(names) != 1:
        return
    if "mounting.tilt" in answers:
        quantity(answers["mounting.tilt"], "angle", "mounting.tilt")
        units.mounting["tilt"] = Choice(answers["mounting.tilt"], "your answer", "answered")
        return
    gain = _gain_in_units(units, roles, period, table)
    if gain is None or abs(gain - 1) < ALONG:
        return
    said = (
        f"The gyro reads {gain:.3g} times the table's rate" if abs(gain) < 1e3 else "The gyro turns against the table"
    )
    text = (
        f"{said}. How far is its input axis raised above the table's plane? (90 deg: along the table's axis, -90 deg: "
        "upside down; what is then left is scale factor)"
    )
    hint = "" if abs(gain) < 0.7 else ("90 deg" if gain > 0 else "-90 deg")
    units.questions.append(Question("mounting.tilt", text, hint, ("angle",), quantity=True))
    units.mounting["tilt"] = Choice(None, f"{said[0].lower()}{said[1:]}", "open")


def _gain_in_units(units: Units, roles: Roles, period: float | None, table: tuple[str, Role]) -> float | None:
    """The gyro's gain, in units that are known or for which the numbers speak; minus infinity where it is but negative.

    None where nothing is to be said of the mounting: no gyro that follows, or one whose unit is any.
    """
    name, role = table
    known = units.table.get(name)
    unit = known[1].value if known else None
    gyro = units.by_kind["gyro"].value if "gyro" in units.by_kind else None
    hints = {question.key: question.hint for question in units.questions}
    unit, gyro = unit or hints.get(f"{name}.unit"), gyro or hints.get("gyro.unit")
    _, gain = _gain(roles, period, (name, replace(role, heading=replace(role.heading, unit=unit or None))))
    if gain is None or not (unit and gyro and is_unit(gyro, "rate")):
        return -np.inf if gain is not None and gain < 0 else None
    size = 1.0 if name == "table_angle" else scale_to_si(unit, "rate", "table_rate.unit")[0]
    return gain * scale_to_si(gyro, "rate", "gyro.unit")[0] / size


def _table_axis(units: Units, answers: Mapping[str, str]) -> None:
    """About which direction a triad turns."""
    if "mounting.table_axis" in answers:
        answer = answers["mounting.table_axis"].upper()
        if answer not in ("U", "D"):
            raise InputError(f"mounting.table_axis = {answer!r}; wanted 'U' or 'D'")
        units.mounting["table_axis"] = Choice(answer, "your answer", "answered")
    else:
        text = "Is the table's rate positive about up (U, anticlockwise from above) or down (D, clockwise)?"
        units.questions.append(Question("mounting.table_axis", text, "", choices=("U", "D")))
        units.mounting["table_axis"] = Choice(None, "a triad on a table", "open")
    if "mounting.axes" in answers:
        units.mounting["axes"] = Choice(answers["mounting.axes"].upper(), "your answer", "answered")
    else:
        text = "Where do x, y and z of the triad point? (three of R L F B U D, right-handed: RFU, FRD, FLU ...)"
        units.questions.append(Question("mounting.axes", text, ""))
        units.mounting["axes"] = Choice(None, "a triad on a table", "open")
