"""Lines that name each of their values, as programs print them, made rows of a table.

    X: 19, Y: -40, Z: 24                 ->  19,-40,24             of X, Y, Z
    12:30:01.250 -> GYRO: X=-0.1,Y=0.2   ->  12:30:01.250,-0.1,0.2  of time, GYRO X, GYRO Y
    Mag: 0.5 -0.8 0.7  Accel: 0 0.3 0.9  ->  0.5,-0.8,0.7,0,0.3,0.9 of Mag x, Mag y, Mag z, Accel x, ...
    {"gyro": {"x": 48.2, "y": 0.3}}      ->  48.2,0.3               of gyro x, gyro y

A name without a value of its own goes before the short ones that follow it; so do the first words of "Gyro X:" before a
bare "Y:". Three values of one name are x, y and z, more or fewer are counted from 0. A unit behind a value goes with
its name. A stamp at the head of a line, or ``[1250 ms]``, is the column ``time``.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterator, Sequence

from insenv.data.readers.stamps import second

#: Values in a line from which on it is one of names and values.
FEWEST = 2
#: Letters of a name that may be short for what its group says.
SHORT = 2
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_UNIT = r"m/s\^?2|m/s²|deg/s|°/s|rad/s|dps|mdps|rpm|mg|g|deg|rad|°C|C|ms|us|ns|s"
_PAIR = re.compile(
    r"(?P<name>[A-Za-z][A-Za-z0-9_ /^.()\[\]°²*%-]*?)\s*[:=]\s*"
    rf"(?:(?P<value>{_NUMBER}(?:(?:\s*,\s*|\s+){_NUMBER}(?![\w.:=]|\s*[:=]))*)"
    rf"(?:\s?(?P<unit>{_UNIT})(?!\w|\s*[:=]))?)?(?![\d:])"
)
_STAMPED = re.compile(
    r"\s*\[?(?P<stamp>(?:\d{4}[-/]\d\d?[-/]\d\d?[ T])?\d\d?:\d\d:\d\d(?:[.,]\d+)?)\]?\s*(?:->|[,;\s])\s*"
)
_COUNTED = re.compile(rf"\s*\[\s*(?P<count>{_NUMBER})\s*(?P<unit>ms|us|ns|s)\s*\]\s*")
_AXES = ("x", "y", "z")
_PARTED = re.compile(r"\s*,\s*|\s+")


def names_of(line: str) -> tuple[str, ...]:
    """Names of the values of a line; empty where it is none of names and values."""
    return tuple(name for name, _ in _pairs(line))


def as_rows(text: str, names: Sequence[str]) -> tuple[str, int]:
    """The lines of ``text`` as rows, commas between the values of ``names``: empty cells where a line lacks some.

    Lines that hold none of them, of another kind, are blank; their number.
    """
    lines = text.splitlines()
    rows = [_row(line, names) for line in lines]
    return "\n".join(rows), sum(not row and bool(line.strip()) for line, row in zip(lines, rows, strict=True))


def _row(line: str, names: Sequence[str]) -> str:
    found = dict(_pairs(line))
    return ",".join(found.get(name, "") for name in names) if any(name in found for name in names) else ""


def _of_object(line: str) -> list[tuple[str, str]]:
    """Names and values of an object of JSON, or as Python prints one."""
    for read in (json.loads, ast.literal_eval):
        try:
            return list(_flat("", read(line)))
        except (ValueError, SyntaxError, TypeError, RecursionError, MemoryError):
            continue
    return []


def _flat(name: str, value: object) -> Iterator[tuple[str, str]]:
    """Numbers and texts of an object, each by the names that lead to it."""
    if isinstance(value, dict):
        parts = [(str(key), one) for key, one in value.items()]
    elif isinstance(value, list | tuple):
        parts = list(zip(_each(len(value)), value, strict=True))
    else:
        yield name, str(value)
        return
    for key, one in parts:
        yield from _flat(f"{name} {key}".strip(), one)


def _of_one_name(name: str, unit: str, values: Sequence[str]) -> list[tuple[str, str]]:
    """Names, each with its value."""
    if len(values) == 1:
        return [(name + unit, values[0])]
    return [(f"{name} {one}{unit}", value) for one, value in zip(_each(len(values)), values, strict=True)]


def _each(count: int) -> Sequence[str]:
    """Names of so many values of one name."""
    return _AXES if count == len(_AXES) else [str(i) for i in range(count)]


def _pairs(line: str) -> list[tuple[str, str]]:
    """Names and values of a line; none where it has too few, or one name twice."""
    found: list[tuple[str, str]] = []
    stamped = _STAMPED.match(line)
    if stamped and second(stamped["stamp"]) >= 0:
        found.append(("time", stamped["stamp"].replace(",", ".")))
        line = line[stamped.end() :]
    elif counted := _COUNTED.match(line):
        found.append((f"time [{counted['unit']}]", counted["count"]))
        line = line[counted.end() :]
    group = ""
    if line.lstrip().startswith("{"):
        return _of_object(line)
    for match in _PAIR.finditer(line):
        words = match["name"].split()
        if match["value"] is None:
            group = " ".join(words)
            continue
        if len(words) > 1 and words[-1].lower() in _AXES:
            group = " ".join(words[:-1])
        elif len(words) == 1 and len(words[0]) <= SHORT and group:
            words.insert(0, group)
        unit = f" [{match['unit']}]" if match["unit"] else ""
        found += _of_one_name(" ".join(words), unit, _PARTED.split(match["value"]))
    values = [name for name, _ in found if name.partition(" ")[0] != "time"]
    return found if len(values) >= FEWEST and len(set(values)) == len(values) else []
