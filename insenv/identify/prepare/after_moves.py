r"""Whether what is left repeats at each change of the motion: a bracket that rings, a base that settles, a cable.

With t_k the bins in which the rate begins to change or has changed, s_k the way it goes or 1, and r the whitened
residual,

    z_l = sum_k s_k r(t_k + l) / sqrt(K_l),      sum_l z_l^2  ~  chi-square

for the bins l behind each of K_l changes: a mean over changes, which noise that knows nothing of them does not have. No
form is presumed, and none is named.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.special import chdtrc

from insenv.core.recording import Floats
from insenv.identify.fit.bins import Block
from insenv.identify.fit.problem import Problem

#: Bins behind a change that are looked at, changes that tell, and what one bin counts at most.
BEHIND, FEWEST, LOUDEST = 24, 5, 3.0
#: Change of the rate from bin to bin from which on it changes: share of the largest rate, and usual changes, which are
#: noise of the reference where a table holds its rates; bins by which the way it goes is told.
CHANGES, USUAL, WAY = 0.02, 8.0, 3


def after_moves_p(problem: Problem, blocks: tuple[tuple[Block, Floats], ...]) -> float:
    """P-value of a mean of what is left over changes of the motion, at their beginnings or ends, with its way or not.

    Parameters
    ----------
    problem : Problem
    blocks : tuple of (Block, ndarray)
        With the whitened residual of each in time.
    """
    if not problem.turns or problem.in_points:
        return 1.0
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))
    usual = np.concatenate([np.abs(np.diff(u[block.start : block.stop])) for block, _ in blocks])
    least = max(CHANGES * float(np.abs(u).max(initial=0.0)), USUAL * float(np.median(usual)) if len(usual) else 0.0)
    tails = []
    for ends in (False, True):
        found = [one for block, white in blocks for one in _changes(u[block.start : block.stop], white, least, ends)]
        tails += [_p(found, signed) for signed in (False, True)]
    return float(min(1.0, min(tails) * len(tails)))


def _changes(u: Floats, white: Floats, least: float, ends: bool) -> Iterator[tuple[float, Floats]]:
    """Of each change of a block the way it goes and what is left behind its beginning or end."""
    moves = np.abs(np.gradient(u)) > least if len(u) > 1 else np.zeros(len(u), bool)
    before, after = moves[:-1], moves[1:]
    edges = before & ~after if ends else ~before & after
    for at in (np.flatnonzero(edges) + 1).tolist():
        way = u[min(at + (0 if ends else WAY), len(u) - 1)] - u[max(at - (WAY if ends else 1), 0)]
        yield float(np.sign(way)), np.clip(white[at : at + BEHIND], -LOUDEST, LOUDEST)


def _p(found: list[tuple[float, Floats]], signed: bool) -> float:
    total, count = np.zeros(BEHIND), np.zeros(BEHIND)
    for way, left in found:
        total[: len(left)] += way * left if signed else left
        count[: len(left)] += 1
    told = count >= FEWEST
    return float(chdtrc(told.sum(), np.sum(total[told] ** 2 / count[told]))) if told.any() else 1.0
