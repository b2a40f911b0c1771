"""How strongly an addition stands out: the norm of its whitened samples beside the declared model.

    s^2 = min_b || S^(-1/2) C (a - X b) ||^2

C is the cosine transform of the fitted rows without its constant (the bias takes that), S the true density of the noise
over the sampling period.
"""

from __future__ import annotations

import numpy as np
from scipy.fft import dct

from blind.noise import Noise
from blind.table import Floats


class Ruler:
    """Measures additions on the first ``fitted`` rows, beside the columns ``declared`` (n, k)."""

    def __init__(self, noise: Noise, dt: float, fitted: int, declared: Floats) -> None:
        self.fitted = fitted
        k = np.arange(1.0, fitted)
        self.root = np.sqrt(noise.density(k / (2 * fitted * dt), dt) / dt)
        self.x = self.whitened(declared) if declared.shape[1] else np.zeros((fitted - 1, 0))

    def whitened(self, columns: Floats) -> Floats:
        """Shape (modes, k) for columns (n, k)."""
        return np.asarray(dct(columns[: self.fitted], axis=0, norm="ortho")[1:]) / self.root[:, None]

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
