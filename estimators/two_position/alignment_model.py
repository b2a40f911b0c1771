r"""What the parameters of `estimators.two_position.alignment` make of forces and velocities, compiled.

    f' - g up = (E^T - 1) g up + C' nabla,      E = R_n' exp([phi x]) exp(-[(J b + S m) x]) R_n

and its derivatives: a change theta of the corrected frame, C <- exp([theta x]) C, changes f' by E^T (up x theta) g.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

from estimators.two_position.alignment_kernel import A_START, BEGAN, J_START, TWIST_START, frame
from insenv.core.compiled import jit, patient


@jit
def _rotation(v, out):
    """exp([v x]), shape (3, 3)."""
    s2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    if s2 < 1e-4:
        a = 1.0 - s2 * (1.0 / 6.0 - s2 * (1.0 / 120.0 - s2 / 5040.0))
        b = 0.5 - s2 * (1.0 / 24.0 - s2 * (1.0 / 720.0 - s2 / 40320.0))
    else:
        s = math.sqrt(s2)
        a, b = math.sin(s) / s, (1.0 - math.cos(s)) / s2
    out[0, 0], out[1, 1], out[2, 2] = 1 - b * (s2 - v[0] * v[0]), 1 - b * (s2 - v[1] * v[1]), 1 - b * (s2 - v[2] * v[2])
    out[0, 1], out[1, 0] = b * v[0] * v[1] - a * v[2], b * v[0] * v[1] + a * v[2]
    out[0, 2], out[2, 0] = b * v[0] * v[2] + a * v[1], b * v[0] * v[2] - a * v[1]
    out[1, 2], out[2, 1] = b * v[1] * v[2] - a * v[0], b * v[1] * v[2] + a * v[0]


@jit
def _product(a, b, out):
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]


@jit
def force(x, t, turned, twist, held, numbers, work, f, D):  # noqa: PLR0913 -- scratch is given, none made in a loop
    """Horizontal specific force in the computed frame less gravity, and its derivative by x.

    x : as of `estimators.two_position.alignment`. t : time. turned, twist, held : J, S of the turns and R_n C_b^n, nine
    numbers each. numbers : g, Earth rate north and up. work : scratch, shape (6, 3, 3). f : shape (2,). D : shape (2,
    12).
    """
    g = numbers[0]
    e0, e1, e, r, m = work[0], work[1], work[2], work[3], work[4]
    frame(t, (numbers[1], numbers[2]), r)
    psi, up = work[5, 0], numbers[2]
    for i in range(3):
        psi[i] = 0.0
        for j in range(3):
            # The Earth's rate about z is there all the time: with it a misalignment acts as a bias.
            psi[i] -= turned[3 * i + j] * (x[3 + j] + up * x[9 + j]) + twist[3 * i + j] * x[9 + j]
    _rotation(x[0:3], e0)
    _rotation(psi, e1)
    _product(e0, e1, e)
    # m = E' R_n, so that E^T = R_n' m' ... with E = R_n' e R_n: rows of E^T are R_n' e' R_n.
    for i in range(3):
        for j in range(3):
            m[i, j] = e[0, i] * r[0, j] + e[1, i] * r[1, j] + e[2, i] * r[2, j]
    for h in range(2):
        # Row h of E^T, then g (E^T [up x])_h, seen in the frame of t = 0.
        b0 = r[0, h] * m[0, 0] + r[1, h] * m[1, 0] + r[2, h] * m[2, 0]
        b1 = r[0, h] * m[0, 1] + r[1, h] * m[1, 1] + r[2, h] * m[2, 1]
        b2 = r[0, h] * m[0, 2] + r[1, h] * m[1, 2] + r[2, h] * m[2, 2]
        cx = r[0, h] * held[0] + r[1, h] * held[3] + r[2, h] * held[6]
        cy = r[0, h] * held[1] + r[1, h] * held[4] + r[2, h] * held[7]
        cz = r[0, h] * held[2] + r[1, h] * held[5] + r[2, h] * held[8]
        f[h] = g * b2 + cx * x[6] + cy * x[7] + cz * x[8]
        # up x theta = (-theta_N, theta_E, 0); theta = R_n' theta_0.
        q0 = g * (b1 * r[0, 0] - b0 * r[0, 1])
        q1 = g * (b1 * r[1, 0] - b0 * r[1, 1])
        q2 = g * (b1 * r[2, 0] - b0 * r[2, 1])
        # By phi_0: the left Jacobian, 1 + [phi x] / 2 to second order of its smallness.
        D[h, 0] = q0 + 0.5 * (q1 * x[2] - q2 * x[1])
        D[h, 1] = q1 + 0.5 * (q2 * x[0] - q0 * x[2])
        D[h, 2] = q2 + 0.5 * (q0 * x[1] - q1 * x[0])
        p0 = q0 * e0[0, 0] + q1 * e0[1, 0] + q2 * e0[2, 0]
        p1 = q0 * e0[0, 1] + q1 * e0[1, 1] + q2 * e0[2, 1]
        p2 = q0 * e0[0, 2] + q1 * e0[1, 2] + q2 * e0[2, 2]
        for j in range(3):
            D[h, 3 + j] = -(p0 * turned[j] + p1 * turned[3 + j] + p2 * turned[6 + j])
            D[h, 9 + j] = up * D[h, 3 + j] - (p0 * twist[j] + p1 * twist[3 + j] + p2 * twist[6 + j])
        D[h, 6], D[h, 7], D[h, 8] = cx, cy, cz


@patient
def polynomials(x, sums, dt, numbers, work, turned, f, D, a, B):  # noqa: PLR0913 -- as `force`
    """Coefficients of the velocity in x = t / T of a rest of length T, and their derivatives by the parameters.

    x : (R, 12). sums : (R, P, SUMS). a : (R, P, 2, 4), of powers 0 to 3, filled. B : (R, P, 2, 4, 12), filled.
    turned, f, D : scratch of shapes (9,), (3, 2), (3, 2, 12). The force is taken at the start, middle and end.
    """
    for i in range(x.shape[0]):
        for p in range(sums.shape[1]):
            rest = sums[i, p]
            twist = rest[TWIST_START : TWIST_START + 9]
            T = rest[0] * dt
            if T == 0.0:
                continue
            for k in range(3):
                s = 0.5 * k * T
                for j in range(9):
                    turned[j] = rest[J_START + j] + s * rest[A_START + j]
                # While the body rests, R_n C_b^n turns with the Earth.
                for j in range(3):
                    c0, c1, c2 = rest[A_START + j], rest[A_START + 3 + j], rest[A_START + 6 + j]
                    w0, w1, w2 = numbers[1] * c2 - numbers[2] * c1, numbers[2] * c0, -numbers[1] * c0
                    turned[j] += 0.5 * s * s * w0
                    turned[3 + j] += 0.5 * s * s * w1
                    turned[6 + j] += 0.5 * s * s * w2
                    work[6, 0, j], work[6, 1, j], work[6, 2, j] = c0 + s * w0, c1 + s * w1, c2 + s * w2
                force(x[i], rest[BEGAN] + s, turned, twist, work[6].ravel(), numbers, work, f[k], D[k])
            for h in range(2):
                y0, y1, y2 = f[0, h], f[1, h], f[2, h]
                a[i, p, h, 1] = T * y0
                a[i, p, h, 2] = T * 0.5 * (4 * y1 - 3 * y0 - y2)
                a[i, p, h, 3] = T * (2.0 / 3.0) * (y0 - 2 * y1 + y2)
                for j in range(12):
                    y0, y1, y2 = D[0, h, j], D[1, h, j], D[2, h, j]
                    B[i, p, h, 1, j] = T * y0
                    B[i, p, h, 2, j] = T * 0.5 * (4 * y1 - 3 * y0 - y2)
                    B[i, p, h, 3, j] = T * (2.0 / 3.0) * (y0 - 2 * y1 + y2)
