"""An estimate of a recording as text, JSON ``insenv.estimate/1`` (SI units) and one HTML page."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from insenv.core.estimate import Estimate, Estimated, Estimation
from insenv.core.files import json_text, write_whole
from insenv.core.filing import filed, stamp
from insenv.core.quantities import number, span, unit_for, with_sd
from insenv.report.page import rendered

SCHEMA = "insenv.estimate/1"
_HEAD = ("quantity", "value", "before the data", "unit")
Row = tuple[str, str, str, str]


def rows(one: Estimated) -> list[Row]:
    """Name, value and deviation, what was known before, unit, of each quantity."""
    found = []
    for name, si in zip(one.estimate.names, one.estimate.units, strict=True):
        value, sd = map(float, one.estimate.of(name))
        unit = unit_for(si, value, sd)
        before = "—"
        if name in one.prior.names:
            mean, width = map(float, one.prior.of(name))
            before = f"{number(mean / unit.factor)} ± {number(width / unit.factor)}"
        found.append((name, with_sd(value / unit.factor, sd / unit.factor), before, unit.label if si != "1" else ""))
    return found


def unobserved(one: Estimated) -> tuple[str, ...]:
    """Quantities of which the data tell next to nothing: the deviation is that of before."""
    known = [name for name in one.estimate.names if name in one.prior.names]
    return tuple(n for n in known if not one.estimate.of(n)[1] < 0.98 * one.prior.of(n)[1])


def summary(found: Estimation) -> str:
    """Text for a terminal."""
    lines = [f"{found.title}: {found.estimator}", f"Manifest: {found.manifest}"]
    for one in found.runs:
        lines += ["", f"{one.label}: {one.rows} rows, {span(one.duration)}", ""]
        table = [_HEAD, *rows(one)]
        widths = [max(len(row[j]) for row in table) for j in range(4)]
        lines += [
            "  " + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in table
        ]
        if silent := unobserved(one):
            lines += ["", f"  The data tell nothing of {', '.join(silent)}: what is shown was known before."]
    lines += ["", "Values with one standard deviation; they hold as far as the datasheet of the manifest does."]
    return "\n".join(lines)


def to_json(found: Estimation) -> dict[str, Any]:
    """Plain dictionaries, lists, texts and finite numbers."""
    return {
        "schema": SCHEMA,
        "manifest": found.manifest,
        "title": found.title,
        "estimator": found.estimator,
        **stamp(),
        **filed(found.filing),
        "runs": [
            {
                "label": one.label,
                "rows": one.rows,
                "duration_s": one.duration,
                "estimates": _block(one.estimate),
                "covariance": np.asarray(one.estimate.cov).tolist(),
                "prior": _block(one.prior),
                "not_told": list(unobserved(one)),
            }
            for one in found.runs
        ],
    }


def _block(one: Estimate) -> list[dict[str, Any]]:
    return [
        {"name": name, "value": float(value), "sd": float(sd), "unit": unit}
        for name, value, sd, unit in zip(one.names, one.mean, one.sd, one.units, strict=True)
    ]


def write_json(found: Estimation, path: str | os.PathLike[str]) -> Path:
    """Write `to_json` to ``path``, whole or not at all; InputError if it cannot be written."""
    return write_whole(path, json_text(to_json(found)))


def to_html(found: Estimation) -> str:
    """The page; nothing is loaded from elsewhere."""
    return rendered(
        "estimate.html.j2",
        found.filing,
        title=found.title,
        estimator=found.estimator,
        manifest=found.manifest,
        header=_HEAD,
        runs=[(one, span(one.duration), rows(one), unobserved(one)) for one in found.runs],
    )


def write_html(found: Estimation, path: str | os.PathLike[str]) -> Path:
    """Write `to_html` to ``path``, whole or not at all; InputError if it cannot be written."""
    return write_whole(path, to_html(found))
