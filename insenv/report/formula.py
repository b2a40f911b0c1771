"""The formula that was found, in sentences, in the JSON, and as a file of Python that the next search tries."""

from __future__ import annotations

import os
from collections.abc import Sequence
from math import floor, log10
from pathlib import Path
from typing import Any

from insenv.core.console.progress import check_folder
from insenv.core.errors import InputError
from insenv.core.files import write_whole
from insenv.core.quantities import p_value, unit_for
from insenv.effects.formula import LAG, name_of, product
from insenv.identify.findings import Estimate, Findings, FoundFormula, TargetFindings
from insenv.report.estimates import value
from insenv.report.words import listing

#: Credible coefficients of an effect that was found: up to so many times the one that was.
_BOUND = 10.0
#: Deviations within which a coefficient may be.
_UP_TO = 3.0


def sentences(target: TargetFindings) -> list[str]:
    """What the search among formulas came to; none where none was asked for."""
    sought = target.formulas
    if sought is None:
        return []
    if sought.found is None:
        return [f"No formula is told ({sought.tried} tried): {sought.reason}."]
    found = sought.found
    unit = unit_for(target.unit, found.held_out_before, found.held_out_after)
    size = ", ".join(f"{p.parameter} = {value(p)}" for p in found.parameters)
    than = f"more than {listing(found.instead_of)}" if found.instead_of else "what is left"
    errors = f"{unit.number(found.held_out_before)} → {unit.show(found.held_out_after)}"
    said = [
        f"A formula whose cause is not known explains {than}: c {found.formula}, {size} "
        f"(p {p_value(found.p_value)} with all {sought.tried} formulas counted, held-out error {errors})."
    ]
    if found.alike:
        said.append(f"This recording does not tell it from {listing(found.alike, 'or')}.")
    return said


def block(target: TargetFindings) -> dict[str, Any] | None:
    """What stands in the JSON of a target."""
    sought = target.formulas
    if sought is None:
        return None
    found = sought.found
    return {
        "tried": sought.tried,
        "reason": sought.reason,
        "found": None
        if found is None
        else {
            "formula": found.formula,
            "effect": name_of(found.formula),
            "parameters": [
                {"name": p.parameter, "value": p.value, "sd": p.sd, "unit": p.unit} for p in found.parameters
            ],
            "p_value": found.p_value,
            "likelihood_ratio": found.likelihood_ratio,
            "alike": list(found.alike),
            "instead_of": list(found.instead_of),
            "held_out_before": found.held_out_before,
            "held_out_after": found.held_out_after,
        },
    }


def check_path(path: Path | None) -> None:
    """Refuse a file for the effects before the work is done."""
    if path is None:
        return
    if path.suffix != ".py":
        raise InputError(f"{path}: an effect is Python; wanted a file whose name ends with .py")
    check_folder(path)


def write_effects(findings: Findings, path: str | os.PathLike[str]) -> Path | None:
    """Write what was found to ``path`` as effects, or nothing where nothing was.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    found = [(t, t.formulas.found) for t in findings.targets if t.formulas is not None and t.formulas.found is not None]
    if not found:
        return None
    kinds: dict[tuple[str, str], list[tuple[TargetFindings, FoundFormula]]] = {}
    for target, one in found:
        kinds.setdefault((one.formula, _instrument(target)), []).append((target, one))
    bases = sorted({_base(one) for _, one in found})
    lines = [
        '"""Effects that a search among formulas found, without a known cause: `insenv close-loop` tries them where',
        '`[model] effects` of a manifest has this file."""',
        "",
        f"from insenv.effects.formula import {', '.join([*bases, 'coefficient'])}",
    ]
    for (_, instrument), each in kinds.items():
        lines += ["", "", *_class(findings, instrument, each, len({i for _, i in kinds}) > 1)]
    return write_whole(path, "\n".join([*lines, ""]))


def _instrument(target: TargetFindings) -> str:
    return "accelerometer" if target.unit == "m/s^2" else "gyro"


def _base(found: FoundFormula) -> str:
    return "LaggedFormula" if found.formula.startswith(LAG) else "Formula"


def _class(
    findings: Findings, instrument: str, each: Sequence[tuple[TargetFindings, FoundFormula]], both: bool
) -> list[str]:
    """The lines of one effect; ``each`` has the targets on which it was found."""
    target, found = each[0]
    key = name_of(found.formula) + (f"_{instrument}" if both else "")
    tried = target.formulas.tried if target.formulas is not None else 0
    hashed = f", sha256 {findings.runs[0].sha256[:12]}" if findings.runs else ""
    where = f"{findings.title or findings.manifest} ({findings.manifest}{hashed})"
    said = "; ".join(f"{t.target}: " + ", ".join(_plain(p) for p in one.parameters) for t, one in each)
    alike = f"As good on that recording: {', '.join(found.alike)}." if found.alike else "No other formula is as good."
    linear = ", ".join(_coefficient(name, instrument, [one for _, one in each]) for name in _names(found.formula))
    source = (
        f"found on {where}: p = {found.p_value:.1g} with all {tried} formulas counted; held-out error "
        f"{found.held_out_before:.3g} -> {found.held_out_after:.3g} {target.held_out.unit}. No cause is known"
    )
    return [
        f"class {_class_name(key)}({_base(found)}):",
        f'    """c {found.formula}.',
        "",
        *(f"    {line}" for line in (_escaped(said), alike)),
        '    """',
        "",
        f"    id = {key!r}",
        f"    formula = {found.formula!r}",
        f"    title = {found.formula!r}",
        '    meaning = "a formula that was found on a recording, without a known cause"',
        f"    linear = ({linear},)",
        f"    instruments = ({instrument!r},)",
        f"    source = {source!r}",
    ]


def _names(formula: str) -> list[str]:
    return list(product(formula).coefficients("gyro"))


def _coefficient(name: str, instrument: str, found: Sequence[FoundFormula]) -> str:
    """The line of a coefficient; one that the model had already, as a gain, was not fitted: it may be what it will."""
    # Both of a wave are one amplitude, and an origin that is where it was measured from may be elsewhere the next time.
    alike = [p for one in found for p in one.parameters if p.parameter[1:] == name[1:]]
    sizes = [max(abs(p.value), _UP_TO * p.sd) for p in alike]
    size = max(sizes, default=0.0)
    bound = f", bound={_rounded(_BOUND * size):.2g}" if size else ""
    return f'coefficient(formula, "{instrument}", sd={_rounded(size) if size else 1.0:.2g}{bound}, name="{name}")'


def _plain(p: Estimate) -> str:
    return f"{p.parameter} = {p.value:.4g} ± {p.sd:.1g} {p.unit}"


def _escaped(text: str) -> str:
    return text.replace("\\", "/").replace('"', "'")


def _rounded(size: float) -> float:
    """One figure, upwards."""
    decade = 10.0 ** floor(log10(max(size, 1e-300)))
    return decade * (floor(size / decade) + 1)


def _class_name(key: str) -> str:
    return "".join(part.capitalize() for part in key.split("_"))
