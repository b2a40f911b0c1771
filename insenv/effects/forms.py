"""Forms that several effects share: interval means in closed form, and regressors side by side.

Over an interval [t0, t1] of length dt the mean of an exponential is exact,

    mean exp(-t / tau) = exp(-t0 / tau) (1 - exp(-dt / tau)) / (dt / tau),

and so is that of a harmonic of an angle that turns evenly from a0 to a1,

    mean cos(n a) = cos(n (a0 + a1) / 2) sinc(n (a1 - a0) / 2),     sinc x = sin x / x.

With an acceleration g the mean angle is (a0 + a1) / 2 - g dt^2 / 12: the harmonic's phase is moved by it.

What follows x through a gap of radius r is the play operator

    P_k = min(max(P_{k-1}, x_k - r), x_k + r);

a chain of plays is one play: prefixes are composed in log2(n) passes, exactly.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.linalg.blas import dtbsv

from insenv.core.errors import InputError
from insenv.core.motion import Motion
from insenv.core.recording import Floats

#: Half-angles up to which `_sinc` is 1 + A x^2 + B x^4 [rad], and A and B: those of the series, its term in x^6
#: replaced by the polynomial of lower degree that is nearest to it up to there (Chebyshev), which is wrong by 3e-17.
_SMALL = 0.0125
_SINC = (-1 / 6 + 9 / 16 * _SMALL**4 / 5040, 1 / 120 - 3 / 2 * _SMALL**2 / 5040)

#: Share of the radius from which on a play is taken up: of 1e-8 rad beside a thousand turns no more figures are left.
TAUT = 0.999

#: Why what an encoder gets wrong in a turn is not seen on an exposure that stands (`Motion.stands`).
SET = "the table's angle was set from rest to rest: no row holds a turn"

#: Intervals up to which an angle counts as straight [s]: at 60 deg/s^2 it bends by 9e-6 rad, 1e-4 deg/h of Earth rate.
_SHORT = 0.01


def known(motion: Motion, name: str, effect: str) -> Floats:
    """Field ``name`` of the exposure, as an array.

    Raises
    ------
    InputError
        If the exposure lacks it: an effect cannot act on what nobody measured.
    """
    value = getattr(motion, name)
    if value is None:
        raise InputError(f"effect {effect!r} needs {name}, which the exposure lacks")
    return np.asarray(value)


def play(x: Floats, radius: float | Floats, before: Floats) -> Floats:
    """What follows ``x``, shape (..., n), through a gap of ``radius`` either way, from ``before``, shape (...)."""
    low, high = x - radius, x + radius
    low, high = np.broadcast_arrays(low, high)
    low, high = low.copy(), high.copy()
    step = 1
    while step < x.shape[-1]:
        # Each bound of the steps before, sent through the steps after: a chain of clamps is one clamp.
        a, b = low[..., step:].copy(), high[..., step:].copy()
        low[..., step:] = np.minimum(np.maximum(low[..., :-step], a), b)
        high[..., step:] = np.minimum(np.maximum(high[..., :-step], a), b)
        step *= 2
    return np.minimum(np.maximum(before[..., None], low), high)


def turning_points(x: Floats) -> Floats:
    """Where ``x``, shape (n,), turns or stops, and both its ends: a play is where it would be behind these alone."""
    turns = np.diff(np.sign(np.diff(x))) != 0
    return x[np.concatenate([[True], turns, [True]])] if len(x) > 1 else x


def reversals(x: Floats, radius: float) -> int:
    """How often ``x``, shape (n,), turns by more than twice a radius."""
    side = x - play(x, radius, x[:1])
    ends = np.sign(side[np.abs(side) > TAUT * radius])
    return int(np.count_nonzero(np.diff(ends)))


def along_axes(values: Mapping[str, Floats]) -> list[Floats]:
    """One array for each of x, y and z; zero where an axis is unknown."""
    return [values.get(axis, np.zeros(1)) for axis in "xyz"]


def cyclic(motion: Motion, effect: str) -> tuple[str, str, str]:
    """The input axis of a unit, and the two after it in cyclic order.

    Raises
    ------
    InputError
        If the exposure does not say which it is.
    """
    if not motion.axis:
        raise InputError(f"effect {effect!r} needs the input axis, which the exposure lacks")
    i = "xyz".index(motion.axis)
    return "xyz"[i], "xyz"[(i + 1) % 3], "xyz"[(i + 2) % 3]


def columns(u: Floats, *regressors: Floats) -> Floats:
    """Regressors side by side, shape (..., n, k), with the batch axes of ``u`` and of each of them.

    A single one of that shape is not copied: the result is not to be written to.
    """
    shape = np.shape(u)
    if any(np.shape(r) != shape for r in regressors):
        shape = np.broadcast_shapes(shape, *(np.shape(r) for r in regressors))
    if len(regressors) == 1 and np.shape(regressors[0]) == shape:
        return regressors[0][..., None]
    # Each in one piece: to write and to add up columns of a batch whose numbers stand apart takes twice the time.
    one_by_one = np.empty((len(regressors), *shape))
    for j, regressor in enumerate(regressors):
        one_by_one[j] = regressor
    return np.moveaxis(one_by_one, 0, -1)


def spread(u: Floats, addition: Floats) -> Floats:
    """An addition with the batch axes of the input ``u`` as well as its own."""
    if addition.shape == np.shape(u):
        return addition
    shape = np.broadcast_shapes(np.shape(u), addition.shape)
    return addition if addition.shape == shape else np.broadcast_to(addition, shape).copy()


def decay(motion: Motion, tau: Floats) -> Floats:
    """Mean of exp(-t / tau) over each interval, for time constants of shape (..., 1).

    Of shape (..., n), or (n,) where all time constants are the same.
    """
    if tau.size > 1 and not np.count_nonzero(tau != tau.flat[0]):
        tau = tau.reshape(-1)[:1]  # one curve for all runs
    decay_rate = -1.0 / tau
    x = motion.dt * decay_rate
    mean: Floats = np.exp(motion.t[:-1] * decay_rate) * (np.expm1(x) / x)
    return mean


def bend(motion: Motion) -> Floats | None:
    """Mean angle of each interval less the middle of its edges [rad], shape (..., n): - a dt^2 / 12 at acceleration a.

    None where the interval is short, or the acceleration is not known.
    """
    if motion.dt <= _SHORT * (1 + 1e-6) or motion.rate_edges is None or not motion.projection:
        return None
    bent: Floats = np.diff(motion.rate_edges, axis=-1) * (-motion.dt / (12 * motion.projection * motion.gain))
    return bent


def wave(angle: Floats, order: int, c: float | Floats, s: float | Floats, bent: Floats | None = None) -> Floats:
    """Mean of c cos(n a) + s sin(n a) over each interval, shape (..., n), for angles at the edges.

    ``c`` and ``s`` are numbers or of shape (..., 1); ``bent`` is what `bend` says of a table that does not turn evenly.
    """
    first, last = angle[..., :-1], angle[..., 1:]
    half_phase = last + first
    half_phase *= 0.25 * order
    if bent is not None:
        half_phase += (0.5 * order) * bent
    mean = cosine_of_twice(half_phase - 0.5 * np.arctan2(s, c))
    mean *= _sinc(np.subtract(last, first, out=half_phase), 0.5 * order)
    mean *= np.hypot(c, s)
    return mean


def wave_at(motion: Motion, angle: Floats, order: int, c: float | Floats, s: float | Floats) -> Floats:
    """`wave` of angles at the edges of an exposure, with its bend, or of the angle at which the table stands."""
    if not motion.stands:
        return wave(angle, order, c, s, bend(motion))
    return standing(angle, order, c, s)


def standing(angle: Floats, order: int, c: float | Floats, s: float | Floats) -> Floats:
    """The same of a table that stands in each interval at the angle of its end."""
    return np.asarray(np.cos(order * angle[..., 1:] - np.arctan2(s, c)) * np.hypot(c, s))


def cosine_of_twice(half: Floats) -> Floats:
    """Cosine of twice an angle to 2e-16, in place: 2 / (1 + tan^2) - 1.

    NumPy has a fast tangent, but no fast cosine.
    """
    value = np.tan(half, out=half)
    value *= value
    value += 1.0
    np.divide(2.0, value, out=value)
    value -= 1.0
    return value


def _sinc(turn: Floats, factor: float) -> Floats:
    """Sine of x over x to 1e-16, for x = turn * factor; ``turn`` is overwritten."""
    square = np.multiply(turn, turn, out=turn)
    a, b, limit = _SINC[0] * factor**2, _SINC[1] * factor**4, (_SMALL / factor) ** 2
    value = square * b
    value += a
    value *= square
    value += 1.0
    if square.max(initial=0.0) > limit:
        # Only where it is needed, so that no value depends on those that it is computed together with.
        large = square > limit
        value[large] = np.sinc(np.sqrt(square[large]) * (factor / np.pi))
    return value


def time_constants(motion: Motion, count: int = 12) -> Floats:
    """Time constants that a scan tries, from a few intervals to twice the run's length; shape (g, 1)."""
    span = motion.dt * motion.n
    return np.geomspace(max(3 * motion.dt, span / 300), 2 * span, count)[:, None]


def checked_order(effect: str, order: int, highest: int) -> None:
    """Refuse an order that the effect does not have.

    Raises
    ------
    InputError
    """
    if not 1 <= order <= highest:
        raise InputError(f"effect {effect!r}: order {order} given, wanted 1 to {highest}")


def behind_the_table(motion: Motion) -> str:
    """Why what remembers the rate's past cannot be told on this exposure; empty where it can.

    A reference that comes late has a past of its own, the logger's or the servo's, which is known but nearly.
    """
    return "beside a reference that comes late: what is left of its lag looks the same" if motion.lag else ""


def first_order(decayed: Floats, drive: Floats, start: Floats) -> tuple[Floats, Floats]:
    """Solve w[k+1] = decayed w[k] + drive[k]: w at the first n edges, shape (..., n), and at the last."""
    shape = np.broadcast_shapes(drive.shape[:-1], start.shape)
    n = drive.shape[-1]
    edges = np.empty((*shape, n + 1))
    edges[..., 0], edges[..., 1:] = start, drive
    factor, band = np.broadcast_to(decayed, shape), np.empty((2, n + 1), order="F")
    for row in np.ndindex(shape):
        # As a triangular system of two diagonals; `scipy.signal` would take longer to import than a day to filter.
        band[1] = -factor[row]
        edges[row] = dtbsv(1, band, edges[row], lower=1, diag=1)
    return edges[..., :-1], edges[..., -1].copy()
