r"""North from whole revolutions, without an estimate of the scale factor.

Least squares of what is left of the increments when the table and the vertical Earth rate, g, are taken off,

    r_m = c cos_m dt + s sin_m dt + b g_m,        azimuth = atan2(s, c),

over all complete revolutions, with one b for each stretch of steady rate, where g is a constant but for what is
left of a change of rate: b holds bias and scale factor. Over whole revolutions at an even rate this is the
correlation with cosine and sine. A scale factor that runs away by eps over the time T leaks into it: over all
azimuths sigma = sqrt(2) eps tan(tilt) / (T w cos(latitude)), whatever the rate.

Source: Zhang, Wu and Wu, Opt. Precis. Eng. 19 (2011) 146, equation 1, with interval means instead of end angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import final

import numpy as np

from estimators.common.told import Errors, gyro_errors
from estimators.common.turns import (
    A0,
    CC,
    CS,
    GC,
    GS,
    LC,
    LS,
    SS,
    STRETCH,
    Revolutions,
    T,
    begin,
    compiled,
    follow,
    gyro_axis,
    patiently,
)
from estimators.north_finder.spread import azimuth, level_rate, solved
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Recording


@final
@dataclass(frozen=True)
class Correlation:
    """Azimuth by correlation over whole revolutions.

    The azimuth is that of a table in level (`estimators.north_finder.levelling`). The covariance holds what the data
    sheet tells of noise, pulses, encoder and of the changes of scale factor and bias
    (`estimators.north_finder.spread`). Before the first revolution is complete: 0 and pi^2 / 3.
    """

    datasheet: Datasheet

    def reset(self, batch: int | None = None) -> Revolutions:
        """No revolution yet."""
        return begin(batch)

    def update(self, state: Revolutions, chunk: Recording) -> Revolutions:
        """After a chunk with the channels "gyro" [rad/s] and "table_angle" [rad]."""
        return follow(state, self._errors.axis, chunk, "gyro", "rad/s")

    def estimate(self, state: Revolutions) -> Estimate:
        """Azimuth [rad] and its variance, shapes (..., 1) and (..., 1, 1)."""
        known, x, cov = solved(state, self._errors, weigh, 2)
        mean, variance, _ = azimuth(known, x, cov, level_rate(self.datasheet))
        return Estimate(("azimuth",), ("rad",), mean[..., None], variance[..., None, None])

    @cached_property
    def _errors(self) -> Errors:
        return gyro_errors(self.datasheet, gyro_axis(self.datasheet))


@patiently
def weigh(closed, count, coefficients, known, time):  # type: ignore[no-untyped-def]
    """Coefficients of the amplitudes of cosine and sine, one constant for each stretch."""
    for r in range(len(count)):
        known[r] = count[r] > 0 and _row(closed[r, : count[r]], coefficients[r])


@compiled
def _row(s, coefficients):  # type: ignore[no-untyped-def]
    matrix = np.zeros(4)
    first = 0
    while first < len(s):
        stop, g, gc, gs = first, 0.0, 0.0, 0.0
        # A gyro that lies in the table plane sees nothing of its turning: then time takes the place of g.
        flat = s[first, A0] == 0.0
        while stop < len(s) and s[stop, STRETCH] == s[first, STRETCH]:
            v = s[stop]
            g, gc, gs = (g + v[T], gc + v[LC], gs + v[LS]) if flat else (g + v[A0], gc + v[GC], gs + v[GS])
            stop += 1
        for j in range(first, stop):
            c, v = coefficients[j], s[j]
            c[0, 0], c[0, 1] = -gc / g, 1.0
            c[1, 0], c[1, 2] = -gs / g, 1.0
            for o in range(2):
                matrix[2 * o] += c[o, 0] * v[LC]
                matrix[2 * o + 1] += c[o, 0] * v[LS]
            for i, at in enumerate((CC, CS, CS, SS)):
                matrix[i] += v[at]
        first = stop
    return divide(coefficients, len(s), matrix[0], matrix[1], matrix[2], matrix[3])


@compiled
def divide(coefficients, count, a, b, c, d):  # type: ignore[no-untyped-def]
    """First two outputs divided by the matrix [[a, b], [c, d]]; whether that can be done."""
    det = a * d - b * c
    if not det > 1e-9 * (abs(a * d) + abs(b * c)):
        return False
    for j in range(count):
        for i in range(3):
            x, y = coefficients[j, 0, i], coefficients[j, 1, i]
            coefficients[j, 0, i] = (d * x - b * y) / det
            coefficients[j, 1, i] = (a * y - c * x) / det
    return True
