"""Closing the loop on a triad that is held still in many attitudes: from the recording to what was found.

Rests, then the accelerometers, then the gyros with the calibrated accelerometers as their attitude reference. What is
found belongs to the triad; each target has it with the coefficients of its own axis, and the triad's one error on
held-out rests.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, fdtrc

from insenv.core.earth import EARTH_RATE
from insenv.core.errors import InputError
from insenv.core.recording import Floats, Recording
from insenv.core.units import STANDARD_GRAVITY
from insenv.data.manifest import Manifest
from insenv.effects.base import Effect
from insenv.effects.bias import Bias, BiasDrift, BiasStep
from insenv.effects.catalogue import by_key
from insenv.effects.cross import CrossAxis, GSensitivity
from insenv.effects.noise import RateRandomWalk
from insenv.effects.rate.scale import ScaleFactor, ScaleFactorTemperature
from insenv.effects.thermal import BiasTemperature
from insenv.effects.triad import AccelBias, AccelScaleFactor, Misalignment, NonOrthogonality
from insenv.identify.findings import NotTestable, Rejected
from insenv.identify.positions.accel import Magnitudes, directions, gravities, through_runs, uncertain_directions
from insenv.identify.positions.accel import with_walk as with_bias_walk
from insenv.identify.positions.checks.bent import REPEATS, WORST, bent, not_repeated
from insenv.identify.positions.checks.creep import creeping
from insenv.identify.positions.checks.numbers import clipped, silenced
from insenv.identify.positions.checks.wander import wandering
from insenv.identify.positions.evidence import evidence, held_out_errors, held_out_scatter
from insenv.identify.positions.factor import common_factor, factor_of, other_axes, unaccounted
from insenv.identify.positions.gyro import Rotations, rotations, with_noise
from insenv.identify.positions.jump import likeliest_jump
from insenv.identify.positions.known import (
    KnownAttitudes,
    as_level_as_read,
    as_quiet_as_read,
    noise_of_means,
    stated_up,
)
from insenv.identify.positions.least_squares import Fit, in_turn, solve
from insenv.identify.positions.model import AXES, Surroundings, TriadTerm, triad_term
from insenv.identify.positions.outliers import outliers
from insenv.identify.positions.rest import RestMeans, RestTerm, over_walks, with_walk
from insenv.identify.positions.rests import Rest, Rests, find_rests, means, middle_times, rows_of_parts
from insenv.identify.positions.search import (
    DISTINCT,
    INCREDIBLE,
    LEAST_FREEDOM,
    UNFORETOLD,
    Doubt,
    Outcome,
    Step,
    as_told,
    distinct,
    search,
)
from insenv.identify.positions.walk import ALLOWED
from insenv.identify.positions.walk import LEAST_FREEDOM as WALK_FREEDOM

#: Effects of each part that may be declared. Those that are not are tried, but for what is slow on gyros at rest: a
#: bias that walks there looks like a drift.
OF_ACCELEROMETERS = (
    AccelBias.id,
    AccelScaleFactor.id,
    NonOrthogonality.id,
    BiasDrift.id,
    BiasTemperature.id,
    ScaleFactorTemperature.id,
)
OF_ROTATIONS = (ScaleFactor.id, NonOrthogonality.id, Misalignment.id)
OF_RESTS = (GSensitivity.id, BiasDrift.id, BiasTemperature.id)
SLOW = (BiasDrift.id, BiasTemperature.id)
#: The noise that looks like them.
WALK = RateRandomWalk.id
#: What turns the directions that accelerometers show.
CALIBRATION = (AccelBias.id, AccelScaleFactor.id, NonOrthogonality.id)
#: May be declared of the rotations, and is not tried: non-orthogonality and misalignment are its parts.
WHOLE = CrossAxis.id
#: Below this p-value beside biases that walk, what is significant without them is said.
NEARLY = 0.1
#: Error of the magnitude of gravity that no unit at rest has, beside all that was found [m/s^2].
NO_REST = 0.5
#: What is wanted where rests do not tell an effect: there are too few, or an axis points one way in all of them.
UNTOLD = (("more positions",), ("other attitudes",))


@dataclass(frozen=True)
class Part:
    """One problem, and what its search came to; ``parted`` are effects of which an axis, or more, is not told."""

    problem: Magnitudes | Rotations | RestMeans
    outcome: Outcome
    reasons: tuple[str, ...]
    parted: tuple[TriadTerm, ...] = ()


@dataclass(frozen=True)
class Positions:
    """Everything that was found: ``gyro`` (None without turns) and ``at_rest`` (one of each axis) of gyros as targets.

    ``forces``, shape (rests, 3), are the calibrated specific forces of ``rests``; ``calm`` are the stretches of them by
    which gyros are judged.
    """

    rests: tuple[Rest, ...]
    calm: tuple[Rest, ...]
    remarks: tuple[str, ...]
    forces: Floats
    gravity_known: bool
    accel: Part
    gyro: Part | None = None
    at_rest: tuple[Part, ...] = ()


def trace_positions(
    manifest: Manifest,
    recordings: tuple[Recording, ...],
    tried: Sequence[Effect] | None = None,
    alpha: float = 0.01,
    progress: Callable[[str], None] = lambda text: None,
) -> Positions:
    """Find the rests, and what the declared model of the triads lacks.

    Raises
    ------
    InputError
        If a channel is missing, rests are too few, or a declared effect is none that rests show.
    """
    gyros = any(target.startswith("gyro") for target in manifest.model.targets)
    prefixes = _check(manifest, recordings, gyros)
    progress("finding rests")
    channels = [f"{prefix}_{axis}" for prefix in prefixes for axis in AXES]
    keys = None if tried is None else tuple(effect.key for effect in tried)
    found = find_rests(manifest, recordings, channels, _wanted(manifest, keys))
    progress("accelerometers")
    accel, left_out, known = _accelerometers(manifest, recordings, found, keys, alpha)
    assert isinstance(accel.problem, Magnitudes)
    after = accel.outcome.after
    forces = directions(accel.problem.measured, accel.problem.around, after.terms, after.theta)
    dropped = {rest.number for rest, left in zip(found.rests, left_out, strict=True) if left}
    calm = tuple(rest for rest in found.calm if rest.number not in dropped)
    remarks = (*found.remarks, *_named(found.rests, recordings, left_out))
    whole = Positions(found.rests, calm, remarks, forces, known, accel)
    if not gyros:
        return whole
    progress("gyros")
    around = _surroundings(manifest, recordings, calm)
    directed = directions(means(recordings, calm, "accel"), around, after.terms, after.theta)
    turns = rotations(recordings, calm, directed, found.in_turn)
    if turns.turns and not (turns.fitted.any() and turns.held_out.any()):
        raise InputError(
            f"{manifest.path}: no turns between rests to fit and to score; wanted rests one after the other"
        )
    at_rest, bias = _gyros_at_rest(manifest, recordings, calm, (directed, around), keys, alpha)
    gyro = None
    if turns.turns:
        away = _uncertain(accel, means(recordings, calm, "accel"), around)
        noise = (bias, {rest.number: each for rest, each in zip(calm, away, strict=True)})
        gyro = _gyros_between(manifest, turns, whole, noise, keys, alpha)
    return replace(whole, gyro=gyro, at_rest=at_rest)


def _check(manifest: Manifest, recordings: Sequence[Recording], gyros: bool) -> tuple[str, ...]:
    """The triads that the recordings have; refuses what a multi-position recording cannot be without."""
    path = manifest.path
    for target in manifest.model.targets:
        if target[-2:] not in ("_x", "_y", "_z"):
            raise InputError(f"{path}: model.target = {target!r}; procedure = 'multi-position' wants axes of a triad")
    wanted = ("accel", "gyro") if gyros else ("accel",)
    for recording in recordings:
        for prefix in wanted:
            lacking = [f"{prefix}_{a}" for a in AXES if f"{prefix}_{a}" not in recording.channels]
            if lacking:
                why = "as attitude reference of the gyros" if gyros and prefix == "accel" else "as one triad"
                found = f"{', '.join(lacking)} missing in [channels]"
                raise InputError(f"{path}: {found}; procedure = 'multi-position' wants {prefix}_x, y and z {why}")
    thermal = [key for key in manifest.model.declared if "temperature" in by_key(key).needs]
    if thermal and not all("temperature" in recording.channels for recording in recordings):
        raise InputError(f"{path}: model.declared has {thermal[0]!r}; wanted temperature in [channels]")
    whole = all(f"gyro_{axis}" in r.channels for r in recordings for axis in AXES)
    return ("accel", "gyro") if whole else ("accel",)


def _surroundings(manifest: Manifest, recordings: Sequence[Recording], rests: Sequence[Rest]) -> Surroundings:
    """Time and temperature of the rests."""
    temperature = None
    if all("temperature" in r.channels for r in recordings):
        temperature = np.array([recordings[r.run].channels["temperature"].values[r.rows].mean() for r in rests])
    return Surroundings(middle_times(recordings, rests), temperature, manifest.model.reference_temperature)


def _wanted(manifest: Manifest, keys: tuple[str, ...] | None) -> int:
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
        return _declared(manifest, "accel")
    return [AccelBias(), AccelScaleFactor()]


def _accelerometers(
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
    _enough(manifest, problem, declared_size, "rests", (len({rest.number for rest in rests}), uncut))
    first = tuple(key for key in OF_ACCELEROMETERS if key != ScaleFactorTemperature.id)
    tried, blind = _candidates(first, declared, problem.around, keys if targets else None)
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
    return replace(part, outcome=outcome, parted=parted), left_out, known


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
    noisy, doubts = _walks(manifest, problem, [*terms, *more], found)
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
    reasons = (*_structure(problem, outcome.after, alpha, "rests", freedom), *_unconfirmed(outcome, alpha))
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


def _magnitudes(
    manifest: Manifest, recordings: Sequence[Recording], found: Rests, declared: Sequence[Effect]
) -> tuple[Magnitudes, bool]:
    """The residuals of the rests with white noise, and whether gravity is known."""
    rests, around = found.rests, _surroundings(manifest, recordings, found.rests)
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


def _walks(
    manifest: Manifest, problem: Magnitudes, terms: Sequence[TriadTerm], found: Rests
) -> tuple[Magnitudes | None, list[Doubt]]:
    """The problem with the walk that is likeliest beside ``terms``, None where none is told, and what to doubt."""
    if isinstance(problem, KnownAttitudes):
        return None, []
    runs = np.array([rest.run for rest in found.rests])
    anew, worst = _set_down_anew(manifest, found)
    most = with_bias_walk(problem, terms, runs, anew)
    doubts = [Doubt(most, (), _WALKING)]
    if worst is not None:
        # What walks is a part of what does not repeat: beside the worst of the one the likeliest of the other.
        least = with_bias_walk(problem, terms, runs, worst, 0.0)
        doubts = [Doubt(least, (), _REPEATED, least.scale), *doubts]
    return (None if most is problem else with_bias_walk(problem, terms, runs, anew, 0.0)), doubts


#: Likelihood ratio beside scatter alone from which on accelerometers' biases are said to change: 1e-8 of three.
GONE = 40.0
#: Probability beside white noise from which on a bias is said to go somewhere: flicker alone, of a good MEMS gyro over
#: minutes, had one in a hundred in five of twelve units without any drift.
FLICKERS = 1e-5
_WALKING = "beside biases that walk as far as these rests allow"
_REPEATED = "beside biases that repeat from rest to rest no better than an accelerometer does at worst"
#: What explains a few rests nearly as well as an effect, and the p-value beside it up to which that is said: what is
#: refused beside the worst repeatability is significant beside the usual one.
_AS_WELL = (
    (_WALKING, "biases that walk from rest to rest", NEARLY),
    (_REPEATED, f"biases that repeat to {1e3 * WORST:g} mm/s^2 and no better", 1.0),
)


def _set_down_anew(manifest: Manifest, found: Rests) -> tuple[Floats | None, Floats | None]:
    """Covariance that parts of one rest have in common, as it is stated or usual, and at its worst.

    None where each rest is a unit of its own: what changes from one to the next is then in their scatter.
    """
    if not found.in_parts:
        return None, None
    number = np.array([rest.number for rest in found.rests])
    one = (number[:, None] == number[None, :]).astype(float)
    stated = None if manifest.positions is None else manifest.positions.repeatability
    return (one * REPEATS**2, one * WORST**2) if stated is None else (one * stated**2, one * stated**2)


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


def _unconfirmed(outcome: Outcome, alpha: float) -> tuple[str, ...]:
    """What is significant and refused, for want of a rest that others foretell or for being more than is credible.

    What is slow and more than credible is none: attitudes that go with time have such a drift from other errors.
    """
    why = {
        UNFORETOLD: "no rest is left that could refuse it: more attitudes would tell",
        INCREDIBLE: "is larger than is credible: check signs, axes and units",
    }
    as_well = tuple(said for doubt, by, least in _AS_WELL for said in _explained_by(outcome, doubt, by, least))
    return tuple(
        f"{one.effect} would explain these rests (p = {one.p_value:.1g}), and {why[one.reason]}"
        for one in outcome.rejected
        if one.reason in why and one.p_value < alpha and not (one.reason == INCREDIBLE and one.effect in SLOW)
    ) + (as_well or _gone(outcome))


def _gone(outcome: Outcome) -> tuple[str, ...]:
    """That biases go further from rest to rest than rests scatter, though a walk stands for it: the likeliest law."""
    laws = (*SLOW, BiasStep.id)
    slow = [one for one in outcome.rejected if one.effect in laws and one.reason == f"not significant {_WALKING}"]
    best = max(slow, key=lambda one: one.likelihood_ratio or 0.0, default=None)
    if best is None or (best.likelihood_ratio or 0.0) < GONE:
        return ()
    return (
        f"the biases change over these rests: {best.effect} explains them far better than scatter does (likelihood "
        f"ratio {best.likelihood_ratio:.3g}), and biases that walk from rest to rest as well: not decided; the same "
        "attitudes again, in another order, would tell",
    )


def _explained_by(outcome: Outcome, doubt: str, by: str, least: float) -> tuple[str, ...]:
    """What would explain the rests and is refused for a ``doubt``, that something else does so as well."""
    names = {
        one.effect: one.p_value
        for one in outcome.rejected
        if one.reason == f"not significant {doubt}" and one.p_value < least and one.effect not in SLOW
    }
    if not names:
        return ()
    return (
        f"{' or '.join(names)} would explain these rests, and {by} nearly as well (p = {min(names.values()):.1g} "
        "beside them): not decided; the same attitudes again, in another order, would tell",
    )


def _uncertain(accel: Part, measured: Floats, around: Surroundings) -> Floats:
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


def _gyros_between(
    manifest: Manifest,
    problem: Rotations,
    found: Positions,
    noise: tuple[float, Mapping[int, Floats]],
    keys: tuple[str, ...] | None,
    alpha: float,
) -> Part:
    """The part of the rotations from rest to rest.

    ``noise`` is the variance of a gyro's mean in a rest [rad^2/s^2], and how uncertain the calibration leaves the
    direction of each rest.
    """
    problem = replace(problem, gain=common_factor(problem))
    declared = [triad_term(e) for e in _declared(manifest, "gyro") if e.id in (*OF_ROTATIONS, WHOLE)]
    _enough(manifest, problem, sum(term.size for term in declared), "turns")
    effects = [term.effect for term in declared]
    tried = [triad_term(e) for e in _candidates(OF_ROTATIONS, effects, Surroundings(np.zeros(1)), keys)[0]]
    # The noise is looked at beside everything that any effect may explain, or it would hold what they do.
    whole = [
        *declared,
        *(triad_term(e) for e in _candidates(OF_ROTATIONS, effects, Surroundings(np.zeros(1)), None)[0]),
    ]
    most = whole if problem.rank * problem.fitted.sum() > sum(t.size for t in whole) + LEAST_FREEDOM else declared
    rest = found.accel.outcome.after.variance * float(np.mean(np.sum(found.accel.problem.root**2, axis=1)))
    direction = rest / float(np.mean(np.sum(found.forces**2, axis=1)))
    problem = with_noise(problem, most, solve(problem, most).theta, direction, *noise)
    outcome = search(problem, declared, tried, alpha)
    untold = problem.gain != 1 and not any(problem.begin((term,)).any() for term in outcome.after.terms)
    wrong = (f"rotations from rest to rest: the gyros' {factor_of([problem.gain])}",) if untold else ()
    after = outcome.after
    axes = other_axes(problem) or unaccounted(problem, problem.errors(after.terms, after.theta)[0])
    wrong = (*wrong, axes) if axes else wrong
    return Part(problem, outcome, (*wrong, *_structure(problem, after, alpha, "turns")))


def _gyros_at_rest(
    manifest: Manifest,
    recordings: Sequence[Recording],
    rests: Sequence[Rest],
    reference: tuple[Floats, Surroundings],
    keys: tuple[str, ...] | None,
    alpha: float,
) -> tuple[tuple[Part, ...], float]:
    """The means at rest of each gyro, and the variance of one about what is found, beside its likeliest walk."""
    (forces, around), in_turn = reference, not any(rest.held_out for rest in rests)
    declared = [e for e in _declared(manifest, "gyro") if e.id in OF_RESTS]
    y = means(recordings, rests, "gyro") - _earth_upward(recordings, rests, forces)
    held_out = np.array([rest.held_out for rest in rests])
    parts, scatter = [], []
    tried, _ = _candidates(tuple(key for key in OF_RESTS if key not in SLOW), declared, around, keys)
    reason = "in the means at rest it looks like a bias that walks at random"
    there = {effect.id for effect in declared}
    blind = tuple(NotTestable(key, (), reason) for key in SLOW if key not in there)
    slow = [key for key in SLOW if key not in there and (key != BiasTemperature.id or around.temperature is not None)]
    untold = [RestTerm(by_key(key)) for key in slow]  # type: ignore[arg-type]
    terms, more = [RestTerm(e) for e in (Bias(), *declared)], [RestTerm(e) for e in tried]  # type: ignore[arg-type]
    runs = np.array([rest.run for rest in rests])
    found = []
    for axis in range(3):
        vertical = _unknown_upward(recordings, rests, forces[:, axis])
        known = np.outer(vertical, vertical) if vertical.any() else None
        problem = RestMeans(y[:, axis], forces, around, ~held_out, held_out | in_turn, np.eye(len(y)), known)
        further = with_walk(problem, [*terms, *more], runs, ALLOWED)
        problem = with_walk(problem, [*terms, *more], runs)
        scatter.append(solve(problem, [*terms, *more]).variance)
        doubts = [Doubt(further, (), "beside a bias that walks as far as these rests allow")]
        doubts += [
            Doubt(problem, (t,), f"beside {t.effect.key}, which these rests do not tell from it") for t in untold
        ]
        outcome = search(problem, terms, more, alpha, doubts)
        found.append((problem, replace(outcome, not_testable=(*outcome.not_testable, *blind))))
    for axis, (problem, outcome) in enumerate(_of_one_cause(found, more, alpha)):
        outcome = _with_slow(problem, outcome, untold, alpha)
        before, after = (over_walks(problem, [*terms, *more], runs, f) for f in (outcome.before, outcome.after))
        outcome = replace(outcome, before=before, after=after)
        silent = silenced(recordings, rests, f"gyro_{AXES[axis]}")
        parts.append(Part(problem, outcome, (*_structure(problem, outcome.after, alpha, "rests"), *silent)))
    return tuple(parts), float(np.median(scatter))


def _of_one_cause(
    found: Sequence[tuple[RestMeans, Outcome]], tried: Sequence[RestTerm], alpha: float
) -> list[tuple[RestMeans, Outcome]]:
    """The searches of three axes, with an effect on those of them that hardly tell it where all together do.

    Their p-values are joined by Fisher's method, -2 sum log p ~ chi-square of six. Source: R. A. Fisher, Statistical
    Methods for Research Workers, 4th ed. (1932), section 21.1.
    """
    joined = list(found)
    for term in tried:
        key = term.effect.key
        told = [{s.term.effect.key: s.p_value for s in out.steps} for _, out in joined]
        asked = [{r.effect: r for r in out.rejected if r.reason.startswith("not significant")} for _, out in joined]
        p = [a.get(key, b[key].p_value if key in b else 1.0) for a, b in zip(told, asked, strict=True)]
        together = float(chdtrc(2 * len(p), -2 * float(np.sum(np.log(np.maximum(p, 1e-300))))))
        for axis, (problem, outcome) in enumerate(joined):
            if together < alpha and key not in told[axis] and p[axis] < NEARLY:
                joined[axis] = problem, _with_another(problem, outcome, term, asked[axis][key], together)
    return joined


def _with_another(problem: RestMeans, outcome: Outcome, term: RestTerm, refused: Rejected, p_value: float) -> Outcome:
    """The outcome with an effect that it refused, where held-out rests are no worse off with it."""
    larger = solve(problem, (*outcome.after.terms, term))
    before, now = held_out_errors(problem, outcome.after, larger)
    if not now <= before:
        return outcome
    step = Step(term, p_value, refused.likelihood_ratio, before, now)
    others = tuple(one for one in outcome.rejected if one is not refused)
    return replace(outcome, after=larger, steps=(*outcome.steps, step), rejected=others)


def _earth_upward(recordings: Sequence[Recording], rests: Sequence[Rest], forces: Floats) -> Floats:
    """Upward part of the Earth's rate in the axes of the rests, shape (rests, 3) [rad/s]; zero where no site says it.

    It goes with gravity, and is a g-sensitivity of 6e-6 rad/s per m/s^2 in middle latitudes to a gyro that sees it.
    """
    known = [recordings[rest.run].site.latitude for rest in rests]
    rate = np.array([0.0 if latitude is None else EARTH_RATE * np.sin(latitude) for latitude in known])
    return np.asarray(rate[:, None] * forces / np.linalg.norm(forces, axis=1)[:, None], float)


def _unknown_upward(recordings: Sequence[Recording], rests: Sequence[Rest], force: Floats) -> Floats:
    """What one axis reads of the Earth's rate where no site says the latitude, a standard deviation, shape (rests,).

    All over the globe it is Omega / sqrt(3) upward.
    """
    untold = np.array([recordings[rest.run].site.latitude is None for rest in rests])
    return np.where(untold, EARTH_RATE / np.sqrt(3) * force / STANDARD_GRAVITY, 0.0)


def _with_slow(problem: RestMeans, outcome: Outcome, slow: Sequence[RestTerm], alpha: float) -> Outcome:
    """The outcome with the slow cause of which means without a walk would be certain, and the walk as its rival.

    That the bias goes is then certain, and why is not; what makes held-out rests worse is none.
    """
    after = outcome.after
    white = replace(problem, root=np.eye(len(problem.y)))
    small = solve(white, after.terms)
    found = [(term, evidence(white, small, solve(white, (*after.terms, term)))) for term in slow]
    level = min(alpha, FLICKERS)
    sure = sorted((e.p_value(len(slow)), i) for i, (_, e) in enumerate(found) if e.p_value(len(slow)) < level)
    for p_value, i in sure[:1]:
        term, told = found[i]
        larger = solve(problem, (*after.terms, term))
        before, now = held_out_errors(problem, after, larger)
        if not now <= before:
            return outcome
        keys = [found[j][0].effect.key for _, j in sure]
        rivals = {**outcome.rivals, keys[0]: (*keys[1:], WALK)}
        blind = tuple(n for n in outcome.not_testable if n.effect not in keys)
        steps = (*outcome.steps, Step(term, p_value, told.likelihood_ratio, before, now))
        return replace(outcome, after=larger, steps=steps, rivals=rivals, not_testable=blind)
    return outcome


def _declared(manifest: Manifest, prefix: str) -> list[Effect]:
    """Declared effects that are meant for this triad, in their order."""
    allowed = {
        "accel": OF_ACCELEROMETERS,
        "gyro": (Bias.id, *OF_ROTATIONS, WHOLE, *OF_RESTS),
    }
    both = {t.partition("_")[0] for t in manifest.model.targets}
    known = {key for name in both for key in (*allowed[name], Bias.id)}
    effects = []
    for key in manifest.model.declared:
        effect = by_key(key)
        if effect.id not in known:
            names = ", ".join(sorted(known))
            where = f"{manifest.path}: model.declared has {key!r}"
            raise InputError(f"{where}; of {', '.join(sorted(both))} in several positions wanted some of {names}")
        if effect.id == Bias.id and prefix == "accel":
            if AccelBias.id in manifest.model.declared:
                continue
            effect = AccelBias()
        if effect.id in allowed[prefix]:
            effects.append(effect)
    return effects


def _candidates(
    allowed: tuple[str, ...], declared: Sequence[Effect], around: Surroundings, keys: tuple[str, ...] | None
) -> tuple[list[Effect], tuple[NotTestable, ...]]:
    """Effects to try beside the declared ones, and those that lack a channel."""
    there = {effect.key for effect in declared}
    tried, blind = [], []
    for effect in map(by_key, allowed):
        names = {effect.key, effect.id} | ({Bias.id} if effect.id == AccelBias.id else set())
        if effect.key in there or any(e.id == WHOLE for e in declared) and effect.id != ScaleFactor.id:
            continue
        if keys is not None and not names & set(keys):
            continue
        if "temperature" in effect.needs and around.temperature is None:
            blind.append(NotTestable(effect.key, ("temperature",), "the recording has no such channel"))
        else:
            tried.append(effect)
    return tried, tuple(blind)


def _enough(
    manifest: Manifest, problem: Magnitudes | Rotations, size: int, units: str, told: tuple[int, str] | None = None
) -> None:
    """Refuse fewer rests than the declared model can be fitted to.

    ``told`` are the attitudes of them, of which parts are none, and what else would do.
    """
    count = int(problem.fitted.sum())
    least = -(-(size + LEAST_FREEDOM) // problem.rank)
    silent = "" if in_turn(problem) else ", or no [held_out] at all: each is then held out in its turn"
    distinct, instead = (count, "") if told is None else told
    if told is not None and distinct * problem.rank < size:
        found = f"{distinct} {units} for {size} declared parameters"
        raise InputError(f"{manifest.path}: {found}; wanted at least {-(-size // problem.rank)} attitudes")
    if count < least:
        found = f"{count} {units} to fit for {size} declared parameters"
        raise InputError(f"{manifest.path}: {found}; wanted at least {least} that are not held out{silent or instead}")


def _named(rests: Sequence[Rest], recordings: Sequence[Recording], left_out: NDArray[np.bool_]) -> tuple[str, ...]:
    """A sentence about rests that were left out."""
    if not left_out.any():
        return ()
    places = [
        f"{r.number} ({run.label}, {run.t[r.start]:.6g} to {run.t[r.stop - 1]:.6g} s)"
        for r, run, left in zip(rests, (recordings[r.run] for r in rests), left_out, strict=True)
        if left
    ]
    noun = "rest" if len(places) == 1 else "rests"
    return (f"{noun} {', '.join(places)} left out of every fit: what was read there fits no triad",)


def _structure(
    problem: Magnitudes | Rotations | RestMeans, fit: Fit, alpha: float, units: str, freedom: int | None = None
) -> tuple[str, ...]:
    """Whether the held-out units scatter as the fitted ones foretell; a sentence where they do not.

    ``freedom`` is that of the noise, that of the fit if None.
    """
    if isinstance(problem, Magnitudes) and (error := held_out_errors(problem, fit)[0]) > NO_REST:
        share = error / STANDARD_GRAVITY
        return (f"rests miss gravity by {error:.2g} m/s^2 ({share:.0%}): the unit moved, or an axis reads no force",)
    if in_turn(problem):
        return ()  # all are fitted, and each is foretold by all others
    freedom = fit.freedom if freedom is None else freedom
    if freedom < 1 or not fit.variance > 0:
        return ()
    ratio, count = held_out_scatter(problem, fit, problem.held_out, fit.variance)
    p = float(fdtrc(count, freedom, ratio))
    if p >= alpha:
        return ()
    return (f"held-out {units} scatter {np.sqrt(ratio):.3g} times as much as the fitted ones foretell (p = {p:.1e})",)
