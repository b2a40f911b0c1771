"""Columns that a problem hands on to one of other rows or other readings are those that it would make anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from fit_cases import problem_of, terms
from simulated_runs import gyro_run

from insenv.effects.catalogue import by_key
from insenv.identify.fit.bins import of_one_use
from insenv.identify.fit.problem import Problem, Term

#: Of the skew per run the fitted rows of a run that stands in them tell nothing: it has the mean of the others'.
MODEL = (
    *terms("bias", "scale_factor", "bias_drift"),
    *(Term(by_key(k), per_run=True) for k in ("bias", "timing_skew")),
)


def remembering() -> Problem:
    """Two runs of which one stands where it is fitted; all columns of the model are remembered."""
    moves, late = (gyro_run("sine", seed, duration=300.0, dt=0.1).recording for seed in (1, 2))
    start = int(0.7 * len(late))
    still = {n: replace(c, values=c.values[np.maximum(np.arange(len(late)), start)]) for n, c in late.channels.items()}
    problem, _ = problem_of(moves, replace(late, channels=still), averaging=1.0, samples=False)
    problem.transformed_together(MODEL)
    return problem


def same_as_anew(problem: Problem) -> None:
    anew = replace(problem, cache={})
    for term in MODEL:
        np.testing.assert_array_equal(problem.columns(term), anew.columns(term))
        np.testing.assert_allclose(problem.transformed(term), anew.transformed(term), rtol=1e-12, atol=1e-300)


def test_with_all_rows_fitted() -> None:
    problem = remembering()
    same_as_anew(problem.all_fitted())
    same_as_anew(problem.used_as(of_one_use(problem.bins).blocks))


def test_with_other_readings() -> None:
    problem = remembering()
    other = problem.measured_as(problem.y + 1.0)
    same_as_anew(other)
    assert np.ptp(other.data() - problem.data()) > 0
