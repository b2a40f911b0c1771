"""Accelerometers of a triad that is held still in many attitudes: what their declared model lacks.

And what their calibration is worth as the attitude reference of gyros.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.recording import Floats, Recording
from insenv.core.units import STANDARD_GRAVITY
from insenv.data.manifest import Manifest
from insenv.effects.base import Effect
from insenv.effects.bias import BiasStep
from insenv.effects.catalogue import by_key
from insenv.effects.rate.scale import ScaleFactorTemperature
from insenv.effects.triad import AccelBias, AccelScaleFactor, NonOrthogonality
from insenv.identify.findings import NotTestable
from insenv.identify.positions.accelerometers.doubts import unconfirmed, walks
from insenv.identify.positions.accelerometers.jump import likeliest_jump
from insenv.identify.positions.accelerometers.known import (
    KnownAttitudes,
    as_level_as_read,
    as_quiet_as_read,
    noise_of_means,
    stated_up,
)
from insenv.identify.positions.accelerometers.magnitudes import (
    Magnitudes,
    directions,
    gravities,
    through_runs,
    uncertain_directions,
)
from insenv.identify.positions.accelerometers.outliers import outliers
from insenv.identify.positions.checks.bent import REPEATS, bent, not_repeated
from insenv.identify.positions.checks.creep import creeping
from insenv.identify.positions.checks.numbers import clipped
from insenv.identify.positions.checks.wander import wandering
from insenv.identify.positions.evidence import held_out_errors
from insenv.identify.positions.least_squares import Fit, solve
from insenv.identify.positions.model import Surroundings, TriadTerm, triad_term
from insenv.identify.positions.part import (
    NO_REST,
    OF_ACCELEROMETERS,
    SLOW,
    Part,
    candidates,
    declared_of,
    enough,
    structure,
    surroundings,
)
from insenv.identify.positions.rests import Rests, means, rows_of_parts
from insenv.identify.positions.search import DISTINCT, LEAST_FREEDOM, Outcome, as_told, distinct, search
from insenv.identify.positions.walk import LEAST_FREEDOM as WALK_FREEDOM

#: What turns the directions that accelerometers show.
CALIBRATION = (AccelBias.id, AccelScaleFactor.id, NonOrthogonality.id)
#: What is wanted where rests do not tell an effect: there are too few, or an axis points one way in all of them.
UNTOLD = (("more positions",), ("other attitudes",))
#: Angle up to which directions of gravity are one [rad].
ONE_WAY = math.radians(0.5)


def trace_accelerometers(
    manifest: Manifest,
    recordings: Sequence[Recording],
    found: Rests,
    keys: tuple[str, ...] | None,
    alpha: float,
) -> tuple[Part, NDArray[np.bool_], bool]:
    """The accelerometers' part, rests that were left out, and whether gravity is known."""
    rests, targets = found.rests, any(target.startswith("accel") for target in manifest.model.targets)
    declared = _of_accelerometers(manifest)
    problem, known = _magnitudes(manifest, recordings, found, declared)
    terms = [triad_term(effect) for effect in declared]
    declared_size = sum(term.size for term in terms)
    rows = max(rows_of_parts(recordings[rest.run]) for rest in rests)
    uncut = f", or rests of {rows} rows and more, which are cut into parts" if not found.in_parts else ""
    enough(manifest, problem, declared_size, "rests", (len({rest.number for rest in rests}), uncut))
    first = tuple(key for key in OF_ACCELEROMETERS if key != ScaleFactorTemperature.id)
    tried, blind = candidates(first, declared, problem.around, keys if targets else None)
    more = [triad_term(effect) for effect in tried]
    steady, walks = _by_pace(more)
    left_out, room = np.zeros(len(rests), dtype=bool), len(rests) * problem.rank
    if isinstance(problem, KnownAttitudes):
        if problem.tolerance is not None:
            problem = as_quiet_as_read(problem, [*terms, *steady])
        left = solve(problem, [*terms, *steady]).residual
        problem = as_level_as_read(problem, left, len(problem.nuisance) + 3)
    elif not found.in_parts:
        left_out = outliers(problem, [*terms, *more])
        problem = replace(problem, fitted=problem.fitted & ~left_out, held_out=problem.held_out & ~left_out)
    if isinstance(problem, KnownAttitudes) or found.in_parts:
        steady = as_told(problem, terms, steady)
    parted = tuple(term for term in steady if term.size < triad_term(term.effect).size)
    more = [*steady, *walks, *_jump(problem, [*terms, *steady, *walks], found, keys if targets else None)]
    if found.in_parts and not isinstance(problem, KnownAttitudes):
        room = len({rest.number for rest in rests}) - declared_size
        more, few = _determined(more, room)
        blind += few
    part = _part(manifest, recordings, problem, terms, more, found, room, alpha)
    if again := _gain_over_temperature(part, more, keys if targets else None, declared):
        other = _part(manifest, recordings, problem, terms, again, found, room, alpha)
        part = other if any(step.term == again[-1] for step in other.outcome.steps) else part
    outcome = replace(part.outcome, not_testable=(*part.outcome.not_testable, *blind))
    if targets:
        _points_somewhere(manifest, problem, part.outcome.before, len({rest.number for rest in rests}))
    return replace(part, outcome=outcome, parted=parted), left_out, known


def _points_somewhere(manifest: Manifest, problem: Magnitudes, fit: Fit, count: int) -> None:
    """Refuses rests in one attitude where scale factors were fitted: any that are large enough fit them.

    Raises
    ------
    InputError
        If gravity points one way in all rests by what was fitted.
    """
    scales = any(term.effect.id == AccelScaleFactor.id for term in fit.terms)
    if isinstance(problem, KnownAttitudes) or not scales:
        return
    if _one_way(directions(problem.measured, problem.around, fit.terms, fit.theta)):
        read = _one_way(problem.measured)
        raise InputError(
            f"{manifest.path}: gravity points one way in all {count} rests, to {math.degrees(ONE_WAY):g} deg; wanted "
            "other attitudes for the scale factors that are declared"
            if read
            else f"{manifest.path}: no bias and scale factor bring the {count} rests to one magnitude of gravity, but "
            "factors of a thousand and more; wanted rests without a drift or a knock, or in more attitudes"
        )


def _one_way(forces: Floats) -> bool:
    """Whether specific forces, shape (rests, 3), have one direction."""
    up = forces / np.linalg.norm(forces, axis=1, keepdims=True)
    mean = up.mean(axis=0)
    return float(np.min(up @ mean)) > math.cos(ONE_WAY) * float(np.linalg.norm(mean))


def wanted_rests(manifest: Manifest, keys: tuple[str, ...] | None) -> int:
    """Rests that the declared model of the accelerometers wants fitted, with scale factors where those are tried."""
    effects = _of_accelerometers(manifest)
    scale = AccelScaleFactor()
    if scale not in effects and (keys is None or scale.key in keys):
        effects = [*effects, scale]
    equations = sum(triad_term(effect).size for effect in effects) + LEAST_FREEDOM
    return -(-equations // 3) if _stated(manifest) else equations


def _stated(manifest: Manifest) -> bool:
    """Whether attitudes are stated."""
    return manifest.positions is not None and bool(manifest.positions.up)


def _of_accelerometers(manifest: Manifest) -> list[Effect]:
    """Declared effects of the accelerometers; where they are no target, what makes them an attitude reference."""
    if any(target.startswith("accel") for target in manifest.model.targets):
        return declared_of(manifest, "accel")
    return [AccelBias(), AccelScaleFactor()]


def _magnitudes(
    manifest: Manifest, recordings: Sequence[Recording], found: Rests, declared: Sequence[Effect]
) -> tuple[Magnitudes, bool]:
    """The residuals of the rests with white noise, and whether gravity is known."""
    rests, around = found.rests, surroundings(manifest, recordings, found.rests)
    gravity, known = gravities(recordings, rests)
    free = not known and all(effect.part != "gain" for effect in declared)
    held_out = np.array([rest.held_out for rest in rests])
    uses = ~held_out, held_out | (found.in_turn and not found.in_parts)
    measured = means(recordings, rests, "accel")
    if not np.all(np.any(measured, axis=1)):
        raise InputError(f"{manifest.path}: in a rest all accelerometers read 0; wanted gravity there, in finer steps")
    if not _stated(manifest):
        return Magnitudes(measured, gravity, around, *uses, free), known
    assert manifest.positions is not None
    # One row tells nothing of its own noise: what an accelerometer repeats stands for it until a fit tells it.
    single = all(rest.rows.stop - rest.rows.start == 1 for rest in rests)
    noise = REPEATS if single else noise_of_means(recordings, rests)
    across = float(np.hypot(1.0, STANDARD_GRAVITY * manifest.positions.tolerance / noise))
    up = stated_up(manifest, rests, measured)
    stated = KnownAttitudes(measured, gravity, around, *uses, up=up, across=across, noise_of_mean=noise)
    return replace(stated, tolerance=across * noise if single else None), known


def _part(  # noqa: PLR0913 -- a search and its judgement take all that led to them
    manifest: Manifest,
    recordings: Sequence[Recording],
    problem: Magnitudes,
    terms: Sequence[TriadTerm],
    more: Sequence[TriadTerm],
    found: Rests,
    room: int,
    alpha: float,
) -> Part:
    """What ``more`` than the declared ``terms`` the rests call for, and what speaks against it."""
    noisy, doubts = walks(manifest, problem, [*terms, *more], found)
    # Where the rests tell a walk, they tell a drift or a jump.
    slow = [] if noisy is not None else [term for term in more if term.effect.id in (*SLOW, BiasStep.id)]
    blind = tuple(
        NotTestable(t.effect.key, ("more positions",), "so few rests do not tell it from noise") for t in slow
    )
    problem = noisy if noisy is not None and found.in_parts else problem
    told = partial(_determined_together, room=room)
    outcome = search(problem, terms, [term for term in more if term not in slow], alpha, doubts, slow, told)
    outcome = replace(outcome, not_testable=(*outcome.not_testable, *blind))
    # The noise within rests was told beside all that may be found.
    freedom = int(problem.fitted.sum()) - sum(t.size for t in [*terms, *more]) if found.in_parts else None
    reasons = (*structure(problem, outcome.after, alpha, "rests", freedom), *unconfirmed(outcome, alpha))
    if not isinstance(problem, KnownAttitudes):
        reasons = _with_what_is_left(manifest, problem, outcome, recordings, found, more, alpha, reasons)
    return Part(problem, outcome, reasons)


def _gain_over_temperature(
    part: Part, more: Sequence[TriadTerm], keys: tuple[str, ...] | None, declared: Sequence[Effect]
) -> list[TriadTerm]:
    """What is tried a second time, a scale factor that follows the temperature the last; empty if rests do not tell it.

    It takes three coefficients more, with which few rests tell nothing else: it is asked by itself, and where the
    others are too many for a walk to be told, beside what follows the temperature alone.
    """
    problem, effect = part.problem, ScaleFactorTemperature()
    assert isinstance(problem, Magnitudes)
    there = {one.key for one in declared}
    if problem.around.temperature is None or effect.key in there or not (keys is None or effect.key in keys):
        return []
    before, gain = part.outcome.before, triad_term(effect)
    told = [term for term in (*more, gain) if distinct(problem, before, term) >= DISTINCT]
    thermal = [term for term in told if "temperature" in term.effect.needs]
    fits = (set_ for set_ in (told, thermal) if before.freedom - sum(term.size for term in set_) >= WALK_FREEDOM)
    return next(fits, []) if gain in told else []


def _jump(
    problem: Magnitudes, terms: Sequence[TriadTerm], found: Rests, keys: tuple[str, ...] | None
) -> tuple[TriadTerm, ...]:
    """A step of the biases where rests of one run may tell it and it is to be tried."""
    if found.in_parts or found.rests[0].run != found.rests[-1].run or not (keys is None or BiasStep.id in keys):
        return ()
    jump = likeliest_jump(problem, terms)
    return () if jump is None else (jump,)


def _by_pace(terms: Sequence[TriadTerm]) -> tuple[list[TriadTerm], list[TriadTerm]]:
    """Terms that hold whenever a rest was, and those that are slow."""
    slow = [term for term in terms if term.effect.id in SLOW]
    return [term for term in terms if term not in slow], slow


def _determined(terms: Sequence[TriadTerm], attitudes: int) -> tuple[list[TriadTerm], tuple[NotTestable, ...]]:
    """Terms that ``attitudes`` more than the declared model takes can tell, and the others: parts are no attitudes."""
    told, blind = [], []
    for term in terms:
        if term.effect.id in SLOW or term.size <= attitudes:
            told.append(term)
        else:
            reason = f"too few for its parameters; at least {term.size - attitudes} more needed"
            blind.append(NotTestable(term.effect.key, ("more positions",), reason))
    return told, tuple(blind)


def _determined_together(terms: Sequence[TriadTerm], room: int) -> bool:
    """Whether attitudes that leave ``room`` beside the declared model tell terms together."""
    return sum(term.size for term in terms if term.effect.id not in SLOW) <= room


def _with_what_is_left(  # noqa: PLR0913 -- what is left of a fit is judged by all that led to it
    manifest: Manifest,
    problem: Magnitudes,
    outcome: Outcome,
    recordings: Sequence[Recording],
    found: Rests,
    more: Sequence[TriadTerm],
    alpha: float,
    reasons: tuple[str, ...],
) -> tuple[str, ...]:
    """The reasons, with what an instrument that is straight and repeats itself does not leave in the magnitudes."""
    # Parts are no attitudes, and of a unit that moved no rest tells a bend.
    untold = found.in_parts or held_out_errors(problem, outcome.after)[0] > NO_REST
    said = reasons if untold else (*reasons, *bent(problem, outcome.after, alpha, _by_pace(more)[0]))
    changes = any(term.effect.id in SLOW for term in outcome.after.terms)
    said = said if changes else (*said, *creeping(recordings, found.rests))
    noise = noise_of_means(recordings, found.rests)
    if not (untold or changes):
        time = through_runs(problem, np.array([rest.run for rest in found.rests]))
        said = (*said, *wandering(problem, outcome.after, _by_pace(more)[0], time, noise))
    said = (*said, *clipped(recordings, found.rests))
    scarce = any(n.effect == AccelScaleFactor.id and n.needs in UNTOLD for n in outcome.not_testable)
    number = np.array([rest.number for rest in found.rests])
    stated = None if manifest.positions is None else manifest.positions.repeatability
    return (*said, *not_repeated(problem, outcome.after, number, noise, scarce, bool(said), stated))


def variance_of_directions(accel: Part, forces: Floats) -> float:
    """Variance of a component of the direction that the accelerometers show in a rest, with their calibration known."""
    rest = accel.outcome.after.variance * float(np.mean(np.sum(accel.problem.root**2, axis=1)))
    return rest / float(np.mean(np.sum(forces**2, axis=1)))


def uncertain_calibration(accel: Part, measured: Floats, around: Surroundings) -> Floats:
    """What the accelerometers' calibration leaves uncertain of directions, found or not: shape (rests, 3, q).

    All that turns directions counts with what the rests tell of it, and with what is usual where they tell nothing.
    """
    problem, after = accel.problem, accel.outcome.after
    there = {term.effect.id for term in after.terms}
    more = [triad_term(by_key(key)) for key in CALIBRATION if key not in there]
    fit = solve(problem, [*after.terms, *more])
    p = sum(term.size for term in fit.terms)
    usual = np.concatenate([np.full(t.size, max(param.sd for param in t.effect.linear)) for t in fit.terms])
    rows = fit.slopes[problem.fitted].reshape(-1, fit.slopes.shape[2])
    # A fit that leaves no freedom leaves no scatter either: that of the model without the rest is then the noise.
    variance = (fit if fit.freedom >= LEAST_FREEDOM else after).variance
    information = rows.T @ rows / max(variance, 1e-300)
    information[p:, p:] += np.diag(1 / problem.nuisance**2)
    information[:p, :p] += np.diag(1 / usual**2)
    covariance = np.asarray(np.linalg.inv(information), np.float64)[:p, :p]
    return uncertain_directions(measured, around, fit.terms, fit.theta[:p], covariance)
