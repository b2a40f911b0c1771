"""When the rows of a file were taken: its time stamps, checked, and mended where they only jitter about a clock.

Increments become mean rates over the time that they cover: the period of the clock, or each row's own step where the
sampler itself is uneven by a little and the table's angle says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from insenv.core.errors import InputError
from insenv.core.recording import GAP, Floats
from insenv.core.series.rounding import counter_step
from insenv.data.clock import NEGLIGIBLE, WINDOW, Clock, clock_of, roughness

Mask = NDArray[np.bool_]

#: Stamps no further off the clock than this many quanta are rounded, or cut off, and nothing else.
ROUNDED = 1.01

#: Stamps no further off the rows' mean rate than this [s], and than this share of the run, do for a unit at rest.
AWAY, SHARE_AWAY = 1.0, 0.01

#: Rows that follow each other within this share of a period, this many and more, stand at one instant; share of the
#: rows beyond which that is how they are written.
AT_ONCE, SEVERAL, MOST_AT_ONCE = 0.1, 3, 0.2

#: Share of the stamps that may run backwards, each by less than a median step.
FEW_BACK = 0.01

#: Share of the mean step below which the usual one is none.
SAME_STAMP = 0.01

#: Share of the steps from which on pauses are those between packets.
OFTEN = 0.01
#: Share of its roughness by the stamps that the angle of a table has at most by the clock, where means were asked for;
#: and by the clock that it has at most by the stamps, where these are taken. An encoder's steps hide which is right:
#: rates by stamps that are wrong by s of a period are 1 + 2 s^2 too large, and those by the clock are true in the mean.
SMOOTHER = 0.8
#: Stamps and steps that are a power of a thousand times those before: so nearly; of so many rows on either side, and at
#: least so many. A median of few steps of a logger that is late now and then may be off by half.
SAME_UNIT, SAME_STEP, AROUND, FEWEST_AROUND = 0.02, 0.3, 64, 3
#: Nineteen of twenty steps of a loop are shorter than so many times those that nineteen of twenty are longer than.
ALIKE = 30.0
#: Steps from the last stamp of a counter to the first one after it began anew, at most; more, and it was set.
FEW_STEPS = 10.0
#: Seconds that are counted from so long ago that their rounding is more than this share of a period count from row 0.
COARSE = 1e-9


class UnevenError(InputError):
    """Rows of a run follow no clock; ``rate`` [Hz] is one at which nearly every mean holds two of them.

    ``alike`` says that a loop wrote them, if a slow one now and then: what is written when something happens has steps
    of any length, and its means are not what an instrument reads all the time.
    """

    def __init__(self, path: Path, t: Floats) -> None:
        low, middle, high = np.quantile(np.diff(t), (0.05, 0.5, 0.95))
        self.rate = 0.5 / max(high, 1e-300)
        self.alike = bool(high < ALIKE * low)
        self._found = f"{path}: not evenly sampled (steps of {low:.3g} to {high:.3g} s, {middle:.3g} s in the median"
        super().__init__(self.proposing(self.rate))

    def proposing(self, rate: float) -> str:
        """The sentence, with a round rate of ``rate`` or less that would do."""
        rate = round_rate(rate)
        example = f'fit.resample = "{rate:g} Hz" for means over {1 / rate:g} s'
        return f"{self._found}, about no even clock); wanted even steps, or {example}"


def round_rate(rate: float) -> float:
    """The largest of 1, 2, 5, 10, ... that is no more than ``rate``."""
    nice = 10.0 ** np.floor(np.log10(rate))
    return float(nice * max(m for m in (1, 2, 5) if m * nice <= rate * (1 + 1e-9)))


@dataclass(frozen=True)
class Sampling:
    """When the rows were taken.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Times [s].
    covered : float or ndarray, shape (n,)
        Time that each row covers [s].
    notes : tuple of str
        What was done, in words.
    doubtful : ndarray of bool, shape (n,)
        Rows of which nobody knows what time they cover: no instrument is read there.
    angle : ndarray, shape (n,), optional
        The table's angle where it had to be read anew, at the times ``t``.
    """

    t: Floats
    covered: float | Floats
    notes: tuple[str, ...] = ()
    doubtful: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    angle: Floats | None = None


def sampling(path: Path, t: Floats, place: Callable[[int], str], angle: Floats | None) -> Sampling:
    """Sampling of a run with stamps ``t``, shape (n,) [s]; ``angle`` of its table, shape (n,), where there is one.

    Stamps that are wrong by themselves get the time of the clock that the others keep.

    Raises
    ------
    InputError
        If time runs backwards or stands still, or if there is no clock behind the stamps.
    """
    check_forwards(path, t, place)
    grain = float(np.spacing(np.abs(t).max()))
    clock = clock_of(t - t[0])
    if not clock.steady:
        raise UnevenError(path, t)
    origin = 0.0 if grain < COARSE * clock.period else float(t[0])
    taken = _mended(path, t - origin, t[0] - origin, replace(clock, quantum=max(clock.quantum, grain)), place, angle)
    if (np.diff(taken.t) <= 0).any() and (np.diff(t) > 0).all():
        raise UnevenError(path, t)  # some stamps and the clock of the others do not go together
    return replace(taken, t=increasing(path, taken.t, place))


def nearly_forwards(t: Floats, place: Callable[[int], str]) -> tuple[Floats, tuple[str, ...]]:
    """Stamps of which a few run backwards by less than a step, shape (n,) [s], with none that does; what was done.

    Two threads of a logger, or a clock that is disciplined, write one row a little before the one before it. Such rows
    share the time between the latest stamp before them and the next one after it; a clock of the others tells better.
    """
    steps = np.diff(t)
    back = steps < 0
    if not back.any() or back.mean() > FEW_BACK or not -steps.min() < float(np.median(steps)):
        return t, ()
    count, first = int(back.sum()), place(int(np.argmax(back)) + 1)
    which = (
        f"1 time stamp runs backwards, at {first}"
        if count == 1
        else f"{count} time stamps run backwards, first at {first}"
    )
    row, late = np.arange(len(t)), np.maximum.accumulate(t) > t
    return np.interp(row, row[~late], t[~late]), (f"{which}, by up to {-steps.min():.2g} s: taken for late ones",)


def after_rollovers(t: Floats, count: float, place: Callable[[int], str]) -> tuple[Floats, tuple[str, ...]]:
    """Stamps of a counter that begins anew at its end, shape (n,) [s], made to go on; what was done.

    The end of 16, 24 or 32 bits of one ``count`` [s], of a day or of a week: where the stamps fall by just that, less
    a few steps, every time. Any other fall is left as it is.
    """
    steps = np.diff(t)
    back = steps < 0
    if not back.any() or not (steps > 0).any():
        return t, ()
    usual, count_of = float(np.median(steps[steps > 0])), {f"{n} bits": 2.0**n * count for n in (16, 24, 32)}
    for name, whole in {**count_of, "a day": 86_400.0, "a week": 604_800.0}.items():
        between = steps[back] + whole
        if whole > FEW_STEPS * usual and np.all((between > 0) & (between < FEW_STEPS * usual)):
            first = place(int(np.argmax(back)) + 1)
            times = "" if back.sum() == 1 else f" {int(back.sum())} times, first"
            note = f"time begins anew{times} at {first}, after {name} ({whole:.10g} s): made to go on"
            return t + whole * np.append(0, np.cumsum(back)), (note,)
    return t, ()


def in_packets(t: Floats) -> bool:
    """Whether rows came in packets: most steps are nearly none beside the mean one, and pauses are no rare gaps."""
    steps = np.diff(t)
    mean = float(steps.mean()) if len(steps) else 0.0
    return mean > 0 and float(np.median(steps)) < AT_ONCE * mean and float(np.mean(steps > mean)) > OFTEN


def at_one_stamp(t: Floats) -> bool:
    """Whether most rows have the stamp of others; a sensor that is heard now and then has stamps of its own."""
    steps = np.diff(t)
    return float(np.median(steps)) < SAME_STAMP * float(steps.mean())


def at_mean_rate(path: Path, t: Floats, place: Callable[[int], str]) -> Sampling | None:
    """Sampling of a unit at rest whose stamps, shape (n,) [s], follow no clock; None where they follow no mean rate.

    A logger that writes a dozen rows at once stamps them all within 2 ms, then pauses. At rest nothing depends on when
    within the second a row was taken: rows follow each other at their mean rate.

    Raises
    ------
    InputError
        If time runs backwards or stands still.
    """
    check_forwards(path, t, place)
    row = np.arange(len(t), dtype=float)
    period = float(np.polyfit(row, t - t[0], 1)[0])
    even = period * row
    even += float(np.median(t - even))
    away = float(np.abs(t - even).max())
    if not period > 0 or away > min(AWAY, SHARE_AWAY * float(t[-1] - t[0])):
        return None
    low, high = np.quantile(np.diff(t), (0.05, 0.95))
    found = f"steps of {low:.3g} to {high:.3g} s, about no even clock: at rest"
    text = f"{found}, rows are taken to follow each other at their mean rate of {1 / period:.6g} Hz"
    return Sampling(even, period, (f"{text}, up to {away:.2g} s off their stamps",))


def by_the_clock(t: Floats, angle: Floats | None) -> tuple[Floats, tuple[str, ...]] | None:
    """Times of rows that are to be made means, shape (n,) [s], and what was done; None where the stamps stand.

    Rows that a link brings two by two have stamps half a period early and late about an even clock. That the clock is
    right, and no stamp, the table's ``angle`` says: it is smoother by it.
    """
    clock = clock_of(t - t[0])
    even = clock.even + t[0]
    if angle is None or not clock.steady or clock.jitter < NEGLIGIBLE * clock.period or (np.diff(even) <= 0).any():
        return None
    own = np.arange(len(t)) if (np.diff(t) > 0).all() else np.unique(t, return_index=True)[1]
    if not roughness(even[own], angle[own]) < SMOOTHER * roughness(t[own], angle[own]):
        return None
    return even, (_jitters(clock),)


def _mended(  # noqa: PLR0913 -- what the file has, and its clock
    path: Path, t: Floats, start: float, clock: Clock, place: Callable[[int], str], angle: Floats | None
) -> Sampling:
    """The times to take, of stamps ``t`` about a clock that counts from ``start``."""
    even = clock.even + start
    off = clock.off if len(clock.off) else np.zeros(len(t), dtype=bool)
    leaps = clock.leaps if len(clock.leaps) else np.zeros(len(t), dtype=bool)
    doubtful = leaps | clock.unsure if len(clock.unsure) else leaps
    notes = _remarks(off, leaps, t - even, place)
    stamps = np.where(off, even, t)
    rounded = bool(np.abs(stamps - even).max() <= ROUNDED * clock.quantum)
    if clock.jitter < NEGLIGIBLE * clock.period:
        # Seconds since 1970 are good to 0.2 us: of a table that turns by 60 deg/s that is 5 deg/h at 100 Hz.
        chosen = even if rounded or (angle is not None and not _confirmed(stamps, even, angle)) else stamps
        late, read = _taken_late(t, chosen, off, angle)
        return Sampling(chosen, clock.period, notes, doubtful | late, read)
    pressed = _at_one_instant(t, clock.period)
    # Rows at one instant are the recorder's: its stamps need not be much smoother to be the angle's own.
    if angle is not None and not rounded and _confirmed(stamps, even, angle, 1.0 if pressed.any() else SMOOTHER):
        text = f"sampled unevenly, by {_share(clock)} of the period (one sigma) as the table's angle confirms"
        said = [f"{text}: each row is taken for the mean over its own step"]
        if pressed.any():
            said.append(f"{int(pressed.sum())} rows stand at one instant with others, or beside them: left out")
        if off.any() and (np.diff(stamps) > 0).all() and not _taken_late(t, stamps, off, angle)[0].any():
            # A stamp that came late is none of its row, whose own instant is known to the jitter alone.
            return Sampling(stamps, own_steps(stamps, clock.period), (*said, *notes), pressed | _and_next(off))
        return Sampling(t, own_steps(t, clock.period), tuple(said), pressed)
    return Sampling(even, clock.period, (_jitters(clock), *notes), doubtful)


def _confirmed(stamps: Floats, even: Floats, angle: Floats, share: float = SMOOTHER) -> bool:
    """Whether the angle of a table is smoother by the stamps than by the clock, by more than noise makes it.

    Of an angle in steps most changes are none or one by the clock, and any by the stamps, which the median takes for
    smoother: steps are blurred first.
    """
    blur = np.random.default_rng(0).uniform(-0.5, 0.5, len(angle))
    blurred = angle + counter_step(angle) * blur
    return roughness(stamps, blurred) < share * roughness(even, blurred)


def _jitters(clock: Clock) -> str:
    text = f"time stamps jitter by {_share(clock)} of the period (one sigma) about an even clock of"
    if clock.packet > 1:
        text = f"rows come in packets of {clock.packet}, about an even clock of"
    return f"{text} {1 / clock.period:.6g} Hz: its times are taken"


def _remarks(off: Mask, leaps: Mask, left: Floats, place: Callable[[int], str]) -> tuple[str, ...]:
    """What was found wrong with single stamps, in words."""
    found = []
    if off.any():
        first, sizes = int(np.argmax(off)), np.abs(left[off])
        span = f"{sizes.max():.3g} s" if off.sum() == 1 else f"{sizes.min():.3g} to {sizes.max():.3g} s"
        count = "1 time stamp is" if off.sum() == 1 else f"{int(off.sum())} time stamps are"
        it = "it" if off.sum() == 1 else "them"
        where = f" at {place(first)}" if off.sum() == 1 else ""
        at = "" if off.sum() == 1 else f", the first at {place(first)}"
        found.append(f"{count} off the clock{where} by {span}{at}: the clock's time is taken for {it}")
    return (*found, *_leapt(leaps, place))


def _leapt(leaps: Mask, place: Callable[[int], str]) -> tuple[str, ...]:
    """What rows at another phase of the clock say: it was set, or stamps go to and fro, which no clock is set to do."""
    if not leaps.any():
        return ()
    rows = np.flatnonzero(leaps)
    stretches = np.split(rows, np.flatnonzero(np.diff(rows) > WINDOW) + 1)
    once = [int(one[0]) for one in stretches if len(one) == 1]
    swaying = [one for one in stretches if len(one) > 1]
    found = []
    if once:
        times = "once" if len(once) == 1 else f"{len(once)} times, first"
        found.append(f"the clock was set {times} at {place(once[0])}: a row there is left out")
    if swaying:
        where = "in one stretch" if len(swaying) == 1 else f"in {len(swaying)} stretches, the first"
        count = sum(map(len, swaying))
        found.append(
            f"stamps go to and fro about the clock {where} from {place(int(swaying[0][0]))}: {count} rows there are "
            "left out"
        )
    return tuple(found)


def _at_one_instant(t: Floats, period: float) -> Mask:
    """Rows that are stamped at one instant, and the rows beside them, shape (n,).

    A recorder that lets no time run backwards presses rows together until a clock that was set back has caught up: when
    they were taken nobody knows, and the row after them has all of their motion in its step.
    """
    from scipy.ndimage import binary_dilation, binary_opening  # slow to import

    short = binary_opening(np.diff(t) < AT_ONCE * period, np.ones(SEVERAL - 1))
    rows = np.append(False, short) | np.append(short, False)
    pressed = np.asarray(binary_dilation(rows, np.ones(3)))
    return pressed if pressed.mean() <= MOST_AT_ONCE else np.zeros(len(t), dtype=bool)


def _taken_late(t: Floats, chosen: Floats, off: Mask, angle: Floats | None) -> tuple[Mask, Floats | None]:
    """Rows to leave out where the table's angle says that the sampler was late, not its stamp; the angle in time."""
    late = np.zeros(len(t), dtype=bool)
    rows = np.flatnonzero(off)
    if angle is None or not len(rows):
        return late, None
    sound = ~off
    by_clock = np.abs(angle[rows] - np.interp(chosen[rows], chosen[sound], angle[sound]))
    by_stamp = np.abs(angle[rows] - np.interp(t[rows], chosen[sound], angle[sound]))
    if not np.median(by_stamp) < 0.5 * np.median(by_clock):
        return late, None
    read = angle.copy()
    read[rows] = np.interp(chosen[rows], chosen[sound], angle[sound])
    return _and_next(off), read


def _and_next(rows: Mask) -> Mask:
    """Those rows and the ones after them, shape (n,)."""
    return rows | np.append(False, rows[:-1])


def check_forwards(path: Path, t: Floats, place: Callable[[int], str]) -> None:
    """Refuse time of one row, time that runs backwards, and time that stands still throughout."""
    if len(t) < 2:
        raise InputError(f"{path}: has {len(t)} row of data; wanted at least 2")
    steps = np.diff(t)
    if (steps < 0).any() or t[-1] == t[0]:
        row = int(np.argmax(steps < 0)) + 1
        _refuse(path, t, row, place)


def check_one_unit(path: Path, t: Floats, place: Callable[[int], str]) -> None:
    """Refuse stamps, shape (n,) [s], that from one row on count in a unit a thousand times smaller or larger, or more.

    From there on both the stamps and their steps are so many times what they were: 29.99, 30.00, 30010, 30020. A gap
    raises no steps, and a slower logger does not multiply the time that has passed.
    """
    next_one = t[:-1] + np.diff(t, prepend=t[0])[:-1]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        share = t[1:] / next_one
        factor = 1000.0 ** np.clip(np.rint(np.log10(share) / 3), -3, 3)
        leaps = (factor != 1) & (np.abs(share / factor - 1) < SAME_UNIT)
    for row in np.flatnonzero(leaps) + 1:
        old, new = np.diff(t[max(0, row - AROUND) : row]), np.diff(t[row : row + AROUND])
        if min(len(old), len(new)) < FEWEST_AROUND or not np.median(old) > 0:
            continue
        was, now, times = float(np.median(old)), float(np.median(new)), float(factor[row - 1])
        if abs(now / was / times - 1) < SAME_STEP:
            unit = f"{max(times, 1 / times):g} times {'smaller' if times > 1 else 'larger'}"
            raise InputError(
                f"{path}: {place(int(row))}: time goes on in a unit {unit} ({t[row]:.15g} s after {t[row - 1]:.15g} s, "
                f"then steps of {now:.4g} s after those of {was:.4g} s); wanted one unit in the whole file"
            )


def increasing(path: Path, t: Floats, place: Callable[[int], str]) -> Floats:
    """The times, refused where they do not increase."""
    still = np.diff(t) <= 0
    if still.any():
        _refuse(path, t, int(np.argmax(still)) + 1, place)
    return t


def _refuse(path: Path, t: Floats, row: int, place: Callable[[int], str]) -> None:
    verb = "stands still" if t[row] == t[row - 1] else "runs backwards"
    found = f"{t[row]:.15g} s after {t[row - 1]:.15g} s"
    raise InputError(f"{path}: {place(row)}: time {verb} ({found}); wanted time that increases")


def own_steps(t: Floats, period: float) -> Floats:
    """Time that each row covers [s]: its step; ``period`` after a gap and for the first row."""
    steps = np.append(period, np.diff(t))
    return np.where(steps <= GAP * period, steps, period)


def _share(clock: Clock) -> str:
    return f"{100 * clock.jitter / clock.period:.2g} %"
