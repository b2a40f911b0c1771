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

from collections.abc import Iterable

import numpy as np

from insenv.effects.base import Effect, MemoryEffect
from insenv.effects.thermal import BiasThermalHysteresis
from insenv.identify.clean.doubtful import shortest_agreeing
from insenv.identify.clean.plausibility import INCREDIBLE
from insenv.identify.findings import BY_SIGNS
from insenv.identify.fit.evidence import log_tail
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.fit.uncertainty import SCALE
from insenv.identify.prepare.obeyed import disobeyed
from insenv.identify.prepare.spectral.wandering import of_counts
from insenv.identify.search.artefacts.reference_errors import log_p_alone
from insenv.identify.search.artefacts.rounded import log_p_unrounded
from insenv.identify.search.doubts.sizes import UNSIGNED, called, imitated, of_no_credible_size, without_a_size
from insenv.identify.search.doubts.slow import slow_without_a_name
from insenv.identify.search.doubts.waves import swung, waves, waves_of_the_angle
from insenv.identify.search.jumps import is_step
from insenv.identify.search.round import against
from insenv.identify.search.scan import Hit, likelihood_ratio, reference
from insenv.identify.search.settle import REPEATED, times
from insenv.identify.search.size import follows_measured_rate
from insenv.identify.search.tracks import MOST_ADDED, Step, Track
from insenv.identify.search.undecided import leaning
from insenv.identify.search.unit.one_box import DRIFTS
from insenv.identify.search.unit.other_gyros import follows_other_gyros
from insenv.identify.search.unit.turn_on import turned_on_anew

#: What is far beyond the level: so many times less likely.
FAR = 10.0
#: How many times as long as was chosen means are that tell a gain of their own.
LONGER = 4.0
#: Likelihood ratio by which another explains less and does so as well.
NEARLY = 9.0


def unfinished(track: Track, alpha: float) -> tuple[str, ...]:
    """Reasons to take the search for incomplete."""
    return (
        *_not_as_told(track),
        *_what_does_not_last(track),
        *without_a_size(track, alpha),
        *_with_the_motion(track, alpha),
        *_rounded(track, alpha),
        *gain_of_means(track.prepared.gains),
        *_of_the_box(track),
        *follows_other_gyros(track.problem, track.fit),
        *leaning(track, alpha),
        *(track.apart or turned_on_anew(track, alpha)),
        *_jumping(track, alpha),
        *waves(track),
        *waves_of_the_angle(track),
        *_curves(track),
        *of_no_credible_size(track),
        *imitated(track),
        *swung(track),
        *_by_another_rate(track),
        *_without_a_name(track),
        *_half_a_loop(track),
        *_follows_a_product(track),
        *slow_without_a_name(track),
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
        f"{called(r.hit)} follows the fitted data (p = {r.hit.p_value:.1g}) and does not hold on the held-out data"
        for r in track.refusals
        if r.fails or r.hit.candidate.generic
    )


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


def _curves(track: Track) -> tuple[str, ...]:
    """Curves that were added beside effects: what they follow has no name."""
    added = [(s.hit.candidate.effect.key, s.hit.candidate.generic) for s in track.steps]
    if all(generic for _, generic in added):
        return ()
    return tuple(f"{key} stands for something that no effect names" for key, generic in added if generic)


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
    return tuple(dict.fromkeys(f"{called(hit)} follows the data, but {why}" for hit, why in (*gone, *twice)))


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


def _as_many_as_may_be(track: Track) -> tuple[str, ...]:
    if len(track.added) < MOST_ADDED:
        return ()
    return (f"{MOST_ADDED} effects were added, as many as are at most: there may be more",)
