r"""The loops of `insenv.navigation.strapdown`, compiled; imported when a mechanisation is first asked for.

Over one interval of length dt, with the increments alpha [rad] and nu [m/s] of the triads in body axes, alpha' and
nu' those of the interval before, the rotation zeta = omega_in^n dt of the navigation frame, and the quaternion q of
C_b^n at the start:

    phi  = alpha + alpha' x alpha / 12                                       (coning)
    w    = nu + k1 alpha x nu + k2 alpha x (alpha x nu)                      (rotation during the interval)
              + (alpha' x nu + nu' x alpha) / 12                             (sculling)
    dv   = (1 - zeta x / 2 + zeta x zeta x / 12) C_b^n w
    q   <- exp(-zeta / 2) q exp(phi / 2)

with k1 = (1 - cos a) / a^2, k2 = (a - sin a) / a^3, a = |phi|. Coning and sculling are exact where rate and force
change linearly in time; the terms with k1 and k2 are exact where both are constant in body axes. The series in zeta
is that of z / (e^z - 1): exact to zeta^4 where the force is constant in the navigation frame, as on a static base.

Source: Savage, Strapdown inertial navigation integration algorithm design, part 1 (attitude) and part 2 (velocity),
J. Guidance, Control, and Dynamics 21 (1998) 19-28 and 208-221; the form with the previous increment and one sample
per update.

Each row runs through the same scalar code alone, without reordered sums: chunks and batches give the same bits.
"""

# mypy: disable-error-code="no-untyped-def"
# Vectors are tuples of floats here, which the compiler keeps in registers.

from __future__ import annotations

import math

from insenv.core import earth
from insenv.core.compiled import jit, patient

#: Half angles whose square is smaller need no library function: the first term left out is below 1e-17.
_SMALL = 0.01
#: Coefficients of cos x - 1 and of sin x / x in powers of x^2. (A division costs ten times a product.)
_C1, _C2, _C3, _C4, _C5 = ((-1.0) ** k / math.factorial(2 * k) for k in range(1, 6))
_S1, _S2, _S3, _S4, _S5, _S6 = ((-1.0) ** k / math.factorial(2 * k + 1) for k in range(1, 7))
_TWELFTH = 1.0 / 12.0

_RATE = earth.EARTH_RATE
_A = earth.SEMI_MAJOR_AXIS
_PER_A = 1.0 / earth.SEMI_MAJOR_AXIS
_E2 = earth.ECCENTRICITY_SQUARED
_F = earth.FLATTENING
_SLOPE = 1.0 + earth.FLATTENING + earth.CENTRIFUGAL_RATIO
_G = earth.EQUATOR_GRAVITY
_K = earth.SOMIGLIANA


@jit
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@jit
def _turns(v):
    """``exp(v / 2) - 1`` as a quaternion, and k1 and k2 of ``|v|``."""
    x2 = 0.25 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    if x2 < _SMALL:
        less = x2 * (_C1 + x2 * (_C2 + x2 * (_C3 + x2 * (_C4 + x2 * _C5))))
        ratio = 1.0 + x2 * (_S1 + x2 * (_S2 + x2 * (_S3 + x2 * _S4)))
        y = 4.0 * x2
        k2 = -(_S1 + y * (_S2 + y * (_S3 + y * (_S4 + y * (_S5 + y * _S6)))))
    else:
        x = math.sqrt(x2)
        ratio = math.sin(x) / x
        cosine = math.cos(x)
        less = cosine - 1.0
        k2 = (1.0 - ratio * cosine) / (4.0 * x2)
    half = 0.5 * ratio
    return (less, half * v[0], half * v[1], half * v[2]), 0.5 * ratio * ratio, k2


@jit
def _product(p, q):
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@jit
def _in_navigation_axes(q, w):
    """C_b^n w."""
    v = (q[1], q[2], q[3])
    t = _cross(v, w)
    t = (2.0 * t[0], 2.0 * t[1], 2.0 * t[2])
    u = _cross(v, t)
    return w[0] + q[0] * t[0] + u[0], w[1] + q[0] * t[1] + u[1], w[2] + q[0] * t[2] + u[2]


@jit
def _body(alpha, nu, alpha0, nu0):
    """``exp(phi / 2) - 1``, and w in body axes at the start of the interval."""
    c = _cross(alpha0, alpha)
    phi = (alpha[0] + c[0] * _TWELFTH, alpha[1] + c[1] * _TWELFTH, alpha[2] + c[2] * _TWELFTH)
    turn, k1, k2 = _turns(phi)
    once = _cross(alpha, nu)
    twice = _cross(alpha, once)
    s, r = _cross(alpha0, nu), _cross(nu0, alpha)
    w0 = nu[0] + k1 * once[0] + k2 * twice[0] + (s[0] + r[0]) * _TWELFTH
    w1 = nu[1] + k1 * once[1] + k2 * twice[1] + (s[1] + r[1]) * _TWELFTH
    w2 = nu[2] + k1 * once[2] + k2 * twice[2] + (s[2] + r[2]) * _TWELFTH
    return turn, (w0, w1, w2)


@jit
def _seen_from_turning_axes(zeta, u):
    """``(1 - zeta x / 2 + zeta x zeta x / 12) u``."""
    once = _cross(zeta, u)
    twice = _cross(zeta, once)
    return (
        u[0] - 0.5 * once[0] + twice[0] * _TWELFTH,
        u[1] - 0.5 * once[1] + twice[1] * _TWELFTH,
        u[2] - 0.5 * once[2] + twice[2] * _TWELFTH,
    )


@jit
def _turned(q, navigation, body):
    """``(1 + navigation) q (1 + body)``, normalised.

    The two small products cancel on a static base before they meet the large q: no drift from rounding.
    """
    n = _product(navigation, q)
    b = _product((q[0] + n[0], q[1] + n[1], q[2] + n[2], q[3] + n[3]), body)
    q0, q1, q2, q3 = q[0] + (n[0] + b[0]), q[1] + (n[1] + b[1]), q[2] + (n[2] + b[2]), q[3] + (n[3] + b[3])
    k = 0.5 * (1.0 - (q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3))  # a step of Newton's method
    return q0 + k * q0, q1 + k * q1, q2 + k * q2, q3 + k * q3


@jit
def _gravity(sin2, root, altitude):
    """Scalar form of `insenv.core.earth.gravity`; root : sqrt(1 - e^2 sin2)."""
    ratio = altitude * _PER_A
    surface = _G * (1.0 + _K * sin2) / root
    return surface * (1.0 - 2.0 * (_SLOPE - 2.0 * _F * sin2) * ratio + 3.0 * ratio * ratio)


@jit
def static_step(q, v, a, f, before, zeta, navigation, fall):  # noqa: PLR0913 -- scalars and short tuples
    """Quaternion and velocity after an interval with increments ``a`` and ``f``; ``before``: those of the last one."""
    body, w = _body(a, f, before[0], before[1])
    u = _seen_from_turning_axes(zeta, _in_navigation_axes(q, w))
    return _turned(q, navigation, body), (v[0] + u[0], v[1] + u[1], v[2] + (u[2] - fall))


@jit
def turn_of_navigation(zeta):
    """``exp(-zeta / 2) - 1`` as a quaternion, for `static_step`."""
    return _turns((-zeta[0], -zeta[1], -zeta[2]))[0]


@patient
def static(gyro, accelerometer, dt, keep, rows, results):
    """Run the rows on, in place: no velocity in Coriolis acceleration and transport rate.

    rows : shape (R, 16): quaternion 0-3, velocity 4-6, position 7-9, increments of the sample before 10-15.
    gyro, accelerometer : shape (1 or R, n, 3). keep : (first, step), samples whose result is stored.
    results : velocity and attitude, shapes (R, m, 3) and (R, m, 4), filled.
    """
    velocity, attitude = results
    many = gyro.shape[0] > 1
    for i in range(rows.shape[0]):
        r, k = rows[i], i if many else 0
        q, v = (r[0], r[1], r[2], r[3]), (r[4], r[5], r[6])
        a0, f0 = (r[10], r[11], r[12]), (r[13], r[14], r[15])
        sine = math.sin(r[7])
        zeta = (0.0, _RATE * math.cos(r[7]) * dt, _RATE * sine * dt)
        navigation = turn_of_navigation(zeta)
        fall = _gravity(sine * sine, math.sqrt(1.0 - _E2 * sine * sine), r[9]) * dt
        due, m = keep[0], 0
        for j in range(gyro.shape[1]):
            a = (gyro[k, j, 0], gyro[k, j, 1], gyro[k, j, 2])
            f = (accelerometer[k, j, 0], accelerometer[k, j, 1], accelerometer[k, j, 2])
            q, v = static_step(q, v, a, f, (a0, f0), zeta, navigation, fall)
            a0, f0 = a, f
            if j == due:
                velocity[i, m, 0], velocity[i, m, 1], velocity[i, m, 2] = v
                attitude[i, m, 0], attitude[i, m, 1], attitude[i, m, 2], attitude[i, m, 3] = q
                due += keep[1]
                m += 1
        r[0], r[1], r[2], r[3] = q
        r[4], r[5], r[6] = v
        r[10], r[11], r[12] = a0
        r[13], r[14], r[15] = f0


@jit
def _turning(rate, per, v, dt):
    """``omega_in dt`` and ``(2 omega_ie + omega_en) x v dt`` at the velocity v."""
    north, up = rate[0] * dt, rate[1] * dt
    zeta = (-v[1] * per[0], north + v[0] * per[1], up + v[0] * per[2])
    return zeta, _cross((zeta[0], zeta[1] + north, zeta[2] + up), v)


@jit
def _advance(u, v, p, dt):
    """Velocity and position after ``dt``, and zeta; the force's ``u`` is in the axes of the interval's start.

    Rates and gravity are those in the middle of the interval, from a first guess of the velocity there.
    """
    # To the middle of the interval a sphere is near enough, and a short step needs no second sine.
    d = 0.5 * dt * v[1] * _PER_A
    s = math.sin(p[0])
    c = math.cos(p[0])
    s, c = s + d * (c - 0.5 * d * s), c - d * (s + 0.5 * d * c)
    h = p[2] + 0.5 * dt * v[2]
    x = 1.0 - _E2 * s * s
    y = math.sqrt(x)
    per_north = dt * x * y / (_A * (1.0 - _E2) + h * x * y)
    per_east = dt * y / (_A + h * y)
    per_cosine = 1.0 / c
    rate, per = (_RATE * c, _RATE * s), (per_north, per_east, per_east * s * per_cosine)
    fall = _gravity(s * s, y, h) * dt
    # First to the middle with what holds at the start; the force is hardly seen to turn otherwise there.
    zeta, k = _turning(rate, per, v, dt)
    f = _seen_from_turning_axes(zeta, u)
    m = (v[0] + 0.5 * (f[0] - k[0]), v[1] + 0.5 * (f[1] - k[1]), v[2] + 0.5 * (f[2] - k[2] - fall))
    zeta, k = _turning(rate, per, m, dt)
    w = (v[0] + (f[0] - k[0]), v[1] + (f[1] - k[1]), v[2] + (f[2] - k[2] - fall))
    moved = (
        p[0] + 0.5 * (v[1] + w[1]) * per_north,
        p[1] + 0.5 * (v[0] + w[0]) * (per_east * per_cosine),
        p[2] + 0.5 * (v[2] + w[2]) * dt,
    )
    return w, moved, zeta


@patient
def full(gyro, accelerometer, dt, keep, rows, results):
    """As `static`, with the velocity fed back; the third of the results, (R, m, 3), is the position."""
    velocity, attitude, position = results
    many = gyro.shape[0] > 1
    for i in range(rows.shape[0]):
        r, k = rows[i], i if many else 0
        q, v, p = (r[0], r[1], r[2], r[3]), (r[4], r[5], r[6]), (r[7], r[8], r[9])
        a0, f0 = (r[10], r[11], r[12]), (r[13], r[14], r[15])
        due, m = keep[0], 0
        for j in range(gyro.shape[1]):
            a = (gyro[k, j, 0], gyro[k, j, 1], gyro[k, j, 2])
            f = (accelerometer[k, j, 0], accelerometer[k, j, 1], accelerometer[k, j, 2])
            body, w = _body(a, f, a0, f0)
            v, p, zeta = _advance(_in_navigation_axes(q, w), v, p, dt)
            q = _turned(q, _turns((-zeta[0], -zeta[1], -zeta[2]))[0], body)
            a0, f0 = a, f
            if j == due:
                velocity[i, m, 0], velocity[i, m, 1], velocity[i, m, 2] = v
                attitude[i, m, 0], attitude[i, m, 1], attitude[i, m, 2], attitude[i, m, 3] = q
                position[i, m, 0], position[i, m, 1], position[i, m, 2] = p
                due += keep[1]
                m += 1
        r[0], r[1], r[2], r[3] = q
        r[4], r[5], r[6] = v
        r[7], r[8], r[9] = p
        r[10], r[11], r[12] = a0
        r[13], r[14], r[15] = f0
