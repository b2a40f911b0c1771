"""Deviations of what gyros at rest tell, where little freedom or a walk of the bias makes the noise uncertain too."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import stdtr

from insenv.core.recording import Floats
from insenv.effects.bias import Bias
from insenv.effects.cross import GSensitivity
from insenv.identify.positions.gyros.means import RestMeans, RestTerm, over_walks, with_walk
from insenv.identify.positions.least_squares import Fit, solve
from insenv.identify.positions.model import Surroundings

TERMS = [RestTerm(Bias()), RestTerm(GSensitivity())]
ATTITUDES, NOISE = 12, 1e-5


def unit(rng: np.random.Generator) -> tuple[RestMeans, Floats]:
    """A gyro in twelve attitudes whose bias walks by its noise from one to the next, and its true g-sensitivity."""
    faces = np.tile(np.concatenate([np.eye(3), -np.eye(3)]), (2, 1))[rng.permutation(ATTITUDES)]
    forces = 9.8 * (faces + 0.1 * rng.normal(size=faces.shape))
    true = 1e-4 * rng.normal(size=3)
    walk = np.cumsum(rng.normal(size=ATTITUDES))
    y = 1e-3 + forces @ true + NOISE * (rng.normal(size=ATTITUDES) + walk)
    used = np.ones(ATTITUDES, bool)
    around = Surroundings(np.linspace(0.0, 110.0, ATTITUDES))
    return RestMeans(y, forces, around, used, used, np.eye(ATTITUDES)), true


def test_a_walk_that_is_not_seen_is_in_the_deviations() -> None:
    # By the likeliest walk alone, often none, the mean square of 200 units is 1.29, and now 1.07. Of 40 units it
    # scatters by 0.14: false alarm 1e-4.
    rng, runs = np.random.default_rng(181), np.zeros(ATTITUDES, int)
    squares, wider = [], []
    for _ in range(40):
        problem, true = unit(rng)
        likeliest = with_walk(problem, TERMS, runs)
        fit = solve(likeliest, TERMS)
        sd = over_walks(likeliest, TERMS, runs, fit).sd()
        squares.append(((fit.theta - [1e-3, *true]) / sd)[1:] ** 2)
        if likeliest.root is problem.root or np.allclose(likeliest.root, np.eye(ATTITUDES)):
            wider.append(sd[1:] / fit.sd()[1:])
    assert 0.55 < np.mean(squares) < 1.6
    assert len(wider) >= 3 and np.mean(wider) > 1.03


@pytest.mark.parametrize("freedom", range(1, 12))
def test_two_deviations_hold_at_any_freedom(freedom: int) -> None:
    # Of g-sensitivities in 12 attitudes, half of them held out, 10 % lay beyond 1.96 deviations.
    one = np.ones(1)
    fit = Fit((), one, one, one, float(freedom), freedom, np.eye(1))
    assert 2 * stdtr(freedom, 1.96 * fit.sd()[0]) - 1 == pytest.approx(0.95, abs=0.006)
