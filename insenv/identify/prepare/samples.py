"""The samples of a channel by frequency, up to half the sampling rate, with the lines that were found in them.

    S(f) = dt |sum w x exp(-2 pi i f t)|^2 / sum w^2        w: Hann

of the longest stretch that may be fitted, less what the declared effects explain. A report draws it, and humps above
the bin rate are told from it: bands that are louder than the median of half a decade beside, far beyond chance.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.ndimage import median_filter

from insenv.core.recording import Floats
from insenv.core.series.allan import QUANTIZATION
from insenv.core.series.stretches import stretches
from insenv.effects.noise import readings_density
from insenv.identify.findings import SampleSpectrum
from insenv.identify.fit.problem import NOISE_TERMS
from insenv.identify.prepare.excess import TOLERANCE
from insenv.identify.prepare.spectral.lines import Line, periodogram

#: Fewest samples that have a spectrum; bins of a decade in which the mean and the largest value are told.
SHORTEST, PER_DECADE = 256, 80
#: How many times as loud as beside it a hump is everywhere and in the mean, and as half a decade below it, which side
#: lobes of a filter are not; deviations of the mean, fewest bins of a hump, and bins beside it.
LOUDER, HUMP, BELOW, DEVIATIONS, BROAD, BESIDE = 1.3, 1.5, 1.2, 7.0, 4, 41
#: Frequency in bins from which on means leave most of a hump out, and frequencies of a window that tell one figure.
ABOVE_BINS, HANN = 0.3, 1.5


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


def beyond_declared(spectrum: SampleSpectrum, declared: Mapping[str, float]) -> tuple[tuple[float, float, float], ...]:
    """Of the bands of `humps` those in which rows are louder than declared noise (by effect id, SI): from, to, times.

    Rounding that nobody declared rises with the frequency, as in the quietest part of the spectrum at most.
    """
    f, dt = spectrum.f, 0.5 / spectrum.nyquist
    terms = {term.id: term for term in NOISE_TERMS}
    known = {key: np.array([value]) for key, value in declared.items() if key in terms}
    if not known:
        return ()
    told = sum((readings_density(terms[key], c, f, dt) for key, c in known.items()), np.zeros(len(f)))
    rises = readings_density(terms[QUANTIZATION], np.ones(1), f, dt)
    rounded = 0.0 if QUANTIZATION in known else float(np.min(spectrum.density / rises))
    most = told * (1 + TOLERANCE) ** 2 + rounded * rises
    found = []
    for low, high, _ in humps(spectrum):
        inside = (f >= low) & (f <= high)
        if float(np.mean((spectrum.density / most)[inside])) > LOUDER:
            found.append((low, high, float(np.mean((spectrum.density / told)[inside]))))
    return tuple(found)


def humps(spectrum: SampleSpectrum) -> tuple[tuple[float, float, float], ...]:
    """Bands without a line that the means leave out and that hold more than noise: from, to [Hz], times that beside."""
    f, ratio = spectrum.f, spectrum.density / median_filter(spectrum.density, BESIDE, mode="nearest")
    inside = (ratio > LOUDER) & (f * spectrum.width > ABOVE_BINS)
    # The lowest bin holds one frequency, the third of the periodogram; a bin at f so many.
    told = np.maximum(1.0, 2 * f / f[0] * (10 ** (1 / PER_DECADE) - 1)) / HANN
    found = []
    for a, b in stretches(inside):
        weight = told[a:b]
        times = float(ratio[a:b] @ weight / weight.sum())
        low = float(np.median(spectrum.density[max(a - BESIDE, 0) : a])) if a else np.inf
        lobe = float(spectrum.density[a:b] @ weight / weight.sum()) < BELOW * low
        sure = (times - 1) * float(np.sqrt(weight.sum())) > DEVIATIONS
        line = any(f[a] * 0.97 < one < f[b - 1] * 1.03 for one, _ in spectrum.lines)
        if b - a >= BROAD and times > HUMP and sure and not lobe and not line:
            found.append((float(f[a]), float(f[b - 1]), times))
    return tuple(found)
