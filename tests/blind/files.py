"""A recording as laboratories leave it: layouts, units and names of many kinds, and the manifest that says so."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from blind.table import Floats

DEG = np.pi / 180
#: One unit in SI.
UNITS = {
    "deg/s": DEG,
    "rad/s": 1.0,
    "deg/h": DEG / 3600,
    "mrad/s": 1e-3,
    "deg": DEG,
    "rad": 1.0,
    "arcsec": DEG / 3600,
    "urad": 1e-6,
    "m/s^2": 1.0,
    "g": 9.80665,
}


@dataclass(frozen=True)
class Column:
    """One channel as it stands in the file: its own heading, values in its unit, and what the manifest says of it."""

    channel: str
    heading: str
    values: Floats
    decimals: int
    unit: str
    more: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Layout:
    """Kind of file: its suffix, what separates the columns, whether a heading stands above them, end of line."""

    suffix: str
    separator: str
    heading: bool
    unit_in_heading: bool = False
    newline: str = "\n"


LAYOUTS = (
    Layout(".csv", ",", True),
    Layout(".csv", ",", True, unit_in_heading=True),
    Layout(".csv", ";", True),
    Layout(".csv", "\t", True),
    Layout(".tsv", "\t", True, unit_in_heading=True),
    Layout(".csv", ",", True, newline="\r\n"),
    Layout(".txt", " ", False),
    Layout(".dat", "\t", False),
    Layout(".npz", "", True),
)


def rounded_up(value: float) -> float:
    """The next of 1, 2, 5 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * next(m for m in (1, 2, 5, 10) if m * power >= 0.999 * value))


def decimals(step: float) -> int:
    """Decimals that show a multiple of ``step`` in full."""
    return int(max(0, np.ceil(-np.log10(step) - 1e-9)))


def write_table(path: Path, columns: list[Column], layout: Layout) -> None:
    if layout.suffix == ".npz":
        named: dict[str, Any] = {c.heading: c.values for c in columns}
        np.savez(path, **named)
        return
    heads = [f"{c.heading} ({c.unit})" if layout.unit_in_heading and c.unit else c.heading for c in columns]
    np.savetxt(
        path,
        np.column_stack([c.values for c in columns]),
        fmt=[f"%.{c.decimals}f" for c in columns],
        delimiter=layout.separator,
        header=layout.separator.join(heads) if layout.heading else "",
        comments="",
        newline=layout.newline,
    )


def channel_lines(columns: list[Column], layout: Layout) -> list[str]:
    lines = []
    for index, c in enumerate(columns):
        where = f'"{c.heading}"' if layout.heading else str(index)
        unit = "" if not c.unit or layout.unit_in_heading and not c.more.get("quantity") else f', unit = "{c.unit}"'
        more = "".join(f", {k} = {v}" for k, v in c.more.items())
        lines.append(f"{c.channel} = {{ column = {where}{unit}{more} }}")
    return lines


def manifest_text(names: list[str], channels: list[str], tables: dict[str, dict[str, str]]) -> str:
    """``tables`` hold values as TOML already."""
    data = f'"{names[0]}"' if len(names) == 1 else json.dumps(names)
    text = [f"data = {data}", "", "[channels]", *channels]
    for table, entries in tables.items():
        if entries:
            text += ["", f"[{table}]", *(f"{k} = {v}" for k, v in entries.items())]
    return "\n".join(text) + "\n"
