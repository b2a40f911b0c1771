"""What cannot be told apart: the encompassing test.

A rival of an added effect is another effect with which in its place the added one is no longer significant. A rival
with more parameters must also explain better, beyond what a further parameter gains by itself, unless on this recording
it is the very same curve: an anomaly at two rates is a cubic. What has another effect as its limit is no rival of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from insenv.core.recording import Floats
from insenv.identify.fit.problem import Model, Problem, Term
from insenv.identify.search.round import refined
from insenv.identify.search.scan import (
    Hit,
    Reference,
    beside,
    likelihood_ratio,
    log_significance,
    reference,
    term_freedom,
)

#: Gain in likelihood ratio per further parameter from which a richer effect counts as a rival.
RICHER_GAIN = 2.0
#: Likelihood ratio by which a rival may fall behind before its refit is worth nothing.
NEAR = 60.0
#: Share of a curve outside another that two curves must have to be two.
ALIKE = 0.05


@dataclass(frozen=True)
class Rivalry:
    """Effects that explain as well as an added one, by key, best first, and their ``terms`` at the best shapes.

    ``better`` is one that explains better.
    """

    rivals: tuple[str, ...]
    better: Hit | None
    terms: tuple[Term, ...] = ()


def rivalry(
    problem: Problem, others: Model, term: Term, hits: list[Hit], alpha: float, gain: float = RICHER_GAIN
) -> Rivalry:
    """Rivals of ``term`` among ``hits``, which were all tried in its place beside ``others``.

    ``gain`` is what each further parameter of a rival must gain in likelihood ratio.
    """
    base = reference(problem, others)
    own, _ = likelihood_ratio(problem, base, (*others, term))
    rivals: list[Hit] = []
    better: Hit | None = None
    for hit in hits:
        if hit.term.effect.key == term.effect.key or hit.candidate.generic or hit.p_value > alpha:
            continue
        extra = _parameters(problem, base, hit.term) - _parameters(problem, base, term)
        if own - hit.likelihood_ratio < NEAR and hit.term.effect.id != "tone":
            hit = refined(problem, base, hit)  # the search refines the best few alone
        richer = extra > 0 and not _same_curve(problem, base, hit.term, term)
        if richer and hit.likelihood_ratio < own + _gain_by_itself(hit.term, extra, alpha, gain):
            continue
        if own - hit.likelihood_ratio > NEAR or _still_needed(problem, (*others, hit.term), term, alpha):
            continue
        rivals.append(hit)
        if extra <= 0 and hit.likelihood_ratio > own + 1e-3 and better is None:
            better = hit
    rivals.sort(key=lambda hit: -hit.likelihood_ratio)
    return Rivalry(tuple(hit.term.effect.key for hit in rivals), better, tuple(hit.term for hit in rivals))


def _same_curve(problem: Problem, base: Reference, rival: Term, term: Term) -> bool:
    """Whether two terms are one curve on this recording, though neither is the other's limit."""
    own, other = _told(problem, base, term), _told(problem, base, rival)
    if term.effect.id in rival.effect.becomes or own.shape != other.shape:
        return False
    span = np.linalg.qr(own)[0]
    return float(np.linalg.norm(other - span @ (span.T @ other))) < ALIKE * float(np.linalg.norm(other))


def _told(problem: Problem, base: Reference, term: Term) -> Floats:
    """Whitened regressors of a term beside the model's, shape (modes, k), without those that show next to nothing.

    Of several parameters in one unit, as the three axes of a force, one that is `ALIKE` times less than the others
    is what its channel's noise makes of it, or was not measured at all. A wave whose frequency was looked for is no
    simpler where one phase of it is in the model already.
    """
    columns = beside(problem, base, term)
    if term.shape:
        return columns
    size = np.linalg.norm(columns, axis=0)
    units = np.array([unit for _, unit, _ in problem.names(term)])
    most = np.array([size[units == unit].max() for unit in units])
    return columns[:, size > ALIKE * most]


def _parameters(problem: Problem, base: Reference, term: Term) -> int:
    """Parameters that a term spends on this problem, those of every run and its shapes."""
    return _told(problem, base, term).shape[1] + len(term.effect.shapes)


def _gain_by_itself(term: Term, extra: int, alpha: float, gain: float) -> float:
    """Likelihood ratio that ``extra`` parameters do not exceed by themselves.

    A term that is free in each run has many, and follows by chance whatever differs from run to run.
    """
    return float(chi2.isf(alpha, extra)) if term.per_run else gain * extra


def _still_needed(problem: Problem, model: Model, term: Term, alpha: float) -> bool:
    """Whether ``term`` adds significantly to ``model``."""
    base = reference(problem, model)
    ratio, gained = likelihood_ratio(problem, base, (*model, term))
    return log_significance(ratio, gained, term_freedom(problem, base, term)) < math.log(alpha)
