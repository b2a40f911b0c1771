"""From rests and searches to findings: one block for each target, its axis's share of what the triad has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from insenv.core.earth import EARTH_RATE
from insenv.core.lazy import Lazy
from insenv.core.recording import Floats, Recording
from insenv.core.series.allan import WHITE
from insenv.core.units import STANDARD_GRAVITY, show
from insenv.data.manifest import Manifest
from insenv.effects.base import OUTPUT
from insenv.effects.catalogue import by_key
from insenv.effects.cross import GSensitivity
from insenv.effects.rate.scale import ScaleFactor
from insenv.effects.triad import AccelBias, AccelScaleFactor, Misalignment
from insenv.identify.findings import (
    NO_SPECTRA,
    Added,
    Estimate,
    Findings,
    HeldOut,
    NextExperiment,
    NotTestable,
    OfferedModels,
    Rejected,
    TargetFindings,
    Traces,
    findings_of,
)
from insenv.identify.fit.uncertainty import NOISE_UNITS
from insenv.identify.positions.accelerometers.known import KnownAttitudes
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes
from insenv.identify.positions.angles import apart
from insenv.identify.positions.evidence import held_out_error, held_out_errors, noise_floor
from insenv.identify.positions.gyros.factor import BROKEN, factor_of
from insenv.identify.positions.gyros.means import RestMeans
from insenv.identify.positions.gyros.rotations import Rotations
from insenv.identify.positions.least_squares import Fit
from insenv.identify.positions.model import AXES, NOWHEN, Linear, TriadTerm, named
from insenv.identify.positions.offered import Fitted, fits, offered_models, rows_of
from insenv.identify.positions.part import Part
from insenv.identify.positions.search import Step
from insenv.identify.positions.trace import Positions

_HELD = "The parameters that are declared of this axis hold, in these attitudes, what there may be of"
_ELSEWHERE = "was found on other axes: on this one, which points one way alone, its bias holds what there may be of it"
#: Range of what an axis feels, in gravity, from which on its bias and its scale factor are told apart.
LEAST_SPAN = 0.7
#: Deviations from which on a gyro is said to read something of the Earth.
SEEN = 3.0
_MORE = "hold the triad still in more attitudes, each axis up, level, down and half-way, in another order"


def position_findings(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    found: Positions,
    remarks: tuple[str, ...],
    alpha: float,
    seed: int,
) -> Findings:
    """All that was found, target by target."""
    fitted: dict[int, Lazy[tuple[Fitted, ...]]] = {}
    targets = tuple(_target(manifest, recordings, found, target, fitted) for target in manifest.model.targets)
    said = (*found.remarks, *remarks, *_reference(found, manifest))
    return replace(findings_of(manifest, recordings, targets, said, alpha, seed), procedure="multi-position")


def _reference(found: Positions, manifest: Manifest) -> tuple[str, ...]:
    """What stood for the attitude where accelerometers are no target."""
    if not found.at_rest or any(t.startswith("accel") for t in manifest.model.targets):
        return ()
    after = found.accel.outcome.after
    model = ", ".join(term.effect.key for term in after.terms)
    left = held_out_error(found.accel.problem, after) / STANDARD_GRAVITY
    return (f"attitude from the accelerometers, fitted with {model}: {left:.2g} g on held-out rests",)


def _target(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    found: Positions,
    target: str,
    fitted: dict[int, Lazy[tuple[Fitted, ...]]],
) -> TargetFindings:
    """Of one target; axes of a triad share what is ``fitted``, by the identity of their part."""
    axis, gyro = AXES.index(target[-1]), target.startswith("gyro")
    triads = ((found.gyro,) if found.gyro else ()) if gyro else (found.accel,)
    alone = found.at_rest[axis : axis + 1] if gyro else ()
    unit = "rad/s" if gyro else "m/s^2"
    parts = (*triads, *alone)
    shown = next((part for part in parts if part.outcome.steps), parts[0])
    steps = [(part, step) for part in parts for step in part.outcome.steps if _has_part(step.term, axis)]
    untold = [term.effect.key for part in parts for term in part.parted if not _has_part(term, axis)]
    added = tuple(_added(part, step, axis, unit, shown) for part, step in steps)
    elsewhere = [step for part in parts for step in part.outcome.steps if not _has_part(step.term, axis)]
    reasons = (
        *(r for part in triads for r in part.reasons),
        *(f"at rest: {r}" for part in alone for r in part.reasons),
        *(f"{step.term.effect.key} {_ELSEWHERE}" for step in elsewhere),
    )
    return TargetFindings(
        target=target,
        unit=unit,
        verdict=_verdict(parts, axis, bool(reasons)),
        reasons=reasons,
        declared=_declared(manifest, gyro),
        added=added,
        rejected=_rejected(parts),
        not_testable=(
            *(n for part in parts for n in part.outcome.not_testable),
            *(NotTestable(key, ("other attitudes",), "the declared model of this axis holds it") for key in untold),
        ),
        held_out=_held_out(recordings, found, shown),
        estimates_before=_estimates(parts, axis, unit, before=True),
        estimates_after=_with_untold(_estimates(parts, axis, unit, before=False), found.accel, elsewhere),
        noise=_noise(recordings, found, target, unit),
        next_experiment=_next(added),
        spectra=NO_SPECTRA,
        traces=_traces(found, shown, axis),
        models=Lazy(
            partial(
                _models,
                shown,
                fitted.setdefault(id(shown), Lazy(partial(fits, shown))),
                axis,
                unit,
                rows_of(recordings, found, shown),
            )
        ),
        cautions=(
            *(() if gyro else _of_one_side(found, target)),
            *_cautions(found, gyro),
            *(_earth_untold(found) if gyro else ()),
            *(f"{_HELD} {key}." for key in untold),
        ),
    )


def _declared(manifest: Manifest, gyro: bool) -> tuple[str, ...]:
    """The declared effects that an instrument of this kind can have."""
    others = (AccelBias.id, AccelScaleFactor.id) if gyro else (ScaleFactor.id, Misalignment.id, GSensitivity.id)
    return tuple(key for key in manifest.model.declared if key not in others)


def _has_part(term: object, axis: int) -> bool:
    """Whether a term has a coefficient on an axis: of what these attitudes tell in part, another may have it all."""
    return not isinstance(term, TriadTerm) or axis in term.axes


def _verdict(parts: Sequence[Part], axis: int, more: bool) -> str:
    own = [(part, step.term.effect.key) for part in parts for step in part.outcome.steps if _has_part(step.term, axis)]
    added = bool(own)
    if any(part.outcome.rivals.get(key) for part, key in own):
        return "confounded"
    if added:
        return "effects-found-incomplete" if more else "effects-found"
    return "unexplained-structure" if more else "nothing-significant"


def _added(part: Part, step: Step, axis: int, unit: str, shown: Part) -> Added:
    effect, outcome = step.term.effect, part.outcome
    remarks = []
    if step.together:
        others = [key for key in step.together if key != effect.key]
        remarks.append(f"judged together with {', '.join(others)}: none of them is accepted alone")
    if isinstance(step.term, TriadTerm):
        remarks.append("one cause in the three axes of the triad")
    if isinstance(part.problem, RestMeans):
        remarks.append("told by the means at rest")
    rows = tuple(_of_term(outcome.after, step.term, axis, unit))
    if angles := apart(effect.id, "xyz"[axis], rows):
        remarks.append(angles)
    return Added(
        effect=effect.id,
        order=getattr(effect, "order", None),
        parameters=rows,
        p_value=step.p_value,
        likelihood_ratio=step.likelihood_ratio,
        confounded_with=outcome.rivals.get(effect.key, ()),
        held_out_before=step.before,
        held_out_after=step.after,
        remark="; ".join(remarks),
        unit="" if part is shown else _unit(part),
    )


def _of_term(fit: Fit, term: object, axis: int, unit: str) -> list[Estimate]:
    """Estimates of a term's coefficients on one axis."""
    if term not in fit.terms:
        return []
    values, sd = fit.theta[fit.of(term)], fit.sd()[fit.of(term)]
    if not isinstance(term, TriadTerm):
        effect = term.effect  # type: ignore[attr-defined]
        return [
            Estimate(effect.key, p.name, float(v), float(s), p.unit.replace(OUTPUT, unit))
            for p, v, s in zip(effect.linear, values, sd, strict=True)
        ]
    return [
        Estimate(term.effect.key, place.name, float(place.factor * value), float(abs(place.factor) * width), place.unit)
        for coefficient, value, width in zip(term.coefficients, values, sd, strict=True)
        for place in named(term, coefficient, unit)
        if place.axis == axis
    ] + [
        Estimate(term.effect.key, param.name, value, width, param.unit)
        for param, value, width in zip(term.effect.shapes, term.shape, term.shape_sd, strict=True)
    ]


def _estimates(parts: Sequence[Part], axis: int, unit: str, before: bool) -> tuple[Estimate, ...]:
    rows = []
    for part in parts:
        fit = part.outcome.before if before else part.outcome.after
        for term in part.outcome.before.terms:
            rows += _of_term(fit, term, axis, unit)
    return tuple(rows)


def _with_untold(rows: tuple[Estimate, ...], accel: Part, elsewhere: Sequence[Step]) -> tuple[Estimate, ...]:
    """Estimates of an axis whose level holds a gain that others tell: less certain by one as large as theirs."""
    fit = accel.outcome.after
    gains = [fit.theta[fit.of(s.term)] for s in elsewhere if s.term.effect.part == "gain" and s.term in fit.terms]
    if not gains:
        return rows
    usual = STANDARD_GRAVITY * float(np.sqrt(np.mean(np.concatenate(gains) ** 2)))
    return tuple(
        replace(row, sd=float(np.hypot(row.sd, usual))) if by_key(row.effect).part == "level" else row for row in rows
    )


def _rejected(parts: Sequence[Part]) -> tuple[Rejected, ...]:
    """What was refused in any part; of an effect that two parts tried, the more significant."""
    best: dict[str, Rejected] = {}
    for row in sorted((r for part in parts for r in part.outcome.rejected), key=lambda r: r.p_value):
        best.setdefault(row.effect, row)
    return tuple(best.values())


def _unit(part: Part) -> str:
    return {Magnitudes: "m/s^2", KnownAttitudes: "m/s^2", Rotations: "rad", RestMeans: "rad/s"}[type(part.problem)]


def _held_out(recordings: Sequence[Recording], found: Positions, part: Part) -> HeldOut:
    outcome = part.outcome
    length = float(np.median([(r.stop - r.start) * recordings[r.run].dt for r in found.rests]))
    of = {
        Magnitudes: "magnitudes of specific force at rest less gravity",
        KnownAttitudes: "specific forces at rest less gravity in the stated attitudes",
        Rotations: "rotations from rest to rest",
        RestMeans: "means at rest",
    }[type(part.problem)]
    floor = noise_floor(part.problem, outcome.after)
    before, after = held_out_errors(part.problem, outcome.before, outcome.after)
    return HeldOut(before, after, floor, _unit(part), length, of)


def _noise(recordings: Sequence[Recording], found: Positions, target: str, unit: str) -> tuple[Estimate, ...]:
    """White noise within the rests, from differences of neighbouring samples; none where each is one row, a mean."""
    values, rows = [], 0
    for rest in found.rests:
        recording = recordings[rest.run]
        steps = np.diff(recording.channels[target].values[rest.rows])
        if len(steps):
            values.append(float(np.mean(steps**2)) / 2 * recording.dt)
        rows += len(steps)
    if not values:
        return ()
    white = float(np.sqrt(np.median(values)))
    key = WHITE
    return (Estimate(key, "N", white, white / np.sqrt(2 * max(rows, 1)), NOISE_UNITS[unit][key]),)


def _traces(found: Positions, part: Part, axis: int) -> Traces:
    problem, outcome = part.problem, part.outcome
    column = axis if isinstance(problem, Rotations) else 0
    used = problem.fitted | problem.held_out
    if isinstance(problem, Rotations):
        turned = np.array([float(np.sum(turn.rates[:, axis] * turn.dt)) for turn in problem.turns])
        run_of = {rest.number: rest.run for rest in found.calm}
        runs = np.array([run_of[turn.before] for turn in problem.turns])
        time, covariates = problem.time, {"turned": turned}
    elif isinstance(problem, RestMeans):
        time, covariates = problem.around.time, {"force": problem.forces[:, axis]}
        runs = np.array([rest.run for rest in found.calm])
    else:
        time, covariates = problem.around.time, {"force": found.forces[:, axis]}
        runs = np.array([rest.run for rest in found.rests])
    return Traces(
        t=time[used],
        run=runs[used] + 1,
        held_out=problem.held_out[used],
        before=problem.plain(outcome.before.residual)[used, column],
        after=problem.plain(outcome.after.residual)[used, column],
        covariates={name: _kept(values, used) for name, values in covariates.items()},
    )


def _models(
    part: Part, fitted: Lazy[tuple[Fitted, ...]], axis: int, unit: str, rows: NDArray[np.int64]
) -> OfferedModels | None:
    column = axis if isinstance(part.problem, Rotations) else 0
    return offered_models(part, fitted(), column, rows, lambda fit, term: _of_term(fit, term, axis, unit))


def _kept(values: Floats, used: np.ndarray) -> Floats:
    return np.asarray(values[used], dtype=float)


def _next(added: Sequence[Added]) -> tuple[NextExperiment, ...]:
    sets = dict.fromkeys((a.effect, *a.confounded_with) for a in added if a.confounded_with)
    return tuple(NextExperiment(keys, _MORE, None) for keys in sets)


def _cautions(found: Positions, gyro: bool) -> tuple[str, ...]:
    """What the figures rest on, and what they can hardly be."""
    terms = {term.effect.part for term in found.accel.outcome.after.terms}
    said = _wrong_range(found.gyro) if gyro else _incredible(found.accel.outcome.after)
    if gyro or found.gravity_known or "gain" not in terms:
        return said
    free = getattr(found.accel.problem, "free_gravity", False)
    width = "their standard deviations include that" if free else "their standard deviations do not include that"
    return (
        *said,
        f"Neither gravity nor latitude is given, {STANDARD_GRAVITY} m/s² is taken: where gravity is larger by a share, "
        f"the three accelerometer scale factors are larger by it too, up to 0.3 % on the Earth; {width}.",
    )


def _earth_untold(found: Positions) -> tuple[str, ...]:
    """Of gyros whose means at rest go with gravity, alike on all axes, as the Earth's rate makes them, if untold."""
    up, weight = 0.0, 0.0
    for axis, part in enumerate(found.at_rest):
        problem = part.problem
        if not isinstance(problem, RestMeans) or problem.known is None or part.outcome.steps:
            continue
        force = problem.forces[:, axis] / STANDARD_GRAVITY
        slope, variance = _slope(force[problem.fitted], problem.y[problem.fitted])
        up, weight = up + slope / variance, weight + 1 / variance
    if not weight or not SEEN * weight**0.5 < abs(up) < EARTH_RATE * weight + SEEN * weight**0.5:
        return ()
    read = f"{show(up / weight, 'deg/h'):.3g} ± {show(weight**-0.5, 'deg/h'):.2g} deg/h"
    return (
        "No latitude is given: the Earth's rate about the vertical, up to 15 deg/h, is like a g-sensitivity that is "
        f"the same on all axes. The gyros at rest read {read} so, which has no name for that; site.latitude takes it "
        "out.",
    )


def _slope(x: Floats, y: Floats) -> tuple[float, float]:
    """The slope of a line through points, and its variance by their scatter."""
    x = x - x.mean()
    square = max(float(x @ x), 1e-300)
    slope = float(x @ y) / square
    left = y - y.mean() - slope * x
    return slope, max(float(left @ left), 1e-300) / max(len(y) - 2, 1) / square


def _of_one_side(found: Positions, target: str) -> tuple[str, ...]:
    """Of an accelerometer that felt nearly the same in all rests: what tells its bias from its scale factor."""
    parts = {term.effect.part for term in found.accel.outcome.after.terms}
    felt = found.forces[:, AXES.index(target[-1])]
    if not {"gain", "level"} <= parts or np.ptp(felt) >= LEAST_SPAN * STANDARD_GRAVITY:
        return ()
    return (
        f"In all rests {target} felt {felt.min():.3g} to {felt.max():.3g} m/s²: that alone tells its bias from its "
        "scale factor, and axes that lean make them wrong by more than their standard deviations. Rests with this axis "
        "up and down tell.",
    )


def _wrong_range(part: Part | None) -> tuple[str, ...]:
    """Of the gyros: that all rates are wrong by a factor, as fitted where a scale factor was."""
    if part is None or not isinstance(part.problem, Rotations):
        return ()
    fit = part.outcome.after
    matrix = Linear.of(fit.terms, NOWHEN).matrix(fit.theta[: sum(t.size for t in fit.terms)])[0]
    factor = factor_of(1 / np.diag(matrix)) or factor_of([part.problem.gain])
    return (f"Rotations from rest to rest: the gyros' {factor}.",) if factor else ()


def _incredible(fit: Fit) -> tuple[str, ...]:
    """Of the accelerometers: scale factors that are a wrong unit or range, biases of an axis that is broken."""
    said = []
    for term in fit.terms:
        values = fit.theta[fit.of(term)]
        if term.effect.part == "gain" and (factor := factor_of(1 + values)):
            said.append(f"The accelerometers' {factor}.")
        if term.effect.part == "level":
            for axis in np.flatnonzero(np.abs(values) > BROKEN):
                share = values[axis] / STANDARD_GRAVITY
                of = f"accel_{AXES[axis]} has a bias of {share:.2g} g"
                said.append(f"{of}: the axis is broken, or its offset is declared wrong.")
    return tuple(said)
