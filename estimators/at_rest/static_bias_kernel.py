r"""Moments, smoothed moments and the Allan cascade of a record at rest, block by block.

For each averaging time of m samples the means of m samples one after the other; of these number, mean and sum of
squares (Welford), about the mean of each power-up. The cascade halves the rate again and again:

    y_0 = samples,   y_j+1[k] = (y_j[2k] + y_j[2k+1]) / 2,   sigma^2(2^j dt) = sum (y_j[k+1] - y_j[k])^2 / (2 (n_j - 1))

A gap drops what is under way and no difference is taken over it. All sums are of float64 values less the first value.
"""

from __future__ import annotations

from estimators.common.turns import compiled

#: Octaves of the Allan deviation: up to dt 2^39.
LEVELS = 40
#: Per averaging time: sum and samples under way; number, mean and squares of this power-up; squares and freedom of
#: those before, and their number.
SUM, IN, COUNT, MEAN, SQUARES, BEFORE, FREEDOM, OLD = range(8)
#: Per level: value that waits for its pair, whether there is one; value before, whether there is one; sum of squared
#: differences, their number.
PENDING, WAITS, LAST, THERE, DIFFERENCES, PAIRS = range(6)


@compiled
def feed(block, factors, moments, cascade, scratch):  # type: ignore[no-untyped-def]
    """One block of samples that follows on the one before, in place; its mean."""
    total = 0.0
    for j in range(factors.size):
        _smooth(block, factors[j], moments[j])
    for j in range(block.size):  # all at once would compile the message of shapes that differ: seconds
        total += block[j]
        scratch[j] = block[j]
    n = block.size
    for level in range(cascade.shape[0]):
        if n == 0:
            break
        n = _halve(scratch, n, cascade[level])
    return total / block.size


@compiled
def _smooth(block, m, s):  # type: ignore[no-untyped-def]
    """Means of m samples into the moments."""
    start = 0
    while start < block.size:
        stop = min(block.size, start + m - int(s[IN]))
        part = 0.0
        for k in range(start, stop):
            part += block[k]
        s[SUM] += part
        s[IN] += stop - start
        start = stop
        if s[IN] == m:
            mean = s[SUM] / m
            s[COUNT] += 1
            away = mean - s[MEAN]
            s[MEAN] += away / s[COUNT]
            s[SQUARES] += away * (mean - s[MEAN])
            s[SUM], s[IN] = 0.0, 0.0


@compiled
def _halve(y, n, s):  # type: ignore[no-untyped-def]
    """Differences of one level, and the means of pairs in place of its values; how many these are."""
    total = 0.0
    if s[THERE]:
        total = (y[0] - s[LAST]) ** 2
        s[PAIRS] += 1
    for k in range(1, n):
        d = y[k] - y[k - 1]
        total += d * d
    s[DIFFERENCES] += total
    s[PAIRS] += n - 1
    s[LAST], s[THERE] = y[n - 1], 1.0
    made, k = 0, 0
    if s[WAITS]:
        first = 0.5 * (s[PENDING] + y[0])
        k = 1
        last, odd = y[n - 1], (n - 1) % 2
        _pairs(y, k, n, 1)
        y[0] = first
        made = 1 + (n - 1) // 2
    else:
        last, odd = y[n - 1], n % 2
        _pairs(y, 0, n, 0)
        made = n // 2
    s[WAITS] = odd
    s[PENDING] = last if odd else 0.0
    return made


@compiled
def _pairs(y, start, n, to):  # type: ignore[no-untyped-def]
    for k in range(start, n - 1, 2):
        y[to] = 0.5 * (y[k] + y[k + 1])
        to += 1


@compiled
def cut(moments, cascade):  # type: ignore[no-untyped-def]
    """A gap: what is under way is dropped, in place."""
    for s in moments:
        s[SUM], s[IN] = 0.0, 0.0
    for s in cascade:
        s[PENDING], s[WAITS], s[LAST], s[THERE] = 0.0, 0.0, 0.0, 0.0


@compiled
def power_up(moments, cascade):  # type: ignore[no-untyped-def]
    """A new power-up: deviations are from its own mean, in place."""
    cut(moments, cascade)
    for s in moments:
        if s[COUNT] > 0:
            s[BEFORE] += s[SQUARES]
            s[FREEDOM] += s[COUNT] - 1
            s[OLD] += s[COUNT]
        s[COUNT], s[MEAN], s[SQUARES] = 0.0, 0.0, 0.0


# Of a row: samples in the buffer, whether the block before is held back, whether it followed on another at rest; time,
# angle and power-up of the row before, whether there is one; angle at the block's start, its time of start, time of the
# first row of this power-up, sum of temperatures.
FILLED, HELD, SEEN, T, ANGLE, POWER, A0, T0, BEGUN, WARMTH, HELD_T, HELD_WARMTH, RESTED = range(13)
STATE = 13


@compiled
def walk(t, channels, settings, factors, state):  # type: ignore[no-untyped-def]
    """Every row of a batch, in place: whole blocks at rest go on, one block late, so that none touches a motion."""
    y, angle, warmth, power = channels
    dt, guarded, limit = settings
    now, buffer, held, moments, cascade, made, count = state
    size = buffer.shape[1]
    scratch = buffer[0].copy()
    for r in range(y.shape[0]):
        s = now[r]
        row = (s, buffer[r], held[r], moments[r], cascade[r], made[r], count[r : r + 1], scratch)
        for i in range(t.size):
            new = s[SEEN] == 0 or power[r, i] != s[POWER]
            if new or abs(t[i] - s[T] - dt) > 0.5 * dt:
                release(row, factors)
                cut(moments[r], cascade[r])
                s[FILLED], s[WARMTH], s[RESTED] = 0.0, 0.0, 0.0
                s[A0], s[T0] = angle[r, i], t[i] - dt
                if new:
                    power_up(moments[r], cascade[r])
                    s[BEGUN] = t[i] - dt
            k = int(s[FILLED])
            buffer[r, k] = y[r, i]
            s[WARMTH] += warmth[r, i]
            s[FILLED] = k + 1
            s[SEEN], s[T], s[ANGLE], s[POWER] = 1.0, t[i], angle[r, i], power[r, i]
            if k + 1 == size:
                _full(row, factors, guarded > 0, limit)


@compiled
def _full(row, factors, guarded, limit):  # type: ignore[no-untyped-def]
    s, buffer, held, moments, cascade, _, _, _ = row
    rests = not guarded or abs(s[ANGLE] - s[A0]) <= limit
    if rests:
        if s[RESTED] or not guarded:
            release(row, factors)
            for j in range(buffer.size):
                held[j] = buffer[j]
            s[HELD], s[HELD_T], s[HELD_WARMTH] = 1.0, s[T0] - s[BEGUN], s[WARMTH] / buffer.size
            if not guarded:
                release(row, factors)
        s[RESTED] = 1.0
    else:
        s[HELD], s[RESTED] = 0.0, 0.0
        cut(moments, cascade)
    s[A0], s[T0], s[FILLED], s[WARMTH] = s[ANGLE], s[T], 0.0, 0.0


@compiled
def release(row, factors):  # type: ignore[no-untyped-def]
    """Give on the block that was held back."""
    s, _, held, moments, cascade, made, count, scratch = row
    if s[HELD]:
        m = made[count[0]]
        m[0], m[1], m[2], m[3] = s[HELD_T], feed(held, factors, moments, cascade, scratch), s[HELD_WARMTH], s[POWER]
        count[0] += 1
        s[HELD] = 0.0
