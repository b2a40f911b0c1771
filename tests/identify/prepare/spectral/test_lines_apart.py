"""A tone in short blocks far apart: one frequency of thousands, told by all blocks in one phase."""

from __future__ import annotations

import numpy as np
import pytest
from fit_cases import problem_of

from insenv.core.recording import Channel, Recording
from insenv.effects.tone import Tone
from insenv.identify.fit.gls import solve
from insenv.identify.fit.problem import Term
from insenv.identify.prepare.spectral.lines import coherent_power, strongest_tone
from insenv.identify.search.round import MOST_LOBES, _coherent
from insenv.identify.search.scan import reference

#: Blocks of so many rows, every so many seconds, at 10 Hz.
BLOCKS, ROWS, EVERY, DT = 12, 50, 200.0, 0.1
FREQUENCY, SIGMA = 0.73123, 1e-4


@pytest.fixture(scope="module")
def recording() -> Recording:
    rng = np.random.default_rng(3)
    late = DT * rng.integers(0, 600, BLOCKS)  # blocks that follow evenly would have exact aliases
    t = np.concatenate([EVERY * k + late[k] + DT * np.arange(ROWS) for k in range(BLOCKS)])
    y = 2e-4 * np.cos(2 * np.pi * FREQUENCY * t + 1.0) + SIGMA * rng.standard_normal(len(t))
    return Recording(t, {"gyro": Channel(y, "rad/s")})


def test_the_strongest_of_thousands_is_the_best_of_all(recording: Recording) -> None:
    """With an amplitude of 2 sigma in 360 fitted rows no lobe comes near."""
    problem, model = problem_of(recording, declared=("bias",), averaging=DT, samples=False)
    fit = solve(problem, model)
    base = reference(problem, model, fit.noise.power)
    first, _ = strongest_tone(problem, fit)
    resolution = 0.25 / max(b.n for b in problem.fitted) / problem.bins.width
    term, ratio, _ = _coherent(problem, fit, base, Term(Tone(), (first,)), resolution)
    span = problem.bins.time[problem.fitted[-1].stop - 1] - problem.bins.time[problem.fitted[0].start]
    assert 2 * resolution * span / 0.25 > 4 * MOST_LOBES  # frequencies that are told from each other
    assert term.shape[0] == pytest.approx(FREQUENCY, abs=0.25 / span)
    assert ratio > 50
    near = FREQUENCY + np.arange(-500, 501) * 0.05 / span
    assert near[np.argmax(coherent_power(problem, fit, near))] == pytest.approx(FREQUENCY, abs=0.1 / span)
