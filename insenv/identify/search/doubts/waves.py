"""Waves that are not what their names say: several that are one curve, or a wave of the angle where that is none."""

from __future__ import annotations

import numpy as np

from insenv.identify.fit.problem import Problem
from insenv.identify.search.candidates import turns_few_waves
from insenv.identify.search.one_wave import frequencies, swinging, wave
from insenv.identify.search.tracks import Track

#: Correlation from which on angle and acceleration are one curve, and fewest bins of a block that are asked.
ONE_CURVE, LEAST_BINS = 0.95, 32
#: Orders of the angle from which on their waves are one curve.
MANY_ORDERS = 4


def waves(track: Track) -> tuple[str, ...]:
    """Tones that are one wave, or one line."""
    tones = tuple(s.hit.term.shape[0] for s in track.steps if s.hit.candidate.effect.line)
    span = _span(track.problem)
    found = frequencies(tones, track.prepared.lines, span)
    base, near = wave(found, span), swinging(found)
    if base is not None:
        return (
            f"{len(found)} tones are multiples of {base:.4g} Hz: one wave that is no sine, whose cause is not named",
        )
    if near is None:
        return ()
    low, high = near
    return (
        f"tones at {low:.5g} and {high:.5g} Hz are as near as one line is whose amplitude swings in "
        f"{1 / (high - low):.2g} s: not told from two",
    )


def _span(problem: Problem) -> float:
    """Longest time from the first to the last fitted bin of a run [s]."""
    time, run = problem.bins.time, problem.bins.run
    return max(float(np.ptp(time[(run == r) & ~problem.bins.held_out])) for r in {b.run for b in problem.fitted})


def waves_of_the_angle(track: Track) -> tuple[str, ...]:
    """Waves of the table's angle that are one curve of it: a place in the turn takes as many as were tried."""
    effects = [step.hit.candidate.effect for step in track.steps]
    orders = sorted({order for e in effects if "angle" in e.needs and (order := getattr(e, "order", 0))})
    if len(orders) < MANY_ORDERS:
        return ()
    return (
        f"waves of the orders {', '.join(map(str, orders))} of the table's angle: one curve of it that is no wave, as "
        "of a place in the turn (a magnet, a bearing, a mark), whose cause is not named",
    )


def swung(track: Track) -> tuple[str, ...]:
    """Effects of the angle, of few waves, beside which no cause that goes with the acceleration could be told."""
    named = [s.hit.candidate.effect for s in track.steps]
    names = ", ".join(dict.fromkeys(e.key for e in named if turns_few_waves(track.problem, e)))
    if not names or not swings_at_one_frequency(track.problem):
        return ()
    return (
        f"the table swings at one frequency, where its angle and its acceleration are one curve: {names} may as well "
        "be a cause that goes with the acceleration",
    )


def swings_at_one_frequency(problem: Problem) -> bool:
    """Whether the angle of a table is its acceleration but for a factor, the same in all fitted bins."""
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))
    parts = [u[b.start : b.stop] for b in problem.fitted if b.n >= LEAST_BINS]
    angles, changes = [], []
    for part in parts:
        line = np.vander(np.arange(len(part)), 2)
        angle = np.cumsum(part - part.mean())
        angles.append(angle - line @ np.linalg.lstsq(line, angle, rcond=None)[0])
        changes.append(np.gradient(part))
    angle, change = np.concatenate([[0.0], *angles]), np.concatenate([[0.0], *changes])
    size = float(np.linalg.norm(angle) * np.linalg.norm(change))
    return size > 0 and -float(angle @ change) > ONE_CURVE * size
