r"""Dwells of a rate table found on line, and their sums over whole turns.

The record is followed in blocks of a tenth of a second. A block belongs to the dwell before it while its table rate is
within a tolerance of the dwell's; otherwise it begins a new dwell. Over the k whole turns that a dwell completes (over
all of it where it completes none)

    rate = k 2 pi / T,      output = (sum of y dt) / T

where the interval in which a turn ends counts by the share of its angle that lies inside: what goes with the table's
angle, as the level Earth rate does, averages out.

The white noise is that of differences of neighbouring means over a second, r of output less table rate, which slow
drift and an error of the scale factor leave alone:  N^2 = mean of (r_k+1 - r_k)^2 tau / 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, inf, isfinite, pi

import numpy as np
from numpy.typing import NDArray

from estimators.common.turns import compiled, patiently
from insenv.core.compiled import of_one_type
from insenv.core.recording import Floats

#: Length of a block, shortest dwell [s].
BLOCK, LEAST = 0.1, 2.0
#: Blocks in a mean for the noise.
PER_MEAN = 10
#: What is kept of a dwell: rate, output, time, turns, power-up, start, temperature (NaN: none).
RATE, OUTPUT, TIME, TURNS, POWER, START, TEMPERATURE = range(7)
WIDTH = 7
#: Share of a turn before its end from which on its end is looked for.
_NEARLY = 1e-6

# Of the row before: whether there is one, time, angle, power-up, segment.
_SEEN, _T, _A, _P, _SEG = range(5)
# Dwell: whether there is one, angle and time at its start, integral, time and temperature integral of what is accepted;
# angle at its end, turns, integral and time at the last of them.
_OPEN, _A0, _T0, _G, _D, _H, _A1, _K, _GK, _DK = range(5, 15)
# Block: angle and time at its start, integral, time, temperature integral; turns, integral and time reached within it.
_BA, _BT, _BG, _BD, _BH, _BK, _BGK, _BDK = range(15, 23)
# Noise: residual and time of the mean under way, its blocks, the mean before (and whether there is one); sum of squared
# differences, their number.
_NR, _ND, _NB, _NL, _NH, _NS, _NC = range(23, 30)
STATE = 30


@dataclass(frozen=True)
class DwellSums:
    """Dwells so far.

    Attributes
    ----------
    now : ndarray, shape (..., STATE)
    dwells : ndarray, shape (..., d, WIDTH)
        Rows beyond ``count`` are zero.
    count : ndarray of int, shape (...)
    """

    now: Floats
    dwells: Floats
    count: NDArray[np.int64]


def nothing(batch: int | None) -> DwellSums:
    """No dwell yet."""
    front = () if batch is None else (batch,)
    return DwellSums(np.zeros((*front, STATE)), np.zeros((*front, 0, WIDTH)), np.zeros(front, np.int64))


def follow(
    found: DwellSums, t: Floats, channels: tuple[Floats, Floats, Floats, Floats], segment: Floats, settings: Floats
) -> DwellSums:
    """After more rows.

    Parameters
    ----------
    found : DwellSums
    t : ndarray, shape (n,)
        [s]
    channels : tuple of ndarray, shape (..., n)
        Output [rad/s], table angle [rad], temperature [K], power-up.
    segment : ndarray, shape (n,)
        Number of the labelled stretch; 0: in none, -1: no stretch is labelled at all.
    settings : ndarray, shape (4,)
        Sampling period [s], share of the table's rate on the axis, tolerance of a dwell's rate [rad/s] and relative.
    """
    front, n = found.count.shape, len(t)
    rows, d = found.count.size, found.dwells.shape[-2]
    wide = [of_one_type(c, (*front, n)).reshape(rows, n) for c in channels]
    now, count = found.now.reshape(rows, STATE).copy(), found.count.reshape(rows).copy()
    most = int(n * settings[0] / LEAST) + 2
    dwells = np.concatenate([found.dwells.reshape(rows, d, WIDTH), np.zeros((rows, most, WIDTH))], axis=1)
    _follow((of_one_type(t), segment), tuple(wide), settings, (now, dwells, count))
    kept = int(count.max(initial=0))
    return DwellSums(now.reshape(*front, STATE), dwells[:, :kept].reshape(*front, kept, WIDTH), count.reshape(front))


def finished(found: DwellSums, settings: Floats) -> DwellSums:
    """With the dwell that is under way as one of them."""
    front, rows, d = found.count.shape, found.count.size, found.dwells.shape[-2]
    now, count = found.now.reshape(rows, STATE).copy(), found.count.reshape(rows).copy()
    dwells = np.concatenate([found.dwells.reshape(rows, d, WIDTH), np.zeros((rows, 1, WIDTH))], axis=1)
    _finish(settings, (now, dwells, count))
    return DwellSums(now.reshape(*front, STATE), dwells.reshape(*front, d + 1, WIDTH), count.reshape(front))


def white_noise(found: DwellSums) -> tuple[Floats, NDArray[np.int64]]:
    """Square of the white noise [rad^2/s] and how many differences tell of it, each of shape (...)."""
    count = found.now[..., _NC]
    return found.now[..., _NS] / np.maximum(count, 1), count.astype(np.int64)


@patiently
def _follow(shared, channels, settings, state):  # type: ignore[no-untyped-def]
    t, segment = shared
    y, angle, warmth, power = channels
    now, dwells, count = state
    dt = settings[0]
    for r in range(y.shape[0]):
        s, i = now[r], 0
        while i < t.size:
            i = _within(s, (t, y[r], angle[r], warmth[r], power[r], segment), i, dt)
            if i == t.size:
                break
            row = (t[i], angle[r, i], power[r, i], segment[i])
            apart = s[_SEEN] == 0 or abs(t[i] - s[_T] - dt) > 0.5 * dt or row[2] != s[_P] or row[3] != s[_SEG]
            if apart or not isfinite(y[r, i]):
                _block(s, settings, dwells[r], count[r : r + 1])
                _close(s, settings, dwells[r], count[r : r + 1])
                s[_SEEN] = 1 if row[3] != 0 else 0
                _anchor(s, row)
            else:
                _sample(s, y[r, i], warmth[r, i], row)
                s[_T], s[_A] = row[0], row[1]
                if s[_BD] >= BLOCK - 0.5 * dt:
                    _block(s, settings, dwells[r], count[r : r + 1])
            s[_T], s[_A], s[_P], s[_SEG] = row[0], row[1], row[2], row[3]
            i += 1


@compiled
def _within(s, rows, i, dt):  # type: ignore[no-untyped-def]
    """From row i on, add to the block what neither begins nor ends anything; the row that does.

    Nearly every row is one of these: their sums are kept out of the state meanwhile.
    """
    t, y, angle, warmth, power, segment = rows
    if s[_SEEN] == 0:
        return i
    last, sum_y, time, sum_warmth = s[_T], s[_BG], s[_BD], s[_BH]
    full = BLOCK - 0.5 * dt
    turn = (s[_BK] + 1 - _NEARLY) * 2 * pi if s[_OPEN] else inf
    start, p, label = s[_A0], s[_P], s[_SEG]
    first = i
    while i < t.size:
        step = t[i] - last
        if abs(step - dt) > 0.5 * dt or power[i] != p or segment[i] != label or not isfinite(y[i]):
            break
        if time + step >= full or abs(angle[i] - start) > turn:
            break
        sum_y += y[i] * step
        time += step
        sum_warmth += warmth[i] * step
        last = t[i]
        i += 1
    if i > first:
        s[_T], s[_A], s[_BG], s[_BD], s[_BH] = last, angle[i - 1], sum_y, time, sum_warmth
    return i


@patiently
def _finish(settings, state):  # type: ignore[no-untyped-def]
    now, dwells, count = state
    for r in range(now.shape[0]):
        _block(now[r], settings, dwells[r], count[r : r + 1])
        _close(now[r], settings, dwells[r], count[r : r + 1])


@compiled
def _anchor(s, row):  # type: ignore[no-untyped-def]
    """Begin a block at a row."""
    s[_BA], s[_BT] = row[1], row[0]
    s[_BG], s[_BD], s[_BH] = 0.0, 0.0, 0.0
    s[_BK], s[_BGK], s[_BDK] = s[_K], s[_GK], s[_DK]


@compiled
def _sample(s, y, warmth, row):  # type: ignore[no-untyped-def]
    """Add an interval to the block, and the turn that ends in it."""
    step = row[0] - s[_T]
    if s[_OPEN]:
        before, after = abs(s[_A] - s[_A0]), abs(row[1] - s[_A0])
        whole = floor(after / (2 * pi) + 1e-9)
        if whole > s[_BK] and after > before:
            share = min(max((whole * 2 * pi - before) / (after - before), 0.0), 1.0)
            s[_BK] = whole
            s[_BGK] = s[_G] + s[_BG] + share * y * step
            s[_BDK] = s[_D] + s[_BD] + share * step
    s[_BG] += y * step
    s[_BD] += step
    s[_BH] += warmth * step


@compiled
def _block(s, settings, dwells, count):  # type: ignore[no-untyped-def]
    """Give the block to the dwell, or begin a new one with it."""
    if s[_BD] <= 0:
        return
    row = (s[_T], s[_A])
    rate = (row[1] - s[_BA]) / s[_BD]
    if s[_OPEN] and s[_SEG] < 0:
        mean = (s[_A1] - s[_A0]) / s[_D]
        if abs(rate - mean) > settings[2] + settings[3] * abs(mean):
            _close(s, settings, dwells, count)
    if not s[_OPEN]:
        s[_OPEN], s[_A0], s[_T0] = 1.0, s[_BA], s[_BT]
        s[_BK] = 0.0
    s[_G] += s[_BG]
    s[_D] += s[_BD]
    s[_H] += s[_BH]
    s[_A1] = row[1]
    s[_K], s[_GK], s[_DK] = s[_BK], s[_BGK], s[_BDK]
    _noise(s, s[_BG] - settings[1] * (row[1] - s[_BA]))
    _anchor(s, row)


@compiled
def _noise(s, residual):  # type: ignore[no-untyped-def]
    s[_NR] += residual
    s[_ND] += s[_BD]
    s[_NB] += 1
    if s[_NB] < PER_MEAN:
        return
    mean = s[_NR] / s[_ND]
    if s[_NH]:
        s[_NS] += 0.5 * ((mean - s[_NL]) * (mean - s[_NL])) * s[_ND]
        s[_NC] += 1
    s[_NL], s[_NH] = mean, 1.0
    s[_NR], s[_ND], s[_NB] = 0.0, 0.0, 0.0


@compiled
def _close(s, settings, dwells, count):  # type: ignore[no-untyped-def]
    """End the dwell; it counts if it was long enough."""
    if s[_OPEN] and (s[_D] >= LEAST - 0.5 * settings[0]) and count[0] < dwells.shape[0]:
        d = dwells[count[0]]
        if s[_K] > 0:
            way = 1.0 if s[_A1] > s[_A0] else -1.0
            d[RATE], d[OUTPUT], d[TIME] = way * s[_K] * 2 * pi / s[_DK], s[_GK] / s[_DK], s[_DK]
        else:
            d[RATE], d[OUTPUT], d[TIME] = (s[_A1] - s[_A0]) / s[_D], s[_G] / s[_D], s[_D]
        d[TURNS], d[POWER], d[START], d[TEMPERATURE] = s[_K], s[_P], s[_T0], s[_H] / s[_D]
        count[0] += 1
    for k in range(_OPEN, _DK + 1):
        s[k] = 0.0
    for k in range(_NR, _NH + 1):
        s[k] = 0.0
