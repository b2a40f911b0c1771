"""A design as text and JSON; angles in arcsec and shares in ppm for people, SI for machines."""

from __future__ import annotations

import os
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Any

from insenv.core.files import write_whole
from insenv.core.filing import stamp
from insenv.design.designing import DESIGNED, PUBLISHED, Designed
from insenv.design.front import Point
from insenv.design.played import Influence, PlayedCheck
from insenv.evaluate.words import columns, number, shown

SCHEMA = "insenv.information/1"
FRONT = ("time [s]", "bound", "procedure")
CHECKS = ("procedure", "estimator", "time [s]", "runs", "rms", "claimed", "bound", "error / claimed")
INFLUENCES = ("effect", "designed", "published")


def title(found: Designed) -> str:
    """What was designed."""
    return f"{found.scenario}: {found.quantity.name} [{unit(found)}]"


def unit(found: Designed) -> str:
    """In which the quantity is shown."""
    return shown(found.quantity.unit)[0]


def demand(found: Designed) -> str:
    """What was asked for, as a sentence."""
    if found.goal == "accuracy":
        return f"Asked for: the least standard deviation in {found.asked:.6g} s"
    price = f"; {found.estimator} has {found.price:.3g} times the bound" if found.price > 1.005 else ""
    return (
        f"Asked for: the least time to a standard deviation of {found.asked / _scale(found):.4g} {unit(found)}{price}"
    )


def sentences(found: Designed) -> list[str]:
    """What was found: the two procedures and their ratio."""
    scale, name = _scale(found), unit(found)
    lines = [
        f"{label}: {_words(point, scale, name)}"
        for label, point in ((DESIGNED, found.chosen), (PUBLISHED, found.published))
    ]
    if isfinite(found.published.sd):
        times, sds = found.chosen.time / found.published.time, found.chosen.sd / found.published.sd
        lines.append(f"Beside the published one: {_beside(times)} time, {_beside(sds)} standard deviation.")
    return lines


def _beside(ratio: float) -> str:
    """A ratio in words: "the same", "31 % smaller", "2.3 times the"."""
    if abs(ratio - 1) < 0.005:
        return "the same"
    if ratio < 1:
        return f"{100 * (1 - ratio):.2g} % less" if ratio > 0.1 else f"{ratio:.2g} of the"
    return f"{ratio:.3g} times the"


def _words(point: Point, scale: float, name: str) -> str:
    told = "".join(f", {key} {value:.1%}" for key, value in point.plan.told.items())
    return f"{point.time:.6g} s, bound {point.sd / scale:.4g} {name}{told}: {point.plan.words}"


def promise(found: Designed) -> str:
    """What the designed procedure promises, for the head of its scenario."""
    checked = [c for c in found.checks if c.procedure == DESIGNED]
    played = "".join(
        f" In {c.runs} runs {c.estimator} erred by {number(c.score.rms, _scale(found))} {unit(found)} rms."
        for c in checked
    )
    return (
        f"Designed by `insenv design` for {found.scenario}. {found.quantity.name} in {found.chosen.time:.6g} s with a "
        f"standard deviation of {found.chosen.sd / _scale(found):.4g} {unit(found)} at least (bound); the published "
        f"procedure: {found.published.time:.6g} s, {found.published.sd / _scale(found):.4g} {unit(found)}.{played} "
        f"What it does: {found.chosen.plan.words}."
    )


def summary(found: Designed) -> str:
    """In words and numbers, for a terminal."""
    lines = [title(found), f"{demand(found)}.", *sentences(found), *(f"Remark: {r}." for r in found.remarks)]
    lines += ["", "Time against accuracy", *columns(FRONT, front_rows(found))]
    if found.checks:
        lines += [
            "",
            f"Checked by Monte Carlo, seeds {found.seeds.start} to {found.seeds.stop - 1}; +-: 95 % intervals",
        ]
        lines += columns(CHECKS, check_rows(found))
    if found.influences:
        lines += ["", f"Sensitivity to undeclared effects, rms over runs [{unit(found)}]"]
        lines += columns(INFLUENCES, influence_rows(found))
    return "\n".join(lines)


def front_rows(found: Designed) -> list[tuple[str, ...]]:
    """A row of `FRONT` for each procedure that no other beats, and the published one."""
    points = [*found.front, found.published]
    rows: list[tuple[str, ...]] = []
    for point in sorted(points, key=lambda p: p.time):
        marked = " (published)" if point is found.published else ""
        rows.append((f"{point.time:.6g}", f"{point.sd / _scale(found):.4g}", f"{point.plan.words}{marked}"))
    return rows


def check_rows(found: Designed) -> list[tuple[str, ...]]:
    """A row of `CHECKS` for each Monte Carlo."""
    scale = _scale(found)
    return [
        (
            c.procedure, c.estimator, f"{c.time:.6g}", str(c.runs), number(c.score.rms, scale),
            f"{c.score.told / scale:.4g}", "" if c.score.bound is None else f"{c.score.bound / scale:.4g}",
            number(c.score.spread),
        )
        for c in found.checks
    ]  # fmt: skip


def influence_rows(found: Designed) -> list[tuple[str, ...]]:
    """A row of `INFLUENCES` for each effect."""
    scale = _scale(found)
    return [
        (effect_words(one.effect), *(f"{one.procedures[name][1] / scale:.3g}" for name in (DESIGNED, PUBLISHED)))
        for one in found.influences
    ]


def effect_words(effect: Mapping[str, Any]) -> str:
    """An effect with its parameters."""
    targets = effect.get("targets")
    of = "" if targets is None else f" of {targets}"
    given = ", ".join(f"{key} = {value}" for key, value in effect.items() if key not in ("effect", "targets"))
    return f"{effect['effect']}{of}: {given}"


def write_json(found: Designed, path: str | os.PathLike[str]) -> Path:
    """Write `to_json` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    import json

    return write_whole(path, json.dumps(to_json(found), indent=1, allow_nan=False) + "\n")


def to_json(found: Designed) -> dict[str, Any]:
    """All numbers in SI units, intervals as [low, high]; null where there is none."""
    return {
        "schema": SCHEMA,
        "scenario": found.scenario,
        "task": found.task,
        "quantity": {"name": found.quantity.name, "unit": found.quantity.unit},
        "goal": found.goal,
        "asked": found.asked,
        "estimator": found.estimator,
        "price": found.price,
        "designed": _point(found.chosen),
        "published": _point(found.published),
        "front": [_point(point) for point in found.front],
        "seeds": [found.seeds.start, found.seeds.stop - 1] if len(found.seeds) else None,
        "checks": [_check(one) for one in found.checks],
        "influences": [_influence(one) for one in found.influences],
        "remarks": list(found.remarks),
        **stamp(),
    }


def _point(point: Point) -> dict[str, Any]:
    return {
        "time_s": point.time,
        "bound": point.sd if isfinite(point.sd) else None,
        "words": point.plan.words,
        "values": dict(point.plan.values),
        "told": dict(point.plan.told),
        "changes": dict(point.plan.changes),
    }


def _check(one: PlayedCheck) -> dict[str, Any]:
    s = one.score
    interval = [s.rms[0] - s.rms[1], s.rms[0] + s.rms[1]]
    return {
        "procedure": one.procedure,
        "estimator": one.estimator,
        "runs": one.runs,
        "time_s": one.time,
        "rms": {"value": s.rms[0], "interval": interval if isfinite(s.rms[1]) else None},
        "bias": s.bias[0],
        "told_rms": s.told if isfinite(s.told) else None,
        "bound": s.bound,
        "z_spread": s.spread[0] if isfinite(s.spread[0]) else None,
    }


def _influence(one: Influence) -> dict[str, Any]:
    moved = {name: {"mean": mean, "rms": rms} for name, (mean, rms) in one.procedures.items()}
    return {"effect": dict(one.effect), **moved}


def _scale(found: Designed) -> float:
    return shown(found.quantity.unit)[1]
