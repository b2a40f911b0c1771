"""A coefficient of several units: what they have in common, how they scatter, and what is to be expected of the next.

Unit i has c_i with the standard deviation s_i; the units are drawn from a population,

    c_i ~ N(m, t^2 + s_i^2).

t^2 is where sum (c_i - m)^2 / (t^2 + s_i^2) is n - 1, what it is on average (Paule and Mandel); its interval is where
that sum has the quantiles of chi-squared (Viechtbauer). The deviation of m is the one that the scatter itself shows,
with Student's t (Hartung and Knapp), and no less than what s_i alone would leave. What t is is hardly told by a few
units: the next one, and each with the others for its prior, are means over t^2 as those quantiles of chi-squared give
it, each as probable as the other (a confidence distribution: Nagashima, Noma and Furukawa). With t at its estimate 90 %
of next units lay in an interval of 95 % where t is as large as s_i. A unit is judged by what the others foretell of
it, with Student's t on n - 2 degrees of freedom (Higgins).

Sources: R. C. Paule and J. Mandel, J. Res. NBS 87 (1982) 377; J. Hartung and G. Knapp, Stat. Med. 20 (2001) 3875;
W. Viechtbauer, Stat. Med. 26 (2007) 37; K. Nagashima, H. Noma and T. A. Furukawa, Stat. Methods Med. Res. 28 (2019)
1689; J. P. T. Higgins, S. G. Thompson and D. J. Spiegelhalter, J. R. Stat. Soc. A 172 (2009) 137; Y. Benjamini and
Y. Hochberg, J. R. Stat. Soc. B 57 (1995) 289.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import chdtrc, chdtri, ndtr, stdtr

from insenv.core.recording import Floats

#: Fewest units of which a scatter is told, and of which one is judged by the others.
FEWEST, TO_JUDGE = 3, 4
#: Variances between units over which is averaged, and the share that a standard deviation to either side holds.
STEPS, _MIDDLE = 50, 0.6827
#: Steps to a variance at most, the share of it that ends them, and the least slope that counts.
MOST_STEPS, _CLOSE, _LEAST = 200, 1e-13, 1e-300


@dataclass(frozen=True)
class Pool:
    """A coefficient of several units.

    Attributes
    ----------
    mean, sd : float
        Of the population, with the deviation of its mean.
    spread : float
        Standard deviation between units, t.
    spread_interval : tuple of float
        Of 95 %.
    differ : float
        Probability of so different units if they were all one.
    common : float
        Probability of so large a mean if units scattered about nothing.
    ahead : tuple of float
        Where the next unit is to be expected: 95 %.
    ahead_sd : float
        Half of the width of the middle 68 % of that.
    shrunk : ndarray, shape (n,)
        What each unit has, with the others for its prior.
    shrunk_sd : ndarray, shape (n,)
    outlying : ndarray, shape (n,)
        Probability of so far a unit by what the others foretell of it, two-sided; 1 where they are too few.
    """

    mean: float
    sd: float
    spread: float
    spread_interval: tuple[float, float]
    differ: float
    common: float
    ahead: tuple[float, float]
    ahead_sd: float
    shrunk: Floats
    shrunk_sd: Floats
    outlying: Floats

    def left_out(self, sd: Floats) -> float:
        """Share of the next unit's test that could be left out, were it to know the coefficient as well as now.

        Information grows with time; the prior is worth 1 / sd^2 of it.
        """
        return float(min(1.0, np.median(sd) ** 2 / max(self.ahead_sd**2, 1e-300)))


def pool(value: Floats, sd: Floats) -> Pool:
    """Values (n,) of n units with their standard deviations (n,), n of `FEWEST` and more."""
    n = len(value)
    scale = float(np.median(sd))
    c, s = value / scale, sd / scale
    t2 = _between(c, s, np.array(n - 1.0))
    mean, error = (float(x) for x in _mean(c, s, t2))
    low, high = np.sqrt(_between(c, s, chdtri(n - 1, np.array([0.025, 0.975])))).tolist()
    told = _Told.of(c, s)
    middle = told.ahead(0.5 - 0.5 * _MIDDLE), told.ahead(0.5 + 0.5 * _MIDDLE)
    shrunk, shrunk_sd = told.shrunk(c, s)
    return Pool(
        mean * scale,
        error * scale,
        math.sqrt(t2) * scale,
        (low * scale, high * scale),
        float(chdtrc(n - 1, _scatter(c, s, np.array(0.0))[0])),
        2 * float(stdtr(n - 1, -abs(mean) / error)),
        (told.ahead(0.025) * scale, told.ahead(0.975) * scale),
        0.5 * (middle[1] - middle[0]) * scale,
        shrunk * scale,
        shrunk_sd * scale,
        _outlying(c, s),
    )


@dataclass(frozen=True)
class _Told:
    """What units tell of their population: variances between them, all as probable, with mean and deviation."""

    between: Floats
    mean: Floats
    error: Floats

    @classmethod
    def of(cls, c: Floats, s: Floats) -> _Told:
        levels = (np.arange(STEPS) + 0.5) / STEPS
        between = _between(c, s, chdtri(len(c) - 1, levels))
        mean, error = _mean(c, s, between)
        return cls(between, mean, error)

    def ahead(self, level: float) -> float:
        """Below what the next unit lies with this probability."""
        sd = np.sqrt(self.between + self.error**2)
        low, high = float(np.min(self.mean - 9 * sd)), float(np.max(self.mean + 9 * sd))
        return float(brentq(lambda x: np.mean(ndtr((x - self.mean) / sd)) - level, low, high))

    def shrunk(self, c: Floats, s: Floats) -> tuple[Floats, Floats]:
        """Each unit with the others for its prior: mean and standard deviation, shapes (n,)."""
        kept = self.between / (self.between + s[:, None] ** 2)
        each = self.mean + kept * (c[:, None] - self.mean)
        variance = kept * s[:, None] ** 2 + ((1 - kept) * self.error) ** 2
        return each.mean(axis=1), np.sqrt(variance.mean(axis=1) + each.var(axis=1))


def _scatter(c: Floats, s: Floats, t2: Floats) -> tuple[Floats, Floats]:
    """Scatter of units (..., n) about their mean for variances between them (...), and its slope in the variance."""
    w = 1 / (t2[..., None] + s**2)
    off = w * (c - (np.sum(w * c, axis=-1) / np.sum(w, axis=-1))[..., None])
    return np.sum(off**2 / w, axis=-1), -np.sum(off**2, axis=-1)


def _between(c: Floats, s: Floats, wanted: Floats) -> Floats:
    """Variances between units (..., n) with which their scatter is as ``wanted``, (...); zero where it is less.

    Newton's steps from zero: the scatter falls and is convex in the variance (the least over the mean of squares over
    what is linear in it), so that no step goes too far.
    """
    t2 = np.zeros(np.broadcast_shapes(np.shape(wanted), np.shape(c)[:-1]))
    for _ in range(MOST_STEPS):
        found, slope = _scatter(c, s, t2)
        step = np.maximum((wanted - found) / np.minimum(slope, -_LEAST), 0.0)
        t2 = t2 + step
        if np.all(step <= _CLOSE * t2):
            break
    return t2


def _mean(c: Floats, s: Floats, t2: Floats) -> tuple[Floats, Floats]:
    """Mean of the population and its deviation, shapes (...), for variances between units."""
    w = 1 / (t2[..., None] + s**2)
    whole = np.sum(w, axis=-1)
    mean = np.sum(w * c, axis=-1) / whole
    shown = np.sum(w * (c - mean[..., None]) ** 2, axis=-1) / (c.shape[-1] - 1)
    return mean, np.sqrt(np.maximum(shown, 1.0) / whole)


def _outlying(c: Floats, s: Floats) -> Floats:
    n = len(c)
    if n < TO_JUDGE:
        return np.ones(n)
    others = np.array([np.delete(np.arange(n), i) for i in range(n)])
    t2 = _between(c[others], s[others], np.full(n, n - 2.0))
    mean, error = _mean(c[others], s[others], t2)
    off = np.abs(c - mean) / np.sqrt(t2 + error**2 + s**2)
    return np.asarray(2 * stdtr(n - 2, -off))


def discoveries(p: Floats, rate: float) -> NDArray[np.bool_]:
    """Which of the hypotheses with p-values (m,) are discoveries at a false discovery rate (Benjamini, Hochberg)."""
    if not len(p):
        return np.zeros(0, bool)
    order = np.argsort(p, kind="stable")
    below = np.flatnonzero(p[order] <= rate * np.arange(1, len(p) + 1) / len(p))
    out = np.zeros(len(p), bool)
    if len(below):
        out[order[: below[-1] + 1]] = True
    return out
