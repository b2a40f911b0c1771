r"""The loop of `estimators.system_calibration.system_kalman`: navigation, covariance and update, sample by sample.

With a = (phi, dv) the errors of attitude and velocity, theta what is constant within a block and B its part in a,

    P_aa' = (Phi P_aa + B P_ta) Phi' + (Phi P_at + B P_tt) B' + Q,      P_at' = Phi P_at + B P_tt

P_tt is not touched. A column of B is the regressor times that of its channel in L, so that B P needs one sum over the
parameters of each channel,

    L = (1, 0; [f^n x] dt / 2, 1) diag(-C, C) K dt,      K = du / dy,

with K what an error of the outputs makes of the inputs, and half of what a sample adds to the attitude's error felt by
its velocity. At rest each component of the velocity is a scalar measurement.

The specific force in Phi stands straight up, as on a table that goes nowhere. Navigation takes a course of its own:
what is found of attitude and velocity stays in e, and at rest the course is put level by its velocity, v / (g tau) a
sample of length dt, and its velocity to zero; e is shifted by as much, which leaves what it says of the unit.

Each row runs alone through the same loop: chunks and batches make no difference.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import math

import numpy as np

from insenv.core.compiled import jit
from insenv.navigation.kernel import static_step, turn_of_navigation
from insenv.navigation.matrices import add_crossed, add_matrix

#: Places in the array of a row: quaternion, velocity, increments of the sample before, samples that levelled the
#: course, errors of attitude and velocity that are found, values of the other states.
QUATERNION, VELOCITY, BEFORE, LEVELLED, ERRORS, STATE = 0, 4, 7, 13, 14, 20
#: Time in which the course is levelled at rest [s].
LEVELLING = 5.0


@jit
def _lever(c, coupling, dt, fall, lever):
    """What errors of the six outputs add to those of attitude and velocity in a sample; fall: gravity's velocity.

    An attitude that errs by phi at the end of a sample erred by half of it on the way, which the velocity has felt.
    """
    for i in range(3):
        for ch in range(6):
            a, b = 0.0, 0.0
            for j in range(3):
                a += c[i, j] * coupling[j, ch]
                b += c[i, j] * coupling[3 + j, ch]
            lever[i, ch] = -dt * a
            lever[3 + i, ch] = dt * b
    for ch in range(6):
        lever[3, ch] -= 0.5 * fall * lever[1, ch]
        lever[4, ch] += 0.5 * fall * lever[0, ch]


@jit
def _onward(p, x, places, lever, fall, zeta, white, scratch):  # noqa: C901, PLR0912, PLR0913 -- plain loops
    """Covariance after a sample; fall: increment of velocity by the specific force."""
    sums, t, m = scratch
    size = p.shape[0]
    for ch in range(6):
        row = sums[ch]
        row[:] = 0.0
        for j in range(places[ch], places[ch + 1]):
            h, source = x[j], p[6 + j]
            for k in range(size):
                row[k] += h * source[k]
    for i in range(6):
        row, own = t[i], lever[i]
        for k in range(size):
            row[k] = p[i, k]
        for ch in range(6):
            if own[ch] != 0.0:
                h, source = own[ch], sums[ch]
                for k in range(size):
                    row[k] += h * source[k]
    add_crossed((-zeta[0], -zeta[1], -zeta[2]), p[0:3], t[0:3])
    add_crossed((0.0, 0.0, fall), p[0:3], t[3:6])
    for i in range(6):
        for ch in range(6):
            s = 0.0
            for j in range(places[ch], places[ch + 1]):
                s += x[j] * t[i, 6 + j]
            m[i, ch] = s
    for i in range(6):
        a, b, g = t[i, 0], t[i, 1], t[i, 2]
        p[i, 0] = a - (zeta[1] * g - zeta[2] * b)
        p[i, 1] = b - (zeta[2] * a - zeta[0] * g)
        p[i, 2] = g - (zeta[0] * b - zeta[1] * a)
        p[i, 3] = t[i, 3] - fall * b
        p[i, 4] = t[i, 4] + fall * a
        p[i, 5] = t[i, 5]
        for j in range(6):
            for ch in range(6):
                p[i, j] += lever[j, ch] * (m[i, ch] + lever[i, ch] * white[ch])
        for k in range(6, size):
            p[i, k] = t[i, k]
            p[k, i] = t[i, k]


@jit
def _errors_onward(e, x, places, h, lever, fall, zeta):
    """Errors of attitude and velocity that are found, after a sample."""
    a, b, g = e[0], e[1], e[2]
    e[0] = a - (zeta[1] * g - zeta[2] * b)
    e[1] = b - (zeta[2] * a - zeta[0] * g)
    e[2] = g - (zeta[0] * b - zeta[1] * a)
    e[3] -= fall * b
    e[4] += fall * a
    for ch in range(6):
        s = 0.0
        for j in range(places[ch], places[ch + 1]):
            s += h[j] * x[j]
        for i in range(6):
            e[i] += lever[i, ch] * s


@jit
def _at_rest(p, e, x, v, variance, gain):
    """Take the velocity for its error, which tells of all states."""
    size = p.shape[0]
    for i in range(3, 6):
        s = p[i, i] + variance
        left = (v[i - 3] - e[i]) / s
        for k in range(size):
            gain[k] = p[i, k]
        for k in range(6):
            e[k] += gain[k] * left
        for k in range(6, size):
            x[k - 6] += gain[k] * left
        for j in range(size):
            h, row = gain[j] / s, p[j]
            for k in range(size):
                row[k] -= h * gain[k]


@jit
def _turned(q, angles):
    """A quaternion after a small turn in axes of navigation."""
    e0, e1, e2 = 0.5 * angles[0], 0.5 * angles[1], 0.5 * angles[2]
    w = 1.0 / math.sqrt(1.0 + e0 * e0 + e1 * e1 + e2 * e2)
    return (
        w * (q[0] - (e0 * q[1] + e1 * q[2] + e2 * q[3])),
        w * (q[1] + e0 * q[0] + e1 * q[3] - e2 * q[2]),
        w * (q[2] + e1 * q[0] + e2 * q[1] - e0 * q[3]),
        w * (q[3] + e2 * q[0] + e0 * q[2] - e1 * q[1]),
    )


@jit
def run(inputs, columns, resting, places, coupling, numbers, variances, rows, cov):  # noqa: PLR0913, PLR0915
    """Run the rows on through a block, in place.

    inputs : shape (R, n, 6), rates and forces less what is declared. columns : (R, n, m), regressors of the states
    in units of their deviations, those of a channel together. resting : (R, n), not zero where the velocity is known
    to be zero at the end of a sample. places : (7,), first state of each channel. coupling : (R, 6, 6), K. numbers :
    dt, Earth's rate north and up, gravity, and six white densities. variances : (R,), of a velocity at rest.
    rows : (R, STATE + m). cov : (R, 6 + m, 6 + m). States beyond those of the channels stand.
    """
    dt, size = numbers[0], cov.shape[1]
    zeta = (0.0, numbers[1] * dt, numbers[2] * dt)
    fall, white = numbers[3] * dt, numbers[4:10] / dt
    navigation = turn_of_navigation(zeta)
    scratch = (np.empty((6, size)), np.empty((6, size)), np.empty((6, 6)))
    gain, c, lever = np.empty(size), np.empty((3, 3)), np.empty((6, 6))
    for i in range(rows.shape[0]):
        r, p = rows[i], cov[i]
        q, v = (r[0], r[1], r[2], r[3]), (r[4], r[5], r[6])
        a0, f0 = (r[7], r[8], r[9]), (r[10], r[11], r[12])
        e, x = r[ERRORS:STATE], r[STATE:]
        for n in range(inputs.shape[1]):
            h, u = columns[i, n], inputs[i, n]
            a, f = (u[0] * dt, u[1] * dt, u[2] * dt), (u[3] * dt, u[4] * dt, u[5] * dt)
            c[:, :] = 0.0
            add_matrix(q, c)
            q, v = static_step(q, v, a, f, (a0, f0), zeta, navigation, fall)
            add_matrix(q, c)
            a0, f0 = a, f
            _lever(c, coupling[i], dt, fall, lever)
            _errors_onward(e, x, places, h, lever, fall, zeta)
            _onward(p, h, places, lever, fall, zeta, white, scratch)
            if resting[i, n] != 0.0:
                _at_rest(p, e, x, v, variances[i], gain)
                r[LEVELLED] += 1.0
                share = max(1.0 / r[LEVELLED], dt / LEVELLING) / fall
                tilt = (share * v[1], -share * v[0], 0.0)
                q = _turned(q, tilt)
                for j in range(3):
                    e[j] -= tilt[j]
                    e[3 + j] -= v[j]
                v = (0.0, 0.0, 0.0)
        r[0], r[1], r[2], r[3] = q
        r[4], r[5], r[6] = v
        r[7], r[8], r[9] = a0
        r[10], r[11], r[12] = f0
