r"""Whether a model fits a list of points, and what it leaves is new in each row: two tests that need no named cause.

**Lack of fit.** Readings at one setting scatter about their mean by noise alone; with r the residuals of n points at G
settings, r_g their mean at one, n_g as many, and k coefficients,

    F = [sum_g n_g r_g^2 / (G - k)] / [sum_g sum_i (r_gi - r_g)^2 / (n - G)]

is Fisher's where the model holds. **Row after row.** v = sum_i r_i r_(i+1) / sum_i r_i^2 among the v of the rows in
other orders, as what the columns of the model leave of them. Noise that walks does so too: of a list it is no figure of
the instrument's, and is said.

Source: N. R. Draper and H. Smith, Applied Regression Analysis (1998), section 2.1; E. J. G. Pitman, J. R. Stat. Soc.
Suppl. 4 (1937) 225 (permutations).
"""

from __future__ import annotations

import numpy as np
from scipy.special import fdtrc

from insenv.core.recording import Floats
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.problem import Problem

#: Share of the range of what was set within which settings are one, and fewest readings more than there are settings.
SAME, FEWEST = 0.02, 3
#: Orders of the rows that are tried.
ORDERS = 1999


def tests(whole: Problem, fit: Fit) -> list[tuple[str, float]]:
    """What the two tests say and their p-values; ``whole`` is a problem of points, all of them fitted."""
    left = whole.y - fit.predicted()
    columns = np.column_stack([np.ones(len(left)), *(whole.columns(term) for term in fit.model)])
    base = np.linalg.svd(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300), full_matrices=False)
    span = base.U[:, base.S > 1e-6]
    left = left - span @ (span.T @ left)
    return [
        ("readings at one setting agree better with each other than with the model", _unlike_p(whole, left, span)),
        ("what is left goes on from row to row, as no independent readings do", _row_after_row_p(left, span)),
    ]


def _unlike_p(problem: Problem, left: Floats, span: Floats) -> float:
    """P-value of the lack of fit; 1 where too few readings repeat a setting."""
    _, setting = np.unique(_settings(problem), axis=0, return_inverse=True)
    count = np.bincount(setting.ravel())
    means = np.bincount(setting.ravel(), left) / count
    within, between = len(left) - len(count), len(count) - span.shape[1]
    if within < FEWEST or between < 1:
        return 1.0
    pure = float(np.sum((left - means[setting.ravel()]) ** 2)) / within
    return float(fdtrc(between, within, float(count @ means**2) / between / pure)) if pure > 0 else 1.0


def _settings(problem: Problem) -> Floats:
    """What each point was set to, in steps of `SAME` of its range, shape (points, k)."""
    cells: list[tuple[Floats, ...]] = []
    motions = [e.motion for e in problem.exposures]
    angles = [np.mod(m.angle[1:], 2 * np.pi) for m in motions if m.angle is not None]
    if len(angles) == len(motions):
        cells.append(tuple(angles))
    elif problem.turns:
        cells.append(tuple(e.u for e in problem.exposures))
    kelvins = [m.temperature[1:] for m in motions if m.temperature is not None]
    if len(kelvins) == len(motions):
        cells.append(tuple(kelvins))
    cells += [tuple(m.force[axis] for m in motions) for axis in "xyz" if all(axis in m.force for m in motions)]
    values = [problem.bins.mean(one) for one in cells]
    steps = [np.rint(v / (SAME * max(float(np.ptp(v)), 1e-300))) for v in values if np.ptp(v)]
    return np.column_stack(steps) if steps else np.arange(float(problem.bins.n))[:, None]


def _row_after_row_p(left: Floats, span: Floats) -> float:
    """P-value of how far what is left goes on from row to row, among the rows in other orders."""
    if not np.any(left):
        return 1.0
    rng = np.random.default_rng(len(left))
    orders = np.array([rng.permutation(len(left)) for _ in range(ORDERS)])
    others = left[orders]
    others = others - (others @ span) @ span.T

    def goes_on(rows: Floats) -> Floats:
        return np.asarray(np.sum(rows[..., 1:] * rows[..., :-1], axis=-1) / np.sum(rows**2, axis=-1))

    return float((1 + np.sum(goes_on(others) >= goes_on(left))) / (1 + ORDERS))
