"""How strongly an addition stands out: the norm of its whitened samples beside the declared model.

    s^2 = min_b || S^(-1/2) C (a - X b) ||^2

C is the cosine transform of each run's fitted rows without its constant (the bias of the run takes that), S the true
density of the noise over the sampling period. Rows that are lost are passed over as if time stood still.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from blind.noise import Noise
from blind.table import Floats


class Ruler:
    """Measures additions on the rows ``fitted``, one set of indices for each run, beside the columns ``declared``."""

    def __init__(self, noise: Noise, dt: float, fitted: Sequence[NDArray[np.int64]], declared: Floats) -> None:
        self.fitted = fitted
        counts = [len(rows) for rows in fitted]
        self.roots = [np.sqrt(noise.density(np.arange(1.0, n) / (2 * n * dt), dt) / dt) for n in counts]
        self.x = self.whitened(declared) if declared.shape[1] else np.zeros((sum(counts) - len(counts), 0))

    def whitened(self, columns: Floats) -> Floats:
        """Shape (modes, k) for columns (n, k)."""
        pieces = zip(self.fitted, self.roots, strict=True)
        return np.concatenate([dct(columns[rows], axis=0, norm="ortho")[1:] / root[:, None] for rows, root in pieces])

    def beside(self, addition: Floats, *others: Floats) -> float:
        """Strength of ``addition`` (n,) beside the declared model and further curves, each (n,) or (n, k)."""
        a = self.whitened(addition[:, None])[:, 0]
        more = [self.whitened(o if o.ndim == 2 else o[:, None]) for o in others]
        x = np.concatenate([self.x, *more], axis=1)
        size = np.linalg.norm(x, axis=0)
        x = x[:, size > 0] / size[size > 0]
        q, r = np.linalg.qr(x)
        q = q[:, np.abs(np.diag(r)) > 1e-7]
        return float(np.linalg.norm(a - q @ (q.T @ a)))
