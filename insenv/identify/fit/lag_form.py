r"""What a lag of unknown form leaves in the second order, and how much less certain it makes the other parameters.

A time shift of c is known in the first order alone. A pure delay leaves the size of a swing as it is; a filter, a servo
or a mean over some rows that comes as late does not: of mean delay c and spread s its gain at the frequency f is

    |H| = 1 - s^2 (2 pi f)^2 / 2,      s^2 = 0 a delay, c^2 / 3 a mean, c^2 a first-order lag,
                                       c^2 (1 - 1 / (2 z^2)) a servo of damping z, -0.4 c^2 at 0.6

so that u(t - c) + u(t + c) - 2 u(t), about c^2 u'', stands beside the model with a coefficient s^2 / (2 c^2). Where a
table swings at one frequency that is a scale factor, and nothing in the data tells them apart: with B the column and
N(0, a^2) its coefficient before the data were seen, v after, and b its likeliest value, the variance of parameter j
grows by G_j^2 (v + b^2), G = (X'X)^-1 X'B.
"""

from __future__ import annotations

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.timing import TimingSkew
from insenv.identify.fit.gls import Fit, spectrum, whitened_rows
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import Problem, Term

#: Standard deviation of the coefficient: a first-order lag has 1/2, a mean 1/6, a servo of damping 0.6 has -0.2.
FORM = 0.25


def second_order(problem: Problem, fit: Fit) -> Floats:
    """What a lag of c leaves in the second order, u(t - c) + u(t + c) - 2 u(t), shape (bins, k); none without a lag."""
    # Where the rate never changes a design has no skew.
    skew = sum(float(fit.theta[fit.design.term == i].sum()) for i, t in enumerate(fit.model) if is_skew(t))
    lag = max(abs(skew), *(abs(e.motion.lag) for e in problem.exposures))
    if not lag:
        return np.zeros((len(problem.y), 0))
    return problem.bins.mean(tuple(_second_difference(e.u, e.motion, lag)[:, None] for e in problem.exposures))


def is_skew(term: Term) -> bool:
    """Whether a term is one time shift of all runs."""
    return isinstance(term.effect, TimingSkew) and not term.per_run


def added_variance(problem: Problem, fit: Fit) -> Floats:
    """What the variance of each scaled coefficient of ``fit`` grows by for the form of its lag, shape (p,).

    That of the lag itself does not: it is the mean delay, whatever the form.
    """
    column = second_order(problem, fit)
    rows, data = whitened_rows(problem, fit.design, fit.noise.power)
    if not column.any() or not rows.shape[1]:
        return np.zeros(rows.shape[1])
    white = transform(problem.fitted, column)[:, 0] / np.sqrt(spectrum(problem, fit.noise.power))
    own = np.append(white, np.zeros(rows.shape[1]))
    q, upper = np.linalg.qr(rows)
    gain = np.linalg.solve(upper, q.T @ own)
    beside = own - q @ (q.T @ own)
    variance = 1 / (1 / FORM**2 + float(beside @ beside))
    size = variance * float(beside @ data)
    of_lag = [j >= 0 and is_skew(fit.model[j]) for j in fit.design.term]
    return np.where(of_lag, 0.0, gain**2 * (variance + size**2))


def _second_difference(u: Floats, motion: Motion, lag: float) -> Floats:
    at = motion.middle
    return np.interp(at - lag, at, u) + np.interp(at + lag, at, u) - 2 * u
