"""Dates and times of day as stamps: "2025-10-04 16:35:12.186" -> seconds since 1970, "16:35:12.186" -> of the day.

Loggers of computers write them, also as names of files ("2025_10_04_16_35_12.186") and by halves of the day
("4:35:12.186 PM"). A time of day that falls by more than half a day goes on after midnight. A time zone shifts all
stamps alike and is passed over.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date
from functools import lru_cache

import numpy as np

from insenv.core.recording import Floats

_DATE = r"(?P<year>\d{4})[-/._](?P<month>\d\d?)[-/._](?P<day>\d\d?)"
#: Behind a date the numbers of the clock may stand as those of the date do.
_BETWEEN = r"(?(year)[:_-]|:)"
#: So may milliseconds or microseconds: "2024_04_20_16_53_56_029".
_PART = r"(?P<part>[.,:]\d+|(?(year)[_-](?:\d{3}|\d{6})|(?!)))?"
_CLOCK = rf"(?P<hour>[01]?\d|2[0-3]){_BETWEEN}(?P<minute>[0-5]\d){_BETWEEN}(?P<second>[0-5]\d|60){_PART}"
_STAMP = re.compile(rf"(?:{_DATE}[ T_-]+)?{_CLOCK}(?: ?(?P<half>[AP])M)?(?: ?(?:Z|UTC|[+-]\d\d:?\d\d))?", re.I)
_HALF_A_DAY, _DAY = 43_200.0, 86_400.0


def second(cell: str) -> float:
    """Seconds that a cell says [s]: since 1970 with a date, else since midnight; NaN where it is no such stamp."""
    match = _STAMP.fullmatch(cell.strip())
    if match is None:
        return np.nan
    part = f"0.{match['part'][1:]}" if match["part"] else "0"
    hour = int(match["hour"])
    if match["half"]:
        hour = hour % 12 + 12 * (match["half"] in "Pp")
    of_day = 3600 * hour + 60 * int(match["minute"]) + int(match["second"])
    if match["year"] is None:
        return of_day + float(part)
    return _midnight(int(match["year"]), int(match["month"]), int(match["day"])) + of_day + float(part)


@lru_cache
def _midnight(year: int, month: int, day: int) -> float:
    """Seconds from 1970 to the beginning of a day; NaN of a day that is none."""
    try:
        return _DAY * (date(year, month, day) - date(1970, 1, 1)).days
    except ValueError:
        return np.nan


def seconds(cells: Sequence[str]) -> Floats:
    """Stamps of a column [s], shape (n,); NaN where a cell is none."""
    found = np.array([second(cell) for cell in cells])
    if len(found) and found[np.isfinite(found)].max(initial=0.0) < _DAY:
        steps = np.diff(found, prepend=found[:1])
        found = found + _DAY * np.cumsum(steps < -_HALF_A_DAY)
    return found
