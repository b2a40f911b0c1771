r"""North from revolutions whose scale factor is found on the way: the paper's on-line recursion, corrected.

The scale factor is 1 + e0 + e1 (t - t_i). Two neighbouring revolutions j give e0 and e1,

    N_j = e0 A0_j + e1 (A1_j + (t_j - t_i) A0_j) + (c Lc_j + s Ls_j),

and the correlation sums of revolution i, less what the scale factor adds to them, give c and s; the sums over
all revolutions are solved at once. N is the sum of what is left when the nominal scale factor is taken off.

Corrected against the paper: means over the intervals instead of end angles (`end_angle_bias`); measured angles
and durations instead of 2 pi and T; boundaries interpolated; the horizontal Earth rate that does not cancel in
such a revolution is kept. The paper does not say which pair serves which revolution:

    forward           (i, i+1) serves i, and the last pair the last revolution as well: nearest to the text
    non_overlapping   (1, 2), (3, 4) ... serve both of theirs; an odd one out is served by the last two
    centred           the mean of (i-1, i) and (i, i+1)
    predicting        (i-2, i-1) serves i: causal, drops the first two revolutions

Everything is linear in the sums, so the noise that a pairing adds is in the covariance
(`estimators.north_finder.spread`). At one rate lock-in and bias look like a scale factor. What is called so holds the
lock-in; a declared bias is an error of it and in its covariance. The azimuth is that of a table in level
(`estimators.north_finder.levelling`).

Source: Zhang, Wu and Wu, Opt. Precis. Eng. 19 (2011) 146, equations 2 to 5.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, final, get_args

import numpy as np

from estimators.common.told import Errors, gyro_errors
from estimators.common.turns import (
    A0,
    A1,
    CC,
    CS,
    GC,
    GS,
    HC,
    HS,
    LC,
    LS,
    SS,
    START,
    STRETCH,
    Revolutions,
    T,
    begin,
    compiled,
    follow,
    gyro_axis,
    patiently,
)
from estimators.north_finder.correlation import divide
from estimators.north_finder.spread import azimuth, level_rate, solved
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.effects.rate.scale import ScaleFactor, ScaleFactorDrift

Pairing = Literal["forward", "non_overlapping", "centred", "predicting"]
_FORWARD, _NON_OVERLAPPING, _CENTRED, _PREDICTING = range(4)


def end_angle_bias(rate: float, dt: float) -> float:
    """Error of the paper's phi [rad] if the angle at the end of an interval is taken for its mean, as eq. 3 prints it.

    ``rate`` [rad/s] of the table, ``dt`` [s]: half an interval's turn. The azimuth here is -phi: it errs the other way.
    """
    return -0.5 * rate * dt


@final
@dataclass(frozen=True)
class Revolution:
    """Azimuth, and scale factor at the middle of the last revolution, by pairs of revolutions.

    Attributes
    ----------
    datasheet : Datasheet
    pairing : str
        Which pair of revolutions serves which.

    Raises
    ------
    InputError
        If there is no such pairing.
    """

    datasheet: Datasheet
    pairing: Pairing = "forward"

    def __post_init__(self) -> None:
        if self.pairing not in get_args(Pairing):
            raise InputError(
                f"revolution: pairing {self.pairing!r} given, wanted one of {', '.join(get_args(Pairing))}"
            )

    def reset(self, batch: int | None = None) -> Revolutions:
        """No revolution yet."""
        return begin(batch)

    def update(self, state: Revolutions, chunk: Recording) -> Revolutions:
        """After a chunk with the channels "gyro" [rad/s] and "table_angle" [rad]."""
        return follow(state, self._errors.axis, chunk, "gyro", "rad/s")

    def estimate(self, state: Revolutions) -> Estimate:
        """Azimuth [rad], error of the scale factor [1] and its rate [1/s], shapes (..., 3) and (..., 3, 3).

        Before a stretch has two revolutions (three where they predict): 0 with the variances pi^2 / 3 and the
        catalogue's for the two effects.
        """
        known, x, cov = solved(state, self._errors, self._weigh, 4)
        angle, variance, slope = azimuth(known, x, cov, level_rate(self.datasheet))
        mean = np.where(known[..., None], np.stack([angle, x[..., 2], x[..., 3]], axis=-1), 0.0)
        full = np.zeros((*angle.shape, 3, 3))
        full[..., 0, 0] = variance
        full[..., 1:, 1:] = np.where(known[..., None, None], cov[..., 2:, 2:], _prior())
        full[..., 0, 1:] = slope[..., 0, None] * cov[..., 0, 2:] + slope[..., 1, None] * cov[..., 1, 2:]
        full[..., 1:, 0] = full[..., 0, 1:]
        return Estimate(("azimuth", ScaleFactor.id, "scale_factor_rate"), ("rad", "1", "1/s"), mean, full)

    @cached_property
    def _errors(self) -> Errors:
        return gyro_errors(self.datasheet, gyro_axis(self.datasheet))

    @property
    def _weigh(self) -> Callable[..., Any]:
        mode = get_args(Pairing).index(self.pairing)
        return lambda *arrays: _weigh(mode, *arrays)


def _prior() -> Floats:
    """Variances of a scale factor and of its rate that nothing is told of."""
    return np.diag([ScaleFactor.linear[0].sd ** 2, ScaleFactorDrift.linear[0].sd ** 2])


@patiently
def _weigh(mode, closed, count, coefficients, known, time):  # type: ignore[no-untyped-def]
    """Coefficients of cosine, sine, scale factor and its rate."""
    for r in range(len(count)):
        s, c = closed[r, : count[r]], coefficients[r]
        latest = _north(mode, s, c)
        known[r] = latest >= 0
        if known[r]:
            time[r] = s[latest + 1, START] + 0.5 * s[latest + 1, T]
            _scale(s, latest, time[r], c)


@compiled
def _north(mode, s, c):  # type: ignore[no-untyped-def]
    """First two outputs; returns the first revolution of the latest pair, -1 where there is none."""
    matrix = np.zeros(4)
    latest, first = -1, 0
    while first < len(s):
        stop = first + 1
        while stop < len(s) and s[stop, STRETCH] == s[first, STRETCH]:
            stop += 1
        # In the table plane (A0 = 0) a gyro tells nothing of its scale factor.
        if s[first, A0] != 0.0 and stop - first >= (3 if mode == _PREDICTING else 2):
            latest = stop - 2
            for i in range(first + 2 if mode == _PREDICTING else first, stop):
                _serve(mode, s, i, first, stop, c)
                c[i, 0, 1] = c[i, 1, 2] = 1.0
                for k, at in enumerate((CC, CS, CS, SS)):
                    matrix[k] += s[i, at]
        first = stop
    for j in range(len(s)):
        for o in range(2):
            matrix[2 * o] += c[j, o, 0] * s[j, LC]
            matrix[2 * o + 1] += c[j, o, 0] * s[j, LS]
    if latest >= 0 and divide(c, len(s), matrix[0], matrix[1], matrix[2], matrix[3]):
        return latest
    return -1


@compiled
def _serve(mode, s, i, first, stop, c):  # type: ignore[no-untyped-def]
    """What the pairs that serve revolution ``i`` take off its correlation sums."""
    if mode == _NON_OVERLAPPING:
        _take_off(s, i, min(first + 2 * ((i - first) // 2), stop - 2), 1.0, c)
    elif mode == _PREDICTING:
        _take_off(s, i, i - 2, 1.0, c)
    elif mode == _CENTRED:
        _take_off(s, i, min(i, stop - 2), 0.5, c)
        _take_off(s, i, max(i - 1, first), 0.5, c)
    else:
        _take_off(s, i, min(i, stop - 2), 1.0, c)


@compiled
def _take_off(s, i, p, share, c):  # type: ignore[no-untyped-def]
    """The pair (p, p + 1) for revolution ``i``."""
    e = _pair(s, p, s[i, START])
    for o, (g, h) in enumerate(((GC, HC), (GS, HS))):
        c[p, o, 0] -= share * (s[i, g] * e[0] + s[i, h] * e[2])
        c[p + 1, o, 0] -= share * (s[i, g] * e[1] + s[i, h] * e[3])


@compiled
def _pair(s, p, time):  # type: ignore[no-untyped-def]
    """Scale factor at ``time`` and its rate from N of the pair (p, p + 1): two rows of two coefficients."""
    a, b = s[p, A0], s[p + 1, A0]
    da = s[p, A1] + (s[p, START] - time) * a
    db = s[p + 1, A1] + (s[p + 1, START] - time) * b
    det = a * db - da * b
    return db / det, -da / det, -b / det, a / det


@compiled
def _scale(s, p, time, c):  # type: ignore[no-untyped-def]
    """Last two outputs, from the pair (p, p + 1) less the horizontal Earth rate that did not cancel."""
    e = _pair(s, p, time)
    for o in range(2):
        before, after = e[2 * o], e[2 * o + 1]
        lc = before * s[p, LC] + after * s[p + 1, LC]
        ls = before * s[p, LS] + after * s[p + 1, LS]
        for j in range(len(s)):
            for i in range(3):
                c[j, 2 + o, i] -= lc * c[j, 0, i] + ls * c[j, 1, i]
        c[p, 2 + o, 0] += before
        c[p + 1, 2 + o, 0] += after
