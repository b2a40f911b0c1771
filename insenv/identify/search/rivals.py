"""What cannot be told apart: the encompassing test.

A rival of an added effect is another effect with which in its place the added one is no longer significant. A rival
with more parameters must also explain better, beyond what a further parameter gains by itself, unless on this recording
it is the very same curve, or the same to the noise: an anomaly at two rates is a cubic. What has another effect as its
limit is no rival of it, but for what time drives: a drift is how a warm-up starts, and one with a time constant within
the record that explains any better is a rival. Of two orders of one polynomial none is a rival of the other: the lower
one is named where the higher one's further powers are not significant. Of one that is rarer by far (`Effect.unusual`)
the evidence must pay for that: one that explains no better than a common effect is told beside it (`same_curve`), and
makes no doubt of it.

Of those that explain as well the likeliest is named first; a law of the temperature itself (`is_plain`) before one of
how it changes or of the time, though it is a little less likely (`PLAIN`): as a unit warms by exp(-t / tau) the
temperature, its change and a warm-up are one curve, and noise would choose the name.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from insenv.core.recording import Floats
from insenv.effects.base import Effect
from insenv.effects.catalogue import plug_in_of
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Model, Problem, Term
from insenv.identify.search.candidates import Candidate
from insenv.identify.search.round import UNUSUAL, against, at_shape, refined
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
#: The same of a warm-up beside a drift, in likelihood ratio.
BENT_GAIN = 0.5
#: Likelihood ratio by which a rival may fall behind before its refit is worth nothing.
NEAR = 60.0
#: Times by which a rival may be less rare by noise than the added effect, where that is found by a hair.
AS_RARE = 10.0
#: Likelihood ratio within which two are as likely.
AS_LIKELY = 1e-3
#: Likelihood ratio by which an unusual effect may fall behind a common one and be told beside it still.
NEAR_UNUSUAL = 4.0
#: The same by which a law of the temperature itself may fall behind one of its change or of time and be named first:
#: odds of five to one.
PLAIN = 2 * math.log(5)
#: The same by which what cannot be of its size must be ahead to speak against an effect that is named.
FAR_BETTER = 20.0
#: Likelihood ratio within which another effect explains as much as what cannot be of its size.
AS_WELL = 1.0
#: Likelihood ratio of the further curves of a term of several, up to which noise may make them: of a polynomial of the
#: temperature the best of three is taken, and one of them may be another effect's.
FURTHER = 16.0
#: Share of a curve outside another that two curves must have to be two.
ALIKE = 0.05
#: Standard deviations by which a curve at its size stands out of another's span, up to which nobody can tell the two.
TO_THE_NOISE = 3.0


@dataclass(frozen=True)
class Rivalry:
    """Effects that explain as well as an added one, by key, best first, and their ``terms`` at the best shapes.

    ``better`` is one that explains better. ``rarer`` are those that explain nearly as well, against whom the odds are.
    ``noise`` are the noise terms of which more would do as well. ``imitation`` is what explains far better, with
    coefficients that it cannot have: it imitates another cause, and the added effect does so less well.
    """

    rivals: tuple[str, ...]
    better: Hit | None
    terms: tuple[Term, ...] = ()
    rarer: tuple[str, ...] = ()
    noise: tuple[str, ...] = ()
    imitation: Hit | None = None

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of all that takes the place of the added effect."""
        return (*self.rivals, *self.noise)

    def beside(self, terms: Iterable[Term], first: bool = False) -> Rivalry:
        """The same with the effects of ``terms`` that are not there yet as its last rivals, or as its ``first``."""
        new = tuple(term for term in terms if term.effect.key not in self.keys)
        keys = tuple(term.effect.key for term in new)
        if first:
            return replace(self, rivals=(*keys, *self.rivals), terms=(*new, *self.terms))
        return replace(self, rivals=(*self.rivals, *keys), terms=(*self.terms, *new))


def rivalry(
    problem: Problem, others: Model, term: Term, hits: list[Hit], alpha: float, gain: float = RICHER_GAIN
) -> Rivalry:
    """Rivals of ``term`` among ``hits``, which were all tried in its place beside ``others``.

    ``gain`` is what each further parameter of a rival must gain in likelihood ratio.
    """
    base = reference(problem, others)
    own, _ = likelihood_ratio(problem, base, (*others, term))
    rivals: list[Hit] = []
    rarer: list[Hit] = []
    paid, level = _paid(term, own, hits), _level(problem, term, hits, alpha)
    able = [hit for hit in hits if not hit.candidate.generic and _significant(problem, hit, level)]
    better = _lower_order(problem, others, term, able, alpha)
    for hit in able:
        if _of_one_polynomial(hit.term.effect, term.effect):
            continue
        extra = _parameters(problem, base, hit.term) - _parameters(problem, base, term)
        if own - hit.likelihood_ratio < NEAR and not hit.term.effect.line:
            hit = refined(problem, base, hit)  # the search refines the best few alone
        richer = extra > 0 and not _same_curve(problem, base, hit.term, term)
        bent = hit.term.effect.of_time and term.effect.of_time and term.effect.id in hit.term.effect.becomes
        needed = min(gain, BENT_GAIN) if bent else gain
        if richer and hit.likelihood_ratio < own + _gain_by_itself(hit.term, extra, alpha, needed):
            continue
        odds = _odds(hit.term) - _odds(term)
        if odds < 0 and plug_in_of(term.effect) and _same_curve(problem, base, hit.term, term):
            continue  # who installs an effect of his own for this curve knows which it is
        if own - hit.likelihood_ratio > (NEAR_UNUSUAL if odds < 0 else NEAR):
            continue
        part = own - hit.likelihood_ratio < FURTHER and _is_part(problem, base, hit.term, term)
        if not part and _still_needed(problem, (*others, hit.term), term, alpha):
            continue
        # Where both are one curve their likelihoods are one, but for rounding.
        if odds < 0 and hit.rank <= paid + odds + AS_LIKELY:
            rarer.append(hit)
            continue
        rivals.append(hit)
        plainer = PLAIN * (is_plain(hit.term.effect) - is_plain(term.effect))
        if extra <= 0 and hit.likelihood_ratio + odds + plainer > own + AS_LIKELY and better is None:
            better = hit
    rivals.sort(key=lambda hit: -hit.likelihood_ratio)
    rarer.sort(key=lambda hit: -hit.likelihood_ratio)
    terms = tuple(hit.term for hit in rivals)
    return Rivalry(_keys(rivals), better, terms, _keys(rarer), imitation=_imitation(term, hits, paid))


def _imitation(term: Term, hits: list[Hit], paid: float) -> Hit | None:
    """What explains far better than a law that is worth ``paid``, with coefficients that its effect cannot have.

    Nor is there another one that can have them and explains as much: then that is the cause, or a rival.
    """
    if term.effect.of_response:
        return None
    best = max((hit for hit in hits if hit.incredible > 0), key=lambda hit: hit.rank, default=None)
    if best is None or best.rank <= paid + FAR_BETTER:
        return None
    as_well = (hit for hit in hits if not hit.candidate.generic and math.isfinite(hit.deviate))
    return None if any(hit.likelihood_ratio > best.likelihood_ratio - AS_WELL for hit in as_well) else best


def _keys(hits: list[Hit]) -> tuple[str, ...]:
    return tuple(hit.term.effect.key for hit in hits)


def _paid(term: Term, own: float, hits: list[Hit]) -> float:
    """What the added effect's likelihood ratio is worth beside its parameters, its looks and the odds against it."""
    hit = next((hit for hit in hits if hit.term.effect.key == term.effect.key), None)
    return own if hit is None else replace(hit, likelihood_ratio=own).rank


def _significant(problem: Problem, hit: Hit, alpha: float) -> bool:
    """Whether a rival explains what is there at all: the odds against it are not counted, for nobody states it.

    Nor are errors of the reference that would explain it as well.
    """
    return _log_p(problem, hit) <= math.log(alpha)


def _level(problem: Problem, term: Term, hits: list[Hit], alpha: float) -> float:
    """Probability up to which a rival explains what is there: that of the added effect times `AS_RARE` if it is more.

    Where one of two is found by a hair the other one is missed by a hair, and is as likely.
    """
    own = next((hit for hit in hits if hit.term.effect.key == term.effect.key), None)
    return alpha if own is None else max(alpha, AS_RARE * math.exp(min(_log_p(problem, own), 0.0)))


def _log_p(problem: Problem, hit: Hit) -> float:
    """Logarithm of the p-value without the odds against the effect, and errors of a reference that would explain it."""
    return log_tail(max(hit.deviate, hit.alone)) + math.log(hit.looks / against(problem, hit.term.effect))


def _odds(term: Term) -> float:
    """Twice the logarithm of the odds for an effect, before any data."""
    return -2 * math.log(UNUSUAL) if term.effect.unusual else 0.0


def is_plain(effect: Effect) -> bool:
    """Whether an effect follows the temperature as it is, in proportion."""
    return "temperature" in effect.needs and not (effect.of_way or effect.shapes or effect.of_time)


def _of_one_polynomial(effect: Effect, other: Effect) -> bool:
    """Whether two effects are one, or one with further coefficients: polynomials of two orders."""
    count = min(len(effect.linear), len(other.linear))
    orders = len(effect.linear) != len(other.linear) and effect.linear[:count] == other.linear[:count]
    return effect.id == other.id and (effect.key == other.key or orders)


def _lower_order(problem: Problem, others: Model, term: Term, hits: list[Hit], alpha: float) -> Hit | None:
    """The lowest order of the polynomial ``term`` beside which its further powers are not significant, if any."""
    lower = [hit for hit in hits if _of_one_polynomial(hit.term.effect, term.effect)]
    lower = [hit for hit in lower if len(hit.term.effect.linear) < len(term.effect.linear)]
    lower.sort(key=lambda hit: len(hit.term.effect.linear))
    return next((hit for hit in lower if not _still_needed(problem, (*others, hit.term), term, alpha)), None)


def _same_curve(problem: Problem, base: Reference, rival: Term, term: Term) -> bool:
    """Whether two terms are one curve on this recording, though neither is the other's limit."""
    own, other = _whitened_regressors(problem, base, term), _whitened_regressors(problem, base, rival)
    if term.effect.id in rival.effect.becomes or own.shape != other.shape:
        return False
    span = np.linalg.qr(own)[0]
    outside = other - span @ (span.T @ other)
    if float(np.linalg.norm(outside)) < ALIKE * float(np.linalg.norm(other)):
        return True
    size = np.linalg.lstsq(other, _whitened_residual(problem, base), rcond=None)[0]
    return float(np.linalg.norm(outside @ size)) < TO_THE_NOISE


def _is_part(problem: Problem, base: Reference, rival: Term, term: Term) -> bool:
    """Whether a rival is one of the curves that a term of several is made of: a gain at one rate, of a polynomial.

    Of two orders of one effect the noise has decided.
    """
    if rival.effect.id == term.effect.id:
        return False
    own, other = _whitened_regressors(problem, base, term), _whitened_regressors(problem, base, rival)
    if term.shape or other.shape[1] >= own.shape[1]:
        return False
    span = np.linalg.qr(own)[0]
    return float(np.linalg.norm(other - span @ (span.T @ other))) < ALIKE * float(np.linalg.norm(other))


def _whitened_residual(problem: Problem, base: Reference) -> Floats:
    """Whitened residual of a model, shape (modes,)."""
    data = problem.data() / base.root
    return np.asarray(data - base.basis @ (base.basis.T @ data))


def _whitened_regressors(problem: Problem, base: Reference, term: Term) -> Floats:
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
    return _whitened_regressors(problem, base, term).shape[1] + len(term.effect.shapes)


def _gain_by_itself(term: Term, extra: int, alpha: float, gain: float) -> float:
    """Likelihood ratio that ``extra`` parameters do not exceed by themselves.

    A term that is free in each run has many, and follows by chance whatever differs from run to run.
    """
    return float(chdtri(extra, alpha)) if term.per_run else gain * extra


def _still_needed(problem: Problem, model: Model, term: Term, alpha: float) -> bool:
    """Whether ``term`` adds significantly to ``model``, as an effect of a credible size, and no error of the reference.

    Two waves of one rate, of the encoder and of the gyro, are one curve: together they follow the noise of the
    reference, with amplitudes of a radian that cancel. Of two laws of a rate that was measured with a filter, neither
    is all that the filter leaves.
    """
    base = reference(problem, model)
    ratio, gained = likelihood_ratio(problem, base, (*model, term))
    if log_significance(ratio, gained, term_freedom(problem, base, term)) >= math.log(alpha):
        return False
    fit = solve(problem, model, start=base.noise.power)
    own = Hit(Candidate(term.effect, (term,)), term, ratio, looks=1.0, deviate=0.0, size=gained)
    return at_shape(problem, fit, base, own, term).log_p < math.log(alpha)
