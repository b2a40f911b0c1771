"""Each unit left out in its turn: what the others foretell of it, from one fit of all.

With whitened residuals r of all units, R their derivatives, C = (R'R + priors)^-1, and W_i the columns of the whitening
that belong to unit i (its own noise alone), a fit without unit i is one with unknowns d_i added to its readings:

    d_i = (W_i' W_i - W_i' R C R' W_i)^-1 W_i' r,          theta - theta_(i) = -C R' W_i d_i

and the residual of unit i under theta_(i), before it was whitened, is that under theta plus its derivatives times the
difference. Exact for linear models whatever the correlation of the noise; one step of Gauss and Newton for others.

Source: Cook and Weisberg, Residuals and Influence in Regression (1982), section 2.2.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats

#: Share of a unit's information that must not be its own: below it the others do not foretell it.
LEAST_SHARE = 1e-6
#: The same, in all that a unit measures: below it the others foretell it ten times worse than it was measured (an axis
#: that points up in one rest alone), and it says nothing of a model.
FORETOLD = 1e-2


def left_out(root: Floats, residual: Floats, slopes: Floats, inverse: Floats, used: NDArray[np.bool_]) -> Floats:
    """Residuals of each unit under the fit of all others, before they were whitened.

    Parameters
    ----------
    root : ndarray, shape (m d, m d)
        L of the noise's covariance s^2 L L'.
    residual : ndarray, shape (m, d) or (m, d, k)
        Whitened; of several sets at once in the last axis.
    slopes : ndarray, shape (m, d, p)
        Their derivatives.
    inverse : ndarray, shape (p, p)
        Inverse of the information of the fit of all used units.
    used : ndarray of bool, shape (m,)

    Returns
    -------
    ndarray, shape of ``residual``
        Infinite where the others do not foretell a unit; zero where it is not used.
    """
    m, d = residual.shape[:2]
    sets = residual.reshape(m * d, -1)
    rows, plain_rows = slopes.reshape(m * d, -1), root @ slopes.reshape(m * d, -1)
    white = np.linalg.solve(root, np.eye(m * d))
    known = np.all(np.isfinite(inverse), axis=0)[:, None]
    spread = np.where(known & known.T, inverse, 0.0)
    moved = rows.T @ white  # R' W
    own = white.T @ white - moved.T @ spread @ moved
    pulled = white.T @ sets
    out = root @ sets
    for i in np.flatnonzero(used):
        at = slice(i * d, (i + 1) * d)
        block = own[at, at]
        # A component that is no measurement has neither noise nor derivatives of its own.
        values, vectors = np.linalg.eigh(0.5 * (block + block.T))
        information = (white.T @ white)[at, at]
        told = values > LEAST_SHARE * np.diag(information).max()
        if not told.all() or _shares(block, information).max() < FORETOLD:
            out[at] = np.inf
            continue
        shift = vectors @ ((vectors.T @ pulled[at]) / values[:, None])
        out[at] += plain_rows[at] @ (spread @ (moved[:, at] @ shift))
    out[~np.repeat(used, d)] = 0.0
    return out.reshape(residual.shape)


def _shares(left: Floats, information: Floats) -> Floats:
    """Shares of a unit's information that are not its own, along the components that it measures, shape (d,)."""
    size, axes = np.linalg.eigh(information)
    unit = axes / np.sqrt(np.maximum(size, LEAST_SHARE * size.max()))
    return np.asarray(np.linalg.eigvalsh(unit.T @ left @ unit))
