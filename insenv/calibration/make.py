"""Findings -> a calibration: every term with its parameters, declared and added."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable

import numpy as np

from insenv.calibration.contents import HELD, LINE, SCHEMA, Parameter, Run, Target, Term
from insenv.calibration.model import Calibration
from insenv.core.errors import InputError
from insenv.core.version import VERSION
from insenv.data.manifest import Manifest
from insenv.effects.angle import EarthRate
from insenv.effects.base import Effect
from insenv.effects.bias import Bias
from insenv.effects.catalogue import RESERVED, by_key, plug_in_of
from insenv.effects.timing import SampleHold
from insenv.effects.tone import Tone
from insenv.identify.findings import Added, Covariance, Estimate, Findings, TargetFindings

#: What cannot be taken out of readings: beyond a rail nothing was read, and a table's errors are not theirs.
LOST = tuple(RESERVED)


def calibration(found: Findings, manifest: Manifest) -> Calibration:
    """What was found, as an object that corrects recordings.

    Parameters
    ----------
    found : Findings
        Of `insenv.close.close` on ``manifest``.
    manifest : Manifest

    Raises
    ------
    InputError
        If the manifest cannot be read any more.
    """
    try:
        sha256 = hashlib.sha256(manifest.path.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(f"{manifest.path}: the manifest cannot be read ({error.strerror or error})") from None
    return Calibration(
        schema=SCHEMA,
        insenv=VERSION,
        title=manifest.title,
        manifest=manifest.path.name,
        sha256=sha256,
        reference_temperature=manifest.model.reference_temperature,
        with_earth=EarthRate.id in manifest.model.declared,
        runs=[
            Run(r.label, r.sha256, r.mounting.tilt, r.mounting.axes, r.mounting.table_axis, r.site.latitude)
            for r in found.runs
        ],
        targets=[_target(target, found, manifest.model.bias) for target in found.targets],
    )


def _target(target: TargetFindings, found: Findings, bias: str | None) -> Target:
    joint = target.covariance or Covariance((), np.zeros(0), np.zeros((0, 0)))
    # Where runs share a bias it has no number of a run; of a single run nobody can tell, but by what was said.
    of_run = any(key == Bias.id and "[" in name for key, name in joint.names) or (
        len(found.runs) == 1 and bias != "common"
    )
    terms = [
        _declared(by_key(key), rows, joint, of_run and key == Bias.id)
        for key, rows in _by_effect(target.estimates_after).items()
    ]
    return Target(
        target=target.target,
        unit="m/s^2" if target.unit == "m/s^2" else "rad/s",
        verdict=target.verdict,
        terms=[*terms, *(_added(one, joint) for one in target.added if one.effect not in LOST)],
        covariance=joint.matrix.tolist(),
    )


def _by_effect(estimates: Iterable[Estimate]) -> dict[str, list[Estimate]]:
    groups: dict[str, list[Estimate]] = {}
    for estimate in estimates:
        groups.setdefault(estimate.effect, []).append(estimate)
    return groups


def _declared(effect: Effect, rows: list[Estimate], joint: Covariance, of_run: bool) -> Term:
    return Term(
        effect.key,
        "declared",
        _parameters(effect, rows, joint, of_run),
        run_dependent=of_run,
        plug_in=plug_in_of(effect),
    )


def _added(added: Added, joint: Covariance) -> Term:
    effect = by_key(added.effect if added.order is None else f"{added.effect}:{added.order}")
    parameters = _parameters(effect, added.parameters, joint, False)
    return Term(
        effect.key,
        "added",
        parameters,
        generic=added.generic,
        fitted=not added.indirect,
        confounded_with=list(added.confounded_with),
        runs=list(added.runs),
        plug_in=plug_in_of(effect),
    )


def _parameters(effect: Effect, rows: Iterable[Estimate], joint: Covariance, of_run: bool) -> list[Parameter]:
    """The effect's own parameters: what is derived from them, as a root or a rate, is left out."""
    own = {p.name for p in effect.params} | set({Tone.id: LINE, SampleHold.id: HELD}.get(effect.id, {}))
    found = []
    for row in rows:
        name, bracket, _ = row.parameter.partition("[")
        if name not in own:
            continue
        index = _row(joint, row)
        run = None
        if of_run:
            full = row.parameter if bracket or index is None else joint.names[index][1]
            run = int(full.partition("[")[2].rstrip("]") or 1)
        sd = float(row.sd) if math.isfinite(row.sd) else None
        found.append(Parameter(name, float(row.value), sd, row.unit, run, index))
    return found


def _row(joint: Covariance, row: Estimate) -> int | None:
    """Where an estimate stands in the covariance."""
    for index, ((key, name), value) in enumerate(zip(joint.names, joint.values, strict=True)):
        if key == row.effect and value == row.value and row.parameter in (name, name.partition("[")[0]):
            return index
    return None
