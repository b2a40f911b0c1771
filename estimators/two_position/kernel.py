"""`estimators.common.least_squares` over the rests of a chunk, recursively, for `estimators.two_position.published`."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from estimators.common.least_squares import recursion
from estimators.two_position.alignment_kernel import BEFORE, SPAN
from insenv.core.compiled import jit, patient

_recursion = jit(recursion)


@patient
def fit(velocity, where, dt, rows, counts, starts, P, X):  # noqa: PLR0913 -- a state in its arrays
    """Take velocities east and north into a fit for each of the first rests.

    velocity : (R, n, 3). where : (R, n), rest of each sample. rows : as before the chunk. counts : (R, F), samples in
    each fit. starts : (R, F, 2), velocity before the first. P : (R, F, 3, 3). X : (R, F, 3, 2).
    """
    n = velocity.shape[1]
    z = velocity[0:1, :, 0:2].copy()
    for i in range(velocity.shape[0]):
        k = 0
        while k < n:
            rest = where[i, k]
            end = k
            while end < n and where[i, end] == rest:
                end += 1
            if 0 <= rest < P.shape[1]:
                if counts[i, rest] == 0.0:
                    for j in range(2):
                        starts[i, rest, j] = velocity[i, k - 1, j] if k else rows[i, BEFORE + j]
                for m in range(k, end):
                    for j in range(2):
                        z[0, m, j] = velocity[i, m, j] - starts[i, rest, j]
                fits = slice(rest, rest + 1)
                # Of the types that other callers have, for which it is compiled already.
                part, lowest = np.ascontiguousarray(z[:, k:end]), np.int64(1)
                _recursion(part, dt / SPAN, int(counts[i, rest]), lowest, P[i, fits], X[i, fits])
                counts[i, rest] += end - k
            k = end
