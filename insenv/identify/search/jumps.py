r"""Whether a step is one event that stands out, or one of the jumps that the noise makes.

A step of the bias is told once, and nothing later repeats it. Noise is taken for Gaussian, but that of real
instruments jumps to and fro, and a fit of one step takes the largest of its jumps. With a step c +- s at t0 in the
model, z(t) the deviate of a further step at t, and d the sizes of bursts and of settling that were left out:

    max |z(t)| < LIKE |c| / s    or no more than chance makes of it, for |t - t0| beyond `NEAR` of the record,
    |d| < LIKE |c|               but for fewer than `EVENTS` of them,
    m / c > STILL                with m the change of level that the later half of the held-out data still shows.

Of Gaussian noise the largest z(t) is about 3, and a step that is found has c / s of 6 and more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import chdtrc

from insenv.effects.base import Effect
from insenv.identify.clean.settling import only_time
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.heldout import residual
from insenv.identify.fit.problem import Problem
from insenv.identify.search.candidates import Candidate
from insenv.identify.search.scan import score

#: Share of a step's deviate that a further one may have by itself, and the probability of chance below which it counts.
LIKE, CHANCE = 0.6, 1e-2
#: Share of the record within which further steps are the same one.
NEAR = 0.05
#: Events of a step's size that show how the noise is.
EVENTS = 2
#: Share of the step that is still there later.
STILL = 0.5
#: Held-out bins, in the half of them that is asked, below which nothing is.
FEWEST = 3


def is_step(effect: Effect) -> bool:
    """Whether an effect is one event at one instant."""
    return effect.sudden and any(param.name == "t0" for param in effect.shapes)


def one_of_many(problem: Problem, large: Fit, candidate: Candidate, events: Sequence[float], seed: int = 0) -> str:
    """Why the last term of ``large`` is no single step; empty if it is one.

    Parameters
    ----------
    problem : Problem
    large : Fit
        With the step as its last term.
    candidate : Candidate
        The step, with the instants that are tried.
    events : sequence of float
        Sizes of bursts and of settling at the start that were left out of the target.
    seed : int
        Of the simulated noise.
    """
    own = np.flatnonzero(large.design.term == len(large.model) - 1)
    if len({b.run for b in problem.bins.blocks}) > 1 or not only_time(problem) or len(own) != 1:
        return ""
    size = float(large.theta[own[0]])
    alike = [abs(event) for event in events if abs(event) > LIKE * abs(size)]
    if len(alike) >= EVENTS:
        return f"{len(alike)} bursts of its size were left out of this channel: jumps of the noise, not one step"
    return _others(problem, large, candidate, seed) or _come_back(problem, large)


def _others(problem: Problem, large: Fit, candidate: Candidate, seed: int) -> str:
    """Why the step is not the only one; empty if it is."""
    own, at = int(np.flatnonzero(large.design.term == len(large.model) - 1)[0]), large.model[-1].shape[0]
    deviate = float(abs(large.theta[own]) / large.sd[own])
    scores = score(problem, large, (candidate,), seed)[0]
    instants = np.array([term.shape[0] for term in candidate.terms])
    beside = np.where(np.abs(instants - at) > NEAR * np.ptp(problem.bins.time), scores.q, 0.0)
    most = int(np.argmax(beside))
    if beside[most] < (LIKE * deviate) ** 2 or chdtrc(1, beside[most]) * scores.trials > CHANCE:
        return ""
    return (
        f"the level changes as much at other times ({np.sqrt(beside[most]):.2g} standard deviations at "
        f"{instants[most]:.4g} s, {deviate:.2g} at {at:.4g} s): jumps of the noise, not one step"
    )


def _come_back(problem: Problem, large: Fit) -> str:
    """Why the step does not last; empty if it does."""
    own, at = int(np.flatnonzero(large.design.term == len(large.model) - 1)[0]), large.model[-1].shape[0]
    later = np.flatnonzero(problem.bins.held_out & (problem.bins.time > at))
    later = later[len(later) // 2 :]
    if len(later) < FEWEST:
        return ""
    left = 1 + float(np.mean(residual(problem, large)[later]) / large.theta[own])
    if left >= STILL:
        return ""
    return f"the level has come back in the later half of the held-out data ({left:.0%} of the step is left)"
