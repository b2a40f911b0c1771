"""Dates and times of day as stamps: "2025-10-04 16:35:12.186" -> seconds since 1970, "16:35:12.186" -> of the day.

Loggers of computers write them, also as names of files ("2025_10_04_16_35_12.186"), with the day first
("04-Oct-2025 16:35:12", "04.10.2025 16:35:12") and by halves of the day ("4:35:12.186 PM"). A time of day that falls by
more than half a day goes on after midnight, minutes and seconds alone ("35:12.2", as spreadsheets show them) after the
hour. Between strokes day and month are told apart where one is above twelve. A time zone shifts all stamps alike and is
passed over, but where it changes within a file, as summer time ends.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import date
from functools import lru_cache

import numpy as np

from insenv.core.recording import Floats

_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_DATE = r"(?P<year>\d{4})[-/._](?P<month>\d\d?)[-/._](?P<day>\d\d?)"
#: Dates with the year last, made into those with the year first: which numbers are day and month.
_DAY_FIRST = re.compile(r"(\d\d?)\.(\d\d?)\.(\d{4})(?=[ T])")
_NAMED_MONTH = re.compile(rf"(\d\d?)[- ]({'|'.join(_MONTHS)})[a-z]*[- ](\d{{4}})(?=[ T])", re.I)
_STROKES = re.compile(r"(\d\d?)/(\d\d?)/(\d{4})(?=[ T])")
#: Behind a date the numbers of the clock may stand as those of the date do.
_BETWEEN = r"(?(year)[:_-]|:)"
#: So may milliseconds or microseconds: "2024_04_20_16_53_56_029".
_PART = r"(?P<part>[.,:]\d+|(?(year)[_-](?:\d{3}|\d{6})|(?!)))?"
_CLOCK = rf"(?P<hour>[01]?\d|2[0-3]){_BETWEEN}(?P<minute>[0-5]\d){_BETWEEN}(?P<second>[0-5]\d|60){_PART}"
_STAMP = re.compile(rf"(?:{_DATE}[ T_-]+)?{_CLOCK}(?: ?(?P<half>[AP])M)?(?: ?(?:Z|UTC|[+-]\d\d:?\d\d))?", re.I)
_MINUTES = re.compile(r"(?P<minute>[0-5]?\d):(?P<second>[0-5]\d)[.,](?P<part>\d+)")
_ZONE = re.compile(r"([+-])(\d\d):?(\d\d)\s*$")
_HOUR, _DAY = 3_600.0, 86_400.0


def second(cell: str) -> float:
    """Seconds that a cell says [s]: since 1970 with a date, else since midnight; NaN where it is no such stamp."""
    if (short := _MINUTES.fullmatch(cell.strip())) is not None:
        return 60 * int(short["minute"]) + int(short["second"]) + float(f"0.{short['part']}")
    match = _STAMP.fullmatch(_year_first(cell.strip()))
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


def _year_first(cell: str) -> str:
    """A stamp with its date as year, month, day; as it is where these are not known."""
    if (found := _DAY_FIRST.match(cell)) is not None:
        day, month, year = found.groups()
    elif (found := _NAMED_MONTH.match(cell)) is not None:
        day, name, year = found.groups()
        month = str(_MONTHS.index(name.lower()) + 1)
    elif (found := _STROKES.match(cell)) is not None and max(map(int, found.groups()[:2])) > len(_MONTHS):
        month, day, year = found.groups()
        month, day = (day, month) if int(month) > len(_MONTHS) else (month, day)
    else:
        return cell
    return f"{year}-{month}-{day}{cell[found.end() :]}"


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
        turn = _HOUR if _MINUTES.fullmatch(cells[0].strip()) else _DAY
        found = found + turn * np.cumsum(np.diff(found, prepend=found[:1]) < -turn / 2)
    elif len(found) and _zone(cells[0]) != _zone(cells[-1]):
        found = found - np.array([_zone(cell) for cell in cells])
    return found


def _zone(cell: str) -> float:
    """By how much the time of a stamp's zone is ahead [s]."""
    match = _ZONE.search(cell)
    return 0.0 if match is None else float(f"{match[1]}1") * (3600 * int(match[2]) + 60 * int(match[3]))
