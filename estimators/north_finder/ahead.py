r"""What a table that turns will tell of north, from its rate and angle: the loop of `estimators.north_finder.horizon`.

At a steady rate W, from the angle a on, the regressors of the rate that `estimators.north_finder.gls` fits are

    cos a, sin a;   u P_j(t), P_j(t);   -s n W sin(n a), s n W cos(n a);      u = s W + vertical,   s = sin(tilt),

and the information of a piece is the integral of x x' / N^2 over the time at that rate. The table needs |dW| / accel
before it; a change of rate also ends a chain of increments, whose free angle costs 2 Q sqrt(dt) / N seconds (the white
error Q of a sample against the walk N: the time constant of the filter that knows the angle at either end).

With L L' the information, c and s in the last places, the block of L at its end holds what is known of them alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from estimators.north_finder.kernel import ORDERS
from insenv.core.compiled import jit
from insenv.core.recording import Floats

#: Points at which a piece is looked at; the fourth harmonic turns by 40 deg between two at 30 deg/s for 4 s.
_NODES = 6
#: Relative change of rate that is none.
_SAME = 5e-3


@lru_cache
def compiled() -> Callable[..., None]:
    """The loop, compiled when it is first asked for."""
    loop: Callable[..., None] = jit(look)
    return loop


def look(  # noqa: C901, PLR0912, PLR0913, PLR0915 -- one loop over sequences; numba wants it in one function
    known: Floats,
    start: Floats,
    plans: Floats,
    weights: Floats,
    numbers: Floats,
    degree: int,
    bias_degree: int,
    found: Floats,
) -> None:
    """Covariance of c and s after each of some sequences, for each run; written into ``found``.

    Parameters
    ----------
    known : ndarray, shape (R, p, p)
        Information so far, priors in it.
    start : ndarray, shape (R, 3)
        Table angle [rad], rate [rad/s] and time [s] now.
    plans : ndarray, shape (S, K)
        Rates of the pieces [rad/s]; NaN: the sequence is over.
    weights : ndarray, shape (S,)
        Inverse of the density of the noise at the rate of the sequence [s/rad^2].
    numbers : ndarray
        Length of a piece [s], acceleration [rad/s^2], share of the table's rate, vertical Earth rate, span of the
        polynomials [s], time that a free angle costs [s].
    degree, bias_degree : int
        Of the polynomials.
    found : ndarray, shape (R, S, 3)
        Variance of c, covariance, variance of s [rad^2/s^2].
    """
    piece, acceleration, share, vertical, span, lost = numbers
    p = known.shape[1]
    first = 2 + degree + 1 + bias_degree + 1
    x = np.empty(p)
    J = np.empty((p, p))
    for r in range(known.shape[0]):
        for s in range(plans.shape[0]):
            for i in range(p * p):  # a matrix at once would compile the message of shapes that differ: seconds
                J[i // p, i % p] = known[r, i // p, i % p]
            angle, rate, t = start[r, 0], start[r, 1], start[r, 2]
            for k in range(plans.shape[1]):
                wanted = plans[s, k]
                if math.isnan(wanted):
                    break
                change = abs(wanted - rate)
                dead = min(change / acceleration, piece)
                reached = wanted if dead < piece else rate + math.copysign(acceleration * piece, wanted - rate)
                angle += 0.5 * (rate + reached) * dead
                steady = piece - dead
                told = steady - (lost if change > _SAME * abs(wanted) else 0.0)
                if told > 0.0 and wanted != 0.0:
                    weight = weights[s] * told / _NODES
                    u = share * wanted + vertical
                    for i in range(_NODES):
                        at = (i + 0.5) / _NODES * steady
                        a = angle + wanted * at
                        z = 2 * (t + dead + at) / span - 1
                        c, w = math.cos(a), math.sin(a)
                        x[p - 2], x[p - 1] = c, w
                        value, before = 1.0, 0.0
                        for j in range(degree + 1):
                            x[j] = value * u
                            if j <= bias_degree:
                                x[degree + 1 + j] = value
                            value, before = ((2 * j + 1) * z * value - j * before) / (j + 1), value
                        cn, sn = 1.0, 0.0
                        for n in range(1, ORDERS + 1):
                            cn, sn = cn * c - sn * w, cn * w + sn * c
                            x[first - 4 + 2 * n] = -share * n * wanted * sn
                            x[first - 3 + 2 * n] = share * n * wanted * cn
                        for i_ in range(p):
                            scaled = weight * x[i_]
                            for j in range(i_ + 1):
                                J[i_, j] += scaled * x[j]
                angle += reached * steady
                rate, t = reached, t + piece
            for j in range(p):  # Cholesky, in place
                for i in range(j, p):
                    total = J[i, j]
                    for m in range(j):
                        total -= J[i, m] * J[j, m]
                    if i == j:
                        J[j, j] = math.sqrt(max(total, 1e-300))
                    else:
                        J[i, j] = total / J[j, j]
            # The inverse of the last two rows' own block is the covariance of c and s.
            d, e, f = J[p - 2, p - 2], J[p - 1, p - 2], J[p - 1, p - 1]
            found[r, s, 0] = 1 / (d * d) + (e / (d * f)) ** 2
            found[r, s, 1] = -e / (d * f * f)
            found[r, s, 2] = 1 / (f * f)
