r"""Whole revolutions of the table, and the sums over each that the estimators of north are made of.

An interval with the mean reading y turns the table from a0 to a1. With the elevation ``tilt`` of the input axis,

    g = sin(tilt) (a1 - a0) + w sin(latitude) sin(tilt) dt          what it sees of table and vertical Earth rate
    r = y dt - g                                                    what is left
    cos_m = cos((a0 + a1) / 2) sinc((a1 - a0) / 2)                  mean of the cosine; the sine likewise

A revolution has the sums of ``r (1, cos_m, sin_m)``, of ``g (1, cos_m, sin_m)``, the same with the time since it
began, and of ``dt (1, cos_m, sin_m, ...)``. The interval that it begins or ends in counts by the share of its
angle that lies inside, in all sums alike: so what is solved from them is exact wherever the boundary falls.

Revolutions are delimited within stretches of one direction at a steady rate, from where the stretch begins. A
gap in time, a missing value and a change of rate by more than `STEADY` begin a new stretch. Intervals have the
length 1/sampling.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, isfinite, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insenv.core.compiled import jit, of_one_type, patient
from insenv.core.earth import EARTH_RATE
from insenv.core.estimate import Datasheet
from insenv.core.recording import GAP, Floats, Recording

#: Share by which a rate may differ from the mean of its stretch.
STEADY = 0.05
#: Noise of an angle step, in standard deviations, that is no change of rate.
SLACK = 8.0
#: An angle this near a boundary has reached it [rad].
REACHED = 1e-9
TURN = 2 * np.pi

#: Sums of a revolution: of dt; r (1, cos, sin); g (1, time); g (cos, sin); g time (cos, sin); dt (cos, sin, cos^2,
#: cos sin, sin^2).
T, N, BC, BS, A0, A1, GC, GS, HC, HS, LC, LS, CC, CS, SS = range(15)
#: When and at what angle it began, which way it turns, its stretch, the shares of the intervals at its two ends.
START, ANGLE, WAY, STRETCH, F0, F1 = range(15, 21)
WIDTH = 21
#: What is kept of the row before: whether there is one, its time and angle; of the stretch: where it began, its
#: rows, the revolutions that it has completed, its number.
_SEEN, _TIME, _LAST, _ORIGIN, _ROWS, _DONE, _NUMBER = range(7)


def compiled(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """The kernel compiled when it is first used, and kept on disk where there is a place for it."""
    machine: Callable[..., Any] = jit(kernel)
    return machine


def patiently(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """The same for what chunks are given to: compiled when it has worked enough for that."""
    machine: Callable[..., Any] = patient(kernel)
    return machine


@dataclass(frozen=True)
class Axis:
    """What an input axis sees as the table turns.

    Attributes
    ----------
    dt : float
        Length of an interval [s].
    share : float
        Of the table's rate.
    vertical : float
        Of the vertical Earth rate [rad/s].
    slack : float
        Step of the angle that noise may make [rad].
    instant : bool
        Whether a reading is the value at the end of the interval, not the mean over it.
    """

    dt: float
    share: float
    vertical: float
    slack: float
    instant: bool = False


def gyro_axis(datasheet: Datasheet) -> Axis:
    """Input axis of the gyro that a data sheet describes."""
    share = float(np.sin(datasheet.mounting.tilt))
    latitude = datasheet.site.latitude
    vertical = 0.0 if latitude is None else EARTH_RATE * float(np.sin(latitude)) * share
    return Axis(datasheet.dt, share, vertical, slack(datasheet))


def slack(datasheet: Datasheet) -> float:
    """Step of the angle that the noise of the encoder may make [rad]."""
    return SLACK * 2**0.5 * datasheet.encoder_noise


@dataclass(frozen=True)
class Revolutions:
    """Revolutions so far.

    Attributes
    ----------
    now : ndarray, shape (..., 7)
        The row before, and the stretch.
    open : ndarray, shape (..., WIDTH)
        Sums of the revolution that is not complete.
    closed : ndarray, shape (..., m, WIDTH)
        Sums of the complete ones, `T` to `F1`; rows beyond ``count`` are zero.
    count : ndarray of int, shape (...)
    """

    now: Floats
    open: Floats
    closed: Floats
    count: NDArray[np.int64]


def begin(batch: int | None) -> Revolutions:
    """Before any data."""
    front = () if batch is None else (batch,)
    return Revolutions(
        np.zeros((*front, 7)), np.zeros((*front, WIDTH)), np.zeros((*front, 0, WIDTH)), np.zeros(front, int)
    )


def follow(state: Revolutions, axis: Axis, chunk: Recording, target: str, unit: str) -> Revolutions:
    """After a chunk with the channels ``target`` and "table_angle", shape (..., n).

    Raises
    ------
    InputError
        If it lacks one of them, or has it in another unit.
    """
    front = state.now.shape[:-1]
    n = len(chunk.t)
    rows = int(np.prod(front))
    y, angle = (
        of_one_type(values, (*front, n)).reshape(rows, n)
        for values in (chunk.values(target, unit), chunk.values("table_angle", "rad"))
    )
    if not n:
        return state
    now, part = state.now.reshape(rows, -1).copy(), state.open.reshape(rows, -1).copy()
    count = state.count.reshape(rows).copy()
    there = state.closed.shape[-2]
    closed = np.zeros((rows, there + _most(angle, now), WIDTH))
    closed[:, :there] = state.closed.reshape(rows, there, WIDTH)
    _walk(of_one_type(chunk.t), y, angle, _settings(axis), (now, part, closed, count))
    closed = closed[:, : count.max(initial=0)]
    return Revolutions(
        now.reshape(*front, -1), part.reshape(*front, -1), closed.reshape(*front, -1, WIDTH), count.reshape(front)
    )


def _settings(axis: Axis) -> tuple[float, float, float, float, bool]:
    return float(axis.dt), float(axis.share), float(axis.vertical), float(axis.slack), axis.instant


@patiently
def _most(angle, now):  # type: ignore[no-untyped-def]
    """Revolutions that a chunk can complete at most."""
    most = 0
    for r in range(angle.shape[0]):
        before = now[r, _LAST] if now[r, _SEEN] else angle[r, 0]
        path = 0.0
        for a in angle[r]:
            if isfinite(a):
                path += abs(a - before) if isfinite(before) else 0.0
                before = a
        most = max(most, int(path / TURN) + 2)
    return most


@patiently
def _walk(t, y, angle, settings, state):  # type: ignore[no-untyped-def]
    """Every row of a batch, in place."""
    now, part, closed, count = state
    for r in range(y.shape[0]):
        row = (now[r], part[r], closed[r], count[r : r + 1])
        m = 0
        while m < t.size:
            _step(t[m], y[r, m], angle[r, m], settings, row)
            m = _run(t, y[r], angle[r], m + 1, settings, row)


@compiled
def _step(t, y, a, settings, state):  # type: ignore[no-untyped-def]
    """One interval, whatever it brings."""
    now, part = state[0], state[1]
    dt, slack = settings[0], settings[3]
    whole = isfinite(y) and isfinite(a)
    before = now[_LAST]
    follows = whole and now[_SEEN] > 0 and t - now[_TIME] < GAP * dt
    now[_SEEN], now[_TIME], now[_LAST] = (1.0 if whole else 0.0), t, a
    if not follows:
        now[_ROWS] = 0.0
        return
    if now[_ROWS] == 0.0 or not _steady(a, before, now[_ORIGIN], now[_ROWS], slack):
        now[_ORIGIN], now[_ROWS], now[_DONE] = before, 0.0, 0.0
        now[_NUMBER] += 1.0
        _open(part, t - dt, before, now[_NUMBER], 1.0)
    now[_ROWS] += 1.0
    sample = _sample(t, y, a, before, settings)
    start, stop = abs(before - now[_ORIGIN]), abs(a - now[_ORIGIN])
    _divide(sample, start, stop, dt, state)


@compiled
def _run(t, y, angle, m, settings, state):  # type: ignore[no-untyped-def]
    """The intervals that go on steadily within one revolution, from ``m`` on: the same, but in registers."""
    now, part = state[0], state[1]
    if now[_ROWS] == 0.0:
        return m
    dt, slack = settings[0], settings[3]
    before, time, rows, origin = now[_LAST], now[_TIME], now[_ROWS], now[_ORIGIN]
    end, start = (now[_DONE] + 1.0) * TURN - REACHED, part[START]
    sums = _sums(part)
    while m < t.size:
        a = angle[m]
        # False for NaN as well.
        if not (isfinite(y[m]) and t[m] - time < GAP * dt and abs(a - origin) < end):
            break
        if not _steady(a, before, origin, rows, slack):
            break
        sums = _add(sums, 1.0, _sample(t[m], y[m], a, before, settings), start, dt)
        before, time, rows, m = a, t[m], rows + 1.0, m + 1
    now[_LAST], now[_TIME], now[_ROWS] = before, time, rows
    _store(part, sums)
    return m


@compiled
def _steady(a, before, origin, rows, slack):  # type: ignore[no-untyped-def]
    """Whether a step is like the mean of the ``rows`` before."""
    turned = before - origin
    return abs((a - before) * rows - turned) <= STEADY * abs(turned) + slack * rows


@compiled
def _sample(t, y, a, before, settings):  # type: ignore[no-untyped-def]
    """Mid-time, r, g, and the means of cosine and sine."""
    dt, share, vertical, _, instant = settings
    step = a - before
    g = share * step + vertical * dt
    middle, shrink = (a, 1.0) if instant else (0.5 * (before + a), _sinc(0.5 * step))
    return t - 0.5 * dt, y * dt - g, g, shrink * cos(middle), shrink * sin(middle)


@compiled
def _divide(sample, start, stop, dt, state):  # type: ignore[no-untyped-def]
    """An interval that turns from ``start`` to ``stop``, seen from the origin, among revolutions."""
    now, part, closed, count = state
    left = 1.0
    while stop - now[_DONE] * TURN >= TURN - REACHED:
        over = max(stop - (now[_DONE] + 1.0) * TURN, 0.0)
        beyond = min(over / (stop - start), left) if stop > start else 0.0
        _store(part, _add(_sums(part), left - beyond, sample, part[START], dt))
        way = 1.0 if now[_LAST] > now[_ORIGIN] else -1.0
        part[WAY], part[F1] = way, 1.0 - beyond
        for k in range(part.size):  # a row at once would compile the message of shapes that differ: 3 s
            closed[count[0], k] = part[k]
        count[0] += 1
        now[_DONE] += 1.0
        left = beyond
        edge = sample[0] + 0.5 * dt - beyond * dt
        _open(part, edge, now[_ORIGIN] + way * TURN * now[_DONE], now[_NUMBER], 1.0 - beyond)
    _store(part, _add(_sums(part), left, sample, part[START], dt))


@compiled
def _open(part, start, angle, number, share):  # type: ignore[no-untyped-def]
    part[:] = 0.0
    part[START], part[ANGLE], part[STRETCH], part[F0] = start, angle, number, share


@compiled
def _add(sums, weight, sample, start, dt):  # type: ignore[no-untyped-def]
    """Sums of a revolution with one interval more, `T` to `SS`."""
    middle, r, g, c, s = sample
    r, g, dt = weight * r, weight * g, weight * dt
    later, dt_c, dt_s = g * (middle - start), dt * c, dt * s
    rates = (sums[0] + dt, sums[1] + r, sums[2] + r * c, sums[3] + r * s)
    scales = (sums[4] + g, sums[5] + later, sums[6] + g * c, sums[7] + g * s, sums[8] + later * c, sums[9] + later * s)
    times = (sums[10] + dt_c, sums[11] + dt_s, sums[12] + dt_c * c, sums[13] + dt_c * s, sums[14] + dt_s * s)
    return rates + scales + times


@compiled
def _sums(part):  # type: ignore[no-untyped-def]
    p = part
    return p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11], p[12], p[13], p[14]


@compiled
def _store(part, sums):  # type: ignore[no-untyped-def]
    for i in range(15):
        part[i] = sums[i]


@compiled
def _sinc(x):  # type: ignore[no-untyped-def]
    """Sin(x)/x; the series is exact to rounding below 0.05."""
    if abs(x) < 0.05:
        z = x * x
        return 1.0 - z * (1.0 / 6.0) * (1.0 - z * (1.0 / 20.0) * (1.0 - z * (1.0 / 42.0)))
    return sin(x) / x
