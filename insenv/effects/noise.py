"""Random errors: the noise terms of IEEE Std 952, each driven by one unit normal per interval.

With two-sided densities S(f) of the rate, and means over intervals of length dt:

====  ===================  =====================  ====================  ======================================
      term                 S(f)                   Allan deviation       variance of a DCT-II coefficient
====  ===================  =====================  ====================  ======================================
N     angle random walk    N^2                    N / sqrt(tau)         N^2 / dt
B     bias instability     B^2 / (2 pi |f|)       B sqrt(2 ln 2 / pi)   B^2 lam h(v), nearly B^2 / sqrt(lam)
K     rate random walk     K^2 / (2 pi f)^2       K sqrt(tau / 3)       K^2 dt (1 / lam - 1 / 6)
Q     quantization         Q^2 dt (2 pi f)^2      Q sqrt(3) / tau       Q^2 lam / dt^2
====  ===================  =====================  ====================  ======================================

h(v) = (zeta(3, v) + zeta(3, 1 - v)) / (8 pi^3) is the sum over all aliases of the averaged 1/f density;
lam = 4 sin^2(pi k / 2 n) and v = k / 2 n, the frequency in cycles per interval.

White noise and random walk are diagonal in the DCT-II basis, exactly. The others are so but for the ends of a
run: the lowest coefficients of 1/f noise have less than the formula (k = 1: 77 %, 2: 90 %, 3: 93 %, 8: 97 %);
quantization has (4 / n) cos^2(pi k / 2 n) / dt^2 more in each, which rules below k of about 2 sqrt(n) / pi.

B and K may ``hold``: they change every so many intervals only. A gyro that is read 2000 times a second has white noise
far above what they have within a tenth of a second.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar, final

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_lyapunov
from scipy.special import zeta

from insenv.core.errors import InputError
from insenv.core.recording import Floats
from insenv.core.series.cascade import cascade
from insenv.effects.base import OUTPUT, NoiseEffect, Param
from insenv.effects.held import held, held_integral

#: Zero of the flicker filter, at z = -b, that stands for the averaging over an interval, within 0.4 %.
_MEAN_ZERO = 0.1525
#: Poles of the flicker filter per decade, and how far beyond the sampling rate they go on: ripple below 1 %.
_POLES_PER_DECADE = 1.5
_FASTEST_POLE = 100.0
#: Decades of 1/f noise below the sampling rate. With more, the stationary covariance loses its digits.
LEAST_DECADES, MOST_DECADES = 1.0, 7.0


@final
@dataclass(frozen=True)
class AngleRandomWalk(NoiseEffect):
    """White noise of the rate."""

    id = "angle_random_walk"
    title = "angle random walk"
    accelerometer_title = "velocity random walk"
    meaning = "white noise of the rate"
    linear = (Param("N", OUTPUT + " sqrt(s)", sd=1e-3, bound=1.0, low=0.0),)
    source = "IEEE Std 952-1997, annex C.1.1"

    def drive(self, theta: Floats, dt: float, state: Any, z: Floats) -> tuple[Floats, Any]:
        """Independent means, shape (..., n)."""
        return z[..., 0, :] * (theta[..., 0, None] / np.sqrt(dt)), state

    def psd(self, theta: Floats, f: Floats) -> Floats:
        """N^2, the same at every frequency."""
        return theta[..., 0, None] ** 2 * np.ones_like(f)

    def allan(self, theta: Floats, tau: Floats) -> Floats:
        """N / sqrt(tau)."""
        deviation: Floats = theta[..., 0, None] / np.sqrt(tau)
        return deviation

    def spectrum(self, lam: Floats, dt: float) -> Floats:
        """``1 / dt``."""
        return np.full_like(lam, 1 / dt)

    def integral(self, edges: NDArray[np.int64], dt: float) -> Floats:
        """``min(s, t)``."""
        return np.minimum(edges[:, None], edges) * dt


@final
@dataclass(frozen=True)
class RateRandomWalk(NoiseEffect):
    """A rate that walks, from zero at the start of the run (where it stands there is the bias).

    The mean of a Wiener process over an interval is the walk up to its beginning plus a part of its own step.
    One normal per interval has the right covariance of successive means, increments of variance 2/3 and
    covariance 1/6, if that part is a with a (1 - a) = 1/6.

    Attributes
    ----------
    hold : int
        Intervals for which a mean stands.
    """

    hold: int = 1

    id = "rate_random_walk"
    title = "rate random walk"
    accelerometer_title = "acceleration random walk"
    meaning = "the rate's error wanders like a random walk"
    linear = (Param("K", OUTPUT + "/sqrt(s)", sd=1e-4, bound=0.1, low=0.0),)
    source = "IEEE Std 952-1997, annex C.1.3"

    #: 1 - a: what of an interval's own step its mean does not yet have.
    _PENDING: ClassVar[float] = 0.5 - 0.5 / 3**0.5

    def drive(self, theta: Floats, dt: float, state: Any, z: Floats) -> tuple[Floats, Any]:
        """Means of the walk, shape (..., n), and where it stands at the last edge, shape (...)."""
        if self.hold > 1:
            return held(replace(self, hold=1), self.hold, theta, dt, state, z)
        steps = z[..., 0, :] * (theta[..., 0, None] * np.sqrt(dt))
        own = self._PENDING * steps
        # Added to the first step, the state enters the sum in the order of an unbroken run.
        steps[..., 0] += 0.0 if state is None else state
        walk = np.cumsum(steps, axis=-1, out=steps)
        last = walk[..., -1].copy()
        return np.subtract(walk, own, out=own), last

    def psd(self, theta: Floats, f: Floats) -> Floats:
        """K^2 / (2 pi f)^2."""
        return (theta[..., 0, None] / (2 * np.pi * f)) ** 2

    def allan(self, theta: Floats, tau: Floats) -> Floats:
        """K sqrt(tau / 3)."""
        deviation: Floats = theta[..., 0, None] * np.sqrt(tau / 3)
        return deviation

    def spectrum(self, lam: Floats, dt: float) -> Floats:
        """``dt (1 / lam - 1 / 6)``: the averaging over an interval takes the sixth."""
        return dt * (1 / lam - 1 / 6)

    def integral(self, edges: NDArray[np.int64], dt: float) -> Floats:
        """``s^2 (3 t - s) / 6`` for s <= t, but for what the first mean lacks of an interval's own step.

        The first of the driven means is ``a`` times its step and not the mean of a walk from zero, whose variance is
        1/3: the walk begins with a part of a step in the interval before.
        """
        if self.hold > 1:
            return held_integral(replace(self, hold=1), self.hold, edges, dt)
        s, t = (f(edges[:, None], edges).astype(float) for f in (np.minimum, np.maximum))
        # Sum over the steps i of the products of what each has brought to the integrals up to s and to t:
        # (s - i - p) (t - i - p) for i < s with p = `_PENDING`.
        p = self._PENDING
        squares, ones, sums = s * (s - 1) * (2 * s - 1) / 6, s, s * (s - 1) / 2
        product: Floats = squares - sums * (s + t - 2 * p) + ones * (s - p) * (t - p)
        return product * dt**3


@final
@dataclass(frozen=True)
class BiasInstability(NoiseEffect):
    """Flicker: 1/f noise from the sampling rate down over ``decades``, flat below.

    A cascade of first-order sections with even spaced logarithms of their corners, one normal per interval.
    Its own scale is the interval, so that one filter serves every sampling rate.

    Attributes
    ----------
    decades : float
    hold : int
        Intervals for which a mean stands, and which are one of the filter's.
    """

    decades: float = MOST_DECADES
    hold: int = 1

    id = "bias_instability"
    title = "bias instability"
    meaning = "flicker noise of the rate"
    linear = (Param("B", OUTPUT, sd=1e-3, bound=1.0, low=0.0),)
    source = "IEEE Std 952-1997, annex C.1.2; Corsini and Saletti, IEEE Trans. Instrum. Meas. 37 (1988) 615"

    def __post_init__(self) -> None:
        if not LEAST_DECADES <= self.decades <= MOST_DECADES:
            raise InputError(
                f"effect {self.id!r}: {self.decades:g} decades given, wanted {LEAST_DECADES:g} to {MOST_DECADES:g}"
            )

    @property
    def draws_at_start(self) -> int:
        """One normal for each state of the filter."""
        return 2 * len(_flicker(self.decades)[0])

    def start(self, z: Floats) -> Floats:
        """State of a process that has run for ever, shape (..., sections, 2)."""
        spread = _flicker(self.decades)[1]
        # Not a matrix product: that may round by the shape of the batch.
        return np.sum(z[..., None, :] * spread, axis=-1).reshape(*z.shape[:-1], -1, 2)

    def processes(self, dt: float) -> tuple[Floats, Floats]:
        """Variances for B = 1 and times of correlation [s] of the processes of first order that it is the sum of."""
        terms, gap, _, _ = _autocovariance(self.decades)
        return terms, dt / gap

    def drive(self, theta: Floats, dt: float, state: Any, z: Floats) -> tuple[Floats, Any]:
        """Flicker noise, shape (..., n), and the filter's state for unit coefficient, (..., sections, 2)."""
        if self.hold > 1:
            return held(replace(self, hold=1), self.hold, theta, dt, state, z)
        sections = _flicker(self.decades)[0]
        x = z[..., 0, :]
        y, after = cascade(sections, x, state)
        return y * theta[..., 0, None], after

    def psd(self, theta: Floats, f: Floats) -> Floats:
        """B^2 / (2 pi |f|), between the cut-offs."""
        return theta[..., 0, None] ** 2 / (2 * np.pi * np.abs(f))

    def allan(self, theta: Floats, tau: Floats) -> Floats:
        """B sqrt(2 ln 2 / pi), at every averaging time between the cut-offs."""
        return theta[..., 0, None] * np.sqrt(2 * np.log(2) / np.pi) * np.ones_like(tau)

    def spectrum(self, lam: Floats, dt: float) -> Floats:
        """Means of 1/f noise with all their aliases: nearly 1 / sqrt(lam), 0.27 at lam = 4."""
        v = np.arcsin(0.5 * np.sqrt(lam)) / np.pi
        variance: Floats = lam * (zeta(3, v) + zeta(3, 1 - v)) / (8 * np.pi**3)
        return variance

    def integral(self, edges: NDArray[np.int64], dt: float) -> Floats:
        """F(s) + F(t) - F(|s - t|) with twice F(n) the variance of a sum of n: a sum of Gauss-Markov processes.

        The filter's output has the autocovariance sum_j c_j p_j^|k|, but for k = 0 and 1, with one term for each pole.
        """
        if self.hold > 1:
            return held_integral(replace(self, hold=1), self.hold, edges, dt)
        at_edges = _half_variance(edges, self.decades)
        distance = np.abs(edges[:, None] - edges)
        different, place = np.unique(distance, return_inverse=True)
        apart = _half_variance(different, self.decades)[place.reshape(distance.shape)]
        return (at_edges[:, None] + at_edges - apart) * dt**2


@final
@dataclass(frozen=True)
class Quantization(NoiseEffect):
    """Readings rounded in angle: an angle error Q at every edge, its difference in the rate.

    Attributes
    ----------
    period : float
        Time between two readings [s], on which the density depends; `drive` and `spectrum` are told it.
    """

    period: float = 1.0

    id = "quantization"
    title = "quantization"
    meaning = "noise from the finite step of a read-out"
    linear = (Param("Q", OUTPUT + " s", sd=1e-5, bound=0.01, low=0.0),)
    source = "IEEE Std 952-1997, annex C.1.5; Q is the standard deviation of the angle error"

    @property
    def draws_at_start(self) -> int:
        """The error at the first edge."""
        return 1

    def start(self, z: Floats) -> Floats:
        """Error at the first edge in units of Q, shape (...)."""
        return z[..., 0]

    def drive(self, theta: Floats, dt: float, state: Any, z: Floats) -> tuple[Floats, Any]:
        """Difference of the errors at the edges over dt, shape (..., n), and the last one in units of Q."""
        at_end = z[..., 0, :]
        change = at_end.copy()
        change[..., 1:] -= at_end[..., :-1]
        change[..., 0] -= 0.0 if state is None else state
        return change * (theta[..., 0, None] / dt), at_end[..., -1].copy()

    def psd(self, theta: Floats, f: Floats) -> Floats:
        """Q^2 period (2 pi f)^2, far below the rate of the readings."""
        return self.period * (2 * np.pi * f * theta[..., 0, None]) ** 2

    def allan(self, theta: Floats, tau: Floats) -> Floats:
        """Q sqrt(3) / tau."""
        deviation: Floats = np.sqrt(3) * theta[..., 0, None] / tau
        return deviation

    def spectrum(self, lam: Floats, dt: float) -> Floats:
        """``lam / dt^2``."""
        return lam / dt**2

    def integral(self, edges: NDArray[np.int64], dt: float) -> Floats:
        """Of the error at each edge less that at the start: 1, twice that where both edges are one, 0 at the start."""
        after = (edges > 0).astype(float)
        return after[:, None] * after + (edges[:, None] == edges) * after


def readings_density(effect: NoiseEffect, theta: Floats, f: Floats, dt: float) -> Floats:
    """Two-sided density at ``f`` [Hz] of readings that are means over ``dt``, with averaging and aliases.

    This is what a periodogram of readings estimates; `NoiseEffect.psd` is that of the rate before it is
    averaged.
    """
    lam = 4 * np.sin(np.pi * f * dt) ** 2
    return theta[..., 0, None] ** 2 * dt * effect.spectrum(lam, dt)


@lru_cache
def _flicker(decades: float) -> tuple[Floats, Floats]:
    """Sections of second order, shape (sections, 6), and a root of the covariance of their states.

    In x = 1 - 1/z the wanted response is x^(-1/2), as near as a ladder of (x + q) / (x + p) comes to it, with
    q = p r^(1/2) and each p a factor r below the one before. One more zero is the averaging over an interval.
    """
    p, q = _corners(decades)
    poles, zeros = 1 / (1 + p), 1 / (1 + q)
    sections = _pairs(np.append(zeros, -_MEAN_ZERO), np.append(poles, 0.0))
    v = np.geomspace(10.0**-decades, 0.5, 400)
    wanted = BiasInstability().spectrum(4 * np.sin(np.pi * v) ** 2, 1.0)
    found = np.prod(np.abs([_response(section, v) for section in sections]), axis=0) ** 2
    sections[0, :3] *= np.exp(0.5 * np.mean(np.log(wanted / found)))
    return sections, _stationary_root(sections)


def _corners(decades: float) -> tuple[Floats, Floats]:
    """Corners p and q of the ladder, shape (count,)."""
    ratio = 10 ** (1 / _POLES_PER_DECADE)
    count = int(np.ceil((np.log10(_FASTEST_POLE / (2 * np.pi)) + decades) * _POLES_PER_DECADE)) + 2
    count += 1 - count % 2
    p: Floats = _FASTEST_POLE * ratio ** -np.arange(count, dtype=np.float64)
    return p, p * np.sqrt(ratio)


@lru_cache
def _autocovariance(decades: float) -> tuple[Floats, Floats, float, float]:
    """Terms c_j and 1 - p_j of the filter's autocovariance, and what it has beyond their sum at k = 0 and at k = 1.

    By residues of H(z) H(1/z) z^(k - 1), with differences of near numbers taken in p and q.
    """
    p, q = _corners(decades)
    gain = _flicker(decades)[0][0, 0]
    at_pole = 1 / (1 + p)
    # 1 - zero / pole, 1 - pole / pole' ; 1 - zero pole, 1 - pole pole'.
    to_zero = (q - p[:, None]) / (1 + q)
    to_pole = (p - p[:, None]) / (1 + p)
    np.fill_diagonal(to_pole, 1.0)
    residue = gain * np.prod(to_zero, axis=1) / np.prod(to_pole, axis=1) * (1 + _MEAN_ZERO / at_pole)
    zero_there = (q + p[:, None] + q * p[:, None]) / ((1 + q) * (1 + p[:, None]))
    pole_there = (p + p[:, None] + p * p[:, None]) / ((1 + p) * (1 + p[:, None]))
    mirrored = gain * np.prod(zero_there, axis=1) / np.prod(pole_there, axis=1) * (1 + _MEAN_ZERO * at_pole)
    at_one = float(gain**2 * _MEAN_ZERO * np.prod((1 + p) / (1 + q)))
    slope = 1 / _MEAN_ZERO + _MEAN_ZERO + np.sum(p - q + at_pole - 1 / (1 + q))
    return residue * mirrored, p * at_pole, at_one * float(slope), at_one


def _half_variance(n: NDArray[np.int64], decades: float) -> Floats:
    """Half of the variance of a sum of n successive values of the filter, of the shape of n."""
    terms, gap, at_zero, at_one = _autocovariance(decades)
    count = n[..., None].astype(float)
    kept = -np.expm1(count * np.log1p(-gap))
    sums = (1 - gap) * (count * gap - kept) / gap**2 + 0.5 * count
    half: Floats = np.sum(terms * sums, axis=-1) + 0.5 * n * at_zero + np.maximum(n - 1, 0) * at_one
    return half


def _pairs(zeros: Floats, poles: Floats) -> Floats:
    """Second-order sections of neighbouring real zeros and poles, shape (len / 2, 6)."""
    return np.array([[*np.poly(zeros[i : i + 2]), *np.poly(poles[i : i + 2])] for i in range(0, len(poles), 2)])


def _response(section: Floats, v: Floats) -> Floats:
    """Complex response of one section at ``v`` cycles per sample."""
    delay = np.exp(-2j * np.pi * np.outer(v, np.arange(3)))
    response: Floats = (delay @ section[:3]) / (delay @ section[3:])
    return response


def _stationary_root(sections: Floats) -> Floats:
    """Root of the covariance that unit white noise keeps in the states, shape (2 sections, 2 sections)."""
    size = 2 * len(sections)
    inputs = np.zeros((size + 1, 1))
    inputs[-1] = 1.0
    states = np.vstack([np.eye(size), np.zeros(size)]).reshape(size + 1, -1, 2)
    # One step from each unit state without input, and from rest with unit input: the columns of [A B].
    _, after = cascade(sections, inputs, states)
    step = after.reshape(size + 1, size).T
    covariance = solve_discrete_lyapunov(step[:, :-1], np.outer(step[:, -1], step[:, -1]))
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root: Floats = vectors * np.sqrt(np.maximum(values, 0.0))
    return root
