r"""What the instruments of a vehicle are exposed to, compiled: means over intervals, and values at their edges.

Between the corners of a turn everything is smooth. A run is cut there and at the multiples of a fixed length; over each
piece, with x in (-1, 1), what `insenv.plants.vehicle_kernel` finds at the Chebyshev nodes makes

    f = sum_k a_k T_k(x),   F = integral f dx = a_0 x + sum_k (a_{k-1} - a_{k+1}) / (2 k) T_k(x)

(Trefethen, as in `insenv.plants.vehicle_rule`), and the mean over an interval is a difference of F. The sway is a power
series about the middle of the piece. A velocity that settling begins with is a jump: its mean force is the jump over
the interval. At rest the means are the values themselves.

Pieces belong to the clock of the run, and each row runs through the same scalar code alone: chunks and batches give the
same bits.
"""

# mypy: disable-error-code="no-untyped-def"
# Vectors are tuples of floats here, which the compiler keeps in registers.

from __future__ import annotations

import math

import numpy as np

from insenv.core.compiled import patient
from insenv.plants.vehicle_kernel import compiled, facing, instant, jump, settling, swayed, turned
from insenv.plants.vehicle_turn import SAME, SETTLED

#: After so long nothing settles any more [s].
_LONG = 1e12
#: Columns of what is seen: rate, force, heading and pitch and roll, velocity; and of the polynomials: integrals of rate
#: and of force, then heading, pitch, roll, velocity, rate.
_SEEN, _POLYNOMIALS = 12, 15


@compiled
def _wrapped(angle):
    return angle - 2.0 * math.pi * round(angle / (2.0 * math.pi))


@compiled
def _series(middle, half, waves, terms):
    """Power series of the sway about the middle of a piece, in x."""
    for d in range(terms.size):
        terms[d] = 0.0
    for i in range(waves.shape[0]):
        at, z = waves[i, 1] * middle + waves[i, 2], waves[i, 1] * half
        even, odd = waves[i, 0] * math.sin(at), waves[i, 0] * math.cos(at) * z
        square = -z * z
        for d in range(0, terms.size, 2):
            terms[d] += even
            terms[d + 1] += odd
            even *= square
            odd *= square
    scale = 1.0
    for d in range(1, terms.size):
        scale /= d
        terms[d] *= scale


@compiled
def _sway(x, half, terms):
    """Sway angle with two derivatives: Horner's scheme."""
    angle, slope, bend = 0.0, 0.0, 0.0
    for d in range(terms.size - 1, -1, -1):
        bend = bend * x + slope
        slope = slope * x + angle
        angle = angle * x + terms[d]
    return angle, slope / half, 2.0 * bend / (half * half)


@compiled
def _look(begin, end, row, nodes, work):
    """Fill what is seen at the nodes of a piece; return the heading that the others are counted from."""
    terms, values = work[:2]
    half, middle = 0.5 * (end - begin), 0.5 * (begin + end)
    swaying = row[4].shape[0] > 0
    if swaying:
        _series(middle, half, row[4], terms)
    n, first = nodes.size, 0.0
    course = turned(middle, row[1])
    faced = facing(course[0], row[0])
    turning = course[1] != 0.0
    for i in range(n):
        t = middle + half * nodes[i]
        if turning:
            course = turned(t, row[1])
            faced = facing(course[0], row[0])
        sway = _sway(nodes[i], half, terms) if swaying else (0.0, 0.0, 0.0)
        rate, force, velocity, angles = instant(t, course, faced, sway, row)
        if i == 0:
            first = angles[0]
        seen = (*rate, *force, _wrapped(angles[0] - first), angles[1], angles[2], *velocity)
        for c in range(_SEEN):
            values[i, c] = seen[c]
    return first


@compiled
def _transformed(transform, values, found):
    """Chebyshev coefficients of what is seen: of symmetric nodes, even ones are of sums, odd ones of differences."""
    n = transform.shape[0]
    for i in range(n // 2):
        for c in range(_SEEN):
            one, other = values[i, c], values[n - 1 - i, c]
            values[i, c], values[n - 1 - i, c] = one + other, one - other
    for k in range(n):
        for c in range(_SEEN):
            found[k, c] = 0.0
        for i in range(n // 2):
            place, factor = (i if k % 2 == 0 else n - 1 - i), transform[k, i]
            for c in range(_SEEN):
                found[k, c] += factor * values[place, c]


@compiled
def _integrated(n, found, polynomials):
    """Coefficients of all polynomials from those of what is seen; of the integrals without the linear term of a_0."""
    for c in range(6):
        polynomials[0, c] = 0.0
        for k in range(1, n + 1):
            below = found[k - 1, c] if k > 1 else 0.0
            above = found[k + 1, c] if k + 1 < n else 0.0
            polynomials[k, c] = (below - above) / (2.0 * k)
    for c in range(6, _POLYNOMIALS):
        for k in range(n):
            polynomials[k, c] = found[k, c if c < _SEEN else c - _SEEN]
        polynomials[n, c] = 0.0


@compiled
def _evaluated(when, size, middle, half, polynomials, chebyshev, sums):
    """Fill ``sums`` (15, .) with the polynomials at times."""
    for p in range(size):
        chebyshev[0, p] = 1.0
        chebyshev[1, p] = (when[p] - middle) / half
    for k in range(2, polynomials.shape[0]):
        for p in range(size):
            chebyshev[k, p] = 2.0 * chebyshev[1, p] * chebyshev[k - 1, p] - chebyshev[k - 2, p]
    for c in range(_POLYNOMIALS):
        for p in range(size):
            sums[c, p] = polynomials[0, c]
        # Two at a time: sums are read and written half as often.
        for k in range(1, polynomials.shape[0], 2):
            one, other = polynomials[k, c], polynomials[k + 1, c]
            for p in range(size):
                sums[c, p] += one * chebyshev[k, p] + other * chebyshev[k + 1, p]


@compiled
def _edge(t, row, edges, k):
    """Fill an edge with what is there: where pieces meet, so that it does not matter which is asked."""
    course = turned(t, row[1])
    rate, _, velocity, angles = instant(t, course, facing(course[0], row[0]), swayed(t, row[4]), row)
    for i in range(3):
        edges[i, k], edges[3 + i, k], edges[6 + i, k] = rate[i], angles[i], velocity[i]
    edges[9, k] = course[0]


@compiled
def _corners(turn, length):
    """Where a turn changes its course; what is the same time, or that of a piece, is one."""
    found = np.empty(4)
    for i in range(4):
        time = turn[0] + (0.0 if i == 0 else turn[4] if i == 1 else turn[5] - turn[4] if i == 2 else turn[5])
        near = round(time / length) * length
        if abs(time - near) < SAME:
            time = near
        elif i > 0 and time - found[i - 1] < SAME:
            time = found[i - 1]
        found[i] = time
    return found


@compiled
def _piece(now, corners, length):
    """Begin and end of the piece that a time lies in."""
    j = math.floor((now + SAME) / length)
    begin, end = j * length, (j + 1) * length
    for time in corners:
        if time <= now + SAME:
            begin = max(begin, time)
        else:
            end = min(end, time)
    return begin, end


@compiled
def _lively(begin, row):
    """Whether the body moves in a piece."""
    _, turn, settle, left, waves = row
    end = turn[0] + turn[5]
    if turn[2] != 0.0 and begin < end - SAME:
        return True
    for i in range(waves.shape[0]):
        if waves[i, 0] != 0.0:
            return True
    for k in range(settle.shape[0]):
        old = left[1, k, 0] != 0.0 or left[1, k, 1] != 0.0 or left[1, k, 2] != 0.0
        if old and begin - end < SETTLED * settle[k, 1]:
            return True
    return False


@compiled
def _still(t, k, last, now, row, means, edges):
    """From a time within interval ``k`` on, fill what is left of a vehicle that stays as it is."""
    long = row[1][0] + row[1][5] + _LONG
    course = turned(long, row[1])
    rate, force, velocity, angles = instant(long, course, facing(course[0], row[0]), (0.0, 0.0, 0.0), row)
    share, after, edge = (t[k + 1] - now) / (t[k + 1] - t[k]), k + 1, k + 1 if k else 0
    for i in range(3):
        means[i, k] += share * rate[i]
        means[3 + i, k] += share * force[i]
        means[i, after:last], means[3 + i, after:last] = rate[i], force[i]
        edges[i, edge : last + 1] = rate[i]
        edges[3 + i, edge : last + 1] = angles[i]
        edges[6 + i, edge : last + 1] = velocity[i]
    edges[9, edge : last + 1] = course[0]


@compiled
def _flags(t, span, row, means):
    """Intervals with a turn in them, and the jump at its end."""
    turn = row[1]
    end = turn[0] + turn[5]
    for k in range(span[0], span[1]):
        turning = turn[2] != 0.0 and t[k] < end - SAME
        means[6, k] = 1.0 if turning else 0.0
        if turning and end <= t[k + 1] + SAME:
            velocity = jump(row)
            for i in range(3):
                means[3 + i, k] += velocity[i] / (t[k + 1] - t[k])


@compiled
def _listed(t, k, last, begin, end, when):
    """Times at which a piece is asked: from ``begin`` over the edges within it to its end."""
    when[0], size, j = begin, 1, k + 1
    while j <= last and t[j] <= end + SAME:
        when[size] = t[j]
        size, j = size + 1, j + 1
    if j <= last and when[size - 1] < end - SAME:
        when[size] = end
        size += 1
    return size, j


@compiled
def _spread(t, place, piece, row, work, means, edges):
    """Add a piece's share to the means of its intervals, from ``k`` on, and fill the edges within it."""
    (k, size, first), found, when, sums = place, work[2], work[3], work[5]
    half = 0.5 * (piece[1] - piece[0])
    for c in range(6):
        for p in range(1, size):
            whole = t[k + p] - t[k + p - 1]
            means[c, k + p - 1] += (
                found[0, c] * (when[p] - when[p - 1]) + half * (sums[c, p] - sums[c, p - 1])
            ) / whole
    # An edge belongs to what was before it; the first one of all has nothing before it.
    begin = 0 if k == 0 and when[0] == t[0] else 1
    stop = size if when[size - 1] == t[k + size - 1] else size - 1
    for i in range(3):
        for p in range(begin, stop):
            edges[i, k + p], edges[3 + i, k + p], edges[6 + i, k + p] = sums[12 + i, p], sums[6 + i, p], sums[9 + i, p]
    for p in range(begin, stop):
        edges[3, k + p] = _wrapped(edges[3, k + p] + first)
        edges[9, k + p] = turned(t[k + p], row[1])[0]
    for p in (begin, stop - 1):
        if begin < stop and min(when[p] - piece[0], piece[1] - when[p]) < SAME:
            _edge(t[k + p], row, edges, k + p)


@compiled
def _row(t, span, row, rule, work, means, edges):
    """One run: ``means`` (7, n) of rate, force and turning; ``edges`` (10, n + 1), rate, attitude, velocity, angle."""
    length, nodes, transform = rule
    corners, (k, last) = _corners(row[1], length), span
    now, polynomials = t[k], work[6]
    means[:6, k:last] = 0.0
    while k < last:
        piece = _piece(now, corners, length)
        if not _lively(piece[0], row):
            _still(t, k, last, now, row, means, edges)
            break
        first = _look(piece[0], piece[1], row, nodes, work)
        _transformed(transform, work[1], work[2])
        _integrated(nodes.size, work[2], polynomials)
        size, after = _listed(t, k, last, now, piece[1], work[3])
        half = 0.5 * (piece[1] - piece[0])
        _evaluated(work[3], size, 0.5 * (piece[0] + piece[1]), half, polynomials, work[4], work[5])
        _spread(t, (k, size, first), piece, row, work, means, edges)
        now, k = work[3][size - 1], after - 1
    _flags(t, span, row, means)


def _expose(t, span, rows, rule, means, edges):
    """All runs, R of them, between two edges of ``t``; what has one row is shared by all.

    ``rows`` are fixed (1 or R, 39), as `insenv.plants.vehicle` says; turn (., 6): start, angle before, angle turned
    by, acceleration, ramp, whole; tails (., 2, 3); settle (2, 2): velocity, time constant; waves (., L, 3). ``rule`` is
    length, nodes, transform and terms of `insenv.plants.vehicle_rule`. The first edge is filled where it is that of
    ``t``: any other is the last one of what was before.
    """
    fixed, turn, tails, settle, waves = rows
    length, nodes, transform, terms = rule
    n = nodes.size
    room = min(t.size, int(length / (t[1] - t[0])) + 3) + 2
    work = (  # series; what is seen, and its coefficients; times; Chebyshev polynomials and sums there; polynomials
        np.zeros(terms),
        np.empty((n, _SEEN)),
        np.empty((n, _SEEN)),
        np.empty(room),
        np.empty((n + 1, room)),
        np.empty((_POLYNOMIALS, room)),
        np.empty((n + 1, _POLYNOMIALS)),
    )
    for i in range(means.shape[0]):
        own, moved = fixed[i % fixed.shape[0]], turn[i % turn.shape[0]]
        left = settling((own[6], own[7], own[8]), moved, tails[i % tails.shape[0]], settle)
        row = (own, moved, settle, left, waves[i % waves.shape[0]])
        _row(t, span, row, (length, nodes, transform), work, means[i], edges[i])


expose = patient(_expose, error_model="numpy")
