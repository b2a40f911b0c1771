"""Slow changes without a cause: Legendre polynomials of the time.

    scale_factor_polynomial   u sum_j c_j P_j(x)
    bias_polynomial             sum_j c_j P_j(x),      x = 2 t / span - 1

Stand-ins for a warm-up or a temperature in a bound or in an estimator: they describe and name nothing, so they are
not in the catalogue that a search tries. The polynomial is taken at the middle of an interval.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, LinearEffect, Param
from insenv.effects.forms import columns

#: Prior standard deviations of one coefficient: relative, and of a bias of 20 deg/h.
SCALE_SD, BIAS_SD = 1e-2, 1e-4


@dataclass(frozen=True)
class _Polynomial(LinearEffect):
    degree: int = 2
    span: float = 300.0

    generic = True
    source = "Abramowitz and Stegun, chapter 22: Legendre polynomials"

    def values(self, motion: Motion) -> list[Floats]:
        """P_0 to P_degree at the middles of the intervals, each of shape (n,)."""
        table = np.polynomial.legendre.legvander(2.0 * motion.middle / self.span - 1.0, self.degree)
        return list(table.T)


@final
@dataclass(frozen=True)
class ScaleFactorPolynomial(_Polynomial):
    """A scale factor that changes slowly over ``span`` seconds."""

    id = "scale_factor_polynomial"
    instruments = ("gyro",)
    of_rate = True

    @property
    def linear(self) -> tuple[Param, ...]:
        """One coefficient for each degree."""
        return tuple(Param(f"c{j}", "1", sd=SCALE_SD) for j in range(self.degree + 1))

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Input times each polynomial, shape (..., n, degree + 1)."""
        return columns(u, *(u * p for p in self.values(motion)))


@final
@dataclass(frozen=True)
class BiasPolynomial(_Polynomial):
    """A bias that changes slowly over ``span`` seconds."""

    id = "bias_polynomial"

    @property
    def linear(self) -> tuple[Param, ...]:
        """One coefficient for each degree."""
        return tuple(Param(f"c{j}", OUTPUT, sd=BIAS_SD) for j in range(self.degree + 1))

    def basis(self, u: Floats, motion: Motion) -> Floats:
        """Each polynomial, shape (..., n, degree + 1)."""
        return columns(u, *self.values(motion))
