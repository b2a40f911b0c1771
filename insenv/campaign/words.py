"""A campaign as text, as JSON of the schema ``insenv.campaign/1``, and as one HTML page."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from insenv.campaign.pool import FEWEST, Pool
from insenv.campaign.run import Campaign, Coefficient
from insenv.core.files import json_text, write_whole
from insenv.core.filing import Filing, filed, stamp
from insenv.core.quantities import ShownUnit, p_value, percent, unit_for
from insenv.evaluate.words import columns
from insenv.report.json import strict
from insenv.report.page import rendered
from insenv.report.words import listing

SCHEMA = "insenv.campaign/1"
#: Probability below which units are said to differ, or to have a coefficient in common.
SAID = 0.05
#: Share of a test from which on it is worth a word that it could be left out.
WORTH = 0.1
VERDICTS = ("unit", "target", "verdict", "named by its own search")
COEFFICIENTS = ("unit", "", "by itself", "with the others as prior")


def summary(found: Campaign) -> str:
    """In words and numbers, for a terminal."""
    lines = [head(found), "", *columns(VERDICTS, verdicts(found))]
    for sentence in discovered(found):
        lines += ["", sentence]
    for one in told(found):
        lines += ["", title(one), *columns(COEFFICIENTS, rows(found, one))]
        lines += [f"  {sentence}" for sentence in population(found, one)]
    return "\n".join(lines)


def verdict(found: Campaign) -> str:
    """One sentence."""
    names = listing(dict.fromkeys(d.effect for d in found.found)) or "nothing"
    said = f"discovered on {len({d.unit for d in found.found})} of {len(found.units)} units: {names}"
    who = listing(dict.fromkeys(found.units[o.unit] for o in found.outliers))
    return f"{said}; outlying: {who}" if who else said


def head(found: Campaign) -> str:
    """What was judged."""
    return (
        f"{len(found.units)} units, {found.hypotheses} effects tried on them; of all that is called discovered, "
        f"{percent(found.rate)} is expected to be false."
    )


def verdicts(found: Campaign) -> list[tuple[str, ...]]:
    """A row for each target of each unit."""
    return [
        (unit, target.target, target.verdict, ", ".join(dict.fromkeys(a.effect for a in target.added)) or "nothing")
        for unit, one in zip(found.units, found.findings, strict=True)
        for target in one.targets
    ]


def discovered(found: Campaign) -> Iterator[str]:
    """What is discovered, where; what a unit names and the campaign doubts; who is an outlier."""
    for target, effect in dict.fromkeys((d.target, d.effect) for d in found.found):
        those = [d for d in found.found if (d.target, d.effect) == (target, effect)]
        named = [found.units[d.unit] for d in those if d.named]
        more = [found.units[d.unit] for d in those if not d.named]
        where = "all units" if len(those) == len(found.units) else listing([*named, *more])
        said = f"{effect} on {target} of {where}: discovered (p {p_value(max(d.p_value for d in those))} at most)"
        if more:
            said += f"; on {listing(more)} only among all units, not by its own search"
        yield f"{said}."
    for d in found.doubted:
        yield (
            f"{d.effect} on {d.target} of {found.units[d.unit]}: named there, and no discovery among all units "
            f"(p {p_value(d.p_value)})."
        )
    for o in found.outliers:
        c = o.coefficient
        yield (
            f"{found.units[o.unit]} is an outlier: its {c.effect} {c.parameter} on {c.target} is further off than the "
            f"others foretell (p {p_value(o.p_value)}, all looks counted)."
        )


def told(found: Campaign) -> list[Coefficient]:
    """Coefficients of which several units tell."""
    return [c for c in found.coefficients if c.pool is not None]


def title(one: Coefficient) -> str:
    """Name of a coefficient."""
    return f"{one.effect} {one.parameter} on {one.target}"


def rows(found: Campaign, one: Coefficient) -> list[tuple[str, ...]]:
    """A row for each unit, marked where it is an outlier."""
    unit, shrunk = _unit(one), _shrunk(one)
    return [
        (
            found.units[k] + (" (outlier)" if k in one.outlying else ""),
            how,
            unit.show_with_sd(value, sd),
            unit.show_with_sd(*shrunk[i]) if i in shrunk else "",
        )
        for i, (k, how, value, sd) in enumerate(zip(one.units, one.how, one.value, one.sd, strict=True))
    ]


def _shrunk(one: Coefficient) -> dict[int, tuple[float, float]]:
    """What each unit has with the others for its prior, by its place."""
    if one.pool is None:
        return {}
    pairs = zip(one.pool.shrunk.tolist(), one.pool.shrunk_sd.tolist(), strict=True)
    return dict(zip(one.kept, pairs, strict=True))


def population(found: Campaign, one: Coefficient) -> Iterator[str]:
    """What is common to the units, what is a unit's own, and what is to be expected of the next."""
    pool, unit = one.pool, _unit(one)
    if pool is None:
        yield f"fewer than {FEWEST} units tell it"
        return
    rest = " but the outlying" if one.outlying else ""
    yield f"common to all{rest}: {unit.show_with_sd(pool.mean, pool.sd)}{_common(pool)}"
    low, high = (unit.number(x, 2) for x in pool.spread_interval)
    more = "more" if pool.differ < SAID else "no more"
    differ = f"they differ by {more} than chance (p {p_value(pool.differ)})"
    yield f"between units: {unit.show(pool.spread, 2)} ({low} to {high}, 95 %); {differ}"
    first, last = pool.ahead
    share = pool.left_out(one.sd)
    said = f"of the next unit expected: {unit.number(first)} to {unit.show(last)} (95 %)"
    yield said + (f"; worth {percent(share)} of its test, which could be left out" if share >= WORTH else "")


def _common(pool: Pool) -> str:
    return f" (p {p_value(pool.common)})" if pool.common < SAID else ", not told from nothing"


def _unit(one: Coefficient) -> ShownUnit:
    return unit_for(one.si_unit, *map(float, (*one.value, *one.sd)))


def to_json(found: Campaign) -> dict[str, Any]:
    """All figures in SI units; null stands for what is not finite."""
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "units": [
            {
                "unit": unit,
                "manifest": one.manifest,
                "title": one.title,
                "verdicts": {t.target: t.verdict for t in one.targets},
                **filed(one.filing),
            }
            for unit, one in zip(found.units, found.findings, strict=True)
        ],
        "false_discovery_rate": found.rate,
        "hypotheses": found.hypotheses,
        "discoveries": [
            {
                "unit": found.units[d.unit],
                "target": d.target,
                "effect": d.effect,
                "p_value": d.p_value,
                "named": d.named,
            }
            for d in found.found
        ],
        "doubted": [
            {"unit": found.units[d.unit], "target": d.target, "effect": d.effect, "p_value": d.p_value}
            for d in found.doubted
        ],
        "coefficients": [_coefficient(found, c) for c in found.coefficients],
        "outliers": [
            {
                "unit": found.units[o.unit],
                "target": o.coefficient.target,
                "effect": o.coefficient.effect,
                "name": o.coefficient.parameter,
                "p_value": o.p_value,
            }
            for o in found.outliers
        ],
        **stamp(),
    }
    return {key: strict(value) for key, value in document.items()}


def _coefficient(found: Campaign, one: Coefficient) -> dict[str, Any]:
    pool, shrunk = one.pool, _shrunk(one)
    each = zip(one.units, one.how, one.value, one.sd, strict=True)
    units = [
        {
            "unit": found.units[k],
            "how": how,
            "value": float(value),
            "sd": float(sd),
            **({"shrunk": shrunk[i][0], "shrunk_sd": shrunk[i][1]} if i in shrunk else {}),
        }
        for i, (k, how, value, sd) in enumerate(each)
    ]
    told = pool and {
        "mean": pool.mean,
        "mean_sd": pool.sd,
        "p_common": pool.common,
        "spread": pool.spread,
        "spread_interval": list(pool.spread_interval),
        "p_differ": pool.differ,
        "next": {"interval": list(pool.ahead), "sd": pool.ahead_sd},
        "left_out": pool.left_out(one.sd),
    }
    return {
        "target": one.target,
        "effect": one.effect,
        "name": one.parameter,
        "si_unit": one.si_unit,
        "units": units,
        "population": told,
    }


def write_json(found: Campaign, path: str | os.PathLike[str]) -> Path:
    """Write `to_json` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    return write_whole(path, json_text(to_json(found)))


def write_html(found: Campaign, path: str | os.PathLike[str]) -> Path:
    """Write the page to ``path``, whole or not at all; nothing is loaded from elsewhere.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    page = rendered(
        "campaign.html.j2",
        Filing(files=tuple(file for one in found.findings for file in one.filing.files)),
        title=f"Campaign of {len(found.units)} units",
        verdict=verdict(found)[0].upper() + verdict(found)[1:],
        head=head(found),
        header=VERDICTS,
        verdicts=verdicts(found),
        discovered=list(discovered(found)),
        columns=COEFFICIENTS,
        coefficients=[(title(c), rows(found, c), list(population(found, c))) for c in told(found)],
    )
    return write_whole(path, page)
