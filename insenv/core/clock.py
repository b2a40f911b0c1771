"""Time stamps of a sampler: an even clock under stamps that jitter, are rounded, or miss rows here and there.

    t_i = a + T k_i + e_i,        k_i whole ticks, e_i the error of the stamp

Errors of the stamps do not add up: the phase t_i - T k_i stays where it is, however long the recording, and leaps only
where rows were lost. Steps that are themselves uneven make it wander like a random walk; then there is no period, and
rows cannot be told to be means over it. That is told apart by the spread of the phase's changes over 1 and over 16
windows of rows: equal in the first case, four times as large in the second.

Where stamps jitter the instrument may have sampled evenly (the stamps are wrong: a rounding, a busy logger) or at the
times stamped (the sampler is uneven, a little). A turning table tells: its angle is smooth in the true time.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from insenv.core.recording import Floats

#: A step is clear if it departs by less than this share of a period from a whole number of them.
CLEAR = 0.35
#: Share of steps that may be unclear (gaps of any length) where ticks are counted step by step.
FEW = 0.02
#: Fewest double steps from which rounding is told from lost rows.
DOUBLES = 20
#: Rows per tick below which the stamps are those of bursts, if a clock of the bursts is there.
SPARSE = 0.2
#: Rows in a window whose median phase is followed.
WINDOW = 64
#: Rows whose median phase stands for the clock where it is not straight.
FOLLOWED = 31
#: Windows over which a phase that wanders is told from one that does not.
FAR = 16
#: Change of the phase over `FAR` windows, in periods, that an uneven sampler exceeds.
WANDER = 0.5
#: The same as a multiple of that over one window; a random walk has 4.
GROWTH = 2.0
#: A step longer than this many periods is a gap beyond doubt; so is what exceeds the usual spread so many times.
LONG = 10.0
#: Jitter of so many periods is none of a clock, unless so many rows share a stamp, as rounding makes them.
UNEVEN, SHARED = 1.5, 0.3
#: Jitter below this share of the period is of no consequence.
NEGLIGIBLE = 0.02
#: Jitter below this share does not even matter to the rate of a table that turns fast.
ROUNDING = 1e-7


@dataclass(frozen=True)
class Clock:
    """What the stamps of a run say of its clock.

    Attributes
    ----------
    period : float
        T [s].
    even : ndarray, shape (n,)
        Times of the rows by the even clock [s].
    jitter : float
        Standard deviation of a stamp about the clock [s].
    wander : float
        Standard deviation of a single step [s], of stamps that follow no clock; 0 where they follow one.
    straight : bool
        Whether each stretch between long gaps has one phase throughout, no row lost.
    """

    period: float
    even: Floats
    jitter: float
    wander: float = 0.0
    straight: bool = False

    @property
    def steady(self) -> bool:
        """Whether there is a clock at all."""
        return self.wander == 0


def clock_of(t: Floats) -> Clock:
    """The clock behind stamps ``t``, shape (n,), n > 1, that nowhere run backwards and somewhere forwards."""
    steps = np.diff(t)
    period = _usual(steps)
    ticks = np.maximum(np.rint(steps / period), 1.0)
    unclear = np.abs(steps / period - ticks) > CLEAR
    if unclear.mean() > FEW:
        return _jittering(t, steps)
    if _rounded(t, ticks, period) or len(t) < SPARSE * ticks.sum():
        other = _jittering(t, steps)
        if other.steady:
            return other
    good = ~unclear
    rough = float(steps[good].sum() / ticks[good].sum())
    jitter = float(np.std(steps[good] - ticks[good] * rough)) / np.sqrt(2)
    if jitter < NEGLIGIBLE * period:
        return Clock(rough, t if jitter < ROUNDING * period else _counted(t, steps, ticks).even, jitter)
    other = _jittering(t, steps)
    return other if other.steady and other.straight else _counted(t, steps, ticks)


def _usual(steps: Floats) -> float:
    """Mean of the steps that are neither gaps nor none [s]."""
    steps = steps[steps > 0]
    return float(np.mean(steps[steps <= 1.5 * np.median(steps)]))


def _rounded(t: Floats, ticks: Floats, period: float) -> bool:
    """Whether double steps keep the stamps on one straight line, as rounding does and rows lost at random do not."""
    if np.sum(ticks == 2) < DOUBLES or ticks.max() > 2:
        return False
    index = np.arange(len(t))
    slope, level = np.polyfit(index, t, 1)
    return bool(np.abs(t - slope * index - level).max() < 0.6 * period)


def _counted(t: Floats, steps: Floats, ticks: Floats) -> Clock:
    """Stamps near the clock, rows lost or not: ticks are counted step by step."""
    short = ticks <= LONG
    period = float(steps[short].sum() / ticks[short].sum())
    window = max(1, min(WINDOW, len(t) // 8))
    phase = t - period * np.concatenate([[0.0], np.cumsum(ticks)])
    # A step that jitter has made longer than one and a half periods counts for two: the phase then leaps back.
    level = np.median(phase[: len(t) // window * window].reshape(-1, window), axis=1)
    for j in np.flatnonzero(np.abs(np.rint(np.diff(level) / period)) == 1):
        near = slice(j * window, min((j + 2) * window, len(ticks)))
        worst = near.start + int(np.argmax(np.abs(steps[near] / period - ticks[near])))
        ticks[worst] = max(ticks[worst] + np.rint((level[j + 1] - level[j]) / period), 1.0)
    short = ticks <= LONG
    period = float(steps[short].sum() / ticks[short].sum())
    clock = period * np.concatenate([[0.0], np.cumsum(ticks)])
    even = clock + _running_median(t - clock, FOLLOWED)
    return Clock(period, even, float(np.std(t - even)))


def _jittering(t: Floats, steps: Floats) -> Clock:
    """Stamps that scatter about the clock by much of a period, or follow none."""
    period, longest = _mean_step(steps)
    even, left, pieces = t.copy(), [np.zeros(0)], []
    breaks = np.flatnonzero(steps > longest) + 1
    for a, b in pairwise((0, *breaks.tolist(), len(t))):
        if b - a > 1:
            piece = _piece(t[a:b], period)
            even[a:b] = piece.even
            left.append(t[a:b] - piece.even)
            pieces.append(piece)
    most = max(pieces, key=lambda p: len(p.even))
    jitter = float(np.std(np.concatenate(left)))
    apart = jitter > UNEVEN * period and float(np.mean(steps == 0)) < SHARED
    wander = most.wander or (jitter if apart or (np.diff(even) <= 0).any() else 0.0)
    return Clock(most.period if most.straight else period, even, jitter, wander, all(p.straight for p in pieces))


def _mean_step(steps: Floats) -> tuple[float, float]:
    """Mean step without gaps, and the length of a step that only a gap explains [s]."""
    longest = np.inf
    for _ in range(5):
        period = float(np.mean(steps[steps <= longest]))
        longest = max(LONG * period, 3 * float(np.quantile(steps, 0.995)))
    return period, longest


def _running_median(x: Floats, size: int) -> Floats:
    from scipy.ndimage import median_filter  # slow to import

    return np.asarray(median_filter(x, size=size, mode="nearest"), dtype=np.float64)


def _spread(x: Floats) -> float:
    """Robust standard deviation."""
    return 1.4826 * float(np.median(np.abs(x - np.median(x)))) if len(x) else 0.0


@dataclass(frozen=True)
class _Piece:
    """A stretch without long gaps: even times, period and wander of its steps; ``straight`` if no row was lost."""

    even: Floats
    period: float
    straight: bool = False
    wander: float = 0.0


def _piece(t: Floats, period: float) -> _Piece:
    n = len(t)
    index = np.arange(n)
    window = max(1, min(WINDOW, n // 8))
    whole = n // window * window
    phase = np.median((t - period * index)[:whole].reshape(-1, window), axis=1)
    centre = np.median(index[:whole].reshape(-1, window), axis=1)
    slope, level = np.polyfit(centre, phase, 1) if len(phase) > 1 else (0.0, phase[0])
    bent = phase - (slope * centre + level)
    noise = _spread(np.diff(bent))
    far = _spread(bent[FAR:] - bent[:-FAR]) if len(bent) > 2 * FAR else 0.0
    if far > max(WANDER * period, GROWTH * noise):
        return _Piece(t, period, wander=float(np.std(np.diff(t))))
    if np.abs(bent).max() <= max(WANDER * period, 4 * noise):
        slope, level = np.polyfit(index, t, 1)
        return _Piece(slope * index + level, float(slope), straight=True)
    # Rows were lost on the way: the phase leaps, and its running median leaps with it.
    even = period * index + _running_median(t - period * index, 2 * WINDOW + 1)
    return _Piece(even, period)


def roughness(t: Floats, angle: Floats) -> float:
    """Median change of the rate between neighbouring steps; infinite where time stands still or there are too few."""
    steps = np.diff(t)
    if len(steps) < 2 or (steps <= 0).any():
        return np.inf
    return float(np.median(np.abs(np.diff(np.diff(angle) / steps))))
