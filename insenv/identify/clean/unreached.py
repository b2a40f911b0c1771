"""Means whose reference was not recorded: beside a lag of c those within c of the start of a run, or of its end.

A table that turns when the recording begins had a past that nobody knows. To go on with its first rate is wrong by as
much as that changes in c: of a swing of 1 rad/s and 0.1 Hz beside 80 ms by 0.05 rad/s, hundreds of deviations of a
good gyro, which a few means then decide.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from insenv.identify.findings import RejectedRows
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.problem import Problem

#: Largest share of the means that are left out so, and change of the rate, in what is left, below which none are.
MOST, CHANGES = 0.05, 1.0


def unreached(problem: Problem, fit: Fit, skew: float) -> NDArray[np.bool_]:
    """Means of which the reference a ``skew`` earlier [s] was not recorded and may have been another, shape (n,).

    Parameters
    ----------
    problem : Problem
    fit : Fit
        With the skew.
    skew : float
        Negative where it is later.
    """
    bins = problem.bins
    ends = np.array([e.motion.dt * e.motion.n for e in problem.exposures])[bins.run]
    sooner = bins.time if skew > 0 else ends - bins.time
    gone = sooner - 0.5 * bins.width < abs(skew) * (1 - 1e-9)
    u = bins.mean(tuple(e.u for e in problem.exposures))
    scatter = CHANGES * float(np.std((problem.y - fit.predicted())[~bins.held_out & ~gone]))
    near = sooner < 2 * abs(skew) + bins.width
    for run in range(len(problem.exposures)):
        own = bins.run == run
        if not (own & near).any() or float(np.ptp(u[own & near])) < scatter:
            gone &= ~own
    few = 0 < np.count_nonzero(gone) <= MOST * len(gone)
    return gone if few else np.zeros(len(gone), bool)


def rows_of(problem: Problem, gone: NDArray[np.bool_], skew: float) -> tuple[RejectedRows, ...]:
    """The rows in such means, by runs."""
    why = f"what the table did {abs(skew):.2g} s {'earlier' if skew > 0 else 'later'} was not recorded"
    return tuple(
        RejectedRows(problem.target, run, int(rows[0]), int(rows[-1]) + 1, why)
        for run, rows in problem.rows_in(gone).items()
    )
