"""A line in the spectrum: dither, a motor, the mains, or an alias of one.

    c cos(2 pi f t) + s sin(2 pi f t)

with t from the start of the run; its mean over an interval is the value in the middle times sinc(pi f dt).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from insenv.core.motion import Motion
from insenv.core.recording import Floats
from insenv.effects.base import OUTPUT, CurveEffect, Param
from insenv.effects.forms import columns, spread


@final
@dataclass(frozen=True)
class Tone(CurveEffect):
    """One line of constant amplitude and phase.

    The standard deviation of ``f`` is that of a frequency read from a spectrum, not of all frequencies there
    are: a difference in steps of its thousandth must stay small against one cycle of the whole recording.
    """

    id = "tone"
    title = "tone"
    meaning = "a line at one frequency: dither, vibration, mains or a servo"
    linear = (Param("c", OUTPUT, sd=0.1, bound=10.0), Param("s", OUTPUT, sd=0.1, bound=10.0))
    shapes = (Param("f", "Hz", sd=1e-4, low=0.0),)
    source = "IEEE Std 952-1997, annex C: sinusoidal noise"
    line = True
    exact = True
    of_time = True

    def curve(self, u: Floats, motion: Motion, theta: Floats) -> Floats:
        """Mean of the line over each interval, shape (..., n)."""
        c, s, f = (theta[..., j, None] for j in range(3))
        phase = 2 * np.pi * f * motion.middle
        wave = c * np.cos(phase) + s * np.sin(phase)
        return spread(u, wave * np.sinc(f * motion.dt))

    def profile(self, u: Floats, motion: Motion, shape: Floats) -> Floats:
        """Cosine and sine, shape (..., n, 2)."""
        f = float(shape[0])
        phase, share = 2 * np.pi * f * motion.middle, np.sinc(f * motion.dt)
        return columns(u, share * np.cos(phase), share * np.sin(phase))

    def grid(self, motion: Motion) -> Floats:
        """Frequencies of the discrete Fourier transform [Hz], shape (n // 2, 1)."""
        return np.arange(1, motion.n // 2 + 1)[:, None] / (motion.n * motion.dt)
