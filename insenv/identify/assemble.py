"""From the end of a search to findings: verdicts, estimates, spectra, traces."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from insenv.core.estimate import Limits
from insenv.core.lazy import Here, Lazy
from insenv.core.recording import Floats, Recording
from insenv.core.series.allan import allan_deviation
from insenv.core.series.rounding import counted
from insenv.core.series.spectrum import psd
from insenv.core.units import ZERO_CELSIUS
from insenv.data.cells.tumble import gravity_sentence
from insenv.data.manifest.spec import Manifest
from insenv.effects.base import Effect, NoiseEffect
from insenv.effects.bias import BiasDrift
from insenv.effects.noise import RateRandomWalk, readings_density
from insenv.effects.rate.scale import ScaleFactorCubic
from insenv.effects.rate.threshold import DeadBand
from insenv.effects.thermal import temperature_excess
from insenv.effects.timing import SampleHold, TimingSkew
from insenv.identify.clean import systematic
from insenv.identify.clean.outliers import rows_of_bins, too_many
from insenv.identify.clean.plausibility import UNMOVED
from insenv.identify.earth.findings import (
    EarthFindings,
    cautions,
    derived,
    earth_findings,
    reasons,
    suspected,
    with_earth,
)
from insenv.identify.earth.leaning import with_gravity
from insenv.identify.earth.two_position import with_vertical_rate
from insenv.identify.findings import (
    Added,
    Estimate,
    Findings,
    HeldOut,
    NotTestable,
    Rejected,
    RejectedRows,
    Spectra,
    TargetFindings,
    Traces,
    WholeError,
    findings_of,
)
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.heldout import Score, held_out_score, residual
from insenv.identify.fit.problem import NOISE_TERMS, Problem, Term
from insenv.identify.fit.resumed import resumed
from insenv.identify.fit.uncertainty import SCALE, covariance, estimates, noise_estimates
from insenv.identify.loop import Outcome
from insenv.identify.next.experiment import Unsettled, next_experiments
from insenv.identify.prepare.declared import without_north
from insenv.identify.prepare.excess import LOUD, MOVING, Structure, structure
from insenv.identify.prepare.gain import as_declared, undeclared_gain
from insenv.identify.prepare.numbers import piles, repeated
from insenv.identify.prepare.samples import beyond_declared, humps
from insenv.identify.prepare.spectral.line_effects import hold_effect, line_effects, rounding_effect, saturation_effect
from insenv.identify.prepare.spectral.lines import Line
from insenv.identify.prepare.unsteady.told import unsteady
from insenv.identify.prepare.vibration import went_away
from insenv.identify.prepare.wide_noise import too_wide
from insenv.identify.search.artefacts.rounded import log_p_unrounded
from insenv.identify.search.detectable import Sensitivity
from insenv.identify.search.doubts.unfinished import made_by_rounding, unfinished
from insenv.identify.search.followers import followers
from insenv.identify.search.rivals import Rivalry
from insenv.identify.search.tracks import Step, Track
from insenv.identify.search.twins import (
    chord_sentence,
    drift_sentence,
    half_row_sentence,
    half_step_sentence,
    head_sentence,
    rarer_sentence,
    twin_sentence,
    twins,
)
from insenv.identify.search.undecided import beside_doubts
from insenv.identify.search.whole.error import of_chance
from insenv.identify.stated import told, unforetold
from insenv.identify.switches import switchable

#: Deviations of a walk over the whole record that a level may go.
WALKED = 2.0
#: Held-out error in scatters of the fitted noise from which on a word is said; of points, whose few tell it worse.
WANDER, WANDER_OF_POINTS = 2.0, 4.0
#: Standard deviations by which a parameter must be beyond what is credible to be said so.
SURE = 3.0
#: Causes of rows that are left out which have a sentence of their own.
TOLD = ("saturation", "burst")

#: What is said of a slow cause that noise explains as well.
UNDECIDED = (
    "the level changes; whether by a law or by a walk of the noise this record does not tell: a longer one does, or "
    "another after it was switched off and on"
)

#: Fewest bins that have a spectrum.
SHORTEST = 8


def findings(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    outcome: Outcome,
    remarks: tuple[str, ...] = (),
    limits: Limits | None = None,
) -> Findings:
    """All that was found, target by target; ``limits`` are those of the table, for the next experiment."""
    levels = outcome.alpha, outcome.seed
    targets = tuple(_target(manifest, recordings, track, levels, limits) for track in outcome.tracks)
    said = (
        *remarks,
        *(() if outcome.tracks[0].problem.turns else repeated(recordings, manifest.model.targets)),
        *_longer_means(outcome.tracks),
        *_vibrating(outcome.tracks),
        *(text for track in outcome.tracks if (text := _outliers(track, recordings))),
        *(text for track in outcome.tracks if (text := _patterns_of_counts(track))),
        *(text for track in outcome.tracks if (text := _ripple(track))),
    )
    found = findings_of(manifest, recordings, targets, said, outcome.alpha, outcome.seed)
    return replace(found, rows_rejected=tuple(r for track in outcome.tracks for r in _rejected_rows(track)))


def _longer_means(tracks: tuple[Track, ...]) -> tuple[str, ...]:
    """A word on means that were made longer."""
    finer = max(track.finer for track in tracks)
    if not finer:
        return ()
    width = max(track.problem.bins.width for track in tracks)
    loud: dict[str, list[str]] = {}
    for track in tracks:
        if track.loudest:
            loud.setdefault(f"{track.loudest:.2g}", []).append(track.problem.target)
    where = ", ".join(f"about {hertz} Hz on {', '.join(loud[hertz])}" for hertz in sorted(loud, key=float))
    return (
        f"means over {width:.3g} s are judged: those over {finer:.3g} s hold vibration, or what a filter leaves, "
        "beyond all lines, which no noise term follows" + (f"; loudest {where}" if where else ""),
    )


def _vibrating(tracks: tuple[Track, ...]) -> tuple[str, ...]:
    """A word on humps of the samples that the means leave out, of targets at rest."""
    said = []
    for track in tracks:
        spectrum = None if track.problem.turns else track.prepared.samples()
        bands = () if spectrum is None else humps(spectrum)
        where = ", ".join(f"{low:.2g} to {high:.2g} Hz ({times:.2g} times)" for low, high, times in bands)
        if bands:
            said.append(
                f"{track.problem.target}: the samples hold more than the noise beside at {where}, and no line: "
                "vibration of what it stands on, or lines that wander; means over "
                f"{track.problem.bins.width:.3g} s leave it out"
            )
    return tuple(said)


def _hertz(lines: Iterable[Line]) -> str:
    """Frequencies of lines as they are said, lowest first; empty if there are none."""
    return ", ".join(sorted({f"{line.frequency:.4g}" for line in lines}, key=float))


def _ripple(track: Track) -> str:
    """Which lines were damped that go with the motion; empty if none."""
    found = _hertz(line for line in track.prepared.lines if line.of_motion)
    if not found:
        return ""
    return (
        f"{track.problem.target}: about {found} Hz the residual goes with what the reference has there: "
        "motion, as a motor's ripple, of which a filter or a lag leaves some; damped, and no error of the instrument"
    )


def _patterns_of_counts(track: Track) -> str:
    """Which lines were taken out as the pattern of counts, of an encoder or of the readings; empty if none."""
    found = _hertz(line for line in track.prepared.lines if line.of_counts)
    if not found:
        return ""
    what = f"{track.problem.target}: lines at {found} Hz"
    if not track.problem.encoder and not track.problem.counter:
        return f"{what} stand in the reference and not in the readings: taken out, and no error of the instrument"
    if not track.problem.encoder:
        count = math.degrees(track.problem.counter) * 3600
        return (
            f"{what} are less than half a count of the readings, {count:.3g} arcsec: taken out, as a counter's pattern"
        )
    return (
        f"{what} are what the steps of the table's angle, "
        f"{math.degrees(track.problem.encoder):.3g} deg, make of its rate: taken out, and no error of the instrument"
    )


def _rejected_rows(track: Track) -> tuple[RejectedRows, ...]:
    return (*track.prepared.rejected, *rows_of_bins(track.problem))


def _outliers(track: Track, runs: tuple[Recording, ...]) -> str:
    """Which rows were left out as outliers; empty if none. Rows at a rail and in bursts are told elsewhere."""
    rejected = [r for r in _rejected_rows(track) if r.cause not in TOLD]
    if not rejected:
        return ""
    of_run = (lambda r: f" of {runs[r.run].label}") if len(runs) > 1 else (lambda r: "")
    causes: dict[str, list[str]] = {}
    for r in rejected:
        causes.setdefault(r.reason, []).append(f"{_rows(r)}{of_run(r)}")
    # Many corners of a motion have one cause, which is said once.
    places = [f"{_some(rows)} ({reason})" for reason, rows in causes.items()]
    where = _some(places)
    count = sum(r.stop - r.start for r in rejected)
    return f"{track.problem.target}: {count} row{'s' * (count > 1)} left out as outliers: {where}"


def _some(places: list[str]) -> str:
    """The first five of them."""
    return ", ".join(places[:5]) + (f", and {len(places) - 5} more" if len(places) > 5 else "")


def _rows(one: RejectedRows) -> str:
    return f"{one.start}" if one.stop - one.start == 1 else f"{one.start} to {one.stop - 1}"


def _target(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    track: Track,
    levels: tuple[float, int],
    limits: Limits | None,
) -> TargetFindings:
    """All of one target; ``levels`` are the probability of a false discovery and the seed."""
    alpha, seed = levels
    track, own, uncertain, errors = told(track, seed)
    plain, problem = as_declared(track.prepared.plain, track.prepared.model), track.problem
    before = solve(plain, track.prepared.model)
    declared_noise = dict(manifest.noise.get(problem.target, {}))
    left = _with_rows(track, structure(problem, track.fit, declared_noise, alpha), declared_noise, recordings)
    lost = systematic.sentences(recordings, problem.target, track.prepared.rejected)
    scores = held_out_score(plain, before), held_out_score(problem, track.fit)
    gain, no_gain = undeclared_gain(problem, track.fit, track.prepared.model, scores, alpha)
    noise = (*_kept(track, recordings, declared_noise), *_level_off(problem, scores[1], declared_noise))
    apart = (*_follows_nothing(problem, own), *uncertain, *lost, *noise, *no_gain, *resumed(problem, track.fit))
    left = replace(left, reasons=_doubts(track, (*left.reasons, *apart), scores[1], errors, alpha))
    lines, hold = tuple(x for x in track.prepared.lines if x.own), track.prepared.held.hold
    earth = earth_findings(track, alpha)
    coarse = _rounding(track, alpha, scores)
    verdict = _verdict(track, bool(lines or coarse or gain), left, earth)
    first = estimates(plain, before)
    declared = set(track.prepared.model)
    found = tuple(_added(track, index, step, own[step.hit.term], recordings) for index, step in enumerate(track.steps))
    suspects = suspected(earth, scores[1])
    collinear = _collinear(track)
    return TargetFindings(
        target=problem.target,
        unit=problem.unit,
        verdict=verdict,
        reasons=(*left.reasons, *reasons(earth)),
        declared=manifest.model.declared,
        added=(
            *_saturation(track, recordings, scores),
            *coarse,
            *gain,
            *(replace(one, whole=error) for one, error in zip(found, errors, strict=True)),
            *((hold_effect(hold, *(score.rms for score in scores)),) if hold else ()),
            *(line_effects(lines, problem, _with_lines(track), scores[1].rms, track.finer) if lines else ()),
            *suspects,
        ),
        rejected=_rejected(track, alpha),
        not_testable=_not_testable(track, collinear),
        held_out=HeldOut(scores[0].rms, scores[1].rms, scores[1].floor, problem.unit, problem.bins.width),
        estimates_before=with_vertical_rate(recordings, [e for rows in first.values() for e in rows]),
        estimates_after=with_vertical_rate(
            recordings, with_earth([e for term, rows in own.items() if term in declared for e in rows], earth)
        ),
        noise=noise_estimates(problem, track.fit),
        next_experiment=next_experiments(
            track, recordings, Unsettled(suspects, tuple(n.effect for n in collinear), earth.check), limits
        ),
        spectra=_spectra(plain, before, problem, track.fit, declared_noise),
        traces=_traces(recordings, plain, before, problem, track.fit),
        derived=derived(plain, before, track, earth),
        cautions=(
            *_cautions(problem, own, earth, scores[1]),
            *gravity_sentence(recordings, problem.target),
            *without_north(manifest, [e.motion for e in problem.exposures]),
        ),
        covariance=covariance(problem, track.fit),
        beside=Here(partial(_beside, track)),
        switchable=Lazy(partial(switchable, track)),
        samples=Lazy(track.prepared.samples),
    )


def _with_rows(
    track: Track, left: Structure, declared: Mapping[str, float], recordings: tuple[Recording, ...]
) -> Structure:
    """What speaks against noise in the means and in the rows, which tell when it is loud, and where a line moves."""
    problem = track.problem
    rows = unsteady(track.prepared.left(problem, track.fit.named), problem.bins.width)
    spectrum = None if problem.turns or not declared else track.prepared.samples()
    more = beyond_declared(spectrum, declared) if spectrum is not None else ()
    loud = (f"the rows hold {times:.2g} times the declared power at {a:.2g} to {b:.2g} Hz" for a, b, times in more)
    once = (text for text in left.reasons if not rows or not text.startswith((LOUD, MOVING)))
    piled = () if problem.turns else piles(recordings, problem.target)
    return replace(left, reasons=(*once, *rows, *loud, *piled))


def _kept(track: Track, recordings: tuple[Recording, ...], declared: Mapping[str, float]) -> tuple[str, ...]:
    """Reasons where free noise has taken in what is none: a bias that goes far, rows that are no measurements."""
    if declared:
        return ()
    went = went_away(track.problem, track.fit) if track.finer else ()
    wide = too_wide(track.problem, track.fit)
    return (*went, *wide, *too_many(recordings, track.problem.target, track.prepared.rejected))


def _doubts(
    track: Track, said: Sequence[str], score: Score, errors: Sequence[Callable[[], WholeError | None]], alpha: float
) -> tuple[str, ...]:
    """What was ``said`` against the search's being complete, and more: chance, and what is less sure by itself."""
    off = _unforetold(track.problem, score)
    shared = (track.in_common,) if track.in_common else ()
    doubts = (*said, *unfinished(track, alpha), *off, *shared) or of_chance(track, errors, alpha)
    if track.law is not None:  # what all rows follow beside it are parts of it
        return doubts
    return (*doubts, *beside_doubts(track, bool(doubts)), *followers(track, alpha, bool(doubts)))


def _beside(track: Track, effect: str, shape: Mapping[str, float]) -> tuple[Estimate, ...]:
    """Coefficients of an effect that was tried, at the nearest of its shapes, beside the model."""
    candidate = next((c for c in track.candidates if c.effect.key == effect), None)
    if candidate is None:
        return ()
    at = [shape.get(p.name, np.nan) for p in candidate.effect.shapes]

    def away(term: Term) -> float:
        return float(np.nansum(np.square(np.subtract(term.shape, at)))) if term.shape else 0.0

    term = min(candidate.terms, key=away)
    named = tuple(t for t in track.fit.model if not t.effect.generic and t.effect.key != effect)
    fit = solve(track.problem, (*named, term), start=track.fit.noise.power)
    linear = {p.name for p in candidate.effect.linear}
    return tuple(e for e in estimates(track.problem, fit, (term,))[term] if e.parameter in linear)


def _cautions(
    problem: Problem, own: Mapping[Term, tuple[Estimate, ...]], earth: EarthFindings, score: Score
) -> tuple[str, ...]:
    """Which of the figures may be wrong by more than their standard deviations."""
    return (
        *_incredible(problem, own),
        *cautions(earth),
        *with_gravity(problem, own),
        *_wander(problem, score),
    )


def _incredible(problem: Problem, own: Mapping[Term, tuple[Estimate, ...]]) -> tuple[str, ...]:
    """A word on every parameter that is beyond what is credible of its effect, whatever the fit says.

    A scale factor on a table is left to the check of the gain before the search, which knows a reversed axis.
    """
    said = []
    turning = problem.turns
    for term, rows in own.items():
        limits = {p.name: problem.limits(p) for p in term.effect.linear}
        for row in rows:
            low, high = limits.get(row.parameter.partition("[")[0], (-np.inf, np.inf))
            beyond = row.value - SURE * row.sd > high or row.value + SURE * row.sd < low
            if beyond and not (turning and term.effect.part == "gain"):
                said.append(
                    f"{row.effect} {row.parameter} = {row.value:.4g} {row.unit} is further out than any instrument of "
                    f"this kind has it ({low:.3g} to {high:.3g}): check unit, sign and column of {problem.target}."
                )
    return tuple(said)


def _follows_nothing(problem: Problem, own: Mapping[Term, tuple[Estimate, ...]]) -> tuple[str, ...]:
    """A word where a gyro reads next to nothing of what it was exposed to, and a scale factor of -1 is told for it."""
    gains = [(1 + row.value, row.sd) for term, rows in own.items() if term.effect.id == SCALE for row in rows]
    for gain, sd in gains if problem.turns else ():
        if abs(gain) < max(UNMOVED, SURE * sd) and sd < 1 / SURE:
            return (
                f"{problem.target} reads {gain:.2g} +- {sd:.1g} of the rate that it was exposed to: it does not follow "
                "it. Check the column, the axis and the clocks of both",
            )
    return ()


def _saturation(track: Track, recordings: tuple[Recording, ...], scores: tuple[Score, Score]) -> tuple[Added, ...]:
    """Rails at which the target clips, and which rates of the table are lost by them."""
    rails, target = track.prepared.rails, track.problem.target
    if not rails:
        return ()
    rates = systematic.lost_rates(recordings, target, track.prepared.rejected, "saturation")
    losses = f"nothing is known of {systematic.listed(rates, np.degrees)} deg/s" if rates else ""
    return (saturation_effect(rails, track.problem, losses, *(score.rms for score in scores)),)


def _wander(problem: Problem, score: Score) -> tuple[str, ...]:
    """A word where held-out data scatter more than the fitted noise, or the model does not tell them."""
    times = WANDER_OF_POINTS if problem.in_points else WANDER
    if score.foretold > times * score.floor > 0:
        return (_carried_on(problem, score),)
    if not score.scatter > times * score.floor > 0 or unforetold(problem, score):
        return ()
    return (
        f"Held-out data scatter by {score.scatter / score.floor:.2g} times as much as the fitted noise: they hold "
        "motion, vibration or an error that the fitted data do not show.",
    )


def _carried_on(problem: Problem, score: Score) -> str:
    """A word on coefficients that are carried on beyond what was fitted, and on the temperatures of both."""
    kelvins, held_out, at = problem.heat(), problem.bins.held_out, ""
    if kelvins is not None and problem.fitted and problem.held_out:
        fitted, held = (
            f"{values.min() - ZERO_CELSIUS:.3g} to {values.max() - ZERO_CELSIUS:.3g} degC"
            for values in (kelvins[~held_out], kelvins[held_out])
        )
        at = f": fitted are {fitted}, held out {held}"
    return (
        "On held-out data the model is carried on beyond what was fitted, and its coefficients leave it uncertain by "
        f"{score.foretold / score.floor:.2g} times the noise{at}. [held_out] can name other rows."
    )


def _level_off(problem: Problem, score: Score, declared: Mapping[str, float]) -> tuple[str, ...]:
    """A reason to doubt a model whose level on held-out data is twice as far off as the fitted noise scatters.

    None where the random walk that the maker declares goes so far in the time of the record.

    Noise that wanders does that, and so does what moved or drifts: of six channels of 724 measured recordings that were
    so, and of which nothing else was said, five had done it.
    """
    if problem.in_points:
        return ()  # each is one of its own, and few tell their noise to a factor of two
    if not score.rms > WANDER * score.floor > 0 or unforetold(problem, score) or score.scatter > WANDER * score.floor:
        return ()
    span = max(e.motion.dt * e.motion.n for e in problem.exposures)
    if score.rms < WALKED * declared.get(RateRandomWalk.id, 0.0) * math.sqrt(span):
        return ()
    return (
        f"held-out data are off by {score.rms / score.floor:.2g} times the scatter of the fitted noise: their level "
        "has gone that far since the fit, by noise that wanders or by a cause that the fitted data do not tell",
    )


def _unforetold(problem: Problem, score: Score) -> tuple[str, ...]:
    """A reason to doubt a model of a turning unit: held-out data scatter as no noise of the fitted data does."""
    if not unforetold(problem, score):
        return ()
    return (
        f"held-out data are off by {score.scatter / score.foretold:.2g} times the scatter of the fitted noise, their "
        "level left out: the model does not hold for all motion, and standard deviations are taken so much larger",
    )


def _with_lines(track: Track) -> float:
    """Held-out error of the final model on plain means, lines and all."""
    return held_out_score(track.prepared.plain, solve(track.prepared.plain, track.fit.model)).rms


def _rounding(track: Track, alpha: float, scores: tuple[Score, Score]) -> tuple[Added, ...]:
    """Rounding that noise does not blur, where what it leaves would be an effect."""
    made, problem = made_by_rounding(track, alpha), track.problem
    if not made or problem.coarse is None:
        return ()
    p_value = math.exp(max(log_p_unrounded(made[0]), -690.0))
    return (rounding_effect(problem.coarse.step, p_value, problem, *(score.rms for score in scores)),)


def _verdict(track: Track, beside: bool, left: Structure, earth: EarthFindings) -> str:
    physical = [s for s in track.steps if not s.hit.candidate.generic]
    more = bool(left.reasons) or earth.departs
    if earth.suspects or any(r.keys for r in track.rivalries) or (track.steps and track.instead):
        return "confounded"
    if physical or beside or track.prepared.held.hold or track.prepared.rails:
        return "effects-found-incomplete" if more else "effects-found"
    if track.steps:
        return "generic-only"
    return "unexplained-structure" if more else "nothing-significant"


def _added(
    track: Track, index: int, step: Step, parameters: tuple[Estimate, ...], recordings: tuple[Recording, ...]
) -> Added:
    effect = step.hit.candidate.effect
    rivalry = track.rivalries[index] if index < len(track.rivalries) else Rivalry((), None)
    remark = f"one cause, judged on {', '.join(step.together)} together" if step.together else ""
    same = twins(track.problem, track.fit, step.hit.term)
    made = _made_by_sampling(effect, parameters, track.problem.target, recordings)
    drift = next((drift_sentence(e.value, e.sd) for e in parameters if e.parameter == "drift"), "")
    head = head_sentence(effect, parameters[0].value) if track.problem.through_gravity else ""
    remark = "; ".join(filter(None, (remark, twin_sentence(same), rarer_sentence(rivalry.rarer), made, drift, head)))
    if rivalry.noise:
        remark = UNDECIDED
    if track.instead:
        remark = "found with the noise held to what was declared; more noise would explain it as well"
    return Added(
        effect=effect.id,
        order=getattr(effect, "order", None),
        parameters=parameters,
        p_value=step.p_value,
        likelihood_ratio=step.hit.likelihood_ratio,
        confounded_with=(*rivalry.keys, *track.instead),
        held_out_before=step.before.rms,
        held_out_after=step.after.rms,
        generic=step.hit.candidate.generic,
        remark=remark,
        same_curve=(*(e.key for e in same), *rivalry.rarer, *((BiasDrift.id,) if drift else ())),
    )


def _made_by_sampling(
    effect: Effect, parameters: tuple[Estimate, ...], target: str, recordings: tuple[Recording, ...]
) -> str:
    """A sentence on an effect that is half a row, its chord, or half a step of the readings; else empty."""
    channels = [r.channels[target] for r in recordings]
    if effect.id == TimingSkew.id and all(channel.covers == "instant" for channel in channels):
        return half_row_sentence([(e.value, e.sd) for e in parameters], recordings[0].dt)
    if effect.id == ScaleFactorCubic.id:
        return chord_sentence(parameters[0].value, parameters[0].sd, recordings[0].dt) if len(parameters) == 1 else ""
    if isinstance(effect, DeadBand) and not effect.whole:
        (lost,) = (e for e in parameters if e.parameter == "c")
        return half_step_sentence(lost.value, lost.sd, max(counted(channel.values) for channel in channels))
    return ""


def _rejected(track: Track, alpha: float) -> tuple[Rejected, ...]:
    """Candidates of the last search that were not added, most significant first."""
    rows = [
        Rejected(r.hit.candidate.effect.key, r.hit.p_value, r.hit.likelihood_ratio, r.reason) for r in track.refusals
    ]
    named = {row.effect for row in rows} | {s.hit.candidate.effect.key for s in track.steps}
    sensitivity = Sensitivity(track.problem, track.fit)
    for hit in (*track.last_physical, *(track.hits or ())):
        key = hit.candidate.effect.key
        if key not in named:
            named.add(key)
            reason = "not significant" if hit.p_value >= alpha else "already explained by what was added"
            reason = hit.remark or reason
            row = Rejected(key, hit.p_value, hit.likelihood_ratio, reason)
            least = Lazy(partial(sensitivity.smallest, hit, alpha))
            rows.append(replace(row, least=least) if reason == "not significant" else row)
    if track.prepared.held.excluded:
        rows.append(Rejected(SampleHold.id, 1.0, 0.0, "not significant"))
    return tuple(sorted(rows, key=lambda row: row.p_value))


def _collinear(track: Track) -> tuple[NotTestable, ...]:
    """Effects whose regressors the model already spans on this recording."""
    seen = {h.candidate.effect.key for h in (*track.last_physical, *(track.hits or ()))}
    seen |= {s.hit.candidate.effect.key for s in track.steps} | {r.hit.candidate.effect.key for r in track.refusals}
    return tuple(
        NotTestable(c.effect.key, (), "on this recording it looks exactly like what the model already has")
        for c in track.candidates
        if c.effect.key not in seen
    )


def _not_testable(track: Track, collinear: tuple[NotTestable, ...]) -> tuple[NotTestable, ...]:
    """What the recording cannot show; a rival of what was added is said to be one."""
    rivals = {key for one in track.rivalries for key in one.keys}
    untold = (*_inseparable(track), *track.not_testable, *collinear)
    return tuple(one for one in untold if one.effect not in rivals)


def _inseparable(track: Track) -> tuple[NotTestable, ...]:
    """Declared effects of which the recording tells nothing beside the ones declared before them."""
    kept = {label[0] for label in track.fit.design.labels}
    dropped = {key for key, _ in track.fit.design.dropped}
    reason = (
        "declared, but on this recording it cannot be told from the effects declared before it, which hold its part"
    )
    declared = dict.fromkeys(term.effect.key for term in track.prepared.model)
    return tuple(NotTestable(key, (), reason) for key in declared if key in dropped and key not in kept)


def _traces(recordings: tuple[Recording, ...], plain: Problem, before: Fit, problem: Problem, fit: Fit) -> Traces:
    covariates: dict[str, Floats] = {}
    motions = [e.motion for e in problem.exposures]
    if all(m.temperature is not None for m in motions):
        kelvins = (temperature_excess(m, "temperature") + m.reference_temperature for m in motions)
        covariates["temperature"] = problem.bins.mean(tuple(kelvins))
    if problem.turns:
        felt = "force" if problem.through_gravity else "rate"
        covariates[felt] = problem.bins.mean(tuple(e.u for e in problem.exposures))
    angles = [(m.angle, m.stands) for m in motions if m.angle is not None]
    if len(angles) == len(motions) and any(np.ptp(angle) > 0 for angle, _ in angles):
        cells = tuple(a[1:] if stands else 0.5 * (a[1:] + a[:-1]) for a, stands in angles)
        covariates["angle"] = np.mod(problem.bins.mean(cells), 2 * np.pi)
    return Traces(
        t=problem.bins.time,
        run=problem.bins.run + 1,
        held_out=problem.bins.held_out,
        before=_residual_before(plain, before, problem),
        after=residual(problem, fit),
        covariates=covariates,
    )


def _residual_before(plain: Problem, before: Fit, problem: Problem) -> Floats:
    """Residual of the declared model on the bins that are left: a held output takes rows away at its start."""
    there = [np.isin(one, other) for one, other in zip(plain.bins.kept, problem.bins.kept, strict=True)]
    return residual(plain, before)[np.concatenate(there)]


def _spectra(plain: Problem, before: Fit, problem: Problem, fit: Fit, declared: dict[str, float]) -> Spectra:
    """Spectrum and Allan deviation of the longest stretch of bins, before and after."""
    start, stop = _longest(problem)
    if stop - start < SHORTEST:
        start, stop = 0, problem.bins.n  # in many short pieces: all of them, one after another
    width = problem.bins.width
    left = _residual_before(plain, before, problem)[start:stop], residual(problem, fit)[start:stop]
    segments = int(np.clip((stop - start) // 64, 1, 15))
    spectra = [psd(x, width, segments) for x in left]
    allan = [allan_deviation(x, width) for x in left]
    f, tau = spectra[1].f, allan[1].taus
    fitted = {term.id: math.sqrt(p) for term, p in zip(NOISE_TERMS, fit.noise.power, strict=True)}
    return Spectra(
        f=f,
        psd_before=spectra[0].density,
        psd_after=spectra[1].density,
        psd_fitted=_total(lambda e, c: readings_density(e, c, f, width), fitted),
        psd_declared=_total(lambda e, c: readings_density(e, c, f, width), declared) if declared else None,
        tau=tau,
        allan_before=allan[0].deviation,
        allan_after=allan[1].deviation,
        allan_lower=allan[1].lower,
        allan_upper=allan[1].upper,
        allan_fitted=np.sqrt(_total(lambda e, c: e.allan(c, tau) ** 2, fitted)),
        allan_declared=np.sqrt(_total(lambda e, c: e.allan(c, tau) ** 2, declared)) if declared else None,
    )


def _longest(problem: Problem) -> tuple[int, int]:
    """Longest stretch of consecutive bins, fitted and held-out ones together."""
    best, start = (0, 0), 0
    run, time = problem.bins.run, problem.bins.time
    breaks = np.flatnonzero((np.diff(run) != 0) | (np.diff(time) > 1.5 * problem.bins.width)) + 1
    for stop in (*breaks.tolist(), problem.bins.n):
        if stop - start > best[1] - best[0]:
            best = (start, stop)
        start = stop
    return best


def _total(value, coefficients: dict[str, float]) -> Floats:  # type: ignore[no-untyped-def]
    """Sum over noise effects of ``value(effect, coefficient)``."""
    return sum(value(_noise(key), np.array([c])) for key, c in coefficients.items())


def _noise(key: str) -> NoiseEffect:
    return next(term for term in NOISE_TERMS if term.id == key)
