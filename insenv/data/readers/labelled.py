"""Lines that name each of their values, as programs print them, made rows of a table.

    X: 19, Y: -40, Z: 24                 ->  19,-40,24             of X, Y, Z
    12:30:01.250 -> GYRO: X=-0.1,Y=0.2   ->  12:30:01.250,-0.1,0.2  of time, GYRO X, GYRO Y

A name without a value of its own goes before the short ones that follow it; so do the first words of "Gyro X:" before a
bare "Y:". A unit behind a value goes with the name. A stamp at the head of a line is the column ``time``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from insenv.data.readers.stamps import second

#: Values in a line from which on it is one of names and values.
FEWEST = 2
#: Letters of a name that may be short for what its group says.
SHORT = 2
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_UNIT = r"m/s\^?2|m/s²|deg/s|°/s|rad/s|dps|mdps|rpm|mg|g|deg|rad|°C|C|ms|us|ns|s"
_PAIR = re.compile(
    r"(?P<name>[A-Za-z][A-Za-z0-9_ /^.()\[\]°²*%-]*?)\s*[:=]\s*"
    rf"(?:(?P<value>{_NUMBER})(?:\s?(?P<unit>{_UNIT})(?![A-Za-z0-9]))?)?(?![\d:])"
)
_STAMPED = re.compile(
    r"\s*\[?(?P<stamp>(?:\d{4}[-/]\d\d?[-/]\d\d?[ T])?\d\d?:\d\d:\d\d(?:[.,]\d+)?)\]?\s*(?:->|[,;\s])\s*"
)
_AXES = ("x", "y", "z")


def names_of(line: str) -> tuple[str, ...]:
    """Names of the values of a line; empty where it is none of names and values."""
    return tuple(name for name, _ in _pairs(line))


def as_rows(text: str, names: Sequence[str]) -> str:
    """The lines of ``text`` as rows, commas between the values of ``names``: empty cells where a line lacks some."""
    return "\n".join(_row(line, names) for line in text.splitlines())


def _row(line: str, names: Sequence[str]) -> str:
    if not line.strip():
        return ""
    found = dict(_pairs(line))
    return ",".join(found.get(name, "") for name in names)


def _pairs(line: str) -> list[tuple[str, str]]:
    """Names and values of a line; none where it has too few, or one name twice."""
    found: list[tuple[str, str]] = []
    stamped = _STAMPED.match(line)
    if stamped and second(stamped["stamp"]) >= 0:
        found.append(("time", stamped["stamp"].replace(",", ".")))
        line = line[stamped.end() :]
    group = ""
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
        found.append((" ".join(words) + unit, match["value"]))
    values = [name for name, _ in found if name != "time"]
    return found if len(values) >= FEWEST and len(set(values)) == len(values) else []
