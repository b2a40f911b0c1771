"""Effects that are not told for their size: it may be anything, or nothing as well, or is one that none has."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from insenv.core.quantities import unit_for
from insenv.effects.base import Effect
from insenv.effects.timing import SampleHold, TimingSkew
from insenv.identify.findings import Estimate
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.problem import Term
from insenv.identify.search.all_rows import may_move_bias
from insenv.identify.search.candidates import law_of_motion
from insenv.identify.search.scan import Hit
from insenv.identify.search.size import LEAST
from insenv.identify.search.tracks import Step, Track
from insenv.identify.search.unit.one_box import DRIFTS, is_thermal

_BESIDE_THE_REFERENCE = (
    "beside errors of the reference (a filter, another axis that leaks in) which may make one as large, of either sign"
)
#: Why a law has no name, and why a skew has none.
_UNSIZED = "its size is not told beside errors of the reference"
UNSIGNED = "not even the sign of the lag is told"
_BY_ITS_DEVIATION = "by a deviation that holds what the form of its curve and errors of the reference leave open"

#: Stated deviations from nothing below which a law of a rate that was measured has no name, nor a step or a warm-up.
HELD = 2.0
#: The same of a share of the output that is held.
WHOLE = 4.0
#: The same of a skew: of half a deviation the other sign has 0.31.
SIGN = 0.5
#: A probability that leaves no doubt.
CERTAIN = 1e-6


def of_no_credible_size(track: Track) -> tuple[str, ...]:
    """What explains what is left beyond all doubt, with coefficients that no such effect has: the likeliest of them.

    Another cause imitates it: a wave of the encoder, of which a table that turns half a turn shows less than two, is a
    backlash of the wrong sign.
    """
    left = [hit for hit in track.last_physical if hit.incredible > 0]
    best = min(left, key=_log_p_incredible, default=None)
    if best is None or _log_p_incredible(best) >= np.log(CERTAIN):
        return ()
    chance = float(np.exp(_log_p_incredible(best)))
    return (f"{called(best)} would explain more (p = {chance:.1g}), but {best.remark}: another cause is there",)


def imitated(track: Track) -> tuple[str, ...]:
    """What explains far better than an effect that was added, with coefficients that it cannot have."""
    return tuple(
        f"{called(other)} would explain far more than {called(step.hit)} (likelihood ratio "
        f"{other.likelihood_ratio:.3g} in its place), but {other.remark}: another cause is there"
        for step, rivalry in zip(track.steps, track.rivalries, strict=False)
        if (other := rivalry.imitation) is not None
    )


def _log_p_incredible(hit: Hit) -> float:
    return log_tail(hit.incredible) + float(np.log(hit.looks))


def without_a_size(track: Track, alpha: float) -> tuple[str, ...]:
    """What is significant to the end and cannot be named, for its coefficients could be anything.

    A curve of the rate beside a reference that is late is what the filter of that reference leaves, unless it is beyond
    all doubt that something bends the response.
    """
    late = any(e.motion.lag for e in track.problem.exposures)
    left = {
        hit.candidate.effect.key: hit
        for hit in track.last_physical
        if hit.log_p < np.log(CERTAIN if late and hit.candidate.effect.of_rate else alpha)
    }
    found = []
    for refusal in track.refusals:
        hit = left.get(refusal.hit.candidate.effect.key)
        if hit and (refusal.unsized or refusal.displaced):
            # What displaced an effect, and was taken out again itself, leaves its evidence behind.
            why = "what explained it better was not kept" if refusal.displaced else refusal.reason
            found.append(f"{called(hit)} follows the data (p = {hit.p_value:.1g}), but {why}")
    return tuple(found)


def untold(track: Track, own: Mapping[Term, tuple[Estimate, ...]]) -> tuple[str, ...]:
    """What was added with one coefficient and is near nothing by the deviation that is stated of it.

    An effect is told from noise by its evidence. Its stated deviation holds more: what the form of the curve and
    errors of the reference leave open. The part that one target has in a cause of several may be weak.
    """
    found = []
    for step in track.steps:
        row, effect = _one_size(step, own), step.hit.candidate.effect
        if row is not None and 0 < abs(row.value) < LEAST * row.sd:
            why = _BESIDE_THE_REFERENCE if effect.of_response else _BY_ITS_DEVIATION
            why = f"and is named on what {', '.join(step.together)} show together" if step.together else why
            found.append(f"{row.effect} is {abs(row.value) / row.sd:.2g} standard deviations from nothing, {why}")
    return tuple(found)


def nothing_as_well(track: Track, own: Mapping[Term, tuple[Estimate, ...]]) -> tuple[Step, str] | None:
    """A law of a unit that turns whose stated deviations hold nothing as well, and why; None where there is none.

    Of an error of the reference, which may be as large, it is not told: it is said, and has no name. Nor has a slow
    change of the bias one: a step of a third of its deviation was named with a walk as its rival, a drift of a
    fourteenth, and they say nothing about the bias. A skew has one, for that there is a lag is certain and only its
    form is not, unless not even its sign is told. All of an output is held or nothing: a share of 1.1 +- 0.5 is half
    of it as well.
    """
    for step in track.steps:
        effect = step.hit.candidate.effect
        if step.together or not track.problem.turns:
            continue
        sizes = {param.name for param in effect.linear}
        rows = [row for row in own.get(step.hit.term, ()) if row.parameter in sizes and row.sd > 0]
        best = max(rows, key=lambda row: abs(row.value) / row.sd, default=None)
        if best is None or not 0 < abs(best.value) < _least(effect) * best.sd:
            continue
        off = f"{abs(best.value) / best.sd:.2g} standard deviations from nothing"
        told = unit_for(best.unit, best.value).show_with_sd(best.value, best.sd)
        return step, f"{UNSIGNED if isinstance(effect, TimingSkew) else _UNSIZED}: {told}, {off}"
    return None


def _least(effect: Effect) -> float:
    """Stated deviations from nothing that a name wants of an effect; 0 where none are asked."""
    if isinstance(effect, TimingSkew):
        return SIGN
    if isinstance(effect, SampleHold):
        return WHOLE
    return HELD if has_a_size(effect) else 0.0


def has_a_size(effect: Effect) -> bool:
    """Whether it has a name and goes with rate, angle or gain, as what errors of a reference leave does, and no lag.

    Or is a law of the bias; but the coefficients of a polynomial of the temperature are told together alone.
    """
    gain = effect.part == "gain"
    of_bias = may_move_bias(effect) and len(effect.linear) == 1
    return (gain or law_of_motion(effect) or of_bias) and not effect.generic and not effect.line


def _one_size(step: Step, own: Mapping[Term, tuple[Estimate, ...]]) -> Estimate | None:
    """The one coefficient of what a step added; None where it has several, or the attitude says how much there is."""
    rows, effect = own.get(step.hit.term, ()), step.hit.candidate.effect
    if step.together:  # its shape is that of all of them
        rows = tuple(row for row in rows if row.parameter in {param.name for param in effect.linear})
    of_base = step.together and not (effect.key in DRIFTS or is_thermal(effect))
    return None if effect.generic or effect.line or of_base or len(rows) != 1 else rows[0]


def called(hit: Hit) -> str:
    """The key of an effect, a line's with its frequency."""
    effect = hit.candidate.effect
    return f"{effect.key} at {hit.term.shape[0]:.4g} Hz" if effect.line else effect.key
