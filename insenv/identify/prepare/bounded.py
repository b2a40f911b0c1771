r"""Noise that may not stand for the motion: a bound beside a reference that the reading follows.

Of y = g u + n with errors in u the likelihood has two ends. At the true gain what is left is small and rough, as the
errors of u are; at a gain of nothing it is the motion itself, large and smooth, which a gyro reads better than a noisy
reference does: a walk of the noise is likelier, whatever it means (V. Solari, J. R. Stat. Soc. B 31 (1969) 372). Where
plain least squares read the motion and the fit reads less of it, no term of the noise may make more than `TIMES` the
power that they leave,

    P_j sum_k s_jk <= `TIMES` sum_k e_k^2,      s_jk the term's shape over the modes k

The reference's own noise stands in y - u, whatever curve of its motion the gain is fitted to, and so in e. What a craft
did not do that it was told to is an error of the reference too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from insenv.core.recording import Floats
from insenv.effects.noise import Quantization
from insenv.effects.rate.scale import ScaleFactor
from insenv.identify.fit.gls import solve
from insenv.identify.fit.noise import transform
from insenv.identify.fit.problem import NOISE_TERMS, Model, Problem, Term, design

#: Share of the power of the reading that the motion must explain for the bound, part of the gain by least squares that
#: the fit must lose, and times what is left that noise may make.
FOLLOWED, LOST, TIMES = 0.8, 0.5, 2.0


def bounded(problem: Problem, model: Model) -> Problem:
    """The problem with a largest power of each noise term, where a fit takes the motion for noise; else as it is.

    Parameters
    ----------
    problem : Problem
        Of a gyro beside a reference.
    model : Model
        The declared one; a lag that it lacks is left, and is no noise that is too small.
    """
    if not problem.turns or not problem.target.startswith("gyro"):
        return problem
    level = tuple(term for term in model if term.effect.part == "level")
    with_gain = (*(term for term in model if term.effect.part != "gain"), Term(ScaleFactor()))
    own = design(problem, with_gain)
    theta, left = least_squares(own.transformed, problem.data())
    gain = own.term == len(with_gain) - 1
    if not gain.any() or left > (1 - FOLLOWED) * unexplained(problem, level):
        return problem
    by_rows = 1 + float((theta / own.scale)[gain][0])
    if abs(1 + solve(problem, with_gain).scale_factor) > (1 - LOST) * abs(by_rows):
        return problem
    most = TIMES * left / np.maximum(problem.modes().shapes.sum(axis=0), 1e-300)
    return replace(problem, most=most if problem.most is None else np.minimum(most, problem.most))


def of_points(problem: Problem) -> Problem:
    """The problem without noise that one mean takes back from the next where each is a point; else as it is.

    Differences of a counter are such: what is left beside them looks smoother than the readings are, and a slow law of
    16 points was told at 2e-4 that least squares know at 0.1.
    """
    if not problem.in_points:
        return problem
    most = np.array([0.0 if term.id == Quantization.id else np.inf for term in NOISE_TERMS])
    return replace(problem, most=most if problem.most is None else np.minimum(most, problem.most))


def unexplained(problem: Problem, level: Model) -> float:
    """Square sum of the reading of a gyro in the modes, the motion in it, beside its ``level`` alone."""
    return least_squares(design(problem, level).transformed, problem.data() + turned(problem))[1]


def turned(problem: Problem) -> Floats:
    """The rate that a gyro was exposed to in the modes, shape (modes,)."""
    rate = problem.bins.mean(tuple(e.motion.rate for e in problem.exposures))
    return np.asarray(transform(problem.fitted, rate[:, None])[:, 0])


def least_squares(columns: Floats, data: Floats) -> tuple[Floats, float]:
    """Coefficients by plain least squares in the modes, and the square sum that they leave."""
    theta = np.asarray(np.linalg.lstsq(columns, data, rcond=1e-10)[0])
    return theta, float(np.sum((data - columns @ theta) ** 2))
