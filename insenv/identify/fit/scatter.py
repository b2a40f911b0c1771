r"""Whether estimates of one thing scatter more than their deviations say, and what their mean is worth then.

    w_k = 1 / s_k^2,      g = sum w_k g_k / sum w_k,      Q = sum w_k (g_k - g)^2  ~  chi^2_{K-1} by chance
    t^2 = max(0, (Q - (K - 1)) / (sum w - sum w^2 / sum w))      variance between them, beyond chance
    z = |sum v_k g_k| / sqrt(sum v_k),      v_k = 1 / (s_k^2 + t^2)

and the same with a covariance in the place of s_k^2 where their errors have one.

Of a model with one bias for several runs, each at rest, at one rate or at one temperature, a run is one number, its
level:

    l_r = x_r' theta + d_r + e_r,        var e_r = v_r by the noise within the run,        var d_r = s^2

How exact noise makes a level says little about how well it comes back: the bias of a power-up, a table's rate, how the
unit was set down. Beside p columns of the model s^2 is what makes sum of r^2 / (v + s^2) the n - p that it should be.

Sources: R. DerSimonian and N. Laird, Meta-analysis in clinical trials, Controlled Clinical Trials 7 (1986) 177; R. C.
Paule and J. Mandel, J. Res. Natl. Bur. Stand. 87 (1982) 377 (s^2 of levels).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import chdtrc, fdtrc

from insenv.core.recording import Floats
from insenv.effects.bias import Bias
from insenv.identify.fit.bins import of_one_use
from insenv.identify.fit.gls import Fit, solve
from insenv.identify.fit.problem import NOTHING, Model, Problem, Term

#: Share of the weights that is nothing: one estimate tells it all.
ROUNDING = 1e-12
#: A level of each run.
ANEW = Term(Bias(), per_run=True)
#: Share of all rates within which those of a run are one, and share of a column's root mean square that its means over
#: runs must have, to be one that levels tell: what changes within the runs they tell.
ONE_RATE, SHOWN = 0.02, 0.5
#: Share of the range of the temperature over all runs within which that of a run is one.
ONE_TEMPERATURE = 0.25
#: Share of the largest reading to which a level is known at best.
EXACT = 1e-9


@dataclass(frozen=True)
class Scatter:
    """Chance of such a scatter, the variance ``between`` the estimates, and the deviate of their mean beside it."""

    chance: float
    between: float
    deviate: float


def scatter(values: Floats, deviations: Floats) -> Scatter:
    """How K independent estimates with their standard deviations scatter, shapes (K,)."""
    return scatter_of_correlated(values, np.diag(deviations**2))


def scatter_of_correlated(values: Floats, covariance: Floats) -> Scatter:
    """How K estimates scatter, shape (K,), whose errors have a covariance, shape (K, K).

    With W = C^-1 and j a column of ones, m = j'W g / j'W j, Q = (g - m)' W (g - m), and what t^2 adds to Q is t^2 times
    tr W - j'W W j / j'W j.
    """
    if not (np.all(np.isfinite(covariance)) and np.all(np.isfinite(values)) and np.all(np.diag(covariance) > 0)):
        return Scatter(1.0, 0.0, 0.0)
    weights = _weights(covariance)
    each = weights.sum(axis=0)
    off, free = values - values @ each / each.sum(), len(values) - 1
    q = float(off @ weights @ off)
    room = float(np.trace(weights) - each @ each / each.sum())
    between = max(0.0, (q - free) / room) if room > ROUNDING * float(np.trace(weights)) else 0.0
    v = _weights(covariance + between * np.eye(len(values))).sum(axis=0)
    # Errors that are nearly one and the same leave a sum of weights of rounding alone: no mean is told.
    deviate = float(abs(values @ v) / np.sqrt(v.sum())) if v.sum() > 0 else 0.0
    return Scatter(float(chdtrc(free, q)), between, deviate)


def _weights(covariance: Floats) -> Floats:
    """C^-1, by way of the correlations: deviations may be far apart."""
    scale = np.sqrt(np.diag(covariance))
    both = np.outer(scale, scale)
    return np.asarray(np.linalg.pinv(covariance / both, hermitian=True) / both)


@dataclass(frozen=True)
class Levels:
    """Levels of n runs beside a model of p columns that they tell.

    ``left`` is what the model leaves of each, with the standard deviation ``sd`` by the noise within the run, shapes
    (n,); ``columns`` are the model's means over each run, shape (n, p); ``run`` are their numbers, from 0, for a run
    may have lost all its bins.
    """

    left: Floats
    sd: Floats
    columns: Floats
    run: NDArray[np.int64]

    @property
    def free(self) -> int:
        """Degrees of freedom of what the columns leave."""
        return len(self.left) - self.columns.shape[1]

    @property
    def chance(self) -> float:
        """Probability that noise within the runs leaves as much beside the columns; 1 where nothing can be left."""
        return 1.0 if self.free <= 0 else float(chdtrc(self.free, self.scatter))

    @property
    def scatter(self) -> float:
        """What the columns leave, in sum of squares of its deviations by the noise within the runs."""
        return left_of(self.left / self.sd, self.columns / self.sd[:, None])

    @property
    def between(self) -> float:
        """Variance between runs with which what the columns leave is as large as it should be."""

        def excess(between: float) -> float:
            root = np.sqrt(self.sd**2 + between)
            return left_of(self.left / root, self.columns / root[:, None]) - self.free

        most = float(np.sum(self.left**2))
        return float(brentq(excess, 0.0, most)) if self.free > 0 and excess(0.0) > 0 > excess(most) else 0.0

    def of(self, some: NDArray[np.bool_]) -> Levels:
        """Those of some runs, shape (n,)."""
        return Levels(self.left[some], self.sd[some], self.columns[some], self.run[some])


def levels(problem: Problem, fit: Fit) -> Levels:
    """What is left of each run by all its rows beside a model, the noise fitted anew within the runs."""
    left = problem.measured_as(problem.y - fit.predicted()).used_as(of_one_use(problem.bins).blocks)
    value, sd, run = of_each_run(solve(left, (ANEW,)), 0)
    exact = EXACT * max(float(np.abs(problem.y).max(initial=0.0)), NOTHING)  # readings that stand still have no noise
    return Levels(value, np.maximum(sd, exact), told_between(problem, fit)[run], run)


def of_each_run(fit: Fit, index: int) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Coefficients of a term that is free in each of several runs, their deviations, and their runs, (n,) each."""
    own = np.flatnonzero(fit.design.term == index)
    run = np.array([int(fit.design.labels[j][1].partition("[")[2].rstrip("]")) - 1 for j in own])
    return fit.theta[own], fit.sd[own], run


def left_of(values: Floats, columns: Floats) -> float:
    """Sum of squares that columns leave of values, shapes (n,) and (n, p)."""
    return float(np.sum((values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0]) ** 2))


def chance_of_columns(values: Floats, columns: Floats, without: int) -> float:
    """Probability that columns beyond the first ``without`` explain as much of values by chance, (n,) and (n, p).

    Fisher's F = ((S_0 - S_1) / k) / (S_1 / (n - p)) of the sums of squares without and with these k.
    """
    more, free = columns.shape[1] - without, len(values) - columns.shape[1]
    if more <= 0 or free <= 0:
        return 1.0
    whole, rest = left_of(values, columns[:, :without]), left_of(values, columns)
    return float(fdtrc(more, free, (whole - rest) / more / (rest / free))) if rest else float(not whole)


def has_one_level(problem: Problem, model: Model) -> bool:
    """Whether several runs, each at rest, at one rate or at one temperature, have one bias for all in a model."""
    common = any(term.effect == ANEW.effect and not term.per_run for term in model)
    return len(problem.exposures) > 1 and common and (_steady(problem) or at_one_temperature(problem))


def _steady(problem: Problem) -> bool:
    """Whether each run is at one rate."""
    if not problem.turns:
        return True
    rates = [e.u for e in problem.exposures]
    return max(float(np.ptp(u)) for u in rates) < ONE_RATE * float(np.ptp([float(np.mean(u)) for u in rates]))


def at_one_temperature(problem: Problem) -> bool:
    """Whether the temperature hardly changes within each of several runs, and differs between them."""
    heat = problem.heat()
    if heat is None or len(problem.exposures) < 2:
        return False
    return apart_in_temperature([heat[problem.bins.run == run] for run in np.unique(problem.bins.run)]) > 0


def apart_in_temperature(heats: Sequence[Floats]) -> float:
    """How far the temperatures of runs are apart [K], if each hardly changes within its run; else 0."""
    between = float(np.ptp([float(np.median(heat)) for heat in heats]))
    within = max(float(np.ptp(np.quantile(heat, (0.05, 0.95)))) for heat in heats)
    return between if within < ONE_TEMPERATURE * between else 0.0


def told_between(problem: Problem, fit: Fit) -> Floats:
    """Means over the bins of each run of the columns of a model that the levels tell, shape (runs, p).

    Those of a run that has none are nothing.
    """
    means = means_of_runs(problem, fit.design.matrix[:, fit.design.term >= 0])
    return means[:, np.sqrt(np.mean(means**2, axis=0)) > SHOWN]


def means_of_runs(problem: Problem, columns: Floats) -> Floats:
    """Means of columns over the bins of each run, shape (runs, k); zero where a run has none."""
    run = problem.bins.run
    own = [columns[run == r] for r in range(len(problem.exposures))]
    return np.array([each.mean(axis=0) if len(each) else np.zeros(columns.shape[1]) for each in own])
