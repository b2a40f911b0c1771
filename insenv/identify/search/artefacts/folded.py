r"""Waves of the table's angle that means fold: of a faster wave, as a motor's poles make, at a steady rate.

At n means a turn the orders k and |k - m n| are one wave of the means. The cells behind the means tell them apart: with
p what the wave is in the cells, and X what the model has beside it, they have

    c = p'M y / p'M p,      M = I - X (X'X)^-1 X',

of it, and where that is not half, beyond three of its deviations, the wave is a faster one.
"""

from __future__ import annotations

import math

import numpy as np

from insenv.core.recording import Floats
from insenv.effects.base import LinearEffect
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.problem import Model, Problem, regressors

#: Share of a wave of the means that the cells must have, and deviations by which it is known that they have less.
SHARE, SURE = 0.5, 3.0
#: Fewest cells that tell.
FEWEST = 64


def folded(problem: Problem, fit: Fit) -> str:
    """Why a wave of the angle that was fitted last is none: what the means are made of has less of it; else empty."""
    term = fit.model[-1]
    if "angle" not in term.effect.needs or not isinstance(term.effect, LinearEffect) or term.per_run:
        return ""
    theta = fit.theta[fit.design.term == len(fit.model) - 1]
    if len(theta) != len(term.effect.linear) or all(weights.shape[1] == 1 for weights in problem.bins.weights):
        return ""
    others, wave, left = _of_cells(problem, fit.model, theta)
    if len(left) < FEWEST or not wave.any():
        return ""
    others /= np.maximum(np.linalg.norm(others, axis=0), 1e-300)
    both = np.column_stack([wave, left])
    wave, left = (both - others @ np.linalg.lstsq(others, both, rcond=1e-9)[0]).T
    power = float(wave @ wave)
    told = float(wave @ left) / power
    sd = math.sqrt(float(np.sum((left - told * wave) ** 2)) / max(len(left) - others.shape[1], 1) / power)
    if told > SHARE or 1 - told < SURE * sd:
        return ""
    return f"what the means are made of has {max(told, 0.0):.0%} of it: a faster wave, folded by the means"


def _of_cells(problem: Problem, model: Model, theta: Floats) -> tuple[Floats, Floats, Floats]:
    """Columns of a model but for its last term, the curve of that, and what is read, over the cells of fitted bins."""
    columns, wave, left = [], [], []
    for run, exposure in enumerate(problem.exposures):
        cells = problem.bins.fitted_cells(run)
        cells = cells[exposure.count[cells] > 0]
        own = np.zeros((len(cells), len(problem.exposures)))
        own[:, run] = 1.0
        *bases, last = (regressors(term.effect, exposure, term.shape)[cells] for term in model)
        columns.append(np.column_stack([own, exposure.u[cells], *bases]))
        wave.append(last @ theta)
        left.append((exposure.y - exposure.motion.rate)[cells])
    return np.concatenate(columns), np.concatenate(wave), np.concatenate(left)
