"""An evaluation as text, JSON and rows of tables; angles in arcsec and shares in ppm."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict
from math import isfinite, log10
from pathlib import Path
from typing import Any

from insenv.core.errors import InputError
from insenv.core.files import write_whole
from insenv.core.filing import stamp
from insenv.core.units import ARCSEC, PPM
from insenv.evaluate.evaluation import Evaluation
from insenv.evaluate.scores import FALSE_ALARM, Paired, QuantityScore, Scored, Value

SCHEMA = "insenv.evaluate/1"
#: How SI units are shown.
_SHOWN = {"rad": ("arcsec", ARCSEC), "1": ("ppm", PPM)}
HEADER = (
    "policy",
    "estimator",
    "bias",
    "standard deviation",
    "rms",
    "claimed",
    "error / claimed",
    "NEES",
    "efficiency",
    "time [s]",
    "CPU [ms]",
    "estimator [ms]",
)
PAIRED = ("policy", "estimator", "bias", "rms")
#: Digits behind the point, at most.
_MOST = 6


def shown(unit: str) -> tuple[str, float]:
    """Name of a unit for people, and what it is in SI."""
    return _SHOWN.get(unit, (unit, 1.0))


def quantities(found: Evaluation) -> list[tuple[str, str]]:
    """Every quantity that was scored, and its SI unit."""
    return list(dict.fromkeys((s.quantity, s.unit) for one in found.scored for s in one.scores))


def rows(found: Evaluation, quantity: str) -> list[tuple[str, ...]]:
    """A row of `HEADER` for each pair that tells this quantity."""
    return [_row(one, s) for one in found.scored for s in one.scores if s.quantity == quantity]


def paired_rows(found: Evaluation, quantity: str) -> list[tuple[str, ...]]:
    """A row of `PAIRED` for each pair but the first."""
    scale = shown(dict(quantities(found))[quantity])[1]
    return [
        (p.pair[1], p.pair[0], number(p.bias, scale), number(p.rms, scale))
        for p in found.paired
        if p.quantity == quantity
    ]


def first(found: Evaluation) -> str:
    """The pair that the others are compared with."""
    one = next(s for s in found.scored if not s.fault)
    return f"{one.policy} with {one.estimator}"


def head(found: Evaluation) -> str:
    """What was played."""
    return (
        f"{found.environment}, {found.scenario}: {found.count} runs, seeds {found.first} to "
        f"{found.first + found.count - 1}, the same for all"
    )


def bound(found: Evaluation, quantity: str) -> str:
    """The bounds of a quantity, by policy."""
    known = {one.policy: s for one in found.scored for s in one.scores if s.quantity == quantity and s.bound}
    return ", ".join(f"{policy} {s.bound / shown(s.unit)[1]:.4g}" for policy, s in known.items() if s.bound)


def summary(found: Evaluation) -> str:
    """In words and numbers, for a terminal."""
    lines = [head(found), "+- are 95 % intervals."]
    for quantity, unit in quantities(found):
        name = shown(unit)[0]
        lines += ["", f"{quantity} [{name}]", *columns(HEADER, rows(found, quantity))]
        if least := bound(found, quantity):
            lines.append(f"Cramer-Rao bound of the deviation: {least}")
        if others := paired_rows(found, quantity):
            lines += ["", f"{quantity} [{name}], difference from {first(found)} on the same runs"]
            lines += columns(PAIRED, others)
    if warned := beyond(found):
        lines += ["", *warned]
    if found.faults:
        lines += ["", "Without a result:", *(f"- {fault}" for fault in found.faults)]
    return "\n".join(lines)


def beyond(found: Evaluation) -> list[str]:
    """A sentence for each pair that errs less than the bound allows."""
    return [
        f"Beyond the bound: {one.estimator} under {one.policy}, {s.quantity}: rms {s.rms[0] / shown(s.unit)[1]:.3g} "
        f"against {s.bound / shown(s.unit)[1]:.4g} {shown(s.unit)[0]}. Who knows the data alone errs as little once in "
        f"{1 / FALSE_ALARM:,.0f} evaluations: it knows the truth, or has guessed what hardly differs from run to run."
        for one in found.scored
        for s in one.scores
        if s.beyond and s.bound is not None
    ]


def write_json(found: Evaluation, path: str | os.PathLike[str]) -> Path:
    """Write `to_json` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    import json

    return write_whole(path, json.dumps(to_json(found), indent=1, allow_nan=False) + "\n")


def to_json(found: Evaluation) -> dict[str, Any]:
    """All numbers in SI units, intervals as [low, high]; null where there is none."""
    return {
        "schema": SCHEMA,
        "environment": found.environment,
        "scenario": found.scenario,
        "seeds": [found.first, found.first + found.count - 1],
        "every": found.every,
        "beyond_bound_false_alarm": FALSE_ALARM,
        "pairs": [_pair(one) for one in found.scored],
        "paired": [_difference(one) for one in found.paired],
        **stamp(),
    }


def number(value: Value | None, scale: float = 1.0) -> str:
    """A value with half of its interval, to two digits of that."""
    if value is None:
        return ""
    middle, half = value[0] / scale, value[1] / scale
    if not (isfinite(half) and half > 0):
        return f"{middle:.4g}"
    digits = max(0, 1 - int(log10(half) // 1))
    if digits > _MOST:
        return f"{middle:.2g} +- {half:.1g}"
    return f"{middle:.{digits}f} +- {half:.{digits}f}"


def named(text: str, what: str) -> list[str]:
    """Names separated by commas.

    Raises
    ------
    InputError
        If one is empty.
    """
    found = [part.strip() for part in text.split(",")]
    if not all(found):
        raise InputError(f"--{what} {text!r} given; wanted names separated by commas")
    return found


def _row(one: Scored, s: QuantityScore) -> tuple[str, ...]:
    scale = shown(s.unit)[1]
    return (
        one.policy,
        one.estimator,
        *(number(value, scale) for value in (s.bias, s.deviation, s.rms)),
        f"{s.told / scale:.4g}",
        number(s.spread),
        number(one.nees),
        number(s.efficiency) + (" beyond the bound" if s.beyond else ""),
        f"{one.time:.6g}",
        f"{1e3 * one.cpu:.3g}",
        f"{1e3 * one.cpu_estimator:.3g}",
    )


def _pair(one: Scored) -> dict[str, Any]:
    if one.fault:
        return {"estimator": one.estimator, "policy": one.policy, "fault": one.fault}
    return {
        "estimator": one.estimator,
        "policy": one.policy,
        "fault": None,
        "runs": one.runs,
        "quantities": [_score(s) for s in one.scores],
        "nees": _interval(one.nees),
        "instrument_time_s": one.time,
        "stopped_share": one.stopped,
        "cpu_s_per_run": one.cpu,
        "estimator_cpu_s_per_run": one.cpu_estimator,
    }


def _score(s: QuantityScore) -> dict[str, Any]:
    return {
        "name": s.quantity,
        "unit": s.unit,
        "bias": _interval(s.bias),
        "standard_deviation": _interval(s.deviation),
        "rms": _interval(s.rms),
        "told_rms": _number(s.told),
        "z_spread": _interval(s.spread),
        "bound": s.bound,
        "efficiency": None if s.efficiency is None else _interval(s.efficiency),
        "beyond_bound": s.beyond,
        "chance_within_bound": s.chance,
    }


def _difference(one: Paired) -> dict[str, Any]:
    names = ("estimator", "policy")
    kept = {k: v for k, v in asdict(one).items() if k == "quantity"}
    return {
        **kept,
        "pair": dict(zip(names, one.pair, strict=True)),
        "first": dict(zip(names, one.first, strict=True)),
        "bias": _interval(one.bias),
        "rms": _interval(one.rms),
    }


def _interval(value: Value) -> dict[str, Any]:
    middle, half = value
    bounded = isfinite(middle) and isfinite(half)
    return {"value": _number(middle), "interval": [middle - half, middle + half] if bounded else None}


def _number(value: float) -> float | None:
    return value if isfinite(value) else None


def columns(header: tuple[str, ...], body: list[tuple[str, ...]]) -> Iterator[str]:
    """A table in columns; those that are empty in every row are left out."""
    kept = [j for j in range(len(header)) if any(row[j] for row in body)]
    table = [tuple(row[j] for j in kept) for row in (header, *body)]
    widths = [max(len(cell) for cell in column) for column in zip(*table, strict=True)]
    for row in table:
        yield "  " + "  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip()
