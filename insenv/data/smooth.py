"""A slow state without its sensor's noise.

The smooth curve s of samples x minimises |x - s|^2 + alpha |second difference of s|^2; in the DCT-II domain
it is each coefficient divided by 1 + alpha lambda^2, lambda = 4 sin^2(pi k / 2n). The weight alpha is the one
that predicts left-out samples best (generalised cross-validation). Readings that stand at one step for long predict
each other though they are rounded: where larger weights still leave no sample further off than half a step, the
largest of them is taken.

Source: D. Garcia, Computational Statistics and Data Analysis 54 (2010) 1167.

Temperature is measured with noise and quantisation, and instruments follow its derivative: without smoothing
the derivative would be all noise.
"""

from __future__ import annotations

import numpy as np

from insenv.core.recording import Floats

#: Fewer samples than this are left as they are.
FEWEST = 32
#: More samples than this are first averaged in blocks, so that the steps of a coarse reading are no signal.
POINTS = 1000
#: Steps that a reading is off by at most, and a little for the sensor's noise.
HALF = 0.525


def smoothed(x: Floats, step: float = 0.0) -> Floats:
    """The smooth curve of evenly spaced samples ``x``, shape (n,), of a sensor that reads in steps of ``step``."""
    n = len(x)
    block = max(1, n // POINTS)
    if n < FEWEST or np.ptp(x) == 0:
        return x
    if block == 1:
        return _smoothed(x, step)
    from scipy.interpolate import CubicSpline  # slow to import

    edges = np.arange(0, n, block)
    sizes = np.diff(np.append(edges, n))
    means = np.add.reduceat(x, edges) / sizes
    whole = len(edges) - (sizes[-1] < block)
    curve = CubicSpline(edges[:whole] + 0.5 * (block - 1), _smoothed(means[:whole], step))
    return np.asarray(curve(np.arange(n)))


def _smoothed(x: Floats, step: float) -> Floats:
    from scipy.fft import dct, idct  # slow to import

    n = len(x)
    # The cosine transform continues a curve evenly beyond its ends: its slopes there are taken out first.
    trend = _end_slopes(x)
    coefficients = dct(x - trend, type=2, norm="ortho")
    lam = 4 * np.sin(0.5 * np.pi * np.arange(n) / n) ** 2
    kept = 1 / (1 + np.geomspace(1e-3, 1e-3 * n**4, 60)[:, None] * lam**2)
    first = int(np.argmin(_cross_validation(coefficients, kept)))
    curve = trend + idct(coefficients * kept[first], type=2, norm="ortho")
    for share in kept[first + 1 :]:
        smoother = trend + idct(coefficients * share, type=2, norm="ortho")
        if np.abs(x - smoother).max() > HALF * step:
            break
        curve = smoother
    return np.asarray(curve)


def _cross_validation(coefficients: Floats, kept: Floats) -> Floats:
    """Generalised cross-validation: n times the squared residual over the squared freedom that is left, shape (w,).

    ``kept`` are shares of each coefficient, shape (w, n).
    """
    n = len(coefficients)
    left = np.maximum(n - kept.sum(axis=1), 1e-9)
    return np.asarray(n * np.sum((coefficients * (1 - kept)) ** 2, axis=1) / left**2)


def _end_slopes(x: Floats) -> Floats:
    """A parabola with the slopes that ``x`` has at its ends, shape (n,)."""
    n = len(x)
    m = max(8, n // 20)
    t = np.arange(m) - 0.5
    # Quadratics: the slope of a curve that bends is not that of its chord, as where a unit begins to warm up.
    first = np.polyfit(t, x[:m], 2)[1]
    last = -np.polyfit(t, x[-m:][::-1], 2)[1]
    whole = np.arange(n)
    return first * whole + 0.5 * (last - first) * whole**2 / n
