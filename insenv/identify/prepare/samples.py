"""The samples of a channel by frequency, up to half the sampling rate, with the lines that were found in them.

    S(f) = dt |sum w x exp(-2 pi i f t)|^2 / sum w^2        w: Hann

of the longest stretch that may be fitted, less what the declared effects explain. A report draws it; nothing else does.
"""

from __future__ import annotations

import numpy as np

from insenv.core.recording import Floats
from insenv.identify.findings import SampleSpectrum
from insenv.identify.prepare.lines import Line, periodogram

#: Fewest samples that have a spectrum; bins of a decade in which the mean and the largest value are told.
SHORTEST, PER_DECADE = 256, 80


def sample_spectrum(values: Floats, dt: float, lines: tuple[Line, ...], width: float) -> SampleSpectrum | None:
    """Spectrum of samples every ``dt`` seconds, whose means over ``width`` are fitted; None of a short stretch."""
    if len(values) < SHORTEST or not np.isfinite(values).all() or not np.ptp(values) > 0:
        return None
    found = periodogram(values, dt)
    keep = slice(2, len(found.f) - 1)  # neither the mean, which a window spreads over two, nor half the sampling rate
    f, density = found.f[keep], found.power[keep] * dt
    label = np.floor(np.log10(f) * PER_DECADE)
    starts = np.flatnonzero(np.concatenate([[True], np.diff(label) != 0]))
    count = np.diff([*starts, len(f)])
    return SampleSpectrum(
        f=np.add.reduceat(f, starts) / count,
        density=np.add.reduceat(density, starts) / count,
        largest=np.maximum.reduceat(density, starts),
        nyquist=0.5 / dt,
        width=width,
        lines=tuple((line.frequency, line.steady) for line in lines),
    )
