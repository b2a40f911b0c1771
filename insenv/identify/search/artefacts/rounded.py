r"""What is left of an effect's evidence beside the rounding of a reading that noise does not blur.

With C the covariance of its coefficients theta by the noise alone, and C' with what rounding adds to it
(`insenv.identify.fit.rounded`), the deviate of the evidence shrinks by

    sqrt(theta' C'^-1 theta / theta' C^-1 theta):

a curve of the rate that is smaller than half a step is no law, and one that is larger stays. An effect that this takes
below `alpha` is not named: the rounding is.

Of the steps of the table's angle, which a curve of rate or angle and a line may follow, the coefficients are tried that
they would make, of mean square M: beside them the evidence is that of the covariance C + M.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.fit.rounded import added_covariance, by_steps
from insenv.identify.prepare.spectral.wandering import FEWEST_CYCLES
from insenv.identify.search.scan import Hit

#: Largest p-value at which an effect is worth the test.
WORTH = 0.05
#: Share of the evidence below which rounding explains the effect as well.
TAKEN = 0.8


def beside_rounding(problem: Problem, larger: Fit, hit: Hit) -> Hit:
    """The hit, the last term of a fit, with its deviate as it is beside the rounding of the readings."""
    own = np.flatnonzero(larger.design.term == len(larger.model) - 1)
    if problem.coarse is None or not len(own) or hit.log_p >= np.log(WORTH):
        return hit
    theta, cov = larger.beta[own], larger.cov[np.ix_(own, own)]
    with_it = cov + added_covariance(problem, larger)[np.ix_(own, own)]
    alone, beside = (float(theta @ np.linalg.lstsq(c, theta, rcond=1e-12)[0]) for c in (cov, with_it))
    if not 0 < beside < alone:
        return hit
    less = replace(hit, deviate=hit.deviate * float(np.sqrt(beside / alone)), unrounded=hit.deviate)
    if beside < TAKEN * alone and hit.log_p < np.log(WORTH) <= less.log_p:
        return replace(less, remark="what rounding of the readings leaves explains it as well")
    return less


def beside_steps(problem: Problem, larger: Fit, hit: Hit) -> Hit:
    """The hit, the last term of a fit, with its deviate as it is beside what the steps of the table's angle make."""
    own = np.flatnonzero(larger.design.term == len(larger.model) - 1)
    if not problem.encoder or not len(own) or hit.log_p >= np.log(WORTH):
        return hit
    made = by_steps(problem, larger)
    if made is None:
        return hit
    theta, cov, among = larger.beta[own], larger.cov[np.ix_(own, own)], made[own] @ made[own].T / made.shape[1]
    alone, beside = (float(theta @ np.linalg.lstsq(c, theta, rcond=1e-12)[0]) for c in (cov, cov + among))
    if not 0 < beside < alone:
        return hit
    less = replace(hit, deviate=hit.deviate * float(np.sqrt(beside / alone)))
    if less.log_p >= np.log(WORTH):
        return replace(less, remark="what the steps of the table's angle make explains it as well")
    return less


def damped_as_steps(problem: Problem, term: Term) -> bool:
    """Whether a term is a line of so many waves that it can be told to be the encoder's, and damped."""
    longest = max(block.n for block in problem.fitted) * problem.bins.width
    return term.effect.line and term.shape[0] * longest >= FEWEST_CYCLES


def log_p_unrounded(hit: Hit) -> float:
    """Logarithm of the p-value that a hit has where readings are not rounded."""
    return min(0.0, log_tail(max(hit.unrounded, hit.deviate)) + float(np.log(hit.looks)))
