r"""Noise that does not wander, beside which a slow law is certain or not: white, rounded, or correlated briefly.

Of a record at rest white noise and a random walk alone explain every slow law. Where rows hold a filter of the chip, a
fusion or vibration, white noise explains nothing, all falls to flicker and walk, and with it the law. So noise that
stays has a first-order Gauss-Markov process as well, of correlation time tau = T / beta,

    S_k = M^2 / ((1 - p)^2 + p lam_k),        p = exp(-beta),    lam_k = 4 sin^2(pi k / 2n)

the spectrum of an autoregression of first order (nearly diagonal in the DCT-II), with tau at most `LONGEST` of the
record: in the modes in which a law of the whole record lives it is white. Which tau, the noise tells that may walk as
well, of which nothing slow is asked; chosen beside the law, it would do what the walk does in the modes between.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from insenv.core.recording import Floats
from insenv.core.series.allan import FLICKER, WALK
from insenv.identify.fit.noise import fit_noise
from insenv.identify.fit.problem import NOISE_TERMS, Model, Problem, pooled

#: Noise whose level does not stay.
WANDERING = (FLICKER, WALK)
#: Longest correlation time as a share of the longest stretch, so that it is white to what lasts as long as that.
LONGEST = 1 / 40


@dataclass(frozen=True)
class Staying:
    """Noise of the fitted bins of a problem, with a process of short correlation or without.

    Attributes
    ----------
    problem : Problem
    memory : tuple of ndarray
        Spectra of that process in the groups of modes; none where the noise has no such process.
    time : float
        Its correlation time [s]; 0 where there is none.
    walking : float
        Log-likelihood of a model whose noise may wander.
    """

    problem: Problem
    memory: tuple[Floats, ...]
    time: float
    walking: float

    @classmethod
    def of(cls, problem: Problem, model: Model) -> Staying:
        """The noise beside a ``model`` without the law."""
        plain = cls(problem, (), 0.0, _loglik(problem, model, None, wanders=True))
        bins, longest = 1.0, LONGEST * max(b.n for b in problem.fitted)
        best = plain
        while bins <= longest:
            spectrum = _spectrum(problem, bins)
            found = _loglik(problem, model, spectrum, wanders=True)
            if found > best.walking:
                best = cls(problem, (spectrum,), bins * problem.bins.width, found)
            bins *= 2
        return best

    def loglik(self, model: Model) -> float:
        """Log-likelihood of a model beside noise that stays."""
        return max(_loglik(self.problem, model, memory, wanders=False) for memory in (None, *self.memory))


def _loglik(problem: Problem, model: Model, memory: Floats | None, wanders: bool) -> float:
    products, prior = pooled(problem, model)
    most = np.array([np.inf if wanders or term.id not in WANDERING else 0.0 for term in NOISE_TERMS])
    if problem.most is not None:
        most = np.minimum(most, problem.most)
    if memory is not None:
        products = replace(products, shapes=np.column_stack([products.shapes, memory]))
        most = np.append(most, np.inf)
    return fit_noise(products, prior, restricted=False, most=most).loglik


def _spectrum(problem: Problem, bins: float) -> Floats:
    """Of a process that correlates over so many bins, in the groups of modes, 1 at no frequency: shape (groups,)."""
    groups, left = problem.grouping(), math.exp(-1 / bins)
    each = (1 - left) ** 2 / ((1 - left) ** 2 + left * problem.modes().lam[groups.order])
    spectrum: Floats = np.add.reduceat(each, groups.starts) / groups.count
    return spectrum
