"""What a lag leaves in the second order, and that a table that never changes its rate leaves nothing."""

from __future__ import annotations

import numpy as np
from fit_cases import problem_of, terms
from motions import edges

from insenv.core.recording import Channel, Floats, Recording
from insenv.identify.fit.gls import solve
from insenv.identify.fit.lag_form import second_order


def beside(rate: Floats, lag: float) -> tuple[Floats, Floats]:
    """Second order of a lag, and the times of the bins: a gyro that is late by ``lag`` [s] beside a commanded rate."""
    t = edges(4000, 0.05)[1:]
    y = np.interp(t - lag, t, rate) + 1e-5 * np.random.default_rng(1).standard_normal(len(t))
    channels = {"gyro": Channel(y, "rad/s"), "table_rate": Channel(rate, "rad/s", source="command")}
    problem, _ = problem_of(Recording(t, channels))
    return second_order(problem, solve(problem, terms("bias", "timing_skew"))), problem.bins.time


def test_of_a_table_at_one_rate_there_is_no_lag() -> None:
    """Its design has no skew: rests of a table were asked for one, and ended in an IndexError."""
    left, _ = beside(np.zeros(4000), 0.0)
    assert left.size == 0


def test_of_a_swing_it_is_its_second_derivative() -> None:
    w, lag = 2 * np.pi * 0.2, 0.1
    left, time = beside(np.sin(w * edges(4000, 0.05)[1:]), lag)
    wanted = -((w * lag) ** 2) * np.sin(w * time)
    inner = slice(10, -10)
    assert np.abs(left[inner, 0] - wanted[inner]).max() < 0.1 * np.abs(wanted).max()
