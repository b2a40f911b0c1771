r"""How fast a motion may be for a measured reference to tell an instrument's errors.

    y = g x + e,      u = x + v        x the motion, v the errors of its reference, e those of the instrument

v makes a gain that is fitted too small by the ratio of powers |v|^2 / |u|^2, and the fit never knows whose the rest is:
at each frequency up to |r|^2 / |u|^2 with r = y - g u. Weighted by its power over that of the rest, s = |u|^2 / |r|^2,
as a fit weights n modes, the gain is off by at most

    sum_k s_k (1 / s_k) / sum_k s_k = n / sum s        beside its standard deviation (sum s)^-1/2

Slow modes have nearly all of s, fast ones all of n: an attitude by cameras follows a hand to a thousandth at 0.5 Hz
and to a quarter at 10 Hz, and with the latter in the fit the gain is 3 % short, from which drifts and curves follow.
So modes are taken up to the frequency up to which the one is no more than the other, n^2 <= sum s, or up to which
nearly all of the motion is: bins are as long as that. A reference without errors of its own tells at all frequencies.
"""

from __future__ import annotations

import numpy as np

from insenv.core.recording import Floats, Recording
from insenv.data.reference import order
from insenv.identify.clean.response import FAR, Stretch, fitted, stretches

#: Share of the square sum of the rate that bins must leave, modes of a band at least, and the ratio of its ends.
MOTION, FEWEST, RATIO = 0.9, 8, 1.25


def rows_told(recordings: tuple[Recording, ...], spans: tuple[slice, ...], target: str) -> int:
    """Rows of a bin that holds no faster motion than the references tell; 1 where they have no errors of their own.

    Parameters
    ----------
    recordings : tuple of Recording
    spans : tuple of slice
        Rows that are looked at in each, contiguous and fitted.
    target : str
    """
    if not target.startswith("gyro") or not all(map(doubtful, recordings)):
        return 1
    parts = stretches(recordings, spans, target)
    if not parts:
        return 1
    spectra = [_spectra(one) for one in parts]
    frequency, motion, left = (np.concatenate(each) for each in zip(*spectra, strict=True))
    return max(1, int(0.5 / (_told_until(frequency, motion, left) * recordings[0].dt)))


def doubtful(recording: Recording) -> bool:
    """Whether the reference of a recording has errors of its own: noise, or rows at which it was not read."""
    channel = next((recording.channels[name] for name in order(recording)), None)
    if channel is None or channel.source != "encoder":
        return False
    noisy = recording.table is not None and not recording.table.still
    return noisy or channel.every > 0


def _told_until(frequency: Floats, motion: Floats, left: Floats) -> float:
    """The frequency up to which modes are taken [Hz], of the powers of the motion and of what is left in each mode."""
    by = np.argsort(frequency)
    frequency, motion, left = frequency[by], motion[by], left[by]
    whole = np.cumsum(motion)
    moved = float(frequency[np.searchsorted(whole, MOTION * whole[-1])])
    told, n, total, start = moved, 0, 0.0, 0
    while start < len(frequency):
        stop = max(start + FEWEST, int(np.searchsorted(frequency, RATIO * frequency[start], side="right")))
        power, rest = float(motion[start:stop].sum()), float(left[start:stop].sum())
        n += len(frequency[start:stop])
        total += len(frequency[start:stop]) * power / max(rest, 1e-300)
        if n**2 <= total:
            told = max(told, float(frequency[min(stop, len(frequency)) - 1]))
        start = stop
    return told


def _spectra(one: Stretch) -> tuple[Floats, Floats, Floats]:
    """Frequencies of a stretch's modes [Hz], the powers of its motion in them, and of what is left beside it."""
    from scipy.fft import dct  # slow to import

    motion = one.exposure.motion
    gain, _, lags = fitted([one], {one.run: motion.lag}, {one.run})
    u, known = gain * one.input(lags[one.run]), one.known > 0
    left = np.where(known, one.y - u - np.median((one.y - u)[known]), 0.0)
    # A few rows far off are no error of the reference; that of a table which rests half of the time is in the others.
    bound = FAR * float(np.sqrt(np.mean(left[known] ** 2)))
    left = np.clip(left, -bound, bound)
    n = len(u)
    of_motion, of_rest = dct(u, norm="ortho")[1:] ** 2, dct(left, norm="ortho")[1:] ** 2
    return np.arange(1.0, n) / (2 * n * motion.dt), of_motion, of_rest
