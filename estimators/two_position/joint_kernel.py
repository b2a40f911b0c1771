r"""The pass of `estimators.two_position.joint` over the blocks of a run.

Mean velocities of blocks of length T have, beside what the parameters make of them, the noise

    a' = w_a,     v' = a + w_v,     z = mean of v over the block + white,

with a the horizontal force that the walk of the attitude makes. Residual and regressors run side by side through its
Kalman filter, whose gains they share; the innovations are white. The velocity is free at the start of each rest, a goes
on: what the turn does to the velocity is no datum. Process and measurement noise of a block are correlated; with q_a
and q_v the densities,

    Q = [[q_v T + q_a T^3/3, q_a T^2/2], [., q_a T]],  N = [q_v T/2 + q_a T^3/8, q_a T^2/6],  R = q_v T/3 + q_a T^3/20.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from estimators.two_position.alignment_kernel import CELL, END, J_END, MEAN, TWIST_END, WHERE
from estimators.two_position.alignment_model import force
from insenv.core.compiled import patient

#: Variance of the velocity at the start of a rest [m^2/s^2]: it may be anything.
FREE = 1.0
#: Length of x, see `estimators.two_position.alignment`.
N = 12
assert TWIST_END == J_END + 9 and CELL == TWIST_END + 9


@patient
def scatter(cells, out):
    """Number and sum of squared second differences of mean velocities within a rest, both channels, per run (2,)."""
    for i in range(cells.shape[0]):
        n, total = 0.0, 0.0
        for k in range(2, cells.shape[1]):
            a, b, c = cells[i, k - 2], cells[i, k - 1], cells[i, k]
            if c[WHERE] >= 0.0 and a[WHERE] == c[WHERE] and b[WHERE] == c[WHERE]:
                for h in range(2):
                    d = c[MEAN + h] - 2.0 * b[MEAN + h] + a[MEAN + h]
                    total += d * d
                n += 2.0
        out[i, 0], out[i, 1] = n, total


@patient
def gather(  # noqa: C901, PLR0912, PLR0913, PLR0915 -- one loop over blocks; scratch is given
    x, cells, sway, noise, numbers, now, work, turned, twist, held, f, D, line, normal, walk
):
    """Normal equations of the residual at x, and the walk's force now.

    x : (R, N). cells : (R, K, CELL). sway : (R,), variance of the white part. noise : q_a, q_v,
    sampling interval (a mean is of samples at the ends of theirs), speed and time constant of what a turn leaves.
    normal : (R, N + 1, N + 1), sums of whitened products, the residual last. walk : (R, 2, N + 2), for each channel the
    force of regressors and residual, and its variance. line : scratch of shape (2, 4, N + 1): velocity, force of noise
    filter, and model's velocity. The rest is scratch, or as in `force`.
    """
    qa, qv, dt, speed, tau = noise
    for i in range(x.shape[0]):
        normal[i, :, :] = 0.0
        line[:, :, :] = 0.0
        p00, p01, p11 = 0.0, 0.0, 0.0
        rest, before, began = -1.0, 0.0, 0.0
        for k in range(cells.shape[1]):
            cell = cells[i, k]
            if cell[WHERE] < 0.0:
                continue
            end = cell[END]
            T = end - (cells[i, k - 1, END] if k else 0.0)
            start = end - T
            if cell[WHERE] != rest or start - before > 0.5 * T:
                p11 += qa * (start - before)
                p00, p01 = FREE, 0.0
                if cell[WHERE] != rest:
                    began = start
                rest = cell[WHERE]
                line[:, 0, :] = 0.0
                line[:, 2, :] = 0.0
            before = end
            for j in range(9):
                early = cells[i, k - 1, J_END + j] if k else 0.0
                turned[j] = 0.5 * (early + cell[J_END + j])
                held[j] = (cell[J_END + j] - early) / T
                twist[j] = cell[TWIST_END + j]  # a block lies in a rest: it stays
            force(x[i], 0.5 * (start + end), turned, twist, held, numbers, work, f, D)
            # Prediction shared by all columns: z = v + a T / 2.
            n0, n1 = qv * T / 2 + qa * T**3 / 8, qa * T * T / 6
            white = sway[i]
            if rest > 0.0:
                white += (speed * math.exp((began - start) / tau)) ** 2
            s = p00 + p01 * T + p11 * T * T / 4 + qv * T / 3 + qa * T**3 / 20 + white
            c0 = p00 + 1.5 * T * p01 + 0.5 * T * T * p11 + n0
            c1 = p01 + 0.5 * T * p11 + n1
            k0, k1 = c0 / s, c1 / s
            for h in range(2):
                one = line[h]
                for j in range(N + 1):
                    # What the model makes of the mean velocity, and the velocity at the end.
                    push = D[h, j] if j < N else f[h]
                    mean = one[2, j] + 0.5 * (T + dt) * push
                    one[2, j] += T * push
                    z = mean if j < N else cell[MEAN + h] - mean
                    e = z - one[0, j] - 0.5 * T * one[1, j]
                    one[0, j] += T * one[1, j] + k0 * e
                    one[1, j] += k1 * e
                    one[3, j] = e
                for j in range(N + 1):
                    e = one[3, j] / s
                    for m in range(j + 1):
                        normal[i, j, m] += e * one[3, m]
            p00 = p00 + 2 * T * p01 + T * T * p11 + qv * T + qa * T**3 / 3 - k0 * c0
            p01 = p01 + T * p11 + qa * T * T / 2 - k0 * c1
            p11 = p11 + qa * T - k1 * c1
        for j in range(N + 1):
            for m in range(j):
                normal[i, m, j] = normal[i, j, m]
        for h in range(2):
            for j in range(N + 1):
                walk[i, h, j] = line[h, 1, j]
            walk[i, h, N + 1] = p11 + qa * (now - before)
