"""Which effects of the catalogue a recording can show, and the shapes that a scan tries for each.

A candidate is one effect with all its shapes. An effect is not testable where the recording lacks a channel
that it needs, or where its regressors cannot be told from the model already there (a scale factor at a single
rate).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.data.exposure import CHANNEL_OF
from insenv.effects.angle import EncoderHarmonic
from insenv.effects.base import CurveEffect, Effect, LinearEffect, MemoryEffect, NoiseEffect
from insenv.effects.spline import Spline
from insenv.identify.findings import NotTestable
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.prepare.obeyed import disobeyed
from insenv.identify.search.unit.real_motion import unmoved

#: Why no law of the motion is told beside a command.
DISOBEYED = "what the unit did not do that it was told to goes with the motion as well"
#: Share of the fitted time at either end in which no step is looked for.
END_SHARE = 0.05
#: Why nothing is told of what is late or held where the rate never changes.
UNCHANGED = "the table keeps its rate, and nothing shows when it was read"
#: Why nothing is told of vibration beside accelerometers.
SLOW = "rows are too far apart, or too few, to show what vibrates within a second"
#: Why nothing is told of the angle of a table that turns, of a lag, a line or a hold.
IN_POINTS = "each row is a point of its own, and nothing was recorded of the way between"
#: Departure of a table's rate, as a share of it, up to which it is none of the table's: the wave of a good encoder.
STEADY = 1e-4
#: Fitted means for each parameter of a curve without a cause.
MEANS_EACH = 3
#: Means over which a hold must last to be more than a delay in them.
HELD_MEANS = 2.0
#: Arc, in radians of a wave of the table's angle, below which the wave is no wave but a gain: on a quarter of one its
#: rate hardly leaves that of the table. Beside a reference that comes late two waves, for what it leaves may look like
#: one that nobody has seen come again. The same in radians of the table for what has no order.
QUARTER_WAVE, TWO_WAVES, LEAST_ARC = 0.5 * np.pi, 4 * np.pi, 0.05


@dataclass(frozen=True)
class Candidate:
    """One effect and the terms (one per shape) that a scan tries."""

    effect: Effect
    terms: tuple[Term, ...]

    @property
    def generic(self) -> bool:
        """Whether it explains without naming a cause."""
        return self.effect.generic


def candidates(
    problem: Problem, catalogue: tuple[Effect, ...]
) -> tuple[tuple[Candidate, ...], tuple[NotTestable, ...]]:
    """Candidates of a problem, and the effects that its recording cannot show."""
    found: list[Candidate] = []
    blind: list[NotTestable] = []
    told = not disobeyed(problem)
    for effect in catalogue:
        if isinstance(effect, NoiseEffect) or effect.line or not _fits_instrument(problem, effect):
            continue
        needs, reason = _unseen(problem, effect) if told or not law_of_motion(effect) else ((), DISOBEYED)
        if problem.in_points and _of_the_way(problem, effect):
            needs, reason = (), IN_POINTS
        terms = () if reason else _terms(problem, effect)
        if terms and effect.generic and _is_richer(problem, terms[0]):
            terms, reason = (), "a curve of so many parameters follows so few means, whatever they are"
        if terms:
            found.append(Candidate(effect, terms))
        else:
            blind.append(NotTestable(effect.key, needs, reason or "no shape of it can be told on this recording"))
    return tuple(found), tuple(blind)


def _unseen(problem: Problem, effect: Effect) -> tuple[tuple[str, ...], str]:
    """What a recording lacks to show an effect, and why it cannot; nothing and an empty reason where it may."""
    if effect.of_rate and not problem.turns and any(np.any(e.motion.rate) for e in problem.exposures):
        return (), "the table turns at one rate, which tells no law of it"
    if needs := _missing(problem, effect):
        felt = "vibration" in effect.needs and all(e.motion.force or e.motion.cross_rate for e in problem.exposures)
        return ((), SLOW) if felt else (needs, "the recording has no such channel")
    if resting := unmoved(problem, effect):
        return ("motion",), resting
    if effect.id == EncoderHarmonic.id and not any(e.motion.projection for e in problem.exposures):
        return (), "the axis sees nothing of the table's rate"
    if "angle" in effect.needs and (still := _without_motion(problem, effect)):
        return (), still
    own = [effect.blind(e.motion) for e in problem.exposures]
    late = effect.of_response and effect.part != "gain" and keeps_its_rate(problem)
    return (), UNCHANGED if late else own[0] if all(own) else ""


def keeps_its_rate(problem: Problem) -> bool:
    """Whether a table turns at one rate in each run, but for what an encoder may be wrong by."""
    rates = [e.motion.rate for e in problem.exposures]
    middles = [float(np.median(rate)) for rate in rates]
    off = (float(np.sqrt(np.mean((rate - at) ** 2))) for rate, at in zip(rates, middles, strict=True))
    return all(middles) and all(each < STEADY * abs(at) for each, at in zip(off, middles, strict=True))


def _is_richer(problem: Problem, term: Term) -> bool:
    """Whether a curve has more than one parameter for each `MEANS_EACH` fitted means."""
    return MEANS_EACH * term.size > int((~problem.bins.held_out).sum())


def _of_the_way(problem: Problem, effect: Effect) -> bool:
    """Whether an effect goes by how a point came about: the angle of a table that turns, a lag, a changing heat."""
    return effect.of_way or (problem.turns and bool({"angle", "rate_edges"} & set(effect.needs)))


def _fits_instrument(problem: Problem, effect: Effect) -> bool:
    if effect.of_force and problem.through_gravity:
        return True
    return ("accelerometer" if problem.unit == "m/s^2" else "gyro") in effect.instruments


def law_of_motion(effect: Effect) -> bool:
    """Whether an effect is a law of the rate or the angle: a gain, and what makes an output late, is a response."""
    return (effect.of_rate or "angle" in effect.needs) and not effect.of_response


def _missing(problem: Problem, effect: Effect) -> tuple[str, ...]:
    """Manifest channels that the effect needs and some run lacks."""
    fields = {need for e in problem.exposures for need in effect.missing(e.motion)}
    if effect.of_rate and not problem.turns:
        fields.add("rate")
    channels = {CHANNEL_OF.get(need.partition(".")[0], need) for need in fields}
    return tuple(sorted(channels))


def _without_motion(problem: Problem, effect: Effect) -> str:
    """Why what repeats with the table's angle cannot be seen: the arc is too short; empty where it is not.

    The noise of an encoder is no arc: of a table that stands the exposure has one angle.
    """
    angles = [e.motion.angle for e in problem.exposures if e.motion.angle is not None]
    arc = _arc(problem)
    if not any(np.ptp(a) for a in angles):
        return "the table does not turn, beyond the noise of its angle"
    order = getattr(effect, "order", None)
    if arc < LEAST_ARC or (order is not None and arc * order < QUARTER_WAVE):
        return f"the table turns by {np.rad2deg(arc):.2g} deg only"
    if _of_few_waves(problem, effect):
        return f"beside a reference that comes late: turns of {np.rad2deg(arc):.3g} deg are less than two waves of it"
    return ""


def _arc(problem: Problem) -> float:
    """From the least to the largest angle of the table [rad]."""
    angles = [e.motion.angle for e in problem.exposures if e.motion.angle is not None]
    return max(float(a.max()) for a in angles) - min(float(a.min()) for a in angles)


def turns_few_waves(problem: Problem, effect: Effect) -> bool:
    """Whether the table turns by less than two waves of an effect of its angle: a power of heat has an order too."""
    order = getattr(effect, "order", None)
    return order is not None and "angle" in effect.needs and _arc(problem) * order < TWO_WAVES


def _of_few_waves(problem: Problem, effect: Effect) -> bool:
    """The same beside a reference that comes late."""
    return turns_few_waves(problem, effect) and any(e.motion.lag for e in problem.exposures)


def of_few_waves(problem: Problem, catalogue: tuple[Effect, ...]) -> tuple[Candidate, ...]:
    """Effects of the table's angle that are not tried beside a reference that comes late, and would be beside another.

    Nobody has seen their wave come again, so none is named; that what is left follows one may be said.
    """
    if not problem.turns or any(e.motion.angle is None for e in problem.exposures) or disobeyed(problem):
        return ()
    tried = (e for e in catalogue if "angle" in e.needs and _fits_instrument(problem, e) and not e.generic)
    tried = (e for e in tried if not _missing(problem, e) and _of_few_waves(problem, e))
    tried = (e for e in tried if _arc(problem) * getattr(e, "order", 0) >= QUARTER_WAVE)
    found = (Candidate(e, _terms(problem, e)) for e in tried if not unmoved(problem, e))
    return tuple(one for one in found if one.terms)


def local_beside_lag(problem: Problem, catalogue: tuple[Effect, ...]) -> tuple[Candidate, ...]:
    """Faults at one rate, which are not tried beside a reference that comes late: it is wrong at some rates by chance.

    None is named there; but another law of the rate that such a fault explains as well may be one.
    """
    if disobeyed(problem):
        return ()
    tried = (
        e for e in catalogue if e.local and e.of_rate and _fits_instrument(problem, e) and not _missing(problem, e)
    )
    tried = (e for e in tried if all(e.blind(x.motion) for x in problem.exposures))
    return tuple(one for e in tried if (one := Candidate(e, _terms(problem, e))).terms)


def _terms(problem: Problem, effect: Effect) -> tuple[Term, ...]:
    """One term per shape; splines are first fitted to the ranges of the recording."""
    motions = [e.motion for e in problem.exposures]
    if isinstance(effect, Spline):
        return (Term(effect.over_all(motions)),)
    motion = _of_all_rates(problem, effect) or max(motions, key=lambda one: _shows(one, effect))
    if isinstance(effect, LinearEffect):
        each = effect.of_run and len({b.run for b in problem.fitted}) > 1
        return tuple(Term(form, per_run=each) for form in effect.variants(motion))
    assert isinstance(effect, CurveEffect)
    grid = effect.grid(motion)
    start, stop = _fitted_time(problem)
    for j, param in enumerate(effect.shapes):
        # What is over within less than its least credible time is an event at the start, or a filter.
        grid = grid[grid[:, j] >= param.low]
        if param.name == "tau":
            # Slower than the fitted data are long, an exponential is a ramp and its time constant a fiction.
            grid = grid[grid[:, j] <= stop - start]
        elif param.name == "t0":
            # A step at either end is a transient, or an outlier: the level beside it is not the instrument's.
            margin = END_SHARE * (stop - start)
            grid = grid[(grid[:, j] > start + margin) & (grid[:, j] < stop - margin)]
    shapes = [shape for row in grid.tolist() if not unseen(problem, effect, shape := tuple(row))]
    return tuple(Term(form, shape) for form in effect.variants(motion) for shape in shapes)


def _of_all_rates(problem: Problem, effect: Effect) -> Motion | None:
    """The rates of all runs as one motion, for a law of the rate alone: a table may run one in each file.

    None of another effect, or of one run.
    """
    law = isinstance(effect, CurveEffect) and not isinstance(effect, MemoryEffect)
    if not (law and effect.of_rate and not effect.of_time and len(problem.exposures) > 1):
        return None

    def made() -> Motion:
        rate = np.concatenate([e.motion.rate for e in problem.exposures], axis=-1)
        return Motion(t=problem.exposures[0].motion.dt * np.arange(rate.shape[-1] + 1.0), rate=rate)

    found: Motion = problem.remember("rates of all runs", made)  # asked once for each shape
    return found


def _shows(motion: Motion, effect: Effect) -> tuple[float, int]:
    """How far a run goes in what an effect depends on, and how long: its shapes are tried over the farthest range."""
    if effect.of_rate and not effect.of_time:
        return float(np.abs(motion.rate).max(initial=0.0)), motion.n
    if "temperature" in effect.needs and motion.temperature is not None:
        return float(np.ptp(motion.temperature)), motion.n
    return 0.0, motion.n


def unseen(problem: Problem, effect: Effect, shape: tuple[float, ...]) -> str:
    """Why no run shows the effect at a shape; empty where one does.

    A hold that is over within two means is a delay in them: what is held within one, only the samples know. Beside a
    reference that comes late nothing more is said: the largest rates are those of its noise and of its corners.
    """
    held = [value for param, value in zip(effect.shapes, shape, strict=True) if param.name == "hold"]
    if held and held[0] < HELD_MEANS * problem.bins.width:
        return "a hold that is over within two means is a delay in them"
    if any(e.motion.lag for e in problem.exposures):
        return ""
    together = _of_all_rates(problem, effect)
    motions = [e.motion for e in problem.exposures] if together is None else [together]
    reasons = [effect.unseen(motion, shape) for motion in motions]
    return reasons[0] if all(reasons) else ""


def _fitted_time(problem: Problem) -> tuple[float, float]:
    """First and last fitted bin of the run with the longest fitted time [s]."""
    time, run = problem.bins.time, problem.bins.run
    fitted = ~problem.bins.held_out
    spans = [time[fitted & (run == r)] for r in {b.run for b in problem.fitted}]
    longest = max(spans, key=lambda t: float(np.ptp(t)))
    return float(longest.min()), float(longest.max())


def stacked(problem: Problem, found: tuple[Candidate, ...]) -> list[Floats]:
    """Transformed regressors of each candidate on the fitted bins, shape (k, shapes, modes) each."""
    return [problem.remember(("stacked", c.effect.key), lambda c=c: stacked_terms(problem, c.terms)) for c in found]


def stacked_terms(problem: Problem, terms: tuple[Term, ...]) -> Floats:
    """The same of one effect at some shapes, shape (k, shapes, modes)."""
    columns = problem.transformed_together(terms)
    rows = np.empty((columns[0].shape[1], len(terms), len(columns[0])))
    for j, own in enumerate(columns):
        rows[:, j] = own.T
    return rows
