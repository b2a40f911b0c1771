r"""Rotation from rest to rest, from the rates of a gyro triad.

With C_k the attitude after k intervals in the axes at the start, and w_k the corrected rate over interval k,

    C_0 = I,   C_k+1 = C_k exp([w_k dt_k x]),   C = C_n

A small change of the rates by D w_k, D a 3 x 3 matrix, turns C into exp([phi x]) C with

    phi_a = sum_bc T_abc D_bc,     T_abc = sum_k C_k,ab w_k,c dt_k

(first order; over one interval the attitude is that of its middle).
"""

from __future__ import annotations

import numpy as np

from insenv.core.recording import Floats


def turned(rates: Floats, dt: Floats, matrix: Floats) -> tuple[Floats, Floats]:
    """C, shape (3, 3), and T, shape (3, 3, 3), of rates ``matrix @ rates[k]`` over ``dt``, shapes (n, 3) and (n,)."""
    from insenv.navigation.matrices import turn  # compiled when it is first used

    attitude, slopes = np.eye(3), np.zeros((3, 3, 3))
    turn(np.ascontiguousarray(rates @ matrix.T), np.ascontiguousarray(dt), attitude, slopes)
    return attitude, slopes
