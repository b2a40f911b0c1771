"""What is over soon after the start of the only fitted run: settling, an event and no law.

A jump in the first tenth of a recording may be a step, or a touch, a spring or a filter that settles: nothing after it
tells which, and nothing later confirms it. Its rows are left out, and it is named so.
"""

from __future__ import annotations

import numpy as np

from insenv.identify.clean.bursts import KELVINS
from insenv.identify.findings import RejectedRows
from insenv.identify.fit.problem import Problem, Term

#: Share of the fitted time within which what settles is over, and the share of its range that may then be left.
OVER, LEFT = 0.15, 0.05


def only_time(problem: Problem) -> bool:
    """Whether nothing but time is at work: no table turns, and the temperature is not driven."""
    turns = problem.turns
    kelvins = [e.motion.temperature for e in problem.exposures if e.motion.temperature is not None]
    return not turns and all(float(np.ptp(k)) < KELVINS for k in kelvins)


def settled_by(problem: Problem, term: Term) -> float | None:
    """When a ``term`` that one event looks like is over [s], if that is soon after the start; else None."""
    if not term.effect.sudden or len({b.run for b in problem.fitted}) > 1 or not only_time(problem):
        return None
    rows = np.concatenate([np.arange(b.start, b.stop) for b in problem.fitted])
    curve, time = problem.columns(term)[rows, 0], problem.bins.time[rows]
    still = np.flatnonzero(np.abs(curve - curve[-1]) > LEFT * np.ptp(curve))
    if not len(still) or time[still[-1]] - time[0] > OVER * np.ptp(time):
        return None
    return float(time[still[-1]] + 0.5 * problem.bins.width)


def without_start(problem: Problem, until: float, size: float) -> tuple[Problem, RejectedRows]:
    """The problem without the fitted bins before ``until`` [s], and the rows in them."""
    run = problem.fitted[0].run
    gone = (problem.bins.run == run) & (problem.bins.time < until) & ~problem.bins.held_out
    rows = problem.rows_in(gone)[run]
    said = RejectedRows(problem.target, run, int(rows[0]), int(rows[-1]) + 1, "settling at the start", "burst", size)
    return problem.without_bins(gone), said
