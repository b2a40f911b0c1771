"""Closing the loop on a triad that is held still in many attitudes: from the recording to what was found.

Rests, then the accelerometers, then the gyros with the calibrated accelerometers as their attitude reference. What is
found belongs to the triad; each target has it with the coefficients of its own axis, and the triad's one error on
held-out rests.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher

from insenv.core.errors import InputError
from insenv.core.manifest import Manifest
from insenv.core.recording import Floats, Recording
from insenv.effects.base import Effect
from insenv.effects.catalogue import by_key
from insenv.identify.findings import NotTestable
from insenv.identify.positions import Rest, find_rests, means, middle_times
from insenv.identify.positions_accel import Magnitudes, gravities
from insenv.identify.positions_gyro import Rotations, rotations, with_noise
from insenv.identify.positions_model import AXES, Surroundings, triad_term
from insenv.identify.positions_rest import RestMeans, RestTerm, with_walk
from insenv.identify.positions_search import LEAST_FREEDOM, Fit, Outcome, search, solve

#: Effects of each part that may be declared. Those that are not are tried, but for what is slow on gyros at rest: a
#: bias that walks there looks like a drift.
OF_ACCELEROMETERS = ("accel_bias", "accel_scale_factor", "non_orthogonality", "bias_drift", "bias_temperature")
OF_ROTATIONS = ("scale_factor", "non_orthogonality", "misalignment")
OF_RESTS = ("g_sensitivity", "bias_drift", "bias_temperature")
SLOW = ("bias_drift", "bias_temperature")
#: May be declared of the rotations, and is not tried: non-orthogonality and misalignment are its parts.
WHOLE = "cross_axis"
#: Probability of an outlier among all fitted rests by which one is left out, and the largest share of them.
OUTLIER, MOST_OUTLIERS = 1e-4, 0.1
#: Least freedom of a fit that is asked for outliers.
OUTLIER_FREEDOM = 6


@dataclass(frozen=True)
class Part:
    """One problem, and what its search came to."""

    problem: Magnitudes | Rotations | RestMeans
    outcome: Outcome
    reasons: tuple[str, ...]


@dataclass(frozen=True)
class Positions:
    """Everything that was found: ``gyro`` and ``at_rest`` (one of each axis) where gyros are targets."""

    rests: tuple[Rest, ...]
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
    found = find_rests(manifest, recordings, [f"{prefix}_{axis}" for prefix in prefixes for axis in AXES])
    around = _surroundings(manifest, recordings, found.rests)
    keys = None if tried is None else tuple(effect.key for effect in tried)
    progress("accelerometers")
    accel, left_out, known = _accelerometers(manifest, recordings, found.rests, around, keys, alpha)
    assert isinstance(accel.problem, Magnitudes)
    forces = accel.problem.directions(accel.outcome.after.terms, accel.outcome.after.theta)
    remarks = (*found.remarks, *_named(found.rests, recordings, left_out))
    whole = Positions(found.rests, remarks, forces, known, accel)
    if not gyros:
        return whole
    progress("gyros")
    turns = rotations(recordings, found.rests, forces, left_out)
    if not turns.fitted.any() or not turns.held_out.any():
        raise InputError(
            f"{manifest.path}: no turns between rests to fit and to score; wanted rests one after the other"
        )
    at_rest = _gyros_at_rest(manifest, recordings, whole, around, keys, alpha)
    gyro = _gyros_between(manifest, turns, whole, at_rest, keys, alpha)
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
    whole = all(f"gyro_{axis}" in r.channels for r in recordings for axis in AXES)
    return ("accel", "gyro") if whole else ("accel",)


def _surroundings(manifest: Manifest, recordings: Sequence[Recording], rests: Sequence[Rest]) -> Surroundings:
    """Time and temperature of the rests."""
    temperature = None
    if all("temperature" in r.channels for r in recordings):
        temperature = np.array([recordings[r.run].channels["temperature"].values[r.rows].mean() for r in rests])
    return Surroundings(middle_times(recordings, rests), temperature, manifest.model.reference_temperature)


def _accelerometers(
    manifest: Manifest,
    recordings: Sequence[Recording],
    rests: Sequence[Rest],
    around: Surroundings,
    keys: tuple[str, ...] | None,
    alpha: float,
) -> tuple[Part, NDArray[np.bool_], bool]:
    """The accelerometers' part, rests that were left out, and whether gravity is known."""
    targets = any(target.startswith("accel") for target in manifest.model.targets)
    declared = _declared(manifest, "accel") if targets else [by_key("accel_bias"), by_key("accel_scale_factor")]
    gravity, known = gravities(recordings, rests)
    held_out = np.array([rest.held_out for rest in rests])
    free = not known and "accel_scale_factor" not in {effect.id for effect in declared}
    problem = Magnitudes(means(recordings, rests, "accel"), gravity, around, ~held_out, held_out, free)
    terms = [triad_term(effect) for effect in declared]
    _enough(manifest, problem, sum(term.size for term in terms), "rests")
    tried, blind = _candidates(OF_ACCELEROMETERS, declared, around, keys if targets else None)
    left_out = _outliers(problem, [*terms, *(triad_term(e) for e in tried)])
    problem = replace(problem, fitted=problem.fitted & ~left_out)
    outcome = search(problem, terms, [triad_term(effect) for effect in tried], alpha)
    outcome = replace(outcome, not_testable=(*outcome.not_testable, *blind))
    return Part(problem, outcome, _structure(problem, outcome.after, alpha, "rests")), left_out, known


def _gyros_between(
    manifest: Manifest,
    problem: Rotations,
    found: Positions,
    at_rest: tuple[Part, ...],
    keys: tuple[str, ...] | None,
    alpha: float,
) -> Part:
    """The part of the rotations from rest to rest."""
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
    direction = found.accel.outcome.after.variance / float(np.mean(np.sum(found.forces**2, axis=1)))
    bias = float(np.median([part.outcome.after.variance for part in at_rest]))
    problem = with_noise(problem, most, solve(problem, most).theta, direction, bias)
    outcome = search(problem, declared, tried, alpha)
    return Part(problem, outcome, _structure(problem, outcome.after, alpha, "turns"))


def _gyros_at_rest(
    manifest: Manifest,
    recordings: Sequence[Recording],
    found: Positions,
    around: Surroundings,
    keys: tuple[str, ...] | None,
    alpha: float,
) -> tuple[Part, ...]:
    """The means at rest of each gyro."""
    declared = [e for e in _declared(manifest, "gyro") if e.id in OF_RESTS]
    y = means(recordings, found.rests, "gyro")
    held_out = np.array([rest.held_out for rest in found.rests])
    fitted = found.accel.problem.fitted
    parts = []
    tried, _ = _candidates(tuple(key for key in OF_RESTS if key not in SLOW), declared, around, keys)
    reason = "in the means at rest it looks like a bias that walks at random"
    there = {effect.id for effect in declared}
    blind = tuple(NotTestable(key, (), reason) for key in SLOW if key not in there)
    terms, more = [RestTerm(e) for e in (by_key("bias"), *declared)], [RestTerm(e) for e in tried]  # type: ignore[arg-type]
    runs = np.array([rest.run for rest in found.rests])
    for axis in range(3):
        problem = RestMeans(y[:, axis], found.forces, around, fitted, held_out, np.eye(len(y)))
        problem = with_walk(problem, [*terms, *more], runs)
        outcome = search(problem, terms, more, alpha)
        outcome = replace(outcome, not_testable=(*outcome.not_testable, *blind))
        parts.append(Part(problem, outcome, _structure(problem, outcome.after, alpha, "rests")))
    return tuple(parts)


def _declared(manifest: Manifest, prefix: str) -> list[Effect]:
    """Declared effects that are meant for this triad, in their order."""
    allowed = {
        "accel": OF_ACCELEROMETERS,
        "gyro": ("bias", *OF_ROTATIONS, WHOLE, *OF_RESTS),
    }
    both = {t.partition("_")[0] for t in manifest.model.targets}
    known = {key for name in both for key in (*allowed[name], "bias")}
    effects = []
    for key in manifest.model.declared:
        effect = by_key(key)
        if effect.id not in known:
            names = ", ".join(sorted(known))
            where = f"{manifest.path}: model.declared has {key!r}"
            raise InputError(f"{where}; of {', '.join(sorted(both))} in several positions wanted some of {names}")
        if effect.id == "bias" and prefix == "accel":
            if "accel_bias" in manifest.model.declared:
                continue
            effect = by_key("accel_bias")
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
        names = {effect.key, effect.id} | ({"bias"} if effect.id == "accel_bias" else set())
        if effect.key in there or any(e.id == WHOLE for e in declared) and effect.id != "scale_factor":
            continue
        if keys is not None and not names & set(keys):
            continue
        if effect.id == "bias_temperature" and around.temperature is None:
            blind.append(NotTestable(effect.key, ("temperature",), "the recording has no such channel"))
        else:
            tried.append(effect)
    return tried, tuple(blind)


def _enough(manifest: Manifest, problem: Magnitudes | Rotations, size: int, units: str) -> None:
    """Refuse fewer rests than the declared model can be fitted to."""
    count = int(problem.fitted.sum())
    least = -(-(size + LEAST_FREEDOM) // problem.rank)
    if count < least:
        found = f"{count} {units} to fit for {size} declared parameters"
        raise InputError(f"{manifest.path}: {found}; wanted at least {least} that are not held out")


def _outliers(problem: Magnitudes, terms: Sequence[object]) -> NDArray[np.bool_]:
    """Fitted rests that nothing explains, shape (rests,), by their residual without them (Student's t, Bonferroni)."""
    left = np.zeros(len(problem.fitted), dtype=bool)
    for _ in range(int(MOST_OUTLIERS * problem.fitted.sum())):
        now = replace(problem, fitted=problem.fitted & ~left)
        fit = solve(now, terms)
        if fit.freedom < OUTLIER_FREEDOM:
            break
        rows = fit.slopes[:, 0]
        leverage = np.minimum(np.einsum("np,pq,nq->n", rows, fit.inverse, rows), 1 - 1e-9)
        own = fit.residual[:, 0] ** 2 / (1 - leverage)
        ratio = own / (np.maximum(fit.rss - own, 1e-300) / (fit.freedom - 1))
        worst = int(np.argmax(np.where(now.fitted, ratio, -1.0)))
        if float(fisher.sf(ratio[worst], 1, fit.freedom - 1)) * now.fitted.sum() > OUTLIER:
            break
        left[worst] = True
    return left


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


def _structure(problem: Magnitudes | Rotations | RestMeans, fit: Fit, alpha: float, units: str) -> tuple[str, ...]:
    """Whether the held-out units scatter as the fitted ones foretell; a sentence where they do not."""
    held = problem.held_out
    r = fit.residual[held].ravel()
    slopes = fit.slopes[held].reshape(len(r), -1)
    covariance = np.eye(len(r)) + slopes @ fit.inverse @ slopes.T
    count = problem.rank * int(held.sum())
    if fit.freedom < 1 or not fit.variance > 0:
        return ()
    ratio = float(r @ np.linalg.solve(covariance, r)) / count / fit.variance
    p = float(fisher.sf(ratio, count, fit.freedom))
    if p >= alpha:
        return ()
    return (f"held-out {units} scatter {np.sqrt(ratio):.3g} times as much as the fitted ones foretell (p = {p:.1e})",)
