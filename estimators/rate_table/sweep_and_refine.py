"""A rate test that looks: a slow sweep against the encoder, then what stood out again, then the rates of most leverage.

1.  The sweep falls from the largest rate to its opposite in steps of twice the spacing, and rises again on the steps in
    between: each magnitude is run both ways, and a drift is told from a scale factor.
2.  What is louder than `suspect` standard deviations (`rate_ladder_residual`) is run again: five rates around it, both
    ways. It is an alarm where one of these repeats, on its own, is louder than `confirm`.
3.  The rates of an optimal design, away from all that is suspect: a design never looks for what its model excludes.

A command lasts for a step, so a sweep is a staircase; the spacing is what bounds the width of a fault that is found.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from estimators.rate_table import rate_ladder_tally as tallies
from estimators.rate_table.rate_ladder import (
    EMPTY,
    STOP,
    Queue,
    QueuePlace,
    action,
    moved,
    over,
    started,
    time_of,
    top_rate,
)
from estimators.rate_table.rate_ladder_residual import BellFault, fault, groups, line, loudness, smooth
from estimators.rate_table.rate_ladder_tally import Tally
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import DEG
from insenv.information.ladder import LadderDesign, optimal
from insenv.information.ladder_time import Dwells, dwells

#: Suspects that are run again, at most; the rates around each, in spacings.
MOST, AROUND = 3, (-1.0, -0.5, 0.0, 0.5, 1.0)
#: Entries of one suspect.
_EACH = 2 * len(AROUND)
#: A rate of leverage stays this many spacings away from a suspect.
_AWAY = 3.0


@dataclass(frozen=True)
class Swept:
    """State of a test.

    Attributes
    ----------
    queue : Queue, shape (..., m)
    place : QueuePlace
    tally : Tally, shape (..., m)
    suspects : ndarray, shape (..., MOST)
        Magnitudes that stood out [rad/s]; NaN: no more.
    planned : ndarray of bool, shape (...)
        Whether the sweep is over, and the rest of the queue is there.
    """

    queue: Queue
    place: QueuePlace
    tally: Tally
    suspects: Floats
    planned: NDArray[np.bool_]


@final
class SweepAndRefine:
    """Sweep, refine, leverage.

    Parameters
    ----------
    datasheet : Datasheet
    spacing : float
        Of the magnitudes that are run [rad/s].
    dwell : float
        At each of them, the table's settling included [s]; all times are rounded up to multiples of it.
    leverage : float
        Time for the rates of most leverage [s], in ``visits`` rounds, or fewer where the table is slow.
    visits : int
    model : str
        Whose D-optimal rates these are: "line", "cubic", "quintic" or "asymmetry".
    suspect, confirm : float
        Thresholds [standard deviations].
    floor : float
        Error of each setting of the table [rad/s].
    top : float, optional
        Largest rate [rad/s]; default: that of the published test, as far as the table has it.
    preheat : float
        Time at rest at first [s], which is not judged.

    Raises
    ------
    InputError
        If a spacing or a time is not positive, or the table has not the rate.
    """

    def __init__(  # noqa: PLR0913 - settings, each with its default
        self,
        datasheet: Datasheet,
        spacing: float = 0.35 * DEG,
        dwell: float = 1.0,
        *,
        leverage: float = 160.0,
        visits: int = 12,
        model: str = "line",
        suspect: float = 4.0,
        confirm: float = 4.5,
        floor: float = 0.0,
        top: float | None = None,
        preheat: float = 0.0,
    ) -> None:
        if not (spacing > 0 and dwell > 0 and leverage > 0 and visits > 0):
            raise InputError(
                f"sweep_and_refine: spacing {spacing / DEG:g} deg/s, dwell {dwell:g} s, leverage {leverage:g} s, "
                f"{visits} visits given, wanted positive ones"
            )
        self.datasheet, self.dwell = datasheet, dwell
        self.suspect, self.confirm, self.floor = suspect, confirm, floor
        self.acceleration = datasheet.limits.acceleration
        self.top = top_rate(datasheet, top)
        steps = max(int(np.ceil(self.top / spacing)), 2)
        self.spacing = self.top / steps
        self.design = optimal(model, "d", self.top)
        self.leverage = _visited(self.design, leverage, self.acceleration, visits)
        falling = self.spacing * np.arange(steps, -steps - 1, -2)
        rising = self.spacing * np.arange(1 - steps, steps, 2)
        slots = self._slots(np.concatenate([falling, rising]), np.zeros(2 * steps + 1), 0.0)
        self._rests = int(preheat > 0)
        self._sweep = EMPTY.append(np.zeros(self._rests), preheat).append(slots.rate, slots.hold)

    def reset(self, batch: int | None = None) -> Swept:
        """The sweep, and room for what comes after it."""
        front = () if batch is None else (batch,)
        room = MOST * _EACH + len(self.leverage.rate) + 1
        queue = self._sweep.append(np.zeros(room), np.inf, STOP)
        queue = Queue(*(np.broadcast_to(a, (*front, len(a))).copy() for a in (queue.rate, queue.hold, queue.signal)))
        return Swept(
            queue,
            started(queue, self.acceleration, batch),
            tallies.empty(queue.rate.shape[-1], batch),
            np.full((*front, MOST), np.nan),
            np.zeros(front, bool),
        )

    def act(self, state: Swept, chunk: Recording | None, estimate: Estimate | None = None) -> tuple[Floats, Swept]:
        """Rate and signal of the entry that is under way, shape (..., 2)."""
        t = time_of(chunk)
        if chunk is not None and len(chunk):
            state = replace(state, tally=tallies.added(state.tally, chunk, state.place, self.datasheet))
        ended = over(state.place, state.queue, t) & (state.place.entry == len(self._sweep.rate) - 1)
        if np.any(ended & ~state.planned):
            state = self._planned(state, ended & ~state.planned)
        place = moved(state.place, state.queue, t, self.acceleration)
        return action(place, state.queue, t), replace(state, place=place)

    def alarms(self, state: Swept) -> list[list[BellFault]]:
        """Local faults that were confirmed, for each run (one list for a single run)."""
        return [self._confirmed(state, at) for at in np.ndindex(state.place.entry.shape)]

    def scale_factor(self, state: Swept) -> tuple[Floats, Floats]:
        """Relative error and its standard deviation, each (...): a line through all that no alarm is near to."""
        found = np.empty((*state.place.entry.shape, 2))
        for at in np.ndindex(state.place.entry.shape):
            rate, residual, middle, variance = self._means(state, at)
            for local in self._confirmed(state, at):
                near = np.abs(np.abs(rate) - local.centre) < max(4 * local.width, 2 * self.spacing)
                variance = np.where(near, np.inf, variance)
            found[at] = line(rate, residual, middle, variance, self.top)
        return found[..., 0], found[..., 1]

    def _slots(self, rate: Floats, hold: Floats, before: float) -> Queue:
        """Entries that fill whole multiples of the dwell, half of one at least at the rate itself."""
        settling = np.abs(np.diff(rate, prepend=before)) / self.acceleration
        slots = np.maximum(np.ceil((settling + np.maximum(hold, 0.5 * self.dwell)) / self.dwell - 1e-9), 1.0)
        return EMPTY.append(rate, slots * self.dwell - settling)

    def _means(self, state: Swept, at: tuple[int, ...]) -> tuple[Floats, Floats, Floats, Floats]:
        """Rate, residual, time and variance of each entry of one run; the variance is infinite for one not run."""
        tally = state.tally
        time = np.where(np.arange(tally.time.shape[-1]) < self._rests, 0.0, tally.time[at])
        return (
            np.nan_to_num(tally.rate[at]),
            np.nan_to_num(tally.residual[at]),
            np.nan_to_num(tally.middle[at]),
            tallies.variance(time, self.datasheet, self.floor),
        )

    def _planned(self, state: Swept, ended: NDArray[np.bool_]) -> Swept:
        """With the rest of the queue for the runs whose sweep has ended."""
        queue = Queue(*(a.copy() for a in (state.queue.rate, state.queue.hold, state.queue.signal)))
        suspects, first = state.suspects.copy(), len(self._sweep.rate)
        for at in np.ndindex(ended.shape):
            if not ended[at]:
                continue
            heard = groups(queue.rate[at][:first], self._loudness(state, at)[:first], self.suspect, *self._grouping)
            suspects[at][: len(heard)] = heard
            rest = self._rest(heard, float(queue.rate[at][first - 1])).append(0.0, np.inf, STOP)
            part = slice(first, first + len(rest.rate))
            queue.rate[at][part], queue.hold[at][part], queue.signal[at][part] = rest.rate, rest.hold, rest.signal
        return replace(state, queue=queue, suspects=suspects, planned=state.planned | ended)

    @property
    def _grouping(self) -> tuple[float, int]:
        return 2.5 * self.spacing, MOST

    def _loudness(self, state: Swept, at: tuple[int, ...]) -> Floats:
        """Of each entry of one run."""
        fit = smooth(*self._means(state, at), self.top)
        return loudness(fit, state.queue.rate[at])

    def _rest(self, heard: Floats, before: float) -> Queue:
        """What is to be run after a sweep in which the magnitudes ``heard`` stood out."""
        offsets = self.spacing * np.array(AROUND)
        around = [np.concatenate([c + offsets, -c - offsets[::-1]]) for c in heard]
        again = np.clip(np.concatenate([*around, []]), -self.top, self.top)
        rates = np.concatenate([again, [self._clear(w, heard) for w in self.leverage.rate]])
        holds = np.concatenate([np.full(len(again), 1.5 * self.dwell), self.leverage.time])
        return self._slots(rates, holds, before)

    def _clear(self, rate: float, heard: Floats) -> float:
        """The rate, or the next lower magnitude that is far enough from all suspects."""
        magnitude, away = abs(rate), _AWAY * self.spacing
        while magnitude > 0 and np.any(np.abs(heard - magnitude) < away):
            magnitude = max(magnitude - 0.5 * self.spacing, 0.0)
        return float(np.copysign(magnitude, rate))

    def _confirmed(self, state: Swept, at: tuple[int, ...]) -> list[BellFault]:
        """Local faults of one run."""
        if np.isnan(state.suspects[at]).all():
            return []
        means = self._means(state, at)
        fit, first, found = smooth(*means, self.top), len(self._sweep.rate), []
        for k, centre in enumerate(state.suspects[at]):
            part = slice(first + k * _EACH, first + (k + 1) * _EACH)
            repeated = replace(fit, left=fit.left[part], sd=fit.sd[part])
            if np.isfinite(centre) and loudness(repeated, state.queue.rate[at][part]).max() > self.confirm:
                found.append(fault(means[0], fit, float(centre), 2 * self.spacing))
        return found


def _visited(design: LadderDesign, time: float, acceleration: float, visits: int) -> Dwells:
    """A design in as many rounds as leave half of the time, at least, to dwell; in one in any case."""
    for count in range(visits, 1, -1):
        if 2 * Dwells(np.resize(design.rate, count + 1), np.zeros(count + 1)).slewing(acceleration).sum() < time:
            return dwells(design, time, acceleration, count)
    return dwells(design, time, acceleration, 1)
