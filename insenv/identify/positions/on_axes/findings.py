"""From the search of a whole unit on a table to findings: one block for each target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from insenv.core.lazy import Lazy
from insenv.core.recording import Floats, Recording
from insenv.core.series.robust import MEDIAN
from insenv.core.unit.motion import UNIT
from insenv.data.manifest import Manifest
from insenv.effects.bias import Bias
from insenv.effects.noise import AngleRandomWalk
from insenv.identify.findings import (
    NO_SPECTRA,
    Added,
    Estimate,
    Findings,
    HeldOut,
    NextExperiment,
    NotTestable,
    Rejected,
    SwitchableUnit,
    TargetFindings,
    Traces,
    findings_of,
)
from insenv.identify.fit.uncertainty import NOISE_UNITS
from insenv.identify.positions.angles import apart
from insenv.identify.positions.least_squares import Fit
from insenv.identify.positions.on_axes.offered import offered, unit_switchable
from insenv.identify.positions.on_axes.problem import UnitTerm
from insenv.identify.positions.on_axes.trace import UnitFound
from insenv.identify.positions.search import Step


def unit_findings(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    found: UnitFound,
    remarks: tuple[str, ...],
    alpha: float,
    seed: int,
) -> Findings:
    """All that was found, target by target."""
    targets = tuple(_target(manifest, recordings, found, target) for target in manifest.model.targets)
    said = (*found.remarks, *remarks)
    return replace(findings_of(manifest, recordings, targets, said, alpha, seed), procedure="multi-position")


def _target(manifest: Manifest, recordings: Sequence[Recording], found: UnitFound, target: str) -> TargetFindings:
    kind, outcome = target.partition("_")[0], found.outcome
    steps = [step for step in outcome.steps if step.term.effect.kind in (kind, "table")]
    unit = "rad/s" if kind == "gyro" else "m/s^2"
    held_out = _held_out(found, target, unit)
    added = tuple(_added(found, step, target, held_out) for step in steps)
    own = {term.effect.id for term in outcome.before.terms if term.effect.kind == kind}
    return TargetFindings(
        target=target,
        unit=unit,
        verdict=_verdict(found, steps),
        reasons=found.reasons,
        declared=tuple(key for key in manifest.model.declared if key.partition(":")[0] in own | {Bias.id}),
        added=added,
        rejected=_rejected(outcome.rejected, kind),
        not_testable=_not_testable(outcome.not_testable, kind),
        held_out=held_out,
        estimates_before=_estimates(outcome.before, outcome.before.terms, target),
        estimates_after=_estimates(outcome.after, outcome.before.terms, target),
        noise=_noise(recordings, target, unit),
        next_experiment=_next(found, added),
        spectra=NO_SPECTRA,
        traces=_traces(found, target),
        unit_switchable=Lazy(partial(_switchable, found, target)),
    )


def _switchable(found: UnitFound, target: str) -> SwitchableUnit | None:
    return unit_switchable(found, offered(found), target)


def plain_key(key: str) -> str:
    """The effect's id without the triad that it is of."""
    return key.rpartition(".")[2]


def _verdict(found: UnitFound, steps: Sequence[Step]) -> str:
    if any(found.outcome.rivals.get(step.term.effect.key) for step in steps):
        return "confounded"
    if steps:
        return "effects-found-incomplete" if found.reasons else "effects-found"
    return "unexplained-structure" if found.reasons else "nothing-significant"


def _added(found: UnitFound, step: Step, target: str, held_out: HeldOut) -> Added:
    term, outcome = step.term, found.outcome
    rivals = dict.fromkeys(plain_key(key) for key in outcome.rivals.get(term.effect.key, ()))
    of = "one cause of the table and its six channels" if term.effect.kind == "table" else "one cause in the three axes"
    rows = tuple(_of_term(outcome.after, term, target))
    words = (of, _shape(term), apart(term.effect.id, target.rpartition("_")[2], rows))
    return Added(
        effect=term.effect.id,
        order=None,
        parameters=rows,
        p_value=step.p_value,
        likelihood_ratio=step.likelihood_ratio,
        confounded_with=tuple(key for key in rivals if key != term.effect.id),
        held_out_before=held_out.before,
        held_out_after=held_out.after,
        remark="; ".join(word for word in words if word),
    )


def _shape(term: UnitTerm) -> str:
    if term.shape is None:
        return ""
    return f"from {term.shape:.0f} s on" if term.effect.kind == "table" else f"time constant about {term.shape:.0f} s"


def _of_term(fit: Fit, term: UnitTerm, target: str) -> list[Estimate]:
    """Coefficients of a term on one channel."""
    if term not in fit.terms:
        return []
    at = fit.of(term)
    rows = []
    for shares, value, sd in zip(term.shares, fit.theta[at], fit.sd()[at], strict=True):
        for s in shares:
            if s.channel in ("", target):
                rows.append(
                    Estimate(term.effect.id, s.name, float(s.factor * value), float(abs(s.factor) * sd), s.unit)
                )
    return rows


def _estimates(fit: Fit, terms: Sequence[UnitTerm], target: str) -> tuple[Estimate, ...]:
    kind = target.partition("_")[0]
    return tuple(row for term in terms if term.effect.kind == kind for row in _of_term(fit, term, target))


def _rejected(rows: Sequence[Rejected], kind: str) -> tuple[Rejected, ...]:
    own = [r for r in rows if r.effect.startswith((f"{kind}.", "table."))]
    return tuple(Rejected(plain_key(r.effect), r.p_value, r.likelihood_ratio, r.reason) for r in own)


def _not_testable(rows: Sequence[NotTestable], kind: str) -> tuple[NotTestable, ...]:
    own = {plain_key(r.effect): r for r in rows if r.effect.startswith((f"{kind}.", "table."))}
    return tuple(NotTestable(key, r.needs, r.reason) for key, r in own.items())


def _held_out(found: UnitFound, target: str, unit: str) -> HeldOut:
    """Of the channel's held-out cells."""
    problem, c = found.problem, UNIT.index(target)
    channel = np.concatenate([np.full(len(part.means), part.channel) for part in problem.cells])
    used = problem.held_out & (channel == c)
    sizes = np.concatenate(
        [s * np.sqrt(np.diag(p.covariance)) for p, s in zip(problem.cells, problem.sizes, strict=True)]
    )

    def rms(values: Floats) -> float:
        return float(np.sqrt(np.mean(values[used] ** 2))) if used.any() else float("nan")

    before, after = (rms(problem.raw(fit.residual)) for fit in (found.outcome.before, found.outcome.after))
    times = np.concatenate([np.diff(part.time, append=part.time[-1:]) for part in problem.cells])
    averaging = float(np.median(times[used])) if used.any() else 1.0
    return HeldOut(before, after, rms(sizes), unit, averaging, "means of rests and turns")


def _noise(recordings: Sequence[Recording], target: str, unit: str) -> tuple[Estimate, ...]:
    """White noise, from differences of neighbouring samples."""
    steps = [np.diff(r.channels[target].values) for r in recordings]
    rows = sum(map(len, steps))
    white = float(
        np.median([np.median(np.abs(s)) / MEDIAN * np.sqrt(r.dt / 2) for s, r in zip(steps, recordings, strict=True)])
    )
    key = AngleRandomWalk.id
    return (Estimate(key, "N", white, white / np.sqrt(2 * max(rows, 1)), NOISE_UNITS[unit][key]),)


def _traces(found: UnitFound, target: str) -> Traces:
    problem, outcome = found.problem, found.outcome
    channel = np.concatenate([np.full(len(part.means), part.channel) for part in problem.cells])
    used = channel == UNIT.index(target)
    return Traces(
        t=np.concatenate([part.time for part in problem.cells])[used],
        run=np.concatenate([np.full(len(part.means), part.run + 1) for part in problem.cells])[used],
        held_out=problem.held_out[used],
        before=problem.raw(outcome.before.residual)[used],
        after=problem.raw(outcome.after.residual)[used],
        covariates={},
    )


def _next(found: UnitFound, added: Sequence[Added]) -> tuple[NextExperiment, ...]:
    sets = {(a.effect, *a.confounded_with) for a in added if a.confounded_with}
    return tuple(one for one in found.next_runs if any(set(one.separates) == set(keys) for keys in sets))
