"""What the search itself says against its being complete, though what is left may look like noise.

* An effect or a smooth curve that is significant on the fitted data and does not hold on the held-out data: something
  is there that is not this.
* An effect whose size is not told, and that is still significant beside all that was added.
* An effect of which the stated deviation, errors of the reference and of its form in it, holds nothing as well.
* An effect of the motion that errors of the reference explain as well: something goes with the motion.
* An effect that rounding of the readings, which no noise blurs, explains as well.
* A gain that is not the same by short means and by the long ones that are judged, beside a reference with errors.
* A drift that axes of the unit have together, and that is not told on this one, or whose size here is not.
* A gyro that follows another one of a unit that was turned, and not on a table.
* A drift of a unit at rest that would be significant if nothing else had been tried, or a slow cause that is so by all
  rows, the held-out ones too. Beside a reference: one of the bias that all rows tell.
* A bias of a unit at rest that is not the same in its runs.
* A step of a unit at rest that noise which does not jump would make less than once in a thousand times.
* Tones at multiples of one frequency: one wave that is no sine, and has a cause that no tone names. Tones nearer than
  two lines are: one whose amplitude swings.
* Waves of four orders of the table's angle: a place in the turn, which no order names.
* A curve without a cause beside effects that have one.
* What is beyond all doubt, and would be of a size that its effect cannot have: another cause is there.
* What would explain far better than an effect that was added, of a size that it cannot have.
* A law of the rate beside a gain that no gyro has: then the reference is not the rate that it turns by.
* One law of the rate twice: a curve of a form that neither has; what signs by chance give as often.
* An effect of the angle, of few waves, of a table that swings at one frequency: there its angle is its acceleration.
* A bias that follows how the temperature changes, where it turned back once: a hysteresis does so too.
* A product of what was recorded that no effect of the catalogue is, and that what is left follows.
* A bias that goes to and fro between two levels, or, beside a reference, bends as no drift does.
* As many effects as are added at most.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from insenv.core.quantities import unit_for
from insenv.effects.base import Effect, MemoryEffect
from insenv.effects.spline import SplineTime
from insenv.effects.thermal import BiasThermalHysteresis
from insenv.effects.timing import SampleHold, TimingSkew
from insenv.identify.clean.doubtful import shortest_agreeing
from insenv.identify.clean.plausibility import INCREDIBLE
from insenv.identify.findings import BY_SIGNS, Estimate
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.gls import solve
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.fit.uncertainty import SCALE
from insenv.identify.prepare.obeyed import disobeyed
from insenv.identify.prepare.spectral.wandering import of_counts
from insenv.identify.prepare.two_levels import two_levels
from insenv.identify.search.all_rows import longer_means, may_move_bias
from insenv.identify.search.artefacts.reference_errors import log_p_alone
from insenv.identify.search.artefacts.rounded import log_p_unrounded
from insenv.identify.search.candidates import law_of_motion, turns_few_waves
from insenv.identify.search.jumps import is_step
from insenv.identify.search.one_wave import frequencies, swinging, wave
from insenv.identify.search.round import against
from insenv.identify.search.scan import Hit, likelihood_ratio, reference
from insenv.identify.search.settle import REPEATED, times
from insenv.identify.search.size import LEAST, follows_measured_rate
from insenv.identify.search.staying import Staying
from insenv.identify.search.tracks import MOST_ADDED, Step, Track
from insenv.identify.search.undecided import leaning, may_be_slow
from insenv.identify.search.unit.one_box import DRIFTS, is_thermal
from insenv.identify.search.unit.other_gyros import follows_other_gyros
from insenv.identify.search.unit.turn_on import turned_on_anew

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
#: What is far beyond the level: so many times less likely; and a probability that leaves no doubt.
FAR, CERTAIN = 10.0, 1e-6
#: How many times as long as was chosen means are that tell a gain of their own.
LONGER = 4.0
#: Correlation from which on angle and acceleration are one curve, and fewest bins of a block that are asked.
ONE_CURVE, LEAST_BINS = 0.95, 32
#: Odds over noise that wanders from which on a bias is said to go to and fro: with so many changes; and with fewer, of
#: which one alone is a step, and two about a few means are an event. Odds from which on it bends. Of 61 tables with
#: neither the largest were 200 and 220, and for one bend 3e4; of 107 channels at rest the largest were 4e5 and 1e4.
MANY_CHANGES, ODDS, FEWEST_CHANGES, SURE, SELDOM, BENDS, AT_REST = 4, 3e3, 2, 1e5, 0.1, 1e5, 1e6
#: Orders of the angle from which on their waves are one curve.
MANY_ORDERS = 4
#: Likelihood ratio by which another explains less and does so as well.
NEARLY = 9.0
#: Fewest means in which they are looked for.
FEWEST_SLOW = 100


def unfinished(track: Track, alpha: float) -> tuple[str, ...]:
    """Reasons to take the search for incomplete."""
    return (
        *_not_as_told(track),
        *_what_does_not_last(track),
        *_without_a_size(track, alpha),
        *_with_the_motion(track, alpha),
        *_rounded(track, alpha),
        *gain_of_means(track.prepared.gains),
        *_of_the_box(track),
        *follows_other_gyros(track.problem, track.fit),
        *leaning(track, alpha),
        *(track.apart or turned_on_anew(track, alpha)),
        *_jumping(track, alpha),
        *_waves(track),
        *_waves_of_the_angle(track),
        *_curves(track),
        *_of_no_credible_size(track),
        *_imitated(track),
        *_swung(track),
        *_by_another_rate(track),
        *_without_a_name(track),
        *_half_a_loop(track),
        *_follows_a_product(track),
        *_slow_without_a_name(track),
        *_as_many_as_may_be(track),
    )


def _not_as_told(track: Track) -> tuple[str, ...]:
    """That a unit did not do what it was told, and how much of what it did."""
    share = disobeyed(track.problem)
    if not share:
        return ()
    return (
        f"the unit did not do what it was told: gain and lag of the command leave {share:.2g} of the power of the "
        "reading, and beside that no law of the rate or of the angle is told",
    )


def _what_does_not_last(track: Track) -> tuple[str, ...]:
    """What foretells nothing though it was significant."""
    return tuple(
        f"{_what(r.hit)} follows the fitted data (p = {r.hit.p_value:.1g}) and does not hold on the held-out data"
        for r in track.refusals
        if r.fails or r.hit.candidate.generic
    )


def _of_no_credible_size(track: Track) -> tuple[str, ...]:
    """What explains what is left beyond all doubt, with coefficients that no such effect has: the likeliest of them.

    Another cause imitates it: a wave of the encoder, of which a table that turns half a turn shows less than two, is a
    backlash of the wrong sign.
    """
    left = [hit for hit in track.last_physical if hit.incredible > 0]
    best = min(left, key=_log_p_incredible, default=None)
    if best is None or _log_p_incredible(best) >= np.log(CERTAIN):
        return ()
    chance = float(np.exp(_log_p_incredible(best)))
    return (f"{_what(best)} would explain more (p = {chance:.1g}), but {best.remark}: another cause is there",)


def _imitated(track: Track) -> tuple[str, ...]:
    """What explains far better than an effect that was added, with coefficients that it cannot have."""
    return tuple(
        f"{_what(other)} would explain far more than {_what(step.hit)} (likelihood ratio {other.likelihood_ratio:.3g} "
        f"in its place), but {other.remark}: another cause is there"
        for step, rivalry in zip(track.steps, track.rivalries, strict=False)
        if (other := rivalry.imitation) is not None
    )


def _log_p_incredible(hit: Hit) -> float:
    return log_tail(hit.incredible) + float(np.log(hit.looks))


def _what(hit: Hit) -> str:
    """The key of an effect, a line's with its frequency."""
    effect = hit.candidate.effect
    return f"{effect.key} at {hit.term.shape[0]:.4g} Hz" if effect.line else effect.key


def _without_a_size(track: Track, alpha: float) -> tuple[str, ...]:
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
            found.append(f"{_what(hit)} follows the data (p = {hit.p_value:.1g}), but {why}")
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
    return HELD if _has_a_size(effect) else 0.0


def _has_a_size(effect: Effect) -> bool:
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


def _with_the_motion(track: Track, alpha: float) -> tuple[str, ...]:
    """What would be significant beside a reference without errors, and is not beside one that may have them."""
    hits = [h for h in (*track.last_physical, *(track.hits or ())) if h.alone and not h.candidate.generic]
    hits = [h for h in hits if h.log_p >= np.log(alpha) > log_p_alone(h) and not _of_the_lag(track.problem, h)]
    hits = [h for h in hits if not h.candidate.effect.line or not of_counts(track.problem, track.fit, h.term.shape[0])]
    names = ", ".join(dict.fromkeys(h.candidate.effect.key for h in sorted(hits, key=log_p_alone)))
    if not names:
        return ()
    return (
        "something is left that goes with the motion, as errors of the reference do (filtered, late, noisy where it is "
        f"fast, or with another axis in it): {names} would follow it, and is not told from that",
    )


def _of_the_lag(problem: Problem, hit: Hit) -> bool:
    """Whether it is a rare memory beside a reference that comes late: what is left of every lag follows it a little."""
    remembers = hit.candidate.effect.unusual and isinstance(hit.candidate.effect, MemoryEffect)
    return remembers and any(exposure.motion.lag for exposure in problem.exposures)


def _rounded(track: Track, alpha: float) -> tuple[str, ...]:
    """What would be significant if readings were not rounded, or rounded beside noise that blurs it."""
    names = ", ".join(dict.fromkeys(hit.candidate.effect.key for hit in made_by_rounding(track, alpha)))
    if not names or track.problem.coarse is None:
        return ()
    step = track.problem.coarse.step
    return (
        f"readings are rounded to steps of {step:.3g} {track.problem.unit}, and their noise is too small to blur that: "
        f"{names} would follow what it leaves, and is not told from it",
    )


def made_by_rounding(track: Track, alpha: float) -> list[Hit]:
    """What is significant but for the rounding of the readings, surest first."""
    hits = [h for h in (*track.last_physical, *(track.hits or ())) if h.unrounded and not h.candidate.generic]
    hits = [h for h in hits if h.log_p >= np.log(alpha) > log_p_unrounded(h)]
    return sorted(hits, key=log_p_unrounded)


def gain_of_means(gains: tuple[tuple[float, float, float], ...]) -> tuple[str, ...]:
    """A gain that settles by means many times as long as were chosen, which are judged then, in words.

    Errors of the reference do that. So does what goes with the motion and is over in a mean: a play, a ripple of the
    angle, a bend at small rates; and nothing is known of these by the long ones.

    Parameters
    ----------
    gains : tuple of (float, float, float)
        Length of means [s], gain by them and its deviation, shortest first.
    """
    if not gains:
        return ()
    least = shortest_agreeing(gains)
    (short, first, of_first), (long, last, of_last) = gains[0], gains[least]
    if long < LONGER * short:
        return ()
    more = " and more" if least < len(gains) - 1 else ", as long as could be asked"
    return (
        f"the gain is not the same by means over {short:.2g} s ({first:.4g} ± {of_first:.1g}) and over {long:.2g} "
        f"s{more} ({last:.4g} ± {of_last:.1g}), which are judged: errors of the reference, or what goes with the "
        "motion and cancels in long means, of which they tell nothing",
    )


def _of_the_box(track: Track) -> tuple[str, ...]:
    """A drift that axes of the unit have together and that this one may have."""
    if any(step.hit.candidate.effect.key in DRIFTS for step in track.steps):
        return ()
    found = next((r for r in track.refusals if r.of_box), None)
    return (f"axes of the unit change together, and this one may as well: {found.reason}",) if found else ()


def _jumping(track: Track, alpha: float) -> tuple[str, ...]:
    """A step of a unit at rest that the odds against events alone keep from its name, by far."""
    found = next((hit for hit in track.last_physical if is_step(hit.candidate.effect)), None)
    if found is None or track.steps or any(r.hit.candidate.effect == found.candidate.effect for r in track.refusals):
        return ()
    odds = against(track.problem, found.candidate.effect)
    log_p = log_tail(found.deviate) + float(np.log(found.looks / odds))
    if odds == 1 or log_p >= np.log(alpha / FAR):
        return ()
    return (
        f"{found.candidate.effect.key} at {found.term.shape[0]:.4g} s explains the data better than noise does (p = "
        f"{np.exp(log_p):.1g} if noise does not jump): not decided between a step and a jump of the noise",
    )


def _waves(track: Track) -> tuple[str, ...]:
    """Tones that are one wave, or one line."""
    tones = tuple(s.hit.term.shape[0] for s in track.steps if s.hit.candidate.effect.line)
    span = _span(track.problem)
    found = frequencies(tones, track.prepared.lines, span)
    base, near = wave(found, span), swinging(found)
    if base is not None:
        return (
            f"{len(found)} tones are multiples of {base:.4g} Hz: one wave that is no sine, whose cause is not named",
        )
    if near is None:
        return ()
    low, high = near
    return (
        f"tones at {low:.5g} and {high:.5g} Hz are as near as one line is whose amplitude swings in "
        f"{1 / (high - low):.2g} s: not told from two",
    )


def _waves_of_the_angle(track: Track) -> tuple[str, ...]:
    """Waves of the table's angle that are one curve of it: a place in the turn takes as many as were tried."""
    effects = [step.hit.candidate.effect for step in track.steps]
    orders = sorted({order for e in effects if "angle" in e.needs and (order := getattr(e, "order", 0))})
    if len(orders) < MANY_ORDERS:
        return ()
    return (
        f"waves of the orders {', '.join(map(str, orders))} of the table's angle: one curve of it that is no wave, as "
        "of a place in the turn (a magnet, a bearing, a mark), whose cause is not named",
    )


def _span(problem: Problem) -> float:
    """Longest time from the first to the last fitted bin of a run [s]."""
    time, run = problem.bins.time, problem.bins.run
    return max(float(np.ptp(time[(run == r) & ~problem.bins.held_out])) for r in {b.run for b in problem.fitted})


def _curves(track: Track) -> tuple[str, ...]:
    """Curves that were added beside effects: what they follow has no name."""
    added = [(s.hit.candidate.effect.key, s.hit.candidate.generic) for s in track.steps]
    if all(generic for _, generic in added):
        return ()
    return tuple(f"{key} stands for something that no effect names" for key, generic in added if generic)


def _swung(track: Track) -> tuple[str, ...]:
    """Effects of the angle, of few waves, beside which no cause that goes with the acceleration could be told."""
    named = [s.hit.candidate.effect for s in track.steps]
    names = ", ".join(dict.fromkeys(e.key for e in named if turns_few_waves(track.problem, e)))
    if not names or not swings_at_one_frequency(track.problem):
        return ()
    return (
        f"the table swings at one frequency, where its angle and its acceleration are one curve: {names} may as well "
        "be a cause that goes with the acceleration",
    )


def _by_another_rate(track: Track) -> tuple[str, ...]:
    """Laws of the rate beside a gain that no gyro has: of wheels that slip, or whose track is not the drawing's."""
    problem, fit = track.problem, track.fit
    gain = abs(problem.gain * (1 + fit.scale_factor))
    laws = [s.hit.candidate.effect for s in track.steps if follows_measured_rate(problem, s.hit.term)]
    names = ", ".join(dict.fromkeys(law.key for law in laws if law.id != SCALE and not law.generic))
    if not names or abs(gain - 1) <= INCREDIBLE:
        return ()
    return (
        f"a gain of {gain:.2g} is none of a gyro: the reference is not the rate that it turns by, and {names} may as "
        "well be the reference's own",
    )


def _without_a_name(track: Track) -> tuple[str, ...]:
    """What was added and has no name: laws of the rate that came more than once, what noise gives as often, any lag."""
    said = (REPEATED, BY_SIGNS, UNSIGNED)
    gone = [(r.hit, r.reason) for r in track.refusals if r.reason.startswith(said)]
    rates = (s.hit for s in track.steps if s.hit.candidate.effect.of_rate)
    twice = [(hit, REPEATED) for hit in rates if times(track, hit.candidate.effect.key) > 1]
    return tuple(dict.fromkeys(f"{_what(hit)} follows the data, but {why}" for hit, why in (*gone, *twice)))


def swings_at_one_frequency(problem: Problem) -> bool:
    """Whether the angle of a table is its acceleration but for a factor, the same in all fitted bins."""
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))
    parts = [u[b.start : b.stop] for b in problem.fitted if b.n >= LEAST_BINS]
    angles, changes = [], []
    for part in parts:
        line = np.vander(np.arange(len(part)), 2)
        angle = np.cumsum(part - part.mean())
        angles.append(angle - line @ np.linalg.lstsq(line, angle, rcond=None)[0])
        changes.append(np.gradient(part))
    angle, change = np.concatenate([[0.0], *angles]), np.concatenate([[0.0], *changes])
    size = float(np.linalg.norm(angle) * np.linalg.norm(change))
    return size > 0 and -float(angle @ change) > ONE_CURVE * size


def _half_a_loop(track: Track) -> tuple[str, ...]:
    """A bias that follows how the temperature changes, where it turned back once: a hysteresis does so too.

    Of three simulated loops of a chamber that rose and fell one was stated to be a lag, and one a rate.
    """
    hysteresis = BiasThermalHysteresis()
    motions = [e.motion for e in track.problem.exposures]
    ways = [s for s in track.steps if s.hit.candidate.effect.of_way and "temperature" in s.hit.candidate.effect.needs]
    if not ways or not any(hysteresis.half_blind(motion) for motion in motions):
        return ()
    radii = {float(r) for motion in motions for r in hysteresis.grid(motion)[:, 0]}
    names = ", ".join(s.hit.candidate.effect.key for s in ways if _as_well(track, s, hysteresis, radii))
    if not names:
        return ()
    return (
        f"the temperature turns back once only: {names} may as well be {hysteresis.id}, of which that is half a loop",
    )


def _as_well(track: Track, step: Step, other: Effect, shapes: Iterable[float]) -> bool:
    """Whether another effect of one shape explains in the place of a step what it does, or nearly."""
    rest = tuple(term for term in track.fit.model if term is not step.hit.term)
    base = reference(track.problem, rest, track.fit.noise.power)
    own, _ = likelihood_ratio(track.problem, base, track.fit.model)
    best = max(likelihood_ratio(track.problem, base, (*rest, Term(other, (one,))))[0] for one in shapes)
    return best > own - NEARLY


def _follows_a_product(track: Track) -> tuple[str, ...]:
    """What is left goes with several things at once."""
    law = track.law
    if law is None:
        return ()
    share = 1 - (law.held_out_after / law.held_out_before) ** 2
    alike = f", or {' or '.join(law.alike[:2])}, which are not told from it" if law.alike else ""
    behind = f"; explains less, and is not named: {', '.join(dict.fromkeys(track.behind))}" if track.behind else ""
    return (
        f"what is left goes with {law.formula}{alike}: a product that no effect of the catalogue is (p = "
        f"{law.p_value:.1g}), {share:.2g} of the variance of held-out data{behind}",
    )


def _slow_without_a_name(track: Track) -> tuple[str, ...]:
    """A bias that goes to and fro between two levels, or bends, far likelier than noise that wanders.

    At rest the slow causes are asked whether they bend.
    """
    if len(track.problem.exposures) > 1 or may_be_slow(track):
        return ()
    longer = longer_means(track, FEWEST_SLOW)
    if longer is None:
        return ()
    asked = _slow if track.problem.turns else _to_and_fro
    return track.problem.remember(("slow", track.fit.model), lambda: asked(track, longer))


def _slow(track: Track, longer: Problem) -> tuple[str, ...]:
    return _to_and_fro(track, longer) or _bends(track, longer)


def _to_and_fro(track: Track, longer: Problem) -> tuple[str, ...]:
    fit = solve(longer, track.fit.model, start=track.fit.noise.power)
    left = longer.y - fit.predicted()
    if not np.ptp(left):  # readings that stand still but for some rows
        return ()
    variance = longer.modes().shapes @ fit.noise.power
    wandering = -0.5 * float(np.sum(np.log(2 * np.pi * variance) + transform(longer.fitted, left) ** 2 / variance))
    found = two_levels(left)
    many = found.changes >= MANY_CHANGES
    few = found.changes >= FEWEST_CHANGES and SELDOM <= found.share <= 1 - SELDOM
    least = (ODDS if many else SURE) if track.problem.turns else AT_REST
    if not (many or few) or found.loglik - wandering <= np.log(least):
        return ()
    apart, odds = unit_for(longer.unit, found.apart).show(found.apart), np.exp(min(found.loglik - wandering, 99.0))
    return (
        f"the bias goes to and fro between two levels {apart} apart, {found.changes} times (upper one "
        f"{found.share:.0%} of the time, by means over {longer.bins.width:.2g} s): {odds:.1g} times as likely as noise "
        "that wanders, and no effect",
    )


def _bends(track: Track, longer: Problem) -> tuple[str, ...]:
    model, noise = track.fit.model, Staying.of(longer, track.fit.model)
    curve = Term(SplineTime(count=3).over(longer.exposures[0].motion))
    odds = noise.loglik((*model, curve)) - noise.walking - (curve.size - 1)
    if odds <= np.log(BENDS):
        return ()
    return (
        f"the bias bends in time, by means over {longer.bins.width:.2g} s: a smooth curve beside noise that stays is "
        f"{np.exp(min(odds, 99.0)):.1g} times as likely as the walk of the noise that stands for it, and no drift, "
        "warm-up or step is told",
    )


def _as_many_as_may_be(track: Track) -> tuple[str, ...]:
    if len(track.added) < MOST_ADDED:
        return ()
    return (f"{MOST_ADDED} effects were added, as many as are at most: there may be more",)
