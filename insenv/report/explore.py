"""What the explorable report needs of each target, as JSON that a page can hold.

An array is whole numbers times a step, chosen so fine that no figure feels it (`FINE` of the residual); its
differences, of the order that makes them smallest, are deflated: a smooth column takes a few hundred bytes.
"""

from __future__ import annotations

import base64
import json
import re
import zlib
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.quantities import p_value, unit_for
from insenv.core.recording import Floats
from insenv.identify.findings import (
    Estimate,
    Findings,
    Switch,
    Switchable,
    SwitchableUnit,
    TargetFindings,
    Traces,
)
from insenv.report import words
from insenv.report.found import as_before

#: Steps of arrays, as shares of the residual: of columns times their coefficients, of the residual itself.
FINE, RESIDUAL = 2e-5, 1e-6
#: Step of a column as a share of it, at least: columns that span each other must do so still.
FINEST = 1e-7
#: The same of a curve without a cause, which together with a bias is hardly told: its last digits decide far outside.
FINEST_CURVE = 1e-9
#: Largest whole number, largest difference, and the highest order of differences.
_MOST, _MOST_CHANGE, _ORDERS = 2**29, 2**30, 4
#: Power that stands for one without a bound, which JSON does not know.
_UNBOUNDED = 1e300

Block = dict[str, Any]


def data(findings: Findings) -> tuple[str, tuple[str, ...]]:
    """JSON of all targets that have something to switch, safe inside ``<script>``, and their ids; "" where none has."""
    targets = [one for index in range(len(findings.targets)) if (one := _one(findings.targets, index)) is not None]
    if not targets:
        return "", ()
    text = json.dumps(
        {"targets": targets, "unit": _unit(findings.targets)}, ensure_ascii=True, allow_nan=False, separators=(",", ":")
    )
    return text.replace("<", "\\u003c"), tuple(one["id"] for one in targets)


def _one(targets: Sequence[TargetFindings], index: int) -> Block | None:
    """Of a target whose measurement no target before it shares."""
    target = targets[index]
    if as_before(target, targets):
        return None
    sharing = [one for one in targets if one is target or as_before(one, targets) == target.target]
    return _target(target, index + 1) or _of_unit(target, index + 1) or _fitted_beforehand(sharing, index + 1)


def scripts() -> tuple[str, ...]:
    """The scripts of the page: uPlot, the fit, the page's own."""
    here = files("insenv.report")
    plot = here.joinpath("vendor/uPlot.iife.min.js").read_text("utf-8")
    return plot, *(
        _lean(here.joinpath(f"templates/{name}.js").read_text("utf-8")) for name in ("gls", "problem", "explore")
    )


def style() -> str:
    """The stylesheet of uPlot."""
    return files("insenv.report").joinpath("vendor/uPlot.min.css").read_text("utf-8")


def _lean(script: str) -> str:
    """A script without its comments, its indentation and the spaces that a reader likes."""
    lines = (re.sub(r"(^| )// .*", "", line.strip()) for line in script.splitlines())
    text = "\n".join(line for line in lines if line) + "\n"
    return re.sub(r"""(`[^`]*`|'[^'\n]*')| *([,;{}()=<>?:&|*]) *""", lambda found: found[1] or found[2], text)


def _target(target: TargetFindings, index: int) -> Block | None:

    model, traces = target.switchable(), target.traces
    size = float(np.sqrt(np.mean(traces.after**2))) if len(traces.after) else 0.0
    arrays = (traces.after,) if model is None else (traces.after, model.columns)
    if model is None or not size > 0 or not all(np.isfinite(one).all() for one in arrays):
        return None
    steps = _steps(model, size)
    packed = _Packed()
    packed.add("after", traces.after, RESIDUAL * size)
    common = _common(target, index, packed, model.width, model.rows)
    for k, step in enumerate(steps):
        packed.add(f"c{k}", model.columns[:, k], step)
    shown = [_coefficient(model, k) for k in range(len(model.of))]
    return {
        **common,
        "switches": [_switch(one, target) for one in model.switches],
        "columns": [{"s": s, **column} for s, column in zip(model.of, shown, strict=True)],
        "free": list(model.free),
        "blocks": [
            {"run": run, "start": start, "n": stop - start, "fitted": fitted, "span": span}
            for run, start, stop, fitted, span in model.blocks
        ],
        "most": None if model.most is None else [min(power, _UNBOUNDED) for power in model.most],
        "terms": list(model.noise),
        "lam": [float(model.lam[0]), float(model.lam[-1]), len(model.lam)],
        "spectra": np.round(np.log(model.spectra), 6).T.tolist(),
        "known": [
            ["".join("01"[on] for on in one.on), {"power": one.power, "theta": [_short(v) for v in one.theta]}]
            for one in model.known
        ],
        "ownLevel": model.own_level,
        "cleaned": list(model.cleaned),
        "heldOut": [target.held_out.before, target.held_out.after, target.held_out.noise_floor],
        "parts": packed.parts,
        "data": packed.text(),
    }


def _common(target: TargetFindings, index: int, packed: _Packed, width: float, rows: NDArray[np.int64]) -> Block:
    """What is told of every target that has something to switch; its arrays are packed."""
    from insenv.report import figures  # here and not above: slow to import

    traces, unit = target.traces, figures.unit_of(target)
    line, label = figures.time_of(target)
    packed.add("x", line.x, 1e-3 * _step(line.x))
    packed.add("t", traces.t, 1e-4 * width)
    packed.add("first", rows[:, 0].astype(float), 1.0)
    packed.add("end", rows[:, 1].astype(float), 1.0)
    against = []
    for name in figures.covariates(target):
        values, axis = figures.covariate_of(name, traces.covariates[name])
        packed.add(name, values, 1e-4 * float(np.ptp(values)))
        against.append({"name": name, "label": axis})
    return {
        "id": f"t{index}",
        "target": target.target,
        "unit": unit.label,
        "factor": unit.factor,
        "n": len(traces.after),
        "width": width,
        "timeLabel": label,
        "several": len(line.runs) > 1,
        "against": against,
    }


def _fitted_beforehand(sharing: Sequence[TargetFindings], index: int) -> Block | None:
    """A target of which each model was fitted beforehand, positions; the coefficients of all axes that share it."""
    target, each = sharing[0], [(one.target, one.models()) for one in sharing]
    offered, traces = each[0][1], target.traces
    if offered is None:
        return None
    estimates = [
        [
            (k, f"{one.parameter}, {name}" if len(each) > 1 else one.parameter, one)
            for name, shown in each
            if shown is not None
            for k, one in shown.models[number].estimates
            if np.isfinite(one.value)
        ]
        for number in range(len(offered.models))
    ]
    packed = _Packed()
    common = _common(target, index, packed, _step(traces.t), offered.rows)
    size = float(np.sqrt(np.mean(traces.after**2))) or 1.0
    # The unit of a coefficient is that of the model that knows it best.
    rows = sorted((row for model in estimates for row in model), key=lambda row: -abs(row[2].value) - row[2].sd)
    known = {(k, name): one for k, name, one in rows}
    known = {key: known[key] for key in dict.fromkeys((k, name) for model in estimates for k, name, _ in model)}
    places = {key: place for place, key in enumerate(known)}
    for number, model in enumerate(offered.models):
        packed.add(f"m{number}", model.left, RESIDUAL * size)
    return {
        **common,
        "switches": [_switch(one, target) for one in offered.switches],
        "columns": [{"s": k, "name": name, **_in_unit(known[k, name])} for k, name in known],
        "blocks": _blocks(traces),
        "cleaned": [],
        "models": [
            {
                "on": "".join("01"[on] for on in model.on),
                "rms": _finite(model.rms),
                "floor": _finite(model.noise_floor),
                "loglik": model.log_likelihood,
                "theta": [[places[k, name], one.value, _finite(one.sd)] for k, name, one in own],
            }
            for model, own in zip(offered.models, estimates, strict=True)
        ],
        "parts": packed.parts,
        "data": packed.text(),
    }


#: What an instrument of a unit is called; the table's own effects say what they are.
_INSTRUMENTS = {"gyro": ", gyros", "accel": ", accelerometers"}


def _unit(targets: Sequence[TargetFindings]) -> Block | None:
    """What all channels of a whole unit on a table share: the triangle of its fitted cells by rows, and the priors."""
    model = next((model for target in targets if (model := target.unit_switchable()) is not None), None)
    if model is None:
        return None
    rows = [_exact(v) for k, row in enumerate(model.triangle) for v in row[k:]]
    deviations = [_finite(one) for one in model.deviations]
    return {"triangle": rows, "deviations": deviations, "of": list(model.of), "fitted": model.fitted}


def _of_unit(target: TargetFindings, index: int) -> Block | None:
    """A channel of a whole unit on a table: its cells, and their columns."""
    model, traces = target.unit_switchable(), target.traces
    size = float(np.sqrt(np.mean(traces.after**2))) if len(traces.after) else 0.0
    if model is None or not size > 0 or not all(np.isfinite(one).all() for one in (traces.after, model.columns)):
        return None
    packed = _Packed()
    common = _common(target, index, packed, _step(traces.t), np.column_stack([model.rests, model.rests + 1]))
    packed.add("after", traces.after, RESIDUAL * size)
    # Columns are multiplied by coefficients here, and not fitted: the triangle is.
    scale = np.sqrt(np.mean(model.columns**2, axis=0))
    for k, (column, wanted) in enumerate(zip(model.columns.T, _largest(model.theta, scale, size), strict=True)):
        packed.add(f"c{k}", column, FINE * size / wanted)
    return {
        **common,
        "switches": [_switch_of_unit(one, target) for one in model.switches],
        "columns": [_coefficient_of_unit(model, k) for k in range(len(model.of))],
        "blocks": _blocks(traces),
        "cleaned": [],
        "whole": True,
        "floor": _finite(target.held_out.noise_floor),
        "parts": packed.parts,
        "data": packed.text(),
    }


def _coefficient_of_unit(model: SwitchableUnit, k: int) -> Block:
    found: Block = {"s": model.of[k], "theta": _exact(model.theta[k])}
    if (label := model.labels[k]) is None:
        return found
    name, si, factor = label
    unit = unit_for(si, float(model.theta[k]) or 1e-5)
    return {**found, "name": name, "unit": unit.label, "per": unit.factor, "f": factor}


def _switch_of_unit(one: Switch, target: TargetFindings) -> Block:
    """Notes are of the channel's own instruments and of the table: a triad has an effect of the other's name."""
    kind, _, effect = one.effect.partition(".")
    own = kind == "table" or target.target.startswith(kind)
    plain = _switch(replace(one, effect=effect), target)
    name = plain["name"] + _INSTRUMENTS.get(kind, "")
    return {**plain, "key": one.effect, "name": name, "note": plain["note"] if own else ""}


def _exact(value: float) -> float:
    """With the digits of which a fit of many coefficients feels the last."""
    return float(f"{value:.15g}")


def _blocks(traces: Traces) -> list[Block]:
    """Stretches of one run that are all fitted, or all held out."""
    held, run = traces.held_out, traces.run
    cuts = np.flatnonzero((np.diff(held.astype(int)) != 0) | (np.diff(run) != 0)) + 1
    edges = [0, *cuts.tolist(), len(held)]
    return [
        {"run": int(run[a]), "start": a, "n": b - a, "fitted": not held[a], "span": b - a}
        for a, b in pairwise(edges)
        if b > a
    ]


def _in_unit(one: Estimate) -> Block:
    unit = unit_for(one.unit, one.value or one.sd)
    return {"unit": unit.label, "per": unit.factor}


def _short(value: float) -> float:
    """With the digits that count."""
    return float(f"{value:.12g}")


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _steps(model: Switchable, size: float) -> list[float]:
    """Steps of the columns: times the largest coefficient that counts, they are `FINE` of the residual."""
    fitted = np.concatenate([np.arange(start, stop) for _, start, stop, own, _ in model.blocks if own])
    scale = np.sqrt(np.mean(model.columns[fitted] ** 2, axis=0))
    step = FINE * size / _largest(model.theta, scale, size)
    curve = np.array([model.switches[k].generic for k in model.of], bool)
    step = np.minimum(step, np.where(curve, FINEST_CURVE, FINEST) * np.where(scale > 0, scale, 1.0))
    largest = np.abs(model.columns).max(axis=0, initial=0.0)
    return np.maximum(step, np.maximum(largest, 1e-300) / _MOST).tolist()


def _largest(theta: Floats, scale: Floats, size: float) -> Floats:
    """Largest coefficients that count: one that was not fitted is taken for thirty times the residual."""
    return np.maximum(np.abs(theta), 30 * size / np.maximum(scale, 1e-300))


def _coefficient(model: Switchable, k: int) -> Block:
    name, si = model.labels[k]
    value = float(model.theta[k])
    unit = unit_for(si, value if value else float(model.prior[k]))
    prior = float(model.prior[k])
    return {
        "name": name, "unit": unit.label, "per": unit.factor, "theta": value,
        "prior": prior if np.isfinite(prior) else None,
    }  # fmt: skip


def _switch(one: Switch, target: TargetFindings) -> Block:
    note = ""
    if one.role == "added":
        note = next((f"p {p_value(a.p_value)}" for a in target.added if words.key_of(a) == one.effect), "")
    if one.role == "refused":
        note = next((r.reason for r in target.rejected if r.effect == one.effect), "")
    return {
        "key": one.effect,
        "name": words.name(one.effect),
        "role": one.role,
        "of": one.of,
        "note": note,
        "shape": ", ".join(_shape(*row) for row in one.shape),
    }


def _shape(name: str, value: float, unit: str) -> str:
    from insenv.report.estimates import value as shown

    return f"{name} = {shown(Estimate('', name, value, float('nan'), unit))}"


def _step(x: Floats) -> float:
    return float(np.median(np.abs(np.diff(x)))) if len(x) > 1 else 1.0


def _smallest_differences(whole: NDArray[np.int64]) -> tuple[int, NDArray[np.int64]]:
    """The order of differences that takes the fewest bits, and these."""
    best, fewest, change = (0, whole), np.inf, whole
    for order in range(_ORDERS):
        if np.abs(change).max(initial=0) > _MOST_CHANGE:
            break
        bits = float(np.log2(1.0 + np.abs(change)).sum())
        if bits < fewest:
            best, fewest = (order, change), bits
        change = np.diff(change, prepend=0)
    return best


class _Packed:
    """Arrays of whole numbers, one after the other: names with lengths, steps and orders, and their bytes."""

    def __init__(self) -> None:
        self.parts: list[tuple[str, int, float, int]] = []
        self._bytes: list[bytes] = []

    def add(self, name: str, values: Floats, step: float) -> None:
        """Add ``values`` to within half a ``step``."""
        step = step if step > 0 else 1.0
        finite = np.where(np.isfinite(values), values, 0.0)
        whole = np.rint(finite / max(step, float(np.abs(finite).max(initial=0.0)) / _MOST)).astype(np.int64)
        step = max(step, float(np.abs(finite).max(initial=0.0)) / _MOST)
        order, change = _smallest_differences(whole)
        zigzag = np.where(change < 0, -2 * change - 1, 2 * change).astype("<u4")
        self._bytes.append(zigzag.view(np.uint8).reshape(-1, 4).T.tobytes())
        self.parts.append((name, len(values), step, order))

    def text(self) -> str:
        """All of them, deflated, in base 64."""
        return base64.b64encode(zlib.compress(b"".join(self._bytes), 9)).decode()
