r"""The loop of `estimators.system_calibration.multi_position`: a turn from the rates of the gyros.

    C' = C [w x],      B' = C X

with w the true rates that are assumed, X the regressors of the gyros' parameters, and C the attitude in the axes at the
start. Rates that differ by X theta make exp([B theta] x) C of C, to first order.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from insenv.core.compiled import jit
from insenv.navigation.matrices import onward


@jit
def turn(rates, columns, dt, c, b):
    """Run through a turn; c, shape (3, 3), is C at its beginning and at its end; b, shape (3, p), is filled.

    rates : shape (n, 3). columns : three arrays of shape (n, p_i), regressors of the gyros, whose columns follow.
    """
    after, middle = np.empty((3, 3)), np.empty((3, 3))
    for n in range(rates.shape[0]):
        onward(c, rates[n, 0] * dt, rates[n, 1] * dt, rates[n, 2] * dt, after)
        for i in range(3):
            for j in range(3):
                middle[i, j] = 0.5 * (c[i, j] + after[i, j])
                c[i, j] = after[i, j]
        for i in range(3):
            k = 0
            for g in range(3):
                own = columns[g]
                for j in range(own.shape[1]):
                    b[i, k] += middle[i, g] * own[n, j] * dt
                    k += 1
