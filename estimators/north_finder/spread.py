r"""Covariance of what is linear in the sums of revolutions.

An estimate x = sum_j C_j (N, Bc, Bs)_j weights the interval m by u_m = C_j (1, cos_m, sin_m). Its error has

    white noise N           N^2 sum_j C_j G_j C_j',  G_j the sums of dt (1, cos, sin) (1, cos, sin)'
    drifts                  the same with their density at one cycle a turn in the place of N^2; a walk leaks twice
                            that into the harmonics (mean of both)
    white angle error E     E^2 sum_m (u_m+1 - u_m)(u_m+1 - u_m)': the jumps where revolutions begin and end, and
                            2 pi^2 / n from within one of n intervals. E^2 = q^2/12 + (sin(tilt) encoder noise)^2
    declared effects        for each a column d(t, a): (sum_m u_m d_m dt)^2; the mean of all together, and each
                            parameter's derivative times its standard deviation

For one correlation over T whole revolutions the jumps give (2 / (T A))^2 E^2 (cos^2 a_n + cos^2 a_0) and the rest
(2 / (T A))^2 E^2 n da^2 / 2. The mean of a declared effect is not corrected for: it counts as an error whose sign
is unknown. What is declared and not in `estimators.common.told.KNOWN` is left out. A lock-in with the threshold W
counts as -W^2 / (2 u), a scale factor of -W^2 / (2 u^2).

The error of pulses is taken for white from turn to turn, within a turn at one rate it has the density of
`insenv.information.rate_noise.pulses`. Where noise and drift move the count of a revolution by much less than a
pulse it repeats from turn to turn: at a tenth of the published random walk the azimuth's deviation is told up to
twice too large, that of the scale factor a fifth too small.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin
from typing import Any

import numpy as np

from estimators.common.told import Errors
from estimators.common.turns import (
    ANGLE,
    BC,
    BS,
    CC,
    CS,
    F0,
    F1,
    LC,
    LS,
    SS,
    START,
    STRETCH,
    TURN,
    WAY,
    WIDTH,
    N,
    Revolutions,
    T,
    compiled,
    patiently,
)
from insenv.core.compiled import of_one_type
from insenv.core.earth import EARTH_RATE
from insenv.core.estimate import Datasheet
from insenv.core.recording import Floats

#: Places in a revolution, in shares of it, at which it is taken, and their weights: of Gauss and Legendre, exact to
#: 1e-9 for a line times a harmonic, so that what a pair of revolutions takes off cancels.
PLACES, WEIGHTS = (
    0.5 * (values + shift) for values, shift in zip(np.polynomial.legendre.leggauss(14), (1, 0), strict=True)
)
#: Variance of an azimuth that nothing is known of: uniform on the circle [rad^2].
ANYWHERE = np.pi**2 / 3


def level_rate(datasheet: Datasheet) -> float | None:
    """Horizontal Earth rate on the gyro's input axis [rad/s]; None where no latitude is told."""
    latitude = datasheet.site.latitude
    return None if latitude is None else float(EARTH_RATE * np.cos(latitude) * np.cos(datasheet.mounting.tilt))


def solved(turns: Revolutions, errors: Errors, weigh: Callable[..., Any], outputs: int) -> tuple[Any, Floats, Floats]:
    """Estimates of every row from the sums of its revolutions.

    Parameters
    ----------
    turns : Revolutions
    errors : Errors
    weigh : callable
        ``weigh(closed, count, coefficients, known, time)`` for all rows: fills the coefficients, shape (rows, m,
        outputs, 3), says whether anything is known and, with four outputs, at what time the scale factor.
    outputs : int
        2: amplitudes of cosine and sine; 4: scale factor and its rate besides.

    Returns
    -------
    known : ndarray of bool, shape (...)
    x : ndarray, shape (..., outputs)
    cov : ndarray, shape (..., outputs, outputs)
    """
    front, m = turns.count.shape, turns.closed.shape[-2]
    rows = turns.count.size
    closed, count = of_one_type(turns.closed.reshape(rows, m, WIDTH)), turns.count.reshape(rows)
    coefficients = np.zeros((rows, m, outputs, 3))
    known, time = np.zeros(rows, bool), np.zeros(rows)
    x, cov = np.zeros((rows, outputs)), np.zeros((rows, outputs, outputs))
    weigh(closed, count, coefficients, known, time)
    axis = (float(errors.axis.share), float(errors.axis.vertical))
    turning = TURN / np.where(closed[..., T] > 0, closed[..., T], np.inf)
    turning = np.maximum(turning, 1e-9)
    angle = errors.inside(turning * closed[..., WAY]), errors.angle_error**2
    noise = (errors.density(turning), angle, errors.axis.dt)
    _solve((closed, count, coefficients, known, time), (noise, errors.told, axis), x, cov)
    return known.reshape(front), x.reshape(*front, outputs), cov.reshape(*front, outputs, outputs)


def azimuth(known: Any, x: Floats, cov: Floats, level: float | None) -> tuple[Floats, Floats, Floats]:
    """Azimuth, its variance, and its derivative to the two amplitudes, shapes (...), (...), (..., 2).

    Where nothing is known, or as little as of a random direction, they are those of the prior: 0 and pi^2 / 3.
    """
    angle = np.arctan2(x[..., 1], x[..., 0])
    size = np.hypot(x[..., 0], x[..., 1]) if level is None else np.full(angle.shape, level)
    size = np.maximum(size, 1e-30)
    slope = np.stack([-np.sin(angle) / size, np.cos(angle) / size], axis=-1)
    a, b = slope[..., 0], slope[..., 1]
    variance = a * a * cov[..., 0, 0] + 2 * a * b * cov[..., 0, 1] + b * b * cov[..., 1, 1]
    good = known & (variance < ANYWHERE)
    return np.where(good, angle, 0.0), np.where(good, variance, ANYWHERE), np.where(good[..., None], slope, 0.0)


@patiently
def _solve(weighed, told, x, cov):  # type: ignore[no-untyped-def]
    """Every row: estimate and covariance, in place."""
    closed, count, coefficients, known, time = weighed
    noise, columns, axis = told
    for r in range(len(x)):
        if not known[r]:
            continue
        s, weights = closed[r, : count[r]], coefficients[r, : count[r]]
        for j in range(len(s)):
            for o in range(x.shape[1]):
                c = weights[j, o]
                x[r, o] += c[0] * s[j, N] + c[1] * s[j, BC] + c[2] * s[j, BS]
        _rate_noise(s, weights, noise[0][r], cov[r])
        _angle_noise(s, weights, (noise[1][0][r], noise[1][1]), noise[2], cov[r])
        for p in range(len(columns[0])):
            column = (columns[0][p], columns[1][p], columns[2], axis, time[r])
            _systematic(s, weights, column, cov[r])


@compiled
def _rate_noise(s, coefficients, density, cov):  # type: ignore[no-untyped-def]
    k = cov.shape[0]
    for j in range(len(s)):
        v = s[j]
        for o in range(k):
            a = coefficients[j, o]
            w0 = a[0] * v[T] + a[1] * v[LC] + a[2] * v[LS]
            w1 = a[0] * v[LC] + a[1] * v[CC] + a[2] * v[CS]
            w2 = a[0] * v[LS] + a[1] * v[CS] + a[2] * v[SS]
            for p in range(k):
                b = coefficients[j, p]
                cov[o, p] += density[j] * (w0 * b[0] + w1 * b[1] + w2 * b[2])


@compiled
def _angle_noise(s, coefficients, variances, dt, cov):  # type: ignore[no-untyped-def]
    k = cov.shape[0]
    within, variance = variances
    jump = np.zeros(k)
    for j in range(len(s)):
        v = s[j]
        inside = within[j] * 2 * np.pi**2 * dt / v[T]
        follows = j > 0 and s[j - 1, STRETCH] == v[STRETCH]
        last = j + 1 == len(s) or s[j + 1, STRETCH] != v[STRETCH]
        ca, sa = cos(v[ANGLE]), sin(v[ANGLE])
        for o in range(k):
            a = coefficients[j, o]
            jump[o] = a[0] + a[1] * ca + a[2] * sa
            if follows:
                b = coefficients[j - 1, o]
                jump[o] -= b[0] + b[1] * ca + b[2] * sa
        _jump(jump, variance * _ends(v[F0]), cov)
        if last:
            for o in range(k):
                a = coefficients[j, o]
                jump[o] = a[0] + a[1] * ca + a[2] * sa
            _jump(jump, variance * _ends(v[F1]), cov)
        for o in range(k):
            for p in range(k):
                a, b = coefficients[j, o], coefficients[j, p]
                cov[o, p] += inside * (a[1] * b[1] + a[2] * b[2])


@compiled
def _ends(share):  # type: ignore[no-untyped-def]
    """Squares of the shares on both sides of a boundary."""
    return share * share + (1 - share) * (1 - share)


@compiled
def _jump(jump, variance, cov):  # type: ignore[no-untyped-def]
    for o in range(len(jump)):
        for p in range(len(jump)):
            cov[o, p] += variance * jump[o] * jump[p]


@compiled
def _systematic(s, coefficients, column, cov):  # type: ignore[no-untyped-def]
    """Response to one declared column."""
    curves, harmonic, cell, axis, time = column
    response = np.zeros(cov.shape[0])
    for j in range(len(s)):
        v = s[j]
        rate = v[WAY] * TURN / v[T] * axis[0]
        u = rate + axis[1]
        for part, weight in zip(PLACES, WEIGHTS):  # noqa: B905 (compiled)
            a = v[ANGLE] + v[WAY] * TURN * part
            t = v[START] + v[T] * part
            ca, sa = cos(a), sin(a)
            d = u * _scale(curves, t, u, cell) + _at(curves[1], t, cell)
            d += rate * (harmonic[1] * ca - harmonic[0] * sa) + harmonic[2] * ca + harmonic[3] * sa
            d *= v[T] * weight
            for o in range(len(response)):
                c = coefficients[j, o]
                response[o] += d * (c[0] + c[1] * ca + c[2] * sa)
        if len(response) == 4 and v[START] <= time <= v[START] + v[T]:  # the scale factor itself is no error of it
            response[2] -= _scale(curves, time, u, cell)
            response[3] -= (_scale(curves, time + cell, u, cell) - _scale(curves, time - cell, u, cell)) / (2 * cell)
    _jump(response, 1.0, cov)


@compiled
def _scale(curves, t, u, cell):  # type: ignore[no-untyped-def]
    """Scale factor, with what a lock-in makes of it, at the rate ``u`` [rad/s]."""
    return _at(curves[0], t, cell) - (0.5 * _at(curves[2], t, cell) / (u * u) if u != 0.0 else 0.0)


@compiled
def _at(curve, t, cell):  # type: ignore[no-untyped-def]
    """Curve of means over cells, linear between their middles and beyond the last."""
    place = t / cell - 0.5
    i = min(max(int(place), 0), len(curve) - 2)
    return curve[i] + (curve[i + 1] - curve[i]) * (place - i)
