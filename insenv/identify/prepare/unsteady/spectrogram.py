r"""Power of the rows in cells of time and frequency, over what is usual at that frequency.

Rows r are made white by what the L rows before foretell of each (Yule and Walker), clipped, cut into segments that
overlap by a half, and

    E_sf = |sum_t w_t r_t exp(-2 pi i f t)|^2 / m_f,        w: Hann,    m_f = median_s |...|^2 / ln 2

is exponential of mean one in each cell if the noise, of any spectrum, is steady. Where a line stands cells tell
nothing, for its amplitude and its frequency may wander. m_f is no less than the median of those about it: of few
segments it is uncertain.

Where the motion, made white by the same filter, has a share of m_f in a cell, the cell tells nothing: what a lag, a
filter or noise of a reference leaves of motion is there. What it has is in m_f elsewhere: a noise of the reference that
comes and goes with the motion, as its steps do, is in what is left as it is.

Source: P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70; M. B. Priestley and T. Subba Rao, J. R. Stat. Soc. B
31 (1969) 140 (steady or not, by spectra of segments).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import LinAlgError, solve_toeplitz
from scipy.ndimage import maximum_filter1d, median_filter

from insenv.core.recording import Floats
from insenv.core.series.robust import robust_deviation

#: Rows before that foretell one, rows for each of them, and the share of white noise that keeps them few.
BEFORE, ROWS_FOR_EACH, WHITE = 24, 50, 1e-5
#: Robust deviations of the white rows to which they are clipped: single rows are outliers, and another's matter.
CLIP = 5.0
#: Share of a step by which rows must scatter: below it readings stand still or hop, by where they are.
BLURRED = 0.55
#: Rows of the shortest segments, how many times as long the next ones are, and fewest segments.
SHORTEST, LONGER, FEWEST = 32, 2, 40
#: Frequencies about one whose median it does not fall below, and share of the usual power below which none is judged.
#: The same share of the mean power, of rows that stand still for most of the time.
ABOUT, FLOOR, STILL = 17, 0.05, 1e-6
#: Share of the usual power that the motion has in a cell from which on that tells nothing of the instrument; for how
#: long after a command a table may be on its way [s].
OF_MOTION, ON_THE_WAY = 0.25, 2.0
#: Share of half the sampling rate up to which rows beside a measured reference are judged: beyond it differences of an
#: angle that was read at times which are not quite even are most of them, and the faster it turned the more.
UP_TO = 0.9
#: Share of the rows of a segment that may be missing.
MISSING = 0.25
#: How far the usual power at a frequency is above that about it where a line stands, and columns beside one that it
#: reaches, more if it wanders.
LINE, BESIDE = 6.0, 2
#: Lowest frequency in segments: below it is the slope of a segment.
LOWEST = 2


@dataclass(frozen=True)
class RowsLeft:
    """What a model leaves of rows that follow each other, and what the rows were exposed to.

    Attributes
    ----------
    run : int
    start : float
        Time of the first row since the start of its run [s].
    dt : float
        Sampling period [s].
    values : ndarray, shape (n,)
        Reading less reference and model.
    rate : ndarray, shape (n,), optional
        The reference; None of a unit at rest.
    commanded : bool
        Whether that is what was asked for, and not what was measured.
    lines : tuple of (float, float)
        Frequency and half the width of lines that are told elsewhere [Hz].
    step : float
        To which readings were rounded coarsely; 0 where they were not.
    missing : ndarray of bool, shape (n,), optional
        Rows that were lost or left out, for which a straight line stands.
    encoder : float
        Step to which the angle of the table is read, as the target sees it [rad]; 0 where that is not the reference.
    """

    run: int
    start: float
    dt: float
    values: Floats
    rate: Floats | None = None
    commanded: bool = False
    lines: tuple[tuple[float, float], ...] = ()
    step: float = 0.0
    missing: NDArray[np.bool_] | None = None
    encoder: float = 0.0


@dataclass(frozen=True)
class White:
    """Rows made white, with what they were exposed to.

    Attributes
    ----------
    rows : ndarray, shape (n,)
        Of unit variance.
    motion : ndarray, shape (n,), optional
        What the same filter makes of the reference; None at rest.
    left : RowsLeft
        The same rows, as they were.
    """

    rows: Floats
    motion: Floats | None
    left: RowsLeft


@dataclass(frozen=True)
class Spectrogram:
    """Energy E of segments by frequency.

    Attributes
    ----------
    rows : int
        Of a segment; the next one begins half as many later.
    first : int
        Frequency of the first column, in cycles per segment; the next one's is one more.
    energy : ndarray, shape (segments, frequencies)
        Of mean one if the noise is steady; zero where a cell tells nothing.
    told : ndarray of bool, shape (segments, frequencies)
        Where it tells something.
    """

    rows: int
    first: int
    energy: Floats
    told: NDArray[np.bool_]

    def seconds(self, segment: int, count: int, left: RowsLeft) -> tuple[float, float]:
        """From when to when [s] ``count`` segments from one on are, without the flanks of their windows."""
        quarter = self.rows // 4
        rows = (segment * self.rows // 2 + quarter, (segment + count + 1) * self.rows // 2 - quarter)
        return left.start + rows[0] * left.dt, left.start + rows[1] * left.dt

    def hertz(self, column: float, left: RowsLeft) -> float:
        """Frequency of a column [Hz]; the edge between two is half of one further."""
        return (self.first + column) / (self.rows * left.dt)


def white(left: RowsLeft) -> White | None:
    """The rows made white; None where they are too few, or stand still."""
    off = left.values - np.median(left.values)
    taps = foretelling(off)
    if taps is None:
        return None
    order = len(taps) - 1
    rows = np.convolve(off, taps, "valid")
    spread = robust_deviation(rows)
    if not spread > BLURRED * left.step:
        return None
    rate = None if left.rate is None else left.rate[order:]
    missing = None if left.missing is None else left.missing[order:]
    motion = None if left.rate is None else np.convolve(left.rate, taps, "valid") / spread
    own = replace(left, start=left.start + order * left.dt, values=left.values[order:], rate=rate, missing=missing)
    return White(np.clip(rows / spread, -CLIP, CLIP), motion, own)


def foretelling(values: Floats) -> Floats | None:
    """Filter that leaves of ``values``, shape (n,), what those before do not foretell, shape (order + 1,).

    None where they are too few, or stand still.
    """
    n, size = len(values), next_fast_len(2 * len(values))
    order = min(BEFORE, n // ROWS_FOR_EACH)
    if order < 1 or not np.ptp(values) > 0:
        return None
    same = irfft(np.abs(rfft(values, size)) ** 2, size)[: order + 1] / n
    same[0] *= 1 + WHITE
    try:
        return np.append(1.0, -solve_toeplitz(same[:-1], same[1:]))
    except LinAlgError:
        return None


def lengths(n: int) -> Iterator[int]:
    """Rows of the segments that ``n`` rows are cut into, shortest first."""
    rows = SHORTEST
    while 2 * n // rows - 1 >= FEWEST:
        yield rows
        rows *= LONGER


def spectrogram(made: White, rows: int, lowest: float) -> Spectrogram | None:
    """Energy in segments of so many ``rows`` above a ``lowest`` frequency [Hz]; None where none is left."""
    left = made.left
    first = max(LOWEST, int(np.ceil(lowest * left.dt * rows)))
    if first >= rows // 2:
        return None
    power = _power(made.rows, rows, first)
    whole = np.ones(len(power), bool)
    if left.missing is not None:
        lost = np.lib.stride_tricks.sliding_window_view(left.missing, rows)[:: rows // 2]
        whole = lost.mean(axis=1) <= MISSING
    if not whole.any():
        return None
    usual = np.median(power[whole], axis=0) / np.log(2)
    about = median_filter(usual, ABOUT, mode="nearest")
    line = maximum_filter1d(usual > LINE * about, 2 * BESIDE + 1)
    least = max(FLOOR * float(np.median(usual)), STILL * float(power.mean()))
    if not least > 0:
        return None
    usual = np.maximum(np.maximum(usual, about), least)
    told = whole[:, None] & ~line
    expected = np.broadcast_to(usual, power.shape)
    if made.motion is not None:
        motion = _power(made.motion, rows, first, straight=True)
        moved = motion > OF_MOTION * usual
        told &= ~(_on_the_way(moved, left.dt * rows) if left.commanded else moved)
        expected = usual + motion
    column = first + np.arange(power.shape[1])
    if made.motion is not None and not left.commanded:
        told[:, column > UP_TO * rows / 2] = False
    for frequency, half in left.lines:
        told[:, np.abs(column - frequency * left.dt * rows) <= half * left.dt * rows + BESIDE] = False
    return Spectrogram(rows, first, np.where(told, power / expected, 0.0), told)


def _on_the_way(moved: NDArray[np.bool_], seconds: float) -> NDArray[np.bool_]:
    """Cells of motion, and those soon after, shape (segments, frequencies), of segments so many ``seconds`` long."""
    after = int(np.ceil(2 * ON_THE_WAY / seconds))
    return np.asarray(maximum_filter1d(moved, 2 * after + 1, axis=0, origin=0), bool)


def _power(values: Floats, rows: int, first: int, straight: bool = False) -> Floats:
    """Power of Hann windows of ``values`` from a frequency on, below half the sampling rate, shape (segments, m).

    Of a motion the ``straight`` line of each segment is taken off: its sharp ends are no motion.
    """
    window = np.sin(np.pi * (np.arange(rows) + 0.5) / rows) ** 2
    window /= np.sqrt(window @ window)
    segments: NDArray[np.float64] = np.lib.stride_tricks.sliding_window_view(values, rows)[:: rows // 2]
    if straight:
        time = np.linspace(-1.0, 1.0, rows)
        mean = segments.mean(axis=1, keepdims=True)
        segments = segments - mean - np.outer(segments @ time / (time @ time), time)
    wave = rfft(segments * window, axis=1)[:, first : rows // 2]
    return np.asarray(wave.real**2 + wave.imag**2)
