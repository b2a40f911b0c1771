r"""Encoders that are off, compiled: true angles of readings, and readings of true angles.

    theta = r - c cos r - s sin r

Neighbours that are the same, where a table rests, are computed once. The converse is found by putting the right side's
r in again: errors of 1e-4 rad leave 1e-16 of it after three times.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from insenv.core.compiled import jit, patient

_TIMES = 3


@jit
def _off(reading, c, s):
    return c * math.cos(reading) + s * math.sin(reading)


@patient
def true_angles(readings, errors, out):
    """Of readings of shape (R, n), for cosines and sines of shape (R, 2), into ``out``."""
    for row in range(readings.shape[0]):
        c, s, off = errors[row, 0], errors[row, 1], 0.0
        for i in range(readings.shape[1]):
            if i == 0 or readings[row, i] != readings[row, i - 1]:
                off = _off(readings[row, i], c, s)
            out[row, i] = readings[row, i] - off


@patient
def readings(angles, errors, out):
    """Of true angles of shape (R, n); the converse of `true_angles`."""
    for row in range(angles.shape[0]):
        c, s, off = errors[row, 0], errors[row, 1], 0.0
        for i in range(angles.shape[1]):
            if i == 0 or angles[row, i] != angles[row, i - 1]:
                off = 0.0
                for _ in range(_TIMES):
                    off = _off(angles[row, i] + off, c, s)
            out[row, i] = angles[row, i] + off
