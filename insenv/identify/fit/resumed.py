r"""A unit at rest that reads another level behind a gap: laid down otherwise, turned on anew, or gone by a drift.

Levels of held-out rows are no part of what is tested, for they may wander. Over a gap of g seconds the difference of
the means of T_1 and T_2 seconds on either side of it has by noise that was fitted a variance of

    N^2 (1/T_1 + 1/T_2)  +  4/pi ln(2) B^2 (1 + log2(1 + g/T))  +  K^2 (g + T_1/3 + T_2/3),      T the shorter one,

white noise, flicker and a random walk. Of a short rest a walk that would hardly be seen is not told: K is at least that
which in the longer stretch goes as far as twice what white noise moves its mean by.
"""

from __future__ import annotations

from math import log2, pi

import numpy as np

from insenv.effects.noise import AngleRandomWalk, BiasInstability, RateRandomWalk
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.heldout import residual
from insenv.identify.fit.problem import NOISE_TERMS, Problem

#: Deviations from which on the level is another one, and the shortest gap [s].
ANOTHER, GAP = 6.0, 1.0
#: How far a walk may go in the longer stretch, in deviations of its mean by white noise.
UNSEEN = 2.0


def resumed(problem: Problem, fit: Fit) -> tuple[str, ...]:
    """Held-out rows behind a gap at a level that no noise of the fit foretells, the farthest one, in words."""
    if problem.turns:
        return ()
    left, time, width = residual(problem, fit), problem.bins.time, problem.bins.width
    power = {term.id: float(value) for term, value in zip(NOISE_TERMS, fit.noise.power, strict=True)}
    found = []
    for before, after in zip(problem.bins.blocks[:-1], problem.bins.blocks[1:], strict=True):
        gap = float(time[after.start] - time[before.stop - 1]) - width
        if before.run != after.run or after.fitted or gap < GAP:
            continue
        step = float(left[after.start : after.stop].mean() - left[before.start : before.stop].mean())
        sd = _deviation(power, before.n * width, after.n * width, gap)
        found.append((abs(step) / sd if sd > 0 else 0.0, step, gap))
    z, step, gap = max(found, default=(0.0, 0.0, 0.0))
    if z < ANOTHER:
        return ()
    return (
        f"held-out rows behind a gap of {gap:.3g} s differ by {step:.3g} {problem.unit} from those before it, "
        f"{z:.2g} standard deviations of the fitted noise: it was laid down otherwise or turned on anew, or has "
        "drifted meanwhile",
    )


def _deviation(power: dict[str, float], first: float, second: float, gap: float) -> float:
    """Of the difference of means over so many seconds on either side of a gap, by noise alone."""
    white = power[AngleRandomWalk.id]
    walk = max(power[RateRandomWalk.id], UNSEEN**2 * 3 * white / max(first, second) ** 2)
    flicker = 4 / pi * np.log(2) * power[BiasInstability.id] * (1 + log2(1 + gap / min(first, second)))
    return float(np.sqrt(white * (1 / first + 1 / second) + flicker + walk * (gap + (first + second) / 3)))
