"""What becomes of one candidate on one target: tried beside the model, kept, refused, or taken for something else.

A line may be the motion's, the reference's or a counter's; one whose phase does not hold is damped; an end of a run
that nobody could have reached is left out. What stays is refitted with all that was added, and what is superfluous then
goes.
"""

from __future__ import annotations

import math
from dataclasses import replace

from insenv.effects.timing import TimingSkew
from insenv.identify.clean.settling import settled_by, without_start
from insenv.identify.clean.unreached import rows_of, unreached
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.heldout import CHANCE, MOST_GROWTH, confirms, held_out_score, rescored
from insenv.identify.fit.lag_form import is_skew
from insenv.identify.prepare.excess import order_of_line
from insenv.identify.prepare.spectral.lines import Line
from insenv.identify.prepare.spectral.wandering import (
    goes_with_motion,
    heated_there,
    left_of,
    lost,
    moves_there,
    stands_in_reference,
    stops_at_rest,
    without_line,
)
from insenv.identify.search.jumps import is_step, one_of_many
from insenv.identify.search.round import at_shape, with_term
from insenv.identify.search.scan import Hit, Reference, likelihood_ratio, reference
from insenv.identify.search.size import follows_measured_rate, unsized
from insenv.identify.search.tracks import Refusal, Step, Track
from insenv.identify.search.unit.other_gyros import beside_other_gyros
from insenv.identify.search.unit.proposals import (
    Proposal,
    may_damp,
    wandering,
)

#: Least normal deviate of a target's own evidence for a cause that was found on several targets together.
LEAST_SUPPORT = 1.0
#: Fits at most in which an effect that is linear only for small parameters comes to those that it has.
MOST_PASSES = 6
#: Log likelihood ratio by which an effect that is exact at its size may explain less than one that is for small ones:
#: at one frequency they are one curve and differ in the gain.
AS_LIKELY = 2.0
#: Forms that are tried, and the largest that a lag has: that of a first-order one. Beyond it something else is there.
FORMS, LARGEST_FORM = (-0.6, 0.6), 0.55
#: Log likelihood ratio by which what an effect has taken the place of must explain more to stay, as the best of rivals.
MARGIN = 6.0
#: Why an effect is refused that would take the place of one which explains more.
LESS = "it would take the place of what explains more"
#: Why a line is refused that is none of the target.
OF_REFERENCE = "it stands in the reference and not in what is read: the reference's own, as an encoder's steps are"
OF_COUNTS = "a line of the counts was taken out there, of which some is left"
#: Why a line beside one that was damped is not named again.
OF_DAMPED = "a line whose phase does not hold was damped there, of which some is left"
#: Why a line is refused that comes so many times a turn of the table.
OF_TURNS = "it comes {} a turn of the table, as what goes with its angle does: a motor's poles, a gear, an encoder"
OF_MOTION = "the motion has a line there as well, of which a filter or a lag leaves some: a motor's ripple, for one"
#: Why a line is refused that the table has while it turns alone.
OF_RIPPLE = "it is there while the table turns and not while it rests: the ripple of a motor, for one"
#: Why a line is refused that the temperature has.
OF_HEAT = "the temperature has a line there as well: what goes with it is asked by its own effects"
#: Why a line is refused that another gyro of the unit reads.
OF_TURN = "the unit turns there, as its other gyros read"
#: P-value below which what is left is suspected to be more than the declared noise.
SUSPECTED = 0.1


def tried(track: Track, hit: Hit, proposal: Proposal, names: tuple[str, ...], alpha: float) -> tuple[Track, bool]:
    """The track with ``hit`` added, or with its refusal noted."""
    joined = names if len(names) > 1 else ()
    problem = track.problem
    elsewhere = _left_of(track, hit) or times_a_turn(track, hit) or _of_the_reference(track, hit)
    wander = None if elsewhere else wandering(track, hit)
    if wander is not None:
        return _damped(track, wander, hit), True
    if nothing := _nothing(track, hit, joined):
        said = bool(times_a_turn(track, hit))
        return replace(track, refusals=(*track.refusals, Refusal(hit, nothing, unsized=said))), False
    if (shorter := _without_ends(track, hit)) is not track:
        return shorter, True
    asked, hit = _as_judged(hit, proposal), _centred(track, hit)
    model = with_term(track.fit.model, hit.term)
    fit = solve(problem, model, start=track.fit.noise.power)
    score = held_out_score(problem, fit)
    confirmed = confirms(track.score, score, rescored(problem, track.fit, fit.noise.power))
    # Each of several effects may cost a little; together no more than one may.
    confirmed &= score.rms <= (1 + MOST_GROWTH) * min(s.rms for s in (track.score, *(s.before for s in track.steps)))
    if follows_measured_rate(problem, hit.term):  # its errors go with the motion; no slow wander excuses a growth
        confirmed &= score.rms <= (1 + CHANCE) * track.score.rms
    if not confirmed and hit.candidate.effect.line and may_damp(track):
        wander = lost(problem, track.fit, hit.term.shape[0])
        if wander is not None:
            return _damped(track, wander, hit), True
    if not confirmed:
        growth = f"by {score.rms / track.score.rms - 1:.0%}" if track.score.rms else "of which nothing was left"
        where = " on several axes together" if proposal.looks else ""
        reason = f"significant{where}, but it makes held-out data worse, {growth}"
        of_box, together = bool(proposal.looks), bool(joined) and not proposal.looks
        against: Refusal | None = Refusal(asked, reason, not joined, of_box=of_box, fails_together=together)
    else:
        unclear = "" if joined else unsized(problem, fit, hit.term, held_out=hit.held_out, looks=hit.looks)
        unclear = unclear or ("" if joined else _no_step(track, fit, hit))
        against = Refusal(hit, unclear, unsized=True) if unclear else None
    if against is not None:
        return replace(track, refusals=(*track.refusals, against)), False
    step = Step(hit, track.score, score, proposal.p_value, joined)
    steps = (*(s for s in track.steps if s.hit.term in model), step)
    grown = replace(track, fit=fit, score=score, steps=steps, hits=None)
    return _kept(track, grown, hit, alpha)


def _as_judged(hit: Hit, proposal: Proposal) -> Hit:
    """The hit with no more looks than its proposal was judged by, if that is of this target alone."""
    if len(proposal.where) > 1 or not 0 < proposal.p_value < hit.p_value:
        return hit
    return replace(hit, looks=math.exp(math.log(proposal.p_value) - log_tail(hit.deviate)))


def _nothing(track: Track, hit: Hit, joined: tuple[str, ...]) -> str:
    """Why a hit is nothing of this target; empty if it may be something."""
    if joined and hit.deviate < LEAST_SUPPORT:
        return "found on another target; nothing speaks for it on this one"
    if not hit.candidate.effect.line:
        return ""
    if damped := _left_of(track, hit):
        return OF_COUNTS if damped.of_counts else OF_MOTION if damped.of_motion else OF_DAMPED
    if order := times_a_turn(track, hit):
        return OF_TURNS.format("once" if order == 1 else f"{order} times")
    if heated_there(track.problem, hit.term.shape[0]):
        return OF_HEAT
    return OF_REFERENCE if _of_the_reference(track, hit) else _of_the_motion(track, hit)


def _of_the_motion(track: Track, hit: Hit) -> str:
    """Why a line is one of the motion; empty if it is not."""
    problem, fit, frequency = track.problem, track.fit, hit.term.shape[0]
    if (turned := beside_other_gyros(problem, fit)) and not _stands(track, turned, hit):
        return OF_TURN
    if stops_at_rest(problem, fit, frequency):
        return OF_RIPPLE
    moved = moves_there(problem, fit, frequency) or goes_with_motion(problem, fit, frequency)
    return OF_MOTION if moved else ""


def _stands(track: Track, fit: Fit, hit: Hit) -> bool:
    """Whether a hit is more than noise beside the model of ``fit``, another one than that of the track."""
    base = reference(track.problem, fit.model, fit.noise.power)
    return at_shape(track.problem, fit, base, hit, hit.term).log_p < math.log(SUSPECTED)


def _left_of(track: Track, hit: Hit) -> Line | None:
    """The line that was damped in the bins and of which a hit is what is left, if it is."""
    if not hit.candidate.effect.line:
        return None
    return left_of(track.problem, track.prepared.lines, hit.term.shape[0])


def _of_the_reference(track: Track, hit: Hit) -> bool:
    """Whether a hit is a line that stands in the reference alone, whether its phase holds or not."""
    return hit.candidate.effect.line and stands_in_reference(track.problem, track.fit, hit.term.shape[0])


def times_a_turn(track: Track, hit: Hit) -> int:
    """Times a turn of the table that the line of a hit comes, if it goes with its angle as nearly as anybody tells."""
    problem, fit = track.problem, track.fit
    if not hit.candidate.effect.line:
        return 0
    frequency = hit.term.shape[0]
    order: int = problem.remember(("order of", hit.term, fit.model), lambda: order_of_line(problem, fit, frequency))
    return order


def _kept(track: Track, grown: Track, hit: Hit, alpha: float) -> tuple[Track, bool]:
    """The track grown by ``hit`` without what has become superfluous, or with the refusal of what explains less."""
    pruned = _pruned(grown, alpha)
    if _explained_more(track, pruned, hit):
        return replace(track, refusals=(*track.refusals, Refusal(hit, LESS, displaced=True))), False
    return pruned, True


def _explained_more(track: Track, pruned: Track, hit: Hit) -> bool:
    """Whether an effect that ``hit`` has taken the place of explains more than it does, by itself in that place.

    Two curves can contradict each other though each fits: beside a lock-in the rest of a dead band would lose a part
    of the low rates only, which no dead band does. Of the two the likelier stays.
    """
    gone = [s.hit.term for s in track.steps if all(s is not left for left in pruned.steps)]
    if not gone:
        return False
    rest = tuple(t for t in track.fit.model if all(t is not one for one in gone))
    base = reference(track.problem, rest, track.fit.noise.power)
    before, _ = likelihood_ratio(track.problem, base, track.fit.model)
    after, _ = likelihood_ratio(track.problem, base, with_term(rest, hit.term))
    return before - after > MARGIN


def _no_step(track: Track, fit: Fit, hit: Hit) -> str:
    """Why a step, the last term of a fit, is none; empty if it is one or is another effect."""
    if not is_step(hit.candidate.effect):
        return ""
    events = [row.size for row in track.prepared.rejected if row.cause == "burst" and row.size is not None]
    return one_of_many(track.problem, fit, hit.candidate, events)


def _damped(track: Track, wander: Line, hit: Hit) -> Track:
    """The track with a line that wanders taken out of its bins, named among the lines."""
    problem = without_line(track.problem, track.fit, wander)
    line = replace(wander, p_value=hit.p_value)
    prepared = replace(track.prepared, problem=problem, lines=(*track.prepared.lines, line))
    fit = solve(problem, track.fit.model, start=track.fit.noise.power)
    return replace(track, prepared=prepared, fit=fit, score=held_out_score(problem, fit), hits=None)


def _without_ends(track: Track, hit: Hit) -> Track:
    """The track without the start of its run that settled, or ends whose reference was not recorded; itself if none."""
    until = settled_by(track.problem, hit.term)
    if until is not None:
        return _without_start(track, until, hit)
    return _without_unreached(track, hit) if is_skew(hit.term) else track


def _without_start(track: Track, until: float, hit: Hit) -> Track:
    """The track without the start of its run, in which something settled."""
    fit = solve(track.problem, with_term(track.fit.model, hit.term), start=track.fit.noise.power)
    own = fit.theta[fit.design.term == len(fit.model) - 1]
    curve = track.problem.columns(hit.term)[[b.start for b in track.problem.fitted[:1]], 0]
    last = track.problem.columns(hit.term)[track.problem.fitted[-1].stop - 1, 0]
    problem, rows = without_start(track.problem, until, float((curve[0] - last) * own[0]) if len(own) else 0.0)
    # What was taken out of the samples is judged on the same rows as what it was taken out of.
    plain, _ = without_start(track.prepared.plain, until, 0.0)
    prepared = replace(track.prepared, problem=problem, plain=plain, rejected=(*track.prepared.rejected, rows))
    fit = solve(problem, track.fit.model, start=track.fit.noise.power)
    return replace(track, prepared=prepared, fit=fit, score=held_out_score(problem, fit), hits=None)


def _without_unreached(track: Track, hit: Hit) -> Track:
    """The track without means whose reference was not recorded, of a reading that is late or early; itself if none."""
    problem, plain = track.problem, track.prepared.plain
    fit = solve(problem, with_term(track.fit.model, hit.term), start=track.fit.noise.power)
    own = fit.theta[fit.design.term == len(fit.model) - 1]
    if not len(own) or not (gone := unreached(problem, fit, float(own[0]))).any():
        return track
    rows = rows_of(problem, gone, float(own[0]))
    shorter = problem.without_bins(gone)
    also = plain.without_bins(unreached(plain, solve(plain, (*track.prepared.model, hit.term)), float(own[0])))
    prepared = replace(track.prepared, problem=shorter, plain=also, rejected=(*track.prepared.rejected, *rows))
    fit = solve(shorter, track.fit.model, start=track.fit.noise.power)
    return replace(track, prepared=prepared, fit=fit, score=held_out_score(shorter, fit), hits=None)


def _centred(track: Track, hit: Hit) -> Hit:
    """The hit with its effect exact at the size at which it is found, but where that explains less."""
    problem, base = track.problem, reference(track.problem, track.fit.model, track.fit.noise.power)
    for _ in range(MOST_PASSES):
        fit = solve(problem, with_term(track.fit.model, hit.term), start=track.fit.noise.power)
        theta = fit.theta[fit.design.term == len(fit.model) - 1]
        # Of one in every run, the mean: what is left at each is small beside it.
        whole = len(theta) > 0 and len(theta) % len(hit.term.effect.linear) == 0
        mean = theta.reshape(len(hit.term.effect.linear), -1).mean(axis=1) if whole else theta
        # What was read late is the input times the gain.
        mean = mean / (1 + fit.scale_factor) if isinstance(hit.term.effect, TimingSkew) else mean
        effect = hit.term.effect.near(mean) if whole else hit.term.effect
        if effect == hit.term.effect:
            break
        moved = at_shape(problem, track.fit, base, hit, replace(hit.term, effect=effect))
        if moved.likelihood_ratio < hit.likelihood_ratio - AS_LIKELY or moved.remark:
            break
        hit = moved
    return _formed(track, base, hit)


def _formed(track: Track, base: Reference, hit: Hit) -> Hit:
    """The hit of a lag with the form that explains most, where that is beyond doubt no delay."""
    from scipy.optimize import minimize_scalar  # slow to import

    effect = hit.term.effect
    if not isinstance(effect, TimingSkew) or not effect.about:
        return hit

    def of(form: float) -> Hit:
        formed = replace(hit.term, effect=replace(effect, form=float(form)))
        return at_shape(track.problem, track.fit, base, hit, formed)

    best = minimize_scalar(lambda k: -of(k).likelihood_ratio, bounds=FORMS, method="bounded", options={"xatol": 0.01})
    formed = of(best.x)
    better = formed.likelihood_ratio > hit.likelihood_ratio + MARGIN and abs(best.x) < LARGEST_FORM
    return formed if better and not formed.remark else hit


def _pruned(track: Track, alpha: float) -> Track:
    """Drop added effects that the ones added after them have made superfluous."""
    for step in track.steps[:-1]:
        if step.together or (track.steps[-1].hit.candidate.generic and not step.hit.candidate.generic):
            continue  # its evidence lies on other targets too; a curve without a cause displaces no cause
        rest = tuple(t for t in track.fit.model if t is not step.hit.term)
        fit = solve(track.problem, rest, start=track.fit.noise.power)
        base = reference(track.problem, rest, track.fit.noise.power)
        alone = at_shape(track.problem, fit, base, step.hit, step.hit.term)
        if log_tail(alone.deviate) > math.log(alpha):
            steps = tuple(s for s in track.steps if s is not step)
            why = "superfluous beside what was added after it"
            refusals = (*track.refusals, Refusal(step.hit, why, displaced=True))
            score = held_out_score(track.problem, fit)
            track = replace(track, fit=fit, steps=steps, score=score, refusals=refusals)
    return track
