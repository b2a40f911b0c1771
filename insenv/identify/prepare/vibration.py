"""A unit at rest is judged on means that vibration no longer shapes.

Vibration, a filter of the instrument or repeated rows give the spectrum of short means a broad hump, beyond all lines.
No noise term has one: noise that must follow it becomes flicker, and flicker hides every drift. Nothing that is sought
at rest is as fast, so where there is a hump, once the lines are found, means are merged two by two,

    y_j = (y_2j + y_2j+1) / 2,        X_j = (X_2j + X_2j+1) / 2

which is exact: a mean of means is one of the samples. Lines that the longer means no longer resolve are subtracted.

A filter of the chip that leaves no hump beyond the noise terms is followed by them, and slower modes pay for that: of a
low pass at some hertz the slope is flicker to them, and flicker goes on to the slowest modes, where there is none. So
means are merged as well where the noise fitted to short ones does not foretell the long ones: with l the restricted
log likelihood of the long ones, 2 (l of noise fitted to them - l of that of the short ones) is chi-squared with as many
degrees of freedom as there are noise terms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.fft import rfft, rfftfreq
from scipy.ndimage import median_filter
from scipy.special import chdtrc, chdtri

from insenv.core.lazy import Lazy
from insenv.core.recording import Floats
from insenv.effects.base import Effect
from insenv.identify.fit.bins import FULL, at_places, merged
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.heldout import residual
from insenv.identify.fit.noise import fit_noise, loglik
from insenv.identify.fit.problem import NOISE_TERMS, Model, Problem, Term, pooled
from insenv.identify.prepare.binned import SPARE
from insenv.identify.prepare.excess import broad_p
from insenv.identify.prepare.spectral.lines import (
    BETWEEN,
    FALSE_ALARM,
    SAME_LINE,
    WIDEST,
    Line,
    heights,
    periodogram,
    with_others,
)
from insenv.identify.prepare.spectral.wandering import FEWEST_CYCLES

#: P-value of a hump from which on means are merged; fitted means that must be left, and the longest ones [s].
HUMP, FEWEST, LONGEST = 1e-3, 80, 5.0
#: Parts of a held-out stretch, and how far their means may be away beside the scatter from mean to mean.
PARTS, AWAY = 5, 3.0
#: Frequency in bins up to which they resolve a line.
RESOLVED = 0.45
#: Share of its frequency by which a line moves whose phase does not hold.
MOVES = 0.02
#: Deviations of a line's frequency within which it is one that is known: half of a hump is no other line.
APART = 2.0
#: Share of the samples' variance from which a line that longer means leave out is told.
LEAST_SHARE = 0.01
#: Share of the data that whole means must leave.
LEFT = 0.5
#: Stretches over which a spectrum is averaged, fewest means in each, and how far above what is beside it vibration is
#: told; chance that noise is.
STRETCHES, IN_EACH, LOUD, CHANCE = 16, 32, 4.0, 1e-3
#: What only a unit that moves is exposed to.
MOTION = ("force", "cross_rate")


def doublings(problem: Problem, fit: Fit, tried: tuple[Effect, ...]) -> int:
    """How often the means of a unit at rest are to be merged two by two; 0 where they show no hump, or the unit moves.

    Its tail is flicker to the noise long after it can be told from any, so that as few means are left as tell a drift
    from a walk. Among the effects ``tried`` are some of motion where the unit moves.
    """
    moves = problem.turns
    if moves or any(need.partition(".")[0] in MOTION for effect in tried for need in effect.needs):
        return 0
    fitted, width = sum(b.n for b in problem.fitted), problem.bins.width
    times = max(0, int(np.log2(min(fitted / FEWEST, LONGEST / width))))
    if not times or (broad_p(problem, fit) >= HUMP and _foretold_p(problem, fit, times) >= HUMP):
        return 0
    return times


def affordable(problem: Problem, model: Model, times: int) -> int:
    """How often, ``times`` at most, means can be merged that the declared ``model`` and the noise can still be fitted.

    Axes of a unit share one averaging, and rows that are lost leave one of them fewer long means than another.
    """
    wanted = sum(len(problem.names(term)) for term in model) + SPARE
    while times and sum(b.n for b in averaged(problem, times).fitted) < wanted:
        times -= 1
    return times


def _foretold_p(problem: Problem, fit: Fit, times: int) -> float:
    """Probability that the noise of means so many times doubled differs by so much from that fitted to short ones."""
    products, prior = pooled(averaged(problem, times), fit.model)
    free = fit_noise(products, prior, restricted=True, start=fit.noise.power)
    foretold, _ = loglik(products, fit.noise.power, prior, restricted=True)
    return float(chdtrc(len(NOISE_TERMS), max(0.0, 2 * (free.loglik - foretold))))


def averaged(problem: Problem, times: int) -> Problem:
    """The problem with its means merged two by two so many times.

    Where rows are lost here and there hardly a long mean is whole: of one row in ten, one mean over thirty in
    twenty-five. Where less than half of the data would be left, means over what is there are made.
    """
    whole = _merged(problem, times, 1.0)
    return whole if whole.bins.n * 2**times >= LEFT * problem.bins.n else _merged(problem, times, FULL)


def unresolved(term: Term, width: float) -> bool:
    """Whether a term is a line that means over ``width`` do not resolve."""
    return term.effect.line and term.shape[0] * width > RESOLVED


def is_folded(term: Term, frequencies: tuple[float, ...], width: float) -> bool:
    """Whether a line of means over ``width`` is what they make of a faster one that is not subtracted.

    Means taken every ``width`` cannot tell f from |f - k / width|; a line whose phase does not hold, a motor's, moves
    by some of its frequency.
    """
    if not term.effect.line:
        return False
    found = term.shape[0]
    return any(abs(abs(f - round(f * width) / width) - found) < MOVES * f for f in frequencies)


def unnamed(problem: Problem, lines: tuple[Line, ...], known: tuple[float, ...]) -> tuple[Line, ...]:
    """Lines of the samples at none of the ``known`` frequencies, fast enough for the band in which they wander.

    A motor's line wanders: in short means, which follow it, no wave stands for it, and longer ones have none of it.
    """
    longest = max((b.stop - b.start) * problem.bins.width for b in problem.fitted)
    return tuple(
        replace(line, averaged=True)
        for line in lines
        if line.share > LEAST_SHARE
        and line.frequency > max(FEWEST_CYCLES / longest, SAME_LINE / WIDEST)
        and not any(abs(line.frequency - f) < max(SAME_LINE, APART * line.frequency_sd) for f in known)
    )


def stands_out(problem: Problem, fit: Fit, term: Term) -> bool:
    """Whether a line of the fit stands out of the noise beside it, and is no peak of a hump.

    By the fitted rows alone, or by these and the held-out ones, by which it was named, together.
    """
    mine = fit.design.term == fit.model.index(term)
    block, later = (max(blocks, key=lambda b: b.n) for blocks in (problem.fitted, problem.held_out))
    left = residual(problem, fit) + fit.design.matrix[:, mine] @ fit.beta[mine]
    values, others = (at_places(left[b.start : b.stop], problem.bins.places(b)) for b in (block, later))
    width = problem.bins.width
    found = periodogram(values, width)
    near = np.abs(found.f - term.shape[0]) <= 1.5 / (len(values) * width)
    height = with_others(found, heights(values, found), width, others)
    return float(height[near].max(initial=0.0)) > np.log(BETWEEN * block.n / 2 / FALSE_ALARM)


def without(problem: Problem, fit: Fit, lines: Model) -> Problem:
    """The problem less some lines of the fit."""
    gone = [k for k, t in enumerate(fit.model) if t in lines]
    if not gone:
        return problem
    mine = np.isin(fit.design.term, gone)
    return problem.measured_as(problem.y - fit.design.matrix[:, mine] @ fit.beta[mine])


def as_lines(problem: Problem, fit: Fit, term: Term, frequency_sd: float, p_value: float) -> tuple[Line, ...]:
    """A line of the means as one of the samples, from which it is taken: one for each run that has it."""
    own = np.flatnonzero(fit.design.term == fit.model.index(term))
    lines, frequency = [], term.shape[0]
    for run, exposure in enumerate(problem.exposures):
        named = {fit.design.labels[j][1]: j for j in own}
        suffix = f"[{run + 1}]" if f"c[{run + 1}]" in named or f"s[{run + 1}]" in named else ""
        c, s = (float(fit.theta[named[n + suffix]]) if n + suffix in named else 0.0 for n in ("c", "s"))
        sd = max((float(fit.sd[named[n + suffix]]) for n in ("c", "s") if n + suffix in named), default=0.0)
        amplitude = float(np.hypot(c, s))
        if amplitude <= 0:
            continue
        # The motion's clock begins half a row before the first one.
        begin = np.pi * frequency * exposure.motion.dt / max(int(exposure.count.max(initial=1)), 1)
        phase = float(np.angle(np.exp(1j * (begin - np.arctan2(s, c)))))
        share = min(1.0, 0.5 * amplitude**2 / max(float(np.var(exposure.y[exposure.count > 0])), 1e-300))
        lines.append(Line(run, frequency, frequency_sd, amplitude, sd, phase, True, share, p_value))
    return tuple(lines)


def loudest(problem: Problem, fit: Fit, width: float) -> float:
    """Frequency of the loudest vibration that means over ``width`` no longer resolve [Hz]; 0 where none stands out.

    No line need hold: the spectrum of what the fit leaves is averaged over stretches of the longest fitted block.
    """
    block = max(problem.fitted, key=lambda b: b.n)
    n = block.n // STRETCHES
    if n < IN_EACH:
        return 0.0
    left = residual(problem, fit)[block.start : block.start + STRETCHES * n].reshape(STRETCHES, n)
    window = np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2
    power = np.mean(np.abs(rfft((left - left.mean(axis=1, keepdims=True)) * window)) ** 2, axis=0)
    f = rfftfreq(n, problem.bins.width)
    beside = np.maximum(median_filter(power, max(n // 8, 9), mode="nearest"), 1e-300)  # none where readings stand still
    above = np.where(f * width > RESOLVED, power / beside, 0.0)
    peak = int(np.argmax(above))
    chance = chdtri(2 * STRETCHES, CHANCE / len(f)) / (2 * STRETCHES)
    return float(f[peak]) if above[peak] > max(LOUD, chance) else 0.0


def went_away(problem: Problem, fit: Fit) -> tuple[str, ...]:
    """A reason where the bias of held-out data is elsewhere than it was fitted, though a walk would explain that.

    In a record that vibration made short, a law of time and a random walk look alike: that noise explains it does not
    make it nothing. Means over parts of a held-out stretch are compared with what the scatter from mean to mean leaves.
    """
    left, most = residual(problem, fit), 0.0
    for block in problem.held_out:
        each = max(block.n // PARTS, 1)
        whole = block.n // each
        if whole < PARTS:
            continue
        x = left[block.start : block.start + whole * each]
        white = float(np.sqrt(0.5 * np.mean(np.diff(x) ** 2) / each))
        away = float(np.sqrt(np.mean(x.reshape(whole, each).mean(axis=1) ** 2)))
        most = max(most, away / max(white, 1e-300))
    if most < AWAY:
        return ()
    # A reading that stands still scatters by nothing.
    times = f"{most:.2g}" if most < 1000 else "more than 1000"
    return (
        f"on held-out data the bias is {times} times as far from where it was fitted as noise from one mean to the "
        "next would leave it: a drift, a warm-up or a random walk, which this record does not tell apart",
    )


def _merged(problem: Problem, times: int, least: float) -> Problem:
    """The problem with its means merged two by two so many times; each has the share ``least`` of its cells."""
    for _ in range(times):
        n, (bins, pairs) = problem.bins.n, merged(problem.bins, least)
        inside = np.isin(pairs, np.array(problem.outliers, int)).any(axis=1)
        outliers = tuple(int(i) for i in np.flatnonzero(inside))
        steps = Lazy(partial(_merged_errors, problem.steps, n, pairs)) if problem.encoder else problem.steps
        y = problem.y[pairs].mean(axis=1)
        problem = replace(problem, bins=bins, y=y, outliers=outliers, steps=steps, cache={})
    return problem


def _merged_errors(steps: Callable[[], Floats | None], n: int, pairs: NDArray[np.int64]) -> Floats | None:
    errors = steps()
    return None if errors is None or errors.shape[1] != n else np.asarray(errors[:, pairs].mean(axis=2))
