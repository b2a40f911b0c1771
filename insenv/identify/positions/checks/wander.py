r"""Whether biases wander from rest to rest: what rests leave is alike in neighbours, where they point alike.

With the covariance s^2 (I + kappa W) of `insenv.identify.positions.walk` beside all that may be found, the restricted
likelihood of the best kappa over that of none,

    Lambda = 2 (l(kappa) - l(0)),

is zero in half of all cases of no walk and chi-square on one degree of freedom in the other half. A drift, a warm-up
and a loose seat look so, and where the walk is as likely as any of them it stands for it and none is named.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import chdtrc

from insenv.core.recording import Floats
from insenv.identify.positions.accelerometers.magnitudes import Magnitudes
from insenv.identify.positions.least_squares import Fit, solve
from insenv.identify.positions.model import TriadTerm
from insenv.identify.positions.walk import likeliest

#: Probability of such a walk by chance, and the least that it goes over the whole of the rests [m/s^2]: at worst an
#: accelerometer repeats itself no better, nor is a mean known to less than its noise.
CHANCE, LEAST = 5e-3, 3e-3


def wandering(problem: Magnitudes, fit: Fit, tried: Sequence[TriadTerm], time: Floats, noise: float) -> tuple[str, ...]:
    """That biases walk from rest to rest, in words; empty where they do not.

    Parameters
    ----------
    problem : Magnitudes
        With white noise.
    fit : Fit
        With all that was found.
    tried : sequence of TriadTerm
        What rests tell and the fit may lack.
    time : ndarray, shape (rests,)
        Of each rest, through all runs [s].
    noise : float
        Of the mean of a rest [m/s^2].
    """
    there = {term.effect.key for term in fit.terms}
    whole = solve(problem, [*fit.terms, *(term for term in tried if term.effect.key not in there)])
    errors, slopes = problem.errors(whole.terms, whole.theta)
    unit = problem.measured / np.linalg.norm(problem.measured, axis=1)[:, None]
    found = likeliest(errors, slopes, time, problem.fitted | problem.held_out, unit @ unit.T)
    if found is None:
        return ()
    ratio, far = found
    p = 0.5 * float(chdtrc(1, ratio))
    if p >= CHANCE or far < max(LEAST, noise):
        return ()
    return (
        f"biases of the accelerometers wander from rest to rest, by {1e3 * far:.2g} mm/s^2 over all of them (p = "
        f"{p:.1g}): a drift, a warm-up or a walk, which these rests do not tell apart",
    )
