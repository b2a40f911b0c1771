"""Rate tables that follow a list of dwells: the published one, an optimal one, one of low discrepancy.

An action is (rate [rad/s], signal), shape (..., 2): from 0.5 on the run ends, from -0.5 down the gyro is switched off
and on. The time is that of the rows recorded so far. A dwell begins when the table has got to its rate, and lasts at
least as long as it should: what a step is too long by is not taken from the next one, so turns are whole.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from estimators.common.rate_policies import checked_rate
from estimators.common.turns import slack
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import DEG
from insenv.information.ladder import optimal
from insenv.information.ladder_time import Dwells, dwells, published

#: Signals of an action.
GO, STOP, POWER_CYCLE = 0.0, 1.0, -1.0
#: What rounding makes of a time [s].
_ROUNDING = 1e-6
#: By which a dwell is too long, at most, where the time must suffice for whole turns: a step [s].
_STEP = 1.0
#: Repeats of the published test; time at rest before each [s], of which the source says nothing.
REPEATS, PREHEAT = 7, 1800.0
#: Times that a ladder of whole turns is made shorter until it fits.
_TRIES = 10
#: Largest rate of the published test [rad/s].
TOP = 35 * DEG


@dataclass(frozen=True)
class Queue:
    """Entries to be worked off: rate [rad/s], time at that rate [s] and signal as it begins, each (..., m)."""

    rate: Floats
    hold: Floats
    signal: Floats

    def append(self, rate: Any, hold: Any, signal: float = GO) -> Queue:
        """With more entries at the end; single numbers hold for all of them."""
        added = np.broadcast_arrays(np.atleast_1d(np.asarray(rate, float)), hold, signal)
        parts = zip((self.rate, self.hold, self.signal), added, strict=True)
        return Queue(*(np.concatenate([old, new], axis=-1) for old, new in parts))


EMPTY = Queue(np.empty(0), np.empty(0), np.empty(0))


@dataclass(frozen=True)
class QueuePlace:
    """How far a queue is: the entry, when it was commanded and when the table has its rate [s], each (...)."""

    entry: NDArray[np.int64]
    began: Floats
    steady: Floats


def started(queue: Queue, acceleration: float, batch: int | None) -> QueuePlace:
    """At the first entry of a queue, from rest, at time 0."""
    front = () if batch is None else (batch,)
    steady = np.abs(queue.rate[..., 0]) / acceleration
    return QueuePlace(np.zeros(front, np.int64), np.zeros(front), np.broadcast_to(steady, front).copy())


def over(place: QueuePlace, queue: Queue, t: float) -> NDArray[np.bool_]:
    """Whether the entry is done at time ``t``, shape (...); the last one never is."""
    waited = t + _ROUNDING >= place.steady + _at(queue.hold, place.entry)
    return np.asarray(waited & (place.entry < queue.rate.shape[-1] - 1))


def moved(place: QueuePlace, queue: Queue, t: float, acceleration: float) -> QueuePlace:
    """At time ``t``: the next entry where one is done."""
    return gone_on(place, queue, over(place, queue, t), t, acceleration)


def gone_on(place: QueuePlace, queue: Queue, done: NDArray[np.bool_], t: float, acceleration: float) -> QueuePlace:
    """At time ``t``: the next entry where one is ``done``, shape (...)."""
    rate = _at(queue.rate, place.entry)
    entry = place.entry + done
    steady = t + np.abs(_at(queue.rate, entry) - rate) / acceleration
    return QueuePlace(entry, np.where(done, t, place.began), np.where(done, steady, place.steady))


def action(place: QueuePlace, queue: Queue, t: float) -> Floats:
    """Rate of the entry that is under way, and its signal as it begins; a stop holds on.  Shape (..., 2)."""
    signal = _at(queue.signal, place.entry)
    signal = np.where((place.began >= t) | (signal >= STOP), signal, GO)
    return np.stack([_at(queue.rate, place.entry), signal], axis=-1)


def time_of(chunk: Recording | None) -> float:
    """Time of the last row [s]; before any it is 0."""
    return 0.0 if chunk is None or not len(chunk) else float(chunk.t[-1])


class Ladder:
    """A policy that works off one queue, whatever is measured.

    Raises
    ------
    InputError
        If the table has not the rate of an entry.
    """

    def __init__(self, datasheet: Datasheet, queue: Queue) -> None:
        for rate in queue.rate:
            checked_rate(datasheet, float(rate))
        #: All entries; the last one stops the run.
        self.queue = queue.append(0.0, np.inf, STOP)
        self.acceleration = datasheet.limits.acceleration

    @property
    def duration(self) -> float:
        """Of all entries where a step is short [s]."""
        settling = np.abs(np.diff(self.queue.rate[:-1], prepend=0.0)) / self.acceleration
        return float(self.queue.hold[:-1].sum() + settling.sum())

    def reset(self, batch: int | None = None) -> QueuePlace:
        """The first entry."""
        return started(self.queue, self.acceleration, batch)

    def act(
        self, state: QueuePlace, chunk: Recording | None, estimate: Estimate | None = None
    ) -> tuple[Floats, QueuePlace]:
        """Rate and signal of the entry that is under way, shape (..., 2)."""
        t = time_of(chunk)
        state = gone_on(state, self.queue, self._done(state, t), t, self.acceleration)
        return action(state, self.queue, t), state

    def _done(self, place: QueuePlace, t: float) -> NDArray[np.bool_]:
        """Whether the entry is over."""
        return over(place, self.queue, t)


@final
class PublishedLadder(Ladder):
    """The published test: 36 rates, a turn each, and again after each time that the gyro was off.

    Parameters
    ----------
    datasheet : Datasheet
    repeats : int, optional
        Default: seven, or as many as there is time for, one at least.
    turns : int
        At each rate.
    preheat : float, optional
        Time at rest after the gyro was switched on [s]; default: half an hour, or as much as one repeat leaves of the
        time.
    rest : float
        Time of the entries at zero, and so of the static means at start and end [s].

    Raises
    ------
    InputError
        If there is no repeat or no turn, a time is negative, or the table has not the rates.
    """

    def __init__(
        self,
        datasheet: Datasheet,
        repeats: int | None = None,
        turns: int = 1,
        preheat: float | None = None,
        rest: float = 60.0,
    ) -> None:
        if (repeats is not None and repeats < 1) or turns < 1 or (preheat or 0.0) < 0 or not rest > 0:
            shown = "default" if preheat is None else f"{preheat:g} s"
            raise InputError(
                f"published_ladder: {repeats} repeats of {turns} turns, preheat {shown}, rest {rest:g} s given; "
                "wanted one or more of each, and times that are not negative"
            )
        listed, queue = whole(published(turns, rest), slack(datasheet)), EMPTY
        once = listed.duration(datasheet.limits.acceleration) + _STEP * (len(listed.rate) + 2)
        if preheat is None:
            preheat = float(np.clip(datasheet.duration - once, 0.0, PREHEAT))
        if repeats is None:
            repeats = int(np.clip(datasheet.duration / (once + preheat), 1, REPEATS))
        for k in range(repeats):
            if preheat or k:
                queue = queue.append(0.0, preheat, POWER_CYCLE if k else GO)
            queue = queue.append(listed.rate, listed.time)
        super().__init__(datasheet, queue)


@final
class OptimalLadder(Ladder):
    """A design that is optimal for a model, in rounds that fall and rise in turn.

    Parameters
    ----------
    datasheet : Datasheet
    model : str
        "line", "cubic", "quintic" or "asymmetry".
    criterion : str
        "c": least variance of the scale factor, "d": smallest ellipsoid of all coefficients.
    duration : float, optional
        Of the test [s]; default: the time that there is, after the preheating. Kept to a step, for each dwell ends
        by the clock; whole turns may take longer where it is given.
    top : float, optional
        Largest rate [rad/s]; default: that of the published test, as far as the table has it.
    visits : int
        Rounds.
    whole_turns : bool
        Round dwells to whole turns.
    zero : float
        Time at rest before each round and after the last [s]: for a gyro that drifts.
    preheat : float
        Time at rest at first [s].

    Raises
    ------
    InputError
        If there is no such design, or no time for it.
    """

    def __init__(  # noqa: PLR0913 - settings, each with its default
        self,
        datasheet: Datasheet,
        model: str = "line",
        criterion: str = "c",
        duration: float | None = None,
        *,
        top: float | None = None,
        visits: int = 8,
        whole_turns: bool = False,
        zero: float = 0.0,
        preheat: float = 0.0,
    ) -> None:
        self.design = optimal(model, criterion, top_rate(datasheet, top))
        most = datasheet.duration - preheat if duration is None else duration
        span, accelerated = most, datasheet.limits.acceleration
        listed = dwells(self.design, span, accelerated, visits, whole_turns=whole_turns, zero=zero)
        if whole_turns:
            # Rounded up, and too long by a step each: what they take too much of the time they shall not have.
            for _ in range(_TRIES):
                late = listed.duration(accelerated) + _STEP * (len(listed.rate) + 2) - most
                if duration is not None or late <= 0:
                    break
                span -= late
                listed = dwells(self.design, span, accelerated, visits, whole_turns=True, zero=zero)
            listed = whole(listed, slack(datasheet))
        queue = EMPTY.append(0.0, preheat) if preheat else EMPTY
        super().__init__(datasheet, queue.append(listed.rate, listed.time))
        settling = np.abs(np.diff(self.queue.rate, prepend=0.0)) / self.acceleration
        self._ends = None if whole_turns else np.cumsum(settling + self.queue.hold)

    def _done(self, place: QueuePlace, t: float) -> NDArray[np.bool_]:
        """By the clock, so that the time of all dwells is kept, unless each has to have its turns."""
        if self._ends is None:
            return super()._done(place, t)
        return np.asarray(t + _ROUNDING >= self._ends[place.entry])


@final
class VanDerCorput(Ladder):
    """Rates of low discrepancy (van der Corput, base 2), in alternating sense; the largest rates come first.

    Whatever the width of a fault is, the largest gap between the rates shrinks as fast as it can.

    Parameters
    ----------
    datasheet : Datasheet
    settings : int
        Number of rates.
    dwell : float
        At each [s].
    low, top : float, optional
        Between which they lie [rad/s]; default: zero and the largest of the published test.

    Raises
    ------
    InputError
        If there is no rate or no dwell, or the table has not the rates.
    """

    def __init__(
        self, datasheet: Datasheet, settings: int = 70, dwell: float = 10.0, low: float = 0.0, top: float | None = None
    ) -> None:
        if settings < 1 or not dwell > 0:
            raise InputError(f"van_der_corput: {settings} settings of {dwell:g} s given, wanted one or more")
        high = top_rate(datasheet, top)
        magnitude = [high, high, *(low + (high - low) * radical_inverse(k) for k in range(1, settings - 1))]
        sign = np.where(np.arange(settings) % 2, -1.0, 1.0)
        super().__init__(datasheet, EMPTY.append(sign * np.array(magnitude[:settings]), dwell))


def radical_inverse(k: int) -> float:
    """The bits of ``k`` mirrored at the point: 1/2, 1/4, 3/4, 1/8 ... for 1, 2, 3, 4 ..."""
    value, bit = 0.0, 0.5
    while k:
        value += bit * (k & 1)
        k, bit = k >> 1, bit / 2
    return value


def top_rate(datasheet: Datasheet, top: float | None) -> float:
    """The largest rate of a test [rad/s]: as asked for, or that of the published test, as far as the table has it."""
    return min(TOP, datasheet.limits.rate) if top is None else abs(checked_rate(datasheet, top))


def whole(listed: Dwells, slack: float) -> Dwells:
    """Dwells that are a little longer, so that whoever counts turns by a noisy encoder finds them whole."""
    turning = listed.rate != 0
    longer = np.where(turning, slack / np.where(turning, np.abs(listed.rate), 1.0), 0.0)
    return replace(listed, time=listed.time + longer)


def _at(values: Floats, entry: NDArray[np.int64]) -> Floats:
    """``values`` (..., m) at ``entry`` (...)."""
    if values.ndim == 1:
        return values[entry]
    taken: Floats = np.take_along_axis(values, entry[..., None], axis=-1)[..., 0]
    return taken
