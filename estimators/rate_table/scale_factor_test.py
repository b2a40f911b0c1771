"""The scale-factor test as a policy: at each rate so many whole turns one way, then as many back.

Turns are counted by the recorded angle, from when the table has got to its rate. With the last of them the run is
over. As a command lasts for a step the table turns a little further than it must, by up to a step, and the encoder's
noise is allowed for: whoever counts whole turns at a steady rate finds them all.

Source: Zhang, Wu and Wu, Opt. Precis. Eng. 19 (2011) 146, table 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from estimators.common.rate_policies import checked_rate
from estimators.common.turns import TURN, slack
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet, Estimate
from insenv.core.recording import Floats, Recording
from insenv.core.units import DEG

#: Rates of the published tests [rad/s].
PUBLISHED_RATES = tuple(rate * DEG for rate in (10, 10, 20, 20, 30, 30, 60, 100))


@dataclass(frozen=True)
class TestProgress:
    """How far a test is; each of shape (...).

    Attributes
    ----------
    dwell : ndarray of int
        Which dwell is under way; two for each rate.
    steady : ndarray
        When the table has its rate [s].
    origin : ndarray
        Angle at which it had it [rad]; NaN: not yet.
    """

    dwell: NDArray[np.int64]
    steady: Floats
    origin: Floats


@final
class ScaleFactorTest:
    """Whole turns at each rate, one way and back.

    Parameters
    ----------
    datasheet : Datasheet
    rates : sequence of float
        Of the tests [rad/s]; a negative one begins clockwise.
    turns : int
        Each way.

    Raises
    ------
    InputError
        If there is no rate, one is zero or more than the table has, or no turn is asked for.
    """

    def __init__(self, datasheet: Datasheet, rates: Sequence[float] = PUBLISHED_RATES, turns: int = 20) -> None:
        if not len(rates) or not all(abs(rate) > 0 for rate in rates):
            raise InputError(
                f"scale_factor_test: rates {[rate / DEG for rate in rates]} deg/s given, wanted some, not 0"
            )
        if turns < 1:
            raise InputError(f"scale_factor_test: {turns} turns given, wanted one or more")
        both = [way * checked_rate(datasheet, rate) for rate in rates for way in (1.0, -1.0)]
        #: Commanded one after the other, at rest in the end.
        self.commands = np.array([*both, 0.0])
        self.angle = turns * TURN + slack(datasheet)
        self.half_sample = 0.5 * datasheet.dt
        self.settling = np.abs(np.diff(self.commands, prepend=0.0)) / datasheet.limits.acceleration

    def reset(self, batch: int | None = None) -> TestProgress:
        """The first dwell, not yet begun."""
        front = () if batch is None else (batch,)
        return TestProgress(np.zeros(front, np.int64), np.full(front, self.settling[0]), np.full(front, np.nan))

    def act(
        self, state: TestProgress, chunk: Recording | None, estimate: Estimate | None = None
    ) -> tuple[Floats, TestProgress]:
        """Rate of the dwell that is under way and whether all are done, shape (..., 2)."""
        if chunk is not None and len(chunk):
            state = self._after(state, np.asarray(chunk.t, float), chunk.values("table_angle", "rad"))
        over = state.dwell >= len(self.commands) - 1
        return np.stack([self.commands[state.dwell], over.astype(float)], axis=-1), state

    def _after(self, state: TestProgress, t: Floats, angle: Floats) -> TestProgress:
        """After rows at the times t, shape (n,), with the table's angles, shape (..., n)."""
        angle = np.broadcast_to(angle, (*state.dwell.shape, len(t)))
        there = t >= state.steady[..., None] - self.half_sample
        first = np.take_along_axis(angle, there.argmax(axis=-1)[..., None], axis=-1)[..., 0]
        origin = np.where(np.isnan(state.origin) & there.any(axis=-1), first, state.origin)
        state = replace(state, origin=origin)
        done = np.abs(angle[..., -1] - origin) >= self.angle  # not where the origin is not known
        dwell = np.minimum(state.dwell + done, len(self.commands) - 1)
        steady = np.where(done, t[-1] + self.settling[dwell], state.steady)
        return TestProgress(dwell, steady, np.where(done, np.nan, origin))
