r"""Rates of a scale-factor test by what they tell of the scale factor and of faults: one dwell ahead, or two.

    value = ln(sd(K) / sd'(K)) + I(fault),      rate by rate, over the seconds of dwell and slewing

Both are nats and are added. sd(K) is that of a line with bias, asymmetry and drift,

    residual = b + c x + a |x| + d t,    C' = C - C f f' C / (variance + f' C f)   after a dwell with the terms f,

until the demanded sd is there; I is the information about whether the error at a rate is out of its limits, of the
Gaussian process of `estimators.rate_table.greedy_information`: it depends on what was read, so no plan made beforehand
does the same. With two dwells ahead the way between them counts, and what is near the first tells little more. The test
is over once K is known as demanded and no dwell tells more than ``doubt`` of a fault.
"""

from __future__ import annotations

from typing import final

import numpy as np
from numpy.typing import NDArray

from estimators.common.horizon import Aim
from estimators.rate_table import rate_ladder_tally as tallies
from estimators.rate_table.greedy_information import GreedyInformation, Learnt
from estimators.rate_table.rate_ladder import GO, STOP
from insenv.core.errors import InputError
from insenv.core.estimate import Datasheet
from insenv.core.recording import Floats
from insenv.core.units import DEG_PER_HOUR, PPM

#: Deviation of the scale factor that is demanded.
DEMANDED = 10 * PPM
#: Prior deviations of bias [rad/s], scale factor, asymmetry, and drift in `_PERIOD` seconds [rad/s].
_PRIOR = np.array([100 * DEG_PER_HOUR, 5e-3, 1e-4, 20 * DEG_PER_HOUR])
_PERIOD = 1000.0
#: Longest dwell, in dwells: once all is searched the way between the ends costs less.
_LONG = (1.0, 4.0)
#: First dwells that are looked behind.
_FIRST = 12

Indices = NDArray[np.int64]


class _Ahead(GreedyInformation):
    """Base; settings as of `HorizonRateTable`."""

    def __init__(
        self,
        datasheet: Datasheet,
        demanded: float = DEMANDED,
        price: float = 0.0,
        doubt: float = 0.05,
        *,
        dwell: float = 2.5,
        settings: int = 250,
        top: float | None = None,
    ) -> None:
        if not doubt > 0:
            raise InputError(f"a doubt of {doubt:g} nat given; wanted more than zero")
        super().__init__(datasheet, settings, dwell, top=top)
        self.aim, self.doubt = Aim(demanded, price), doubt
        long = np.array(_LONG)[:, None] * np.ones(len(self.candidates))
        self._rate, self._hold = np.tile(self.candidates, len(_LONG)), dwell * long.ravel()

    def entry(self, state: Learnt) -> tuple[Floats, Floats, Floats]:
        """Rate [rad/s], time [s] and signal of the next entry, shape (...) each."""
        told = self.information(*self.process(state, self.candidates))
        fault = np.tile(np.where(told > self.doubt, told, 0.0), len(_LONG))
        C, late = self._line(state)
        now = np.take_along_axis(state.queue.rate, np.asarray(state.place.entry)[..., None], axis=-1)
        seconds = self._hold + np.abs(self._rate - now) / self.acceleration
        best, value = self._best(C, late, fault, seconds)
        enough = self.aim.reached(np.sqrt(C[..., 1, 1]), value) & np.all(fault == 0, axis=-1)
        rate = np.where(enough, 0.0, self._rate[best])
        return rate, np.where(enough, np.inf, self._hold[best]), np.where(enough, STOP, GO)

    def _best(self, C: Floats, late: Floats, fault: Floats, seconds: Floats) -> tuple[Indices, Floats]:
        """Which candidate, and its value by the second [nat/s], shape (...) each."""
        raise NotImplementedError

    def _line(self, state: Learnt) -> tuple[Floats, Floats]:
        """Covariance of bias, scale factor, asymmetry and drift, shape (..., 4, 4), and the last row's time [s]."""
        tally = state.tally
        known = tally.time > 0
        weight = np.where(known, 1 / np.where(known, tallies.variance(tally.time, self.datasheet, 0.0), 1.0), 0.0)
        x, t = np.where(known, tally.rate, 0.0), np.where(known, tally.middle, 0.0)
        F = _terms(x, t)
        # Entry by entry, so that a row of a batch is the run alone.
        M = np.einsum("...ni,...nj->...ij", F * weight[..., None], F) + np.diag(_PRIOR**-2.0)
        return np.linalg.inv(M), np.where(known, t + 0.5 * tally.time, 0.0).max(axis=-1)

    def _gain(self, C: Floats, late: Floats) -> tuple[Floats, Floats, Floats]:
        """What each candidate tells of K [nat], shape (..., c), and C f with the variance of what is read."""
        shape = (*C.shape[:-2], len(self._rate))
        t = np.broadcast_to(late[..., None], shape)
        f = _terms(np.broadcast_to(self._rate, shape), t)
        Cf = np.einsum("...ij,...cj->...ci", C, f)
        read = np.einsum("...ci,...ci->...c", Cf, f) + tallies.variance(self._hold, self.datasheet, 0.0)
        now = C[..., 1, 1][..., None]
        # The demanded deviation is enough: less tells nothing more.
        least = self.aim.demanded**2
        then = np.maximum(now - Cf[..., 1] ** 2 / read, np.minimum(least, now))
        return 0.5 * np.log(now / then), Cf, read


@final
class GreedyRateTable(_Ahead):
    """The dwell that tells most by the second; settings as of `HorizonRateTable`."""

    def _best(self, C: Floats, late: Floats, fault: Floats, seconds: Floats) -> tuple[Indices, Floats]:
        gain = (self._gain(C, late)[0] + fault) / seconds
        return np.asarray(gain.argmax(axis=-1)), np.asarray(gain.max(axis=-1))


@final
class HorizonRateTable(_Ahead):
    """The pair of dwells that tells most by the second.

    Parameters
    ----------
    datasheet : Datasheet
    demanded : float
        Standard deviation of the scale factor's relative error at which it is known well enough.
    price : float
        Least gain by the second [nat/s].
    doubt : float
        Information about a fault below which a dwell is not worth its time [nat].
    dwell : float
        [s]; a step of a second rounds it up, and `rate_line` takes no dwell below two.
    settings : int
        Dwells, at most.
    top : float, optional
        Largest rate [rad/s]; default: that of the published test, as far as the table has it.

    Raises
    ------
    InputError
        If one of them is out of range, or the table has not the rate.
    """

    def _best(self, C: Floats, late: Floats, fault: Floats, seconds: Floats) -> tuple[Indices, Floats]:
        told, Cf, read = self._gain(C, late)
        alone = (told + fault) / seconds
        first = np.argsort(-alone, axis=-1, kind="stable")[..., :_FIRST]
        value = np.empty(first.shape)
        for k in range(first.shape[-1]):
            at = first[..., k][..., None]
            one, v = (np.take_along_axis(a, at, axis=-1)[..., 0] for a in (told + fault, read))
            c = np.take_along_axis(Cf, at[..., None], axis=-2)[..., 0, :]
            then = C - c[..., :, None] * c[..., None, :] / v[..., None, None]
            two, _, _ = self._gain(then, late)
            rate = self._rate[at[..., 0]][..., None]
            near = np.exp(-(((np.abs(self._rate) - np.abs(rate)) / self.length) ** 2))
            way = self._hold + np.abs(self._rate - rate) / self.acceleration
            both = np.take_along_axis(seconds, at, axis=-1) + way
            value[..., k] = ((one[..., None] + two + fault * (1 - near)) / both).max(axis=-1)
        best = value.argmax(axis=-1)[..., None]
        return np.take_along_axis(first, best, axis=-1)[..., 0], value.max(axis=-1)


def _terms(x: Floats, t: Floats) -> Floats:
    """Bias, rate [rad/s], its magnitude and time, shape (..., 4)."""
    return np.stack([np.ones_like(x), x, np.abs(x), t / _PERIOD], axis=-1)
