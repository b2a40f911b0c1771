"""Lines that move, in what is left: a pump that speeds up, a gear that follows a motor which no channel tells.

The whitened residual r of one run, at bins t = 0 ... n - 1, is compared with waves whose frequency changes evenly,

    2 / n | sum_t r_t exp(-i pi (2 f t + c t^2)) |^2  ~  chi-square with 2 degrees of freedom

for every f below half the bin rate and changes c n of the frequency of up to a quarter of it: in whole runs, each by
itself and all of them at one f and c (a machine that is switched on with the run), and in thirds and ninths, of which
the best of each are joined (Fisher), for a line that moves unevenly. Where noise is louder than what whitens it says,
over a broad band, so is what a wave must be: the mean power around it, at its own c, stands for the 1 (F). Where the
model was fitted, its columns take out a part of noise alone, so probabilities are upper bounds.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.fft import fft
from scipy.ndimage import uniform_filter1d
from scipy.special import chdtrc

from insenv.core.recording import Floats

#: Largest change of the frequency over a window, in cycles per bin, and what lies between two that are tried, in 1 / n:
#: half of it leaves 0.3 rad of phase, a twentieth of the power.
MOST_CHANGE, STEP = 0.25, 3.0
#: Share of all waves tried (at half the distance of Fourier's) that are as good as independent; measured 0.2 to 0.4.
DISTINCT = 0.5
#: Parts that runs are cut into; fewest bins of a part, the most that are looked at together, and of all runs.
PARTS, LEAST, LONGEST, MOST = (1, 3, 9), 32, 4096, 8192
#: Fewest waves in a part: what is slower is a curve, and belongs to the noise or to a drift.
FEWEST_WAVES = 4
#: Share of the frequencies over which the loudness of noise is judged, and how many about a wave are its own.
BROAD, OWN = 8, 5


def sweeps_p(runs: tuple[Floats, ...]) -> float:
    """Probability that white noise follows any line that moves so well.

    Parameters
    ----------
    runs : tuple of ndarray, shape (n,)
        White, of unit variance if only noise is left, one value for each bin of a run; zero where there is none.
    """
    runs = tuple(run for run in runs if len(run) >= LEAST)
    if not runs:
        return 1.0
    length, tails = min(max(map(len, runs)), LONGEST), []
    for count in PARTS:
        n = length // count
        if n < LEAST:
            break
        parts = [run[i : i + n] for run in runs for i in range(0, max(len(run) - n // 2, 1), n)][: MOST // n]
        chirps = _chirps(n)
        power = [_power(part, chirps) for part in parts if np.count_nonzero(part) >= n // 2]
        if power:
            tails += _tails(power, whole=count == 1 and length == max(map(len, runs)))
    return float(min(1.0, min(tails, default=1.0) * len(tails)))


def _tails(power: list[NDArray[np.float32]], whole: bool) -> list[float]:
    """Tails of the largest wave of any part, of the sum of all at one frequency and sweep, and of the best of each."""
    cells = DISTINCT * power[0].size
    if whole and len(power) > 1:
        power = [_beside_noise(p) for p in power]
        together = [float(chdtrc(2 * len(power), np.sum(power, axis=0).max()) * cells)]
    else:
        power, together = [_beside_noise(_loud(p, cells)) for p in power], []
    single = np.minimum(np.exp(-0.5 * np.array([float(p.max(initial=0.0)) for p in power])) * cells, 1.0)
    if len(power) == 1:
        return [float(single[0])]
    joined = float(chdtrc(2 * len(single), -2 * np.log(np.maximum(single, 1e-300)).sum()))
    return [float(single.min() * len(power)), joined, *together]


@lru_cache(maxsize=len(PARTS))
def _chirps(n: int) -> NDArray[np.complex64]:
    """Waves that take each rise of the frequency back over ``n`` bins, none first, shape (rises, n)."""
    phase = STEP * np.arange(int(MOST_CHANGE * n / STEP) + 1)[:, None] * (np.arange(n) / n) ** 2
    phase -= 2 * np.floor(0.5 * phase)  # the remainder, to the last bit as by %, which takes far longer
    return np.exp((-1j * np.pi * phase).astype(np.complex64))


def _power(part: Floats, chirps: NDArray[np.complex64]) -> NDArray[np.float32]:
    """Power at each change and frequency, shape (changes, frequencies).

    The series is real: its fall at f is the conjugate of its rise at -f.
    """
    n, have = chirps.shape[1], part != 0
    series = np.where(have, part - part.sum() / have.sum(), 0.0).astype(np.float32)
    both = fft(series * chirps[:, : len(part)], 2 * n, axis=1, overwrite_x=True)
    first, rises = 2 * FEWEST_WAVES, len(both)
    power = np.empty((2 * rises - 1, n - 1 - first), np.float32)
    for rows, found in ((power[:rises], both[:, first : n - 1]), (power[rises:], both[1:, -first : 1 - n : -1])):
        np.square(found.real, out=rows)
        rows += np.square(found.imag)
    np.multiply(power, 2 / have.sum(), out=power, casting="same_kind")
    return power


def _beside_noise(power: NDArray[np.float32]) -> NDArray[np.float32]:
    """Power over that of the noise about it, where that is less, by rows."""
    broad = power.shape[1] // BROAD + OWN + 1
    around = uniform_filter1d(power, broad)
    around *= broad
    near = uniform_filter1d(power, OWN)
    near *= OWN
    around -= near
    # The mean is itself of few values (two frequencies for each of Fourier's): F, not chi-square.
    known = np.float32(broad - OWN)
    beside = np.divide(np.multiply(power, 2, out=near), np.maximum(around, 1e-6, out=around), out=near)
    beside = np.log1p(beside, out=beside)
    beside *= known
    return np.minimum(power, beside, out=beside)


def _loud(power: NDArray[np.float32], cells: float) -> NDArray[np.float32]:
    """Changes of which some raw power is a surprise among all: the others need no comparison with their noise."""
    return power[power.max(axis=1) > 2 * np.log(cells)]
