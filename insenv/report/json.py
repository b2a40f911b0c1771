"""Findings as JSON by the contract ``insenv.close-loop/1``: SI units; null stands for what is not finite.

One target: its blocks stand at the top. Several: every entry of a list carries its ``target``, ``held_out``
and ``noise`` map targets to their blocks, ``verdicts`` holds each target's own verdict.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from insenv.core.files import json_text, write_whole
from insenv.core.filing import filed, stamp
from insenv.identify.findings import (
    Added,
    Derived,
    Detectable,
    Estimate,
    Findings,
    HeldOut,
    NextExperiment,
    TargetFindings,
    WholeError,
)
from insenv.report import formula

SCHEMA = "insenv.close-loop/1"

Block = dict[str, Any]


def to_json(findings: Findings) -> Block:
    """``findings`` as plain dictionaries, lists, strings and finite numbers."""
    targets = findings.targets
    document: Block = {
        "schema": SCHEMA,
        "manifest": findings.manifest,
        "title": findings.title,
        "rows": findings.rows,
        "duration_s": findings.duration,
        "verdict": findings.verdict,
        "declared": list(dict.fromkeys(key for target in targets for key in target.declared)),
        **(_blocks(targets[0]) if len(targets) == 1 else _blocks_of_several(targets)),
        "alpha": findings.alpha,
        "seed": findings.seed,
        "remarks": list(findings.remarks),
        "rows_rejected": [
            {
                "run": r.run + 1,
                "target": r.target,
                "rows": [r.start, r.stop],
                "reason": r.reason,
                "cause": r.cause,
                "size": r.size,
            }
            for r in findings.rows_rejected
        ],
        "common_mode": [{"channels": list(c.channels), "correlation": c.correlation} for c in findings.common_mode],
        "source": findings.source,
        "licence": findings.licence,
        **stamp(),
        **filed(findings.filing),
    }
    return {key: strict(value) for key, value in document.items()}


def write_json(findings: Findings, path: str | os.PathLike[str]) -> Path:
    """Write `to_json` to ``path``, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    return write_whole(path, json_text(to_json(findings)))


def _blocks(target: TargetFindings) -> Block:
    """What stands at the top for one target."""
    return {
        "target": target.target,
        "reasons": list(target.reasons),
        "added": [_added(one) for one in target.added],
        "held_out": _held_out(target.held_out),
        "estimates": {
            "before": [_estimate(one) for one in target.estimates_before],
            "after": [_estimate(one) for one in target.estimates_after],
        },
        "noise": _noise(target.noise),
        "rejected": [
            {
                "effect": r.effect,
                "p_value": r.p_value,
                "likelihood_ratio": r.likelihood_ratio,
                "reason": r.reason,
                "smallest_detectable": r.smallest_detectable and _detectable(r.smallest_detectable),
            }
            for r in target.rejected
        ],
        "not_testable": [
            {"effect": n.effect, "needs": list(n.needs), "reason": n.reason, "smallest_detectable": None}
            for n in target.not_testable
        ],
        "next_experiment": [_experiment(one) for one in target.next_experiment],
        "derived": [_derived(one) for one in target.derived],
        "cautions": list(target.cautions),
        **({"formula": sought} if (sought := formula.block(target)) is not None else {}),
    }


def _blocks_of_several(targets: tuple[TargetFindings, ...]) -> Block:
    """The blocks of several targets, joined."""
    each = {target.target: _blocks(target) for target in targets}

    def joined(pick: Callable[[Block], list[Block]]) -> list[Block]:
        return [{"target": name, **entry} for name, block in each.items() for entry in pick(block)]

    return {
        "verdicts": {target.target: target.verdict for target in targets},
        "reasons": {name: block["reasons"] for name, block in each.items()},
        "declared_by_target": {target.target: list(target.declared) for target in targets},
        "added": joined(lambda b: b["added"]),
        "held_out": {name: block["held_out"] for name, block in each.items()},
        "estimates": {
            "before": joined(lambda b: b["estimates"]["before"]),
            "after": joined(lambda b: b["estimates"]["after"]),
        },
        "noise": {name: block["noise"] for name, block in each.items()},
        "rejected": joined(lambda b: b["rejected"]),
        "not_testable": joined(lambda b: b["not_testable"]),
        "next_experiment": joined(lambda b: b["next_experiment"]),
        "derived": joined(lambda b: b["derived"]),
        "cautions": {name: block["cautions"] for name, block in each.items()},
        **(
            {"formula": {n: b["formula"] for n, b in each.items()}}
            if all("formula" in b for b in each.values())
            else {}
        ),
    }


def _detectable(least: Detectable) -> Block:
    at = [{"name": name, "value": value, "unit": unit} for name, (value, unit) in least.at.items()]
    return {"name": least.name, "value": least.value, "unit": least.unit, "at": at}


def _added(added: Added) -> Block:
    return {
        "effect": added.effect,
        "order": added.order,
        "parameters": [{"name": p.parameter, "value": p.value, "sd": p.sd, "unit": p.unit} for p in added.parameters],
        "p_value": added.p_value,
        "likelihood_ratio": added.likelihood_ratio,
        "confounded_with": list(added.confounded_with),
        **({"same_curve": list(added.same_curve)} if added.same_curve else {}),
        "held_out_before": added.held_out_before,
        "held_out_after": added.held_out_after,
        "generic": added.generic,
        "remark": added.remark,
        **({"held_out_unit": added.unit} if added.unit else {}),
        **({} if (error := added.whole()) is None else {"whole_search": _whole(error)}),
    }


def _whole(error: WholeError) -> Block:
    """The error of the whole search for a finding."""
    return {"p_value": error.p, "draws": error.draws, "agrees": error.agrees}


def _estimate(estimate: Estimate) -> Block:
    return {
        "effect": estimate.effect,
        "name": estimate.parameter,
        "value": estimate.value,
        "sd": estimate.sd,
        "unit": estimate.unit,
    }


def _held_out(held_out: HeldOut) -> Block:
    return {
        "before": held_out.before,
        "after": held_out.after,
        "noise_floor": held_out.noise_floor,
        "unit": held_out.unit,
        "averaging_s": held_out.averaging,
        **({"of": held_out.of} if held_out.of else {}),
    }


def _noise(noise: Iterable[Estimate]) -> Block:
    """Noise coefficients by effect; a second parameter of one effect goes by ``effect.parameter``."""
    block: Block = {}
    for one in noise:
        key = one.effect if one.effect not in block else f"{one.effect}.{one.parameter}"
        block[key] = {"value": one.value, "sd": one.sd, "unit": one.unit}
    return block


def _experiment(experiment: NextExperiment) -> Block:
    return {
        "separates": list(experiment.separates),
        "procedure": experiment.procedure,
        "expected_separation_sigma": experiment.expected_separation_sigma,
        "profile": None if experiment.profile is None else dict(experiment.profile),
        "changes": None if experiment.changes is None else dict(experiment.changes),
        "pairs": [{"effects": list(pair.effects), "sigma": pair.sigma} for pair in experiment.pairs],
    }


def _derived(derived: Derived) -> Block:
    return {
        "name": derived.name,
        "unit": derived.unit,
        "before": {"value": derived.before.value, "sd": derived.before.sd},
        "after": {"value": derived.after.value, "sd": derived.after.sd},
    }


def strict(value: Any) -> Any:
    """The same with Python's own numbers, and None for what JSON has no number for."""
    if isinstance(value, dict):
        return {key: strict(item) for key, item in value.items()}
    if isinstance(value, list):
        return [strict(item) for item in value]
    if hasattr(value, "item"):  # a NumPy scalar
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
