"""Time stamps of a sampler: an even clock under stamps that jitter, are rounded, or miss rows here and there.

    t_i = a + T k_i + e_i,        k_i whole ticks, e_i the error of the stamp

Errors of the stamps do not add up: the phase t_i - T k_i stays where it is, however long the recording, and leaps only
where rows were lost. Steps that are themselves uneven make it wander like a random walk; then there is no period, and
rows cannot be told to be means over it. That is told apart by the spread of the phase's changes over 1 and over 16
windows of rows: equal in the first case, four times as large in the second.

A stamp may be wrong by itself: written late by a busy logger, written twice, rounded. It departs from the clock that
its neighbours keep, and they go on as if nothing had been; where all that follow depart, a clock was set.

    k_i = round((t_i - phase) / T),     phase: circular mean of t modulo T,     k_i - i never falls

Rows that are lost raise k_i - i for good; of the stamps that would make it fall as few as can be are wrong.

Rows may come in packets of one size, stamped as they are read out: then the packets keep the clock, a packet is n
periods long, and its last row was taken when it came.

Where stamps jitter the instrument may have sampled evenly (the stamps are wrong: a rounding, a busy logger) or at the
times stamped (the sampler is uneven, a little). A turning table tells: its angle is smooth in the true time.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from insenv.core.recording import GAP, Floats
from insenv.core.series.robust import robust_deviation

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
#: Share of the mean step within which the rows of a packet follow each other, fewest packets, the share of them that
#: are of one size, and the share of a period by which they may come early or late.
WITHIN, PACKETS, ONE_SIZE, PUNCTUAL = 0.2, 16, 0.98, 0.3
#: Jitter below this share of the period is of no consequence.
NEGLIGIBLE = 0.02
#: Jitter below this share of the period leaves no doubt which tick a stamp belongs to.
LITTLE = 0.1
#: Jitter below this share does not even matter to the rate of a table that turns fast.
ROUNDING = 1e-7
#: A stamp is off the clock by more than so many robust deviations, and more than this share of a period.
OFF, LEAST_OFF = 8.0, 2e-3
#: Stamps rounded to more than this share of a period are no longer told from a clock that leaps.
COARSEST = 0.25
#: Share of stamps beyond which those off the clock are how the stamps are.
MOST_OFF = 0.25
#: A stamp within this share of a period of a tick is counted at that tick.
ON_TICK = 0.25
#: Windows over which a phase is taken, so that one window of stamps that are wrong does not lead it astray.
PHASES = 5
#: A phase that changes by more than this share of a period, and deviations of a stamp, from one row to the next leaps.
LEAP, LEAP_SD = 0.05, 6.0
#: Share of rows at which a clock may be set, and of rows of an unsure tick.
MOST_LEAPS, MOST_UNSURE = 0.01, 0.1


def _none() -> NDArray[np.bool_]:
    return np.zeros(0, dtype=bool)


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
    off : ndarray of bool, shape (n,)
        Stamps that are wrong by themselves; empty where they are not told from the others.
    leaps : ndarray of bool, shape (n,)
        First rows at another phase of the clock, without a gap before them; empty as ``off``.
    unsure : ndarray of bool, shape (n,)
        Stamps that are wrong beside rows that were lost: nobody can tell which tick is theirs; empty as ``off``.
    quantum : float
        What the stamps are rounded to [s], as far as it shows.
    packet : int
        Rows that come at once; 1 where they come one by one.
    """

    period: float
    even: Floats
    jitter: float
    wander: float = 0.0
    straight: bool = False
    off: NDArray[np.bool_] = field(default_factory=_none)
    leaps: NDArray[np.bool_] = field(default_factory=_none)
    unsure: NDArray[np.bool_] = field(default_factory=_none)
    quantum: float = 0.0
    packet: int = 1

    @property
    def steady(self) -> bool:
        """Whether there is a clock at all."""
        return self.wander == 0


def clock_of(t: Floats) -> Clock:
    """The clock behind stamps ``t``, shape (n,), n > 1, that nowhere run backwards and somewhere forwards."""
    steps = np.diff(t)
    if (packets := _of_packets(t, steps)) is not None:
        return packets
    period = _usual(steps)
    ticks = np.maximum(np.rint(steps / period), 1.0)
    unclear = np.abs(steps / period - ticks) > CLEAR
    other = None
    if _rounded(t, ticks, period) or len(t) < SPARSE * ticks.sum():
        other = _jittering(t, steps)
        if other.steady:
            return other
    counted = _counted(t, _plain(t, steps, ticks, unclear))
    told = counted.leaps.mean() <= MOST_LEAPS and counted.unsure.mean() <= MOST_UNSURE
    kept = told and bool((np.diff(counted.even) > 0).all())
    if counted.jitter < NEGLIGIBLE * period and kept:
        return counted
    other = other or _jittering(t, steps)
    if unclear.mean() <= FEW and told:
        straight = other.steady and other.straight and not (kept and other.jitter > GROWTH * counted.jitter)
        return _with_off(other, t) if straight else counted
    return counted if kept and not other.steady and counted.jitter < LITTLE * period else other


def _of_packets(t: Floats, steps: Floats) -> Clock | None:
    """The clock behind rows that come in packets of one size at even times; None where they do not."""
    first = np.flatnonzero(np.append(True, steps > WITHIN * float(steps.mean())))
    sizes = np.diff(np.append(first, len(t)))
    rows = int(np.median(sizes))
    if len(first) < PACKETS or rows < 2 or float(np.mean(sizes == rows)) < ONE_SIZE:
        return None
    came = clock_of(t[first])
    period = came.period / rows
    if not came.steady or came.jitter > PUNCTUAL * period:
        return None
    place = np.arange(len(t)) - np.repeat(first, sizes)
    even = np.repeat(came.even, sizes) + period * (place - np.repeat(sizes, sizes) + 1)
    if (np.diff(even) <= 0).any():
        return None
    return Clock(period, even, float(np.std(t - even)), straight=came.straight, quantum=came.quantum, packet=rows)


def _plain(t: Floats, steps: Floats, ticks: Floats, unclear: NDArray[np.bool_]) -> float:
    """The period [s] whose phase the stamps keep better: mean of the clear steps, or of those like the median."""
    middle = float(np.median(steps))
    like = steps[np.abs(steps - middle) <= 0.05 * middle]
    tried = [float(like.mean())] if middle > 0 and len(like) else []  # none where the median lies between two steps
    if not unclear.all():
        tried.append(float(steps[~unclear].sum() / ticks[~unclear].sum()))
    return max(tried or [_usual(steps)], key=lambda period: float(np.mean(np.abs(_turns(t, period)))))


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


def _counted(t: Floats, period: float) -> Clock:
    """Stamps near the clock, rows lost or not, some of them wrong."""
    lost, unsure = _lost((t - _phase(t, period)) / period)
    ticks = np.arange(len(t)) + lost
    long = np.flatnonzero(np.diff(lost) > LONG) + 1
    even, leaps = np.empty(len(t)), np.zeros(len(t), dtype=bool)
    quantum = _quantum(t, period)
    periods = []
    for a, b in pairwise((0, *long.tolist(), len(t))):
        even[a:b], leaps[a:b], own = _levelled(t[a:b], ticks[a:b], period, quantum)
        periods.append((b - a, own))
    left = t - even
    off = _off(left, period, quantum)
    jitter = float(np.std(left[~off]))
    fewer = np.diff(lost) > 0
    unsure |= off & (np.append(False, fewer) | np.append(fewer, False))
    # One of two wrong stamps beside a loss: the rows may both be a tick earlier.
    unsure |= off & (np.append(False, unsure[:-1]) | np.append(unsure[1:], False))
    if jitter < ROUNDING * period:
        even = np.where(off, even, t)
    return Clock(max(periods)[1], even, jitter, off=off, leaps=leaps & ~off, unsure=unsure, quantum=quantum)


def _off(left: Floats, period: float, quantum: float) -> NDArray[np.bool_]:
    """Which stamps, ``left`` [s] from their clock, shape (n,), are wrong by themselves; none where many would be."""
    off = np.abs(left) > max(OFF * _spread(left), LEAST_OFF * period, 1.5 * quantum)
    return off if off.mean() <= MOST_OFF else np.zeros(len(left), dtype=bool)


def _with_off(clock: Clock, t: Floats) -> Clock:
    """A clock about which stamps ``t`` scatter a little, with those that are wrong by themselves."""
    off = _off(t - clock.even, clock.period, clock.quantum)
    jitter = float(np.std((t - clock.even)[~off]))
    if not off.any() or jitter > LITTLE * clock.period:
        return clock
    return replace(clock, off=off, jitter=jitter)


def _phase(t: Floats, period: float) -> Floats:
    """Phase of the clock at each row [s], shape (n,): circular means over windows, followed from one to the next."""
    level = np.unwrap(np.angle(_turns(t, period)))
    if len(level) > PHASES:
        level = _running_median(level, PHASES)
    level *= period / (2 * np.pi)
    window = _window(t)
    return np.interp(np.arange(len(t)), np.arange(len(level)) * window + 0.5 * (window - 1), level)


def _lost(ticks: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Rows lost before each row, shape (n,), of stamps in ``ticks``; and where they may as well be lost after it."""
    index = np.arange(len(ticks))
    lost: Floats = np.rint(ticks) - index
    sound = np.flatnonzero(np.abs(ticks - np.rint(ticks)) <= ON_TICK)
    if not len(sound):
        return np.maximum.accumulate(lost), np.zeros(len(ticks), dtype=bool)
    if (np.diff(lost[sound]) < 0).any():
        sound = sound[_never_falling(lost[sound])]
    at = np.searchsorted(sound, index, side="right")
    below = lost[sound[np.maximum(at - 1, 0)]]
    above = lost[sound[np.minimum(np.searchsorted(sound, index), len(sound) - 1)]]
    return np.maximum.accumulate(np.clip(lost, below, np.maximum(below, above))), below < above


def _never_falling(values: Floats) -> NDArray[np.int64]:
    """Indices of the longest part of ``values`` that never falls, by patience sorting."""
    ends: list[float] = []
    at: list[int] = []
    before = np.full(len(values), -1)
    for i, value in enumerate(values.tolist()):
        place = bisect_right(ends, value)
        before[i] = at[place - 1] if place else -1
        ends[place : place + 1] = [value]
        at[place : place + 1] = [i]
    chain = [at[-1]]
    while before[chain[-1]] >= 0:
        chain.append(int(before[chain[-1]]))
    return np.array(chain[::-1])


def _turns(t: Floats, period: float) -> NDArray[np.complex128]:
    """Mean of exp(2 pi i t / T) over each window of rows: its size is 1 where they keep one phase."""
    window = _window(t)
    whole = len(t) // window * window
    turns = np.exp(2j * np.pi * np.mod(t[:whole], period) / period).reshape(-1, window).mean(axis=1)
    return np.asarray(turns, dtype=np.complex128)


def _window(t: Floats) -> int:
    """Rows of a window."""
    return max(1, min(WINDOW, len(t) // 8))


def _levelled(t: Floats, ticks: Floats, period: float, quantum: float) -> tuple[Floats, NDArray[np.bool_], float]:
    """Times by the clock of a stretch without long gaps, where its phase leaps, and its period [s].

    One line where the phase keeps to one; else the running median of the phase, which keeps its leaps.
    """
    leaps = np.zeros(len(t), dtype=bool)
    slope, level, straight = _line(ticks, t - period * ticks, quantum)
    if straight:
        return (period + slope) * ticks + level, leaps, period + slope
    phase = t - (period + slope) * ticks - level
    followed = _running_median(phase, FOLLOWED)
    sd = _spread(phase - followed)
    jumps = np.append(0.0, np.diff(followed))
    leaps = np.abs(jumps) > max(LEAP_SD * sd, LEAP * period, 2 * quantum)
    edges = (0, *np.flatnonzero(leaps).tolist(), len(t))
    for a, b in pairwise(edges):
        if b - a > FOLLOWED:
            own, base, straight = _line(ticks[a:b], phase[a:b], quantum)
            followed[a:b] = own * ticks[a:b] + base if straight else followed[a:b]
    # After rows that were lost there is a gap, and nobody takes what lies in it for a step.
    leaps &= np.append(0.0, np.diff(t)) <= GAP * period
    return (period + slope) * ticks + level + followed, leaps, period + slope


def _line(x: Floats, y: Floats, quantum: float) -> tuple[float, float, bool]:
    """Slope and level of a robust line, and whether the means over windows keep to it."""
    window = _window(x)
    whole = len(x) // window * window
    middle = np.median(y[:whole].reshape(-1, window), axis=1)
    centre = np.median(x[:whole].reshape(-1, window), axis=1)
    if len(middle) < 2:
        return 0.0, float(np.median(y)), True
    slope, level = np.polyfit(centre, middle, 1)
    for _ in range(3):
        left = y - slope * x - level
        near = np.abs(left - np.median(left)) <= max(4 * _spread(left), 0.51 * quantum)
        slope, level = np.polyfit(x[near], y[near], 1) if near.sum() > 2 else (slope, level)
    left = y - slope * x - level
    bent = middle - slope * centre - level
    if len(bent) > PHASES:
        bent = _running_median(bent, PHASES)  # a window that a rush of late rows fills bends nothing
    noise = _spread(left) / np.sqrt(window)
    return float(slope), float(level), bool(np.abs(bent).max() <= max(6 * noise, 0.6 * quantum))


def _quantum(t: Floats, period: float) -> float:
    """What stamps are rounded to, by how steps of theirs differ; else what their numbers can tell apart [s]."""
    grain = 4 * float(np.spacing(np.abs(t).max()))
    kinds = np.diff(np.unique(np.diff(t)))
    kinds = kinds[(kinds > grain) & (kinds < COARSEST * period)]
    if not len(kinds):
        return grain
    count = (t - t[0]) / kinds.min()
    whole = np.abs(count - np.rint(count)) < 0.02
    return float(kinds.min()) if whole.mean() > 1 - FEW else grain


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
    quantum = _quantum(t, period)
    straight = all(p.straight for p in pieces)
    return Clock(most.period if most.straight else period, even, jitter, wander, straight, quantum=quantum)


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
    return robust_deviation(x - np.median(x)) if len(x) else 0.0


@dataclass(frozen=True)
class _Piece:
    """A stretch without long gaps: even times, period and wander of its steps; ``straight`` if no row was lost."""

    even: Floats
    period: float
    straight: bool = False
    wander: float = 0.0


def _piece(t: Floats, period: float) -> _Piece:
    n = len(t)
    index, steps = np.arange(n), np.diff(t)
    window = max(1, min(WINDOW, n // 8))
    whole = n // window * window
    phase = np.median((t - period * index)[:whole].reshape(-1, window), axis=1)
    centre = np.median(index[:whole].reshape(-1, window), axis=1)
    slope, level = np.polyfit(centre, phase, 1) if len(phase) > 1 else (0.0, phase[0])
    bent = phase - (slope * centre + level)
    noise = _spread(np.diff(bent))
    far = _spread(bent[FAR:] - bent[:-FAR]) if len(bent) > 2 * FAR else 0.0
    uneven = _Piece(t, period, wander=float(np.std(steps)))
    if far > max(WANDER * period, GROWTH * noise):
        return uneven
    if np.abs(bent).max() <= max(WANDER * period, 4 * noise):
        slope, level = np.polyfit(index, t, 1)
        even = slope * index + level
        if float(np.mean(steps == 0)) <= FEW and _adds_up(t - even, period):
            return uneven
        return _Piece(even, float(slope), straight=True)
    # Rows were lost on the way: the phase leaps, and its running median leaps with it.
    even = period * index + _running_median(t - period * index, 2 * WINDOW + 1)
    return _Piece(even, period)


def _adds_up(left: Floats, period: float) -> bool:
    """Whether stamps, ``left`` [s] from an even clock, shape (n,), walk away from it; rounded ones share their stamps.

    Errors of stamps are as far from each other over a 64th of the rows as over an eighth, and uneven steps, which add
    up, 2.8 times less.
    """
    near, far = (max(len(left) // parts, 1) for parts in (64, 8))
    if not WANDER < float(np.std(left)) / period <= UNEVEN or far <= near:  # what is farther is uneven anyway
        return False
    apart = [float(np.std(left[lag:] - left[:-lag])) for lag in (near, far)]
    return apart[1] > GROWTH * apart[0]


def roughness(t: Floats, angle: Floats) -> float:
    """Median change of the rate between neighbouring steps; infinite where time stands still or there are too few."""
    steps = np.diff(t)
    if len(steps) < 2 or (steps <= 0).any():
        return np.inf
    return float(np.median(np.abs(np.diff(np.diff(angle) / steps))))
