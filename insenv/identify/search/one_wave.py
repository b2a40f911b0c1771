r"""Lines that are one: multiples of one frequency, and two so near that the amplitude of one line swings.

Clicks or a saw tooth every P seconds have lines at k / P, and none of these is a cause. Of n lines the lowest is taken
for b, a half of b or a third of it. Each of the others is off its nearest multiple by a share s of half of b, which is
anything from 0 to 1 where the lines have nothing to do with each other, so

    p = (part of b) (max s)^{n-1}

is the probability that they are as near to multiples by chance. Known to a fraction of a wave in the time that they
were seen for, lines that last long are near with many multiples and few lines that last short with none: p asks no more
waves of a short recording than its lines need.

An amplitude that swings in Q seconds makes of a line at f those at f and f +- 1 / Q.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from insenv.core.recording import Floats
from insenv.identify.prepare.spectral.line_effects import merged
from insenv.identify.prepare.spectral.lines import SAME_LINE, WIDEST, Line

#: Lines that are multiples of one frequency by chance: any two.
MOST_BY_CHANCE = 2
#: Probability of unrelated lines to be as near to multiples below which they are said to be one wave.
CHANCE = 0.01
#: How far off a multiple may be, in waves in the fitted time, and fewest waves of their frequency in it: lines that are
#: nearer to each other than that are not told apart, and slow noise has them.
OFF, FEWEST_WAVES = 0.3, 4.0


def frequencies(tones: tuple[float, ...], lines: tuple[Line, ...], span: float) -> Floats:
    """Frequencies of ``tones`` of the bins and steady ``lines`` of the samples, one of each, ascending [Hz].

    ``span`` is the time that tells them apart [s].
    """
    groups = merged(tuple(line for line in lines if line.own and line.steady))
    found = sorted((*tones, *(float(np.mean([line.frequency for line in group])) for group in groups)))
    return np.array([f for k, f in enumerate(found) if k == 0 or f - found[k - 1] > OFF / span])


def wave(found: Floats, span: float) -> float | None:
    """The frequency of which all are multiples [Hz], of frequencies known to a fraction of 1 / ``span`` [1/s].

    None where there are too few to tell, or they have none.
    """
    if len(found) <= MOST_BY_CHANCE:
        return None
    for part in (1, 2, 3):
        base = float(found.min()) / part
        if base * span >= FEWEST_WAVES and _all_multiples(found, base, part, OFF / span):
            return base
    return None


def _all_multiples(found: Floats, base: float, part: int, off: float) -> bool:
    """Whether all are multiples of ``base``, which is known as well as its multiple ``part``; ``off`` in Hz."""
    last, farthest = float(part), 0.0
    for frequency in np.sort(found):
        times = float(np.rint(frequency / base))
        away = abs(frequency - times * base)
        if away > min(off * max(1.0, times / last), 0.25 * base):
            return False
        farthest = max(farthest, 2 * away / base)
        base, last = frequency / times, times
    return part * farthest ** (len(found) - 1) < CHANCE


def swinging(found: Floats) -> tuple[float, float] | None:
    """Two frequencies that are nearer than two lines are [Hz], nearest first; None where there are no such."""
    near = [(low, high) for low, high in pairwise(found.tolist()) if high - low < min(SAME_LINE, WIDEST * low)]
    return min(near, key=lambda pair: pair[1] - pair[0], default=None)
