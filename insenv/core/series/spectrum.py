"""Power spectral density of rate data, two-sided.

Convention: S(f) is the two-sided density at f > 0, in (unit of the rate)^2 / Hz, so that white rate noise
with angle random walk N has S(f) = N^2, the variance of its samples is N^2 / dt and its Allan variance N^2 /
tau. A one-sided density is twice this.

Estimated by Welch's method with Hann windows that overlap by half. The interval of confidence is chi-square
with 36 K^2 / (19 K - 1) degrees of freedom for K segments: Percival and Walden, Spectral Analysis for
Physical Applications (1993), equation 292b.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insenv.core.errors import InputError

Floats = NDArray[np.float64]


class Density(NamedTuple):
    """Two-sided density with its confidence interval.

    f : shape (k,), Hz, above zero and below half the sampling rate
    density, lower, upper : shape (..., k), (unit of the rate)^2 / Hz
    """

    f: Floats
    density: Floats
    lower: Floats
    upper: Floats


def psd(rate: ArrayLike, dt: float, segments: int = 15, *, confidence: float = 0.6827) -> Density:
    """Density of evenly sampled rates without gaps, the mean of each segment removed.

    rate : shape (..., n), any unit; dt : s; segments : half-overlapping pieces, more of them for less
    scatter and less resolution; confidence : probability that the interval covers the density, for Gaussian
    noise.

    Raises InputError for rates that are not finite or too few (each segment wants at least 8).
    """
    from scipy.special import chdtri  # here and not above: slow to import

    rate = np.asarray(rate, dtype=np.float64)
    n = rate.shape[-1] if rate.ndim else 0
    length = 2 * n // (segments + 1)
    if length < 8 or not np.isfinite(rate).all():
        raise InputError(
            f"a spectrum of {segments} segments was asked for of {n} rates; "
            f"wanted at least {4 * (segments + 1)} rates, all of them finite"
        )
    # As `scipy.signal.welch`, which takes longer to import than most recordings take to be evaluated.
    pieces = np.lib.stride_tricks.sliding_window_view(rate, length, axis=-1)[..., :: length - length // 2, :]
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(length) / length)
    lines = np.fft.rfft(window * (pieces - pieces.mean(axis=-1, keepdims=True)))
    kept = slice(1, (length + 1) // 2)  # neither zero, taken out with the mean, nor half the sampling rate
    power = lines.real[..., kept] ** 2 + lines.imag[..., kept] ** 2
    density = np.asarray(power.mean(axis=-2) * dt / float(window @ window), np.float64)
    f = np.asarray(np.fft.rfftfreq(length, dt), np.float64)
    count = pieces.shape[-2]
    edf = 36.0 * count**2 / (19.0 * count - 1.0)
    tail = 0.5 * (1.0 - confidence)
    lower, upper = (edf / chdtri(edf, p) for p in (tail, 1.0 - tail))
    return Density(f[kept], density, density * lower, density * upper)
