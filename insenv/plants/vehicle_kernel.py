r"""What the instruments of a vehicle are exposed to, compiled: see `insenv.plants.vehicle` for the motion.

In the vehicle's frame, which turns by phi about the pivot axis a and in which the body sways by theta about s,

    d = R_s(theta) r,   P = rho + d
    v = phi' a x P + theta' s x d + v_t
    v' = phi'' a x P + phi'^2 a x (a x P) + 2 phi' theta' a x (s x d) + theta'' s x d + theta'^2 s x (s x d) + v_t'
    rate  = R_s(-theta) (phi' a + w_ie + w_en) + theta' s
    force = R_s(-theta) (v' + (2 w_ie + w_en) x v + g)

with w_ie, the specific force of gravity g and the velocity v_t of settling turned by R_a(-phi). Means over an interval
are taken by Gauss-Legendre quadrature, piece by piece where a turn changes its course within it; at rest they are the
values themselves. A velocity that settling begins with is a jump: its mean force is the jump over the interval.

Each row runs through the same scalar code alone, sample by sample: chunks and batches give the same bits.
"""

# mypy: disable-error-code="no-untyped-def"
# Vectors are tuples of floats here, which the compiler keeps in registers.

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from insenv.plants.vehicle_turn import SAME, SETTLED

#: After so long nothing settles any more [s].
_LONG = 1e12


def _compiled(function: Callable[..., Any]) -> Any:
    try:
        return numba.njit(cache=True, error_model="numpy")(function)
    except RuntimeError:  # nowhere to write the cache
        return numba.njit(function)


@_compiled
def _three(row, k):
    return row[k], row[k + 1], row[k + 2]


@_compiled
def _sum(a, x, b, y):
    return a * x[0] + b * y[0], a * x[1] + b * y[1], a * x[2] + b * y[2]


@_compiled
def _cross(x, y):
    return x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]


@_compiled
def _about(axis, cosine, sine, x):
    """Return x, turned about a unit axis."""
    y = _cross(axis, x)
    along = (axis[0] * x[0] + axis[1] * x[1] + axis[2] * x[2]) * (1.0 - cosine)
    return (
        cosine * x[0] + sine * y[0] + along * axis[0],
        cosine * x[1] + sine * y[1] + along * axis[1],
        cosine * x[2] + sine * y[2] + along * axis[2],
    )


@_compiled
def _times(row, k, x):
    """Return the 3 by 3 matrix that stands in a row from k on, times x."""
    return (
        row[k] * x[0] + row[k + 1] * x[1] + row[k + 2] * x[2],
        row[k + 3] * x[0] + row[k + 4] * x[1] + row[k + 5] * x[2],
        row[k + 6] * x[0] + row[k + 7] * x[1] + row[k + 8] * x[2],
    )


@_compiled
def _turned(t, turn):
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


@_compiled
def _swayed(t, waves):
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


@_compiled
def _lines(t, waves, now):
    """Sine and cosine of each line, with its amplitude."""
    for i in range(waves.shape[0]):
        at = waves[i, 1] * t + waves[i, 2]
        now[i, 0], now[i, 1] = waves[i, 0] * math.sin(at), waves[i, 0] * math.cos(at)


@_compiled
def _swayed_on(waves, now, step):
    """Return the same, a step after an edge: sums of angles, for a library's sine costs ten products."""
    angle, rate, change = 0.0, 0.0, 0.0
    for i in range(waves.shape[0]):
        w = waves[i, 1]
        part = now[i, 0] * step[i, 1] + now[i, 1] * step[i, 0]
        angle += part
        rate += w * (now[i, 1] * step[i, 1] - now[i, 0] * step[i, 0])
        change -= w * w * part
    return angle, rate, change


@_compiled
def _steps(dt, waves, node):
    """Sine and cosine of what each line goes on by from an edge to the nodes, and to the edge itself."""
    steps = np.empty((node.size + 1, waves.shape[0], 2))
    for j in range(node.size + 1):
        after = 0.5 * dt * (1.0 + node[j]) if j < node.size else 0.0
        for i in range(waves.shape[0]):
            steps[j, i, 0], steps[j, i, 1] = math.sin(waves[i, 1] * after), math.cos(waves[i, 1] * after)
    return steps


@_compiled
def _settling(t, axis, turn, tails, settle):
    """Velocity and acceleration of settling, in the vehicle's frame at turn angle 0."""
    v, a = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    end = turn[0] + turn[5]
    for k in range(settle.shape[0]):
        tau = settle[k, 1]
        if t - turn[0] < SETTLED * tau:
            left = math.exp(-(t - turn[0]) / tau)
            before = (tails[k, 0], tails[k, 1], tails[k, 2])
            v, a = _sum(1.0, v, left, before), _sum(1.0, a, -left / tau, before)
        if turn[2] != 0.0 and t + SAME >= end and t - end < SETTLED * tau:
            left = settle[k, 0] * math.exp(-(t - end) / tau)
            angle = turn[1] + turn[2]
            forward = _about(axis, math.cos(angle), math.sin(angle), (0.0, 1.0, 0.0))
            v, a = _sum(1.0, v, left, forward), _sum(1.0, a, -left / tau, forward)
    return v, a


@_compiled
def _instant(t, sway, row):
    """Rate and specific force in body axes, and velocity in the vehicle's frame at turn angle 0, at an instant."""
    fixed, turn, tails, settle, _ = row
    phi, speed, change = _turned(t, turn)
    theta, rolling, jerk = sway
    a, s = _three(fixed, 6), _three(fixed, 9)
    c, sn, ct, st = math.cos(phi), math.sin(phi), math.cos(theta), math.sin(theta)
    earth = _about(a, c, -sn, _three(fixed, 0))
    arm = _about(s, ct, st, _three(fixed, 15))
    swung, place = _cross(s, arm), _sum(1.0, _three(fixed, 12), 1.0, arm)
    carried = _cross(a, place)
    v, acceleration = _settling(t, a, turn, tails, settle)
    v, acceleration = _about(a, c, -sn, v), _about(a, c, -sn, acceleration)
    v = _sum(1.0, v, 1.0, _sum(speed, carried, rolling, swung))
    acceleration = _sum(1.0, acceleration, 1.0, _sum(change, carried, jerk, swung))
    centre = _sum(speed * speed, _cross(a, carried), rolling * rolling, _cross(s, swung))
    acceleration = _sum(1.0, acceleration, 1.0, centre)
    acceleration = _sum(1.0, acceleration, 2.0 * speed * rolling, _cross(a, swung))
    level = _about(a, c, sn, v)
    transport = _about(a, c, -sn, _times(fixed, 30, level))
    force = _sum(1.0, acceleration, 1.0, _cross(_sum(2.0, earth, 1.0, transport), v))
    force = _sum(1.0, force, 1.0, _about(a, c, -sn, _three(fixed, 3)))
    rate = _sum(1.0, _sum(1.0, earth, 1.0, transport), speed, a)
    rate = _sum(1.0, _about(s, ct, -st, rate), rolling, s)
    return rate, _about(s, ct, -st, force), level


@_compiled
def _edge(t, theta, seen, row, out, k):
    """Fill what is known at an edge."""
    fixed, turn = row[0], row[1]
    phi = _turned(t, turn)[0]
    a, s = _three(fixed, 6), _three(fixed, 9)
    c, sn, ct, st = math.cos(phi), math.sin(phi), math.cos(theta), math.sin(theta)
    forward = _times(fixed, 21, _about(a, c, sn, _about(s, ct, st, (0.0, 1.0, 0.0))))
    up = _about(s, ct, -st, _about(a, c, -sn, _three(fixed, 18)))
    velocity = _times(fixed, 21, seen[2])
    for i in range(3):
        out[i, k] = seen[0][i]
        out[6 + i, k] = velocity[i]
    out[3, k] = math.atan2(forward[0], forward[1])
    out[4, k] = math.atan2(forward[2], math.hypot(forward[0], forward[1]))
    out[5, k] = math.atan2(-up[0], up[2])
    out[9, k] = phi


@_compiled
def _mean(first, last, row, rule):
    """Mean rate and force over an interval with a turn in it, piece by piece."""
    turn, node, weight = row[1], rule[0], rule[1]
    rate, force = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    begin = first
    for k in range(5):
        end = last
        if k < 4:
            end = turn[0] + (0.0 if k == 0 else turn[4] if k == 1 else turn[5] - turn[4] if k == 2 else turn[5])
            if end <= begin + SAME or end >= last - SAME:
                continue
        half = 0.5 * (end - begin)
        for i in range(node.size):
            at = begin + half * (1.0 + node[i])
            seen = _instant(at, _swayed(at, row[4]), row)
            share = weight[i] * half / (last - first)
            rate, force = _sum(1.0, rate, share, seen[0]), _sum(1.0, force, share, seen[1])
        begin = end
    return rate, force


@_compiled
def _mean_between(first, last, row, rule, now, steps):
    """Mean rate and force over an interval between turns."""
    rate, force = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(rule[0].size):
        at = first + 0.5 * (last - first) * (1.0 + rule[0][i])
        seen = _instant(at, _swayed_on(row[4], now, steps[i]), row)
        rate, force = _sum(1.0, rate, 0.5 * rule[1][i], seen[0]), _sum(1.0, force, 0.5 * rule[1][i], seen[1])
    return rate, force


@_compiled
def _jump(row):
    """Velocity that the instruments get when a turn ends."""
    fixed, turn, _, settle, waves = row
    speed = 0.0
    for k in range(settle.shape[0]):
        speed += settle[k, 0]
    theta = _swayed(turn[0] + turn[5], waves)[0]
    return _about(_three(fixed, 9), math.cos(theta), -math.sin(theta), (0.0, speed, 0.0))


@_compiled
def _lively(t, row):
    """Whether the body moves at a time between turns."""
    _, turn, tails, settle, waves = row
    for i in range(waves.shape[0]):
        if waves[i, 0] != 0.0:
            return True
    for k in range(settle.shape[0]):
        old = tails[k, 0] != 0.0 or tails[k, 1] != 0.0 or tails[k, 2] != 0.0
        if old and t - turn[0] < SETTLED * settle[k, 1]:
            return True
        since = t - turn[0] - turn[5]
        if settle[k, 0] != 0.0 and turn[2] != 0.0 and since + SAME >= 0.0 and since < SETTLED * settle[k, 1]:
            return True
    return False


@_compiled
def _interval(rate, force, turning, out, k):
    """Fill what is known of an interval."""
    for i in range(3):
        out[i, k] = rate[i]
        out[3 + i, k] = force[i]
    out[6, k] = 1.0 if turning else 0.0


@_compiled
def _row(t, span, row, rule, means, edges):
    """One run: ``means`` (7, n) of rate, force and turning; ``edges`` (10, n + 1), rate, attitude, velocity, angle."""
    turn, waves = row[1], row[4]
    end = turn[0] + turn[5]
    now, steps = np.empty((waves.shape[0], 2)), _steps(rule[2], waves, rule[0])
    # At rest nothing changes; a turn that is known of has begun.
    rest, still = _instant(end + _LONG, (0.0, 0.0, 0.0), row), -1
    for k in range(span[0], span[1] + 1):
        turning = turn[2] != 0.0 and t[k] < end - SAME
        lively = turning or _lively(t[k], row)
        if lively:
            _lines(t[k], waves, now)
            sway = _swayed_on(waves, now, steps[-1])
            _edge(t[k], sway[0], _instant(t[k], sway, row), row, edges, k)
        elif still < 0:
            _edge(t[k], 0.0, rest, row, edges, k)
            still = k
        else:
            edges[:, k] = edges[:, still]
        if k == span[1]:
            break
        if turning:
            rate, force = _mean(t[k], t[k + 1], row, rule)
            if end <= t[k + 1] + SAME:
                force = _sum(1.0, force, 1.0 / (t[k + 1] - t[k]), _jump(row))
        elif lively:
            rate, force = _mean_between(t[k], t[k + 1], row, rule, now, steps)
        else:
            rate, force = rest[0], rest[1]
        _interval(rate, force, turning, means, k)


@_compiled
def expose(t, span, rows, rule, means, edges):
    """All runs, R of them, between two edges of ``t``; what has one row is shared by all.

    ``rows`` are fixed (1 or R, 39), as `insenv.plants.vehicle` says; turn (., 6): start, angle before, angle turned
    by, acceleration, ramp, whole; tails (., 2, 3); settle (2, 2): velocity, time constant; waves (., L, 3). ``rule`` is
    nodes, weights and the length of an interval, the same number for every chunk.
    """
    fixed, turn, tails, settle, waves = rows
    for i in range(means.shape[0]):
        own = (
            fixed[i % fixed.shape[0]],
            turn[i % turn.shape[0]],
            tails[i % tails.shape[0]],
            settle,
            waves[i % waves.shape[0]],
        )
        _row(t, span, own, rule, means[i], edges[i])
