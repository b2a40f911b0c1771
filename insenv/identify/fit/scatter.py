r"""Whether estimates of one thing scatter more than their deviations say, and what their mean is worth then.

    w_k = 1 / s_k^2,      g = sum w_k g_k / sum w_k,      Q = sum w_k (g_k - g)^2  ~  chi^2_{K-1} by chance
    t^2 = max(0, (Q - (K - 1)) / (sum w - sum w^2 / sum w))      variance between them, beyond chance
    z = |sum v_k g_k| / sqrt(sum v_k),      v_k = 1 / (s_k^2 + t^2)

Source: R. DerSimonian and N. Laird, Meta-analysis in clinical trials, Controlled Clinical Trials 7 (1986) 177.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from insenv.core.recording import Floats

#: Share of the weights that is nothing: one estimate tells it all.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Scatter:
    """Chance of such a scatter, the variance ``between`` the estimates, and the deviate of their mean beside it."""

    chance: float
    between: float
    deviate: float


def scatter(values: Floats, deviations: Floats) -> Scatter:
    """How K estimates with their standard deviations scatter, shapes (K,)."""
    w = 1 / deviations**2
    mean = float(values @ w / w.sum())
    q, free = float((values - mean) ** 2 @ w), len(values) - 1
    room = float(w.sum() - w @ w / w.sum())
    between = max(0.0, (q - free) / room) if room > ROUNDING * float(w.sum()) else 0.0
    v = 1 / (deviations**2 + between)
    return Scatter(float(chdtrc(free, q)), between, float(abs(values @ v) / np.sqrt(v.sum())))
