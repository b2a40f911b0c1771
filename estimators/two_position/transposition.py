r"""When to turn, by how much, and when to stop: policies of the two-position calibration.

An action is (turn angle [half turns, counter-clockwise], stop), shape (..., 2). With sigma(t1, t2) the deviation of the
installation angle's inertial part after a rest of t1, a turn of tau and a rest of t2, and t2(t1) the least rest with
sigma <= demanded,

    the end is at  F(t1) = t1 + tau + t2(t1):   turn as soon as  F(t1 + 1 s) >= F(t1),

that is, once another second here shortens the rest after the turn by less than a second. sigma is the Cramer-Rao bound
of `insenv.information.alignment`, the turn's velocities left out; it depends on no data, so the plan is made at once.
The end is told by the estimator's covariance if there is one, else by the plan.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from estimators.two_position.alignment_told import Told
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import ARCMIN, DEG
from insenv.information.alignment import AlignedUnit, Knowledge, Stretch, after, bound, last, procedure, unknowing

#: The published procedure: rests [s] and turn [rad]; and how long it takes where no limit of the vehicle is known [s].
PUBLISHED_REST, PUBLISHED_TURN, PUBLISHED_TURN_S = 300.0, 170 * DEG, 20.0
#: 3 sigma below one minute of arc.
DEMANDED = ARCMIN / 3
#: Deviation of `estimators.two_position.tied` over the bound at long rests: its noise counts for so much more.
TIED_PRICE = 1.2
#: Longest plan where the datasheet sets no time [s].
_LONGEST = 3600.0


@dataclass(frozen=True)
class Going:
    """Where the runs stand; shape (...), each.

    Attributes
    ----------
    rests : ndarray of int
        Turns that are over.
    began : ndarray
        Time at which the present rest began [s].
    asked, moving : ndarray of bool
        Whether a turn was asked for and is not over; whether it was seen to go on.
    """

    rests: NDArray[np.int64]
    began: Floats
    asked: NDArray[np.bool_]
    moving: NDArray[np.bool_]


class Transposition:
    """Base: keeps count of rests and turns.

    Parameters
    ----------
    datasheet : Datasheet
    turns : sequence of float
        Angles, counter-clockwise [rad].
    """

    def __init__(self, datasheet: Datasheet, turns: Sequence[float]) -> None:
        self.datasheet, self.turns = datasheet, np.array([*turns, 0.0])
        self.slack = 0.5 * datasheet.dt

    def reset(self, batch: int | None = None) -> Going:
        """At rest."""
        shape = () if batch is None else (batch,)
        no = np.zeros(shape, bool)
        return Going(np.zeros(shape, np.int64), np.zeros(shape), no, no)

    def act(self, state: Going, chunk: Recording | None, estimate: Estimate | None = None) -> tuple[Floats, Going]:
        """Turn and stop of every run, shape (..., 2)."""
        state, t = seen(state, chunk, self.datasheet.dt)
        rest = np.where(state.asked, -1.0, t - state.began + self.slack)
        final = state.rests >= len(self.turns) - 1
        turn = ~state.asked & ~final & (rest >= self.rest(state.rests))
        stop = ~state.asked & final & self.done(rest, estimate)
        angle = self.turns[np.minimum(state.rests, len(self.turns) - 1)] / np.pi
        action = np.stack([np.where(turn, angle, 0.0), stop], axis=-1)
        return action, replace(state, asked=state.asked | turn)

    def rest(self, rests: NDArray[np.int64]) -> Floats:
        """How long to rest before the next turn [s]."""
        raise NotImplementedError

    def done(self, rest: Floats, estimate: Estimate | None) -> NDArray[np.bool_]:
        """Whether to stop after so long in the last rest."""
        raise NotImplementedError


class PublishedSchedule(Transposition):
    """300 s, a turn by 170 degrees, 300 s: Guo, Li, He (2018)."""

    def __init__(self, datasheet: Datasheet, rest: float = PUBLISHED_REST, turn: float = PUBLISHED_TURN) -> None:
        super().__init__(datasheet, [turn])
        self.length = rest

    def rest(self, rests: NDArray[np.int64]) -> Floats:
        """The same for all."""
        return np.full(np.shape(rests), self.length)

    def done(self, rest: Floats, estimate: Estimate | None) -> NDArray[np.bool_]:
        """When the time is over."""
        return np.asarray(rest >= self.length)


class _Planned(Transposition):
    """By the bound: parameters as of `CovarianceTriggered`."""

    price = 1.0

    def __init__(self, datasheet: Datasheet, turns: Sequence[float], demanded: float) -> None:
        if not demanded > 0:
            raise InputError(f"a deviation of {demanded:g} rad was demanded; wanted more than zero")
        super().__init__(datasheet, turns)
        self.demanded, self.told = demanded, Told.of(datasheet)
        self.turn_s = turn_time(datasheet, abs(turns[0]))

    @cached_property
    def instrument(self) -> AlignedUnit:
        """As the bound takes it, with the noise that the estimator makes of it."""
        return instrument(self.told, self.price)

    @property
    def budget(self) -> float:
        """Time that there is for rests [s]."""
        total = self.datasheet.duration if 0 < self.datasheet.duration < np.inf else _LONGEST
        return max(total - (len(self.turns) - 1) * self.turn_s, 2.0)

    def inertial(self, estimate: Estimate) -> Floats:
        """Deviation of the installation angle without the sight's error [rad]."""
        # The heading is known as well as the installation angle, but for the sight.
        return np.asarray(estimate.of("heading")[1])

    def done(self, rest: Floats, estimate: Estimate | None) -> NDArray[np.bool_]:
        """When the demanded deviation is reached."""
        if estimate is None:
            return np.asarray(rest >= self.last_rest)
        return np.asarray((self.inertial(estimate) <= self.demanded) & (rest > 1.0))

    @property
    def last_rest(self) -> float:
        """Length of the last rest by the plan [s]."""
        raise NotImplementedError


class CovarianceTriggered(_Planned):
    """One turn, as soon as another second here gains less than it would.

    Parameters
    ----------
    datasheet : Datasheet
    demanded : float
        Deviation of the installation angle's inertial part [rad].
    turn : float
        [rad]
    price : float
        Deviation of the estimator over the bound.

    Raises
    ------
    InputError
        Without a latitude, or if nothing positive is demanded.
    """

    def __init__(
        self, datasheet: Datasheet, demanded: float = DEMANDED, turn: float = np.pi, price: float = TIED_PRICE
    ) -> None:
        super().__init__(datasheet, [turn], demanded)
        self.price = price

    def rest(self, rests: NDArray[np.int64]) -> Floats:
        """Until the trigger."""
        return np.full(np.shape(rests), self.plan[0])

    @property
    def last_rest(self) -> float:
        """After the turn."""
        return self.plan[1]

    @cached_property
    def plan(self) -> tuple[float, float]:
        """Rests before and after the turn [s]; halves of the time if that is not enough."""
        rests = [unknowing(self.instrument), *after(self.instrument, unknowing(self.instrument), Stretch(self.budget))]

        def end(first: int) -> float:
            return first + self._needed(rests[first], self.budget - first)

        low, high = 1, max(int(self.budget) - 1, 2)
        while high - low > 1:
            middle = (low + high) // 2
            now, later = end(middle), end(min(middle + 1, len(rests) - 1))
            if not np.isfinite(now):  # too early, or too late for both
                low, high = (middle, high) if middle < 0.5 * self.budget else (low, middle)
            elif later >= now:
                high = middle
            else:
                low = middle
        found = end(high) - high
        return (float(high), found) if np.isfinite(found) else (0.5 * self.budget, 0.5 * self.budget)

    def _needed(self, known: Knowledge, left: float) -> float:
        """Rest after a turn now until the demanded deviation [s]; infinite if there is not time enough."""
        turned = last(after(self.instrument, known, Stretch(self.turn_s, float(self.turns[0]))), known)
        return _until(self.instrument, turned, self.demanded, left)


class ThreeRests(_Planned):
    """0, 180, 0 degrees in equal thirds; parameters as of `CovarianceTriggered`, for the joint estimator."""

    def __init__(self, datasheet: Datasheet, demanded: float = DEMANDED, price: float = 1.0) -> None:
        super().__init__(datasheet, [np.pi, -np.pi], demanded)
        self.price = price

    def rest(self, rests: NDArray[np.int64]) -> Floats:
        """A third."""
        return np.full(np.shape(rests), self.third)

    @property
    def last_rest(self) -> float:
        """A third."""
        return self.third

    @cached_property
    def third(self) -> float:
        """Length of each rest [s]: whole seconds; a third of the time if that is not enough."""
        low, high = 1, max(int(self.budget / 3), 2)
        if self._sd(high) > self.demanded:
            return self.budget / 3
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if self._sd(middle) <= self.demanded else (middle, high)
        return float(high)

    def _sd(self, rest: float) -> float:
        stretches = procedure(rest, self.turns[:-1].tolist(), self.turn_s)
        return bound(self.instrument, stretches, turning_data=False).installation


def turn_time(datasheet: Datasheet, angle: float) -> float:
    """Time that the vehicle needs for a turn [s]: a trapezoid, or a triangle, of its rate."""
    rate, acceleration = datasheet.limits.rate, datasheet.limits.acceleration
    if not np.isfinite(rate) and not np.isfinite(acceleration):
        return PUBLISHED_TURN_S
    if not np.isfinite(acceleration):
        return angle / rate
    if rate**2 >= angle * acceleration:
        return float(2 * np.sqrt(angle / acceleration))
    return float(angle / rate + rate / acceleration)


def instrument(told: Told, price: float = 1.0) -> AlignedUnit:
    """What the bound needs, with noise that is ``price`` times as large."""
    cov, sd = told.prior(np.zeros(())), told.sd
    phi = np.sqrt(np.diagonal(cov)[:3])
    return AlignedUnit(
        told.latitude,
        price * told.walk,
        price * told.velocity_walk,
        (float(phi[0]), float(phi[1]), float(phi[2])),
        (float(sd[0]), float(sd[1]), float(sd[2])),
        (float(sd[3]), float(sd[4])),
        told.altitude,
    )


def _until(known_by: AlignedUnit, known: Knowledge, demanded: float, left: float) -> float:
    """Time at rest until a deviation is reached [s], between steps by interpolation of its logarithm."""
    before, start = known, known.time
    if before.installation <= demanded:
        return 0.0
    for now in after(known_by, known, Stretch(max(left, 0.0))):
        if now.installation <= demanded:
            a, b = np.log(before.installation), np.log(now.installation)
            return float(before.time - start + (now.time - before.time) * (a - np.log(demanded)) / (a - b))
        before = now
    return np.inf


def seen(state: Going, chunk: Recording | None, dt: float) -> tuple[Going, float]:
    """State after a chunk, and the time."""
    if chunk is None or not len(chunk):
        return state, 0.0
    turning = np.broadcast_to(chunk.values("turning", "1"), (*np.shape(state.asked), len(chunk))) != 0
    t, now, some = float(chunk.t[-1]), turning[..., -1], turning.any(axis=-1)
    over = ~now & (some | state.moving)
    # A turn that ended with the chunk before: the rest began with this one.
    ends = np.where(some, chunk.t[len(chunk) - 1 - np.argmax(turning[..., ::-1], axis=-1)], chunk.t[0] - dt)
    return Going(
        state.rests + over,
        np.where(over, ends, state.began),
        (state.asked | now) & ~over,
        now,
    ), t
