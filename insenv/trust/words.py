"""What a claim is worth on a recording, as text and as JSON of the schema ``insenv.trust/1``."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from insenv.core.files import write_whole
from insenv.report.json import strict
from insenv.report.quantities import unit_for
from insenv.trust.rates import Completeness, Rate, Reliability, Trust
from insenv.trust.trial import SIZES

SCHEMA = "insenv.trust/1"


def summary(found: Trust) -> str:
    """In words and numbers, for a terminal."""
    quiet = found.reliability[0].wrong.of
    lines = [
        found.findings.title,
        f"{found.copies} copies: {quiet} with nothing to find, {found.copies - quiet} with one effect more. "
        "Brackets hold 95 % intervals.",
    ]
    for one in found.reliability:
        lines += ["", *_reliability(one, found.findings.alpha)]
    if found.effects:
        lines += ["", *_completeness(found)]
    return "\n".join(lines)


def verdict(found: Trust) -> str:
    """One sentence."""
    wrong = Rate(sum(r.wrong.count for r in found.reliability), sum(r.wrong.of for r in found.reliability))
    said = f"a name where there is nothing in {rate(wrong)}"
    promised = next(s for s in found.whole.sizes if s.size == 1.0)
    if not promised.found.of:
        return said
    seen, named = rate(promised.found), rate(promised.named)
    return f"{said}; an effect of the smallest detectable size found in {seen}, named in {named}"


def rate(r: Rate) -> str:
    """A share with its interval."""
    low, high = r.interval
    return f"{r.count} of {r.of} ({100 * low:.0f} to {100 * high:.0f} %)"


def _reliability(one: Reliability, alpha: float) -> list[str]:
    lines = [
        f"{one.target}: something is named in {rate(one.wrong)} copies with nothing to find; {100 * alpha:g} % wanted"
    ]
    lines += [f"  {name}: found in the recording, named without cause in {rate(r)}" for name, r in one.findings]
    known = {name for name, _ in one.findings}
    lines += [f"  {name}: named without cause in {rate(r)}" for name, r in one.names if name not in known]
    if one.left:
        lines.append(f"  not counted, for every copy has it: {', '.join(one.left)}")
    return lines


def _completeness(found: Trust) -> list[str]:
    """A table: effects down, sizes across."""
    head = ("effect", "on", "smallest detectable", *(f"x {size:g}" for size in SIZES))
    rows = [head, *(_row(one) for one in found.effects)]
    for word in ("found", "named", "honest"):
        rates = [getattr(size, word) for size in found.whole.sizes]
        rows.append((_WORDS[word], "", "", *(f"{r.count}/{r.of}" if r.of else "-" for r in rates)))
    widths = [max(len(row[i]) for row in rows) for i in range(len(head))]
    table = ["  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return [
        "Copies in which an effect was named, of those that have it, by size in smallest detectable amplitudes:",
        *table,
    ]


_WORDS = {"found": "anything found", "named": "the effect named", "honest": "estimate within 1.96 sd"}


def _row(one: Completeness) -> tuple[str, ...]:
    named = [f"{s.named.count}/{s.named.of}" if s.named.of else "-" for s in one.sizes]
    return (one.effect, one.target, unit_for(one.unit, one.amplitude).show(one.amplitude), *named)


def to_json(found: Trust) -> dict[str, Any]:
    """As plain dictionaries, lists, strings and finite numbers; SI."""
    return {
        "schema": SCHEMA,
        "title": found.findings.title,
        "manifest": found.findings.manifest,
        "verdict": found.findings.verdict,
        "copies": found.copies,
        "seed": found.seed,
        "alpha": found.findings.alpha,
        "reliability": [
            {
                "target": one.target,
                "wrong": _rate(one.wrong),
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
    return write_whole(path, json.dumps(to_json(found), indent=2, ensure_ascii=False, allow_nan=False) + "\n")
