r"""What the instruments of a vehicle sense at an instant, compiled: see `insenv.plants.vehicle` for the motion.

In the vehicle's frame, which turns by phi about the pivot axis a and in which the body sways by theta about s,

    d = R_s(theta) r,   P = rho + d
    v = phi' a x P + theta' s x d + v_t
    v' = phi'' a x P + phi'^2 a x (a x P) + 2 phi' theta' a x (s x d) + theta'' s x d + theta'^2 s x (s x d) + v_t'
    rate  = R_s(-theta) (phi' a + w_ie + w_en) + theta' s
    force = R_s(-theta) (v' + (2 w_ie + w_en) x v + g)

with w_ie, the specific force of gravity g and the velocity v_t of settling turned by R_a(-phi). Means over intervals
are `insenv.plants.vehicle_pieces`'.
"""

# mypy: disable-error-code="no-untyped-def"
# Vectors are tuples of floats here, which the compiler keeps in registers.

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from insenv.core.compiled import jit
from insenv.plants.vehicle_turn import SAME


def compiled(function: Callable[..., Any]) -> Any:
    """The function compiled, with divisions as NumPy has them."""
    return jit(function, error_model="numpy")


@compiled
def _sum(a, x, b, y):
    return a * x[0] + b * y[0], a * x[1] + b * y[1], a * x[2] + b * y[2]


@compiled
def _cross(x, y):
    return x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]


@compiled
def _about(axis, cosine, sine, x):
    """Return x, turned about a unit axis."""
    y = _cross(axis, x)
    along = (axis[0] * x[0] + axis[1] * x[1] + axis[2] * x[2]) * (1.0 - cosine)
    return (
        cosine * x[0] + sine * y[0] + along * axis[0],
        cosine * x[1] + sine * y[1] + along * axis[1],
        cosine * x[2] + sine * y[2] + along * axis[2],
    )


@compiled
def _times(row, k, x):
    """Return the 3 by 3 matrix that stands in a row from k on, times x."""
    return (
        row[k] * x[0] + row[k + 1] * x[1] + row[k + 2] * x[2],
        row[k + 3] * x[0] + row[k + 4] * x[1] + row[k + 5] * x[2],
        row[k + 6] * x[0] + row[k + 7] * x[1] + row[k + 8] * x[2],
    )


@compiled
def turned(t, turn):
    """Turn angle with two derivatives: a trapezoid of rate."""
    s, base, by, a, ramp, whole = t - turn[0], turn[1], turn[2], turn[3], turn[4], turn[5]
    if s <= 0.0:
        return base, 0.0, 0.0
    if s >= whole:
        return base + by, 0.0, 0.0
    if s < ramp:
        return base + 0.5 * a * s * s, a * s, a
    if s < whole - ramp:
        return base + a * ramp * (s - 0.5 * ramp), a * ramp, 0.0
    left = whole - s
    return base + by - 0.5 * a * left * left, a * left, -a


@compiled
def swayed(t, waves):
    """Sway angle with two derivatives: a sum of sines, of amplitude, angular frequency and phase."""
    angle, rate, change = 0.0, 0.0, 0.0
    for i in range(waves.shape[0]):
        w = waves[i, 1]
        at = w * t + waves[i, 2]
        part = waves[i, 0] * math.sin(at)
        angle += part
        rate += w * waves[i, 0] * math.cos(at)
        change -= w * w * part
    return angle, rate, change


@compiled
def settling(axis, turn, tails, settle):
    """Velocities that settle, (2, 2, 3): as they are at the start of the turn, and at its end."""
    left = np.zeros((2, 2, 3))
    angle = turn[1] + turn[2]
    forward = _about(axis, math.cos(angle), math.sin(angle), (0.0, 1.0, 0.0))
    for k in range(settle.shape[0]):
        fading = math.exp(-turn[5] / settle[k, 1])
        for i in range(3):
            left[0, k, i] = tails[k, i]
            left[1, k, i] = fading * tails[k, i] + (settle[k, 0] * forward[i] if turn[2] != 0.0 else 0.0)
    return left


@compiled
def _settled(t, turn, settle, left):
    """Velocity and acceleration of settling, in the vehicle's frame at turn angle 0."""
    v, a = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    end = turn[0] + turn[5]
    after = 1 if t + SAME >= end else 0
    since = t - (end if after else turn[0])
    for k in range(settle.shape[0]):
        old = (left[after, k, 0], left[after, k, 1], left[after, k, 2])
        if old[0] != 0.0 or old[1] != 0.0 or old[2] != 0.0:
            share = math.exp(-since / settle[k, 1])
            v, a = _sum(1.0, v, share, old), _sum(1.0, a, -share / settle[k, 1], old)
    return v, a


@compiled
def facing(phi, fixed):
    """What stays while the vehicle does not turn: cosine and sine of the turn angle, Earth rate, gravity and up."""
    a, c, sn = (fixed[6], fixed[7], fixed[8]), math.cos(phi), math.sin(phi)
    earth, gravity, up = (
        (fixed[0], fixed[1], fixed[2]),
        (fixed[3], fixed[4], fixed[5]),
        (fixed[18], fixed[19], fixed[20]),
    )
    return c, sn, _about(a, c, -sn, earth), _about(a, c, -sn, gravity), _about(a, c, -sn, up)


@compiled
def _attitude(ct, st, faced, fixed):
    """Heading, pitch and roll; ``ct`` and ``st`` are of the sway."""
    c, sn, _, _, up = faced
    s = (fixed[9], fixed[10], fixed[11])
    forward = _times(fixed, 21, _about((fixed[6], fixed[7], fixed[8]), c, sn, _about(s, ct, st, (0.0, 1.0, 0.0))))
    up = _about(s, ct, -st, up)
    level = math.sqrt(forward[0] * forward[0] + forward[1] * forward[1])
    return math.atan2(forward[0], forward[1]), math.atan2(forward[2], level), math.atan2(-up[0], up[2])


@compiled
def instant(t, course, faced, sway, row):
    """Rate and specific force in body axes; velocity east, north, up; heading, pitch, roll.

    ``course`` is the turn angle with two derivatives, ``faced`` as of `facing`, ``sway`` an angle likewise.
    """
    fixed, turn, settle, left, _ = row
    _, speed, change = course
    theta, rolling, jerk = sway
    a, s = (fixed[6], fixed[7], fixed[8]), (fixed[9], fixed[10], fixed[11])
    c, sn, earth, gravity, _ = faced
    ct, st = math.cos(theta), math.sin(theta)
    arm = _about(s, ct, st, (fixed[15], fixed[16], fixed[17]))
    swung, place = _cross(s, arm), _sum(1.0, (fixed[12], fixed[13], fixed[14]), 1.0, arm)
    carried = _cross(a, place)
    v, acceleration = _settled(t, turn, settle, left)
    v, acceleration = _about(a, c, -sn, v), _about(a, c, -sn, acceleration)
    v = _sum(1.0, v, 1.0, _sum(speed, carried, rolling, swung))
    acceleration = _sum(1.0, acceleration, 1.0, _sum(change, carried, jerk, swung))
    centre = _sum(speed * speed, _cross(a, carried), rolling * rolling, _cross(s, swung))
    acceleration = _sum(1.0, acceleration, 1.0, centre)
    acceleration = _sum(1.0, acceleration, 2.0 * speed * rolling, _cross(a, swung))
    level = _about(a, c, sn, v)
    transport = _about(a, c, -sn, _times(fixed, 30, level))
    force = _sum(1.0, acceleration, 1.0, _cross(_sum(2.0, earth, 1.0, transport), v))
    force = _about(s, ct, -st, _sum(1.0, force, 1.0, gravity))
    rate = _sum(1.0, _sum(1.0, earth, 1.0, transport), speed, a)
    rate = _sum(1.0, _about(s, ct, -st, rate), rolling, s)
    return rate, force, _times(fixed, 21, level), _attitude(ct, st, faced, fixed)


@compiled
def jump(row):
    """Velocity that the instruments get when a turn ends, in body axes."""
    fixed, turn, settle, _, waves = row
    speed = 0.0
    for k in range(settle.shape[0]):
        speed += settle[k, 0]
    theta = swayed(turn[0] + turn[5], waves)[0]
    return _about((fixed[9], fixed[10], fixed[11]), math.cos(theta), -math.sin(theta), (0.0, speed, 0.0))
