r"""Noise that goes with the motion: how uncertain a coefficient is by its scores in swings, not in rows.

What errors of a reference leave is loud where the table is fast, and a curve of the motion meets it there. With phi the
curve, or the weights of a coefficient, and e what is left, both whitened and in time, the variance is larger by

    f = sum_k (sum_{t in k} phi e)^2 / sum phi^2 * K / (K - 1),      K = (sum w)^2 / sum w^2,   w_k = sum_{t in k} phi^2

over pieces k: swings, four swings, tenths of the time, runs. f counts where it is more than chance, and where K tells
it: both by weights that grow smoothly, for where pieces are alike K is a whole number, and its last digit is chance.

Source: A. C. Cameron and D. L. Miller, A practitioner's guide to cluster-robust inference, J. Human Resources 50 (2015)
317.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.fft import idct
from scipy.special import chdtrc, chdtri

from insenv.core.recording import Floats
from insenv.identify.fit.problem import Problem

#: Pieces up to which they tell no variance, and from which on they do; parts of the time of the longest pieces.
FEWEST, ENOUGH, PARTS = 3.0, 4.0, 10
#: Chance of a factor from which on it counts in part, and below which it counts in full.
CHANCE, NO_CHANCE = 0.1, 0.025
#: Swings of which one is one of many, and the share of a usual swing's weight that tells nothing.
MANY, UNTOLD = 8, 1e-3
#: Length of the windows in which a unit at rest is shaken or still [s], and the fewest bins of one.
SHAKEN, BINS = 2.0, 4
#: Departure from the middle of the input, in its root mean square, by which a side of it is told.
LEAST = 0.2
#: Departure of the input from its middle, in the usual step from bin to bin of what is left of it, up to which it is no
#: motion: the last digits of an angle.
UNSEEN = 1e-3


def by_swings(problem: Problem, curve: Floats, left: Floats) -> tuple[float, float]:
    """Factor f on the variance of a curve's coefficient, and the freedom with which swings tell it; 1, inf where none.

    Parameters
    ----------
    problem : Problem
    curve, left : ndarray, shape (modes,)
        Whitened; what of the curve is in ``left`` all the time is taken out of it.
    """
    return _scattering(problem, curve, left, _pieces(problem))


def by_seconds(problem: Problem, curve: Floats, left: Floats) -> tuple[float, float]:
    """The same of a unit at rest that is shaken now and then: by bins and by windows of `SHAKEN` seconds."""
    return _scattering(problem, curve, left, _windows(problem))


def windows_of(problem: Problem, curve: Floats) -> float:
    """In how many windows of `SHAKEN` seconds a curve lies, by the squares of its weights."""
    weight = np.bincount(_windows(problem)[1], in_time(problem, curve) ** 2)
    return float(weight.sum() ** 2 / max(float(np.sum(weight**2)), 1e-300))


def _scattering(
    problem: Problem, curve: Floats, left: Floats, labels: tuple[NDArray[np.int64], ...]
) -> tuple[float, float]:
    phi, e = in_time(problem, curve), in_time(problem, left)
    e = e - phi * float(phi @ e) / max(float(phi @ phi), 1e-300)
    worst, freedom = 1.0, np.inf
    for label in labels:
        weight = np.bincount(label, phi * phi)
        count = float(weight.sum() ** 2 / max(np.sum(weight**2), 1e-300))
        if count <= FEWEST:
            continue
        factor = float(np.sum(np.bincount(label, phi * e) ** 2) / weight.sum()) * count / (count - 1)
        share = _enough(count) * _beyond_chance(float(chdtrc(count - 1, factor * (count - 1))))
        if share * (factor - 1) > worst - 1:
            worst, freedom = 1 + share * (factor - 1), (count - 1) / share
    return worst, freedom


def _enough(count: float) -> float:
    """Weight, from 0 to 1, of what so many pieces tell of a variance."""
    return _smooth((count - FEWEST) / (ENOUGH - FEWEST))


def _beyond_chance(p: float) -> float:
    return _smooth(float(np.log(CHANCE / max(p, 1e-300)) / np.log(CHANCE / NO_CHANCE)))


def _smooth(x: float) -> float:
    """From 0 to 1 as x does, level at both ends."""
    x = min(max(x, 0.0), 1.0)
    return x * x * (3 - 2 * x)


def in_few_swings(problem: Problem, curve: Floats) -> float:
    """Weight, from 0 to 1, with which a curve lies in so few of many swings that nothing tells how it repeats."""
    phi, label = in_time(problem, curve), _pieces(problem)[0]
    weight = np.bincount(label, phi * phi)
    if len(weight) < MANY:
        return 0.0
    return 1.0 - _enough(float(weight.sum() ** 2) / max(float(np.sum(weight**2)), 1e-300))


def in_the_loudest(problem: Problem, curve: Floats, left: Floats) -> float:
    """Square of the coefficient of a curve in the loudest swing, in that of noise there; 1 if it is that of noise.

    What is in one swing alone must stand out of what is left in the others.
    """
    phi, e = in_time(problem, curve), in_time(problem, left)
    worst = 1.0
    for label in _pieces(problem)[:2]:
        weight = np.bincount(label, phi * phi)
        some = weight > UNTOLD * weight.mean()
        square = np.bincount(label, phi * e)[some] ** 2 / weight[some]
        worst = max(worst, float(square.max(initial=0.0)) / float(chdtri(1, 1 - 0.5 ** (1 / max(len(square), 1)))))
    return worst


def in_time(problem: Problem, modes: Floats) -> Floats:
    """Whitened modes of the fitted blocks transformed back: white in time."""
    ends = np.cumsum([b.n for b in problem.fitted])[:-1]
    return np.concatenate([idct(part, type=2, norm="ortho") for part in np.split(modes, ends)])


def _pieces(problem: Problem) -> tuple[NDArray[np.int64], ...]:
    """Which piece each fitted bin lies in: swings, four swings, tenths of the time, runs."""
    made: tuple[NDArray[np.int64], ...] = problem.remember("pieces", lambda: tuple(_labels(problem)))
    return made


def _windows(problem: Problem) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Which bin each fitted bin is, and which window of `SHAKEN` seconds and a few bins it lies in."""
    rows = np.concatenate([np.arange(b.start, b.stop) for b in problem.fitted])
    long = max(SHAKEN, BINS * problem.bins.width)
    key = np.column_stack([problem.bins.run[rows], np.floor(problem.bins.time[rows] / long)])
    return np.arange(len(rows)), np.unique(key, axis=0, return_inverse=True)[1].ravel()


def _labels(problem: Problem) -> Iterator[NDArray[np.int64]]:
    rows = np.concatenate([np.arange(b.start, b.stop) for b in problem.fitted])
    run = np.unique(problem.bins.run[rows], return_inverse=True)[1].ravel()
    steps = float(np.median(np.abs(np.diff(problem.y[rows])))) if len(rows) > 1 else 0.0
    swings = _swings(problem.bins.mean(tuple(e.u for e in problem.exposures))[rows], run, UNSEEN * steps)
    count = int(swings.max()) + 1
    yield swings
    yield swings // 4
    yield swings * min(PARTS, count) // count
    yield run


def _swings(u: Floats, run: NDArray[np.int64], least: float) -> NDArray[np.int64]:
    """Which swing each bin lies in: from one way up through the middle of the input to the next, whole waves.

    An input whose root mean square about its middle is no more than ``least`` has none. What repeats from wave to wave,
    as an effect that is not in the model yet does, has no scores in whole waves.
    """
    out = np.zeros(len(u), np.int64)
    for k in range(int(run.max()) + 1):
        own = run == k
        off = u[own] - np.median(u[own])
        size = float(np.sqrt(np.mean(off**2)))
        side = np.sign(off) * (np.abs(off) > LEAST * size) * (size > least)
        known = np.flatnonzero(side)
        up = known[1:][(side[known[1:]] > 0) & (side[known[:-1]] < 0)]
        starts = np.zeros(len(off), np.int64)
        starts[up] = 1
        starts[0] = 1
        out[own] = np.cumsum(starts) + out.max()
    return out - 1
