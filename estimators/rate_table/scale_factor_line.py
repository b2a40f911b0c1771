r"""Scale-factor test on line: the value of each test as soon as the table has turned both ways, and what repeats.

A dwell is a stretch of whole turns one way at one rate. Its sums are N, what the nominal scale factor leaves of the
readings, A, the angle that the input axis turned with the table and with the vertical Earth rate, and its time T. Two
neighbouring dwells at the same rate in opposite directions are a test: its relative error e of the scale factor and
the bias b follow from

    N_f = e A_f + b T_f,   N_r = e A_r + b T_r,   e = (N_f T_r - N_r T_f) / D,   D = A_f T_r - A_r T_f

so that the bias cancels whatever the two times are, as does the horizontal Earth rate over whole turns. With the
random walk N0, the white angle error E of pulses and encoder at the ends of the turns, and the variance s^2 of how far
the bias drifts from one dwell to the other (`drifted`),

    var e = (T_r^2 V_f + T_f^2 V_r + (T_f T_r)^2 s^2) / D^2,   V = N0^2 T + E^2 per end.

Not in it is what makes the scale factor itself differ from test to test: lock-in adds -W^2 / (2 u^2) at the rate u,
and a threshold W that has wandered by the share w changes that by 2 w of itself; warm-up. This is no error of a
value, but what the repeatability is there to show.

Source: Zhang, Wu and Wu, Opt. Precis. Eng. 19 (2011) 146, table 1; IEEE Std 647-2006, scale factor test.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import final

import numpy as np
from numpy.typing import NDArray

from estimators.common.turns import (
    A0,
    F0,
    F1,
    START,
    STEADY,
    STRETCH,
    WAY,
    WIDTH,
    Axis,
    N,
    Revolutions,
    T,
    begin,
    compiled,
    follow,
    gyro_axis,
    patiently,
)
from estimators.rate_table.scale_factor import mean_and_repeatability
from insenv.core.compiled import of_one_type
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import ARCSEC
from insenv.effects.rate.scale import ScaleFactor
from insenv.information.rate_noise import white_angle

#: What is kept of a dwell: direction, whole turns, N, A, T, the weight of the white angle error at the ends of its
#: stretches, the stretch it is in and the weight of that one's end, and from when to when it lasted.
_WAY, _TURNS, _LEFT, _NOMINAL, _TIME, _ENDS, _IN, _END, _START, _STOP = range(10)
_KEPT = 10


@dataclass(frozen=True)
class LevelSums:
    """Dwells so far.

    Attributes
    ----------
    turns : Revolutions
        The revolution that is not complete.
    sums : ndarray, shape (..., d, 10)
        Of the dwells; rows beyond ``count`` are zero.
    count : ndarray of int, shape (...)
    """

    turns: Revolutions
    sums: Floats
    count: NDArray[np.int64]


@final
@dataclass(frozen=True)
class ScaleFactorOnLine:
    """Relative error of the scale factor (reading per angle, 1 + error) in each test, its mean and repeatability.

    A test is complete when its second dwell has as many whole turns as the first, or one less, or has ended. Dwells
    are found by the table's angle. Of a chunk with segments only these rows are taken.

    Attributes
    ----------
    datasheet : Datasheet
    tests : int
        How many tests are reported; further ones are passed over.

    Raises
    ------
    InputError
        If fewer than two tests are asked for, or the input axis lies in the table plane.
    """

    datasheet: Datasheet
    tests: int = 8

    def __post_init__(self) -> None:
        if self.tests < 2:
            raise InputError(f"scale_factor: {self.tests} tests given, wanted two or more")
        if abs(self._axis.share) < 1e-6:
            raise InputError("scale_factor: the input axis lies in the table plane and sees nothing of its turning")

    def reset(self, batch: int | None = None) -> LevelSums:
        """No dwell yet."""
        front = () if batch is None else (batch,)
        return LevelSums(begin(batch), np.zeros((*front, 0, _KEPT)), np.zeros(front, np.int64))

    def update(self, state: LevelSums, chunk: Recording) -> LevelSums:
        """After a chunk with the channels "gyro" [rad/s] and "table_angle" [rad]."""
        for part in _labelled(chunk):
            state = _added(state, follow(state.turns, self._axis, part, "gyro", "rad/s"))
        return state

    def estimate(self, state: LevelSums) -> Estimate:
        """Mean "scale_factor" [1], "repeatability" [1] and "test_1" ..., shapes (..., k) and (..., k, k).

        The repeatability is relative, of the angle per pulse, with n - 1; its variance is that of the standard
        deviation of n Gaussian values. The variance of the mean is that of the values, without their scatter. What is
        not yet known is 0 with the variance that the catalogue gives a scale factor.
        """
        there, error, variance = self._of_tests(state)
        n = there.sum(axis=-1)
        prior = ScaleFactor.linear[0].sd ** 2
        mean = np.where(there, error, 0.0).sum(axis=-1) / np.maximum(n, 1)
        _, spread = mean_and_repeatability(1 / (1 + error), there)
        share = np.where(there, variance, 0.0) / np.maximum(n, 1)[..., None]
        cov = np.zeros((*n.shape, 2 + self.tests, 2 + self.tests))
        each = np.arange(self.tests)
        cov[..., 2 + each, 2 + each] = np.where(there, variance, prior)
        cov[..., 0, 2:] = cov[..., 2:, 0] = share
        cov[..., 0, 0] = np.where(n > 0, share.sum(axis=-1) / np.maximum(n, 1), prior)
        cov[..., 1, 1] = np.where(n > 1, spread**2 / (2 * np.maximum(n - 1, 1)), prior)
        values = np.concatenate([mean[..., None], spread[..., None], np.where(there, error, 0.0)], axis=-1)
        names = (ScaleFactor.id, "repeatability", *(f"test_{k + 1}" for k in each))
        return Estimate(names, len(names) * ("1",), values, cov)

    def _of_tests(self, state: LevelSums) -> tuple[NDArray[np.bool_], Floats, Floats]:
        """Which tests are complete, their errors of the scale factor and variances, each of shape (..., tests)."""
        front, d = state.count.shape, state.sums.shape[-2]
        rows = state.count.size
        first = np.full((rows, self.tests), -1)
        # Two empty dwells at the end, so that where there is no test there is something to take.
        sums = np.concatenate([state.sums.reshape(rows, d, _KEPT), np.zeros((rows, 2, _KEPT))], axis=1)
        _pair(sums, state.count.reshape(rows), first)
        there = first >= 0
        place = np.where(there, first, d)
        row = np.arange(rows)[:, None]
        error, variance = self._solved(sums[row, place], sums[row, place + 1])
        shape = (*front, self.tests)
        error, variance = np.where(there, error, 0.0), np.where(there, variance, 0.0)
        return there.reshape(shape), error.reshape(shape), variance.reshape(shape)

    def _solved(self, f: Floats, r: Floats) -> tuple[Floats, Floats]:
        """Error and variance from the sums of two dwells, each of shape (..., 10)."""
        walk = self.datasheet.white("gyro") ** 2
        white = white_angle(self.datasheet) ** 2
        det = f[..., _NOMINAL] * r[..., _TIME] - r[..., _NOMINAL] * f[..., _TIME]
        det = np.where(det != 0, det, 1.0)
        tf, tr = f[..., _TIME], r[..., _TIME]
        error = (f[..., _LEFT] * tr - r[..., _LEFT] * tf) / det
        of_f, of_r = (walk * d[..., _TIME] + white * d[..., _ENDS] for d in (f, r))
        drift = (tf * tr) ** 2 * drifted(self.datasheet, f[..., _START], f[..., _STOP], r[..., _START], r[..., _STOP])
        return error, (tr**2 * of_f + tf**2 * of_r + drift) / det**2

    @cached_property
    def _axis(self) -> Axis:
        return gyro_axis(self.datasheet)


def arcsec_per_pulse(error: Floats | float, pulse: float) -> Floats:
    """Scale factor in the unit of a maker's table [arcsec per pulse].

    Parameters
    ----------
    error : ndarray or float
        Relative error of the reading per angle, as estimated.
    pulse : float
        Nominal weight of a pulse [rad].
    """
    return np.asarray(pulse / ARCSEC / (1 + np.asarray(error, float)))


def drifted(datasheet: Datasheet, a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    r"""Variance of the change of the bias between its means over [a, b] and [c, d], shape (...) [rad^2/s^2].

    A rate random walk has K^2 ((b - a) / 3 + c - b + (d - c) / 3). The covariance of a bias instability is
    -B^2 / pi ln(t), whose integral over two intervals is that of G'' = ln at their four distances.
    """
    walk = datasheet.walk("gyro") ** 2
    flicker = datasheet.flicker("gyro") ** 2 / np.pi
    one, other = np.maximum(b - a, datasheet.dt), np.maximum(d - c, datasheet.dt)
    both = _twice_integrated(d - a) - _twice_integrated(d - b) + _twice_integrated(c - b) - _twice_integrated(c - a)
    alone = sum(_twice_integrated(length) / length**2 for length in (one, other))
    return walk * (one / 3 + np.maximum(c - b, 0.0) + other / 3) - 2 * flicker * (alone - both / (one * other))


def _twice_integrated(x: Floats) -> Floats:
    """x^2 (ln x / 2 - 3 / 4), whose second derivative is the logarithm."""
    square: Floats = x * x * (0.5 * np.log(np.maximum(np.abs(x), 1e-300)) - 0.75)
    return square


def _labelled(chunk: Recording) -> Iterator[Recording]:
    """The segments of a chunk, or all of it where it has none."""
    if not chunk.segments:
        yield chunk
    for segment in chunk.segments:
        rows = slice(segment.start, segment.stop)
        channels = {
            name: replace(chunk.channel(name), values=chunk.channel(name).values[..., rows])
            for name in ("gyro", "table_angle")
        }
        yield replace(chunk, t=chunk.t[rows], channels=channels, segments=())


def _added(state: LevelSums, turns: Revolutions) -> LevelSums:
    """With the revolutions that are complete since, which then need not be kept."""
    front, m = turns.count.shape, turns.closed.shape[-2]
    if not m:
        return replace(state, turns=turns)
    rows, d = state.count.size, state.sums.shape[-2]
    sums = np.concatenate([state.sums.reshape(rows, d, _KEPT), np.zeros((rows, m, _KEPT))], axis=1)
    count = state.count.reshape(rows).copy()
    _fold(of_one_type(turns.closed.reshape(rows, m, WIDTH)), turns.count.reshape(rows), sums, count)
    most = count.max(initial=0)
    left = replace(turns, closed=np.zeros((*front, 0, WIDTH)), count=np.zeros_like(turns.count))
    return LevelSums(left, sums[:, :most].reshape(*front, most, _KEPT), count.reshape(front))


@patiently
def _fold(closed, turned, sums, count):  # type: ignore[no-untyped-def]
    """Add each revolution to its dwell, in place; one of another direction or rate begins a new dwell."""
    for r in range(len(count)):
        for j in range(turned[r]):
            v = closed[r, j]
            last = count[r] - 1
            if last < 0 or v[WAY] != sums[r, last, _WAY] or not _same_rate(sums[r, last], v[T]):
                last += 1
                count[r] = last + 1
            d = sums[r, last]
            end = v[F1] * v[F1] + (1 - v[F1]) * (1 - v[F1])
            if d[_TURNS] > 0 and d[_IN] == v[STRETCH]:
                d[_ENDS] += end - d[_END]
            else:
                d[_ENDS] += end + v[F0] * v[F0] + (1 - v[F0]) * (1 - v[F0])
            if d[_TURNS] == 0:
                d[_START] = v[START]
            d[_WAY], d[_IN], d[_END], d[_STOP] = v[WAY], v[STRETCH], end, v[START] + v[T]
            d[_TURNS] += 1
            d[_LEFT] += v[N]
            d[_NOMINAL] += v[A0]
            d[_TIME] += v[T]


@compiled
def _same_rate(dwell, time):  # type: ignore[no-untyped-def]
    """Whether a turn that takes so long is like those of a dwell."""
    mean = dwell[_TIME] / dwell[_TURNS]
    return abs(time - mean) <= STEADY * mean


@compiled
def _pair(sums, count, first):  # type: ignore[no-untyped-def]
    """The first dwell of each test that is complete."""
    for r in range(len(count)):
        i, k = 0, 0
        while i + 1 < count[r] and k < first.shape[1]:
            f, s = sums[r, i], sums[r, i + 1]
            match = f[_WAY] != s[_WAY] and _same_rate(f, s[_TIME] / s[_TURNS])
            if match and s[_TURNS] < f[_TURNS] - 1 and i + 2 == count[r]:
                break  # under way
            if match:
                first[r, k] = i
                k += 1
            i += 2 if match else 1
