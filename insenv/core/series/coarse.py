r"""Rounding of a reading that its noise does not blur: an error that is one in all rows of a steady rate.

A reading x + n, n ~ N(0, s^2), rounded to steps of q is off in the mean over n by

    b(x) = q sum_k (-1)^k / (pi k) sin(2 pi k x / q) exp(-2 pi^2 k^2 s^2 / q^2),

a saw tooth of half a step where s is small beside q, and nothing from s = q / 2 on: then the noise dithers it. Its mean
square over x, and what rows scatter by at one x, are

    m^2 = q^2 sum_k exp(-4 pi^2 k^2 s^2 / q^2) / (2 pi^2 k^2),        v = s^2 + q^2 / 12 - m^2,

so v, which is half of the mean square from row to row, tells s, and s tells m. Counts of an increment carry what they
leave over to the next row, and have no such error.

Source: B. Widrow and I. Kollar, Quantization Noise (Cambridge 2008), chapters 4 and 17.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from insenv.core.recording import Floats
from insenv.core.series.rounding import rounding

#: Steps below which the error is none.
LEAST = 0.01
#: Terms of the sum, and scatters of a row, in steps, at which it is taken.
TERMS, SCATTERS = np.arange(1, 60), np.linspace(0.0, 0.6, 241)


@dataclass(frozen=True)
class Coarse:
    """Readings that are rounded: the step, and the root mean square of the error that is one at a rate."""

    step: float
    rms: float


def coarse(values: Floats, rate: Floats | None = None) -> Coarse | None:
    """What rounding leaves in the means of ``values``, shape (n,); None where that is nothing.

    ``rate``, shape (n,), is what they are to follow, in their unit.
    """
    if len(values) < 3 or not (step := rounding(values)):
        return None
    moves = np.diff(values) if rate is None else np.diff(values - rate)
    rms = undithered(0.5 * float(np.mean(moves**2)) / step**2)
    return Coarse(step, step * rms) if rms > LEAST else None


def undithered(power: float) -> float:
    """Root mean square of the error that is one at a rate [steps], of rows that scatter by ``power`` [steps^2]."""
    smooth = np.exp(-4 * (np.pi * np.outer(SCATTERS, TERMS)) ** 2) @ (0.5 / (np.pi * TERMS) ** 2)
    scatter: Floats = SCATTERS**2 + smooth[0] - smooth
    return float(np.sqrt(max(np.interp(power, scatter, smooth, right=0.0), 0.0)))
