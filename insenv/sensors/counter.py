r"""A pulse counter: whole pulses of an angle that passes, none of them lost.

    c_k = floor(p + v_1 + ... + v_k),    counts = c_k - c_{k-1}

with v the increments in pulses and p in [0, 1) the part of a pulse that had passed before the first of them. At rates
of many pulses per sample the angle error is uniform on one pulse q: the effect ``quantization`` with Q = q / sqrt(12).

The sum runs sample by sample on the part of a pulse alone, so that its rounding does not grow and chunks are the whole
bit for bit. That is a loop, which numba compiles when it is worth it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from insenv.core.compiled import jit, patient
from insenv.core.recording import Floats


def count(increments: Floats, phase: Floats | float, factor: float = 1.0) -> tuple[Floats, Floats]:
    """Whole pulses of each interval, and the part of a pulse that is left.

    Parameters
    ----------
    increments : ndarray, shape (..., n)
        Of the angle; times ``factor`` they are in pulses.
    phase : ndarray, shape (...), or float
        Part of a pulse in [0, 1) before the first interval: random at the start of a run, then as returned.
    factor : float

    Returns
    -------
    counts : ndarray, shape (..., n)
        Whole numbers.
    phase : ndarray, shape (...)
    """
    increments = np.asarray(increments, float)
    batch = increments.shape[:-1]
    if np.shape(phase) != batch:
        batch = np.broadcast_shapes(batch, np.shape(phase))
    n = increments.shape[-1]
    counts, left = np.empty((*batch, n)), np.empty(batch)
    left[...] = phase
    if increments.shape != counts.shape or not increments.flags.c_contiguous:
        increments = np.ascontiguousarray(np.broadcast_to(increments, counts.shape))
    _counted(increments.reshape(left.size, n), left.reshape(-1), counts.reshape(left.size, n), factor)
    return counts, left


def _count(increments: Any, phase: Any, counts: Any, factor: float) -> None:
    """Fill ``counts``, shape (rows, n), and go on with ``phase``, shape (rows,), in place."""
    rows, n = increments.shape
    # Each sum waits for the sample before; four rows side by side keep the processor busy.
    fours = rows - rows % 4
    for i in range(0, fours, 4):
        a, b, c, d = phase[i], phase[i + 1], phase[i + 2], phase[i + 3]
        for k in range(n):
            counts[i, k], a = _split(a + increments[i, k] * factor)
            counts[i + 1, k], b = _split(b + increments[i + 1, k] * factor)
            counts[i + 2, k], c = _split(c + increments[i + 2, k] * factor)
            counts[i + 3, k], d = _split(d + increments[i + 3, k] * factor)
        phase[i], phase[i + 1], phase[i + 2], phase[i + 3] = a, b, c, d
    for i in range(fours, rows):
        for k in range(n):
            counts[i, k], phase[i] = _split(phase[i] + increments[i, k] * factor)


@jit
def _split(angle: float) -> tuple[float, float]:
    """Whole pulses, and the part in [0, 1) that is left."""
    whole = np.floor(angle)
    part = angle - whole
    over = 1.0 if part >= 1.0 else 0.0  # from just below zero, by rounding
    return whole + over, part - over


_counted = patient(_count)
