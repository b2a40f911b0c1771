r"""The motion of a table behind a noisy reading of it: angle, rate and acceleration as a state.

    x_{k+1} = F_k x_k + g eta_k,   eta_k ~ N(0, q_k h_k)    x = (angle, rate, acceleration), per period
    w_k     = H x_k + e_k,         e_k   ~ N(0, s^2)        w the reading: the angle, or the rate

with steps of h_k periods, F = ((1, h, h^2/2), (0, 1, h), (0, 0, 1)): of an even clock one each.

A rate that was measured is no input without errors. In the slope of a regression its noise stands twice: in y - u with
one sign, in every curve of u with the other, and a derivative of u is mostly noise, which pulls a skew towards zero.
Curves of u are therefore made of the smoothed state (Kalman filter, de Jong's smoother), whose error does not know the
motion; y - u keeps the reading itself, with noise that is white from row to row and is fitted there.

s is told by differences of the readings, in which no smooth motion is left: one for all rows, but where those near by
are far louder (an error of the time is one of the angle that goes with the rate). One q for all rows by the likelihood.
A table that holds its rate and then changes it has no one q: by expectation and maximisation each row then takes the
mean square of eta over `NEAR` rows around it, so that dwells are averaged far and corners stay sharp.

Source: J. Durbin and S. J. Koopman, Time Series Analysis by State Space Methods (2012), sections 4.4 to 4.5 and 7.3.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from insenv.core.compiled import jit
from insenv.core.series.robust import MEDIAN
from insenv.core.series.rounding import ORDER, counter_step
from insenv.core.series.stretches import stretches

Floats = NDArray[np.float64]

#: Rows over which the mean square of what drives the motion is taken, and passes until it has settled.
NEAR, PASSES = 16, 12
#: Least of it, as a share of that of the whole run.
LEAST = 1e-6
#: Rows of a run, and rows that may be missing between them, up to which the motion is smoothed.
MOST_ROWS, MOST_GAPS = 300_000, 0.5
#: Share of the noise by which a reading may be off because its time is not even.
UNEVEN = 0.5
#: Share of the square sum of the acceleration from which on noise would bend what is fitted.
MATTERS = 1e-3
#: A spread of the reading in that of its noise, up to which the table stands.
STILL = 1.5
#: Root mean square of a rate's means, in that of means of its noise, from which on the table swings; fewest means.
SWINGS, FEWEST_MEANS = 3.0, 8
#: Deviations of a rate within which it may be zero, fewest means of a stop, and their root mean square of deviations.
SLIGHT, STOP, NOISE_ALONE = 4.0, 12, 1.6
#: Rows around one whose noise is told apart, and how much louder than usual it is then.
LOCAL, LOUDER = 65, 1.5
#: Noise below this share of the largest value is rounding.
ROUNDING = 1e-9

Of = Literal["angle", "rate"]


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The motion of a table over a run.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Times [s], even unless the table stands or was read unevenly; of a rate that covers its interval the ends of
        the intervals.
    angle : ndarray, shape (n,)
        Smoothed angle [rad], from zero where the rate was read.
    noise : float
        Standard deviation of a reading [rad] or [rad/s].
    rate_sd : ndarray, shape (n,)
        Of the smoothed rate [rad/s].
    of : "angle" or "rate"
        What was read.
    still : bool
        Whether the table cannot be told from one that stands.
    angle_sd : ndarray, shape (n,), optional
        Of the smoothed angle, where it was read [rad].
    """

    t: Floats
    angle: Floats
    noise: float
    rate_sd: Floats
    of: Of
    still: bool = False
    angle_sd: Floats | None = None

    @cached_property
    def _curve(self) -> Any:
        from scipy.interpolate import CubicSpline  # slow to import

        return CubicSpline(self.t, self.angle)

    @cached_property
    def _slope(self) -> Any:
        return self._curve.derivative()

    @cached_property
    def _bend(self) -> Any:
        return self._curve.derivative(2)

    def angle_at(self, t: Floats) -> Floats:
        """Angle at times ``t`` [rad]; beyond the ends the table goes on evenly."""
        inside = np.clip(t, self.t[0], self.t[-1])
        return np.asarray(self._curve(inside) + (t - inside) * self._slope(inside))

    def rate_at(self, t: Floats) -> Floats:
        """Rate at times ``t`` [rad/s]."""
        return np.asarray(self._slope(np.clip(t, self.t[0], self.t[-1])))

    def acceleration_at(self, t: Floats) -> Floats:
        """Acceleration at times ``t`` [rad/s^2]."""
        return np.asarray(self._bend(np.clip(t, self.t[0], self.t[-1])))

    def stops(self, t: Floats, rate: Floats, length: float) -> NDArray[np.bool_]:
        """Where a mean ``rate`` over ``length`` around times ``t``, shape (n,), is noise for `STOP` of them and more.

        What is left of the noise there is no motion: a curve of it would explain the very noise that stands in y - u.
        A rate that only passes through zero is larger at both ends. A mean over long is as certain as the angles at its
        ends, and knows motion that is lost in the noise of the rate at an instant.
        """
        deviation = np.interp(t, self.t, self.rate_sd)
        if self.angle_sd is not None:
            deviation = np.minimum(deviation, np.sqrt(2) * np.interp(t, self.t, self.angle_sd) / length)
        score = np.abs(rate) / np.maximum(deviation, 1e-300)
        found = np.zeros(len(t), bool)
        for a, b in stretches(score < SLIGHT):
            found[a:b] = b - a >= STOP and float(np.mean(score[a:b] ** 2)) < NOISE_ALONE**2
        return found


def trajectory(  # noqa: PLR0913 -- what was read, when, of what and how surely
    t: Floats,
    dt: float,
    values: Floats,
    of: Of,
    over_interval: bool = False,
    doubtful: NDArray[np.bool_] | None = None,
) -> Trajectory | None:
    """The motion behind readings of it; None where they have no noise, or cannot be put on even times.

    Parameters
    ----------
    t : ndarray, shape (rows,)
        Times of the readings [s].
    dt : float
        Sampling period [s].
    values : ndarray, shape (rows,)
        [rad] or [rad/s]
    of : "angle" or "rate"
    over_interval : bool
        Whether a rate is the mean over the interval that ends at its time.
    doubtful : ndarray of bool, shape (rows,), optional
        Readings of which nobody knows when they were taken: the motion passes them by. Never the first or the last.
    """
    index = np.rint((t - t[0]) / dt).astype(np.int64)
    change = _changes(values, index)
    noise = _usual(values, change)
    # A reading at another time than the even one is off by the change until then.
    off = float(np.abs(t - t[0] - dt * index).max()) * float(np.abs(np.diff(values)).max(initial=0.0)) / dt
    uneven = off > UNEVEN * noise or bool(np.any(np.diff(index) <= 0))
    if uneven:
        change = _changes_at(t, values)
        noise = _usual(values, change)
    if of == "angle":  # of a table that stands half of the time the counts do not change in most rows
        noise = max(noise, counter_step(values) / np.sqrt(12))
    if noise == 0 or len(t) < 4 * ORDER:
        return None
    if _stands(values, noise, of):
        level = float(np.mean(values)) if of == "angle" else 0.0
        return Trajectory(t, np.full(len(t), level), noise, np.zeros(len(t)), of, still=True)
    n = int(index[-1]) + 1
    if n > MOST_ROWS or n > (1 + MOST_GAPS) * len(t):
        return None
    each = _of_each(change, noise, len(t))
    sure = np.ones(len(t), bool) if doubtful is None else ~doubtful
    sure[[0, -1]] = True
    if uneven:
        at, readings, known, spread = t, values, sure, each
    else:
        at, readings, known, spread = t[0] + dt * np.arange(n), np.zeros(n), np.zeros(n, bool), np.full(n, noise)
        readings[index], known[index], spread[index] = values, sure, each
    steps = np.diff(t) / dt if uneven else np.ones(n - 1)
    states, variances = _smoothed(readings, known, steps, spread, 3 if of == "angle" else 2)
    if not _matters(states, float(np.sqrt(np.mean(each**2))), of):
        return None
    if of == "angle":
        angle_sd, rate_sd = np.sqrt(variances[:, 0]), np.sqrt(variances[:, 1]) / dt
        return Trajectory(at, states[:, 0], noise, rate_sd, of, angle_sd=angle_sd)
    from scipy.interpolate import CubicSpline  # slow to import

    rate, sd = states[:, 0], np.sqrt(variances[:, 0])
    covered = dt * np.append(1.0, steps)
    angle = np.cumsum(rate * covered) if over_interval else CubicSpline(at, rate).antiderivative()(at)
    return Trajectory(at, angle, noise, sd, of)


def _matters(states: Floats, noise: float, of: Of) -> bool:
    """Whether the noise would be more than `MATTERS` of the square sum of the acceleration.

    Where it is not, windows on the rate itself (`insenv.data.cells.follow`) keep corners sharper.
    """
    rate = states[:, 1] if of == "angle" else states[:, 0]
    moved = float(np.mean(np.diff(rate) ** 2))
    return noise**2 * (6 if of == "angle" else 2) > MATTERS * moved


def reading_noise(values: Floats, index: NDArray[np.int64] | None = None) -> float:
    """Standard deviation of the noise of a reading, from its differences; 0 where that is rounding of the numbers.

    Of readings that repeat at times, as those of a coarse encoder do, it is at least that of their step. ``index`` are
    the numbers of the rows, where some are missing: differences over a gap are motion.
    """
    return _usual(values, _changes(values, index))


def _usual(values: Floats, change: Floats) -> float:
    change = change[np.isfinite(change)]
    if not len(change):
        return 0.0
    noise = max(float(np.median(np.abs(change))) / MEDIAN, _step(values) / np.sqrt(12))
    return noise if noise > ROUNDING * float(np.abs(values).max()) else 0.0


def _changes(values: Floats, index: NDArray[np.int64] | None = None) -> Floats:
    """Differences of readings, of the variance of one reading, shape (n - `ORDER`,); nan over a gap."""
    if len(values) <= ORDER:
        return np.empty(0)
    from scipy.special import comb  # slow to import

    change = np.diff(values, ORDER) / np.sqrt(comb(2 * ORDER, ORDER))
    return change if index is None else np.where(index[ORDER:] - index[:-ORDER] == ORDER, change, np.nan)


def _changes_at(t: Floats, values: Floats) -> Floats:
    """The same of readings at uneven times ``t``, shape (n,): divided differences."""
    if len(values) <= ORDER:
        return np.empty(0)
    windows = np.lib.stride_tricks.sliding_window_view
    points = windows(t / float(np.median(np.diff(t))), ORDER + 1)
    apart = points[:, :, None] - points[:, None, :] + np.eye(ORDER + 1)
    share = 1 / np.prod(apart, axis=2)
    change = np.sum(share * windows(values, ORDER + 1), axis=1) / np.linalg.norm(share, axis=1)
    return np.asarray(change)


def _of_each(change: Floats, noise: float, n: int) -> Floats:
    """Standard deviation of each reading, shape (n,): where `LOCAL` rows around it are far louder than usual, theirs.

    The error of a stamp is one of the angle in proportion to the rate.
    """
    from scipy.ndimage import median_filter  # slow to import

    size = np.where(np.isfinite(change), np.abs(change), MEDIAN * noise)
    local = np.asarray(median_filter(size, min(LOCAL, len(size)), mode="nearest")) / MEDIAN
    ahead = ORDER // 2
    whole = np.concatenate([np.full(ahead, local[0]), local, np.full(n - len(local) - ahead, local[-1])])
    return np.where(whole > LOUDER * noise, whole, noise)


#: Share of rows that must change for the least change to be the step of the numbers, and share that must fit it.
_CHANGING, _FITTING = 0.2, 0.95


def _step(values: Floats) -> float:
    """Step of the numbers that a reading takes; 0 where they take none.

    Second differences are multiples of it too, and most of those of a table that turns evenly are zero.
    """
    change = np.abs(np.diff(values, 2))
    size = float(change.max(initial=0.0))
    moved = change[change > 1e-9 * max(size, 1e-300)]
    if not size or len(moved) < _CHANGING * len(change):
        return 0.0
    step = float(moved.min())
    off = np.abs(moved / step - np.rint(moved / step))
    return step if float(np.mean(off < 0.05)) > _FITTING else 0.0


def _stands(values: Floats, noise: float, of: Of) -> bool:
    """Whether the reading of a table that stands would scatter like this."""
    level = float(np.mean(values))
    if of == "rate" and (abs(level) > 5 * noise / np.sqrt(len(values)) or _swings(values, noise)):
        return False
    half = len(values) // 2
    apart = abs(float(np.mean(values[:half]) - np.mean(values[half:]))) if of == "angle" else 0.0
    return float(np.std(values)) <= STILL * noise and apart <= max(noise, 5 * noise * np.sqrt(4 / len(values)))


def _swings(values: Floats, noise: float) -> bool:
    """Whether means of a rate are far larger than its noise leaves them, as those of a table that goes to and fro.

    Counts of a coarse encoder from row to row are mostly none or one, however the table turns.
    """
    m = 4
    while len(values) >= FEWEST_MEANS * m:
        means = values[: len(values) // m * m].reshape(-1, m).mean(axis=1)
        if float(np.sqrt(np.mean(means**2))) > SWINGS * noise / np.sqrt(m):
            return True
        m *= 2
    return False


def _smoothed(
    values: Floats, known: NDArray[np.bool_], steps: Floats, deviation: Floats, size: int
) -> tuple[Floats, Floats]:
    """States per row and their variances, shape (n, size) each; ``steps`` in periods, shape (n - 1,).

    ``deviation`` is that of each reading, shape (n,).
    """
    from scipy.ndimage import uniform_filter1d  # slow to import
    from scipy.optimize import minimize_scalar

    filtered, smoother = _kernels()
    n, steps = len(values), np.append(steps, 1.0)
    variance, noise = deviation**2, float(np.median(deviation))
    readings = values[known]
    spread = [noise**2]
    for order in range(1, size):
        spread.append(9 * float(np.max(np.diff(readings, order) ** 2)) + noise**2)
    first = np.zeros(size)
    first[0] = readings[0]
    start = np.diag([1e4 * spread[0], *spread[1:]])

    def loss(log_ratio: float) -> float:
        q = np.full(n, noise**2 * np.exp(log_ratio))
        *_, total, log_size = filtered(values, known, steps, first, start, variance, q)
        return float(total + log_size)

    tried = np.linspace(np.log(1e-14), np.log(1e4), 13)
    middle = min(tried.tolist(), key=loss)
    best = minimize_scalar(loss, bounds=(middle - 3.5, middle + 3.5), method="bounded", options={"xatol": 0.05})
    q = np.full(n, noise**2 * np.exp(float(best.x)))
    least = LEAST * q[0]
    for _ in range(PASSES):
        passed = filtered(values, known, steps, first, start, variance, q)[:4]
        driven = smoother(known, steps, q, *passed)[2]
        q = np.maximum(uniform_filter1d(driven, NEAR, mode="nearest"), least)
    passed = filtered(values, known, steps, first, start, variance, q)[:4]
    states, variances, _ = smoother(known, steps, q, *passed)
    return states, np.maximum(variances, 0.0)


def _filtered(values, known, steps, first, start, variance, q):  # type: ignore[no-untyped-def]  # noqa: C901, PLR0912, PLR0915 -- compiled
    """Kalman filter: predicted states and covariances, innovations and their variances; and the likelihood's parts."""
    n, size = len(values), len(first)
    states, covariances = np.empty((n, size)), np.empty((n, size, size))
    innovations, spreads = np.zeros(n), np.ones(n)
    x, p = first.copy(), start.copy()
    total, log_size = 0.0, 0.0
    gain, moved, carried = np.zeros(size), np.zeros((size, size)), np.zeros((size, size))
    for k in range(n):
        for i in range(size):
            states[k, i] = x[i]
            for j in range(size):
                covariances[k, i, j] = moved[i, j] = p[i, j]
        if known[k]:
            f = p[0, 0] + variance[k]
            v = values[k] - x[0]
            innovations[k], spreads[k] = v, f
            if k >= size:
                total += v * v / f
                log_size += np.log(f)
            for i in range(size):
                gain[i] = p[i, 0] / f
            for i in range(size):
                x[i] += gain[i] * v
            for i in range(size):
                for j in range(size):
                    moved[i, j] = p[i, j] - gain[i] * gain[j] * f
        # x <- F x: each state goes on by those above it, 1, h, h^2/2.
        h = steps[k]
        if size == 3:
            x[0] += h * x[1] + 0.5 * h * h * x[2]
            x[1] += h * x[2]
        else:
            x[0] += h * x[1]
        for j in range(size):
            if size == 3:
                carried[0, j] = moved[0, j] + h * moved[1, j] + 0.5 * h * h * moved[2, j]
                carried[1, j] = moved[1, j] + h * moved[2, j]
                carried[2, j] = moved[2, j]
            else:
                carried[0, j] = moved[0, j] + h * moved[1, j]
                carried[1, j] = moved[1, j]
        for i in range(size):
            if size == 3:
                p[i, 0] = carried[i, 0] + h * carried[i, 1] + 0.5 * h * h * carried[i, 2]
                p[i, 1] = carried[i, 1] + h * carried[i, 2]
                p[i, 2] = carried[i, 2]
            else:
                p[i, 0] = carried[i, 0] + h * carried[i, 1]
                p[i, 1] = carried[i, 1]
        p[size - 1, size - 1] += q[k] * h
        for i in range(size):
            for j in range(i):
                p[i, j] = p[j, i] = 0.5 * (p[i, j] + p[j, i])
    return states, covariances, innovations, spreads, total, log_size


def _smoother(known, steps, q, states, covariances, innovations, spreads):  # type: ignore[no-untyped-def]  # noqa: C901, PLR0912 -- compiled
    """De Jong's smoother: states, their variances, and the mean square of what drove each step."""
    n, size = states.shape
    smooth, var = np.empty((n, size)), np.empty((n, size))
    driven = np.empty(n)
    r, big = np.zeros(size), np.zeros((size, size))
    step, back = np.zeros((size, size)), np.zeros((size, size))
    gain, new, half = np.zeros(size), np.zeros(size), np.zeros((size, size))
    last = size - 1
    for k in range(n - 1, -1, -1):
        h = steps[k]
        for i in range(size):
            step[i, i] = 1.0
            if i + 1 < size:
                step[i, i + 1] = h
            if i + 2 < size:
                step[i, i + 2] = 0.5 * h * h
        drive = q[k] * h
        eta = drive * r[last]
        driven[k] = (eta * eta + max(drive - drive * drive * big[last, last], 0.0)) / h
        f, v, seen = spreads[k], innovations[k], 1.0 if known[k] else 0.0
        for i in range(size):
            gain[i] = 0.0
            for j in range(size):
                gain[i] += seen * step[i, j] * covariances[k, j, 0] / f
        for i in range(size):
            for j in range(size):
                back[i, j] = step[i, j]
            back[i, 0] -= gain[i]
        for i in range(size):
            new[i] = 0.0
            for j in range(size):
                new[i] += back[j, i] * r[j]
                half[i, j] = 0.0
                for m in range(size):
                    half[i, j] += big[i, m] * back[m, j]
        for i in range(size):
            r[i] = new[i]
            for j in range(size):
                big[i, j] = 0.0
                for m in range(size):
                    big[i, j] += back[m, i] * half[m, j]
        r[0] += seen * v / f
        big[0, 0] += seen / f
        for i in range(size):
            smooth[k, i], var[k, i] = states[k, i], covariances[k, i, i]
            for j in range(size):
                smooth[k, i] += covariances[k, i, j] * r[j]
                for m in range(size):
                    var[k, i] -= covariances[k, i, j] * big[j, m] * covariances[k, m, i]
    return smooth, var, driven


@lru_cache
def _kernels() -> tuple[Any, Any]:
    """Filter and smoother, compiled."""
    return jit(_filtered), jit(_smoother)
