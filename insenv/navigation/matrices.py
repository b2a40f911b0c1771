r"""Small loops on attitude matrices, compiled; imported when they are first asked for.

    C' = C exp([w dt x]),      exp([a x]) = 1 + s [a x] + v [a x]^2,    s = sin |a| / |a|,  v = (1 - cos |a|) / |a|^2

Each writes into an array that it is given.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np

from insenv.core.compiled import jit


@jit
def onward(c, x, y, z, out):
    """``out`` is C exp([(x, y, z) x]); it may not be ``c``."""
    a2 = x * x + y * y + z * z
    if a2 < 1e-8:
        s, v = 1.0 - a2 / 6.0, 0.5 - a2 / 24.0
    else:
        a = math.sqrt(a2)
        s, v = math.sin(a) / a, (1.0 - math.cos(a)) / a2
    e00, e01, e02 = 1.0 - v * (y * y + z * z), v * x * y - s * z, v * x * z + s * y
    e10, e11, e12 = v * x * y + s * z, 1.0 - v * (x * x + z * z), v * y * z - s * x
    e20, e21, e22 = v * x * z - s * y, v * y * z + s * x, 1.0 - v * (x * x + y * y)
    for i in range(3):
        out[i, 0] = c[i, 0] * e00 + c[i, 1] * e10 + c[i, 2] * e20
        out[i, 1] = c[i, 0] * e01 + c[i, 1] * e11 + c[i, 2] * e21
        out[i, 2] = c[i, 0] * e02 + c[i, 1] * e12 + c[i, 2] * e22


@jit
def add_matrix(q, c):
    """C_b^n of a quaternion, added to c with the weight of a half."""
    w, x, y, z = q
    c[0, 0] += 0.5 - (y * y + z * z)
    c[0, 1] += x * y - w * z
    c[0, 2] += x * z + w * y
    c[1, 0] += x * y + w * z
    c[1, 1] += 0.5 - (x * x + z * z)
    c[1, 2] += y * z - w * x
    c[2, 0] += x * z - w * y
    c[2, 1] += y * z + w * x
    c[2, 2] += 0.5 - (x * x + y * y)


@jit
def add_crossed(v, rows, out):
    """Add v x to three rows, of all columns."""
    for k in range(rows.shape[1]):
        out[0, k] += v[1] * rows[2, k] - v[2] * rows[1, k]
        out[1, k] += v[2] * rows[0, k] - v[0] * rows[2, k]
        out[2, k] += v[0] * rows[1, k] - v[1] * rows[0, k]


@jit
def turn(rates, dt, c, t):
    """Run through rates, shape (n, 3), over dt, shape (n,): c is C in the end, and T is added to t, (3, 3, 3).

    T_abc is the sum of C_ab w_c dt, C in the middle of each interval (`insenv.identify.positions.turn`).
    """
    middle, after = np.empty((3, 3)), np.empty((3, 3))
    for k in range(rates.shape[0]):
        x, y, z = rates[k, 0] * dt[k], rates[k, 1] * dt[k], rates[k, 2] * dt[k]
        onward(c, 0.5 * x, 0.5 * y, 0.5 * z, middle)
        onward(c, x, y, z, after)
        for i in range(3):
            for j in range(3):
                for m in range(3):
                    t[i, j, m] += middle[i, j] * rates[k, m] * dt[k]
                c[i, j] = after[i, j]
