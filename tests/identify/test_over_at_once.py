"""A course of time that is over within the least credible time constant is an event, and heat that is over is none.

Generated with NumPy; the seed is fixed. The warm-ups have 30 standard deviations and more.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import FITTED, gyro_run, manifest, use

from insenv.effects.catalogue import by_key
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Problem, Term
from insenv.identify.prepare.problems import prepare
from insenv.identify.search.round import no_law
from insenv.identify.search.scan import reference


@pytest.fixture(scope="module")
def problem() -> Problem:
    run = gyro_run("sine", 7, duration=300.0, noise={"angle_random_walk": 1e-5})
    uses = (use(len(run.recording), FITTED),)
    return prepare(manifest(averaging=0.2), (run.recording,), uses, "gyro", holds=False).problem


@pytest.mark.parametrize("key", ["bias_warm_up", "scale_factor_warm_up"])
@pytest.mark.parametrize(("tau", "event"), [(0.5, True), (0.502, True), (3.0, False), (100.0, False)])
def test_a_warm_up_at_the_least_credible_time_is_an_event(problem: Problem, key: str, tau: float, event: bool) -> None:
    term, declared = Term(by_key(key), (tau,)), (Term(by_key("bias")), Term(by_key("scale_factor")))
    rng = np.random.default_rng(1)
    y = 3e-3 * problem.columns(term)[:, 0] + 2e-5 * rng.standard_normal(problem.bins.n)
    warm = replace(problem, y=y, cache={})
    fit = solve(warm, declared)
    base = reference(warm, fit.model, fit.noise.power)
    why = no_law(warm, fit, base, solve(warm, (*declared, term), start=fit.noise.power))
    assert ("an event" in why) is event


@pytest.mark.parametrize(("tau", "over"), [(0.5, True), (0.502, True), (3.0, False), (50.0, False)])
def test_heat_that_is_over_at_once_is_no_memory(problem: Problem, tau: float, over: bool) -> None:
    """It is the rate's own law, or what a lag of the reference leaves."""
    term, declared = Term(by_key("self_heating"), (tau,)), (Term(by_key("bias")), Term(by_key("scale_factor")))
    rng = np.random.default_rng(2)
    column = problem.columns(term)[:, 0]
    y = 1e-3 * column / np.abs(column).max() + 2e-5 * rng.standard_normal(problem.bins.n)
    hot = replace(problem, y=y, cache={})
    fit = solve(hot, declared)
    base = reference(hot, fit.model, fit.noise.power)
    why = no_law(hot, fit, base, solve(hot, (*declared, term), start=fit.noise.power))
    assert ("no memory" in why) is over
