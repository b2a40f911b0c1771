r"""Whether a wave of the table's angle stands in its encoder alone, and the gyro has none of it.

A response of the reference that nobody foretold explains any wave of the reference: that the gyro reads nothing at its
frequency. A filter does not do that to one wave and leave those beside it. Where the table turns steadily, with x~ what
is left of x beside its mean over a wave of the angle, w the wave as it is fitted and y the gyro without other waves,
which it reads (the Earth's rate is far larger than the errors of a good encoder),

    c = sum w~ y~ / sum w~^2

is 0 of an error of the encoder, and of a ripple that both see far from it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import Floats
from insenv.data.exposure import Exposure
from insenv.effects.angle import EncoderHarmonic
from insenv.identify.fit.gls import Fit
from insenv.identify.fit.problem import Problem, Term, regressors

#: Share of the wave that the gyro has at most, two of its deviations counted.
HALF = 0.5
#: Cells in a wave at least; how far apart the means of the gyro over its halves may be where the table turns steadily,
#: in root mean squares of the wave; and waves that tell it.
LEAST_CELLS, STEADY, WAVES = 4.0, 3.0, 2.0


def in_reference_alone(problem: Problem, fit: Fit) -> bool:
    """Whether the gyro has none of a wave of the encoder that was fitted last."""
    *others, term = fit.model
    if not isinstance(term.effect, EncoderHarmonic) or problem.commanded or term.per_run or not _sees_it(problem):
        return False
    theta = fit.theta[fit.design.term == len(others)]
    waves = [(t, fit.theta[fit.design.term == k]) for k, t in enumerate(others) if "angle" in t.effect.needs]
    whole = [(t, theta) for t, theta in waves if len(theta) == len(t.effect.linear)]  # each coefficient is told
    read = [each for each in whole if each[0].effect.belongs != "reference" and not each[0].per_run]
    parts = [part for run in range(len(problem.exposures)) for part in _steady(problem, run, (term, theta), read)]
    if len(theta) != len(term.effect.linear) or sum(count for *_, count in parts) < WAVES:
        return False
    wave, own = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    power = float(wave @ wave)
    if not power:
        return False
    share = float(wave @ own) / power
    sd = math.sqrt(float(np.mean((own - share * wave) ** 2)) / power)
    return abs(share) + 2 * sd < HALF


def _sees_it(problem: Problem) -> bool:
    """Whether the gyro reads the turning at all: of one across the table's axis it is no wonder that it has no wave."""
    read, turned = 0.0, 0.0
    for run, exposure in enumerate(problem.exposures):
        fitted = _fitted(problem, run)
        read += float(exposure.y[fitted] @ exposure.motion.rate[fitted])
        turned += float(exposure.motion.rate[fitted] @ exposure.motion.rate[fitted])
    return abs(problem.gain * read) > HALF * turned


def _steady(
    problem: Problem, run: int, fitted_wave: tuple[Term, Floats], read: Sequence[tuple[Term, Floats]]
) -> Iterator[tuple[Floats, Floats, float]]:
    """Wave and reading beside their means over a wave, where a run turns steadily, and how many waves these are.

    ``read`` are other waves, with their coefficients, that the gyro reads.
    """
    exposure = problem.exposures[run]
    if exposure.motion.angle is None:
        return
    fitted = _fitted(problem, run)
    if not fitted.any():
        return
    turned = np.abs(np.diff(exposure.motion.angle)) * getattr(fitted_wave[0].effect, "order", 1) / (2 * np.pi)
    way, edges = np.concatenate([[0.0], np.cumsum(turned)]), np.arange(len(turned) + 1.0)
    middle = 0.5 * (way[1:] + way[:-1])
    low, mid, high = (np.interp(middle + side, way, edges) for side in (-0.5, 0.0, 0.5))
    whole = (middle >= 0.5) & (middle <= way[-1] - 0.5) & (high - low >= LEAST_CELLS) & (low < mid) & (mid < high)
    low, mid, high = np.where(whole, low, 0.0), np.where(whole, mid, 0.5), np.where(whole, high, 1.0)
    wave = _curve(fitted_wave, exposure)
    beside = sum((_curve(each, exposure) for each in read), np.zeros(len(exposure.y)))
    reading = np.where(fitted, exposure.y - beside, 0.0)
    apart = np.abs(_mean(reading, low, mid) - _mean(reading, mid, high))
    used = whole & (_mean(fitted.astype(float), low, high) > 1 - 1e-9)
    used &= apart < STEADY * float(np.sqrt(np.mean(wave[fitted] ** 2)))
    yield (
        (wave - _mean(wave, low, high))[used],
        (reading - _mean(reading, low, high))[used],
        float(turned[used].sum()),
    )


def _curve(fitted_wave: tuple[Term, Floats], exposure: Exposure) -> Floats:
    """What a term adds to the cells of a run."""
    term, theta = fitted_wave
    return np.asarray(regressors(term.effect, exposure, term.shape) @ theta, np.float64)


def _fitted(problem: Problem, run: int) -> NDArray[np.bool_]:
    """Which cells of a run hold rows of fitted bins, shape (cells,)."""
    exposure, cells = problem.exposures[run], problem.bins.fitted_cells(run)
    out = np.zeros(len(exposure.y), bool)
    out[cells] = exposure.count[cells] > 0
    return out


def _mean(values: Floats, low: Floats, high: Floats) -> Floats:
    """Mean of cells from one place to another, in cells and parts of them."""
    total, edges = np.concatenate([[0.0], np.cumsum(values)]), np.arange(len(values) + 1)
    return np.asarray((np.interp(high, edges, total) - np.interp(low, edges, total)) / (high - low))
