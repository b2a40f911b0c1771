r"""A bias that jumps between two rests: at which of them, and the term that says so.

    f = A (m - o - c h(t > t0))

A triad that is knocked, or whose supply is switched, reads otherwise from one rest on. Between rests nothing is read:
every time there is one form of the effect, and t0 halfway. The likeliest form is offered to the search, and pays for
all; t0 is as uncertain as others are likely, and as the time from rest to rest is long. So many rests must stand on
either side that the three coefficients do not fit whatever is there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from insenv.core.recording import Floats
from insenv.effects.bias import BiasStep
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes
from insenv.identify.positions.least_squares import normal, solve
from insenv.identify.positions.model import TriadTerm, triad_term

#: Fewest fitted rests before and after a jump, twice its coefficients, and least freedom that it leaves.
FEWEST, FREEDOM = 6, 6


def likeliest_jump(problem: Magnitudes, terms: Sequence[TriadTerm]) -> TriadTerm | None:
    """The step that explains most of what ``terms`` leave of the rests; None where too few stand on either side.

    Parameters
    ----------
    problem : Magnitudes
        Of the rests of one run, in the order of time.
    terms : sequence of TriadTerm
        All that may be found beside it.
    """
    used = np.flatnonzero(problem.fitted)
    gaps = range(FEWEST, len(used) - FEWEST + 1)
    if not gaps:
        return None
    middle = problem.around.time[used]
    times = np.array([0.5 * (middle[k - 1] + middle[k]) for k in gaps])
    forms = [triad_term(BiasStep(), (float(t),)) for t in times]
    size = sum(term.size for term in terms)
    freedom = problem.rank * len(used) - size - forms[0].size
    if freedom < FREEDOM:
        return None
    fit = solve(problem, terms)
    gained = np.array([_explained(problem, terms, fit.theta, size, form) for form in forms])
    best = int(np.argmax(gained))
    likely = np.exp((gained - gained[best]) * freedom / max(fit.rss - gained[best], 1e-300) / 2)
    apart = (times - times[best]) ** 2 + float(np.median(np.diff(middle))) ** 2 / 12
    sd = float(np.sqrt(np.sum(likely * apart) / np.sum(likely)))
    return replace(forms[best], shape_sd=(sd,), looks=len(forms))


def _explained(problem: Magnitudes, terms: Sequence[TriadTerm], theta: Floats, size: int, form: TriadTerm) -> float:
    """Square sum of the fitted rests that a form explains beside ``terms``, to first order."""
    start = np.concatenate([theta[:size], np.zeros(form.size), theta[size:]])
    residual, slopes = problem.evaluate((*terms, form), start)
    rows, right = normal(problem, residual, slopes, start, 1.0)
    own = np.arange(size, size + form.size)
    model = np.linalg.qr(np.delete(rows, own, axis=1))[0]
    left, fresh = (x - model @ (model.T @ x) for x in (right, rows[:, own]))
    return float(np.sum((np.linalg.qr(fresh)[0].T @ left) ** 2))
