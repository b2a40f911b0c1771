r"""A level that goes to and fro between two values: popcorn noise, a relay, a mode of a laser that flips.

A hidden Markov chain of two states with white noise beside it,

    r_i = b + c s_i + sigma n_i,      s_i in {0, 1},      P(s changes) = p_up, p_down from one mean to the next,

its parameters by expectation and maximisation. Noise of a given spectrum is Gaussian and knows no levels: of one that
flips it makes flicker or a walk. Which of the two is likelier the log-likelihoods say, for both have few parameters.

Source: L. R. Rabiner, Proc. IEEE 77 (1989) 257 (forward and backward probabilities).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats

#: Rounds at most, and the gain in log-likelihood below which they end.
ROUNDS, GAIN = 60, 1e-3
#: Probability of a change from one mean to the next that is tried first, least, and at most: beyond it is white noise.
FIRST, LEAST, MOST = 0.05, 1e-4, 0.4


@dataclass(frozen=True)
class TwoLevels:
    """The likeliest chain of two levels.

    Attributes
    ----------
    loglik : float
        Its log-likelihood.
    apart, spread : float
        How far the levels are from each other, and the deviation of the noise about them, in the unit of the values.
    share : float
        Of the means that are at the upper level.
    upper : ndarray of bool, shape (n,)
        Which are.
    """

    loglik: float
    apart: float
    spread: float
    share: float
    upper: NDArray[np.bool_]

    @property
    def changes(self) -> int:
        """How often the level changes."""
        return int(np.count_nonzero(self.upper[1:] != self.upper[:-1]))


def two_levels(values: Floats) -> TwoLevels:
    """The likeliest chain of two levels of means that follow each other, shape (n,)."""
    levels, spread = np.quantile(values, [0.2, 0.8]), max(0.7 * float(np.std(values)), 1e-300)
    change, before = np.array([FIRST, FIRST]), -math.inf
    for _ in range(ROUNDS):
        near = np.exp(-0.5 * ((values[:, None] - levels) / spread) ** 2) / (spread * math.sqrt(2 * math.pi)) + 1e-300
        steps = np.array([[1 - change[0], change[0]], [change[1], 1 - change[1]]])
        loglik, state, moved = _chain(near, steps)
        if loglik - before < GAIN:
            break
        before = loglik
        change = np.clip([moved[i, 1 - i] / max(moved[i].sum(), 1e-300) for i in (0, 1)], LEAST, MOST)
        weight = np.maximum(state.sum(axis=0), 1e-300)
        levels = (state * values[:, None]).sum(axis=0) / weight
        spread = max(math.sqrt(float((state * (values[:, None] - levels) ** 2).sum()) / len(values)), 1e-300)
    high = int(np.argmax(levels))
    upper = state[:, high] > 0.5
    return TwoLevels(loglik, float(abs(levels[1] - levels[0])), spread, float(upper.mean()), upper)


def _chain(near: Floats, steps: Floats) -> tuple[float, Floats, Floats]:
    """Log-likelihood, probabilities of the states (n, 2), and expected moves between them (2, 2).

    A number at a time: for two states NumPy takes six times as long.
    """
    (stay, up), (down, high) = steps.tolist()
    rows: list[list[float]] = near.tolist()
    forward, backward, scale = list[tuple[float, float]](), [(1.0, 1.0)], list[float]()
    low, top = 0.5, 0.5
    for i, (below, above) in enumerate(rows):
        if i:
            low, top = low * stay + top * down, low * up + top * high
        low, top = low * below, top * above
        whole = low + top
        low, top = low / whole, top / whole
        scale.append(whole)
        forward.append((low, top))
    for (below, above), whole in zip(rows[:0:-1], scale[:0:-1], strict=True):
        low, top = below * backward[-1][0], above * backward[-1][1]
        backward.append(((stay * low + up * top) / whole, (down * low + high * top) / whole))
    before, after, size = np.array(forward), np.array(backward[::-1]), np.array(scale)
    onward = near[1:] * after[1:] / size[1:, None]
    return float(np.log(size).sum()), before * after, steps * (before[:-1].T @ onward)
