"""What a claim is worth on a recording, as text and as JSON of the schema ``insenv.trust/1``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from insenv.core.files import json_text, write_whole
from insenv.core.filing import filed, stamp
from insenv.core.quantities import unit_for
from insenv.evaluate.words import columns
from insenv.report.json import strict
from insenv.trust.rates import Completeness, Rate, Reliability, Trust
from insenv.trust.trial import SIZES

SCHEMA = "insenv.trust/1"


def summary(found: Trust) -> str:
    """In words and numbers, for a terminal."""
    lines = [found.findings.title, f"{head(found)} Brackets hold with 95 %."]
    for one in found.reliability:
        lines += ["", *columns(("on", "name", "", "copies with nothing to find"), reliability(one))]
        if one.left:
            lines.append(f"  {not_counted(one)}")
    if found.effects:
        header, *rows = completeness(found)
        lines += ["", "  Copies in which an effect was named, by its size in smallest detectable amplitudes:"]
        lines += columns(header, rows)
    return "\n".join(lines)


def head(found: Trust) -> str:
    """What was done."""
    quiet = found.reliability[0].wrong.of
    return f"{found.copies} copies: {quiet} with nothing to find, {found.copies - quiet} with one effect more."


def verdict(found: Trust) -> str:
    """One sentence."""
    wrong, sure = _together([r.wrong for r in found.reliability]), _together([r.sure for r in found.reliability])
    said = f"a name where there is nothing in {rate(wrong)}"
    if wrong.count > sure.count:
        said += f", one that is told from noise in {rate(sure)}"
    promised = next(s for s in found.whole.sizes if s.size == 1.0)
    if not promised.found.of:
        return said
    seen, named = rate(promised.found), rate(promised.named)
    return f"{said}; an effect of the smallest detectable size found in {seen}, named in {named}"


def _together(rates: list[Rate]) -> Rate:
    return Rate(sum(r.count for r in rates), sum(r.of for r in rates))


def rate(r: Rate) -> str:
    """A share with its interval."""
    low, high = r.interval
    return f"{r.count} of {r.of} ({100 * low:.0f} to {100 * high:.0f} %)"


def reliability(one: Reliability) -> list[tuple[str, ...]]:
    """Rows of target, name, what is known of it, and in how many copies it was named without cause."""
    known = {name for name, _ in one.findings}
    return [
        (one.target, "anything", "", rate(one.wrong)),
        (one.target, "anything", "told from noise", rate(one.sure)),
        *((one.target, name, "found in the recording", rate(r)) for name, r in one.findings),
        *((one.target, name, "", rate(r)) for name, r in one.names if name not in known),
    ]


def not_counted(one: Reliability) -> str:
    """What is not counted."""
    return f"not counted, for every copy has it: {', '.join(one.left)}"


def completeness(found: Trust) -> list[tuple[str, ...]]:
    """A header and rows: effects down, sizes across; all effects together last."""
    rows = [("effect", "on", "smallest detectable", *(f"x {size:g}" for size in SIZES))]
    rows += [_row(one) for one in found.effects]
    for word, text in _WORDS.items():
        rates = [getattr(size, word) for size in found.whole.sizes]
        rows.append((text, "", "", *map(_count, rates)))
    return rows


_WORDS = {"found": "all: anything found", "named": "all: effect named", "honest": "all: estimate within 1.96 sd"}


def _row(one: Completeness) -> tuple[str, ...]:
    shown = unit_for(one.unit, one.amplitude).show(one.amplitude)
    return (one.effect, one.target, shown, *(_count(size.named) for size in one.sizes))


def _count(r: Rate) -> str:
    return f"{r.count}/{r.of}" if r.of else "-"


def to_json(found: Trust) -> dict[str, Any]:
    """As plain dictionaries, lists, strings and finite numbers; SI."""
    return {
        "schema": SCHEMA,
        **stamp(),
        "title": found.findings.title,
        "manifest": found.findings.manifest,
        **filed(found.findings.filing),
        "verdict": found.findings.verdict,
        "copies": found.copies,
        "seed": found.seed,
        "alpha": found.findings.alpha,
        "reliability": [
            {
                "target": one.target,
                "wrong": _rate(one.wrong),
                "sure": _rate(one.sure),
                "names": {name: _rate(r) for name, r in one.names},
                "findings": {name: _rate(r) for name, r in one.findings},
                "left": list(one.left),
            }
            for one in found.reliability
        ],
        "completeness": [
            {
                "target": one.target,
                "effect": one.effect,
                "smallest_detectable": strict(one.amplitude),
                "unit": one.unit,
                "sizes": [
                    {"size": s.size, "found": _rate(s.found), "named": _rate(s.named), "honest": _rate(s.honest)}
                    for s in one.sizes
                ],
            }
            for one in (found.whole, *found.effects)
        ],
    }


def _rate(r: Rate) -> dict[str, Any]:
    return {"count": r.count, "of": r.of, "interval": list(r.interval)}


def write_json(found: Trust, path: str | os.PathLike[str]) -> Path:
    """Write `to_json` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    return write_whole(path, json_text(to_json(found)))
