r"""How much less certain coefficients are for the rounding of a reading that its noise does not blur.

All rows at one rate have one error e_l of root mean square m (`insenv.core.series.coarse`), whatever their number. With
w the weights of the coefficients over the bins, their covariance grows by

    m^2 sum_l w_l w_l',      w_l = sum of w over the bins at the rate l,

where rates are one that differ by less than an eighth of a step.

The steps of the table's angle are an error of the reference that follows the motion: lines at a steady rate, the same
in every swing of a table that swings evenly. What they make of the coefficients is tried, the encoder's zero elsewhere
in a step each time (`Problem.steps`).
"""

from __future__ import annotations

import numpy as np
from scipy.fft import idct

from insenv.core.recording import Floats
from insenv.identify.fit.gls import Fit, spectrum
from insenv.identify.fit.problem import Problem

#: Parts of a step within which rates have one error.
ONE_RATE = 8.0


def added_covariance(problem: Problem, fit: Fit) -> Floats:
    """What the covariance of the scaled coefficients grows by, shape (p, p); zero where noise blurs the rounding."""
    p = len(fit.beta)
    if problem.coarse is None:
        return np.zeros((p, p))
    weights = fit.cov @ (fit.design.transformed / spectrum(problem, fit.noise.power)[:, None]).T
    u = problem.bins.mean(tuple(e.u for e in problem.exposures))
    level = np.unique(np.rint(u * ONE_RATE / problem.coarse.step), return_inverse=True)[1]
    sums, offset = np.zeros((p, int(level.max()) + 1)), 0
    for block in problem.fitted:
        in_time = idct(weights[:, offset : offset + block.n], type=2, norm="ortho", axis=1)
        offset += block.n
        for row, values in zip(sums, in_time, strict=True):
            row += np.bincount(level[block.start : block.stop], values, len(row))
    return np.asarray(problem.coarse.rms**2 * sums @ sums.T)


def by_steps(problem: Problem, fit: Fit) -> Floats | None:
    """Scaled coefficients that the steps of the table's angle would make, shape (p, draws); None where not known."""
    errors = problem.step_errors()
    if errors is None:
        return None
    weights = fit.cov @ (fit.design.transformed / spectrum(problem, fit.noise.power)[:, None]).T
    made, offset = np.zeros((len(fit.beta), len(errors))), 0
    for block in problem.fitted:
        in_time = idct(weights[:, offset : offset + block.n], type=2, norm="ortho", axis=1)
        offset += block.n
        made += in_time @ errors[:, block.start : block.stop].T
    return made
