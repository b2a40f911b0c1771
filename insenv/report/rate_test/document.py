"""Rate tests as a laboratory files them: one HTML page, JSON by the contract ``insenv.rate-test/1``, a summary."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.files import json_text, write_whole
from insenv.core.filing import filed, stamp
from insenv.core.quantities import number, span
from insenv.core.rate_test import NORMALISATIONS, RateTest
from insenv.core.series.allan import WHITE
from insenv.core.units import DEG, DEG_PER_HOUR
from insenv.report.json import strict
from insenv.report.page import rendered
from insenv.report.rate_test import rows

SCHEMA = "insenv.rate-test/1"
Block = dict[str, Any]


def to_json(tests: Sequence[RateTest]) -> Block:
    """``tests`` as plain dictionaries, lists, texts and finite numbers, SI; null: not finite."""
    block = {
        "schema": SCHEMA,
        "units": "SI and radians",
        "normalisations": dict(NORMALISATIONS),
        "instruments": [_instrument_json(test) for test in tests],
        **stamp(),
    }
    return {key: strict(value) for key, value in block.items()}


def _instrument_json(test: RateTest) -> Block:
    block: Block = _plain(test)
    del block["filing"]
    return {**block, **filed(test.filing)}


def _plain(value: Any) -> Any:
    """Dataclasses as dictionaries, arrays as lists."""
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return value


def write_json(tests: Sequence[RateTest], path: str | os.PathLike[str]) -> Path:
    """Write `to_json` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    return write_whole(path, json_text(to_json(tests)))


def write_html(tests: Sequence[RateTest], path: str | os.PathLike[str]) -> Path:
    """Write `to_html` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    return write_whole(path, to_html(tests))


def to_html(tests: Sequence[RateTest]) -> str:
    """``tests`` as one self-contained HTML page; every text from a file is escaped."""
    resting = [test for test in tests if test.static is not None]
    return rendered(
        "rate_test.html.j2",
        tests[0].filing if len(tests) == 1 else None,
        title=" · ".join(test.title for test in tests),
        comparison=_typeset(rows.comparison(tests)),
        several=len(tests) > 1,
        allan=_allan_of_all(resting) if len(resting) > 1 else "",
        instruments=[_instrument(test, f"i{i}") for i, test in enumerate(tests, 1)],
    )


def _instrument(test: RateTest, ident: str) -> Block:
    """Everything that the template shows of one instrument, as ready text."""
    return {
        "id": ident,
        "title": test.title,
        "manifest": test.manifest,
        "size": f"{test.rows:,}".replace(",", "\u202f") + f" rows, {span(test.duration)}",
        "conditions": [*test.conditions.items(), *((f"sha256 of {f.name}", f.sha256) for f in test.filing.files)],
        "line": None if test.line is None else _line(test, ident),
        "static": None if test.static is None else _static(test, ident),
        "remarks": test.remarks,
    }


def _line(test: RateTest, ident: str) -> Block:
    line = test.line
    assert line is not None
    flagged = [f"{f.rate / DEG:+.3f} deg/s (z = {number(f.z)})" for f in line.flagged]
    return {
        "fits": _typeset(rows.fits(line)),
        "normalisations": _typeset(rows.normalisations(line)),
        "power_ups": _typeset(rows.power_ups(line)),
        "rates": _typeset(rows.rates(line)),
        "dwells": _typeset(rows.dwells(line)),
        "zeros": f"{line.zero_method} ({line.zero_reason})",
        "flagged": _minus(", ".join(flagged)) or "none",
        "rule": line.rule,
        "false_alarm": number(line.false_alarm, 1),
        "noise": number(line.noise / rows.COEFFICIENTS[WHITE][2]),
        "setting": f"{number(line.setting / DEG_PER_HOUR)} deg/h, {line.setting_from}",
        "figure": _figure("nonlinearity", test, ident),
    }


def _static(test: RateTest, ident: str) -> Block:
    static = test.static
    assert static is not None
    return {
        "label": static.label,
        "duration": span(static.duration),
        "earth": static.earth_note,
        "biases": _typeset(rows.biases(test)),
        "stability": _typeset(rows.stability(static)),
        "allan": _typeset(rows.allan(static)),
        "model": rows.of_the_model(static),
        "figures": [
            (
                _figure("allan", [test], ident),
                "Good: lower at every averaging time, and the measured curve follows the sum of the fitted terms.",
            ),
            (
                _figure("against_time", test, ident),
                "Good: a level band without trend or steps, which does not follow the temperature.",
            ),
        ],
    }


def _typeset(grid: rows.Grid) -> rows.Grid:
    """A table with true minus signs."""
    cells = tuple((row[0], *map(_minus, row[1:])) if row else row for row in grid.rows)
    if grid.head[0].startswith("rate"):
        cells = tuple((_minus(row[0]), *row[1:]) for row in cells)
    return rows.Grid(grid.head, cells)


def _minus(text: str) -> str:
    """Minus signs before numbers; hyphens stay."""
    return re.sub(r"(?<![\w-])-(?=[\d.])", "\N{MINUS SIGN}", text)


def _figure(name: str, what: Any, ident: str) -> Any:
    from markupsafe import Markup

    from insenv.report.rate_test import figures
    from insenv.report.svg import inline

    return Markup(inline(getattr(figures, name)(what), f"{ident}-{name}", name.replace("_", " ")))


def _allan_of_all(tests: Sequence[RateTest]) -> Any:
    return _figure("allan", list(tests), "all")


def summary(tests: Sequence[RateTest]) -> str:
    """The comparison as text, and what was flagged; no final line break."""
    grid = rows.comparison(tests)
    table = [grid.head, *grid.rows]
    widths = [max(len(row[i]) for row in table) for i in range(len(grid.head))]
    lines = [
        "  ".join(c.ljust(w) if i == 0 else c.rjust(w) for i, (c, w) in enumerate(zip(row, widths, strict=True)))
        for row in table
    ]
    for test in tests:
        if test.line is not None:
            rates = ", ".join(f"{f.rate / DEG:+.4g}" for f in test.line.flagged)
            lines.append(f"{test.title}: {'flagged ' + rates + ' deg/s' if rates else 'no rate is flagged'}")
        if test.static is not None:
            lines.append(f"{test.title}: {test.static.earth_note}")
            if said := rows.of_the_model(test.static):
                lines.append(f"{test.title}: Allan deviation: {said}")
        lines += [f"{test.title}: {remark}" for remark in test.remarks]
    return "\n".join(
        "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in line).rstrip() for line in lines
    )
