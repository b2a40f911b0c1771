"""Triads in many attitudes whose errors are known, traced; the rests that are found of them."""

from __future__ import annotations

from collections.abc import Mapping

from positions_cases import ACCELS, Case, manifest, recording, scales, tied

from insenv.core.recording import Recording
from insenv.data.manifest import HeldOut
from insenv.effects.catalogue import by_key
from insenv.identify.positions.least_squares import Fit
from insenv.identify.positions.rests import find_rests
from insenv.identify.positions.search import Outcome
from insenv.identify.positions.trace import Positions, trace_positions

CALIBRATED = ("accel_bias", "accel_scale_factor")
ACCEL_TRUTH = (0.1, -0.2, 0.05, 2e-3, -1e-3, 3e-3)
SCALED = scales(*ACCEL_TRUTH[3:])
CROOKED = tied(1e-3, -0.7e-3, 0.5e-3)
TURNED = tied(4e-3, 5e-3, -6e-3, -1.0)


def trace(
    case: Case,
    seed: int,
    targets: tuple[str, ...] = ACCELS,
    declared: tuple[str, ...] = CALIBRATED,
    tried: tuple[str, ...] | None = None,
) -> Positions:
    effects = None if tried is None else tuple(map(by_key, tried))
    return trace_positions(manifest(targets, declared), (recording(case, seed),), effects)


def names(outcome: Outcome) -> list[str]:
    return sorted(step.term.effect.key for step in outcome.steps)


def z_scores(fit: Fit, truth: Mapping[str, tuple[float, ...]]) -> list[float]:
    """Errors in standard deviations of all coefficients of the terms named in ``truth``."""
    scores = []
    for term in fit.terms:
        own = fit.of(term)
        scores += list((fit.theta[own] - truth[term.effect.key]) / fit.sd()[own])
    return scores


def found_rows(run: Recording) -> list[tuple[int, int]]:
    channels = [name for name in run.channels if name[:5] in ("accel", "gyro_")]
    model = manifest(ACCELS, CALIBRATED, HeldOut(positions=(1,)))
    return [(r.start, r.stop) for r in find_rests(model, (run,), channels).rests]
