r"""Rotation from rest to rest, from the rates of a gyro triad.

With C_k the attitude after k intervals in the axes at the start, and w_k the corrected rate over interval k,

    C_0 = I,   C_k+1 = C_k exp([w_k dt_k x]),   C = C_n

A small change of the rates by D w_k, D a 3 x 3 matrix, turns C into exp([phi x]) C with

    phi_a = sum_bc T_abc D_bc,     T_abc = sum_k C_k,ab w_k,c dt_k

(first order; over one interval the attitude is that of its middle). The loop is compiled when it is first used.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np

from insenv.core.compiled import jit
from insenv.core.recording import Floats


def turned(rates: Floats, dt: Floats, matrix: Floats) -> tuple[Floats, Floats]:
    """C, shape (3, 3), and T, shape (3, 3, 3), of rates ``matrix @ rates[k]`` over ``dt``, shapes (n, 3) and (n,)."""
    attitude, slopes = np.eye(3), np.zeros((3, 3, 3))
    _compiled()(np.ascontiguousarray(rates @ matrix.T), np.ascontiguousarray(dt), attitude, slopes)
    return attitude, slopes


@cache
def _compiled() -> Any:
    return jit(_turn)


def _turn(rates, dt, c, t):
    step, middle, after = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for k in range(rates.shape[0]):
        for share, out in ((0.5, middle), (1.0, after)):
            x, y, z = rates[k, 0] * dt[k] * share, rates[k, 1] * dt[k] * share, rates[k, 2] * dt[k] * share
            a2 = x * x + y * y + z * z
            if a2 < 1e-8:
                s, v = 1.0 - a2 / 6.0, 0.5 - a2 / 24.0
            else:
                a = math.sqrt(a2)
                s, v = math.sin(a) / a, (1.0 - math.cos(a)) / a2
            step[0, 0], step[0, 1], step[0, 2] = 1.0 - v * (y * y + z * z), v * x * y - s * z, v * x * z + s * y
            step[1, 0], step[1, 1], step[1, 2] = v * x * y + s * z, 1.0 - v * (x * x + z * z), v * y * z - s * x
            step[2, 0], step[2, 1], step[2, 2] = v * x * z - s * y, v * y * z + s * x, 1.0 - v * (x * x + y * y)
            for i in range(3):
                for j in range(3):
                    out[i, j] = c[i, 0] * step[0, j] + c[i, 1] * step[1, j] + c[i, 2] * step[2, j]
        for i in range(3):
            for j in range(3):
                for m in range(3):
                    t[i, j, m] += middle[i, j] * rates[k, m] * dt[k]
        c[:, :] = after
