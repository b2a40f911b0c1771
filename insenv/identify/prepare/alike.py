r"""Whether one of several runs wanders more than the others, which noise of one instrument does not.

Where nobody says how much an instrument wanders, a walk is fitted to all runs, and takes up what is slow in one of them
alone: a bad day, a draught, a unit that was touched. Of the k slowest modes of each run, its mean left out, S_r is the
sum of whitened squares, and

    (S_r / k_r) / (2 sum_(s != r) S_s / sum k_s)  ~  F(k_r, sum k_s)

for runs of which one has at most twice the power of the others there. k = 4, 8, 16, ... and all runs are tried
(Bonferroni).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from insenv.core.recording import Floats
from insenv.identify.fit.bins import Block

#: Fewest runs of which one may be unlike the others; modes that are tried; ratio of powers up to which they are alike.
FEWEST, MODES, ALIKE = 3, (4, 8, 16, 32), 2.0


@dataclass(frozen=True)
class Unlike:
    """The run that wanders most: its number from 0, by how many times the others, and the probability of that."""

    run: int
    times: float
    p_value: float


def most_unlike(blocks: Sequence[Block], residual: Floats) -> Unlike | None:
    """The run whose slow modes are least like those of the others; None of few runs.

    Parameters
    ----------
    blocks : sequence of Block
    residual : ndarray, shape (modes,)
        Whitened, block by block, slowest modes first.
    """
    slow: dict[int, Floats] = {}
    start = 0
    for block in blocks:
        own = residual[start + 1 : start + block.n]
        start += block.n
        if len(own) > len(slow.get(block.run, ())):
            slow[block.run] = own
    counts = [count for count in MODES if all(len(own) >= count for own in slow.values())]
    if len(slow) < FEWEST or not counts:
        return None
    tried = len(counts) * len(slow)
    found = [_unlike(slow, run, count, tried) for count in counts for run in slow]
    return min(found, key=lambda one: one.p_value)


def _unlike(slow: dict[int, Floats], run: int, count: int, tried: int) -> Unlike:
    own = float(np.mean(slow[run][:count] ** 2))
    others = float(np.mean([np.mean(values[:count] ** 2) for other, values in slow.items() if other != run]))
    ratio = own / max(others, 1e-300)
    p = float(fdtrc(count, count * (len(slow) - 1), ratio / ALIKE))
    return Unlike(run, float(np.sqrt(ratio)), min(1.0, tried * p))
