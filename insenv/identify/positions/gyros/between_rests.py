"""Gyros from rest to rest: what the declared model of their rotations lacks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from insenv.core.recording import Floats
from insenv.data.manifest import Manifest
from insenv.identify.positions.gyros.factor import common_factor, factor_of, other_axes, unaccounted
from insenv.identify.positions.gyros.rotations import Rotations, with_noise
from insenv.identify.positions.least_squares import solve
from insenv.identify.positions.model import Surroundings, triad_term
from insenv.identify.positions.part import OF_ROTATIONS, WHOLE, Part, candidates, declared_of, enough, structure
from insenv.identify.positions.search import LEAST_FREEDOM, search


def trace_between_rests(
    manifest: Manifest,
    problem: Rotations,
    noise: tuple[float, float, Mapping[int, Floats]],
    keys: tuple[str, ...] | None,
    alpha: float,
) -> Part:
    """The part of the rotations from rest to rest.

    ``noise`` is the variance of a direction in a rest [rad^2] and that of a gyro's mean [rad^2/s^2], and how uncertain
    the calibration leaves the direction of each rest.
    """
    problem = replace(problem, gain=common_factor(problem))
    declared = [triad_term(e) for e in declared_of(manifest, "gyro") if e.id in (*OF_ROTATIONS, WHOLE)]
    enough(manifest, problem, sum(term.size for term in declared), "turns")
    effects = [term.effect for term in declared]
    tried = [triad_term(e) for e in candidates(OF_ROTATIONS, effects, Surroundings(np.zeros(1)), keys)[0]]
    # The noise is looked at beside everything that any effect may explain, or it would hold what they do.
    whole = [
        *declared,
        *(triad_term(e) for e in candidates(OF_ROTATIONS, effects, Surroundings(np.zeros(1)), None)[0]),
    ]
    most = whole if problem.rank * problem.fitted.sum() > sum(t.size for t in whole) + LEAST_FREEDOM else declared
    problem = with_noise(problem, most, solve(problem, most).theta, *noise)
    outcome = search(problem, declared, tried, alpha)
    untold = problem.gain != 1 and not any(problem.begin((term,)).any() for term in outcome.after.terms)
    wrong = (f"rotations from rest to rest: the gyros' {factor_of([problem.gain])}",) if untold else ()
    after = outcome.after
    axes = other_axes(problem) or unaccounted(problem, problem.errors(after.terms, after.theta)[0])
    wrong = (*wrong, axes) if axes else wrong
    return Part(problem, outcome, (*wrong, *structure(problem, after, alpha, "turns")))
