r"""Drifts of one box: weak on each axis, certain on all of them together.

What warms up is the box: its axes drift at the same time, with one time constant, each by an amount of its own. With z
the deviates of one drift on n channels, the largest m of them give

    Z = (z_1 + ... + z_m) / sqrt(max(m, sum_ij s_i s_j rho_ij)),        p = (n over m) looks P(N > Z)

where the binomial coefficient pays for the choice of channels. Mostly the random walks of the axes know nothing of each
other: on 134 pieces of 600 s of seven units at rest z of a straight drift had a mean of -0.11 and a standard deviation
of 1.00. But a supply or a reference moves all of them at once, and then the sum is one look taken m times: rho_ij is
the correlation of the slow modes that channels i and j have left beside the drift, less what chance makes of so few,
and s the sign of the drift. The surest channel counts as the next one does, and where it is certain by itself the
others must be certain without it: an axis that warms up alone would drag along any that noise moves a little.

What its temperature is known to do to two axes of a box is no rare finding on a third one: there its p-value pays for
its own shapes alone, not for all else that was tried.

Source: S. A. Stouffer et al., The American Soldier (1949), vol. 1, p. 45 (sum of deviates).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.fft import dct

from insenv.core.recording import Floats
from insenv.effects.base import Effect
from insenv.effects.bias import BiasDrift, BiasStep, BiasWarmUp
from insenv.identify.clean.settling import only_time
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.problem import NOISE_TERMS, Problem
from insenv.identify.search.round import CALIBRATION, against
from insenv.identify.search.scan import Hit
from insenv.identify.search.tracks import Track

#: What a box does as a whole; each axis by its own amount.
DRIFTS = (BiasDrift.id, BiasWarmUp.id)
#: What a knock or a supply does to several axes at once: it is said, and not named, for a jump of noise looks the same.
STEPS = (BiasStep.id,)
#: Axes that must have what the temperature of their box does for it to be known.
KNOWN = 2
#: Deviate of an axis' own evidence without which it has no part in it: one in twenty by chance.
LEAST = 1.64
#: Probability of one channel's own drift below which it is certain without the others.
ALONE = 1e-3
#: Windows of the fitted time, and the slow modes of their means that tell what channels have in common.
WINDOWS, MODES = 24, 10
#: Deviate from which on an axis of a box that drifts is not said to be still.
DOUBT = 1.0


def may_drift(track: Track) -> bool:
    """Whether nothing but time is at work on the one run that was fitted."""
    return only_time(track.problem) and len({b.run for b in track.problem.fitted}) == 1


def looks_of(track: Track, hit: Hit) -> float:
    """Looks of a hit without the odds against events, which one channel has."""
    return hit.looks / against(track.problem, hit.candidate.effect)


def log_p_by_itself(track: Track, hit: Hit) -> float:
    """Logarithm of the p-value of a hit without the looks of other effects and the odds against events."""
    return min(0.0, log_tail(hit.deviate) + math.log(own_looks(track, hit)))


def own_looks(track: Track, hit: Hit) -> float:
    """Looks of a hit's own shapes."""
    return hit.looks / (CALIBRATION * track.family * against(track.problem, hit.candidate.effect))


def is_thermal(effect: Effect) -> bool:
    """Whether an effect is what a temperature does."""
    return not effect.generic and any(need.partition(".")[0] == "temperature" for need in effect.needs)


def warmed(tracks: Sequence[Track], index: int) -> bool:
    """Whether enough other axes have what the temperature of their box does to them."""
    others = (t for i, t in enumerate(tracks) if i != index)
    return sum(any(is_thermal(term.effect) for term in t.added) for t in others) >= KNOWN


def log_p_together(deviates: Sequence[float], looks: float, channels: int, variance: float = 0.0) -> float:
    """Logarithm of the p-value of one drift on some of so many channels, chosen by these deviates.

    ``variance`` is that of their sum, if noise in common makes it more than their number.
    """
    total = sum(deviates) / math.sqrt(max(len(deviates), variance))
    return min(0.0, log_tail(total) + math.log(looks * math.comb(channels, len(deviates))))


def surest(deviates: Sequence[float], looks: float, common: Floats | None = None) -> float:
    """Logarithm of the smallest p-value of one drift on any two or more of the channels; 0 where there are fewer.

    Parameters
    ----------
    deviates : sequence of float
        Of all channels.
    looks : float
    common : ndarray, shape (n, n), optional
        Covariance of the deviates, by noise in common (`in_common`).
    """
    z = np.array(deviates)
    able = np.flatnonzero(z >= LEAST)
    own = able[np.argsort(-z[able])]
    if len(own) < 2:
        return 0.0
    alone = log_p_together(z[own[:1]].tolist(), looks, len(z)) < math.log(ALONE)
    z[own[0]] = z[own[1]]
    rest, least = (own[1:], 1) if alone else (own, 2)
    sums = [0.0 if common is None else float(common[np.ix_(rest[:m], rest[:m])].sum()) for m in range(len(rest) + 1)]
    return min(log_p_together(z[rest[:m]].tolist(), looks, len(z), sums[m]) for m in range(least, len(rest) + 1))


def in_common(parts: Sequence[tuple[Problem, Fit]]) -> Floats:
    """Covariance of the deviates of a drift, the last term of each fit, by slow noise in common, shape (n, n).

    Parameters
    ----------
    parts : sequence of (Problem, Fit)
        Of each channel.
    """
    slow = [_slow_modes(problem, fit, _span(parts)) for problem, fit in parts]
    out = np.eye(len(parts))
    for i, (a, of_a) in enumerate(slow):
        for j, (b, of_b) in enumerate(slow[:i]):
            weight = np.sqrt(of_a * of_b)
            many = float(weight.sum()) ** 2 / float(weight @ weight or 1.0)
            power = float(weight @ a**2) * float(weight @ b**2)
            rho = float((weight * a) @ b) / math.sqrt(power) if power > 0 else 0.0
            beyond = max(0.0, (many * rho**2 - 1) / (many - 1)) if many > 1 else 0.0
            out[i, j] = out[j, i] = math.copysign(math.sqrt(beyond), rho)
    return out


def _span(parts: Sequence[tuple[Problem, Fit]]) -> tuple[float, float]:
    """From when to when all channels were fitted [s]."""
    times = [problem.bins.time[~problem.bins.held_out] for problem, _ in parts]
    return max(float(t.min()) for t in times), min(float(t.max()) for t in times)


def _slow_modes(problem: Problem, fit: Fit, span: tuple[float, float]) -> tuple[Floats, Floats]:
    """Slow modes of what a fit leaves, in deviations of its noise, with the sign of the last term, shape (MODES,).

    And the share of each one's variance that is not white: noise from row to row is each channel's own.
    """
    edges = np.linspace(*span, WINDOWS + 1)
    left, time = problem.y - fit.predicted(), problem.bins.time
    index = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, WINDOWS - 1)
    inside = ~problem.bins.held_out & (time >= span[0]) & (time <= span[1])
    count = np.bincount(index[inside], minlength=WINDOWS)
    known = np.flatnonzero(count)
    means = np.bincount(index[inside], left[inside], minlength=WINDOWS)[known] / count[known]
    modes = dct(np.interp(np.arange(WINDOWS), known, means), norm="ortho")[1 : MODES + 1]
    lam = 4 * np.sin(0.5 * np.pi * np.arange(1, MODES + 1) / WINDOWS) ** 2
    width = (span[1] - span[0]) / WINDOWS
    parts = np.stack([term.spectrum(lam, width) for term in NOISE_TERMS], axis=1) * fit.noise.power
    variance, own = parts.sum(axis=1), fit.theta[fit.design.term == len(fit.model) - 1]
    sign = np.sign(own[0]) if len(own) else 1.0
    return sign * modes / np.sqrt(variance), parts[:, 1:3].sum(axis=1) / variance
