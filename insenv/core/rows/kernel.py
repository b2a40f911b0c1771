"""Sums over the rows of a batch in one pass, compiled: NumPy's temporaries of a batch cost more than the sums.

Every number is rounded as NumPy rounds it, in the same order: a row of a batch is the same run alone, bit for bit.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from insenv.core.compiled import patient


@patient
def combined(basis, theta, out):
    """Regressors (R, n, k) times parameters (R, k), into ``out``, (R, n)."""
    for row in range(out.shape[0]):
        for j in range(theta.shape[1]):
            h = theta[row, j]
            if j == 0:
                for i in range(out.shape[1]):
                    out[row, i] = basis[row, i, 0] * h
            else:
                for i in range(out.shape[1]):
                    out[row, i] += basis[row, i, j] * h


@patient
def product_means(a, b, out):
    """Mean over each interval of the product of two states that are straight between edges (R, n + 1), (R, n)."""
    for row in range(out.shape[0]):
        for i in range(out.shape[1]):
            early = 2 * b[row, i] + b[row, i + 1]
            late = 2 * b[row, i + 1] + b[row, i]
            out[row, i] = (a[row, i] * early + a[row, i + 1] * late) / 6
