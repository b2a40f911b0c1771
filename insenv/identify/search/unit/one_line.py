r"""A line of one box: sure on one channel of a unit at rest, and looked for at that frequency alone on the others.

What shakes a unit shakes all of it. A channel on which the line stands no higher than the largest of a thousand peaks
of noise is not asked about a thousand frequencies: the whitened modes r_k in a band about the known one are compared
with as wide a band on either side,

    F = (sum_in r_k^2 / n) / (sum_beside r_k^2 / m) ~ F(n, m),        p = asked P(F > F_0)

where ``asked`` are the lines that channels of the unit have times the other channels. What stands beside raises a hump
of the noise as it raises the band, and the power of a line whose phase does not hold is all in it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import fdtrc, ndtri_exp

from insenv.identify.fit.gls import whitened
from insenv.identify.fit.problem import Problem
from insenv.identify.prepare.spectral.lines import SAME_LINE
from insenv.identify.prepare.spectral.wandering import reach, wanders
from insenv.identify.search.round import at_shape
from insenv.identify.search.scan import Hit, reference
from insenv.identify.search.tracks import Track

#: Widths of the band on either side that tell the noise beside a line.
BESIDE = 2.0
#: Least probability that is told.
LEAST = 1e-300
#: Largest frequency that bins tell, times their length.
RESOLVED = 0.48


def rings_too(tracks: Sequence[Track], index: int) -> Hit | None:
    """The surest tone of a channel at a frequency that others have and it has not, with the looks of these alone.

    A line whose phase holds is told by its wave, others by the power of their band.
    """
    track = tracks[index]
    tone = next((hit for hit in track.hits or () if hit.candidate.effect.line), None)
    if track.problem.turns or tone is None:
        return None
    known = _distinct(f for i, other in enumerate(tracks) if i != index for f in _frequencies(other))
    own, most = _frequencies(track), RESOLVED / track.problem.bins.width
    fresh = [f for f in known if f < most and all(abs(f - g) > 2 * reach(track.problem, f) for g in own)]
    asked = len(known) * (len(tracks) - 1)
    found = [_judged(track, tone, f, asked, (*known, *own)) for f in fresh]
    return min(found, key=lambda hit: hit.log_p, default=None)


def _judged(track: Track, tone: Hit, frequency: float, asked: int, lines: Sequence[float]) -> Hit:
    base = reference(track.problem, track.fit.model, track.fit.noise.power)
    hit = at_shape(track.problem, track.fit, base, tone, replace(tone.term, shape=(frequency,)))
    hit = replace(hit, looks=float(asked))
    if wanders(track.problem, track.fit, frequency) is None:
        return hit
    p = max(_p(track, frequency, lines), LEAST)
    return replace(hit, deviate=float(-ndtri_exp(np.log(min(p, 1 - 1e-12)))), remark="")


def _distinct(frequencies: Iterable[float]) -> list[float]:
    """One of those that are one line."""
    out: list[float] = []
    for frequency in sorted(frequencies):
        if not out or frequency - out[-1] > SAME_LINE:
            out.append(frequency)
    return out


def _frequencies(track: Track) -> list[float]:
    """Of the lines that a channel has [Hz]."""
    lines = [line.frequency for line in track.prepared.lines if line.own]
    return [*lines, *(term.shape[0] for term in track.added if term.effect.line)]


def _p(track: Track, frequency: float, lines: Sequence[float]) -> float:
    """Probability that noise has such power about a frequency, beside it as much as on either side without lines."""
    problem = track.problem
    f, power = _power(problem, track)
    half = reach(problem, frequency)
    away = np.abs(f - frequency)
    others = [g for g in lines if abs(g - frequency) > half]
    free = np.all([np.abs(f - g) > half for g in others], axis=0) if others else np.ones(len(f), bool)
    inside, beside = power[away < half], power[free & (away >= half) & (away < (1 + BESIDE) * half)]
    if len(inside) < 2 or len(beside) < len(inside):
        return 1.0
    return float(fdtrc(len(inside), len(beside), inside.mean() / max(float(beside.mean()), LEAST)))


def _power(problem: Problem, track: Track) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies of the modes [Hz] and squares of what a fit leaves of them, whitened."""
    _, _, left = whitened(problem, track.fit)
    f = np.concatenate([np.arange(b.n) / (2 * b.n * problem.bins.width) for b in problem.fitted])
    return f, np.asarray(left**2)
