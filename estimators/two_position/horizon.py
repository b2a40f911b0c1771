r"""Rests and turns of the two-position calibration by what they are expected to tell: greedy, or a receding horizon.

At rest, every few seconds, plans are compared that begin with what is known now
(`estimators.two_position.rests_ahead`):

    rest r1, turn by theta, rest r2, turn back, rest until sigma <= demanded,     at most ``turns`` turns to come.

The plan that gets there first is taken, or the one that ends with the least sigma where none gets there in the time
that is left; a turn is begun if it is due now, and the choice is made anew after the next seconds. sigma is the
Cramer-Rao bound of the inertial part of the installation angle, with the noise of the datasheet: it does not depend on
what is read. So on the datasheet's own terms all could be planned beforehand; what closes the loop is what was done,
which enters as it was done (a vehicle that turns more slowly), and the end, which the estimator's covariance tells:
where it is not there yet when the plan is over, the rest of the time is planned for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import final

import numpy as np
from numpy.typing import NDArray

from estimators.common import horizon
from estimators.common.horizon import Aim
from estimators.two_position import rests_ahead
from estimators.two_position.alignment_told import Told
from estimators.two_position.rests_ahead import RestModel, Turned
from estimators.two_position.transposition import DEMANDED, Going, instrument, seen, turn_time
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import DEG
from insenv.information.alignment import unknowing

#: Turns that are tried [rad]; which sense does not matter.
TURNS = (180 * DEG, 150 * DEG)
#: Time between two decisions at rest [s].
PIECE = 5.0
#: Lengths of rests that are tried: from now on, and after a turn [s].
NOW = (0.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 90.0, 130.0, 180.0)
THEN = (10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 80.0, 110.0, 150.0, 200.0)
#: No rest is shorter than this [s]: a vehicle has to settle, and an estimator fits a polynomial to each rest.
LEAST_REST = 20.0
#: Turns of a run that are remembered.
MOST = 12
#: Longest run where the datasheet sets no time [s].
_LONGEST = 3600.0
#: A plan that gets there is better than any that does not: longer than any time [s].
_NEVER = 1e9

#: A run so far: rest before each turn [s], angle of the turn [rad], time of the turn [s].
History = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class RunsAhead:
    """Where the runs stand; the batch in front.

    Attributes
    ----------
    going : Going
    length, angle, took : ndarray, shape (..., MOST)
        Rest before each turn [s], the turn [rad], and its time [s].
    next : ndarray, shape (...)
        Time of the next decision [s].
    enough : ndarray of bool, shape (...)
        Whether the best gain is below the price of a second.
    """

    going: Going
    length: Floats
    angle: Floats
    took: Floats
    next: Floats
    enough: NDArray[np.bool_]


class _Ahead:
    """Base; settings as of `HorizonTwoPosition`."""

    def __init__(
        self,
        datasheet: Datasheet,
        demanded: float = DEMANDED,
        price: float = 0.0,
        angles: Sequence[float] = TURNS,
        turns: int = 2,
        noise: float = 1.0,
    ) -> None:
        if not angles or not all(0 < angle <= np.pi for angle in angles) or not 1 <= turns <= 3:
            raise InputError(
                f"{len(angles)} turns of up to {max(angles, default=0.0) / DEG:g} deg and {turns} of them ahead given; "
                "wanted one or more above zero and up to 180 deg, and one to three ahead"
            )
        self.datasheet, self.aim, self.angles, self.turns = datasheet, Aim(demanded, price), tuple(angles), turns
        self.instrument = instrument(Told.of(datasheet), noise)
        self.budget = datasheet.duration if 0 < datasheet.duration < np.inf else _LONGEST
        # What runs have in common is worked out once: mostly all of them have done the same.
        self._chosen = lru_cache(maxsize=4096)(self._choice)
        self._after = lru_cache(maxsize=4096)(self._known)
        self._place = lru_cache(maxsize=64)(self._placed)
        self._turns = lru_cache(maxsize=64)(self._turned)

    def reset(self, batch: int | None = None) -> RunsAhead:
        """At rest."""
        shape = () if batch is None else (batch,)
        no, zero, none = np.zeros(shape, bool), np.zeros(shape), np.zeros((*shape, MOST))
        going = Going(np.zeros(shape, np.int64), zero, no, no)
        return RunsAhead(going, none, none, none, zero, no)

    def act(
        self, state: RunsAhead, chunk: Recording | None, estimate: Estimate | None = None
    ) -> tuple[Floats, RunsAhead]:
        """Turn [half turns] and stop of every run, shape (..., 2)."""
        before = state.going
        going, t = seen(before, chunk, self.datasheet.dt)
        state = self._timed(replace(state, going=going), before)
        rest = t - going.began
        due = ~going.asked & (state.next <= t + 0.5 * self.datasheet.dt)
        new = {name: np.array(getattr(state, name)) for name in ("length", "angle", "next", "enough")}
        asked, turn = np.array(going.asked), np.zeros(np.shape(rest))
        for at in zip(*np.nonzero(due), strict=True) if due.ndim else ((),) * int(due):
            history = self._history(state, at)
            angle, wait, best = self._chosen(history, round(float(rest[at]), 2), round(self.budget - t, 2))
            new["next"][at], new["enough"][at] = t + wait, best < self.aim.price
            if angle and len(history) < MOST:
                turn[at], asked[at] = angle / np.pi, True
                new["length"][at][len(history)], new["angle"][at][len(history)] = rest[at], angle
        stop = ~asked & (rest > 1.0) & (self._reached(state, estimate, rest) | new["enough"])
        state = replace(state, going=replace(going, asked=asked), **new)
        return np.stack([turn, stop.astype(float)], axis=-1), state

    def _timed(self, state: RunsAhead, before: Going) -> RunsAhead:
        """With the time of the turns that have ended."""
        ended = state.going.rests > before.rests
        if not np.any(ended):
            return state
        k = np.minimum(before.rests, MOST - 1)[..., None]
        asked = before.began + np.take_along_axis(state.length, k, axis=-1)[..., 0]
        took, old = state.took.copy(), np.take_along_axis(state.took, k, axis=-1)[..., 0]
        np.put_along_axis(took, k, np.where(ended, state.going.began - asked, old)[..., None], axis=-1)
        return replace(state, took=took)

    def _reached(self, state: RunsAhead, estimate: Estimate | None, rest: Floats) -> NDArray[np.bool_]:
        """Whether the demanded deviation is there: told, or by the bound where nothing is told."""
        if estimate is not None and "heading" in estimate.names:
            # The heading is known as well as the installation angle, but for the sight.
            return self.aim.reached(np.asarray(estimate.of("heading")[1]))
        bound = np.full(np.shape(rest), np.inf)
        for at in np.ndindex(np.shape(rest)):
            if not state.going.asked[at]:
                bound[at] = np.sqrt(self._after(self._history(state, at), round(float(rest[at]), 2))[-1, -1])
        return self.aim.reached(bound)

    def _history(self, state: RunsAhead, at: tuple[int, ...]) -> History:
        """Of one run, to a hundredth of a second, so that what is the same is the same."""
        return tuple(
            (round(float(a), 2), float(b), round(float(c), 2))
            for a, b, c in np.stack([state.length[at], state.angle[at], state.took[at]], axis=-1)[
                : int(state.going.rests[at])
            ]
        )

    def _known(self, history: History, rest: float) -> Floats:
        """Covariance after a history and so much of a rest, shape (9, 9)."""
        heading = _heading(history)
        if rest >= 1.0:
            # In pieces, which are remembered: so a run costs each second once.
            whole = float(int(rest))
            behind = whole - PIECE if whole > PIECE else 0.0
            return rests_ahead.rested(self._after(history, behind), self._place(heading), whole - behind)
        if not history:
            return np.ascontiguousarray(unknowing(self.instrument).cov[np.ix_(rests_ahead.STATES, rests_ahead.STATES)])
        length, angle, took = history[-1]
        cov = self._after(history[:-1], length)
        moved = rests_ahead.turned(self.instrument, heading + angle, angle, took)
        return np.asarray(moved.F @ cov @ moved.F.T + moved.Q)

    def _choice(self, history: History, rest: float, left: float) -> tuple[float, float, float]:
        """Turn to begin now [rad] (0: none), time until the next decision [s], and gain by the second [nat/s]."""
        cov = self._after(history, rest)
        now, heading = np.sqrt(cov[-1, -1]), _heading(history)
        sign = -1.0 if history and history[-1][1] > 0 else 1.0
        options = []
        for angle in self.angles:
            seconds, there = turn_time(self.datasheet, angle), heading - sign * angle
            plans = self._plans(left, seconds)
            turning = np.isfinite(plans[:, 1])
            plans[turning, 0] = np.maximum(plans[turning, 0], LEAST_REST - rest)
            found = np.empty((len(plans), 3))
            turns = self._turns(heading, sign * angle, seconds), self._turns(there, -sign * angle, seconds)
            rests_ahead.look(cov, plans, (self._place(heading), self._place(there)), turns, self.aim.demanded, found)
            k, value = self._best(found, float(now))
            gained = float(np.log(now / found[k, 2]) / max(float(found[k, 1]), 1.0))
            first = sign * angle if np.isfinite(plans[k, 1]) else 0.0
            options.append((value, first, float(plans[k, 0]), gained))
        # Of equal ones the first angle that was asked for.
        _, angle, wait, gained = min(options, key=lambda option: option[0])
        if angle and wait <= 0:
            return angle, 0.0, gained
        return 0.0, min(wait, PIECE) if angle else PIECE, gained

    def _placed(self, heading: float) -> RestModel:
        return rests_ahead.place(self.instrument, heading)

    def _turned(self, heading: float, angle: float, seconds: float) -> Turned:
        return rests_ahead.turned(self.instrument, heading, angle, seconds)

    def _plans(self, left: float, turn_s: float) -> Floats:
        """Rests of the plans, shape (S, turns + 1)."""
        raise NotImplementedError

    def _best(self, found: Floats, now: float) -> tuple[int, float]:
        """The plan to take, and what it is worth: less is better."""
        raise NotImplementedError


@final
class HorizonTwoPosition(_Ahead):
    """The plan that gets first to the demanded deviation.

    Parameters
    ----------
    datasheet : Datasheet
    demanded : float
        Deviation of the inertial part of the installation angle at which to stop [rad]; 0: none.
    price : float
        Least gain by the second [nat/s].
    angles : sequence of float
        Turns that are tried, there and back [rad].
    turns : int
        Turns that a plan may have.
    noise : float
        Deviation of the estimator over the bound.

    Raises
    ------
    InputError
        Without a latitude, or with a setting out of range.
    """

    def _plans(self, left: float, turn_s: float) -> Floats:
        rows = [[left, *[np.nan] * self.turns]]
        for turns in range(1, self.turns + 1):
            for rests in product(NOW, *[THEN] * (turns - 1)):
                last = left - sum(rests) - turns * turn_s
                if last >= 2.0:
                    rows.append([*rests, last, *[np.nan] * (self.turns - turns)])
        return np.array(rows)

    def _best(self, found: Floats, now: float) -> tuple[int, float]:
        if np.isfinite(found[:, 0]).any():
            k = int(found[:, 0].argmin())
            return k, float(found[k, 0]) - _NEVER
        k = int(found[:, 2].argmin())
        return k, float(found[k, 2])


@final
class GreedyTwoPosition(_Ahead):
    """A rest from now on, or a turn now and a rest after it: whichever gains most by the second; settings as above."""

    def _plans(self, left: float, turn_s: float) -> Floats:
        rows = [[max(left, 1.0), np.nan], *([rest, np.nan] for rest in (PIECE, *THEN) if rest < left)]
        rows += [[0.0, rest] for rest in THEN if rest + turn_s <= left]
        return np.array(rows)

    def _best(self, found: Floats, now: float) -> tuple[int, float]:
        rate = horizon.gain(np.array(now), found[:, 2], np.maximum(found[:, 1], 1.0))
        k = int(rate.argmax())
        return k, -float(rate[k])


def _heading(history: History) -> float:
    """After the turns of a run, from that at its start [rad]."""
    return -sum(angle for _, angle, _ in history)
