r"""The loop of `estimators.system_calibration.multi_position`: a turn from the rates of the gyros.

    C' = C [w x],      B' = C X

with w the true rates that are assumed, X the regressors of the gyros' parameters, and C the attitude in the axes at the
start. Rates that differ by X theta make exp([B theta] x) C of C, to first order.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np

from insenv.core.compiled import jit


@jit
def turn(rates, columns, dt, c, b):  # noqa: C901, PLR0912 -- plain loops over samples
    """Run through a turn; c, shape (3, 3), is C at its beginning and at its end; b, shape (3, p), is filled.

    rates : shape (n, 3). columns : three arrays of shape (n, p_i), regressors of the gyros, whose columns follow.
    """
    step, after, middle = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for n in range(rates.shape[0]):
        x, y, z = rates[n, 0] * dt, rates[n, 1] * dt, rates[n, 2] * dt
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
                after[i, j] = c[i, 0] * step[0, j] + c[i, 1] * step[1, j] + c[i, 2] * step[2, j]
                middle[i, j] = 0.5 * (c[i, j] + after[i, j])
        for i in range(3):
            k = 0
            for g in range(3):
                own = columns[g]
                for j in range(own.shape[1]):
                    b[i, k] += middle[i, g] * own[n, j] * dt
                    k += 1
        c[:, :] = after
