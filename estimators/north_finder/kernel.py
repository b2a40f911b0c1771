r"""Blocks of increments, whitened exactly, into normal equations: the loop of `estimators.north_finder.gls`.

With x_k what the increments of one column are (the residual angle, or a regressor) and phi_k their running sum,
the mean of phi over each block of m samples is taken and neighbouring blocks are differenced,

    d_b = mean phi (block b) - mean phi (block b - 1).

Of a white angle error Q and an angle random walk N, with T = m dt, the differences have a tridiagonal covariance,

    c0 = N^2 T (2/3 + 1 / 3 m^2) + 2 Q^2 / m,     c1 = N^2 T (1/6 - 1 / 6 m^2) - Q^2 / m,

so they are a moving average of order one, whose innovations are exact from the first difference on:

    e_b = d_b - (c1 / v_(b-1)) e_(b-1),     v_b = c0 - c1^2 / v_(b-1),     v_first = c0.

The sum of e e' / v over the chain, with the regressors and the residual side by side in e, holds the normal
equations. A change of rate ends a chain, and the angle is free before the next: what an instrument does while it
passes through its dead zone is in no model.

Numbers of a row stand in one array, so that chunks and batches do not matter: each row runs through the same loop
alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from insenv.core.compiled import jit
from insenv.core.recording import Floats

#: Highest harmonic of the encoder.
ORDERS = 4
#: Places in the array of a row.
SEEN, ANGLE, TIME, COUNT, BAD, COS, SIN, BEGAN, TURN, VARIANCE, FORWARD, BACKWARD, USED = range(13)
SUMS = 13
#: Sums over a block: residual, cosine, sine, rate (plain and times the place of the sample), angle.
_N_SUMS = 9
_FOLLOWED = SUMS + _N_SUMS
#: Below this turn between samples [rad] a series stands for sine and cosine, to the last digit.
_SMALL = 0.05
#: Slower than this the table stands still [rad/s].
_REST = 1e-4


def columns(degree: int, bias_degree: int) -> int:
    """Number of columns: c, s, scale factor and bias of each degree, harmonics, residual."""
    return 2 + (degree + 1) + (bias_degree + 1) + 2 * ORDERS + 1


def padded(size: int) -> int:
    """Columns with zeros behind them, so that a line is a whole number of the processor's vectors."""
    return -(-size // 4) * 4


def width(size: int) -> int:
    """Length of the array of a row: the block before and the innovation before, of all columns, follow the sums."""
    return _FOLLOWED + 2 * padded(size)


@lru_cache
def compiled() -> Callable[..., None]:
    """The loop, compiled when it is first asked for: numba costs more to import than the rest."""
    # A product and a sum may be rounded as one: a sixth faster, and the same for every row and chunk.
    loop: Callable[..., None] = jit(accumulate, fastmath={"contract"})
    return loop


def accumulate(  # noqa: C901, PLR0912, PLR0913, PLR0915 -- one loop over samples; numba wants it in one function
    gyro: Floats,
    angle: Floats,
    t: Floats,
    rows: Floats,
    normal: Floats,
    numbers: Floats,
    m: int,
    degree: int,
    bias_degree: int,
) -> None:
    """Take a chunk into ``rows`` and ``normal``, both changed in place.

    Parameters
    ----------
    gyro, angle : ndarray, shape (R, n)
        Rate [rad/s], and table angle at the ends of the intervals [rad].
    t : ndarray, shape (n,)
        Those ends [s].
    rows : ndarray, shape (R, width)
    normal : ndarray, shape (R, padded columns, padded columns)
    numbers : ndarray
        dt, share of the table's rate, vertical Earth rate, span, c0, c1, relative change of rate that ends a chain,
        change of turn that noise alone makes.
    m : int
        Samples per block.
    degree, bias_degree : int
        Of the polynomials.
    """
    dt, share, vertical, span, c0, c1, relative, absolute = numbers
    n_columns = normal.shape[1]
    n_poly = degree + 1
    n_bias = bias_degree + 1
    first_harmonic = 2 + n_poly + n_bias
    last = first_harmonic + 2 * ORDERS
    before, carried = _FOLLOWED, _FOLLOWED + n_columns
    e = np.empty(n_columns)
    d = np.zeros(n_columns)
    after = np.zeros(n_columns)
    late, per_m = 0.5 * dt * (m - 1), 1.0 / m
    for r in range(gyro.shape[0]):
        row = rows[r]
        i = 0
        n = gyro.shape[1]
        if row[SEEN] == 0.0 and n > 0:
            row[SEEN], row[ANGLE], row[TIME] = 1.0, angle[r, 0], t[0]
            i = 1
        while i < n:
            a0 = row[ANGLE]
            l0 = int(row[COUNT])
            if l0 == 0:
                row[BEGAN], row[COS], row[SIN] = a0, math.cos(a0), math.sin(a0)
                row[BAD] = 0.0
                for j in range(SUMS, _FOLLOWED):
                    row[j] = 0.0
            stop = min(n, i + m - l0)
            if t[stop - 1] - row[TIME] > (stop - i + 0.5) * dt:
                row[BAD] = 1.0
            y0, y1, f0, f1, g0, g1 = row[13], row[14], row[15], row[16], row[17], row[18]
            u0, u1, around = row[19], row[20], row[21]
            c, s = row[COS], row[SIN]
            place = float(l0)
            for k in range(i, stop):
                a = angle[r, k]
                turn = a - a0
                a0 = a
                if abs(turn) < _SMALL:
                    x = turn * turn
                    even = 1 - x * (1 / 6 - x * (1 / 120 - x * (1 / 5040)))
                    odd = turn * (0.5 - x * (1 / 24 - x * (1 / 720 - x * (1 / 40320))))
                else:
                    even = math.sin(turn) / turn
                    odd = (1 - math.cos(turn)) / turn
                # Means of cosine and sine over the interval, times its length; then the wave at its end.
                mean_c, mean_s = dt * (c * even - s * odd), dt * (s * even + c * odd)
                p, q = 1 - turn * odd, turn * even
                c, s = c * p - s * q, s * p + c * q
                u = share * turn + vertical * dt
                y = gyro[r, k] * dt - u
                y0 += y
                y1 += place * y
                f0 += mean_c
                f1 += place * mean_c
                g0 += mean_s
                g1 += place * mean_s
                u0 += u
                u1 += place * u
                place += 1.0
                around += a
            row[13], row[14], row[15], row[16], row[17], row[18] = y0, y1, f0, f1, g0, g1
            row[19], row[20], row[21] = u0, u1, around
            row[COS], row[SIN] = c, s
            row[ANGLE], row[TIME], row[COUNT] = a0, t[stop - 1], float(l0 + stop - i)
            i = stop
            if row[COUNT] < m:
                continue
            # A block is full. ``after``: what of it stays for the next; ``d``: the difference to the block before.
            row[COUNT] = 0.0
            f1, g1, u1, y1 = f1 * per_m, g1 * per_m, u1 * per_m, y1 * per_m
            after[0], after[1], after[last] = f1, g1, y1
            d[0], d[1], d[last] = f0 - f1, g0 - g1, y0 - y1
            x = 2 * (t[stop - 1] - 0.5 * m * dt) / span - 1
            # One value for a block: its slope cancels between two blocks, its curvature is of lower degree.
            value, value_before = 1.0, 0.0
            for j in range(n_poly):
                k = 2 + j
                after[k], d[k] = value * u1, value * (u0 - u1)
                if j < n_bias:
                    after[k + n_poly], d[k + n_poly] = value * late, value * (dt * m - late)
                value, value_before = ((2 * j + 1) * x * value - j * value_before) / (j + 1), value
            # Of even steps x the mean of exp(i n a) is that of their middle times sin(n m x / 2) / (m sin(n x / 2)).
            turned = a0 - row[BEGAN]
            x = 0.5 * turned
            c, s = math.cos(around * per_m), math.sin(around * per_m)
            cos_m, sin_m, cos_1, sin_1 = math.cos(x), math.sin(x), math.cos(x * per_m), math.sin(x * per_m)
            wave_c, wave_s, pc, ps, qc, qs = share * per_m, 0.0, 1.0, 0.0, 1.0, 0.0
            for j in range(ORDERS):
                wave_c, wave_s = wave_c * c - wave_s * s, wave_c * s + wave_s * c
                pc, ps = pc * cos_m - ps * sin_m, pc * sin_m + ps * cos_m
                qc, qs = qc * cos_1 - qs * sin_1, qc * sin_1 + qs * cos_1
                factor = ps / qs if abs(qs) > 1e-9 else float(m)
                k = first_harmonic + 2 * j
                d[k], d[k + 1] = factor * wave_c, factor * wave_s
                after[k], after[k + 1] = -d[k], -d[k + 1]
            largest = max(abs(turned), abs(row[TURN]))
            joined = (
                row[BAD] == 0.0
                and abs(turned - row[TURN]) <= relative * largest + absolute
                and largest > _REST * m * dt + 2 * absolute
            )
            if joined:
                if row[VARIANCE] > 0.0:
                    ratio = c1 / row[VARIANCE]
                    variance = c0 - c1 * ratio
                else:
                    ratio, variance = 0.0, c0
                for j in range(n_columns):
                    e[j] = row[before + j] + d[j] - ratio * row[carried + j]
                    row[carried + j] = e[j]
                weight = 1 / variance
                for j in range(n_columns):
                    weighed = weight * e[j]
                    line = normal[r, j]
                    for i_ in range(n_columns):
                        line[i_] += weighed * e[i_]
                row[VARIANCE] = variance
                row[USED] += m * dt
                if turned > 0:
                    row[FORWARD] += turned
                else:
                    row[BACKWARD] -= turned
            else:
                row[VARIANCE] = 0.0
            row[TURN] = turned if row[BAD] == 0.0 else np.nan
            for j in range(n_columns):
                row[before + j] = after[j]
