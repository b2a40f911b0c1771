"""Error on data that no fit saw.

Everything is frozen at the fit's values, but for the level and the scale factor of a run that had no fitted data at all
where the bias is per run: they change from one power-up to the next, and that change is not what a model can foretell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from insenv.core.recording import Floats
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.noise import eigenvalues, transform
from insenv.identify.fit.problem import Problem

#: Share by which the held-out error may grow by chance, through a level that is now estimated a little differently.
CHANCE = 0.01
#: Share by which it may grow at most, where slow wander dominates it and the whitened error gets better.
MOST_GROWTH = 0.02
#: Scatter of held-out data, in that of the fitted noise, from which on their noise is another one.
UNFORETOLD = 3.0


@dataclass(frozen=True)
class Score:
    """How a fit does on held-out bins: root mean square, noise floor, and the whitened sum of squares.

    ``scatter`` is the root mean square about the level of each block, as the fitted noise has it in ``floor``; in
    ``foretold`` is what the coefficients' uncertainty adds, where a law is carried on beyond what was fitted.
    """

    rms: float
    floor: float
    whitened: float
    scatter: float
    foretold: float

    @property
    def unforetold(self) -> bool:
        """Whether held-out data scatter as no noise of the fitted data does."""
        return self.scatter > UNFORETOLD * self.foretold > 0


def residual(problem: Problem, fit: Fit) -> Floats:
    """Measured minus model over all bins, shape (bins,)."""
    left = problem.y - fit.predicted()
    if any(term.effect.part == "level" and term.per_run for term in fit.model):
        fitted_runs = {b.run for b in problem.fitted}
        own = [np.ones((problem.bins.n, 1)), *(problem.columns(t) for t in fit.model if t.effect.part == "gain")]
        columns = np.column_stack([c.sum(axis=1) for c in own])
        for run in set(problem.bins.run.tolist()) - fitted_runs:
            rows = problem.bins.run == run
            left[rows] -= columns[rows] @ np.linalg.lstsq(columns[rows], left[rows], rcond=None)[0]
    return left


def held_out_score(problem: Problem, fit: Fit) -> Score:
    """Score of a fit on the held-out bins."""
    left = residual(problem, fit)
    variance = problem.held_out_modes().shapes @ fit.noise.power
    modes = transform(problem.held_out, left) ** 2
    # The level of a block is what the noise wandered since the fit, not its scatter: no part of the floor. A block of
    # one mean has nothing else.
    alone = np.concatenate([np.full(block.n, block.n == 1) for block in problem.held_out])
    moves = (eigenvalues(problem.held_out) > 0) | alone

    def scatter(of_modes: Floats) -> float:
        return float(np.sqrt(np.mean(np.where(moves, of_modes, 0.0))))

    rms = float(np.sqrt(np.mean(left[problem.bins.held_out] ** 2)))
    floor = scatter(variance)
    foretold = float(np.hypot(floor, scatter(_uncertain(problem, fit))))
    return Score(rms, floor, float(np.sum(modes / variance)), scatter(modes), foretold)


def _uncertain(problem: Problem, fit: Fit) -> Floats:
    """Variance of the held-out modes by the covariance of the coefficients, shape (modes,); none of what is per run."""
    own = np.array([k >= 0 and not fit.model[k].per_run for k in fit.design.term], bool)
    columns = transform(problem.held_out, fit.design.matrix[:, own])
    return np.asarray(np.einsum("mi,ij,mj->m", columns, fit.cov[np.ix_(own, own)], columns))


def confirms(before: Score, after: Score, by_noise_of: Score) -> bool:
    """Whether held-out data do not speak against a change: refused where both measures get worse, or one much worse.

    The plain mean square is what a user sees; the whitened one, with one and the same noise for both models
    (``by_noise_of`` is the smaller model scored with the larger one's noise), is not drowned by slow wander. An effect
    that lives in the fitted data alone (a warm-up, an early step) leaves both unchanged but for chance: `CHANCE`.
    """
    if after.rms <= before.rms * (1 + CHANCE):
        return True
    return after.rms <= before.rms * (1 + MOST_GROWTH) and after.whitened <= by_noise_of.whitened


def rescored(problem: Problem, fit: Fit, power: Floats) -> Score:
    """Score of a fit with other noise powers."""
    return held_out_score(problem, replace(fit, noise=replace(fit.noise, power=power)))
